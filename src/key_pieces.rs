//! Sets with fewer samples than keys on a Vulkan device: keys go there as they are stored,
//! with where the samples lie among them, some tracks at a time. Nothing is prepared.

use std::ops::Range;

use glam::Quat;
use rayon::prelude::*;

use crate::clock::{FramesError, Ticks, Timeline};
use crate::cpu::{CpuEngine, Row, Straight, Turns, in_lanes, straight};
use crate::engine::Error;
use crate::frame_clock::FrameClock;
use crate::joints::{Joints, TrackJoints};
use crate::method::{Interpolation, Path};
use crate::plan::{FramePlan, Stretch, time_sample};
use crate::prepare::flip;
use crate::rotations::Layout;
use crate::segment::shader::HELD;
use crate::segment::{Joint, Rows, Sample};
use crate::tracks::TrackSet;

/// Rows of one piece: workgroups along y.
const ROWS: usize = 65_535;

/// Keys that one thread brings at once.
const TASK_KEYS: usize = 16 * 1024;

/// What is to be evaluated.
pub(crate) struct KeyJob<'a> {
    set: &'a TrackSet,
    tracks: Range<usize>,
    interpolation: &'a Interpolation,
    timeline: &'a Timeline,
    /// What its samples are made of.
    pub(crate) straight: Straight,
}

impl<'a> KeyJob<'a> {
    /// Nothing where a device needs segments. It gets about `most` keys and samples at
    /// once.
    pub(crate) fn new(
        set: &'a TrackSet,
        tracks: Range<usize>,
        interpolation: &'a Interpolation,
        timeline: &'a Timeline,
        layout: Layout,
        most: usize,
    ) -> Option<Self> {
        let is_row = layout == Layout::TrackMajor || timeline.len() == 1;
        let straight = straight(set, interpolation, timeline)?;
        // Arcs of more than half a turn need segments.
        let is_shortest = interpolation.path == Path::Shortest;
        // Where samples are explicit times, a track is not cut.
        let in_order = matches!(timeline.ticks, Ticks::Frames { .. });
        let by_pieces = in_order || set.longest().max(timeline.len()) <= most;
        let suits = is_row && by_pieces && is_shortest;
        suits.then_some(Self {
            set,
            tracks,
            interpolation,
            timeline,
            straight,
        })
    }

    /// Those of cubics; arcs have none.
    fn joints(&self) -> Option<Joints> {
        match self.straight {
            Straight::Cubics(joints) => Some(joints),
            Straight::Arcs | Straight::Pairs => None,
        }
    }

    /// Works out on the CPU what the device left 0, because it turns too much.
    pub(crate) fn mend(&self, output: &mut [[f32; 4]]) -> Result<(), Error> {
        let left_out = |some: &[[f32; 4]]| some.contains(&[0.0; 4]);
        if self.joints().is_none() || !output.par_chunks(TASK_KEYS).any(left_out) {
            return Ok(());
        }
        let engine = CpuEngine::widest();
        let rows = output.par_chunks_mut(self.timeline.len());
        (rows.zip(self.tracks.clone())).try_for_each(|(row, index)| {
            let whole = Row::whole(self.set, index, self.interpolation, self.timeline);
            engine.mend(whole, row)
        })
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
struct Part<'a> {
    stretch: Stretch<'a>,
    window: Range<usize>,
    /// The sign of its first key.
    sign: f32,
}

/// What a device gets at once.
pub(crate) struct KeyPiece<'a, 'j> {
    job: &'j KeyJob<'a>,
    tasks: Vec<Task<'a>>,
    /// Rows, all of whose samples lie alike among their keys.
    rows: usize,
    keys: usize,
    /// Samples of which the kernel is told where they lie: those of one row.
    samples: usize,
}

/// What one thread writes of a piece.
struct Task<'a> {
    what: What<'a>,
    keys: usize,
    samples: usize,
}

enum What<'a> {
    /// All of some tracks.
    Tracks(Range<usize>),
    Part(Part<'a>),
}

/// Walks over a job.
pub(crate) struct KeyPieces<'a, 'j> {
    job: &'j KeyJob<'a>,
    /// The next track.
    next: usize,
    /// The rest of a track that is more than a piece: what is left of it, from the key,
    /// whose sign is known, and the sample on.
    long: Option<Long>,
}

#[derive(Clone, Copy)]
struct Long {
    track: usize,
    key: usize,
    sign: f32,
    sample: usize,
}

impl<'a, 'j> KeyPieces<'a, 'j> {
    /// The next piece, of about so many keys and so many samples at most.
    pub(crate) fn next(&mut self, most: usize) -> Result<Option<KeyPiece<'a, 'j>>, Error> {
        let job = self.job;
        if let Some(long) = self.long.take() {
            return Ok(Some(job.piece_of(self.part_of(long, most))));
        }
        let samples = job.timeline.len();
        let in_frames = matches!(job.timeline.ticks, Ticks::Frames { .. });
        let mut tasks = Vec::new();
        let mut first_times: &[f64] = &[];
        let (mut alike, mut all_keys) = (in_frames, 0);
        let (first, mut start, mut keys) = (self.next, self.next, 0);
        while self.next < job.tracks.end {
            let (own_times, own_keys) = job.set.times_and_keys(self.next);
            let rows = self.next - first;
            let is_full = all_keys + own_keys.len() > most || (rows + 1) * samples > most;
            if is_full && rows > 0 {
                break;
            }
            job.interpolation.ends.check(own_keys, self.next)?;
            if is_full && in_frames {
                let long = Long {
                    track: self.next,
                    key: 0,
                    sign: 1.0,
                    sample: 0,
                };
                self.next += 1;
                return Ok(Some(job.piece_of(self.part_of(long, most))));
            }
            if rows == 0 {
                first_times = own_times;
            }
            alike &= std::ptr::eq(first_times, own_times) && rows < ROWS;
            self.next += 1;
            all_keys += own_keys.len();
            keys += own_keys.len();
            if keys >= TASK_KEYS {
                tasks.push(Task::new(start..self.next, keys, samples));
                (start, keys) = (self.next, 0);
            }
        }
        if keys > 0 {
            tasks.push(Task::new(start..self.next, keys, samples));
        }
        let tracks = self.next - first;
        if tracks == 0 {
            return Ok(None);
        }
        let rows = if alike { tracks } else { 1 };
        Ok(Some(KeyPiece {
            job,
            tasks,
            rows,
            keys: all_keys,
            samples: tracks / rows * samples,
        }))
    }

    /// A stretch of a track that is more than a piece, and what of it is left.
    fn part_of(&mut self, long: Long, most: usize) -> Part<'a> {
        let (times, keys) = self.job.set.times_and_keys(long.track);
        let samples = self.job.timeline.len();
        let last = keys.len() - 1;
        let last_key = (long.key + most - 1).min(last);
        let end = match self.job.clock(times) {
            Some(clock) if last_key < last => clock.first_frame(times[last_key]) as usize,
            _ => samples,
        };
        let end = end.clamp(long.sample, samples);
        let sample = end.min(long.sample + most);
        let stretch = |first_key: usize, last_key: usize| Stretch {
            times: &times[first_key..=last_key],
            keys: &keys[first_key..=last_key],
            index: long.track,
            first_key,
            all: last + 1,
        };
        self.long = if sample < end {
            Some(Long { sample, ..long })
        } else if sample < samples {
            let sign = turned(&stretch(long.key, last_key), long.sign, |_| {});
            Some(Long {
                key: last_key,
                sign,
                sample,
                ..long
            })
        } else {
            None
        };
        // Cubics look at the keys beside their own too.
        let beside = usize::from(self.job.joints().is_some());
        let first = long.key.saturating_sub(beside);
        let before = stretch(first, long.key);
        Part {
            stretch: stretch(first, (last_key + beside).min(last)),
            window: long.sample..sample,
            sign: long.sign * turned(&before, 1.0, |_| {}),
        }
    }
}

impl Task<'_> {
    fn new(tracks: Range<usize>, keys: usize, samples: usize) -> Self {
        Self {
            samples: tracks.len() * samples,
            what: What::Tracks(tracks),
            keys,
        }
    }
}

impl<'a> KeyJob<'a> {
    fn piece_of<'j>(&'j self, part: Part<'a>) -> KeyPiece<'a, 'j> {
        let (keys, samples) = (part.stretch.keys.len(), part.window.len());
        KeyPiece {
            job: self,
            tasks: vec![Task {
                what: What::Part(part),
                keys,
                samples,
            }],
            rows: 1,
            keys,
            samples,
        }
    }

    /// All of a track.
    fn track(&self, index: usize) -> Part<'a> {
        let (times, keys) = self.set.times_and_keys(index);
        Part {
            stretch: Stretch {
                times,
                keys,
                index,
                first_key: 0,
                all: keys.len(),
            },
            window: 0..self.timeline.len(),
            sign: 1.0,
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

impl KeyPiece<'_, '_> {
    pub(crate) fn rows(&self) -> Rows {
        Rows {
            samples: self.samples as u32,
            keys: (self.keys / self.rows) as u32,
        }
    }

    pub(crate) fn row_count(&self) -> usize {
        self.rows
    }

    /// Rotations that it becomes.
    pub(crate) fn rotation_count(&self) -> usize {
        self.samples * self.rows
    }

    /// Bytes of its keys, their signs, the samples, the rotations and the joints.
    pub(crate) fn bytes(&self) -> [usize; 5] {
        let joints = match self.job.joints() {
            Some(_) => self.keys / self.rows,
            None => 0,
        };
        [
            self.keys * size_of::<Quat>(),
            self.keys.div_ceil(32) * size_of::<u32>(),
            self.samples * size_of::<Sample>(),
            self.rotation_count() * size_of::<Quat>(),
            joints * size_of::<Joint>(),
        ]
    }

    /// Writes what the kernel reads.
    pub(crate) fn write(
        &self,
        mut keys: &mut [[f32; 4]],
        signs: &mut [u32],
        mut samples: &mut [Sample],
        mut joints: &mut [Joint],
    ) -> Result<(), FramesError> {
        let mut first_key = 0;
        let mut places = Vec::with_capacity(self.tasks.len());
        for task in &self.tasks {
            // Where all rows are alike only the first one's are told.
            let (told, joined) = match self.rows {
                1 => (task.samples, task.keys.min(joints.len())),
                _ => (samples.len(), joints.len()),
            };
            let (own_keys, other_keys) = keys.split_at_mut(task.keys);
            let (own_samples, other_samples) = samples.split_at_mut(told);
            let (own_joints, other_joints) = joints.split_at_mut(joined);
            (keys, samples, joints) = (other_keys, other_samples, other_joints);
            let written = Written {
                keys: own_keys,
                samples: own_samples,
                joints: own_joints,
                next_key: first_key,
                turned: Vec::new(),
            };
            places.push((task, written));
            first_key += task.keys;
        }
        let ends = self.job.interpolation.ends;
        let rule = self.job.joints();
        let new = || {
            (
                FramePlan::new(),
                rule.map(|rule| TrackJoints::new(rule, ends)),
            )
        };
        let turned: Vec<Vec<usize>> = places
            .into_par_iter()
            .map_init(new, |known, (task, mut written)| {
                match &task.what {
                    What::Part(part) => self.write_part(part, known, &mut written)?,
                    What::Tracks(tracks) => {
                        for index in tracks.clone() {
                            self.write_part(&self.job.track(index), known, &mut written)?;
                        }
                    }
                }
                Ok(written.turned)
            })
            .collect::<Result<_, FramesError>>()?;
        signs.fill(0);
        for key in turned.into_iter().flatten() {
            signs[key / 32] |= 1 << (key % 32);
        }
        Ok(())
    }

    fn write_part<'p>(
        &self,
        part: &Part<'p>,
        (plan, joints): &mut (FramePlan<'p>, Option<TrackJoints<'p>>),
        written: &mut Written<'_>,
    ) -> Result<(), FramesError> {
        let first_key = written.next_key;
        let keys: &[[f32; 4]] = bytemuck::cast_slice(part.stretch.keys);
        let (own, others) = std::mem::take(&mut written.keys).split_at_mut(keys.len());
        own.copy_from_slice(keys);
        written.keys = others;
        let turn = |key| written.turned.push(first_key + key);
        turned(&part.stretch, part.sign, turn);
        if !written.samples.is_empty() {
            let all = std::mem::take(&mut written.samples);
            let (own, others) = all.split_at_mut(part.window.len());
            self.write_samples(part, first_key as u32, own, plan)?;
            written.samples = others;
        }
        if let (Some(joints), false) = (joints, written.joints.is_empty()) {
            let all = std::mem::take(&mut written.joints);
            let (own, others) = all.split_at_mut(keys.len());
            let Stretch {
                times,
                first_key,
                all,
                ..
            } = part.stretch;
            own.copy_from_slice(joints.of(times, first_key, all));
            written.joints = others;
        }
        written.next_key += keys.len();
        Ok(())
    }

    fn write_samples<'p>(
        &self,
        part: &Part<'p>,
        first_key: u32,
        samples: &mut [Sample],
        plan: &mut FramePlan<'p>,
    ) -> Result<(), FramesError> {
        let KeyJob { set, timeline, .. } = self.job;
        let index = part.stretch.index;
        match &timeline.ticks {
            Ticks::Frames { rate, start } => {
                let all = set.times_and_keys(index).0;
                let clock = FrameClock::new(*rate, *start, all[all.len() - 1]);
                let found = plan.samples(part.stretch, clock, &part.window)?;
                for (sample, found) in samples.iter_mut().zip(found) {
                    *sample = Sample {
                        key: found.key + first_key,
                        ..*found
                    };
                }
            }
            Ticks::Times { times, stride } => {
                let times = &times[index * stride..][..samples.len()];
                let mut near = 0;
                for (sample, &time) in samples.iter_mut().zip(times) {
                    let found = time_sample(part.stretch.times, time, near);
                    near = (found.key & !HELD) as usize;
                    *sample = Sample {
                        key: found.key + first_key,
                        ..found
                    };
                }
            }
        }
        Ok(())
    }
}

/// What a thread has still to write, and what it has found.
struct Written<'w> {
    keys: &'w mut [[f32; 4]],
    samples: &'w mut [Sample],
    joints: &'w mut [Joint],
    /// The place of the next key among the piece's.
    next_key: usize,
    /// Keys whose sign is turned.
    turned: Vec<usize>,
}

/// Calls `turn` for each key whose sign those before it turn, where the first one's is
/// given; the sign of the last.
fn turned(stretch: &Stretch<'_>, first: f32, mut turn: impl FnMut(usize)) -> f32 {
    let keys: &[[f32; 4]] = bytemuck::cast_slice(stretch.keys);
    let mut turns = Turns { keys, any: false };
    in_lanes(&mut turns);
    if !turns.any && first > 0.0 {
        return first;
    }
    let mut sign = first;
    for (i, key) in keys.iter().enumerate() {
        if i > 0 {
            sign *= flip(keys[i - 1], *key);
        }
        if sign < 0.0 {
            turn(i);
        }
    }
    sign
}
