//! The end of a clip that is sampled at a rate, if the end lies between two frames. [`EndFrame`] is the rule for it;
//! [`FramesToEnd`] are the samples according to the rule.
//!
//! A clip of 1.1583 s at 30 fps ends 0.025 s after its frame 34. If nothing followed this frame, the clip would be
//! shorter, and a loop would jump at its end. Therefore a file of clips gets one sample more, whose value is that of
//! the end.

mod result;

use std::borrow::Cow;

use glam::Quat;
use tumble::{Engine, Error, FrameRate, Layout, SampleTimes, Timeline};

use crate::diagnostic::{Code, Diagnostic};
use crate::motion::Motion;
use crate::motion::sample::{ChannelMethods, Samples};
use crate::motion::signs::continue_signs;
use crate::times::clock_text;

pub use result::{EndFrameError, SampledKind, SampledResult};

/// How a result that is sampled at the frames of a rate ends, if its clip ends between two frames. If the end lies on a
/// frame, this frame is the last sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndFrame {
    /// A sample at the end, after the last frame.
    Key,
    /// One frame more, after the end. It has the value of the end.
    Hold,
    /// Nothing: the last frame before the end is the last sample.
    LeaveOut,
}

tumble::names! {
    EndFrame, "end frame",
    Key => "key",
    Hold => "hold",
    LeaveOut => "leave-out",
}

/// The sample after the last frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndSample {
    /// The time of its value, in seconds: that of the end.
    pub at: f64,
    /// The time that is written for it, in seconds.
    pub time: f64,
}

impl EndSample {
    /// Whether it is a frame of the rate, later than the end.
    #[must_use]
    pub fn is_held(self) -> bool {
        self.time != self.at
    }

    /// The warning that a frame after the end was added, unless it was asked for. `name` is the output's name in
    /// messages, and `time_offset` that of the clip.
    #[must_use]
    pub fn warning(self, rate: FrameRate, time_offset: i64, name: &str) -> Option<Diagnostic> {
        self.is_held().then(|| {
            let [at, time] = [self.at, self.time].map(|time| clock_text(time_offset, time));
            let message = format!(
                "the clip ends at {at} s, between two frames at {rate} fps; a last frame, at {time} s, \
                 repeats the end (--end-frame leave-out omits it)"
            );
            Diagnostic::new(name, Code::EndHeld, message)
        })
    }
}

/// An end that is at most this part of a frame after the last frame is that frame: times are rounded.
const ON_FRAME: f64 = 1e-3;

impl EndFrame {
    /// [`Key`](Self::Key) if samples are stored with their times, [`Hold`](Self::Hold) if they are frames of a rate.
    #[must_use]
    pub fn where_times_are(has_times: bool) -> Self {
        match has_times {
            true => Self::Key,
            false => Self::Hold,
        }
    }

    /// The sample after the frames of `timeline`, which are those of `rate` up to `end`, in seconds; `None` if the
    /// last frame is the end, or if the end is left out.
    #[must_use]
    pub fn sample(self, timeline: &Timeline, rate: FrameRate, end: f64) -> Option<EndSample> {
        let last_frame = timeline.len().checked_sub(1)?;
        let last = timeline.time(0, last_frame)?;
        if is_on_frame(end, last, rate) {
            return None;
        }
        let time = match self {
            Self::Key => end,
            Self::Hold => {
                let next = timeline.time(0, 0)? + rate.time_of(timeline.len() as u64);
                // If the file is written again with its other content, the first sample may be between two frames.
                let frames = (next - last) * rate.per_second();
                match (frames - 1.0).abs() <= ON_FRAME {
                    true => next,
                    false => last + rate.time_of(1),
                }
            }
            Self::LeaveOut => return None,
        };
        Some(EndSample { at: end, time })
    }
}

/// Whether the end of a clip is its last frame. Both are in seconds.
pub(crate) fn is_on_frame(end: f64, last_frame: f64, rate: FrameRate) -> bool {
    // Formats of f32 times cannot store times that are nearer to each other.
    let rounding = f64::from(f32::EPSILON) * end.abs();
    end - last_frame <= (ON_FRAME / rate.per_second()).max(rounding)
}

/// The frames of a rate at which a clip is sampled.
#[derive(Debug, Clone)]
pub struct RateFrames {
    /// Their times; the first may lie between two frames.
    pub frames: SampleTimes,
    /// The rate.
    pub rate: FrameRate,
    /// Where the clip ends, in seconds.
    pub end: f64,
}

/// The samples of a clip: its frames, and the sample after them.
#[derive(Debug, Clone)]
pub struct FramesToEnd {
    /// The frames.
    pub frames: SampleTimes,
    /// The times of the frames.
    pub timeline: Timeline,
    /// The sample at the end of the clip, after its frames.
    pub end: Option<EndSample>,
    /// The seconds from the last frame to the end of the clip, where nothing follows the last frame.
    pub left_out: Option<f64>,
    /// The rate of which all samples are neighbouring frames.
    pub rate: Option<FrameRate>,
    /// The whole second of the clip from which all times count.
    pub time_offset: i64,
}

impl FramesToEnd {
    /// The frames of a rate, and the sample that `end_frame` puts after them.
    ///
    /// # Errors
    /// As [`SampleTimes::resolve`].
    pub fn new(clip: &Motion, frames: RateFrames, end_frame: EndFrame) -> Result<Self, Error> {
        let RateFrames { frames, rate, end } = frames;
        let found = Self::at(clip, frames)?;
        let sample = end_frame.sample(&found.timeline, rate, end);
        let left_out = EndFrame::Key.sample(&found.timeline, rate, end);
        let left_out = left_out.filter(|_| sample.is_none());
        let last_frame = found.timeline.len().checked_sub(1);
        let last_frame = last_frame.and_then(|frame| found.timeline.time(0, frame));
        Ok(Self {
            end: sample,
            left_out: left_out.zip(last_frame).map(|(end, last)| end.at - last),
            rate: Some(rate).filter(|_| sample.is_none_or(EndSample::is_held)),
            ..found
        })
    }

    /// Samples at these times alone.
    ///
    /// # Errors
    /// As [`SampleTimes::resolve`].
    pub fn at(clip: &Motion, frames: SampleTimes) -> Result<Self, Error> {
        Ok(Self {
            timeline: frames.resolve(clip.set.track_count(), clip.set.time_span())?,
            frames,
            end: None,
            left_out: None,
            rate: None,
            time_offset: clip.time_offset,
        })
    }

    /// The times of all samples, in seconds.
    #[must_use]
    pub fn times(&self) -> Vec<f64> {
        let end = self.end.map(|end| end.time);
        self.timeline.times(0).chain(end).collect()
    }
}

/// The samples of a clip at some frames, as [`ChannelMethods::sample`] makes them, and that at its end, if there is one.
///
/// # Errors
/// As [`Engine::evaluate`].
pub fn sample_to_end(
    methods: &ChannelMethods,
    engine: &Engine,
    clip: &Motion,
    frames: &SampleTimes,
    end: Option<EndSample>,
) -> Result<Samples, Error> {
    let mut samples = methods.sample(engine, clip, frames)?;
    if let Some(end) = end {
        let last = methods.sample(engine, clip, &SampleTimes::at(vec![end.at]))?;
        samples.times.push(end.time);
        samples.rotations.extend(last.rotations);
        samples.translations.extend(last.translations);
        samples.scales.extend(last.scales);
        samples.scalars.extend(last.scalars);
        continue_signs(&mut samples.rotations, clip.set.track_count());
    }
    Ok(samples)
}

/// The values of all tracks at the end of a clip, which are put after those of its frames while they are streamed.
#[derive(Debug)]
pub struct EndRows {
    /// The rotation of each track, or the four numbers of another value; empty if nothing follows the last frame.
    rows: Vec<Quat>,
    layout: Layout,
    /// Number of frames of a track, without the end.
    frames: usize,
    /// Number of rows that have passed.
    passed: usize,
}

impl EndRows {
    /// `rows` has the end of each track, or nothing. `frames` is the number of rows of each track that pass.
    #[must_use]
    pub fn new(rows: Vec<Quat>, layout: Layout, frames: usize) -> Self {
        Self {
            rows,
            layout,
            frames,
            passed: 0,
        }
    }

    /// The next rows, in the order of the layout, with the ends that follow them.
    pub fn next<'a>(&mut self, rows: &'a [Quat]) -> Cow<'a, [Quat]> {
        let before = self.passed;
        self.passed += rows.len();
        let ends_before = |passed: usize| match self.layout {
            Layout::TrackMajor => passed.checked_div(self.frames).unwrap_or(0),
            Layout::FrameMajor => usize::from(passed >= self.frames * self.rows.len()),
        };
        if self.rows.is_empty() || ends_before(before) == ends_before(self.passed) {
            return Cow::Borrowed(rows);
        }
        let mut all = Vec::with_capacity(rows.len() + self.rows.len());
        match self.layout {
            Layout::FrameMajor => {
                all.extend_from_slice(rows);
                all.extend_from_slice(&self.rows);
            }
            Layout::TrackMajor => {
                let mut rest = rows;
                for track in ends_before(before)..ends_before(self.passed) {
                    let passed = self.passed - rest.len();
                    let (of_track, later) = rest.split_at((track + 1) * self.frames - passed);
                    all.extend_from_slice(of_track);
                    all.push(self.rows[track]);
                    rest = later;
                }
                all.extend_from_slice(rest);
            }
        }
        Cow::Owned(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(end_frame: EndFrame, start: f64, end: f64) -> Option<EndSample> {
        let rate = FrameRate::new(30, 1).unwrap();
        let frames = SampleTimes::rate(rate).between(start, end);
        end_frame.sample(&frames.resolve(1, None).unwrap(), rate, end)
    }

    #[test]
    fn an_end_between_frames_has_one_sample_more() {
        let end = 139.0 / 120.0;
        let key = EndSample { at: end, time: end };
        assert_eq!(sample(EndFrame::Key, 0.0, end), Some(key));
        let held = EndSample {
            at: end,
            time: 35.0 / 30.0,
        };
        assert_eq!(sample(EndFrame::Hold, 0.0, end), Some(held));
        assert_eq!(sample(EndFrame::LeaveOut, 0.0, end), None);
    }

    #[test]
    fn an_end_on_a_frame_is_its_last_sample() {
        for end_frame in EndFrame::ALL {
            for (start, end) in [
                (0.0, 1.0),
                (0.1, 0.1 + 34.0 / 30.0),
                (0.0, f64::from(1.133_333_4_f32)),
                (0.0, 1.133_34),
                (2.0, 2.0),
            ] {
                assert_eq!(sample(end_frame, start, end), None, "{start} {end}");
            }
        }
    }

    /// The first sample of a file that is kept may lie between two frames; the frame after the last one does not.
    #[test]
    fn a_held_end_is_the_next_whole_frame() {
        let rate = FrameRate::new(10, 1).unwrap();
        let frames = SampleTimes::at(vec![0.04, 0.1, 0.2]);
        let timeline = frames.resolve(1, None).unwrap();
        let held = EndFrame::Hold.sample(&timeline, rate, 0.25).unwrap();
        assert!((held.time - 0.3).abs() < 1e-12, "{held:?}");
    }

    #[test]
    fn ends_follow_the_rows_of_their_tracks_in_any_parts() {
        let row = |number: usize| Quat::from_array([number as f32; 4]);
        let rows: Vec<Quat> = (0..6).map(row).collect();
        for (layout, expected) in [
            (Layout::TrackMajor, [0, 1, 2, 10, 3, 4, 5, 11]),
            (Layout::FrameMajor, [0, 1, 2, 3, 4, 5, 10, 11]),
        ] {
            for part in 1..=6 {
                let mut ends = EndRows::new(vec![row(10), row(11)], layout, 3);
                let mut found = Vec::new();
                for rows in rows.chunks(part) {
                    let next = ends.next(rows);
                    // If no end frame is added, nothing is copied.
                    assert_eq!(matches!(next, Cow::Borrowed(_)), next.len() == rows.len());
                    found.extend_from_slice(&next);
                }
                assert_eq!(found, expected.map(row), "{layout} in parts of {part}");
            }
        }
    }
}
