//! The spline with continuous angular acceleration. Between keys, the rotation vector is a cubic; the velocities at
//! the keys are found by Newton's iteration on accelerations of the curve itself.

use glam::{DMat3, DVec3};

use crate::curve::options::Ends;
use crate::reference::curve::Definition;
use crate::reference::quaternion::logarithm;
use crate::reference::rotation_vector::{acceleration, velocity_matrix};
use crate::reference::segment::Segment;
use crate::reference::track::ReferenceTrack;
use crate::reference::two_keys::smooth;

/// Cubic rotation vectors with continuous angular acceleration.
pub(crate) const C2: Definition = Definition::new("c2", |track, ends| {
    let velocities = velocities(track, ends);
    smooth(track, ends, |i| Segment::RotationVector {
        base: track.keys[i],
        powers: C2Interval::new(track, i).cubic(&velocities, i).powers,
    })
});

/// The number of keys that the copies of a closed track must have on each side.
const KEYS_AROUND: usize = 48;

/// The angular velocities at the keys (rad/s, body frame) that make the angular acceleration
/// continuous.
fn velocities(track: &ReferenceTrack, ends: Ends) -> Vec<DVec3> {
    let last = track.last();
    if last < 2 {
        // Two keys are joined by an arc, and one has no curve.
        return vec![DVec3::ZERO; last + 1];
    }
    let is_closed = ends == Ends::Loop;
    let copies = if is_closed {
        KEYS_AROUND.div_ceil(last)
    } else {
        0
    };
    let intervals: Vec<C2Interval> = (0..last * (2 * copies + 1))
        .map(|i| C2Interval::new(track, i % last))
        .collect();
    let secant = |i: usize| intervals[i].whole * 2.0 / intervals[i].duration;
    let parabola = |end: usize, next: usize| {
        let (h, next_h) = (intervals[end].duration, intervals[next].duration);
        let inner = (secant(next) * h + secant(end) * next_h) / (h + next_h);
        2.0 * secant(end) - inner
    };
    let final_interval = intervals.len() - 1;
    let at_ends = match ends {
        Ends::Clamped { start, end } => [Some(start), Some(end)],
        Ends::Parabolic | Ends::Frozen => [
            Some(parabola(0, 1)),
            Some(parabola(final_interval, final_interval - 1)),
        ],
        Ends::Natural => [None; 2],
        Ends::Secant | Ends::Loop => [Some(secant(0)), Some(secant(final_interval))],
    };
    let solved = System::new(&intervals, at_ends).solve();
    solved[last * copies..=last * (copies + 1)].to_vec()
}

/// Three equations for every key: the angular acceleration is the same on both sides of it. They are linear in the
/// velocities of the neighbouring keys, and quadratic in the key's velocity.
///
/// The quadratic part, the bend, is used if it is not too strong ([`System::strength`]). The bends are increased from
/// zero, where the equations are linear, to their full size, and Newton's iteration follows the solution in parts so
/// small that each iteration halves its step.
struct System<'a> {
    intervals: &'a [C2Interval],
    /// The velocities at the keys where they are fixed.
    set: Vec<Option<DVec3>>,
    /// The derivatives of the equations by the neighbours' velocities.
    beside: Vec<[DMat3; 2]>,
}

/// The strength up to which bends are used first; half as strong if no solution is found, and so on.
const STRONGEST: f64 = 1024.0;
const WEAKEST: f64 = 0.5;
/// The longest step in radians next to which equations are solved.
const LONGEST: f64 = 3.5;
/// The smallest part by which the bends are increased.
const LEAST_PART: f64 = 1.0 / 1024.0;
/// The maximum numbers of Newton steps for one part, and in total.
const STEPS_FOR_PART: usize = 32;
const ALL_STEPS: usize = 1024;

impl<'a> System<'a> {
    fn new(intervals: &'a [C2Interval], [start, end]: [Option<DVec3>; 2]) -> Self {
        let last = intervals.len();
        let secant = |i: usize| 2.0 * intervals[i].whole / intervals[i].duration;
        // A key next to a long step gets Bessel's mean, because the equations may have no solution there.
        let set = (0..=last).map(|key| {
            let near = key.saturating_sub(1)..last.min(key + 1);
            let is_long = near
                .into_iter()
                .any(|i| 2.0 * intervals[i].whole.length() > LONGEST);
            match (key, is_long) {
                (0, _) if start.is_some() => start,
                _ if key == last && end.is_some() => end,
                (_, false) => None,
                (0, true) => Some(secant(0)),
                (_, true) if key == last => Some(secant(last - 1)),
                (_, true) => {
                    let (h, next_h) = (intervals[key - 1].duration, intervals[key].duration);
                    Some((secant(key - 1) * next_h + secant(key) * h) / (h + next_h))
                }
            }
        });
        let mut system = Self {
            intervals,
            set: set.collect(),
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

    /// The acceleration before a key minus the acceleration after it, as a change of its velocity. The arguments are
    /// the velocities at the previous key, at this key and at the next key, and the fraction of the bend that is
    /// used.
    fn excess(&self, key: usize, [before, velocity, behind]: [DVec3; 3], part: f64) -> DVec3 {
        if let Some(set) = self.set[key] {
            return velocity - set;
        }
        let last = self.intervals.len();
        let (mut excess, mut stiffness) = (DVec3::ZERO, 0.0);
        if key > 0 {
            let interval = &self.intervals[key - 1];
            excess += interval.acceleration_at_end(before, velocity, part);
            stiffness += 4.0 / interval.duration;
        }
        if key < last {
            let interval = &self.intervals[key];
            excess -= interval.acceleration_at_start(velocity, behind);
            stiffness += 4.0 / interval.duration;
        }
        excess / stiffness
    }

    /// The three velocities in the equations of a key.
    fn around(velocities: &[DVec3], key: usize) -> [DVec3; 3] {
        let at = |key: usize| velocities.get(key).copied().unwrap_or_default();
        [at(key.wrapping_sub(1)), at(key), at(key + 1)]
    }

    /// The strength of the bend at a key relative to the rest of its equations. It is the product of three numbers: the
    /// angle of the interval before the key, the rate of the rotation vector at the interval's end in radians per
    /// interval, and the weight of the interval.
    fn strength(&self, key: usize, velocities: &[DVec3]) -> f64 {
        if key == 0 || self.set[key].is_some() {
            return 0.0;
        }
        let before = &self.intervals[key - 1];
        let weight = match self.intervals.get(key) {
            Some(behind) => behind.duration / (before.duration + behind.duration),
            None => 1.0,
        };
        let rate = before.to_rate * velocities[key] * before.duration;
        let angle = 2.0 * before.whole.length();
        weight * f64::max(angle, 0.1) * rate.length()
    }

    /// The sum of the magnitudes of the terms of a key's equations, as a velocity.
    fn size(&self, key: usize, velocities: &[DVec3]) -> f64 {
        let [before, velocity, behind] = Self::around(velocities, key);
        let still = self.excess(key, [DVec3::ZERO; 3], 0.0);
        let [of_before, of_behind] = self.beside[key];
        let beside = (of_before * before).length() + (of_behind * behind).length();
        velocity.length() + beside + still.length() + 1e-200
    }

    fn solve(&self) -> Vec<DVec3> {
        let keys = self.intervals.len() + 1;
        let (start, none) = (vec![DVec3::ZERO; keys], vec![0.0; keys]);
        let Some(linear) = self.newton_step(&start, &none, &vec![1.0; keys]) else {
            return start;
        };
        let sizes: Vec<f64> = (0..keys).map(|key| self.size(key, &linear)).collect();
        let mut strongest = STRONGEST;
        let mut steps_left = ALL_STEPS;
        while strongest >= WEAKEST {
            let counts = |key| f64::from(self.strength(key, &linear) <= strongest);
            let bends: Vec<f64> = (0..keys).map(counts).collect();
            if let Some(found) = self.with_bends(&linear, &bends, &sizes, &mut steps_left) {
                return found;
            }
            strongest /= 2.0;
        }
        linear
    }

    /// Tries all bends at once, then a quarter of them; afterwards the part is doubled after a success and halved
    /// after a failure.
    fn with_bends(
        &self,
        linear: &[DVec3],
        bends: &[f64],
        sizes: &[f64],
        steps_left: &mut usize,
    ) -> Option<Vec<DVec3>> {
        let mut velocities = linear.to_vec();
        let (mut part, mut more) = (0.0, 1.0);
        while more >= LEAST_PART && *steps_left > 0 {
            let next = f64::min(part + more, 1.0);
            let some: Vec<f64> = bends.iter().map(|bend| bend * next).collect();
            match self.newton(&velocities, &some, sizes, steps_left) {
                Some(found) if next >= 1.0 => return Some(found),
                Some(found) => (velocities, part, more) = (found, next, 2.0 * more),
                None if more >= 1.0 => more = 0.25,
                None => more /= 2.0,
            }
        }
        None
    }

    /// Newton's iteration; `None` if a step is more than half as long as the previous one.
    fn newton(
        &self,
        from: &[DVec3],
        bends: &[f64],
        sizes: &[f64],
        steps_left: &mut usize,
    ) -> Option<Vec<DVec3>> {
        let mut velocities = from.to_vec();
        let mut previous = f64::INFINITY;
        for _ in 0..STEPS_FOR_PART.min(*steps_left) {
            *steps_left -= 1;
            let next = self.newton_step(&velocities, bends, sizes)?;
            let changes = velocities.iter().zip(&next).zip(sizes);
            let relative = changes.map(|((from, to), size)| (*to - *from).length() / size);
            let largest = relative.fold(0.0, f64::max);
            if largest > previous / 2.0 && largest > 1e-10 {
                return None;
            }
            velocities = next;
            // Newton's iteration converges quadratically: the quotient of a step and the square of the step before it
            // stays the same.
            let rest = largest * largest * (largest / (previous * previous));
            if largest <= 1e-8 && (rest <= 1e-15 || previous <= 1e-8) {
                return Some(velocities);
            }
            previous = largest;
        }
        None
    }

    fn newton_step(
        &self,
        velocities: &[DVec3],
        bends: &[f64],
        sizes: &[f64],
    ) -> Option<Vec<DVec3>> {
        let keys = velocities.len();
        let mut band = Band::new(3 * keys);
        let mut excesses = Vec::with_capacity(3 * keys);
        for key in 0..keys {
            let around = Self::around(velocities, key);
            let at_key = self.slope_at(key, around, bends[key], sizes[key]);
            let [before, behind] = self.beside[key];
            let blocks = [
                (before, key.wrapping_sub(1)),
                (at_key, key),
                (behind, key + 1),
            ];
            for (block, column_key) in blocks.into_iter().filter(|&(_, key)| key < keys) {
                for (row, column) in (0..9).map(|i| (i / 3, i % 3)) {
                    let value = block.col(column)[row];
                    band.set(3 * key + row, 3 * column_key + column, value);
                }
            }
            excesses.extend(self.excess(key, around, bends[key]).to_array());
        }
        let changes = band.solve(excesses)?;
        let changes = changes.chunks(3).map(DVec3::from_slice);
        let next = velocities.iter().zip(changes);
        let next: Vec<DVec3> = next.map(|(velocity, change)| *velocity - change).collect();
        next.iter()
            .all(|velocity| velocity.is_finite())
            .then_some(next)
    }

    /// The derivative of the equations by the key's velocity, by central differences, which are exact for quadratic
    /// functions.
    fn slope_at(&self, key: usize, around: [DVec3; 3], bend: f64, size: f64) -> DMat3 {
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
            let at = |sign: f64| {
                let velocity = around[1] + axis * (sign * size);
                self.excess(key, [around[0], velocity, around[2]], bend)
            };
            (at(1.0) - at(-1.0)) / (2.0 * size)
        });
        DMat3::from_cols(x, y, z)
    }
}

/// A matrix with five diagonals below the main one and five above it, and room for the elements that exchanging rows
/// creates.
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

    /// Gaussian elimination with exchange of rows; `None` if the matrix is singular.
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
struct C2Interval {
    /// Half of the rotation vector from its first key to its last.
    whole: DVec3,
    /// The matrix from the angular velocity at the last key to that vector's rate of change.
    to_rate: DMat3,
    duration: f64,
}

impl C2Interval {
    fn new(track: &ReferenceTrack, i: usize) -> Self {
        let whole = logarithm(track.difference(i));
        Self {
            whole,
            to_rate: velocity_matrix(whole).inverse(),
            duration: track.step(i),
        }
    }

    fn cubic(&self, velocities: &[DVec3], i: usize) -> RotationVectorCubic {
        let [start, end] = self.slopes(velocities[i], velocities[i + 1]);
        RotationVectorCubic {
            powers: [
                start,
                3.0 * self.whole - 2.0 * start - end,
                start + end - 2.0 * self.whole,
            ],
        }
    }

    /// Half of the derivatives of the rotation vector at the interval's start and end, for the velocities there.
    fn slopes(&self, from: DVec3, to: DVec3) -> [DVec3; 2] {
        let half = self.duration / 2.0;
        [from * half, self.to_rate * (to * half)]
    }

    /// The angular acceleration at the interval's start, where the rotation vector is 0 and the velocity has no
    /// quadratic term.
    fn acceleration_at_start(&self, from: DVec3, to: DVec3) -> DVec3 {
        let [start, end] = self.slopes(from, to);
        let second = 6.0 * self.whole - 4.0 * start - 2.0 * end;
        acceleration(DVec3::ZERO, DVec3::ZERO, second) / (self.duration * self.duration)
    }

    /// The angular acceleration at the interval's end, with the fraction `part` of the term that is quadratic in the
    /// velocity there.
    fn acceleration_at_end(&self, from: DVec3, to: DVec3, part: f64) -> DVec3 {
        let [start, end] = self.slopes(from, to);
        let second = 2.0 * start + 4.0 * end - 6.0 * self.whole;
        let linear = acceleration(self.whole, DVec3::ZERO, second);
        let bend = acceleration(self.whole, end, DVec3::ZERO);
        (linear + bend * part) / (self.duration * self.duration)
    }
}

/// Half of a rotation vector as a cubic in `t`.
struct RotationVectorCubic {
    powers: [DVec3; 3],
}
