//! Arcs from keys, in vector lanes: one key interval to a lane, of as many tracks as
//! it takes to fill them.

use std::ops::Range;

use crate::curve::segment::Segments;
use crate::math::canonical::round_f32;
use crate::math::quaternion::{dot, unit};
use crate::method::interpolation::{Ends, Interpolation, InterpolationError, Path};
use crate::prepare::arcs::arc_lanes::{LANES, arc_anyhow, arc_in_lanes};
use crate::prepare::set::Prepare;
use crate::prepare::{NONE, Part, Prepared, Source};
use crate::shader::ArcSegment;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::tracks::set::Track;

/// Intervals that wait for their block, and what has become of them.
pub(crate) struct ArcBlock {
    from: [[f32; 4]; LANES],
    to: [[f32; 4]; LANES],
    /// Whether each starts a track.
    is_first: [bool; LANES],
    count: usize,
    /// -1 where the second key's sign is turned.
    flips: [f32; LANES],
    /// Whether any may be.
    any_flips: bool,
    /// As if each interval's first key counted as stored.
    middles: [[f32; 4]; LANES],
    tangents: [[f32; 4]; LANES],
}

impl ArcBlock {
    fn new() -> Self {
        Self {
            from: [[0.0; 4]; LANES],
            to: [[0.0; 4]; LANES],
            is_first: [false; LANES],
            count: 0,
            flips: [1.0; LANES],
            any_flips: false,
            middles: [[0.0; 4]; LANES],
            tangents: [[0.0; 4]; LANES],
        }
    }
}

impl InLanes for ArcBlock {
    /// Works out every interval that waits.
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let mut any_flips = false;
        for j in (0..self.count).step_by(L::COUNT) {
            let lanes = j..j + L::COUNT;
            let from = L::load_rotations(&self.from[j..]);
            let arcs = arc_in_lanes(from, L::load_rotations(&self.to[j..]));
            L::store_rotations(arcs.middle, &mut self.middles[lanes.clone()]);
            L::store_rotations(arcs.tangent, &mut self.tangents[lanes.clone()]);
            arcs.flip.store(&mut self.flips[lanes.clone()]);
            any_flips |= arcs.any_in_doubt || arcs.flip.any_at_most(-1.0);
            if arcs.any_in_doubt {
                for lane in lanes {
                    let (arc, flip) = arc_anyhow(self.from[lane], self.to[lane]);
                    self.middles[lane] = arc.middle;
                    self.tangents[lane] = arc.tangent;
                    self.flips[lane] = flip;
                }
            }
        }
        self.any_flips = any_flips;
    }
}

/// Prepares arcs; its block is made once for many tracks.
pub(crate) struct ArcPreparation {
    block: ArcBlock,
    ends: Ends,
    path: Path,
    /// What the signs of the keys so far make of the next.
    sign: f32,
}

impl ArcPreparation {
    pub(crate) fn new(interpolation: &Interpolation) -> Self {
        Self {
            block: ArcBlock::new(),
            ends: interpolation.ends,
            path: interpolation.path,
            sign: 1.0,
        }
    }
}

impl Prepare for ArcPreparation {
    fn add(
        &mut self,
        prepared: &mut Prepared,
        track: Track,
        index: usize,
        intervals: Range<usize>,
    ) -> Result<(), InterpolationError> {
        self.ends.check(track.keys, index)?;
        let (start, end) = (intervals.start, intervals.end);
        let long = self.long_arcs(track, index, intervals.clone())?;
        let first_key = prepared.constants.len() as u32;
        let first_span = prepared.spans.len();
        let last_key = first_key + intervals.len() as u32;
        let keys: &[[f32; 4]] = bytemuck::cast_slice(track.keys);
        prepared.constants.extend_from_slice(&keys[start..=end]);
        // Every interval has one span and one segment; a long arc has two of each.
        let segments = (prepared.segments.len() + self.block.count) as u32;
        let spans = &mut prepared.spans;
        if long.is_empty() {
            let own = &track.times[intervals.clone()];
            spans.starts.extend_from_slice(own);
            spans.keys.extend(first_key..last_key);
        } else {
            let mut halves = long.iter().peekable();
            for (key, constant) in intervals.clone().zip(first_key..) {
                let [from, to] = [track.times[key], track.times[key + 1]];
                spans.starts.push(from);
                spans.keys.push(constant);
                if halves.next_if(|half| half.key == key).is_some() {
                    spans.starts.push(from + (to - from) * 0.5);
                    spans.keys.push(NONE);
                }
            }
        }
        let count = spans.starts.len() - first_span;
        let sources = (segments..segments + count as u32).map(Source::Segment);
        spans.sources.extend(sources);
        let beyond = prepared.copies(track);
        prepared.parts.push(Part {
            track: index as u32,
            first_key: start as u32,
            spans: first_span..first_span + count,
            end: track.times[end],
            before: if start == 0 { first_key } else { NONE },
            after: if end + 1 == track.keys.len() {
                last_key
            } else {
                NONE
            },
            beyond,
        });
        if long.is_empty() {
            self.push(prepared, keys, intervals);
            return Ok(());
        }
        let mut halves = long.iter().peekable();
        for key in intervals {
            let middle = halves.next_if(|half| half.key == key);
            if let Some(half) = middle {
                let lane = self.lane(prepared);
                self.block.from[lane] = keys[key];
                self.block.to[lane] = half.middle;
                self.block.is_first[lane] = key == 0;
            }
            let lane = self.lane(prepared);
            self.block.from[lane] = middle.map_or(keys[key], |half| half.middle);
            self.block.to[lane] = keys[key + 1];
            self.block.is_first[lane] = key == 0 && middle.is_none();
        }
        Ok(())
    }

    fn finish(&mut self, prepared: &mut Prepared) -> Result<f32, InterpolationError> {
        self.flush(prepared);
        Ok(std::mem::replace(&mut self.sign, 1.0))
    }
}

/// The middle of an arc of more than half a turn, which is made of two.
struct Half {
    /// The key that the arc starts with.
    key: usize,
    middle: [f32; 4],
}

impl ArcPreparation {
    /// Where signs count as authored an arc may be up to a whole turn: such arcs among some.
    fn long_arcs(
        &self,
        track: Track,
        index: usize,
        intervals: Range<usize>,
    ) -> Result<Vec<Half>, InterpolationError> {
        let mut long = Vec::new();
        if self.path == Path::Shortest {
            return Ok(long);
        }
        for key in intervals {
            let [from, to] = [key, key + 1].map(|key| unit(track.keys[key].to_array()));
            let cosine = dot(from, to);
            if self.path.refuses(cosine) {
                let track = index;
                return Err(InterpolationError::Antipodal { track, key });
            }
            if cosine < 0.0 {
                let sum: [f64; 4] = std::array::from_fn(|c| from[c] + to[c]);
                let length = dot(sum, sum).sqrt();
                let middle = sum.map(|component| round_f32(component / length));
                long.push(Half { key, middle });
            }
        }
        Ok(long)
    }

    /// Takes intervals between these keys, none of which is long.
    fn push(&mut self, prepared: &mut Prepared, keys: &[[f32; 4]], mut intervals: Range<usize>) {
        while !intervals.is_empty() {
            if self.block.count == LANES {
                self.flush(prepared);
            }
            let own = self.block.count..LANES.min(self.block.count + intervals.len());
            let end = intervals.start + own.len();
            self.block.from[own.clone()].copy_from_slice(&keys[intervals.start..end]);
            self.block.to[own.clone()].copy_from_slice(&keys[intervals.start + 1..=end]);
            self.block.is_first[own.clone()].fill(false);
            self.block.is_first[own.start] = intervals.start == 0;
            self.block.count = own.end;
            intervals.start = end;
        }
    }

    /// The next lane that is free.
    #[inline(always)]
    fn lane(&mut self, prepared: &mut Prepared) -> usize {
        if self.block.count == LANES {
            self.flush(prepared);
        }
        self.block.count += 1;
        self.block.count - 1
    }

    fn flush(&mut self, prepared: &mut Prepared) {
        in_lanes(&mut self.block);
        let Segments::Arc(segments) = &mut prepared.segments else {
            unreachable!("the method's form")
        };
        let block = &mut self.block;
        let count = std::mem::take(&mut block.count);
        let arcs = block.middles.iter().zip(&block.tangents).take(count);
        if !block.any_flips && self.sign == 1.0 {
            segments.extend(arcs.map(|(&middle, &tangent)| ArcSegment { middle, tangent }));
            return;
        }
        let lanes = block.is_first.iter().zip(&block.flips);
        segments.extend(
            lanes
                .zip(arcs)
                .map(|((&is_first, flip), (&middle, &tangent))| {
                    let sign = if is_first { 1.0 } else { self.sign };
                    self.sign = sign * flip;
                    ArcSegment {
                        middle: middle.map(|c| c * sign),
                        tangent: tangent.map(|c| c * sign),
                    }
                }),
        );
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::simd::dispatch::tests::at_every_width;

    /// Catches an instruction set whose code fuses, reorders or divides otherwise:
    /// segments must not depend on the machine that prepared them.
    #[test]
    fn every_vector_width_prepares_the_same_bits() {
        let filled = || {
            let mut block = ArcBlock::new();
            for lane in 0..LANES - 3 {
                let step = 10.0f32.powi(-(lane as i32 % 8)) * 3.0;
                let key = Quat::from_rotation_y(lane as f32) * Quat::from_rotation_x(0.3);
                let sign = if lane % 5 == 0 { -1.0 } else { 1.0 };
                block.from[lane] = key.to_array();
                block.to[lane] = (key * Quat::from_rotation_z(step) * sign).to_array();
            }
            block.to[7] = block.from[7]; // no plane
            block.to[9] = [1.0, 0.0, 0.0, 0.0]; // in doubt
            block.from[9] = [0.0, 0.0, 0.0, 1.0];
            block.count = LANES - 3;
            in_lanes(&mut block);
            let bits = [block.middles, block.tangents].map(|all| {
                let components: &[f32] = all.as_flattened();
                components.iter().map(|c| c.to_bits()).collect::<Vec<_>>()
            });
            (bits, block.flips.map(f32::to_bits))
        };
        let results = at_every_width(filled);
        let (_, expected) = &results[0];
        let negative = |&bits: &u32| f32::from_bits(bits) < 0.0;
        assert!(expected.1.iter().any(negative) && !expected.1.iter().all(negative));
        for (width, found) in &results {
            assert!(found == expected, "{width:?}");
        }
    }
}
