//! Bessel-Overhauser: the tangent at a key is that of the parabola through it and its two neighbours.

use crate::fit::exact::handles::{BothSides, HandlePair, HandleRule};
use crate::fit::exact::shape::BERNSTEIN;
use crate::fit::tangent_weights::WeightRule;
use crate::math::quaternion::{Real as _, product, ratio, scaled, sum};
use crate::math::ranges::Algebra;
use crate::method::vector_method::VectorMethod;
use crate::method::{Continuity, Cost, CurveKind, Keys, Method, SmoothCurves, defaults, ends};

/// Bessel-Overhauser on rotations: a continuous velocity for any key times, and the same as
/// [`CATMULL_ROM`](crate::method::CATMULL_ROM) for even ones.
pub const BESSEL_OVERHAUSER: Method = Method {
    name: "bessel-overhauser",
    summary: "the default: smooth through keys at any spacing; equals catmull-rom on even spacing",
    formula: "t_i = ((s⁻)^h_i (s⁺)^h_{i-1})^(1/(h_{i-1}+h_i)), a_i = q_i t_i^(h_i/3), b_i = q_i t_i^(-h_{i-1}/3)",
    source: "Overhauser 1968; on rotations in the form of Kim, Kim, Shin 1995",
    continuity: Continuity::C1,
    keeps_constant_velocity: Keys::Any,
    symmetric: false,
    cost: Cost::new(210.0, 2.8),
    curves: &CURVES,
    ..defaults(VectorMethod::BesselOverhauser)
};

static CURVES: CurveKind = CurveKind::Smooth(
    SmoothCurves::new(&BERNSTEIN, ends::curves::<BesselOverhauserRule>)
        .fast::<BesselOverhauserRule>(WeightRule::ByTime),
);

struct BesselOverhauserRule;

impl HandleRule for BesselOverhauserRule {
    const IS_CUMULATIVE: bool = true;

    #[inline(always)]
    fn handles<A: Algebra>(
        algebra: &mut A,
        [before, after]: BothSides<A>,
    ) -> HandlePair<A::Number> {
        let both = before.duration + after.duration;
        // The slope on each side is weighted by the other side's duration. The left factor comes
        // first: otherwise the curve would not equal Catmull-Rom on uniform keys.
        let left = scaled(
            algebra.log_of_step(before.step, before.log),
            ratio(after.duration, before.duration),
        );
        let right = scaled(
            algebra.log_of_step(after.step, after.log),
            ratio(before.duration, after.duration),
        );
        // The logarithm of the product has several branches. On the principal one, a long tangent would point
        // backwards, so the branch near the sum is taken.
        let rotation = product(algebra.exp(left), algebra.exp(right));
        let tangent = scaled(
            algebra.log_near(rotation, sum(left, right)),
            ratio(A::Number::all(1.0), A::Number::all(3.0) * both),
        );
        HandlePair {
            incoming: scaled(tangent, before.duration),
            outgoing: scaled(tangent, after.duration),
        }
    }
}
