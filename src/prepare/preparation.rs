//! Prepares tracks in the way of their method: key intervals become segments.

use std::ops::Range;

use glam::Quat;

use crate::curve::options::{InterpolationError, Quantity};
use crate::method::Curves;
use crate::method::interpolation::Interpolation;
use crate::prepare::arcs::ArcPreparation;
use crate::prepare::prepared::Prepared;
use crate::prepare::smooth::SmoothPreparation;
use crate::time::frames::{Ticks, Timeline};
use crate::time::spans::{NONE, Source};
use crate::tracks::set::TrackSet;

/// Prepares tracks by an interpolation; its memory is reused.
pub(crate) struct Preparation {
    interpolation: Interpolation,
    way: Way,
}

/// How intervals become segments: in blocks that may hold intervals of several tracks, but for
/// steps, which have no segments.
enum Way {
    Steps,
    Arcs(Box<ArcPreparation>),
    Smooth(Box<SmoothPreparation>),
}

impl Preparation {
    pub(crate) fn new(interpolation: &Interpolation) -> Self {
        let way = match *interpolation.method.curves {
            Curves::Steps => Way::Steps,
            Curves::Arcs(_) if !interpolation.is_by_formula() => {
                Way::Arcs(Box::new(ArcPreparation::new(interpolation.path)))
            }
            Curves::Arcs(smooth) | Curves::Smooth(smooth) => {
                Way::Smooth(Box::new(SmoothPreparation::new(interpolation, smooth)))
            }
        };
        Self {
            interpolation: *interpolation,
            way,
        }
    }

    /// From now on intervals without a sample of this timeline may be left out, which is done if
    /// the timeline has fewer samples than tracks have keys on average. The segments then serve no
    /// other timeline.
    pub(crate) fn only_for(&mut self, timeline: &Timeline, set: &TrackSet) {
        let keys = set.key_count() / set.track_count().max(1);
        if let Way::Smooth(smooth) = &mut self.way {
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
    ) -> Result<(), InterpolationError> {
        let Self { interpolation, way } = self;
        // Steps have no path, and a method with a path of its own also defines the curve between
        // opposite keys.
        let has_path = !matches!(way, Way::Steps) && interpolation.method.path.is_none();
        for (track, own) in intervals {
            let (_, keys) = set.times_and_keys(track);
            interpolation.ends.check(keys, track)?;
            if has_path {
                interpolation.path.check(keys, own.clone(), track)?;
            }
            match way {
                Way::Steps => add_steps(prepared, set, track, own, interpolation.quantity),
                Way::Arcs(arcs) => arcs.add(prepared, set, track, own),
                Way::Smooth(smooth) => smooth.add(prepared, set, track, own),
            }
        }
        match way {
            Way::Steps => {}
            Way::Arcs(arcs) => arcs.finish(prepared),
            Way::Smooth(smooth) => smooth.finish(prepared),
        }
        Ok(())
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
        prepared.push_span(times[i], Source::Constant(constant), NONE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::METHODS;
    use crate::prepare::batch::{Batch, PART_INTERVALS};
    use crate::prepare::clip_data::{ClipData, Wanted};
    use crate::simd::dispatch::tests::same_at_every_width;

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

    /// Catches a part of a track that ignores the signs of the keys before it, and lanes that mix
    /// up tracks.
    #[test]
    fn a_track_in_pieces_is_prepared_like_a_whole_one() {
        let count = 3 * PART_INTERVALS + 17;
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
                .push(&mut whole, &set, Batch::Tracks(0..1).intervals(&set))
                .unwrap();
            let pieces = (ClipData::new(&set, interpolation, Wanted::all(&set)).unwrap()).groups;
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
            let mut keys: Vec<Quat> = (0..23)
                .map(|i| {
                    let turn = step * (i as f32 + (i as f32).sin());
                    Quat::from_rotation_y(turn) * Quat::from_rotation_x(0.3 * turn.cos())
                })
                .collect();
            if track == 13 {
                keys[7] = keys[6]; // no plane
                keys[9] = Quat::IDENTITY; // half a turn to the next
                keys[10] = Quat::from_xyzw(1.0, 0.0, 0.0, 0.0);
            }
            set.push("", &times, &keys).unwrap();
        }
        for method in METHODS {
            same_at_every_width(|| {
                let interpolation = method.into();
                let mut prepared = Prepared::new(&interpolation);
                let all = Batch::Tracks(0..set.track_count());
                Preparation::new(&interpolation)
                    .push(&mut prepared, &set, all.intervals(&set))
                    .unwrap();
                let bytes = prepared.segments.as_bytes().to_vec();
                (bytes, prepared.spans.starts, prepared.exact.len())
            });
        }
    }
}
