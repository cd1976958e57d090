//! Splits matrices of nodes into a translation, a rotation and a scale.

use glam::{DMat3, DQuat, DVec3, Vec3};

use crate::motion::Transform;
use crate::quaternion::nearest_unit;

/// Axes whose inner product is smaller than this are perpendicular, up to the rounding of f32.
const RIGHT_ANGLE: f64 = 1e-5;

/// The transform with this matrix, column by column, and whether the matrix has shear or a projection. In that case
/// the transform is the nearest one with the same x axis. `None` if f32 cannot store its numbers.
pub(super) fn split(matrix: [f64; 16]) -> Option<(Transform, bool)> {
    let column = |c: usize| DVec3::from_slice(&matrix[4 * c..]);
    let columns = [0, 1, 2].map(column);
    let mut scale = columns.map(DVec3::length);
    if DMat3::from_cols(columns[0], columns[1], columns[2]).determinant() < 0.0 {
        scale[0] = -scale[0];
    }
    let axes = [0, 1, 2].map(|i| (scale[i] != 0.0).then(|| columns[i] / scale[i]));
    let pairs = [(0, 1), (1, 2), (2, 0)];
    let leaning = pairs.iter().any(|&(i, j)| {
        let both = axes[i].zip(axes[j]);
        both.is_some_and(|(a, b)| a.dot(b).abs() > RIGHT_ANGLE)
    });
    let last_row = [3, 7, 11, 15].map(|at| matrix[at]);
    let is_sheared = leaning || last_row != [0.0, 0.0, 0.0, 1.0];
    let [x, y, z] = at_right_angles(axes);
    let transform = Transform {
        translation: column(3).as_vec3(),
        rotation: nearest_unit(DQuat::from_mat3(&DMat3::from_cols(x, y, z))),
        scale: DVec3::from_array(scale).as_vec3(),
    };
    let Transform {
        translation,
        rotation,
        scale,
    } = transform;
    let all_finite = translation.is_finite() && rotation.is_finite() && Vec3::is_finite(scale);
    all_finite.then_some((transform, is_sheared))
}

/// Perpendicular unit axes, each rotated away from the axes before it as little as possible. An axis of length 0 gets
/// the remaining direction.
fn at_right_angles(mut axes: [Option<DVec3>; 3]) -> [DVec3; 3] {
    for i in 0..3 {
        let before = axes;
        axes[i] = axes[i].and_then(|axis| {
            let others = before[..i].iter().flatten();
            let rest = others.fold(axis, |axis, other| axis - *other * axis.dot(*other));
            (rest.length() > RIGHT_ANGLE).then(|| rest.normalize())
        });
    }
    for i in 0..3 {
        let (next, last) = (axes[(i + 1) % 3], axes[(i + 2) % 3]);
        axes[i] = axes[i].or(match (next, last) {
            (Some(next), Some(last)) => Some(next.cross(last)),
            (Some(other), None) | (None, Some(other)) => Some(other.any_orthonormal_vector()),
            (None, None) => Some(DVec3::AXES[i]),
        });
    }
    axes.map(Option::unwrap_or_default)
}

#[cfg(test)]
mod tests {
    use glam::{DMat4, Quat};

    use super::*;

    fn assert_is_again(matrix: DMat4) -> Transform {
        let (found, is_sheared) = split(matrix.to_cols_array()).unwrap();
        assert!(!is_sheared);
        let again = DMat4::from_scale_rotation_translation(
            found.scale.as_dvec3(),
            found.rotation.as_dquat(),
            found.translation.as_dvec3(),
        );
        assert!(again.abs_diff_eq(matrix, 1e-6), "{matrix} {again}");
        found
    }

    #[test]
    fn transforms_are_found_again_mirrored_and_flat_ones_too() {
        let rotation = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.2, 2.9);
        for scale in [
            DVec3::ONE,
            DVec3::new(2.0, 0.5, 3.0),
            DVec3::new(1.0, -2.0, 1.0),
            DVec3::new(-1.0, -2.0, -1.0),
            DVec3::new(1.0, 0.0, 2.0),
            DVec3::new(0.0, 0.0, 2.0),
            DVec3::ZERO,
        ] {
            let at = DVec3::new(1.0, 2.0, 3.0);
            assert_is_again(DMat4::from_scale_rotation_translation(scale, rotation, at));
        }
        let quarter = [
            0.0, 2.0, 0.0, 0.0, -2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 3.0, 4.0, 5.0, 1.0,
        ];
        let found = assert_is_again(DMat4::from_cols_array(&quarter));
        assert_eq!(found.scale, Vec3::splat(2.0));
        let expected = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
        assert!(found.rotation.dot(expected).abs() > 1.0 - 1e-7);
    }

    #[test]
    fn shears_are_seen_and_what_passes_f32_is_none() {
        let mut matrix = DMat4::IDENTITY.to_cols_array();
        matrix[4] = 0.5;
        let (found, is_sheared) = split(matrix).unwrap();
        assert!(is_sheared);
        assert_eq!(found.rotation, Quat::IDENTITY);
        matrix[4] = 0.0;
        matrix[3] = 0.5;
        assert!(split(matrix).unwrap().1);
        for large in [1e39, 1e200, f64::MAX] {
            let mut matrix = DMat4::IDENTITY.to_cols_array();
            matrix[0] = large;
            assert!(split(matrix).is_none());
        }
    }
}
