//! Passes over poses: values that a machine computes from values.

use crate::machine::error::EvaluateError;
use crate::output::rotations::Layout;
use crate::shader::Link;
use crate::smooth::rows::{SampleRow, SmoothingPass};

/// A pass, and the values that it reads.
pub(crate) enum Pass<'a> {
    /// The weighted sum of layers.
    Blend {
        /// The values of each layer, one layer after another.
        layers: &'a [[f32; 4]],
        /// A weight for each layer.
        weights: &'a [f32],
    },
    /// Slerp.
    Mix {
        from: &'a [[f32; 4]],
        to: &'a [[f32; 4]],
        weight: f32,
    },
    /// A base, and the weighted difference of a layer from references.
    Add {
        base: &'a [[f32; 4]],
        layer: &'a [[f32; 4]],
        /// A reference for each value, and behind them the weight in the first component.
        references: &'a [[f32; 4]],
    },
    /// Rotations and positions in the world, of some frames.
    World {
        /// The rotations in the parents' frames, `[frame][joint]`.
        local: &'a [[f32; 4]],
        links: &'a [Link],
    },
}

/// A machine that runs passes.
pub(crate) trait PassRunner {
    /// The maximum number of values of 16 bytes that one pass reads of each input, and writes.
    fn window(&self) -> usize;

    /// Runs a pass into `output`: as many values as an input has, of [`Pass::World`] two for each.
    fn run(&self, pass: &Pass<'_>, output: &mut [[f32; 4]]) -> Result<(), EvaluateError>;

    /// Smooths all rows, except for the samples at their ends.
    fn smooth(
        &self,
        rows: &SampleRows<'_>,
        pass: &SmoothingPass<'_>,
        output: &mut [[f32; 4]],
    ) -> Result<(), EvaluateError>;
}

/// Values at the samples of tracks, one or more of each.
pub(crate) struct SampleRows<'a> {
    pub(crate) values: &'a [[f32; 4]],
    pub(crate) tracks: usize,
    pub(crate) samples: usize,
    pub(crate) layout: Layout,
}

impl SampleRows<'_> {
    /// The samples of a track.
    pub(crate) fn row(&self, track: usize) -> SampleRow<'_> {
        let at = |sample| self.layout.offset(track, sample, self.tracks, self.samples);
        SampleRow {
            values: self.values,
            first: at(0),
            stride: at(1) - at(0),
            count: self.samples,
        }
    }
}
