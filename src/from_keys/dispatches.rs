//! Sets with fewer samples than keys, cut into dispatches for a Vulkan device: some tracks at a time,
//! with their keys as they are stored and the places of the samples among them.

use std::ops::Range;

use glam::Quat;

use crate::curve::options::{Ends, InterpolationError};
use crate::fit::tangent_weights::WeightRule;
use crate::from_keys::KeyCurve;
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

    /// The clock of a track whose samples are frames.
    pub(crate) fn clock(&self, track: usize) -> Option<FrameClock> {
        match self.request.timeline.ticks {
            Ticks::Frames { rate, start } => {
                let times = self.request.set.times_and_keys(track).0;
                Some(FrameClock::new(rate, start, times[times.len() - 1]))
            }
            Ticks::Times { .. } => None,
        }
    }

    /// How many keys and samples a task has.
    pub(crate) fn task_size(&self, task: &Task<'_>) -> (usize, usize) {
        let Request { set, timeline, .. } = self.request;
        match task {
            Task::Tracks(tracks) => (set.keys_of(tracks.clone()), tracks.len() * timeline.len()),
            Task::Window(window) => (window.keys.keys.len(), window.samples.len()),
        }
    }

    /// Its dispatches, which are consecutive in the result.
    pub(crate) fn dispatches(&self) -> KeyDispatches<'a, '_> {
        KeyDispatches {
            job: self,
            next: self.request.tracks.start,
            long: None,
        }
    }
}

/// Some samples of a track, and the keys that they lie among.
pub(crate) struct KeyWindow<'a> {
    pub(crate) keys: TrackKeys<'a>,
    pub(crate) samples: Range<usize>,
}

/// What one dispatch evaluates.
pub(crate) struct KeyDispatch<'a, 'j> {
    pub(crate) job: &'j KeyJob<'a>,
    pub(crate) tasks: Vec<Task<'a>>,
    /// Number of rows. Tracks that share their key times are a row each, because their samples lie
    /// at the same places among their keys; other tracks together are one row.
    pub(crate) rows: usize,
    pub(crate) keys: usize,
    /// Samples of one row; the kernel gets the place of each among the keys.
    pub(crate) samples: usize,
}

/// What one thread writes of a dispatch.
pub(crate) enum Task<'a> {
    /// All of some tracks.
    Tracks(Range<usize>),
    Window(KeyWindow<'a>),
}

/// Cuts a job into dispatches.
pub(crate) struct KeyDispatches<'a, 'j> {
    job: &'j KeyJob<'a>,
    /// The next track.
    next: usize,
    /// What is left of a track that is larger than a dispatch.
    long: Option<Long>,
}

#[derive(Clone, Copy)]
struct Long {
    track: usize,
    key: usize,
    sample: usize,
}

impl<'a, 'j> KeyDispatches<'a, 'j> {
    /// The next dispatch, of about `most` keys and at most `most` samples.
    pub(crate) fn next(
        &mut self,
        most: usize,
    ) -> Result<Option<KeyDispatch<'a, 'j>>, InterpolationError> {
        let job = self.job;
        if let Some(dispatch) = self.next_of_long(most) {
            return Ok(Some(dispatch));
        }
        let Request { set, timeline, .. } = *job.request;
        let (samples, first, last) = (timeline.len(), self.next, job.request.tracks.end);
        let in_frames = matches!(timeline.ticks, Ticks::Frames { .. });
        let rows = most / samples.max(1);
        let end = (set.tracks_within(first..last, most)).min(first.saturating_add(rows));
        self.next = last.min(end.max(first + 1));
        // Ends that cannot be met are refused: a loop whose first and last rotation differ, or a
        // clamped velocity that is too large.
        let ends = job.request.interpolation.ends;
        if matches!(ends, Ends::Loop | Ends::Clamped { .. }) {
            for track in first..self.next {
                ends.check(set.times_and_keys(track).1, track)?;
            }
        }
        if first == self.next {
            return Ok(None);
        }
        if end == first && in_frames {
            self.long = Some(Long {
                track: first,
                key: 0,
                sample: 0,
            });
            return Ok(self.next_of_long(most));
        }
        let mut tasks = Vec::new();
        let mut start = first;
        while start < self.next {
            let end = (set.tracks_within(start..self.next, TASK_KEYS)).max(start + 1);
            tasks.push(Task::Tracks(start..end));
            start = end;
        }
        let times = |track| set.times_and_keys(track).0;
        let tracks = self.next - first;
        let alike = in_frames
            && tracks <= ROWS
            && (first..self.next).all(|track| std::ptr::eq(times(first), times(track)));
        let rows = if alike { tracks } else { 1 };
        Ok(Some(KeyDispatch {
            job,
            tasks,
            rows,
            keys: set.keys_of(first..self.next),
            samples: tracks / rows * samples,
        }))
    }

    /// The next dispatch of a track that is larger than a dispatch: several windows, a task each.
    fn next_of_long(&mut self, most: usize) -> Option<KeyDispatch<'a, 'j>> {
        let mut dispatch = KeyDispatch {
            job: self.job,
            tasks: Vec::new(),
            rows: 1,
            keys: 0,
            samples: 0,
        };
        let each = most.min(TASK_KEYS);
        while let Some(long) = self.long {
            let is_full = dispatch.keys.max(dispatch.samples) + each > most;
            if is_full && !dispatch.tasks.is_empty() {
                break;
            }
            let window = self.window_of(long, each);
            dispatch.keys += window.keys.keys.len();
            dispatch.samples += window.samples.len();
            dispatch.tasks.push(Task::Window(window));
        }
        (!dispatch.tasks.is_empty()).then_some(dispatch)
    }

    /// Takes the next window of a track that is larger than a dispatch, and notes what is left.
    fn window_of(&mut self, long: Long, most: usize) -> KeyWindow<'a> {
        let whole = TrackKeys::whole(self.job.request.set, long.track);
        let samples = self.job.request.timeline.len();
        let last = whole.all - 1;
        let last_key = (long.key + most - 1).min(last);
        let end = match self.job.clock(long.track) {
            Some(clock) if last_key < last => clock.first_frame(whole.times[last_key]) as usize,
            _ => samples,
        };
        let end = end.clamp(long.sample, samples);
        let sample = end.min(long.sample + most);
        let key = if sample < end { long.key } else { last_key };
        self.long = (sample < samples).then_some(Long {
            key,
            sample,
            ..long
        });
        // A cubic needs the keys before and after its own two as well.
        let beside = usize::from(self.job.weights().is_some());
        let first = long.key.saturating_sub(beside);
        KeyWindow {
            keys: whole.between(first, (last_key + beside).min(last)),
            samples: long.sample..sample,
        }
    }
}
