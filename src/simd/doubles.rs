//! Vectors of f64, of as many samples as a vector of f32 has: two vectors, each with half of the samples.

#[cfg(not(target_arch = "x86_64"))]
use std::ops::{Add, Div, Mul, Sub};
use std::slice;

use bytemuck::Pod;
use glam::Vec4;

use crate::math::quaternion::FullRange;
use pair::Pair;

/// As many numbers in f64 as a vector of f32 has lanes, in the order of samples; or a single one.
pub(crate) trait Doubles: FullRange + Pod {
    /// Number of samples.
    const COUNT: usize = size_of::<Self>() / size_of::<f64>();

    /// Loads as many numbers as there are lanes.
    #[inline(always)]
    fn load(numbers: &[f64]) -> Self {
        bytemuck::pod_read_unaligned(bytemuck::cast_slice(&numbers[..Self::COUNT]))
    }

    /// Stores to the first numbers, one for each lane.
    #[inline(always)]
    fn store(self, numbers: &mut [f64]) {
        numbers[..Self::COUNT].copy_from_slice(bytemuck::cast_slice(slice::from_ref(&self)));
    }

    /// Whether every number is at most `limit`, and none is NaN.
    fn are_at_most(self, limit: f64) -> bool;
}

impl Doubles for f64 {
    #[inline(always)]
    fn are_at_most(self, limit: f64) -> bool {
        self <= limit
    }
}

/// Defines a pair of vectors of f64 from functions of one vector, which the macro `$run` calls.
macro_rules! doubles {
    ($name:ident: $vector:ident, $run:ident, $all:path, $add:path, $sub:path,
     $mul:path, $div:path, $root:path, $min:path, $max:path, $up_to:path, $are_at_most:path) => {
        /// As many f64 as the vector of f32 has lanes.
        #[derive(Clone, Copy, bytemuck::Zeroable, bytemuck::Pod)]
        #[repr(transparent)]
        pub(crate) struct $name(pub(crate) [$vector; 2]);

        $crate::math::operators::operators! {
            [] $name, x, y:
            Add add => Self($run!([$add(x.0[0], y.0[0]), $add(x.0[1], y.0[1])]));
            Sub sub => Self($run!([$sub(x.0[0], y.0[0]), $sub(x.0[1], y.0[1])]));
            Mul mul => Self($run!([$mul(x.0[0], y.0[0]), $mul(x.0[1], y.0[1])]));
            Div div => Self($run!([$div(x.0[0], y.0[0]), $div(x.0[1], y.0[1])]));
            // Compilers turn this into a change of the sign bit. 0 - x would be wrong for 0: it gives +0.
            - => Self($run!([$sub($all(-0.0), x.0[0]), $sub($all(-0.0), x.0[1])]));
        }

        impl $crate::math::quaternion::Real for $name {
            #[inline(always)]
            fn all(value: f64) -> Self {
                Self([$run!($all(value)); 2])
            }

            #[inline(always)]
            fn root(self) -> Self {
                let Self([a, b]) = self;
                Self($run!([$root(a), $root(b)]))
            }

            #[inline(always)]
            fn smaller(self, Self([c, d]): Self) -> Self {
                let Self([a, b]) = self;
                Self($run!([$min(a, c), $min(b, d)]))
            }

            #[inline(always)]
            fn larger(self, Self([c, d]): Self) -> Self {
                let Self([a, b]) = self;
                Self($run!([$max(a, c), $max(b, d)]))
            }

            #[inline(always)]
            fn up_to(self, limit: Self, then: Self, otherwise: Self) -> Self {
                let ([a, b], [c, d]) = (self.0, limit.0);
                let ([e, f], [g, h]) = (then.0, otherwise.0);
                Self([$up_to(a, c, e, g), $up_to(b, d, f, h)])
            }
        }

        impl $crate::math::quaternion::FullRange for $name {
            #[inline(always)]
            fn each(self, function: impl Fn(f64) -> (f64, f64)) -> (Self, Self) {
                const LANES: usize = size_of::<$name>() / size_of::<f64>();
                let mut first: [f64; LANES] = bytemuck::cast(self);
                let mut second = [0.0; LANES];
                for (first, second) in first.iter_mut().zip(&mut second) {
                    (*first, *second) = function(*first);
                }
                (bytemuck::cast(first), bytemuck::cast(second))
            }
        }

        impl $crate::simd::doubles::Doubles for $name {
            #[inline(always)]
            fn are_at_most(self, limit: f64) -> bool {
                let Self([a, b]) = self;
                let limit = $run!($all(limit));
                $are_at_most(a, limit) && $are_at_most(b, limit)
            }
        }
    };
}
#[cfg(wide_vectors)]
pub(crate) use doubles;

/// Calls instructions that every processor of the target has.
#[cfg(target_arch = "x86_64")]
macro_rules! baseline {
    ($($work:tt)*) => {
        // SAFETY: every x86-64 processor has SSE2.
        unsafe { $($work)* }
    };
}
#[cfg(not(target_arch = "x86_64"))]
macro_rules! baseline {
    ($work:expr) => {
        $work
    };
}

#[cfg(target_arch = "x86_64")]
doubles!(
    Four: Pair, baseline, pair::all, pair::add, pair::sub, pair::mul, pair::div, pair::root,
    pair::smaller, pair::larger, pair::up_to, pair::are_at_most
);
#[cfg(not(target_arch = "x86_64"))]
doubles!(
    Four: Pair, baseline, Pair::splat, Add::add, Sub::sub, Mul::mul, Div::div, pair::root,
    pair::smaller, pair::larger, pair::up_to, pair::are_at_most
);

/// Vectors of two f64, by the instructions of SSE2.
#[cfg(target_arch = "x86_64")]
pub(crate) mod pair {
    use std::arch::x86_64::*;
    pub(crate) use std::arch::x86_64::{
        __m128d as Pair, _mm_add_pd as add, _mm_div_pd as div, _mm_max_pd as larger,
        _mm_min_pd as smaller, _mm_mul_pd as mul, _mm_set1_pd as all, _mm_sqrt_pd as root,
        _mm_sub_pd as sub,
    };

    use super::Vec4;

    #[inline(always)]
    pub(crate) fn up_to(numbers: Pair, limit: Pair, then: Pair, otherwise: Pair) -> Pair {
        baseline! {
            let within = _mm_cmple_pd(numbers, limit);
            _mm_or_pd(_mm_and_pd(within, then), _mm_andnot_pd(within, otherwise))
        }
    }

    #[inline(always)]
    pub(crate) fn are_at_most(numbers: Pair, limit: Pair) -> bool {
        baseline!(_mm_movemask_pd(_mm_cmple_pd(numbers, limit)) == 0b11)
    }

    #[inline(always)]
    pub(crate) fn rounded([a, b]: [Pair; 2]) -> Vec4 {
        Vec4::from(baseline!(_mm_movelh_ps(_mm_cvtpd_ps(a), _mm_cvtpd_ps(b))))
    }

    #[inline(always)]
    pub(crate) fn widened(numbers: Vec4) -> [Pair; 2] {
        let numbers = __m128::from(numbers);
        baseline!([
            _mm_cvtps_pd(numbers),
            _mm_cvtps_pd(_mm_movehl_ps(numbers, numbers))
        ])
    }
}

/// Vectors of two f64 on other targets, by glam's portable type.
#[cfg(not(target_arch = "x86_64"))]
pub(crate) mod pair {
    pub(crate) use glam::DVec2 as Pair;

    use super::Vec4;

    #[inline(always)]
    pub(crate) fn root(numbers: Pair) -> Pair {
        Pair::new(numbers.x.sqrt(), numbers.y.sqrt())
    }

    #[inline(always)]
    pub(crate) fn smaller(a: Pair, b: Pair) -> Pair {
        Pair::select(a.cmplt(b), a, b)
    }

    #[inline(always)]
    pub(crate) fn larger(a: Pair, b: Pair) -> Pair {
        Pair::select(a.cmpgt(b), a, b)
    }

    #[inline(always)]
    pub(crate) fn up_to(numbers: Pair, limit: Pair, then: Pair, otherwise: Pair) -> Pair {
        Pair::select(numbers.cmple(limit), then, otherwise)
    }

    #[inline(always)]
    pub(crate) fn are_at_most(numbers: Pair, limit: Pair) -> bool {
        numbers.cmple(limit).all()
    }

    #[inline(always)]
    pub(crate) fn rounded([a, b]: [Pair; 2]) -> Vec4 {
        Vec4::new(a.x as f32, a.y as f32, b.x as f32, b.y as f32)
    }

    #[inline(always)]
    pub(crate) fn widened(numbers: Vec4) -> [Pair; 2] {
        let [x, y, z, w] = numbers.to_array().map(f64::from);
        [Pair::new(x, y), Pair::new(z, w)]
    }
}
