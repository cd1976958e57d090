//! Twin of `shaders/kernel.wgsl`: the samples of one run, in vector lanes.

use crate::segment::shader::TINY_BITS;

/// Samples are evaluated in multiples of this many: the lanes of the widest vector.
pub(super) const BLOCK: usize = 16;

/// So few samples are evaluated one by one: a block would be mostly waste.
pub(super) const FEW: usize = 3;

/// Samples whose components are kept before they are stored.
pub(super) const CHUNK: usize = 4 * BLOCK;

/// Room for the components of some samples, before they are put together.
pub(crate) trait Room {
    /// So many samples.
    const SAMPLES: usize;

    fn new() -> Self;

    /// The components of the first `count` samples.
    fn components(&mut self, count: usize) -> [&mut [f32]; 4];
}

/// Aligned to the widest vector: where one lies across two cache lines, everything takes
/// a sixth longer.
#[repr(align(64))]
pub(crate) struct RoomFor<const SAMPLES: usize> {
    components: [[f32; SAMPLES]; 4],
}

impl<const SAMPLES: usize> Room for RoomFor<SAMPLES> {
    const SAMPLES: usize = SAMPLES;

    #[inline(always)]
    fn new() -> Self {
        Self {
            components: [[0.0; SAMPLES]; 4],
        }
    }

    #[inline(always)]
    fn components(&mut self, count: usize) -> [&mut [f32]; 4] {
        // Slices of one length: no bounds check is left to keep a loop scalar.
        self.components
            .each_mut()
            .map(|component| &mut component[..count])
    }
}

/// One form's formula.
pub(crate) trait Evaluate {
    /// Room for the components of the samples that are worked out before they are put
    /// together.
    type Room: Room;

    /// What is the same for all samples.
    #[inline(always)]
    fn constant(&self) -> f32 {
        0.0
    }

    /// The rotation at a parameter of the segment, `x y z w`.
    fn evaluate(&self, constant: f32, parameter: f32) -> [f32; 4];
}

/// How a run's parameter follows from the distance to the segment's middle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Affine {
    pub(crate) scale: f32,
    pub(crate) offset: f32,
}

/// Evaluates frames `first`, `first + 1`, … into `output[..count]`. What lies
/// behind `count` may be overwritten up to the end of a block.
#[inline(always)]
pub(super) fn frames<S: Evaluate>(
    segment: &S,
    affine: Affine,
    first: i32,
    count: usize,
    room: &mut S::Room,
    output: &mut [[f32; 4]],
) {
    // An integer converts with one rounding, like the shader's sum of two exact
    // halves.
    let distance = |j: u32| first.wrapping_add(j as i32) as f32;
    run(segment, affine, count, distance, room, output);
}

/// Evaluates the samples whose distances from the middle are given.
#[inline(always)]
pub(super) fn distances<S: Evaluate>(
    segment: &S,
    affine: Affine,
    distances: &[f32],
    room: &mut S::Room,
    output: &mut [[f32; 4]],
) {
    let distance = |j: u32| distances[(j as usize).min(distances.len() - 1)];
    run(segment, affine, distances.len(), distance, room, output);
}

/// Evaluates the sample at a distance from the middle.
#[inline(always)]
pub(super) fn one<S: Evaluate>(segment: &S, affine: Affine, distance: f32) -> [f32; 4] {
    let q = segment.evaluate(segment.constant(), distance * affine.scale + affine.offset);
    [
        canonical(q[0]),
        canonical(q[1]),
        canonical(q[2]),
        canonical(q[3]),
    ]
}

/// Components side by side, so that lanes run along samples and the compiler
/// vectorises the whole formula. The number of samples is kept a variable on
/// purpose: a constant one is unrolled first and then vectorised across the four
/// components, at a quarter of the speed.
#[inline(always)]
fn run<S: Evaluate>(
    segment: &S,
    affine: Affine,
    count: usize,
    distance: impl Fn(u32) -> f32,
    room: &mut S::Room,
    output: &mut [[f32; 4]],
) {
    if count <= FEW {
        for (j, rotation) in output[..count].iter_mut().enumerate() {
            *rotation = one(segment, affine, distance(j as u32));
        }
        return;
    }
    let constant = segment.constant();
    for start in (0..count).step_by(S::Room::SAMPLES) {
        let wanted = (count - start).min(S::Room::SAMPLES);
        let whole = wanted.next_multiple_of(BLOCK);
        let [x, y, z, w] = room.components(whole);
        for j in 0..whole {
            let parameter = distance(start as u32 + j as u32) * affine.scale + affine.offset;
            let q = segment.evaluate(constant, parameter);
            x[j] = canonical(q[0]);
            y[j] = canonical(q[1]);
            z[j] = canonical(q[2]);
            w[j] = canonical(q[3]);
        }
        let rest = &mut output[start..];
        let stored = if rest.len() < whole { wanted } else { whole };
        let rotations = &mut rest[..stored];
        let (x, y, z, w) = (&x[..stored], &y[..stored], &z[..stored], &w[..stored]);
        for j in 0..stored {
            rotations[j] = [x[j], y[j], z[j], w[j]];
        }
    }
}

/// Magnitudes below 2^-64 become +0. Twin: `shaders/canonical.wgsl`.
#[inline(always)]
pub(super) fn canonical(q: f32) -> f32 {
    let magnitude = q.to_bits() & 0x7fff_ffff;
    if magnitude < TINY_BITS { 0.0 } else { q }
}
