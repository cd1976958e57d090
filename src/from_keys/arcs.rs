//! Twin of `shaders/from_keys/arcs.wgsl` and `shaders/from_keys/two_keys.wgsl`: samples by two
//! keys, in lanes.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use bytemuck::Zeroable;

use crate::fit::constant_velocity::arc_component;
use crate::shader::{Form, IS_KEY, KeySample};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::{Lanes, canonical as canonical_rotations};
use crate::tracks::track_keys::SignedKeys;
use crate::twin::arc_between::arc_between;
use crate::twin::evaluate_arc::{norm_squared, on_arc};
use crate::twin::functions::polynomial;

/// The maximum number of samples that are evaluated together.
pub(crate) const LANES: usize = 64;

/// The rotations that are still to be written.
pub(super) type OutputIter<'a> = std::slice::IterMut<'a, [f32; 4]>;

/// Samples that are gathered to be evaluated together; they are consecutive in the result.
#[derive(Zeroable)]
pub(crate) struct TwoKeyBlock {
    /// Whether arcs are evaluated as polynomials.
    pub(crate) are_polynomials: bool,
    /// The keys before and after each sample, with their signs for the shortest path. A sample at a key has that key
    /// twice, with its original sign.
    pub(crate) from: [[f32; 4]; LANES],
    pub(crate) to: [[f32; 4]; LANES],
    pub(crate) parameters: [f32; LANES],
    pub(crate) count: usize,
    pub(crate) rotations: [[f32; 4]; LANES],
}

impl TwoKeyBlock {
    pub(crate) fn new(form: Form) -> Self {
        Self {
            are_polynomials: form == Form::Polynomial,
            ..Self::zeroed()
        }
    }
}

impl InLanes for TwoKeyBlock {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        // Smooth methods join a track's only two keys by an arc, which is evaluated as a
        // polynomial like their other curves.
        match self.are_polynomials {
            false => self.evaluate::<L, false>(),
            true => self.evaluate::<L, true>(),
        }
    }
}

impl TwoKeyBlock {
    #[inline(always)]
    fn evaluate<L: Lanes, const AS_POLYNOMIALS: bool>(&mut self) {
        let mut arcs = Arcs::<L>::new();
        for first in (0..self.count).step_by(VECTORS * L::COUNT) {
            let end = self.count.min(first + VECTORS * L::COUNT);
            for (vector, j) in (first..end).step_by(L::COUNT).enumerate() {
                let from = L::load_rotations(&self.from[j..]);
                arcs.put(vector, from, L::load_rotations(&self.to[j..]));
            }
            for (vector, j) in (first..end).step_by(L::COUNT).enumerate() {
                let parameter = L::load(&self.parameters[j..]);
                let found = if AS_POLYNOMIALS {
                    arcs.at_as_polynomials(vector, parameter)
                } else {
                    arcs.at(vector, parameter)
                };
                L::store_rotations(found, &mut self.rotations[j..j + L::COUNT]);
            }
        }
    }
}

/// The number of vectors of arcs that are computed before the first of them is evaluated. One vector is a long chain
/// of dependent operations, and a processor looks ahead only a vector or two.
const VECTORS: usize = 8;

/// Arcs in vectors, one for each lane.
struct Arcs<L> {
    middles: [[L; 4]; VECTORS],
    tangents: [[L; 4]; VECTORS],
}

impl<L: Lanes> Arcs<L> {
    #[inline(always)]
    fn new() -> Self {
        Self {
            middles: [[L::all(0.0); 4]; VECTORS],
            tangents: [[L::all(0.0); 4]; VECTORS],
        }
    }

    /// Makes the arcs of a vector.
    #[inline(always)]
    fn put(&mut self, vector: usize, from: [L; 4], to: [L; 4]) {
        let (middle, tangent) = arc_between(from, to);
        self.middles[vector % VECTORS] = middle;
        self.tangents[vector % VECTORS] = tangent;
    }

    /// The rotations on the arcs of a vector.
    #[inline(always)]
    fn at(&self, vector: usize, parameter: L) -> [L; 4] {
        let middle = self.middles[vector % VECTORS];
        let tangent = self.tangents[vector % VECTORS];
        canonical_rotations(on_arc(middle, tangent, norm_squared(tangent), parameter))
    }

    /// The same by the arcs' polynomials.
    #[inline(always)]
    fn at_as_polynomials(&self, vector: usize, parameter: L) -> [L; 4] {
        let mut found = self.middles[vector % VECTORS];
        let tangent = self.tangents[vector % VECTORS];
        let square = norm_squared(tangent);
        for c in 0..4 {
            let coefficients = arc_component(found[c], tangent[c], square);
            found[c] = polynomial(coefficients, parameter).canonical();
        }
        found
    }
}

impl TwoKeyBlock {
    /// Adds a sample, and evaluates the block when it is full.
    #[inline(always)]
    pub(super) fn push(
        &mut self,
        keys: SignedKeys<'_>,
        sample: KeySample,
        output: &mut OutputIter<'_>,
    ) {
        let lane = self.count;
        let key = (sample.key & !IS_KEY) as usize;
        if sample.key & IS_KEY == 0 {
            self.from[lane] = keys.get(key);
            self.to[lane] = keys.get(key + 1);
        } else {
            // The arc from a key to itself is that key.
            self.from[lane] = keys.authored[key];
            self.to[lane] = self.from[lane];
        }
        self.parameters[lane] = sample.parameter;
        self.count += 1;
        if self.count == LANES {
            self.flush(output);
        }
    }

    pub(super) fn flush(&mut self, output: &mut OutputIter<'_>) {
        in_lanes(self);
        // The output is the second iterator of `zip`. As the first one, it would lose an element when the rotations
        // end.
        for (&rotation, value) in self.rotations[..self.count].iter().zip(output) {
            *value = rotation;
        }
        self.count = 0;
    }
}
