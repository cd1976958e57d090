//! Sample times, and the layout of results.

use tumble::{FrameRate, Layout, SampleTimes};

use crate::arguments::{SizedStructure, constant, list, needed, option};
use crate::result::Failure;

/// The order of a result in memory. Each sample of a track has one value: four numbers, or in a request as many as
/// its encoding has.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleLayout {
    /// `[track][sample]`: all samples of the first track, then those of the second, and so on.
    TrackMajor = 0,
    /// `[sample][track]`: all tracks at the first sample, then at the second, and so on.
    FrameMajor = 1,
}

/// How sample times are specified.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleSampling {
    /// Frames at a rate, from the first key time of the set to the last (`tumble_set_time_span`).
    Keys = 0,
    /// Frames at a rate, from `start` to `end`.
    Range = 1,
    /// A list of times in any order, the same for every track.
    Times = 2,
    /// A list of times for each track, in the order `[track][sample]`, with the same number of times for every track.
    TimesOfTracks = 3,
}

/// The sample times of an evaluation. Members that `sampling` does not use are ignored.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleSamples {
    /// `sizeof(TumbleSamples)`.
    pub size: usize,
    /// A `TumbleSampling`: which of the members below are used.
    pub sampling: u32,
    /// The numerator of the frame rate: there are `rate_frames` frames in `rate_seconds` seconds, such as 60 in 1, or
    /// 30000 in 1001.
    pub rate_frames: u64,
    /// The denominator of the frame rate: a number of seconds; 0 means 1.
    pub rate_seconds: u64,
    /// The time of the first frame in seconds, for `TUMBLE_SAMPLING_RANGE`.
    pub start: f64,
    /// The time in seconds after which there are no frames, for `TUMBLE_SAMPLING_RANGE`; not before `start`.
    pub end: f64,
    /// The sample times in seconds, for `TUMBLE_SAMPLING_TIMES` and `TUMBLE_SAMPLING_TIMES_OF_TRACKS`. They are copied
    /// during the call.
    pub times: *const f64,
    /// The number of `times`, for all tracks together.
    pub time_count: usize,
}

// SAFETY: `repr(C)`, the size is the first member, and zero bits are valid numbers and null pointers.
unsafe impl SizedStructure for TumbleSamples {
    const FIRST_SIZE: usize = size_of::<Self>();
}

impl TumbleSamples {
    /// The sample times of a structure; null is an error.
    ///
    /// # Safety
    /// The pointer must be null or point to such a structure, whose `times` has `time_count` numbers.
    pub(crate) unsafe fn read(pointer: *const Self) -> Result<SampleTimes, Failure> {
        // SAFETY: as the caller promises.
        let structure = unsafe { needed(pointer, "samples")? };
        let rate = || FrameRate::new(structure.rate_frames, structure.rate_seconds.max(1));
        // SAFETY: as the caller promises.
        let times = || unsafe { list(structure.times, structure.time_count, "samples->times") };
        let samplings = [
            TumbleSampling::Keys,
            TumbleSampling::Range,
            TumbleSampling::Times,
            TumbleSampling::TimesOfTracks,
        ];
        let samplings = samplings.map(|sampling| (sampling as u32, sampling));
        Ok(
            match constant(structure.sampling, &samplings, "samples->sampling")? {
                TumbleSampling::Keys => SampleTimes::rate(rate()?),
                TumbleSampling::Range => {
                    SampleTimes::rate(rate()?).between(structure.start, structure.end)
                }
                TumbleSampling::Times => SampleTimes::at(times()?.to_vec()),
                TumbleSampling::TimesOfTracks => SampleTimes::at_each(times()?.to_vec()),
            },
        )
    }
}

/// The layout of a C constant.
pub(crate) fn layout(value: u32) -> Result<Layout, Failure> {
    option(value, &Layout::ALL, "layout")
}
