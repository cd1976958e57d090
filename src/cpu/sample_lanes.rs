//! What arcs with fewer samples than keys take from lanes: frames of keys, signs that
//! are not in doubt, and the samples themselves.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use super::dispatch::InLanes;
use super::evaluate::canonical;
use super::evaluate::{Affine, one};
use super::evaluate_polynomial::component;
use crate::frame_clock::{FrameClock, InFrames, finite_scale, in_frames};
use crate::numeric::{round_f32, whole_number};
use crate::prepare::{arc, arc_component, signed};
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
    /// Whether arcs are evaluated as polynomials, as two keys that are alone are by
    /// smooth methods. Their signs are as stored.
    pub(super) as_polynomials: bool,
    /// Where each rotation goes.
    pub(super) outputs: [usize; LANES],
    pub(super) count: usize,
    pub(super) rotations: [[f32; 4]; LANES],
}

impl InLanes for SampleBlock {
    #[inline(always)]
    fn run(&mut self) {
        if self.as_polynomials {
            self.polynomials();
        } else {
            self.arcs();
        }
    }
}

/// How a sample's parameter follows from its place.
struct Parameter {
    distance: f32,
    affine: Affine,
}

impl SampleBlock {
    /// Lanes to work out: whole vectors of them.
    #[inline(always)]
    fn whole(&self) -> usize {
        self.count.next_multiple_of(16).min(LANES)
    }

    /// As the schedule has it, of a parameter that runs through `extent`.
    #[inline(always)]
    fn parameter(&self, lane: usize, extent: f64) -> Parameter {
        let (start, end, place) = (self.starts[lane], self.ends[lane], self.places[lane]);
        let InFrames {
            whole,
            scale,
            offset,
        } = in_frames(start, end, extent);
        let seconds = end - start;
        let middle = start + seconds * 0.5;
        if self.frames {
            Parameter {
                distance: (place - whole) as f32,
                affine: Affine { scale, offset },
            }
        } else {
            Parameter {
                distance: round_f32(place - middle),
                affine: Affine {
                    scale: finite_scale(extent / seconds),
                    offset: 0.0,
                },
            }
        }
    }

    #[inline(always)]
    fn arcs(&mut self) {
        let mut parameters = [[0.0; LANES]; 3];
        let mut middles = [[0.0; LANES]; 4];
        let mut partners = [[0.0; LANES]; 4];
        let [distances, scales, offsets] = &mut parameters;
        for j in 0..self.whole() {
            let arc = arc(self.from[j], self.to[j], self.noise);
            let Parameter { distance, affine } = self.parameter(j, arc.angle);
            (distances[j], scales[j], offsets[j]) = (distance, affine.scale, affine.offset);
            for c in 0..4 {
                middles[c][j] = arc.middle[c];
                partners[c][j] = arc.partner[c];
            }
        }
        let mut found = [[0.0; LANES]; 4];
        for j in 0..self.whole() {
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
        self.keep(&found);
    }

    #[inline(always)]
    fn polynomials(&mut self) {
        let mut parameters = [0.0; LANES];
        let mut middles = [[0.0; LANES]; 4];
        let mut partners = [[0.0; LANES]; 4];
        let mut angles = [0.0; LANES];
        for j in 0..self.whole() {
            let arc = arc(self.from[j], self.to[j], self.noise);
            let Parameter { distance, affine } = self.parameter(j, 1.0);
            parameters[j] = distance * affine.scale + affine.offset;
            angles[j] = arc.angle;
            for c in 0..4 {
                middles[c][j] = arc.middle[c];
                partners[c][j] = arc.partner[c];
            }
        }
        let mut found = [[0.0; LANES]; 4];
        for c in 0..4 {
            let (middle, partner, lanes) = (&middles[c], &partners[c], &mut found[c]);
            for j in 0..self.whole() {
                let own = arc_component(middle[j], partner[j], angles[j]);
                lanes[j] = canonical(component(|power| own[power], parameters[j]));
            }
        }
        self.keep(&found);
    }

    /// Components side by side to rotations.
    #[inline(always)]
    fn keep(&mut self, [x, y, z, w]: &[[f32; LANES]; 4]) {
        let mut rotations = [[0.0; 4]; LANES];
        for j in 0..self.whole() {
            rotations[j] = [x[j], y[j], z[j], w[j]];
        }
        self.rotations = rotations;
    }
}

/// Where intervals start, in frames.
pub(super) struct Boundaries {
    pub(super) times: [f64; LANES],
    pub(super) count: usize,
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
        // Whole vectors, or those left over would be done one by one.
        let count = self.count.next_multiple_of(8).min(LANES);
        for j in 0..count {
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
