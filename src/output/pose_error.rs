//! Why poses cannot be put together as asked, and why parents make no skeleton.

use glam::Vec3;

use crate::memory::OutOfMemoryError;
use crate::output::rotations::Layout;

/// Why poses cannot be put together as asked. Indices count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseError {
    /// Nothing to blend.
    #[error("there is no layer to blend; give at least one")]
    NoLayer,
    /// Layers must be of the same tracks and samples, in the same order in memory.
    #[error(
        "layer {layer} has {} tracks with {} samples, {}, and the first {} with {}, {}; evaluate them at the same frames",
        shape.0, shape.1, shape.2, first.0, first.1, first.2
    )]
    Shape {
        /// The layer's index.
        layer: usize,
        /// Its tracks, samples and layout.
        shape: (usize, usize, Layout),
        /// Those of the first layer.
        first: (usize, usize, Layout),
    },
    /// A weight is NaN, infinite, or too large.
    #[error(
        "the weight of layer {layer} is {weight}; weights are finite, and within ±{LARGEST_WEIGHT:e}"
    )]
    WeightNotFinite {
        /// The layer's index.
        layer: usize,
        /// Its weight.
        weight: f32,
    },
    /// Slerp goes from 0 to 1.
    #[error("the weight is {weight}; between two rotations it is 0 to 1")]
    WeightOutOfRange {
        /// What was given.
        weight: f32,
    },
    /// An additive layer needs a reference rotation for each track.
    #[error("{references} reference rotations were given for {tracks} tracks; give one for each")]
    References {
        /// Rotations given.
        references: usize,
        /// Tracks of the layer.
        tracks: usize,
    },
    /// A skeleton of other tracks.
    #[error(
        "the skeleton has {skeleton_tracks} tracks, the poses have {tracks}; give one that has as many"
    )]
    Skeleton {
        /// Tracks of the skeleton.
        skeleton_tracks: usize,
        /// Tracks of the poses.
        tracks: usize,
    },
    /// It must be known of each track whether it has translations.
    #[error("`has_translation` has {entries} entries for {tracks} tracks; give one for each")]
    HasTranslation {
        /// Entries given.
        entries: usize,
        /// Tracks of the poses.
        tracks: usize,
    },
    /// An inverse bind matrix is needed for each track.
    #[error(
        "{matrices} inverse bind matrices were given for {tracks} tracks; give one for each, or none"
    )]
    InverseBind {
        /// Matrices given.
        matrices: usize,
        /// Tracks of the poses.
        tracks: usize,
    },
}

/// The largest magnitude of a weight of a blend: squares of sums of thousands of layers are finite.
pub(crate) const LARGEST_WEIGHT: f32 = 1e9;

/// The most tracks of a skeleton.
pub(crate) const MAX_TRACKS: usize = u32::MAX as usize;

/// Why parents make no skeleton. Indices count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SkeletonError {
    /// The numbers of parents and offsets differ.
    #[error("there are {parents} parents but {offsets} offsets; give one of each for every track")]
    Lengths {
        /// Parents given.
        parents: usize,
        /// Offsets given.
        offsets: usize,
    },
    /// A parent that does not exist.
    #[error("the parent of track {track} is track {parent}, but there are {tracks} tracks")]
    NoSuchParent {
        /// The track.
        track: usize,
        /// Its parent.
        parent: usize,
        /// How many there are.
        tracks: usize,
    },
    /// A track that is its own ancestor.
    #[error("track {track} is its own ancestor")]
    Cycle {
        /// One track of the circle.
        track: usize,
    },
    /// An offset is NaN or infinite.
    #[error("the offset of track {track} is {offset}, which is not finite")]
    OffsetNotFinite {
        /// The track.
        track: usize,
        /// Its offset.
        offset: Vec3,
    },
    /// Tracks are counted in 32 bits on a device.
    #[error("a skeleton of {tracks} tracks; the limit is {}", MAX_TRACKS)]
    TooMany {
        /// Tracks given.
        tracks: usize,
    },
    /// There is not the memory.
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemoryError),
}
