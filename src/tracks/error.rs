//! Why a set refuses keys, and the limits that its messages name.

/// A key whose norm differs from 1 by more than this is refused by
/// [`TrackSet::push`](crate::tracks::set::TrackSet::push): it is more likely a mistake than a
/// rotation.
pub const NORM_TOLERANCE: f64 = 0.1;

/// The largest magnitude of a time, in seconds: the limit of `.dat` files. Products of intervals
/// stay far from overflowing in f64.
pub(crate) const LATEST: f64 = f32::MAX as f64;

/// Why keys were refused. Indices count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// A track must have at least one key.
    #[error("track {track} has no keys; give it at least one")]
    Empty {
        /// The track's index in the set.
        track: usize,
    },
    /// Each key needs one time.
    #[error("track {track} has {keys} keys but {times} times; give one time for each key")]
    LengthMismatch {
        /// The track's index in the set.
        track: usize,
        /// Number of keys given.
        keys: usize,
        /// Number of times given.
        times: usize,
    },
    /// A time is NaN or infinite.
    #[error("track {track}, key {key}: time {time} is not finite")]
    TimeNotFinite {
        /// The track's index in the set.
        track: usize,
        /// The key's index in the track.
        key: usize,
        /// The offending time, seconds.
        time: f64,
    },
    /// A time is so far away that arithmetic would overflow.
    #[error("track {track}, key {key}: time {time} s; times lie within ±{LATEST:e} s")]
    TimeOutOfRange {
        /// The track's index in the set.
        track: usize,
        /// The key's index in the track.
        key: usize,
        /// The offending time, seconds.
        time: f64,
    },
    /// Times must increase strictly.
    #[error(
        "track {track}, key {key}: time {time} s does not come after {previous} s; sort the keys and remove duplicates"
    )]
    TimeNotIncreasing {
        /// The track's index in the set.
        track: usize,
        /// The key's index in the track.
        key: usize,
        /// The offending time, seconds.
        time: f64,
        /// The time before it, seconds.
        previous: f64,
    },
    /// The quaternion is not close to unit length.
    #[error(
        "track {track}, key {key}: quaternion norm is {norm}; a rotation has norm 1 (±{NORM_TOLERANCE})"
    )]
    NotUnit {
        /// The track's index in the set.
        track: usize,
        /// The key's index in the track.
        key: usize,
        /// Its norm.
        norm: f64,
    },
    /// There is no track with that index.
    #[error("there is no track {track}; the set has {tracks}")]
    NoSuchTrack {
        /// The index asked for.
        track: usize,
        /// Number of tracks in the set.
        tracks: usize,
    },
    /// Data beside the rotations, such as velocities, must be given for every key of a track.
    #[error(
        "track {track} has {keys} keys but {values} values of {quantity}; give one for each key"
    )]
    DataLength {
        /// The track's index in the set.
        track: usize,
        /// What the values are, such as `velocity`.
        quantity: &'static str,
        /// Number of keys of the track.
        keys: usize,
        /// Number of values given.
        values: usize,
    },
    /// An upward direction of a path has no length, or is not finite.
    #[error("track {track}, point {key}: the upward direction has no length, or is not finite")]
    NoUp {
        /// The track's index in the set.
        track: usize,
        /// The point's index in the path.
        key: usize,
    },
    /// A value beside a rotation is too large.
    #[error(
        "track {track}, key {key}: the {quantity} is too large; its numbers lie within ±{limit:e}"
    )]
    DataTooLarge {
        /// The track's index in the set.
        track: usize,
        /// The key's index in the track.
        key: usize,
        /// What the values are, such as `velocity`.
        quantity: &'static str,
        /// The largest magnitude.
        limit: f64,
    },
    /// A value beside a rotation is NaN or infinite.
    #[error("track {track}, key {key}: the {quantity} is not finite")]
    DataNotFinite {
        /// The track's index in the set.
        track: usize,
        /// The key's index in the track.
        key: usize,
        /// What the values are, such as `velocity`.
        quantity: &'static str,
    },
}
