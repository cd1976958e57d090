//! What lies outside a track's keys: end values, or copies of the time between the first key
//! and the last, forwards or backwards.

use std::ops::Range;

use rayon::iter::Either;

use crate::time::frame_clock::FrameClock;
use crate::time::frame_rate::FrameRate;
use crate::time::frames::{Ticks, Timeline};
use crate::tracks::check::LATEST;

/// What happens before a track's first key, or after its last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum WrapMode {
    /// The end value is held.
    #[default]
    Hold,
    /// The track starts again. A sample on the seam is the first key's.
    Loop,
    /// The track runs back, and forth again.
    Mirror,
    /// It goes on at the angular velocity of its end.
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
    /// Frame coordinates of the copy: `sign` times the track's own, and this more.
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

/// What happens on both sides of a track.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Wrap {
    pub(crate) before: WrapMode,
    pub(crate) after: WrapMode,
}

impl Wrap {
    /// Whether end values are held on both wrap.
    pub(crate) fn are_held(self) -> bool {
        self == Self::default()
    }

    pub(crate) fn repeats(self) -> bool {
        self.before.repeats() || self.after.repeats()
    }

    /// Which copy the part of a track at `place` is, counted in its lengths from its first
    /// key, and whether it runs backwards. What is held belongs to the track itself.
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

    /// The samples of a track, cut where its copies meet; `span` is when its keys start and
    /// end, seconds, or nothing where there are no copies. What copy a sample is in does not depend on the samples asked for.
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
            // Explicit times are folded.
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
            // The first sample of another copy: near where this one ends.
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

    /// A time as one within the keys from `first` to `last`, where it is repeated there.
    pub(crate) fn folded(self, (first, last): (f64, f64), time: f64) -> f64 {
        let length = last - first;
        if length <= 0.0 {
            return time;
        }
        // Copies of times beyond those that keys may have cannot be counted.
        let far = time.clamp(-LATEST, LATEST);
        let (number, backwards) = self.copy_at((far - first) / length);
        // Far outside, the copies are narrower than the spaces between f64.
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

    #[test]
    fn times_are_folded_into_the_keys() {
        let wrap = Wrap {
            before: WrapMode::Loop,
            after: WrapMode::Mirror,
        };
        for (time, expected) in [
            (1.5, 1.5),
            (3.5, 2.5),
            (5.25, 1.25),
            (0.5, 2.5),
            (-1.75, 2.25),
        ] {
            assert_eq!(wrap.folded((1.0, 3.0), time), expected, "{time}");
        }
        let held = Wrap::default();
        assert_eq!(held.folded((1.0, 3.0), 9.0), 9.0);
    }
}
