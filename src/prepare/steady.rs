//! Arcs as polynomials: what smooth methods make of two keys that are alone. Taylor's
//! series of the sine and cosine about the middle are all that it takes; nothing is
//! sampled and fitted.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use super::arcs::arc;
use crate::cpu::InLanes;
use crate::numeric::{canonical, round_f32};
use crate::segment::PolynomialSegment;

/// Powers of the parameter in a segment.
const COEFFICIENTS: usize = 11;

/// 1, 1, -1/2!, -1/3!, 1/4! …: of cosine and sine in turn.
const SERIES: [f64; COEFFICIENTS] = [
    1.0,
    1.0,
    -1.0 / 2.0,
    -1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    -1.0 / 720.0,
    -1.0 / 5040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    -1.0 / 3_628_800.0,
];

/// One component of an arc whose parameter runs from -1/2 to 1/2, as a polynomial; the
/// angle in radians. Half of that is at most pi/4, and what the series leave out at most
/// 2e-9.
#[inline(always)]
pub(crate) fn arc_component(middle: f32, partner: f32, angle: f64) -> [f32; COEFFICIENTS] {
    let (middle, partner) = (f64::from(middle), f64::from(partner));
    let square = angle * angle;
    let mut coefficients = [0.0; COEFFICIENTS];
    let (mut even, mut odd) = (middle, partner * angle);
    coefficients[0] = canonical(round_f32(even));
    for k in 0..COEFFICIENTS / 2 {
        coefficients[2 * k + 1] = canonical(round_f32(odd * SERIES[2 * k + 1]));
        (even, odd) = (even * square, odd * square);
        coefficients[2 * k + 2] = canonical(round_f32(even * SERIES[2 * k + 2]));
    }
    coefficients
}

/// Intervals that wait.
const LANES: usize = 64;

/// Pairs of keys, and their polynomials.
pub(super) struct SteadyBlock {
    from: [[f32; 4]; LANES],
    to: [[f32; 4]; LANES],
    /// Where each polynomial goes among the segments.
    segments: [u32; LANES],
    count: usize,
    /// Dot products below this turn the second key's sign.
    noise: f64,
    coefficients: [[[f32; LANES]; 4]; COEFFICIENTS],
}

impl SteadyBlock {
    pub(super) fn new(noise: f64) -> Self {
        let identity = [0.0, 0.0, 0.0, 1.0];
        Self {
            from: [identity; LANES],
            to: [identity; LANES],
            segments: [0; LANES],
            count: 0,
            noise,
            coefficients: [[[0.0; LANES]; 4]; COEFFICIENTS],
        }
    }

    pub(super) fn is_full(&self) -> bool {
        self.count == LANES
    }

    /// Adds two keys; the block is not full.
    pub(super) fn push(&mut self, [from, to]: [[f32; 4]; 2], segment: u32) {
        let lane = self.count;
        (self.from[lane], self.to[lane]) = (from, to);
        self.segments[lane] = segment;
        self.count += 1;
    }

    /// Writes the polynomials, once they are worked out.
    pub(super) fn write(&mut self, segments: &mut [PolynomialSegment]) {
        for (lane, &place) in self.segments[..self.count].iter().enumerate() {
            let segment = &mut segments[place as usize];
            for (own, lanes) in segment.coefficients.iter_mut().zip(&self.coefficients) {
                let [x, y, z, w] = lanes;
                *own = [x[lane], y[lane], z[lane], w[lane]];
            }
        }
        self.count = 0;
    }
}

impl InLanes for SteadyBlock {
    #[inline(always)]
    fn run(&mut self) {
        let mut middles = [[0.0; LANES]; 4];
        let mut partners = [[0.0; LANES]; 4];
        let mut angles = [0.0; LANES];
        let count = self.count.next_multiple_of(16).min(LANES);
        let (from, to) = (&self.from, &self.to);
        for j in 0..count {
            let arc = arc(from[j], to[j], self.noise);
            angles[j] = arc.angle;
            for c in 0..4 {
                middles[c][j] = arc.middle[c];
                partners[c][j] = arc.partner[c];
            }
        }
        let mut found = [[[0.0; LANES]; 4]; COEFFICIENTS];
        for c in 0..4 {
            let (middle, partner) = (&middles[c], &partners[c]);
            for j in 0..count {
                let own = arc_component(middle[j], partner[j], angles[j]);
                for k in 0..COEFFICIENTS {
                    found[k][c][j] = own[k];
                }
            }
        }
        self.coefficients = found;
    }
}
