//! Crowds on an application's own Vulkan device, recorded into its own command buffers.

use std::ffi::c_void;

use tumble::vulkan::CrowdTarget;

use crate::arguments::{Out, flag, vulkan};
use crate::crowd::output;
use crate::crowd::player::TumbleCrowd;
use crate::handle::{self, Object};
use crate::result::{TumbleResult, code};
use crate::vulkan::buffer_range;

/// A range of an application's buffer that a crowd is evaluated into, with all that recording needs.
pub struct TumbleCrowdTarget {
    inner: CrowdTarget,
}

impl Object for TumbleCrowdTarget {
    const NAME: &'static str = "crowd target";
}

/// Prepares everything to evaluate into a range of an application's buffer, on the device of
/// `tumble_engine_from_vulkan`: kernels are compiled and memory is allocated here, and not when a frame
/// is recorded. `values` is a `TumbleCrowdValues`, and `half` 1 for numbers of 16 bits. `buffer` is the
/// `VkBuffer`, as a number: `(uint64_t)buffer`. The range starts at `offset`, a multiple of 256, and has
/// at least `tumble_crowd_output_count` × 4 bytes, × 2 with `half`: as many instances as have room there may be
/// visible later.
///
/// The buffer belongs to that device, has memory, and was made for use as
/// `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT`; it stays the application's, and lives longer than the target.
///
/// # Safety
/// The buffer is as said, and `target` has room for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_target_new(
    crowd: *const TumbleCrowd,
    values: u32,
    half: u32,
    buffer: u64,
    offset: u64,
    size: u64,
    target: *mut *mut TumbleCrowdTarget,
) -> TumbleResult {
    code(|| {
        let out = Out::new(target, "target")?;
        let crowd = handle::get(crowd)?;
        let output = output::output(values, flag(half, "half")?)?;
        let buffer = buffer_range(crowd.is_on_application_device, buffer, offset, size)?;
        // SAFETY: as the caller promises.
        let inner = unsafe { crowd.lock()?.inner.target(output, buffer)? };
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(TumbleCrowdTarget { inner })) };
        Ok(())
    })
}

/// Records an evaluation at the clock's time into the application's `VkCommandBuffer`: up to 20 bytes for each
/// layer that changed since the last evaluation, 4 for each instance of a new list of visible ones, and the dispatches. Nothing is waited for, submitted or
/// allocated. What is recorded behind it, or submitted to the same queue later, sees the result; it
/// waits for all that was recorded before it.
///
/// The command buffer is of the engine's device and of the family of its queue, in recording, outside of
/// a render pass. What is recorded is submitted once, to the engine's queue, in the order of the calls;
/// after a frame that is thrown away, call `tumble_crowd_forget_recorded`. The library submits to that
/// queue by itself only in `tumble_upload`, `tumble_evaluate`, `tumble_clip_evaluate`,
/// `tumble_clip_evaluate_to_buffer`, `tumble_crowd_new`, `tumble_crowd_evaluate` and `tumble_crowd_submit` (and their `half` forms): the
/// application keeps these calls and its own submissions from one another.
///
/// # Safety
/// The command buffer is as said, and its work is submitted as said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_record(
    crowd: *mut TumbleCrowd,
    target: *const TumbleCrowdTarget,
    commands: *mut c_void,
) -> TumbleResult {
    code(|| {
        let (crowd, target) = (handle::get(crowd)?, handle::get(target)?);
        let commands = vulkan(commands, "commands")?;
        let mut state = crowd.lock()?;
        // SAFETY: as the caller promises.
        unsafe { state.inner.record(&target.inner, commands)? };
        Ok(())
    })
}

/// Forgets what was recorded: the next evaluation writes all layers again.
/// Call it if a recorded frame was discarded.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_forget_recorded(crowd: *mut TumbleCrowd) -> TumbleResult {
    code(|| {
        handle::get(crowd)?.lock()?.inner.forget_recorded();
        Ok(())
    })
}

/// Frees a target, after all work that was recorded with it has ended. Null is allowed.
///
/// # Safety
/// No such work is in flight.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_target_free(target: *mut TumbleCrowdTarget) -> TumbleResult {
    code(|| handle::free(target))
}
