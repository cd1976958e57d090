//! Normalised linear interpolation.

use crate::curve::formula::{ControlNumbers, Formula, NUMBERS, normalised, quaternion, weighted};
use crate::curve::options::Ends;
use crate::fit::block::{Intervals, TrackStretch, at, squared_extent};
use crate::fit::exact::fit::Shape;
use crate::fit::exact::shape::shape_of;
use crate::math::dual::Scalar;
use crate::method::vector_method::VectorMethod;
use crate::method::{Continuity, Cost, CurveKind, Keys, Method, SmoothCurves, defaults};

/// Nlerp: the straight line between neighbouring keys, normalised. Its path is that of slerp with another speed,
/// slower near the keys; it differs from slerp by up to 8° if keys are 180° apart.
pub const NLERP: Method = Method {
    name: "nlerp",
    summary: "the path of slerp, at uneven speed; common in games",
    formula: "q(t) = ((1-t) q0 + t q1) / |(1-t) q0 + t q1|",
    source: "Blow 2004, Understanding slerp, then not using it",
    continuity: Continuity::C0,
    continuity_on_even_keys: Continuity::C0,
    keeps_constant_velocity: Keys::Never,
    uses_neighbours: false,
    cost: Cost::new(150.0, 2.8),
    curves: &CURVES,
    ..defaults(VectorMethod::Linear)
};

static SHAPE: Shape = shape_of::<Linear>(16);

/// `((1-t) q0 + t q1) / |…|`. Numbers: `q0`, two quaternions that are not used, `q1`.
struct Linear;

impl Formula for Linear {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let rest = S::all(1.0) - t;
        normalised(weighted(
            quaternion(numbers, 0),
            rest,
            quaternion(numbers, 12),
            t,
        ))
    }
}

static CURVES: CurveKind = CurveKind::Smooth(SmoothCurves::new(&SHAPE, curves));

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
