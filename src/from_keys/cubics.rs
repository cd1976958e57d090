//! Twin of `shaders/from_keys/cubics.wgsl`: cubics with fewer samples than keys, in lanes.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use crate::fit::arc_lanes::{LANES, whole};
use crate::fit::tangent_weights::UNKNOWN;
use crate::math::canonical::canonical;
use crate::shader::TangentWeights;
use crate::simd::dispatch::InLanes;
use crate::simd::lanes::Lanes;
use crate::twin::small_angle::small_angle_cubic;

/// Samples that are gathered to be evaluated together; they are consecutive in the result.
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

impl CubicBlock {
    pub(crate) fn new() -> Self {
        let identity = [0.0, 0.0, 0.0, 1.0];
        Self {
            keys: [[identity; LANES]; 4],
            weights: [[UNKNOWN; LANES]; 2],
            parameters: [0.0; LANES],
            held: [0.0; LANES],
            count: 0,
            rotations: [identity; LANES],
            unresolved: 0,
        }
    }
}

impl InLanes for CubicBlock {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let [mut x, mut y, mut z, mut w] = [[0.0; LANES]; 4];
        let mut unresolved = 0;
        let [before, start, end, after] = &self.keys;
        let [first, last] = &self.weights;
        for j in 0..whole(self.count) {
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
        for j in 0..whole(self.count) {
            self.rotations[j] = [x[j], y[j], z[j], w[j]];
        }
        self.unresolved += unresolved as usize;
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;
    use crate::fit::tangent_weights::WeightRule;
    use crate::simd::dispatch::in_lanes;
    use crate::simd::dispatch::tests::same_at_every_width;

    /// Keys at constant angular velocity give a curve of constant velocity. Catches a wrong digit
    /// in a coefficient, which both twins would share, and fused operations at any vector width.
    #[test]
    fn constant_velocity_stays_constant_at_every_width() {
        let axis = DVec3::new(0.48, -0.6, 0.64);
        let key = |turn: f64| {
            let rotation = DQuat::from_xyzw(0.1, 0.7, -0.5, 0.5).normalize();
            rotation * DQuat::from_axis_angle(axis, turn)
        };
        let (bits, parameters) = same_at_every_width(|| {
            let mut block = CubicBlock::new();
            block.count = LANES;
            for lane in 0..LANES {
                let turn = 0.1 * lane as f64 / LANES as f64;
                for (place, keys) in block.keys.iter_mut().enumerate() {
                    keys[lane] = key(turn * (place as f64 - 1.5)).as_quat().to_array();
                }
                let tangent_weights = WeightRule::ByTime.between(1.0, 1.0);
                block.weights = [[tangent_weights; LANES]; 2];
                block.parameters[lane] = (lane as f32 * 0.618).fract() - 0.5;
            }
            in_lanes(&mut block);
            assert_eq!(block.unresolved, 0);
            let bits = block.rotations.as_flattened().iter().map(|c| c.to_bits());
            (bits.collect::<Vec<_>>(), block.parameters)
        });
        for (lane, found) in bits.chunks(4).enumerate() {
            let turn = 0.1 * lane as f64 / LANES as f64;
            let exact = key(turn * f64::from(parameters[lane])).to_array();
            for (&found, exact) in found.iter().zip(exact) {
                assert!(
                    (f64::from(f32::from_bits(found)) - exact).abs() < 1.5e-7,
                    "{lane}"
                );
            }
        }
    }

    /// Catches a curve that is evaluated where the series does not hold.
    #[test]
    fn what_turns_too_much_is_left_out() {
        let mut block = CubicBlock::new();
        block.count = 3;
        let tangent_weights = WeightRule::Alike.between(1.0, 1.0);
        block.weights = [[tangent_weights; LANES]; 2];
        let turned = |turn: f32| glam::Quat::from_rotation_z(turn).to_array();
        for (place, keys) in block.keys.iter_mut().enumerate() {
            keys[0] = turned(0.1 * place as f32);
            keys[1] = turned(0.2 * place as f32);
            keys[2] = turned(0.1 * place as f32);
        }
        block.weights[0][2] = UNKNOWN;
        block.held[3..].fill(1.0);
        in_lanes(&mut block);
        assert_eq!(block.unresolved, 2);
        assert_ne!(block.rotations[0], [0.0; 4]);
        assert_eq!(block.rotations[1..3], [[0.0; 4]; 2]);
    }
}
