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
