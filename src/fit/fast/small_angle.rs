//! Curves of small angles, in vector lanes of f32: the coefficients for the kernels are computed directly from the
//! keys; nothing is sampled or fitted.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use bytemuck::Zeroable;

use crate::fit::block::{Intervals, LANES, ROW_LEN, TrackStretch};
use crate::fit::tangent_weights::KeyWeights;
use crate::shader::{KEY_INNER, LONGEST_STEP, PolynomialSegment};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::{Lanes, MAX_LANES};
use crate::twin::small_angle::{SmallAngleCubic, small_angle_cubic};

/// The maximum number of curves that are computed one by one, because most lanes of vectors would be unused.
const CURVES_ONE_BY_ONE: usize = 6;

/// The small-angle curves of a block's intervals.
#[derive(Zeroable)]
pub(crate) struct SmallAngleLanes {
    powers: [[[f32; 4]; ROW_LEN]; 7],
    /// Whether a lane's curve has small angles only, so that `powers` are its coefficients.
    pub(crate) is_valid: [bool; ROW_LEN],
}

impl SmallAngleLanes {
    /// Computes the curves of the intervals whose squared chords, and those of both neighbours, are at
    /// most [`LONGEST_STEP`].
    pub(crate) fn find(
        &mut self,
        chords: &[f32; ROW_LEN],
        intervals: &Intervals,
        weights: &KeyWeights,
        stretches: &[TrackStretch],
    ) {
        let mut near = [false; ROW_LEN];
        for j in 1..LANES {
            near[j] = (chords[j - 1] <= LONGEST_STEP)
                & (chords[j] <= LONGEST_STEP)
                & (chords[j + 1] <= LONGEST_STEP);
        }
        self.is_valid = [false; ROW_LEN];
        if !near.contains(&true) {
            return;
        }
        let lanes = stretches.iter().flat_map(TrackStretch::lanes);
        let near: Vec<usize> = lanes.filter(|&lane| near[lane]).collect();
        let Some(last) = near.last() else {
            return;
        };
        let mut curves = SmallAnglePass {
            lanes: self,
            intervals,
            weights,
            // Step j of the loop computes the curve of lane j + 1, so `last` steps reach lane `last`.
            count: last.next_multiple_of(MAX_LANES),
        };
        if near.len() > CURVES_ONE_BY_ONE {
            in_lanes(&mut curves);
            return;
        }
        for lane in near {
            let curve = curves.curve(lane - 1, curves.neighbours(lane - 1));
            let found = &mut *curves.lanes;
            for (powers, power) in found.powers.iter_mut().zip(curve.powers) {
                powers[lane] = power;
            }
            found.is_valid[lane] = curve.is_valid;
        }
    }

    /// Writes a lane's coefficients to a segment.
    #[inline]
    pub(crate) fn write(&self, lane: usize, segment: &mut PolynomialSegment) {
        for (coefficient, power) in segment.coefficients.iter_mut().zip(&self.powers) {
            *coefficient = power[lane];
        }
    }
}

struct SmallAnglePass<'a> {
    lanes: &'a mut SmallAngleLanes,
    intervals: &'a Intervals,
    weights: &'a KeyWeights,
    /// The number of lanes to compute, rounded up to whole vectors.
    count: usize,
}

impl SmallAnglePass<'_> {
    /// The curve of lane `j + 1`, between the keys before and after it.
    #[inline(always)]
    fn curve(&self, j: usize, [before, after]: [[f32; 4]; 2]) -> SmallAngleCubic<f32> {
        let Intervals { from, to, .. } = self.intervals;
        let (first, last) = (self.weights.keys[j + 1], self.weights.keys[j + 2]);
        small_angle_cubic(before, from[j + 1], to[j + 1], after, first, last)
    }

    /// The keys before and after lane `j + 1`; a missing neighbour is replaced by the key itself.
    #[inline(always)]
    fn neighbours(&self, j: usize) -> [[f32; 4]; 2] {
        let Intervals { from, to, .. } = self.intervals;
        let (first, last) = (self.weights.keys[j + 1], self.weights.keys[j + 2]);
        [
            either(first.kind == KEY_INNER, from[j], from[j + 1]),
            either(last.kind == KEY_INNER, to[j + 2], to[j + 1]),
        ]
    }
}

impl InLanes for SmallAnglePass<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let mut powers = [[[0.0; ROW_LEN]; 4]; 7];
        let mut is_valid = [false; ROW_LEN];
        // Lane 0 is context, or a track's only interval, which has no such curve: the first curve is in
        // lane 1.
        let count = self.count.min(LANES);
        // Chosen in a loop of their own: a choice between two keys in memory would keep the
        // compiler from making vectors of the loop behind it, which then costs twice as much.
        let mut neighbours = [[[0.0; 4]; 2]; LANES];
        for j in 0..count {
            neighbours[j] = self.neighbours(j);
        }
        for j in 0..count {
            let curve = self.curve(j, neighbours[j]);
            for power in 0..7 {
                for c in 0..4 {
                    powers[power][c][j + 1] = curve.powers[power][c];
                }
            }
            is_valid[j + 1] = curve.is_valid;
        }
        self.lanes.is_valid = is_valid;
        for power in 0..7 {
            let [x, y, z, w] = &powers[power];
            for j in 0..ROW_LEN {
                self.lanes.powers[power][j] = [x[j], y[j], z[j], w[j]];
            }
        }
    }
}

#[inline(always)]
fn either(first: bool, a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [
        if first { a[0] } else { b[0] },
        if first { a[1] } else { b[1] },
        if first { a[2] } else { b[2] },
        if first { a[3] } else { b[3] },
    ]
}
