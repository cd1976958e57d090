//! Sparse samples of long tracks: only the key intervals that have a sample are prepared.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use crate::cpu::engine::CpuEngine;
use crate::cpu::streaming::RowOutput;
use crate::output::encoded::EncodedOutput;
use crate::prepare::error::SetError;
use crate::prepare::preparation::{PART_INTERVALS, Preparation, SetRequest};
use crate::threads::stop;
use crate::time::frame_clock::{FrameClock, TrackCopy};
use crate::time::frames::{Ticks, Timeline};
use crate::time::times::interval_at;

/// The number of samples of one task: enough to fill the blocks of intervals that are prepared in lanes.
const TASK_SAMPLES: usize = 512;

/// Two intervals with samples and at most this many other intervals between them are prepared together.
pub(crate) const APART: usize = 2;

/// Consecutive samples, and the key intervals of a track that contain them.
pub(crate) struct Group {
    pub(crate) intervals: Range<usize>,
    pub(crate) samples: Range<usize>,
}

/// The samples of a track in order of time, and the groups that they form.
struct Sorted {
    timeline: Timeline,
    /// The index in the timeline of the row's first sample.
    first: usize,
    /// The index in the row of each sample; `None` if the samples are in the request's order.
    request_indices: Option<Vec<u32>>,
    groups: Vec<Group>,
}

impl CpuEngine {
    /// Evaluates some tracks, `[track][sample]`. Frames at a rate must not lie in copies of a track.
    pub(crate) fn evaluate_sparse(
        &self,
        request: &SetRequest<'_>,
        mut output: EncodedOutput<'_>,
    ) -> Result<(), SetError> {
        let samples = request.samples.len();
        if output.len() == 0 {
            return Ok(());
        }
        let each = (TASK_SAMPLES / samples).max(1);
        let stop = stop::current();
        let task = |(tracks, output): (Range<usize>, EncodedOutput<'_>)| {
            stop::during(stop.clone(), || {
                output.fill(|output| self.evaluate_sparse_tracks(request, tracks, output))
            })
        };
        if request.tracks.len() <= each {
            return task((request.tracks.clone(), output));
        }
        let tasks: Vec<_> = (request.tracks.clone().step_by(each))
            .map(|first| first..(first + each).min(request.tracks.end))
            .map(|tracks| (tracks.clone(), output.split_off(tracks.len() * samples)))
            .collect();
        self.on_threads(|| tasks.into_par_iter().try_for_each(task))?
    }

    /// Evaluates the samples of some of the request's tracks.
    fn evaluate_sparse_tracks(
        &self,
        request: &SetRequest<'_>,
        tracks: Range<usize>,
        output: &mut [[f32; 4]],
    ) -> Result<(), SetError> {
        stop::check()?;
        let samples = request.samples.len();
        // Tracks with the same key times and sample times also have the same groups.
        let mut sorted: Vec<(usize, Sorted)> = Vec::new();
        let shares = !matches!(request.timeline.ticks, Ticks::Times { stride: 1.., .. });
        let mut of_track = Vec::with_capacity(tracks.len());
        for track in tracks.clone() {
            let (times, keys) = request.set.times_and_keys(track);
            // Keys without a sample are checked too, as on every other route.
            Preparation::check_track(request.interpolation, keys, track)?;
            let is_known = |(known, _): &(usize, Sorted)| {
                let (others, _) = request.set.times_and_keys(*known);
                shares && std::ptr::eq(times, others)
            };
            if !sorted.last().is_some_and(is_known) {
                sorted.push((track, Sorted::new(request, track)?));
            }
            of_track.push(sorted.len() - 1);
        }
        let mut memory = self.scratch_pool.take(request);
        let groups_of = |row: usize| sorted[of_track[row]].1.groups.iter();
        let intervals = tracks.clone().enumerate().flat_map(|(row, track)| {
            groups_of(row).map(move |group| (track, group.intervals.clone()))
        });
        memory.prepare(request.set, intervals)?;
        let mut parts = memory.parts();
        let mut in_order = vec![[0.0; 4]; samples];
        for (i, output) in output.chunks_exact_mut(samples).enumerate() {
            let sorted = &sorted[of_track[i]].1;
            let row: &mut [[f32; 4]] = match sorted.request_indices {
                Some(_) => &mut in_order,
                None => &mut *output,
            };
            for (group, part) in sorted.groups.iter().zip(parts.by_ref()) {
                let copy = TrackCopy::of_track(group.samples.clone());
                let in_row = group.samples.start - sorted.first..group.samples.end - sorted.first;
                let values = &mut RowOutput::Here(&mut row[in_row]);
                self.part(part, &sorted.timeline, &copy, values)?;
            }
            if let Some(indices) = &sorted.request_indices {
                for (&index, &value) in indices.iter().zip(&in_order) {
                    output[index as usize] = value;
                }
            }
        }
        drop(parts);
        self.scratch_pool.give_back(memory);
        Ok(())
    }
}

impl Sorted {
    fn new(request: &SetRequest<'_>, track: usize) -> Result<Self, SetError> {
        let timeline = request.timeline;
        let samples = request.samples.clone();
        let Ticks::Times { .. } = timeline.ticks else {
            return Ok(Self {
                groups: intervals_of_frames(request, track, 0, samples),
                timeline: timeline.clone(),
                first: request.samples.start,
                request_indices: None,
            });
        };
        let (times, _) = request.set.times_and_keys(track);
        let last = times.len() - 1;
        let wrap = request.interpolation.wrap();
        let time_of = |sample: usize| {
            let time = timeline.time_at(track, sample);
            match wrap.repeats() {
                true => wrap.folded((times[0], times[last]), time),
                false => time,
            }
        };
        let mut order: Vec<(f64, u32)> = samples
            .zip(0..)
            .map(|(sample, index)| (time_of(sample), index))
            .collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mut groups: Vec<Group> = Vec::new();
        let mut near = 0;
        for (sample, &(time, _)) in order.iter().enumerate() {
            near = interval_at(times, time, near);
            let interval = near.min(last.saturating_sub(1));
            Group::put(&mut groups, interval, last, sample);
        }
        let sorted = Arc::new(order.iter().map(|&(time, _)| time).collect());
        Ok(Self {
            timeline: Timeline::at(sorted),
            first: 0,
            request_indices: Some(order.into_iter().map(|(_, sample)| sample).collect()),
            groups,
        })
    }
}

impl Group {
    /// Adds the next sample, which is in an interval of a track whose last key is `last`, to the last group or to a
    /// new one.
    pub(crate) fn put(groups: &mut Vec<Self>, interval: usize, last: usize, sample: usize) {
        match groups.last_mut() {
            Some(Self { intervals, samples })
                if interval <= intervals.end + APART && intervals.len() < PART_INTERVALS =>
            {
                intervals.end = (interval + 1).clamp(intervals.end, last);
                samples.end = sample + 1;
            }
            _ => groups.push(Self {
                intervals: interval..(interval + 1).min(last),
                samples: sample..sample + 1,
            }),
        }
    }
}

/// The intervals of a track that contain frames at a rate, in increasing order. `key` is the index of a key at or
/// before all frames that are between keys.
pub(crate) fn intervals_of_frames(
    request: &SetRequest<'_>,
    track: usize,
    key: usize,
    samples: impl Iterator<Item = usize>,
) -> Vec<Group> {
    let (times, _) = request.set.times_and_keys(track);
    let last = times.len() - 1;
    let mut all = Vec::new();
    let Ticks::Frames { rate, start } = request.timeline.ticks else {
        return all; // explicit times have other groups
    };
    let clock = FrameClock::new(rate, start, request.interpolation.steps());
    for sample in samples {
        let time = request.timeline.time_at(track, sample);
        let after = times.partition_point(|&key| key <= time);
        let last_interval = last.saturating_sub(1);
        let mut interval = after
            .saturating_sub(1)
            .clamp(key.min(last_interval), last_interval);
        // A sample within rounding of a key is that key.
        while interval + 1 < last && clock.first_frame(times[interval + 1]) <= sample as f64 {
            interval += 1;
        }
        while interval > key && clock.first_frame(times[interval]) > sample as f64 {
            interval -= 1;
        }
        Group::put(&mut all, interval, last, sample);
    }
    all
}
