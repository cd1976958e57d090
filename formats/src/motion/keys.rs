//! Converts the keys of files to keys of sets: unit quaternions at increasing times.

use glam::{DQuat, Quat};
use tumble::UNIT_TOLERANCE;

use crate::diagnostic::{Code, Diagnostic, Location};
use crate::quaternion::{dot, nearest_unit, rounded};
use crate::warnings::Warnings;

/// How two different keys at the same time are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Duplicates {
    /// The input is refused.
    #[default]
    Refuse,
    /// The first key is kept.
    First,
    /// The last key is kept.
    Last,
    /// Both keys are kept, and the value jumps. The first key is moved to the f32 before its time (6e-8 s earlier at
    /// 1 s), or halfway to the key before it if that is nearer. Of three or more keys, the first and the last are
    /// kept.
    Both,
}

/// Norms that differ from 1 by no more than this are normalised without a warning: six printed digits.
pub(crate) const QUIET_NORM: f64 = 0.0077;

/// Quaternions with a smaller norm do not define a rotation.
const LEAST_NORM: f64 = 1e-6;

/// The source of the keys of one channel, for messages.
pub(crate) struct Origin<'a> {
    /// The input's name in messages.
    pub(crate) file: &'a str,
    /// Where key `i` is.
    pub(crate) location: &'a dyn Fn(usize) -> Location,
    pub(crate) duplicates: Duplicates,
}

impl Origin<'_> {
    fn refuse(&self, key: usize, code: Code, message: String) -> Diagnostic {
        Diagnostic {
            location: Some((self.location)(key)),
            ..Diagnostic::new(self.file, code, message)
        }
    }

    /// Unit quaternions in f32, with unchanged signs.
    ///
    /// # Errors
    /// When a key is not finite, or its norm is less than 1e-6.
    pub(crate) fn unit(
        &self,
        keys: impl IntoIterator<Item = DQuat>,
        warnings: &mut Warnings,
    ) -> Result<Vec<Quat>, Diagnostic> {
        let unit = |(index, key): (usize, DQuat)| {
            let norm = dot(key, key).sqrt();
            if !norm.is_finite() {
                let message = format!("the quaternion {key} is not finite; repair or remove it");
                return Err(self.refuse(index, Code::NotFinite, message));
            }
            if norm < LEAST_NORM {
                let message =
                    "the quaternion has a norm below 1e-6; a rotation has norm 1".to_owned();
                return Err(self.refuse(index, Code::KeyNorm, message));
            }
            if (norm - 1.0).abs() > QUIET_NORM {
                warnings.warn(Code::NormOff, || {
                    let message = format!("the quaternion has norm {norm:.6}; it is normalised");
                    (Some((self.location)(index)), message)
                });
            }
            Ok(nearest_unit(key))
        };
        keys.into_iter().enumerate().map(unit).collect()
    }

    /// The keys to keep so that times increase strictly; `None` for all. With [`Duplicates::Both`], some times are
    /// moved. `equal(i, j)` is whether the values of two keys are the same.
    ///
    /// # Errors
    /// When times are not finite or decrease, and when values at equal times differ with [`Duplicates::Refuse`].
    pub(crate) fn increasing(
        &self,
        times: &mut [f64],
        equal: impl Fn(usize, usize) -> bool,
        warnings: &mut Warnings,
    ) -> Result<Option<Vec<usize>>, Diagnostic> {
        if let Some(key) = times.iter().position(|time| !time.is_finite()) {
            let message = format!("the time {} is not finite", times[key]);
            return Err(self.refuse(key, Code::NotFinite, message));
        }
        if times.windows(2).all(|pair| pair[0] < pair[1]) {
            return Ok(None);
        }
        let mut kept: Vec<usize> = Vec::with_capacity(times.len());
        // Whether the last kept key is the second one at its time, so that the key before it was moved to an earlier
        // time.
        let mut jumps = false;
        for key in 0..times.len() {
            let time = times[key];
            let Some(&before) = kept.last() else {
                kept.push(key);
                continue;
            };
            let last = times[before];
            if time > last {
                kept.push(key);
                jumps = false;
            } else if time < last {
                let message =
                    format!("time {time} is before the previous time, {last}; times increase");
                return Err(self.refuse(key, Code::TimeNotIncreasing, message));
            } else if equal(before, key) {
                warnings.warn(Code::EqualKeys, || {
                    let message = format!("two equal keys at time {time}; one is left out");
                    (Some((self.location)(key)), message)
                });
            } else {
                match self.duplicates {
                    Duplicates::Refuse => {
                        let message = format!(
                            "two different keys at time {time}; --duplicates first or --duplicates last keeps one of \
                             them, --duplicates both makes a jump"
                        );
                        return Err(self.refuse(key, Code::EqualTimes, message));
                    }
                    Duplicates::First => {}
                    Duplicates::Both if !jumps => {
                        let earlier = kept.len().checked_sub(2).map(|i| times[kept[i]]);
                        let Some(moved) = just_before(time, earlier) else {
                            let message = format!(
                                "two different keys at time {time}, and no time is left before it; \
                                 --duplicates first or last keeps one"
                            );
                            return Err(self.refuse(key, Code::EqualTimes, message));
                        };
                        times[before] = moved;
                        kept.push(key);
                        jumps = true;
                    }
                    Duplicates::Last | Duplicates::Both => {
                        kept.pop();
                        kept.push(key);
                    }
                }
            }
        }
        Ok(Some(kept))
    }
}

/// The result of [`Origin::unit`] for a key that needs no warning; otherwise NaN. Callers with many keys first look
/// for NaN, and determine locations only if there is one.
#[inline(always)]
pub(crate) fn quiet_unit(key: DQuat) -> Quat {
    let near = rounded(key);
    if is_unit(near.as_dquat()) {
        return near;
    }
    match (dot(key, key).sqrt() - 1.0).abs() <= QUIET_NORM {
        true => nearest_unit(key),
        false => Quat::NAN,
    }
}

/// The same for a key in f32.
#[inline(always)]
pub(crate) fn quiet_unit_f32(key: Quat) -> Quat {
    let exact = key.as_dquat();
    match is_unit(exact) {
        true => key,
        false => quiet_unit(exact),
    }
}

/// Whether a key is certainly a unit quaternion: |n² - 1| is about twice |n - 1|.
#[inline(always)]
fn is_unit(key: DQuat) -> bool {
    (dot(key, key) - 1.0).abs() <= 1.9 * UNIT_TOLERANCE
}

/// The shortest step from one time to the next, in seconds. The next f32 after 0 is so near that nothing could be
/// evaluated between the two.
const SHORTEST: f64 = 1e-9;

/// The f32 after `time`.
#[cfg(feature = "fbx")]
pub(crate) fn just_after(time: f64) -> f64 {
    f64::from((time as f32).next_up()).max(time + SHORTEST)
}

/// The f32 before `time`, or the middle between `earlier` and `time` if that is nearer; `None` if there is no such
/// time.
pub(crate) fn just_before(time: f64, earlier: Option<f64>) -> Option<f64> {
    let step = f64::from((time as f32).next_down()).min(time - SHORTEST);
    let Some(earlier) = earlier else {
        return Some(step);
    };
    let moved = if step > earlier {
        step
    } else {
        0.5 * (earlier + time)
    };
    (earlier < moved && moved < time).then_some(moved)
}

/// Keeps the entries of a list whose keys are kept.
pub(crate) fn select<T: Copy>(list: &mut Vec<T>, kept: Option<&[usize]>) {
    if let Some(kept) = kept {
        *list = kept.iter().map(|&key| list[key]).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn origin(duplicates: Duplicates) -> Origin<'static> {
        Origin {
            file: "t",
            location: &|key| Location::Inside(format!("key {key}")),
            duplicates,
        }
    }

    #[test]
    fn keys_are_normalised_and_what_is_no_rotation_is_refused() {
        let mut warnings = Warnings::new("t");
        let keys = [
            DQuat::from_xyzw(0.0, 0.0, 0.0, -2.0),
            DQuat::from_xyzw(0.0, 3e-6, 0.0, 0.0),
        ];
        let unit = origin(Duplicates::Refuse)
            .unit(keys, &mut warnings)
            .unwrap();
        assert_eq!(unit, [-Quat::IDENTITY, Quat::from_xyzw(0.0, 1.0, 0.0, 0.0)]);
        let warnings = warnings.into_list();
        assert_eq!((warnings.len(), warnings[0].count), (1, 2));
        for (bad, code) in [(0.0, Code::KeyNorm), (f64::NAN, Code::NotFinite)] {
            let keys = [DQuat::IDENTITY, DQuat::from_xyzw(0.0, 0.0, bad, 0.0)];
            let found = origin(Duplicates::Refuse).unit(keys, &mut Warnings::new("t"));
            let error = found.unwrap_err();
            assert_eq!(
                (error.code, error.to_string().contains("key 1")),
                (code, true)
            );
        }
    }

    #[test]
    fn quiet_keys_are_the_same_and_others_are_marked() {
        let rotation = DQuat::from_rotation_y(0.7);
        for norm in [
            1.0,
            1.0 + 3.9e-7,
            1.0 + 4.1e-7,
            0.9999,
            1.0077,
            1.0078,
            0.9,
            1e-7,
            1e200,
            f64::NAN,
        ] {
            let key = rotation * norm;
            let mut warnings = Warnings::new("t");
            let unit = origin(Duplicates::Refuse).unit([key], &mut warnings);
            let quiet = quiet_unit(key);
            match unit {
                Ok(unit) if warnings.into_list().is_empty() => {
                    let bits = |q: Quat| q.to_array().map(f32::to_bits);
                    assert_eq!(bits(quiet), bits(unit[0]), "{norm}");
                }
                _ => assert!(quiet.w.is_nan(), "{norm}"),
            }
            let single = rounded(key);
            let bits = |q: Quat| q.to_array().map(f32::to_bits);
            let (quiet, double) = (quiet_unit_f32(single), quiet_unit(single.as_dquat()));
            assert_eq!(bits(quiet), bits(double), "{norm}");
        }
    }

    #[test]
    fn equal_times_keep_one_key_or_are_refused() {
        let values = [5, 6, 6, 7, 8];
        let kept_of = |times: &mut [f64], duplicates| {
            let equal = |i: usize, j: usize| values[i] == values[j];
            origin(duplicates).increasing(times, equal, &mut Warnings::new("t"))
        };
        let kept = |duplicates| kept_of(&mut [0.0, 1.0, 1.0, 1.0, 2.0], duplicates);
        assert_eq!(kept(Duplicates::First).unwrap(), Some(vec![0, 1, 4]));
        assert_eq!(kept(Duplicates::Last).unwrap(), Some(vec![0, 3, 4]));
        assert_eq!(kept(Duplicates::Refuse).unwrap_err().code, Code::EqualTimes);
        // `Both` keeps both keys of a jump and moves the earlier one back by a step of f32; also where the key before
        // is only 1e-12 s earlier.
        let mut times = [0.0, 1.0, 1.0, 1.0, 2.0];
        let jump = kept_of(&mut times, Duplicates::Both).unwrap();
        assert_eq!(jump, Some(vec![0, 1, 3, 4]));
        assert_eq!(times[1], 1.0 - f64::from(f32::EPSILON) / 2.0);
        let mut times = [-2.0, 0.0, 1.0, 1.0 + 1e-12, 1.0 + 1e-12];
        assert_eq!(
            kept_of(&mut times, Duplicates::Both).unwrap(),
            Some(vec![0, 1, 2, 3, 4])
        );
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "{times:?}");
        let next = 1f64.next_up();
        let full = kept_of(&mut [0.0, 0.5, 1.0, next, next], Duplicates::Both).unwrap_err();
        assert_eq!(full.code, Code::EqualTimes);
        let falling = origin(Duplicates::Last).increasing(
            &mut [0.0, 1.0, 0.5],
            |_, _| true,
            &mut Warnings::new("t"),
        );
        assert_eq!(falling.unwrap_err().code, Code::TimeNotIncreasing);
    }
}
