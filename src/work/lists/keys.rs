//! Division of sets with fewer samples than keys into dispatches for a Vulkan device, each for some tracks. The input
//! of a dispatch is: keys with their stored signs, the positions of the samples among them, and the tangent weights.

use std::iter::Peekable;
use std::ops::Range;
use std::vec::IntoIter;

use glam::Quat;
use rayon::prelude::*;

use crate::curve::options::{Ends, InterpolationError};
use crate::fit::tangent_weights::{TrackWeights, WeightRule};
use crate::from_keys::KeyCurve;
use crate::prepare::error::SetError;
use crate::prepare::preparation::{Batch, BatchSize, SetRequest, batches};
use crate::shader::{
    IS_KEY, KeySample, LINE, ROWS_PER_INVOCATION, RowShape, SIGN_NEGATED, TangentWeights,
};
use crate::threads::on_threads;
use crate::time::error::SampleTimesError;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::Ticks;
use crate::time::key_samples::FramePlan;
use crate::time::times::key_sample;
use crate::tracks::set::TrackSet;
use crate::tracks::track_keys::TrackKeys;

/// The maximum number of rows of one dispatch; every Vulkan device allows as many workgroups along y.
const ROWS: usize = 65_535;

/// Keys that one task writes.
const TASK_KEYS: usize = 16 * 1024;

/// The samples to evaluate.
pub(crate) struct KeyJob<'a> {
    pub(crate) request: &'a SetRequest<'a>,
    /// The curves of its samples.
    pub(crate) curve: KeyCurve,
}

impl<'a> KeyJob<'a> {
    /// The rule for the tangent weights of cubics; arcs have none.
    pub(crate) fn weights(&self) -> Option<WeightRule> {
        match self.curve {
            KeyCurve::Cubics(weights) => Some(weights),
            KeyCurve::Arcs | KeyCurve::TwoKeys => None,
        }
    }

    /// All keys of the set, if kernels can read them as they are stored. For cubics they cannot, because weights have
    /// the indices of a dispatch's keys.
    pub(crate) fn keys(&self) -> Option<&'a [Quat]> {
        self.weights().is_none().then_some(self.request.set.keys())
    }

    /// The clock of samples that are frames.
    pub(crate) fn clock(&self) -> Option<FrameClock> {
        match self.request.timeline.ticks {
            Ticks::Frames { rate, start } => Some(FrameClock::new(rate, start, false)),
            Ticks::Times { .. } => None,
        }
    }

    /// The keys of each track of a batch that its samples need.
    pub(crate) fn keys_of(&self, batch: &Batch) -> impl Iterator<Item = TrackKeys<'a>> {
        let (set, curve) = (self.request.set, self.curve);
        let tracks = batch.intervals(set);
        tracks.map(move |(index, intervals)| {
            TrackKeys::whole(set, index).around(&intervals, curve.beside())
        })
    }

    /// The dispatches of the job, which are consecutive in the result; `limit` is as in [`KeyDispatches::next`].
    /// Refuses invalid ends: a loop whose first and last rotation differ, or a clamped velocity that is too large.
    pub(crate) fn dispatches(
        &self,
        limit: usize,
    ) -> Result<KeyDispatches<'a, '_>, InterpolationError> {
        let SetRequest { set, timeline, .. } = *self.request;
        let interpolation = self.request.interpolation;
        interpolation.check()?;
        if interpolation.ends == Ends::Loop {
            for track in self.request.tracks.clone() {
                interpolation.check_track(set.times_and_keys(track).1, track)?;
            }
        }
        let in_frames = matches!(timeline.ticks, Ticks::Frames { .. });
        let size = BatchSize {
            keys: limit,
            tracks: limit / self.request.samples.len().max(1),
            cut: in_frames.then_some(TASK_KEYS.min(limit)),
        };
        let task_size = BatchSize {
            keys: TASK_KEYS,
            tracks: usize::MAX,
            cut: None,
        };
        let mut tasks = Vec::new();
        for batch in batches(set, self.request.batch_of_keys(), size) {
            let parts = match batch {
                Batch::Tracks(_) | Batch::Span { .. } => batches(set, batch, task_size),
                Batch::Intervals { .. } => vec![batch],
            };
            for batch in parts {
                let keys = match &batch {
                    Batch::Tracks(tracks) => set.keys_of(tracks.clone()),
                    Batch::Intervals { .. } | Batch::Span { .. } => {
                        self.keys_of(&batch).map(|track| track.keys.len()).sum()
                    }
                };
                let all = self.request.samples_of(&batch);
                tasks.extend(all.clone().step_by(limit).map(|first| KeyTask {
                    batch: batch.clone(),
                    samples: first..all.end.min(first + limit),
                    keys,
                }));
            }
        }
        Ok(KeyDispatches {
            job: self,
            tasks: tasks.into_iter().peekable(),
        })
    }
}

/// The part of a dispatch that one thread writes.
pub(crate) struct KeyTask {
    pub(crate) batch: Batch,
    /// The samples of each of its tracks: all, unless it has a single track.
    pub(crate) samples: Range<usize>,
    /// Keys of all its tracks.
    pub(crate) keys: usize,
}

impl KeyTask {
    /// Samples of all its tracks.
    pub(crate) fn sample_count(&self) -> usize {
        self.batch.tracks().len() * self.samples.len()
    }
}

/// The input of one dispatch.
pub(crate) struct KeyDispatch<'a, 'j> {
    pub(crate) job: &'j KeyJob<'a>,
    pub(crate) tasks: Vec<KeyTask>,
    /// The tracks that it has samples of.
    pub(crate) tracks: Range<usize>,
    /// Number of rows. Tracks that share their key times are a row each, because their samples have the same
    /// positions among their keys; other tracks together are one row.
    pub(crate) rows: usize,
    pub(crate) keys: usize,
    /// Samples of one row; the kernel gets the position of each among the keys.
    pub(crate) samples: usize,
}

/// The dispatches of a job.
pub(crate) struct KeyDispatches<'a, 'j> {
    job: &'j KeyJob<'a>,
    tasks: Peekable<IntoIter<KeyTask>>,
}

impl<'a, 'j> KeyDispatches<'a, 'j> {
    /// The next dispatch, of about `limit` keys and at most `limit` samples. If windows were halved after the tasks
    /// were made, one task may have more.
    pub(crate) fn next(&mut self, limit: usize) -> Option<KeyDispatch<'a, 'j>> {
        let SetRequest { set, timeline, .. } = *self.job.request;
        let (mut keys, mut samples) = (0, 0);
        let mut tasks: Vec<KeyTask> = Vec::new();
        while let Some(task) = self.tasks.next_if(|task| {
            let longest = (keys + task.keys).max(samples + task.sample_count());
            tasks.is_empty() || longest <= limit
        }) {
            keys += task.keys;
            samples += task.sample_count();
            tasks.push(task);
        }
        let tracks = tasks.first()?.batch.tracks().start..tasks.last()?.batch.tracks().end;
        let is_whole = |task: &KeyTask| {
            matches!(task.batch, Batch::Tracks(_)) && task.samples == self.job.request.samples
        };
        let times = |track| set.times_and_keys(track).0;
        let are_alike = matches!(timeline.ticks, Ticks::Frames { .. })
            && tracks.len() <= ROWS
            && tasks.iter().all(is_whole)
            && (tracks.clone()).all(|track| std::ptr::eq(times(tracks.start), times(track)));
        let rows = if are_alike { tracks.len() } else { 1 };
        Some(KeyDispatch {
            job: self.job,
            tasks,
            tracks,
            rows,
            keys,
            samples: samples / rows,
        })
    }
}

impl KeyDispatch<'_, '_> {
    /// The shape of its rows. With `maps_samples`, an invocation evaluates one sample, and neighbours start to store
    /// at the start of a memory line.
    pub(crate) fn rows(&self, maps_samples: bool) -> RowShape {
        let (each, line) = match maps_samples {
            true => (1, LINE - 1),
            false => (ROWS_PER_INVOCATION, 0),
        };
        RowShape {
            each,
            line,
            samples: self.samples as u32,
            keys: (self.keys / self.rows) as u32,
            count: self.rows as u32,
        }
    }

    /// Number of rotations of its result.
    pub(crate) fn rotation_count(&self) -> usize {
        self.samples * self.rows
    }

    /// Bytes of its keys, the samples and the weights.
    pub(crate) fn bytes(&self) -> [usize; 3] {
        let weights = match self.job.weights() {
            Some(_) => self.keys / self.rows,
            None => 0,
        };
        [
            self.keys * size_of::<Quat>(),
            self.samples * size_of::<KeySample>(),
            weights * size_of::<TangentWeights>(),
        ]
    }

    /// Whether no key of its tracks is negated: a kernel may then read the keys as they are stored.
    pub(crate) fn has_no_negated_key(&self) -> bool {
        let mut tracks = self.tracks.clone();
        !tracks.any(|track| self.job.request.set.signs(track).any())
    }

    /// Writes the kernel's input. Keys that are read in imported memory (as they are stored, if none is negated) are
    /// not written; `imported` is the index of the set's first key there.
    pub(crate) fn write(
        &self,
        imported: Option<usize>,
        mut keys: &mut [[u32; 4]],
        mut samples: &mut [KeySample],
        mut weights: &mut [TangentWeights],
    ) -> Result<(), SetError> {
        let mut next_key = 0;
        let mut outputs = Vec::with_capacity(self.tasks.len());
        for task in &self.tasks {
            // Several rows share the samples and weights of the first row, which the first task writes.
            let (sample_count, weight_count) = match self.rows {
                1 => (task.sample_count(), task.keys),
                _ => (samples.len(), weights.len()),
            };
            let written = TaskBuffers {
                keys: take_first(&mut keys, task.keys),
                samples: take_first(&mut samples, sample_count),
                weights: take_first(&mut weights, weight_count),
                next_key,
                imported,
            };
            outputs.push((task, written));
            next_key += task.keys;
        }
        let request = self.job.request;
        let rule = self.job.weights();
        let new = || Known {
            frames: FramePlan::new(),
            weights: rule.map(|rule| TrackWeights::new(rule, request.interpolation.ends)),
        };
        let written = on_threads(|| {
            outputs
                .into_par_iter()
                .try_for_each_init(new, |known, (task, mut written)| {
                    if let Ticks::Times { times, stride } = &request.timeline.ticks {
                        self.write_times(task, times, *stride, &mut written);
                        if imported.is_some() {
                            return Ok(());
                        }
                    }
                    let mut tracks = self.job.keys_of(&task.batch);
                    tracks.try_for_each(|keys| self.write_track(keys, task, known, &mut written))
                })
        });
        Ok(written??)
    }

    /// Writes keys and weights of a track, and the positions of frames among the keys.
    fn write_track<'p>(
        &self,
        track: TrackKeys<'p>,
        task: &KeyTask,
        known: &mut Known<'p>,
        written: &mut TaskBuffers<'_>,
    ) -> Result<(), SampleTimesError> {
        let keys: &[[u32; 4]] = bytemuck::cast_slice(track.keys);
        let first_key = written.key_index(self.job.request.set, track.index, track.first_key);
        if written.imported.is_none() {
            let written_keys = take_first(&mut written.keys, keys.len());
            if track.signs.any() {
                // Each key is written whole and in order, and never read: this memory may be
                // write-combined (docs/gpu-memory.md).
                for (i, (to, &[x, y, z, w])) in written_keys.iter_mut().zip(keys).enumerate() {
                    let sign = SIGN_NEGATED * u32::from(track.signs.is_negated(i));
                    *to = [x | sign, y, z, w];
                }
            } else {
                written_keys.copy_from_slice(keys);
            }
        }
        if !written.samples.is_empty()
            && let Some(clock) = self.job.clock()
        {
            let written_samples = take_first(&mut written.samples, task.samples.len());
            let (found, _) = known.frames.samples(track, clock, &task.samples)?;
            for (to, sample) in written_samples.iter_mut().zip(found) {
                *to = KeySample {
                    key: sample.key + first_key,
                    ..*sample
                };
            }
        }
        if let (Some(weights), false) = (&mut known.weights, written.weights.is_empty()) {
            let written_weights = take_first(&mut written.weights, keys.len());
            written_weights.copy_from_slice(weights.weights_of(
                track.times,
                track.first_key,
                track.track_key_count,
            ));
        }
        written.next_key += keys.len();
        Ok(())
    }

    /// Writes the positions of explicit times among the keys, which are as in [`Ticks::Times`]. This is a separate
    /// loop, because a crowd has many tracks with one sample each.
    fn write_times(
        &self,
        task: &KeyTask,
        times: &[f64],
        stride: usize,
        written: &mut TaskBuffers<'_>,
    ) {
        let (set, tracks) = (self.job.request.set, task.batch.tracks());
        let mut first_key = written.key_index(set, tracks.start, 0);
        let mut samples = std::mem::take(&mut written.samples).iter_mut();
        for index in tracks {
            let (starts, keys) = set.times_and_keys(index);
            let mut near = 0;
            let track_times = &times[index * stride..][task.samples.clone()];
            for (&time, to) in track_times.iter().zip(&mut samples) {
                let sample = key_sample(starts, time, near);
                near = (sample.key & !IS_KEY) as usize;
                *to = KeySample {
                    key: sample.key + first_key,
                    ..sample
                };
            }
            first_key += keys.len() as u32;
        }
    }
}

/// Takes the first elements out of a slice, or as many as there are.
fn take_first<'w, T>(slice: &mut &'w mut [T], count: usize) -> &'w mut [T] {
    let count = count.min(slice.len());
    slice.split_off_mut(..count).unwrap_or_default()
}

/// Results that a thread keeps for the next track.
struct Known<'p> {
    frames: FramePlan<'p>,
    /// The tangent weights of cubics.
    weights: Option<TrackWeights<'p>>,
}

/// The remaining output of a task.
struct TaskBuffers<'w> {
    keys: &'w mut [[u32; 4]],
    samples: &'w mut [KeySample],
    weights: &'w mut [TangentWeights],
    /// The index of the next key among the dispatch's.
    next_key: usize,
    /// The index of the set's first key in imported memory, if keys are read there.
    imported: Option<usize>,
}

impl TaskBuffers<'_> {
    /// The index of a track's key; it is the next index if keys are copied.
    fn key_index(&self, set: &TrackSet, track: usize, key: usize) -> u32 {
        self.imported
            .map_or(self.next_key, |first| first + set.keys_of(0..track) + key) as u32
    }
}
