//! Converts rotation matrices of files to quaternions.

use glam::DQuat;

/// How much lengths and products of the rows may differ from those of a rotation: three printed digits.
const TOLERANCE: f64 = 5e-3;

/// The rotation of a matrix that rotates column vectors, row by row; `None` if the matrix is not a rotation.
pub(crate) fn of_matrix(rows: [[f64; 3]; 3]) -> Option<DQuat> {
    let [a, b, c] = rows;
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let lengths = [dot(a, a), dot(b, b), dot(c, c)];
    let products = [dot(a, b), dot(b, c), dot(c, a)];
    let is_near = |value: f64, to: f64| (value - to).abs() <= TOLERANCE;
    let cross = [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ];
    let is_rotation = lengths.iter().all(|&length| is_near(length, 1.0))
        && products.iter().all(|&product| is_near(product, 0.0))
        && dot(cross, c) > 0.0;
    if !is_rotation {
        return None;
    }
    // Four times the square of each component. The largest one is the divisor, because it is never small.
    let squares = [
        1.0 + a[0] - b[1] - c[2],
        1.0 - a[0] + b[1] - c[2],
        1.0 - a[0] - b[1] + c[2],
        1.0 + a[0] + b[1] + c[2],
    ];
    let [x, y, z, w] = squares;
    let (xy, yz, zx) = (a[1] + b[0], b[2] + c[1], c[0] + a[2]);
    let (wx, wy, wz) = (c[1] - b[2], a[2] - c[0], b[0] - a[1]);
    let largest = (0..4).fold(3, |largest, i| {
        if squares[i] > squares[largest] {
            i
        } else {
            largest
        }
    });
    let q = match largest {
        0 => DQuat::from_xyzw(x, xy, zx, wx),
        1 => DQuat::from_xyzw(xy, y, yz, wy),
        2 => DQuat::from_xyzw(zx, yz, z, wz),
        _ => DQuat::from_xyzw(wx, wy, wz, w),
    };
    Some(q.normalize())
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, EulerRot};

    use super::*;

    #[test]
    fn matrices_of_rotations_are_those_rotations() {
        for step in 0..4096 {
            let angle = |bits: i32| f64::from((step >> bits) & 15) * 0.42 - 3.1;
            let q = DQuat::from_euler(EulerRot::XYZ, angle(0), angle(4), angle(8));
            let rows = DMat3::from_quat(q).transpose().to_cols_array_2d();
            let found = of_matrix(rows).unwrap();
            assert!(found.dot(q).abs() > 1.0 - 1e-14, "{q} {found}");
        }
        let [one, zero] = [1.0, 0.0];
        let mirror = [[one, zero, zero], [zero, one, zero], [zero, zero, -one]];
        assert_eq!(of_matrix(mirror), None);
        let doubled = [[2.0, zero, zero], [zero, one, zero], [zero, zero, one]];
        assert_eq!(of_matrix(doubled), None);
        assert_eq!(of_matrix([[f64::NAN; 3]; 3]), None);
    }
}
