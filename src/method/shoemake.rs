//! Shoemake's approach I, from the lecture, and the handle rule of all three approaches.

use crate::fit::exact::handles::{BothSides, HandlePair, HandleRule};
use crate::fit::exact::shape::DE_CASTELJAU;
use crate::math::quaternion::{Real as _, dot, scaled, sum};
use crate::math::ranges::Algebra;
use crate::method::vector_method::VectorMethod;
use crate::method::{Cost, CurveKind, Method, SmoothCurves, defaults, ends};

/// Approach I of Shoemake's lecture: the control rotation is the bisector itself. At its keys the curve is three
/// times too fast, and it overshoots; it is included for comparison. [`SHOEMAKE_1985`](crate::method::SHOEMAKE_1985)
/// corrects this.
pub const SHOEMAKE: Method = Method {
    name: "shoemake",
    summary: "historical, for comparison only; its speed at a key is three times that of a smooth curve",
    formula: "a_i = Bisect(Double(q_{i-1}, q_i), q_{i+1}), b_i = Double(a_i, q_i), de Casteljau",
    source: "Shoemake 1985 as lectured, approach I",
    cost: Cost::new(1500.0, 4.1),
    curves: &CURVES,
    ..defaults(VectorMethod::BesselOverhauser)
};

static CURVES: CurveKind = CurveKind::Smooth(SmoothCurves::new(
    &DE_CASTELJAU,
    ends::curves::<Bisector<1>>,
));

/// Handles at 1/`DIVISOR` of the arc from the key to the bisector.
///
/// `Double(p, q) = 2 (p·q) q - p` and `Bisect(p, q) = (p + q) / |p + q|`. Relative to `q_i`, `Double(q_{i-1}, q_i)`
/// repeats the step before the key.
pub(crate) struct Bisector<const DIVISOR: u8>;

impl<const DIVISOR: u8> HandleRule for Bisector<DIVISOR> {
    // At inner keys too, these handles are 3/DIVISOR times as long as those of a parabola.
    const HANDLE_SHARE: f64 = 2.0 / DIVISOR as f64;

    #[inline(always)]
    fn handles<A: Algebra>(
        algebra: &mut A,
        [before, after]: BothSides<A>,
    ) -> HandlePair<A::Number> {
        let (a, b) = (before.step, after.step);
        let both = [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]];
        let norm = dot(both, both).root();
        let (none, zero, one) = (
            A::Number::all(1e-12),
            A::Number::all(0.0),
            A::Number::all(1.0),
        );
        // After half a turn and back, the sum is 0: there is no bisector, so the handle is 0.
        let scale = norm.up_to(none, zero, one / norm);
        let w = norm.up_to(none, one, both[3] * scale);
        let bisector = [both[0] * scale, both[1] * scale, both[2] * scale, w];
        let log = algebra.log_toward(bisector, sum(before.log, after.log));
        let handle = scaled(log, A::Number::all(1.0 / f64::from(DIVISOR)));
        HandlePair {
            incoming: handle,
            outgoing: handle,
        }
    }
}
