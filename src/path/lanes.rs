//! Directions and carried rotations at many places of a stretch at once, in vector lanes.

use crate::fit::double::fit::MOST;
use crate::math::quaternion::{
    Quaternion, Real, Vector, cross3, dot, dot3, minus, product, scaled, sine_cosine, square,
};
use crate::path::carry::{NODES, Piece};
use crate::path::polynomial::Polynomial;
use crate::path::route::{Heading, NO_DIRECTION, Route, Stretch};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::{Doubles, Lanes};

/// A number for each place.
pub(crate) type Row = [f64; MOST];

/// Directions at places of a stretch, and their derivatives by the interval's parameter.
pub(crate) struct Ways {
    pub(crate) ways: [Row; 3],
    pub(crate) changes: [Row; 3],
}

impl Ways {
    pub(crate) fn new(route: &Route, stretch: &Stretch, places: &Row) -> Self {
        let mut own = Self {
            ways: [[0.0; MOST]; 3],
            changes: [[0.0; MOST]; 3],
        };
        if let Heading::Polynomial(vector) = &stretch.heading {
            in_lanes(&mut OfPolynomial {
                vector,
                places,
                own: &mut own,
            });
        } else {
            for (lane, &place) in places.iter().enumerate() {
                let [way, change] = stretch.way(route, place);
                for c in 0..3 {
                    (own.ways[c][lane], own.changes[c][lane]) = (way[c], change[c]);
                }
            }
        }
        own
    }

    /// The direction at one place.
    pub(crate) fn at(&self, lane: usize) -> Vector {
        self.ways.map(|row| row[lane])
    }
}

/// The directions of a polynomial.
struct OfPolynomial<'a> {
    vector: &'a Polynomial,
    places: &'a Row,
    own: &'a mut Ways,
}

impl InLanes for OfPolynomial<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let [own, rise, bend, twist] = self.vector.0;
        let powers = [
            all::<L, 3>(own.to_array()),
            all::<L, 3>(rise.to_array()),
            all::<L, 3>(bend.to_array()),
            all::<L, 3>(twist.to_array()),
        ];
        let [first, second, third, _] = self.vector.derivative().0;
        let slopes = [
            all::<L, 3>(first.to_array()),
            all::<L, 3>(second.to_array()),
            all::<L, 3>(third.to_array()),
        ];
        for lane in (0..MOST).step_by(L::COUNT) {
            let t = L::Doubles::load(&self.places[lane..]);
            let [mut vector, mut change] = [powers[3], slopes[2]];
            for c in 0..3 {
                vector[c] = ((vector[c] * t + powers[2][c]) * t + powers[1][c]) * t + powers[0][c];
                change[c] = (change[c] * t + slopes[1][c]) * t + slopes[0][c];
            }
            let length = square(vector).root();
            let (zero, none) = (L::Doubles::all(0.0), L::Doubles::all(NO_DIRECTION));
            // Written out here and below: closures are not always inlined.
            let mut way = [zero; 3];
            for c in 0..3 {
                way[c] = vector[c] / length;
            }
            let along = dot3(way, change);
            let across = minus(change, scaled(way, along));
            for c in 0..3 {
                let change = across[c] / length;
                (length.up_to(none, zero, way[c])).store(&mut self.own.ways[c][lane..]);
                (length.up_to(none, zero, change)).store(&mut self.own.changes[c][lane..]);
            }
        }
    }
}

/// The integrand of a piece's roll at places, and its Chebyshev coefficients.
pub(crate) struct Integrand<'a> {
    pub(crate) ways: &'a Ways,
    /// The direction at the middle of the piece.
    pub(crate) middle: Vector,
    /// Half of the piece's length, in parameters.
    pub(crate) half: f64,
    /// `cosines[k][j]` is the Chebyshev polynomial of degree j at node k, 0 beyond the last degree.
    pub(crate) cosines: &'a [Row; NODES],
    /// The cosines of the angles to the middle's direction.
    pub(crate) to_middle: Row,
    pub(crate) coefficients: Row,
}

impl Integrand<'_> {
    pub(crate) fn find(&mut self) {
        in_lanes(self);
    }
}

impl InLanes for Integrand<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (middle, half) = (all::<L, 3>(self.middle), L::Doubles::all(self.half));
        let mut values = [0.0; MOST];
        for lane in (0..MOST).step_by(L::COUNT) {
            let way = load::<L, 3>(&self.ways.ways, lane);
            let change = load::<L, 3>(&self.ways.changes, lane);
            let cosine = dot3(middle, way);
            let rest = (L::Doubles::all(1.0) + cosine).larger(L::Doubles::all(1e-9));
            let value = half * dot3(cross3(middle, way), change) / rest;
            cosine.store(&mut self.to_middle[lane..]);
            value.store(&mut values[lane..]);
        }
        for degree in (0..MOST).step_by(L::COUNT) {
            let mut sum = L::Doubles::all(0.0);
            for (value, cosines) in values.iter().zip(self.cosines) {
                sum = sum + L::Doubles::all(*value) * L::Doubles::load(&cosines[degree..]);
            }
            let own = sum * L::Doubles::all(2.0) / L::Doubles::all(NODES as f64);
            own.store(&mut self.coefficients[degree..]);
        }
    }
}

/// Numbers of lanes from `lane` on.
#[inline(always)]
fn load<L: Lanes, const N: usize>(rows: &[Row; N], lane: usize) -> [L::Doubles; N] {
    let mut own = [L::Doubles::all(0.0); N];
    for c in 0..N {
        own[c] = L::Doubles::load(&rows[c][lane..]);
    }
    own
}

/// The same numbers in every lane.
#[inline(always)]
fn all<L: Lanes, const N: usize>(numbers: [f64; N]) -> [L::Doubles; N] {
    let mut own = [L::Doubles::all(0.0); N];
    for c in 0..N {
        own[c] = L::Doubles::all(numbers[c]);
    }
    own
}

/// The rotations of a body at places of one piece of a stretch.
pub(crate) struct Carried<'a> {
    pub(crate) piece: &'a Piece,
    pub(crate) ways: &'a Ways,
    pub(crate) places: &'a Row,
    /// Rolls added to those of the piece.
    pub(crate) rolls: &'a Row,
    /// The rotation from the body to z forward, y up.
    pub(crate) body: Quaternion,
    pub(crate) rotations: [Row; 4],
}

impl Carried<'_> {
    pub(crate) fn find(mut self) -> [Row; 4] {
        in_lanes(&mut self);
        self.rotations
    }
}

impl InLanes for Carried<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let piece = self.piece;
        let [zero, one, two] = all::<L, 3>([0.0, 1.0, 2.0]);
        let [from, to] = all::<L, 2>([piece.from, piece.to]);
        let width = L::Doubles::all((piece.to - piece.from).max(f64::MIN_POSITIVE));
        let mut rolls = [[0.0; MOST], *self.rolls];
        for lane in (0..MOST).step_by(L::COUNT) {
            let t = L::Doubles::load(&self.places[lane..]);
            let x = ((two * t - from - to) / width).larger(-one).smaller(one);
            // Clenshaw's recurrence.
            let (mut next, mut own) = (zero, zero);
            for &c in piece.roll[1..].iter().rev() {
                (next, own) = (own, L::Doubles::all(c) + two * x * own - next);
            }
            let roll = L::Doubles::all(piece.roll[0]) + x * own - next;
            roll.store(&mut rolls[0][lane..]);
        }
        let [sines, cosines] = halves(&rolls);
        let base = all::<L, 4>(piece.base.to_array());
        let middle = all::<L, 3>(piece.middle.to_array());
        let body = all::<L, 4>(self.body);
        for lane in (0..MOST).step_by(L::COUNT) {
            let way = load::<L, 3>(&self.ways.ways, lane);
            let own = [
                L::Doubles::load(&sines[0][lane..]),
                L::Doubles::load(&cosines[0][lane..]),
            ];
            let added = [
                L::Doubles::load(&sines[1][lane..]),
                L::Doubles::load(&cosines[1][lane..]),
            ];
            let [x, y, z] = cross3(middle, way);
            let mut turn = [x, y, z, one + dot3(middle, way)];
            let length = dot(turn, turn).root();
            for (c, own) in turn.iter_mut().enumerate() {
                let identity = if c == 3 { one } else { zero };
                *own = length.up_to(zero, identity, *own / length);
            }
            let carried = product(turn, about_z(base, own));
            let rotation = product(about_z(carried, added), body);
            for (own, row) in rotation.into_iter().zip(&mut self.rotations) {
                own.store(&mut row[lane..]);
            }
        }
    }
}

/// The sines and cosines of half the angles.
#[inline(always)]
fn halves(angles: &[Row; 2]) -> [[Row; 2]; 2] {
    let mut found = [[[0.0; MOST]; 2]; 2];
    for (of, angles) in angles.iter().enumerate() {
        for (lane, angle) in angles.iter().enumerate() {
            let (sine, cosine) = sine_cosine(0.5 * angle);
            (found[0][of][lane], found[1][of][lane]) = (sine, cosine);
        }
    }
    found
}

/// A rotation times one about z, given by the sine and the cosine of half its angle.
#[inline(always)]
fn about_z<R: Real>([x, y, z, w]: [R; 4], [sine, cosine]: [R; 2]) -> [R; 4] {
    [
        x * cosine + y * sine,
        y * cosine - x * sine,
        w * sine + z * cosine,
        w * cosine - z * sine,
    ]
}
