//! Prepares arcs from keys in vector lanes: one key interval to a lane, of as many tracks as it
//! takes to fill a block.

use std::ops::Range;

use crate::curve::options::{Ends, InterpolationError, Path};
use crate::fit::arc_lanes::LANES;
use crate::math::canonical::round_f32;
use crate::math::quaternion::{dot, unit};
use crate::method::interpolation::Interpolation;
use crate::prepare::preparation::Prepare;
use crate::prepare::prepared::Prepared;
use crate::shader::ArcSegment;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::time::spans::{NONE, Source};
use crate::tracks::set::{Track, TrackSet};
use crate::tracks::signs::Signs;
use crate::twin::arc_between::arc_between;

/// Intervals that wait for their block, and the arcs that they become.
struct ArcBlock {
    from: [[f32; 4]; LANES],
    /// The key at the end of each interval, in the sign nearer to `from`.
    to: [[f32; 4]; LANES],
    count: usize,
    middles: [[f32; 4]; LANES],
    tangents: [[f32; 4]; LANES],
}

impl ArcBlock {
    fn new() -> Self {
        Self {
            from: [[0.0; 4]; LANES],
            to: [[0.0; 4]; LANES],
            count: 0,
            middles: [[0.0; 4]; LANES],
            tangents: [[0.0; 4]; LANES],
        }
    }
}

impl InLanes for ArcBlock {
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

/// Prepares arcs; its block is made once for many tracks.
pub(crate) struct ArcPreparation {
    block: ArcBlock,
    ends: Ends,
    path: Path,
}

impl ArcPreparation {
    pub(crate) fn new(interpolation: &Interpolation) -> Self {
        Self {
            block: ArcBlock::new(),
            ends: interpolation.ends,
            path: interpolation.path,
        }
    }
}

impl Prepare for ArcPreparation {
    fn add(
        &mut self,
        prepared: &mut Prepared,
        set: &TrackSet,
        index: usize,
        intervals: Range<usize>,
    ) -> Result<(), InterpolationError> {
        let track = set.track(index);
        self.ends.check(track.keys, index)?;
        let (start, end) = (intervals.start, intervals.end);
        self.path.check(track.keys, intervals.clone(), index)?;
        let long = self.long_arcs(track, intervals.clone());
        let first_key = prepared.constants.len() as u32;
        let first_span = prepared.spans.len();
        let last_key = first_key + intervals.len() as u32;
        let keys: &[[f32; 4]] = bytemuck::cast_slice(track.keys);
        prepared.constants.extend_from_slice(&keys[start..=end]);
        // Every interval has one span and one segment; a long arc has two of each.
        let segments = (prepared.segments.len() + self.block.count) as u32;
        if long.is_empty() {
            let own = &track.times[intervals.clone()];
            prepared.spans.starts.extend_from_slice(own);
            prepared.spans.keys.extend(first_key..last_key);
            let signs = self.path.signs(set, index);
            self.push(prepared, keys, signs, intervals.clone());
        } else {
            let mut halves = long.iter().peekable();
            for (key, constant) in intervals.clone().zip(first_key..) {
                let [from, to] = [track.times[key], track.times[key + 1]];
                prepared.spans.starts.push(from);
                prepared.spans.keys.push(constant);
                let mut start = keys[key];
                if let Some(half) = halves.next_if(|half| half.key == key) {
                    prepared.spans.starts.push(from + (to - from) * 0.5);
                    prepared.spans.keys.push(NONE);
                    self.push_arc(prepared, start, half.middle);
                    start = half.middle;
                }
                self.push_arc(prepared, start, keys[key + 1]);
            }
        }
        let spans = &mut prepared.spans;
        let count = spans.starts.len() - first_span;
        let sources = (segments..segments + count as u32).map(Source::Segment);
        spans.sources.extend(sources);
        let spans = first_span..first_span + count;
        prepared.push_part(index, track.times, &intervals, spans, [first_key, last_key]);
        Ok(())
    }

    fn finish(&mut self, prepared: &mut Prepared) {
        self.flush(prepared);
    }
}

/// The middle of an arc of more than half a turn, which becomes two arcs.
struct Half {
    /// The key that the arc starts with.
    key: usize,
    middle: [f32; 4],
}

impl ArcPreparation {
    /// The arcs of more than half a turn among some intervals. They occur only on
    /// [`Path::AsAuthored`], where an arc may be up to a whole turn.
    fn long_arcs(&self, track: Track, intervals: Range<usize>) -> Vec<Half> {
        let mut long = Vec::new();
        if self.path == Path::Shortest {
            return long;
        }
        for key in intervals {
            let [from, to] = [key, key + 1].map(|key| unit(track.keys[key].to_array()));
            if dot(from, to) < 0.0 {
                let sum: [f64; 4] = std::array::from_fn(|c| from[c] + to[c]);
                let length = dot(sum, sum).sqrt();
                let middle = sum.map(|component| round_f32(component / length));
                long.push(Half { key, middle });
            }
        }
        long
    }

    /// Takes intervals between these keys, none of more than half a turn.
    fn push(
        &mut self,
        prepared: &mut Prepared,
        keys: &[[f32; 4]],
        signs: Signs<'_>,
        mut intervals: Range<usize>,
    ) {
        while !intervals.is_empty() {
            if self.block.count == LANES {
                self.flush(prepared);
            }
            let own = self.block.count..LANES.min(self.block.count + intervals.len());
            let (start, end) = (intervals.start, intervals.start + own.len());
            let (from, to) = (start..end, start + 1..end + 1);
            let signs = [&from, &to].map(|keys| signs.between(keys.clone()));
            signs[0].copy(&keys[from], &mut self.block.from[own.clone()]);
            signs[1].copy(&keys[to], &mut self.block.to[own.clone()]);
            self.block.count = own.end;
            intervals.start = end;
        }
    }

    fn push_arc(&mut self, prepared: &mut Prepared, from: [f32; 4], to: [f32; 4]) {
        if self.block.count == LANES {
            self.flush(prepared);
        }
        (
            self.block.from[self.block.count],
            self.block.to[self.block.count],
        ) = (from, to);
        self.block.count += 1;
    }

    fn flush(&mut self, prepared: &mut Prepared) {
        in_lanes(&mut self.block);
        let count = std::mem::take(&mut self.block.count);
        let arcs = self.block.middles.iter().zip(&self.block.tangents);
        let arcs = arcs.map(|(&middle, &tangent)| ArcSegment { middle, tangent });
        prepared.segments.arcs.extend(arcs.take(count));
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::simd::dispatch::tests::same_at_every_width;

    /// Catches an instruction set whose code fuses, reorders or divides otherwise:
    /// segments must not depend on the machine that prepared them.
    #[test]
    fn every_vector_width_prepares_the_same_bits() {
        same_at_every_width(|| {
            let mut block = ArcBlock::new();
            for lane in 0..LANES - 3 {
                let step = 10.0f32.powi(-(lane as i32 % 8)) * 3.0;
                let key = Quat::from_rotation_y(lane as f32) * Quat::from_rotation_x(0.3);
                block.from[lane] = key.to_array();
                block.to[lane] = (key * Quat::from_rotation_z(step)).to_array();
            }
            block.to[7] = block.from[7]; // no plane
            block.to[9] = [1.0, 0.0, 0.0, 0.0]; // half a turn
            block.from[9] = [0.0, 0.0, 0.0, 1.0];
            block.count = LANES - 3;
            in_lanes(&mut block);
            [block.middles, block.tangents].map(|all| {
                let components: &[f32] = all.as_flattened();
                components.iter().map(|c| c.to_bits()).collect::<Vec<_>>()
            })
        });
    }
}
