//! Twin of `shaders/poses/blend.wgsl`: the same names, the same order.

use crate::math::canonical::canonical;
use crate::math::quaternion::dot;
use crate::shader::LEAST_SQUARED_SUM;
use crate::twin::quaternion::normalised;

/// The blended rotation at `index`. `layers` has one layer after another, each of `count`
/// rotations.
#[inline(always)]
pub(crate) fn pose(layers: &[[f32; 4]], weights: &[f32], count: usize, index: usize) -> [f32; 4] {
    let first = layers[index];
    let mut sum = first.map(|c| c * weights[0]);
    for (layer, &weight) in weights.iter().enumerate().skip(1) {
        let next = layers[layer * count + index];
        let flip = dot(first, next) < 0.0;
        let near = if flip { next.map(|c| -c) } else { next };
        sum = std::array::from_fn(|c| sum[c] + near[c] * weight);
    }
    let short = dot(sum, sum) < LEAST_SQUARED_SUM;
    if short { first } else { normalised(sum) }.map(canonical)
}
