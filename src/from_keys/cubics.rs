//! Twin of `shaders/from_keys/cubics.wgsl`: cubics with fewer samples than keys, in lanes.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use bytemuck::Zeroable;

use crate::from_keys::arcs::{LANES, OutputIter};
use crate::math::canonical::canonical;
use crate::shader::{IS_KEY, KEY_INNER, KeySample, TangentWeights};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::tracks::track_keys::SignedKeys;
use crate::twin::small_angle::small_angle_cubic;

/// Samples that are collected and evaluated together; they are consecutive in the result. A block of zeros is empty;
/// unused lanes are marked as held before the evaluation.
#[derive(Zeroable)]
pub(crate) struct CubicBlock {
    /// The four keys around each sample, with their signs for the shortest path. For a sample at a key, the second
    /// one is that key, with its original sign.
    pub(crate) keys: [[[f32; 4]; LANES]; 4],
    /// The tangent weights at the keys before and after each sample.
    pub(crate) weights: [[TangentWeights; LANES]; 2],
    pub(crate) parameters: [f32; LANES],
    /// 1 if the sample is at a key, else 0.
    pub(crate) held: [f32; LANES],
    pub(crate) count: usize,
    /// The results; `UNRESOLVED` if the curve rotates too far for the small-angle series.
    pub(crate) rotations: [[f32; 4]; LANES],
    /// How many of the samples were unresolved.
    pub(crate) unresolved: usize,
}

impl InLanes for CubicBlock {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let [mut x, mut y, mut z, mut w] = [[0.0; LANES]; 4];
        let mut unresolved = 0;
        // Whole vectors are computed: the lanes of a partly filled one would be computed one by one.
        let whole = self.count.next_multiple_of(16).min(LANES);
        let [before, start, end, after] = &self.keys;
        let [first, last] = &self.weights;
        for j in 0..whole {
            let curve = small_angle_cubic(before[j], start[j], end[j], after[j], first[j], last[j]);
            let c = &curve.powers;
            let s = self.parameters[j];
            let t = s * s;
            let is_held = self.held[j] == 1.0;
            let found = if curve.is_valid { 1.0 } else { 0.0 };
            macro_rules! component {
                ($c:literal) => {{
                    let third = c[3][$c] * s + c[2][$c];
                    let high = c[6][$c] * t + (c[5][$c] * s + c[4][$c]);
                    let gain = high * (t * t) + (third * t + c[1][$c] * s);
                    let value = canonical(c[0][$c] + gain);
                    let value = if curve.is_valid { value } else { 0.0 };
                    if is_held { start[j][$c] } else { value }
                }};
            }
            (x[j], y[j], z[j], w[j]) = (component!(0), component!(1), component!(2), component!(3));
            unresolved += u32::from(found + self.held[j] == 0.0);
        }
        for j in 0..whole {
            self.rotations[j] = [x[j], y[j], z[j], w[j]];
        }
        self.unresolved += unresolved as usize;
    }
}

impl CubicBlock {
    /// As [`push`](super::arcs::TwoKeyBlock::push) of two keys, with the tangent weights of the keys.
    #[inline(always)]
    pub(super) fn push(
        &mut self,
        keys: SignedKeys<'_>,
        weights: &[TangentWeights],
        sample: KeySample,
        output: &mut OutputIter<'_>,
    ) {
        let lane = self.count;
        let key = (sample.key & !IS_KEY) as usize;
        if sample.key & IS_KEY == 0 {
            let (first, last) = (weights[key], weights[key + 1]);
            let before = key - usize::from(first.kind == KEY_INNER);
            let after = key + 1 + usize::from(last.kind == KEY_INNER);
            self.weights[0][lane] = first;
            self.weights[1][lane] = last;
            for (i, key) in [before, key, key + 1, after].into_iter().enumerate() {
                self.keys[i][lane] = keys.get(key);
            }
            self.held[lane] = 0.0;
        } else {
            self.keys[1][lane] = keys.authored[key];
            self.held[lane] = 1.0;
        }
        self.parameters[lane] = sample.parameter;
        self.count += 1;
        if self.count == LANES {
            self.flush(output);
        }
    }

    pub(super) fn flush(&mut self, output: &mut OutputIter<'_>) {
        // Unused lanes are evaluated too; marked as held, they do not count as unresolved.
        self.held[self.count..].fill(1.0);
        in_lanes(self);
        for (&rotation, value) in self.rotations[..self.count].iter().zip(output) {
            *value = rotation;
        }
        self.count = 0;
    }
}
