//! Checks of times and keys when they come into a set. Everything behind the set relies on them.

use glam::{DQuat, Quat};

use crate::math::canonical::canonical;
use crate::math::quaternion::unit_f32;
use crate::tracks::error::{LATEST, NORM_TOLERANCE, TrackError};

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
    // Numbers that increase between two that are in range are in range, and finite. The loop goes to
    // the end in any case, so that it is compiled to vectors.
    let increase = |all: bool, pair: &[f64]| all & (pair[0] < pair[1]);
    let (first, last) = (times[0], times[keys - 1]);
    if first >= -LATEST && last <= LATEST && times.windows(2).fold(true, increase) {
        return Ok(());
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

/// Refuses data beside the rotations of which there is not one value for each key.
pub(crate) fn check_length(
    track: usize,
    quantity: &'static str,
    keys: usize,
    values: usize,
) -> Result<(), TrackError> {
    if values == keys {
        Ok(())
    } else {
        Err(TrackError::DataLength {
            track,
            quantity,
            keys,
            values,
        })
    }
}

/// Refuses data that is NaN or infinite at a key.
pub(crate) fn check_finite<T>(
    track: usize,
    quantity: &'static str,
    values: &[T],
    is_finite: impl Fn(&T) -> bool,
) -> Result<(), TrackError> {
    match values.iter().position(|value| !is_finite(value)) {
        Some(key) => Err(TrackError::DataNotFinite {
            track,
            key,
            quantity,
        }),
        None => Ok(()),
    }
}

/// A key whose norm differs from 1 by at most this is kept bit for bit, so that results which are
/// written and loaded again do not change. Rounding to f32 moves the norm of a unit quaternion by
/// at most about 2 × 2^-24.
pub const UNIT_TOLERANCE: f64 = 4.0e-7;

/// A key as it is kept: unit, and with its tiny components at +0.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_refused_wherever_they_do_not_increase() {
        let good: Vec<f64> = (0..9).map(f64::from).collect();
        assert!(check_times(0, &good, 9).is_ok());
        assert_eq!(
            check_times(1, &good, 8).unwrap_err().to_string(),
            "track 1 has 8 keys but 9 times; give one time for each key"
        );
        assert_eq!(check_times(1, &[], 0), Err(TrackError::Empty { track: 1 }));
        assert!(check_times(0, &[-LATEST, LATEST], 2).is_ok());
        for index in 0..9 {
            for bad in [
                f64::NAN,
                f64::INFINITY,
                f64::NEG_INFINITY,
                2.0 * LATEST,
                -2.0 * LATEST,
            ] {
                let mut times = good.clone();
                times[index] = bad;
                let error = check_times(0, &times, 9).unwrap_err();
                let is_named = match error {
                    TrackError::TimeNotFinite { key, .. } => !bad.is_finite() && key == index,
                    _ => bad.is_finite(),
                };
                assert!(is_named, "{bad} at {index}: {error}");
            }
            if index > 0 {
                let mut times = good.clone();
                times[index] = times[index - 1];
                let error = check_times(0, &times, 9).unwrap_err();
                assert!(matches!(error, TrackError::TimeNotIncreasing { key, .. } if key == index));
            }
        }
    }
}
