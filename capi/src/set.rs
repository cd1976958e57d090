//! Sets of keyframe tracks.

use std::ffi::c_char;
use std::sync::{PoisonError, RwLock, RwLockReadGuard};

use glam::Quat;
use tumble::{Track, TrackError, TrackSet};

use crate::arguments::{Out, list, product, text};
use crate::handle::{self, Object};
use crate::result::{Failure, TumbleResult, code, guarded};

/// Tracks of keys. Any number of threads may read a set at once.
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

    /// The set: a track is pushed as a whole or not at all, after panics too.
    pub(crate) fn read(&self) -> RwLockReadGuard<'_, TrackSet> {
        self.inner.read().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A set without tracks.
///
/// # Safety
/// `set` has room for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_set_new(set: *mut *mut TumbleSet) -> TumbleResult {
    code(|| {
        let out = Out::new(set, "set")?;
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(TumbleSet::default())) };
        Ok(())
    })
}

/// Appends a track. `times` are seconds, strictly increasing; `keys` are unit quaternions, `x y z w`
/// each, four numbers for each time. Keys that are unit to within rounding are kept bit for bit, others
/// (norm within 0.1 of 1) are normalised. `name` may be null. If anything is refused, the set is as it
/// was.
///
/// # Safety
/// `name` is null or text that ends with a zero, `times` has `key_count` numbers, and `keys` four
/// times as many.
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

/// A set whose tracks all have the same key times: `keys` holds one track after another, `key_count`
/// keys of four numbers each.
///
/// # Safety
/// `times` has `key_count` numbers, `keys` 4 × `key_count` × `track_count`, and `set` has room for a
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

/// The number of tracks; 0 for an invalid handle.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_set_track_count(set: *const TumbleSet) -> usize {
    guarded(|| Ok(handle::get(set)?.read().track_count())).unwrap_or(0)
}

/// The number of keys of all tracks together; 0 for an invalid handle.
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

/// The times and the keys (`x y z w`) of a track, as they lie in the set. They stay there until a
/// track is pushed to the set, or it is freed.
///
/// # Safety
/// `times` and `keys` have room for a pointer and `key_count` for a number.
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

/// The name of a track, `box1`, `box2` … by its place where it has none: UTF-8, with a zero behind
/// it. `length` is set to its bytes without that zero, also where `size`, the bytes of `buffer`, is
/// not more than that: then nothing else is written, which is an error unless `buffer` is null.
///
/// # Safety
/// `buffer` is null or has room for `size` bytes, and `length` for a number.
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

/// The first and the last key time over all tracks, seconds; an error for a set without tracks.
///
/// # Safety
/// `first` and `last` have room for a number.
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

/// Frees a set; clips that were made of it stay. Null is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_set_free(set: *mut TumbleSet) -> TumbleResult {
    code(|| handle::free(set))
}
