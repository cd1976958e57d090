//! Preparation of translations, scales and scalars: a segment is a cubic in each component about the middle of its interval.
//! It is a polynomial already, so nothing is fitted.

use std::borrow::Cow;

use bytemuck::Zeroable;
use glam::{DVec3, Vec3};

use crate::curve::formula::LineNumbers;
use crate::curve::options::Quantity;
use crate::fit::exact::fit::IntervalCurve;
use crate::fit::exact::shape::LINE;
use crate::math::canonical::{canonical, round_f32};
use crate::math::quaternion::{ratio, round_quat};
use crate::method::interpolation::Interpolation;
use crate::method::vector_curve::{VectorCubic, VectorCurves};
use crate::method::vector_method::{ScalarQuantity, VectorMethod};
use crate::prepare::prepared::Prepared;
use crate::shader::PolynomialSegment;
use crate::time::frames::Timeline;
use crate::time::runs::NONE;
use crate::time::spans::SpanSource;
use crate::time::wrap::{Wrap, WrapMode};
use crate::tracks::set::vectors::VectorTrack;

/// The number of keys on each side of a sample on which its curve may depend, and one for the rounding of times.
const BESIDE: usize = 3;

/// With fewer keys for each sample, thinning a track takes as long as preparing it.
const KEYS_OF_A_SAMPLE: usize = 8;

/// The curves through translations, scales or scalars that are prepared, and for which samples.
#[derive(Clone, Copy)]
pub(crate) struct VectorRequest<'a> {
    pub(crate) quantity: ScalarQuantity,
    pub(crate) method: VectorMethod,
    /// The ends and the wrap modes.
    pub(crate) interpolation: &'a Interpolation,
    /// The largest size of a group's segments in bytes.
    pub(crate) group_bytes: Option<usize>,
    /// The only timeline that will be sampled; keys on which no sample of it depends may be left out.
    pub(crate) only_for: Option<&'a Timeline>,
}

/// The track with only the keys on which the curves at some times depend, and those at its ends. The whole track if
/// there are many samples, or if every key has an influence.
pub(crate) fn thinned<'t>(
    track: &'t VectorTrack,
    method: VectorMethod,
    wrap: Wrap,
    samples: impl ExactSizeIterator<Item = f64>,
) -> Cow<'t, VectorTrack> {
    let count = track.keys.len();
    if method == VectorMethod::C2 || (samples.len() + 1) * KEYS_OF_A_SAMPLE > count {
        return Cow::Borrowed(track);
    }
    let span = (track.times[0], track.times[count - 1]);
    let mut near = Vec::with_capacity(samples.len() + 2);
    near.extend([0, count - 1]);
    near.extend(samples.map(|time| {
        let time = if wrap.repeats() {
            wrap.folded(span, time)
        } else {
            time
        };
        track.times.partition_point(|&key| key <= time)
    }));
    near.sort_unstable();
    let mut indices: Vec<usize> = Vec::new();
    for near in near {
        let from = indices.last().map_or(0, |&last| last + 1);
        indices.extend(from.max(near.saturating_sub(BESIDE + 1))..count.min(near + BESIDE + 1));
    }
    fn picked<T: Copy>(all: &[T], indices: &[usize]) -> Vec<T> {
        match all {
            [] => Vec::new(),
            all => indices.iter().map(|&index| all[index]).collect(),
        }
    }
    Cow::Owned(VectorTrack {
        times: picked(&track.times, &indices),
        keys: picked(&track.keys, &indices),
        tangents: picked(&track.tangents, &indices),
        ups: picked(&track.ups, &indices),
    })
}

/// Adds the vectors of the `index`th track.
pub(crate) fn add(
    prepared: &mut Prepared,
    index: usize,
    track: &VectorTrack,
    request: &VectorRequest<'_>,
) {
    let (method, interpolation) = (request.method, request.interpolation);
    let last = track.keys.len() - 1;
    let first_key = prepared.constants.len() as u32;
    let stored = |key: &Vec3| [canonical(key.x), canonical(key.y), canonical(key.z), 0.0];
    prepared.constants.extend(track.keys.iter().map(stored));
    let first_span = prepared.spans.len();
    let curves = VectorCurves::new(track, method, interpolation.ends);
    // A B-spline passes near its keys.
    let meets_keys = method != VectorMethod::BSpline;
    let mut held = [first_key, first_key + last as u32];
    let mut lines = [NONE; 2];
    for i in 0..last {
        let (start, key) = (track.times[i], first_key + i as u32);
        if curves.is_held(i) {
            prepared.push_span(start, SpanSource::Constant(key), NONE);
            continue;
        }
        let curve = curves.of(i);
        prepared.push_segment(start, segment(&curve), if meets_keys { key } else { NONE });
        let rate = ratio(1.0, track.times[i + 1] - start);
        let (before, after) = (interpolation.before, interpolation.after);
        let sides = [
            (i == 0, before, curve.start, curve.leaving),
            (i + 1 == last, after, curve.end, curve.arriving),
        ];
        for (side, (is_at_end, outside, value, slope)) in sides.into_iter().enumerate() {
            if is_at_end && outside == WrapMode::Extrapolate {
                lines[side] = prepared.exact.len() as u32;
                prepared.exact.push(line(value, slope * rate));
                held[side] = NONE;
            } else if is_at_end && !meets_keys {
                held[side] = prepared.constant(round_quat([value.x, value.y, value.z, 0.0]));
            }
        }
    }
    let spans = first_span..first_span + last;
    prepared.push_part(index, &track.times, &(0..last), spans, held);
    if lines != [NONE; 2]
        && let Some(part) = prepared.parts.last_mut()
    {
        let extension = part.extension_mut((track.times[0], track.times[last]));
        [extension.from_before, extension.from_after] = lines;
    }
}

/// Adds the velocities or accelerations of the `index`th track's vectors ([`ScalarQuantity`] has the rules at keys and
/// outside them).
pub(crate) fn add_rates(
    prepared: &mut Prepared,
    index: usize,
    track: &VectorTrack,
    request: &VectorRequest<'_>,
) {
    let (interpolation, last) = (request.interpolation, track.keys.len() - 1);
    let still = prepared.constant([0.0; 4]);
    let curves = VectorCurves::new(track, request.method, interpolation.ends);
    let rate_of = |i: usize| {
        let duration = curves.duration(i);
        let velocity = curves.of(i).derivative(duration);
        match request.quantity {
            ScalarQuantity::Acceleration => velocity.derivative(duration),
            ScalarQuantity::Value | ScalarQuantity::Velocity => velocity,
        }
    };
    let first_span = prepared.spans.len();
    let mut at_ends = [DVec3::ZERO; 2];
    for i in 0..last {
        let start = track.times[i];
        if curves.is_held(i) {
            prepared.push_span(start, SpanSource::Constant(still), NONE);
            continue;
        }
        let rate = rate_of(i);
        prepared.push_segment(start, segment(&rate), NONE);
        if i == 0 {
            at_ends[0] = rate.start;
        }
        if i + 1 == last {
            at_ends[1] = rate.end;
        }
    }
    let at_ends = at_ends.map(|rate| prepared.constant(round_quat([rate.x, rate.y, rate.z, 0.0])));
    let outside = |mode: WrapMode, at_end: u32| match mode {
        WrapMode::Hold => still,
        WrapMode::Extrapolate if request.quantity == ScalarQuantity::Acceleration => still,
        // At the ends of a copy, the values are those of the curve, not of the keys.
        WrapMode::Extrapolate | WrapMode::Loop | WrapMode::Mirror => at_end,
    };
    let held = [
        outside(interpolation.before, at_ends[0]),
        outside(interpolation.after, at_ends[1]),
    ];
    let spans = first_span..first_span + last;
    prepared.push_part(index, &track.times, &(0..last), spans, held);
    if last > 0
        && let Some(part) = prepared.parts.last_mut()
    {
        let extension = part.extension_mut((track.times[0], track.times[last]));
        extension.at_end = at_ends[1];
    }
}

/// A cubic in powers about its middle.
fn segment(cubic: &VectorCubic) -> PolynomialSegment {
    let (start, end) = (cubic.start, cubic.end);
    let (leaving, arriving) = (cubic.leaving, cubic.arriving);
    let rise = end - start;
    let powers = [
        (start + end) * 0.5 + (leaving - arriving) * 0.125,
        rise * 1.5 - (leaving + arriving) * 0.25,
        (arriving - leaving) * 0.5,
        leaving + arriving - rise * 2.0,
    ];
    let mut segment = PolynomialSegment::zeroed();
    for (coefficients, power) in segment.coefficients.iter_mut().zip(powers) {
        *coefficients = [power.x, power.y, power.z, 0.0].map(round_f32);
    }
    segment
}

/// A straight line from a point, with this slope per second.
fn line(from: DVec3, slope: DVec3) -> IntervalCurve {
    let numbers = LineNumbers {
        start: [from.x, from.y, from.z, 0.0],
        slope: [slope.x, slope.y, slope.z, 0.0],
    };
    IntervalCurve::new(&LINE, numbers.into(), Quantity::Rotation, 1.0)
}
