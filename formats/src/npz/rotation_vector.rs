//! Rotation vectors: their direction is the axis, and their length is the angle in radians. A component may be any
//! number; an angle above π is one that the motion reached without a jump.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3, Quat};

/// Number of terms of the series for angles up to 2π. The first omitted term is below 2e-12, a ten-thousandth of an
/// f32 step.
const TERMS: usize = 12;

/// Number of terms for angles up to π/2, which most joints have. The first omitted term is below 5e-13.
const SHORT_TERMS: usize = 7;

/// The coefficients of cos √t and sin √t / √t, in pairs, so that one vector of two serves both: 1/(2k)! and 1/(2k +
/// 1)!, with alternating signs.
const COEFFICIENTS: [[f64; 2]; TERMS] = {
    let mut list = [[1.0; 2]; TERMS];
    let mut k = 1;
    while k < TERMS {
        let n = (2 * k) as f64;
        let [cos, sinc] = list[k - 1];
        list[k] = [-cos / (n * (n - 1.0)), -sinc / (n * (n + 1.0))];
        k += 1;
    }
    list
};

/// The unit quaternion of a rotation vector: (v sin(θ/2)/θ, cos(θ/2)), θ = |v|. Both functions are
/// power series in θ², so that no root, no division and no case of small angles is needed.
#[inline(always)]
pub(crate) fn exp(vector: [f64; 3]) -> DQuat {
    let [x, y, z] = vector;
    let squared = (x * x + y * y + z * z) * 0.25;
    let series = |coefficients: &[[f64; 2]]| {
        let terms = coefficients.iter().rev();
        terms.fold([0.0; 2], |[cos, sinc], next| {
            [cos * squared + next[0], sinc * squared + next[1]]
        })
    };
    let [cos, sinc] = if squared <= PI * PI / 16.0 {
        series(&COEFFICIENTS[..SHORT_TERMS])
    } else if squared <= PI * PI {
        series(&COEFFICIENTS)
    } else {
        let half = squared.sqrt();
        let (sin, cos) = (libm::sin(half), libm::cos(half));
        [cos, sin / half]
    };
    let half_sinc = 0.5 * sinc;
    DQuat::from_xyzw(x * half_sinc, y * half_sinc, z * half_sinc, cos)
}

/// The rotation vector of a unit quaternion that is nearest to the one before it. Without one before it, the sign of
/// the quaternion decides: the angle is above π if w < 0.
pub(crate) fn log(rotation: Quat, before: Option<DVec3>) -> DVec3 {
    log_of(rotation.as_dquat(), before)
}

/// As [`log`], of a quaternion in f64.
pub(crate) fn log_of(q: DQuat, before: Option<DVec3>) -> DVec3 {
    let (axis, w) = (DVec3::new(q.x, q.y, q.z), q.w);
    let sin = libm::sqrt(axis.x * axis.x + axis.y * axis.y + axis.z * axis.z);
    let angle = 2.0 * libm::atan2(sin, w);
    let near = before.unwrap_or(DVec3::ZERO);
    // With a smaller sine, f32 does not determine the axis.
    if sin < 1e-12 {
        let length = near.length();
        let direction = if length > 0.0 {
            near / length
        } else {
            DVec3::ZERO
        };
        return direction * ((length / TAU).round() * TAU);
    }
    let axis = axis / sin;
    match before {
        None => axis * angle,
        Some(before) => axis * (angle + ((before.dot(axis) - angle) / TAU).round() * TAU),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternions_are_those_of_sine_and_cosine() {
        for step in 0..2000 {
            let angle = f64::from(step) * 0.01;
            let vector = DVec3::new(0.6, -0.48, 0.64) * angle;
            let found = exp(vector.to_array());
            let (sin, cos) = (libm::sin(angle / 2.0), libm::cos(angle / 2.0));
            let expected = [0.6 * sin, -0.48 * sin, 0.64 * sin, cos];
            for (found, expected) in found.to_array().into_iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 2e-12,
                    "{angle}: {found} {expected}"
                );
            }
        }
        assert_eq!(exp([0.0; 3]), DQuat::IDENTITY);
    }

    #[test]
    fn a_turn_of_many_circles_is_a_straight_line_of_vectors() {
        let axis = DVec3::new(0.0, 0.8, -0.6);
        let (mut before, mut sign) = (None, 1.0f32);
        let mut last = Quat::IDENTITY;
        for step in 0..200 {
            let vector = axis * (f64::from(step) * 0.1);
            let mut rotation = exp(vector.to_array()).as_quat();
            if rotation.dot(last) * sign < 0.0 {
                sign = -sign;
            }
            rotation *= sign;
            last = rotation;
            let found = log(rotation, before);
            assert!((found - vector).length() < 1e-6, "{vector}: {found}");
            before = Some(found);
        }
    }

    #[test]
    fn the_sign_decides_of_the_first_vector() {
        let rotation = Quat::from_rotation_x(3.0);
        assert!((log(rotation, None).x - 3.0).abs() < 1e-6);
        assert!((log(-rotation, None).x - (3.0 - TAU)).abs() < 1e-6);
        assert_eq!(log(Quat::IDENTITY, None), DVec3::ZERO);
        assert_eq!(log(-Quat::IDENTITY, Some(DVec3::X * 6.0)).x, TAU);
    }
}
