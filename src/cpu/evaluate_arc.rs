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
        let z = parameter * parameter * square;
        let (sine, fall) = short_sine_and_fall(parameter, z);
        let [mx, my, mz, mw] = self.middle;
        let [tx, ty, tz, tw] = self.tangent;
        // Written out: closures are not always inlined.
        [
            N::all(mx) + (N::all(mx) * fall + N::all(tx) * sine),
            N::all(my) + (N::all(my) * fall + N::all(ty) * sine),
            N::all(mz) + (N::all(mz) * fall + N::all(tz) * sine),
            N::all(mw) + (N::all(mw) * fall + N::all(tw) * sine),
        ]
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

#[inline(always)]
pub(super) fn square(q: [f32; 4]) -> f32 {
    q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
}
