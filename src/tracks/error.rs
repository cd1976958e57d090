//! Errors of sets, and the limits in their messages.

use crate::names::counted;

/// The maximum difference of a key's norm from 1. [`TrackSet::push`](crate::tracks::set::TrackSet::push) refuses
/// other keys, because they are probably not rotations.
pub const NORM_TOLERANCE: f64 = 0.1;

/// The largest magnitude of a time in seconds: the limit of `.dat` files. With it, products of intervals do not
/// overflow in f64.
pub(crate) const LATEST: f64 = f32::MAX as f64;

/// Why a set refused keys or other data. Indices count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// The track has no keys.
    #[error("track {track} has no keys; give it at least one")]
    Empty {
        /// The track's index in the set.
        track: usize,
    },
    /// The numbers of keys and of times differ.
    #[error("track {track} has {} but {}; give one time for each key", counted(*.keys, "key"), counted(*.times, "time"))]
    LengthMismatch {
        /// The track's index in the set.
        track: usize,
        /// The number of keys.
        keys: usize,
        /// The number of times.
        times: usize,
    },
    /// A time is NaN or infinite.
    #[error("track {track}, key {key}: time {time} is not finite")]
    TimeNotFinite {
        /// The track's index in the set.
        track: usize,
        /// The key's index in the track.
        key: usize,
        /// The refused time in seconds.
        time: f64,
    },
    /// A time is so large that computations would overflow.
    #[error("track {track}, key {key}: time {time} s; times lie within ±{LATEST:e} s")]
    TimeOutOfRange {
        /// The track's index in the set.
        track: usize,
        /// The key's index in the track.
        key: usize,
        /// The refused time in seconds.
        time: f64,
    },
    /// A time is not after the previous one.
    #[error(
        "track {track}, key {key}: time {time} s does not come after {previous} s; sort the keys and remove duplicates"
    )]
    TimeNotIncreasing {
        /// The track's index in the set.
        track: usize,
        /// The key's index in the track.
        key: usize,
        /// The refused time in seconds.
        time: f64,
        /// The previous time in seconds.
        previous: f64,
    },
    /// The norm of a quaternion is not close to 1.
    #[error(
        "track {track}, key {key}: quaternion norm is {norm}; a rotation has norm 1 (±{NORM_TOLERANCE})"
    )]
    NotUnit {
        /// The track's index in the set.
        track: usize,
        /// The key's index in the track.
        key: usize,
        /// The quaternion's norm.
        norm: f64,
    },
    /// There is no track with this index.
    #[error("there is no track {track}; the set has {tracks}")]
    NoSuchTrack {
        /// The requested index.
        track: usize,
        /// The number of tracks of the set.
        tracks: usize,
    },
    /// Data in addition to rotations, such as velocities, are not one value for each key.
    #[error(
        "track {track} has {} but {} of {quantity}; give one for each key", counted(*.keys, "key"), counted(*.values, "value")
    )]
    DataLength {
        /// The track's index in the set.
        track: usize,
        /// The kind of the values, such as `velocity`.
        quantity: &'static str,
        /// The number of the track's keys.
        keys: usize,
        /// The number of values.
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
    /// A value in addition to a rotation is too large.
    #[error(
        "track {track}, key {key}: the {quantity} is too large; its numbers lie within ±{limit:e}"
    )]
    DataTooLarge {
        /// The track's index in the set.
        track: usize,
        /// The key's index in the track.
        key: usize,
        /// The kind of the values, such as `velocity`.
        quantity: &'static str,
        /// The maximum magnitude.
        limit: f64,
    },
    /// A value in addition to a rotation is NaN or infinite.
    #[error("track {track}, key {key}: the {quantity} is not finite")]
    DataNotFinite {
        /// The track's index in the set.
        track: usize,
        /// The key's index in the track.
        key: usize,
        /// The kind of the values, such as `velocity`.
        quantity: &'static str,
    },
}
