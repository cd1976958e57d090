//! Twin of `shaders/forms/evaluate_polynomial.wgsl` and `shaders/math/polynomial.wgsl`: the same
//! names, the same order.

use glam::Vec4;

use crate::shader::PolynomialSegment;
use crate::simd::lanes::{Lanes, Number};
use crate::twin::functions::{PolynomialBegun, polynomial_begin, polynomial_end};
use crate::twin::{Evaluate, Parameters, WHOLE_DEGREE};

/// The rows of coefficients of a polynomial of degree `ROWS` - 1: the whole, or one whose other coefficients are +0.
pub(crate) type Polynomial<const ROWS: usize> = [[f32; 4]; ROWS];

/// The items of [`Evaluate`] that polynomials of every degree have.
macro_rules! run_of_polynomial {
    () => {
        /// A quarter of the lanes: with all four components of a rotation side by side, the
        /// coefficients of a run nearly fit into the registers.
        #[inline(always)]
        fn samples<L: Lanes>() -> usize {
            L::COUNT / 4
        }

        #[inline(always)]
        fn load<L: Lanes>(distances: &[f32]) -> L {
            L::fourfold_of(distances)
        }

        type Begun<L: Lanes> = PolynomialBegun<L>;
        type Vectors<L: Lanes> = [L; 1];

        #[inline(always)]
        fn begin<L: Lanes, const IS_PIPELINED: bool>(
            _: L,
            parameters: &mut impl Parameters<L>,
        ) -> PolynomialBegun<L> {
            polynomial_begin(parameters.next())
        }
    };
}

/// The coefficients of these powers in all lanes. Written out without a closure, because closures are not always
/// inlined.
macro_rules! repeated {
    ($rows:expr, $($power:literal)+) => {
        [$(L::repeated($rows[$power])),+]
    };
}

impl Evaluate for PolynomialSegment {
    run_of_polynomial!();

    #[inline(always)]
    fn degree(&self) -> usize {
        // Compared as integers, so that no vector register is needed. This is exact, because coefficients are canonical
        // and none is -0.
        let [.., seventh, eighth, ninth, tenth] = &self.coefficients;
        let bits = |c: &[f32; 4]| -> u64 {
            let [low, high]: [u64; 2] = bytemuck::cast(*c);
            low | high
        };
        let ninth_on = bits(ninth) | bits(tenth);
        let seventh_on = bits(seventh) | bits(eighth) | ninth_on;
        if seventh_on == 0 {
            6
        } else if ninth_on == 0 {
            8
        } else {
            WHOLE_DEGREE
        }
    }

    #[inline(always)]
    fn evaluate<L: Lanes, const FILTER: bool, const IS_PIPELINED: bool, const DEGREE: usize>(
        &self,
        _: L,
        begun: PolynomialBegun<L>,
        parameters: &mut impl Parameters<L>,
    ) -> (PolynomialBegun<L>, [L; 1]) {
        let next = polynomial_begin(parameters.next());
        let c = &self.coefficients;
        let mut q = match DEGREE {
            6 => end_of_degree_6(repeated!(c, 0 1 2 3 4 5 6), begun),
            8 => end_of_degree_8(repeated!(c, 0 1 2 3 4 5 6 7 8), begun),
            _ => polynomial_end(repeated!(c, 0 1 2 3 4 5 6 7 8 9 10), begun),
        };
        if FILTER {
            q = q.canonical();
        }
        (next, [q])
    }

    #[inline(always)]
    fn at(&self, s: f32) -> Vec4 {
        self.coefficients.at(s)
    }
}

/// [`Evaluate`] for the rows of polynomials of one degree.
macro_rules! of_rows {
    ($rows:literal, $is_short:literal, $end:ident, $($power:literal)+) => {
        impl Evaluate for Polynomial<$rows> {
            run_of_polynomial!();

            const IS_SHORT: bool = $is_short;

            #[inline(always)]
            fn evaluate<
                L: Lanes,
                const FILTER: bool,
                const IS_PIPELINED: bool,
                const DEGREE: usize,
            >(
                &self,
                _: L,
                begun: PolynomialBegun<L>,
                parameters: &mut impl Parameters<L>,
            ) -> (PolynomialBegun<L>, [L; 1]) {
                let next = polynomial_begin(parameters.next());
                let mut q = $end(repeated!(self, $($power)+), begun);
                if FILTER {
                    q = q.canonical();
                }
                (next, [q])
            }

            #[inline(always)]
            fn at(&self, s: f32) -> Vec4 {
                $end(self.map(Vec4::from_array), polynomial_begin(Vec4::splat(s)))
            }
        }
    };
}

of_rows!(7, true, end_of_degree_6, 0 1 2 3 4 5 6);
of_rows!(9, true, end_of_degree_8, 0 1 2 3 4 5 6 7 8);
of_rows!(11, false, polynomial_end, 0 1 2 3 4 5 6 7 8 9 10);

/// [`polynomial_end`] for polynomials whose coefficients of higher powers than s⁶ are +0. The terms of these
/// coefficients are zeros. Leaving them out changes no bit, because no sum to which they would be added is -0.
#[inline(always)]
fn end_of_degree_6<N: Number>(c: [N; 7], begun: PolynomialBegun<N>) -> N {
    let PolynomialBegun { s, z, zz } = begun;
    let third = c[3] * s + c[2];
    let fifth = c[5] * s + c[4];
    let high = c[6] * z + fifth;
    c[0] + (high * zz + (third * z + c[1] * s))
}

/// The same for s⁸.
#[inline(always)]
fn end_of_degree_8<N: Number>(c: [N; 9], begun: PolynomialBegun<N>) -> N {
    let PolynomialBegun { s, z, zz } = begun;
    let third = c[3] * s + c[2];
    let fifth = c[5] * s + c[4];
    let seventh = c[7] * s + c[6];
    let high = c[8] * zz + (seventh * z + fifth);
    c[0] + (high * zz + (third * z + c[1] * s))
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::*;
    use crate::math::canonical::canonical;
    use crate::twin::functions::polynomial;

    /// Coefficients of all magnitudes, zeros among them, and parameters at which powers underflow.
    #[test]
    fn short_polynomials_have_the_bits_of_the_whole() {
        let random = &mut Rng::with_seed(3);
        let mut degrees = [0; 3];
        for round in 0..200_000 {
            let mut number = || match random.u32(0..6) {
                0 => 0.0,
                _ => canonical((random.f32() - 0.5) * 2.0f32.powi(random.i32(-64..4))),
            };
            let mut coefficients = [0.0; 11].map(|_| number());
            let s = number() * 0.5f32.powi(round % 70);
            let degree = [6, 8, 10][round as usize % 3];
            coefficients[degree + 1..].fill(0.0);
            let segment = PolynomialSegment {
                coefficients: coefficients.map(|c| [c, 0.0, c, 0.0]),
            };
            let whole = polynomial(coefficients, s);
            let begun = polynomial_begin(s);
            let rows = segment.coefficients;
            let (found, at) = match segment.degree() {
                6 => (
                    end_of_degree_6(std::array::from_fn(|i| coefficients[i]), begun),
                    rows.first_chunk::<7>().unwrap().at(s),
                ),
                8 => (
                    end_of_degree_8(std::array::from_fn(|i| coefficients[i]), begun),
                    rows.first_chunk::<9>().unwrap().at(s),
                ),
                _ => (whole, rows.at(s)),
            };
            let label = || format!("{coefficients:?} at {s:e}");
            assert_eq!(found.to_bits(), whole.to_bits(), "{}", label());
            let bits = |value: Vec4| value.to_array().map(f32::to_bits);
            assert_eq!(bits(at), bits(segment.at(s)), "{}", label());
            assert_eq!(at.x.to_bits(), whole.to_bits(), "{}", label());
            assert!(segment.degree() <= degree);
            degrees[(segment.degree() - 6) / 2] += 1;
        }
        assert!(degrees.iter().all(|&count| count > 10_000), "{degrees:?}");
    }
}
