//! Results of scalars: a number for each scalar and sample.

use std::fmt;

use crate::memory::{OutOfMemoryError, zeroed};
use crate::output::rotations::Layout;

/// The purpose in [`OutOfMemoryError`].
const LABEL: &str = "scalars";

/// A number for every scalar of a set at every sample, such as the angles of a robot's joints in rad.
#[derive(Clone, PartialEq)]
pub struct Scalars {
    values: Vec<f32>,
    scalars: usize,
    samples: usize,
    layout: Layout,
}

impl Scalars {
    /// Zeros for so many scalars and samples.
    pub(crate) fn new(
        scalars: usize,
        samples: usize,
        layout: Layout,
    ) -> Result<Self, OutOfMemoryError> {
        Ok(Self {
            values: zeroed(scalars.saturating_mul(samples), LABEL)?,
            scalars,
            samples,
            layout,
        })
    }

    /// All numbers: `[scalar][sample]`, or with [`Layout::FrameMajor`] `[sample][scalar]`.
    #[must_use]
    pub fn as_slice(&self) -> &[f32] {
        &self.values
    }

    pub(crate) fn as_mut_slice(&mut self) -> &mut [f32] {
        &mut self.values
    }

    /// The number of one scalar at one sample; `None` out of range.
    #[must_use]
    pub fn get(&self, scalar: usize, sample: usize) -> Option<f32> {
        let index = (self.layout).index(scalar, sample, self.scalars, self.samples)?;
        Some(self.values[index])
    }

    /// Number of scalars.
    #[must_use]
    pub fn scalar_count(&self) -> usize {
        self.scalars
    }

    /// Number of samples of each scalar.
    #[must_use]
    pub fn sample_count(&self) -> usize {
        self.samples
    }

    /// The order in memory.
    #[must_use]
    pub fn layout(&self) -> Layout {
        self.layout
    }
}

impl fmt::Debug for Scalars {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scalars")
            .field("scalars", &self.scalars)
            .field("samples", &self.samples)
            .field("layout", &self.layout)
            .finish_non_exhaustive()
    }
}
