//! Division of sets into batches (whole tracks, or some intervals of a long track), and preparation of them by their
//! method: key intervals become segments.

use std::ops::Range;

use glam::Quat;

use crate::curve::options::{InterpolationError, Quantity, Speed};
use crate::method::CurveKind;
use crate::method::interpolation::Interpolation;
use crate::prepare::arcs::ArcPreparation;
use crate::prepare::error::SetError;
use crate::prepare::prepared::Prepared;
use crate::prepare::smooth::SmoothPreparation;
use crate::threads::stop;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::{Ticks, Timeline};
use crate::time::runs::NONE;
use crate::time::spans::SpanSource;
use crate::tracks::set::TrackSet;

/// Prepares tracks by an interpolation; its memory is reused.
pub(crate) struct Preparation {
    interpolation: Interpolation,
    strategy: Strategy,
}

/// The method of converting intervals to segments: in blocks with intervals of several tracks, except for steps,
/// which have no segments.
enum Strategy {
    Steps,
    Arcs(Box<ArcPreparation>),
    Smooth(Box<SmoothPreparation>),
}

impl Preparation {
    pub(crate) fn new(interpolation: &Interpolation) -> Self {
        let strategy = match *interpolation.method.curves {
            CurveKind::Steps => Strategy::Steps,
            CurveKind::Arcs(_) if !interpolation.is_by_formula() => {
                Strategy::Arcs(Box::new(ArcPreparation::new(interpolation.signs)))
            }
            CurveKind::Arcs(smooth) | CurveKind::Smooth(smooth) => {
                Strategy::Smooth(Box::new(SmoothPreparation::new(interpolation, smooth)))
            }
        };
        Self {
            interpolation: *interpolation,
            strategy,
        }
    }

    /// Refuses keys of the track `track` that cannot be interpolated as requested.
    pub(crate) fn check_track(
        interpolation: &Interpolation,
        keys: &[Quat],
        track: usize,
    ) -> Result<(), InterpolationError> {
        interpolation.check_track(keys, track)?;
        if Self::has_path(interpolation) {
            (interpolation.signs).check(keys, 0..keys.len() - 1, track)
        } else {
            Ok(())
        }
    }

    /// Whether an option selects the path between keys. Steps have no path, and a method that prescribes the path
    /// also defines the curve between opposite keys.
    fn has_path(interpolation: &Interpolation) -> bool {
        !interpolation.steps() && interpolation.method.signs.is_none()
    }

    /// Allows intervals without a sample of this timeline to be left out. This is done if the timeline has fewer
    /// samples than tracks have keys on average. The segments can then be used for this timeline only.
    pub(crate) fn only_for(&mut self, timeline: &Timeline, set: &TrackSet) {
        let keys = set.key_count() / set.track_count().max(1);
        if let Strategy::Smooth(smooth) = &mut self.strategy {
            smooth.frames = match timeline.ticks {
                Ticks::Frames { rate, start } if timeline.len() < keys => Some((rate, start)),
                _ => None,
            };
        }
    }

    /// Whether intervals without a sample are left out.
    pub(crate) fn leaves_intervals_out(&self) -> bool {
        matches!(&self.strategy, Strategy::Smooth(smooth) if smooth.frames.is_some())
    }

    /// Prepares intervals of a set's tracks; each range of intervals becomes a part.
    pub(crate) fn push(
        &mut self,
        prepared: &mut Prepared,
        set: &TrackSet,
        intervals: impl Iterator<Item = (usize, Range<usize>)>,
    ) -> Result<(), SetError> {
        let Self {
            interpolation,
            strategy,
        } = self;
        let has_path = Self::has_path(interpolation);
        for (track, range) in intervals {
            stop::check()?;
            let (_, keys) = set.times_and_keys(track);
            interpolation.check_track(keys, track)?;
            if has_path {
                interpolation.signs.check(keys, range.clone(), track)?;
            }
            match strategy {
                Strategy::Steps => add_steps(prepared, set, track, range, interpolation.quantity),
                Strategy::Arcs(arcs) => arcs.add(prepared, set, track, range),
                Strategy::Smooth(smooth) => smooth.add(prepared, set, track, range),
            }
        }
        match strategy {
            Strategy::Steps => {}
            Strategy::Arcs(arcs) => arcs.finish(prepared),
            Strategy::Smooth(smooth) => smooth.finish(prepared),
        }
        // After a stop, the result is incomplete and must not be used.
        Ok(stop::check()?)
    }
}

/// Adds some intervals of the track `index` of a set as a separate part. Its keys are held until the next key: every
/// sample is a constant.
fn add_steps(
    prepared: &mut Prepared,
    set: &TrackSet,
    index: usize,
    intervals: Range<usize>,
    quantity: Quantity,
) {
    let (times, keys) = set.times_and_keys(index);
    let first = prepared.constants.len() as u32;
    let last = first + intervals.len() as u32;
    let value = |key: &Quat| match quantity {
        Quantity::Rotation => key.to_array(),
        _ => [0.0; 4],
    };
    let keys = keys[intervals.start..=intervals.end].iter();
    prepared.constants.extend(keys.map(value));
    let first_span = prepared.spans.len();
    let spans = first_span..first_span + intervals.len();
    prepared.push_part(index, times, &intervals, spans, [first, last]);
    for (i, constant) in intervals.zip(first..last) {
        prepared.push_span(times[i], SpanSource::Constant(constant), NONE);
    }
}

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
    /// The intervals of some tracks that contain samples between two times in seconds, and some intervals next to them:
    /// a time within rounding of a key may be on either side of it.
    Span {
        tracks: Range<usize>,
        from: f64,
        to: f64,
    },
}

/// The intervals between keys at these times that contain samples between two times, and one more on each side.
/// Before the first key and after the last one, the nearest interval is included.
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

    /// Keys of all its intervals.
    pub(crate) fn keys(&self, set: &TrackSet) -> usize {
        match self {
            Self::Tracks(tracks) => set.keys_of(tracks.clone()),
            Self::Span { .. } | Self::Intervals { .. } => {
                let intervals = self.intervals(set);
                intervals.map(|(_, intervals)| intervals.len() + 1).sum()
            }
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

    /// The samples of the batch: those from its first key to its end, and those before a track's first key or after
    /// its last. `steps` is whether keys are held until the next one.
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

/// The sizes of the batches of a set.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BatchSize {
    /// The maximum number of keys and of tracks of a batch; a track with more keys is a separate batch.
    pub(crate) keys: usize,
    pub(crate) tracks: usize,
    /// The number of intervals after which a track with more keys is divided; `None` if it must not be divided.
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
            // A batch gets as many tracks as its limits of tracks and keys allow.
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

/// A request for a set: some samples of some of its tracks, by a method. The timeline is that of the whole set.
#[derive(Clone)]
pub(crate) struct SetRequest<'a> {
    pub(crate) set: &'a TrackSet,
    pub(crate) tracks: Range<usize>,
    pub(crate) samples: Range<usize>,
    pub(crate) interpolation: &'a Interpolation,
    pub(crate) timeline: &'a Timeline,
}

impl<'a> SetRequest<'a> {
    /// All samples of all tracks.
    pub(crate) fn whole(
        set: &'a TrackSet,
        interpolation: &'a Interpolation,
        timeline: &'a Timeline,
    ) -> Self {
        Self {
            set,
            tracks: 0..set.track_count(),
            samples: 0..timeline.len(),
            interpolation,
            timeline,
        }
    }
}

impl SetRequest<'_> {
    /// The request for other tracks and samples of the same set.
    pub(crate) fn part(&self, tracks: Range<usize>, samples: Range<usize>) -> Self {
        Self {
            tracks,
            samples,
            ..self.clone()
        }
    }

    /// The number of values of the result.
    pub(crate) fn len(&self) -> usize {
        self.tracks.len() * self.samples.len()
    }

    /// Whether an interval can be prepared without the other intervals of its track: not if tracks continue outside
    /// their keys, and not if the speed depends on the whole track.
    pub(crate) fn prepares_apart(&self) -> bool {
        self.interpolation.wrap().are_held() && self.interpolation.speed == Speed::AsKeyed
    }

    /// The intervals to prepare: those around the samples, if that leaves out enough of the others, else all.
    pub(crate) fn batch(&self) -> Batch {
        let tracks = self.tracks.clone();
        let span = (self
            .prepares_apart()
            .then(|| self.set.time_span())
            .flatten())
        .and_then(|of_keys| Some((of_keys, self.time_span()?)));
        match span {
            Some(((first, last), (from, to)))
                if (from - first).max(0.0) + (last - to).max(0.0) >= LEFT_OUT * (last - first) =>
            {
                Batch::Span { tracks, from, to }
            }
            _ => Batch::Tracks(tracks),
        }
    }

    /// The intervals with the keys that the samples are evaluated from: as [`SetRequest::batch`] for frames at a rate;
    /// listed times are looked up among all keys of a track.
    pub(crate) fn batch_of_keys(&self) -> Batch {
        match self.timeline.ticks {
            Ticks::Frames { .. } => self.batch(),
            Ticks::Times { .. } => Batch::Tracks(self.tracks.clone()),
        }
    }

    /// The first and the last time of the samples.
    fn time_span(&self) -> Option<(f64, f64)> {
        let (first, last) = (self.samples.start, self.samples.end.checked_sub(1)?);
        let (timeline, track) = (self.timeline, self.tracks.start);
        let tracks = match timeline.ticks {
            Ticks::Frames { .. } => {
                return Some((
                    timeline.time_at(track, first),
                    timeline.time_at(track, last),
                ));
            }
            Ticks::Times { stride: 0, .. } => track..track + 1,
            Ticks::Times { .. } => self.tracks.clone(),
        };
        let all = tracks.flat_map(|track| {
            let samples = self.samples.clone();
            samples.map(move |sample| timeline.time_at(track, sample))
        });
        all.fold(None, |span, time| {
            let (from, to): (f64, f64) = span.unwrap_or((time, time));
            Some((from.min(time), to.max(time)))
        })
    }

    /// The samples of the request that a batch of its tracks has.
    pub(crate) fn samples_of(&self, batch: &Batch) -> Range<usize> {
        let of_batch = batch.samples(self.set, self.timeline, self.interpolation.steps());
        let end = of_batch.end.min(self.samples.end);
        of_batch.start.max(self.samples.start).min(end)..end
    }

    /// Refuses tracks that cannot be interpolated as requested, also if the fault is at keys that no sample needs.
    pub(crate) fn check(&self) -> Result<(), InterpolationError> {
        self.interpolation.check_wraps()?;
        self.tracks.clone().try_for_each(|track| {
            let (_, keys) = self.set.times_and_keys(track);
            Preparation::check_track(self.interpolation, keys, track)
        })
    }
}

/// If the samples leave out at least this part of a set's time, the intervals in that part are not prepared. For a
/// smaller part, the search in the key times of every track would take longer than it saves.
const LEFT_OUT: f64 = 0.25;

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
