//! Methods: how the rotation between keys follows from the keys.
//!
//! One file per method, and the only place that names it. A method turns a track's
//! keys into curves, one for each key interval; the few forms those curves have
//! are what the kernels evaluate.

/// Which of the two quaternions of each key counts: `q` and `-q` are one rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Path {
    /// Each key is taken with the sign nearer to its predecessor, so no rotation
    /// goes the long way round. Keys 180° apart keep the sign they were given.
    #[default]
    Shortest,
    /// Signs as given: a dot product below zero turns the long way.
    AsAuthored,
}

/// What happens in the first and in the last segment, where a neighbour is missing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Ends {
    /// The parabola through the last three keys: constant velocity stays constant
    /// to the very ends.
    #[default]
    Parabolic,
    /// No angular acceleration at the ends.
    Natural,
    /// Given angular velocities (radians per second, body frame) at the ends.
    Clamped {
        /// At the first key.
        start: glam::DVec3,
        /// At the last key.
        end: glam::DVec3,
    },
    /// The last key repeats the first; neighbours are taken across the seam.
    Loop,
    /// The first and the last segment stand still, as in the original program.
    Frozen,
}
