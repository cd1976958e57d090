//! Sample times: the times at which a request evaluates tracks.
//!
//! All times in seconds are f64 and stay on the host. A kernel gets a whole number of frames from the middle of a
//! segment (or, for explicit times, an f32 distance from that middle). Therefore a frame 24 hours into a set is as
//! exact as the first.

use std::sync::Arc;

use crate::memory::{OutOfMemoryError, reserved};
use crate::time::error::{MAX_FRAMES, SampleTimesError};
use crate::time::frame_clock::FrameStart;
use crate::time::frame_rate::FrameRate;
use crate::time::moment::Moment;

/// A key that is at most this many frames after the last frame still has a frame, because key times are rarely exact
/// multiples of the frame time.
const LAST_FRAME_TOLERANCE: f64 = 1e-6;

/// The times of the samples of every track: frames at a rate, or explicit times.
///
/// Before its first key and after its last, a track has its end values, unless a
/// [`WrapMode`](crate::time::wrap::WrapMode) says otherwise.
///
/// ```
/// use tumble::SampleTimes;
/// let frames = SampleTimes::fps(25);                       // from the first key to the last
/// let second = SampleTimes::fps(60).between(1.0, 2.0);     // 61 frames
/// let sparse = SampleTimes::at(vec![0.0, 0.125, 7.5]);     // any times, in any order
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SampleTimes(SampleTimesKind);

#[derive(Debug, Clone, PartialEq)]
enum SampleTimesKind {
    Rate {
        rate: FrameRate,
        start: Option<f64>,
        end: Option<f64>,
    },
    Shared(Arc<Vec<f64>>),
    PerTrack(Arc<Vec<f64>>),
    /// Explicit times with a range, which are refused.
    TimesInRange,
}

impl SampleTimes {
    /// Frames at a whole number of frames per second, from the set's first key to its last. A rate of 0 is refused in
    /// [`SampleTimes::resolve`].
    #[must_use]
    pub fn fps(frames_per_second: u32) -> Self {
        Self::rate(FrameRate::whole(frames_per_second))
    }

    /// Frames at an exact rate, from the set's first key to its last: frame `k` is at `start + k / rate`, for every
    /// `k` whose time is not after the end.
    #[must_use]
    pub fn rate(rate: FrameRate) -> Self {
        Self(SampleTimesKind::Rate {
            rate,
            start: None,
            end: None,
        })
    }

    /// The same rate from `from` to `to` in seconds. Explicit times cannot have a range; [`SampleTimes::resolve`]
    /// refuses it ([`SampleTimesError::TimesInRange`]).
    #[must_use]
    pub fn between(mut self, from: f64, to: f64) -> Self {
        match &mut self.0 {
            SampleTimesKind::Rate { start, end, .. } => (*start, *end) = (Some(from), Some(to)),
            request => *request = SampleTimesKind::TimesInRange,
        }
        self
    }

    /// Sets the start and the end of frames, unless [`SampleTimes::between`] has set them. They replace the times of
    /// the set's first and last key. Explicit times do not change.
    #[must_use]
    pub fn spanning(mut self, (first, last): (f64, f64)) -> Self {
        if let SampleTimesKind::Rate { start, end, .. } = &mut self.0 {
            start.get_or_insert(first);
            end.get_or_insert(last);
        }
        self
    }

    /// Explicit times in seconds, in any order, the same for every track.
    #[must_use]
    #[doc(alias = "sample times")]
    pub fn at(times: Vec<f64>) -> Self {
        Self(SampleTimesKind::Shared(Arc::new(times)))
    }

    /// Explicit times for each track in seconds: first all times of the first track, then those of the second, and so
    /// on. Each track has the same number of times.
    #[must_use]
    pub fn at_each(times: Vec<f64>) -> Self {
        Self(SampleTimesKind::PerTrack(Arc::new(times)))
    }

    /// Computes the sample times for a set with `tracks` tracks. `span` is the times of its first and last key in
    /// seconds.
    ///
    /// # Errors
    /// * [`SampleTimesError::Rate`] when the rate is 0.
    /// * [`SampleTimesError::TimeNotFinite`] when a time is NaN or infinite.
    /// * [`SampleTimesError::ReversedRange`] when the end is before the start.
    /// * [`SampleTimesError::TimesInRange`] when [`SampleTimes::between`] was called for explicit times.
    /// * [`SampleTimesError::Uneven`] when times are listed for each track ([`SampleTimes::at_each`]), and their number
    ///   is not a multiple of the number of tracks.
    /// * [`SampleTimesError::TooMany`] when there are more than 2^40 samples of a track, or more values than memory can
    ///   address.
    pub fn resolve(
        &self,
        tracks: usize,
        span: Option<(f64, f64)>,
    ) -> Result<Timeline, SampleTimesError> {
        let finite = |times: &[f64]| match times.iter().position(|time| !time.is_finite()) {
            Some(index) => Err(SampleTimesError::TimeNotFinite {
                index,
                time: times[index],
            }),
            None => Ok(()),
        };
        let (first, last) = span.unwrap_or((0.0, 0.0));
        let (ticks, count) = match &self.0 {
            SampleTimesKind::Rate { rate, start, end } => {
                if rate.is_zero() {
                    let text = rate.to_string();
                    return Err(SampleTimesError::Rate { text });
                }
                let (start, end) = (start.unwrap_or(first), end.unwrap_or(last));
                finite(&[start, end])?;
                if end < start {
                    return Err(SampleTimesError::ReversedRange { start, end });
                }
                // Rounding to f64 may move a time by one step.
                let step = f64::EPSILON * start.abs().max(end.abs());
                let tolerance = rate.frames_in(step).clamp(LAST_FRAME_TOLERANCE, 0.5);
                let count = (rate.frames_in(end - start) + tolerance).floor() + 1.0;
                check_size(tracks, count)?;
                let (rate, start) = (*rate, FrameStart::new(start));
                (Ticks::Frames { rate, start }, count as usize)
            }
            SampleTimesKind::Shared(times) => {
                finite(times)?;
                check_size(tracks, times.len() as f64)?;
                let (times, stride) = (Arc::clone(times), 0);
                let count = times.len();
                (Ticks::Times { times, stride }, count)
            }
            SampleTimesKind::PerTrack(times) => {
                finite(times)?;
                if tracks == 0 || !times.len().is_multiple_of(tracks) {
                    return Err(SampleTimesError::Uneven {
                        times: times.len(),
                        tracks,
                    });
                }
                let (times, stride) = (Arc::clone(times), times.len() / tracks);
                (Ticks::Times { times, stride }, stride)
            }
            SampleTimesKind::TimesInRange => return Err(SampleTimesError::TimesInRange),
        };
        Ok(Timeline { ticks, count })
    }
}

fn check_size(tracks: usize, frames: f64) -> Result<(), SampleTimesError> {
    let bytes = tracks as f64 * frames * size_of::<glam::Quat>() as f64;
    if frames > MAX_FRAMES as f64 || bytes > isize::MAX as f64 {
        return Err(SampleTimesError::TooMany {
            tracks,
            frames,
            bytes,
        });
    }
    Ok(())
}

/// The sample times of one evaluation: [`SampleTimes`] resolved for a set.
#[derive(Debug, Clone, PartialEq)]
pub struct Timeline {
    pub(crate) ticks: Ticks,
    count: usize,
}

/// The time of a sample as a function of its index.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Ticks {
    /// Frame `k` is at `start + k / rate`.
    Frames { rate: FrameRate, start: FrameStart },
    /// Sample `k` of track `t` is at `times[t × stride + k]`; with a stride of 0 all tracks have the same times.
    Times { times: Arc<Vec<f64>>, stride: usize },
}

impl Timeline {
    /// Number of samples of each track.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Explicit times, the same for every track.
    pub(crate) fn at(times: Arc<Vec<f64>>) -> Self {
        Self {
            count: times.len(),
            ticks: Ticks::Times { times, stride: 0 },
        }
    }

    /// The same sample times for a set that has only these of the tracks.
    pub(crate) fn of_listed(&self, tracks: &[usize]) -> Self {
        let mut timeline = self.clone();
        if let Ticks::Times { times, stride: 1.. } = &mut timeline.ticks {
            let of_track = |&track: &usize| &times[track * self.count..][..self.count];
            *times = Arc::new(tracks.iter().flat_map(of_track).copied().collect());
        }
        timeline
    }

    /// The times for some samples of some tracks, and the index of the first of these samples in it. Explicit times
    /// are only those of the part; frames have the same start as before.
    pub(crate) fn part(
        &self,
        tracks: &std::ops::Range<usize>,
        samples: &std::ops::Range<usize>,
    ) -> (Self, usize) {
        let Ticks::Times { times, stride } = &self.ticks else {
            return (self.clone(), samples.start);
        };
        let of_track = |track: usize| &times[track * stride..][samples.clone()];
        let (times, stride) = match stride {
            0 => (of_track(0).to_vec(), 0),
            _ => (
                tracks.clone().flat_map(of_track).copied().collect(),
                samples.len(),
            ),
        };
        let times = Arc::new(times);
        let part = Self {
            ticks: Ticks::Times { times, stride },
            count: samples.len(),
        };
        (part, 0)
    }

    /// Explicit times for every track: each time is replaced by `map(track, time)`.
    pub(crate) fn map_times(
        &self,
        tracks: usize,
        map: impl Fn(usize, f64) -> f64,
    ) -> Result<Self, OutOfMemoryError> {
        let count = tracks.saturating_mul(self.count);
        let mut times = reserved(count, "the times of every track")?;
        for track in 0..tracks {
            let mapped = (0..self.count).map(|sample| map(track, self.time_at(track, sample)));
            times.extend(mapped);
        }
        Ok(Self {
            ticks: Ticks::Times {
                times: Arc::new(times),
                stride: self.count,
            },
            count: self.count,
        })
    }

    /// The time of a sample in seconds. `None` if the sample is out of range, or if times are listed for each track and
    /// the track is out of range.
    #[must_use]
    pub fn time(&self, track: usize, sample: usize) -> Option<f64> {
        let has_times = match &self.ticks {
            Ticks::Times { times, stride: 1.. } => track < times.len() / self.count.max(1),
            _ => true,
        };
        (has_times && sample < self.count).then(|| self.time_at(track, sample))
    }

    /// The times of all samples of a track in seconds. Empty if times are listed for each track and the track is out of
    /// range.
    #[must_use]
    pub fn times(&self, track: usize) -> impl ExactSizeIterator<Item = f64> {
        let count = self.time(track, 0).map_or(0, |_| self.count);
        (0..count).map(move |sample| self.time_at(track, sample))
    }

    /// Whether times are listed for each track.
    pub(crate) fn is_per_track(&self) -> bool {
        matches!(self.ticks, Ticks::Times { stride: 1.., .. })
    }

    /// The exact time of a sample within [`Timeline::len`].
    pub(crate) fn moment_at(&self, track: usize, sample: usize) -> Moment {
        match &self.ticks {
            Ticks::Frames { rate, start } => Moment::of_frame(start.seconds, *rate, sample as u64),
            Ticks::Times { .. } => Moment::new(self.time_at(track, sample)),
        }
    }

    /// The time of a sample within [`Timeline::len`], in seconds.
    #[inline]
    pub(crate) fn time_at(&self, track: usize, sample: usize) -> f64 {
        match &self.ticks {
            Ticks::Frames { rate, start } => start.seconds + rate.time_of(sample as u64),
            Ticks::Times { times, stride } => times[track * stride + sample],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_key_keeps_its_frame() {
        let set = |last| Some((0.1, last));
        // 0.1 + 20 s is not 20.1 in binary.
        let frames = SampleTimes::fps(25).resolve(1, set(0.1 + 20.0)).unwrap();
        assert_eq!(frames.len(), 501);
        assert_eq!(
            SampleTimes::fps(25).resolve(1, set(20.09)).unwrap().len(),
            500
        );
        assert_eq!(SampleTimes::fps(1).resolve(1, set(0.1)).unwrap().len(), 1);
    }

    #[test]
    fn the_last_key_of_unix_time_keeps_its_frame() {
        for frames in 1..200u32 {
            let last = 1.7e9 + f64::from(frames) / 100.0;
            let timeline = SampleTimes::fps(100)
                .resolve(1, Some((1.7e9, last)))
                .unwrap();
            assert_eq!(timeline.len(), frames as usize + 1);
        }
    }

    #[test]
    fn times_are_told_of_samples_that_there_are() {
        let each = SampleTimes::at_each(vec![1.0, 2.0, 3.0, 4.0]);
        let each = each.resolve(2, None).unwrap();
        let found = [(0, 1), (1, 0), (1, 2), (2, 0), (usize::MAX, 0)];
        let found = found.map(|(track, sample)| each.time(track, sample));
        assert_eq!(found, [Some(2.0), Some(3.0), None, None, None]);
        let frames = SampleTimes::fps(2).resolve(1, Some((1.0, 2.0))).unwrap();
        assert_eq!((frames.time(0, 2), frames.time(0, 3)), (Some(2.0), None));
    }

    #[test]
    fn impossible_requests_are_refused_before_any_work() {
        let span = Some((0.0, 1e9));
        let ranged = SampleTimes::at(vec![0.0, 1.0]).between(0.0, 1.0);
        assert_eq!(ranged.resolve(1, span), Err(SampleTimesError::TimesInRange));
        let nan = SampleTimes::at(vec![0.0, f64::NAN])
            .resolve(1, span)
            .unwrap_err();
        assert!(matches!(
            nan,
            SampleTimesError::TimeNotFinite { index: 1, .. }
        ));
        let uneven = SampleTimes::at_each(vec![0.0; 3])
            .resolve(2, span)
            .unwrap_err();
        assert_eq!(
            uneven,
            SampleTimesError::Uneven {
                times: 3,
                tracks: 2
            }
        );
    }
}
