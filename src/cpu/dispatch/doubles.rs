//! [`Doubles`](crate::cpu::lanes::Doubles) as two vectors, each with half of the samples.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{
    __m128d as Pair, _mm_add_pd as add, _mm_cmple_pd, _mm_cvtpd_ps, _mm_max_pd as larger,
    _mm_movelh_ps, _mm_movemask_pd, _mm_mul_pd as mul, _mm_set1_pd as all, _mm_sub_pd as sub,
};

#[cfg(not(target_arch = "x86_64"))]
use glam::DVec2 as Pair;
use glam::Vec4;

/// Makes two vectors of so many numbers by these functions of one, which `$run` calls.
macro_rules! doubles {
    ($name:ident: $vector:ident, $count:literal, $run:ident, $all:path, $add:path, $sub:path,
     $mul:path, $max:path, $are_at_most:path) => {
        /// As many numbers as a vector of f32 has lanes.
        #[derive(Clone, Copy)]
        pub(crate) struct $name(pub(super) [$vector; 2]);

        impl std::ops::Add for $name {
            type Output = Self;

            #[inline(always)]
            fn add(self, Self([c, d]): Self) -> Self {
                let Self([a, b]) = self;
                Self($run!([$add(a, c), $add(b, d)]))
            }
        }

        impl std::ops::Sub for $name {
            type Output = Self;

            #[inline(always)]
            fn sub(self, Self([c, d]): Self) -> Self {
                let Self([a, b]) = self;
                Self($run!([$sub(a, c), $sub(b, d)]))
            }
        }

        impl std::ops::Mul for $name {
            type Output = Self;

            #[inline(always)]
            fn mul(self, Self([c, d]): Self) -> Self {
                let Self([a, b]) = self;
                Self($run!([$mul(a, c), $mul(b, d)]))
            }
        }

        impl $crate::branchless::Real for $name {
            #[inline(always)]
            fn all(value: f64) -> Self {
                Self([$run!($all(value)); 2])
            }
        }

        impl $crate::cpu::lanes::Doubles for $name {
            #[inline(always)]
            fn load(numbers: &[f64]) -> Self {
                let own: [f64; 2 * $count] = *numbers.first_chunk().expect("enough numbers");
                Self(bytemuck::cast(own))
            }

            #[inline(always)]
            fn store(self, numbers: &mut [f64]) {
                let own: [f64; 2 * $count] = bytemuck::cast(self.0);
                numbers[..2 * $count].copy_from_slice(&own);
            }

            #[inline(always)]
            fn larger(self, Self([c, d]): Self) -> Self {
                let Self([a, b]) = self;
                Self($run!([$max(a, c), $max(b, d)]))
            }

            #[inline(always)]
            fn are_at_most(self, limit: f64) -> bool {
                let Self([a, b]) = self;
                $run!({
                    let limit = $all(limit);
                    $are_at_most(a, limit) && $are_at_most(b, limit)
                })
            }
        }
    };
}
pub(super) use doubles;

/// What every processor of the target does.
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
doubles!(Four: Pair, 2, baseline, all, add, sub, mul, larger, are_at_most);
#[cfg(not(target_arch = "x86_64"))]
doubles!(
    Four: Pair, 2, baseline, Pair::splat, std::ops::Add::add, std::ops::Sub::sub,
    std::ops::Mul::mul, larger, are_at_most
);

impl Four {
    /// Rounded to f32.
    #[inline(always)]
    pub(crate) fn rounded(self) -> Vec4 {
        let Self([a, b]) = self;
        rounded(a, b)
    }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn are_at_most(numbers: Pair, limit: Pair) -> bool {
    baseline!(_mm_movemask_pd(_mm_cmple_pd(numbers, limit)) == 0b11)
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn rounded(a: Pair, b: Pair) -> Vec4 {
    Vec4::from(baseline!(_mm_movelh_ps(_mm_cvtpd_ps(a), _mm_cvtpd_ps(b))))
}

#[cfg(not(target_arch = "x86_64"))]
use pair::{are_at_most, larger, rounded};

#[cfg(not(target_arch = "x86_64"))]
mod pair {
    use super::{Pair, Vec4};

    #[inline(always)]
    pub(super) fn larger(own: Pair, other: Pair) -> Pair {
        Pair::select(own.cmpgt(other), own, other)
    }

    #[inline(always)]
    pub(super) fn are_at_most(numbers: Pair, limit: Pair) -> bool {
        numbers.cmple(limit).all()
    }

    #[inline(always)]
    pub(super) fn rounded(a: Pair, b: Pair) -> Vec4 {
        Vec4::new(a.x as f32, a.y as f32, b.x as f32, b.y as f32)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::branchless::Real;
    use crate::cpu::lanes::{Doubles, Lanes};

    /// Catches halves that are mixed up, and a comparison that sees only one of them.
    pub(crate) fn doubles_are_samples<L: Lanes>() {
        let numbers: Vec<f64> = (0..L::COUNT).map(|k| 0.1 * (k * k) as f64 - 0.7).collect();
        let found = L::Doubles::load(&numbers);
        let two = L::Doubles::all(2.0);
        let mut stored = vec![0.0; L::COUNT];
        let mut rounded = vec![0.0; L::COUNT];
        L::rounded(found).store(&mut rounded);
        type Same = fn(f64) -> f64;
        let cases: [(L::Doubles, Same); 5] = [
            (found, |x| x),
            (found + two, |x| x + 2.0),
            (found - two, |x| x - 2.0),
            (found * two, |x| x * 2.0),
            (found.larger(two - two), |x| if x > 0.0 { x } else { 0.0 }),
        ];
        for (doubles, same) in cases {
            doubles.store(&mut stored);
            assert!(stored.iter().copied().eq(numbers.iter().copied().map(same)));
        }
        for (number, rounded) in numbers.iter().zip(rounded) {
            assert_eq!(*number as f32, rounded);
        }
        for k in 0..L::COUNT {
            for other in [4.5, f64::NAN] {
                let mut all = vec![4.0; L::COUNT];
                assert!(L::Doubles::load(&all).are_at_most(4.0));
                all[k] = other;
                assert!(!L::Doubles::load(&all).are_at_most(4.0));
                let larger = L::Doubles::load(&all).larger(two);
                larger.store(&mut stored);
                assert_eq!(stored[k], if other > 2.0 { other } else { 2.0 });
            }
        }
    }

    #[test]
    fn four_doubles_are_samples() {
        doubles_are_samples::<Vec4>();
    }
}
