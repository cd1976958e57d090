//! Cuts sets into batches that are prepared together: whole tracks, or some intervals of a long
//! track.

use std::ops::Range;

use crate::time::frame_clock::FrameClock;
use crate::time::frames::{Ticks, Timeline};
use crate::tracks::set::TrackSet;

/// Key intervals of a long track that are prepared as one part.
pub(crate) const PART_INTERVALS: usize = 4096;

/// The key intervals that are prepared together.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Batch {
    /// All of some tracks.
    Tracks(Range<usize>),
    /// Some intervals of one track.
    Intervals {
        track: usize,
        intervals: Range<usize>,
    },
    /// The intervals of some tracks in which samples between two times lie, seconds, and some beside them: a time
    /// within rounding of a key may lie on either side of it.
    Span {
        tracks: Range<usize>,
        from: f64,
        to: f64,
    },
}

/// The intervals between keys at these times in which samples between two times lie, and one more on either side.
/// Before the first key and after the last that is the interval beside it.
pub(crate) fn around(times: &[f64], from: f64, to: f64) -> Range<usize> {
    let all = times.len() - 1;
    let first = times.partition_point(|&time| time <= from);
    let last = times.partition_point(|&time| time <= to);
    first.saturating_sub(2).min(all.saturating_sub(1))..(last + 1).min(all)
}

impl Batch {
    /// The tracks of which it has intervals.
    pub(crate) fn tracks(&self) -> Range<usize> {
        match *self {
            Self::Tracks(ref tracks) | Self::Span { ref tracks, .. } => tracks.clone(),
            Self::Intervals { track, .. } => track..track + 1,
        }
    }

    /// Each track with the intervals of it that belong to the batch.
    pub(crate) fn intervals(&self, set: &TrackSet) -> impl Iterator<Item = (usize, Range<usize>)> {
        let batch = self.clone();
        self.tracks().map(move |track| {
            let (times, _) = set.times_and_keys(track);
            let intervals = match &batch {
                Self::Tracks(_) => 0..times.len() - 1,
                Self::Intervals { intervals, .. } => intervals.clone(),
                Self::Span { from, to, .. } => around(times, *from, *to),
            };
            (track, intervals)
        })
    }

    /// The samples that the batch gives: those from its first key up to its end, and those before a
    /// track's first key or after its last. `steps` is whether keys are held until the next one.
    pub(crate) fn samples(&self, set: &TrackSet, timeline: &Timeline, steps: bool) -> Range<usize> {
        let Self::Intervals { track, intervals } = self else {
            return 0..timeline.len();
        };
        let (times, _) = set.times_and_keys(*track);
        let from = match intervals.start {
            0 => 0,
            start => first_sample(times[start], timeline, steps),
        };
        let to = if intervals.end + 1 == times.len() {
            timeline.len()
        } else {
            first_sample(times[intervals.end], timeline, steps)
        };
        from..to.max(from)
    }
}

/// The first sample of the interval that starts at a time.
fn first_sample(time: f64, timeline: &Timeline, steps: bool) -> usize {
    let Ticks::Frames { rate, start } = timeline.ticks else {
        return 0;
    };
    let clock = FrameClock::new(rate, start, steps);
    (clock.first_frame(time) as usize).min(timeline.len())
}

/// How a set is cut into batches.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BatchSize {
    /// The most keys and the most tracks of a batch; a track with more keys is a batch of its own.
    pub(crate) keys: usize,
    pub(crate) tracks: usize,
    /// A track with more keys is cut after this many intervals; `None` if it may not be cut.
    pub(crate) cut: Option<usize>,
}

/// The batches of a set's tracks, or of a batch, in order.
pub(crate) fn batches(set: &TrackSet, whole: Batch, size: BatchSize) -> Vec<Batch> {
    let each = size.cut.unwrap_or(usize::MAX);
    let parts = |track: usize, intervals: Range<usize>| {
        intervals
            .clone()
            .step_by(each)
            .map(move |start| Batch::Intervals {
                track,
                intervals: start..intervals.end.min(start.saturating_add(each)),
            })
    };
    let mut all = Vec::new();
    let tracks = match whole {
        Batch::Tracks(tracks) => tracks,
        Batch::Intervals { track, intervals } => return parts(track, intervals).collect(),
        Batch::Span {
            ref tracks,
            from,
            to,
        } => {
            // Of tracks with few keys in the span as many as may be together.
            let (mut start, mut keys) = (tracks.start, 0);
            let span = |tracks| Batch::Span { tracks, from, to };
            for (track, intervals) in whole.intervals(set) {
                let needed = intervals.len() + 1;
                if start < track && (keys + needed > size.keys || track - start >= size.tracks) {
                    all.push(span(start..track));
                    (start, keys) = (track, 0);
                }
                if each < intervals.len() {
                    all.extend(parts(track, intervals));
                    start = track + 1;
                } else {
                    keys += needed;
                }
            }
            all.extend((start < tracks.end).then(|| span(start..tracks.end)));
            return all;
        }
    };
    let mut start = tracks.start;
    while start < tracks.end {
        let limit = (tracks.end).min(start.saturating_add(size.tracks.max(1)));
        let next = set.tracks_within(start..limit, size.keys);
        let intervals = 0..set.times_and_keys(start).1.len() - 1;
        if next == start && each < intervals.len() {
            all.extend(parts(start, intervals));
        } else {
            all.push(Batch::Tracks(start..next.max(start + 1)));
        }
        start = next.max(start + 1);
    }
    all
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::time::frames::SampleTimes;

    fn with_keys(counts: &[usize]) -> TrackSet {
        let mut set = TrackSet::new();
        for &count in counts {
            let times: Vec<f64> = (0..count).map(|i| i as f64).collect();
            let keys = vec![Quat::IDENTITY; count];
            set.push("", &times, &keys).expect("unit keys in order");
        }
        set
    }

    #[test]
    fn batches_have_no_more_than_they_may_and_leave_nothing_out() {
        let set = with_keys(&[3, 3, 3, 1, 30, 2, 9, 1]);
        let size = BatchSize {
            keys: 8,
            tracks: 3,
            cut: Some(12),
        };
        let intervals = |track, intervals| Batch::Intervals { track, intervals };
        let found: Vec<Batch> = batches(&set, Batch::Tracks(0..8), size);
        let expected = [
            Batch::Tracks(0..2),
            Batch::Tracks(2..4),
            intervals(4, 0..12),
            intervals(4, 12..24),
            intervals(4, 24..29),
            Batch::Tracks(5..6),
            Batch::Tracks(6..7),
            Batch::Tracks(7..8),
        ];
        assert_eq!(found, expected);
        let timeline = SampleTimes::fps(2).resolve(8, set.time_span()).unwrap();
        let samples: Vec<_> = (found[2..5].iter())
            .map(|batch| batch.samples(&set, &timeline, false))
            .collect();
        assert_eq!(samples, [0..24, 24..48, 48..59]);
        assert_eq!(found[0].samples(&set, &timeline, false), 0..59);

        let whole = BatchSize { cut: None, ..size };
        let long = batches(&set, Batch::Tracks(4..5), whole);
        assert_eq!(long, [Batch::Tracks(4..5)]);
        let of_batch = batches(&set, intervals(4, 3..20), size);
        assert_eq!(of_batch, [intervals(4, 3..15), intervals(4, 15..20)]);
    }
}
