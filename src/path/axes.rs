//! Rotations by their axes, in vector lanes: of frames that are not carried.

use crate::fit::double::fit::MOST;
use crate::fit::double::intervals::store;
use crate::math::quaternion::{
    Quaternion, Real, cross3, dot, dot3, minus, product, scaled, square,
};
use crate::path::lanes::{Row, all, load};
use crate::simd::dispatch::InLanes;
use crate::simd::lanes::{Doubles, Lanes};

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
                let way = load::<L, 3>(&self.ways[place], lane);
                let side = load::<L, 3>(&self.sides[place], lane);
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
