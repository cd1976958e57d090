//! Sequences of Euler angles.

use std::fmt;
use std::str::FromStr;

use crate::math::quaternion::{Quaternion, about, product};
use crate::shader::{INTRINSIC, NEGATIVE, SYMMETRIC};

/// The axes x, y and z.
const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The three axes of Euler angles: one of twelve sequences, about axes that rotate with the body (intrinsic) or are
/// fixed (extrinsic).
///
/// ```
/// use tumble::EulerSequence;
/// let yaw_pitch_roll: EulerSequence = "ZYX".parse()?; // intrinsic: about the turned axes
/// let the_same: EulerSequence = "xyz".parse()?;       // extrinsic: about the fixed ones
/// assert!("XXY".parse::<EulerSequence>().is_err());
/// # Ok::<(), tumble::EulerSequenceError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct EulerSequence {
    axes: [u8; 3],
    intrinsic: bool,
}

impl EulerSequence {
    /// Intrinsic: about x, then about the rotated y, then about the rotated z.
    pub const XYZ: Self = Self {
        axes: [0, 1, 2],
        intrinsic: true,
    };

    /// All 24 sequences: twelve intrinsic ones, then twelve extrinsic ones.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let axes = (0..27u8).map(|code| [code / 9, code / 3 % 3, code % 3]);
        let axes = axes.filter(|[i, j, k]| i != j && j != k);
        let all = |intrinsic| axes.clone().map(move |axes| Self { axes, intrinsic });
        all(true).chain(all(false)).collect()
    }

    /// The axes in the order of the angles: 0, 1, 2 for x, y, z.
    pub fn axes(self) -> [usize; 3] {
        self.axes.map(usize::from)
    }

    /// The names of the angles: the axis, and its index in the sequence from 1.
    pub(crate) fn angle_names(self) -> &'static [&'static str; 3] {
        const NAMES: [[&str; 3]; 27] = {
            let [first, second, third] =
                [["x1", "y1", "z1"], ["x2", "y2", "z2"], ["x3", "y3", "z3"]];
            let (mut names, mut code) = ([[""; 3]; 27], 0);
            while code < 27 {
                names[code] = [first[code / 9], second[code / 3 % 3], third[code % 3]];
                code += 1;
            }
            names
        };
        let [i, j, k] = self.axes();
        &NAMES[9 * i + 3 * j + k]
    }

    /// Whether each angle is about an axis that was rotated by the angles before it.
    #[must_use]
    pub fn is_intrinsic(self) -> bool {
        self.intrinsic
    }

    /// The parameter of the kernels' store: two bits for each axis, then the flags of
    /// `shaders/stores/euler.wgsl`.
    pub(crate) fn detail(self) -> u32 {
        let [mut i, j, mut k] = self.axes.map(i32::from);
        if self.intrinsic {
            (i, k) = (k, i);
        }
        let symmetric = i == k;
        if symmetric {
            k = 3 - i - j;
        }
        let negative = (i - j) * (j - k) * (k - i) < 0;
        let flag = |set: bool, bit: u32| if set { bit } else { 0 };
        (i | j << 2 | k << 4) as u32
            | flag(symmetric, SYMMETRIC)
            | flag(negative, NEGATIVE)
            | flag(self.intrinsic, INTRINSIC)
    }

    /// The rotation of three angles in degrees, for the sequence that the parameter of the kernels' store encodes.
    pub(crate) fn decode(degrees: &dyn Fn(usize) -> f32, detail: u32) -> [f32; 4] {
        let axis = |index: u32| AXES[(detail >> (2 * index) & 3) as usize];
        let last_axis = axis(if detail & SYMMETRIC != 0 { 0 } else { 2 });
        let is_intrinsic = detail & INTRINSIC != 0;
        let (first, last) = if is_intrinsic { (2, 0) } else { (0, 2) };
        let rotation = |axis, angle| -> Quaternion { about(axis, f64::from(degrees(angle))) };
        let later = product(rotation(last_axis, last), rotation(axis(1), 1));
        product(later, rotation(axis(0), first)).map(|c| c as f32)
    }
}

impl EulerSequence {
    /// The sequence in words: `euler XYZ`.
    pub(crate) fn in_words(self) -> String {
        self.to_string()
    }
}

impl fmt::Display for EulerSequence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let letters = if self.intrinsic { "XYZ" } else { "xyz" };
        let mut axes = self.axes().into_iter();
        axes.try_for_each(|axis| f.write_str(&letters[axis..=axis]))
    }
}

/// The text is not a sequence of Euler angles.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{name}` is not a sequence of Euler angles; give three axes, no two neighbours the same: XYZ, ZXZ … for intrinsic angles, xyz, zxz … for extrinsic ones"
)]
#[non_exhaustive]
pub struct EulerSequenceError {
    /// The text.
    pub name: String,
}

impl FromStr for EulerSequence {
    type Err = EulerSequenceError;

    fn from_str(name: &str) -> Result<Self, EulerSequenceError> {
        let named = |sequence: &Self| sequence.to_string() == name;
        Self::all()
            .into_iter()
            .find(named)
            .ok_or_else(|| EulerSequenceError {
                name: name.to_owned(),
            })
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::EulerSequence;
    use crate::twin::axis_angle::axis_angle;
    use crate::twin::euler::euler;
    use crate::twin::matrix::rows;

    const AXES: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];

    fn composed(sequence: EulerSequence, degrees: [f32; 3]) -> DQuat {
        let rotations = [0, 1, 2].map(|i| {
            let angle = f64::from(degrees[i]).to_radians();
            DQuat::from_axis_angle(AXES[sequence.axes()[i]], angle)
        });
        if sequence.is_intrinsic() {
            rotations[0] * rotations[1] * rotations[2]
        } else {
            rotations[2] * rotations[1] * rotations[0]
        }
    }

    fn rotations() -> Vec<DQuat> {
        let mut all = vec![DQuat::IDENTITY, -DQuat::IDENTITY];
        for i in 0..4000 {
            let x = f64::from(i);
            let axis = DVec3::new((x * 0.7).sin(), (x * 1.3).cos(), (x * 0.4).sin());
            all.push(DQuat::from_axis_angle(axis.normalize(), x * 0.0031 - 6.2));
        }
        // Angles in gimbal lock, and close to it.
        for axis in AXES {
            for angle in [90.0, -90.0, 180.0, 90.001, 1e-4, 179.999] {
                let rotation = DQuat::from_axis_angle(axis, f64::to_radians(angle));
                all.push(rotation);
                all.push(DQuat::from_rotation_x(0.3) * rotation * DQuat::from_rotation_x(-0.8));
            }
        }
        all
    }

    #[test]
    fn angles_put_together_are_the_rotation() {
        let mut locked = 0;
        for rotation in rotations() {
            let stored = rotation.as_quat().to_array();
            let exact = rotation.as_quat().as_dquat().normalize();
            for sequence in EulerSequence::all() {
                let angles = euler(stored, sequence.detail());
                let off =
                    crate::reference::quaternion::angle_between(composed(sequence, angles), exact);
                assert!(off < 1.5e-6, "{sequence}, {rotation}: {angles:?}, {off:e}");
                let [first, second, third] = angles;
                assert!(first.abs() <= 180.0 && third.abs() <= 180.0);
                let symmetric = sequence.axes()[0] == sequence.axes()[2];
                let range = if symmetric { 0.0..=180.0 } else { -90.0..=90.0 };
                assert!(range.contains(&second), "{sequence}: {angles:?}");
                locked += usize::from(third == 0.0);
            }
        }
        assert!(locked > 50, "{locked}");
    }

    #[test]
    fn axes_and_matrices_are_the_rotation() {
        for rotation in rotations() {
            let stored = rotation.as_quat();
            let exact = stored.as_dquat().normalize();
            let [x, y, z, degrees] = axis_angle(stored.to_array()).map(f64::from);
            let axis = DVec3::new(x, y, z);
            assert!((axis.length() - 1.0).abs() < 3e-7);
            assert!((0.0..=360.0).contains(&degrees));
            let back = DQuat::from_axis_angle(axis.normalize(), degrees.to_radians());
            let off = crate::reference::quaternion::angle_between(back, exact);
            assert!(off < 1.2e-6, "{rotation}: {degrees}° about {axis}, {off:e}");
            for (r, row) in rows(stored.to_array(), 0).into_iter().enumerate() {
                for (c, found) in row.into_iter().enumerate() {
                    let expected = (exact * AXES[c])[r];
                    assert!((f64::from(found) - expected).abs() < 4e-7);
                    let transposed = rows(stored.to_array(), 1)[c][r];
                    assert_eq!(found.to_bits(), transposed.to_bits());
                }
            }
        }
    }

    #[test]
    fn names_are_sequences() {
        assert_eq!(EulerSequence::all().len(), 24);
        for sequence in EulerSequence::all() {
            assert_eq!(sequence.to_string().parse(), Ok(sequence));
        }
        for wrong in ["", "XY", "XYY", "Xyz", "xyzx", "abc"] {
            assert!(wrong.parse::<EulerSequence>().is_err(), "{wrong}");
        }
    }
}
