//! The spline with continuous angular acceleration: between keys a cubic in the
//! rotation vector, its velocities at the keys found by Newton's iteration on accelerations that are
//! taken of the curve itself.

use glam::{DMat3, DQuat, DVec3};

use crate::curve::options::Ends;
use crate::reference::curve::Definition;
use crate::reference::given::smooth;
use crate::reference::quaternion::{exponential, from_parts, invert, logarithm, multiply, vector};
use crate::reference::segment::Segment;
use crate::reference::track::Track;

/// Cubic rotation vectors with continuous angular acceleration.
pub(crate) const C2: Definition = Definition::new(|track, ends| {
    let velocities = velocities(track, ends);
    smooth(track, ends, |i| Segment::RotationVector {
        base: track.keys[i],
        powers: Interval::new(track, i).cubic(&velocities, i).powers,
    })
});

/// Copies of a closed track are joined until there are so many keys on either side of it.
const AROUND: usize = 48;

/// The angular velocities at the keys (rad/s, body frame) that make the angular acceleration
/// continuous.
fn velocities(track: &Track, ends: Ends) -> Vec<DVec3> {
    let last = track.last();
    if last < 2 {
        // Two keys are joined by an arc, and one has no curve.
        return vec![DVec3::ZERO; last + 1];
    }
    let closed = ends == Ends::Loop;
    let copies = if closed { AROUND.div_ceil(last) } else { 0 };
    let intervals: Vec<Interval> = (0..last * (2 * copies + 1))
        .map(|i| Interval::new(track, i % last))
        .collect();
    let secant = |i: usize| intervals[i].whole * 2.0 / intervals[i].duration;
    let parabola = |end: usize, next: usize| {
        let (h, next_h) = (intervals[end].duration, intervals[next].duration);
        let inner = (secant(next) * h + secant(end) * next_h) / (h + next_h);
        2.0 * secant(end) - inner
    };
    let final_interval = intervals.len() - 1;
    let both = match ends {
        Ends::Clamped { start, end } => [Some(start), Some(end)],
        Ends::Parabolic | Ends::Frozen => [
            Some(parabola(0, 1)),
            Some(parabola(final_interval, final_interval - 1)),
        ],
        Ends::Natural => [None; 2],
        Ends::Secant | Ends::Loop => [Some(secant(0)), Some(secant(final_interval))],
    };
    let solved = System::new(&intervals, both).solve();
    solved[last * copies..=last * (copies + 1)].to_vec()
}

/// For every key three equations: the angular acceleration is the same on both sides of it. They are
/// linear in the velocities of the neighbouring keys, and quadratic in its own.
struct System<'a> {
    intervals: &'a [Interval],
    /// The velocities at the first and at the last key, if they are not free.
    ends: [Option<DVec3>; 2],
    /// How the equations depend on the neighbours' velocities.
    beside: Vec<[DMat3; 2]>,
}

/// Newton's steps from the solution of the linear part; then for each part of the rest, and for all.
const DIRECT: usize = 16;
const EACH_PART: usize = 8;
const ALL_PARTS: usize = 128;

impl<'a> System<'a> {
    fn new(intervals: &'a [Interval], ends: [Option<DVec3>; 2]) -> Self {
        let mut system = Self {
            intervals,
            ends,
            beside: Vec::new(),
        };
        let (zero, axes) = ([DVec3::ZERO; 3], [DVec3::X, DVec3::Y, DVec3::Z]);
        let slopes = |key: usize| {
            let still = system.excess(key, zero, 0.0);
            [0, 2].map(|side: usize| {
                let [x, y, z] = axes.map(|axis| {
                    let mut moved = zero;
                    moved[side] = axis;
                    system.excess(key, moved, 0.0) - still
                });
                DMat3::from_cols(x, y, z)
            })
        };
        system.beside = (0..=intervals.len()).map(slopes).collect();
        system
    }

    /// By how much the acceleration is larger before a key than behind it, as a change of its velocity;
    /// given the velocities at the key before it, at it and behind it, and the part of what is not
    /// linear that counts.
    fn excess(&self, key: usize, [before, own, after]: [DVec3; 3], part: f64) -> DVec3 {
        let last = self.intervals.len();
        let fixed = match key {
            0 => self.ends[0],
            _ if key == last => self.ends[1],
            _ => None,
        };
        if let Some(velocity) = fixed {
            return own - velocity;
        }
        let (mut excess, mut stiffness) = (DVec3::ZERO, 0.0);
        if key > 0 {
            let interval = &self.intervals[key - 1];
            let h = interval.duration;
            let cubic = interval.cubic_between(before, own);
            excess += cubic.acceleration(1.0, part) / (h * h);
            stiffness += 4.0 / h;
        }
        if key < last {
            let interval = &self.intervals[key];
            let h = interval.duration;
            let cubic = interval.cubic_between(own, after);
            excess -= cubic.acceleration(0.0, 1.0) / (h * h);
            stiffness += 4.0 / h;
        }
        excess / stiffness
    }

    /// The three velocities that the equations of a key have.
    fn around(velocities: &[DVec3], key: usize) -> [DVec3; 3] {
        let at = |key: usize| velocities.get(key).copied().unwrap_or_default();
        [at(key.wrapping_sub(1)), at(key), at(key + 1)]
    }

    /// Where the equations have no solution, what is not linear is left out behind steps of more than
    /// half a turn, else everywhere.
    fn solve(&self) -> Vec<DVec3> {
        let keys = self.intervals.len() + 1;
        let start = vec![DVec3::ZERO; keys];
        let none = vec![0.0; keys];
        let Some(linear) = self.step(&start, &none, &vec![1.0; keys]) else {
            return start;
        };
        let secant = |i: usize| {
            let interval = self.intervals.get(i);
            interval.map_or(0.0, |own| 2.0 * own.whole.length() / own.duration)
        };
        let sizes: Vec<f64> = (0..keys)
            .map(|key| secant(key.wrapping_sub(1)) + secant(key) + linear[key].length() + 1e-200)
            .collect();
        let is_long = |key: usize| {
            key > 0 && self.intervals[key - 1].whole.length() > std::f64::consts::FRAC_PI_2
        };
        let short: Vec<f64> = (0..keys).map(|key| f64::from(!is_long(key))).collect();
        let found = self.with_bends(&linear, &vec![1.0; keys], &sizes);
        let found = found.or_else(|| self.with_bends(&linear, &short, &sizes));
        found.unwrap_or(linear)
    }

    /// At once, else in parts that are halved where one fails.
    fn with_bends(&self, linear: &[DVec3], bends: &[f64], sizes: &[f64]) -> Option<Vec<DVec3>> {
        if let (Some(found), _) = self.newton(linear, bends, sizes, DIRECT) {
            return Some(found);
        }
        let (mut part, mut more, mut taken) = (0.0, 0.25, 0);
        let mut velocities = linear.to_vec();
        while taken < ALL_PARTS && more >= 1.0 / 256.0 {
            let next = f64::min(part + more, 1.0);
            let some: Vec<f64> = bends.iter().map(|bend| bend * next).collect();
            let (found, steps) = self.newton(&velocities, &some, sizes, EACH_PART);
            taken += steps;
            match found {
                Some(found) if next >= 1.0 => return Some(found),
                Some(found) => (velocities, part, more) = (found, next, 2.0 * more),
                None => more /= 2.0,
            }
        }
        None
    }

    fn excesses(&self, velocities: &[DVec3], bends: &[f64]) -> Vec<DVec3> {
        (0..velocities.len())
            .map(|key| self.excess(key, Self::around(velocities, key), bends[key]))
            .collect()
    }

    /// One whole step of Newton's.
    fn step(&self, velocities: &[DVec3], bends: &[f64], sizes: &[f64]) -> Option<Vec<DVec3>> {
        let keys = velocities.len();
        let mut band = Band::new(3 * keys);
        for key in 0..keys {
            let own = self.own_slope(key, Self::around(velocities, key), bends[key], sizes[key]);
            let [before, after] = self.beside[key];
            for (block, at) in [(before, key.wrapping_sub(1)), (own, key), (after, key + 1)] {
                if at < keys {
                    for (row, column) in (0..9).map(|i| (i / 3, i % 3)) {
                        band.set(3 * key + row, 3 * at + column, block.col(column)[row]);
                    }
                }
            }
        }
        let off = self.excesses(velocities, bends);
        let steps = band.solve(off.iter().flat_map(DVec3::to_array).collect())?;
        let steps = steps.chunks(3).map(DVec3::from_slice);
        Some(
            velocities
                .iter()
                .zip(steps)
                .map(|(own, step)| *own - step)
                .collect(),
        )
    }

    /// Newton's iteration, whose steps are halved until they help; and how many there were.
    fn newton(
        &self,
        from: &[DVec3],
        bends: &[f64],
        sizes: &[f64],
        most: usize,
    ) -> (Option<Vec<DVec3>>, usize) {
        let off = |velocities: &[DVec3]| -> f64 {
            let all = self.excesses(velocities, bends);
            let relative = all.iter().zip(sizes).map(|(own, size)| *own / *size);
            relative.map(DVec3::length_squared).sum()
        };
        let mut velocities = from.to_vec();
        for taken in 1..=most {
            let Some(whole) = self.step(&velocities, bends, sizes) else {
                return (None, taken);
            };
            let before = off(&velocities);
            let mut damping = 1.0;
            let next: Vec<DVec3> = loop {
                let both = velocities.iter().zip(&whole);
                let next: Vec<DVec3> = both.map(|(own, to)| own.lerp(*to, damping)).collect();
                let now = off(&next);
                if now <= (1.0 - damping / 2.0) * before || now <= 1e-24 * next.len() as f64 {
                    break next;
                }
                damping /= 2.0;
                if damping < 1.0 / 64.0 {
                    return (None, taken);
                }
            };
            let moved = velocities.iter().zip(&next).zip(sizes);
            let largest = moved.map(|((own, next), size)| (*next - *own).length() / size);
            let largest = largest.fold(0.0, f64::max);
            velocities = next;
            if damping >= 1.0 && largest <= 1e-8 {
                return (Some(velocities), taken);
            }
        }
        (None, most)
    }

    /// How the equations depend on the key's own velocity: of a quadratic function central differences
    /// are the derivative.
    fn own_slope(&self, key: usize, around: [DVec3; 3], bend: f64, size: f64) -> DMat3 {
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
            let at = |sign: f64| {
                let own = around[1] + axis * (sign * size);
                self.excess(key, [around[0], own, around[2]], bend)
            };
            (at(1.0) - at(-1.0)) / (2.0 * size)
        });
        DMat3::from_cols(x, y, z)
    }
}

/// A matrix with five diagonals below the main one and five above it, and room for what exchanging rows
/// fills.
struct Band {
    rows: Vec<[f64; 16]>,
}

impl Band {
    fn new(size: usize) -> Self {
        Self {
            rows: vec![[0.0; 16]; size],
        }
    }

    fn get(&self, row: usize, column: usize) -> f64 {
        self.rows[row][column + 5 - row]
    }

    fn set(&mut self, row: usize, column: usize, value: f64) {
        self.rows[row][column + 5 - row] = value;
    }

    /// Gauss' elimination with exchange of rows; none where the matrix is singular.
    fn solve(mut self, mut sides: Vec<f64>) -> Option<Vec<f64>> {
        let size = sides.len();
        for pivot in 0..size {
            let below = pivot..size.min(pivot + 6);
            let columns = pivot..size.min(pivot + 11);
            let largest = |a: &usize, b: &usize| {
                let [a, b] = [*a, *b].map(|row| self.get(row, pivot).abs());
                a.total_cmp(&b)
            };
            let best = below.clone().max_by(largest)?;
            if best != pivot {
                for column in columns.clone() {
                    let (one, other) = (self.get(pivot, column), self.get(best, column));
                    self.set(pivot, column, other);
                    self.set(best, column, one);
                }
                sides.swap(pivot, best);
            }
            let divisor = self.get(pivot, pivot);
            if divisor == 0.0 || !divisor.is_finite() {
                return None;
            }
            for row in pivot + 1..below.end {
                let factor = self.get(row, pivot) / divisor;
                if factor != 0.0 {
                    for column in columns.clone() {
                        let value = self.get(row, column) - factor * self.get(pivot, column);
                        self.set(row, column, value);
                    }
                    sides[row] -= factor * sides[pivot];
                }
            }
        }
        for row in (0..size).rev() {
            for column in row + 1..size.min(row + 11) {
                sides[row] -= self.get(row, column) * sides[column];
            }
            sides[row] /= self.get(row, row);
        }
        Some(sides)
    }
}

/// The constants of an interval, which do not depend on the velocities.
struct Interval {
    /// Half of the rotation vector from its first key to its last.
    whole: DVec3,
    /// From the angular velocity at the last key to that vector's rate of change.
    to_rate: DMat3,
    duration: f64,
}

impl Interval {
    fn new(track: &Track, i: usize) -> Self {
        let whole = logarithm(track.difference(i));
        Self {
            whole,
            to_rate: rates(whole).inverse(),
            duration: track.step(i),
        }
    }

    fn cubic(&self, velocities: &[DVec3], i: usize) -> Cubic {
        self.cubic_between(velocities[i], velocities[i + 1])
    }

    fn cubic_between(&self, from: DVec3, to: DVec3) -> Cubic {
        let half = self.duration / 2.0;
        let start = from * half;
        let end = self.to_rate * (to * half);
        Cubic {
            powers: [
                start,
                3.0 * self.whole - 2.0 * start - end,
                start + end - 2.0 * self.whole,
            ],
        }
    }
}

/// Half of a rotation vector as a cubic in `t`.
struct Cubic {
    powers: [DVec3; 3],
}

impl Cubic {
    /// Twice `vec(e⁻¹ e'')` for the exponential `e` of the cubic, with that part of what is not linear in
    /// the velocities.
    fn acceleration(&self, t: f64, part: f64) -> DVec3 {
        let [a, b, c] = self.powers;
        let v = a * t + b * (t * t) + c * (t * t * t);
        let v1 = a + b * (2.0 * t) + c * (3.0 * t * t);
        let v2 = 2.0 * b + c * (6.0 * t);
        let linear = 2.0 * (rates(v) * v2);
        if part == 0.0 {
            return linear;
        }
        // e = [C; S v], with C and S functions of z = v·v.
        let (s, k, slope) = waves(v.dot(v));
        let (z1, z2) = (2.0 * v.dot(v1), 2.0 * (v1.dot(v1) + v.dot(v2)));
        // S' = k/2, C' = -S/2.
        let (s1, s2) = (0.5 * k * z1, 0.5 * (k * z2 + slope * z1 * z1));
        let c2 = -0.5 * (s * z2 + 0.5 * k * z1 * z1);
        let second = from_parts(c2, v * s2 + v1 * (2.0 * s1) + v2 * s);
        let whole = 2.0 * vector(multiply(invert(exponential(v)), second));
        if part == 1.0 {
            return whole;
        }
        linear + (whole - linear) * part
    }
}

/// With `z = x²`: `S = sin(x)/x`, `k = (cos(x) - S)/z`, and the derivative of `k` by `z`.
fn waves(z: f64) -> (f64, f64, f64) {
    let x = z.sqrt();
    if x < 0.1 {
        let s = 1.0 - z / 6.0 + z * z / 120.0 - z * z * z / 5040.0;
        let k = -1.0 / 3.0 + z / 30.0 - z * z / 840.0 + z * z * z / 45_360.0;
        let slope = 1.0 / 30.0 - z / 420.0 + z * z / 15_120.0;
        return (s, k, slope);
    }
    let s = x.sin() / x;
    let k = (x.cos() - s) / z;
    (s, k, -(s + 3.0 * k) / (2.0 * z))
}

/// From the rate of change of half a rotation vector to half of the angular velocity in
/// the body frame: a column for each axis.
fn rates(v: DVec3) -> DMat3 {
    let (s, k, _) = waves(v.dot(v));
    let column = |axis: DVec3| {
        let along = v.dot(axis);
        let slope: DQuat = from_parts(-s * along, v * (k * along) + axis * s);
        vector(multiply(invert(exponential(v)), slope))
    };
    DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
}
