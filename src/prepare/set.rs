//! Whole sets: tracks in batches, shared among the threads.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use glam::Quat;
use rayon::prelude::*;

use crate::curve::segment::segment_size;
use crate::method::Curves;
use crate::method::interpolation::{Interpolation, InterpolationError, Speed};
use crate::prepare::Prepared;
use crate::prepare::arcs::arcs::ArcPreparation;
use crate::prepare::clip_data::Wanted;
use crate::prepare::double::smooth::SmoothPreparation;
use crate::prepare::steps::StepPreparation;
use crate::shader::Form;
use crate::time::frame_rate::FrameRate;
use crate::time::frames::{Ticks, Timeline};
use crate::time::wrap::Sides;
use crate::tracks::set::TrackSet;

/// Key intervals prepared as one piece of work.
pub(crate) const BATCH: usize = 4096;

/// Prepares tracks of a set, in parallel: one [`Prepared`] for each batch of tracks, or of
/// intervals where a track is long, in order.
pub(crate) fn prepare(
    set: &TrackSet,
    interpolation: &Interpolation,
    wanted: Wanted<'_>,
) -> Result<Vec<Prepared>, InterpolationError> {
    let tracks = wanted.tracks.clone();
    let intervals = wanted.intervals.clone();
    let batch = wanted.batch(set, interpolation.form());
    let held = interpolation.sides() == Sides::default();
    let only_for = wanted.only_for.filter(|_| held);
    let spare = Mutex::new(wanted.spare);
    let preparation = || {
        let mut preparation = Preparation::new(interpolation);
        if let Some(timeline) = only_for {
            preparation.only_for(timeline, set);
        }
        preparation
    };
    let batches: Vec<Vec<Prepared>> = batches(set, tracks.clone(), batch)
        .into_par_iter()
        .map(|tracks| {
            let alone = tracks.clone().next().filter(|_| tracks.len() == 1);
            let in_pieces = interpolation.speed == Speed::AsKeyed;
            if let (Some(long), true) = (alone, in_pieces) {
                let all = 0..set.track(long).keys.len() - 1;
                let own = intervals.clone().unwrap_or(all);
                return prepare_long(set, long, own, interpolation, &preparation, &spare);
            }
            let own = spare.lock().unwrap_or_else(PoisonError::into_inner).pop();
            let mut prepared = own.unwrap_or_else(|| Prepared::new(interpolation));
            prepared.clear();
            prepared.reserve(keys_of(set, tracks.clone()));
            preparation().push(&mut prepared, set, whole_tracks(set, tracks))?;
            Ok(vec![prepared])
        })
        .collect::<Result<_, _>>()?;
    let mut groups: Vec<Prepared> = batches.into_iter().flatten().collect();
    // Their places are those among the tracks asked for.
    for part in groups.iter_mut().flat_map(|group| &mut group.parts) {
        part.track -= tracks.start as u32;
    }
    Ok(groups)
}

impl Wanted<'_> {
    /// Intervals of a batch: so many that the groups are few, where that is wanted, but
    /// enough for all threads.
    fn batch(&self, set: &TrackSet, form: Form) -> usize {
        let (Some(limit), true) = (self.group_bytes, self.few_groups) else {
            return BATCH;
        };
        let most = limit / (segment_size(form) + size_of::<Quat>()) / 2;
        let each = keys_of(set, self.tracks.clone()) / (4 * rayon::current_num_threads());
        each.min(most).max(BATCH)
    }
}

fn keys_of(set: &TrackSet, tracks: Range<usize>) -> usize {
    tracks.map(|index| set.times_and_keys(index).1.len()).sum()
}

/// Ranges of tracks with about so many intervals each.
fn batches(set: &TrackSet, tracks: Range<usize>, batch: usize) -> Vec<Range<usize>> {
    let mut batches = Vec::new();
    let (mut start, mut intervals) = (tracks.start, 0);
    for index in tracks.clone() {
        intervals += set.times_and_keys(index).1.len();
        if intervals >= batch || index + 1 == tracks.end {
            batches.push(start..index + 1);
            (start, intervals) = (index + 1, 0);
        }
    }
    batches
}

/// Intervals of a track in pieces.
fn prepare_long(
    set: &TrackSet,
    index: usize,
    intervals: Range<usize>,
    interpolation: &Interpolation,
    preparation: &(impl Fn() -> Preparation + Sync),
    spare: &Mutex<Vec<Prepared>>,
) -> Result<Vec<Prepared>, InterpolationError> {
    let pieces = intervals.len().div_ceil(BATCH).max(1);
    let piece = |i: usize| {
        let start = intervals.start + i * BATCH;
        let own = start..(start + BATCH).min(intervals.end);
        let memory = spare.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut prepared = memory.unwrap_or_else(|| Prepared::new(interpolation));
        prepared.clear();
        preparation().push(&mut prepared, set, [(index, own)])?;
        Ok(prepared)
    };
    (0..pieces).into_par_iter().map(piece).collect()
}

/// Makes segments from key intervals, in blocks that may hold several tracks'.
pub(crate) trait Prepare: Send {
    /// Adds some intervals of a track, the `index`th of its set, as a part of their own.
    fn add(
        &mut self,
        prepared: &mut Prepared,
        set: &TrackSet,
        index: usize,
        intervals: Range<usize>,
    ) -> Result<(), InterpolationError>;

    /// Finishes what was added.
    fn finish(&mut self, prepared: &mut Prepared);

    /// From now on only intervals that hold a frame need segments; or all.
    fn only_frames(&mut self, _frames: Option<(FrameRate, f64)>) {}
}

/// Prepares whole tracks, with memory that serves many.
pub(crate) struct Preparation(Box<dyn Prepare>);

impl Preparation {
    pub(crate) fn new(interpolation: &Interpolation) -> Self {
        Self(match *interpolation.method.curves {
            Curves::Arcs(moving) if interpolation.is_by_formula() => {
                Box::new(SmoothPreparation::new(interpolation, moving))
            }
            Curves::Arcs(_) => Box::new(ArcPreparation::new(interpolation)),
            Curves::Steps => Box::new(StepPreparation::new(interpolation)),
            Curves::Smooth(smooth) => Box::new(SmoothPreparation::new(interpolation, smooth)),
        })
    }

    /// From now on intervals without a sample of that timeline need not be prepared,
    /// if that saves anything. What is prepared then serves no other.
    pub(crate) fn only_for(&mut self, timeline: &Timeline, set: &TrackSet) {
        let keys = set.key_count() / set.track_count().max(1);
        self.0.only_frames(match timeline.ticks {
            Ticks::Frames { rate, start } if timeline.len() < keys => Some((rate, start)),
            _ => None,
        });
    }

    /// Prepares some intervals of tracks of a set, each time a part of their own.
    pub(crate) fn push(
        &mut self,
        prepared: &mut Prepared,
        set: &TrackSet,
        pieces: impl IntoIterator<Item = (usize, Range<usize>)>,
    ) -> Result<(), InterpolationError> {
        for (track, intervals) in pieces {
            self.0.add(prepared, set, track, intervals)?;
        }
        self.0.finish(prepared);
        Ok(())
    }
}

/// All intervals of some tracks.
pub(crate) fn whole_tracks(
    set: &TrackSet,
    tracks: Range<usize>,
) -> impl Iterator<Item = (usize, Range<usize>)> {
    tracks.map(|track| (track, 0..set.times_and_keys(track).1.len() - 1))
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::method::METHODS;
    use crate::prepare::Source;
    use crate::simd::dispatch::tests::at_every_width;

    /// The bytes of every span's segment; parts of curves may lie in another order.
    fn curves(prepared: &Prepared) -> Vec<&[u8]> {
        let bytes = prepared.segments.as_bytes();
        let size = bytes.len() / prepared.segments.len().max(1);
        let segment = |source: &Source| match *source {
            Source::Segment(i) => &bytes[i as usize * size..][..size],
            _ => &[],
        };
        prepared.spans.sources.iter().map(segment).collect()
    }

    /// Catches a piece that forgets the signs of the keys before it, or lanes that
    /// mix up tracks.
    #[test]
    fn a_track_in_pieces_is_prepared_like_a_whole_one() {
        let count = 3 * BATCH + 17;
        let times: Vec<f64> = (0..count)
            .map(|i| i as f64 + 0.3 * (i % 3) as f64)
            .collect();
        let keys: Vec<Quat> = (0..count)
            .map(|i| {
                let key = Quat::from_rotation_y(i as f32 * 0.7) * Quat::from_rotation_x(i as f32);
                if i * i % 7 == 2 { -key } else { key }
            })
            .collect();
        let mut set = TrackSet::new();
        set.push("", &times, &keys).unwrap();
        for method in METHODS {
            let interpolation = method.into();
            let mut whole = Prepared::new(&interpolation);
            Preparation::new(&interpolation)
                .push(&mut whole, &set, whole_tracks(&set, 0..1))
                .unwrap();
            let pieces = prepare(&set, &interpolation, Wanted::all(&set, None)).unwrap();
            assert!(pieces.len() > 3, "{method}");
            let mut together = Prepared::new(&interpolation);
            pieces.into_iter().for_each(|piece| together.append(piece));
            assert!(curves(&whole) == curves(&together), "{method}");
            assert_eq!(whole.spans.starts, together.spans.starts, "{method}");
        }
    }

    /// Catches an instruction set whose code fuses, reorders or divides otherwise:
    /// segments must not depend on the machine that prepared them.
    #[test]
    fn every_vector_width_prepares_the_same_bits() {
        let mut set = TrackSet::new();
        for track in 0..40 {
            // From a hundredth of a degree to half a turn, evenly and unevenly.
            let step = 3.1 * 0.5f32.powi(track % 14);
            let uneven = if track < 20 { 0.0 } else { 0.99 };
            let times: Vec<f64> = (0..23)
                .map(|i| f64::from(i) + uneven * f64::from(i % 2))
                .collect();
            let keys: Vec<Quat> = (0..23)
                .map(|i| {
                    let turn = step * (i as f32 + (i as f32).sin());
                    Quat::from_rotation_y(turn) * Quat::from_rotation_x(0.3 * turn.cos())
                })
                .collect();
            set.push("", &times, &keys).unwrap();
        }
        for method in METHODS {
            let results = at_every_width(|| {
                let interpolation = method.into();
                let mut prepared = Prepared::new(&interpolation);
                Preparation::new(&interpolation)
                    .push(
                        &mut prepared,
                        &set,
                        whole_tracks(&set, 0..set.track_count()),
                    )
                    .unwrap();
                prepared
            });
            let (_, expected) = &results[0];
            for (width, found) in &results {
                assert!(
                    found.segments.as_bytes() == expected.segments.as_bytes()
                        && found.spans.starts == expected.spans.starts
                        && found.exact.len() == expected.exact.len(),
                    "{method}, {width:?}"
                );
            }
        }
    }
}
