//! The segments of a group in the two forms that the CPU's loops read: a list of whole segments, or packed segments,
//! each of which is evaluated by the loop for its degree.

use crate::cpu::evaluate::distances;
use crate::cpu::streaming::Samples;
use crate::prepare::packed::{PackedSegments, of_degree};
use crate::simd::lanes::Lanes;
use crate::time::runs::Affine;
use crate::twin::Evaluate;

/// Segments by the index that their spans have.
pub(crate) trait SegmentList {
    /// As [`Samples::frames`].
    fn frames<L: Lanes, O: Samples + ?Sized>(
        &self,
        index: u32,
        affine: Affine,
        first: f32,
        start: usize,
        count: usize,
        output: &mut O,
    );

    /// As [`distances`].
    fn distances<L: Lanes>(
        &self,
        index: u32,
        affine: Affine,
        from_middle: &[f32],
        output: &mut [[f32; 4]],
    );

    /// The values at some parameters, one after the other.
    fn values_at(&self, index: u32, parameters: impl Iterator<Item = f32>, output: &mut [[f32; 4]]);
}

impl<S: Evaluate> SegmentList for [S] {
    #[inline(always)]
    fn frames<L: Lanes, O: Samples + ?Sized>(
        &self,
        index: u32,
        affine: Affine,
        first: f32,
        start: usize,
        count: usize,
        output: &mut O,
    ) {
        output.frames::<L, S>(&self[index as usize], affine, first, start, count);
    }

    #[inline(always)]
    fn distances<L: Lanes>(
        &self,
        index: u32,
        affine: Affine,
        from_middle: &[f32],
        output: &mut [[f32; 4]],
    ) {
        let count = output.len();
        distances::<L, S>(&self[index as usize], affine, from_middle, count, output);
    }

    #[inline(always)]
    fn values_at(
        &self,
        index: u32,
        parameters: impl Iterator<Item = f32>,
        output: &mut [[f32; 4]],
    ) {
        let segment = &self[index as usize];
        for (value, parameter) in output.iter_mut().zip(parameters) {
            *value = segment.value_at(parameter);
        }
    }
}

impl SegmentList for PackedSegments {
    #[inline(always)]
    fn frames<L: Lanes, O: Samples + ?Sized>(
        &self,
        index: u32,
        affine: Affine,
        first: f32,
        start: usize,
        count: usize,
        output: &mut O,
    ) {
        of_degree!(self.get(index), segment => output.frames::<L, _>(segment, affine, first, start, count));
    }

    #[inline(always)]
    fn distances<L: Lanes>(
        &self,
        index: u32,
        affine: Affine,
        from_middle: &[f32],
        output: &mut [[f32; 4]],
    ) {
        let count = output.len();
        of_degree!(self.get(index), segment => distances::<L, _>(segment, affine, from_middle, count, output));
    }

    #[inline(always)]
    fn values_at(
        &self,
        index: u32,
        parameters: impl Iterator<Item = f32>,
        output: &mut [[f32; 4]],
    ) {
        of_degree!(self.get(index), segment => std::slice::from_ref(segment).values_at(0, parameters, output));
    }
}
