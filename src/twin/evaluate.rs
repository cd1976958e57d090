//! How a form's formula is evaluated in vector lanes: what the twins of the shaders in
//! `shaders/forms/` provide, and what the loops over a run's samples ask of them.

use glam::Vec4;

use crate::simd::lanes::Lanes;

/// One form's formula.
pub(crate) trait Evaluate: Copy {
    /// What is the same for all samples.
    #[inline(always)]
    fn constant(&self) -> f32 {
        0.0
    }

    /// How many samples are worked out at once.
    fn samples<L: Lanes>() -> usize;

    /// Their distances, as [`Evaluate::evaluate`] takes their parameters.
    fn load<L: Lanes>(distances: &[f32]) -> L;

    /// The fewest turns in which it pays to begin samples several turns before their own.
    /// Their operations are long chains, and a processor looks ahead no farther than a turn or
    /// two.
    const FAR_FROM: Option<usize> = None;

    /// What is known of samples before it is their turn.
    type Begun<L: Lanes>: Copy;

    /// The rotations of a turn's samples, side by side: in so many vectors.
    type Vectors<L: Lanes>: AsRef<[L]>;

    /// Begins with the first samples; and, where that is `FAR`, with those of later turns.
    fn begin<L: Lanes, const FAR: bool>(
        constant: L,
        parameters: &mut impl Parameters<L>,
    ) -> Self::Begun<L>;

    /// What is known of the samples behind those that are next, and the rotations of these.
    /// Where there may be tiny components, `FILTER` makes them [`canonical`](crate::math::canonical::canonical).
    fn evaluate<L: Lanes, const FILTER: bool, const FAR: bool>(
        &self,
        constant: L,
        begun: Self::Begun<L>,
        parameters: &mut impl Parameters<L>,
    ) -> (Self::Begun<L>, Self::Vectors<L>);

    /// The rotation at one parameter.
    fn at(&self, parameter: f32) -> Vec4;

    /// Whether [`canonical`](crate::math::canonical::canonical) would change no component of any sample. Each is a sum `m + r`
    /// with the segment's middle `m`. Where |m| >= 2^-40, either |r| < |m|/2, and the sum is
    /// more than 2^-41; or both are multiples of 2^-64, and so is the sum, which is +0 where
    /// they cancel. Where all of the component's constants are +0, it is +0.
    fn is_canonical(&self) -> bool;
}

/// See [`Evaluate::is_canonical`].
pub(crate) const COARSE: f32 = 1.0 / (1u64 << 40) as f32;

/// Whether no component of a segment's middle is smaller than [`COARSE`].
#[inline(always)]
pub(crate) fn is_coarse(middle: [f32; 4]) -> bool {
    let magnitudes = Vec4::from_array(middle).abs();
    magnitudes.cmpge(Vec4::splat(COARSE)).all()
}

/// The parameters of a run's samples, a vector at a time. Behind the last there are more, which
/// mean nothing.
pub(crate) trait Parameters<L> {
    fn next(&mut self) -> L;
}
