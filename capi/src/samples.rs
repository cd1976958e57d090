//! Which samples are evaluated, and where they lie in memory.

use tumble::{FrameRate, Layout, SampleTimes};

use crate::arguments::{constant, list, needed, option};
use crate::result::Failure;

/// The order of a result in memory, four numbers for each sample of each track.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleLayout {
    /// `[track][sample]`: the samples of a track lie together.
    TrackMajor = 0,
    /// `[sample][track]`: the tracks of a sample lie together.
    FrameMajor = 1,
}

/// Which samples.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleSampling {
    /// Frames at a rate, from the first key of the set to its last.
    Keys = 0,
    /// Frames at a rate, from `start` to `end`.
    Range = 1,
    /// The listed times, the same for every track, in any order.
    Times = 2,
    /// The listed times, different for each track: first those of the first track, then those of the
    /// second, the same number for each.
    TimesOfTracks = 3,
}

/// The samples of an evaluation. Zeros stand for what is not used.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleSamples {
    /// `sizeof(TumbleSamples)`.
    pub size: usize,
    /// A `TumbleSampling`.
    pub sampling: u32,
    /// Frames per `rate_seconds`: 60, or 30000 in 1001 seconds.
    pub rate_frames: u64,
    /// 0 stands for 1.
    pub rate_seconds: u64,
    /// Seconds, for `TUMBLE_SAMPLING_RANGE`.
    pub start: f64,
    /// Seconds, for `TUMBLE_SAMPLING_RANGE`.
    pub end: f64,
    /// Seconds, for `TUMBLE_SAMPLING_TIMES` and `TUMBLE_SAMPLING_TIMES_OF_TRACKS`.
    pub times: *const f64,
    /// How many times there are, of all tracks together.
    pub time_count: usize,
}

impl TumbleSamples {
    /// The samples that the structure says.
    ///
    /// # Safety
    /// The pointer is null or that of such a structure, whose `times` has `time_count` numbers.
    pub(crate) unsafe fn read(pointer: *const Self) -> Result<SampleTimes, Failure> {
        // SAFETY: as the caller promises.
        let structure = unsafe {
            let size = |pointer: *const Self| (&raw const (*pointer).size).cast();
            needed(pointer, size, "samples")?
        };
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

/// The layout of a constant.
pub(crate) fn layout(value: u32) -> Result<Layout, Failure> {
    option(value, &Layout::ALL, "layout")
}
