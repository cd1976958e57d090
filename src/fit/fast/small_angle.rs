//! Curves of small angles, in vector lanes of f32: the coefficients for the kernels are computed directly from the
//! keys; nothing is sampled or fitted.

use bytemuck::Zeroable;

use crate::fit::block::{Intervals, LANES, ROW_LEN, TrackStretch};
use crate::fit::tangent_weights::KeyWeights;
use crate::shader::{KEY_INNER, LONGEST_STEP, PolynomialSegment};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::{Choice, Lanes, MAX_LANES};
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
            let curve = curves.curve(lane);
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
    /// The curve of a lane, between the keys before and after it.
    fn curve(&self, lane: usize) -> SmallAngleCubic<f32> {
        let Intervals { from, to, .. } = self.intervals;
        let [first, last] = [lane, lane + 1].map(|key| bytemuck::cast(self.weights.keys[key]));
        let [start, end] = [from[lane], to[lane]];
        let before = inner_or(first, from[lane - 1], start);
        let after = inner_or(last, to[lane + 1], end);
        small_angle_cubic(before, start, end, after, first.into(), last.into())
    }
}

impl InLanes for SmallAnglePass<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let Intervals { from, to, .. } = self.intervals;
        let mut is_valid = [0.0; ROW_LEN];
        // The first curve is in lane 1. The interval in lane 0 has no such curve: it is the context of lane 1, or the
        // only interval of its track.
        for j in (0..self.count.min(LANES)).step_by(L::COUNT) {
            let lanes = j + 1..j + 1 + L::COUNT;
            let [first, last]: [[L; 4]; 2] = [self.weights.load(j + 1), self.weights.load(j + 2)];
            let start = L::load_rotations(&from[j + 1..]);
            let end = L::load_rotations(&to[j + 1..]);
            let before = inner_or(first, L::load_rotations(&from[j..]), start);
            let after = inner_or(last, L::load_rotations(&to[j + 2..]), end);
            let curve = small_angle_cubic(before, start, end, after, first.into(), last.into());
            for (powers, power) in self.lanes.powers.iter_mut().zip(curve.powers) {
                L::store_rotations(power, &mut powers[lanes.clone()]);
            }
            let flags = L::choose(curve.is_valid, L::all(1.0), L::all(0.0));
            flags.store(&mut is_valid[lanes]);
        }
        for (is_valid, flag) in self.lanes.is_valid.iter_mut().zip(is_valid) {
            *is_valid = flag == 1.0;
        }
    }
}

/// The neighbour of a key with these weights, if it has one, else the key itself.
#[inline(always)]
pub(crate) fn inner_or<N: Choice>(weights: [N; 4], neighbour: [N; 4], key: [N; 4]) -> [N; 4] {
    let is_inner = weights[3].equals(N::all(KEY_INNER));
    [
        N::choose(is_inner, neighbour[0], key[0]),
        N::choose(is_inner, neighbour[1], key[1]),
        N::choose(is_inner, neighbour[2], key[2]),
        N::choose(is_inner, neighbour[3], key[3]),
    ]
}
