//! Sets with fewer samples than keys, cut into dispatches for a Vulkan device: some tracks at a time,
//! with their keys as they are stored and the places of the samples among them.

use std::iter::Peekable;
use std::ops::Range;
use std::vec::IntoIter;

use glam::Quat;

use crate::curve::options::{Ends, InterpolationError};
use crate::fit::tangent_weights::WeightRule;
use crate::from_keys::KeyCurve;
use crate::prepare::batch::{Batch, BatchSize, batches};
use crate::prepare::request::Request;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::Ticks;
use crate::tracks::track_keys::TrackKeys;

/// The most rows of one dispatch; every Vulkan device allows as many workgroups along y.
const ROWS: usize = 65_535;

/// Keys that one task writes.
const TASK_KEYS: usize = 16 * 1024;

/// What is to be evaluated.
pub(crate) struct KeyJob<'a> {
    pub(crate) request: &'a Request<'a>,
    /// The curves that its samples lie on.
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

    /// All keys of the set, where kernels can read them as they are stored. For cubics they
    /// cannot, because weights are indexed like the keys of a dispatch.
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

    /// The keys among which the samples of a batch lie, of each of its tracks.
    pub(crate) fn keys_of(&self, batch: &Batch) -> impl Iterator<Item = TrackKeys<'a>> {
        let (set, curve) = (self.request.set, self.curve);
        let tracks = batch.intervals(set);
        tracks.map(move |(index, own)| TrackKeys::whole(set, index).around(&own, curve.beside()))
    }

    /// Its dispatches, which are consecutive in the result; `most` is as in [`KeyDispatches::next`].
    /// Refuses ends that cannot be met: a loop whose first and last rotation differ, or a clamped
    /// velocity that is too large.
    pub(crate) fn dispatches(
        &self,
        most: usize,
    ) -> Result<KeyDispatches<'a, '_>, InterpolationError> {
        let Request { set, timeline, .. } = *self.request;
        let interpolation = self.request.interpolation;
        interpolation.check()?;
        if interpolation.ends == Ends::Loop {
            for track in self.request.tracks.clone() {
                interpolation.check_track(set.times_and_keys(track).1, track)?;
            }
        }
        let in_frames = matches!(timeline.ticks, Ticks::Frames { .. });
        let size = BatchSize {
            keys: most,
            tracks: most / timeline.len().max(1),
            cut: in_frames.then_some(TASK_KEYS.min(most)),
        };
        let task_size = BatchSize {
            keys: TASK_KEYS,
            tracks: usize::MAX,
            cut: None,
        };
        let mut tasks = Vec::new();
        for batch in batches(set, Batch::Tracks(self.request.tracks.clone()), size) {
            let parts = match batch {
                Batch::Tracks(_) => batches(set, batch, task_size),
                Batch::Intervals { .. } | Batch::Span { .. } => vec![batch],
            };
            for batch in parts {
                let keys = match &batch {
                    Batch::Tracks(tracks) => set.keys_of(tracks.clone()),
                    Batch::Intervals { .. } | Batch::Span { .. } => {
                        self.keys_of(&batch).map(|track| track.keys.len()).sum()
                    }
                };
                let all = batch.samples(set, timeline, false);
                tasks.extend(all.clone().step_by(most).map(|first| Task {
                    batch: batch.clone(),
                    samples: first..all.end.min(first + most),
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

/// What one thread writes of a dispatch.
pub(crate) struct Task {
    pub(crate) batch: Batch,
    /// The samples that it has of each of its tracks: all, unless it has a single track.
    pub(crate) samples: Range<usize>,
    /// Keys of all its tracks.
    pub(crate) keys: usize,
}

impl Task {
    /// Samples of all its tracks.
    pub(crate) fn sample_count(&self) -> usize {
        self.batch.tracks().len() * self.samples.len()
    }
}

/// What one dispatch evaluates.
pub(crate) struct KeyDispatch<'a, 'j> {
    pub(crate) job: &'j KeyJob<'a>,
    pub(crate) tasks: Vec<Task>,
    /// The tracks that it has samples of.
    pub(crate) tracks: Range<usize>,
    /// Number of rows. Tracks that share their key times are a row each, because their samples lie
    /// at the same places among their keys; other tracks together are one row.
    pub(crate) rows: usize,
    pub(crate) keys: usize,
    /// Samples of one row; the kernel gets the place of each among the keys.
    pub(crate) samples: usize,
}

/// The dispatches of a job.
pub(crate) struct KeyDispatches<'a, 'j> {
    job: &'j KeyJob<'a>,
    tasks: Peekable<IntoIter<Task>>,
}

impl<'a, 'j> KeyDispatches<'a, 'j> {
    /// The next dispatch, of about `most` keys and at most `most` samples. Where windows were halved
    /// since the tasks were cut, one task may have more.
    pub(crate) fn next(&mut self, most: usize) -> Option<KeyDispatch<'a, 'j>> {
        let Request { set, timeline, .. } = *self.job.request;
        let (mut keys, mut samples) = (0, 0);
        let mut tasks: Vec<Task> = Vec::new();
        while let Some(task) = self.tasks.next_if(|task| {
            let longest = (keys + task.keys).max(samples + task.sample_count());
            tasks.is_empty() || longest <= most
        }) {
            keys += task.keys;
            samples += task.sample_count();
            tasks.push(task);
        }
        let tracks = tasks.first()?.batch.tracks().start..tasks.last()?.batch.tracks().end;
        let is_whole = |task: &Task| {
            matches!(task.batch, Batch::Tracks(_)) && task.samples.len() == timeline.len()
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
