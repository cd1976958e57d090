//! Reduction for curves whose intervals depend only on their two keys: arcs and lines, and cubics with tangents for
//! each interval.

use glam::DVec4;

use crate::reduce::ReductionTask;
use crate::reduce::value::Value;
use crate::reference::segment::hermite;

/// The indices of the keys of intervals that are as long as possible: from each key to the last sample that `fits`
/// accepts. The length is doubled until `fits` fails, then found by bisection, so each sample is checked about `log
/// n` times. A neighbouring sample always fits, because there are no samples between.
pub(crate) fn longest(samples: usize, fits: impl Fn(usize, usize) -> bool) -> Vec<usize> {
    let last = samples - 1;
    let mut indices = vec![0];
    while let Some(&from) = indices.last().filter(|&&from| from < last) {
        let mut reached = from + 1;
        let mut refused = last + 1;
        let mut step = 2;
        while reached < last {
            let to = (from + step).min(last);
            if !fits(from, to) {
                refused = to;
                break;
            }
            reached = to;
            step *= 2;
        }
        while reached + 1 < refused {
            let middle = usize::midpoint(reached, refused);
            match fits(from, middle) {
                true => reached = middle,
                false => refused = middle,
            }
        }
        indices.push(reached);
    }
    indices
}

impl<T: Value> ReductionTask<'_, T> {
    /// Whether all samples within an interval are near to the curve.
    pub(crate) fn fits(&self, from: usize, to: usize, is_cubic: bool) -> bool {
        let error = self.interval(from, to, is_cubic, self.tolerance);
        error.is_some()
    }

    /// The largest distance of a sample from the intervals between the keys at some samples.
    pub(crate) fn interval_error(&self, indices: &[usize], is_cubic: bool) -> f64 {
        let error = |pair: &[usize]| self.interval(pair[0], pair[1], is_cubic, f64::INFINITY);
        let errors = indices.windows(2).map(error);
        errors.fold(0.0, |largest, found| {
            largest.max(found.unwrap_or(f64::INFINITY))
        })
    }

    /// The tangents of cubics at some keys, per second.
    pub(crate) fn tangents_at(&self, indices: &[usize]) -> Vec<[T; 2]> {
        let mut found = Vec::with_capacity(indices.len());
        let still = T::of_numbers(DVec4::ZERO);
        let mut arriving = still;
        for pair in indices.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let seconds = self.times[to] - self.times[from];
            let tangents = self.tangents(from, to);
            let [leaving, next] = tangents.map(|tangent| T::of_numbers(tangent / seconds));
            found.push([arriving, leaving]);
            arriving = next;
        }
        found.push([arriving, still]);
        found
    }

    /// The largest distance of a sample within an interval; `None` if it exceeds `limit`.
    fn interval(&self, from: usize, to: usize, is_cubic: bool, limit: f64) -> Option<f64> {
        let (times, samples) = (self.times, self.samples);
        let (start, end) = (samples[from], samples[to]);
        let seconds = times[to] - times[from];
        let part = |i: usize| (times[i] - times[from]) / seconds;
        let tangents = match is_cubic {
            true => self.tangents(from, to),
            false => [DVec4::ZERO; 2],
        };
        let cubic = |part: f64| {
            let [a, b, c, d] = hermite(part);
            let ends = start.numbers() * a + end.numbers() * c;
            T::nearest(ends + tangents[0] * b + tangents[1] * d)
        };
        // A cubic could pass through all samples and deviate between them. Neighbouring samples are always connected.
        if is_cubic && to > from + 1 {
            for i in from..to {
                // The difference between both shows how much is unknown between samples.
                let [straight, smooth] = self.middle(i);
                let (middle, slack) = (straight.towards(smooth, 0.5), 0.5 * straight.apart(smooth));
                let curve = cubic(f64::midpoint(part(i), part(i + 1)));
                let apart = middle.apart(curve);
                if apart.is_nan() || apart > limit + slack {
                    return None;
                }
            }
        }
        let mut error = 0.0f64;
        for (i, &sample) in samples.iter().enumerate().take(to).skip(from + 1) {
            let curve = match is_cubic {
                true => cubic(part(i)),
                false => start.towards(end, part(i)),
            };
            let apart = sample.apart(curve);
            // NaN counts as too far away.
            if apart.is_nan() || apart > limit {
                return None;
            }
            error = error.max(apart);
        }
        Some(error)
    }

    /// Two estimates of the value at the middle between a sample and the next one: on the straight line, and on the
    /// cubic through the four nearest samples (at an end, the parabola through three).
    fn middle(&self, i: usize) -> [T; 2] {
        let samples = self.samples;
        let straight = samples[i].towards(samples[i + 1], 0.5);
        let numbers_at = |j: usize| samples.get(j).map(|sample| sample.numbers());
        let [b, c] = [i, i + 1].map(|j| samples[j].numbers());
        let before = i.checked_sub(1).and_then(numbers_at);
        let smooth = match (before, numbers_at(i + 2)) {
            (Some(a), Some(d)) => (b + c) * (9.0 / 16.0) - (a + d) / 16.0,
            (None, Some(d)) => b * (3.0 / 8.0) + c * (3.0 / 4.0) - d / 8.0,
            (Some(a), None) => c * (3.0 / 8.0) + b * (3.0 / 4.0) - a / 8.0,
            (None, None) => (b + c) / 2.0,
        };
        [straight, T::nearest(smooth)]
    }

    /// The tangents whose cubic is nearest to the samples of an interval, by least squares over their components. The
    /// values at the middles between samples have small weights; without them, few samples would not determine the
    /// tangents.
    fn tangents(&self, from: usize, to: usize) -> [DVec4; 2] {
        /// The weight relative to a sample's.
        const STRAIGHT: f64 = 1e-6;
        const MIDDLE: f64 = 1e-2;
        let (times, samples) = (self.times, self.samples);
        let (start, end) = (samples[from].numbers(), samples[to].numbers());
        let straight = end - start;
        let (mut aa, mut ab, mut bb) = (STRAIGHT, 0.0, STRAIGHT);
        let (mut ar, mut br) = (straight * STRAIGHT, straight * STRAIGHT);
        let seconds = times[to] - times[from];
        let part = |i: usize| (times[i] - times[from]) / seconds;
        let mut add = |part: f64, value: DVec4, weight: f64| {
            let [p0, a, p1, b] = hermite(part);
            let rest = (value - start * p0 - end * p1) * weight;
            aa += weight * a * a;
            ab += weight * a * b;
            bb += weight * b * b;
            ar += rest * a;
            br += rest * b;
        };
        for (i, sample) in samples.iter().enumerate().take(to).skip(from) {
            if i > from {
                add(part(i), sample.numbers(), 1.0);
            }
            let middle = f64::midpoint(part(i), part(i + 1));
            add(middle, self.middle(i)[1].numbers(), MIDDLE);
        }
        let determinant = aa * bb - ab * ab;
        [
            (ar * bb - br * ab) / determinant,
            (br * aa - ar * ab) / determinant,
        ]
    }
}
