//! Times as decimal numbers, exact to 1e-24 s. An f64 of seconds since 1970 is exact only to 0.2 µs.

use std::fmt;

use crate::rate::{Precision, last_digit_power, whole_power};

/// Units of this type in a second.
const SECOND: i128 = 10i128.pow(SECOND_DECIMALS);
const SECOND_DECIMALS: u32 = 24;
const NANOSECOND: i128 = SECOND / 1_000_000_000;

/// The largest magnitude of a time, three million years.
const LARGEST: i128 = 100_000_000_000_000 * SECOND;

/// A number of seconds, in steps of 1e-24.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Decimal(i128);

/// If the first time is at least this many seconds from 0, times count from its whole second. The reason is that an f64
/// of seconds since 1970 has steps of 0.2 µs; seconds from 0 are exact to a nanosecond for 104 days.
const OFFSET_LIMIT: u64 = 1_000_000;

/// The largest time that is taken for seconds since 1970; it is in the year 5138.
pub(crate) const LARGEST_SECONDS: f64 = 1e11;

/// The whole second from which times count, if `first` is the whole second of the first time.
pub(crate) fn offset_of(first: i64) -> i64 {
    match first.unsigned_abs() < OFFSET_LIMIT {
        true => 0,
        false => first,
    }
}

/// Whether times that count from this whole second are of a clock, rather than of a recording that begins near 0.
pub(crate) fn is_clock(whole: i64) -> bool {
    offset_of(whole) != 0
}

/// Seconds after a whole second as text, with their shortest decimals. Times of a clock have nanoseconds: further
/// digits would be those of the difference to the whole second.
pub(crate) fn time_text(whole: i64, time: f64) -> String {
    match Decimal::of(whole, time).filter(|_| whole != 0) {
        Some(sum) if is_clock(whole) => sum.to_clock().to_string(),
        Some(sum) => sum.to_string(),
        None => (whole as f64 + time).to_string(),
    }
}

/// Number of decimals in seconds of a number in a unit of `10^power` seconds. If the digits are those of an f64 printed
/// with more digits than it has, only the digits that it has count: `numpy.savetxt` prints 18 decimals of any number,
/// and 1700000000.05 becomes 1700000000.049999952….
pub(crate) fn decimal_count(token: &str, power: i32) -> u32 {
    let last = last_digit_power(token);
    let exact = f64_power(token, last).unwrap_or(last);
    exact.saturating_add(power).min(0).unsigned_abs()
}

/// For a number that is the decimal expansion of an f64 with more digits than the f64 determines: the power of ten of
/// the last digit that it determines. Otherwise `None`. `last` is the power of the number's last digit.
fn f64_power(token: &str, last: i32) -> Option<i32> {
    let mantissa = token.split(['e', 'E']).next().unwrap_or_default();
    let digits = mantissa.bytes().filter(u8::is_ascii_digit);
    let significant = digits.skip_while(|&digit| digit == b'0').count();
    if significant <= F64_DIGITS || last >= 0 {
        return None;
    }
    let value: f64 = token.parse().ok()?;
    let decimals = usize::try_from(last.unsigned_abs()).ok()?.min(400);
    let printed = format!("{value:.decimals$}");
    if Decimal::parse(&printed)? != Decimal::parse(token)? {
        return None;
    }
    let step = Precision::F64.ulp(value);
    (last..0).find(|&power| step <= whole_power(10.0, power))
}

/// The most digits that an f64 needs.
const F64_DIGITS: usize = 17;

impl Decimal {
    /// Parses a number as [`parse`](crate::text::number::parse) does, without digits after the 24th decimal. `None`
    /// outside ±1e14.
    pub(crate) fn parse(token: &str) -> Option<Self> {
        Self::parse_in(token, 0)
    }

    /// Parses a number in a unit of `10^power` seconds: -9 for nanoseconds.
    pub(crate) fn parse_in(token: &str, power: i32) -> Option<Self> {
        let (mantissa, exponent) = token.split_once(['e', 'E']).unwrap_or((token, "0"));
        let (whole, decimals) = mantissa.split_once('.').unwrap_or((mantissa, ""));
        let is_negative = whole.starts_with('-');
        let digits = format!("{}{decimals}", whole.trim_start_matches(['+', '-']));
        let digits = digits.trim_start_matches('0');
        if digits.is_empty() {
            return Some(Self(0));
        }
        // If the exponent does not fit into i32, the number is out of range, or 0.
        let exponent = match exponent.parse::<i32>() {
            Ok(exponent) => exponent,
            Err(_) if exponent.starts_with('-') => return Some(Self(0)),
            Err(_) => return None,
        };
        let zeros = exponent
            .saturating_sub(decimals.len() as i32)
            .saturating_add(SECOND_DECIMALS as i32 + power);
        let digits = match usize::try_from(zeros) {
            Ok(zeros) if zeros + digits.len() <= 39 => format!("{digits}{}", "0".repeat(zeros)),
            Ok(_) => return None,
            Err(_) => {
                let kept = digits.len().saturating_sub(zeros.unsigned_abs() as usize);
                format!("0{}", &digits[..kept])
            }
        };
        let steps: i128 = digits.parse().ok().filter(|&steps| steps <= LARGEST)?;
        Some(Self(if is_negative { -steps } else { steps }))
    }

    /// A whole number in a unit of `10^power` seconds.
    pub(crate) fn whole(number: i64, power: i32) -> Option<Self> {
        Self::parse_in(&number.to_string(), power)
    }

    /// The sum of whole seconds and a time with its shortest decimals; `None` outside ±1e14.
    pub(crate) fn of(whole: i64, time: f64) -> Option<Self> {
        // The whole seconds are added in i128, because `time` may be a difference from the first time, and so larger
        // than any time.
        let digits = time.to_string();
        let (seconds, decimals) = digits.split_once('.').unwrap_or((&digits, "0"));
        let seconds = i128::from(whole) + seconds.parse::<i128>().ok()?;
        let Self(rest) = Self::parse(&format!("0.{decimals}"))?;
        let rest = if time < 0.0 { -rest } else { rest };
        let sum = seconds.checked_mul(SECOND)?.checked_add(rest)?;
        (sum.abs() <= LARGEST).then_some(Self(sum))
    }

    /// Whether it is a whole second.
    pub(crate) fn is_whole(self) -> bool {
        self.0 % SECOND == 0
    }

    /// The time rounded to nanoseconds.
    pub(crate) fn to_clock(self) -> Self {
        Self(self.nanoseconds() * NANOSECOND)
    }

    /// The nearest whole nanosecond.
    pub(crate) fn nanoseconds(self) -> i128 {
        (self.0 + NANOSECOND / 2).div_euclid(NANOSECOND)
    }

    /// The whole second at or before it.
    pub(crate) fn whole_seconds(self) -> i64 {
        self.0.div_euclid(SECOND) as i64
    }

    /// Seconds after a whole second, correctly rounded.
    pub(crate) fn since(self, whole: i64) -> f64 {
        let steps = i128::from(whole).checked_mul(SECOND);
        match steps.and_then(|steps| self.0.checked_sub(steps)) {
            // The text of the difference has only digits and a point, so it can be parsed as an f64, correctly rounded.
            Some(difference) => Self(difference).to_string().parse().unwrap_or(f64::NAN),
            // Such a number is a whole number in f64, so its whole seconds are exact.
            None => {
                let rest = self.0.rem_euclid(SECOND) as f64 / SECOND as f64;
                (self.whole_seconds() - whole) as f64 + rest
            }
        }
    }
}

/// Displays at least as many decimals as `{:.9}` requests.
impl fmt::Display for Decimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (sign, steps) = (if self.0 < 0 { "-" } else { "" }, self.0.unsigned_abs());
        let (whole, rest) = (steps / SECOND as u128, steps % SECOND as u128);
        let decimals = format!("{rest:0width$}", width = SECOND_DECIMALS as usize);
        let decimals = decimals.trim_end_matches('0');
        let least = f.precision().unwrap_or(0);
        if decimals.len().max(least) == 0 {
            return write!(f, "{sign}{whole}");
        }
        write!(f, "{sign}{whole}.{decimals:0<least$}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_as_far_apart_as_can_be_are_told() {
        let (first, last) = ("-1e14", "99999999999999.57");
        let [first, last] = [first, last].map(|text| Decimal::parse(text).unwrap());
        let apart = last.since(first.whole_seconds());
        assert!((apart - 199_999_999_999_999.57).abs() < 0.02, "{apart}");
    }

    #[test]
    fn times_of_a_clock_have_nanoseconds() {
        for (whole, time, text) in [
            (1_700_000_000, 0.000_796_556_5, "1700000000.000796557"),
            (1_700_000_000, 1.0 / 3.0, "1700000000.333333333"),
            (1_700_000_000, 2.0, "1700000002"),
            (-1_700_000_000, 0.25, "-1699999999.75"),
            (0, 1.0 / 3.0, "0.3333333333333333"),
        ] {
            assert_eq!(time_text(whole, time), text);
        }
    }

    #[test]
    fn digits_after_those_of_an_f64_do_not_count() {
        for (token, power, count) in [
            ("1.700000000049999952e+09", 0, 6),
            ("1.700000000000000000e+09", 0, 6),
            ("1700000000.123456789", 0, 9),
            ("1700000000123456789", -9, 9),
            ("1.700000000050000000e+12", -3, 6),
            ("1.000000000000000056e-01", 0, 16),
            ("1305031098.6659", 0, 4),
        ] {
            assert_eq!(decimal_count(token, power), count, "{token}");
        }
    }

    #[test]
    fn every_digit_is_kept() {
        for (token, shown) in [
            ("1305031098.6659", "1305031098.6659"),
            ("1.305031098665900000e+09", "1305031098.6659"),
            ("-0.25", "-0.25"),
            ("+.5", "0.5"),
            ("5.", "5"),
            ("-0", "0"),
            ("1e-24", "0.000000000000000000000001"),
            ("1.9e-24", "0.000000000000000000000001"),
            ("1e-999999999999", "0"),
            ("0e999999999999", "0"),
            ("00012", "12"),
            ("1e14", "100000000000000"),
        ] {
            let number = Decimal::parse(token).unwrap();
            assert_eq!(number.to_string(), shown, "{token}");
            let decimals = shown
                .split_once('.')
                .map_or(0, |(_, decimals)| decimals.len());
            let padded = format!("{number:.5}");
            assert_eq!(Decimal::parse(&padded), Some(number));
            assert_eq!(
                padded.split_once('.').unwrap().1.len(),
                decimals.max(5),
                "{token}"
            );
        }
        for token in ["100000000000000.1", "-1e15", "1e38", "1e999999999999"] {
            assert_eq!(Decimal::parse(token), None, "{token}");
        }
    }

    #[test]
    fn nanoseconds_keep_their_digits() {
        for token in ["1403636579763555584", "1403636579763555584.000000"] {
            let time = Decimal::parse_in(token, -9).unwrap();
            assert_eq!(time.to_string(), "1403636579.763555584", "{token}");
            assert_eq!(time.since(1_403_636_579), 0.763_555_584);
            assert_eq!(time.nanoseconds(), 1_403_636_579_763_555_584);
        }
        assert_eq!(Decimal::whole(-1_500, -3), Decimal::parse("-1.5"));
        for (token, nearest) in [
            ("-0.0000000016", -2),
            ("-1e-10", 0),
            ("15e-10", 2),
            ("1.4e-9", 1),
        ] {
            assert_eq!(
                Decimal::parse(token).unwrap().nanoseconds(),
                nearest,
                "{token}"
            );
        }
    }

    #[test]
    fn whole_seconds_and_the_rest_are_the_time() {
        let time = Decimal::parse("1305031098.6659").unwrap();
        assert_eq!(
            (time.whole_seconds(), time.since(1_305_031_098)),
            (1_305_031_098, 0.6659)
        );
        assert_eq!(Decimal::of(1_305_031_098, 0.6659), Some(time));
        let before = Decimal::parse("-3.25").unwrap();
        assert_eq!((before.whole_seconds(), before.since(-4)), (-4, 0.75));
        assert_eq!(Decimal::of(-4, 0.75), Some(before));
        let apart = Decimal::of(-99_999_999_999_999, 100_000_005_000_000.5);
        assert_eq!(apart.unwrap().to_string(), "5000001.5");
        assert_eq!(Decimal::of(-3, -0.25).unwrap().to_string(), "-3.25");
        assert_eq!(before.since(0), -3.25);
        assert_eq!(
            (Decimal::of(i64::MAX, 0.0), Decimal::of(0, f64::NAN)),
            (None, None)
        );
    }
}
