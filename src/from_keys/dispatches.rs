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
pub(crate) struct Task<'a> {
    pub(crate) what: What<'a>,
    pub(crate) keys: usize,
    pub(crate) samples: usize,
}

pub(crate) enum What<'a> {
    /// All of some tracks.
    Tracks(Range<usize>),
    Window(KeyWindow<'a>),
}

/// Cuts a job into dispatches.
pub(crate) struct KeyDispatches<'a, 'j> {
    pub(crate) job: &'j KeyJob<'a>,
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
        let (set, samples, first) = (job.request.set, job.request.timeline.len(), self.next);
        let in_frames = matches!(job.request.timeline.ticks, Ticks::Frames { .. });
        let within = |tracks: Range<usize>, most| set.tracks_within(tracks, most);
        let rows = most / samples.max(1);
        let end = within(first..job.request.tracks.end, most).min(first.saturating_add(rows));
        let is_long = end == first;
        self.next = job.request.tracks.end.min(end.max(first + 1));
        job.check(first..self.next)?;
        if first == self.next {
            return Ok(None);
        }
        if is_long && in_frames {
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
            let end = within(start..self.next, TASK_KEYS).max(start + 1);
            tasks.push(Task {
                what: What::Tracks(start..end),
                keys: set.keys_of(start..end),
                samples: (end - start) * samples,
            });
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
            let (keys, samples) = (window.keys.keys.len(), window.samples.len());
            dispatch.keys += keys;
            dispatch.samples += samples;
            dispatch.tasks.push(Task {
                what: What::Window(window),
                keys,
                samples,
            });
        }
        (!dispatch.tasks.is_empty()).then_some(dispatch)
    }

    /// Takes the next window of a track that is larger than a dispatch, and notes what is left.
    fn window_of(&mut self, long: Long, most: usize) -> KeyWindow<'a> {
        let whole = TrackKeys::whole(self.job.request.set, long.track);
        let times = whole.times;
        let samples = self.job.request.timeline.len();
        let last = whole.all - 1;
        let last_key = (long.key + most - 1).min(last);
        let end = match self.job.clock(times) {
            Some(clock) if last_key < last => clock.first_frame(times[last_key]) as usize,
            _ => samples,
        };
        let end = end.clamp(long.sample, samples);
        let sample = end.min(long.sample + most);
        self.long = if sample < end {
            Some(Long { sample, ..long })
        } else if sample < samples {
            Some(Long {
                key: last_key,
                sample,
                ..long
            })
        } else {
            None
        };
        // A cubic needs the keys before and after its own two as well.
        let beside = usize::from(self.job.weights().is_some());
        let first = long.key.saturating_sub(beside);
        KeyWindow {
            keys: whole.between(first, (last_key + beside).min(last)),
            samples: long.sample..sample,
        }
    }
}

impl<'a> KeyJob<'a> {
    /// Refuses ends that cannot be met: a loop whose first and last rotation differ, or a clamped
    /// velocity that is too large.
    fn check(&self, tracks: Range<usize>) -> Result<(), InterpolationError> {
        let ends = self.request.interpolation.ends;
        if matches!(ends, Ends::Loop | Ends::Clamped { .. }) {
            for track in tracks {
                ends.check(self.request.set.times_and_keys(track).1, track)?;
            }
        }
        Ok(())
    }

    /// All of a track.
    pub(crate) fn track(&self, index: usize) -> KeyWindow<'a> {
        KeyWindow {
            keys: TrackKeys::whole(self.request.set, index),
            samples: 0..self.request.timeline.len(),
        }
    }

    fn clock(&self, times: &[f64]) -> Option<FrameClock> {
        match self.request.timeline.ticks {
            Ticks::Frames { rate, start } => {
                Some(FrameClock::new(rate, start, times[times.len() - 1]))
            }
            Ticks::Times { .. } => None,
        }
    }
}
