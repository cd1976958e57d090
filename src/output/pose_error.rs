//! Errors of combining poses, and of making skeletons.

use std::fmt;

use glam::Vec3;

use crate::memory::OutOfMemoryError;
use crate::names::counted;
use crate::output::rotations::Layout;

/// Why poses cannot be combined as requested. Indices count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseError {
    /// There is no layer to blend.
    #[error("there is no layer to blend; give at least one")]
    NoLayer,
    /// The layers differ in tracks, samples or layout.
    #[error(
        "layer {layer} has {} tracks with {} samples, {}, and the first {} with {}, {}; evaluate them at the same frames",
        shape.0, shape.1, shape.2, first.0, first.1, first.2
    )]
    Shape {
        /// The layer's index.
        layer: usize,
        /// The layer's tracks, samples and layout.
        shape: (usize, usize, Layout),
        /// The first layer's tracks, samples and layout.
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
    /// A weight is outside 0 to 1.
    #[error("the weight is {weight}; between two rotations it is 0 to 1")]
    WeightOutOfRange {
        /// The weight.
        weight: f32,
    },
    /// The number of weights does not fit the pass.
    #[error("{}, and the pass takes {needed}; give one for each", counted(*.weights, "weight"))]
    WeightCount {
        /// The number of weights.
        weights: usize,
        /// The required number: the layers of a blend; 1 for two layers that are mixed or added; 0 for a skeleton.
        needed: usize,
    },
    /// The number of an additive layer's reference rotations is not the number of tracks.
    #[error("{} for {}; give one for each", counted(*.references, "reference rotation"), counted(*.tracks, "track"))]
    References {
        /// The number of reference rotations.
        references: usize,
        /// The number of the layer's tracks.
        tracks: usize,
    },
    /// The number of weights is not the number of rotations.
    #[error("{} for {}; give one for each", counted(*.weights, "weight"), counted(*.rotations, "rotation"))]
    RotationWeights {
        /// The number of weights.
        weights: usize,
        /// The number of rotations of a layer.
        rotations: usize,
    },
    /// The skeleton's number of tracks differs from the poses'.
    #[error(
        "the skeleton has {}, the poses have {tracks}; give one that has as many", counted(*.skeleton_tracks, "track")
    )]
    Skeleton {
        /// The number of the skeleton's tracks.
        skeleton_tracks: usize,
        /// The number of the poses' tracks.
        tracks: usize,
    },
    /// The poses for a skeleton are in track-major layout.
    #[error(
        "the poses of a skeleton lie track by track in the buffer; evaluate them frame by frame (Layout::FrameMajor)"
    )]
    TrackMajor,
    /// The range of a buffer does not fit the input or the result of a pass.
    #[error(
        "{operand}: the buffer's range of {size} bytes at {offset} does not fit; {needed} bytes are needed, from a multiple of {step} on"
    )]
    Buffer {
        /// The input or the result.
        operand: PassOperand,
        /// The start of the range in bytes.
        offset: u64,
        /// The length of the range in bytes.
        size: u64,
        /// The required length in bytes.
        needed: u64,
        /// The range must start at a multiple of this number of bytes.
        step: u64,
    },
    /// The result of a pass would overwrite an input.
    #[error("the result overlaps input {input} of the pass in its buffer; write it elsewhere")]
    Overlap {
        /// The input's index, in the order of the pass's fields.
        input: usize,
    },
    /// `has_translation` does not have one entry for each track.
    #[error("`has_translation` has {} for {}; give one for each", counted(*.entries, "entry"), counted(*.tracks, "track"))]
    HasTranslation {
        /// The number of entries.
        entries: usize,
        /// The number of the poses' tracks.
        tracks: usize,
    },
    /// The number of inverse bind matrices differs from the number of tracks.
    #[error(
        "{matrices} inverse bind matrices for {}; give one for each, or none", counted(*.tracks, "track")
    )]
    InverseBind {
        /// The number of matrices.
        matrices: usize,
        /// The number of the poses' tracks.
        tracks: usize,
    },
}

/// An operand of a pass over poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PassOperand {
    /// An input, by its index in the order of the pass's fields.
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

/// The alignment of buffer ranges that works on every device: the maximum of Vulkan's limit
/// `minStorageBufferOffsetAlignment` in bytes.
pub(crate) const OFFSET_STEP: u64 = 256;

/// Refuses weights of a blend that are not finite, or are too large.
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

/// Refuses a weight that is not from 0 to 1.
pub(crate) fn check_fraction(weight: f32) -> Result<(), PoseError> {
    match (0.0..=1.0).contains(&weight) {
        true => Ok(()),
        false => Err(PoseError::WeightOutOfRange { weight }),
    }
}

/// Refuses weights that are not one for each rotation.
pub(crate) fn check_weight_count(weights: usize, rotations: usize) -> Result<(), PoseError> {
    match weights == rotations {
        true => Ok(()),
        false => Err(PoseError::RotationWeights { weights, rotations }),
    }
}

/// Refuses reference rotations that are not one for each track.
pub(crate) fn check_references(references: usize, tracks: usize) -> Result<(), PoseError> {
    match references == tracks {
        true => Ok(()),
        false => Err(PoseError::References { references, tracks }),
    }
}

/// Refuses a skeleton with another number of tracks.
pub(crate) fn check_skeleton(skeleton_tracks: usize, tracks: usize) -> Result<(), PoseError> {
    match skeleton_tracks == tracks {
        true => Ok(()),
        false => Err(PoseError::Skeleton {
            skeleton_tracks,
            tracks,
        }),
    }
}

/// The largest magnitude of a blend's weight: with it, the squares of sums of thousands of layers are finite.
pub(crate) const LARGEST_WEIGHT: f32 = 1e9;

/// The maximum number of tracks of a skeleton.
pub(crate) const MAX_TRACKS: usize = u32::MAX as usize;

/// Why a skeleton cannot be made. Indices count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SkeletonError {
    /// The numbers of parents and offsets differ.
    #[error("there are {parents} parents but {offsets} offsets; give one of each for every track")]
    Lengths {
        /// The number of parents.
        parents: usize,
        /// The number of offsets.
        offsets: usize,
    },
    /// A parent does not exist.
    #[error("the parent of track {track} is track {parent}, but there are {tracks} tracks")]
    NoSuchParent {
        /// The track's index.
        track: usize,
        /// The parent's index.
        parent: usize,
        /// The number of tracks.
        tracks: usize,
    },
    /// The parents contain a cycle.
    #[error("track {track} is its own ancestor")]
    Cycle {
        /// The index of a track in the cycle, or of a descendant of one.
        track: usize,
    },
    /// There is not one name for each track.
    #[error("{} for {}; give one for each", counted(*.names, "name"), counted(*.tracks, "track"))]
    Names {
        /// The number of names.
        names: usize,
        /// The number of tracks.
        tracks: usize,
    },
    /// An offset is NaN or infinite.
    #[error("the offset of track {track} is {offset}, which is not finite")]
    OffsetNotFinite {
        /// The track's index.
        track: usize,
        /// The offset.
        offset: Vec3,
    },
    /// There are more tracks than 32 bits can count.
    #[error("a skeleton of {tracks} tracks; the limit is {}", MAX_TRACKS)]
    TooMany {
        /// The number of tracks.
        tracks: usize,
    },
    /// There is not enough memory.
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemoryError),
}
