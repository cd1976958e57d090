//! Which instances of a crowd are evaluated.

use crate::arguments::{Out, list};
use crate::crowd::player::TumbleCrowd;
use crate::handle;
use crate::result::{TumbleResult, code};

/// From now on evaluates the instances of a list alone, as a camera sees them: a result has their rows and no others,
/// in the list's order, with the bits that they have among all. The others go on meanwhile. The list is in any
/// order, names no instance twice, and may be empty; it is copied. If it is refused, everything stays.
///
/// # Safety
/// `instances` has `count` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_set_visible(
    crowd: *mut TumbleCrowd,
    instances: *const u32,
    count: usize,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        // SAFETY: as the caller promises.
        let instances = unsafe { list(instances, count, "instances")? };
        Ok(crowd.lock()?.inner.set_visible(instances)?)
    })
}

/// From now on evaluates all instances again.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_set_all_visible(crowd: *mut TumbleCrowd) -> TumbleResult {
    code(|| {
        handle::get(crowd)?.lock()?.inner.set_all_visible();
        Ok(())
    })
}

/// How many instances are evaluated: as many as the list has, or all.
///
/// # Safety
/// `count` has room for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_visible_count(
    crowd: *const TumbleCrowd,
    count: *mut usize,
) -> TumbleResult {
    code(|| {
        let out = Out::new(count, "count")?;
        let visible = handle::get(crowd)?.lock()?.inner.visible_count();
        // SAFETY: as the caller promises.
        unsafe { out.set(visible) };
        Ok(())
    })
}
