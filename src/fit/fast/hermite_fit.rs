//! The Hermite fit: polynomials for curves between two keys, in vector lanes of f32. The values and
//! slopes at the keys and the value and two derivatives at the middle are known in closed form, so
//! that only one or two pairs of nodes are sampled.

use crate::fit::block::{rounded, widened};
use crate::fit::exact::expansion::{AboutMiddle, SineCosm1};
use crate::fit::fast::exp_log::{long_exp, medium_exp, short_exp};
use crate::fit::fast::fit_range::{BasisValues, FitRange, HALF, LAST_HALF, SEAM};
use crate::fit::nodes::{NodeSamples, interpolate};
use crate::math::quaternion::{
    cross3, normalised, product, product_with_vector, scaled, square, sum,
};
use crate::shader::PolynomialSegment;
use crate::simd::lanes::{Lanes, MAX_LANES, Number};
use crate::twin::small_angle::{chord_of, composed, inverse_rotated};

/// Curves `q₀ exp(w₁ b₁) exp(w₂ b₂) exp(w₃ b₃)`, a lane to each.
#[derive(Clone, Copy)]
pub(crate) struct BetweenKeys<L> {
    pub(crate) start: [L; 4],
    pub(crate) vectors: [[L; 3]; 3],
    pub(crate) end: [L; 4],
}

/// A method of fitting such curves by `PAIRS` pairs of nodes.
pub(crate) trait KeyFit<const PAIRS: usize> {
    /// Fits the curves into the segments with these indices; a fit in two halves also fills the
    /// segment after each. `samples` is scratch memory.
    fn fit<L: Lanes>(
        &self,
        samples: &mut NodeSamples<L, PAIRS>,
        curves: &BetweenKeys<L>,
        indices: &[usize; MAX_LANES],
        segments: &mut [PolynomialSegment],
    );
}

/// Fits the whole curve by one polynomial.
impl<const SAMPLED: usize, const PAIRS: usize> KeyFit<PAIRS> for FitRange<SAMPLED, PAIRS> {
    #[inline(always)]
    fn fit<L: Lanes>(
        &self,
        samples: &mut NodeSamples<L, PAIRS>,
        curves: &BetweenKeys<L>,
        indices: &[usize; MAX_LANES],
        segments: &mut [PolynomialSegment],
    ) {
        let [w1, _, w3] = curves.vectors;
        let ends = [
            RangeEnd::new(curves.start, w1, self.slope),
            RangeEnd::new(curves.end, w3, self.slope),
        ];
        let middle = CurvePoint::new::<false>(curves.start, curves.vectors, &self.middle);
        sample(samples, self, middle, ends);
        interpolate(true, self.nodes, samples, indices, segments);
    }
}

/// Fits a curve by two polynomials, which meet at its middle.
pub(crate) struct Halves;

impl KeyFit<5> for Halves {
    #[inline(always)]
    fn fit<L: Lanes>(
        &self,
        samples: &mut NodeSamples<L, 5>,
        curves: &BetweenKeys<L>,
        indices: &[usize; MAX_LANES],
        segments: &mut [PolynomialSegment],
    ) {
        let (start, vectors, end) = (curves.start, curves.vectors, curves.end);
        let [w1, ..] = vectors;
        let seam = CurvePoint::new::<true>(start, vectors, &SEAM);
        let [u1, u2, u3] = seam.rates(&SEAM);
        let seam = RangeEnd::new(seam.rotation, sum(sum(u1, u3), u2), 1.0);
        let middle = CurvePoint::new::<false>(start, vectors, &HALF.middle);
        let ends = [RangeEnd::new(start, w1, HALF.slope), seam];
        sample(samples, &HALF, middle, ends);
        interpolate(true, HALF.nodes, samples, indices, segments);
        let backward = backward(vectors);
        let middle = CurvePoint::new::<false>(end, backward, &LAST_HALF.middle);
        let [x, y, z, w] = seam.slope;
        let seam = RangeEnd {
            slope: [-x, -y, -z, -w],
            ..seam
        };
        let ends = [RangeEnd::new(end, backward[2], HALF.slope), seam];
        sample(samples, &LAST_HALF, middle, ends);
        // In the second half, the parameter runs backwards, so odd parts change their sign.
        for odd in samples.odd.as_flattened_mut() {
            *odd = -*odd;
        }
        let behind = indices.map(|index| index + 1);
        interpolate(true, LAST_HALF.nodes, samples, &behind, segments);
    }
}

/// The end of a range: the rotation there, and its derivative by the range's parameter.
#[derive(Clone, Copy)]
struct RangeEnd<L> {
    rotation: [L; 4],
    slope: [L; 4],
}

impl<L: Lanes> RangeEnd<L> {
    /// A rotation whose half-rotation vector changes by `times` a vector per unit of the parameter.
    #[inline(always)]
    fn new(rotation: [L; 4], vector: [L; 3], times: f32) -> Self {
        Self {
            rotation,
            slope: product_with_vector(rotation, scaled(vector, L::all(times))),
        }
    }
}

/// Curves at one value of their parameter: the rotation, and the half-rotation vectors, each
/// rotated back by the factors that follow it. The derivative is then `m Σ vᵢ bᵢ'`.
struct CurvePoint<L> {
    rotation: [L; 4],
    vectors: [[L; 3]; 3],
}

impl<L: Lanes> CurvePoint<L> {
    #[inline(always)]
    fn new<const EXACT: bool>(start: [L; 4], vectors: [[L; 3]; 3], basis: &BasisValues) -> Self {
        let ([w1, w2, w3], [b1, b2, b3]) = (vectors, basis.weights);
        let third_rotation = short_exp(scaled(w3, L::all(b3)));
        let last_rotations = composed(short_exp(scaled(w2, L::all(b2))), third_rotation);
        let rotation = if EXACT {
            // Curves that are divided rotate farther, and in this product f32 would round too much.
            let factors = product(medium_exp(w1, b1), medium_exp(w2, b2));
            let factors = product(factors, medium_exp(w3, b3));
            rounded(product(normalised(widened(start)), factors))
        } else {
            let factors = composed(short_exp(scaled(w1, L::all(b1))), last_rotations);
            let [x, y, z] = factors.vector;
            let [x, y, z, w] = product(start, [x, y, z, factors.cosm1]);
            [x + start[0], y + start[1], z + start[2], w + start[3]]
        };
        let v1 = inverse_rotated(w1, last_rotations);
        let v2 = inverse_rotated(w2, third_rotation);
        Self {
            rotation,
            vectors: [v1, v2, w3],
        }
    }

    /// The contribution of each vector to the rotation's rate, per unit of a range's parameter.
    #[inline(always)]
    fn rates(&self, basis: &BasisValues) -> [[L; 3]; 3] {
        let ([v1, v2, v3], [r1, r2, r3]) = (self.vectors, basis.rates);
        [
            scaled(v1, L::all(r1)),
            scaled(v2, L::all(r2)),
            scaled(v3, L::all(r3)),
        ]
    }
}

/// The vectors of the same curves from their ends. With `Bᵢ' = 1 - Bᵢ` the curves are
/// `q₁ exp(w₁' B₁') exp(w₂' B₂') exp(w₃' B₃')`, where `wᵢ'` is `-wᵢ` rotated back by the factors
/// that follow it in q₁.
#[inline(always)]
fn backward<L: Lanes>([w1, w2, w3]: [[L; 3]; 3]) -> [[L; 3]; 3] {
    let third_rotation = long_exp(w3);
    let last_rotations = composed(long_exp(w2), third_rotation);
    let v1 = inverse_rotated(w1, last_rotations);
    let v2 = inverse_rotated(w2, third_rotation);
    // Written out without a closure, because closures are not always inlined.
    [
        [-v1[0], -v1[1], -v1[2]],
        [-v2[0], -v2[1], -v2[2]],
        [-w3[0], -w3[1], -w3[2]],
    ]
}

/// Samples a range of curves about its middle.
#[inline(always)]
fn sample<L: Lanes, const SAMPLED: usize, const PAIRS: usize>(
    samples: &mut NodeSamples<L, PAIRS>,
    range: &FitRange<SAMPLED, PAIRS>,
    middle: CurvePoint<L>,
    [start, end]: [RangeEnd<L>; 2],
) {
    samples.middle = middle.rotation;
    set_middle(samples, range, &middle);
    let curve = AboutMiddle::new(middle.rotation, middle.vectors);
    let [v1, v2, v3] = middle.vectors;
    let squares = [square(v1), square(v2), square(v3)];
    for (k, [before, after]) in (1..).zip(&range.gains) {
        let before = curve.differences(sines_cosines(before, squares));
        samples.set_differences(k, before, curve.differences(sines_cosines(after, squares)));
    }
    let before = chord_of(samples.middle, start.rotation);
    samples.set_differences(PAIRS - 2, before, chord_of(samples.middle, end.rotation));
    samples.set_slopes(start.slope, end.slope);
}

/// Sets the derivative at the middle, `m a` with `a = Σ vᵢ bᵢ'`, and half of the second,
/// `m (a² + Σ vᵢ bᵢ''/2 + Σ vᵢ bᵢ' × vⱼ bⱼ')` over i < j, from derivatives of the product.
#[inline(always)]
fn set_middle<L: Lanes, const SAMPLED: usize, const PAIRS: usize>(
    samples: &mut NodeSamples<L, PAIRS>,
    range: &FitRange<SAMPLED, PAIRS>,
    middle: &CurvePoint<L>,
) {
    let m = middle.rotation;
    let [u1, u2, u3] = middle.rates(&range.middle);
    let rate = sum(sum(u1, u3), u2);
    let ([v1, v2, v3], [b1, b2, b3]) = (middle.vectors, range.bends);
    let ends = sum(scaled(v1, L::all(b1)), scaled(v3, L::all(b3)));
    let bend = sum(ends, scaled(v2, L::all(b2)));
    // u₁ × rate is u₁ × u₂ + u₁ × u₃, as u₁ × u₁ is 0.
    let turning = sum(cross3(u1, rate), cross3(u2, u3));
    let [x, y, z, w] = product_with_vector(m, sum(bend, turning));
    let half = square(rate) * L::all(0.5);
    // The first node of these fits is s = 0.
    samples.odd[0] = product_with_vector(m, rate);
    samples.even[0] = [
        x - m[0] * half,
        y - m[1] * half,
        z - m[2] * half,
        w - m[3] * half,
    ];
}

/// Coefficients of `(sin(x)/x - 1) / x²` and of `(cos(x) - 1) / x²` in powers of x², for x²
/// up to 0.201; from Chebyshev nodes, within 3e-9.
const SINC: [f32; 3] = [-0.166_666_67, 0.008_333_27, -0.000_197_583_55];
const COSINE_MINUS_ONE: [f32; 3] = [-0.5, 0.041_666_105, -0.001_381_43];

/// For each of three vectors with these squares, the sine over the length and the cosine minus one
/// of its angle, by its gain.
#[inline(always)]
fn sines_cosines<L: Lanes>(gains: &[f32; 3], [first, second, third]: [L; 3]) -> [SineCosm1<L>; 3] {
    // Written out without a closure, because closures are not always inlined.
    [
        sine_cosine(gains[0], first),
        sine_cosine(gains[1], second),
        sine_cosine(gains[2], third),
    ]
}

#[inline(always)]
fn sine_cosine<N: Number>(gain: f32, square: N) -> (N, N) {
    let (gain, z) = (N::all(gain), square * N::all(gain * gain));
    let sinc = ((N::all(SINC[2]) * z + N::all(SINC[1])) * z + N::all(SINC[0])) * z;
    let cosine_minus_one = ((N::all(COSINE_MINUS_ONE[2]) * z + N::all(COSINE_MINUS_ONE[1])) * z
        + N::all(COSINE_MINUS_ONE[0]))
        * z;
    (gain * sinc + gain, cosine_minus_one)
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;
    use fastrand::Rng;
    use glam::{DQuat, DVec3, DVec4, Quat, Vec3, Vec4};

    use super::*;
    use crate::fit::fast::exp_log::tests::assert_near;
    use crate::fit::fast::fit_range::{LONGEST_DEGREE_8, LONGEST_WHOLE, WHOLE, WHOLE_DEGREE_8};
    use crate::fit::fast::handles::LONGEST_DIRECT;

    /// Catches a wrong digit in a coefficient, and a range that is too short.
    #[test]
    fn waves_hold_for_every_curve_that_is_fitted() {
        let sinc = |z: f64| libm::sin(libm::sqrt(z)) / libm::sqrt(z);
        assert_near(&SINC.map(f64::from), LARGEST, sinc, 3e-9);
        let cosine = |z: f64| libm::cos(libm::sqrt(z));
        assert_near(&COSINE_MINUS_ONE.map(f64::from), LARGEST, cosine, 3e-9);
        for (gains, longest) in [
            (&WHOLE_DEGREE_8.gains[..], LONGEST_DEGREE_8),
            (&WHOLE.gains, LONGEST_WHOLE),
            (&HALF.gains, LONGEST_DIRECT),
        ] {
            let gains = gains.as_flattened().as_flattened();
            let largest_square = gains
                .iter()
                .fold(0.0f32, |largest, gain| largest.max(gain * gain));
            assert!(f64::from(largest_square) * longest < LARGEST);
        }
    }

    const LARGEST: f64 = 0.201;

    /// A curve's value at `t`.
    fn value(start: Quat, vectors: [Vec3; 3], t: f64) -> DQuat {
        let u = 1.0 - t;
        let basis = [1.0 - u * u * u, (3.0 - 2.0 * t) * t * t, t * t * t];
        let factors = vectors.into_iter().zip(basis);
        factors.fold(start.as_dquat().normalize(), |q, (vector, weight)| {
            q * DQuat::from_scaled_axis(vector.as_dvec3() * 2.0 * weight)
        })
    }

    /// A random curve with the squared extent `square`.
    fn curve(random: &mut Rng, square: f64, goes_back: bool) -> (Quat, [Vec3; 3]) {
        let mut number = || random.f64() - 0.5;
        let start = DQuat::from_xyzw(number(), number(), number(), number());
        let mut three = || DVec3::new(number(), number(), number());
        let mut vectors = [three(), three(), three()];
        if goes_back {
            // A curve that reverses its direction has the largest coefficients of high powers.
            vectors[1] = vectors[0] * -1.5;
            vectors[2] = vectors[0] * 0.9;
        }
        let extent: f64 = vectors.iter().map(|v| v.length_squared()).sum();
        let vectors = vectors.map(|v| (v * (square / extent).sqrt()).as_vec3());
        (start.normalize().as_quat(), vectors)
    }

    /// The segments of a curve.
    fn fitted<const PAIRS: usize>(
        how: &impl KeyFit<PAIRS>,
        start: Quat,
        vectors: [Vec3; 3],
    ) -> [PolynomialSegment; 2] {
        let end = value(start, vectors, 1.0).as_quat();
        let curves = BetweenKeys {
            start: start.to_array().map(Vec4::splat),
            vectors: vectors.map(|v| v.to_array().map(Vec4::splat)),
            end: end.to_array().map(Vec4::splat),
        };
        let mut segments = [PolynomialSegment::zeroed(); 2];
        let mut samples = NodeSamples::all(Vec4::ZERO);
        how.fit(&mut samples, &curves, &[0; MAX_LANES], &mut segments);
        segments
    }

    /// The largest error of a component over random curves, each fitted in `parts` parts.
    fn largest_error<const PAIRS: usize>(
        how: &impl KeyFit<PAIRS>,
        parts: usize,
        longest: f64,
    ) -> f64 {
        let random = &mut Rng::with_seed(1);
        let mut largest = 0.0f64;
        for i in 0..4000 {
            let (start, vectors) = curve(random, longest, i % 4 == 0);
            let segments = fitted(how, start, vectors);
            for (part, segment) in segments[..parts].iter().enumerate() {
                for j in 0..=40 {
                    let s = f64::from(j) / 40.0 - 0.5;
                    let powers = segment.coefficients.map(|c| Vec4::from(c).as_dvec4());
                    let found = powers.into_iter().rev().reduce(|sum, c| sum * s + c);
                    let t = (part as f64 + 0.5 + s) / parts as f64;
                    let exact = DVec4::from(value(start, vectors, t));
                    let error = exact - found.expect("eleven powers");
                    largest = largest.max(error.abs().max_element());
                }
            }
        }
        largest
    }

    /// Catches a wrong derivative, a second half that leaves the curve, and limits that are too
    /// high.
    #[test]
    fn the_longest_curves_are_fitted_closely() {
        for (found, bound) in [
            (largest_error(&WHOLE_DEGREE_8, 1, LONGEST_DEGREE_8), 1.2e-7),
            (largest_error(&WHOLE, 1, LONGEST_WHOLE), 1.2e-7),
            (largest_error(&Halves, 2, LONGEST_DIRECT), 1.7e-7),
        ] {
            assert!(found < bound, "{found:e}");
        }
    }
}
