//! The angular velocity and acceleration of a rotation that is the exponential of half a rotation vector, in closed form.
//!
//! Differences would not do: a rotation vector that is a cubic between two unevenly spaced keys may turn hundreds of
//! times within the interval, and any fixed step is then too long.

use glam::{DMat3, DQuat, DVec3};

use crate::reference::quaternion::{exponential, from_parts, invert, multiply, vector};

/// The angular acceleration in the body frame, `2 vec(e⁻¹ e'')`, where `e` is the exponential of half a rotation vector
/// `v` with the derivatives `v1` and `v2`.
pub(crate) fn acceleration(v: DVec3, v1: DVec3, v2: DVec3) -> DVec3 {
    // e = [C; S v], with C and S functions of z = v·v.
    let (s, k, slope) = waves(v.dot(v));
    let (z1, z2) = (2.0 * v.dot(v1), 2.0 * (v1.dot(v1) + v.dot(v2)));
    // S' = k/2, C' = -S/2.
    let (s1, s2) = (0.5 * k * z1, 0.5 * (k * z2 + slope * z1 * z1));
    let c2 = -0.5 * (s * z2 + 0.5 * k * z1 * z1);
    let second = from_parts(c2, v * s2 + v1 * (2.0 * s1) + v2 * s);
    2.0 * vector(multiply(invert(exponential(v)), second))
}

/// `S = sin(x)/x`, `k = (cos(x) - S)/z` and the derivative of `k` by `z`, with `z = x²`.
fn waves(z: f64) -> (f64, f64, f64) {
    let x = z.sqrt();
    if x < 0.1 {
        let s = 1.0 - z / 6.0 + z * z / 120.0 - z * z * z / 5040.0;
        let k = -1.0 / 3.0 + z / 30.0 - z * z / 840.0 + z * z * z / 45_360.0;
        let slope = 1.0 / 30.0 - z / 420.0 + z * z / 15_120.0;
        return (s, k, slope);
    }
    let s = libm::sin(x) / x;
    let k = (libm::cos(x) - s) / z;
    (s, k, -(s + 3.0 * k) / (2.0 * z))
}

/// The matrix from the rate of change of half a rotation vector to half of the angular velocity in the body frame.
pub(crate) fn velocity_matrix(v: DVec3) -> DMat3 {
    let (s, k, _) = waves(v.dot(v));
    let column = |axis: DVec3| {
        let along = v.dot(axis);
        let slope: DQuat = from_parts(-s * along, v * (k * along) + axis * s);
        vector(multiply(invert(exponential(v)), slope))
    };
    DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
}
