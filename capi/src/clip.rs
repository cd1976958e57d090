//! Evaluating: a set in one go, or a clip that stays on a device.

use tumble::{Clip, SampleTimes, Timeline, TrackSet};

use crate::arguments::{Out, list_mut};
use crate::engine::TumbleEngine;
use crate::handle::{self, Object};
use crate::interpolation::TumbleInterpolation;
use crate::result::{Failure, TumbleResult, code};
use crate::samples::{TumbleSamples, layout};
use crate::set::TumbleSet;
use crate::vulkan::buffer_range;

/// A set prepared for one method, on an engine's device. Any number of threads may use it at once.
pub struct TumbleClip {
    pub(crate) inner: Clip,
    /// Whether its engine is on the application's own Vulkan device.
    pub(crate) is_on_application_device: bool,
}

impl Object for TumbleClip {
    const NAME: &'static str = "clip";
}

/// How many floats a result has, four for each sample, of which `floats` must be exactly as many.
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

/// How many samples each track of a set has: a result has 4 × tracks × samples floats.
///
/// # Safety
/// `samples` is such a structure, and `count` has room for a number.
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

/// Prepares and evaluates a set in one call, into the caller's memory: `output_count` floats, exactly
/// 4 × tracks × samples. Memory that is aligned to 16 bytes is filled without a copy. All arguments are
/// checked before anything is written.
///
/// # Safety
/// `interpolation` is null (the defaults) or such a structure, `samples` is such a structure, and
/// `output` has room for `output_count` floats, which nothing else uses during the call.
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

/// Prepares a set for a method and uploads it to the engine's device, where it stays.
///
/// # Safety
/// `interpolation` is null (the defaults) or such a structure, and `clip` has room for a handle.
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

/// How many samples each track of a clip has: a result has 4 × tracks × samples floats.
///
/// # Safety
/// `samples` is such a structure, and `count` has room for a number.
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

/// Evaluates a clip into the caller's memory, as `tumble_evaluate` does a set.
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

/// Evaluates a clip of an engine of `tumble_engine_from_vulkan` into a range of a buffer on its device:
/// four floats for each sample of each track, which stay there. Returns when they are written; what is
/// submitted to the queue afterwards sees them. `buffer` is the `VkBuffer`, as a number:
/// `(uint64_t)buffer`. The range starts at a multiple of 16 and has at least 16 × tracks × samples bytes.
///
/// The buffer belongs to that device, has memory, and was made for use as
/// `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT` and `VK_BUFFER_USAGE_TRANSFER_DST_BIT`. Nobody else uses it, or
/// the queue, during the call.
///
/// # Safety
/// `samples` is such a structure, and the buffer is as said.
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

/// Frees a clip. Null is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_clip_free(clip: *mut TumbleClip) -> TumbleResult {
    code(|| handle::free(clip))
}
