//! Long tracks, which all threads share: stretches of their intervals, in memory that is
//! used again.

use std::ops::Range;

use glam::Quat;
use rayon::prelude::*;

use crate::cpu::engine::CpuEngine;
use crate::cpu::streaming::Output;
use crate::engine::Error;
use crate::from_keys::evaluate::{Sampled, Straight};
use crate::from_keys::fallback::Row;
use crate::method::interpolation::{Interpolation, Speed};
use crate::prepare::Prepared;
use crate::prepare::clip_data::PartRef;
use crate::prepare::set::{BATCH, Preparation};
use crate::time::frame_clock::FrameClock;
use crate::time::frames::{Ticks, Timeline};
use crate::time::key_samples::Stretch;
use crate::time::wrap::{Cycle, Sides};
use crate::tracks::set::TrackSet;

/// Intervals that one task takes, where nothing is prepared.
const STRETCH: usize = 16 * 1024;

/// Whether a track can be evaluated stretch by stretch: its samples are in order, and lie
/// between its keys or are held.
pub(crate) fn is_in_stretches(interpolation: &Interpolation, timeline: &Timeline) -> bool {
    matches!(timeline.ticks, Ticks::Frames { .. })
        && interpolation.sides() == Sides::default()
        && interpolation.speed == Speed::AsKeyed
}

/// The first sample of the piece that starts with an interval of a track that
/// [`is_in_stretches`].
pub(crate) fn first_sample(times: &[f64], timeline: &Timeline, interval: usize) -> usize {
    let Ticks::Frames { rate, start } = timeline.ticks else {
        return 0;
    };
    let end = (interval + BATCH).min(times.len() - 1);
    let clock = FrameClock::new(rate, start, times[end]);
    (clock.first_frame(times[interval]) as usize).min(timeline.len())
}

/// Some intervals of a track, and its samples among them.
struct Piece<'o> {
    intervals: Range<usize>,
    samples: Range<usize>,
    output: &'o mut [[f32; 4]],
}

impl CpuEngine {
    /// As [`CpuEngine::sampled`], for one track that all threads share: stretches
    /// of its intervals.
    pub(crate) fn sampled_track(
        &self,
        set: &TrackSet,
        index: usize,
        (interpolation, straight): (&Interpolation, Straight),
        timeline: &Timeline,
        output: &mut [Quat],
    ) -> Result<(), Error> {
        let mut output: &mut [[f32; 4]] = bytemuck::cast_slice_mut(output);
        let track = set.track(index);
        let (Ticks::Frames { rate, start }, 1..) = (&timeline.ticks, track.keys.len() - 1) else {
            let own = index..index + 1;
            return self.sampled(set, own, (interpolation, straight), timeline, output);
        };
        interpolation.ends.check(track.keys, index)?;
        let last = track.keys.len() - 1;
        let clock = FrameClock::new(*rate, *start, track.times[last]);
        let whole = Stretch::whole(set, index);
        let firsts: Vec<usize> = (0..last).step_by(STRETCH).collect();
        let last_of = |first: usize| (first + STRETCH).min(last);
        let new = || Sampled::new(interpolation, straight);
        let mut from = 0;
        let mut work = Vec::new();
        for (i, &first) in firsts.iter().enumerate() {
            let to = match firsts.get(i + 1) {
                Some(&next) => (clock.first_frame(track.times[next]) as usize).min(timeline.len()),
                None => timeline.len(),
            };
            let (own, others) = output.split_at_mut(to.max(from) - from);
            work.push((first, from..to.max(from), own));
            (output, from) = (others, to.max(from));
        }
        self.on_threads(|| {
            let all = work.into_par_iter();
            all.try_for_each_init(new, |sampled, (first, window, own)| {
                // Cubics look at the keys beside their own too.
                let beside = usize::from(matches!(straight, Straight::Cubics(_)));
                let start = first.saturating_sub(beside);
                let stretch = whole.between(start, (last_of(first) + beside).min(last));
                if sampled.stretch(stretch, clock, &window, own)? {
                    let row = Row {
                        first: window.start,
                        key: first,
                        ..Row::whole(set, index, interpolation, timeline)
                    };
                    self.mend(row, own)?;
                }
                Ok(())
            })
        })
    }

    /// One track that [`is_in_stretches`]: each is prepared, evaluated and forgotten.
    pub(crate) fn long_track(
        &self,
        set: &TrackSet,
        index: usize,
        interpolation: &Interpolation,
        timeline: &Timeline,
        output: &mut [Quat],
    ) -> Result<(), Error> {
        let mut output: &mut [[f32; 4]] = bytemuck::cast_slice_mut(output);
        let track = set.track(index);
        let intervals = track.keys.len() - 1;
        let mut pieces = Vec::new();
        let mut from = 0;
        for first in (0..intervals.max(1)).step_by(BATCH) {
            let end = (first + BATCH).min(intervals);
            let to = match end < intervals {
                true => first_sample(track.times, timeline, end).max(from),
                false => timeline.len(),
            };
            let (own, others) = output.split_at_mut(to - from);
            pieces.push(Piece {
                intervals: first..end,
                samples: from..to,
                output: own,
            });
            (output, from) = (others, to);
        }
        let new = || {
            let mut preparation = Preparation::new(interpolation);
            preparation.only_for(timeline, set);
            (Prepared::new(interpolation), preparation)
        };
        let evaluate = |(prepared, preparation): &mut (Prepared, Preparation),
                        piece: Piece<'_>|
         -> Result<(), Error> {
            prepared.clear();
            preparation.push(prepared, set, [(index, piece.intervals)])?;
            let part = PartRef {
                prepared,
                part: &prepared.parts[0],
            };
            let cycle = Cycle::own(piece.samples);
            Ok(self.part(part, timeline, &cycle, &mut Output::Here(piece.output))?)
        };
        self.on_threads(|| {
            let all = pieces.into_par_iter();
            all.try_for_each_init(new, evaluate)
        })
    }
}
