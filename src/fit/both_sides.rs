//! A pair of numbers, one before and one after a curve's middle, with arithmetic on both.

use std::ops::{Add, Mul, Neg, Sub};

use crate::simd::lanes::Number;

/// A number before the middle and one after it. The operations on the two alternate: on one
/// side alone every operation would wait for the result of the one before it.
#[derive(Clone, Copy)]
pub(crate) struct Sides<N> {
    pub(crate) before: N,
    pub(crate) after: N,
}

impl<N: Number> Sides<N> {
    /// The same on both sides.
    #[inline(always)]
    pub(crate) fn same(number: N) -> Self {
        Self {
            before: number,
            after: number,
        }
    }
}

macro_rules! operator {
    ($operator:ident, $apply:ident) => {
        impl<N: Number> $operator for Sides<N> {
            type Output = Self;

            #[inline(always)]
            fn $apply(self, other: Self) -> Self {
                Self {
                    before: self.before.$apply(other.before),
                    after: self.after.$apply(other.after),
                }
            }
        }
    };
}

operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);

impl<N: Number> Neg for Sides<N> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            before: -self.before,
            after: -self.after,
        }
    }
}

impl<N: Number> Number for Sides<N> {
    #[inline(always)]
    fn all(value: f32) -> Self {
        Self::same(N::all(value))
    }

    #[inline(always)]
    fn canonical(self) -> Self {
        Self {
            before: self.before.canonical(),
            after: self.after.canonical(),
        }
    }
}
