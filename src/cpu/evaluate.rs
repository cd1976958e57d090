//! Twin of `shaders/kernel.wgsl`: the samples of one run, sixteen at a time, so
//! that the compiler turns them into vector lanes.

use crate::segment::shader::{ITEM_SAMPLES, TINY_BITS};

/// Samples evaluated together.
pub(crate) const BLOCK: usize = ITEM_SAMPLES as usize;

/// One form's formula.
pub(crate) trait Evaluate {
    /// The rotation at a parameter of the segment, `x y z w`.
    fn evaluate(&self, parameter: f32) -> [f32; 4];
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
    output: &mut [[f32; 4]],
) {
    blocks(count, output, |start, rotations| {
        let first = first.wrapping_add(start as i32);
        // Rounded once, like the shader's sum of two exact halves.
        let distances = std::array::from_fn(|j| first.wrapping_add(j as i32) as f32);
        block(segment, affine, &distances, rotations);
    });
}

/// Evaluates the samples whose distances from the middle are given.
#[inline(always)]
pub(super) fn distances<S: Evaluate>(
    segment: &S,
    affine: Affine,
    distances: &[f32],
    output: &mut [[f32; 4]],
) {
    blocks(distances.len(), output, |start, rotations| {
        let mut padded = [0.0; BLOCK];
        let given = &distances[start..distances.len().min(start + BLOCK)];
        padded[..given.len()].copy_from_slice(given);
        block(segment, affine, &padded, rotations);
    });
}

/// Whole blocks into the output; the last one through a buffer of its own where
/// the output ends before the block does.
#[inline(always)]
fn blocks(count: usize, output: &mut [[f32; 4]], mut block: impl FnMut(usize, &mut [[f32; 4]; BLOCK])) {
    let mut start = 0;
    while start < count {
        let rest = &mut output[start..];
        if let Some((whole, _)) = rest.split_first_chunk_mut::<BLOCK>() {
            block(start, whole);
        } else {
            let mut rotations = [[0.0; 4]; BLOCK];
            block(start, &mut rotations);
            let wanted = count - start;
            rest[..wanted].copy_from_slice(&rotations[..wanted]);
        }
        start += BLOCK;
    }
}

#[inline(always)]
fn block<S: Evaluate>(
    segment: &S,
    affine: Affine,
    distances: &[f32; BLOCK],
    rotations: &mut [[f32; 4]; BLOCK],
) {
    for j in 0..BLOCK {
        let parameter = distances[j] * affine.scale + affine.offset;
        rotations[j] = segment.evaluate(parameter).map(canonical);
    }
}

/// Magnitudes below 2^-64 become +0.
#[inline(always)]
pub(super) fn canonical(q: f32) -> f32 {
    let magnitude = q.to_bits() & 0x7fff_ffff;
    if magnitude < TINY_BITS { 0.0 } else { q }
}
