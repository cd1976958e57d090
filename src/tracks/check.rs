//! Checks of times and keys when they come into a set. Everything behind the set relies on them.

use glam::{DQuat, Quat};

use crate::math::canonical::{canonical, unit_f32};
use crate::tracks::error::TrackError;
use crate::tracks::rotation::Rotation;

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

/// A key whose norm differs from 1 by at most this is kept bit for bit, so that results which are
/// written and loaded again do not change. Rounding to f32 moves the norm of a unit quaternion by
/// at most about 2 × 2^-24.
pub const UNIT_TOLERANCE: f64 = 4.0e-7;

/// Appends the keys of a track as [`unit_key`] makes them.
///
/// # Errors
/// The first key that is refused; there are no more keys then than before.
pub(crate) fn append_keys<R: Rotation>(
    all: &mut Vec<Quat>,
    track: usize,
    keys: &[R],
) -> Result<(), TrackError> {
    let first = all.len();
    // Mostly all of them are unit quaternions. |n² - 1| is about twice |n - 1|.
    let mut are_unit = true;
    all.extend(keys.iter().map(|key| {
        let quat = key.quat();
        let [x, y, z, w] = quat.to_array().map(f64::from);
        are_unit &= (x * x + y * y + z * z + w * w - 1.0).abs() <= 1.9 * UNIT_TOLERANCE;
        Quat::from_array(quat.to_array().map(canonical))
    }));
    if are_unit {
        return Ok(());
    }
    all.truncate(first);
    for (key, rotation) in keys.iter().enumerate() {
        match unit_key(track, key, rotation.quat()) {
            Ok(unit) => all.push(unit),
            Err(error) => {
                all.truncate(first);
                return Err(error);
            }
        }
    }
    Ok(())
}

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
    fn keys_together_are_what_each_of_them_is() {
        let turned = Quat::from_xyzw(0.6, -0.0, 1e-30, 0.8);
        let bits = |q: &Quat| q.to_array().map(f32::to_bits);
        for off in [1.0, 1.000_000_3, 1.000_001, 0.95] {
            let keys = [turned, turned * off, -turned];
            let mut all = vec![Quat::IDENTITY];
            append_keys(&mut all, 0, &keys).unwrap();
            let each = keys.map(|key| unit_key(0, 0, key).unwrap());
            assert_eq!(
                all[1..].iter().map(bits).collect::<Vec<_>>(),
                each.each_ref().map(bits)
            );
        }
        for off in [0.5, f32::NAN] {
            let mut all = vec![Quat::IDENTITY];
            let error = append_keys(&mut all, 3, &[turned, turned * off, turned]).unwrap_err();
            assert!(matches!(
                error,
                TrackError::NotUnit {
                    track: 3,
                    key: 1,
                    ..
                }
            ));
            assert_eq!(all, [Quat::IDENTITY]);
        }
    }

    #[test]
    fn times_are_refused_wherever_they_do_not_increase() {
        let good: Vec<f64> = (0..9).map(f64::from).collect();
        assert!(check_times(0, &good, 9).is_ok());
        assert!(check_times(0, &[-LATEST, LATEST], 2).is_ok());
        for place in 0..9 {
            for bad in [
                f64::NAN,
                f64::INFINITY,
                f64::NEG_INFINITY,
                2.0 * LATEST,
                -2.0 * LATEST,
            ] {
                let mut times = good.clone();
                times[place] = bad;
                assert!(check_times(0, &times, 9).is_err(), "{bad} at {place}");
            }
            if place > 0 {
                let mut times = good.clone();
                times[place] = times[place - 1];
                let error = check_times(0, &times, 9).unwrap_err();
                assert!(matches!(error, TrackError::TimeNotIncreasing { key, .. } if key == place));
            }
        }
    }
}
