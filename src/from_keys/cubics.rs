//! Twin of `shaders/from_keys/cubics.wgsl`: cubics at samples between keys, one in each lane.

use bytemuck::Zeroable;

use crate::from_keys::arcs::{LANES, OutputIter};
use crate::shader::{IS_KEY, KEY_INNER, KeySample, TangentWeights};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::tracks::track_keys::SignedKeys;
use crate::twin::small_angle::{SmallAngleCubic, small_angle_cubic};

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
    /// Whether any sample was unresolved.
    pub(crate) has_unresolved: bool,
}

impl InLanes for CubicBlock {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        for j in (0..self.count).step_by(L::COUNT) {
            let [before, start, end, after] = &self.keys;
            let start = L::load_rotations(&start[j..]);
            let [first, last] = &self.weights;
            let curve = small_angle_cubic(
                L::load_rotations(&before[j..]),
                start,
                L::load_rotations(&end[j..]),
                L::load_rotations(&after[j..]),
                L::load_rotations(bytemuck::cast_slice(&first[j..])).into(),
                L::load_rotations(bytemuck::cast_slice(&last[j..])).into(),
            );
            let is_held = L::load(&self.held[j..]).equals(L::all(1.0));
            let found = sample(&curve, L::load(&self.parameters[j..]));
            // Written out without a closure, because closures are not always inlined.
            let found = [
                L::choose(is_held, start[0], found[0]),
                L::choose(is_held, start[1], found[1]),
                L::choose(is_held, start[2], found[2]),
                L::choose(is_held, start[3], found[3]),
            ];
            L::store_rotations(found, &mut self.rotations[j..j + L::COUNT]);
            let is_unresolved = !curve.is_valid & !is_held;
            let resolved = L::choose(is_unresolved, L::all(0.0), L::all(1.0));
            self.has_unresolved |= resolved.any_at_most(0.0);
        }
    }
}

/// The rotation at a parameter of a curve of small angles, as `polynomial` gives it, whose powers above the sixth are
/// 0; [`UNRESOLVED`](crate::from_keys::UNRESOLVED) if the curve turns too far.
#[inline(always)]
pub(crate) fn sample<L: Lanes>(curve: &SmallAngleCubic<L>, s: L) -> [L; 4] {
    let c = &curve.powers;
    let z = s * s;
    let zz = z * z;
    macro_rules! component {
        ($c:literal) => {{
            let third = c[3][$c] * s + c[2][$c];
            let high = c[6][$c] * z + (c[5][$c] * s + c[4][$c]);
            let gain = high * zz + (third * z + c[1][$c] * s);
            L::choose(curve.is_valid, (c[0][$c] + gain).canonical(), L::all(0.0))
        }};
    }
    [component!(0), component!(1), component!(2), component!(3)]
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
        // Unused lanes are evaluated too. They are marked as held, so that they do not count as unresolved.
        self.held[self.count..].fill(1.0);
        in_lanes(self);
        for (&rotation, value) in self.rotations[..self.count].iter().zip(output) {
            *value = rotation;
        }
        self.count = 0;
    }
}
