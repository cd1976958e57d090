//! Twin of `shaders/arc.wgsl`: the same names, the same order.

use super::evaluate::canonical;
use super::evaluate_arc::square;
use crate::segment::ArcSegment;
use crate::segment::shader::{
    ARC_SINE_1, ARC_SINE_2, ARC_SINE_3, ARC_SINE_4, ARC_SINE_5, ARC_SINE_6, ARC_SINE_7, ARC_SINE_8,
    SECANT_1, SECANT_2, SECANT_3, SECANT_4, SECANT_5, SECANT_6, SECANT_7, SECANT_8, SECANT_9,
};

/// The arc between two unit quaternions, at most pi/2 apart in R⁴.
#[inline(always)]
pub(crate) fn arc(start: [f32; 4], end: [f32; 4]) -> ArcSegment {
    let [ax, ay, az, aw] = start;
    let [bx, by, bz, bw] = end;
    let half = [
        (ax + bx) * 0.5,
        (ay + by) * 0.5,
        (az + bz) * 0.5,
        (aw + bw) * 0.5,
    ];
    let difference = [bx - ax, by - ay, bz - az, bw - aw];
    let x = square(difference) * 0.25;
    let secant_high = ((SECANT_9 * x + SECANT_8) * x + SECANT_7) * x + SECANT_6;
    let secant_mid = ((secant_high * x + SECANT_5) * x + SECANT_4) * x + SECANT_3;
    let secant = ((secant_mid * x + SECANT_2) * x + SECANT_1) * x;
    let sine_high = ((ARC_SINE_8 * x + ARC_SINE_7) * x + ARC_SINE_6) * x + ARC_SINE_5;
    let sine_mid = ((sine_high * x + ARC_SINE_4) * x + ARC_SINE_3) * x + ARC_SINE_2;
    let arc_sine = (sine_mid * x + ARC_SINE_1) * x;
    let lengthened = |q: [f32; 4], by: f32| {
        [
            canonical(q[0] * by + q[0]),
            canonical(q[1] * by + q[1]),
            canonical(q[2] * by + q[2]),
            canonical(q[3] * by + q[3]),
        ]
    };
    ArcSegment {
        middle: lengthened(half, secant),
        tangent: lengthened(difference, arc_sine),
    }
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
            let ArcSegment { middle, tangent } = arc([0.0, 0.0, 0.0, 1.0], end);
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
