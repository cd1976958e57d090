//! Compares two clips, two paths of a body, or two arrays of results.

mod arrays;
mod clips;
mod paths;
mod tally;

use tumble::{Error, JointMatchError};

use crate::motion::scalars::ScalarKind;
use crate::motion::world::HierarchyError;
use crate::times::clock_text;

pub use crate::motion::compare::arrays::ArrayDifference;
pub use crate::motion::compare::clips::{
    ChannelDifference, ClipDifference, ClipPair, CommonTimes, JointDifference, MatchedTracks,
    ScalarDifference, TimedSpread,
};
pub use crate::motion::compare::paths::{
    AlignmentSummary, PathDifference, PathErrors, PathMeasure, PathStatistics,
};
pub use crate::motion::compare::tally::Spread;

fn hint(near: Option<&[String; 2]>) -> String {
    near.map_or_else(String::new, |[first, second]| {
        format!(" (`{first}` and `{second}` are similar, but only equal names match)")
    })
}

/// A time, in seconds.
fn short(time: f64) -> String {
    clock_text(0, time)
}

fn in_world(error: &JointMatchError) -> &'static str {
    match error {
        JointMatchError::Parent { .. } => "; compare them in the world with --world",
        _ => "",
    }
}

/// Why two inputs cannot be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// No track of one clip corresponds to a track of the other.
    #[error(
        "{} and {}: have {} and {} tracks, none of the same name{}; --tracks chooses some",
        inputs[0], inputs[1], tracks[0], tracks[1], hint(near.as_ref())
    )]
    NoTrackInBoth {
        /// Names of the clips in messages.
        inputs: [String; 2],
        /// Number of tracks of each clip.
        tracks: [usize; 2],
        /// A name of each clip that differ only in case, separators or a prefix.
        near: Option<[String; 2]>,
    },
    /// The clips have only scalars, and none of one clip corresponds to a scalar of the other.
    #[error(
        "{} and {}: have {} and {} scalars, none of the same name", inputs[0], inputs[1], scalars[0], scalars[1]
    )]
    NoScalarInBoth {
        /// Names of the clips in messages.
        inputs: [String; 2],
        /// Number of scalars of each clip.
        scalars: [usize; 2],
    },
    /// Scalars of one name are different quantities.
    #[error(
        "the scalar `{name}` is of the kind `{}` in {} and `{}` in {}, so their difference has no unit; --map reads the \
         columns of tables and arrays as one kind: {name}=COLUMN:scalar:{}",
        kinds[0].name(), inputs[0], kinds[1].name(), inputs[1], kinds[0].name()
    )]
    ScalarKinds {
        /// Names of the clips in messages.
        inputs: [String; 2],
        /// Name of the scalar.
        name: String,
        /// The kind of the scalar in each clip.
        kinds: [ScalarKind; 2],
    },
    /// One clip has only scalars, and none of them corresponds to a scalar of the other, which has tracks.
    #[error("{input} has only scalars, and none of them has the name of a scalar of {other}")]
    OnlyScalars {
        /// Name of the clip without tracks in messages.
        input: String,
        /// Name of the other clip.
        other: String,
    },
    /// The names do not tell the tracks apart, or a track has another parent.
    #[error("{error}{}", in_world(error))]
    Joints {
        /// The first difference.
        #[from]
        error: JointMatchError,
    },
    /// The rotations of one clip are relative to the world, those of the other to the parents.
    #[error(
        "the rotations of {world} are relative to the world, those of {local} to the parents; compare them in the world \
         with --world"
    )]
    Spaces {
        /// Name of the first of these clips in messages.
        world: String,
        /// Name of the second.
        local: String,
    },
    /// Poses in the world are compared, and a joint has a parent in one clip, while the other clip has no skeleton.
    #[error(
        "`{joint}` has a parent in {with}, and {without} has no skeleton, so its poses in the world are not known; \
         give {without} in a format that stores parents, or compare relative to the parents, without --world"
    )]
    NoSkeleton {
        /// Name of the clip without a skeleton in messages.
        without: String,
        /// Name of the other clip.
        with: String,
        /// Name of the first joint with a parent.
        joint: String,
    },
    /// The time spans of the clips do not overlap.
    #[error(
        "the inputs have no common time: {} from {} to {} s, {} from {} to {} s",
        inputs[0], short(spans[0][0]), short(spans[0][1]), inputs[1], short(spans[1][0]), short(spans[1][1])
    )]
    NoTimeInBoth {
        /// Names of the clips in messages.
        inputs: [String; 2],
        /// First and last key time of each clip, in seconds, on the clock of the first clip.
        spans: [[f64; 2]; 2],
    },
    /// The requested times lie outside those that both clips have.
    #[error(
        "{} and {}: times from {} to {} s are requested, but both have only times from {} to {} s",
        inputs[0], inputs[1], short(range[0]), short(range[1]), short(common[0]), short(common[1])
    )]
    RangeOutside {
        /// Names of the clips in messages.
        inputs: [String; 2],
        /// First and last requested time, in seconds, on the clock of the first clip.
        range: [f64; 2],
        /// First and last common time, in seconds, on the clock of the first clip.
        common: [f64; 2],
    },
    /// A path has rotations alone.
    #[error("{input} has no positions; leave out --ape and --rpe to compare the rotations")]
    NoPositions {
        /// Name of the clip in messages.
        input: String,
    },
    /// No pose of one path has one of the other at its time.
    #[error(
        "no pose of one lies at a time of the other: {} from {} to {} s, {} from {} to {} s; both must use the same clock",
        inputs[0], short(spans[0][0]), short(spans[0][1]), inputs[1], short(spans[1][0]), short(spans[1][1])
    )]
    NoPoseInBoth {
        /// Names of the clips in messages.
        inputs: [String; 2],
        /// First and last time of each path, in seconds, on the clock of its file; of the second with the offset.
        spans: [[f64; 2]; 2],
    },
    /// The step of relative errors is longer than the path.
    #[error("{} and {}: --rpe is longer than the whole path", inputs[0], inputs[1])]
    StepTooLong {
        /// Names of the clips in messages.
        inputs: [String; 2],
    },
    /// The arrays have different shapes.
    #[error(
        "{} has the shape {:?} and {} has {:?}; arrays of one shape can be compared",
        inputs[0], shapes[0], inputs[1], shapes[1]
    )]
    Shapes {
        /// Names of the arrays in messages.
        inputs: [String; 2],
        /// Shape of each array.
        shapes: [Vec<usize>; 2],
    },
    /// A clip could not be sampled.
    #[error("{input}: {error}")]
    Evaluating {
        /// Name of the clip in messages.
        input: String,
        /// The error of the engine.
        error: Error,
    },
    /// The parents of a clip's joints do not make a hierarchy.
    #[error("{input}: {error}")]
    Hierarchy {
        /// Name of the clip in messages.
        input: String,
        /// The fault of the hierarchy.
        error: HierarchyError,
    },
}
