//! The nodes at which curves are sampled, and the computation of the coefficients from the samples by Newton's
//! divided differences. Both kinds of fitting use it.
//!
//! One node is the middle, which the polynomial meets exactly; the other samples are differences from it, for which
//! f32 is precise enough. Divided differences are computed first and powers last, which keeps the rounding errors of
//! f32 small.

use crate::shader::{POWERS, PolynomialSegment};
use crate::simd::lanes::{Lanes, canonical};

/// Pairs of nodes at `-s` and `s`, by their `s`; the middle, s = 0, is always an additional node. If the first `s` is
/// 0, the first and the second derivative at the middle are known too. If the last `s` occurs twice, the first
/// derivatives at `-s` and `s` are known too.
pub(crate) struct Nodes<const PAIRS: usize> {
    /// The nodes in the order in which Newton's polynomials take them, which is chosen for small
    /// rounding errors in f32.
    pub(crate) at: [f32; PAIRS],
    pub(crate) squares: [f32; PAIRS],
    /// `1/(2s²)` and `1/(2s)`: with these factors the sum and the difference of the samples at `-s`
    /// and `s` become values of polynomials in s². Both are 1 for s = 0, where half of the second
    /// derivative and the first derivative are these values themselves.
    pub(crate) even: [f32; PAIRS],
    pub(crate) odd: [f32; PAIRS],
    /// `quotients[l][k]` is 1 / (sₖ² - sₖ₋ₗ²), or 1 if both nodes are the same.
    pub(crate) quotients: [[f32; PAIRS]; PAIRS],
}

/// The seven Chebyshev nodes, for a polynomial of degree 6.
pub(crate) const SMALL_ANGLE_NODES: Nodes<3> = Nodes::new([0.39091575, 0.21694186, 0.48746395]);

/// The eleven Chebyshev nodes, for a polynomial of degree 10.
pub(crate) const FULL_NODES: Nodes<5> =
    Nodes::new([0.45481598, 0.49491072, 0.14086628, 0.27032042, 0.3778748]);

/// Degree 10, with the derivatives at the middle and at both ends known. The two pairs between are
/// those with the least truncation error, which grows with the product of the distances to all
/// nodes: 2.71 times that of Chebyshev nodes.
pub(crate) const END_NODES: Nodes<5> = Nodes::new([0.0, 0.265_266_77, 0.394_327_03, 0.5, 0.5]);

/// The same for degree 8: 3.53 times the truncation error of Chebyshev nodes.
pub(crate) const DEGREE_8_END_NODES: Nodes<4> = Nodes::new([0.0, 0.331_538_23, 0.5, 0.5]);

/// As [`END_NODES`] with the pairs nearer to the middle, for the halves of longer curves, whose
/// truncation error is small: 3.85 times that of Chebyshev nodes.
pub(crate) const HALF_END_NODES: Nodes<5> = Nodes::new([0.0, 0.26, 0.374, 0.5, 0.5]);

impl<const PAIRS: usize> Nodes<PAIRS> {
    const fn new(at: [f32; PAIRS]) -> Self {
        let mut nodes = Self {
            at,
            squares: [0.0; PAIRS],
            even: [0.0; PAIRS],
            odd: [0.0; PAIRS],
            quotients: [[0.0; PAIRS]; PAIRS],
        };
        let mut k = 0;
        while k < PAIRS {
            let s = at[k] as f64;
            nodes.squares[k] = (s * s) as f32;
            (nodes.even[k], nodes.odd[k]) = if s == 0.0 {
                (1.0, 1.0)
            } else {
                ((0.5 / (s * s)) as f32, (0.5 / s) as f32)
            };
            let mut l = 1;
            while l <= k {
                let other = at[k - l] as f64;
                let distance = s * s - other * other;
                nodes.quotients[l][k] = if distance == 0.0 {
                    1.0
                } else {
                    (1.0 / distance) as f32
                };
                l += 1;
            }
            k += 1;
        }
        nodes
    }

    /// All nodes, `COUNT` = 2 `PAIRS` + 1: the middle, then those before it, then those after it.
    pub(crate) const fn offsets<const COUNT: usize>(&self) -> [f64; COUNT] {
        assert!(COUNT == 2 * PAIRS + 1);
        let mut offsets = [0.0; COUNT];
        let mut k = 0;
        while k < PAIRS {
            offsets[1 + k] = -self.at[k] as f64;
            offsets[1 + PAIRS + k] = self.at[k] as f64;
            k += 1;
        }
        offsets
    }

    /// The coefficients of s, s³, … and of s², s⁴, … of component `c`. Divided differences give
    /// Newton's polynomials in s² through the samples; these are then expanded in powers.
    #[inline(always)]
    pub(crate) fn powers<L: Lanes>(
        &self,
        samples: &NodeSamples<L, PAIRS>,
        c: usize,
    ) -> [[L; PAIRS]; 2] {
        let mut odd = [L::all(0.0); PAIRS];
        let mut even = odd;
        for k in 0..PAIRS {
            odd[k] = samples.odd[k][c] * L::all(self.odd[k]);
            even[k] = samples.even[k][c] * L::all(self.even[k]);
        }
        for l in 1..PAIRS {
            for k in (l..PAIRS).rev() {
                let quotient = L::all(self.quotients[l][k]);
                odd[k] = (odd[k] - odd[k - 1]) * quotient;
                even[k] = (even[k] - even[k - 1]) * quotient;
            }
        }
        for k in (0..PAIRS - 1).rev() {
            let square = L::all(self.squares[k]);
            for i in k..PAIRS - 1 {
                odd[i] = odd[i] - odd[i + 1] * square;
                even[i] = even[i] - even[i + 1] * square;
            }
        }
        [odd, even]
    }
}

/// An estimate of twice the truncation error of a component's fit, from its last Chebyshev
/// coefficients, which follow from those of the powers. If the curves are
/// [entire](crate::fit::exact::fit::Shape::entire), the last two coefficients suffice.
#[inline(always)]
pub(crate) fn tail<L: Lanes, const PAIRS: usize>(
    are_entire: bool,
    [odd, even]: &[[L; PAIRS]; 2],
) -> L {
    // The coefficient of sⁿ in Tₙ(2s) is 2²ⁿ⁻¹, and that of sⁿ⁻² is -n 2²ⁿ⁻⁵.
    let last = L::all(1.0 / (1u64 << (4 * PAIRS - 1)) as f32);
    let (four, sixteen) = (L::all(4.0), L::all(16.0));
    let last_odd = odd[PAIRS - 1] * last * four;
    let last_even = even[PAIRS - 1] * last;
    if are_entire {
        return last_even.magnitude() + L::all(0.125) * last_odd.magnitude();
    }
    let degree = 2.0 * PAIRS as f32;
    let odd_before = odd[PAIRS - 2] * last * four * sixteen + last_odd * L::all(degree - 1.0);
    let even_before = even[PAIRS - 2] * last * sixteen + last_even * L::all(degree);
    let before_last = odd_before.magnitude() + even_before.magnitude();
    last_even.magnitude() + last_odd.magnitude() + L::all(0.25) * before_last
}

/// Samples of curves: the rotations at the middle, and for each pair of nodes `-s` and `s` the
/// differences from the middle, as their sum (`even`) and their difference (`odd`).
pub(crate) struct NodeSamples<L, const PAIRS: usize> {
    pub(crate) middle: [L; 4],
    pub(crate) even: [[L; 4]; PAIRS],
    pub(crate) odd: [[L; 4]; PAIRS],
}

impl<L: Lanes, const PAIRS: usize> NodeSamples<L, PAIRS> {
    /// Samples that all have the same value.
    #[inline(always)]
    pub(crate) fn all(number: L) -> Self {
        Self {
            middle: [number; 4],
            even: [[number; 4]; PAIRS],
            odd: [[number; 4]; PAIRS],
        }
    }

    /// Sets the samples of the `k`th pair of nodes from the differences of the rotations before
    /// and after the middle from the one at the middle.
    #[inline(always)]
    pub(crate) fn set_differences(&mut self, k: usize, before: [L; 4], after: [L; 4]) {
        for c in 0..4 {
            self.even[k][c] = after[c] + before[c];
            self.odd[k][c] = after[c] - before[c];
        }
    }

    /// Sets the derivatives by s at the ends, which are the last pair of nodes and are there twice.
    /// Each is stored as a second sample, whose difference from the first is the derivative by s²
    /// that the divided differences of [`Nodes::powers`] need there.
    #[inline(always)]
    pub(crate) fn set_slopes(&mut self, before: [L; 4], after: [L; 4]) {
        // At s = 1/2, `even / 2s²` has the value `2 even`, and its derivative by s² is `2 (after - before) - 8 even`.
        // `odd / 2s` has the value `odd`, and its derivative by s² is `after + before - 2 odd`.
        for c in 0..4 {
            let (even, odd) = (self.even[PAIRS - 2][c], self.odd[PAIRS - 2][c]);
            self.even[PAIRS - 1][c] = (after[c] - before[c]) - L::all(3.0) * even;
            self.odd[PAIRS - 1][c] = (after[c] + before[c]) - odd;
        }
    }
}

/// Interpolates samples and writes the coefficients to each lane's segment. Returns estimates of
/// twice the truncation error.
#[inline(always)]
pub(crate) fn interpolate<L: Lanes, const PAIRS: usize>(
    are_entire: bool,
    nodes: &Nodes<PAIRS>,
    samples: &NodeSamples<L, PAIRS>,
    indices: &[usize],
    segments: &mut [PolynomialSegment],
) -> L {
    let mut powers = [[L::all(0.0); 4]; POWERS];
    let tails = coefficients(are_entire, nodes, samples, &mut powers);
    L::store_powers(&powers[..=2 * PAIRS], segments, indices);
    tails
}

/// Sets the coefficients of the polynomials through samples. Returns estimates of twice the
/// truncation error, which depend on whether the curves are [entire](crate::fit::exact::fit::Shape::entire).
#[allow(clippy::needless_range_loop)]
#[inline(always)]
pub(crate) fn coefficients<L: Lanes, const PAIRS: usize>(
    are_entire: bool,
    nodes: &Nodes<PAIRS>,
    samples: &NodeSamples<L, PAIRS>,
    powers: &mut [[L; 4]; POWERS],
) -> L {
    powers[0] = canonical(samples.middle);
    let mut tails = L::all(0.0);
    for c in 0..4 {
        let odd_even = nodes.powers(samples, c);
        tails = tail(are_entire, &odd_even).larger(tails);
        let [odd, even] = odd_even;
        for i in 0..PAIRS {
            powers[2 * i + 1][c] = odd[i].canonical();
            powers[2 * i + 2][c] = even[i].canonical();
        }
    }
    tails
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use glam::Vec4;

    use super::*;

    /// Catches a wrong node or quotient, powers in another order, and a tail that takes one
    /// Chebyshev coefficient for another.
    #[test]
    fn chebyshev_polynomials_come_back() {
        come_back(&SMALL_ANGLE_NODES);
        come_back(&FULL_NODES);
        come_back(&END_NODES);
        come_back(&DEGREE_8_END_NODES);
        come_back(&HALF_END_NODES);
    }

    /// Catches nodes with a larger truncation error than their comments state.
    #[test]
    fn ends_leave_out_a_few_times_what_chebyshev_nodes_do() {
        fn assert_factor<const PAIRS: usize>(nodes: &Nodes<PAIRS>, expected: f64) {
            let distances = |i: u32| {
                let s = f64::from(i) / 20_000.0;
                let nodes = nodes.at.iter().map(|&node| f64::from(node));
                nodes.fold(s, |product, node| product * (s * s - node * node))
            };
            let all = (0..=10_000).map(|i| distances(i).abs());
            let largest = all.fold(0.0, f64::max);
            // The coefficient of sⁿ in Tₙ(2s), n = 2 PAIRS + 1.
            let factor = largest * f64::from(1 << (4 * PAIRS + 1));
            assert!((factor - expected).abs() < 0.005, "{factor}");
        }
        assert_factor(&FULL_NODES, 1.0);
        assert_factor(&END_NODES, 2.71);
        assert_factor(&DEGREE_8_END_NODES, 3.53);
        assert_factor(&HALF_END_NODES, 3.85);
    }

    /// Fits `Tₙ(2s)` for every degree n; component `c` is it times `c + 1`.
    fn come_back<const PAIRS: usize>(nodes: &Nodes<PAIRS>) {
        let degree = 2 * PAIRS;
        for n in 1..=degree {
            // The rounding error grows with the sum of the magnitudes of Tₙ's powers.
            let rounding = 2e-7 * libm::pow(1.0 + 2f64.sqrt(), n as f64);
            let chebyshev = |s: f64| libm::cos(n as f64 * libm::acos(2.0 * s));
            let slope =
                |s: f32| f64::from((2 * n * n) as u32) * f64::from(s.signum()).powi(n as i32 + 1);
            let mut samples = NodeSamples::all(Vec4::ZERO);
            for (k, &s) in nodes.at.iter().enumerate() {
                let comes_again = k > 0 && nodes.at[k - 1] == s;
                let value = |s: f32| {
                    if comes_again {
                        slope(s)
                    } else {
                        chebyshev(s.into()) - chebyshev(0.0)
                    }
                };
                let of_components = |value: f64| {
                    [1.0, 2.0, 3.0, 4.0].map(|times| Vec4::splat((times * value) as f32))
                };
                let (before, after) = (of_components(value(-s)), of_components(value(s)));
                if s == 0.0 {
                    let (n, angle) = (n as f64, n as f64 * FRAC_PI_2);
                    let derivative = 2.0 * n * libm::sin(angle);
                    // From Chebyshev's differential equation.
                    let second = -4.0 * n * n * libm::cos(angle);
                    samples.odd[0] = of_components(derivative);
                    samples.even[0] = of_components(0.5 * second);
                } else if comes_again {
                    samples.set_slopes(before, after);
                } else {
                    samples.set_differences(k, before, after);
                }
            }
            for c in 0..4 {
                let times = (c + 1) as f64;
                let found = nodes.powers(&samples, c);
                for i in 0..=100 {
                    let s = 0.01 * f64::from(i) - 0.5;
                    let [odd, even] = found.map(|powers| {
                        let of_squares = |sum: f64, power: &Vec4| sum * s * s + f64::from(power.x);
                        powers.iter().rev().fold(0.0, of_squares)
                    });
                    let value = odd * s + even * s * s;
                    let error = value - times * (chebyshev(s) - chebyshev(0.0));
                    assert!(error.abs() < rounding * times, "T{n} at {s}: {error}");
                }
                let expected = |weights: [f64; 4]| {
                    let weight = weights.get(degree - n).copied();
                    weight.unwrap_or(0.0) * times
                };
                for (are_entire, weights) in [
                    (true, [1.0, 0.125, 0.0, 0.0]),
                    (false, [1.0, 1.0, 0.25, 0.25]),
                ] {
                    let error = f64::from(tail(are_entire, &found).x) - expected(weights);
                    assert!(
                        error.abs() < rounding * times,
                        "T{n}, {are_entire}: {error}"
                    );
                }
            }
        }
    }
}
