//! The result of an evaluation: the rotation of every track at every sample.

use std::fmt;

use glam::Quat;

use crate::output::buffer::OutputBuffer;

/// The order of a result in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum Layout {
    /// `[track][frame]`: the samples of one track lie together.
    #[default]
    TrackMajor,
    /// `[frame][track]`: the tracks of one frame lie together.
    FrameMajor,
}

impl Layout {
    /// The layout for this number of samples. With a single sample both orders are the same, and
    /// track-major stands for either.
    pub(crate) fn of(self, samples: usize) -> Self {
        if samples == 1 { Self::TrackMajor } else { self }
    }

    /// Where a sample of a track lies among `tracks × samples` rotations.
    #[must_use]
    pub fn index(self, track: usize, sample: usize, tracks: usize, samples: usize) -> usize {
        match self {
            Self::TrackMajor => track * samples + sample,
            Self::FrameMajor => sample * tracks + track,
        }
    }
}

/// Memory that holds a result: the process's own, or mapped memory of a device.
pub(crate) trait Storage: Send + Sync {
    fn quats(&self) -> &[Quat];
}

/// The result of an evaluation: unit quaternions, `x y z w` in memory, of shape
/// `(tracks, samples)` or `(samples, tracks)`, as the [`Layout`] says.
pub struct Rotations {
    storage: Box<dyn Storage>,
    tracks: usize,
    samples: usize,
    layout: Layout,
}

impl Rotations {
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
        }
    }

    /// Rotations from elsewhere, of so many tracks, in this order; `None` if their number is not a
    /// multiple of the tracks'.
    #[must_use]
    pub fn of(rotations: &[Quat], tracks: usize, layout: Layout) -> Option<Self> {
        let samples = rotations.len().checked_div(tracks).unwrap_or(0);
        if samples * tracks != rotations.len() {
            return None;
        }
        let mut storage = OutputBuffer::new(rotations.len());
        storage.copy_from_slice(rotations);
        Some(Self::new(Box::new(storage), tracks, samples, layout))
    }

    /// Number of tracks.
    #[must_use]
    pub fn tracks(&self) -> usize {
        self.tracks
    }

    /// Samples of each track.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// The order in memory.
    #[must_use]
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// All rotations, without a copy: where a device maps its memory, these are the
    /// values that the device wrote.
    #[must_use]
    pub fn as_quats(&self) -> &[Quat] {
        self.storage.quats()
    }

    /// The rotation of one track at one sample; `None` out of range.
    #[must_use]
    pub fn get(&self, track: usize, sample: usize) -> Option<Quat> {
        let inside = track < self.tracks && sample < self.samples;
        inside.then(|| self.as_quats()[self.layout.index(track, sample, self.tracks, self.samples)])
    }
}

impl fmt::Debug for Rotations {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Rotations")
            .field("tracks", &self.tracks)
            .field("samples", &self.samples)
            .field("layout", &self.layout)
            .finish_non_exhaustive()
    }
}
