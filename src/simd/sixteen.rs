//! Sixteen lanes of AVX-512.

use std::arch::x86_64::*;

use bytemuck::{Pod, Zeroable};

use crate::math::operators::operators;
use crate::shader::PolynomialSegment;
use crate::simd::cache_line::CacheLine;
use crate::simd::doubles::doubles;
use crate::simd::eight::{Eight, alike_at_any_width};
use crate::simd::lanes::{Choice, Lanes, Number};

/// Calls instructions of AVX-512.
macro_rules! avx512 {
    ($($work:tt)*) => {
        // SAFETY: `dispatch`, like the tests, uses `Sixteen` only where the processor has AVX-512.
        unsafe { $($work)* }
    };
}

/// Sixteen samples: 0 4 8 12 in the first quarter, 1 5 9 13 in the next, and so on. After a
/// transposition of each quarter four neighbouring rotations lie side by side.
#[derive(Clone, Copy, Zeroable, Pod)]
#[repr(transparent)]
pub(crate) struct Sixteen(__m512);

operators! {
    [] Sixteen, a, b:
    Add add => Self(avx512!(_mm512_add_ps(a.0, b.0)));
    Sub sub => Self(avx512!(_mm512_sub_ps(a.0, b.0)));
    Mul mul => Self(avx512!(_mm512_mul_ps(a.0, b.0)));
    - => Self(avx512!(_mm512_xor_ps(a.0, Self::all(-0.0).0)));
}

impl Number for Sixteen {
    #[inline(always)]
    fn all(value: f32) -> Self {
        Self(avx512!(_mm512_set1_ps(value)))
    }

    #[inline(always)]
    fn zero_below(self, limit: f32) -> Self {
        let limit = Self::all(limit);
        Self(avx512! {
            let whole = _mm512_cmp_ps_mask::<_CMP_NLT_UQ>(_mm512_abs_ps(self.0), limit.0);
            _mm512_maskz_mov_ps(whole, self.0)
        })
    }

    #[inline(always)]
    fn sign(self) -> Self {
        let (one, minus_one) = (Self::all(1.0), Self::all(-1.0));
        Self(avx512! {
            let below = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, _mm512_setzero_ps());
            _mm512_mask_blend_ps(below, one.0, minus_one.0)
        })
    }

    #[inline(always)]
    fn guess(self, seed: u32, shift: u32) -> Self {
        Self(avx512! {
            let bits = _mm512_castps_si512(self.0);
            let shifted = _mm512_srlv_epi32(bits, _mm512_set1_epi32(shift as i32));
            _mm512_castsi512_ps(_mm512_sub_epi32(_mm512_set1_epi32(seed as i32), shifted))
        })
    }
}

impl Choice for Sixteen {
    type Flags = __mmask16;

    #[inline(always)]
    fn at_most(self, limit: Self) -> __mmask16 {
        avx512!(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, limit.0))
    }

    #[inline(always)]
    fn equals(self, other: Self) -> __mmask16 {
        avx512!(_mm512_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, other.0))
    }

    #[inline(always)]
    fn has_bits(self, mask: u32) -> __mmask16 {
        avx512! {
            let mask = _mm512_set1_epi32(mask as i32);
            let bits = _mm512_and_si512(_mm512_castps_si512(self.0), mask);
            _mm512_cmpeq_epi32_mask(bits, mask)
        }
    }

    #[inline(always)]
    fn choose(flags: __mmask16, accept: Self, reject: Self) -> Self {
        Self(avx512!(_mm512_mask_blend_ps(flags, reject.0, accept.0)))
    }
}

/// A vector of two halves.
#[inline(always)]
fn joined(low: __m256, high: __m256) -> __m512 {
    avx512!(_mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high))
}

impl Sixteen {
    /// From the order of lanes to that of samples or back: the permutation is its own inverse.
    #[inline(always)]
    fn reordered(self) -> Self {
        Self(avx512! {
            let order = _mm512_setr_epi32(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
            _mm512_permutexvar_ps(order, self.0)
        })
    }

    /// A vector of the first quarters of all four vectors, one of the second quarters, and so on.
    #[inline(always)]
    fn quarters_exchanged([a, b, c, d]: [Self; 4]) -> [Self; 4] {
        avx512! {
            let ab_even = _mm512_shuffle_f32x4::<0b10_00_10_00>(a.0, b.0);
            let ab_odd = _mm512_shuffle_f32x4::<0b11_01_11_01>(a.0, b.0);
            let cd_even = _mm512_shuffle_f32x4::<0b10_00_10_00>(c.0, d.0);
            let cd_odd = _mm512_shuffle_f32x4::<0b11_01_11_01>(c.0, d.0);
            [
                Self(_mm512_shuffle_f32x4::<0b10_00_10_00>(ab_even, cd_even)),
                Self(_mm512_shuffle_f32x4::<0b10_00_10_00>(ab_odd, cd_odd)),
                Self(_mm512_shuffle_f32x4::<0b11_01_11_01>(ab_even, cd_even)),
                Self(_mm512_shuffle_f32x4::<0b11_01_11_01>(ab_odd, cd_odd)),
            ]
        }
    }

    /// A vector with a rotation in each quarter.
    #[inline(always)]
    fn of_four([a, b, c, d]: [[f32; 4]; 4]) -> Self {
        Self(avx512! {
            let low = _mm256_set_m128(bytemuck::cast(b), bytemuck::cast(a));
            let high = _mm256_set_m128(bytemuck::cast(d), bytemuck::cast(c));
            joined(low, high)
        })
    }
}

doubles!(
    SixteenDoubles: __m512d, avx512, _mm512_set1_pd, _mm512_add_pd, _mm512_sub_pd,
    _mm512_mul_pd, _mm512_div_pd, _mm512_sqrt_pd, _mm512_min_pd, _mm512_max_pd, up_to, are_at_most
);

#[inline(always)]
fn up_to(numbers: __m512d, limit: __m512d, then: __m512d, otherwise: __m512d) -> __m512d {
    avx512! {
        let within = _mm512_cmp_pd_mask::<_CMP_LE_OQ>(numbers, limit);
        _mm512_mask_blend_pd(within, otherwise, then)
    }
}

#[inline(always)]
fn are_at_most(numbers: __m512d, limit: __m512d) -> bool {
    avx512!(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(numbers, limit) == u8::MAX)
}

impl Lanes for Sixteen {
    type Narrow = Eight;
    type Rotations = [[f32; 4]; 16];
    type Doubles = SixteenDoubles;
    type Block = CacheLine;

    alike_at_any_width! {
        avx512, CacheLine, _mm512_permute_ps, _mm512_castps_pd, _mm512_castpd_ps, _mm512_unpacklo_ps,
        _mm512_unpackhi_ps, _mm512_unpacklo_pd, _mm512_unpackhi_pd, _mm512_max_ps, _mm512_stream_ps
    }

    #[inline(always)]
    fn rounded(SixteenDoubles([a, b]): SixteenDoubles) -> Self {
        Self(avx512!(joined(_mm512_cvtpd_ps(a), _mm512_cvtpd_ps(b)))).reordered()
    }

    #[inline(always)]
    fn widened(self) -> SixteenDoubles {
        let samples = self.reordered();
        SixteenDoubles(avx512! {
            let low = _mm512_castps512_ps256(samples.0);
            let high = _mm512_extractf32x8_ps::<1>(samples.0);
            [_mm512_cvtps_pd(low), _mm512_cvtps_pd(high)]
        })
    }

    #[inline(always)]
    fn load(samples: &[f32]) -> Self {
        let samples: [f32; 16] = *samples.first_chunk().expect("sixteen samples");
        Self(bytemuck::cast(samples)).reordered()
    }

    #[inline(always)]
    fn store(self, samples: &mut [f32]) {
        let stored: [f32; 16] = bytemuck::cast(self.reordered().0);
        samples.copy_from_slice(&stored);
    }

    #[inline(always)]
    fn gather_rotations(rotations: &[[f32; 4]], indices: &[u32]) -> [Self; 4] {
        let indices: &[u32; 16] = indices.first_chunk().expect("sixteen indices");
        // Written out without a closure, because closures are not always inlined.
        macro_rules! four {
            ($a:literal $b:literal $c:literal $d:literal) => {
                Self::of_four([
                    rotations[indices[$a] as usize],
                    rotations[indices[$b] as usize],
                    rotations[indices[$c] as usize],
                    rotations[indices[$d] as usize],
                ])
            };
        }
        Self::transposed([
            four!(0 1 2 3),
            four!(4 5 6 7),
            four!(8 9 10 11),
            four!(12 13 14 15),
        ])
    }

    #[inline(always)]
    fn repeated(rotation: [f32; 4]) -> Self {
        Self(avx512!(_mm512_broadcast_f32x4(bytemuck::cast(rotation))))
    }

    #[inline(always)]
    fn fourfold_of(samples: &[f32]) -> Self {
        let [a, b, c, d]: [f32; 4] = *samples.first_chunk().expect("four samples");
        Self(bytemuck::cast([[a; 4], [b; 4], [c; 4], [d; 4]]))
    }

    #[inline(always)]
    fn store_powers(powers: &[[Self; 4]], segments: &mut [PolynomialSegment], indices: &[usize]) {
        // One store writes four powers of a lane. If the number of powers is not a multiple of four, the last store
        // writes some powers a second time.
        for i in 0..powers.len().div_ceil(4) {
            let first = (4 * i).min(powers.len() - 4);
            let a = Self::transposed(powers[first]);
            let b = Self::transposed(powers[first + 1]);
            let c = Self::transposed(powers[first + 2]);
            let d = Self::transposed(powers[first + 3]);
            for quarter in 0..4 {
                let vectors = [a[quarter], b[quarter], c[quarter], d[quarter]];
                let vectors = Self::quarters_exchanged(vectors);
                for j in 0..4 {
                    let rotations: [[f32; 4]; 4] = bytemuck::cast(vectors[j].0);
                    let segment = &mut segments[indices[4 * quarter + j]];
                    segment.coefficients[first..first + 4].copy_from_slice(&rotations);
                }
            }
        }
    }

    #[inline(always)]
    fn behind(self, line: &CacheLine, count: usize) -> Self {
        let first = (1u32 << (4 * count)) - 1;
        let line = Self::of_block(line);
        Self(avx512!(_mm512_mask_blend_ps(first as u16, self.0, line.0)))
    }

    #[inline(always)]
    fn magnitude(self) -> Self {
        Self(avx512!(_mm512_abs_ps(self.0)))
    }

    #[inline(always)]
    fn any_at_most(self, limit: f32) -> bool {
        self.at_most(Self::all(limit)) != 0
    }
}
