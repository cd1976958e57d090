//! Motion outside a track's keys: the end value is held, the rotation continues with the velocity of the end, or the
//! time between the first key and the last is repeated, forwards or backwards.

use std::ops::Range;

use rayon::iter::Either;

use crate::names::names;
use crate::time::frame_clock::{CopyPosition, FrameStart, TrackCopy, rounding};
use crate::time::frame_rate::FrameRate;
use crate::time::frames::{Ticks, Timeline};
use crate::time::moment::{InCopy, Moment, Period};

/// The motion of a track before its first key, or after its last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[doc(alias = "pre-infinity")]
#[doc(alias = "post-infinity")]
#[doc(alias = "extrapolation")]
#[doc(alias = "loop")]
#[non_exhaustive]
pub enum WrapMode {
    /// The end value is held.
    #[default]
    Hold,
    /// The track repeats. A sample at the time of the last key has the first key's value.
    Loop,
    /// The track is played backwards, then forwards again, and so on.
    Mirror,
    /// The rotation continues at the angular velocity at that end.
    Extrapolate,
}

names! {
    WrapMode, "wrap mode",
    Hold => "hold",
    Loop => "loop",
    Mirror => "mirror",
    Extrapolate => "extrapolate",
}

impl WrapMode {
    pub(crate) fn repeats(self) -> bool {
        matches!(self, Self::Loop | Self::Mirror)
    }
}

/// The minimum length of a copy whose samples are computed in frames.
const MIN_FRAMES: f64 = 2.0;

/// The wrap modes on both sides of a track.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Wrap {
    pub(crate) before: WrapMode,
    pub(crate) after: WrapMode,
}

impl Wrap {
    /// Whether end values are held on both sides.
    pub(crate) fn are_held(self) -> bool {
        self == Self::default()
    }

    pub(crate) fn repeats(self) -> bool {
        self.before.repeats() || self.after.repeats()
    }

    /// The samples of a track, divided where its copies meet. `span` is the times of its first and last key in seconds;
    /// `None` if it has no copies. The copy of a sample does not depend on the other samples of the request.
    #[inline]
    pub(crate) fn copies(
        self,
        span: Option<(f64, f64)>,
        timeline: &Timeline,
        samples: Range<usize>,
    ) -> impl Iterator<Item = TrackCopy> {
        match (&timeline.ticks, span) {
            (&Ticks::Frames { rate, start }, Some((first, last)))
                if self.repeats() && last > first =>
            {
                let copies = self.copies_of_frames((first, last), (rate, start), samples);
                Either::Right(copies.into_iter())
            }
            // Explicit times are moved between the keys by `folded` instead.
            _ => Either::Left(std::iter::once(TrackCopy::of_track(samples))),
        }
    }

    /// The copy that contains a time, and whether it runs backwards; `None` for the track itself, and where end
    /// values are held or extrapolated.
    fn copy_at(self, period: &Period, time: Moment, rounding: f64) -> Option<(InCopy, bool)> {
        let found = period.find(time, rounding);
        let mode = if found.is_before {
            self.before
        } else {
            self.after
        };
        match mode {
            _ if found.number == Some(0.0) => None,
            WrapMode::Loop => Some((found, false)),
            WrapMode::Mirror => Some((found, found.is_odd)),
            WrapMode::Hold | WrapMode::Extrapolate => None,
        }
    }

    /// The copy that contains a frame, as [`Wrap::copy_at`].
    fn copy_of_frame(
        self,
        period: &Period,
        (rate, start): (FrameRate, FrameStart),
        frame: usize,
    ) -> Option<(InCopy, bool)> {
        let time = Moment::of_frame(start.seconds, rate, frame as u64);
        let magnitude = time.high.abs().max(start.latest);
        self.copy_at(period, time, rounding(magnitude, false))
    }

    /// Whether a sample is in a copy of its track that runs backwards. `span` is the times of the track's first and
    /// last key in seconds.
    pub(crate) fn is_backwards(
        self,
        span: (f64, f64),
        timeline: &Timeline,
        track: usize,
        sample: usize,
    ) -> bool {
        let in_copy = || {
            let period = Period::new(span)?;
            match &timeline.ticks {
                &Ticks::Frames { rate, start } => {
                    self.copy_of_frame(&period, (rate, start), sample)
                }
                Ticks::Times { .. } => {
                    let time = Moment::new(timeline.time_at(track, sample));
                    self.copy_at(&period, time, 0.0)
                }
            }
        };
        in_copy().is_some_and(|(_, backwards)| backwards)
    }

    fn copies_of_frames(
        self,
        span: (f64, f64),
        (rate, start): (FrameRate, FrameStart),
        samples: Range<usize>,
    ) -> Vec<TrackCopy> {
        let Some(period) = Period::new(span) else {
            return vec![TrackCopy::of_track(samples)];
        };
        let length = rate.frames_in(period.length().seconds());
        let position = |sample: usize| {
            let found = self.copy_of_frame(&period, (rate, start), sample);
            let Some((found, backwards)) = found else {
                return CopyPosition::Track;
            };
            match found.number.filter(|_| length >= MIN_FRAMES) {
                Some(number) => CopyPosition::Frames {
                    first: span.0,
                    at_first: period.frame_of_first(number, backwards, (rate, start.seconds)),
                    backwards,
                },
                None => CopyPosition::At(period.time_in_track(found.into, backwards)),
            }
        };
        let mut copies = Vec::new();
        let mut sample = samples.start;
        let mut next_position = None;
        while sample < samples.end {
            let at_sample = next_position.take().unwrap_or_else(|| position(sample));
            let mut next = sample + 1;
            // The next copy begins near this sample. The loops find its first sample by `position`.
            let end = match at_sample {
                CopyPosition::At(_) => None,
                CopyPosition::Track => {
                    let is_in = |sample: usize| position(sample) == CopyPosition::Track;
                    Some(first_outside(sample + 1, samples.end, is_in))
                }
                CopyPosition::Frames {
                    at_first,
                    backwards,
                    ..
                } => Some(
                    (if backwards {
                        at_first
                    } else {
                        at_first + length
                    })
                    .ceil() as usize,
                ),
            };
            if let Some(end) = end {
                next = end.clamp(sample + 1, samples.end);
                while next > sample + 1 && position(next - 1) != at_sample {
                    next -= 1;
                }
                while next < samples.end {
                    let at_next = position(next);
                    if at_next != at_sample {
                        next_position = Some(at_next);
                        break;
                    }
                    next += 1;
                }
            }
            copies.push(TrackCopy {
                samples: sample..next,
                position: at_sample,
            });
            sample = next;
        }
        copies
    }

    /// The time between the keys, from `first` to `last`, whose value is repeated at `time`; `time` itself if it is
    /// in no other copy.
    pub(crate) fn folded(self, span: (f64, f64), time: f64) -> f64 {
        let in_track = || {
            let period = Period::new(span)?;
            let (found, backwards) = self.copy_at(&period, Moment::new(time), 0.0)?;
            Some(period.time_in_track(found.into, backwards))
        };
        in_track().map_or(time, |within| within.seconds().clamp(span.0, span.1))
    }
}

/// The first number of `from..end` for which `is_in` is false, or `end`. `is_in` must be true for all numbers before
/// it.
fn first_outside(from: usize, end: usize, is_in: impl Fn(usize) -> bool) -> usize {
    let (mut from, mut end) = (from, end);
    while from < end {
        let middle = from + (end - from) / 2;
        if is_in(middle) {
            from = middle + 1;
        } else {
            end = middle;
        }
    }
    from
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::frames::SampleTimes;

    #[test]
    fn samples_fall_into_copies_whatever_is_asked_for() {
        let wrap = Wrap {
            before: WrapMode::Mirror,
            after: WrapMode::Loop,
        };
        let timeline = SampleTimes::fps(10)
            .between(-2.0, 5.0)
            .resolve(1, None)
            .unwrap();
        let span = Some((0.25, 1.25));
        let whole: Vec<TrackCopy> = wrap.copies(span, &timeline, 0..71).collect();
        assert_eq!(whole.len(), 8);
        let mut next = 0;
        for copy in &whole {
            assert_eq!(copy.samples.start, next);
            next = copy.samples.end;
        }
        assert_eq!(next, 71);
        // Frame 0 is at -2 s, two copies and a quarter before the first key.
        let backwards: Vec<bool> = whole.iter().map(TrackCopy::is_backwards).collect();
        assert_eq!(backwards[..4], [true, false, true, false]);
        assert!(!backwards[3..].contains(&true));
        for from in 0..70 {
            for copy in wrap.copies(span, &timeline, from..from + 1) {
                let has_sample = |copy: &&TrackCopy| copy.samples.contains(&from);
                let of_whole = whole.iter().find(has_sample).unwrap();
                assert_eq!(copy.position, of_whole.position);
            }
        }
    }

    /// Even in the billionth copy, each sample has the position that exact arithmetic gives.
    #[test]
    fn far_copies_lie_where_they_repeat() {
        let wrap = Wrap {
            before: WrapMode::Loop,
            after: WrapMode::Mirror,
        };
        let start = 1.7e9 + 0.5;
        let frames = SampleTimes::fps(8).between(start, start + 3.0);
        let timeline = frames.resolve(1, None).unwrap();
        // A copy lasts 3.125 s, so the copy at 1.7e9 s has the number 544 000 000.
        let span = Some((0.0, 3.125));
        let copies: Vec<TrackCopy> = wrap.copies(span, &timeline, 0..25).collect();
        let at = |at_first, backwards| CopyPosition::Frames {
            first: 0.0,
            at_first,
            backwards,
        };
        let expected = [(0..21, at(-4.0, false)), (21..25, at(46.0, true))];
        assert_eq!(copies.len(), 2);
        for (copy, (samples, position)) in copies.iter().zip(expected) {
            assert_eq!((copy.samples.clone(), copy.position), (samples, position));
        }
    }
}
