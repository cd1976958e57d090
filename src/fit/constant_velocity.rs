//! Twin of `shaders/from_keys/constant_velocity.wgsl`, one component at a time: arcs as
//! polynomials. A smooth method joins a track's only two keys by such an arc. Its coefficients are
//! Taylor's series of sine and cosine about the middle; nothing is sampled and fitted.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use crate::fit::arc_lanes::{LANES, arcs};
use crate::math::canonical::canonical;
use crate::shader::{
    PolynomialSegment, SERIES_2, SERIES_3, SERIES_4, SERIES_5, SERIES_6, SERIES_7, SERIES_8,
    SERIES_9, SERIES_10,
};
use crate::simd::dispatch::InLanes;
use crate::simd::lanes::Lanes;

/// The number of coefficients in a segment: powers 0 to 10 of the parameter.
const COEFFICIENTS: usize = 11;

/// Taylor coefficients of the cosine (even powers) and the sine (odd powers).
const SERIES: [f32; COEFFICIENTS] = [
    1.0, 1.0, SERIES_2, SERIES_3, SERIES_4, SERIES_5, SERIES_6, SERIES_7, SERIES_8, SERIES_9,
    SERIES_10,
];

/// One component of an arc as a polynomial, from that component of its middle and of its tangent
/// there; `square` is the square of the arc's angle in R⁴. Half of that angle is at most pi/4, so
/// the truncation error is at most 2e-9.
#[inline(always)]
pub(crate) fn arc_component(middle: f32, tangent: f32, square: f32) -> [f32; COEFFICIENTS] {
    let mut coefficients = [0.0; COEFFICIENTS];
    let (mut even, mut odd) = (middle, tangent);
    coefficients[0] = even;
    for k in 0..COEFFICIENTS / 2 {
        coefficients[2 * k + 1] = canonical(odd * SERIES[2 * k + 1]);
        (even, odd) = (even * square, odd * square);
        coefficients[2 * k + 2] = canonical(even * SERIES[2 * k + 2]);
    }
    coefficients
}

/// Up to [`LANES`] pairs of keys, and the polynomials of the arcs between them.
pub(crate) struct SteadyBlock {
    from: [[f32; 4]; LANES],
    to: [[f32; 4]; LANES],
    /// The place of each polynomial among the segments.
    segments: [u32; LANES],
    count: usize,
    coefficients: [[[f32; LANES]; 4]; COEFFICIENTS],
}

impl SteadyBlock {
    pub(crate) fn new() -> Self {
        let identity = [0.0, 0.0, 0.0, 1.0];
        Self {
            from: [identity; LANES],
            to: [identity; LANES],
            segments: [0; LANES],
            count: 0,
            coefficients: [[[0.0; LANES]; 4]; COEFFICIENTS],
        }
    }

    pub(crate) fn is_full(&self) -> bool {
        self.count == LANES
    }

    /// Adds two keys; the block must not be full.
    pub(crate) fn push(&mut self, [from, to]: [[f32; 4]; 2], segment: u32) {
        let lane = self.count;
        (self.from[lane], self.to[lane]) = (from, to);
        self.segments[lane] = segment;
        self.count += 1;
    }

    /// Writes the polynomials, which `run` must have computed, and empties the block.
    pub(crate) fn write(&mut self, segments: &mut [PolynomialSegment]) {
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
    fn run<L: Lanes>(&mut self) {
        let arcs = arcs::<L>(&self.from, &self.to, self.count);
        let squares = arcs.squares();
        let mut found = [[[0.0; LANES]; 4]; COEFFICIENTS];
        for c in 0..4 {
            let (middle, tangent) = (&arcs.middles[c], &arcs.tangents[c]);
            for j in 0..LANES {
                let own = arc_component(middle[j], tangent[j], squares[j]);
                for k in 0..COEFFICIENTS {
                    found[k][c][j] = own[k];
                }
            }
        }
        self.coefficients = found;
    }
}
