//! Skeletons as C passes them: two arrays, with a parent and an offset for each joint.

use glam::Vec3;

use crate::arguments::{list, product};
use crate::result::Failure;

/// The parent and the offset of each joint of two arrays; null offsets are all 0.
///
/// # Safety
/// `parents` must have `joint_count` numbers, and `offsets` must be null or have 3 × `joint_count`.
pub(crate) unsafe fn joints(
    parents: *const i32,
    offsets: *const f32,
    joint_count: usize,
) -> Result<Vec<(Option<usize>, Vec3)>, Failure> {
    let numbers = match offsets.is_null() {
        true => 0,
        false => product::<f32>(joint_count, 3, "offsets")?,
    };
    // SAFETY: as the caller promises.
    let (parents, offsets) = unsafe {
        (
            list(parents, joint_count, "parents")?,
            list(offsets, numbers, "offsets")?,
        )
    };
    let (offsets, _) = offsets.as_chunks::<3>();
    let joint = |(joint, &number): (usize, &i32)| {
        let parent = usize::try_from(number).ok();
        if parent.is_none() && number != -1 {
            let message = format!("`parents[{joint}]` is {number}; that of a root is -1");
            return Err(Failure::argument(message));
        }
        let offset = offsets.get(joint).copied().map_or(Vec3::ZERO, Vec3::from);
        Ok((parent, offset))
    };
    parents.iter().enumerate().map(joint).collect()
}
