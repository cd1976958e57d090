//! Twin of `shaders/poses/smooth.wgsl`: the same names, the same order.

use crate::math::canonical::canonical;
use crate::math::quaternion::{dot, product};
use crate::shader::LONGEST_TURN_SQUARE;
use crate::twin::arc_tangent::flushed;
use crate::twin::sine_cosine::sine_cosm1;

#[inline(always)]
pub(crate) fn turned(q: [f32; 4], v: [f32; 4]) -> [f32; 4] {
    let half = v.map(flushed);
    let square = half[0] * half[0] + half[1] * half[1] + half[2] * half[2];
    let long = square > LONGEST_TURN_SQUARE;
    let z = if long { 0.0 } else { square };
    let turn = sine_cosm1(1.0f32, z);
    let more = product(
        q,
        [half[0] * turn.0, half[1] * turn.0, half[2] * turn.0, turn.1],
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
pub(crate) fn moved(own: [f32; 4], sum: [f32; 4], are_rotations: bool) -> [f32; 4] {
    let value = match are_rotations {
        true => turned(own, sum),
        false => std::array::from_fn(|c| own[c] + sum[c]),
    };
    value.map(canonical)
}

/// The whole function of the shader: `steps` begin at the first that reaches the value at place 0.
pub(crate) fn pose(
    values: &[[f32; 4]],
    steps: &[[f32; 4]],
    weights: &[f32],
    are_rotations: bool,
    place: usize,
) -> [f32; 4] {
    let mut sum = [0.0; 4];
    for (m, weight) in weights.iter().enumerate() {
        let after = steps[place + weights.len() + m];
        let before = steps[place + weights.len() - 1 - m];
        for c in 0..4 {
            sum[c] += (after[c] - before[c]) * weight;
        }
    }
    moved(values[place], sum, are_rotations)
}
