//! Twin of `shaders/evaluate_arc.wgsl`: the same names, the same order.

use super::evaluate::{COARSE, Evaluate, is_coarse};
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
        is_coarse(self.middle) || self.is_coarse_or_zero()
    }
}

impl ArcSegment {
    /// As [`Evaluate::is_canonical`], where some middle is small.
    #[inline(never)]
    fn is_coarse_or_zero(&self) -> bool {
        let is_zero = |c: usize| self.middle[c].to_bits() | self.tangent[c].to_bits() == 0;
        (0..4).all(|c| self.middle[c].abs() >= COARSE || is_zero(c))
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
