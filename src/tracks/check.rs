//! Checks of times and keys when they come into a set. Everything behind the set relies on them.

use glam::{DQuat, Quat};

use crate::math::canonical::{canonical, unit_f32};
use crate::tracks::error::TrackError;

/// A key whose norm differs from 1 by more than this is refused by
/// [`TrackSet::push`](crate::tracks::set::TrackSet::push): it is more likely a mistake than a
/// rotation.
pub const NORM_TOLERANCE: f64 = 0.1;

/// The largest magnitude of a time, in seconds: the limit of `.dat` files. Products of intervals
/// stay far from overflowing in f64.
pub(crate) const LATEST: f64 = f32::MAX as f64;

pub(crate) fn check_times(track: usize, times: &[f64], keys: usize) -> Result<(), TrackError> {
    if times.len() != keys {
        return Err(TrackError::LengthMismatch {
            track,
            keys,
            times: times.len(),
        });
    }
    if times.is_empty() {
        return Err(TrackError::Empty { track });
    }
    if let Some(key) = times.iter().position(|time| !time.is_finite()) {
        return Err(TrackError::TimeNotFinite {
            track,
            key,
            time: times[key],
        });
    }
    if let Some(i) = times.windows(2).position(|pair| pair[1] <= pair[0]) {
        return Err(TrackError::TimeNotIncreasing {
            track,
            key: i + 1,
            time: times[i + 1],
            previous: times[i],
        });
    }
    match times.iter().position(|time| time.abs() > LATEST) {
        Some(key) => Err(TrackError::TimeOutOfRange {
            track,
            key,
            time: times[key],
        }),
        None => Ok(()),
    }
}

/// A key whose norm differs from 1 by at most this is kept bit for bit, so that results which are
/// written and loaded again do not change. Rounding to f32 moves the norm of a unit quaternion by
/// at most about 2 × 2^-24.
pub const UNIT_TOLERANCE: f64 = 4.0e-7;

pub(crate) fn unit_key(track: usize, key: usize, quat: Quat) -> Result<Quat, TrackError> {
    let exact: DQuat = quat.as_dquat();
    let norm = exact.length();
    if norm.is_nan() || (norm - 1.0).abs() > NORM_TOLERANCE {
        return Err(TrackError::NotUnit { track, key, norm });
    }
    if (norm - 1.0).abs() <= UNIT_TOLERANCE {
        return Ok(Quat::from_array(quat.to_array().map(canonical)));
    }
    Ok(unit_f32(exact))
}
