//! Samples of a clip one at a time.

use std::sync::{Mutex, MutexGuard};

use tumble::Sampler;

use crate::arguments::{Out, list, list_mut, product};
use crate::clip::TumbleClip;
use crate::handle::{self, Object};
use crate::result::{Failure, TumbleResult, code};

/// A sampler: it evaluates a clip at one time after another, on the calling thread, for programs that need a pose now.
/// Sampling is fastest if most times are near the time before. Threads that share a sampler wait for each other; give
/// each thread its own (`tumble_sampler_copy`).
pub struct TumbleSampler {
    inner: Mutex<Sampler>,
}

impl Object for TumbleSampler {
    const NAME: &'static str = "sampler";
}

impl TumbleSampler {
    fn locked(&self) -> Result<MutexGuard<'_, Sampler>, Failure> {
        handle::locked::<Self, _>(self.inner.lock())
    }
}

fn give(sampler: Sampler) -> *mut TumbleSampler {
    let inner = Mutex::new(sampler);
    handle::give(TumbleSampler { inner })
}

/// Creates a sampler of a clip. Its values have the bits that `tumble_clip_evaluate` gives at listed times.
///
/// The clip may be freed before the sampler. The caller frees the sampler with `tumble_sampler_free`.
///
/// # Errors
/// `TUMBLE_RESULT_OUT_OF_MEMORY` if the segments of the clip exceed its engine's memory limit, and samples cannot be
/// computed from its keys within the limit.
///
/// # Safety
/// `sampler` must point to memory for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_sampler_new(
    clip: *const TumbleClip,
    sampler: *mut *mut TumbleSampler,
) -> TumbleResult {
    code(|| {
        let out = Out::new(sampler, "sampler")?;
        let made = handle::get(clip)?.inner.sampler()?;
        // SAFETY: as the caller promises.
        unsafe { out.set(give(made)) };
        Ok(())
    })
}

/// Creates a sampler of the same clip, for another thread or another playback. The caller frees it with
/// `tumble_sampler_free`.
///
/// # Safety
/// `copy` must point to memory for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_sampler_copy(
    sampler: *const TumbleSampler,
    copy: *mut *mut TumbleSampler,
) -> TumbleResult {
    code(|| {
        let out = Out::new(copy, "copy")?;
        let made = handle::get(sampler)?.locked()?.clone();
        // SAFETY: as the caller promises.
        unsafe { out.set(give(made)) };
        Ok(())
    })
}

/// Evaluates one track at `time`, which is in seconds. `value` receives four floats, according to the quantity of the
/// clip's interpolation. Nothing is allocated.
///
/// # Errors
/// - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such track.
/// - `TUMBLE_RESULT_INVALID_INPUT` if the time is not finite.
///
/// # Safety
/// `value` must have four floats, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_sampler_sample(
    sampler: *const TumbleSampler,
    track: usize,
    time: f64,
    value: *mut f32,
) -> TumbleResult {
    code(|| {
        let sampler = handle::get(sampler)?;
        // SAFETY: as the caller promises.
        let value = unsafe { list_mut(value, 4, "value")? };
        let (rows, _) = value.as_chunks_mut::<4>();
        Ok(sampler.locked()?.pose_of(&[track], time, rows)?)
    })
}

/// Evaluates every track at `time`, which is in seconds, into the caller's memory: four floats for each track.
/// `output_count` is the number of floats. Nothing is allocated.
///
/// # Errors
/// - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is not 4 × tracks.
/// - `TUMBLE_RESULT_INVALID_INPUT` if the time is not finite.
///
/// # Safety
/// `output` must have `output_count` floats, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_sampler_pose(
    sampler: *const TumbleSampler,
    time: f64,
    output: *mut f32,
    output_count: usize,
) -> TumbleResult {
    code(|| {
        let sampler = handle::get(sampler)?;
        let mut sampler = sampler.locked()?;
        let tracks = sampler.track_count();
        // SAFETY: as the caller promises.
        let rows = unsafe { rows(output, output_count, tracks)? };
        Ok(sampler.pose(time, rows)?)
    })
}

/// Evaluates some tracks at `time`, which is in seconds, into the caller's memory: four floats for each of the
/// `track_count` indices in `tracks`. `output_count` is the number of floats. Nothing is allocated.
///
/// # Errors
/// - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is not 4 × `track_count`.
/// - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such track.
/// - `TUMBLE_RESULT_INVALID_INPUT` if the time is not finite.
///
/// # Safety
/// `tracks` must have `track_count` numbers, and `output` must have `output_count` floats, which nothing else uses
/// during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_sampler_pose_of(
    sampler: *const TumbleSampler,
    tracks: *const usize,
    track_count: usize,
    time: f64,
    output: *mut f32,
    output_count: usize,
) -> TumbleResult {
    code(|| {
        let sampler = handle::get(sampler)?;
        // SAFETY: as the caller promises.
        let (tracks, rows) = unsafe {
            let tracks = list(tracks, track_count, "tracks")?;
            (tracks, rows(output, output_count, track_count)?)
        };
        Ok(sampler.locked()?.pose_of(tracks, time, rows)?)
    })
}

/// Frees a sampler. Does nothing if `sampler` is null.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_sampler_free(sampler: *mut TumbleSampler) -> TumbleResult {
    code(|| handle::free(sampler))
}

/// The caller's memory for a value of each of `tracks`.
///
/// # Safety
/// As [`list_mut`].
unsafe fn rows<'a>(
    output: *mut f32,
    output_count: usize,
    tracks: usize,
) -> Result<&'a mut [[f32; 4]], Failure> {
    if output_count != product::<f32>(tracks, 4, "output")? {
        let message = format!(
            "`output_count` is {output_count}; a pose of {tracks} tracks has {} floats",
            4 * tracks
        );
        return Err(Failure::new(TumbleResult::WrongSize, message));
    }
    // SAFETY: as the caller promises.
    let output = unsafe { list_mut(output, output_count, "output")? };
    Ok(output.as_chunks_mut().0)
}
