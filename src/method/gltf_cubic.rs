//! The cubic spline of glTF.

use crate::curve::formula::{ControlNumbers, Formula, NUMBERS, normalised, quaternion, weighted};
use crate::curve::options::{Ends, KeySigns};
use crate::fit::block::{Intervals, TrackStretch, at, squared_extent};
use crate::fit::exact::fit::Shape;
use crate::fit::exact::shape::shape_of;
use crate::math::dual::Scalar;
use crate::math::quaternion::{Quaternion, Vector, length};
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::VectorMethod;
use crate::method::{Continuity, Cost, CurveKind, Method, MethodInput, SmoothCurves, defaults};
use crate::tracks::set::Track;

/// glTF's CUBICSPLINE: a normalised cubic in each component, with the tangents of
/// [`TrackSet::set_tangents`](crate::tracks::set::TrackSet::set_tangents).
///
/// In a track with tangents, keys keep their signs, as glTF specifies. A track without tangents does not come from a
/// CUBICSPLINE of glTF: all its tangents are 0, each key is at rest, and [`Interpolation::signs`] applies as for every
/// method. The keys of such a track may have any signs, for example if they were computed from angles; with these signs,
/// the cubic between `q` and nearly `-q` would rotate extremely fast.
pub const GLTF_CUBIC: Method = Method {
    name: "gltf-cubic",
    summary: "glTF's CUBICSPLINE, exactly as specified; without tangents each key is at rest",
    formula: "p(t) = (2t³-3t²+1) q0 + h (t³-2t²+t) out0 + (3t²-2t³) q1 + h (t³-t²) in1, q = p/|p|",
    source: "glTF 2.0, appendix C.5, Cubic Spline Interpolation",
    continuity: Continuity::C1,
    uses_neighbours: false,
    signs: Some(KeySigns::AsAuthored),
    cost: Cost::new(350.0, 3.8),
    curves: &CURVES,
    ..defaults(VectorMethod::GltfCubic)
};

static SHAPE: Shape = shape_of::<Hermite>(16);

/// `((2t³-3t²+1) q0 + (t³-2t²+t) m0 + (3t²-2t³) q1 + (t³-t²) m1) / |…|`.
///
/// Numbers: `q0`, `m0`, `m1`, `q1`; the tangents are multiplied by the interval's length.
struct Hermite;

impl Formula for Hermite {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let one = S::all(1.0);
        let rest = one - t;
        let two = S::all(2.0);
        let start = (one + two * t) * rest * rest;
        let end = t * t * (S::all(3.0) - two * t);
        let leaving = t * rest * rest;
        let arriving = t * t * (t - one);
        let keys = weighted(quaternion(numbers, 0), start, quaternion(numbers, 12), end);
        let tangents = weighted(
            quaternion(numbers, 4),
            leaving,
            quaternion(numbers, 8),
            arriving,
        );
        normalised(weighted(keys, one, tangents, one))
    }
}

static CURVES: CurveKind =
    CurveKind::Smooth(SmoothCurves::new(&SHAPE, curves).with(MethodInput::Numbers(numbers)));

/// The tangents at the start and at the end of an interval.
fn numbers(track: Track, interval: usize, _: &Interpolation) -> [[f64; 4]; 2] {
    let tangent = |key: usize, side: usize| {
        let tangents = track.tangents.get(key);
        tangents.map_or([0.0; 4], |both| both[side].to_array().map(f64::from))
    };
    [tangent(interval, 1), tangent(interval + 1, 0)]
}

fn curves(intervals: &mut Intervals, stretches: &[TrackStretch], _: Ends) {
    for lane in stretches.iter().flat_map(TrackStretch::lanes) {
        let duration = intervals.durations[lane];
        let outgoing = at(&intervals.outward, lane).map(|c| c * duration);
        let incoming = at(&intervals.inward, lane + 1).map(|c| c * duration);
        let (start, end) = (intervals.key(lane), intervals.end_key(lane));
        let numbers = ControlNumbers {
            start,
            after_start: outgoing,
            before_end: incoming,
            end,
        };
        intervals.set_curve(lane, numbers);
        // An estimate of the squared extent: the component of a tangent along its key changes only
        // the quaternion's length.
        let log = at(&intervals.logs, lane);
        let across = [cross3(start, outgoing), log, cross3(end, incoming)];
        intervals.squared_extents[lane] = squared_extent(across);
    }
}

/// A vector with the length of the component of a tangent that is orthogonal to its key.
fn cross3(key: Quaternion, tangent: Quaternion) -> Vector {
    let along: f64 = key.iter().zip(tangent).map(|(k, t)| k * t).sum();
    let rest: [f64; 4] = std::array::from_fn(|c| tangent[c] - key[c] * along);
    [rest[0], rest[1], length([rest[2], rest[3], 0.0])]
}
