//! Formulas as values: construction of a [`Shape`] from a formula, and the shapes that several methods share.

use crate::curve::formula::{DeCasteljau, Formula, NUMBERS, Product, RotationVector, StraightLine};
use crate::fit::exact::expansion::Expansion;
use crate::fit::exact::fit::{FitBlock, SMALL_ANGLE, Shape};
use crate::fit::exact::sampling::{Directly, fit};
use crate::fit::motion::derivatives::{Motion, MotionOf};
use crate::math::dual::Dual;
use crate::shader::PolynomialSegment;

/// A formula of unit quaternions that takes `per_curve` numbers, as a value; sampled by itself.
pub(crate) const fn shape_of<F: Formula>(per_curve: usize) -> Shape {
    Shape {
        per_curve,
        shared: [0.0; NUMBERS],
        entire: false,
        is_unit: true,
        small_angle: SMALL_ANGLE,
        rotation: F::rotation::<f64>,
        moving: F::rotation::<Dual>,
        fit: fit::<Directly<F>>,
        fit_rates: fit::<Motion>,
        fit_at_constant_speed: fit::<Motion>,
    }
}

/// [`Product`] with Bernstein's basis.
pub(crate) static BERNSTEIN: Shape = Shape {
    per_curve: Product::BASIS,
    shared: Product::WITH_BERNSTEIN,
    entire: true,
    fit: fit::<Expansion<false>>,
    fit_rates: rates_of::<Product>(),
    ..shape_of::<Product>(NUMBERS)
};

/// [`Product`] whose basis functions differ from curve to curve.
pub(crate) static PRODUCT: Shape = Shape {
    entire: true,
    fit: fit::<Expansion<true>>,
    fit_rates: rates_of::<Product>(),
    ..shape_of::<Product>(NUMBERS)
};

/// [`DeCasteljau`] with four control rotations.
pub(crate) static DE_CASTELJAU: Shape = shape_of::<DeCasteljau>(16);

/// [`StraightLine`]s, whose values are vectors.
pub(crate) static LINE: Shape = Shape {
    is_unit: false,
    ..shape_of::<StraightLine>(8)
};

/// [`RotationVector`]s.
pub(crate) static ROTATION_VECTOR: Shape = Shape {
    fit_rates: rates_of::<RotationVector>(),
    ..shape_of::<RotationVector>(13)
};

/// The function that fits velocities and accelerations: in vector lanes, compiled for each formula; in WebAssembly,
/// where every page would load that code, curve by curve, with the same bits.
const fn rates_of<F: Formula>() -> fn(&mut FitBlock, &mut [PolynomialSegment]) {
    if cfg!(target_arch = "wasm32") {
        fit::<Motion>
    } else {
        fit::<MotionOf<F>>
    }
}
