//! Curves of vectors between keys: Hermite cubics and B-splines, as in textbooks.

use glam::DVec3;

use crate::curve::options::Ends;
use crate::reference::segment::{hermite, knots};

/// Keys of a vector in f64, and the method of the textbook curve through them.
#[derive(Debug, Clone)]
pub struct VectorCurve {
    /// `step`, `linear`, `catmull-rom`, `bessel-overhauser`, `gltf-cubic`, `c2` or `b-spline`.
    pub method: &'static str,
    /// The curve at the ends; clamped ends are at rest.
    pub ends: Ends,
    /// The key times in seconds.
    pub times: Vec<f64>,
    /// A vector for each time.
    pub keys: Vec<DVec3>,
    /// The incoming and outgoing tangent of each key, units per second; 0 for a key that has none.
    pub tangents: Vec<[DVec3; 2]>,
}

impl VectorCurve {
    /// The vector at a time in seconds. Before the first key and after the last it is the value there.
    #[must_use]
    pub fn value(&self, time: f64) -> DVec3 {
        let last = self.keys.len() - 1;
        if last == 0 {
            return self.keys[0];
        }
        // The end times themselves have the end values.
        if time >= self.times[last] {
            return match self.method {
                "b-spline" if !self.is_frozen(last - 1) => self.interval(last - 1)(1.0)[0],
                _ => self.keys[last],
            };
        }
        if time <= self.times[0] {
            return self.interval(0)(0.0)[0];
        }
        let i = self.times.partition_point(|&key| key <= time) - 1;
        self.interval(i)((time - self.times[i]) / self.step(i))[0]
    }

    /// The velocity and the acceleration at a time, per second: at a key those of the interval after it, at the last
    /// key those of the last interval. They are 0 where a value is held.
    #[must_use]
    pub fn derivatives(&self, time: f64) -> [DVec3; 2] {
        let last = self.keys.len() - 1;
        if last == 0 || time < self.times[0] || time > self.times[last] {
            return [DVec3::ZERO; 2];
        }
        let i = (self.times.partition_point(|&key| key <= time) - 1).min(last - 1);
        let h = self.step(i);
        let [_, by_parameter, twice] = self.interval(i)((time - self.times[i]) / h);
        [by_parameter / h, twice / (h * h)]
    }

    /// The time from key `i` to the next in seconds.
    fn step(&self, i: usize) -> f64 {
        self.times[i + 1] - self.times[i]
    }

    /// The difference from key `i` to the next.
    fn rise(&self, i: usize) -> DVec3 {
        self.keys[i + 1] - self.keys[i]
    }

    /// Whether an interval has the constant value of its first key.
    fn is_frozen(&self, i: usize) -> bool {
        let last = self.keys.len() - 1;
        let has_ends = !matches!(self.method, "step" | "linear" | "gltf-cubic");
        has_ends && self.ends == Ends::Frozen && last > 1 && (i == 0 || i + 1 == last)
    }

    /// The curve of interval `i`: its value and its first and second derivative by a parameter from 0 to 1.
    pub(crate) fn interval(&self, i: usize) -> Box<dyn Fn(f64) -> [DVec3; 3] + '_> {
        let last = self.keys.len() - 1;
        let (p0, p1, h) = (self.keys[i], self.keys[i + 1], self.step(i));
        if self.method == "step" || self.is_frozen(i) {
            return Box::new(move |_| [p0, DVec3::ZERO, DVec3::ZERO]);
        }
        let (m0, m1) = match self.method {
            "gltf-cubic" => {
                let tangent = |key: usize, side: usize| match self.tangents.get(key) {
                    Some(both) => both[side] * h,
                    None => DVec3::ZERO,
                };
                (tangent(i, 1), tangent(i + 1, 0))
            }
            _ if self.method == "linear" || last == 1 => (p1 - p0, p1 - p0),
            "b-spline" => return self.b_spline(i),
            "c2" => {
                let slopes = self.c2_slopes();
                (slopes[i] * h, slopes[i + 1] * h)
            }
            _ => self.tangents_of(i),
        };
        Box::new(move |t| {
            let [from, out, to, incoming] = hermite(t);
            let t2 = t * t;
            [
                p0 * from + m0 * out + p1 * to + m1 * incoming,
                (p1 - p0) * (6.0 * t - 6.0 * t2)
                    + m0 * (3.0 * t2 - 4.0 * t + 1.0)
                    + m1 * (3.0 * t2 - 2.0 * t),
                (p1 - p0) * (6.0 - 12.0 * t) + m0 * (6.0 * t - 4.0) + m1 * (6.0 * t - 2.0),
            ]
        })
    }

    /// The slopes at all keys, per second, with which the second derivative is continuous: a full system of
    /// equations, solved by Gaussian elimination with pivoting.
    fn c2_slopes(&self) -> Vec<DVec3> {
        let keys = self.keys.len();
        let last = keys - 1;
        let h = |i: usize| self.step(i);
        let secant = |i: usize| self.rise(i) / h(i);
        let mut rows = vec![(vec![0.0; keys], DVec3::ZERO); keys];
        let mut inner = |row: usize, at: [usize; 3], l: usize, r: usize| {
            let (coefficients, side) = &mut rows[row];
            coefficients[at[0]] += 1.0 / h(l);
            coefficients[at[1]] += 2.0 / h(l) + 2.0 / h(r);
            coefficients[at[2]] += 1.0 / h(r);
            *side = 3.0 * (secant(l) / h(l) + secant(r) / h(r));
        };
        for i in 1..last {
            inner(i, [i - 1, i, i + 1], i - 1, i);
        }
        if self.ends == Ends::Loop {
            inner(0, [last - 1, 0, 1], last - 1, 0);
            rows[last].0[last] = 1.0;
            rows[last].0[0] = -1.0;
        } else {
            for (row, other, i) in [(0, 1, 0), (last, last - 1, last - 1)] {
                let (diagonal, next, side) = match self.ends {
                    Ends::Natural => (2.0, 1.0, 3.0 * secant(i)),
                    Ends::Secant => (1.0, 0.0, secant(i)),
                    Ends::Clamped { .. } => (1.0, 0.0, DVec3::ZERO),
                    _ => (1.0, 1.0, 2.0 * secant(i)),
                };
                rows[row].0[row] = diagonal;
                rows[row].0[other] = next;
                rows[row].1 = side;
            }
        }
        for column in 0..keys {
            let size = |row: &usize| rows[*row].0[column].abs();
            let pivot = (column..keys).max_by(|a, b| size(a).total_cmp(&size(b)));
            rows.swap(column, pivot.unwrap_or(column));
            let (pivot_row, side) = rows[column].clone();
            for (row, (coefficients, other)) in rows.iter_mut().enumerate() {
                if row != column {
                    let factor = coefficients[column] / pivot_row[column];
                    for (to, from) in coefficients.iter_mut().zip(&pivot_row) {
                        *to -= factor * from;
                    }
                    *other -= side * factor;
                }
            }
        }
        let solved =
            |(i, (coefficients, side)): (usize, &(Vec<f64>, DVec3))| *side / coefficients[i];
        rows.iter().enumerate().map(solved).collect()
    }

    /// Interval `i` of the cubic B-spline whose control points are the keys, by the recursion of Cox and de Boor,
    /// with one more control point outside each end. It is not called for frozen ends, or for two keys.
    fn b_spline(&self, i: usize) -> Box<dyn Fn(f64) -> [DVec3; 3] + '_> {
        let count = self.keys.len() - 1;
        // The knots from three before the interval to two after its end, in its parameter.
        let knots_of = |i: usize| {
            let knots = knots(&self.times, self.ends, i);
            knots.map(|knot| (knot - knots[2]) / self.step(i))
        };
        let outer_point = |at_end: bool| -> DVec3 {
            let [outer, inner, next] = [0, 1, 2].map(|j| if at_end { count - j } else { j });
            let [interval, second] = [0, 1].map(|j| if at_end { count - 1 - j } else { j });
            let [p, q, r] = [outer, inner, next].map(|key| self.keys[key]);
            if self.ends == Ends::Parabolic {
                // The parabola through the last three keys, continued by the length of the last interval.
                let (a, b) = (self.step(interval), self.step(second));
                let (x, y, z) = (0.0, a, a + b);
                let at = -a;
                return p * ((at - y) * (at - z) / ((x - y) * (x - z)))
                    + q * ((at - x) * (at - z) / ((y - x) * (y - z)))
                    + r * ((at - x) * (at - y) / ((z - x) * (z - y)));
            }
            // The end condition is linear in the outer point, so two evaluations solve it.
            let knots = knots_of(interval);
            let off = |candidate: DVec3| {
                let [_, slope, bend] = match at_end {
                    false => de_boor(&knots, [candidate, p, q, r], 0.0),
                    true => de_boor(&knots, [r, q, p, candidate], 1.0),
                };
                match self.ends {
                    Ends::Natural => bend,
                    Ends::Secant => slope - self.rise(interval),
                    _ => slope,
                }
            };
            let (zero, one) = (off(DVec3::ZERO), off(DVec3::ONE));
            -zero / (one - zero)
        };
        // Counted from the point before the first key.
        let point = |j: usize| match j {
            _ if self.ends == Ends::Loop => self.keys[(j + count - 1) % count],
            0 => outer_point(false),
            j if j > count + 1 => outer_point(true),
            j => self.keys[j - 1],
        };
        let points = [0, 1, 2, 3].map(|offset| point(i + offset));
        let knots = knots_of(i);
        Box::new(move |t| de_boor(&knots, points, t))
    }

    /// The tangents at both keys of interval `i`, per unit of its parameter.
    fn tangents_of(&self, i: usize) -> (DVec3, DVec3) {
        let last = self.keys.len() - 1;
        let at_key = |key: usize| -> Option<DVec3> {
            let (before, after) = match key % last {
                0 if self.ends != Ends::Loop => return None,
                0 => (last - 1, 0),
                key => (key - 1, key),
            };
            let (left, right) = (self.rise(before), self.rise(after));
            let (l, r) = (self.step(before), self.step(after));
            Some(if self.method == "catmull-rom" {
                (left + right) / 2.0
            } else {
                // The slope of the parabola through three keys.
                (left / l * r + right / r * l) / (l + r) * self.step(i)
            })
        };
        let whole = self.rise(i);
        let end = |other: DVec3| match self.ends {
            Ends::Natural => (3.0 * whole - other) / 2.0,
            Ends::Clamped { .. } => DVec3::ZERO,
            Ends::Secant => whole,
            _ => 2.0 * whole - other,
        };
        match (at_key(i), at_key(i + 1)) {
            (Some(m0), Some(m1)) => (m0, m1),
            (None, Some(m1)) => (end(m1), m1),
            (Some(m0), None) => (m0, end(m0)),
            (None, None) => (whole, whole),
        }
    }
}

/// A cubic B-spline between the third and the fourth of six knots: its value and its first and
/// second derivative (de Boor 1972).
fn de_boor(knots: &[f64], points: [DVec3; 4], t: f64) -> [DVec3; 3] {
    // Slopes are a spline of lower degree, whose points are the differences over the knots.
    let derived = |points: &[DVec3], degree: usize| -> Vec<DVec3> {
        (1..points.len())
            .map(|j| {
                let from = j + 2 - degree;
                (points[j] - points[j - 1]) * degree as f64 / (knots[from + degree] - knots[from])
            })
            .collect()
    };
    let value = |points: &[DVec3], degree: usize| -> DVec3 {
        let mut points = points.to_vec();
        for round in 1..=degree {
            for j in (round..=degree).rev() {
                let from = j + 2 - degree;
                let (low, high) = (knots[from], knots[from + degree + 1 - round]);
                let part = (t - low) / (high - low);
                points[j] = points[j - 1] * (1.0 - part) + points[j] * part;
            }
        }
        points[degree]
    };
    let slopes = derived(&points, 3);
    let bends = derived(&slopes, 2);
    [value(&points, 3), value(&slopes, 2), value(&bends, 1)]
}
