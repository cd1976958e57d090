//! The whole second from which the times of a set count, for clocks of whole numbers.

/// A whole second from which the times of a set count, so that they are exact in f64.
///
/// The seconds since 1970 as an f64 are multiples of 0.24 µs. All times of a set are relative: keys, frames and
/// explicit times may count from any moment, if it is the same for all. Time stamps in nanoseconds become seconds
/// after the whole second of the first stamp; these are exact to 1e-16 s in the first second, and to 1e-12 s in the
/// first hour.
///
/// ```
/// use glam::Quat;
/// use tumble::{TimeBase, TrackSet};
/// let stamps = [1_403_636_579_763_555_584, 1_403_636_579_813_555_584];
/// let (base, times) = TimeBase::of_nanoseconds(&stamps);
/// assert_eq!((base.second(), times[0]), (1_403_636_579, 0.763_555_584));
/// let mut set = TrackSet::new();
/// set.push("body", &times, &[Quat::IDENTITY, Quat::from_rotation_x(0.1)])?;
/// assert_eq!(base.nanoseconds(set.track(0).times[1]), Some(stamps[1]));
/// # Ok::<(), tumble::TrackError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct TimeBase(i64);

const NANOSECONDS: i64 = 1_000_000_000;

impl TimeBase {
    /// A base at this second.
    #[must_use]
    pub const fn new(second: i64) -> Self {
        Self(second)
    }

    /// The base for time stamps in nanoseconds, in any order, and each stamp in seconds after the base. The base is
    /// the whole second at or before the first stamp, or 0 if there are no stamps.
    #[must_use]
    pub fn of_nanoseconds(stamps: &[i64]) -> (Self, Vec<f64>) {
        let first = stamps.iter().min().copied().unwrap_or(0);
        let base = Self(first.div_euclid(NANOSECONDS));
        let times = stamps.iter().map(|&stamp| base.seconds(stamp));
        (base, times.collect())
    }

    /// The second from which times count.
    #[must_use]
    pub const fn second(self) -> i64 {
        self.0
    }

    /// The seconds from the base to a time stamp in nanoseconds, correctly rounded.
    #[must_use]
    pub fn seconds(self, nanoseconds: i64) -> f64 {
        let behind = i128::from(nanoseconds) - i128::from(self.0) * i128::from(NANOSECONDS);
        let (unit, exact_limit) = (i128::from(NANOSECONDS), 1i128 << f64::MANTISSA_DIGITS);
        if behind.abs() <= exact_limit {
            return behind as f64 / NANOSECONDS as f64;
        }
        // Whole seconds are exact; the remaining part of a second has only the rounding of a small number.
        (behind.div_euclid(unit)) as f64 + behind.rem_euclid(unit) as f64 / NANOSECONDS as f64
    }

    /// The time stamp in nanoseconds nearest to `seconds` after the base; `None` if it does not fit 64 bits.
    #[must_use]
    pub fn nanoseconds(self, seconds: f64) -> Option<i64> {
        let whole = seconds.floor();
        // Seconds of 63 bits fit; the sum is checked.
        if whole.is_nan() || whole.abs() > i64::MAX as f64 / 2.0 {
            return None;
        }
        let part = ((seconds - whole) * NANOSECONDS as f64).round() as i128;
        let second = i128::from(self.0) + whole as i128;
        i64::try_from(second * i128::from(NANOSECONDS) + part).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_come_back_from_seconds() {
        for first in [
            0,
            -1,
            999_999_999,
            -1_500_000_000,
            1_403_636_579_763_555_584,
            i64::MIN,
        ] {
            let stamps: Vec<i64> = (0..1000).map(|k| first + k * 4_999_999).collect();
            let (base, times) = TimeBase::of_nanoseconds(&stamps);
            assert!(times[0] >= 0.0 && times[0] < 1.0 && times.is_sorted());
            for (&stamp, &time) in stamps.iter().zip(&times) {
                assert_eq!(base.nanoseconds(time), Some(stamp), "{stamp}");
            }
        }
        let late = TimeBase::new(-3).seconds(i64::MAX);
        assert_eq!(late, 9_223_372_039.854_776);
        for seconds in [f64::NAN, f64::INFINITY, 1e300, -1e12, 1e10] {
            assert_eq!(TimeBase::default().nanoseconds(seconds), None, "{seconds}");
        }
    }
}
