//! Kochanek-Bartels: tension, continuity and bias at each key.

use crate::fit::exact::handles::{BothSides, HandlePair, HandleRule};
use crate::fit::exact::shape::DE_CASTELJAU;
use crate::math::quaternion::Real as _;
use crate::math::ranges::Algebra;
use crate::method::bessel_overhauser_mean::handle;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::VectorMethod;
use crate::method::{
    Continuity, Cost, CurveKind, Keys, Method, MethodInput, SmoothCurves, defaults, ends,
};
use crate::tracks::set::Track;

/// Kochanek-Bartels, with a [`Tcb`](crate::tracks::set::key_data::Tcb) at each key
/// ([`TrackSet::set_tcb`](crate::tracks::set::TrackSet::set_tcb)) or the same for all keys ([`Interpolation::tcb`]).
/// With zeros it is the same as [`BESSEL_OVERHAUSER_MEAN`](crate::method::BESSEL_OVERHAUSER_MEAN).
pub const KOCHANEK_BARTELS: Method = Method {
    name: "kochanek-bartels",
    summary: "an animator's curve: tension, continuity and bias at each key",
    formula: "log in = h_{i-1}/3 (c h_i/h_{i-1} log(q_{i-1}⁻¹ q_i) + d h_{i-1}/h_i log(q_i⁻¹ q_{i+1})) / (h_{i-1} + h_i), log out alike with h_i, a, b; a, d = (1-T)(1+C)(1±B), c, b = (1-T)(1-C)(1±B), de Casteljau",
    source: "Kochanek, Bartels 1984, Interpolating splines with local tension, continuity, and bias control; Geier, splines 0.3 (Python)",
    continuity: Continuity::C1,
    keeps_constant_velocity: Keys::Any,
    cost: Cost::new(860.0, 3.2),
    curves: &CURVES,
    ..defaults(VectorMethod::BesselOverhauser)
};

static CURVES: CurveKind = CurveKind::Smooth(
    SmoothCurves::new(&DE_CASTELJAU, ends::curves::<KochanekBartelsRule>)
        .with(MethodInput::Numbers(numbers)),
);

/// Tension, continuity and bias of the key at the start of an interval.
fn numbers(track: Track, interval: usize, interpolation: &Interpolation) -> [[f64; 4]; 2] {
    let tcb = track.tcb.get(interval).unwrap_or(&interpolation.tcb);
    [[tcb.tension, tcb.continuity, tcb.bias, 0.0], [0.0; 4]]
}

struct KochanekBartelsRule;

impl HandleRule for KochanekBartelsRule {
    #[inline(always)]
    fn handles<A: Algebra>(_: &mut A, [before, after]: BothSides<A>) -> HandlePair<A::Number> {
        let [tension, continuity, bias, _] = after.key;
        let one = A::Number::all(1.0);
        let tight = one - tension;
        let weights = |corner| {
            let left = tight * (one + corner) * (one + bias);
            [left, tight * (one - corner) * (one - bias)]
        };
        HandlePair {
            incoming: handle(before, after, before.duration, weights(-continuity)),
            outgoing: handle(before, after, after.duration, weights(continuity)),
        }
    }
}
