//! Samples of cubics, in vector lanes: the first half of a fit.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use super::fit::{FitBlock, Lane32, Lane64, Samples};
use super::intervals::LANES;
use super::nodes::Nodes;
use super::shape::Sampling;
use crate::branchless::{self, Algebra, Near, product, scaled};
use crate::cpu::{Lanes, Number, sine_and_fall};
use crate::formula::Product;

/// Cubics about the middle of their pieces: `q = q_0 exp(v_1 B_1) exp(v_2 B_2) exp(v_3 B_3)`.
pub(super) struct Middles {
    /// What the rotations before each vector, and behind the last, have made of it there.
    bases: [[Lane32; 4]; 3],
    /// The rotations by the second and by the third vector alone.
    turns: [[Lane32; 4]; 2],
    vectors: [[Lane32; 3]; 3],
    /// The squares of the three vectors' lengths.
    squares: [Lane32; 3],
    /// Coefficients of s, s² and s³ in the three basis functions.
    powers: [[Lane32; 3]; 3],
}

/// By the expanded cubic, in f32; with a basis of each curve's own, or one for all.
pub(super) struct Expansion<const OWN_BASIS: bool>;

impl<const OWN_BASIS: bool> Sampling for Expansion<OWN_BASIS> {
    #[inline(always)]
    fn fit<L: Lanes, const PAIRS: usize>(block: &mut FitBlock, count: usize, nodes: &Nodes<PAIRS>) {
        let lane = [0.0; LANES];
        let mut middles = Middles {
            bases: [[lane; 4]; 3],
            turns: [[lane; 4]; 2],
            vectors: [[lane; 3]; 3],
            squares: [lane; 3],
            powers: [[lane; 3]; 3],
        };
        block.at_middles::<OWN_BASIS>(count, &mut middles);
        for lane in (0..count).step_by(L::COUNT) {
            let samples = Expanded::<L>::new(&middles, lane).sample(nodes);
            block.interpolate(lane, nodes, &samples);
        }
    }
}

impl FitBlock {
    #[inline(always)]
    fn at_middles<const OWN_BASIS: bool>(&mut self, count: usize, found: &mut Middles) {
        let Middles {
            bases,
            turns,
            vectors,
            squares,
            powers,
        } = found;
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
                bases[2][c][lane] = third[c] as f32;
                turns[0][c][lane] = reached[1][c][lane] as f32;
                turns[1][c][lane] = reached[2][c][lane] as f32;
            }
        }
        for j in 0..3 {
            for c in 0..3 {
                for lane in 0..count {
                    vectors[j][c][lane] = rest[3 * j + c][lane] as f32;
                }
            }
        }
    }
}

/// The Hamilton product `a b` in f32.
#[inline(always)]
fn product32<N: Number>(a: [N; 4], b: [N; 4]) -> [N; 4] {
    [
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    ]
}

/// `a v`, `v` a vector.
#[inline(always)]
fn about<N: Number>(a: [N; 4], v: [N; 3]) -> [N; 4] {
    [
        a[3] * v[0] + a[1] * v[2] - a[2] * v[1],
        a[3] * v[1] - a[0] * v[2] + a[2] * v[0],
        a[3] * v[2] + a[0] * v[1] - a[1] * v[0],
        -a[0] * v[0] - a[1] * v[1] - a[2] * v[2],
    ]
}

/// Cubics about the middle of their pieces, expanded, a lane to each: with `c_j` the cosine
/// of the j-th angle and `s_j` its sine divided by the length of its vector,
/// `q = Σ terms[4a+2b+c] {c,s}_1 {c,s}_2 {c,s}_3`.
struct Expanded<L> {
    terms: [[L; 4]; 8],
    squares: [L; 3],
    powers: [[L; 3]; 3],
}

impl<L: Lanes> Expanded<L> {
    /// The cubics from `lane` on.
    #[inline(always)]
    fn new(middles: &Middles, lane: usize) -> Self {
        let Middles {
            bases,
            turns,
            vectors,
            squares,
            powers,
        } = middles;
        // Written out: closures are not always inlined.
        let (r2, r3) = (load4(&turns[0], lane), load4(&turns[1], lane));
        let v1: [L; 3] = load3(&vectors[0], lane);
        let (v2, v3) = (load3(&vectors[1], lane), load3(&vectors[2], lane));
        let third = load4(&bases[2], lane);
        let second = product32(about(load4(&bases[1], lane), v2), r3);
        let first = product32(about(load4(&bases[0], lane), v1), r2);
        let first_second = product32(about(first, v2), r3);
        let first = product32(first, r3);
        Self {
            terms: [
                third,
                about(third, v3),
                second,
                about(second, v3),
                first,
                about(first, v3),
                first_second,
                about(first_second, v3),
            ],
            squares: load3(squares, lane),
            powers: [
                load3(&powers[0], lane),
                load3(&powers[1], lane),
                load3(&powers[2], lane),
            ],
        }
    }

    /// Samples them at every node.
    #[inline(always)]
    fn sample<const PAIRS: usize>(&self, nodes: &Nodes<PAIRS>) -> Samples<L, PAIRS> {
        let half = L::all(0.5);
        let mut samples = Samples::all(L::all(0.0));
        samples.middle = self.terms[0];
        for k in 0..PAIRS {
            let [before, after] = self.differences(L::all(nodes.at[k]));
            for c in 0..4 {
                samples.even[k][c] = (after[c] + before[c]) * half;
                samples.odd[k][c] = (after[c] - before[c]) * half;
            }
        }
        samples
    }

    /// `q(-s) - q(0)` and `q(s) - q(0)`, side by side: each is a long chain.
    #[inline(always)]
    fn differences(&self, s: L) -> [[L; 4]; 2] {
        let first = self.turns(0, s);
        let second = self.turns(1, s);
        let third = self.turns(2, s);
        let mut differences = [self.terms[0]; 2];
        for i in 0..2 {
            let ((s1, f1), (s2, f2), (s3, f3)) = (first[i], second[i], third[i]);
            // With cosines as 1 + fall, nothing is lost where the angles are small.
            let both = f2 + f3 + f2 * f3;
            let cs = s3 + f2 * s3;
            let sc = s2 + s2 * f3;
            let ss = s2 * s3;
            let cc = L::all(1.0) + both;
            for c in 0..4 {
                let terms = [
                    self.terms[0][c],
                    self.terms[1][c],
                    self.terms[2][c],
                    self.terms[3][c],
                    self.terms[4][c],
                    self.terms[5][c],
                    self.terms[6][c],
                    self.terms[7][c],
                ];
                let rest = terms[1] * cs + terms[2] * sc + terms[3] * ss;
                let even = terms[0] * both + rest;
                let odd = terms[4] * cc + terms[5] * cs + terms[6] * sc + terms[7] * ss;
                differences[i][c] = even + (terms[0] + even) * f1 + odd * s1;
            }
        }
        differences
    }

    /// Sine over length, and cosine less 1, of the j-th angle at `-s` and at `s`.
    #[inline(always)]
    fn turns(&self, j: usize, s: L) -> [(L, L); 2] {
        let [linear, quadratic, cubic] = [self.powers[0][j], self.powers[1][j], self.powers[2][j]];
        let rise = cubic * s;
        // The same as with -s, to the bit.
        let before = -((linear - (quadratic - rise) * s) * s);
        let after = ((rise + quadratic) * s + linear) * s;
        [
            sine_and_fall(before, self.squares[j] * (before * before)),
            sine_and_fall(after, self.squares[j] * (after * after)),
        ]
    }
}

#[inline(always)]
fn load3<L: Lanes>([x, y, z]: &[Lane32; 3], lane: usize) -> [L; 3] {
    [
        L::load(&x[lane..]),
        L::load(&y[lane..]),
        L::load(&z[lane..]),
    ]
}

#[inline(always)]
fn load4<L: Lanes>([x, y, z, w]: &[Lane32; 4], lane: usize) -> [L; 4] {
    [
        L::load(&x[lane..]),
        L::load(&y[lane..]),
        L::load(&z[lane..]),
        L::load(&w[lane..]),
    ]
}
