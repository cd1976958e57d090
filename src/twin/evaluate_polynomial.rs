//! Twin of `shaders/forms/evaluate_polynomial.wgsl` and `shaders/math/polynomial.wgsl`: the same
//! names, the same order.

use glam::Vec4;

use crate::shader::PolynomialSegment;
use crate::simd::lanes::{Lanes, Number};
use crate::twin::{Evaluate, Parameters};

impl Evaluate for PolynomialSegment {
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

    type Begun<L: Lanes> = [L; 3];
    type Vectors<L: Lanes> = [L; 1];

    /// `s`, `s²` and `s⁴`.
    #[inline(always)]
    fn begin<L: Lanes, const IS_PIPELINED: bool>(
        _: L,
        parameters: &mut impl Parameters<L>,
    ) -> [L; 3] {
        powers(parameters.next())
    }

    #[inline(always)]
    fn evaluate<L: Lanes, const FILTER: bool, const IS_PIPELINED: bool>(
        &self,
        _: L,
        begun: [L; 3],
        parameters: &mut impl Parameters<L>,
    ) -> ([L; 3], [L; 1]) {
        let next = powers(parameters.next());
        // Written out: closures are not always inlined.
        macro_rules! coefficients {
            ($($power:literal)+) => {
                [$(L::repeated(self.coefficients[$power])),+]
            };
        }
        let mut q = by_powers(coefficients!(0 1 2 3 4 5 6 7 8 9 10), begun);
        if FILTER {
            q = q.canonical();
        }
        (next, [q])
    }

    #[inline(always)]
    fn at(&self, s: f32) -> Vec4 {
        polynomial(self.coefficients.map(Vec4::from_array), Vec4::splat(s))
    }
}

/// The polynomial with the coefficients `c` of 1, s, s², … s¹⁰.
#[inline(always)]
pub(crate) fn polynomial<N: Number>(c: [N; 11], s: N) -> N {
    by_powers(c, powers(s))
}

/// `s`, `s²` and `s⁴`.
#[inline(always)]
fn powers<N: Number>(s: N) -> [N; 3] {
    let z = s * s;
    [s, z, z * z]
}

#[inline(always)]
fn by_powers<N: Number>(c: [N; 11], [s, z, zz]: [N; 3]) -> N {
    let third = c[3] * s + c[2];
    let fifth = c[5] * s + c[4];
    let seventh = c[7] * s + c[6];
    let ninth = c[9] * s + c[8];
    let high = (c[10] * z + ninth) * zz + (seventh * z + fifth);
    c[0] + (high * zz + (third * z + c[1] * s))
}
