//! The result of an evaluation: a value of every track at every sample.

use std::fmt;
use std::marker::PhantomData;

use glam::{Quat, Vec3, Vec4};

use crate::math::canonical::canonical;
use crate::memory::OutOfMemoryError;
use crate::names::{counted, names};
use crate::output::buffer::OutputBuffer;
use crate::tracks::error::NORM_TOLERANCE;
use crate::tracks::rotation::Rotation;

/// The order of a result in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum Layout {
    /// `[track][frame]`: the samples of one track are contiguous.
    #[default]
    TrackMajor,
    /// `[frame][track]`: the tracks of one frame are contiguous.
    FrameMajor,
}

names! {
    Layout, "layout",
    TrackMajor => "track",
    FrameMajor => "frame",
}

impl Layout {
    /// The normal form of the layout for this number of samples: with a single sample both orders are the same, and
    /// it is track-major.
    pub(crate) fn of(self, samples: usize) -> Self {
        if samples == 1 { Self::TrackMajor } else { self }
    }

    /// The index of a track's sample among `tracks × samples` values; `None` out of range.
    #[must_use]
    pub fn index(
        self,
        track: usize,
        sample: usize,
        tracks: usize,
        samples: usize,
    ) -> Option<usize> {
        let inside = track < tracks && sample < samples && tracks.checked_mul(samples).is_some();
        inside.then(|| self.offset(track, sample, tracks, samples))
    }

    /// As [`Layout::index`], for a sample that is in range.
    #[inline]
    pub(crate) fn offset(
        self,
        track: usize,
        sample: usize,
        tracks: usize,
        samples: usize,
    ) -> usize {
        match self {
            Self::TrackMajor => track * samples + sample,
            Self::FrameMajor => sample * tracks + track,
        }
    }
}

/// Memory of a result: the process's memory, or mapped memory of a device.
pub(crate) trait Storage: Send + Sync {
    fn quats(&self) -> &[Quat];
}

impl Storage for OutputBuffer {
    fn quats(&self) -> &[Quat] {
        self
    }
}

/// The result of an evaluation: a value of every track at every sample, 16 bytes each. The shape is `(tracks,
/// samples)` or `(samples, tracks)`, depending on the [`Layout`].
pub struct Samples<T> {
    storage: Box<dyn Storage>,
    tracks: usize,
    samples: usize,
    layout: Layout,
    value: PhantomData<T>,
}

/// Unit quaternions, `x y z w` in memory.
pub type Rotations = Samples<Quat>;

/// Vectors, `x y z 0` in memory: velocities, accelerations, translations or scales.
pub type Vectors = Samples<Vec3>;

/// Why values cannot be used as a result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SamplesError {
    /// The number of values is not a multiple of the number of tracks.
    #[error(
        "{} do not divide among {}; give every track the same number", counted(*.values, "value"), counted(*.tracks, "track")
    )]
    Uneven {
        /// Number of values.
        values: usize,
        /// Number of tracks.
        tracks: usize,
    },
    /// A rotation's norm is not within [`NORM_TOLERANCE`] of 1, or a vector is not finite.
    #[error("value {index} is {value:?}; rotations are unit quaternions, and vectors finite")]
    OutOfRange {
        /// The value's index.
        index: usize,
        /// The value: `x y z w` of a rotation, `x y z 0` of a vector.
        value: [f32; 4],
    },
    /// There is not enough memory.
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemoryError),
}

impl<T> Samples<T> {
    pub(crate) fn new(
        storage: Box<dyn Storage>,
        tracks: usize,
        samples: usize,
        layout: Layout,
    ) -> Self {
        debug_assert_eq!(storage.quats().len(), tracks * samples);
        Self {
            storage,
            tracks,
            samples,
            layout,
            value: PhantomData,
        }
    }

    fn of_rows(
        rows: impl ExactSizeIterator<Item = Quat>,
        is_valid: impl Fn(Quat) -> bool,
        tracks: usize,
        layout: Layout,
    ) -> Result<Self, SamplesError> {
        let (values, samples) = (rows.len(), rows.len().checked_div(tracks).unwrap_or(0));
        if samples * tracks != values {
            return Err(SamplesError::Uneven { values, tracks });
        }
        let mut storage = OutputBuffer::new(values)?;
        for (index, (to, row)) in storage.iter_mut().zip(rows).enumerate() {
            let value = row.to_array();
            if !is_valid(row) {
                return Err(SamplesError::OutOfRange { index, value });
            }
            *to = Quat::from_array(value.map(canonical));
        }
        Ok(Self::new(Box::new(storage), tracks, samples, layout))
    }

    /// All values without a copy, as four numbers each: `x y z w` of rotations, `x y z 0` of vectors.
    #[must_use]
    pub fn as_arrays(&self) -> &[[f32; 4]] {
        bytemuck::cast_slice(self.storage.quats())
    }

    /// Number of tracks.
    #[must_use]
    pub fn track_count(&self) -> usize {
        self.tracks
    }

    /// Number of samples of each track.
    #[must_use]
    pub fn sample_count(&self) -> usize {
        self.samples
    }

    /// The order in memory.
    #[must_use]
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Tracks, samples and layout.
    pub(crate) fn shape(&self) -> (usize, usize, Layout) {
        (self.tracks, self.samples, self.layout)
    }

    /// The index of the value of a track at a sample; `None` out of range.
    fn offset(&self, track: usize, sample: usize) -> Option<usize> {
        (self.layout).index(track, sample, self.tracks, self.samples)
    }
}

impl Rotations {
    /// Makes a result from rotations of another source, [`Quat`] or `[f32; 4]`, of `tracks` tracks in this layout.
    /// Components below 2^-64 in magnitude become 0, as in every result.
    ///
    /// ```
    /// use tumble::{Device, Engine, Layout, Rotations, Smoothing, SmoothingKernel};
    /// // Two tracks of three samples, from a network or a tracker.
    /// let given = [[0.0, 0.0, 0.0, 1.0]; 6];
    /// let rotations = Rotations::of(&given, 2, Layout::TrackMajor)?;
    /// let calm = Smoothing::new(SmoothingKernel::Gaussian(2.0));
    /// let smooth = Engine::new(Device::Cpu)?.smooth(&rotations, &calm)?;
    /// assert_eq!(smooth.as_arrays(), given);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When the number of rotations is not a multiple of `tracks`, one is not a unit quaternion, or there is not
    /// enough memory.
    pub fn of<R: Rotation>(
        rotations: &[R],
        tracks: usize,
        layout: Layout,
    ) -> Result<Self, SamplesError> {
        let quats = rotations.iter().map(|rotation| rotation.quat());
        let is_unit = |q: Quat| (q.as_dquat().length() - 1.0).abs() <= NORM_TOLERANCE;
        Self::of_rows(quats, is_unit, tracks, layout)
    }

    /// All rotations, without a copy. If a device maps its memory, these are the values that the device wrote.
    #[must_use]
    pub fn as_quats(&self) -> &[Quat] {
        self.storage.quats()
    }

    /// The rotation of one track at one sample; `None` out of range.
    #[must_use]
    pub fn get(&self, track: usize, sample: usize) -> Option<Quat> {
        Some(self.as_quats()[self.offset(track, sample)?])
    }
}

impl Vectors {
    /// Makes a result from vectors of another source, [`Vec3`] or `[f32; 3]`; otherwise as [`Rotations::of`].
    ///
    /// # Errors
    /// As [`Rotations::of`], but when a vector is not finite instead of when a rotation is not a unit quaternion.
    pub fn of<V: Copy + Into<Vec3>>(
        vectors: &[V],
        tracks: usize,
        layout: Layout,
    ) -> Result<Self, SamplesError> {
        let rows = (vectors.iter()).map(|&vector| Quat::from_vec4(vector.into().extend(0.0)));
        Self::of_rows(rows, Quat::is_finite, tracks, layout)
    }

    /// All vectors, without a copy, each followed by 0.
    #[must_use]
    pub fn as_slice(&self) -> &[Vec4] {
        bytemuck::cast_slice(self.storage.quats())
    }

    /// The vector of one track at one sample; `None` out of range.
    #[must_use]
    pub fn get(&self, track: usize, sample: usize) -> Option<Vec3> {
        Some(self.as_slice()[self.offset(track, sample)?].truncate())
    }
}

impl<T> fmt::Debug for Samples<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Samples")
            .field("tracks", &self.tracks)
            .field("samples", &self.samples)
            .field("layout", &self.layout)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_result_is_refused() {
        let unit = [0.0, 0.6, 0.0, 0.8];
        let of = |second, tracks| {
            let rotations = [unit, second];
            Rotations::of(&rotations, tracks, Layout::TrackMajor)
                .map(|result| result.as_arrays()[1])
        };
        let tiny = [1e-20, 0.0, 0.0, 1.05];
        assert_eq!(of(tiny, 2), Ok([0.0, 0.0, 0.0, 1.05]));
        let values = 2;
        for tracks in [0, 3] {
            assert_eq!(
                of(unit, tracks),
                Err(SamplesError::Uneven { values, tracks })
            );
        }
        let (index, value) = (1, [0.0; 4]);
        assert_eq!(of(value, 1), Err(SamplesError::OutOfRange { index, value }));
        assert!(of([f32::NAN, 0.0, 0.0, 1.0], 1).is_err());
        let vectors = [[1.0; 3], [0.0, f32::INFINITY, 0.0]];
        let error = Vectors::of(&vectors, 1, Layout::TrackMajor).unwrap_err();
        let expected =
            "value 1 is [0.0, inf, 0.0, 0.0]; rotations are unit quaternions, and vectors finite";
        assert_eq!(error.to_string(), expected);
    }
}
