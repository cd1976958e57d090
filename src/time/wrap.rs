//! What lies outside a track's keys: its cycles, each a copy of the time between the
//! first key and the last, forwards or backwards.

use std::ops::Range;

use rayon::iter::Either;

use crate::time::frame_clock::FrameClock;
use crate::time::frame_rate::FrameRate;
use crate::time::frames::{Ticks, Timeline};
use crate::tracks::check::LATEST;

/// What happens before a track's first key, or after its last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Outside {
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

impl Outside {
    pub(crate) fn repeats(self) -> bool {
        matches!(self, Self::Loop | Self::Mirror)
    }
}

/// Some consecutive samples that lie in one copy of a track.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cycle {
    pub(crate) samples: Range<usize>,
    /// Frame coordinates of the copy: `sign` times the track's own, and this more.
    pub(crate) sign: f64,
    pub(crate) offset: f64,
}

impl Cycle {
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

/// Both sides of a track.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Sides {
    pub(crate) before: Outside,
    pub(crate) after: Outside,
}

impl Sides {
    /// Whether end values are held on both sides.
    pub(crate) fn are_held(self) -> bool {
        self == Self::default()
    }

    pub(crate) fn repeats(self) -> bool {
        self.before.repeats() || self.after.repeats()
    }

    /// Which copy the part of a track at `place` is, counted in its lengths from its first
    /// key, and whether it runs backwards. What is held belongs to the track itself.
    fn copy(self, place: f64) -> (f64, bool) {
        let (outside, number) = if place < 0.0 {
            (self.before, place.floor())
        } else {
            (self.after, place.floor())
        };
        match outside {
            _ if number == 0.0 => (0.0, false),
            Outside::Loop => (number, false),
            Outside::Mirror => (number, number % 2.0 != 0.0),
            Outside::Hold | Outside::Extrapolate => (0.0, false),
        }
    }

    /// The samples of a track, cut where its copies meet; `span` is when its keys start and
    /// end, seconds, or nothing where there are no copies. What copy a sample is in does not depend on the samples asked for.
    #[inline]
    pub(crate) fn cycles(
        self,
        span: Option<(f64, f64)>,
        timeline: &Timeline,
        samples: Range<usize>,
    ) -> impl Iterator<Item = Cycle> {
        match (&timeline.ticks, span) {
            (&Ticks::Frames { rate, start }, Some((first, last)))
                if self.repeats() && last > first =>
            {
                let copies = self.copies((first, last), (rate, start), samples);
                Either::Right(copies.into_iter())
            }
            // Explicit times are folded.
            _ => Either::Left(std::iter::once(Cycle::own(samples))),
        }
    }

    fn copies(
        self,
        (first, last): (f64, f64),
        (rate, start): (FrameRate, f64),
        samples: Range<usize>,
    ) -> Vec<Cycle> {
        let clock = FrameClock::new(rate, start, last);
        let (from, to) = (clock.boundary(first).frame, clock.boundary(last).frame);
        let length = to - from;
        let copy = |sample: usize| self.copy((sample as f64 - from) / length);
        let mut cycles = Vec::new();
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
            cycles.push(Cycle {
                samples: sample..next,
                sign: if backwards { -1.0 } else { 1.0 },
                offset,
            });
            sample = next;
        }
        cycles
    }

    /// A time as one within the keys from `first` to `last`, where it is repeated there.
    pub(crate) fn folded(self, (first, last): (f64, f64), time: f64) -> f64 {
        let length = last - first;
        if length <= 0.0 {
            return time;
        }
        // Copies of times beyond those that keys may have cannot be counted.
        let far = time.clamp(-LATEST, LATEST);
        let (number, backwards) = self.copy((far - first) / length);
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
        let sides = Sides {
            before: Outside::Mirror,
            after: Outside::Loop,
        };
        let timeline = Frames::fps(10).between(-2.0, 5.0).resolve(1, None).unwrap();
        let span = Some((0.25, 1.25));
        let whole: Vec<Cycle> = sides.cycles(span, &timeline, 0..71).collect();
        assert_eq!(whole.len(), 8);
        let mut next = 0;
        for cycle in &whole {
            assert_eq!(cycle.samples.start, next);
            next = cycle.samples.end;
        }
        assert_eq!(next, 71);
        // Frame 0 is at -2 s, a copy and a quarter before the first key.
        assert_eq!(
            (whole[0].sign, whole[1].sign, whole[2].sign),
            (-1.0, 1.0, -1.0)
        );
        assert!(whole[3..].iter().all(|cycle| cycle.sign == 1.0));
        for from in 0..70 {
            for cycle in sides.cycles(span, &timeline, from..from + 1) {
                let holds = |own: &&Cycle| own.samples.contains(&from);
                let own = whole.iter().find(holds).unwrap();
                assert_eq!((cycle.sign, cycle.offset), (own.sign, own.offset));
            }
        }
    }

    #[test]
    fn times_are_folded_into_the_keys() {
        let sides = Sides {
            before: Outside::Loop,
            after: Outside::Mirror,
        };
        for (time, expected) in [
            (1.5, 1.5),
            (3.5, 2.5),
            (5.25, 1.25),
            (0.5, 2.5),
            (-1.75, 2.25),
        ] {
            assert_eq!(sides.folded((1.0, 3.0), time), expected, "{time}");
        }
        let held = Sides::default();
        assert_eq!(held.folded((1.0, 3.0), 9.0), 9.0);
    }
}
