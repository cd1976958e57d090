//! Bessel-Overhauser by the weighted mean of the slopes: the tangent is that of the parabola
//! through three keys, computed with logarithms.

use crate::fit::exact::handles::{BothSides, HandlePair, HandleRule, KeyInterval};
use crate::fit::exact::shape::DE_CASTELJAU;
use crate::math::quaternion::{Real, ratio, scaled, sum};
use crate::math::ranges::Algebra;
use crate::method::vector_method::VectorMethod;
use crate::method::{Continuity, Cost, CurveKind, Keys, Method, SmoothCurves, defaults, ends};

/// Bessel-Overhauser whose tangents are weighted means of logarithms: they never wrap around, and the curve is the
/// same for reversed time.
///
/// The Python package `splines` calls this method (non-uniform) Catmull-Rom.
pub const BESSEL_OVERHAUSER_MEAN: Method = Method {
    name: "bessel-overhauser-mean",
    summary: "smooth through keys at any spacing; the same curve for reversed keys",
    formula: "log t_i = (h_i/h_{i-1} log(q_{i-1}⁻¹ q_i) + h_{i-1}/h_i log(q_i⁻¹ q_{i+1})) / (h_{i-1} + h_i), a_i = q_i t_i^(h_i/3), b_i = q_i t_i^(-h_{i-1}/3), de Casteljau",
    source: "Overhauser 1968; Shoemake 1985; Geier, splines 0.3 (Python)",
    continuity: Continuity::C1,
    keeps_constant_velocity: Keys::Any,
    cost: Cost::new(840.0, 3.2),
    curves: &CURVES,
    ..defaults(VectorMethod::BesselOverhauser)
};

static CURVES: CurveKind = CurveKind::Smooth(SmoothCurves {
    steady_alone: true,
    ..SmoothCurves::new(&DE_CASTELJAU, ends::curves::<BesselOverhauserMeanRule>)
});

struct BesselOverhauserMeanRule;

impl HandleRule for BesselOverhauserMeanRule {
    #[inline(always)]
    fn handles<A: Algebra>(_: &mut A, [before, after]: BothSides<A>) -> HandlePair<A::Number> {
        HandlePair {
            incoming: handle(before, after, before.duration, [A::Number::all(1.0); 2]),
            outgoing: handle(before, after, after.duration, [A::Number::all(1.0); 2]),
        }
    }
}

/// The handle in an interval of `duration` seconds: the mean of the slopes on both sides, each weighted by the
/// duration of the other side and by a factor.
#[inline(always)]
pub(crate) fn handle<R: Real>(
    before: KeyInterval<R>,
    after: KeyInterval<R>,
    duration: R,
    [left, right]: [R; 2],
) -> [R; 3] {
    let left = scaled(before.log, ratio(after.duration, before.duration) * left);
    let right = scaled(after.log, ratio(before.duration, after.duration) * right);
    let both = before.duration + after.duration;
    scaled(
        sum(left, right),
        ratio(R::all(1.0), R::all(3.0) * both) * duration,
    )
}
