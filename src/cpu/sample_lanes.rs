//! Twin of `shaders/sampled_arcs.wgsl`: arcs with fewer samples than keys, in lanes.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use super::dispatch::InLanes;
use super::evaluate::{Evaluate, canonical};
use super::evaluate_polynomial::component;
use crate::method::{Form, Interpolation};
use crate::prepare::{ARC_LANES, IN_DOUBT, any_arc, arc_component, arcs, near_arc, whole};
use crate::segment::ArcSegment;

/// Samples, or intervals, worked out together.
pub(super) const LANES: usize = ARC_LANES;

/// Samples that wait, one behind the other in the result.
pub(super) struct SampleBlock {
    interpolation: Interpolation,
    /// The keys beside each; the same one twice where the sample is that key.
    pub(super) from: [[f32; 4]; LANES],
    pub(super) to: [[f32; 4]; LANES],
    pub(super) signs: [f32; LANES],
    pub(super) parameters: [f32; LANES],
    pub(super) count: usize,
    pub(super) rotations: [[f32; 4]; LANES],
}

impl SampleBlock {
    pub(super) fn new(interpolation: &Interpolation) -> Self {
        let identity = [0.0, 0.0, 0.0, 1.0];
        Self {
            interpolation: *interpolation,
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
    fn run(&mut self) {
        // Arcs are evaluated as polynomials where two keys are alone by smooth methods.
        // Their signs are as stored.
        match self.interpolation.form() {
            Form::Arc => self.arcs(),
            Form::Polynomial => self.polynomials(),
        }
    }
}

impl SampleBlock {
    #[inline(always)]
    fn arcs(&mut self) {
        let path = self.interpolation.path;
        let [mut x, mut y, mut z, mut w] = [[0.0; LANES]; 4];
        let mut certain = [1.0; LANES];
        let mut doubtful = 0;
        for j in 0..whole(self.count) {
            let near = near_arc(self.from[j], self.to[j], path);
            let q = at(near.arc, self.signs[j], self.parameters[j]);
            [x[j], y[j], z[j], w[j]] = q;
            certain[j] = near.certain;
            doubtful += u32::from(near.certain <= IN_DOUBT);
        }
        self.keep(&[x, y, z, w]);
        if doubtful > 0 {
            for lane in (0..self.count).filter(|&lane| certain[lane] <= IN_DOUBT) {
                let any = any_arc(self.from[lane], self.to[lane], path);
                self.rotations[lane] = at(any.arc, self.signs[lane], self.parameters[lane]);
            }
        }
    }

    #[inline(always)]
    fn polynomials(&mut self) {
        let arcs = arcs(&self.from, &self.to, self.count, self.interpolation.path);
        let squares = arcs.squares();
        let mut found = [[0.0; LANES]; 4];
        for c in 0..4 {
            let (middle, tangent, lanes) = (&arcs.middles[c], &arcs.tangents[c], &mut found[c]);
            for j in 0..LANES {
                let own = arc_component(middle[j], tangent[j], squares[j]);
                lanes[j] = canonical(component(|power| own[power], self.parameters[j]));
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
fn at(ArcSegment { middle, tangent }: ArcSegment, sign: f32, parameter: f32) -> [f32; 4] {
    let [mx, my, mz, mw] = middle;
    let [tx, ty, tz, tw] = tangent;
    let segment = ArcSegment {
        middle: [mx * sign, my * sign, mz * sign, mw * sign],
        tangent: [tx * sign, ty * sign, tz * sign, tw * sign],
    };
    let q = segment.evaluate(segment.constant(), parameter);
    [
        canonical(q[0]),
        canonical(q[1]),
        canonical(q[2]),
        canonical(q[3]),
    ]
}

/// Whether the sign of any key of some is turned, or in doubt.
pub(crate) struct Turns<'a> {
    pub(crate) keys: &'a [[f32; 4]],
    pub(crate) any: bool,
}

impl InLanes for Turns<'_> {
    #[inline(always)]
    fn run(&mut self) {
        let intervals = self.keys.len().saturating_sub(1);
        let (from, to) = (
            &self.keys[..intervals],
            &self.keys[self.keys.len() - intervals..],
        );
        let mut doubtful = 0;
        for j in 0..intervals {
            let (a, b) = (from[j], to[j]);
            let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
            doubtful |= u32::from(dot <= IN_DOUBT);
        }
        self.any = doubtful != 0;
    }
}
