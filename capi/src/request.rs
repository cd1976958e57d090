//! Requests of a clip: which tracks and samples are evaluated, their layout and encoding, and whether the result goes
//! to the caller's memory or is recorded into an application's command buffers.

use std::ffi::{CString, c_char, c_void};
use std::sync::LazyLock;

use tumble::vulkan::{ClipTarget, VulkanBuffer};
use tumble::{Clip, Encoding, EncodingOptions, Error, EulerSequence, MatrixOrder, Request};

use crate::arguments::{Out, SizedStructure, list_mut, needed, option, text, vulkan};
use crate::clip::TumbleClip;
use crate::handle::{self, Object};
use crate::result::{Failure, TumbleResult, code};
use crate::samples::{TumbleSamples, layout};
use crate::vulkan::buffer_range;

/// The order of matrix elements in memory.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleMatrixOrder {
    /// Row by row.
    RowMajor = 0,
    /// Column by column.
    ColumnMajor = 1,
}

/// A request: which tracks and samples of a clip are evaluated, and their layout and encoding. If all members except
/// `size` and `samples` are 0, it selects all tracks and samples, track by track, as `x y z w` in f32.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleRequest {
    /// `sizeof(TumbleRequest)`.
    pub size: usize,
    /// The sample times, not null.
    pub samples: *const TumbleSamples,
    /// A `TumbleLayout`.
    pub layout: u32,
    /// A `TumbleMatrixOrder`, for the encodings "matrix" and "matrix-3x4".
    pub matrix_order: u32,
    /// The name of the encoding of each value, such as "f16" or "matrix-3x4", from `tumble_encoding_name`; null:
    /// "f32". Angles are in degrees.
    pub encoding: *const c_char,
    /// The axes of the encoding "euler": uppercase, such as "ZXY", for axes that rotate with the body (intrinsic);
    /// lowercase, such as "zxy", for fixed axes (extrinsic). Null: "XYZ".
    pub sequence: *const c_char,
    /// The index of the first track, from 0.
    pub first_track: usize,
    /// The number of tracks; 0: all from `first_track` on.
    pub track_count: usize,
    /// The index of the first sample, from 0.
    pub first_sample: usize,
    /// The number of samples of each track; 0: all from `first_sample` on.
    pub sample_count: usize,
}

// SAFETY: `repr(C)`, the size is the first member, and zero bits are valid numbers and null pointers.
unsafe impl SizedStructure for TumbleRequest {
    const FIRST_SIZE: usize = size_of::<Self>();
}

impl TumbleRequest {
    /// Calls `work` with the request of a structure; null is an error.
    ///
    /// # Safety
    /// The pointer must be null or point to such a structure, whose pointers are null or as its members say.
    unsafe fn read<T>(
        pointer: *const Self,
        clip: &Clip,
        work: impl FnOnce(Request<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        // SAFETY: as the caller promises.
        let (structure, frames) = unsafe {
            let structure = needed(pointer, "request")?;
            (structure, TumbleSamples::read(structure.samples)?)
        };
        // SAFETY: as the caller promises.
        let (encoding, sequence) = unsafe {
            let encoding = text(structure.encoding, "request->encoding")?;
            (encoding, text(structure.sequence, "request->sequence")?)
        };
        let encoding: Encoding = encoding
            .unwrap_or("f32")
            .parse()
            .map_err(|error| Failure::argument(format!("`request->encoding`: {error}")))?;
        let sequence = match sequence {
            None => EulerSequence::XYZ,
            Some(sequence) => sequence
                .parse()
                .map_err(|error| Failure::argument(format!("`request->sequence`: {error}")))?,
        };
        let order = option(
            structure.matrix_order,
            &MatrixOrder::ALL,
            "request->matrix_order",
        )?;
        let (tracks, samples) = (clip.track_count(), clip.timeline(&frames)?.len());
        let part = |first: usize, count: usize, all: usize| match count {
            0 => first..all,
            _ => first..first.saturating_add(count),
        };
        let request = clip
            .request(&frames)
            .layout(layout(structure.layout)?)
            .encoding(
                encoding.with(
                    EncodingOptions::default()
                        .with_order(order)
                        .with_sequence(sequence),
                ),
            )
            .tracks(part(structure.first_track, structure.track_count, tracks))
            .samples(part(
                structure.first_sample,
                structure.sample_count,
                samples,
            ));
        work(request)
    }
}

static ENCODING_NAMES: LazyLock<Vec<CString>> = LazyLock::new(|| {
    let names = Encoding::kinds().map(|encoding| CString::new(encoding.name()));
    names.map(Result::unwrap_or_default).collect()
});

/// Returns the number of encodings.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_encoding_count() -> usize {
    ENCODING_NAMES.len()
}

/// Returns the name of the encoding `index`, counted from 0: a text that is never freed; null, without an error
/// message, if there is no such encoding.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_encoding_name(index: usize) -> *const c_char {
    let name = ENCODING_NAMES.get(index);
    name.map_or(std::ptr::null(), |name| name.as_ptr())
}

/// Returns the size of a request's result in bytes.
///
/// # Errors
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if a constant or a name is unknown.
/// - `TUMBLE_RESULT_OUT_OF_RANGE` if the clip does not have these tracks or samples.
/// - `TUMBLE_RESULT_INVALID_INPUT` if the sample times are invalid, or the encoding is for rotations and the clip's
///   quantity is a velocity or an acceleration.
///
/// # Safety
/// `request` must point to a `TumbleRequest` whose pointers are null or as its members say, and `bytes` must point to
/// memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_request_bytes(
    clip: *const TumbleClip,
    request: *const TumbleRequest,
    bytes: *mut usize,
) -> TumbleResult {
    code(|| {
        let out = Out::new(bytes, "bytes")?;
        let clip = handle::get(clip)?;
        // SAFETY: as the caller promises.
        let (values, each) =
            unsafe { TumbleRequest::read(request, &clip.inner, |request| Ok(request.size()?))? };
        // SAFETY: as the caller promises.
        unsafe { out.set(values.saturating_mul(each)) };
        Ok(())
    })
}

/// Evaluates a request of a clip into the caller's memory, and waits for the result.
///
/// `output` receives the values in the request's layout and encoding. `output_bytes` is its size, exactly that of
/// `tumble_request_bytes`. Memory that is aligned to 16 bytes is filled without a copy.
///
/// # Errors
/// - As `tumble_request_bytes`.
/// - `TUMBLE_RESULT_WRONG_SIZE` if `output_bytes` is another number.
/// - `TUMBLE_RESULT_DEVICE` if the device fails.
///
/// All arguments are checked before anything is written.
///
/// # Safety
/// `request` must point to a `TumbleRequest` whose pointers are null or as its members say, and `output` must have
/// `output_bytes` bytes, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_request_evaluate(
    clip: *const TumbleClip,
    request: *const TumbleRequest,
    output: *mut c_void,
    output_bytes: usize,
) -> TumbleResult {
    code(|| {
        let clip = handle::get(clip)?;
        // SAFETY: as the caller promises.
        unsafe {
            TumbleRequest::read(request, &clip.inner, |request| {
                let output: &mut [u8] = list_mut(output.cast(), output_bytes, "output")?;
                Ok(request.evaluate_into(output)?)
            })
        }
    })
}

/// A clip target: a request of a clip, prepared for recording into command buffers, and the range of the
/// application's buffer that receives its result. Any number of threads may use it at the same time.
pub struct TumbleClipTarget {
    inner: ClipTarget,
}

impl Object for TumbleClipTarget {
    const NAME: &'static str = "clip target";
}

/// Prepares the recording of a request of a clip, whose result goes to a range of the application's Vulkan buffer.
///
/// Kernels are compiled and work lists are uploaded here, not when a frame is recorded. The clip's engine must have
/// been created by `tumble_engine_from_vulkan`. This call submits to the engine's queue. `buffer` is the `VkBuffer`, as
/// a number: `(uint64_t)buffer`. The range starts at `offset`, a multiple of the bytes of a value (16 for "f32"), and
/// has `size` bytes, at least those of `tumble_request_bytes`. The buffer must belong to the engine's device, be bound
/// to memory, and have the usages `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT` and `VK_BUFFER_USAGE_TRANSFER_DST_BIT`.
///
/// The target needs neither the clip nor the engine afterwards. The application frees the target with
/// `tumble_clip_target_free` before it destroys the buffer or the device.
///
/// # Errors
/// - As `tumble_request_bytes`.
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if the engine was not created by `tumble_engine_from_vulkan`.
/// - `TUMBLE_RESULT_WRONG_SIZE` if the range is not aligned or too short.
///
/// # Safety
/// `request` must point to a `TumbleRequest` whose pointers are null or as its members say; the buffer must be as
/// described; and `target` must point to memory for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_clip_target_new(
    clip: *const TumbleClip,
    request: *const TumbleRequest,
    buffer: u64,
    offset: u64,
    size: u64,
    target: *mut *mut TumbleClipTarget,
) -> TumbleResult {
    let made = |request: Request<'_>, buffer| {
        // SAFETY: as the caller promises.
        let inner = unsafe { request.target(buffer)? };
        Ok(TumbleClipTarget { inner })
    };
    // SAFETY: as the caller promises.
    unsafe { new_target(clip, request, [buffer, offset, size], target, made) }
}

/// Gives the handle of what `make` makes of a request for a range of the application's buffer: handle, offset and size.
///
/// # Safety
/// `request` must be as for [`TumbleRequest::read`], and `target` must point to memory for a handle.
pub(crate) unsafe fn new_target<T: Object>(
    clip: *const TumbleClip,
    request: *const TumbleRequest,
    [buffer, offset, size]: [u64; 3],
    target: *mut *mut T,
    make: impl FnOnce(Request<'_>, VulkanBuffer) -> Result<T, Failure>,
) -> TumbleResult {
    code(|| {
        let out = Out::new(target, "target")?;
        let clip = handle::get(clip)?;
        let buffer = buffer_range(clip.is_on_application_device, buffer, offset, size)?;
        // SAFETY: as the caller promises.
        let made =
            unsafe { TumbleRequest::read(request, &clip.inner, |request| make(request, buffer))? };
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(made)) };
        Ok(())
    })
}

/// Records an evaluation into the application's command buffer `commands`, a `VkCommandBuffer`.
///
/// The result starts `offset` bytes after the start of the target's range, a multiple of the bytes of a value.
/// Nothing is submitted, waited for or allocated. Barriers are included: the evaluation waits for all commands that
/// were recorded before it, and all commands after it see the result. The commands may be submitted any number of
/// times, to any queue of the command buffer's family.
///
/// The command buffer must belong to the engine's device and to a queue family that can compute, and must be in the
/// recording state, outside a render pass.
///
/// # Errors
/// `TUMBLE_RESULT_WRONG_SIZE` if the result does not fit there or `offset` is not aligned; then nothing is recorded.
///
/// # Safety
/// The command buffer must be as described, and nothing else may use it during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_clip_record(
    target: *const TumbleClipTarget,
    commands: *mut c_void,
    offset: u64,
) -> TumbleResult {
    code(|| {
        let target = handle::get(target)?;
        let commands = vulkan(commands, "commands")?;
        // SAFETY: as the caller promises.
        let recorded = unsafe { target.inner.record(commands, offset) };
        recorded.map_err(|error| Error::Vulkan(error).into())
    })
}

/// Frees a clip target. Does nothing if `target` is null.
///
/// # Safety
/// All work that was recorded with the target must have ended, and none may be submitted later.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_clip_target_free(target: *mut TumbleClipTarget) -> TumbleResult {
    code(|| handle::free(target))
}
