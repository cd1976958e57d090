//! Twin of `shaders/poses/smooth.wgsl`: the same names, the same order.

use crate::math::canonical::canonical;
use crate::math::quaternion::{dot, product};
use crate::shader::LONGEST_ANGLE_SQUARE;
use crate::twin::arc_tangent::flushed;
use crate::twin::sine_cosine::sine_cosm1;

#[inline(always)]
pub(crate) fn rotated_by(q: [f32; 4], v: [f32; 4]) -> [f32; 4] {
    let half = v.map(flushed);
    let square = half[0] * half[0] + half[1] * half[1] + half[2] * half[2];
    let long = square > LONGEST_ANGLE_SQUARE;
    let z = if long { 0.0 } else { square };
    let sine_cosine = sine_cosm1(1.0f32, z);
    let more = product(
        q,
        [
            half[0] * sine_cosine.0,
            half[1] * sine_cosine.0,
            half[2] * sine_cosine.0,
            sine_cosine.1,
        ],
    );
    let sum: [f32; 4] = std::array::from_fn(|c| q[c] + more[c]);
    let scale = 1.5 - 0.5 * dot(sum, sum);
    if long {
        [0.0; 4]
    } else if square == 0.0 {
        q
    } else {
        sum.map(|c| c * scale)
    }
}

/// The value moved by the sum of its steps.
#[inline(always)]
pub(crate) fn moved(value: [f32; 4], sum: [f32; 4], are_rotations: bool) -> [f32; 4] {
    let moved = match are_rotations {
        true => rotated_by(value, sum),
        false => std::array::from_fn(|c| value[c] + sum[c]),
    };
    moved.map(canonical)
}

/// The whole function of the shader; `steps` starts with the first step that affects the value at index 0.
pub(crate) fn pose(
    values: &[[f32; 4]],
    steps: &[[f32; 4]],
    weights: &[f32],
    are_rotations: bool,
    index: usize,
) -> [f32; 4] {
    let mut sum = [0.0; 4];
    for (m, weight) in weights.iter().enumerate() {
        let after = steps[index + weights.len() + m];
        let before = steps[index + weights.len() - 1 - m];
        for c in 0..4 {
            sum[c] += (after[c] - before[c]) * weight;
        }
    }
    moved(values[index], sum, are_rotations)
}
