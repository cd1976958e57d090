//! Why requested samples are refused.

/// More samples of one track than this are refused.
pub const MAX_FRAMES: u64 = 1 << 40;

/// Why samples were refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleTimesError {
    /// The frame rate is zero, too large, or not a number.
    #[error(
        "`{text}` is not a frame rate; give a positive number or a ratio, such as 25 or 30000/1001"
    )]
    Rate {
        /// The text that was refused.
        text: String,
    },
    /// The range ends before it starts.
    #[error("the range ends at {end} s, before it starts at {start} s")]
    ReversedRange {
        /// Start, seconds.
        start: f64,
        /// End, seconds.
        end: f64,
    },
    /// A range was given beside explicit times.
    #[error(
        "explicit times have no range; give a rate with a start and an end, or only the times within the range"
    )]
    TimesInRange,
    /// A time is NaN or infinite.
    #[error("time {index} is {time}; times are finite numbers of seconds")]
    TimeNotFinite {
        /// Its index in the list, from 0.
        index: usize,
        /// The offending time.
        time: f64,
    },
    /// Times given for each track must divide evenly among the tracks.
    #[error("{times} times do not divide among {tracks} tracks; give every track the same number")]
    Uneven {
        /// Number of times given.
        times: usize,
        /// Number of tracks in the set.
        tracks: usize,
    },
    /// More samples than [`MAX_FRAMES`] or than memory can address.
    #[error(
        "tracks × frames = {tracks} × {frames:.0}, which is {bytes:.0} bytes; at most {MAX_FRAMES} frames can be asked for"
    )]
    TooMany {
        /// Number of tracks.
        tracks: usize,
        /// Samples of each track.
        frames: f64,
        /// Bytes of the result.
        bytes: f64,
    },
    /// Two neighbouring keys lie so far apart that frames between them cannot be
    /// counted in 32 bits.
    #[error("track {track}: {frames:.3e} frames between key {key} and the next; the limit is 2^32")]
    GapTooLong {
        /// The track's index in the set.
        track: usize,
        /// The key before the gap.
        key: usize,
        /// Frames in the gap.
        frames: f64,
    },
}
