//! Curves whose intervals depend on their two keys alone: arcs and lines, and cubics with tangents of
//! their own.

use glam::DVec4;

use crate::reduce::value::Value;
use crate::reduce::{ReducedKeys, Task};

/// The places of the keys of intervals that are as long as possible: the farthest sample from each key
/// that `fits` lets an interval reach. Its length is doubled until it does not, and then halved down
/// between the two, so that each sample is looked at about `log n` times. A neighbour is always
/// reached: there is no sample in between.
pub(crate) fn longest(samples: usize, fits: impl Fn(usize, usize) -> bool) -> Vec<usize> {
    let last = samples - 1;
    let mut places = vec![0];
    while let Some(&from) = places.last().filter(|&&from| from < last) {
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
        places.push(reached);
    }
    places
}

impl<T: Value> Task<'_, T> {
    /// Whether all samples within an interval are near.
    pub(crate) fn fits(&self, from: usize, to: usize, is_cubic: bool) -> bool {
        self.error(from, to, is_cubic)
            .is_some_and(|error| error <= self.tolerance)
    }

    /// The keys at some places, with the tangents of cubics.
    pub(crate) fn keys_at(&self, places: &[usize], is_cubic: bool) -> ReducedKeys<T> {
        let mut found = ReducedKeys {
            keys: places.iter().map(|&place| self.samples[place]).collect(),
            ..ReducedKeys::default()
        };
        let mut arriving = T::default();
        for pair in places.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let error = self.interval(from, to, is_cubic, f64::INFINITY);
            found.error = found.error.max(error.unwrap_or(f64::INFINITY));
            if is_cubic {
                let seconds = self.times[to] - self.times[from];
                let tangents = self.tangents(from, to);
                let [leaving, next] = tangents.map(|own| T::of_numbers(own / seconds));
                found.tangents.push([arriving, leaving]);
                arriving = next;
            }
        }
        if is_cubic {
            found.tangents.push([arriving, T::default()]);
        }
        found.places = places.to_vec();
        found
    }

    fn error(&self, from: usize, to: usize, is_cubic: bool) -> Option<f64> {
        self.interval(from, to, is_cubic, self.tolerance)
    }

    /// The largest distance of the samples within an interval; nothing where it is over `most`.
    fn interval(&self, from: usize, to: usize, is_cubic: bool, most: f64) -> Option<f64> {
        let (times, samples) = (self.times, self.samples);
        let (start, end) = (samples[from], samples[to]);
        let part = |place: usize| (times[place] - times[from]) / (times[to] - times[from]);
        let tangents = match is_cubic {
            true => self.tangents(from, to),
            false => [DVec4::ZERO; 2],
        };
        let mut error = 0.0f64;
        for (place, &sample) in samples.iter().enumerate().take(to).skip(from + 1) {
            let curve = match is_cubic {
                true => {
                    let [a, b, c, d] = hermite(part(place));
                    let ends = start.numbers() * a + end.numbers() * c;
                    T::nearest(ends + tangents[0] * b + tangents[1] * d)
                }
                false => start.towards(end, part(place)),
            };
            let apart = sample.apart(curve);
            // What is no number is not near.
            if apart.is_nan() || apart > most {
                return None;
            }
            error = error.max(apart);
        }
        Some(error)
    }

    /// The tangents whose cubic is nearest to the samples of an interval, by least squares over their
    /// numbers. A small weight keeps them near the straight line where there are too few samples.
    fn tangents(&self, from: usize, to: usize) -> [DVec4; 2] {
        /// As a part of the weight of a sample.
        const STRAIGHT: f64 = 1e-6;
        let (times, samples) = (self.times, self.samples);
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
