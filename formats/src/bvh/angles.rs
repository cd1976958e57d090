//! Converts quaternions to Euler angles about rotating axes, continuous from frame to frame.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DQuat;

/// The bound of gimbal lock: the sine of half the middle angle's distance from it, times √2. Within this bound the
/// first and the last angle are noise of an f32 quaternion, which changes either by up to a radian. Choosing one of
/// them freely changes the rotation by 3e-7 rad or less.
const LOCKED: f64 = 1e-7;

/// The Euler angles in radians about `axes` (three different ones, each rotated by those before) of a rotation,
/// nearest to the angles of the frame before.
///
/// From Bernardes and Viollet, *Quaternion to Euler angles conversion: a direct, general and computationally
/// efficient method* (2022): the sum and the difference of the first and the last angle are the angles of two complex
/// numbers. One of these numbers vanishes in gimbal lock, and the other stays exact.
pub(super) fn nearest(q: DQuat, axes: [usize; 3], before: [f64; 3]) -> [f64; 3] {
    let [first, middle, last] = axes;
    let v = [q.x, q.y, q.z];
    let sign = if (first + 1) % 3 == middle { -1.0 } else { 1.0 };
    let (a, b) = (q.w - v[middle], v[last] + v[first] * sign);
    let (c, d) = (v[middle] + q.w, v[first] * sign - v[last]);
    let (sum_size, difference_size) = (libm::hypot(a, b), libm::hypot(c, d));
    let second = 2.0 * libm::atan2(difference_size, sum_size) - FRAC_PI_2;
    let [sum_before, difference_before] =
        [1.0, -1.0].map(|part| (sign * before[0] + part * before[2]) / 2.0);
    let half_sum = match sum_size < LOCKED {
        true => sum_before,
        false => libm::atan2(b, a),
    };
    let half_difference = match difference_size < LOCKED {
        true => difference_before,
        false => libm::atan2(d, c),
    };
    let angles = [
        sign * (half_sum + half_difference),
        second,
        half_sum - half_difference,
    ];
    // Rotating by half a turn about both outer axes cancels the mirrored middle angle.
    let other = [angles[0] + PI, PI - second, angles[2] + PI];
    let [angles, other] = [angles, other].map(|angles| {
        let circles = |i: usize| ((angles[i] - before[i]) / TAU).round();
        [0, 1, 2].map(|i| angles[i] - TAU * circles(i))
    });
    let distance = |angles: [f64; 3]| -> f64 {
        (0..3)
            .map(|i| (angles[i] - before[i]) * (angles[i] - before[i]))
            .sum()
    };
    if distance(other) < distance(angles) {
        other
    } else {
        angles
    }
}

#[cfg(test)]
mod tests {
    use glam::EulerRot;

    use super::*;

    const ORDERS: [([usize; 3], EulerRot); 6] = [
        ([0, 1, 2], EulerRot::XYZ),
        ([0, 2, 1], EulerRot::XZY),
        ([1, 0, 2], EulerRot::YXZ),
        ([1, 2, 0], EulerRot::YZX),
        ([2, 0, 1], EulerRot::ZXY),
        ([2, 1, 0], EulerRot::ZYX),
    ];

    #[test]
    fn angles_put_together_are_the_rotation_and_follow_those_before() {
        for (axes, order) in ORDERS {
            let mut before = [0.3, -0.2, 0.1];
            for step in 0..20_000 {
                let t = f64::from(step) * 1e-3;
                // The middle angle passes through both gimbal locks, and stays in one of them for some time.
                let middle = (3.0 * t.sin()).clamp(-FRAC_PI_2, 2.5);
                let expected = [0.3 + 2.0 * t, middle, 0.1 - 1.3 * t];
                let q = DQuat::from_euler(order, expected[0], expected[1], expected[2]);
                let found = nearest(q.as_quat().as_dquat().normalize(), axes, before);
                let made = DQuat::from_euler(order, found[0], found[1], found[2]);
                let off = 2.0 * (made * q.conjugate()).xyz().length();
                assert!(off < 6e-7, "{order:?} {step}: {found:?}, {off:e}");
                for i in 0..3 {
                    assert!((found[i] - before[i]).abs() <= PI + 1e-12);
                }
                before = found;
            }
        }
    }

    #[test]
    fn in_gimbal_lock_both_outer_angles_move_alike() {
        for (axes, order) in ORDERS {
            for middle in [FRAC_PI_2, -FRAC_PI_2] {
                let q = DQuat::from_euler(order, 0.5, middle, 0.25);
                let found = nearest(q, axes, [0.4, middle, 0.35]);
                let expected = DQuat::from_euler(order, found[0], found[1], found[2]);
                assert!(expected.dot(q).abs() > 1.0 - 1e-14, "{order:?}: {found:?}");
                // In gimbal lock only the sum (or difference) of the outer angles is determined, so each moves by half
                // of the change.
                let moved = (found[0] - 0.4).abs().max((found[2] - 0.35).abs());
                assert!(moved <= 0.1 + 1e-7, "{order:?}, {middle}: {found:?}");
            }
        }
    }
}
