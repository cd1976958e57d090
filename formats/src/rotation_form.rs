//! The forms in which files represent rotations by numbers.

use glam::{DQuat, DVec3};
use tumble::EulerSequence;

use crate::quaternion::ComponentOrder;
use crate::rotation_matrix::of_matrix;

/// The form in which numbers represent a rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RotationForm {
    /// A quaternion with components in this order.
    Quaternion(ComponentOrder),
    /// A rotation vector: its direction is the axis, and its length is the angle.
    Vector {
        /// Whether the angle is in degrees instead of radians.
        degrees: bool,
    },
    /// A 3 × 3 matrix that rotates column vectors, row by row.
    Matrix,
    /// Euler angles.
    Euler {
        /// The sequence of axes.
        sequence: EulerSequence,
        /// Whether the angles are in degrees instead of radians.
        degrees: bool,
    },
}

impl RotationForm {
    /// How many numbers represent a rotation.
    #[must_use]
    pub fn width(self) -> usize {
        match self {
            Self::Quaternion(_) => 4,
            Self::Vector { .. } | Self::Euler { .. } => 3,
            Self::Matrix => 9,
        }
    }

    /// The rotation that the numbers represent, as a quaternion of any norm; `None` if they do not represent one.
    pub(crate) fn rotation(self, numbers: &[f64]) -> Option<DQuat> {
        let angle = |degrees: bool| {
            if degrees {
                std::f64::consts::PI / 180.0
            } else {
                1.0
            }
        };
        let found = match (self, numbers) {
            (Self::Quaternion(ComponentOrder::Xyzw), &[x, y, z, w])
            | (Self::Quaternion(ComponentOrder::Wxyz), &[w, x, y, z]) => {
                DQuat::from_xyzw(x, y, z, w)
            }
            (Self::Vector { degrees }, &[x, y, z]) => {
                let vector = DVec3::new(x, y, z) * angle(degrees);
                let half = 0.5 * vector.length();
                let (sine, cosine) = libm::sincos(half);
                let scale = if half > 0.0 { 0.5 * sine / half } else { 0.5 };
                let [x, y, z] = (vector * scale).to_array();
                DQuat::from_xyzw(x, y, z, cosine)
            }
            (Self::Matrix, &[a, b, c, d, e, f, g, h, i]) => {
                of_matrix([[a, b, c], [d, e, f], [g, h, i]])?
            }
            (Self::Euler { sequence, degrees }, &[a, b, c]) => {
                let axes = sequence.axes();
                let factors = [(axes[0], a), (axes[1], b), (axes[2], c)].map(|(axis, about)| {
                    let (sine, cosine) = libm::sincos(0.5 * about * angle(degrees));
                    let [x, y, z] = (DVec3::AXES[axis] * sine).to_array();
                    DQuat::from_xyzw(x, y, z, cosine)
                });
                match sequence.is_intrinsic() {
                    true => factors[0] * factors[1] * factors[2],
                    false => factors[2] * factors[1] * factors[0],
                }
            }
            _ => return None,
        };
        found.is_finite().then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn every_form_of_a_rotation_is_that_rotation() {
        let (half, quarter) = (0.5f64.sqrt(), DQuat::from_rotation_z(FRAC_PI_2));
        let euler = |name: &str, degrees| RotationForm::Euler {
            sequence: name.parse().unwrap(),
            degrees,
        };
        let forms: [(RotationForm, &[f64]); 7] = [
            (
                RotationForm::Quaternion(ComponentOrder::Wxyz),
                &[half, 0.0, 0.0, half],
            ),
            (
                RotationForm::Quaternion(ComponentOrder::Xyzw),
                &[0.0, 0.0, half, half],
            ),
            (
                RotationForm::Vector { degrees: false },
                &[0.0, 0.0, FRAC_PI_2],
            ),
            (RotationForm::Vector { degrees: true }, &[0.0, 0.0, 90.0]),
            (
                RotationForm::Matrix,
                &[0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            ),
            (euler("ZYX", true), &[90.0, 0.0, 0.0]),
            (euler("zyx", false), &[FRAC_PI_2, 0.0, 0.0]),
        ];
        for (form, numbers) in forms {
            assert_eq!(form.width(), numbers.len());
            let found = form.rotation(numbers).unwrap();
            assert!(found.dot(quarter).abs() > 1.0 - 1e-15, "{form:?}: {found}");
        }
        // Intrinsic: the second rotation is about the rotated axis. Extrinsic: about the axis of the world. The values
        // are those of SciPy's from_euler("XYZ", [90, 90, 0]) and ("xyz", [90, 90, 0]).
        let intrinsic = euler("XYZ", true).rotation(&[90.0, 90.0, 0.0]).unwrap();
        assert!(intrinsic.dot(DQuat::from_xyzw(0.5, 0.5, 0.5, 0.5)).abs() > 1.0 - 1e-15);
        let extrinsic = euler("xyz", true).rotation(&[90.0, 90.0, 0.0]).unwrap();
        assert!(extrinsic.dot(DQuat::from_xyzw(0.5, 0.5, -0.5, 0.5)).abs() > 1.0 - 1e-15);
        assert_eq!(RotationForm::Matrix.rotation(&[1.0; 9]), None);
        assert_eq!(euler("XYZ", true).rotation(&[f64::NAN, 0.0, 0.0]), None);
        let still = RotationForm::Vector { degrees: false }.rotation(&[0.0; 3]);
        assert_eq!(still, Some(DQuat::IDENTITY));
    }
}
