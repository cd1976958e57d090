//! Twin of `shaders/forms/evaluate_arc.wgsl` and `shaders/math/norm_squared.wgsl`: the same names, the same order.

use glam::Vec4;

use crate::shader::ArcSegment;
use crate::simd::lanes::{Lanes, Number};
pub(crate) use crate::twin::functions::norm_squared;
use crate::twin::sine_cosine::{
    SineCosm1QuarterBegun, sine_cosm1_quarter, sine_cosm1_quarter_begin, sine_cosm1_quarter_end,
};
use crate::twin::{Evaluate, Parameters};

impl Evaluate for ArcSegment {
    #[inline(always)]
    fn constant(&self) -> f32 {
        norm_squared(self.tangent)
    }

    #[inline(always)]
    fn samples<L: Lanes>() -> usize {
        L::COUNT
    }

    #[inline(always)]
    fn load<L: Lanes>(distances: &[f32]) -> L {
        L::load(distances)
    }

    const PIPELINE_FROM: Option<usize> = Some(5);

    type Begun<L: Lanes> = Begun<L>;
    type Vectors<L: Lanes> = [L; 4];

    #[inline(always)]
    fn begin<L: Lanes, const IS_PIPELINED: bool>(
        square: L,
        parameters: &mut impl Parameters<L>,
    ) -> Begun<L> {
        let (parameter, z) = parameter_and_square(square, parameters);
        let halves = sine_cosm1_quarter_begin(parameter, z);
        let mut begun = Begun {
            sine_cosine: sine_cosm1_quarter_end(halves),
            halves,
            parameter,
            z,
        };
        if IS_PIPELINED {
            // After two steps `sine_cosine` belongs to the first iteration, `halves` to the second and
            // `parameter` to the third; the values before were placeholders.
            begun = begun.next(square, parameters).next(square, parameters);
        }
        begun
    }

    #[inline(always)]
    fn evaluate<L: Lanes, const FILTER: bool, const IS_PIPELINED: bool, const DEGREE: usize>(
        &self,
        square: L,
        begun: Begun<L>,
        parameters: &mut impl Parameters<L>,
    ) -> (Begun<L>, [L; 4]) {
        let (middle, tangent) = (L::repeated(self.middle), L::repeated(self.tangent));
        let (sine, cosine_minus_one) = if IS_PIPELINED {
            begun.sine_cosine
        } else {
            sine_cosm1_quarter(begun.parameter, begun.z)
        };
        let (s, f) = (sine.fourfold(), cosine_minus_one.fourfold());
        // Written out without a closure, because closures are not always inlined.
        let mut quarters = [
            arc_component(middle, tangent, s[0], f[0]),
            arc_component(middle, tangent, s[1], f[1]),
            arc_component(middle, tangent, s[2], f[2]),
            arc_component(middle, tangent, s[3], f[3]),
        ];
        if FILTER {
            // Not by a call of `lanes::canonical`, which makes SSE2 take 1.5 times as long.
            quarters = [
                quarters[0].canonical(),
                quarters[1].canonical(),
                quarters[2].canonical(),
                quarters[3].canonical(),
            ];
        }
        (begun.next(square, parameters), quarters)
    }

    #[inline(always)]
    fn at(&self, parameter: f32) -> Vec4 {
        let z = parameter * parameter * self.constant();
        let (sine, cosine_minus_one) = sine_cosm1_quarter(parameter, z);
        let (sine, cosine_minus_one) = (Vec4::splat(sine), Vec4::splat(cosine_minus_one));
        arc_component(
            self.middle.into(),
            self.tangent.into(),
            sine,
            cosine_minus_one,
        )
    }
}

/// Intermediate results of the samples of the next three iterations. Without `IS_PIPELINED` only
/// `parameter` and `z` are used, and belong to the next iteration.
#[derive(Clone, Copy)]
pub(crate) struct Begun<L> {
    /// Sine and cosine minus one, for the next iteration.
    sine_cosine: (L, L),
    /// The half-finished sine and cosine of the iteration after it.
    halves: SineCosm1QuarterBegun<L>,
    /// The parameter and the angle's square of the third iteration.
    parameter: L,
    z: L,
}

impl<L: Lanes> Begun<L> {
    /// The intermediate results one iteration later.
    #[inline(always)]
    fn next(self, square: L, parameters: &mut impl Parameters<L>) -> Self {
        let (parameter, z) = parameter_and_square(square, parameters);
        Self {
            sine_cosine: sine_cosm1_quarter_end(self.halves),
            halves: sine_cosm1_quarter_begin(self.parameter, self.z),
            parameter,
            z,
        }
    }
}

#[inline(always)]
fn parameter_and_square<L: Lanes>(square: L, parameters: &mut impl Parameters<L>) -> (L, L) {
    let parameter = parameters.next();
    (parameter, parameter * parameter * square)
}

/// The rotation at a parameter of an arc.
#[inline(always)]
pub(crate) fn on_arc<N: Number>(
    middle: [N; 4],
    tangent: [N; 4],
    square: N,
    parameter: N,
) -> [N; 4] {
    let z = parameter * parameter * square;
    let (sine, cosine_minus_one) = sine_cosm1_quarter(parameter, z);
    [
        arc_component(middle[0], tangent[0], sine, cosine_minus_one),
        arc_component(middle[1], tangent[1], sine, cosine_minus_one),
        arc_component(middle[2], tangent[2], sine, cosine_minus_one),
        arc_component(middle[3], tangent[3], sine, cosine_minus_one),
    ]
}

#[inline(always)]
fn arc_component<N: Number>(middle: N, tangent: N, sine: N, cosine_minus_one: N) -> N {
    middle + (middle * cosine_minus_one + tangent * sine)
}
