//! The rate that a printed frame time stands for.

use tumble::FrameRate;

/// The largest numerator and denominator of a rate: those that f64 holds exactly.
const LARGEST: u128 = 1 << f64::MANTISSA_DIGITS;

/// The rate of a frame time that the file writes as `token`, and whose number is `period`, seconds.
///
/// The nearest whole number up to 1000 whose period is within half a unit of the last digit
/// printed (`.0083333` is 120); else such a number times 1000/1001; else the number itself. Some
/// programs print the digits of an f32, so it may also be the period rounded to f32 that is so
/// near. `None` for periods beyond 1e-9 s to 1e9 s.
pub(crate) fn of_period(token: &str, period: f64) -> Option<FrameRate> {
    let half_unit = 0.5 * 10f64.powi(last_place(token));
    let near = |exact: f64| {
        let rounded = f64::from(exact as f32);
        (exact - period).abs() <= half_unit || (rounded - period).abs() <= half_unit
    };
    let multiple_of = |frames: u64, seconds: u64| {
        let multiple = (seconds as f64 / frames as f64 / period).round();
        let rate = (1.0..=1000.0)
            .contains(&multiple)
            .then(|| FrameRate::new(multiple as u64 * frames, seconds))?
            .ok()?;
        near(rate.time_of(1)).then_some(rate)
    };
    let ntsc = || multiple_of(1000, 1001);
    multiple_of(1, 1).or_else(ntsc).or_else(|| itself(period))
}

/// The power of ten that the last digit of a number counts.
fn last_place(token: &str) -> i32 {
    let (mantissa, exponent) = token.split_once(['e', 'E']).unwrap_or((token, "0"));
    let decimals = mantissa
        .split_once('.')
        .map_or(0, |(_, decimals)| decimals.len());
    let exponent: i32 = exponent.parse().unwrap_or(0); // of at most 62 digits; it has been a number
    exponent.saturating_sub(decimals as i32)
}

/// The rate whose period is the simplest fraction that is this number in f64: the first of its
/// continued fraction's convergents that rounds to it. So a rate comes back from the shortest
/// digits of its period.
pub(crate) fn itself(period: f64) -> Option<FrameRate> {
    if !(1e-9..=1e9).contains(&period) {
        return None;
    }
    // The number as a ratio of whole numbers; it has at most 82 binary places.
    let exponent = (period.to_bits() >> 52) as i32 - 1023;
    let places = 52 - exponent;
    let mut rest = ((period * 2f64.powi(places)) as u128, 1u128 << places);
    let (mut before, mut last) = ((0u128, 1u128), (1u128, 0u128));
    while rest.1 > 0 {
        let whole = rest.0 / rest.1;
        rest = (rest.1, rest.0 % rest.1);
        let next = |last: u128, before: u128| whole.saturating_mul(last).saturating_add(before);
        let next = (next(last.0, before.0), next(last.1, before.1));
        (before, last) = (last, next);
        if last.0.max(last.1) > LARGEST {
            return None;
        }
        if last.0 as f64 / last.1 as f64 == period {
            return FrameRate::new(last.1 as u64, last.0 as u64).ok();
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rate(token: &str) -> Option<FrameRate> {
        of_period(token, token.parse().unwrap())
    }

    #[test]
    fn printed_periods_are_the_rates_they_were_rounded_from() {
        for (token, frames, seconds) in [
            (".0083333", 120, 1),
            ("0.033333", 30, 1),
            ("0.0333333", 30, 1),
            ("0.0333667", 30_000, 1_001),
            ("0.04170833", 24_000, 1_001),
            ("0.008341666666666667", 120_000, 1_001),
            ("3.3333e-02", 30, 1),
            ("1E0", 1, 1),
            ("0.001", 1000, 1),
            ("0.04", 25, 1),
            ("0.00694", 144, 1),
            // The digits of f32(1/30), in C# and in full.
            ("0.03333334", 30, 1),
            ("0.0333333351", 30, 1),
        ] {
            assert_eq!(rate(token), FrameRate::new(frames, seconds).ok(), "{token}");
        }
    }

    #[test]
    fn other_periods_are_taken_as_they_are() {
        for (token, frames, seconds) in [
            ("0.0166", 5_000, 83),
            ("0.033334", 500_000, 16_667),
            ("2.5", 2, 5),
            ("0.00025", 4_000, 1),
            ("1e9", 1, 1_000_000_000),
            ("1e-9", 1_000_000_000, 1),
        ] {
            assert_eq!(rate(token), FrameRate::new(frames, seconds).ok(), "{token}");
        }
        for token in ["1e10", "9e-10", "1e-30"] {
            assert_eq!(rate(token), None, "{token}");
        }
    }

    #[test]
    fn rates_come_back_from_the_shortest_digits_of_their_period() {
        let ratios = (1..400).flat_map(|frames| {
            [1, 3, 100, 1001, 99_991].map(|seconds| (frames * 7919 % 100_003, seconds))
        });
        for (frames, seconds) in ratios {
            let rate = FrameRate::new(frames, seconds).unwrap();
            let period = seconds as f64 / frames as f64;
            assert_eq!(of_period(&period.to_string(), period), Some(rate), "{rate}");
        }
    }
}
