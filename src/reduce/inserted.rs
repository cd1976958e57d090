//! Curves that depend on neighbouring keys: keys are put in where the curve is too far away, and those
//! that can be missed are taken out again.

use std::ops::Range;

use crate::reduce::ReductionTask;
use crate::reduce::value::Value;

/// A curve changes as far as this many keys from one that is put in or taken out.
const REACH: usize = 2;

/// The worst sample of each of some intervals between keys, and how far it is from the curve, as a part
/// of the tolerance. The keys are all that the curve of these intervals depends on.
pub(crate) type Worst<'a> = dyn Fn(&[usize], Range<usize>) -> Vec<(usize, f64)> + 'a;

/// The indices of the keys of a curve that is near to all samples: the fewest of those that are found from
/// the two ends, from all samples, and from the keys of `cubics`, whose intervals are cubics too.
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

/// Puts keys in until the curve is near: every interval whose curve is too far from a sample gets the
/// worst one. It ends: at last every sample is a key.
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

/// Takes keys out while the curve stays near: of two neighbours one in each round, so that those that
/// stay are spread evenly.
fn thinned(mut indices: Vec<usize>, worst_of_each: &Worst<'_>) -> Vec<usize> {
    loop {
        let before = indices.len();
        let mut i = 1;
        while i + 1 < indices.len() {
            if can_miss(&indices, i, worst_of_each) {
                indices.remove(i);
            }
            // Behind a key that is out the next one stays for this round.
            i += 1;
        }
        if indices.len() == before {
            return indices;
        }
    }
}

/// Whether the curve stays near all samples without a key.
fn can_miss(keys: &[usize], key: usize, worst_of_each: &Worst<'_>) -> bool {
    // One key more on each side than the curve that changes: its tangents depend on those.
    let first = key.saturating_sub(REACH + 1);
    let end = (key + REACH + 2).min(keys.len());
    let kept: Vec<usize> = (first..end)
        .filter(|&k| k != key)
        .map(|k| keys[k])
        .collect();
    // Cut ends are not those of the curve, and their intervals do not change.
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
                    // Also where both are 0.
                    true => (apart / self.tolerance).min(1.0),
                    // NaN is not near.
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
