//! Search for the interval between keys, or the span of a prepared track, that contains an explicit time. Explicit
//! times may be in any order.

use crate::shader::{IS_KEY, KeySample};
use crate::time::frame_clock::in_seconds;

/// The key before a time and the time's parameter after it; the search starts at the key `near`.
#[inline(always)]
pub(crate) fn key_sample(times: &[f64], time: f64, near: usize) -> KeySample {
    let key = key_before(times, time, near);
    let parameter = match key & IS_KEY {
        0 => parameter(times[key as usize], times[key as usize + 1], time),
        _ => 0.0,
    };
    KeySample { key, parameter }
}

/// The parameter of a time in the interval from `start` to `end`.
#[inline(always)]
fn parameter(start: f64, end: f64, time: f64) -> f32 {
    in_seconds(end - start).parameter(time - start)
}

/// The last key that is not after a time, or the first one for earlier times. The bit `IS_KEY` is set if the rotation
/// is that key itself. The search starts at the key `near`.
#[inline(always)]
pub(crate) fn key_before(times: &[f64], time: f64, near: usize) -> u32 {
    let last = times.len() - 1;
    if time >= times[last] {
        return IS_KEY | last as u32;
    } else if time < times[0] {
        return IS_KEY;
    }
    let key = interval_at(times, time, near);
    key as u32 | if time == times[key] { IS_KEY } else { 0 }
}

/// The interval that contains a time, from the starts of all intervals; the first one for earlier times. The search
/// starts at the interval `near`.
#[inline(always)]
pub(crate) fn interval_at(starts: &[f64], time: f64, near: usize) -> usize {
    let contains = |i: usize| {
        starts.get(i).is_some_and(|&start| start <= time)
            && starts.get(i + 1).is_none_or(|&next| time < next)
    };
    // Times mostly increase: the same interval and the next one are tried before a search.
    if contains(near) {
        near
    } else if contains(near + 1) {
        near + 1
    } else {
        // Most keys are at even times: compute the interval as if all were. Because of rounding it may be the
        // neighbouring one.
        let guess = even_interval(starts, time);
        if contains(guess) {
            guess
        } else if contains(guess + 1) {
            guess + 1
        } else {
            let behind = starts.partition_point(|&start| start <= time);
            behind.saturating_sub(1)
        }
    }
}

/// The interval that would contain a time if all were equally long.
#[inline(always)]
fn even_interval(starts: &[f64], time: f64) -> usize {
    let (Some(first), Some(last)) = (starts.first(), starts.last()) else {
        return 0;
    };
    let intervals = starts.len() - 1;
    let passed = (time - first) / (last - first) * intervals as f64;
    // The cast gives a valid index also for times outside the keys and for numbers that are not finite, because casts
    // of floats saturate.
    (passed as usize).min(intervals)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a guess that is taken where the time is in another interval: even keys, uneven ones, a single one, and
    /// times on, between, before and after them, from any interval.
    #[test]
    fn the_interval_of_a_time_is_found_from_anywhere() {
        let even: Vec<f64> = (0..50).map(|key| 0.1 + f64::from(key) / 30.0).collect();
        let uneven: Vec<f64> = (0..50).map(|key| f64::from(key * key)).collect();
        let one_gap: Vec<f64> = (0..50)
            .map(|key| f64::from(key + 1000 * (key / 25)))
            .collect();
        for starts in [even, uneven, one_gap, vec![2.0], vec![-f64::MAX, f64::MAX]] {
            let beside = |time: f64| [time.next_down(), time, time.next_up(), time + 0.01];
            for time in starts.iter().copied().flat_map(beside) {
                let expected = starts.iter().rposition(|&start| start <= time);
                for near in 0..=starts.len() {
                    let found = interval_at(&starts, time, near);
                    assert_eq!(
                        found,
                        expected.unwrap_or(0),
                        "{time} of {starts:?} from {near}"
                    );
                }
            }
        }
    }
}
