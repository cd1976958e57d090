//! Reduction for curves that depend on neighbouring keys: keys are inserted where the curve is too far from samples,
//! and unnecessary keys are removed again.

use std::ops::Range;

use crate::reduce::ReductionTask;
use crate::reduce::value::Value;

/// The number of keys on each side of an inserted or removed key up to which the curve changes.
const REACH: usize = 2;

/// The worst sample of each of some intervals between keys, and its distance from the curve as a fraction of the
/// tolerance. The keys are all keys on which the curve of these intervals depends.
pub(crate) type Worst<'a> = dyn Fn(&[usize], Range<usize>) -> Vec<(usize, f64)> + 'a;

/// The indices of the keys of a curve that is near to all samples. Three starts are tried: only the two ends, all
/// samples, and the keys of `cubics`, whose intervals are cubics too; the result with the fewest keys is returned.
pub(crate) fn inserted(
    samples: usize,
    cubics: Vec<usize>,
    worst_of_each: &Worst<'_>,
) -> Vec<usize> {
    let starts = [vec![0, samples - 1], cubics];
    let filled = starts.map(|start| filled(start, worst_of_each));
    let all = filled.into_iter().chain([(0..samples).collect()]);
    let thinned = all.map(|indices| thinned(indices, worst_of_each));
    thinned.min_by_key(Vec::len).unwrap_or_default()
}

/// Inserts keys until the curve is near: every interval with a sample that is not near gets its worst sample as a
/// key. This ends at the latest when every sample is a key.
fn filled(mut indices: Vec<usize>, worst_of_each: &Worst<'_>) -> Vec<usize> {
    loop {
        let worst = worst_of_each(&indices, 0..indices.len() - 1);
        let more = worst.into_iter().filter(|candidate| candidate.1 > 1.0);
        let more: Vec<usize> = more.map(|candidate| candidate.0).collect();
        if more.is_empty() {
            return indices;
        }
        indices.extend(more);
        indices.sort_unstable();
        indices.dedup();
    }
}

/// Removes keys while the curve stays near. Each round removes at most one of two neighbours, so that the remaining
/// keys are spread evenly.
fn thinned(mut indices: Vec<usize>, worst_of_each: &Worst<'_>) -> Vec<usize> {
    loop {
        let before = indices.len();
        let mut i = 1;
        while i + 1 < indices.len() {
            if can_miss(&indices, i, worst_of_each) {
                indices.remove(i);
            }
            // After a removed key, the next key is kept in this round.
            i += 1;
        }
        if indices.len() == before {
            return indices;
        }
    }
}

/// Whether the curve stays near to all samples without this key.
fn can_miss(keys: &[usize], key: usize, worst_of_each: &Worst<'_>) -> bool {
    // One key more on each side than the changed part of the curve, because its tangents depend on these keys.
    let first = key.saturating_sub(REACH + 1);
    let end = (key + REACH + 2).min(keys.len());
    let kept: Vec<usize> = (first..end)
        .filter(|&k| k != key)
        .map(|k| keys[k])
        .collect();
    // The ends of this part are not the ends of the whole curve. The intervals there do not change, so they are
    // skipped.
    let skipped = usize::from(first > 0);
    let count = kept.len() - 1 - usize::from(end < keys.len());
    worst_of_each(&kept, skipped..count)
        .iter()
        .all(|candidate| candidate.1 <= 1.0)
}

impl<T: Value> ReductionTask<'_, T> {
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
            for i in keys[interval] + 1..keys[interval + 1] {
                let apart = self.samples[i].apart(curve(self.times[i]));
                let part = match apart <= self.tolerance {
                    // 0 / 0 is NaN; `min` turns it into 1.
                    true => (apart / self.tolerance).min(1.0),
                    // NaN counts as too far away.
                    false => (apart / self.tolerance).max(1.0).next_up(),
                };
                if part > worst.1 {
                    worst = (i, part);
                }
            }
            worst
        };
        intervals.map(worst).collect()
    }
}
