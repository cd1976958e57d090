//! Twin of `shaders/evaluate_arc.wgsl`: the same names, the same order.

use glam::Vec4;

use super::evaluate::{COARSE, Evaluate, is_coarse};
use super::lanes::{Lanes, Number};
use super::sine_cosine::short_sine_and_fall;
use crate::segment::ArcSegment;

impl Evaluate for ArcSegment {
    #[inline(always)]
    fn constant(&self) -> f32 {
        square(self.tangent)
    }

    #[inline(always)]
    fn samples<L: Lanes>() -> usize {
        L::COUNT
    }

    #[inline(always)]
    fn load<L: Lanes>(distances: &[f32]) -> L {
        L::load(distances)
    }

    type Arguments<L: Lanes> = L;

    #[inline(always)]
    fn arguments<L: Lanes>(parameters: L) -> L {
        parameters
    }

    #[inline(always)]
    fn evaluate<L: Lanes, const FILTER: bool>(
        &self,
        square: L,
        parameter: L,
        rotations: &mut [[f32; 4]],
    ) {
        let (middle, tangent) = (L::repeated(self.middle), L::repeated(self.tangent));
        let z = parameter * parameter * square;
        let (sine, fall) = short_sine_and_fall(parameter, z);
        let (s, f) = (sine.fourfold(), fall.fourfold());
        // Written out: closures are not always inlined.
        let mut quarters = [
            turned(middle, tangent, s[0], f[0]),
            turned(middle, tangent, s[1], f[1]),
            turned(middle, tangent, s[2], f[2]),
            turned(middle, tangent, s[3], f[3]),
        ];
        if FILTER {
            // Written out: `lanes::canonical` here costs SSE2 half as much again.
            quarters = [
                quarters[0].canonical(),
                quarters[1].canonical(),
                quarters[2].canonical(),
                quarters[3].canonical(),
            ];
        }
        rotations.copy_from_slice(L::joined(quarters).as_ref());
    }

    #[inline(always)]
    fn at(&self, parameter: f32) -> Vec4 {
        let z = parameter * parameter * self.constant();
        let (sine, fall) = short_sine_and_fall(parameter, z);
        let (sine, fall) = (Vec4::splat(sine), Vec4::splat(fall));
        turned(self.middle.into(), self.tangent.into(), sine, fall)
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
        turned(middle[0], tangent[0], sine, fall),
        turned(middle[1], tangent[1], sine, fall),
        turned(middle[2], tangent[2], sine, fall),
        turned(middle[3], tangent[3], sine, fall),
    ]
}

#[inline(always)]
fn turned<N: Number>(middle: N, tangent: N, sine: N, fall: N) -> N {
    middle + (middle * fall + tangent * sine)
}

#[inline(always)]
pub(super) fn square<N: Number>(q: [N; 4]) -> N {
    q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
}
