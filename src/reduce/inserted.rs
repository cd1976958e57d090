//! Curves that depend on neighbouring keys: keys are put in where the curve is too far away, and those
//! that can be missed are taken out again.

use crate::reduce::value::Value;
use crate::reduce::{ReducedKeys, Task};

/// A curve changes as far as this many keys from one that is put in or taken out.
const REACH: usize = 2;

pub(crate) fn inserted<T: Value>(task: &Task<'_, T>) -> ReducedKeys<T> {
    let last = task.samples.len() - 1;
    let mut places = vec![0, last];
    // Every interval whose curve is too far from a sample gets the worst one. It ends: at last every
    // sample is a key.
    loop {
        let worst = task.worst_of_each(&places, 0..places.len() - 1);
        let more = worst.into_iter().filter(|own| own.1 > task.tolerance);
        let more: Vec<usize> = more.map(|own| own.0).collect();
        if more.is_empty() {
            break;
        }
        places.extend(more);
        places.sort_unstable();
        places.dedup();
    }
    let mut place = 1;
    while place + 1 < places.len() {
        if task.can_miss(&places, place) {
            places.remove(place);
            // The one before may be missed now.
            place = place.saturating_sub(1).max(1);
        } else {
            place += 1;
        }
    }
    let worst = task.worst_of_each(&places, 0..places.len() - 1);
    ReducedKeys {
        keys: places.iter().map(|&place| task.samples[place]).collect(),
        places,
        tangents: Vec::new(),
        error: worst.iter().map(|own| own.1).fold(0.0, f64::max),
    }
}

impl<T: Value> Task<'_, T> {
    /// The worst sample of each interval between keys, and how far it is from the curve. `keys` are
    /// all that the curve of these intervals depends on.
    fn worst_of_each(
        &self,
        keys: &[usize],
        intervals: std::ops::Range<usize>,
    ) -> Vec<(usize, f64)> {
        let times: Vec<f64> = keys.iter().map(|&key| self.times[key]).collect();
        let values: Vec<T> = keys.iter().map(|&key| self.samples[key]).collect();
        let curve = T::bessel_overhauser(&times, &values);
        intervals
            .map(|interval| {
                let mut worst = (keys[interval], 0.0);
                for place in keys[interval] + 1..keys[interval + 1] {
                    let apart = self.samples[place].apart(curve(self.times[place]));
                    let apart = if apart.is_nan() { f64::INFINITY } else { apart };
                    if apart > worst.1 {
                        worst = (place, apart);
                    }
                }
                worst
            })
            .collect()
    }

    /// Whether the curve stays near all samples without a key.
    fn can_miss(&self, keys: &[usize], key: usize) -> bool {
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
        let near = |own: &(usize, f64)| own.1 <= self.tolerance;
        self.worst_of_each(&own, skipped..count).iter().all(near)
    }
}
