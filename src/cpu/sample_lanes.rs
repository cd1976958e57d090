//! Twin of `shaders/sampled_arcs.wgsl` and `shaders/sampled_pairs.wgsl`: samples by two
//! keys, in lanes.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use super::dispatch::InLanes;
use super::evaluate::canonical;
use super::evaluate_arc::{on_arc, square};
use super::evaluate_polynomial::component;
use super::lanes::{self, Lanes, Number};
use crate::method::Form;
use crate::prepare::{ARC_LANES, any_turns, arc_anyhow, arc_component, arc_in_lanes, arcs, whole};

/// Samples, or intervals, worked out together.
pub(super) const LANES: usize = ARC_LANES;

/// Samples that wait, one behind the other in the result.
pub(super) struct SampleBlock {
    form: Form,
    /// The keys beside each; the same one twice where the sample is that key.
    pub(super) from: [[f32; 4]; LANES],
    pub(super) to: [[f32; 4]; LANES],
    pub(super) signs: [f32; LANES],
    pub(super) parameters: [f32; LANES],
    pub(super) count: usize,
    pub(super) rotations: [[f32; 4]; LANES],
}

impl SampleBlock {
    pub(super) fn new(form: Form) -> Self {
        let identity = [0.0, 0.0, 0.0, 1.0];
        Self {
            form,
            from: [identity; LANES],
            to: [identity; LANES],
            signs: [1.0; LANES],
            parameters: [0.0; LANES],
            count: 0,
            rotations: [identity; LANES],
        }
    }
}

impl InLanes for SampleBlock {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        // Arcs are evaluated as polynomials where two keys are alone by smooth methods.
        // Their signs are as stored.
        match self.form {
            Form::Arc => self.arcs::<L>(),
            Form::Polynomial => self.polynomials::<L>(),
        }
    }
}

impl SampleBlock {
    #[inline(always)]
    fn arcs<L: Lanes>(&mut self) {
        for j in (0..self.count).step_by(L::COUNT) {
            let arcs = arc_in_lanes::<L>(&self.from[j..], &self.to[j..]);
            let sign = L::load(&self.signs[j..]);
            let parameter = L::load(&self.parameters[j..]);
            let found = at(arcs.middle, arcs.tangent, sign, parameter);
            L::store_rotations(found, &mut self.rotations[j..j + L::COUNT]);
            if arcs.any_in_doubt {
                for lane in j..j + L::COUNT {
                    let (arc, _) = arc_anyhow(self.from[lane], self.to[lane]);
                    let (sign, parameter) = (self.signs[lane], self.parameters[lane]);
                    self.rotations[lane] = at(arc.middle, arc.tangent, sign, parameter);
                }
            }
        }
    }

    #[inline(always)]
    fn polynomials<L: Lanes>(&mut self) {
        let arcs = arcs::<L>(&self.from, &self.to, self.count);
        let squares = arcs.squares();
        let mut found = [[0.0; LANES]; 4];
        for c in 0..4 {
            let (middle, tangent, lanes) = (&arcs.middles[c], &arcs.tangents[c], &mut found[c]);
            for j in 0..LANES {
                let own = arc_component(middle[j], tangent[j], squares[j]);
                lanes[j] = canonical(component(own, self.parameters[j]));
            }
        }
        self.keep(&found);
    }

    /// Components side by side to rotations.
    #[inline(always)]
    fn keep(&mut self, [x, y, z, w]: &[[f32; LANES]; 4]) {
        let mut rotations = [[0.0; 4]; LANES];
        for j in 0..whole(self.count) {
            rotations[j] = [x[j], y[j], z[j], w[j]];
        }
        self.rotations = rotations;
    }
}

/// A rotation of an arc whose first key has that sign.
#[inline(always)]
fn at<N: Number>(middle: [N; 4], tangent: [N; 4], sign: N, parameter: N) -> [N; 4] {
    let [mx, my, mz, mw] = middle;
    let [tx, ty, tz, tw] = tangent;
    let middle = [mx * sign, my * sign, mz * sign, mw * sign];
    let tangent = [tx * sign, ty * sign, tz * sign, tw * sign];
    lanes::canonical(on_arc(middle, tangent, square(tangent), parameter))
}

/// [`any_turns`].
pub(crate) struct Turns<'a> {
    pub(crate) keys: &'a [[f32; 4]],
    pub(crate) any: bool,
}

impl InLanes for Turns<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        self.any = any_turns::<L>(self.keys);
    }
}
