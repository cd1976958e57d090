//! Several vectors that are processed together. In a long chain of operations each waits for the previous result.
//! Here the same operation of the other vectors follows, so that a processor need not look far ahead for independent
//! operations.

use std::ops::{Add, Mul, Neg, Sub};

use crate::simd::lanes::{Lanes, Number};

/// Vectors side by side; each operation is applied to all of them.
#[derive(Clone, Copy)]
pub(crate) struct Together<L, const VECTORS: usize>(pub(crate) [L; VECTORS]);

/// Repeats an expression for each vector, up to eight. It is written out, because with a loop for each operation
/// these functions would take much longer to compile than all others.
macro_rules! for_each_vector {
    ($v:ident: $body:expr) => {
        for_each_vector!(@0 1 2 3 4 5 6 7; $v: $body)
    };
    (@$($index:literal)+; $v:ident: $body:expr) => {
        const { assert!(VECTORS <= 8) };
        $(if VECTORS > $index {
            let $v = $index;
            $body;
        })+
    };
}

/// Functions that call the function of the same name for each vector. They are written out without closures, whose
/// bodies would not be compiled for the vector width.
macro_rules! of_each {
    ($($of:ident $name:ident($($other:ident),*; $($value:ident: $type:ty),*);)+) => {
        $(of_each!(@$of $name, ($($other),*), ($($value: $type),*));)+
    };
    (@function $name:ident, ($($other:ident),*), ($($value:ident: $type:ty),*)) => {
        #[inline(always)]
        fn $name(mut self $(, $value: $type)*) -> Self {
            for_each_vector!(v: self.0[v] = self.0[v].$name($($value),*));
            self
        }
    };
    (@operator $name:ident, ($other:ident), ()) => {
        #[inline(always)]
        fn $name(mut self, $other: Self) -> Self {
            for_each_vector!(v: self.0[v] = self.0[v].$name($other.0[v]));
            self
        }
    };
}

impl<L: Lanes, const VECTORS: usize> Add for Together<L, VECTORS> {
    type Output = Self;
    of_each! { operator add(other;); }
}

impl<L: Lanes, const VECTORS: usize> Sub for Together<L, VECTORS> {
    type Output = Self;
    of_each! { operator sub(other;); }
}

impl<L: Lanes, const VECTORS: usize> Mul for Together<L, VECTORS> {
    type Output = Self;
    of_each! { operator mul(other;); }
}

impl<L: Lanes, const VECTORS: usize> Neg for Together<L, VECTORS> {
    type Output = Self;
    of_each! { function neg(;); }
}

impl<L: Lanes, const VECTORS: usize> Number for Together<L, VECTORS> {
    #[inline(always)]
    fn all(value: f32) -> Self {
        Self([L::all(value); VECTORS])
    }

    of_each! {
        function zero_below(; limit: f32);
        function sign(;);
        function guess(; seed: u32, shift: u32);
    }
}

impl<L: Lanes> Together<L, 2> {
    /// Puts the components of two vectors of rotations together, `x y z w` each.
    #[inline(always)]
    pub(crate) fn of_rotations(a: [L; 4], b: [L; 4]) -> [Self; 4] {
        [
            Self([a[0], b[0]]),
            Self([a[1], b[1]]),
            Self([a[2], b[2]]),
            Self([a[3], b[3]]),
        ]
    }

    /// The inverse of [`Self::of_rotations`]: the components of each vector.
    #[inline(always)]
    pub(crate) fn rotations([x, y, z, w]: [Self; 4]) -> [[L; 4]; 2] {
        [
            [x.0[0], y.0[0], z.0[0], w.0[0]],
            [x.0[1], y.0[1], z.0[1], w.0[1]],
        ]
    }
}

impl<L: Lanes, const VECTORS: usize> Together<L, VECTORS> {
    /// `then` where a number is `value`, else `otherwise`.
    #[inline(always)]
    pub(crate) fn where_equal(self, value: f32, then: Self, mut otherwise: Self) -> Self {
        for_each_vector!(v: otherwise.0[v] = self.0[v].where_equal(value, then.0[v], otherwise.0[v]));
        otherwise
    }

    /// Whether any number is at least `limit`.
    #[inline(always)]
    pub(crate) fn any_at_least(self, limit: f32) -> bool {
        let mut largest = self.0[0];
        for_each_vector!(v: largest = largest.larger(self.0[v]));
        (-largest).any_at_most(-limit)
    }
}
