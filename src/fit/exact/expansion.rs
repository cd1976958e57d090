//! Samples cubics in cumulative form at the nodes, in vector lanes: the first half of a fit.

use crate::curve::formula::Product;
use crate::fit::block::{at, load, put, rounded, store};
use crate::fit::exact::fit::{FitBlock, FitRow, Tier};
use crate::fit::exact::handles::redo;
use crate::fit::exact::sampling::Sampling;
use crate::math::quaternion::{
    self, Real as _, cross3, dot3, exp_by, product, product_with_vector, scaled, square,
};
use crate::math::ranges::{LONG_WAVES, SHORT_WAVES};
use crate::simd::doubles::Doubles;
use crate::simd::lanes::{Lanes, MAX_LANES};
use crate::twin::sine_cosine::{sine_cosm1, sine_cosm1_quarter};
use crate::twin::small_angle::{FromIdentity, inverse_rotated};

/// Samples a cubic by its expansion about the middle, in f32. With `PER_CURVE_BASIS` each curve has its
/// basis functions among its numbers; without it all have Bernstein's.
pub(crate) struct Expansion<const PER_CURVE_BASIS: bool>;

impl<const PER_CURVE_BASIS: bool> Sampling for Expansion<PER_CURVE_BASIS> {
    #[inline(always)]
    fn sample<L: Lanes>(block: &mut FitBlock) {
        match block.tier {
            Tier::SmallAngle | Tier::Full => sample::<L, PER_CURVE_BASIS, true>(block),
            Tier::Piece => sample::<L, PER_CURVE_BASIS, false>(block),
        }
    }
}

#[inline(always)]
fn sample<L: Lanes, const PER_CURVE_BASIS: bool, const WHOLE: bool>(block: &mut FitBlock) {
    let (_, after_middle) = block.tier.offsets().split_at(1);
    let after = &after_middle[after_middle.len() / 2..];
    for lane in (0..block.padded_count()).step_by(L::COUNT) {
        let first = Factor::<L>::new::<PER_CURVE_BASIS, WHOLE>(block, lane, 0);
        let second = Factor::<L>::new::<PER_CURVE_BASIS, WHOLE>(block, lane, 1);
        let third = Factor::<L>::new::<PER_CURVE_BASIS, WHOLE>(block, lane, 2);
        let reach = third.reach.larger(second.reach.larger(first.reach));
        reach.store(&mut block.reaches[lane..]);
        let base = load(from(&block.numbers, 0), lane);
        let cubics = Expanded::new(base, [first, second, third]);
        block.set_middle(lane, cubics.curve.middle);
        for (k, &node) in after.iter().enumerate() {
            let before = cubics.differences::<WHOLE>(L::all(-node as f32));
            let after = cubics.differences::<WHOLE>(L::all(node as f32));
            let (mut even, mut odd) = (before, before);
            for c in 0..4 {
                even[c] = after[c] + before[c];
                odd[c] = after[c] - before[c];
            }
            block.set_pair(lane, k, even, odd);
        }
    }
}

/// One of the three rotations of a cubic about the middle of its piece,
/// `q = q_0 exp(v_1 B_1) exp(v_2 B_2) exp(v_3 B_3)`, a lane to each cubic.
struct Factor<L: Lanes> {
    /// This rotation at the middle.
    rotation: [L::Doubles; 4],
    vector: [L; 3],
    /// The square of the vector's length.
    square: L,
    /// Coefficients of s, s² and s³ in the basis function's difference from the middle.
    powers: [L; 3],
    /// The square of the farthest angle from the middle.
    reach: L::Doubles,
}

impl<L: Lanes> Factor<L> {
    /// The `j`th of the cubics from `lane` on.
    #[inline(always)]
    fn new<const PER_CURVE_BASIS: bool, const WHOLE: bool>(
        block: &FitBlock,
        lane: usize,
        j: usize,
    ) -> Self {
        let [c0, c1, c2, c3] = if PER_CURVE_BASIS {
            load(from(&block.numbers, Product::BASIS + 4 * j), lane)
        } else {
            let [c0, c1, c2, c3] = Product::BERNSTEIN[j];
            [all::<L>(c0), all::<L>(c1), all::<L>(c2), all::<L>(c3)]
        };
        let (middle, width) = if WHOLE {
            (all::<L>(0.5), all::<L>(1.0))
        } else {
            (
                L::Doubles::load(&block.middles[lane..]),
                L::Doubles::load(&block.widths[lane..]),
            )
        };
        let vector = load(from(&block.numbers, Product::VECTORS + 3 * j), lane);
        let squared = square(vector);
        let weight = ((c3 * middle + c2) * middle + c1) * middle + c0;
        // B_j(middle + s width) - B_j(middle), in powers of s.
        let two = all::<L>(2.0);
        let three = all::<L>(3.0);
        let linear = ((three * c3 * middle + two * c2) * middle + c1) * width;
        let quadratic = (three * c3 * middle + c2) * width * width;
        let cubic = c3 * width * width * width;
        // The square of the larger one of the differences at s = -1/2 and at s = 1/2.
        let odd = (linear + all::<L>(0.25) * cubic) * all::<L>(0.5);
        let even = quadratic * all::<L>(0.25);
        let (before, after) = (odd - even, odd + even);
        let largest_change = (before * before).larger(after * after);
        Self {
            rotation: exp_in_lanes::<L, WHOLE>(scaled(vector, weight)),
            vector: rounded(vector),
            square: L::rounded(squared),
            powers: [L::rounded(linear), L::rounded(quadratic), L::rounded(cubic)],
            reach: squared * largest_change,
        }
    }
}

/// The exponentials of half-rotation vectors by polynomials; lanes whose vector is too long for
/// them are computed over the full range.
#[inline(always)]
fn exp_in_lanes<L: Lanes, const SHORT: bool>(vector: [L::Doubles; 3]) -> [L::Doubles; 4] {
    let squared = square(vector);
    let (limit, waves) = if SHORT {
        (SHORT_WAVES.limit, SHORT_WAVES.of(squared))
    } else {
        (LONG_WAVES.limit, LONG_WAVES.of(squared))
    };
    let rotation = exp_by(vector, waves);
    if squared.are_at_most(limit) {
        return rotation;
    }
    let mut lanes = ([[0.0; MAX_LANES]; 3], [[0.0; MAX_LANES]; 4]);
    store(&mut lanes.0, 0, vector);
    store(&mut lanes.1, 0, rotation);
    let doubt = squared.up_to(all::<L>(limit), all::<L>(0.0), all::<L>(1.0));
    redo(doubt, 0..L::COUNT, &mut lanes, exp_of_lane);
    load(&lanes.1, 0)
}

/// The exponential of one lane's vector over the full range.
fn exp_of_lane(
    (vectors, rotations): &mut ([[f64; MAX_LANES]; 3], [[f64; MAX_LANES]; 4]),
    lane: usize,
) {
    put(rotations, lane, quaternion::exp(at(vectors, lane)));
}

/// The sine of an angle divided by the length of its vector, and the angle's cosine minus one.
pub(crate) type SineCosm1<L> = (L, L);

/// Cubics about the middle of their pieces, `m exp(v₁ b₁) exp(v₂ b₂) exp(v₃ b₃)`, a lane to each.
/// Each half-rotation vector is rotated back by the factors that follow it at the middle, and each
/// `bᵢ` is 0 there.
pub(crate) struct AboutMiddle<L> {
    middle: [L; 4],
    /// `m v₁`.
    first: [L; 4],
    second: [L; 3],
    third: [L; 3],
    /// `v₂ v₃`.
    both: [L; 4],
}

impl<L: Lanes> AboutMiddle<L> {
    /// Takes the rotation at the middle and the vectors `vᵢ`.
    #[inline(always)]
    pub(crate) fn new(middle: [L; 4], [v1, v2, v3]: [[L; 3]; 3]) -> Self {
        let [x, y, z] = cross3(v2, v3);
        Self {
            middle,
            first: product_with_vector(middle, v1),
            second: v2,
            third: v3,
            both: [x, y, z, -dot3(v2, v3)],
        }
    }

    /// The differences of the rotations at these angles from the one at the middle.
    #[inline(always)]
    pub(crate) fn differences(&self, [(s1, f1), (s2, f2), (s3, f3)]: [SineCosm1<L>; 3]) -> [L; 4] {
        let (m, first, both) = (self.middle, self.first, self.both);
        let (second, third) = (self.second, self.third);
        // With cosines minus one, no digits cancel where the angles are small.
        let cs = s3 + f2 * s3;
        let sc = s2 + s2 * f3;
        let ss = s2 * s3;
        let behind = [
            second[0] * sc + third[0] * cs + both[0] * ss,
            second[1] * sc + third[1] * cs + both[1] * ss,
            second[2] * sc + third[2] * cs + both[2] * ss,
            f2 + f3 + f2 * f3 + both[3] * ss,
        ];
        let first_change = [
            first[0] * s1 + m[0] * f1,
            first[1] * s1 + m[1] * f1,
            first[2] * s1 + m[2] * f1,
            first[3] * s1 + m[3] * f1,
        ];
        let start = [
            m[0] + first_change[0],
            m[1] + first_change[1],
            m[2] + first_change[2],
            m[3] + first_change[3],
        ];
        let [x, y, z, w] = product(start, behind);
        [
            x + first_change[0],
            y + first_change[1],
            z + first_change[2],
            w + first_change[3],
        ]
    }
}

/// [`AboutMiddle`] with the polynomials of its three angles.
struct Expanded<L> {
    curve: AboutMiddle<L>,
    squares: [L; 3],
    powers: [[L; 3]; 3],
}

impl<L: Lanes> Expanded<L> {
    #[inline(always)]
    fn new(base: [L::Doubles; 4], [first, second, third]: [Factor<L>; 3]) -> Self {
        let middle = product(
            product(product(base, first.rotation), second.rotation),
            third.rotation,
        );
        let (r2, r3) = (
            from_identity(second.rotation),
            from_identity(third.rotation),
        );
        let v1 = inverse_rotated(inverse_rotated(first.vector, r2), r3);
        let v2 = inverse_rotated(second.vector, r3);
        Self {
            curve: AboutMiddle::new(rounded(middle), [v1, v2, third.vector]),
            squares: [first.square, second.square, third.square],
            powers: [first.powers, second.powers, third.powers],
        }
    }

    /// The differences of the rotations at `s` from those at the middle.
    #[inline(always)]
    fn differences<const SHORT: bool>(&self, s: L) -> [L; 4] {
        // Written out without a closure, because closures are not always inlined.
        self.curve.differences([
            self.sine_cosine::<SHORT>(0, s),
            self.sine_cosine::<SHORT>(1, s),
            self.sine_cosine::<SHORT>(2, s),
        ])
    }

    /// The sine and cosine of the `j`th angle at `s`.
    #[inline(always)]
    fn sine_cosine<const SHORT: bool>(&self, j: usize, s: L) -> SineCosm1<L> {
        let [linear, quadratic, cubic] = self.powers[j];
        let angle = ((cubic * s + quadratic) * s + linear) * s;
        let square = self.squares[j] * (angle * angle);
        if SHORT {
            sine_cosm1_quarter(angle, square)
        } else {
            sine_cosm1(angle, square)
        }
    }
}

/// The rotation in f32, with its cosine minus one.
#[inline(always)]
fn from_identity<L: Lanes>([x, y, z, w]: [L::Doubles; 4]) -> FromIdentity<L> {
    FromIdentity {
        vector: [L::rounded(x), L::rounded(y), L::rounded(z)],
        cosm1: L::rounded(w - all::<L>(1.0)),
    }
}

#[inline(always)]
fn all<L: Lanes>(value: f64) -> L::Doubles {
    L::Doubles::all(value)
}

/// The `N` numbers from `offset` on.
#[inline(always)]
fn from<const N: usize>(numbers: &[FitRow], offset: usize) -> &[FitRow; N] {
    numbers[offset..]
        .first_chunk()
        .expect("a product's numbers")
}
