//! Evaluation of a set in one call, or of a clip that stays on a device.

use tumble::{Clip, SampleTimes, Timeline, TrackSet};

use crate::arguments::{Out, list_mut};
use crate::engine::TumbleEngine;
use crate::handle::{self, Object};
use crate::interpolation::TumbleInterpolation;
use crate::result::{Failure, TumbleResult, code};
use crate::samples::{TumbleSamples, layout};
use crate::set::TumbleSet;
use crate::vulkan::buffer_range;

/// A clip: a set that was prepared for one interpolation and uploaded to an engine's device. Any number of threads
/// may use it at the same time.
pub struct TumbleClip {
    pub(crate) inner: Clip,
    /// Whether its engine is on the application's Vulkan device.
    pub(crate) is_on_application_device: bool,
}

impl Object for TumbleClip {
    const NAME: &'static str = "clip";
}

/// Checks that `floats` is the number of floats of a result, four for each sample of each track.
fn check_size(tracks: usize, timeline: &Timeline, floats: usize) -> Result<(), Failure> {
    let needed = tracks as u128 * timeline.len() as u128 * 4;
    if floats as u128 == needed {
        return Ok(());
    }
    let message = format!(
        "`output_count` is {floats}; the result has {needed} floats: {tracks} tracks × {} samples × 4",
        timeline.len()
    );
    Err(Failure::new(TumbleResult::WrongSize, message))
}

fn timeline(set: &TrackSet, frames: &SampleTimes) -> Result<Timeline, Failure> {
    Ok(frames.resolve(set.track_count(), set.time_span())?)
}

/// Returns the number of samples of each track of a set. A result has 4 × tracks × samples floats.
///
/// # Errors
/// `TUMBLE_RESULT_INVALID_INPUT` if the sample times are invalid or do not fit the set.
///
/// # Safety
/// `samples` must point to a `TumbleSamples` whose `times` has `time_count` numbers, and `count` must point to memory
/// for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_set_sample_count(
    set: *const TumbleSet,
    samples: *const TumbleSamples,
    count: *mut usize,
) -> TumbleResult {
    code(|| {
        let out = Out::new(count, "count")?;
        let set = handle::get(set)?;
        // SAFETY: as the caller promises.
        let frames = unsafe { TumbleSamples::read(samples)? };
        let timeline = timeline(&set.read(), &frames)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(timeline.len()) };
        Ok(())
    })
}

/// Prepares and evaluates a set in one call, into the caller's memory, and waits for the result.
///
/// `interpolation` may be null for the defaults. `layout` is a `TumbleLayout`. `output` receives four floats for each
/// sample of each track, according to the quantity of the interpolation. `output_count` is the number of floats,
/// exactly 4 × tracks × samples (`tumble_set_sample_count`). Memory that is aligned to 16 bytes is filled without a
/// copy.
///
/// # Errors
/// - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is another number.
/// - `TUMBLE_RESULT_INVALID_INPUT` if the sample times are invalid, or a track cannot be interpolated as requested.
/// - `TUMBLE_RESULT_DEVICE` if the device fails.
///
/// All arguments are checked before anything is written.
///
/// # Safety
/// `interpolation` must be null or point to a `TumbleInterpolation` whose `method` is null or a text that ends with a
/// zero byte; `samples` must point to a `TumbleSamples` whose `times` has `time_count` numbers; and `output` must
/// have `output_count` floats, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_evaluate(
    engine: *const TumbleEngine,
    set: *const TumbleSet,
    interpolation: *const TumbleInterpolation,
    samples: *const TumbleSamples,
    layout: u32,
    output: *mut f32,
    output_count: usize,
) -> TumbleResult {
    code(|| {
        let (engine, set) = (handle::get(engine)?, handle::get(set)?);
        // SAFETY: as the caller promises.
        let (interpolation, frames) = unsafe {
            let interpolation = TumbleInterpolation::read(interpolation)?;
            (interpolation, TumbleSamples::read(samples)?)
        };
        let layout = self::layout(layout)?;
        let set = set.read();
        let timeline = timeline(&set, &frames)?;
        check_size(set.track_count(), &timeline, output_count)?;
        // SAFETY: as the caller promises.
        let output = unsafe { list_mut(output, output_count, "output")? };
        let (rows, _) = output.as_chunks_mut::<4>();
        let (engine, how) = (&engine.inner, interpolation);
        Ok(engine.evaluate_into(&set, how, &frames, layout, rows)?)
    })
}

/// Prepares a set for an interpolation and uploads it to the engine's device as a clip, for repeated evaluation.
///
/// `interpolation` may be null for the defaults. The clip is independent of the set, and the engine may be freed
/// before it. The caller frees the clip with `tumble_clip_free`.
///
/// # Errors
/// - `TUMBLE_RESULT_INVALID_INPUT` if a track cannot be interpolated as requested.
/// - `TUMBLE_RESULT_OUT_OF_MEMORY` or `TUMBLE_RESULT_DEVICE` if the device lacks memory or fails.
///
/// # Safety
/// `interpolation` must be null or point to a `TumbleInterpolation` whose `method` is null or a text that ends with a
/// zero byte, and `clip` must point to memory for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_upload(
    engine: *const TumbleEngine,
    set: *const TumbleSet,
    interpolation: *const TumbleInterpolation,
    clip: *mut *mut TumbleClip,
) -> TumbleResult {
    code(|| {
        let out = Out::new(clip, "clip")?;
        let (engine, set) = (handle::get(engine)?, handle::get(set)?);
        // SAFETY: as the caller promises.
        let interpolation = unsafe { TumbleInterpolation::read(interpolation)? };
        let inner = engine.inner.upload(&set.read(), interpolation)?;
        // SAFETY: as the caller promises.
        unsafe {
            out.set(handle::give(TumbleClip {
                inner,
                is_on_application_device: engine.is_on_application_device,
            }));
        }
        Ok(())
    })
}

/// Returns the memory that a clip takes on the host for each key, in bytes: 16 or more if the clip keeps its keys; if
/// the clip keeps segments, at least 64 for arcs (slerp), at least 144 for polynomials. On the CPU, a clip
/// whose segments would exceed the limit `memory` of `TumbleEngineOptions` keeps its keys instead, if samples can be
/// computed from them.
///
/// # Safety
/// `bytes` must point to memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_clip_bytes_per_key(
    clip: *const TumbleClip,
    bytes: *mut f64,
) -> TumbleResult {
    code(|| {
        let out = Out::new(bytes, "bytes")?;
        let found = handle::get(clip)?.inner.bytes_per_key();
        // SAFETY: as the caller promises.
        unsafe { out.set(found) };
        Ok(())
    })
}

/// Returns the number of samples of each track of a clip. A result of `tumble_clip_evaluate` has 4 × tracks × samples
/// floats.
///
/// # Errors
/// `TUMBLE_RESULT_INVALID_INPUT` if the sample times are invalid or do not fit the clip.
///
/// # Safety
/// `samples` must point to a `TumbleSamples` whose `times` has `time_count` numbers, and `count` must point to memory
/// for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_clip_sample_count(
    clip: *const TumbleClip,
    samples: *const TumbleSamples,
    count: *mut usize,
) -> TumbleResult {
    code(|| {
        let out = Out::new(count, "count")?;
        let clip = handle::get(clip)?;
        // SAFETY: as the caller promises.
        let frames = unsafe { TumbleSamples::read(samples)? };
        let timeline = clip.inner.timeline(&frames)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(timeline.len()) };
        Ok(())
    })
}

/// Evaluates a clip into the caller's memory, and waits for the result. The arguments, the result and the errors are
/// those of `tumble_evaluate`; the number of samples is that of `tumble_clip_sample_count`.
///
/// # Safety
/// As `tumble_evaluate`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_clip_evaluate(
    clip: *const TumbleClip,
    samples: *const TumbleSamples,
    layout: u32,
    output: *mut f32,
    output_count: usize,
) -> TumbleResult {
    code(|| {
        let clip = handle::get(clip)?;
        // SAFETY: as the caller promises.
        let frames = unsafe { TumbleSamples::read(samples)? };
        let layout = self::layout(layout)?;
        let timeline = clip.inner.timeline(&frames)?;
        check_size(clip.inner.track_count(), &timeline, output_count)?;
        // SAFETY: as the caller promises.
        let output = unsafe { list_mut(output, output_count, "output")? };
        let (rows, _) = output.as_chunks_mut::<4>();
        Ok(clip.inner.evaluate_into(&frames, layout, rows)?)
    })
}

/// Evaluates a clip into a range of the application's Vulkan buffer: four floats for each sample of each track.
///
/// The clip's engine must have been created by `tumble_engine_from_vulkan`. `layout` is a `TumbleLayout`. `buffer` is
/// the `VkBuffer`, as a number: `(uint64_t)buffer`. The range starts at `offset`, a multiple of 16, and has `size`
/// bytes, at least 16 × tracks × samples. The buffer must belong to the engine's device, be bound to memory, and have
/// the usages `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT` and `VK_BUFFER_USAGE_TRANSFER_DST_BIT`.
///
/// The call submits to the engine's queue (`tumble_engine_from_vulkan` says who may use the queue meanwhile) and
/// returns when the result is written. Commands that are submitted to the queue afterwards see it.
///
/// # Errors
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if the engine was not created by `tumble_engine_from_vulkan`.
/// - `TUMBLE_RESULT_WRONG_SIZE` if the range is not aligned or too short.
/// - Otherwise as `tumble_evaluate`.
///
/// # Safety
/// `samples` must point to a `TumbleSamples` whose `times` has `time_count` numbers. The buffer must be as described,
/// and nothing else may use the range during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_clip_evaluate_to_buffer(
    clip: *const TumbleClip,
    samples: *const TumbleSamples,
    layout: u32,
    buffer: u64,
    offset: u64,
    size: u64,
) -> TumbleResult {
    code(|| {
        let clip = handle::get(clip)?;
        // SAFETY: as the caller promises.
        let frames = unsafe { TumbleSamples::read(samples)? };
        let layout = self::layout(layout)?;
        let buffer = buffer_range(clip.is_on_application_device, buffer, offset, size)?;
        let request = clip.inner.request(&frames).layout(layout);
        // SAFETY: as the caller promises.
        Ok(unsafe { request.to_buffer(buffer) }?)
    })
}

/// Frees a clip. Targets that were made from it stay valid. Does nothing if `clip` is null.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_clip_free(clip: *mut TumbleClip) -> TumbleResult {
    code(|| handle::free(clip))
}
