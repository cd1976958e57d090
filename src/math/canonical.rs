//! Rounding of numbers for kernels, the same on every machine: all input of kernels is made [`canonical`], so that
//! drivers never process subnormal numbers.

use crate::shader::TINY_BITS;

/// Replaces a magnitude below 2^-64 by +0, in inputs and outputs of kernels. Drivers may flush subnormals, which are
/// below 2^-126: the remaining numbers are at least 2^62 times as large. Twin: `shaders/math/canonical.wgsl`.
#[inline(always)]
pub(crate) fn canonical(value: f32) -> f32 {
    let magnitude = value.to_bits() & 0x7fff_ffff;
    if magnitude < TINY_BITS { 0.0 } else { value }
}

/// At this magnitude neighbouring f64 numbers are 1 apart, so that adding it rounds the fraction away.
pub(super) const SHIFT: f64 = 1.5 * (1u64 << 52) as f64;

/// The whole number nearest to `x`, for |x| < 2^51. A call of `round` would take longer than the
/// rest of a loop that uses it.
#[inline(always)]
pub(crate) fn nearest_whole(x: f64) -> f64 {
    (x + SHIFT) - SHIFT
}

/// A whole number below 2^51 as an integer. Rust's `as` saturates, which takes branches.
#[inline(always)]
pub(crate) fn whole_number(x: f64) -> i64 {
    (x + SHIFT).to_bits() as i64 - SHIFT.to_bits() as i64
}

/// Rounds to f32 and makes the result canonical.
#[inline(always)]
pub(crate) fn round_f32(value: f64) -> f32 {
    canonical(value as f32)
}

/// The largest power of two that does not exceed a magnitude; 1 if the magnitude is very small.
pub(crate) fn power_of_two(magnitude: f64) -> f64 {
    if magnitude > 1e-30 {
        f64::from_bits(magnitude.to_bits() & (0x7ff << 52))
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiny_values_become_positive_zero() {
        assert_eq!(canonical(-0.0).to_bits(), 0);
        let tiny = f32::from_bits(TINY_BITS);
        assert_eq!(canonical(tiny.next_down()).to_bits(), 0);
        assert_eq!(canonical(-tiny), -tiny);
    }
}
