//! Curves whose intervals depend on their two keys alone: arcs and lines, and cubics with tangents of
//! their own.

use glam::DVec4;

use crate::reduce::value::Value;
use crate::reduce::{ReducedKeys, Task};

/// The search for the longest intervals.
pub(crate) struct Intervals<'a, T> {
    task: &'a Task<'a, T>,
    is_cubic: bool,
}

/// An interval that is near to all samples within it.
struct Found<T> {
    to: usize,
    error: f64,
    /// The tangents at its start and its end, over the whole interval.
    tangents: [T; 2],
}

impl<'a, T: Value> Intervals<'a, T> {
    pub(crate) fn new(task: &'a Task<'a, T>, is_cubic: bool) -> Self {
        Self { task, is_cubic }
    }

    pub(crate) fn keys(&self) -> ReducedKeys<T> {
        let Task { times, samples, .. } = *self.task;
        let last = samples.len() - 1;
        let mut found = ReducedKeys {
            places: vec![0],
            keys: vec![samples[0]],
            ..ReducedKeys::default()
        };
        let mut arriving = T::default();
        while let Some(&from) = found.places.last().filter(|&&from| from < last) {
            let interval = self.longest(from);
            let seconds = times[interval.to] - times[from];
            let [leaving, next] = interval
                .tangents
                .map(|tangent| T::of_numbers(tangent.numbers() / seconds));
            found.tangents.push([arriving, leaving]);
            arriving = next;
            found.error = found.error.max(interval.error);
            found.places.push(interval.to);
            found.keys.push(samples[interval.to]);
        }
        found.tangents.push([arriving, T::default()]);
        if !self.is_cubic {
            found.tangents.clear();
        }
        found
    }

    /// The longest interval from a sample. Its length is doubled until it is too far away, and then
    /// halved down between the two.
    fn longest(&self, from: usize) -> Found<T> {
        let last = self.task.samples.len() - 1;
        // A neighbour is always reached: there is no sample in between.
        let mut best = self.interval(from, from + 1).unwrap_or(Found {
            to: from + 1,
            error: 0.0,
            tangents: [T::default(); 2],
        });
        let mut step = 2;
        let mut refused = last + 1;
        while best.to < last {
            let to = (from + step).min(last);
            match self.interval(from, to) {
                Some(found) => best = found,
                None => {
                    refused = to;
                    break;
                }
            }
            step *= 2;
        }
        while best.to + 1 < refused {
            let middle = usize::midpoint(best.to, refused);
            match self.interval(from, middle) {
                Some(found) => best = found,
                None => refused = middle,
            }
        }
        best
    }

    fn interval(&self, from: usize, to: usize) -> Option<Found<T>> {
        let Task {
            times,
            samples,
            tolerance,
        } = *self.task;
        let (start, end) = (samples[from], samples[to]);
        let part = |place: usize| (times[place] - times[from]) / (times[to] - times[from]);
        let tangents = match self.is_cubic {
            true => self.tangents(from, to),
            false => [DVec4::ZERO; 2],
        };
        let mut error = 0.0f64;
        for (place, &sample) in samples.iter().enumerate().take(to).skip(from + 1) {
            let curve = match self.is_cubic {
                true => {
                    let [a, b, c, d] = hermite(part(place));
                    let numbers =
                        start.numbers() * a + tangents[0] * b + end.numbers() * c + tangents[1] * d;
                    T::nearest(numbers)
                }
                false => start.towards(end, part(place)),
            };
            let apart = sample.apart(curve);
            // What is no number is not near.
            if apart.is_nan() || apart > tolerance {
                return None;
            }
            error = error.max(apart);
        }
        Some(Found {
            to,
            error,
            tangents: tangents.map(T::of_numbers),
        })
    }

    /// The tangents whose cubic is nearest to the samples of an interval, by least squares over their
    /// numbers. A small weight keeps them near the straight line where there are too few samples.
    fn tangents(&self, from: usize, to: usize) -> [DVec4; 2] {
        /// As a part of the weight of a sample.
        const STRAIGHT: f64 = 1e-6;
        let Task { times, samples, .. } = *self.task;
        let (start, end) = (samples[from].numbers(), samples[to].numbers());
        let straight = end - start;
        let (mut aa, mut ab, mut bb) = (STRAIGHT, 0.0, STRAIGHT);
        let (mut ar, mut br) = (straight * STRAIGHT, straight * STRAIGHT);
        for place in from + 1..to {
            let part = (times[place] - times[from]) / (times[to] - times[from]);
            let [p0, a, p1, b] = hermite(part);
            let rest = samples[place].numbers() - start * p0 - end * p1;
            aa += a * a;
            ab += a * b;
            bb += b * b;
            ar += rest * a;
            br += rest * b;
        }
        let determinant = aa * bb - ab * ab;
        [
            (ar * bb - br * ab) / determinant,
            (br * aa - ar * ab) / determinant,
        ]
    }
}

/// The weights of start, start tangent, end and end tangent.
fn hermite(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        2.0 * t3 - 3.0 * t2 + 1.0,
        t3 - 2.0 * t2 + t,
        3.0 * t2 - 2.0 * t3,
        t3 - t2,
    ]
}
