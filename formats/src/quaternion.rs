//! Converts quaternions in f64 to keys.

use glam::{DQuat, Quat};
use tumble::UNIT_TOLERANCE;

/// The order of a quaternion's components in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum ComponentOrder {
    /// `x y z w`, as in memory, glTF and `SciPy`.
    #[default]
    Xyzw,
    /// `w x y z`, as in `.dat` files.
    Wxyz,
}

tumble::names! {
    ComponentOrder, "order",
    Xyzw => "xyzw",
    Wxyz => "wxyz",
}

/// The inner product in R⁴.
#[inline(always)]
pub(crate) fn dot(a: DQuat, b: DQuat) -> f64 {
    a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w
}

/// Each component rounded to f32. Not by `map` of an array, which is a call for each component.
#[inline(always)]
pub(crate) fn rounded(q: DQuat) -> Quat {
    q.as_quat()
}

/// The unit quaternion nearest to `q`, in f32.
pub(crate) fn unit(q: DQuat) -> Quat {
    let norm = dot(q, q).sqrt();
    Quat::from_array(q.to_array().map(|component| (component / norm) as f32))
}

/// The unit quaternion of `key`, in f32. If the key rounded to f32 is a unit quaternion, it is only rounded, so that
/// writing and reading a set is exact. Otherwise it is normalised in f64.
#[must_use]
pub fn nearest_unit(key: DQuat) -> Quat {
    let near = rounded(key);
    let exact = near.as_dquat();
    if (dot(exact, exact).sqrt() - 1.0).abs() <= UNIT_TOLERANCE {
        return near;
    }
    unit(key)
}
