//! Prepares tracks as their method says: key intervals become segments.

use std::ops::Range;

use glam::Quat;

use crate::curve::options::{InterpolationError, Quantity};
use crate::method::CurveKind;
use crate::method::interpolation::Interpolation;
use crate::prepare::arcs::ArcPreparation;
use crate::prepare::error::SetError;
use crate::prepare::prepared::Prepared;
use crate::prepare::smooth::SmoothPreparation;
use crate::threads::stop;
use crate::time::frames::{Ticks, Timeline};
use crate::time::runs::NONE;
use crate::time::spans::SpanSource;
use crate::tracks::set::TrackSet;

/// Prepares tracks by an interpolation; its memory is reused.
pub(crate) struct Preparation {
    interpolation: Interpolation,
    strategy: Strategy,
}

/// How intervals become segments: in blocks with intervals of several tracks, except for steps,
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

    /// Refuses a set whose tracks cannot be interpolated so.
    pub(crate) fn check(
        interpolation: &Interpolation,
        set: &TrackSet,
    ) -> Result<(), InterpolationError> {
        (0..set.track_count()).try_for_each(|track| {
            let (_, keys) = set.times_and_keys(track);
            Self::check_track(interpolation, keys, track)
        })
    }

    /// Refuses keys of the `track`th track that cannot be interpolated so, wherever they lie.
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

    /// Whether an option chooses the path between keys. Steps have no path, and a method that fixes the path also
    /// defines the curve between opposite keys.
    fn has_path(interpolation: &Interpolation) -> bool {
        !interpolation.steps() && interpolation.method.signs.is_none()
    }

    /// From now on intervals without a sample of this timeline may be left out, which is done if
    /// the timeline has fewer samples than tracks have keys on average. The segments then serve no
    /// other timeline.
    pub(crate) fn only_for(&mut self, timeline: &Timeline, set: &TrackSet) {
        let keys = set.key_count() / set.track_count().max(1);
        if let Strategy::Smooth(smooth) = &mut self.strategy {
            smooth.frames = match timeline.ticks {
                Ticks::Frames { rate, start } if timeline.len() < keys => Some((rate, start)),
                _ => None,
            };
        }
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
        // Work that was stopped leaves something that must not be used.
        Ok(stop::check()?)
    }
}

/// Adds some intervals of the `index`th track of a set, whose keys are held until the next key, as a
/// part of their own: every sample is a constant.
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
