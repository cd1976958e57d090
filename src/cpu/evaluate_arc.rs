//! Twin of `shaders/evaluate_arc.wgsl`: the same names, the same order.

use super::evaluate::{BLOCK, Evaluate, RoomFor};
use super::sine_cosine::short_sine_and_fall;
use crate::segment::ArcSegment;

impl Evaluate for ArcSegment {
    type Room = RoomFor<{ 4 * BLOCK }>;

    #[inline(always)]
    fn constant(&self) -> f32 {
        square(self.tangent)
    }

    #[inline(always)]
    fn evaluate(&self, square: f32, parameter: f32) -> [f32; 4] {
        let z = parameter * parameter * square;
        let (sine, fall) = short_sine_and_fall(parameter, z);
        let [mx, my, mz, mw] = self.middle;
        let [tx, ty, tz, tw] = self.tangent;
        // Written out: closures are not always inlined.
        [
            mx + (mx * fall + tx * sine),
            my + (my * fall + ty * sine),
            mz + (mz * fall + tz * sine),
            mw + (mw * fall + tw * sine),
        ]
    }
}

#[inline(always)]
pub(super) fn square(q: [f32; 4]) -> f32 {
    q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
}
