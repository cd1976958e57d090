//! Arcs from keys, in vector lanes: one key interval to a lane, of as many tracks as
//! it takes to fill them.

use std::ops::Range;

use bytemuck::Zeroable;
use glam::Quat;

use super::set::Prepare;
use super::{NONE, Part, Prepared, Source};
use crate::branchless::{angle_by_sine, dot, norm, unit};
use crate::cpu::{InLanes, in_lanes};
use crate::method::{Ends, Interpolation, InterpolationError, Path};
use crate::numeric::{canonical, round_f32};
use crate::segment::{ArcSegment, Segments};
use crate::tracks::Track;

/// Intervals worked out together.
const LANES: usize = 64;

/// Intervals that wait for their block, and what has become of them.
pub(crate) struct ArcBlock {
    /// Plain numbers: a vector type would keep the loop from being vectorised.
    from: [[f32; 4]; LANES],
    to: [[f32; 4]; LANES],
    /// The track and the key that each interval starts with.
    places: [(usize, usize); LANES],
    count: usize,
    /// Dot products below this turn the second key's sign.
    noise: f64,
    /// Inner products of the two keys.
    dots: [f64; LANES],
    angles: [f64; LANES],
    middles: [[f32; LANES]; 4],
    partners: [[f32; LANES]; 4],
    /// The sign of each interval's first key after those before it in its track.
    signs: [f32; LANES],
    /// With their signs, and a lane's components together.
    signed_middles: [[f32; 4]; LANES],
    signed_partners: [[f32; 4]; LANES],
}

impl ArcBlock {
    /// Lanes to work out: whole vectors of them.
    #[inline(always)]
    fn whole(&self) -> usize {
        self.count.next_multiple_of(16).min(LANES)
    }

    fn new(noise: f64) -> Self {
        Self {
            from: [[0.0; 4]; LANES],
            to: [[0.0; 4]; LANES],
            places: [(0, 0); LANES],
            count: 0,
            noise,
            dots: [0.0; LANES],
            angles: [0.0; LANES],
            middles: [[0.0; LANES]; 4],
            partners: [[0.0; LANES]; 4],
            signs: [1.0; LANES],
            signed_middles: [[0.0; 4]; LANES],
            signed_partners: [[0.0; 4]; LANES],
        }
    }
}

impl InLanes for ArcBlock {
    /// Works out every interval that waits.
    #[inline(always)]
    fn run(&mut self) {
        let noise = self.noise;
        // Arrays of its own: the compiler must see that they do not overlap.
        let (from, to) = (&self.from, &self.to);
        let (mut dots, mut angles) = ([0.0; LANES], [0.0; LANES]);
        let [mut mx, mut my, mut mz, mut mw] = [[0.0; LANES]; 4];
        let [mut px, mut py, mut pz, mut pw] = [[0.0; LANES]; 4];
        for j in 0..self.whole() {
            let arc = arc(from[j], to[j], noise);
            dots[j] = arc.dot;
            angles[j] = arc.angle;
            [mx[j], my[j], mz[j], mw[j]] = arc.middle;
            [px[j], py[j], pz[j], pw[j]] = arc.partner;
        }
        (self.dots, self.angles) = (dots, angles);
        self.middles = [mx, my, mz, mw];
        self.partners = [px, py, pz, pw];
    }
}

/// The great circle between two keys.
pub(crate) struct Arc {
    /// Their inner product as stored.
    pub(crate) dot: f64,
    /// The angle between them once their signs are aligned.
    pub(crate) angle: f64,
    /// As in [`ArcSegment`].
    pub(crate) middle: [f32; 4],
    pub(crate) partner: [f32; 4],
}

/// The arc between two keys; dot products below `noise` turn the second one's sign.
#[inline(always)]
pub(crate) fn arc(from: [f32; 4], to: [f32; 4], noise: f64) -> Arc {
    let a = unit(from);
    let b = unit(to);
    let dot = dot(a, b);
    let flip = if dot < noise { -1.0 } else { 1.0 };
    let b = [b[0] * flip, b[1] * flip, b[2] * flip, b[3] * flip];
    let sum = [b[0] + a[0], b[1] + a[1], b[2] + a[2], b[3] + a[3]];
    let difference = [b[0] - a[0], b[1] - a[1], b[2] - a[2], b[3] - a[3]];
    // 2 cos and 2 sin of half the angle between them: never acos, which loses half
    // of the digits of a small one.
    let cosine = norm(sum);
    let chord = norm(difference);
    let to_unit = 1.0 / cosine;
    // Equal keys have no plane; with an angle of 0 any partner will do.
    let to_partner = if chord > 0.0 { 1.0 / chord } else { 0.0 };
    Arc {
        dot,
        angle: chord * angle_by_sine(1.0 - 0.5 * cosine),
        middle: [
            round_f32(sum[0] * to_unit),
            round_f32(sum[1] * to_unit),
            round_f32(sum[2] * to_unit),
            round_f32(sum[3] * to_unit),
        ],
        partner: [
            round_f32(difference[0] * to_partner),
            round_f32(difference[1] * to_partner),
            round_f32(difference[2] * to_partner),
            round_f32(difference[3] * to_partner),
        ],
    }
}

/// Gives every lane its sign.
struct Signed<'a>(&'a mut ArcBlock);

impl InLanes for Signed<'_> {
    #[inline(always)]
    fn run(&mut self) {
        let count = self.0.whole();
        let (mut middles, mut partners) = ([[0.0; 4]; LANES], [[0.0; 4]; LANES]);
        let signs = &self.0.signs;
        let [x, y, z, w] = &self.0.middles;
        for j in 0..count {
            middles[j] = signed(signs[j], [x[j], y[j], z[j], w[j]]);
        }
        let [x, y, z, w] = &self.0.partners;
        for j in 0..count {
            partners[j] = signed(signs[j], [x[j], y[j], z[j], w[j]]);
        }
        (self.0.signed_middles, self.0.signed_partners) = (middles, partners);
    }
}

/// The same rotation with another sign.
#[inline(always)]
pub(crate) fn signed(sign: f32, [x, y, z, w]: [f32; 4]) -> [f32; 4] {
    [
        canonical(x * sign),
        canonical(y * sign),
        canonical(z * sign),
        canonical(w * sign),
    ]
}

/// Prepares arcs; its block is made once for many tracks.
pub(crate) struct ArcPreparation {
    block: ArcBlock,
    path: Path,
    ends: Ends,
    /// What the signs of the keys so far make of the next.
    sign: f32,
}

impl ArcPreparation {
    pub(crate) fn new(interpolation: &Interpolation) -> Self {
        Self {
            block: ArcBlock::new(interpolation.path.flips_below()),
            path: interpolation.path,
            ends: interpolation.ends,
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
        let first_key = prepared.constants.len() as u32;
        let first_span = prepared.spans.len();
        let last_key = first_key + intervals.len() as u32;
        let keys = track.keys[start..=end].iter();
        prepared.constants.extend(keys.map(Quat::to_array));
        // Every interval has one span and one segment.
        let segments = (prepared.segments.len() + self.block.count) as u32;
        let spans = &mut prepared.spans;
        let count = intervals.len() as u32;
        spans
            .starts
            .extend_from_slice(&track.times[intervals.clone()]);
        spans.keys.extend(first_key..last_key);
        let sources = (segments..segments + count).map(Source::Segment);
        spans.sources.extend(sources);
        let beyond = prepared.copies(track);
        prepared.parts.push(Part {
            track: index,
            spans: first_span..first_span + intervals.len(),
            end: track.times[end],
            before: if start == 0 { first_key } else { NONE },
            after: if end + 1 == track.keys.len() {
                last_key
            } else {
                NONE
            },
            beyond,
        });
        for key in intervals {
            if self.block.count == LANES {
                self.flush(prepared)?;
            }
            let lane = self.block.count;
            self.block.from[lane] = track.keys[key].to_array();
            self.block.to[lane] = track.keys[key + 1].to_array();
            self.block.places[lane] = (index, key);
            self.block.count += 1;
        }
        Ok(())
    }

    fn finish(&mut self, prepared: &mut Prepared) -> Result<f32, InterpolationError> {
        self.flush(prepared)?;
        Ok(self.sign)
    }
}

impl ArcPreparation {
    fn flush(&mut self, prepared: &mut Prepared) -> Result<(), InterpolationError> {
        in_lanes(&mut self.block);
        let block = &mut self.block;
        let count = block.count;
        let refused = |&dot: &f64| self.path.refuses(dot);
        if let Some(lane) = block.dots[..count].iter().position(refused) {
            let (track, key) = block.places[lane];
            return Err(InterpolationError::Antipodal { track, key });
        }
        for lane in 0..count {
            if block.places[lane].1 == 0 {
                self.sign = 1.0;
            }
            block.signs[lane] = self.sign;
            if block.dots[lane] < block.noise {
                self.sign = -self.sign;
            }
        }
        in_lanes(&mut Signed(block));
        let Segments::Arc(segments) = &mut prepared.segments else {
            unreachable!("the method's form")
        };
        let start = segments.len();
        segments.resize(start + count, ArcSegment::zeroed());
        let middles = block.signed_middles.iter().zip(&block.signed_partners);
        for (segment, (&middle, &partner)) in segments[start..].iter_mut().zip(middles) {
            *segment = ArcSegment { middle, partner };
        }
        let angles = &block.angles[..count];
        prepared.spans.extents.extend_from_slice(angles);
        block.count = 0;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::at_every_width;

    /// Catches an instruction set whose code fuses, reorders or divides otherwise:
    /// segments must not depend on the machine that prepared them.
    #[test]
    fn every_vector_width_prepares_the_same_bits() {
        let filled = || {
            let mut block = ArcBlock::new(Path::Shortest.flips_below());
            for lane in 0..LANES - 3 {
                let step = 10.0f32.powi(-(lane as i32 % 8)) * 3.0;
                let key = Quat::from_rotation_y(lane as f32) * Quat::from_rotation_x(0.3);
                let sign = if lane % 5 == 0 { -1.0 } else { 1.0 };
                block.from[lane] = key.to_array();
                block.to[lane] = (key * Quat::from_rotation_z(step) * sign).to_array();
            }
            block.to[7] = block.from[7]; // no plane
            block.count = LANES - 3;
            in_lanes(&mut block);
            let components = [block.middles, block.partners].concat();
            let bits: Vec<u32> = components.concat().iter().map(|c| c.to_bits()).collect();
            let dots = block.dots.map(f64::to_bits);
            (bits, block.angles.map(f64::to_bits), dots)
        };
        let results = at_every_width(filled);
        let (_, expected) = &results[0];
        let negative = |&bits: &u64| f64::from_bits(bits) < 0.0;
        assert!(expected.2.iter().any(negative) && !expected.2.iter().all(negative));
        for (width, found) in &results {
            assert!(found == expected, "{width:?}");
        }
    }
}
