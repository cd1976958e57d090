//! Eight lanes of AVX2.

use std::arch::x86_64::*;

use bytemuck::{Pod, Zeroable};

use crate::math::operators::operators;
use crate::simd::doubles::doubles;
use crate::simd::lanes::{Choice, Lanes, Number};

/// Calls instructions of AVX2.
macro_rules! avx2 {
    ($($work:tt)*) => {
        // SAFETY: `dispatch`, like the tests, uses `Eight` only where the processor has AVX2.
        unsafe { $($work)* }
    };
}

/// The methods of [`Lanes`] that differ only in the width of their instructions, which the macro `$run` calls.
macro_rules! alike_at_any_width {
    ($run:ident, $block:ty, $permute:ident, $to_doubles:ident, $to_floats:ident, $low:ident,
     $high:ident, $low_pair:ident, $high_pair:ident, $larger:ident, $stream:ident) => {
        #[inline(always)]
        fn fourfold(self) -> [Self; 4] {
            // The order of lanes is such that nothing crosses between the parts of four.
            $run! {
                [
                    Self($permute::<0b00_00_00_00>(self.0)),
                    Self($permute::<0b01_01_01_01>(self.0)),
                    Self($permute::<0b10_10_10_10>(self.0)),
                    Self($permute::<0b11_11_11_11>(self.0)),
                ]
            }
        }

        #[inline(always)]
        fn transposed([a, b, c, d]: [Self; 4]) -> [Self; 4] {
            // Written out without a closure, because closures are not always inlined.
            $run! {
                let (ab_low, ab_high) = ($to_doubles($low(a.0, b.0)), $to_doubles($high(a.0, b.0)));
                let (cd_low, cd_high) = ($to_doubles($low(c.0, d.0)), $to_doubles($high(c.0, d.0)));
                [
                    Self($to_floats($low_pair(ab_low, cd_low))),
                    Self($to_floats($high_pair(ab_low, cd_low))),
                    Self($to_floats($low_pair(ab_high, cd_high))),
                    Self($to_floats($high_pair(ab_high, cd_high))),
                ]
            }
        }

        #[inline(always)]
        fn store_past_caches(self, block: &mut $block) {
            // The block is aligned as this instruction demands.
            $run!($stream(std::ptr::from_mut(block).cast(), self.0));
        }

        #[inline(always)]
        fn larger(self, other: Self) -> Self {
            Self($run!($larger(self.0, other.0)))
        }
    };
}
pub(crate) use alike_at_any_width;

/// Eight samples: 0 2 4 6 in one half and 1 3 5 7 in the other. After a transposition of each half
/// two neighbouring rotations lie side by side, without an exchange between the halves.
#[derive(Clone, Copy, Zeroable, Pod)]
#[repr(transparent)]
pub(crate) struct Eight(__m256);

/// Two rotations, half of a cache line.
#[derive(Clone, Copy, Zeroable, Pod)]
#[repr(C, align(32))]
pub(crate) struct HalfLine([[f32; 4]; 2]);

operators! {
    [] Eight, a, b:
    Add add => Self(avx2!(_mm256_add_ps(a.0, b.0)));
    Sub sub => Self(avx2!(_mm256_sub_ps(a.0, b.0)));
    Mul mul => Self(avx2!(_mm256_mul_ps(a.0, b.0)));
    - => Self(avx2!(_mm256_xor_ps(a.0, Self::all(-0.0).0)));
}

impl Number for Eight {
    #[inline(always)]
    fn all(value: f32) -> Self {
        Self(avx2!(_mm256_set1_ps(value)))
    }

    #[inline(always)]
    fn zero_below(self, limit: f32) -> Self {
        let (magnitude, limit) = (self.magnitude(), Self::all(limit));
        Self(avx2! {
            let whole = _mm256_cmp_ps::<_CMP_NLT_UQ>(magnitude.0, limit.0);
            _mm256_and_ps(self.0, whole)
        })
    }

    #[inline(always)]
    fn sign(self) -> Self {
        let (one, minus_one) = (Self::all(1.0), Self::all(-1.0));
        Self(avx2! {
            let below = _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, _mm256_setzero_ps());
            _mm256_blendv_ps(one.0, minus_one.0, below)
        })
    }

    #[inline(always)]
    fn guess(self, seed: u32, shift: u32) -> Self {
        Self(avx2! {
            let bits = _mm256_castps_si256(self.0);
            let shifted = _mm256_srlv_epi32(bits, _mm256_set1_epi32(shift as i32));
            _mm256_castsi256_ps(_mm256_sub_epi32(_mm256_set1_epi32(seed as i32), shifted))
        })
    }
}

/// Bits that are all 1 where the answer is yes, else 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EightFlags(__m256);

impl std::ops::BitAnd for EightFlags {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(avx2!(_mm256_and_ps(self.0, other.0)))
    }
}

impl std::ops::Not for EightFlags {
    type Output = Self;

    #[inline(always)]
    fn not(self) -> Self {
        Self(avx2! {
            let all = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
            _mm256_xor_ps(self.0, all)
        })
    }
}

impl Choice for Eight {
    type Flags = EightFlags;

    #[inline(always)]
    fn at_most(self, limit: Self) -> EightFlags {
        EightFlags(avx2!(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, limit.0)))
    }

    #[inline(always)]
    fn equals(self, other: Self) -> EightFlags {
        EightFlags(avx2!(_mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0)))
    }

    #[inline(always)]
    fn has_bits(self, mask: u32) -> EightFlags {
        EightFlags(avx2! {
            let mask = _mm256_set1_epi32(mask as i32);
            let bits = _mm256_and_si256(_mm256_castps_si256(self.0), mask);
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(bits, mask))
        })
    }

    #[inline(always)]
    fn choose(flags: EightFlags, accept: Self, reject: Self) -> Self {
        Self(avx2!(_mm256_blendv_ps(reject.0, accept.0, flags.0)))
    }
}

impl Eight {
    /// A vector with a rotation in each half.
    #[inline(always)]
    fn of_two(first: [f32; 4], second: [f32; 4]) -> Self {
        Self(avx2!(_mm256_set_m128(
            bytemuck::cast(second),
            bytemuck::cast(first)
        )))
    }
}

doubles!(
    EightDoubles: __m256d, avx2, _mm256_set1_pd, _mm256_add_pd, _mm256_sub_pd,
    _mm256_mul_pd, _mm256_div_pd, _mm256_sqrt_pd, _mm256_min_pd, _mm256_max_pd, up_to, are_at_most
);

#[inline(always)]
fn up_to(numbers: __m256d, limit: __m256d, then: __m256d, otherwise: __m256d) -> __m256d {
    avx2! {
        let within = _mm256_cmp_pd::<_CMP_LE_OQ>(numbers, limit);
        _mm256_blendv_pd(otherwise, then, within)
    }
}

#[inline(always)]
fn are_at_most(numbers: __m256d, limit: __m256d) -> bool {
    avx2! {
        let within = _mm256_cmp_pd::<_CMP_LE_OQ>(numbers, limit);
        _mm256_movemask_pd(within) == 0b1111
    }
}

impl Lanes for Eight {
    type Narrow = Self;
    type Rotations = [[f32; 4]; 8];
    type Doubles = EightDoubles;
    type Block = HalfLine;

    alike_at_any_width! {
        avx2, HalfLine, _mm256_permute_ps, _mm256_castps_pd, _mm256_castpd_ps, _mm256_unpacklo_ps,
        _mm256_unpackhi_ps, _mm256_unpacklo_pd, _mm256_unpackhi_pd, _mm256_max_ps, _mm256_stream_ps
    }

    #[inline(always)]
    fn rounded(EightDoubles([a, b]): EightDoubles) -> Self {
        Self(avx2! {
            let samples = _mm256_set_m128(_mm256_cvtpd_ps(b), _mm256_cvtpd_ps(a));
            _mm256_permutevar8x32_ps(samples, _mm256_setr_epi32(0, 2, 4, 6, 1, 3, 5, 7))
        })
    }

    #[inline(always)]
    fn widened(self) -> EightDoubles {
        EightDoubles(avx2! {
            let order = _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7);
            let samples = _mm256_permutevar8x32_ps(self.0, order);
            let (low, high) = (
                _mm256_castps256_ps128(samples),
                _mm256_extractf128_ps::<1>(samples),
            );
            [_mm256_cvtps_pd(low), _mm256_cvtps_pd(high)]
        })
    }

    #[inline(always)]
    fn load(samples: &[f32]) -> Self {
        let samples: [f32; 8] = *samples.first_chunk().expect("eight samples");
        Self(avx2! {
            let order = _mm256_setr_epi32(0, 2, 4, 6, 1, 3, 5, 7);
            _mm256_permutevar8x32_ps(bytemuck::cast(samples), order)
        })
    }

    #[inline(always)]
    fn store(self, samples: &mut [f32]) {
        let stored = avx2! {
            let order = _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7);
            _mm256_permutevar8x32_ps(self.0, order)
        };
        samples.copy_from_slice(&bytemuck::cast::<_, [f32; 8]>(stored));
    }

    #[inline(always)]
    fn gather_rotations(rotations: &[[f32; 4]], indices: &[u32]) -> [Self; 4] {
        let [a, b, c, d, e, f, g, h]: [u32; 8] = *indices.first_chunk().expect("eight indices");
        // Written out without a closure, because closures are not always inlined.
        Self::transposed([
            Self::of_two(rotations[a as usize], rotations[b as usize]),
            Self::of_two(rotations[c as usize], rotations[d as usize]),
            Self::of_two(rotations[e as usize], rotations[f as usize]),
            Self::of_two(rotations[g as usize], rotations[h as usize]),
        ])
    }

    #[inline(always)]
    fn repeated(rotation: [f32; 4]) -> Self {
        Self::of_two(rotation, rotation)
    }

    #[inline(always)]
    fn fourfold_of(samples: &[f32]) -> Self {
        let [a, b]: [f32; 2] = *samples.first_chunk().expect("two samples");
        Self::of_two([a; 4], [b; 4])
    }

    #[inline(always)]
    fn behind(self, half: &HalfLine, count: usize) -> Self {
        let lane_numbers = Self(bytemuck::cast([0.0f32, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]));
        let (half, end) = (Self::of_block(half), Self::all((4 * count) as f32));
        Self(avx2! {
            let is_first = _mm256_cmp_ps::<_CMP_LT_OQ>(lane_numbers.0, end.0);
            _mm256_blendv_ps(self.0, half.0, is_first)
        })
    }

    #[inline(always)]
    fn magnitude(self) -> Self {
        let magnitude = Self::all(f32::from_bits(i32::MAX as u32));
        Self(avx2!(_mm256_and_ps(self.0, magnitude.0)))
    }

    #[inline(always)]
    fn any_at_most(self, limit: f32) -> bool {
        let within = self.at_most(Self::all(limit));
        avx2!(_mm256_movemask_ps(within.0) != 0)
    }
}
