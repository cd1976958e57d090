//! Conversion from seconds to frames: frame rates, sample times, wrap modes, and the span of a track or the interval
//! between keys that contains each sample. Results do not depend on the requested window of samples.
//!
//! # Principle
//!
//! Seconds are f64 and stay on the host. A kernel gets a whole number of frames, counted from the frame nearest to a
//! segment's middle, with a scale and an offset in f32. So a frame at hour 24 is as exact as the first. The parameter
//! of a sample is a function of its number, not a sum of steps, so that windows, chunks and vector widths have no
//! effect. A key time within its rounding of a whole frame counts as that frame
//! ([`frame_clock::FrameClock::boundary`]), and the sample there is the key, bit for bit.
//!
//! # Types
//!
//! | type | what it is |
//! |---|---|
//! | [`frames::SampleTimes`] | the requested samples: a rate and a range, or explicit times |
//! | [`frames::Timeline`] | the same for a set: how many samples, and the time of each |
//! | [`frame_rate::FrameRate`] | frames per second, as an exact ratio |
//! | [`frame_clock::FrameClock`] | from key times to frame coordinates, for a track or one of its copies |
//! | [`moment::Moment`] | an exact time as the sum of two f64, for copies far from the track |
//! | [`frame_clock::TrackCopy`] | consecutive samples in one copy of a track that repeats |
//! | [`runs::IntervalBlock`] | frame coordinates of 32 intervals, and the samples in each |
//! | [`spans::Spans`], [`spans::TrackPart`] | where in time the segments of prepared tracks lie |
//! | [`runs::Run`] | consecutive samples with one source: the unit of work of every device |
//! | [`key_samples::FramePlan`] | for each frame the key before it, where there are no segments |
//!
//! # From a key time to runs
//!
//! ```text
//! SampleTimes ─► Timeline ─► TrackCopy ─┬─ frames: FrameClock ─► IntervalBlock ─┬─► Run (spans)
//!                                       │                                       └─► FramePlan (keys)
//!                                       └─ explicit times: a search in the starts ─► Run, key sample
//! ```
//!
//! # Memory
//!
//! Key times are read once, in order. For 32 intervals a block has these rows, about 1.5 KB, which vectors fill
//! without a branch. The bits of `occupied` then lead to the intervals with samples, because a branch for each
//! interval would often be mispredicted if keys are denser than samples.
//!
//! ```text
//! interval   0     1     2     …  31    32
//! frame      0.0   1.25  1.75  …  40.0  41.5   f64: where it starts, in frames
//! first      0     2     2     …  40    42     the first sample that is not before that
//! is_held    1     0     0     …  1            whether that sample lies at exactly the start
//! whole, distance, scale, offset               how a parameter follows from the sample's number
//! occupied   1     0     1     …  1            a bit each
//! ```

pub(crate) mod error;
pub(crate) mod frame_clock;
pub(crate) mod frame_rate;
pub(crate) mod frames;
pub(crate) mod key_samples;
pub(crate) mod moment;
pub(crate) mod runs;
pub(crate) mod spans;
pub(crate) mod time_base;
pub(crate) mod times;
pub(crate) mod wrap;
