//! Whole sets: tracks in batches, shared among the threads.

use std::ops::Range;

use rayon::prelude::*;

use super::Prepared;
use super::arcs::{self, ArcPreparation};
use crate::method::{Ends, Form, Interpolation, InterpolationError, Keys};
use crate::tracks::{Track, TrackSet};

/// Key intervals prepared as one piece of work.
const BATCH: usize = 4096;

/// Prepares every track of a set, in parallel: one [`Prepared`] for each batch of
/// tracks, or of intervals where a track is long, in order.
pub(super) fn prepare(
    set: &TrackSet,
    interpolation: &Interpolation,
) -> Result<Vec<Prepared>, InterpolationError> {
    let batches: Vec<Vec<Prepared>> = batches(set)
        .into_par_iter()
        .map(|tracks| {
            let mut prepared = Prepared::new(interpolation);
            if let Some(long) = tracks.clone().next().filter(|_| tracks.len() == 1) {
                return prepare_long(set, long, interpolation);
            }
            Preparation::new(interpolation).push(&mut prepared, set, tracks)?;
            Ok(vec![prepared])
        })
        .collect::<Result<_, _>>()?;
    Ok(batches.into_iter().flatten().collect())
}

/// Ranges of tracks with about [`BATCH`] intervals each.
fn batches(set: &TrackSet) -> Vec<Range<usize>> {
    let mut batches = Vec::new();
    let (mut start, mut intervals) = (0, 0);
    for (index, track) in set.tracks().enumerate() {
        intervals += track.keys.len();
        if intervals >= BATCH || index + 1 == set.track_count() {
            batches.push(start..index + 1);
            (start, intervals) = (index + 1, 0);
        }
    }
    batches
}

fn prepare_long(
    set: &TrackSet,
    index: usize,
    interpolation: &Interpolation,
) -> Result<Vec<Prepared>, InterpolationError> {
    let track = set.track(index);
    if has_arc_lanes(interpolation) {
        return long_arcs(track, index, interpolation);
    }
    let keys = Keys::new(track, index, interpolation)?;
    let parts = keys.intervals().div_ceil(BATCH).max(1);
    let part = |i: usize| {
        let intervals = i * BATCH..((i + 1) * BATCH).min(keys.intervals());
        let mut prepared = Prepared::new(interpolation);
        prepared.push(track, index, &keys, intervals, interpolation);
        prepared
    };
    Ok((0..parts).into_par_iter().map(part).collect())
}

/// Whether arcs are prepared in lanes, straight from the keys: the great circles
/// between neighbours. Loops have their seam checked on the way of the cubics.
fn has_arc_lanes(interpolation: &Interpolation) -> bool {
    interpolation.method.form == Form::Arc && !matches!(interpolation.ends, Ends::Loop)
}

fn long_arcs(
    track: Track,
    index: usize,
    interpolation: &Interpolation,
) -> Result<Vec<Prepared>, InterpolationError> {
    let intervals = track.keys.len() - 1;
    let pieces = intervals.div_ceil(BATCH).max(1);
    let piece = |i: usize| {
        let own = i * BATCH..((i + 1) * BATCH).min(intervals);
        let mut prepared = Prepared::new(interpolation);
        let mut arcs = ArcPreparation::new(interpolation);
        let sign = arcs.push_piece(&mut prepared, track, index, own)?;
        Ok((prepared, sign))
    };
    let pieces: Vec<(Prepared, f32)> = (0..pieces)
        .into_par_iter()
        .map(piece)
        .collect::<Result<_, _>>()?;
    let mut sign = 1.0;
    let with_sign = |(mut prepared, own): (Prepared, f32)| {
        if sign < 0.0 {
            arcs::negate(&mut prepared.segments);
        }
        sign *= own;
        prepared
    };
    Ok(pieces.into_iter().map(with_sign).collect())
}

/// Prepares whole tracks, with memory that serves many.
pub(crate) struct Preparation<'a> {
    interpolation: &'a Interpolation,
    arcs: Option<Box<ArcPreparation>>,
}

impl<'a> Preparation<'a> {
    pub(crate) fn new(interpolation: &'a Interpolation) -> Self {
        let arcs = || Box::new(ArcPreparation::new(interpolation));
        Self {
            interpolation,
            arcs: has_arc_lanes(interpolation).then(arcs),
        }
    }

    /// Prepares some tracks of a set, one part for each.
    pub(crate) fn push(
        &mut self,
        prepared: &mut Prepared,
        set: &TrackSet,
        tracks: Range<usize>,
    ) -> Result<(), InterpolationError> {
        if let Some(arcs) = &mut self.arcs {
            return arcs.push(prepared, set, tracks);
        }
        for index in tracks {
            let track = set.track(index);
            let keys = Keys::new(track, index, self.interpolation)?;
            prepared.push(track, index, &keys, 0..keys.intervals(), self.interpolation);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::method::METHODS;

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
                .push(&mut whole, &set, 0..1)
                .unwrap();
            let pieces = prepare(&set, &interpolation).unwrap();
            assert!(pieces.len() > 3, "{method}");
            let mut together = Prepared::new(&interpolation);
            pieces.into_iter().for_each(|piece| together.append(piece));
            assert_eq!(
                whole.segments.as_bytes(),
                together.segments.as_bytes(),
                "{method}"
            );
            assert_eq!(whole.spans.extents, together.spans.extents, "{method}");
            assert_eq!(whole.spans.starts, together.spans.starts, "{method}");
        }
    }
}
