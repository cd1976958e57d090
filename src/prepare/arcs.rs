//! Preparation of arcs from keys in vector lanes: one key interval in each lane. A block is filled with intervals of
//! several tracks. If a device prepares the arcs, lists the intervals for it: the
//! twin of `shaders/prepare_arcs.wgsl`.

use std::ops::Range;

use bytemuck::Zeroable;

use crate::curve::options::KeySigns;
use crate::math::canonical::round_f32;
use crate::math::quaternion::{dot, unit};
use crate::prepare::prepared::Prepared;
use crate::shader::{ArcSegment, END_NEGATED, KEY_OF_INTERVAL, START_NEGATED};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::time::runs::NONE;
use crate::time::spans::{SpanSource, StoredSource};
use crate::tracks::set::TrackSet;
use crate::tracks::signs::Signs;
use crate::twin::arc_between::arc_between;

/// The maximum number of arcs that are computed together.
const BLOCK_ARCS: usize = 64;

/// Intervals that wait until their block is full, and the arcs that are computed from them.
#[derive(Zeroable)]
pub(crate) struct ArcPreparation {
    /// Whether no arc exceeds 180°.
    is_shortest: bool,
    from: [[f32; 4]; BLOCK_ARCS],
    /// The key at the end of each interval, with the sign nearer to `from`.
    to: [[f32; 4]; BLOCK_ARCS],
    count: usize,
    middles: [[f32; 4]; BLOCK_ARCS],
    tangents: [[f32; 4]; BLOCK_ARCS],
}

impl InLanes for ArcPreparation {
    /// Computes the arc of every interval that waits.
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        for j in (0..self.count).step_by(L::COUNT) {
            let lanes = j..j + L::COUNT;
            let from = L::load_rotations(&self.from[j..]);
            let to = L::load_rotations(&self.to[j..]);
            let (middle, tangent) = arc_between(from, to);
            L::store_rotations(middle, &mut self.middles[lanes.clone()]);
            L::store_rotations(tangent, &mut self.tangents[lanes]);
        }
    }
}

impl ArcPreparation {
    pub(crate) fn new(signs: KeySigns) -> Self {
        Self {
            is_shortest: signs == KeySigns::Shortest,
            ..Self::zeroed()
        }
    }

    /// Adds some intervals of the track `index` of a set, as a separate part.
    pub(crate) fn add(
        &mut self,
        prepared: &mut Prepared,
        set: &TrackSet,
        index: usize,
        intervals: Range<usize>,
    ) {
        let (times, keys) = set.times_and_keys(index);
        let keys: &[[f32; 4]] = bytemuck::cast_slice(keys);
        let first_key = prepared.constants.len() as u32;
        let first_span = prepared.spans.len();
        let last_key = first_key + intervals.len() as u32;
        let stored = &keys[intervals.start..=intervals.end];
        prepared.constants.extend_from_slice(stored);
        if self.is_shortest {
            let segments = (prepared.segments.len() + self.count) as u32;
            let indices = segments..segments + intervals.len() as u32;
            let spans = &mut prepared.spans;
            spans.starts.extend_from_slice(&times[intervals.clone()]);
            let sources = indices.map(|index| StoredSource::from(SpanSource::Segment(index)));
            spans.sources.extend(sources);
            spans.keys.extend(first_key..last_key);
            let signs = set.signs(index);
            if prepared.segments.are_arcs_listed {
                let listed = listed(signs, intervals.clone(), first_key);
                prepared.segments.intervals.extend(listed);
            } else {
                self.push(prepared, keys, signs, intervals.clone());
            }
        } else {
            for (key, constant) in intervals.clone().zip(first_key..) {
                let [start, end] = [times[key], times[key + 1]];
                let [from, to] = [keys[key], keys[key + 1]];
                if let Some(middle) = middle_of_long([from, to]) {
                    let halfway = start + (end - start) * 0.5;
                    self.push_arc(prepared, start, constant, [from, middle]);
                    self.push_arc(prepared, halfway, NONE, [middle, to]);
                } else {
                    self.push_arc(prepared, start, constant, [from, to]);
                }
            }
        }
        let spans = first_span..prepared.spans.len();
        prepared.push_part(index, times, &intervals, spans, [first_key, last_key]);
    }

    /// Adds intervals between these keys, none of which exceeds 180°.
    fn push(
        &mut self,
        prepared: &mut Prepared,
        keys: &[[f32; 4]],
        signs: Signs<'_>,
        mut intervals: Range<usize>,
    ) {
        while !intervals.is_empty() {
            if self.count == BLOCK_ARCS {
                self.finish(prepared);
            }
            let lanes = self.count..BLOCK_ARCS.min(self.count + intervals.len());
            let (start, end) = (intervals.start, intervals.start + lanes.len());
            signs.copy(keys, start..end, &mut self.from[lanes.clone()]);
            signs.copy(keys, start + 1..end + 1, &mut self.to[lanes.clone()]);
            self.count = lanes.end;
            intervals.start = end;
        }
    }

    /// Adds one arc as the next span.
    fn push_arc(
        &mut self,
        prepared: &mut Prepared,
        start: f64,
        key: u32,
        [from, to]: [[f32; 4]; 2],
    ) {
        if self.count == BLOCK_ARCS {
            self.finish(prepared);
        }
        let segment = (prepared.segments.len() + self.count) as u32;
        prepared.push_span(start, SpanSource::Segment(segment), key);
        (self.from[self.count], self.to[self.count]) = (from, to);
        self.count += 1;
    }

    /// Finishes the segments of all intervals that wait.
    pub(crate) fn finish(&mut self, prepared: &mut Prepared) {
        in_lanes(self);
        let count = std::mem::take(&mut self.count);
        let arcs = self.middles.iter().zip(&self.tangents);
        let arcs = arcs.map(|(&middle, &tangent)| ArcSegment { middle, tangent });
        prepared.segments.arcs.extend(arcs.take(count));
    }
}

/// Intervals of a track as the device reads them, the first of which begins with the constant `first_key`.
fn listed(signs: Signs<'_>, intervals: Range<usize>, first_key: u32) -> impl Iterator<Item = u32> {
    let is_any_negated = signs.between(intervals.start..intervals.end + 1).any();
    intervals.zip(first_key..).map(move |(key, constant)| {
        let flag = |key, flag| match is_any_negated && signs.is_negated(key) {
            true => flag,
            false => 0,
        };
        constant | flag(key, START_NEGATED) | flag(key + 1, END_NEGATED)
    })
}

/// The arcs that a group lists for a device to compute; empty if it has computed them.
pub(crate) fn listed_arcs(prepared: &Prepared) -> Vec<ArcSegment> {
    let intervals = prepared.segments.intervals.iter();
    intervals
        .map(|&interval| listed_arc(prepared, interval))
        .collect()
}

fn listed_arc(prepared: &Prepared, interval: u32) -> ArcSegment {
    let key = (interval & KEY_OF_INTERVAL) as usize;
    let signed = |key: usize, flag| match interval & flag {
        0 => prepared.constants[key],
        _ => prepared.constants[key].map(|component| -component),
    };
    let [from, to] = [signed(key, START_NEGATED), signed(key + 1, END_NEGATED)];
    let (middle, tangent) = arc_between(from, to);
    ArcSegment { middle, tangent }
}

/// An arc of a group, which is computed now if it was only listed.
pub(crate) fn arc_at(prepared: &Prepared, index: u32) -> ArcSegment {
    let segments = &prepared.segments;
    match segments.are_arcs_listed {
        true => listed_arc(prepared, segments.intervals[index as usize]),
        false => segments.arcs[index as usize],
    }
}

/// The middle of an arc between two keys if the arc exceeds 180°; then it becomes two arcs.
fn middle_of_long(keys: [[f32; 4]; 2]) -> Option<[f32; 4]> {
    let [from, to] = keys.map(unit);
    (dot(from, to) < 0.0).then(|| {
        let sum: [f64; 4] = std::array::from_fn(|c| from[c] + to[c]);
        let length = dot(sum, sum).sqrt();
        sum.map(|component| round_f32(component / length))
    })
}
