//! Sets with fewer samples than keys on a Vulkan device: keys go there as they are stored,
//! with where the samples lie among them, some tracks at a time. Nothing is prepared.

use std::ops::Range;

use glam::Quat;

use crate::curve::options::{Ends, InterpolationError};
use crate::fit::tangent_weights::WeightRule;
use crate::from_keys::KeyCurve;
use crate::method::interpolation::Interpolation;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::{Ticks, Timeline};
use crate::tracks::set::TrackSet;
use crate::tracks::track_keys::TrackKeys;

/// Rows of one piece: workgroups along y.
const ROWS: usize = 65_535;

/// Keys that one thread brings at once.
const TASK_KEYS: usize = 16 * 1024;

/// What is to be evaluated.
pub(crate) struct KeyJob<'a> {
    pub(crate) set: &'a TrackSet,
    pub(crate) tracks: Range<usize>,
    pub(crate) interpolation: &'a Interpolation,
    pub(crate) timeline: &'a Timeline,
    /// The curves that its samples lie on.
    pub(crate) curve: KeyCurve,
}

impl<'a> KeyJob<'a> {
    /// Those of cubics; arcs have none.
    pub(crate) fn weights(&self) -> Option<WeightRule> {
        match self.curve {
            KeyCurve::Cubics(weights) => Some(weights),
            KeyCurve::Arcs | KeyCurve::TwoKeys => None,
        }
    }

    /// All keys of the set, where kernels can read them as they are stored: weights lie as
    /// the keys of a piece do.
    pub(crate) fn keys(&self) -> Option<&'a [Quat]> {
        self.weights().is_none().then_some(self.set.keys())
    }

    /// The pieces of it, which lie in the result one behind the other.
    pub(crate) fn pieces(&self) -> KeyPieces<'a, '_> {
        KeyPieces {
            job: self,
            next: self.tracks.start,
            long: None,
        }
    }
}

/// Some samples of a track, and the keys that they lie among.
pub(crate) struct Part<'a> {
    pub(crate) keys: TrackKeys<'a>,
    pub(crate) window: Range<usize>,
}

/// What a device gets at once.
pub(crate) struct KeyPiece<'a, 'j> {
    pub(crate) job: &'j KeyJob<'a>,
    pub(crate) tasks: Vec<Task<'a>>,
    /// Rows, all of whose samples lie alike among their keys.
    pub(crate) rows: usize,
    pub(crate) keys: usize,
    /// Samples of which the kernel is told where they lie: those of one row.
    pub(crate) samples: usize,
}

/// What one thread writes of a piece.
pub(crate) struct Task<'a> {
    pub(crate) what: What<'a>,
    pub(crate) keys: usize,
    pub(crate) samples: usize,
}

pub(crate) enum What<'a> {
    /// All of some tracks.
    Tracks(Range<usize>),
    Part(Part<'a>),
}

/// Walks over a job.
pub(crate) struct KeyPieces<'a, 'j> {
    pub(crate) job: &'j KeyJob<'a>,
    /// The next track.
    next: usize,
    /// The rest of a track that is more than a piece: what is left of it, from the key and
    /// the sample on.
    long: Option<Long>,
}

#[derive(Clone, Copy)]
struct Long {
    track: usize,
    key: usize,
    sample: usize,
}

impl<'a, 'j> KeyPieces<'a, 'j> {
    /// The next piece, of about so many keys and so many samples at most.
    pub(crate) fn next(
        &mut self,
        most: usize,
    ) -> Result<Option<KeyPiece<'a, 'j>>, InterpolationError> {
        let job = self.job;
        if let Some(piece) = self.next_of_long(most) {
            return Ok(Some(piece));
        }
        let (set, samples, first) = (job.set, job.timeline.len(), self.next);
        let in_frames = matches!(job.timeline.ticks, Ticks::Frames { .. });
        let within = |tracks: Range<usize>, most| set.tracks_within(tracks, most);
        let rows = most / samples.max(1);
        let end = within(first..job.tracks.end, most).min(first.saturating_add(rows));
        let is_long = end == first;
        self.next = job.tracks.end.min(end.max(first + 1));
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
        Ok(Some(KeyPiece {
            job,
            tasks,
            rows,
            keys: set.keys_of(first..self.next),
            samples: tracks / rows * samples,
        }))
    }

    /// The next piece of a track that is more than a piece: parts for as many threads.
    fn next_of_long(&mut self, most: usize) -> Option<KeyPiece<'a, 'j>> {
        let mut piece = KeyPiece {
            job: self.job,
            tasks: Vec::new(),
            rows: 1,
            keys: 0,
            samples: 0,
        };
        let each = most.min(TASK_KEYS);
        while let Some(long) = self.long {
            let is_full = piece.keys.max(piece.samples) + each > most;
            if is_full && !piece.tasks.is_empty() {
                break;
            }
            let part = self.part_of(long, each);
            let (keys, samples) = (part.keys.keys.len(), part.window.len());
            piece.keys += keys;
            piece.samples += samples;
            piece.tasks.push(Task {
                what: What::Part(part),
                keys,
                samples,
            });
        }
        (!piece.tasks.is_empty()).then_some(piece)
    }

    /// A stretch of a track that is more than a piece, and what of it is left.
    fn part_of(&mut self, long: Long, most: usize) -> Part<'a> {
        let whole = TrackKeys::whole(self.job.set, long.track);
        let times = whole.times;
        let samples = self.job.timeline.len();
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
        // Cubics look at the keys beside their own too.
        let beside = usize::from(self.job.weights().is_some());
        let first = long.key.saturating_sub(beside);
        Part {
            keys: whole.between(first, (last_key + beside).min(last)),
            window: long.sample..sample,
        }
    }
}

impl<'a> KeyJob<'a> {
    /// Refuses tracks that do not end as they must.
    fn check(&self, tracks: Range<usize>) -> Result<(), InterpolationError> {
        let ends = self.interpolation.ends;
        if matches!(ends, Ends::Loop | Ends::Clamped { .. }) {
            for track in tracks {
                ends.check(self.set.times_and_keys(track).1, track)?;
            }
        }
        Ok(())
    }

    /// All of a track.
    pub(crate) fn track(&self, index: usize) -> Part<'a> {
        Part {
            keys: TrackKeys::whole(self.set, index),
            window: 0..self.timeline.len(),
        }
    }

    fn clock(&self, times: &[f64]) -> Option<FrameClock> {
        match self.timeline.ticks {
            Ticks::Frames { rate, start } => {
                Some(FrameClock::new(rate, start, times[times.len() - 1]))
            }
            Ticks::Times { .. } => None,
        }
    }
}
