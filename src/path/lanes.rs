//! Directions and carried rotations in vector lanes. A lane is a piece of a stretch, or a span of
//! time on one, of as many paths as it takes to fill a block; all lanes take their places in turn.

use crate::fit::double::fit::MOST;
use crate::fit::double::intervals::{load, put, store};
use crate::math::quaternion::{
    Quaternion, Real, cross3, dot, dot3, minus, product, scaled, sine_cosine, square,
};
use crate::path::carry::{CHEBYSHEV, MIDDLE, NODES, Piece};
use crate::path::route::{Heading, NO_DIRECTION, Route, Stretch};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::{Doubles, Lanes};

/// A number for each lane.
pub(crate) type Row = [f64; MOST];

/// Finds the directions at places of stretches, one stretch in each lane, and their derivatives if
/// they are asked for.
pub(crate) fn find_directions<'a, const PLACES: usize>(
    stretches: impl ExactSizeIterator<Item = (&'a Route, &'a Stretch)> + Clone,
    places: &[Row; PLACES],
    ways: &mut [[Row; 3]; PLACES],
    mut changes: Option<&mut [[Row; 3]; PLACES]>,
) {
    let mut polynomials = [[[0.0; MOST]; 3]; 4];
    for (lane, (_, own)) in stretches.clone().enumerate() {
        if let Heading::Polynomial(way) = &own.heading {
            for (rows, power) in polynomials.iter_mut().zip(way.0) {
                put(rows, lane, power.to_array());
            }
        }
    }
    in_lanes(&mut Directions {
        count: stretches.len(),
        polynomials: &polynomials,
        places,
        ways,
        changes: changes.as_deref_mut(),
    });
    for (lane, (route, own)) in stretches.enumerate() {
        if let Heading::Polynomial(_) = own.heading {
            continue;
        }
        for place in 0..PLACES {
            let [way, change] = own.way(route, places[place][lane]);
            put(&mut ways[place], lane, way.to_array());
            if let Some(changes) = &mut changes {
                put(&mut changes[place], lane, change.to_array());
            }
        }
    }
}

/// The directions of polynomials at places, and their derivatives if they are asked for.
struct Directions<'a, const PLACES: usize> {
    /// How many lanes there are.
    count: usize,
    /// The coefficients of 1, t, t², t³.
    polynomials: &'a [[Row; 3]; 4],
    places: &'a [Row; PLACES],
    ways: &'a mut [[Row; 3]; PLACES],
    changes: Option<&'a mut [[Row; 3]; PLACES]>,
}

impl<const PLACES: usize> InLanes for Directions<'_, PLACES> {
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
            for place in 0..PLACES {
                let t = L::Doubles::load(&self.places[place][lane..]);
                let mut vector = powers[3];
                for c in 0..3 {
                    vector[c] =
                        ((vector[c] * t + powers[2][c]) * t + powers[1][c]) * t + powers[0][c];
                }
                let length = square(vector).root();
                // Written out here and below: closures are not always inlined.
                let mut way = [zero; 3];
                for c in 0..3 {
                    way[c] = vector[c] / length;
                    let own = length.up_to(none, zero, way[c]);
                    own.store(&mut self.ways[place][c][lane..]);
                }
                let Some(changes) = &mut self.changes else {
                    continue;
                };
                let mut change = [zero; 3];
                for c in 0..3 {
                    change[c] = (powers[3][c] * three * t + powers[2][c] * two) * t + powers[1][c];
                }
                let across = minus(change, scaled(way, dot3(way, change)));
                for c in 0..3 {
                    let own = length.up_to(none, zero, across[c] / length);
                    own.store(&mut changes[place][c][lane..]);
                }
            }
        }
    }
}

/// The rolls of pieces, and what turns a rotation from a piece's start to its end.
pub(crate) struct Rolling<'a, const PLACES: usize> {
    /// How many pieces there are.
    pub(crate) count: usize,
    /// Directions at the nodes, at [`MIDDLE`], at the start and at the end, and their derivatives.
    pub(crate) ways: &'a [[Row; 3]; PLACES],
    pub(crate) changes: &'a [[Row; 3]; PLACES],
    /// The parameters at the start and at the end.
    pub(crate) ends: &'a [Row; 2],
    pub(crate) own: &'a mut Rolled,
}

/// What is found of each piece.
#[derive(Default)]
pub(crate) struct Rolled {
    /// Chebyshev coefficients of the roll.
    pub(crate) roll: [Row; NODES + 1],
    /// The least cosine of the angles from the middle's direction.
    pub(crate) least: Row,
    /// The magnitudes of the integrand's last two coefficients.
    pub(crate) rest: Row,
    /// The least turns from the middle's direction to that at the start and at the end.
    pub(crate) turns: [[Row; 4]; 2],
    /// The sines and cosines of half the rolls from the start to the middle and from there to the
    /// end.
    pub(crate) halves: [[Row; 2]; 2],
}

impl<const PLACES: usize> InLanes for Rolling<'_, PLACES> {
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let [zero, one, two] = all::<L, 3>([0.0, 1.0, 2.0]);
        let all_cosines = &CHEBYSHEV.cosines;
        let mut angles = [[0.0; MOST]; 2];
        for lane in (0..self.count).step_by(L::COUNT) {
            let [from, to] = load::<L::Doubles, 2, _>(self.ends, lane);
            let half = L::Doubles::all(0.5) * (to - from);
            let middle = load::<L::Doubles, 3, _>(&self.ways[MIDDLE], lane);
            let mut least = one;
            let mut values = [zero; NODES];
            for (k, value) in values.iter_mut().enumerate() {
                let way = load::<L::Doubles, 3, _>(&self.ways[k], lane);
                let change = load::<L::Doubles, 3, _>(&self.changes[k], lane);
                let cosine = dot3(middle, way);
                let rest = (one + cosine).larger(L::Doubles::all(1e-9));
                *value = half * dot3(cross3(middle, way), change) / rest;
                least = cosine.smaller(least);
            }
            least.store(&mut self.own.least[lane..]);
            let mut own = [zero; NODES + 2];
            for degree in 0..NODES {
                let mut sum = zero;
                for (value, cosines) in values.iter().zip(all_cosines) {
                    sum = sum + *value * L::Doubles::all(cosines[degree]);
                }
                own[degree] = sum * two / L::Doubles::all(NODES as f64);
            }
            let [last, before] = [own[NODES - 1], own[NODES - 2]];
            let rest = last.larger(-last) + before.larger(-before);
            rest.store(&mut self.own.rest[lane..]);
            // The integral of T_j is (T_{j+1}/(j+1) - T_{j-1}/(j-1))/2, and T_j(0) is 1, 0, -1, 0 and
            // so on.
            let mut roll = [zero; NODES + 1];
            let mut at_middle = zero;
            for j in 1..=NODES {
                roll[j] = (own[j - 1] - own[j + 1]) / L::Doubles::all((2 * j) as f64);
                if j % 2 == 0 {
                    at_middle = at_middle + if j % 4 == 0 { roll[j] } else { -roll[j] };
                }
            }
            roll[0] = -at_middle;
            store(&mut self.own.roll, lane, roll);
            (-clenshaw(&roll, -one)).store(&mut angles[0][lane..]);
            clenshaw(&roll, within([from, to], to)).store(&mut angles[1][lane..]);
            for end in 0..2 {
                let way = load::<L::Doubles, 3, _>(&self.ways[MIDDLE + 1 + end], lane);
                store(&mut self.own.turns[end], lane, least_turn(middle, way));
            }
        }
        for (angles, halves) in angles.iter().zip(&mut self.own.halves) {
            *halves = sines_and_cosines(angles);
        }
    }
}

/// The pieces of some lanes.
#[derive(Default)]
pub(crate) struct Pieces {
    ends: [Row; 2],
    roll: [Row; NODES + 1],
    middle: [Row; 3],
    base: [Row; 4],
}

impl Pieces {
    pub(crate) fn set(&mut self, lane: usize, piece: &Piece) {
        put(&mut self.ends, lane, [piece.from, piece.to]);
        put(&mut self.roll, lane, piece.roll);
        put(&mut self.middle, lane, piece.middle.to_array());
        put(&mut self.base, lane, piece.base.to_array());
    }
}

/// The rotations of bodies at places of carried frames.
pub(crate) struct Carried<'a, const PLACES: usize> {
    /// How many lanes there are.
    pub(crate) count: usize,
    /// The pieces of the first place.
    pub(crate) pieces: &'a mut Pieces,
    /// From a place on, in order, a lane has another piece.
    pub(crate) others: &'a [(usize, usize, &'a Piece)],
    pub(crate) places: &'a [Row; PLACES],
    pub(crate) ways: &'a [[Row; 3]; PLACES],
    /// Rolls added to those of the pieces, if there are any.
    pub(crate) rolls: Option<&'a [Row; PLACES]>,
    /// The rotation from the body to z forward, y up, if it is not the identity.
    pub(crate) body: Option<Quaternion>,
    pub(crate) rotations: &'a mut [[Row; 4]; PLACES],
}

impl<const PLACES: usize> InLanes for Carried<'_, PLACES> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let mut others = self.others;
        for place in 0..PLACES {
            while let [(from, lane, piece), rest @ ..] = others
                && *from <= place
            {
                self.pieces.set(*lane, piece);
                others = rest;
            }
            let mut angles = [0.0; MOST];
            for lane in (0..self.count).step_by(L::COUNT) {
                let ends = load::<L::Doubles, 2, _>(&self.pieces.ends, lane);
                let t = L::Doubles::load(&self.places[place][lane..]);
                let roll = load::<L::Doubles, { NODES + 1 }, _>(&self.pieces.roll, lane);
                clenshaw(&roll, within(ends, t)).store(&mut angles[lane..]);
            }
            let own = sines_and_cosines(&angles);
            let mut added = [[0.0; MOST]; 2];
            if let Some(rolls) = self.rolls {
                added = sines_and_cosines(&rolls[place]);
            }
            for lane in (0..self.count).step_by(L::COUNT) {
                let middle = load::<L::Doubles, 3, _>(&self.pieces.middle, lane);
                let base = load::<L::Doubles, 4, _>(&self.pieces.base, lane);
                let way = load::<L::Doubles, 3, _>(&self.ways[place], lane);
                let turn = least_turn(middle, way);
                let mut rotation =
                    product(turn, about_z(base, load::<L::Doubles, 2, _>(&own, lane)));
                if self.rolls.is_some() {
                    rotation = about_z(rotation, load::<L::Doubles, 2, _>(&added, lane));
                }
                if let Some(body) = self.body {
                    rotation = product(rotation, all::<L, 4>(body));
                }
                store(&mut self.rotations[place], lane, rotation);
            }
        }
    }
}

/// Rotations that take z to a direction and x as near as possible to a side.
pub(crate) struct ByAxes<'a, const PLACES: usize> {
    /// How many lanes there are.
    pub(crate) count: usize,
    pub(crate) sides: &'a [[Row; 3]; PLACES],
    pub(crate) ways: &'a [[Row; 3]; PLACES],
    /// The rotation from the body to z forward, y up, if it is not the identity.
    pub(crate) body: Option<Quaternion>,
    pub(crate) rotations: &'a mut [[Row; 4]; PLACES],
    /// Not 0 where at some place the side lies along the direction.
    pub(crate) are_along: &'a mut Row,
}

impl<const PLACES: usize> InLanes for ByAxes<'_, PLACES> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let [zero, one, least, most] = all::<L, 4>([0.0, 1.0, f64::MIN_POSITIVE, f64::MAX]);
        *self.are_along = [0.0; MOST];
        for lane in (0..self.count).step_by(L::COUNT) {
            let mut is_along = zero;
            for place in 0..PLACES {
                let way = load::<L::Doubles, 3, _>(&self.ways[place], lane);
                let side = load::<L::Doubles, 3, _>(&self.sides[place], lane);
                let across = minus(side, scaled(way, dot3(way, side)));
                let inverse = one / square(across).root();
                is_along = inverse.up_to(most, is_along, one);
                is_along = least.up_to(inverse, is_along, one);
                let mut rotation = of_axes(scaled(across, inverse), way);
                if let Some(body) = self.body {
                    rotation = product(rotation, all::<L, 4>(body));
                }
                store(&mut self.rotations[place], lane, rotation);
            }
            is_along.store(&mut self.are_along[lane..]);
        }
    }
}

/// The rotation with this x and z axis, which are of unit length: of its four components the largest,
/// or one that is nearly as large, divides the others.
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
    // Where z points down, x or y is largest, else z or w.
    let own = [
        z[2].up_to(zero, rest.up_to(zero, square, xy), rest.up_to(zero, xz, xw)) * inverse,
        z[2].up_to(zero, rest.up_to(zero, xy, square), rest.up_to(zero, yz, yw)) * inverse,
        z[2].up_to(zero, rest.up_to(zero, xz, yz), rest.up_to(zero, square, zw)) * inverse,
        z[2].up_to(zero, rest.up_to(zero, xw, yw), rest.up_to(zero, zw, square)) * inverse,
    ];
    let (inverse, [x, y, z, w]) = (one / dot(own, own).root(), own);
    [x * inverse, y * inverse, z * inverse, w * inverse]
}

/// The turn by the least angle from one direction to another that is not opposite.
#[inline(always)]
pub(crate) fn least_turn<R: Real>(from: [R; 3], to: [R; 3]) -> [R; 4] {
    let (zero, one) = (R::all(0.0), R::all(1.0));
    let [x, y, z] = cross3(from, to);
    let own = [x, y, z, one + dot3(from, to)];
    let length = dot(own, own).root();
    [
        length.up_to(zero, zero, own[0] / length),
        length.up_to(zero, zero, own[1] / length),
        length.up_to(zero, zero, own[2] / length),
        length.up_to(zero, one, own[3] / length),
    ]
}

/// Where a place lies in a piece, from -1 at its start to 1 at its end.
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
    let (mut next, mut own) = (R::all(0.0), R::all(0.0));
    for &c in coefficients[1..].iter().rev() {
        (next, own) = (own, c + twice * own - next);
    }
    coefficients[0] + x * own - next
}

/// The sines and cosines of half the angles.
#[inline(always)]
fn sines_and_cosines(angles: &Row) -> [Row; 2] {
    let mut found = [[0.0; MOST]; 2];
    for (lane, angle) in angles.iter().enumerate() {
        (found[0][lane], found[1][lane]) = sine_cosine(0.5 * angle);
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

/// The same numbers in every lane.
#[inline(always)]
pub(crate) fn all<L: Lanes, const N: usize>(numbers: [f64; N]) -> [L::Doubles; N] {
    let mut own = [L::Doubles::all(0.0); N];
    for c in 0..N {
        own[c] = L::Doubles::all(numbers[c]);
    }
    own
}
