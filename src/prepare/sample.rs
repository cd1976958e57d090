//! Samples of cubics, in vector lanes: the first half of a fit.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use super::fit::{FitBlock, Lane32, Lane64, Samples};
use super::intervals::LANES;
use super::nodes::Nodes;
use super::shape::Sampling;
use crate::branchless::{self, Algebra, Near, product, scaled};
use crate::cpu::sine_and_fall;
use crate::formula::Product;

/// A cubic about the middle of its piece, expanded: with `c_j` the cosine of the j-th
/// angle and `s_j` its sine divided by the length of its vector,
/// `q = Σ terms[4a+2b+c] {c,s}_1 {c,s}_2 {c,s}_3`.
pub(super) struct Expanded {
    pub(super) terms: [[Lane32; 4]; 8],
    /// The squares of the three vectors' lengths.
    pub(super) squares: [Lane32; 3],
    /// Coefficients of s, s² and s³ in the three basis functions.
    pub(super) powers: [[Lane32; 3]; 3],
}

/// By the expanded cubic, in f32; with a basis of each curve's own, or one for all.
pub(super) struct Expansion<const OWN_BASIS: bool>;

impl<const OWN_BASIS: bool> Sampling for Expansion<OWN_BASIS> {
    #[inline(always)]
    fn sample<const PAIRS: usize>(
        block: &mut FitBlock,
        count: usize,
        nodes: &Nodes<PAIRS>,
        samples: &mut Samples<PAIRS>,
    ) {
        let lane = [0.0; LANES];
        let mut expanded = Expanded {
            terms: [[lane; 4]; 8],
            squares: [lane; 3],
            powers: [[lane; 3]; 3],
        };
        block.expand::<OWN_BASIS>(count, &mut expanded);
        expanded.sample(count, nodes, samples);
    }
}

impl FitBlock {
    #[inline(always)]
    fn expand<const OWN_BASIS: bool>(&mut self, count: usize, expanded: &mut Expanded) {
        let Expanded {
            terms,
            squares,
            powers,
        } = expanded;
        let mut reaches = [0.0; LANES];
        // What each rotation has reached at the middle.
        let mut reached = [[[0.0; LANES]; 4]; 3];
        let (base, rest) = self.numbers.split_at(Product::VECTORS);
        for j in 0..3 {
            let mut holds = [0.0; LANES];
            let [vx, vy, vz] = &rest[3 * j..][..3] else {
                unreachable!("three of them")
            };
            let place = Product::BASIS + 4 * j;
            // A copy: what is written below could be what a reference shows.
            let shared: [f64; 4] = std::array::from_fn(|c| self.shape.shared[place + c]);
            let own = self.numbers.get(place..place + 4).unwrap_or_default();
            let at = |lane: usize| match OWN_BASIS {
                true => [own[0][lane], own[1][lane], own[2][lane], own[3][lane]],
                false => shared,
            };
            for lane in 0..count {
                let [c0, c1, c2, c3] = at(lane);
                let (middle, width) = (self.middles[lane], self.widths[lane]);
                let [x, y, z] = [vx[lane], vy[lane], vz[lane]];
                let square = x * x + y * y + z * z;
                let weight = ((c3 * middle + c2) * middle + c1) * middle + c0;
                let mut near = Near::new();
                let turn = near.exp(scaled([x, y, z], weight));
                holds[lane] = near.holds;
                for c in 0..4 {
                    reached[j][c][lane] = turn[c];
                }
                // B_j(middle + s width) - B_j(middle), in powers of s.
                let linear = ((3.0 * c3 * middle + 2.0 * c2) * middle + c1) * width;
                let quadratic = (3.0 * c3 * middle + c2) * width * width;
                let cubic = c3 * width * width * width;
                squares[j][lane] = square as f32;
                powers[0][j][lane] = linear as f32;
                powers[1][j][lane] = quadratic as f32;
                powers[2][j][lane] = cubic as f32;
                // At s = 1/2 and at -1/2, the farther.
                let far = (linear + 0.25 * cubic).abs() * 0.5 + quadratic.abs() * 0.25;
                let (far, reach) = (square * (far * far), reaches[lane]);
                reaches[lane] = if far > reach { far } else { reach };
            }
            for lane in (0..count).filter(|&lane| holds[lane] == 0.0) {
                let middle = self.middles[lane];
                let [c0, c1, c2, c3] = at(lane);
                let weight = ((c3 * middle + c2) * middle + c1) * middle + c0;
                let turn = branchless::exp(scaled([vx[lane], vy[lane], vz[lane]], weight));
                for c in 0..4 {
                    reached[j][c][lane] = turn[c];
                }
            }
        }
        self.reaches = reaches;
        let mut bases = [[[0.0; LANES]; 4]; 2];
        for lane in 0..count {
            let turn = |j: usize| {
                let [x, y, z, w]: &[Lane64; 4] = &reached[j];
                [x[lane], y[lane], z[lane], w[lane]]
            };
            let start = [base[0][lane], base[1][lane], base[2][lane], base[3][lane]];
            let first = product(start, turn(0));
            let second = product(first, turn(1));
            let third = product(second, turn(2));
            for c in 0..4 {
                bases[0][c][lane] = first[c] as f32;
                bases[1][c][lane] = second[c] as f32;
                terms[0][c][lane] = third[c] as f32;
            }
        }
        for lane in 0..count {
            let quaternion = |lanes: &[Lane32; 4]| {
                let [x, y, z, w] = lanes;
                [x[lane], y[lane], z[lane], w[lane]]
            };
            let turn = |j: usize| {
                let [x, y, z, w]: &[Lane64; 4] = &reached[j];
                [x[lane], y[lane], z[lane], w[lane]].map(|c| c as f32)
            };
            let vector = |j: usize| {
                let v = &rest[3 * j..][..3];
                [v[0][lane], v[1][lane], v[2][lane]].map(|c| c as f32)
            };
            let (v1, v2, v3) = (vector(0), vector(1), vector(2));
            let (r2, r3) = (turn(1), turn(2));
            let to_third = about(quaternion(&terms[0]), v3);
            let second = product32(about(quaternion(&bases[1]), v2), r3);
            let first = product32(about(quaternion(&bases[0]), v1), r2);
            let first_second = product32(about(first, v2), r3);
            let first = product32(first, r3);
            let all = [
                to_third,
                second,
                about(second, v3),
                first,
                about(first, v3),
                first_second,
                about(first_second, v3),
            ];
            for i in 0..7 {
                for c in 0..4 {
                    terms[i + 1][c][lane] = all[i][c];
                }
            }
        }
    }
}

/// The Hamilton product `a b` in f32.
#[inline(always)]
fn product32(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    ]
}

/// `a v`, `v` a vector.
#[inline(always)]
fn about(a: [f32; 4], v: [f32; 3]) -> [f32; 4] {
    [
        a[3] * v[0] + a[1] * v[2] - a[2] * v[1],
        a[3] * v[1] - a[0] * v[2] + a[2] * v[0],
        a[3] * v[2] + a[0] * v[1] - a[1] * v[0],
        -a[0] * v[0] - a[1] * v[1] - a[2] * v[2],
    ]
}

impl Expanded {
    #[inline(always)]
    pub(super) fn sample<const PAIRS: usize>(
        &self,
        count: usize,
        nodes: &Nodes<PAIRS>,
        Samples { middle, even, odd }: &mut Samples<PAIRS>,
    ) {
        *middle = self.terms[0];
        for (k, &node) in nodes.at.iter().enumerate() {
            let mut before = [[0.0; LANES]; 4];
            for lane in 0..count {
                let difference = self.difference(lane, -node);
                for c in 0..4 {
                    before[c][lane] = difference[c];
                }
            }
            for lane in 0..count {
                let difference = self.difference(lane, node);
                for c in 0..4 {
                    even[k][c][lane] = (difference[c] + before[c][lane]) * 0.5;
                    odd[k][c][lane] = (difference[c] - before[c][lane]) * 0.5;
                }
            }
        }
    }

    /// `q(s) - q(0)`.
    #[inline(always)]
    fn difference(&self, lane: usize, s: f32) -> [f32; 4] {
        let mut sines = [0.0; 3];
        let mut falls = [0.0; 3];
        for j in 0..3 {
            let [linear, quadratic, cubic] = [
                self.powers[0][j][lane],
                self.powers[1][j][lane],
                self.powers[2][j][lane],
            ];
            let weight = ((cubic * s + quadratic) * s + linear) * s;
            (sines[j], falls[j]) = sine_and_fall(weight, self.squares[j][lane] * (weight * weight));
        }
        // With cosines as 1 + fall, nothing is lost where the angles are small.
        let [s1, s2, s3] = sines;
        let [f1, f2, f3] = falls;
        let both = f2 + f3 + f2 * f3;
        let cs = s3 + f2 * s3;
        let sc = s2 + s2 * f3;
        let ss = s2 * s3;
        let cc = 1.0 + both;
        let mut difference = [0.0; 4];
        for c in 0..4 {
            let terms = [
                self.terms[0][c][lane],
                self.terms[1][c][lane],
                self.terms[2][c][lane],
                self.terms[3][c][lane],
                self.terms[4][c][lane],
                self.terms[5][c][lane],
                self.terms[6][c][lane],
                self.terms[7][c][lane],
            ];
            let rest = terms[1] * cs + terms[2] * sc + terms[3] * ss;
            let even = terms[0] * both + rest;
            let odd = terms[4] * cc + terms[5] * cs + terms[6] * sc + terms[7] * ss;
            difference[c] = even + (terms[0] + even) * f1 + odd * s1;
        }
        difference
    }
}
