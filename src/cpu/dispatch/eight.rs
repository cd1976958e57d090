//! Eight lanes of AVX2.

use std::arch::x86_64::{
    __m256, _CMP_NLT_UQ, _mm256_add_ps, _mm256_and_ps, _mm256_castps_pd, _mm256_cmp_ps,
    _mm256_mul_ps, _mm256_permutevar8x32_ps, _mm256_set1_ps, _mm256_setr_epi32, _mm256_unpackhi_pd,
    _mm256_unpackhi_ps, _mm256_unpacklo_pd, _mm256_unpacklo_ps,
};
use std::ops::{Add, Mul};

use crate::cpu::lanes::{Lanes, Number};
use crate::segment::shader::TINY_BITS;

// SAFETY of every block here: only functions that are compiled for AVX2 use this type, and
// those run where the processor has it (`Kernels::new`).

/// Samples 0 2 4 6 in one half and 1 3 5 7 in the other: so two neighbours lie side by side
/// when each half has been transposed, and the halves need not be exchanged.
#[derive(Clone, Copy)]
pub(super) struct Eight(__m256);

impl Add for Eight {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(unsafe { _mm256_add_ps(self.0, other.0) })
    }
}

impl Mul for Eight {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(unsafe { _mm256_mul_ps(self.0, other.0) })
    }
}

impl Number for Eight {
    #[inline(always)]
    fn all(value: f32) -> Self {
        Self(unsafe { _mm256_set1_ps(value) })
    }
}

impl Lanes for Eight {
    const COUNT: usize = 8;

    #[inline(always)]
    fn load(samples: &[f32]) -> Self {
        let samples: [f32; 8] = *samples.first_chunk().expect("eight samples");
        Self(unsafe {
            let order = _mm256_setr_epi32(0, 2, 4, 6, 1, 3, 5, 7);
            _mm256_permutevar8x32_ps(bytemuck::cast(samples), order)
        })
    }

    #[inline(always)]
    fn canonical(self) -> Self {
        Self(unsafe {
            let magnitude = _mm256_and_ps(self.0, _mm256_set1_ps(f32::from_bits(!(1 << 31))));
            let tiny = _mm256_set1_ps(f32::from_bits(TINY_BITS));
            _mm256_and_ps(self.0, _mm256_cmp_ps::<_CMP_NLT_UQ>(magnitude, tiny))
        })
    }

    #[inline(always)]
    fn store([x, y, z, w]: [Self; 4], rotations: &mut [[f32; 4]]) {
        // Written out: closures are not always inlined.
        let pairs = unsafe {
            let xy_low = _mm256_castps_pd(_mm256_unpacklo_ps(x.0, y.0));
            let xy_high = _mm256_castps_pd(_mm256_unpackhi_ps(x.0, y.0));
            let zw_low = _mm256_castps_pd(_mm256_unpacklo_ps(z.0, w.0));
            let zw_high = _mm256_castps_pd(_mm256_unpackhi_ps(z.0, w.0));
            [
                _mm256_unpacklo_pd(xy_low, zw_low),
                _mm256_unpackhi_pd(xy_low, zw_low),
                _mm256_unpacklo_pd(xy_high, zw_high),
                _mm256_unpackhi_pd(xy_high, zw_high),
            ]
        };
        let pairs: [[f32; 4]; 8] = bytemuck::cast(pairs);
        rotations.copy_from_slice(&pairs);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::VectorWidth;
    use crate::cpu::lanes::tests::lanes_are_samples;

    #[test]
    fn eight_lanes_are_samples() {
        if VectorWidth::available().contains(&VectorWidth::Avx2) {
            lanes_are_samples::<Eight>();
        }
    }
}
