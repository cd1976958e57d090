//! What is asked of a clip beside its samples: an encoding, some of the tracks and samples; and where the result goes:
//! the caller's memory, or an application's command buffers.

use std::ffi::{CString, c_char, c_void};
use std::sync::LazyLock;

use tumble::vulkan::ClipTarget;
use tumble::{Clip, Encoding, EncodingOptions, Error, EulerSequence, MatrixOrder, Request};

use crate::arguments::{Out, list_mut, needed, option, text, vulkan};
use crate::clip::TumbleClip;
use crate::handle::{self, Object};
use crate::result::{Failure, TumbleResult, code};
use crate::samples::{TumbleSamples, layout};
use crate::vulkan::buffer_range;

/// How a matrix lies in memory.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleMatrixOrder {
    /// Row by row.
    RowMajor = 0,
    /// Column by column.
    ColumnMajor = 1,
}

/// What is asked of a clip. All zeros but `size` and `samples` ask for all of it, as `x y z w` in f32, track by track.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleRequest {
    /// `sizeof(TumbleRequest)`.
    pub size: usize,
    /// At which times.
    pub samples: *const TumbleSamples,
    /// A `TumbleLayout`.
    pub layout: u32,
    /// A `TumbleMatrixOrder`, for matrices.
    pub matrix_order: u32,
    /// The name of what each rotation is stored as, such as "f16" or "matrix-3x4" (`tumble_encoding_name`); null:
    /// "f32".
    pub encoding: *const c_char,
    /// The axes of "euler": "ZXY" about turned axes, "zxy" about fixed ones; null: "XYZ".
    pub sequence: *const c_char,
    /// The first track, from 0.
    pub first_track: usize,
    /// How many tracks; 0: all from the first one on.
    pub track_count: usize,
    /// The first of the samples, from 0.
    pub first_sample: usize,
    /// How many of the samples; 0: all from the first one on.
    pub sample_count: usize,
}

impl TumbleRequest {
    /// Calls `work` with the request that the structure says.
    ///
    /// # Safety
    /// The pointer is null or that of such a structure, whose pointers are null or those of what is said there.
    unsafe fn read<T>(
        pointer: *const Self,
        clip: &Clip,
        work: impl FnOnce(Request<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        // SAFETY: as the caller promises.
        let (structure, frames) = unsafe {
            let size = |pointer: *const Self| (&raw const (*pointer).size).cast();
            let structure = needed(pointer, size, "request")?;
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
            .encoding(encoding.with(EncodingOptions { order, sequence }))
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

/// The number of encodings.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_encoding_count() -> usize {
    ENCODING_NAMES.len()
}

/// The name of an encoding, from 0; null where there is none.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_encoding_name(index: usize) -> *const c_char {
    let name = ENCODING_NAMES.get(index);
    name.map_or(std::ptr::null(), |name| name.as_ptr())
}

/// How many bytes the result of a request has.
///
/// # Safety
/// `request` is such a structure, and `bytes` has room for a number.
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

/// Evaluates what is asked of a clip into the caller's memory: exactly `tumble_request_bytes`, values of the encoding in
/// the order of the layout. All arguments are checked before anything is written.
///
/// # Safety
/// `request` is such a structure, and `output` has room for so many bytes, which nothing else uses during the call.
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

/// A range of an application's buffer that a request of a clip is evaluated into, with all that recording needs.
pub struct TumbleClipTarget {
    inner: ClipTarget,
}

impl Object for TumbleClipTarget {
    const NAME: &'static str = "clip target";
}

/// Makes ready what it takes to evaluate a request into a range of a buffer of the application's, on the device of
/// `tumble_engine_from_vulkan`: kernels are compiled, and what they read of the samples is brought to the device, here,
/// and not when a frame is recorded. `buffer` is the `VkBuffer`, as a number: `(uint64_t)buffer`. The range starts at
/// a multiple of the bytes of a value (16 for "f32"), and has at least `tumble_request_bytes`.
///
/// The buffer belongs to that device, has memory, and was made for use as `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT` and
/// `VK_BUFFER_USAGE_TRANSFER_DST_BIT`; it stays the application's, and lives longer than the target. The target needs
/// neither the clip nor the engine that it was made of. This call submits to the queue, as uploading does.
///
/// # Safety
/// `request` is such a structure, the buffer is as said, and `target` has room for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_clip_target_new(
    clip: *const TumbleClip,
    request: *const TumbleRequest,
    buffer: u64,
    offset: u64,
    size: u64,
    target: *mut *mut TumbleClipTarget,
) -> TumbleResult {
    code(|| {
        let out = Out::new(target, "target")?;
        let clip = handle::get(clip)?;
        let buffer = buffer_range(clip.is_on_application_device, buffer, offset, size)?;
        // SAFETY: as the caller promises.
        let inner = unsafe {
            TumbleRequest::read(request, &clip.inner, |request| Ok(request.target(buffer)?))?
        };
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(TumbleClipTarget { inner })) };
        Ok(())
    })
}

/// Records an evaluation into the application's `VkCommandBuffer`, to `offset` bytes behind the beginning of the
/// target's range, a multiple of the bytes of a value. Nothing is waited for, submitted or allocated. What is recorded
/// waits for all that was recorded before it, and all that comes behind it sees the result; it may be submitted any
/// number of times, to any queue of the family.
///
/// The command buffer is of the engine's device and of a family that computes, in recording, outside of a render pass.
///
/// # Safety
/// The command buffer is as said, and nobody else uses it during the call.
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

/// Frees a target, after all work that was recorded with it has ended. Null is allowed.
///
/// # Safety
/// No such work is in flight, and none will be submitted.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_clip_target_free(target: *mut TumbleClipTarget) -> TumbleResult {
    code(|| handle::free(target))
}
