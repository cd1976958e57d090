//! Twin of `shaders/from_keys/arc_between.wgsl`: the same names, the same order.

use crate::shader::*;
use crate::simd::lanes::{Number, canonical};
use crate::twin::evaluate_arc::norm_squared;

/// The middle of the arc between two unit quaternions, and its tangent there. They are at most pi/2
/// apart in R⁴.
#[inline(always)]
pub(crate) fn arc_between<N: Number>(start: [N; 4], end: [N; 4]) -> ([N; 4], [N; 4]) {
    let [ax, ay, az, aw] = start;
    let [bx, by, bz, bw] = end;
    let one_half = N::all(0.5);
    let half = [
        (ax + bx) * one_half,
        (ay + by) * one_half,
        (az + bz) * one_half,
        (aw + bw) * one_half,
    ];
    let difference = [bx - ax, by - ay, bz - az, bw - aw];
    let x = norm_squared(difference) * N::all(0.25);
    let xx = x * x;
    let secant_7 = N::all(SECANT_8) * x + N::all(SECANT_7);
    let secant_5 = N::all(SECANT_6) * x + N::all(SECANT_5);
    let secant_3 = N::all(SECANT_4) * x + N::all(SECANT_3);
    let secant_1 = N::all(SECANT_2) * x + N::all(SECANT_1);
    let secant_high = (N::all(SECANT_9) * xx + secant_7) * xx + secant_5;
    let secant = ((secant_high * xx + secant_3) * xx + secant_1) * x;
    let sine_7 = N::all(ARC_SINE_8) * x + N::all(ARC_SINE_7);
    let sine_5 = N::all(ARC_SINE_6) * x + N::all(ARC_SINE_5);
    let sine_3 = N::all(ARC_SINE_4) * x + N::all(ARC_SINE_3);
    let sine_1 = N::all(ARC_SINE_2) * x + N::all(ARC_SINE_1);
    let arc_sine = (((sine_7 * xx + sine_5) * xx + sine_3) * xx + sine_1) * x;
    (lengthened(half, secant), lengthened(difference, arc_sine))
}

#[inline(always)]
fn lengthened<N: Number>(q: [N; 4], by: N) -> [N; 4] {
    canonical([
        q[0] * by + q[0],
        q[1] * by + q[1],
        q[2] * by + q[2],
        q[3] * by + q[3],
    ])
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    /// Catches a wrong digit in a coefficient, which bit equality alone would not: both
    /// twins read the same one.
    #[test]
    fn middles_and_tangents_are_as_accurate_as_stated() {
        for step in 0..=10_000 {
            let angle = f64::from(step) / 10_000.0 * FRAC_PI_2;
            let (sine, cosine) = angle.sin_cos();
            let end = [sine as f32, 0.0, 0.0, cosine as f32];
            let (middle, tangent) = arc_between([0.0, 0.0, 0.0, 1.0], end);
            let (sine, cosine) = (angle * 0.5).sin_cos();
            let expected = [sine, cosine, cosine * angle, -sine * angle];
            let found = [middle[0], middle[3], tangent[0], tangent[3]];
            for (found, expected) in found.into_iter().zip(expected) {
                let error = (f64::from(found) - expected).abs();
                assert!(error < 2.5e-7, "{error} at {angle}: {found}, {expected}");
            }
        }
    }
}
