//! Twin of `shaders/crowd/transform.wgsl`, `shaders/crowd/locals.wgsl`, `shaders/crowd/affine.wgsl`,
//! `shaders/crowd/walk.wgsl`, `shaders/crowd/walk_all.wgsl`, `shaders/crowd/skin.wgsl`, `shaders/crowd/any_half.wgsl`
//! and `shaders/crowd/half.wgsl`: the same names, the same order.

use glam::Vec4;

use crate::simd::lanes::Number as _;
use crate::twin::{functions, matrix};

/// The three rows of an affine matrix for column vectors.
pub(crate) type Rows = [[f32; 4]; 3];

/// A row of a rotation's matrix with scaled columns, followed by the translation.
#[inline(always)]
pub(crate) fn transform_row(rotated: [f32; 3], scale: [f32; 4], moved: f32) -> [f32; 4] {
    let [x, y, z] = rotated;
    let row = Vec4::new(x, y, z, 0.0).canonical() * Vec4::from_array(scale);
    row.with_w(moved).canonical().to_array()
}

/// The transform T R S.
#[inline(always)]
pub(crate) fn transform(rotation: [f32; 4], moved: [f32; 4], scale: [f32; 4]) -> Rows {
    let matrix::MatrixRows {
        first,
        second,
        third,
    } = matrix::matrix_rows(rotation, 0);
    [
        transform_row(first, scale, moved[0]),
        transform_row(second, scale, moved[1]),
        transform_row(third, scale, moved[2]),
    ]
}

/// A row of the product: this row times the rows of the other matrix. The term added to the first three numbers is 0,
/// which has an effect only on -0; the last step makes -0 to +0.
#[inline(always)]
pub(crate) fn row_product(row: [f32; 4], other: &Rows) -> [f32; 4] {
    let [first, second, third] = other.map(Vec4::from_array);
    let [x, y, z, moved] = row;
    let sum = (first * x + second * y) + third * z;
    (sum + Vec4::new(0.0, 0.0, 0.0, moved))
        .canonical()
        .to_array()
}

/// The product of two affine matrices.
#[inline(always)]
pub(crate) fn affine_product(a: &Rows, b: &Rows) -> Rows {
    [
        row_product(a[0], b),
        row_product(a[1], b),
        row_product(a[2], b),
    ]
}

/// The half nearest to a value of any magnitude, ties to even.
#[inline(always)]
pub(crate) fn to_any_half(value: f32) -> u16 {
    functions::to_any_half(value) as u16
}
