//! Quaternions on the way from text to keys.

use glam::{DQuat, Quat};

/// The inner product in R⁴.
pub(crate) fn dot(a: DQuat, b: DQuat) -> f64 {
    a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w
}

/// Each component rounded to f32.
pub(crate) fn rounded(q: DQuat) -> Quat {
    Quat::from_array(q.to_array().map(|component| component as f32))
}

/// The unit quaternion nearest to `q`, in f32.
pub(crate) fn unit(q: DQuat) -> Quat {
    let norm = dot(q, q).sqrt();
    Quat::from_array(q.to_array().map(|component| (component / norm) as f32))
}
