//! Catmull-Rom: the tangent at a key is half of the step between its neighbours.

use crate::fit::exact::handles::{BothSides, HandlePair, HandleRule};
use crate::fit::exact::shape::BERNSTEIN;
use crate::fit::tangent_weights::WeightRule;
use crate::math::quaternion::{Real as _, product, scaled, sum};
use crate::math::ranges::Algebra;
use crate::method::vector_method::VectorMethod;
use crate::method::{Cost, CurveKind, Keys, Method, SmoothCurves, defaults, ends};

/// Catmull-Rom on rotations, in cumulative form. It ignores key times, so its velocity jumps at unevenly spaced keys;
/// [`BESSEL_OVERHAUSER`](crate::method::BESSEL_OVERHAUSER) corrects this.
pub const CATMULL_ROM: Method = Method {
    name: "catmull-rom",
    summary: "smooth through evenly spaced keys; its velocity jumps where they are uneven",
    formula: "a_i = q_i (q_{i-1}⁻¹ q_{i+1})^(1/6), b_i = q_i (q_{i-1}⁻¹ q_{i+1})^(-1/6)",
    source: "Kim, Kim, Shin 1995, A general construction scheme for unit quaternion curves",
    keeps_constant_velocity: Keys::Even,
    symmetric: false,
    cost: Cost::new(150.0, 2.6),
    curves: &CURVES,
    ..defaults(VectorMethod::CatmullRom)
};

static CURVES: CurveKind = CurveKind::Smooth(
    SmoothCurves::new(&BERNSTEIN, ends::curves::<CatmullRomRule>)
        .fast::<CatmullRomRule>(WeightRule::Alike),
);

struct CatmullRomRule;

impl HandleRule for CatmullRomRule {
    const IS_CUMULATIVE: bool = true;

    #[inline(always)]
    fn handles<A: Algebra>(
        algebra: &mut A,
        [before, after]: BothSides<A>,
    ) -> HandlePair<A::Number> {
        // The half-angle of both steps together may be near pi, so the product keeps its sign.
        let two_step = product(before.step, after.step);
        let log = algebra.log_toward(two_step, sum(before.log, after.log));
        let handle = scaled(log, A::Number::all(1.0 / 6.0));
        HandlePair {
            incoming: handle,
            outgoing: handle,
        }
    }
}
