//! Twin of `shaders/math/matrix.wgsl`, `shaders/stores/matrix3x3.wgsl`
//! and `shaders/stores/matrix3x4.wgsl`: the same names, the same order.

use crate::math::canonical::canonical;

/// The rows as they are stored.
#[inline(always)]
pub(crate) fn rows(rotation: [f32; 4], detail: u32) -> [[f32; 3]; 3] {
    matrix_rows(rotation, detail).map(|row| row.map(canonical))
}

#[inline(always)]
pub(crate) fn matrix_rows(rotation: [f32; 4], detail: u32) -> [[f32; 3]; 3] {
    let [x, y, z, w] = rotation;
    let along = if detail == 1 { [-x, -y, -z] } else { [x, y, z] };
    let double = along.map(|c| c + c);
    let xx = along[0] * double[0];
    let yy = along[1] * double[1];
    let zz = along[2] * double[2];
    let xy = along[0] * double[1];
    let yz = along[1] * double[2];
    let zx = along[2] * double[0];
    let wx = w * double[0];
    let wy = w * double[1];
    let wz = w * double[2];
    [
        [1.0 - (yy + zz), xy - wz, zx + wy],
        [xy + wz, 1.0 - (xx + zz), yz - wx],
        [zx - wy, yz + wx, 1.0 - (xx + yy)],
    ]
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
