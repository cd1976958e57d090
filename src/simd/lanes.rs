//! What the twins compute with: the number of one sample, or those of several in one vector.

use crate::math::canonical;
use std::ops::Neg;

use bytemuck::Pod;
use glam::{Mat4, Vec4, Vec4Swizzles as _};

use crate::math::quaternion::{Arithmetic, Real};
use crate::shader::PolynomialSegment;
use crate::shader::TINY_BITS;
use crate::simd::doubles::Four;

/// A number of one sample, or of several. Whatever it is of, an operation rounds alike.
pub(crate) trait Number: Arithmetic + Neg<Output = Self> {
    /// The same for every sample.
    fn all(value: f32) -> Self;

    /// Magnitudes below 2^-64 become +0: twin of `shaders/math/canonical.wgsl`.
    fn canonical(self) -> Self;
}

impl Number for f32 {
    #[inline(always)]
    fn all(value: f32) -> Self {
        value
    }

    #[inline(always)]
    fn canonical(self) -> Self {
        canonical::canonical(self)
    }
}

/// [`Number::canonical`] of every component.
#[inline(always)]
pub(crate) fn canonical<N: Number>([x, y, z, w]: [N; 4]) -> [N; 4] {
    [x.canonical(), y.canonical(), z.canonical(), w.canonical()]
}

/// The numbers of several consecutive samples, in an order of their own.
pub(crate) trait Lanes: Number {
    /// How many.
    const COUNT: usize;

    /// What evaluates runs of few: these, or vectors half as wide.
    type Narrow: Lanes;

    /// As many rotations.
    type Rotations: AsRef<[[f32; 4]]>;

    /// As many in f64.
    type Doubles: Doubles;

    /// A vector in memory, at a multiple of its size.
    type Block: Pod;

    /// Rounded to f32.
    fn rounded(numbers: Self::Doubles) -> Self;

    /// The same in f64.
    fn widened(self) -> Self::Doubles;

    /// Of [`Lanes::COUNT`] samples.
    fn load(samples: &[f32]) -> Self;

    /// To [`Lanes::COUNT`] samples.
    fn store(self, samples: &mut [f32]);

    /// `x y z w` of [`Lanes::COUNT`] rotations.
    fn load_rotations(rotations: &[[f32; 4]]) -> [Self; 4];

    /// The same of rotations that lie anywhere: the first [`Lanes::COUNT`] of the `places`.
    fn gather_rotations(rotations: &[[f32; 4]], places: &[u32]) -> [Self; 4];

    /// The inner products of [`Lanes::COUNT`] pairs of rotations.
    fn inner(from: &[[f32; 4]], to: &[[f32; 4]]) -> Self;

    /// A rotation again and again, `x y z w x y z w …`.
    fn repeated(rotation: [f32; 4]) -> Self;

    /// Each number four times over, for the components of its sample's rotation: those of
    /// the first quarter of the samples, and so on.
    fn fourfold(self) -> [Self; 4];

    /// Each of a quarter of [`Lanes::COUNT`] numbers four times over.
    fn fourfold_of(samples: &[f32]) -> Self;

    /// To a quarter of [`Lanes::COUNT`] rotations, `x y z w x y z w …`.
    fn store_side_by_side(self, rotations: &mut [[f32; 4]]);

    /// From `x y z w`, the rotations of the first quarter of the samples side by side, and so
    /// on.
    fn transposed(components: [Self; 4]) -> [Self; 4];

    /// The rotations of all samples, from those of each quarter side by side.
    fn joined(quarters: [Self; 4]) -> Self::Rotations;

    /// Puts `x y z w` together.
    #[inline(always)]
    fn rotations(components: [Self; 4]) -> Self::Rotations {
        Self::joined(Self::transposed(components))
    }

    /// The same, to [`Lanes::COUNT`] places.
    #[inline(always)]
    fn store_rotations(components: [Self; 4], rotations: &mut [[f32; 4]]) {
        rotations.copy_from_slice(Self::rotations(components).as_ref());
    }

    /// Stores the coefficients of all powers, `x y z w`, four or more: each lane's to the
    /// segment at its place.
    #[inline(always)]
    fn store_powers(powers: &[[Self; 4]], segments: &mut [PolynomialSegment], places: &[usize]) {
        for (power, &components) in powers.iter().enumerate() {
            let rotations = Self::rotations(components);
            for (&place, rotation) in places.iter().zip(rotations.as_ref()) {
                segments[place].coefficients[power] = *rotation;
            }
        }
    }

    fn of_block(block: &Self::Block) -> Self;

    /// With the first `count` of the rotations that lie side by side from a block.
    fn behind(self, block: &Self::Block, count: usize) -> Self;

    /// Stores past the caches, where there is such a thing; seen by other threads behind a
    /// [`fence`](super::dispatch::fence).
    fn store_past_caches(self, block: &mut Self::Block);

    /// -1 where a number is less than 0, else 1.
    fn sign(self) -> Self;

    fn magnitude(self) -> Self;

    /// The larger of two numbers; `other` where one of them is none.
    fn larger(self, other: Self) -> Self;

    /// Whether any is at most `limit`.
    fn any_at_most(self, limit: f32) -> bool;
}

/// As many numbers in f64 as a vector of f32 has lanes, in the order of samples.
pub(crate) trait Doubles: Real {
    /// Of the first so many numbers.
    fn load(numbers: &[f64]) -> Self;

    /// To the first so many numbers.
    fn store(self, numbers: &mut [f64]);

    /// Whether each is a number, and not more than `limit`.
    fn are_at_most(self, limit: f64) -> bool;
}

impl Number for Vec4 {
    #[inline(always)]
    fn all(value: f32) -> Self {
        Self::splat(value)
    }

    #[inline(always)]
    fn canonical(self) -> Self {
        let tiny = self.abs().cmplt(Self::splat(f32::from_bits(TINY_BITS)));
        Self::select(tiny, Self::ZERO, self)
    }
}

impl Lanes for Vec4 {
    const COUNT: usize = 4;
    type Narrow = Self;
    type Rotations = [[f32; 4]; 4];
    type Doubles = Four;
    type Block = [f32; 4];

    #[inline(always)]
    fn rounded(numbers: Four) -> Self {
        numbers.rounded()
    }

    #[inline(always)]
    fn widened(self) -> Four {
        Four::of(self)
    }

    #[inline(always)]
    fn load(samples: &[f32]) -> Self {
        Self::from_slice(samples)
    }

    #[inline(always)]
    fn store(self, samples: &mut [f32]) {
        self.write_to_slice(samples);
    }

    #[inline(always)]
    fn load_rotations(rotations: &[[f32; 4]]) -> [Self; 4] {
        let columns: &[[f32; 4]; 4] = rotations.first_chunk().expect("four rotations");
        rows(Mat4::from_cols_array_2d(columns))
    }

    #[inline(always)]
    fn gather_rotations(rotations: &[[f32; 4]], places: &[u32]) -> [Self; 4] {
        let [a, b, c, d]: [u32; 4] = *places.first_chunk().expect("four places");
        let columns = [
            rotations[a as usize],
            rotations[b as usize],
            rotations[c as usize],
            rotations[d as usize],
        ];
        rows(Mat4::from_cols_array_2d(&columns))
    }

    #[inline(always)]
    fn inner(from: &[[f32; 4]], to: &[[f32; 4]]) -> Self {
        let from: &[[f32; 4]; 4] = from.first_chunk().expect("four rotations");
        let to: &[[f32; 4]; 4] = to.first_chunk().expect("four rotations");
        // Multiplied before they are put side by side: half as much to put.
        let [x, y, z, w] = rows(Mat4::from_cols(
            Self::from(from[0]) * Self::from(to[0]),
            Self::from(from[1]) * Self::from(to[1]),
            Self::from(from[2]) * Self::from(to[2]),
            Self::from(from[3]) * Self::from(to[3]),
        ));
        x + y + z + w
    }

    #[inline(always)]
    fn repeated(rotation: [f32; 4]) -> Self {
        Self::from_array(rotation)
    }

    #[inline(always)]
    fn fourfold(self) -> [Self; 4] {
        [self.xxxx(), self.yyyy(), self.zzzz(), self.wwww()]
    }

    #[inline(always)]
    fn fourfold_of(samples: &[f32]) -> Self {
        Self::splat(samples[0])
    }

    #[inline(always)]
    fn store_side_by_side(self, rotations: &mut [[f32; 4]]) {
        rotations.copy_from_slice(&[self.to_array()]);
    }

    #[inline(always)]
    fn of_block(block: &[f32; 4]) -> Self {
        Self::from_array(*block)
    }

    #[inline(always)]
    fn behind(self, block: &[f32; 4], count: usize) -> Self {
        if count > 0 {
            Self::of_block(block)
        } else {
            self
        }
    }

    #[inline(always)]
    fn store_past_caches(self, block: &mut [f32; 4]) {
        *block = self.to_array();
    }

    #[inline(always)]
    fn transposed([x, y, z, w]: [Self; 4]) -> [Self; 4] {
        rows(Mat4::from_cols(x, y, z, w))
    }

    #[inline(always)]
    fn joined([a, b, c, d]: [Self; 4]) -> Self::Rotations {
        [a.to_array(), b.to_array(), c.to_array(), d.to_array()]
    }

    #[inline(always)]
    fn sign(self) -> Self {
        Self::select(self.cmplt(Self::ZERO), Self::NEG_ONE, Self::ONE)
    }

    #[inline(always)]
    fn magnitude(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Self::select(self.cmpgt(other), self, other)
    }

    #[inline(always)]
    fn any_at_most(self, limit: f32) -> bool {
        self.cmple(Self::splat(limit)).any()
    }
}

#[inline(always)]
fn rows(columns: Mat4) -> [Vec4; 4] {
    let rows = columns.transpose();
    [rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis]
}

#[cfg(test)]
pub(crate) mod tests {
    use bytemuck::Zeroable as _;

    use super::*;
    use crate::cpu::evaluate::tests::runs_are_samples;

    fn bits(numbers: &[f32]) -> Vec<u32> {
        numbers.iter().map(|number| number.to_bits()).collect()
    }

    /// Of as many powers as gentle curves have: four, and four of which one is among them.
    fn powers_come_to_their_places<L: Lanes>() {
        let number = |power: usize, lane: usize, c: usize| (100 * power + 10 * lane + c) as f32;
        let component = |power: usize, c: usize| {
            let own: Vec<f32> = (0..L::COUNT).map(|lane| number(power, lane, c)).collect();
            L::load(&own)
        };
        let powers: Vec<[L; 4]> = (0..7)
            .map(|power| [0, 1, 2, 3].map(|c| component(power, c)))
            .collect();
        let mut segments = vec![PolynomialSegment::zeroed(); L::COUNT];
        let backward: Vec<usize> = (0..L::COUNT).rev().collect();
        L::store_powers(&powers, &mut segments, &backward);
        for (lane, &place) in backward.iter().enumerate() {
            for (power, found) in segments[place].coefficients.iter().enumerate() {
                let expected = match power {
                    ..7 => [0, 1, 2, 3].map(|c| number(power, lane, c)),
                    _ => [0.0; 4],
                };
                assert_eq!(*found, expected);
            }
        }
    }

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
        L::store_rotations(components, &mut found);
        let mut filtered = found.clone();
        L::store_rotations(components.map(L::canonical), &mut filtered);
        let loaded = L::load_rotations(&found);
        let backward: Vec<u32> = (0..L::COUNT as u32).rev().collect();
        let gathered = L::gather_rotations(&found, &backward);
        let mut again = vec![[9.0; 4]; L::COUNT];
        L::store_rotations(gathered, &mut again);
        again.reverse();
        assert_eq!(bits(again.as_flattened()), bits(found.as_flattened()));
        powers_come_to_their_places::<L>();
        let (numbers, ones) = (
            vec![[1.0, 20.0, 300.0, 4000.0]; L::COUNT],
            vec![[1.0; 4]; L::COUNT],
        );
        for k in 0..L::COUNT {
            let mut from = numbers.clone();
            from[k][0] = -4321.0;
            assert!(L::inner(&from, &ones).any_at_most(-1.0));
            assert!(L::inner(&ones, &from).any_at_most(-1.0));
        }
        assert!(!L::inner(&numbers, &ones).any_at_most(4320.0));
        for c in 0..4 {
            let mut stored = vec![9.0; L::COUNT];
            loaded[c].store(&mut stored);
            assert_eq!(bits(&stored), bits(&columns[c]));
            loaded[c].sign().store(&mut stored);
            let signs = columns[c].iter().map(|&v| if v < 0.0 { -1.0 } else { 1.0 });
            assert!(stored.iter().copied().eq(signs));
            let least = columns[c].iter().copied().fold(f32::MAX, f32::min);
            assert!(loaded[c].any_at_most(least) && !loaded[c].any_at_most(least.next_down()));
        }
        for k in 0..L::COUNT {
            for c in 0..4 {
                let expected = columns[c][k];
                assert_eq!(found[k][c].to_bits(), expected.to_bits());
                let expected = crate::math::canonical::canonical(expected);
                assert_eq!(filtered[k][c].to_bits(), expected.to_bits());
            }
        }
    }

    #[test]
    fn four_lanes_are_samples() {
        lanes_are_samples::<Vec4>();
        runs_are_samples::<Vec4>();
    }
}
