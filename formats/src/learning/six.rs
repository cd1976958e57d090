//! Rotations as six numbers: two columns, or two rows, of the matrix.

use glam::{DMat3, DQuat, DVec3};
use tumble::names;

/// Which numbers of the matrix, and in which order. Programs differ, so there is no default. With columns x, y, z of
/// the matrix `R` for column vectors:
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SixOrder {
    /// `x0 x1 x2 y0 y1 y2`: Zhou 2019, HumanML3D, Kimodo.
    Columns,
    /// `R00 R01 R02 R10 R11 R12`, two rows: PyTorch3D.
    Rows,
    /// `R00 R01 R10 R11 R20 R21`, two columns side by side: SPIN and programs that follow it.
    Interleaved,
}

names! {
    SixOrder, "order of six numbers",
    Columns => "six-columns",
    Rows => "six-rows",
    Interleaved => "six-interleaved",
}

/// The six numbers of a unit quaternion.
#[must_use]
pub fn six(rotation: DQuat, order: SixOrder) -> [f64; 6] {
    let of_columns = |matrix: DMat3| {
        let [x, y] = [matrix.x_axis, matrix.y_axis];
        [x.x, x.y, x.z, y.x, y.y, y.z]
    };
    let matrix = DMat3::from_quat(rotation);
    match order {
        SixOrder::Columns => of_columns(matrix),
        SixOrder::Rows => of_columns(matrix.transpose()),
        SixOrder::Interleaved => {
            let [a, b, c, d, e, f] = of_columns(matrix);
            [a, d, b, e, c, f]
        }
    }
}

/// The rotation of six numbers, such as those of a network, by Gram–Schmidt; `None` if they are parallel, 0 or not
/// finite.
#[must_use]
pub fn rotation_of_six(numbers: [f64; 6], order: SixOrder) -> Option<DQuat> {
    let [a, b, c, d, e, f] = numbers;
    let (first, second) = match order {
        SixOrder::Columns | SixOrder::Rows => (DVec3::new(a, b, c), DVec3::new(d, e, f)),
        SixOrder::Interleaved => (DVec3::new(a, c, e), DVec3::new(b, d, f)),
    };
    let x = unit(first)?;
    let y = unit(second - x.dot(second) * x)?;
    let matrix = DMat3::from_cols(x, y, x.cross(y));
    Some(DQuat::from_mat3(&match order {
        SixOrder::Rows => matrix.transpose(),
        SixOrder::Columns | SixOrder::Interleaved => matrix,
    }))
}

fn unit(vector: DVec3) -> Option<DVec3> {
    let length = vector.length();
    (length > 1e-12 && length.is_finite()).then(|| vector / length)
}
