//! f64 arithmetic that reaches a kernel, the same on every machine.
//!
//! The platform's sine differs from libm to libm; ours is the `libm` crate's.
//! Everything a kernel reads passes through [`canonical`], so that no driver
//! ever meets a subnormal.

use glam::{DQuat, DVec3, Quat};

/// Components below this magnitude are stored as +0, in inputs and in outputs:
/// drivers may flush subnormals, and nothing within 2^62 of one remains.
const TINY: f32 = f32::from_bits(0x1f80_0000); // 2^-64

/// The value with every magnitude below 2^-64 replaced by +0.
#[inline(always)]
pub(crate) fn canonical(value: f32) -> f32 {
    if value.abs() < TINY { 0.0 } else { value }
}

/// Rounds to f32 and makes the result canonical.
#[inline(always)]
pub(crate) fn round_f32(value: f64) -> f32 {
    canonical(value as f32)
}

/// Rounds each component to f32, `x y z w`.
pub(crate) fn round_quat(q: DQuat) -> [f32; 4] {
    q.to_array().map(round_f32)
}

/// The unit quaternion nearest to `q`, in f32.
pub(crate) fn unit_f32(q: DQuat) -> Quat {
    Quat::from_array(round_quat(unit(q)))
}

/// `q` in f64, not normalised.
pub(crate) fn to_f64(q: Quat) -> DQuat {
    DQuat::from_array(q.to_array().map(f64::from))
}

/// `q / |q|`. Plain operations only: glam's own may use the platform's.
pub(crate) fn unit(q: DQuat) -> DQuat {
    let norm = dot(q, q).sqrt();
    DQuat::from_xyzw(q.x / norm, q.y / norm, q.z / norm, q.w / norm)
}

/// The inner product in R⁴.
pub(crate) fn dot(a: DQuat, b: DQuat) -> f64 {
    a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w
}

/// The Hamilton product `a b`, written out so that its order of operations is
/// ours on every target.
pub(crate) fn product(a: DQuat, b: DQuat) -> DQuat {
    DQuat::from_xyzw(
        a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
        a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
        a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
        a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
    )
}

/// `a⁻¹ b` for unit quaternions.
pub(crate) fn step(a: DQuat, b: DQuat) -> DQuat {
    product(DQuat::from_xyzw(-a.x, -a.y, -a.z, a.w), b)
}

/// `|v|`.
pub(crate) fn norm3(v: DVec3) -> f64 {
    (v.x * v.x + v.y * v.y + v.z * v.z).sqrt()
}

/// The exponential of a half-rotation vector: `[cos |a|; sin |a| a/|a|]`.
pub(crate) fn exp(a: DVec3) -> DQuat {
    let angle = norm3(a);
    let (sine, cosine) = libm::sincos(angle);
    // sin(x)/x is 1 to f64 rounding below 1e-9.
    let sinc = if angle < 1e-9 { 1.0 } else { sine / angle };
    DQuat::from_xyzw(sinc * a.x, sinc * a.y, sinc * a.z, cosine)
}

/// The logarithm of a unit quaternion, HALF of the rotation vector, of length at
/// most pi. `atan2`, not `acos`: the latter loses half of the digits of a small
/// angle.
pub(crate) fn log(q: DQuat) -> DVec3 {
    log_toward(q, DVec3::X)
}

/// As [`log`]; `axis` gives the direction where the quaternion has none (at -1,
/// where every direction is a logarithm of length pi).
pub(crate) fn log_toward(q: DQuat, axis: DVec3) -> DVec3 {
    let v = DVec3::new(q.x, q.y, q.z);
    let sine = norm3(v);
    if sine == 0.0 {
        let length = norm3(axis);
        let at_minus_one = q.w < 0.0 && length > 0.0;
        return if at_minus_one {
            axis * (std::f64::consts::PI / length)
        } else {
            DVec3::ZERO
        };
    }
    v * (libm::atan2(sine, q.w) / sine)
}

/// The branch of the logarithm of `q` that lies nearest to `near`: with `p` the
/// principal one, `p + 2 pi k p/|p|` for the best whole `k`.
pub(crate) fn log_near(q: DQuat, near: DVec3) -> DVec3 {
    let principal = log_toward(q, near);
    let length = norm3(principal);
    if length < 1e-9 && norm3(near) < std::f64::consts::PI {
        return principal;
    }
    // A principal logarithm of (almost) nothing still has branches along `near`.
    let axis = if length < 1e-9 {
        near / norm3(near)
    } else {
        principal / length
    };
    let along = axis.x * near.x + axis.y * near.y + axis.z * near.z;
    let turns = libm::round((along - length) / std::f64::consts::TAU);
    principal + axis * (turns * std::f64::consts::TAU)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_undoes_log_on_every_branch() {
        for angle in [0.0, 1e-12, 1e-5, 0.4, 1.5, 3.0, 3.1] {
            let v = DVec3::new(2.0, -1.0, 0.5).normalize() * angle;
            let q = exp(v);
            assert!(norm3(log(q) - v) < 1e-9, "{angle}");
            for turns in [-2.0, 1.0, 3.0] {
                let far = v + v.normalize_or(DVec3::Y) * (turns * std::f64::consts::TAU);
                let branch = log_near(q, far);
                assert!(norm3(branch - far) < 1e-6, "{angle} {turns} {branch} {far}");
            }
        }
    }

    #[test]
    fn tiny_values_become_positive_zero() {
        assert_eq!(canonical(-0.0).to_bits(), 0);
        assert_eq!(canonical(f32::from_bits(0x1f7f_ffff)).to_bits(), 0);
        assert_eq!(canonical(-TINY), -TINY);
    }
}
