//! The result of an evaluation: a value of every track at every sample.

use std::fmt;
use std::marker::PhantomData;

use glam::{Quat, Vec3, Vec4};

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

/// The result of an evaluation: a value of every track at every sample, 16 bytes each, of shape
/// `(tracks, samples)` or `(samples, tracks)`, as the [`Layout`] says.
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

    /// Where the value of one track at one sample lies; `None` out of range.
    fn place(&self, track: usize, sample: usize) -> Option<usize> {
        let inside = track < self.tracks && sample < self.samples;
        inside.then(|| (self.layout).index(track, sample, self.tracks, self.samples))
    }
}

impl Rotations {
    /// All rotations, without a copy: where a device maps its memory, these are the
    /// values that the device wrote.
    #[must_use]
    pub fn as_quats(&self) -> &[Quat] {
        self.storage.quats()
    }

    /// The rotation of one track at one sample; `None` out of range.
    #[must_use]
    pub fn get(&self, track: usize, sample: usize) -> Option<Quat> {
        Some(self.as_quats()[self.place(track, sample)?])
    }
}

impl Vectors {
    /// All of them, without a copy, each followed by 0.
    #[must_use]
    pub fn as_slice(&self) -> &[Vec4] {
        bytemuck::cast_slice(self.storage.quats())
    }

    /// The vector of one track at one sample; `None` out of range.
    #[must_use]
    pub fn get(&self, track: usize, sample: usize) -> Option<Vec3> {
        Some(self.as_slice()[self.place(track, sample)?].truncate())
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
