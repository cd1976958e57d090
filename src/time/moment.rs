//! A time as the sum of two numbers. At 1.7e9 s, one f64 has steps of 0.24 µs, in which a fast joint rotates
//! measurably. The time of a frame, or its position in a copy of a track, lies between two of these steps.

use crate::time::frame_rate::FrameRate;

/// A time or a duration in seconds: `high + low`, where `low` is at most half a step of `high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moment {
    pub(crate) high: f64,
    pub(crate) low: f64,
}

impl Moment {
    /// A time that one f64 represents exactly.
    #[inline]
    pub(crate) fn new(seconds: f64) -> Self {
        Self {
            high: seconds,
            low: 0.0,
        }
    }

    /// The exact sum of two numbers (Knuth 1969, theorem 4.2.2 B).
    #[inline]
    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let of_b = high - a;
        let low = (a - (high - of_b)) + (b - of_b);
        Self { high, low }
    }

    /// The exact product of two numbers (Dekker 1971, section 5).
    #[inline]
    fn product(a: f64, b: f64) -> Self {
        let halves = |x: f64| {
            let wide = x * 134_217_729.0; // 2^27 + 1
            let high = wide - (wide - x);
            (high, x - high)
        };
        let ((a1, a2), (b1, b2)) = (halves(a), halves(b));
        let high = a * b;
        let low = ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2;
        Self { high, low }
    }

    /// The exact distance from one number to another.
    #[inline]
    pub(crate) fn between(from: f64, to: f64) -> Self {
        Self::sum(to, -from)
    }

    #[inline]
    fn plus(self, other: Self) -> Self {
        let (high, low) = (
            Self::sum(self.high, other.high),
            Self::sum(self.low, other.low),
        );
        let high = Self::sum(high.high, high.low + low.high);
        Self::sum(high.high, high.low + low.low)
    }

    #[inline]
    fn times(self, number: f64) -> Self {
        let product = Self::product(self.high, number);
        Self::sum(product.high, product.low + self.low * number)
    }

    #[inline]
    pub(crate) fn minus(self, other: Self) -> Self {
        self.plus(Self {
            high: -other.high,
            low: -other.low,
        })
    }

    /// The time of frame `frame` at a rate.
    #[inline]
    pub(crate) fn of_frame(start: f64, rate: FrameRate, frame: u64) -> Self {
        let (whole, rest) = rate.seconds_of(frame);
        let time = Self::sum(start, whole);
        Self::sum(time.high, time.low + rest)
    }

    /// The seconds from another time to this one.
    #[inline(always)]
    pub(crate) fn since(self, time: f64) -> f64 {
        let high = Self::between(time, self.high);
        high.high + (high.low + self.low)
    }

    /// Its nearest f64.
    #[inline]
    pub(crate) fn seconds(self) -> f64 {
        self.high + self.low
    }

    fn is_negative(self) -> bool {
        self.high < 0.0 || (self.high == 0.0 && self.low < 0.0)
    }

    /// The number of frames in a duration.
    fn in_frames(self, rate: FrameRate) -> f64 {
        let (frames, seconds) = rate.ratio();
        let count = self.times(frames);
        let quotient = count.high / seconds;
        let rest = count.minus(Self::product(quotient, seconds));
        quotient + (rest.high + rest.low) / seconds
    }
}

/// The time from the first key of a track to the last, which is repeated: the period of its copies.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Period {
    first: f64,
    length: Moment,
}

/// The limit of copy numbers that are distinguished. At larger distances, more than one copy is between neighbouring
/// f64 times.
const COUNTED: f64 = (1u64 << 51) as f64;

/// The position of a time among the copies of a track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct InCopy {
    /// The number of the copy, 0 for the track itself; `None` above the limit.
    pub(crate) number: Option<f64>,
    /// Whether it is before the track's first key.
    pub(crate) is_before: bool,
    /// Whether the copy's number is odd: then it runs backwards if copies mirror each other.
    pub(crate) is_odd: bool,
    /// The seconds from the start of the copy, from 0 to less than its length.
    pub(crate) into: Moment,
}

impl Period {
    /// `None` for a track whose keys have one time.
    pub(crate) fn new((first, last): (f64, f64)) -> Option<Self> {
        let length = Moment::between(first, last);
        (length.high > 0.0).then_some(Self { first, length })
    }

    pub(crate) fn length(&self) -> Moment {
        self.length
    }

    /// The copy that contains a time. A time that is less than `rounding` before a copy counts to that copy.
    pub(crate) fn find(&self, time: Moment, rounding: f64) -> InCopy {
        let length = self.length;
        let from_first = time.minus(Moment::new(self.first));
        let mut number = (from_first.high / length.high).floor();
        if number.abs() > COUNTED {
            return self.find_uncounted(from_first);
        }
        let mut into = from_first.minus(length.times(number));
        while into.is_negative() {
            number -= 1.0;
            into = into.plus(length);
        }
        while !into.minus(length).is_negative() {
            number += 1.0;
            into = into.minus(length);
        }
        let until_next = length.minus(into).seconds();
        if until_next <= rounding.min(length.high / f64::from(1 << 20)) {
            (number, into) = (number + 1.0, Moment::new(0.0));
        }
        InCopy {
            number: Some(number),
            is_before: number < 0.0,
            is_odd: number % 2.0 != 0.0,
            into,
        }
    }

    fn find_uncounted(&self, from_first: Moment) -> InCopy {
        let (length, twice) = (self.length.high, 2.0 * self.length.high);
        // A remainder is exact, even if the quotient is too large to be counted.
        let into = (from_first.high.rem_euclid(twice) + from_first.low.rem_euclid(twice)) % twice;
        let is_odd = into >= length;
        let into = if is_odd { into - length } else { into };
        InCopy {
            number: None,
            is_before: from_first.high < 0.0,
            is_odd,
            into: Moment::new(into.clamp(0.0, length)),
        }
    }

    /// The frame coordinate of the track's first key in a copy.
    pub(crate) fn frame_of_first(
        &self,
        number: f64,
        backwards: bool,
        (rate, start): (FrameRate, f64),
    ) -> f64 {
        // If the copy runs backwards, it reaches the first key where the next copy begins.
        let number = if backwards { number + 1.0 } else { number };
        let time = Moment::between(start, self.first).plus(self.length.times(number));
        time.in_frames(rate)
    }

    /// The track's time at a position in a copy.
    pub(crate) fn time_in_track(&self, into: Moment, backwards: bool) -> Moment {
        let from_first = if backwards {
            self.length.minus(into)
        } else {
            into
        };
        from_first.plus(Moment::new(self.first))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In units of 2^-20 s / 1001, whole numbers of 128 bits have these times exactly.
    #[test]
    fn times_and_copies_are_exact_at_any_time() {
        let unit = |seconds: f64| (seconds * f64::from(1 << 20)) as i128 * 1001;
        let rate = FrameRate::new(1001, 1).unwrap();
        let frame = |k: u64| i128::from(k) << 20;
        for start in [0.0, -7.5, 86_400.25, 1.7e9, -4e16, 1e12 + 0.125, 1e18] {
            for (first, last) in [
                (0.0, 2.5),
                (0.25, 0.28125),
                (1.7e9, 1.7e9 + 0.75),
                (-3.0, 1e6),
            ] {
                let period = Period::new((first, last)).unwrap();
                let length = unit(last) - unit(first);
                for k in [0, 1, 2, 500, 1_000_000, (1 << 40) - 1] {
                    let time = Moment::of_frame(start, rate, k);
                    let exact = unit(start) + frame(k) - unit(first);
                    let found = period.find(time, 0.0);
                    let (number, into) = (exact.div_euclid(length), exact.rem_euclid(length));
                    let off = found.into.seconds() - into as f64 / 1001.0 / f64::from(1 << 20);
                    // The number of copies is unknown if one copy is shorter than a step of f64.
                    let bound = 1e-15 * (last - first).max(found.number.map_or(1e3, |_| 0.0));
                    let whole = last - first;
                    assert!(
                        off.abs() <= bound || (off.abs() - whole).abs() <= bound,
                        "{start}, {first} to {last}, frame {k}: {off:e}"
                    );
                    if off.abs() <= bound {
                        assert_eq!(found.is_odd, number % 2 != 0, "{start}, {first}, {k}");
                        assert!(found.number.is_none_or(|found| found == number as f64));
                    }
                }
            }
        }
    }
}
