//! What a kernel reads of a dispatch: keys with their signs, the places of the samples among them,
//! and tangent weights.

use glam::Quat;
use rayon::prelude::*;

use crate::fit::tangent_weights::TrackWeights;
use crate::from_keys::dispatches::{KeyDispatch, Task};
use crate::prepare::error::SetError;
use crate::shader::{
    IS_KEY, KeySample, LINE, ROWS_PER_INVOCATION, RowShape, SIGN_TURNED, TangentWeights,
};
use crate::threads::on_threads;
use crate::time::frames::{FramesError, Ticks};
use crate::time::key_samples::FramePlan;
use crate::time::times::key_sample;
use crate::tracks::set::TrackSet;
use crate::tracks::track_keys::TrackKeys;

impl KeyDispatch<'_, '_> {
    /// Its rows; with `maps_samples` an invocation takes a sample of one, and neighbours begin to
    /// store where a line of memory does.
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

    /// Whether none of its tracks' keys is turned: a kernel may then read them as they were given.
    pub(crate) fn keys_are_as_given(&self) -> bool {
        !self.job.request.set.signs_of(self.tracks.clone()).any()
    }

    /// Writes what the kernel reads. Keys that it reads in imported memory, as they are stored and none
    /// of them turned, are not written; `imported` is the place of the set's first key there.
    pub(crate) fn write(
        &self,
        imported: Option<usize>,
        mut keys: &mut [[u32; 4]],
        mut samples: &mut [KeySample],
        mut weights: &mut [TangentWeights],
    ) -> Result<(), SetError> {
        let mut next_key = 0;
        let mut places = Vec::with_capacity(self.tasks.len());
        for task in &self.tasks {
            // Several rows share the samples and weights of the first, which the first task
            // writes.
            let (own_samples, own_weights) = match self.rows {
                1 => (task.sample_count(), task.keys),
                _ => (samples.len(), weights.len()),
            };
            let written = Written {
                keys: take_first(&mut keys, task.keys),
                samples: take_first(&mut samples, own_samples),
                weights: take_first(&mut weights, own_weights),
                next_key,
                imported,
            };
            places.push((task, written));
            next_key += task.keys;
        }
        let request = self.job.request;
        let rule = self.job.weights();
        let new = || Known {
            frames: FramePlan::new(),
            weights: rule.map(|rule| TrackWeights::new(rule, request.interpolation.ends)),
        };
        let written = on_threads(|| {
            places
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

    /// Writes keys and weights of a track, and the places of frames.
    fn write_track<'p>(
        &self,
        track: TrackKeys<'p>,
        task: &Task,
        known: &mut Known<'p>,
        written: &mut Written<'_>,
    ) -> Result<(), FramesError> {
        let keys: &[[u32; 4]] = bytemuck::cast_slice(track.keys);
        let place = written.place_of(self.job.request.set, track.index, track.first_key);
        if written.imported.is_none() {
            let own = take_first(&mut written.keys, keys.len());
            if track.signs.any() {
                // Whole keys, in order: what is written to may be slow to read.
                for (i, (to, &[x, y, z, w])) in own.iter_mut().zip(keys).enumerate() {
                    let turned = SIGN_TURNED * u32::from(track.signs.is_turned(i));
                    *to = [x | turned, y, z, w];
                }
            } else {
                own.copy_from_slice(keys);
            }
        }
        if !written.samples.is_empty()
            && let Some(clock) = self.job.clock()
        {
            let own = take_first(&mut written.samples, task.samples.len());
            let found = known.frames.samples(track, clock, &task.samples)?;
            for (to, sample) in own.iter_mut().zip(found) {
                *to = KeySample {
                    key: sample.key + place,
                    ..*sample
                };
            }
        }
        if let (Some(weights), false) = (&mut known.weights, written.weights.is_empty()) {
            let own = take_first(&mut written.weights, keys.len());
            own.copy_from_slice(weights.of(track.times, track.first_key, track.all));
        }
        written.next_key += keys.len();
        Ok(())
    }

    /// Writes the places of explicit times, which are as in [`Ticks::Times`]. This is a loop of its own,
    /// because a crowd has many tracks with one sample each.
    fn write_times(&self, task: &Task, times: &[f64], stride: usize, written: &mut Written<'_>) {
        let (set, tracks) = (self.job.request.set, task.batch.tracks());
        let mut first_key = written.place_of(set, tracks.start, 0);
        let mut samples = std::mem::take(&mut written.samples).iter_mut();
        for index in tracks {
            let (starts, keys) = set.times_and_keys(index);
            let mut near = 0;
            let own = &times[index * stride..][task.samples.clone()];
            for (&time, to) in own.iter().zip(&mut samples) {
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

/// What a task has still to write.
struct Written<'w> {
    keys: &'w mut [[u32; 4]],
    samples: &'w mut [KeySample],
    weights: &'w mut [TangentWeights],
    /// The place of the next key among the dispatch's.
    next_key: usize,
    /// The place of the set's first key in imported memory, where keys are read from there.
    imported: Option<usize>,
}

impl Written<'_> {
    /// The place of a track's key, which is the next one where keys are copied.
    fn place_of(&self, set: &TrackSet, track: usize, key: usize) -> u32 {
        self.imported
            .map_or(self.next_key, |first| first + set.keys_of(0..track) + key) as u32
    }
}
