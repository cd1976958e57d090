//! Why poses cannot be put together as asked, and why parents make no skeleton.

use std::fmt;

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
    /// Other weights than a pass takes.
    #[error("{weights} weights were given, and the pass takes {needed}; give one for each")]
    WeightCount {
        /// Weights given.
        weights: usize,
        /// Layers of a blend; 1 for two layers that are mixed or added, and 0 for a skeleton.
        needed: usize,
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
    /// A skeleton is walked frame by frame.
    #[error(
        "the poses of a skeleton lie track by track in the buffer; evaluate them frame by frame (Layout::FrameMajor)"
    )]
    TrackMajor,
    /// The range of a buffer does not fit what a pass reads or writes there.
    #[error(
        "{operand}: the buffer's range of {size} bytes at {offset} does not fit; {needed} bytes are needed, from a multiple of {step} on"
    )]
    Buffer {
        /// What lies there.
        operand: PassOperand,
        /// Where the range starts, bytes.
        offset: u64,
        /// Its length, bytes.
        size: u64,
        /// Bytes that are read or written there.
        needed: u64,
        /// The range starts at a multiple of so many bytes.
        step: u64,
    },
    /// A pass would overwrite what it reads.
    #[error("the result overlaps input {input} of the pass in its buffer; write it elsewhere")]
    Overlap {
        /// The input's index, in the order in which the pass names its inputs.
        input: usize,
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

/// What lies in a buffer for a pass over poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PassOperand {
    /// An input, by its index in the order in which the pass names its inputs.
    Input(usize),
    /// The result.
    Result,
}

impl fmt::Display for PassOperand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(index) => write!(f, "input {index}"),
            Self::Result => f.write_str("the result"),
        }
    }
}

/// Where the range of a buffer may start that a kernel binds: no device may ask for more (Vulkan's limit of
/// `minStorageBufferOffsetAlignment`).
pub(crate) const OFFSET_STEP: u64 = 256;

/// Refuses weights of a blend that are not finite, or too large.
pub(crate) fn check_weights(weights: &[f32]) -> Result<(), PoseError> {
    let is_refused = |weight: &f32| weight.is_nan() || weight.abs() > LARGEST_WEIGHT;
    match weights.iter().position(is_refused) {
        Some(layer) => Err(PoseError::WeightNotFinite {
            layer,
            weight: weights[layer],
        }),
        None => Ok(()),
    }
}

/// Refuses a weight that is no fraction of the way from one rotation to another.
pub(crate) fn check_fraction(weight: f32) -> Result<(), PoseError> {
    match (0.0..=1.0).contains(&weight) {
        true => Ok(()),
        false => Err(PoseError::WeightOutOfRange { weight }),
    }
}

/// Refuses a number of reference rotations that is not that of the tracks.
pub(crate) fn check_references(references: usize, tracks: usize) -> Result<(), PoseError> {
    match references == tracks {
        true => Ok(()),
        false => Err(PoseError::References { references, tracks }),
    }
}

/// Refuses a skeleton of other tracks.
pub(crate) fn check_skeleton(skeleton_tracks: usize, tracks: usize) -> Result<(), PoseError> {
    match skeleton_tracks == tracks {
        true => Ok(()),
        false => Err(PoseError::Skeleton {
            skeleton_tracks,
            tracks,
        }),
    }
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
    /// Not enough memory.
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemoryError),
}
