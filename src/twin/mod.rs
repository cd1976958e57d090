//! Twins: the functions of the shaders in Rust, with the same names and the same order of operations, so that the CPU
//! gives the bits of an exact Vulkan device. Those of `shaders/forms/` are an [`Evaluate`], which the loops over a
//! run's samples call.

pub(crate) mod arc_between;
pub(crate) mod arc_tangent;
pub(crate) mod axis_angle;
pub(crate) mod crowd_compact;
pub(crate) mod crowd_entries;
pub(crate) mod crowd_layers;
pub(crate) mod crowd_matrices;
pub(crate) mod crowd_times;
// Each statement and operation of the shaders becomes one in Rust, even if it is not needed or could be shorter.
// Kernels that read texel buffers are run only in tests.
#[cfg(feature = "vulkan")]
#[allow(
    dead_code,
    unused_assignments,
    unused_variables,
    clippy::approx_constant,
    clippy::doc_markdown,
    clippy::if_not_else,
    clippy::let_and_return,
    clippy::needless_return,
    clippy::nonminimal_bool,
    clippy::redundant_closure,
    clippy::redundant_closure_for_method_calls
)]
#[path = "../../shaders/compiled/entries.rs"]
pub(crate) mod entries;
pub(crate) mod euler;
pub(crate) mod evaluate_arc;
pub(crate) mod evaluate_polynomial;
pub(crate) mod f16;
// Coefficients are written with all their digits, and in the shader's order.
#[allow(
    clippy::approx_constant,
    clippy::doc_markdown,
    clippy::excessive_precision
)]
#[path = "../../shaders/compiled/functions.rs"]
pub(crate) mod functions;
#[cfg(feature = "vulkan")]
pub(crate) mod machine;
pub(crate) mod matrix;
pub(crate) mod pose_add;
pub(crate) mod pose_blend;
pub(crate) mod pose_mix;
pub(crate) mod pose_smooth;
pub(crate) mod pose_steps;
pub(crate) mod pose_world;
pub(crate) mod quaternion;
pub(crate) mod sine_cosine;
pub(crate) mod small_angle;
pub(crate) mod snorm16;

use std::slice;

use bytemuck::NoUninit;
use glam::Vec4;

use crate::simd::lanes::{Lanes, Number as _};

/// The formula of one form, for segments of constants `x y z w`, of which the middle is the first. A run is evaluated
/// in iterations; each computes several samples at once.
pub(crate) trait Evaluate: NoUninit {
    /// A number that is the same for all samples of a run.
    #[inline(always)]
    fn constant(&self) -> f32 {
        0.0
    }

    /// Number of samples of an iteration.
    fn samples<L: Lanes>() -> usize;

    /// Loads the distances of an iteration's samples, in the lanes in which [`Evaluate::evaluate`] takes
    /// their parameters.
    fn load<L: Lanes>(distances: &[f32]) -> L;

    /// The minimum number of iterations of a run for software pipelining, in which samples start several iterations
    /// ahead; `None` if it is never faster. A sample is a long chain of dependent operations, and a processor looks
    /// ahead no more than an iteration or two.
    const PIPELINE_FROM: Option<usize> = None;

    /// Intermediate results of samples of later iterations.
    type Begun<L: Lanes>: Copy;

    /// An array of vectors with the rotations of an iteration's samples, side by side.
    type Vectors<L: Lanes>: AsRef<[L]>;

    /// Begins the samples of the first iteration and, if `IS_PIPELINED`, those of later ones.
    fn begin<L: Lanes, const IS_PIPELINED: bool>(
        constant: L,
        parameters: &mut impl Parameters<L>,
    ) -> Self::Begun<L>;

    /// The degree with which the segment is evaluated: 6 for curves of small angles, 8 for curves of not much larger
    /// ones, else [`WHOLE_DEGREE`]. Terms of higher powers are +0, which changes no bit of a sum: the samples have the
    /// bits that the whole degree gives.
    #[inline(always)]
    fn degree(&self) -> usize {
        WHOLE_DEGREE
    }

    /// Finishes the samples of an iteration, of a segment of this degree. Returns the intermediate results for the
    /// iterations after it, and the rotations. With `FILTER` all components are made
    /// [`canonical`](crate::math::canonical::canonical).
    fn evaluate<L: Lanes, const FILTER: bool, const IS_PIPELINED: bool, const DEGREE: usize>(
        &self,
        constant: L,
        begun: Self::Begun<L>,
        parameters: &mut impl Parameters<L>,
    ) -> (Self::Begun<L>, Self::Vectors<L>);

    /// The rotation at one parameter.
    fn at(&self, parameter: f32) -> Vec4;

    /// The same as samples are stored: [`canonical`](crate::math::canonical::canonical).
    #[inline(always)]
    fn value_at(&self, parameter: f32) -> [f32; 4] {
        self.at(parameter).canonical().to_array()
    }

    /// Whether segments of this type have only the coefficients of one degree and never need the filter of tiny
    /// components. Segments that need it have another type.
    const IS_SHORT: bool = false;

    /// Whether [`canonical`](crate::math::canonical::canonical) would change no component of any sample, so that no
    /// filter is needed. Each component is a sum `m + r`, where `m` is the component of the segment's middle. If
    /// `|m| >= 2^-40`, either `|r| < |m|/2`, and the sum exceeds 2^-41; or both are multiples of 2^-64, and so is the
    /// sum, which is +0 if they cancel. If all constants of the component are +0, it is +0.
    #[inline(always)]
    fn is_canonical(&self) -> bool {
        let constants: &[[f32; 4]] = bytemuck::cast_slice(slice::from_ref(self));
        let middle = Vec4::from_array(constants[0]).abs();
        middle.cmpge(Vec4::splat(COARSE)).all() || are_coarse_or_zero(constants)
    }
}

/// The degree with which every segment can be evaluated.
pub(crate) const WHOLE_DEGREE: usize = 10;

/// The smallest magnitude of a middle's component for which [`Evaluate::is_canonical`] is true.
pub(crate) const COARSE: f32 = 1.0 / (1u64 << 40) as f32;

/// As [`Evaluate::is_canonical`], for a middle with a small component. That is rare, so it is not
/// inlined.
#[inline(never)]
fn are_coarse_or_zero(constants: &[[f32; 4]]) -> bool {
    let is_zero = |c: usize| constants.iter().all(|constant| constant[c].to_bits() == 0);
    (0..4).all(|c| constants[0][c].abs() >= COARSE || is_zero(c))
}

/// The parameters of a run's samples, one iteration at a time. After the last sample there are more numbers, which
/// are not used.
pub(crate) trait Parameters<L> {
    fn next(&mut self) -> L;
}

// These tests also compare kernels, which exist only with the feature `vulkan`.
#[cfg(all(test, feature = "vulkan"))]
#[path = "../../tests/twins/mod.rs"]
mod tests;
