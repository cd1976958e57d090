//! Frame rates as exact ratios.

use std::fmt;
use std::str::FromStr;

use crate::time::error::SampleTimesError;

/// Frames per second as a ratio: 30000/1001 is exact, 29.97 is not.
///
/// ```
/// use tumble::FrameRate;
/// let ntsc: FrameRate = "30000/1001".parse()?;
/// assert_eq!(ntsc, FrameRate::new(30_000, 1_001)?);
/// assert_eq!("12.5".parse::<FrameRate>()?, FrameRate::new(25, 2)?);
/// # Ok::<(), tumble::SampleTimesError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FrameRate {
    frames: u64,
    seconds: u64,
}

impl FrameRate {
    /// The rate of `frames` frames in `seconds` seconds. The ratio is reduced.
    ///
    /// # Errors
    /// When one of the numbers is zero, or exceeds 2^53 after reduction (then it is not exact in f64).
    pub fn new(frames: u64, seconds: u64) -> Result<Self, SampleTimesError> {
        let exact = 1..=1u64 << f64::MANTISSA_DIGITS;
        let divisor = gcd(frames, seconds).max(1);
        let rate = Self {
            frames: frames / divisor,
            seconds: seconds / divisor,
        };
        if !exact.contains(&rate.frames) || !exact.contains(&rate.seconds) {
            return Err(SampleTimesError::Rate {
                text: format!("{frames}/{seconds}"),
            });
        }
        Ok(rate)
    }

    /// The rate of `factor` times as many frames in the same seconds.
    ///
    /// # Errors
    /// As [`FrameRate::new`].
    pub fn times(self, factor: u64) -> Result<Self, SampleTimesError> {
        Self::new(self.frames.saturating_mul(factor), self.seconds)
    }

    /// A whole number of frames per second. 0 is refused later, in
    /// [`SampleTimes::resolve`](crate::SampleTimes::resolve).
    pub(crate) fn whole(frames: u32) -> Self {
        Self {
            frames: u64::from(frames),
            seconds: 1,
        }
    }

    pub(crate) fn is_zero(self) -> bool {
        self.frames == 0
    }

    /// The number of frames per second, rounded to f64.
    #[must_use]
    pub fn per_second(self) -> f64 {
        self.frames as f64 / self.seconds as f64
    }

    /// The number of frames in `seconds`, not rounded to a whole number.
    #[inline(always)]
    pub(crate) fn frames_in(self, seconds: f64) -> f64 {
        let frames = seconds * self.frames as f64;
        // Most rates are whole numbers. The comparison avoids a division, which takes longer than the rest.
        if self.seconds == 1 {
            frames
        } else {
            frames / self.seconds as f64
        }
    }

    /// The time of a frame after frame 0: whole seconds, and a fraction of a second.
    #[inline]
    pub(crate) fn seconds_of(self, frame: u64) -> (f64, f64) {
        let (frames, product) = (
            u128::from(self.frames),
            u128::from(frame) * u128::from(self.seconds),
        );
        let rest = (product % frames) as f64;
        ((product / frames) as f64, rest / self.frames as f64)
    }

    /// The numbers of frames and of seconds, both exact in f64.
    #[inline]
    pub(crate) fn ratio(self) -> (f64, f64) {
        (self.frames as f64, self.seconds as f64)
    }

    /// The time of frame `frame`, in seconds after frame 0.
    #[must_use]
    pub fn time_of(self, frame: u64) -> f64 {
        // At usual rates, this product is exact for every possible number of frames.
        frame as f64 * self.seconds as f64 / self.frames as f64
    }

    /// The rate with its unit, for messages: `1 frame a second`, `30000/1001 frames a second`.
    #[doc(hidden)]
    #[must_use]
    pub fn in_words(self) -> String {
        match (self.frames, self.seconds) {
            (1, 1) => "1 frame a second".to_owned(),
            _ => format!("{self} frames a second"),
        }
    }
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

impl fmt::Display for FrameRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.seconds {
            1 => write!(f, "{}", self.frames),
            seconds => write!(f, "{}/{seconds}", self.frames),
        }
    }
}

impl FromStr for FrameRate {
    type Err = SampleTimesError;

    /// Parses `25`, `12.5`, `1e-3` or `30000/1001`. Decimals are exact; one with more digits than a ratio holds, as of
    /// `0.1 + 0.2` in f64, is rounded to 15 significant digits.
    fn from_str(text: &str) -> Result<Self, SampleTimesError> {
        let refuse = || SampleTimesError::Rate {
            text: text.to_owned(),
        };
        let (frames, seconds) = match text.split_once('/') {
            Some((frames, seconds)) => (
                frames.parse().map_err(|_| refuse())?,
                seconds.parse().map_err(|_| refuse())?,
            ),
            None => {
                let rate = |(frames, seconds)| Self::new(frames, seconds).ok();
                let exact = decimal_ratio(text).and_then(rate);
                return exact
                    .or_else(|| rounded_ratio(text).and_then(rate))
                    .ok_or_else(refuse);
            }
        };
        Self::new(frames, seconds).map_err(|_| refuse())
    }
}

/// The ratio of a decimal rounded to 15 significant digits, as many as f64 holds of any decimal.
fn rounded_ratio(text: &str) -> Option<(u64, u64)> {
    let is_part = |byte: u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'e' | b'E' | b'-');
    let number: f64 = text.bytes().all(is_part).then(|| text.parse().ok())??;
    let is_rate = number.is_finite() && number > 0.0;
    is_rate.then(|| decimal_ratio(&format!("{number:.14e}")))?
}

/// The exact ratio of a decimal such as `12.5e1`: its digits over a power of ten.
fn decimal_ratio(text: &str) -> Option<(u64, u64)> {
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = format!("{whole}{}", fraction.trim_end_matches('0'));
    if digits.is_empty() || !digits.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let shift = exponent.checked_sub(i32::try_from(fraction.trim_end_matches('0').len()).ok()?)?;
    let power = 10u64.checked_pow(shift.unsigned_abs())?;
    let digits: u64 = digits.parse().ok()?;
    match shift {
        ..0 => Some((digits, power)),
        _ => Some((digits.checked_mul(power)?, 1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_exact_ratios() {
        for (text, frames, seconds) in [
            ("25", 25, 1),
            ("29.97", 2997, 100),
            ("30000/1001", 30_000, 1_001),
            ("1e9", 1_000_000_000, 1),
            ("1e-9", 1, 1_000_000_000),
            ("50/2", 25, 1),
            ("12.50", 25, 2),
            ("0.30000000000000004", 3, 10),
            ("59.99999999999999999999", 60, 1),
        ] {
            assert_eq!(text.parse(), FrameRate::new(frames, seconds), "{text}");
        }
        for text in [
            "0", "-1", "nan", "inf", "30fps", "", "1/0", "0/5", "1e99", ".", "1 0", "+-5",
        ] {
            assert!(text.parse::<FrameRate>().is_err(), "{text}");
        }
    }
}
