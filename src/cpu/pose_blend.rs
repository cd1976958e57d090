//! Twin of `shaders/pose_blend.wgsl`: the same names, the same order.

use super::evaluate::canonical;
use super::quaternion::{inner, normalised};
use crate::segment::shader::LEAST;

/// Its layers, one behind the other, `count` values each.
#[inline(always)]
pub(super) fn pose(layers: &[[f32; 4]], weights: &[f32], count: usize, place: usize) -> [f32; 4] {
    let first = layers[place];
    let mut sum = first.map(|c| c * weights[0]);
    for (layer, &weight) in weights.iter().enumerate().skip(1) {
        let next = layers[layer * count + place];
        let flip = inner(first, next) < 0.0;
        let near = if flip { next.map(|c| -c) } else { next };
        sum = std::array::from_fn(|c| sum[c] + near[c] * weight);
    }
    let short = inner(sum, sum) < LEAST;
    if short { first } else { normalised(sum) }.map(canonical)
}
