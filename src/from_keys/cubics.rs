//! Twin of `shaders/from_keys/cubics.wgsl`: cubics with fewer samples than keys, in lanes.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use bytemuck::Zeroable;

use crate::from_keys::arcs::LANES;
use crate::math::canonical::canonical;
use crate::shader::TangentWeights;
use crate::simd::dispatch::InLanes;
use crate::simd::lanes::Lanes;
use crate::twin::small_angle::small_angle_cubic;

/// Samples that are gathered to be evaluated together; they are consecutive in the result. A block of
/// zeros is empty; lanes that no sample has are marked as held before it is evaluated.
#[derive(Zeroable)]
pub(crate) struct CubicBlock {
    /// The four keys around each sample, with continued signs. For a sample that is a key itself
    /// the second is that key, with the sign that it was given.
    pub(crate) keys: [[[f32; 4]; LANES]; 4],
    /// The tangent weights at the keys before and after each sample.
    pub(crate) weights: [[TangentWeights; LANES]; 2],
    pub(crate) parameters: [f32; LANES],
    /// 1 where the sample is a key itself, else 0.
    pub(crate) held: [f32; LANES],
    pub(crate) count: usize,
    /// `UNRESOLVED` where the curve turns too far for the small-angle series.
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
            let keys = [before[j], start[j], end[j], after[j]];
            let curve = small_angle_cubic(keys, first[j], last[j]);
            let c = &curve.powers;
            let s = self.parameters[j];
            let t = s * s;
            let is_held = self.held[j] == 1.0;
            let found = if curve.holds { 1.0 } else { 0.0 };
            macro_rules! component {
                ($c:literal) => {{
                    let third = c[3][$c] * s + c[2][$c];
                    let high = c[6][$c] * t + (c[5][$c] * s + c[4][$c]);
                    let gain = high * (t * t) + (third * t + c[1][$c] * s);
                    let own = canonical(c[0][$c] + gain);
                    let own = if curve.holds { own } else { 0.0 };
                    if is_held { start[j][$c] } else { own }
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
