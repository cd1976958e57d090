//! Normalised linear interpolation.

use crate::curve::formula::ControlNumbers;
use crate::curve::options::Ends;
use crate::fit::block::{Intervals, TrackStretch, at, squared_extent};
use crate::fit::exact::shape::Shape;
use crate::method::vector_method::VectorMethod;
use crate::method::{Continuity, Cost, CurveKind, Keys, Method, SmoothCurves, defaults};
use crate::reference;

/// Nlerp: the straight line between neighbouring keys, normalised. It follows the path of slerp at
/// another speed, slower near the keys: it is up to 8° from slerp where keys are 180° apart.
pub const NLERP: Method = Method {
    name: "nlerp",
    summary: "slerp's way at uneven speed, as many games have it",
    formula: "q(t) = ((1-t) q0 + t q1) / |(1-t) q0 + t q1|",
    source: "Blow 2004, Understanding slerp, then not using it",
    continuity: Continuity::C0,
    continuity_on_even_keys: Continuity::C0,
    keeps_constant_velocity: Keys::Never,
    uses_neighbours: false,
    cost: Cost::new(150.0, 2.8),
    reference: reference::two_keys::NLERP,
    curves: &CURVES,
    ..defaults(VectorMethod::Linear)
};

static CURVES: CurveKind = CurveKind::Smooth(SmoothCurves::new(Shape::LINEAR, curves));

fn curves(intervals: &mut Intervals, stretches: &[TrackStretch], _: Ends) {
    for lane in stretches.iter().flat_map(TrackStretch::lanes) {
        let (start, end) = (intervals.key(lane), intervals.end_key(lane));
        let numbers = ControlNumbers {
            start,
            end,
            ..ControlNumbers::default()
        };
        intervals.set_curve(lane, numbers);
        intervals.squared_extents[lane] =
            squared_extent([at(&intervals.logs, lane), [0.0; 3], [0.0; 3]]);
    }
}
