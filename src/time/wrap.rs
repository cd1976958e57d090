//! What a track does outside its keys: it holds its end value, goes on at the velocity of its end,
//! or repeats in copies of the time between its first key and its last, forwards or backwards.

use std::ops::Range;

use rayon::iter::Either;

use crate::time::frame_clock::FrameClock;
use crate::time::frame_rate::FrameRate;
use crate::time::frames::{Ticks, Timeline};
use crate::tracks::check::LATEST;

/// What happens before a track's first key, or after its last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[doc(alias = "pre-infinity")]
#[doc(alias = "post-infinity")]
#[doc(alias = "extrapolation")]
#[doc(alias = "loop")]
pub enum WrapMode {
    /// The end value is held.
    #[default]
    Hold,
    /// The track starts again. A sample on the seam is the first key's.
    Loop,
    /// The track runs backwards, then forwards again, and so on.
    Mirror,
    /// The rotation goes on at the angular velocity that it has at that end.
    Extrapolate,
}

impl WrapMode {
    pub(crate) fn repeats(self) -> bool {
        matches!(self, Self::Loop | Self::Mirror)
    }
}

/// Consecutive samples that lie in one copy of a track.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TrackCopy {
    pub(crate) samples: Range<usize>,
    /// A frame coordinate in the copy is `sign` × the track's own + `offset`.
    pub(crate) sign: f64,
    pub(crate) offset: f64,
}

impl TrackCopy {
    /// The track itself.
    pub(crate) fn own(samples: Range<usize>) -> Self {
        Self {
            samples,
            sign: 1.0,
            offset: 0.0,
        }
    }

    pub(crate) fn is_own(&self) -> bool {
        self.sign == 1.0 && self.offset == 0.0
    }
}

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

    /// The number of the copy at `place`, which is in lengths of the track from its first key, and
    /// whether the copy runs backwards. Where end values are held or extrapolated it is copy 0, the
    /// track itself.
    fn copy_at(self, place: f64) -> (f64, bool) {
        let number = place.floor();
        let mode = if place < 0.0 { self.before } else { self.after };
        match mode {
            _ if number == 0.0 => (0.0, false),
            WrapMode::Loop => (number, false),
            WrapMode::Mirror => (number, number % 2.0 != 0.0),
            WrapMode::Hold | WrapMode::Extrapolate => (0.0, false),
        }
    }

    /// The samples of a track, cut where its copies meet. `span` holds the times of its first and
    /// last key, seconds; `None` if it has no copies. The copy of a sample does not depend on which
    /// other samples are requested.
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
            _ => Either::Left(std::iter::once(TrackCopy::own(samples))),
        }
    }

    fn copies_of_frames(
        self,
        (first, last): (f64, f64),
        (rate, start): (FrameRate, f64),
        samples: Range<usize>,
    ) -> Vec<TrackCopy> {
        let clock = FrameClock::new(rate, start, last);
        let (from, to) = (clock.boundary(first).frame, clock.boundary(last).frame);
        let length = to - from;
        let copy = |sample: usize| self.copy_at((sample as f64 - from) / length);
        let mut copies = Vec::new();
        let mut sample = samples.start;
        while sample < samples.end {
            let (number, backwards) = copy(sample);
            // The next copy starts near here; the loops find its first sample by `copy` alone.
            let end = (from + (number + 1.0) * length).ceil();
            let mut next = (end.clamp(0.0, samples.end as f64) as usize).max(sample + 1);
            while next > sample + 1 && copy(next - 1).0 != number {
                next -= 1;
            }
            while next < samples.end && copy(next).0 == number {
                next += 1;
            }
            let offset = number * length + if backwards { from + to } else { 0.0 };
            copies.push(TrackCopy {
                samples: sample..next,
                sign: if backwards { -1.0 } else { 1.0 },
                offset,
            });
            sample = next;
        }
        copies
    }

    /// The time between the keys, from `first` to `last`, that is repeated at `time`; `time` itself
    /// if it lies in no other copy.
    pub(crate) fn folded(self, (first, last): (f64, f64), time: f64) -> f64 {
        let length = last - first;
        if length <= 0.0 {
            return time;
        }
        // Copies cannot be counted farther out than key times may be.
        let far = time.clamp(-LATEST, LATEST);
        let (number, backwards) = self.copy_at((far - first) / length);
        // Far outside, a copy may be shorter than the distance between neighbouring f64 numbers.
        let into = ((far - first) - number * length).clamp(0.0, length);
        match (number, backwards) {
            (0.0, _) => time,
            (_, true) => last - into,
            _ => first + into,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::frames::Frames;

    #[test]
    fn samples_fall_into_copies_whatever_is_asked_for() {
        let wrap = Wrap {
            before: WrapMode::Mirror,
            after: WrapMode::Loop,
        };
        let timeline = Frames::fps(10).between(-2.0, 5.0).resolve(1, None).unwrap();
        let span = Some((0.25, 1.25));
        let whole: Vec<TrackCopy> = wrap.copies(span, &timeline, 0..71).collect();
        assert_eq!(whole.len(), 8);
        let mut next = 0;
        for copy in &whole {
            assert_eq!(copy.samples.start, next);
            next = copy.samples.end;
        }
        assert_eq!(next, 71);
        // Frame 0 is at -2 s, a copy and a quarter before the first key.
        assert_eq!(
            (whole[0].sign, whole[1].sign, whole[2].sign),
            (-1.0, 1.0, -1.0)
        );
        assert!(whole[3..].iter().all(|copy| copy.sign == 1.0));
        for from in 0..70 {
            for copy in wrap.copies(span, &timeline, from..from + 1) {
                let holds = |own: &&TrackCopy| own.samples.contains(&from);
                let own = whole.iter().find(holds).unwrap();
                assert_eq!((copy.sign, copy.offset), (own.sign, own.offset));
            }
        }
    }
}
