//! Curves that depend on neighbouring keys: keys are put in where the curve is too far away, and those
//! that can be missed are taken out again.

use std::ops::Range;

use crate::reduce::Task;
use crate::reduce::value::Value;

/// A curve changes as far as this many keys from one that is put in or taken out.
const REACH: usize = 2;

/// The worst sample of each of some intervals between keys, and how far it is from the curve, as a part
/// of the tolerance. The keys are all that the curve of these intervals depends on.
pub(crate) type Worst<'a> = dyn Fn(&[usize], Range<usize>) -> Vec<(usize, f64)> + 'a;

/// The places of the keys of a curve that is near to all samples: the fewest of those that are found from
/// the two ends, from all samples, and from the keys of `cubics`, whose intervals are cubics too.
pub(crate) fn inserted(
    samples: usize,
    cubics: Vec<usize>,
    worst_of_each: &Worst<'_>,
) -> Vec<usize> {
    let starts = [vec![0, samples - 1], cubics];
    let filled = starts.map(|start| filled(start, worst_of_each));
    let all = filled.into_iter().chain([(0..samples).collect()]);
    let thinned = all.map(|places| thinned(places, worst_of_each));
    thinned.min_by_key(Vec::len).unwrap_or_default()
}

/// Puts keys in until the curve is near: every interval whose curve is too far from a sample gets the
/// worst one. It ends: at last every sample is a key.
fn filled(mut places: Vec<usize>, worst_of_each: &Worst<'_>) -> Vec<usize> {
    loop {
        let worst = worst_of_each(&places, 0..places.len() - 1);
        let more = worst.into_iter().filter(|own| own.1 > 1.0);
        let more: Vec<usize> = more.map(|own| own.0).collect();
        if more.is_empty() {
            return places;
        }
        places.extend(more);
        places.sort_unstable();
        places.dedup();
    }
}

/// Takes keys out while the curve stays near: of two neighbours one in each round, so that those that
/// stay are spread evenly.
fn thinned(mut places: Vec<usize>, worst_of_each: &Worst<'_>) -> Vec<usize> {
    loop {
        let before = places.len();
        let mut place = 1;
        while place + 1 < places.len() {
            if can_miss(&places, place, worst_of_each) {
                places.remove(place);
            }
            // Behind a key that is out the next one stays for this round.
            place += 1;
        }
        if places.len() == before {
            return places;
        }
    }
}

/// Whether the curve stays near all samples without a key.
fn can_miss(keys: &[usize], key: usize, worst_of_each: &Worst<'_>) -> bool {
    // One key more on each side than the curve that changes: its tangents depend on those.
    let first = key.saturating_sub(REACH + 1);
    let end = (key + REACH + 2).min(keys.len());
    let own: Vec<usize> = (first..end)
        .filter(|&k| k != key)
        .map(|k| keys[k])
        .collect();
    // Cut ends are not those of the curve, and their intervals do not change.
    let skipped = usize::from(first > 0);
    let count = own.len() - 1 - usize::from(end < keys.len());
    worst_of_each(&own, skipped..count)
        .iter()
        .all(|own| own.1 <= 1.0)
}

impl<T: Value> Task<'_, T> {
    pub(crate) fn worst_of_each(
        &self,
        keys: &[usize],
        intervals: Range<usize>,
    ) -> Vec<(usize, f64)> {
        let times: Vec<f64> = keys.iter().map(|&key| self.times[key]).collect();
        let values: Vec<T> = keys.iter().map(|&key| self.samples[key]).collect();
        let curve = T::bessel_overhauser(&times, &values);
        let worst = |interval: usize| {
            let mut worst = (keys[interval], 0.0);
            for place in keys[interval] + 1..keys[interval + 1] {
                let apart = self.samples[place].apart(curve(self.times[place]));
                let part = match apart <= self.tolerance {
                    // Also where both are 0.
                    true => (apart / self.tolerance).min(1.0),
                    // What is no number is not near.
                    false => (apart / self.tolerance).max(1.0).next_up(),
                };
                if part > worst.1 {
                    worst = (place, part);
                }
            }
            worst
        };
        intervals.map(worst).collect()
    }
}
