//! Which instances of a crowd are evaluated.

use crate::arguments::{Out, list};
use crate::crowd::player::TumbleCrowd;
use crate::handle;
use crate::result::{TumbleResult, code};

/// Limits evaluations to a list of `count` instances, for example those that a camera sees.
///
/// A result then has the rows of these instances only, in the list's order, with the same bits as among all
/// instances. The clips of the other instances continue. The list may be in any order and may be empty; no instance
/// may be in it twice. It is copied.
///
/// # Errors
/// - `TUMBLE_RESULT_OUT_OF_RANGE` if an instance does not exist.
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if an instance is in the list twice.
///
/// After any error nothing changes.
///
/// # Safety
/// `instances` must have `count` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_set_visible(
    crowd: *mut TumbleCrowd,
    instances: *const usize,
    count: usize,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        // SAFETY: as the caller promises.
        let instances = unsafe { list(instances, count, "instances")? };
        Ok(crowd.lock()?.inner.set_visible(instances)?)
    })
}

/// Makes all instances visible again, in the order of their indices.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_set_all_visible(crowd: *mut TumbleCrowd) -> TumbleResult {
    code(|| {
        handle::get(crowd)?.lock()?.inner.set_all_visible();
        Ok(())
    })
}

/// Returns the number of visible instances: the length of the list, or the number of all instances without a list.
///
/// # Safety
/// `count` must point to memory for a number.
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
