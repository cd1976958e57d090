//! What arcs with fewer samples than keys take from lanes: frames of keys, signs that
//! are not in doubt, and the samples themselves.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use super::dispatch::InLanes;
use super::evaluate::{Affine, one};
use crate::frame_clock::{FrameClock, InFrames, finite_scale, in_frames};
use crate::numeric::{round_f32, whole_number};
use crate::prepare::{arc, signed};
use crate::segment::ArcSegment;

/// Samples, or intervals, worked out together.
pub(super) const LANES: usize = 64;

/// Samples that wait.
pub(super) struct SampleBlock {
    pub(super) from: [[f32; 4]; LANES],
    pub(super) to: [[f32; 4]; LANES],
    pub(super) signs: [f32; LANES],
    /// Where the interval starts and ends, and where the sample is: frames, or seconds.
    pub(super) starts: [f64; LANES],
    pub(super) ends: [f64; LANES],
    pub(super) places: [f64; LANES],
    /// Whether those are frames.
    pub(super) frames: bool,
    /// Dot products below this turn the second key's sign.
    pub(super) noise: f64,
    /// Where each rotation goes.
    pub(super) outputs: [usize; LANES],
    pub(super) count: usize,
    pub(super) rotations: [[f32; 4]; LANES],
}

impl InLanes for SampleBlock {
    #[inline(always)]
    fn run(&mut self) {
        let count = self.count.next_multiple_of(16).min(LANES);
        let mut parameters = [[0.0; LANES]; 3];
        let mut middles = [[0.0; LANES]; 4];
        let mut partners = [[0.0; LANES]; 4];
        let [distances, scales, offsets] = &mut parameters;
        let frames = self.frames;
        for j in 0..count {
            let arc = arc(self.from[j], self.to[j], self.noise);
            let (start, end, place) = (self.starts[j], self.ends[j], self.places[j]);
            let InFrames {
                whole,
                scale,
                offset,
            } = in_frames(start, end, arc.angle);
            let seconds = end - start;
            let middle = start + seconds * 0.5;
            distances[j] = if frames {
                (place - whole) as f32
            } else {
                round_f32(place - middle)
            };
            scales[j] = if frames {
                scale
            } else {
                finite_scale(arc.angle / seconds)
            };
            offsets[j] = if frames { offset } else { 0.0 };
            for c in 0..4 {
                middles[c][j] = arc.middle[c];
                partners[c][j] = arc.partner[c];
            }
        }
        let mut found = [[0.0; LANES]; 4];
        for j in 0..count {
            let sign = self.signs[j];
            let [x, y, z, w] = &middles;
            let middle = signed(sign, [x[j], y[j], z[j], w[j]]);
            let [x, y, z, w] = &partners;
            let partner = signed(sign, [x[j], y[j], z[j], w[j]]);
            let affine = Affine {
                scale: scales[j],
                offset: offsets[j],
            };
            let q = one(&ArcSegment { middle, partner }, affine, distances[j]);
            for c in 0..4 {
                found[c][j] = q[c];
            }
        }
        let mut rotations = [[0.0; 4]; LANES];
        let [x, y, z, w] = &found;
        for j in 0..count {
            rotations[j] = [x[j], y[j], z[j], w[j]];
        }
        self.rotations = rotations;
    }
}

/// Where intervals start, in frames.
pub(super) struct Boundaries {
    pub(super) times: [f64; LANES],
    pub(super) clock: Option<FrameClock>,
    pub(super) frames: [f64; LANES],
    /// The first whole frame not before each.
    pub(super) firsts: [i64; LANES],
    /// Whether that is the boundary itself: 1 or 0.
    pub(super) whole: [i64; LANES],
}

impl InLanes for Boundaries {
    #[inline(always)]
    fn run(&mut self) {
        let Some(clock) = self.clock else { return };
        let mut frames = [0.0; LANES];
        let (mut firsts, mut whole) = ([0; LANES], [0; LANES]);
        for j in 0..LANES {
            let boundary = clock.boundary(self.times[j]);
            frames[j] = boundary.frame;
            firsts[j] = whole_number(within(boundary.first));
            whole[j] = i64::from(boundary.first == boundary.frame);
        }
        (self.frames, self.firsts, self.whole) = (frames, firsts, whole);
    }
}

/// Frames as far away as no sample is.
#[inline(always)]
fn within(frame: f64) -> f64 {
    const FAR: f64 = (1u64 << 50) as f64;
    let below = if frame < FAR { frame } else { FAR };
    if below > -FAR { below } else { -FAR }
}

/// Inner products of neighbouring keys, in f32: good enough to see that a sign is not
/// in doubt.
pub(super) struct Dots {
    pub(super) keys: [[f32; 4]; LANES + 1],
    /// Intervals between them.
    pub(super) count: usize,
    pub(super) dots: [f32; LANES],
    /// How many are near 0, or below.
    pub(super) doubtful: u32,
}

/// What f32 makes of an inner product is within 1e-6 of it.
pub(super) const IN_DOUBT: f32 = 1e-5;

impl InLanes for Dots {
    #[inline(always)]
    fn run(&mut self) {
        let mut dots = [0.0; LANES];
        let mut doubtful = 0;
        for j in 0..self.count.min(LANES) {
            let (a, b) = (self.keys[j], self.keys[j + 1]);
            let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
            doubtful += u32::from(dot <= IN_DOUBT);
            dots[j] = dot;
        }
        (self.dots, self.doubtful) = (dots, doubtful);
    }
}
