//! Sets of keyframe tracks.

use std::ffi::c_char;
use std::sync::{PoisonError, RwLock, RwLockReadGuard};

use glam::Quat;
use tumble::{Track, TrackError, TrackSet};

use crate::arguments::{Out, list, product, text};
use crate::handle::{self, Object};
use crate::result::{Failure, TumbleResult, code, guarded};

/// A set: tracks of rotation keys that are evaluated together, each with optional translations and scales. Any number
/// of threads may use it at the same time.
#[derive(Default)]
pub struct TumbleSet {
    pub(crate) inner: RwLock<TrackSet>,
}

impl Object for TumbleSet {
    const NAME: &'static str = "set";
}

impl TumbleSet {
    pub(crate) fn new(tracks: TrackSet) -> Self {
        Self {
            inner: RwLock::new(tracks),
        }
    }

    /// The set, also if its lock is poisoned: a track is added completely or not at all, even if a call panics.
    pub(crate) fn read(&self) -> RwLockReadGuard<'_, TrackSet> {
        self.inner.read().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Creates a set without tracks. The caller frees it with `tumble_set_free`.
///
/// # Safety
/// `set` must point to memory for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_set_new(set: *mut *mut TumbleSet) -> TumbleResult {
    code(|| {
        let out = Out::new(set, "set")?;
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(TumbleSet::default())) };
        Ok(())
    })
}

/// Appends a track of `key_count` rotation keys, at least one, to a set.
///
/// `times` are the key times in seconds, strictly increasing. `keys` are unit quaternions, `x y z w`, one for each
/// time. Keys whose norm is 1 within f32 rounding keep their bits; others, whose norm is within 0.1 of 1, are
/// normalised. `name` is the track's name in UTF-8, or null for none. Arrays and name are copied. Pointers that
/// `tumble_set_track` returned for this set become invalid.
///
/// # Errors
/// `TUMBLE_RESULT_INVALID_INPUT` if there are no keys, the times are not finite and strictly increasing, or a key's
/// norm is not within 0.1 of 1. After any error the set is unchanged.
///
/// # Safety
/// `name` must be null or a text that ends with a zero byte; `times` must have `key_count` numbers, and `keys`
/// 4 × `key_count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_set_push(
    set: *mut TumbleSet,
    name: *const c_char,
    times: *const f64,
    keys: *const f32,
    key_count: usize,
) -> TumbleResult {
    code(|| {
        let set = handle::get(set)?;
        let numbers = product::<f32>(key_count, 4, "keys")?;
        // SAFETY: as the caller promises.
        let (name, times, keys) = unsafe {
            let name = text(name, "name")?.unwrap_or_default();
            (
                name,
                list(times, key_count, "times")?,
                list(keys, numbers, "keys")?,
            )
        };
        let (keys, _) = keys.as_chunks::<4>();
        let mut tracks = set.inner.write().unwrap_or_else(PoisonError::into_inner);
        Ok(tracks.push(name, times, keys)?)
    })
}

/// Creates a set of `track_count` tracks without names, which all have the same `key_count` key times.
///
/// `times` are the key times in seconds. `keys` are unit quaternions in the order `[track][key]`, four numbers
/// `x y z w` each. The conditions and errors are those of `tumble_set_push`. The arrays are copied. The caller frees
/// the set with `tumble_set_free`.
///
/// # Safety
/// `times` must have `key_count` numbers and `keys` 4 × `key_count` × `track_count`; `set` must point to memory for a
/// handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_set_with_shared_times(
    times: *const f64,
    key_count: usize,
    keys: *const f32,
    track_count: usize,
    set: *mut *mut TumbleSet,
) -> TumbleResult {
    code(|| {
        let out = Out::new(set, "set")?;
        let of_track = product::<f32>(key_count, 4, "keys")?;
        let numbers = product::<f32>(track_count, of_track, "keys")?;
        // SAFETY: as the caller promises.
        let (times, keys) = unsafe {
            (
                list(times, key_count, "times")?,
                list(keys, numbers, "keys")?,
            )
        };
        let (keys, _) = keys.as_chunks::<4>();
        let tracks = TrackSet::with_shared_times(times, keys)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(TumbleSet::new(tracks))) };
        Ok(())
    })
}

/// Returns the number of tracks; 0 if the handle is invalid.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_set_track_count(set: *const TumbleSet) -> usize {
    guarded(|| Ok(handle::get(set)?.read().track_count())).unwrap_or(0)
}

/// Returns the number of rotation keys of all tracks together; 0 if the handle is invalid.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_set_key_count(set: *const TumbleSet) -> usize {
    guarded(|| Ok(handle::get(set)?.read().key_count())).unwrap_or(0)
}

fn track(set: &TrackSet, index: usize) -> Result<Track<'_>, Failure> {
    let tracks = set.track_count();
    let track = index;
    let found = set.get(index);
    found.ok_or_else(|| TrackError::NoSuchTrack { track, tracks }.into())
}

/// Returns pointers to the key times and the rotation keys of the track `index`, counted from 0.
///
/// `times` receives a pointer to `key_count` numbers in seconds, and `keys` a pointer to 4 × `key_count` numbers, `x y
/// z w` for each key. The arrays belong to the set and stay valid until a track is pushed to the set, or the set is
/// freed.
///
/// # Errors
/// `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such track.
///
/// # Safety
/// `times` and `keys` must each point to memory for a pointer, and `key_count` to memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_set_track(
    set: *const TumbleSet,
    index: usize,
    times: *mut *const f64,
    keys: *mut *const f32,
    key_count: *mut usize,
) -> TumbleResult {
    code(|| {
        let outs = (
            Out::new(times, "times")?,
            Out::new(keys, "keys")?,
            Out::new(key_count, "key_count")?,
        );
        let set = handle::get(set)?;
        let set = set.read();
        let track = track(&set, index)?;
        // SAFETY: as the caller promises; a quaternion is four numbers, `x y z w`.
        unsafe {
            outs.0.set(track.times.as_ptr());
            outs.1.set(track.keys.as_ptr().cast::<[f32; 4]>().cast());
            outs.2.set(track.keys.len());
        }
        Ok(())
    })
}

const _: () = assert!(size_of::<Quat>() == size_of::<[f32; 4]>());

/// Copies the name of the track `index`, counted from 0, into `buffer`: UTF-8, followed by a zero byte. Tracks
/// without a name are called `box1`, `box2` … in the order of the tracks.
///
/// `size` is the size of `buffer` in bytes. `length` receives the length of the name in bytes, without the zero byte.
/// If `buffer` is null, only `length` is written.
///
/// # Errors
/// - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such track.
/// - `TUMBLE_RESULT_WRONG_SIZE` if `buffer` is not null and `size` is less than the length + 1: then `length` is
///   written, and `buffer` is not.
///
/// # Safety
/// `buffer` must be null or have `size` bytes, and `length` must point to memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_set_track_name(
    set: *const TumbleSet,
    index: usize,
    buffer: *mut c_char,
    size: usize,
    length: *mut usize,
) -> TumbleResult {
    code(|| {
        let length = Out::new(length, "length")?;
        let set = handle::get(set)?;
        let set = set.read();
        track(&set, index)?;
        let name = set.track_name(index).replace('\0', "");
        // SAFETY: as the caller promises.
        unsafe { length.set(name.len()) };
        if buffer.is_null() {
            return Ok(());
        }
        if size <= name.len() {
            let message = format!(
                "the name has {} bytes and a zero; `size` is {size}",
                name.len()
            );
            return Err(Failure::new(TumbleResult::WrongSize, message));
        }
        // SAFETY: there is room, as the caller promises, and the name is elsewhere.
        unsafe {
            name.as_ptr()
                .copy_to_nonoverlapping(buffer.cast(), name.len());
            buffer.cast::<u8>().add(name.len()).write(0);
        }
        Ok(())
    })
}

/// Returns the first and the last key time of all tracks in seconds; key times of translations and scales count too.
///
/// # Errors
/// `TUMBLE_RESULT_OUT_OF_RANGE` if the set has no tracks.
///
/// # Safety
/// `first` and `last` must each point to memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_set_time_span(
    set: *const TumbleSet,
    first: *mut f64,
    last: *mut f64,
) -> TumbleResult {
    code(|| {
        let outs = (Out::new(first, "first")?, Out::new(last, "last")?);
        let span = handle::get(set)?.read().time_span();
        let none = || {
            Failure::new(
                TumbleResult::OutOfRange,
                "the set has no tracks, and no times",
            )
        };
        let span = span.ok_or_else(none)?;
        // SAFETY: as the caller promises.
        unsafe {
            outs.0.set(span.0);
            outs.1.set(span.1);
        }
        Ok(())
    })
}

/// Frees a set. Clips that were made from it stay valid. Does nothing if `set` is null.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_set_free(set: *mut TumbleSet) -> TumbleResult {
    code(|| handle::free(set))
}
