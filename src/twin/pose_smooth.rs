//! Twin of `shaders/poses/smooth.wgsl`: the same names, the same order.

use crate::math::canonical::canonical;
pub(crate) use crate::twin::functions::rotated_by;

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
