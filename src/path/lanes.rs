//! Directions and carried rotations in vector lanes. A lane is a piece of a stretch, or a span of time on a stretch;
//! the lanes of a block may belong to several paths. All lanes are evaluated together, one sample after the other.

use crate::fit::block::{load, put, store};
use crate::math::quaternion::{
    Quaternion, Real, cross3, dot, dot3, minus, product, scaled, sine_cosine, square,
};
use crate::path::carried_piece::{CHEBYSHEV, CarriedPiece, MIDDLE, NODES};
use crate::path::stretch::{Heading, NO_DIRECTION, PathStretch};
use crate::path::timed_path::TimedPath;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::doubles::Doubles;
use crate::simd::lanes::{Lanes, MAX_LANES};

/// A number for each lane.
pub(crate) type LaneValues = [f64; MAX_LANES];

/// Computes the directions at parameters of stretches, one stretch in each lane, and optionally their derivatives.
pub(crate) fn find_directions<'a, const SAMPLES: usize>(
    stretches: impl ExactSizeIterator<Item = (&'a TimedPath, &'a PathStretch)> + Clone,
    parameters: &[LaneValues; SAMPLES],
    directions: &mut [[LaneValues; 3]; SAMPLES],
    mut derivatives: Option<&mut [[LaneValues; 3]; SAMPLES]>,
) {
    let mut polynomials = [[[0.0; MAX_LANES]; 3]; 4];
    for (lane, (_, stretch)) in stretches.clone().enumerate() {
        if let Heading::Polynomial(polynomial) = &stretch.heading {
            for (rows, power) in polynomials.iter_mut().zip(polynomial.0) {
                put(rows, lane, power.to_array());
            }
        }
    }
    in_lanes(&mut Directions {
        count: stretches.len(),
        polynomials: &polynomials,
        parameters,
        directions,
        derivatives: derivatives.as_deref_mut(),
    });
    for (lane, (timed_path, stretch)) in stretches.enumerate() {
        if let Heading::Polynomial(_) = stretch.heading {
            continue;
        }
        for sample in 0..SAMPLES {
            let [direction, derivative] = stretch.direction(timed_path, parameters[sample][lane]);
            put(&mut directions[sample], lane, direction.to_array());
            if let Some(derivatives) = &mut derivatives {
                put(&mut derivatives[sample], lane, derivative.to_array());
            }
        }
    }
}

/// The directions of polynomials at some parameters, and optionally their derivatives.
struct Directions<'a, const SAMPLES: usize> {
    /// How many lanes there are.
    count: usize,
    /// The coefficients of 1, t, t², t³.
    polynomials: &'a [[LaneValues; 3]; 4],
    parameters: &'a [LaneValues; SAMPLES],
    directions: &'a mut [[LaneValues; 3]; SAMPLES],
    derivatives: Option<&'a mut [[LaneValues; 3]; SAMPLES]>,
}

impl<const SAMPLES: usize> InLanes for Directions<'_, SAMPLES> {
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let [zero, two, three] = all::<L, 3>([0.0, 2.0, 3.0]);
        let none = L::Doubles::all(NO_DIRECTION);
        for lane in (0..self.count).step_by(L::COUNT) {
            let mut powers = [[zero; 3]; 4];
            for (power, rows) in powers.iter_mut().zip(self.polynomials) {
                *power = load::<L::Doubles, 3, _>(rows, lane);
            }
            for sample in 0..SAMPLES {
                let t = L::Doubles::load(&self.parameters[sample][lane..]);
                let mut vector = powers[3];
                for c in 0..3 {
                    vector[c] =
                        ((vector[c] * t + powers[2][c]) * t + powers[1][c]) * t + powers[0][c];
                }
                let length = square(vector).root();
                // Written out here and below: closures are not always inlined.
                let mut direction = [zero; 3];
                for c in 0..3 {
                    direction[c] = vector[c] / length;
                    let component = length.up_to(none, zero, direction[c]);
                    component.store(&mut self.directions[sample][c][lane..]);
                }
                let Some(derivatives) = &mut self.derivatives else {
                    continue;
                };
                let mut derivative = [zero; 3];
                for c in 0..3 {
                    derivative[c] =
                        (powers[3][c] * three * t + powers[2][c] * two) * t + powers[1][c];
                }
                let across = minus(derivative, scaled(direction, dot3(direction, derivative)));
                for c in 0..3 {
                    let component = length.up_to(none, zero, across[c] / length);
                    component.store(&mut derivatives[sample][c][lane..]);
                }
            }
        }
    }
}

/// Finds the rolls of pieces, and the rotations from a piece's start to its end.
pub(crate) struct Rolling<'a, const SAMPLES: usize> {
    /// How many pieces there are.
    pub(crate) count: usize,
    /// Directions at the nodes, at [`MIDDLE`], at the start and at the end, and their derivatives.
    pub(crate) directions: &'a [[LaneValues; 3]; SAMPLES],
    pub(crate) derivatives: &'a [[LaneValues; 3]; SAMPLES],
    /// The parameters at the start and at the end.
    pub(crate) ends: &'a [LaneValues; 2],
    pub(crate) results: &'a mut RollResults,
}

/// The results of [`Rolling`], for each piece.
#[derive(Default)]
pub(crate) struct RollResults {
    /// Chebyshev coefficients of the roll.
    pub(crate) roll: [LaneValues; NODES + 1],
    /// The smallest cosine of the angles to the middle's direction.
    pub(crate) least: LaneValues,
    /// The magnitudes of the integrand's last two coefficients.
    pub(crate) tail: LaneValues,
    /// The shortest rotations from the middle's direction to that at the start and at the end.
    pub(crate) swings: [[LaneValues; 4]; 2],
    /// The sines and cosines of half the rolls from the start to the middle and from there to the
    /// end.
    pub(crate) halves: [[LaneValues; 2]; 2],
}

impl<const SAMPLES: usize> InLanes for Rolling<'_, SAMPLES> {
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let [zero, one, two] = all::<L, 3>([0.0, 1.0, 2.0]);
        let all_cosines = &CHEBYSHEV.cosines;
        let mut angles = [[0.0; MAX_LANES]; 2];
        for lane in (0..self.count).step_by(L::COUNT) {
            let [from, to] = load::<L::Doubles, 2, _>(self.ends, lane);
            let half = L::Doubles::all(0.5) * (to - from);
            let middle = load::<L::Doubles, 3, _>(&self.directions[MIDDLE], lane);
            let mut least = one;
            let mut values = [zero; NODES];
            for (k, value) in values.iter_mut().enumerate() {
                let direction = load::<L::Doubles, 3, _>(&self.directions[k], lane);
                let derivative = load::<L::Doubles, 3, _>(&self.derivatives[k], lane);
                let cosine = dot3(middle, direction);
                let denominator = (one + cosine).larger(L::Doubles::all(1e-9));
                *value = half * dot3(cross3(middle, direction), derivative) / denominator;
                least = cosine.smaller(least);
            }
            least.store(&mut self.results.least[lane..]);
            let mut coefficients = [zero; NODES + 2];
            for degree in 0..NODES {
                let mut sum = zero;
                for (value, cosines) in values.iter().zip(all_cosines) {
                    sum = sum + *value * L::Doubles::all(cosines[degree]);
                }
                coefficients[degree] = sum * two / L::Doubles::all(NODES as f64);
            }
            let [last, before] = [coefficients[NODES - 1], coefficients[NODES - 2]];
            let tail = last.larger(-last) + before.larger(-before);
            tail.store(&mut self.results.tail[lane..]);
            // The integral of T_j is (T_{j+1}/(j+1) - T_{j-1}/(j-1))/2, and T_j(0) is 1, 0, -1, 0 and
            // so on.
            let mut roll = [zero; NODES + 1];
            let mut at_middle = zero;
            for j in 1..=NODES {
                roll[j] =
                    (coefficients[j - 1] - coefficients[j + 1]) / L::Doubles::all((2 * j) as f64);
                if j % 2 == 0 {
                    at_middle = at_middle + if j % 4 == 0 { roll[j] } else { -roll[j] };
                }
            }
            roll[0] = -at_middle;
            store(&mut self.results.roll, lane, roll);
            (-clenshaw(&roll, -one)).store(&mut angles[0][lane..]);
            clenshaw(&roll, within([from, to], to)).store(&mut angles[1][lane..]);
            for end in 0..2 {
                let direction = load::<L::Doubles, 3, _>(&self.directions[MIDDLE + 1 + end], lane);
                store(
                    &mut self.results.swings[end],
                    lane,
                    rotation_between(middle, direction),
                );
            }
        }
        for (angles, halves) in angles.iter().zip(&mut self.results.halves) {
            *halves = sines_and_cosines(angles);
        }
    }
}

/// The pieces of some lanes.
#[derive(Default)]
pub(crate) struct PieceLanes {
    ends: [LaneValues; 2],
    roll: [LaneValues; NODES + 1],
    middle: [LaneValues; 3],
    base: [LaneValues; 4],
}

impl PieceLanes {
    pub(crate) fn set(&mut self, lane: usize, piece: &CarriedPiece) {
        put(&mut self.ends, lane, [piece.from, piece.to]);
        put(&mut self.roll, lane, piece.roll);
        put(&mut self.middle, lane, piece.middle.to_array());
        put(&mut self.base, lane, piece.base.to_array());
    }
}

/// The rotations of bodies with carried frames, at some parameters.
pub(crate) struct Carried<'a, const SAMPLES: usize> {
    /// How many lanes there are.
    pub(crate) count: usize,
    /// The pieces of the first sample.
    pub(crate) pieces: &'a mut PieceLanes,
    /// Changes of a lane's piece, in order: the first sample with the next piece, the lane, the piece.
    pub(crate) others: &'a [(usize, usize, &'a CarriedPiece)],
    pub(crate) parameters: &'a [LaneValues; SAMPLES],
    pub(crate) directions: &'a [[LaneValues; 3]; SAMPLES],
    /// Rolls added to those of the pieces, if there are any.
    pub(crate) rolls: Option<&'a [LaneValues; SAMPLES]>,
    /// The rotation from the body to z forward, y up, if it is not the identity.
    pub(crate) body_axes: Option<Quaternion>,
    pub(crate) rotations: &'a mut [[LaneValues; 4]; SAMPLES],
}

impl<const SAMPLES: usize> InLanes for Carried<'_, SAMPLES> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let mut others = self.others;
        for sample in 0..SAMPLES {
            while let [(from, lane, piece), rest @ ..] = others
                && *from <= sample
            {
                self.pieces.set(*lane, piece);
                others = rest;
            }
            let mut angles = [0.0; MAX_LANES];
            for lane in (0..self.count).step_by(L::COUNT) {
                let ends = load::<L::Doubles, 2, _>(&self.pieces.ends, lane);
                let t = L::Doubles::load(&self.parameters[sample][lane..]);
                let roll = load::<L::Doubles, { NODES + 1 }, _>(&self.pieces.roll, lane);
                clenshaw(&roll, within(ends, t)).store(&mut angles[lane..]);
            }
            let half_rolls = sines_and_cosines(&angles);
            let mut added = [[0.0; MAX_LANES]; 2];
            if let Some(rolls) = self.rolls {
                added = sines_and_cosines(&rolls[sample]);
            }
            for lane in (0..self.count).step_by(L::COUNT) {
                let middle = load::<L::Doubles, 3, _>(&self.pieces.middle, lane);
                let base = load::<L::Doubles, 4, _>(&self.pieces.base, lane);
                let direction = load::<L::Doubles, 3, _>(&self.directions[sample], lane);
                let swing = rotation_between(middle, direction);
                let mut rotation = product(
                    swing,
                    about_z(base, load::<L::Doubles, 2, _>(&half_rolls, lane)),
                );
                if self.rolls.is_some() {
                    rotation = about_z(rotation, load::<L::Doubles, 2, _>(&added, lane));
                }
                if let Some(axes) = self.body_axes {
                    rotation = product(rotation, all::<L, 4>(axes));
                }
                store(&mut self.rotations[sample], lane, rotation);
            }
        }
    }
}

/// Rotations that take z to a direction and x as near as possible to a side.
pub(crate) struct ByAxes<'a, const SAMPLES: usize> {
    /// How many lanes there are.
    pub(crate) count: usize,
    pub(crate) sides: &'a [[LaneValues; 3]; SAMPLES],
    pub(crate) directions: &'a [[LaneValues; 3]; SAMPLES],
    /// The rotation from the body to z forward, y up, if it is not the identity.
    pub(crate) body_axes: Option<Quaternion>,
    pub(crate) rotations: &'a mut [[LaneValues; 4]; SAMPLES],
    /// Not 0 if the side vector is parallel to the direction at some sample.
    pub(crate) are_along: &'a mut LaneValues,
}

impl<const SAMPLES: usize> InLanes for ByAxes<'_, SAMPLES> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let [zero, one, smallest, largest] = all::<L, 4>([0.0, 1.0, f64::MIN_POSITIVE, f64::MAX]);
        *self.are_along = [0.0; MAX_LANES];
        for lane in (0..self.count).step_by(L::COUNT) {
            let mut is_along = zero;
            for sample in 0..SAMPLES {
                let direction = load::<L::Doubles, 3, _>(&self.directions[sample], lane);
                let side = load::<L::Doubles, 3, _>(&self.sides[sample], lane);
                let across = minus(side, scaled(direction, dot3(direction, side)));
                let inverse = one / square(across).root();
                is_along = inverse.up_to(largest, is_along, one);
                is_along = smallest.up_to(inverse, is_along, one);
                let mut rotation = of_axes(scaled(across, inverse), direction);
                if let Some(axes) = self.body_axes {
                    rotation = product(rotation, all::<L, 4>(axes));
                }
                store(&mut self.rotations[sample], lane, rotation);
            }
            is_along.store(&mut self.are_along[lane..]);
        }
    }
}

/// The rotation with these x and z axes, which are unit vectors. The largest of its four components, or one that is
/// nearly as large, divides the others.
#[inline(always)]
pub(crate) fn of_axes<R: Real>(x: [R; 3], z: [R; 3]) -> [R; 4] {
    let (zero, one) = (R::all(0.0), R::all(1.0));
    let y = cross3(z, x);
    let base = z[2].up_to(zero, one - z[2], one + z[2]);
    let rest = z[2].up_to(zero, y[1] - x[0], y[1] + x[0]);
    let square = rest.up_to(zero, base - rest, base + rest);
    let inverse = R::all(0.5) / square.root();
    let (xy, xz, yz) = (x[1] + y[0], x[2] + z[0], y[2] + z[1]);
    let (xw, yw, zw) = (y[2] - z[1], z[0] - x[2], x[1] - y[0]);
    // If z points down, the largest component of the quaternion is x or y, otherwise z or w.
    let unscaled = [
        z[2].up_to(zero, rest.up_to(zero, square, xy), rest.up_to(zero, xz, xw)) * inverse,
        z[2].up_to(zero, rest.up_to(zero, xy, square), rest.up_to(zero, yz, yw)) * inverse,
        z[2].up_to(zero, rest.up_to(zero, xz, yz), rest.up_to(zero, square, zw)) * inverse,
        z[2].up_to(zero, rest.up_to(zero, xw, yw), rest.up_to(zero, zw, square)) * inverse,
    ];
    let (inverse, [x, y, z, w]) = (one / dot(unscaled, unscaled).root(), unscaled);
    [x * inverse, y * inverse, z * inverse, w * inverse]
}

/// The shortest rotation from one direction to another that is not opposite.
#[inline(always)]
pub(crate) fn rotation_between<R: Real>(from: [R; 3], to: [R; 3]) -> [R; 4] {
    let (zero, one) = (R::all(0.0), R::all(1.0));
    let [x, y, z] = cross3(from, to);
    let unscaled = [x, y, z, one + dot3(from, to)];
    let length = dot(unscaled, unscaled).root();
    [
        length.up_to(zero, zero, unscaled[0] / length),
        length.up_to(zero, zero, unscaled[1] / length),
        length.up_to(zero, zero, unscaled[2] / length),
        length.up_to(zero, one, unscaled[3] / length),
    ]
}

/// A parameter within a piece, from -1 at its start to 1 at its end.
#[inline(always)]
fn within<R: Real>([from, to]: [R; 2], t: R) -> R {
    let (one, width) = (R::all(1.0), (to - from).larger(R::all(f64::MIN_POSITIVE)));
    let x = (R::all(2.0) * t - from - to) / width;
    x.larger(-one).smaller(one)
}

/// A sum of Chebyshev polynomials at x, from -1 to 1, by Clenshaw's recurrence.
#[inline(always)]
fn clenshaw<R: Real>(coefficients: &[R; NODES + 1], x: R) -> R {
    let twice = R::all(2.0) * x;
    let (mut next, mut current) = (R::all(0.0), R::all(0.0));
    for &c in coefficients[1..].iter().rev() {
        (next, current) = (current, c + twice * current - next);
    }
    coefficients[0] + x * current - next
}

/// The sines and cosines of half the angles.
#[inline(always)]
fn sines_and_cosines(angles: &LaneValues) -> [LaneValues; 2] {
    let mut found = [[0.0; MAX_LANES]; 2];
    for (lane, angle) in angles.iter().enumerate() {
        (found[0][lane], found[1][lane]) = sine_cosine(0.5 * angle);
    }
    found
}

/// A rotation times one about z, whose half-angle has this sine and cosine.
#[inline(always)]
fn about_z<R: Real>([x, y, z, w]: [R; 4], [sine, cosine]: [R; 2]) -> [R; 4] {
    [
        x * cosine + y * sine,
        y * cosine - x * sine,
        w * sine + z * cosine,
        w * cosine - z * sine,
    ]
}

/// The same numbers in every lane.
#[inline(always)]
pub(crate) fn all<L: Lanes, const N: usize>(numbers: [f64; N]) -> [L::Doubles; N] {
    let mut filled = [L::Doubles::all(0.0); N];
    for c in 0..N {
        filled[c] = L::Doubles::all(numbers[c]);
    }
    filled
}
