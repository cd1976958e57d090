//! Errors of sample times.

use crate::names::counted;

/// The maximum number of samples of one track; more are refused.
pub const MAX_FRAMES: u64 = 1 << 40;

/// Why sample times were refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleTimesError {
    /// The frame rate is zero, too large, or not a number.
    #[error(
        "`{text}` is not a frame rate; give a positive number or a ratio, such as 25 or 30000/1001"
    )]
    Rate {
        /// The refused text.
        text: String,
    },
    /// The range ends before it starts.
    #[error("the range ends at {end} s, before it starts at {start} s")]
    ReversedRange {
        /// The start in seconds.
        start: f64,
        /// The end in seconds.
        end: f64,
    },
    /// A range was set for explicit times.
    #[error(
        "explicit times have no range; give a rate with a start and an end, or only the times within the range"
    )]
    TimesInRange,
    /// A time is NaN or infinite.
    #[error("time {index} is {time}; times are finite numbers of seconds")]
    TimeNotFinite {
        /// The time's index in the list, from 0.
        index: usize,
        /// The refused time.
        time: f64,
    },
    /// The number of times for each track ([`SampleTimes::at_each`](crate::time::frames::SampleTimes::at_each)) is
    /// not a multiple of the number of tracks.
    #[error(
        "{} do not divide among {}; give every track the same number",
        counted(*.times, "time"),
        counted(*.tracks, "track")
    )]
    Uneven {
        /// The number of times.
        times: usize,
        /// The number of tracks of the set.
        tracks: usize,
    },
    /// The number of times differs from the number of samples that a target was made for.
    #[error(
        "{}; the target has {} of each track",
        counted(*.times, "time"),
        counted(*.samples, "sample")
    )]
    Count {
        /// The number of times.
        times: usize,
        /// The number of samples of each track.
        samples: usize,
    },
    /// There are more samples than [`MAX_FRAMES`], or than memory can address.
    #[error(
        "tracks × frames = {tracks} × {frames:.0}, which is {bytes:.0} bytes; at most {MAX_FRAMES} frames can be asked for"
    )]
    TooMany {
        /// The number of tracks.
        tracks: usize,
        /// The number of samples of each track.
        frames: f64,
        /// The size of the result in bytes.
        bytes: f64,
    },
    /// Two neighbouring keys are so far apart that 32 bits cannot count the frames between them.
    #[error("track {track}: {frames:.3e} frames between key {key} and the next; the limit is 2^32")]
    GapTooLong {
        /// The track's index in the set.
        track: usize,
        /// The index of the key before the gap.
        key: usize,
        /// The number of frames in the gap.
        frames: f64,
    },
}
