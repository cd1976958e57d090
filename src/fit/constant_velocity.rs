//! Twin of `shaders/from_keys/constant_velocity.wgsl`, one component at a time: arcs as polynomials. In smooth
//! methods, a track of only two keys is such an arc. Its coefficients are the Taylor series of sine and cosine at the
//! middle; nothing is sampled or fitted.

use glam::Vec4;

use crate::shader::*;
use crate::simd::lanes::Number;
use crate::twin::arc_between::arc_between;
use crate::twin::evaluate_arc::norm_squared;

/// Taylor coefficients of the cosine (even powers) and the sine (odd powers).
const SERIES: [f32; POWERS] = [
    1.0, 1.0, SERIES_2, SERIES_3, SERIES_4, SERIES_5, SERIES_6, SERIES_7, SERIES_8, SERIES_9,
    SERIES_10,
];

/// One component of an arc as a polynomial, from that component of its middle and of its tangent
/// there; `square` is the square of the arc's angle in R⁴. Half of that angle is at most pi/4, so
/// the truncation error is at most 2e-9.
#[inline(always)]
pub(crate) fn arc_component<N: Number>(middle: N, tangent: N, square: N) -> [N; POWERS] {
    let mut coefficients = [middle; POWERS];
    let (mut even, mut odd) = (middle, tangent);
    for k in 0..POWERS / 2 {
        coefficients[2 * k + 1] = (odd * N::all(SERIES[2 * k + 1])).canonical();
        (even, odd) = (even * square, odd * square);
        coefficients[2 * k + 2] = (even * N::all(SERIES[2 * k + 2])).canonical();
    }
    coefficients
}

/// The arc between two keys; the second key's sign is the one nearer to the first.
pub(crate) fn arc_polynomial([from, to]: [[f32; 4]; 2]) -> PolynomialSegment {
    let (middle, tangent) = arc_between(from, to);
    let square = Vec4::splat(norm_squared(tangent));
    // Each vector has all four components, so one call computes the coefficients of all.
    let powers = arc_component(Vec4::from_array(middle), Vec4::from_array(tangent), square);
    PolynomialSegment {
        coefficients: powers.map(|power| power.to_array()),
    }
}
