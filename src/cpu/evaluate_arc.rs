//! Twin of `shaders/evaluate_arc.wgsl`: the same names, the same order.

use super::evaluate::{COARSE, Evaluate};
use super::lanes::Number;
use super::sine_cosine::short_sine_and_fall;
use crate::segment::ArcSegment;

impl Evaluate for ArcSegment {
    #[inline(always)]
    fn constant(&self) -> f32 {
        square(self.tangent)
    }

    #[inline(always)]
    fn evaluate<N: Number>(&self, square: N, parameter: N) -> [N; 4] {
        let [mx, my, mz, mw] = self.middle;
        let [tx, ty, tz, tw] = self.tangent;
        // Written out: closures are not always inlined.
        let middle = [N::all(mx), N::all(my), N::all(mz), N::all(mw)];
        let tangent = [N::all(tx), N::all(ty), N::all(tz), N::all(tw)];
        on_arc(middle, tangent, square, parameter)
    }

    #[inline(always)]
    fn is_canonical(&self) -> bool {
        let mut all = true;
        for c in 0..4 {
            let is_zero = self.middle[c].to_bits() | self.tangent[c].to_bits() == 0;
            all &= is_zero | (self.middle[c].abs() >= COARSE);
        }
        all
    }
}

/// The rotation at a parameter of an arc.
#[inline(always)]
pub(super) fn on_arc<N: Number>(
    middle: [N; 4],
    tangent: [N; 4],
    square: N,
    parameter: N,
) -> [N; 4] {
    let z = parameter * parameter * square;
    let (sine, fall) = short_sine_and_fall(parameter, z);
    [
        middle[0] + (middle[0] * fall + tangent[0] * sine),
        middle[1] + (middle[1] * fall + tangent[1] * sine),
        middle[2] + (middle[2] * fall + tangent[2] * sine),
        middle[3] + (middle[3] * fall + tangent[3] * sine),
    ]
}

#[inline(always)]
pub(super) fn square<N: Number>(q: [N; 4]) -> N {
    q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
}
