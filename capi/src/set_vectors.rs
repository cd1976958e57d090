//! Translations and scales beside a set's rotations, as crowds use them.

use std::sync::PoisonError;

use glam::Vec3;
use tumble::{TrackError, TrackSet};

use crate::arguments::{list, product};
use crate::handle;
use crate::result::{Failure, TumbleResult, code};
use crate::set::TumbleSet;

type Set = fn(&mut TrackSet, usize, &[f64], &[[f32; 3]], &[[Vec3; 2]]) -> Result<(), TrackError>;

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

/// Sets the translations of a track, replacing any it had. `times` are seconds, strictly increasing,
/// and may differ from those of its rotations; `keys` are vectors, three numbers for each time;
/// `tangents`, for "gltf-cubic", may be null or has six numbers for each time: the tangent with which the
/// curve arrives, then the one with which it leaves, units per second. If anything is refused, the set
/// is as it was.
///
/// # Safety
/// `times` has `key_count` numbers, `keys` three times as many, and `tangents` is null or has six times
/// as many.
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

/// Sets the scales of a track along its axes; otherwise as `tumble_set_translations`.
///
/// # Safety
/// As there.
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
