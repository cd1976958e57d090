//! The Hermite method: a cubic with specified angular velocities at the keys.

use crate::curve::options::Ends;
use crate::fit::block::{Intervals, TrackStretch, at, put};
use crate::fit::exact::handles::BetweenHandles;
use crate::fit::exact::shape::BERNSTEIN;
use crate::math::quaternion::scaled;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::VectorMethod;
use crate::method::{Continuity, Cost, CurveKind, Method, MethodInput, SmoothCurves, defaults};
use crate::simd::dispatch::in_lanes;
use crate::tracks::set::Track;

/// Hermite: the curve has the specified rotation and angular velocity at every key
/// ([`TrackSet::set_velocities`](crate::tracks::set::TrackSet::set_velocities)). In a track without velocities they
/// are 0.
pub const HERMITE: Method = Method {
    name: "hermite",
    summary: "angular velocities are given at the keys; without them each key is at rest",
    formula: "a_i = q_i exp(ω_i h_i/6), b_i = q_i exp(-ω_i h_{i-1}/6)",
    source: "Kim, Kim, Shin 1995, A general construction scheme for unit quaternion curves",
    continuity: Continuity::C1,
    symmetric: false,
    uses_neighbours: false,
    cost: Cost::new(160.0, 2.8),
    curves: &CURVES,
    ..defaults(VectorMethod::BesselOverhauser)
};

static CURVES: CurveKind =
    CurveKind::Smooth(SmoothCurves::new(&BERNSTEIN, curves).with(MethodInput::Numbers(numbers)));

fn numbers(track: Track, interval: usize, _: &Interpolation) -> [[f64; 4]; 2] {
    [interval, interval + 1].map(|key| {
        let velocity = track.velocities.get(key).copied().unwrap_or_default();
        [velocity.x, velocity.y, velocity.z, 0.0]
    })
}

fn curves(intervals: &mut Intervals, stretches: &[TrackStretch], _: Ends) {
    for lane in stretches.iter().flat_map(TrackStretch::lanes) {
        let sixth = intervals.durations[lane] / 6.0;
        let ([x, y, z, _], [u, v, w, _]) = (
            at(&intervals.outward, lane),
            at(&intervals.inward, lane + 1),
        );
        put(&mut intervals.outgoing, lane, scaled([x, y, z], sixth));
        put(&mut intervals.incoming, lane + 1, scaled([u, v, w], sixth));
    }
    in_lanes(&mut BetweenHandles(intervals));
}
