//! Lengths along a path, for bodies with a specified speed, and for looking ahead.

use crate::math::quadrature::{gauss, integral};
use crate::path::polynomial::Polynomial;
use crate::threads::stop;

/// Lengths along the intervals of a path.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lengths {
    /// For each interval, increasing parameters, each with the length from the path's start to it.
    marks: Vec<Vec<(f64, f64)>>,
    /// The slopes of each interval's curve.
    slopes: Vec<Polynomial>,
}

/// The number of marks of each interval; there is another one where the curve stops.
const PARTS: usize = 8;

/// The maximum number of halvings of a quadrature.
const MAX_HALVINGS: u32 = 24;

impl Lengths {
    /// The lengths of curves with these slopes, which are zero at the parameters `stops`; their speed has a corner
    /// there.
    pub(crate) fn new<'a>(slopes: Vec<Polynomial>, stops: impl Iterator<Item = &'a [f64]>) -> Self {
        let mut lengths = Self {
            marks: Vec::with_capacity(slopes.len()),
            slopes,
        };
        let mut total = 0.0;
        for (slope, stops) in lengths.slopes.iter().zip(stops) {
            let even = (1..=PARTS).map(|part| part as f64 / PARTS as f64);
            let mut ends: Vec<f64> = even.chain(stops.iter().copied()).collect();
            ends.sort_by(f64::total_cmp);
            let mut marks = vec![(0.0, total)];
            if stop::is_stopped() {
                // The work was stopped; the caller notices it after this function has returned.
                marks.push((1.0, total));
                lengths.marks.push(marks);
                continue;
            }
            let mut from = 0.0;
            for to in ends {
                if to > from {
                    total += between(slope, from, to);
                    marks.push((to, total));
                    from = to;
                }
            }
            lengths.marks.push(marks);
        }
        lengths
    }

    /// Whether there are no intervals, or their lengths were not computed yet.
    pub(crate) fn is_empty(&self) -> bool {
        self.marks.is_empty()
    }

    /// The length of the whole path.
    pub(crate) fn total(&self) -> f64 {
        self.marks
            .last()
            .map_or(0.0, |marks| marks[marks.len() - 1].1)
    }

    /// The lengths at an interval's start and end.
    pub(crate) fn of(&self, interval: usize) -> [f64; 2] {
        let marks = &self.marks[interval];
        [marks[0].1, marks[marks.len() - 1].1]
    }

    /// The length up to a parameter of an interval.
    pub(crate) fn at(&self, interval: usize, t: f64) -> f64 {
        let marks = &self.marks[interval];
        let after = marks.partition_point(|mark| mark.0 <= t).max(1);
        let (from, length) = marks[after - 1];
        length + between(&self.slopes[interval], from, t)
    }

    /// The interval in which a length is reached; for larger lengths the last one that has a length.
    pub(crate) fn interval(&self, length: f64) -> usize {
        let after = self.marks.partition_point(|marks| marks[0].1 <= length);
        let mut interval = after.saturating_sub(1);
        while interval > 0 && self.of(interval)[0] == self.of(interval)[1] {
            interval -= 1;
        }
        interval
    }

    /// The parameter of an interval at which a length is reached, by Newton's method, or by bisection if Newton's
    /// method leaves the part that contains it.
    pub(crate) fn parameter(&self, interval: usize, length: f64) -> f64 {
        let marks = &self.marks[interval];
        let after = marks.partition_point(|mark| mark.1 <= length);
        if after == 0 || after == marks.len() {
            return if after == 0 { 0.0 } else { 1.0 };
        }
        let (from, before) = marks[after - 1];
        let (to, end) = marks[after];
        let slope = &self.slopes[interval];
        let (mut low, mut high) = (from, to);
        let mut t = from + (to - from) * ((length - before) / (end - before));
        let mut excess = before + between(slope, from, t) - length;
        for _ in 0..60 {
            if excess.abs() <= 2.0 * f64::EPSILON * length.max(end) {
                break;
            }
            if excess > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let newton = t - excess / slope.at(t).length().max(1e-300);
            let inside = newton > low && newton < high;
            let next = if inside { newton } else { 0.5 * (low + high) };
            let step = next - t;
            if step.abs() <= 1e-14 {
                return next;
            }
            excess += if step.abs() < 1e-3 * (to - from) {
                // One quadrature is exact enough for a short step.
                gauss(&speed(slope), t, next)
            } else if step > 0.0 {
                between(slope, t, next)
            } else {
                -between(slope, next, t)
            };
            t = next;
        }
        t
    }
}

fn between(slope: &Polynomial, from: f64, to: f64) -> f64 {
    let tolerance = 1e-14 * slope.size();
    // If numbers overflow, the sum is NaN. Then halving would never end.
    let differ = |whole: f64, sum: f64| (sum - whole).abs() > tolerance;
    integral(&speed(slope), from, to, MAX_HALVINGS, &differ)
}

fn speed(slope: &Polynomial) -> impl Fn(f64) -> f64 {
    move |t| slope.at(t).length()
}
