//! What the twins compute with: the number of one sample, or those of several in one vector.

use std::ops::{Add, Mul};

use glam::{Mat4, Vec4};

use crate::segment::shader::TINY_BITS;

/// A number of one sample, or of several. Whatever it is of, an operation rounds alike.
pub(crate) trait Number: Copy + Add<Output = Self> + Mul<Output = Self> {
    /// The same for every sample.
    fn all(value: f32) -> Self;
}

impl Number for f32 {
    #[inline(always)]
    fn all(value: f32) -> Self {
        value
    }
}

/// The numbers of several consecutive samples, in an order of their own.
pub(crate) trait Lanes: Number {
    /// How many.
    const COUNT: usize;

    /// Of [`Lanes::COUNT`] samples.
    fn load(samples: &[f32]) -> Self;

    /// Magnitudes below 2^-64 become +0.
    fn canonical(self) -> Self;

    /// Puts `x y z w` together, as [`Lanes::COUNT`] rotations.
    fn store(components: [Self; 4], rotations: &mut [[f32; 4]]);
}

impl Number for Vec4 {
    #[inline(always)]
    fn all(value: f32) -> Self {
        Self::splat(value)
    }
}

impl Lanes for Vec4 {
    const COUNT: usize = 4;

    #[inline(always)]
    fn load(samples: &[f32]) -> Self {
        Self::from_slice(samples)
    }

    #[inline(always)]
    fn canonical(self) -> Self {
        let tiny = self.abs().cmplt(Self::splat(f32::from_bits(TINY_BITS)));
        Self::select(tiny, Self::ZERO, self)
    }

    #[inline(always)]
    fn store([x, y, z, w]: [Self; 4], rotations: &mut [[f32; 4]]) {
        rotations.copy_from_slice(&Mat4::from_cols(x, y, z, w).transpose().to_cols_array_2d());
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Catches lanes that are put together in another order than they were loaded in, and a
    /// comparison that is off by one bit.
    pub(crate) fn lanes_are_samples<L: Lanes>() {
        let tiny = f32::from_bits(TINY_BITS);
        let below = f32::from_bits(TINY_BITS - 1);
        let samples = |c: usize| -> Vec<f32> {
            let special = [0.0, -0.0, tiny, -tiny, below, -below, 1e-45, -1.0];
            let sample = |k: usize| match (k + c) % 3 {
                0 => special[(k + 2 * c) % special.len()],
                _ => (10 * k + c) as f32,
            };
            (0..L::COUNT).map(sample).collect()
        };
        let columns = [0, 1, 2, 3].map(samples);
        let components = [0, 1, 2, 3].map(|c| L::load(&columns[c]));
        let mut found = vec![[9.0; 4]; L::COUNT];
        L::store(components, &mut found);
        let mut filtered = found.clone();
        L::store(components.map(L::canonical), &mut filtered);
        for k in 0..L::COUNT {
            for c in 0..4 {
                let expected = columns[c][k];
                assert_eq!(found[k][c].to_bits(), expected.to_bits());
                let expected = crate::numeric::canonical(expected);
                assert_eq!(filtered[k][c].to_bits(), expected.to_bits());
            }
        }
    }

    #[test]
    fn four_lanes_are_samples() {
        lanes_are_samples::<Vec4>();
    }
}
