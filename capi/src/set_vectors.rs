//! Translations and scales of a set's tracks, for crowds.

use std::sync::PoisonError;

use glam::Vec3;
use tumble::{TrackError, TrackSet};

use crate::arguments::{list, product};
use crate::handle;
use crate::result::{Failure, TumbleResult, code};
use crate::set::TumbleSet;

type Set = fn(&mut TrackSet, usize, &[f64], &[[f32; 3]], &[[Vec3; 2]]) -> Result<(), TrackError>;

/// Sets translation or scale keys of a track by the function `to`.
///
/// # Safety
/// As `tumble_set_translations`.
unsafe fn give(
    set: *mut TumbleSet,
    track: usize,
    times: *const f64,
    (keys, tangents): (*const f32, *const f32),
    key_count: usize,
    to: Set,
) -> Result<(), Failure> {
    let set = handle::get(set)?;
    let numbers = product::<f32>(key_count, 3, "keys")?;
    let of_tangents = if tangents.is_null() {
        0
    } else {
        product::<f32>(key_count, 6, "tangents")?
    };
    // SAFETY: as the caller promises.
    let (times, keys, tangents) = unsafe {
        (
            list(times, key_count, "times")?,
            list(keys, numbers, "keys")?,
            list(tangents, of_tangents, "tangents")?,
        )
    };
    let (keys, _) = keys.as_chunks::<3>();
    let (tangents, _) = tangents.as_chunks::<3>();
    let (tangents, _) = tangents.as_chunks::<2>();
    let tangents: Vec<[Vec3; 2]> = tangents.iter().map(|both| both.map(Vec3::from)).collect();
    let mut tracks = set.inner.write().unwrap_or_else(PoisonError::into_inner);
    Ok(to(&mut tracks, track, times, keys, &tangents)?)
}

/// Sets the translation keys of the track `track`, counted from 0, and replaces earlier ones.
///
/// `times` are `key_count` key times in seconds, at least one, strictly increasing; they may differ from the times of
/// the rotations. `keys` are vectors `x y z`, one for each time. `tangents` are for the method "gltf-cubic" and may
/// be null: six numbers for each time, the incoming tangent `x y z` and the outgoing one, in units per second. The
/// arrays are copied.
///
/// # Errors
/// - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such track.
/// - `TUMBLE_RESULT_INVALID_INPUT` if the times are not finite and strictly increasing, or a number is not finite or
///   exceeds 1e30 in magnitude.
///
/// After any error the set is unchanged.
///
/// # Safety
/// `times` must have `key_count` numbers and `keys` 3 × `key_count`; `tangents` must be null or have 6 × `key_count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_set_translations(
    set: *mut TumbleSet,
    track: usize,
    times: *const f64,
    keys: *const f32,
    tangents: *const f32,
    key_count: usize,
) -> TumbleResult {
    let both = (keys, tangents);
    // SAFETY: as the caller promises.
    code(|| unsafe {
        give(
            set,
            track,
            times,
            both,
            key_count,
            TrackSet::set_translations,
        )
    })
}

/// Sets the scale keys of a track: factors `x y z` along its axes. Otherwise as `tumble_set_translations`.
///
/// # Safety
/// As `tumble_set_translations`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_set_scales(
    set: *mut TumbleSet,
    track: usize,
    times: *const f64,
    keys: *const f32,
    tangents: *const f32,
    key_count: usize,
) -> TumbleResult {
    let both = (keys, tangents);
    // SAFETY: as the caller promises.
    code(|| unsafe { give(set, track, times, both, key_count, TrackSet::set_scales) })
}
