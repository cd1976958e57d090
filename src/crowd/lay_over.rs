//! Rotations of layers, laid over each other for many joints at once.

use crate::math::canonical::canonical;
use crate::math::quaternion::{dot, product, step};
use crate::shader::{CHANNELS, ROTATION};
use crate::simd::components::{BLOCK, Components, at, put, put_together, take_apart};
use crate::simd::lanes::Lanes;
use crate::twin::arc_tangent::{arc_tangent, reciprocal_root, root};
use crate::twin::crowd_layers::Layers;
use crate::twin::quaternion::{along, chord, inverse_root, normalised};
use crate::twin::sine_cosine::sine_cosine;

/// Lays the rotations of a layer over those below it: [`laid_over`](crate::twin::crowd_layers::laid_over)
/// of every joint.
#[inline(always)]
pub(crate) fn lay_over<L: Lanes>(
    context: &Layers<'_>,
    layer: usize,
    layered: &[[f32; 4]],
    output: &mut [[f32; 4]],
) {
    let entry = &context.entries[layer];
    let (weight, mask) = context.weight_and_mask(entry);
    let is_additive = entry.speed_and_modes >> 31 != 0;
    let references = context.references_of(entry);
    let empty: Components = [[0.0; BLOCK]; 4];
    let [mut below, mut above, mut found] = [empty; 3];
    let mut weights = [0.0; BLOCK];
    let blocks = output.chunks_mut(BLOCK).zip(layered.chunks(BLOCK));
    for ((block, mask), (values, layered)) in (0..).zip(mask.chunks(BLOCK)).zip(blocks) {
        for (joint_weight, cell) in weights.iter_mut().zip(mask) {
            *joint_weight = weight * cell[0];
        }
        take_apart::<L>(values, &mut below);
        take_apart::<L>(layered, &mut above);
        if is_additive {
            let channels = references.chunks_exact(CHANNELS as usize);
            for (j, joint) in channels.skip(block * BLOCK).take(values.len()).enumerate() {
                put(&mut found, j, joint[ROTATION as usize]);
            }
            add(&below, &above, &weights, &mut found);
        } else {
            go_over(&below, &above, &weights, &mut found);
        }
        put_together::<L>(&found, values);
    }
}

/// [`slerp`](crate::twin::quaternion::slerp) of a block, taken apart: each of its long chains of operations is
/// a loop of its own, in which a processor works on several vectors at once.
#[inline(always)]
fn slerps(from: &Components, to: &Components, weights: &[f32; BLOCK], found: &mut Components) {
    let empty: Components = [[0.0; BLOCK]; 4];
    let [mut sums, mut differences] = [empty; 2];
    let [
        mut squares,
        mut wholes,
        mut roots,
        mut whole_roots,
        mut cosines,
    ] = [[0.0; BLOCK]; 5];
    for j in 0..BLOCK {
        let (sum, difference) = chord(at(from, j), at(to, j));
        put(&mut sums, j, sum);
        put(&mut differences, j, difference);
        squares[j] = dot(difference, difference);
        wholes[j] = dot(sum, sum);
    }
    for j in 0..BLOCK {
        roots[j] = root(squares[j]);
        whole_roots[j] = root(wholes[j]);
    }
    for j in 0..BLOCK {
        roots[j] = arc_tangent(roots[j], whole_roots[j]);
    }
    for j in 0..BLOCK {
        let t = weights[j];
        (roots[j], cosines[j]) = sine_cosine((t + t - 1.0) * roots[j]);
    }
    for j in 0..BLOCK {
        (squares[j], wholes[j]) = (inverse_root(squares[j]), reciprocal_root(wholes[j]));
    }
    for j in 0..BLOCK {
        let scales = (wholes[j], squares[j]);
        let turn = (roots[j], cosines[j]);
        put(
            found,
            j,
            along(at(&sums, j), at(&differences, j), scales, turn),
        );
    }
}

/// A layer that the ones below it go over into.
#[inline(always)]
fn go_over(below: &Components, above: &Components, weights: &[f32; BLOCK], found: &mut Components) {
    slerps(below, above, weights, found);
    for (j, &weight) in weights.iter().enumerate() {
        let (below, above) = (at(below, j), at(above, j));
        let inner = if weight == 1.0 { above } else { at(found, j) };
        let value = if weight == 0.0 { below } else { inner };
        put(found, j, value.map(canonical));
    }
}

/// A layer of which the difference from a reference is added. `found` has the reference before.
#[inline(always)]
fn add(below: &Components, above: &Components, weights: &[f32; BLOCK], found: &mut Components) {
    let mut steps: Components = [[0.0; BLOCK]; 4];
    for j in 0..BLOCK {
        put(&mut steps, j, step(at(found, j), at(above, j)));
    }
    let mut identities: Components = [[0.0; BLOCK]; 4];
    identities[3] = [1.0; BLOCK];
    slerps(&identities, &steps, weights, found);
    for j in 0..BLOCK {
        let turned = normalised(product(at(below, j), at(found, j)));
        put(found, j, turned.map(canonical));
    }
}
