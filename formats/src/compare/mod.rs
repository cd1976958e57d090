//! How far two motions, two paths of a body, or two arrays of results are apart.

mod arrays;
mod clips;
mod paths;
mod tally;

use tumble::Error;

use crate::world::HierarchyError;

pub use crate::compare::arrays::ArrayDifference;
pub use crate::compare::clips::{ChannelDifference, ClipDifference, ClipPair, CommonTimes};
pub use crate::compare::paths::{
    AlignmentSummary, PathDifference, PathErrors, PathMeasure, PathStatistics,
};
pub use crate::compare::tally::Spread;

/// Why two clips cannot be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// No track of one belongs to one of the other.
    #[error(
        "{} and {}: have {} and {} tracks, none of the same name; --tracks chooses some",
        inputs[0], inputs[1], tracks[0], tracks[1]
    )]
    NoTrackInBoth {
        /// What messages call the clips.
        inputs: [String; 2],
        /// How many tracks they have.
        tracks: [usize; 2],
    },
    /// Their keys lie at different times.
    #[error(
        "no time lies in both: {} from {} to {} s, {} from {} to {} s",
        inputs[0], spans[0][0], spans[0][1], inputs[1], spans[1][0], spans[1][1]
    )]
    NoTimeInBoth {
        /// What messages call the clips.
        inputs: [String; 2],
        /// Their first and last key times, seconds.
        spans: [[f64; 2]; 2],
    },
    /// No pose of the reference lies at a time of the estimate.
    #[error(
        "{} and {}: no pose of the first lies at a time of the second", inputs[0], inputs[1]
    )]
    NoPoseInBoth {
        /// What messages call the clips.
        inputs: [String; 2],
    },
    /// No step of relative errors fits into the path.
    #[error("{} and {}: --rpe is longer than the whole path", inputs[0], inputs[1])]
    StepTooLong {
        /// What messages call the clips.
        inputs: [String; 2],
    },
    /// Arrays of different shapes.
    #[error(
        "{} has the shape {:?} and {} has {:?}; arrays of one shape can be compared",
        inputs[0], shapes[0], inputs[1], shapes[1]
    )]
    Shapes {
        /// What messages call the arrays.
        inputs: [String; 2],
        /// Their shapes.
        shapes: [Vec<usize>; 2],
    },
    /// A clip was not sampled.
    #[error("{input}: {error}")]
    Evaluating {
        /// What messages call the clip.
        input: String,
        /// Why.
        error: Error,
    },
    /// The joints of a clip make no hierarchy.
    #[error("{input}: {error}")]
    Hierarchy {
        /// What messages call the clip.
        input: String,
        /// Why.
        error: HierarchyError,
    },
}
