//! What a kernel reads of a dispatch: keys with their signs, the places of the samples among them,
//! and tangent weights.

use std::ops::Range;

use glam::Quat;
use rayon::prelude::*;

use crate::fit::tangent_weights::TrackWeights;
use crate::from_keys::dispatches::{KeyDispatch, KeyWindow, What};
use crate::shader::{
    IS_KEY, KeySample, LINE, ROWS_PER_INVOCATION, RowShape, SIGN_TURNED, TangentWeights,
};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::{FramesError, Ticks};
use crate::time::key_samples::FramePlan;
use crate::time::times::{TimeLanes, key_before};
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

    /// Bytes of its keys, the samples, the rotations and the weights.
    pub(crate) fn bytes(&self) -> [usize; 4] {
        let weights = match self.job.weights() {
            Some(_) => self.keys / self.rows,
            None => 0,
        };
        [
            self.keys * size_of::<Quat>(),
            self.samples * size_of::<KeySample>(),
            self.rotation_count() * size_of::<Quat>(),
            weights * size_of::<TangentWeights>(),
        ]
    }

    /// Whether none of its keys is turned: a kernel may then read them as they were given.
    pub(crate) fn keys_are_as_given(&self) -> bool {
        self.tasks.iter().all(|task| {
            let signs = match &task.what {
                What::Tracks(tracks) => self.job.request.set.signs_of(tracks.clone()),
                What::Window(window) => window.keys.signs,
            };
            !signs.any()
        })
    }

    /// Writes what the kernel reads.
    pub(crate) fn write(
        &self,
        keys: Keys<'_>,
        mut samples: &mut [KeySample],
        mut weights: &mut [TangentWeights],
    ) -> Result<(), FramesError> {
        let (mut keys, imported) = match keys {
            Keys::Copied(keys) => (keys, None),
            Keys::ImportedMemory(first) => (&mut [][..], Some(first)),
        };
        let mut first_key = 0;
        let mut places = Vec::with_capacity(self.tasks.len());
        for task in &self.tasks {
            // Several rows share the samples and weights of the first, which the first task
            // writes.
            let (told, joined) = match self.rows {
                1 => (task.samples, task.keys.min(weights.len())),
                _ => (samples.len(), weights.len()),
            };
            let (own_keys, other_keys) = keys.split_at_mut(task.keys.min(keys.len()));
            let (own_samples, other_samples) = samples.split_at_mut(told);
            let (own_tangent_weights, other_tangent_weights) = weights.split_at_mut(joined);
            (keys, samples, weights) = (other_keys, other_samples, other_tangent_weights);
            let written = Written {
                keys: own_keys,
                samples: own_samples,
                weights: own_tangent_weights,
                next_key: first_key,
                imported,
            };
            places.push((task, written));
            first_key += task.keys;
        }
        let ends = self.job.request.interpolation.ends;
        let rule = self.job.weights();
        let new = || Known {
            frames: FramePlan::new(),
            weights: rule.map(|rule| TrackWeights::new(rule, ends)),
        };
        places
            .into_par_iter()
            .try_for_each_init(new, |known, (task, mut written)| {
                let tracks = match &task.what {
                    What::Window(window) => return self.write_window(window, known, &mut written),
                    What::Tracks(tracks) => tracks.clone(),
                };
                if let Ticks::Times { times, stride } = &self.job.request.timeline.ticks {
                    let mut of_tracks = TimesOfTracks {
                        set: self.job.request.set,
                        tracks: tracks.clone(),
                        times,
                        stride: *stride,
                        each: self.job.request.timeline.len(),
                        first_key: written.place_of(self.job.request.set, tracks.start, 0),
                        samples: std::mem::take(&mut written.samples),
                    };
                    in_lanes(&mut of_tracks);
                    if written.imported.is_some() {
                        return Ok(());
                    }
                }
                tracks.into_iter().try_for_each(|index| {
                    self.write_window(&self.job.track(index), known, &mut written)
                })
            })
    }

    fn write_window<'p>(
        &self,
        window: &KeyWindow<'p>,
        known: &mut Known<'p>,
        written: &mut Written<'_>,
    ) -> Result<(), FramesError> {
        let keys: &[[u32; 4]] = bytemuck::cast_slice(window.keys.keys);
        let first_key = written.place_of(
            self.job.request.set,
            window.keys.index,
            window.keys.first_key,
        );
        if written.imported.is_none() {
            let (own, others) = std::mem::take(&mut written.keys).split_at_mut(keys.len());
            let signs = window.keys.signs;
            if signs.any() {
                // Whole keys, in order: what is written to may be slow to read.
                for (i, (to, &[x, y, z, w])) in own.iter_mut().zip(keys).enumerate() {
                    let turned = if signs.is_turned(i) { SIGN_TURNED } else { 0 };
                    *to = [x | turned, y, z, w];
                }
            } else {
                own.copy_from_slice(keys);
            }
            written.keys = others;
        }
        if !written.samples.is_empty() {
            let all = std::mem::take(&mut written.samples);
            let (own, others) = all.split_at_mut(window.samples.len());
            self.write_frames(window, first_key as u32, own, known)?;
            written.samples = others;
        }
        if let (Some(weights), false) = (&mut known.weights, written.weights.is_empty()) {
            let all = std::mem::take(&mut written.weights);
            let (own, others) = all.split_at_mut(keys.len());
            let TrackKeys { times, all, .. } = window.keys;
            own.copy_from_slice(weights.of(times, window.keys.first_key, all));
            written.weights = others;
        }
        written.next_key += keys.len();
        Ok(())
    }

    /// Writes the places of a window's samples if these are frames.
    fn write_frames<'p>(
        &self,
        window: &KeyWindow<'p>,
        first_key: u32,
        samples: &mut [KeySample],
        known: &mut Known<'p>,
    ) -> Result<(), FramesError> {
        let (set, timeline) = (self.job.request.set, self.job.request.timeline);
        let Ticks::Frames { rate, start } = timeline.ticks else {
            return Ok(());
        };
        let all = set.times_and_keys(window.keys.index).0;
        let clock = FrameClock::new(rate, start, all[all.len() - 1]);
        let found = known.frames.samples(window.keys, clock, &window.samples)?;
        for (sample, found) in samples.iter_mut().zip(found) {
            *sample = KeySample {
                key: found.key + first_key,
                ..*found
            };
        }
        Ok(())
    }
}

/// Writes the places of explicit times in lanes, across tracks: a crowd has many tracks with one
/// sample each.
struct TimesOfTracks<'a> {
    set: &'a TrackSet,
    tracks: Range<usize>,
    /// As in [`Ticks::Times`].
    times: &'a [f64],
    stride: usize,
    /// Samples of each track.
    each: usize,
    /// The place of the tracks' first key.
    first_key: usize,
    samples: &'a mut [KeySample],
}

impl InLanes for TimesOfTracks<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (mut first_key, mut done) = (self.first_key as u32, 0);
        let mut found = TimeLanes::new();
        for index in self.tracks.clone() {
            let (starts, keys) = self.set.times_and_keys(index);
            let mut near = 0;
            for &time in &self.times[index * self.stride..][..self.each] {
                let key = key_before(starts, time, near);
                near = (key & !IS_KEY) as usize;
                let (start, end) = match key & IS_KEY {
                    0 => (starts[near], starts[near + 1]),
                    _ => (0.0, 1.0),
                };
                found.push(key + first_key, time, start, end);
                if found.count == TimeLanes::LEN {
                    done += found.write(&mut self.samples[done..]);
                }
            }
            first_key += keys.len() as u32;
        }
        found.write(&mut self.samples[done..]);
    }
}

impl TimeLanes {
    /// Writes the samples that wait; returns how many.
    #[inline(always)]
    fn write(&mut self, samples: &mut [KeySample]) -> usize {
        let count = std::mem::take(&mut self.count);
        let parameters = self.parameters();
        for (lane, sample) in samples[..count].iter_mut().enumerate() {
            *sample = KeySample {
                key: self.sources[lane],
                parameter: parameters[lane],
            };
        }
        count
    }
}

/// Where a kernel reads the keys of a dispatch.
pub(crate) enum Keys<'w> {
    /// In a buffer of the dispatch: here they are written, with their signs.
    Copied(&'w mut [[u32; 4]]),
    /// In imported memory, as they are stored: the set's first key has this place there. No key is
    /// turned.
    ImportedMemory(usize),
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
    fn place_of(&self, set: &TrackSet, track: usize, key: usize) -> usize {
        self.imported
            .map_or(self.next_key, |first| first + set.keys_of(0..track) + key)
    }
}
