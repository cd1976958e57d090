//! Which of a rotation's two quaternions a key counts with.

use crate::cpu::evaluate::FEW;
use crate::math::quaternion::{dot, unit};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::{Lanes, Number};

/// Dot products nearer to zero than this are rounding noise of f32 keys: the signs
/// given decide, never the noise.
pub(crate) const DOT_NOISE: f64 = 1.0 / (1u64 << 21) as f64;

/// What f32 makes of the inner product of two keys is within 1e-6 of it: beyond this its
/// sign is not in doubt.
pub(crate) const IN_DOUBT: f32 = 1e-5;

/// The inner product in f32.
#[inline(always)]
pub(crate) fn inner<N: Number>(a: [N; 4], b: [N; 4]) -> N {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

/// -1 where the shortest path from one key to the other turns the second one's sign.
#[inline]
pub(crate) fn flip(from: [f32; 4], to: [f32; 4]) -> f32 {
    let inner = inner(from, to);
    let turns = if inner.abs() <= IN_DOUBT {
        dot(unit(from), unit(to)) < -DOT_NOISE
    } else {
        inner < 0.0
    };
    if turns { -1.0 } else { 1.0 }
}

/// Whether the second key's sign is turned, or in doubt.
#[inline(always)]
pub(crate) fn may_turn(from: [f32; 4], to: [f32; 4]) -> bool {
    inner(from, to) <= IN_DOUBT
}

/// Whether the sign of any key after the first of some is turned, or in doubt.
#[inline(always)]
pub(crate) fn any_turns_in_lanes<L: Lanes>(keys: &[[f32; 4]]) -> bool {
    let mut first = 0;
    while first + L::COUNT < keys.len() {
        if L::inner(&keys[first..], &keys[first + 1..]).any_at_most(IN_DOUBT) {
            return true;
        }
        first += L::COUNT;
    }
    let rest = keys[first..].windows(2);
    rest.into_iter().any(|pair| may_turn(pair[0], pair[1]))
}

/// Whether the sign of any key after the first of some is turned, or in doubt.
#[inline]
pub(crate) fn any_turns(keys: &[[f32; 4]]) -> bool {
    if keys.len() <= FEW {
        return (keys.windows(2)).any(|pair| may_turn(pair[0], pair[1]));
    }
    let mut turns = Turns { keys, any: false };
    in_lanes(&mut turns);
    turns.any
}

struct Turns<'a> {
    keys: &'a [[f32; 4]],
    any: bool,
}

impl InLanes for Turns<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        self.any = any_turns_in_lanes::<L>(self.keys);
    }
}
