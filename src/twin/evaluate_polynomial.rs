//! Twin of `shaders/forms/evaluate_polynomial.wgsl` and `shaders/math/polynomial.wgsl`: the same
//! names, the same order.

use glam::Vec4;

use crate::shader::PolynomialSegment;
use crate::simd::lanes::Lanes;
pub(crate) use crate::twin::functions::polynomial;
use crate::twin::functions::{PolynomialBegun, polynomial_begin, polynomial_end};
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

    type Begun<L: Lanes> = PolynomialBegun<L>;
    type Vectors<L: Lanes> = [L; 1];

    #[inline(always)]
    fn begin<L: Lanes, const IS_PIPELINED: bool>(
        _: L,
        parameters: &mut impl Parameters<L>,
    ) -> PolynomialBegun<L> {
        polynomial_begin(parameters.next())
    }

    #[inline(always)]
    fn evaluate<L: Lanes, const FILTER: bool, const IS_PIPELINED: bool>(
        &self,
        _: L,
        begun: PolynomialBegun<L>,
        parameters: &mut impl Parameters<L>,
    ) -> (PolynomialBegun<L>, [L; 1]) {
        let next = polynomial_begin(parameters.next());
        // Written out: closures are not always inlined.
        macro_rules! coefficients {
            ($($power:literal)+) => {
                [$(L::repeated(self.coefficients[$power])),+]
            };
        }
        let mut q = polynomial_end(coefficients!(0 1 2 3 4 5 6 7 8 9 10), begun);
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
