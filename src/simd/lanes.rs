//! The numbers that the twins compute with: an f32 for one sample, or a vector for several.

use std::fmt;
use std::ops::{BitAnd, Neg, Not};
use std::slice;

use bytemuck::Pod;
use glam::{BVec4A, Mat4, Vec4, Vec4Swizzles as _};

use crate::math::quaternion::Arithmetic;
use crate::shader::{PolynomialSegment, TINY_BITS};
use crate::simd::doubles::{Doubles, Four, pair};

/// The number of one sample, or a vector with the numbers of several samples. Operations round both in the same way.
pub(crate) trait Number: Arithmetic + Neg<Output = Self> {
    /// The same for every sample.
    fn all(value: f32) -> Self;

    /// Magnitudes below a positive limit become +0.
    fn zero_below(self, limit: f32) -> Self;

    /// Magnitudes below 2^-64 become +0: twin of `shaders/math/canonical.wgsl`.
    #[inline(always)]
    fn canonical(self) -> Self {
        self.zero_below(f32::from_bits(TINY_BITS))
    }

    /// -1 where a number is less than 0, else 1.
    fn sign(self) -> Self;

    /// The number whose bits are `seed` minus the bits of this one shifted to the right: the initial guess of a
    /// reciprocal or of a root.
    fn guess(self, seed: u32, shift: u32) -> Self;
}

/// A number that can be compared with others and chosen among them, sample by sample.
pub(crate) trait Choice: Number {
    /// The answer to a comparison, for each sample.
    type Flags: Copy + fmt::Debug + BitAnd<Output = Self::Flags> + Not<Output = Self::Flags>;

    fn at_most(self, limit: Self) -> Self::Flags;

    fn equals(self, other: Self) -> Self::Flags;

    /// Whether all bits of `mask`, which is not 0, are 1 in the number's representation.
    fn has_bits(self, mask: u32) -> Self::Flags;

    /// `accept` where the answer is yes, else `reject`.
    fn choose(flags: Self::Flags, accept: Self, reject: Self) -> Self;
}

impl Choice for f32 {
    type Flags = bool;

    #[inline(always)]
    fn at_most(self, limit: Self) -> bool {
        self <= limit
    }

    #[inline(always)]
    fn equals(self, other: Self) -> bool {
        self == other
    }

    #[inline(always)]
    fn has_bits(self, mask: u32) -> bool {
        self.to_bits() & mask == mask
    }

    #[inline(always)]
    fn choose(flags: bool, accept: Self, reject: Self) -> Self {
        if flags { accept } else { reject }
    }
}

impl Number for f32 {
    #[inline(always)]
    fn all(value: f32) -> Self {
        value
    }

    #[inline(always)]
    fn zero_below(self, limit: f32) -> Self {
        let magnitude = self.to_bits() & 0x7fff_ffff;
        if magnitude < limit.to_bits() {
            0.0
        } else {
            self
        }
    }

    #[inline(always)]
    fn sign(self) -> Self {
        if self < 0.0 { -1.0 } else { 1.0 }
    }

    #[inline(always)]
    fn guess(self, seed: u32, shift: u32) -> Self {
        Self::from_bits(seed.wrapping_sub(self.to_bits() >> shift))
    }
}

/// [`Number::canonical`] of every component.
#[inline(always)]
pub(crate) fn canonical<N: Number>([x, y, z, w]: [N; 4]) -> [N; 4] {
    [x.canonical(), y.canonical(), z.canonical(), w.canonical()]
}

/// The number of lanes in the widest vector.
pub(crate) const MAX_LANES: usize = 16;

/// A vector with the numbers of several consecutive samples. Each width has a different order of lanes;
/// [`Lanes::load`] and [`Lanes::store`] convert it.
pub(crate) trait Lanes: Choice + Pod {
    /// Number of samples.
    const COUNT: usize = size_of::<Self>() / size_of::<f32>();

    /// The vectors that evaluate short runs: these, or vectors half as wide.
    type Narrow: Lanes;

    /// An array of [`Lanes::COUNT`] rotations.
    type Rotations: AsRef<[[f32; 4]]> + Pod;

    /// The numbers of [`Lanes::COUNT`] samples in f64.
    type Doubles: Doubles;

    /// A vector in memory, aligned as [`Lanes::store_past_caches`] needs it.
    type Block: Pod;

    /// Rounded to f32.
    fn rounded(numbers: Self::Doubles) -> Self;

    /// The same numbers in f64.
    fn widened(self) -> Self::Doubles;

    /// Loads the first [`Lanes::COUNT`] of consecutive samples.
    fn load(samples: &[f32]) -> Self;

    /// Stores to [`Lanes::COUNT`] consecutive samples.
    fn store(self, samples: &mut [f32]);

    /// Loads what [`Lanes::store_unordered`] stored.
    #[inline(always)]
    fn load_unordered(numbers: &[f32]) -> Self {
        bytemuck::pod_read_unaligned(bytemuck::cast_slice(&numbers[..Self::COUNT]))
    }

    /// Stores the numbers in this vector's order of lanes, without an instruction to convert it.
    #[inline(always)]
    fn store_unordered(self, numbers: &mut [f32]) {
        numbers[..Self::COUNT].copy_from_slice(bytemuck::cast_slice(slice::from_ref(&self)));
    }

    /// Loads the first [`Lanes::COUNT`] rotations, a vector for each of `x y z w`.
    #[inline(always)]
    fn load_rotations(rotations: &[[f32; 4]]) -> [Self; 4] {
        let (all, each) = (&rotations[..Self::COUNT], Self::COUNT / 4);
        // Written out without a closure, because closures are not always inlined.
        Self::transposed([
            Self::load_side_by_side(all),
            Self::load_side_by_side(&all[each..]),
            Self::load_side_by_side(&all[2 * each..]),
            Self::load_side_by_side(&all[3 * each..]),
        ])
    }

    /// The same for rotations with the first [`Lanes::COUNT`] of the `indices`.
    fn gather_rotations(rotations: &[[f32; 4]], indices: &[u32]) -> [Self; 4];

    /// Loads the first of some rotations, a quarter of [`Lanes::COUNT`]: `x y z w x y z w …`.
    #[inline(always)]
    fn load_side_by_side(rotations: &[[f32; 4]]) -> Self {
        bytemuck::pod_read_unaligned(bytemuck::cast_slice(&rotations[..Self::COUNT / 4]))
    }

    /// One rotation, repeated: `x y z w x y z w …`.
    fn repeated(rotation: [f32; 4]) -> Self;

    /// Repeats each number four times, for the four components of its sample's rotation: the first
    /// vector has the numbers of the first quarter of the samples, and so on.
    fn fourfold(self) -> [Self; 4];

    /// Loads a quarter of [`Lanes::COUNT`] numbers and repeats each four times.
    fn fourfold_of(samples: &[f32]) -> Self;

    /// Stores a vector of rotations, `x y z w x y z w …`, to a quarter of [`Lanes::COUNT`] elements.
    #[inline(always)]
    fn store_side_by_side(self, rotations: &mut [[f32; 4]]) {
        rotations.copy_from_slice(bytemuck::cast_slice(slice::from_ref(&self)));
    }

    /// From a vector for each of `x y z w` to vectors of whole rotations: the first has those of
    /// the first quarter of the samples, and so on.
    fn transposed(components: [Self; 4]) -> [Self; 4];

    /// The rotations of all samples, from a vector for each of `x y z w`.
    #[inline(always)]
    fn rotations(components: [Self; 4]) -> Self::Rotations {
        bytemuck::cast(Self::transposed(components))
    }

    /// Stores the rotations of all samples, from a vector for each of `x y z w`.
    #[inline(always)]
    fn store_rotations(components: [Self; 4], rotations: &mut [[f32; 4]]) {
        rotations.copy_from_slice(Self::rotations(components).as_ref());
    }

    /// Stores coefficients of polynomials, each lane's to the segment with its index. There is a
    /// vector for each of `x y z w` of every power, and at least four powers.
    #[inline(always)]
    fn store_powers(powers: &[[Self; 4]], segments: &mut [PolynomialSegment], indices: &[usize]) {
        for (power, &components) in powers.iter().enumerate() {
            let rotations = Self::rotations(components);
            for (&index, rotation) in indices.iter().zip(rotations.as_ref()) {
                segments[index].coefficients[power] = *rotation;
            }
        }
    }

    #[inline(always)]
    fn of_block(block: &Self::Block) -> Self {
        bytemuck::cast(*block)
    }

    /// This vector of whole rotations, with the first `count` of them replaced by those of a block.
    fn behind(self, block: &Self::Block, count: usize) -> Self;

    /// A streaming (non-temporal) store, if the target has one. Other threads see it after a
    /// [`fence`](super::dispatch::fence).
    fn store_past_caches(self, block: &mut Self::Block);

    fn magnitude(self) -> Self;

    /// `then` where a number is `value`, else `otherwise`.
    #[inline(always)]
    fn where_equal(self, value: f32, then: Self, otherwise: Self) -> Self {
        Self::choose(self.equals(Self::all(value)), then, otherwise)
    }

    /// The larger of two numbers; `other` if either is NaN.
    fn larger(self, other: Self) -> Self;

    /// Whether any number is at most `limit`.
    fn any_at_most(self, limit: f32) -> bool;
}

impl Number for Vec4 {
    #[inline(always)]
    fn all(value: f32) -> Self {
        Self::splat(value)
    }

    #[inline(always)]
    fn zero_below(self, limit: f32) -> Self {
        let small = self.abs().cmplt(Self::splat(limit));
        Self::select(small, Self::ZERO, self)
    }

    #[inline(always)]
    fn sign(self) -> Self {
        Self::select(self.cmplt(Self::ZERO), Self::NEG_ONE, Self::ONE)
    }

    #[inline(always)]
    fn guess(self, seed: u32, shift: u32) -> Self {
        let of = |number: f32| number.guess(seed, shift);
        let [x, y, z, w] = self.to_array();
        Self::new(of(x), of(y), of(z), of(w))
    }
}

impl Choice for Vec4 {
    type Flags = BVec4A;

    #[inline(always)]
    fn at_most(self, limit: Self) -> BVec4A {
        self.cmple(limit)
    }

    #[inline(always)]
    fn equals(self, other: Self) -> BVec4A {
        self.cmpeq(other)
    }

    #[inline(always)]
    fn has_bits(self, mask: u32) -> BVec4A {
        let of = |number: f32| if number.has_bits(mask) { 1.0 } else { 0.0 };
        let [x, y, z, w] = self.to_array();
        Self::new(of(x), of(y), of(z), of(w)).cmpeq(Self::ONE)
    }

    #[inline(always)]
    fn choose(flags: BVec4A, accept: Self, reject: Self) -> Self {
        Self::select(flags, accept, reject)
    }
}

impl Lanes for Vec4 {
    type Narrow = Self;
    type Rotations = [[f32; 4]; 4];
    type Doubles = Four;
    #[cfg(target_arch = "x86_64")]
    type Block = std::arch::x86_64::__m128;
    #[cfg(not(target_arch = "x86_64"))]
    type Block = [f32; 4];

    #[inline(always)]
    fn rounded(numbers: Four) -> Self {
        pair::rounded(numbers.0)
    }

    #[inline(always)]
    fn widened(self) -> Four {
        Four(pair::widened(self))
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
    fn gather_rotations(rotations: &[[f32; 4]], indices: &[u32]) -> [Self; 4] {
        let [a, b, c, d]: [u32; 4] = *indices.first_chunk().expect("four indices");
        Self::transposed([
            Self::from_array(rotations[a as usize]),
            Self::from_array(rotations[b as usize]),
            Self::from_array(rotations[c as usize]),
            Self::from_array(rotations[d as usize]),
        ])
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
    fn behind(self, block: &Self::Block, count: usize) -> Self {
        if count > 0 {
            Self::of_block(block)
        } else {
            self
        }
    }

    #[inline(always)]
    fn store_past_caches(self, block: &mut Self::Block) {
        // Miri executes no non-temporal stores.
        #[cfg(all(target_arch = "x86_64", not(miri)))]
        // SAFETY: SSE is part of x86-64, and the block is aligned as this instruction demands.
        unsafe {
            std::arch::x86_64::_mm_stream_ps(std::ptr::from_mut(block).cast(), self.into());
        }
        #[cfg(any(not(target_arch = "x86_64"), miri))]
        {
            *block = bytemuck::cast(self);
        }
    }

    #[inline(always)]
    fn transposed([x, y, z, w]: [Self; 4]) -> [Self; 4] {
        let rows = Mat4::from_cols(x, y, z, w).transpose();
        [rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis]
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::quaternion::Real as _;
    use crate::simd::dispatch::{InLanes, VectorWidth, in_lanes_of};

    fn bits(numbers: &[f32]) -> Vec<u32> {
        numbers.iter().map(|number| number.to_bits()).collect()
    }

    /// Catches lanes that are stored in another order than they were loaded in, and a comparison
    /// that is off by one bit.
    fn lanes_are_samples<L: Lanes>() {
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
        for c in 0..4 {
            let mut stored = vec![9.0; L::COUNT];
            loaded[c].store(&mut stored);
            assert_eq!(bits(&stored), bits(&columns[c]));
            let guess = loaded[c].guess(0x5f37_59df, 1);
            guess.store(&mut stored);
            let guesses: Vec<f32> = columns[c].iter().map(|v| v.guess(0x5f37_59df, 1)).collect();
            assert_eq!(bits(&stored), bits(&guesses));
            let (one, two) = (L::all(1.0), L::all(2.0));
            loaded[c].where_equal(10.0, one, two).store(&mut stored);
            let chosen = columns[c]
                .iter()
                .map(|&v| if v == 10.0 { 1.0 } else { 2.0 });
            assert!(stored.iter().copied().eq(chosen));
            loaded[c].sign().store(&mut stored);
            let signs = columns[c].iter().map(|&v| if v < 0.0 { -1.0 } else { 1.0 });
            assert!(stored.iter().copied().eq(signs));
            for mask in [1 << 23, 3 << 22] {
                let flags = loaded[c].has_bits(mask);
                L::choose(flags, one, two).store(&mut stored);
                let flags = columns[c].iter().map(|v| v.to_bits() & mask == mask);
                let chosen = flags.map(|flag| if flag { 1.0 } else { 2.0 });
                assert!(stored.iter().copied().eq(chosen));
            }
            let least = columns[c].iter().copied().fold(f32::MAX, f32::min);
            assert!(loaded[c].any_at_most(least) && !loaded[c].any_at_most(least.next_down()));
            let within = loaded[c].at_most(two) & !loaded[c].equals(L::all(0.0));
            L::choose(within, one, two).store(&mut stored);
            let chosen = (columns[c].iter()).map(|&v| if v <= 2.0 && v != 0.0 { 1.0 } else { 2.0 });
            assert!(stored.iter().copied().eq(chosen));
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

    struct EveryVector;

    impl InLanes for EveryVector {
        const WIDE_IN_TESTS: bool = true;

        fn run<L: Lanes>(&mut self) {
            lanes_are_samples::<L>();
            doubles_are_samples::<L>();
        }
    }

    #[test]
    fn vectors_of_every_width_are_samples() {
        for width in VectorWidth::available() {
            in_lanes_of(width, &mut EveryVector);
        }
    }

    /// Catches halves that are mixed up, and a comparison that sees only one of them.
    fn doubles_are_samples<L: Lanes>() {
        let numbers: Vec<f64> = (0..L::COUNT).map(|k| 0.1 * (k * k) as f64 - 0.7).collect();
        let found = L::Doubles::load(&numbers);
        let two = L::Doubles::all(2.0);
        let mut stored = vec![0.0; L::COUNT];
        let mut rounded = vec![0.0; L::COUNT];
        L::rounded(found).store(&mut rounded);
        let widened = L::load(&rounded).widened();
        type Same = fn(f64) -> f64;
        let cases: [(L::Doubles, Same); 11] = [
            (found, |x| x),
            (widened, |x| f64::from(x as f32)),
            (found + two, |x| x + 2.0),
            (found - two, |x| x - 2.0),
            (found * two, |x| x * 2.0),
            (two / found, |x| 2.0 / x),
            (-found, |x| -x),
            ((found * found).root(), f64::abs),
            (found.smaller(two), |x| if x < 2.0 { x } else { 2.0 }),
            (found.larger(two), |x| if x > 2.0 { x } else { 2.0 }),
            (found.up_to(two, found, -two), |x| {
                if x <= 2.0 { x } else { -2.0 }
            }),
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
                let numbers = L::Doubles::load(&all);
                for (doubles, of_none) in [
                    (numbers.larger(two), 2.0),
                    (numbers.smaller(two), 2.0),
                    (numbers.up_to(two, numbers, two + two), 4.0),
                ] {
                    doubles.store(&mut stored);
                    assert!(!other.is_nan() || stored[k] == of_none);
                }
            }
        }
    }
}
