//! Matrices, of `shaders/math/matrix.wgsl`, and their stores: `shaders/stores/matrix3x3.wgsl`,
//! `shaders/stores/matrix3x4.wgsl`, `shaders/stores/six_d.wgsl` and `shaders/motion/matrices.wgsl`.

use crate::math::canonical::canonical;
pub(crate) use crate::twin::functions::{MatrixRows, matrix_rows};

/// The rows as they are stored.
#[inline(always)]
pub(crate) fn rows(rotation: [f32; 4], detail: u32) -> [[f32; 3]; 3] {
    let MatrixRows {
        first,
        second,
        third,
    } = matrix_rows(rotation, detail);
    [first, second, third].map(|row| row.map(canonical))
}

/// The first two rows, or columns, as they are stored.
#[inline(always)]
pub(crate) fn first_two(rotation: [f32; 4], detail: u32) -> [[f32; 3]; 2] {
    let [first, second, _] = rows(rotation, detail);
    [first, second]
}

/// The rows that `store` writes in row-major order.
#[inline(always)]
pub(crate) fn store3x4_rows(rotation: [f32; 4], detail: u32) -> [[f32; 4]; 3] {
    rows(rotation, detail).map(|[x, y, z]| [x, y, z, 0.0])
}

/// The columns that `store` writes in column-major order.
#[inline(always)]
pub(crate) fn store3x4_columns(rotation: [f32; 4], detail: u32) -> [f32; 12] {
    let columns = rows(rotation, detail);
    std::array::from_fn(|i| if i < 9 { columns[i / 3][i % 3] } else { 0.0 })
}
