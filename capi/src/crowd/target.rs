//! Crowds on an application's Vulkan device, recorded into the application's command buffers.

use std::ffi::c_void;

use tumble::crowd::{Crowd, CrowdStage};
use tumble::vulkan::{CommandScopes, CommandUsers, CrowdTarget, VulkanBuffer};

use crate::arguments::{Out, flag, option, vulkan};
use crate::crowd::output;
use crate::crowd::player::TumbleCrowd;
use crate::handle::{self, Object};
use crate::result::{Failure, TumbleResult, code};
use crate::vulkan::buffer_range;

/// Matrices of a crowd in a buffer that become those of a later stage, in place. The application may have changed
/// them before.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleCrowdStage {
    /// `TUMBLE_CROWD_VALUES_LOCAL` become `TUMBLE_CROWD_VALUES_MODEL`.
    LocalToModel = 0,
    /// `TUMBLE_CROWD_VALUES_MODEL` become `TUMBLE_CROWD_VALUES_SKINNING`.
    ModelToSkinning = 1,
    /// `TUMBLE_CROWD_VALUES_LOCAL` become `TUMBLE_CROWD_VALUES_SKINNING`.
    LocalToSkinning = 2,
}

/// A crowd target: everything that is needed to record evaluations of a crowd, or a stage of them, and the range of the
/// application's buffer that receives their results.
pub struct TumbleCrowdTarget {
    inner: CrowdTarget,
}

impl Object for TumbleCrowdTarget {
    const NAME: &'static str = "crowd target";
}

/// Prepares the recording of evaluations of a crowd, whose results go to a range of the application's Vulkan buffer.
///
/// Kernels are compiled and memory is allocated here, not when a frame is recorded. The crowd's engine must have been
/// created by `tumble_engine_from_vulkan`. This call checks kernels that were not checked before, and then submits to
/// the engine's queue. `values` is a `TumbleCrowdValues`. `half` is 0 for numbers of 32 bits, 1 for 16 bits. `buffer`
/// is the `VkBuffer`, as a number: `(uint64_t)buffer`. The range starts at `offset`, a multiple of 256, and has `size`
/// bytes: at least `tumble_crowd_output_count` × 4, or × 2 with `half` 1, and room for one instance. If it has room for
/// more instances than are visible now, more may be visible later.
///
/// The buffer must belong to the engine's device, be bound to memory, and have the usage
/// `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT`. The application frees the target with `tumble_crowd_target_free` before it
/// destroys the buffer or the device.
///
/// # Errors
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if the engine was not created by `tumble_engine_from_vulkan`.
/// - `TUMBLE_RESULT_WRONG_SIZE` if the range is not aligned or too short.
/// - `TUMBLE_RESULT_WRONG_STATE` if skinning matrices are requested but the library has no inverse bind matrices.
/// - `TUMBLE_RESULT_DEVICE` if the device fails.
///
/// # Safety
/// The buffer must be as described, and `target` must point to memory for a handle.
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
    let made = |crowd: &Crowd, buffer| {
        let output = output::output(values, flag(half, "half")?)?;
        // SAFETY: as the caller promises.
        Ok(unsafe { crowd.target(output, buffer) }?)
    };
    // SAFETY: as the caller promises.
    unsafe { new_target(crowd, [buffer, offset, size], target, made) }
}

/// Prepares a stage that continues matrices in a range of the application's Vulkan buffer, in place, in 32 bits.
///
/// `stage` is a `TumbleCrowdStage`. A frame is then, for example: `tumble_crowd_record` with a target for
/// `TUMBLE_CROWD_VALUES_LOCAL` in this range, the application's own commands that change these matrices (inverse
/// kinematics), and `tumble_crowd_record` with the stage's target, which makes them skinning matrices. The stage
/// continues the matrices of as many instances as are visible when it is recorded. The application may have changed these
/// matrices. Results have the bits of the CPU, if all numbers are finite and less than 2^36 in magnitude; where
/// nothing was changed, they have the bits of an evaluation without stages. The buffer, its range and the errors
/// are as for `tumble_crowd_target_new` with matrices in 32 bits.
///
/// # Safety
/// As for `tumble_crowd_target_new`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_stage_target_new(
    crowd: *const TumbleCrowd,
    stage: u32,
    buffer: u64,
    offset: u64,
    size: u64,
    target: *mut *mut TumbleCrowdTarget,
) -> TumbleResult {
    let made = |crowd: &Crowd, buffer| {
        let stage = option(stage, &CrowdStage::ALL, "stage")?;
        // SAFETY: as the caller promises.
        Ok(unsafe { crowd.stage_target(stage, buffer) }?)
    };
    // SAFETY: as the caller promises.
    unsafe { new_target(crowd, [buffer, offset, size], target, made) }
}

/// Gives the handle of what `make` makes for a range of the application's buffer: handle, offset and size.
///
/// # Safety
/// `target` must point to memory for a handle.
unsafe fn new_target(
    crowd: *const TumbleCrowd,
    [buffer, offset, size]: [u64; 3],
    target: *mut *mut TumbleCrowdTarget,
    make: impl FnOnce(&Crowd, VulkanBuffer) -> Result<CrowdTarget, Failure>,
) -> TumbleResult {
    code(|| {
        let out = Out::new(target, "target")?;
        let crowd = handle::get(crowd)?;
        let buffer = buffer_range(crowd.is_on_application_device, buffer, offset, size)?;
        let inner = make(&crowd.lock()?.inner, buffer)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(TumbleCrowdTarget { inner })) };
        Ok(())
    })
}

/// Records an evaluation at the clock's time, or the stage of the target, into the application's command buffer
/// `commands`, a `VkCommandBuffer`.
///
/// The commands write up to 20 bytes for each layer that changed since the last evaluation and 4 bytes for each
/// instance of a new list of visible instances, and dispatch the kernels. A stage writes none of these changes; they
/// remain for the next evaluation. If no instance is visible, nothing is recorded. Nothing is submitted, waited for or
/// allocated. Barriers are included: the evaluation waits for all commands that were recorded before it; commands that
/// are recorded after it, or submitted to the same queue later, see the result.
///
/// The command buffer must belong to the engine's device and to the family of the engine's queue, and must be in the
/// recording state, outside a render pass. Everything that is recorded must be submitted to the engine's queue, once
/// and in the order of the calls. If a recorded frame is discarded, call `tumble_crowd_forget_recorded`.
/// `tumble_engine_from_vulkan` says which calls of the library submit to that queue: the application must not submit
/// at the same time without a lock.
///
/// # Errors
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if the target belongs to another crowd.
/// - `TUMBLE_RESULT_WRONG_SIZE` if more instances are visible than the target has room for.
///
/// After any error nothing is recorded.
///
/// # Safety
/// The command buffer must be as described, nothing else may use it during the call, and its commands must be
/// submitted as described.
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

/// Commands of an application that use the memory of a result.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleCommandUsers {
    /// All commands.
    Any = 0,
    /// Compute shaders.
    Kernels = 1,
    /// Copies, fills and updates of buffers.
    Copies = 2,
    /// Compute shaders, copies, fills and updates.
    KernelsAndCopies = 3,
    /// The host.
    Host = 4,
    /// Vertex shaders, and vertex buffers: the queue must support graphics.
    VertexShaders = 5,
}

/// As `tumble_crowd_record`, but the barriers order the evaluation only with the commands that are named: it waits for
/// those of `before`, and those of `after` wait for it. Both are `TumbleCommandUsers`. Earlier evaluations of the crowd
/// are always waited for. Waiting for fewer kinds of commands takes less time.
///
/// # Errors
/// As `tumble_crowd_record`; also `TUMBLE_RESULT_INVALID_ARGUMENT` if a constant is unknown.
///
/// # Safety
/// As for `tumble_crowd_record`. In addition, the application must have its own barriers for all other commands that use
/// the result's memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_record_between(
    crowd: *mut TumbleCrowd,
    target: *const TumbleCrowdTarget,
    commands: *mut c_void,
    before: u32,
    after: u32,
) -> TumbleResult {
    code(|| {
        let (crowd, target) = (handle::get(crowd)?, handle::get(target)?);
        let commands = vulkan(commands, "commands")?;
        let scopes = CommandScopes::default()
            .with_before(option(before, &CommandUsers::ALL, "before")?)
            .with_after(option(after, &CommandUsers::ALL, "after")?);
        let mut state = crowd.lock()?;
        // SAFETY: as the caller promises.
        unsafe {
            state
                .inner
                .record_between(&target.inner, commands, scopes)?;
        }
        Ok(())
    })
}

/// Marks all layers as unknown to the device, so that the next evaluation writes all of them. Call it if a recorded
/// frame was discarded.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_forget_recorded(crowd: *mut TumbleCrowd) -> TumbleResult {
    code(|| {
        handle::get(crowd)?.lock()?.inner.forget_recorded();
        Ok(())
    })
}

/// Frees a crowd target. Does nothing if `target` is null.
///
/// # Safety
/// All work that was recorded with the target must have ended, and none may be submitted later.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_target_free(target: *mut TumbleCrowdTarget) -> TumbleResult {
    code(|| handle::free(target))
}
