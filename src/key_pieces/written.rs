//! What a kernel reads of a piece: its keys with their signs, where the samples lie, and joints.

use std::ops::Range;

use glam::Quat;
use rayon::prelude::*;

use super::{KeyJob, KeyPiece, Part, What};
use crate::clock::{FramesError, Ticks};
use crate::cpu::{Turns, in_lanes};
use crate::frame_clock::FrameClock;
use crate::joints::TrackJoints;
use crate::plan::{FramePlan, Stretch, TimePlan};
use crate::prepare::{flip, may_turn};
use crate::segment::shader::{HELD, TURNED};
use crate::segment::{Joint, Rows, Sample};

impl KeyPiece<'_, '_> {
    pub(crate) fn rows(&self) -> Rows {
        Rows {
            samples: self.samples as u32,
            keys: (self.keys / self.rows) as u32,
            count: self.rows as u32,
        }
    }

    /// Rotations that it becomes.
    pub(crate) fn rotation_count(&self) -> usize {
        self.samples * self.rows
    }

    /// Bytes of its keys, the samples, the rotations and the joints.
    pub(crate) fn bytes(&self) -> [usize; 4] {
        let joints = match self.job.joints() {
            Some(_) => self.keys / self.rows,
            None => 0,
        };
        [
            self.keys * size_of::<Quat>(),
            self.samples * size_of::<Sample>(),
            self.rotation_count() * size_of::<Quat>(),
            joints * size_of::<Joint>(),
        ]
    }

    /// Whether any of its keys is turned by those before it, or may be.
    pub(crate) fn turns(&self) -> bool {
        let set = self.job.set;
        self.tasks.par_iter().any(|task| match &task.what {
            What::Part(part) => part.sign < 0.0 || any_turns(part.stretch.keys),
            What::Tracks(tracks) => {
                let mut tracks = tracks.clone();
                tracks.any(|index| any_turns(set.times_and_keys(index).1))
            }
        })
    }

    /// Writes what the kernel reads.
    pub(crate) fn write(
        &self,
        keys: Keys<'_>,
        mut samples: &mut [Sample],
        mut joints: &mut [Joint],
    ) -> Result<(), FramesError> {
        let (mut keys, lent) = match keys {
            Keys::Copied(keys) => (keys, None),
            Keys::Lent(first) => (&mut [][..], Some(first)),
        };
        let mut first_key = 0;
        let mut places = Vec::with_capacity(self.tasks.len());
        for task in &self.tasks {
            // Where all rows are alike only the first one's are told.
            let (told, joined) = match self.rows {
                1 => (task.samples, task.keys.min(joints.len())),
                _ => (samples.len(), joints.len()),
            };
            let (own_keys, other_keys) = keys.split_at_mut(task.keys.min(keys.len()));
            let (own_samples, other_samples) = samples.split_at_mut(told);
            let (own_joints, other_joints) = joints.split_at_mut(joined);
            (keys, samples, joints) = (other_keys, other_samples, other_joints);
            let written = Written {
                keys: own_keys,
                samples: own_samples,
                joints: own_joints,
                next_key: first_key,
                lent,
            };
            places.push((task, written));
            first_key += task.keys;
        }
        let ends = self.job.interpolation.ends;
        let rule = self.job.joints();
        let new = || Known {
            frames: FramePlan::new(),
            times: TimePlan::new(),
            joints: rule.map(|rule| TrackJoints::new(rule, ends)),
        };
        let ticks = &self.job.timeline.ticks;
        places
            .into_par_iter()
            .try_for_each_init(new, |known, (task, mut written)| {
                let tracks = match &task.what {
                    What::Part(part) => return self.write_part(part, known, &mut written),
                    What::Tracks(tracks) => tracks.clone(),
                };
                if let (Ticks::Times { times, stride }, Some(first)) = (ticks, written.lent) {
                    let samples = written.samples;
                    self.write_times(tracks, (times, *stride), first, known, samples);
                    return Ok(());
                }
                tracks.into_iter().try_for_each(|index| {
                    self.write_part(&self.job.track(index), known, &mut written)
                })
            })
    }

    fn write_part<'p>(
        &self,
        part: &Part<'p>,
        known: &mut Known<'p>,
        written: &mut Written<'_>,
    ) -> Result<(), FramesError> {
        let keys: &[[u32; 4]] = bytemuck::cast_slice(part.stretch.keys);
        let first_key = match written.lent {
            Some(first) => {
                let Stretch {
                    index, first_key, ..
                } = part.stretch;
                first + self.job.set.keys_of(0..index) + first_key
            }
            None => {
                let (own, others) = std::mem::take(&mut written.keys).split_at_mut(keys.len());
                own.copy_from_slice(keys);
                turned(&part.stretch, part.sign, |key| own[key][0] |= TURNED);
                written.keys = others;
                written.next_key
            }
        };
        if !written.samples.is_empty() {
            let all = std::mem::take(&mut written.samples);
            let (own, others) = all.split_at_mut(part.window.len());
            self.write_samples(part, first_key as u32, own, known)?;
            written.samples = others;
        }
        if let (Some(joints), false) = (&mut known.joints, written.joints.is_empty()) {
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
        known: &mut Known<'p>,
    ) -> Result<(), FramesError> {
        let KeyJob { set, timeline, .. } = self.job;
        let index = part.stretch.index;
        match &timeline.ticks {
            Ticks::Frames { rate, start } => {
                let all = set.times_and_keys(index).0;
                let clock = FrameClock::new(*rate, *start, all[all.len() - 1]);
                let found = known.frames.samples(part.stretch, clock, &part.window)?;
                for (sample, found) in samples.iter_mut().zip(found) {
                    *sample = Sample {
                        key: found.key + first_key,
                        ..*found
                    };
                }
            }
            Ticks::Times { times, stride } => {
                let times = &times[index * stride..][..samples.len()];
                known
                    .times
                    .write(part.stretch.times, times, first_key, samples);
            }
        }
        Ok(())
    }

    /// The samples of whole tracks, which may be many with a sample each, where keys are
    /// read as they are stored; `first` is the place of the set's first one.
    fn write_times(
        &self,
        tracks: Range<usize>,
        (times, stride): (&[f64], usize),
        first: usize,
        known: &mut Known<'_>,
        samples: &mut [Sample],
    ) {
        let KeyJob { set, timeline, .. } = self.job;
        let mut first_key = (first + set.keys_of(0..tracks.start)) as u32;
        for (index, samples) in tracks.zip(samples.chunks_mut(timeline.len().max(1))) {
            let (starts, keys) = set.times_and_keys(index);
            let times = &times[index * stride..][..samples.len()];
            known.times.write(starts, times, first_key, samples);
            first_key += keys.len() as u32;
        }
    }
}

impl TimePlan {
    /// Where times lie among keys, the first of which has the place `first_key`.
    #[inline(always)]
    fn write(&mut self, starts: &[f64], times: &[f64], first_key: u32, samples: &mut [Sample]) {
        let mut near = 0;
        for (sample, &time) in samples.iter_mut().zip(times) {
            let found = self.sample(starts, time, near);
            near = (found.key & !HELD) as usize;
            *sample = Sample {
                key: found.key + first_key,
                ..found
            };
        }
    }
}

/// Where a kernel reads the keys of a piece.
pub(crate) enum Keys<'w> {
    /// Here, with their signs.
    Copied(&'w mut [[u32; 4]]),
    /// Where they are stored; the set's first one has this place. None is turned.
    Lent(usize),
}

/// What a thread finds out, and keeps for the next track.
struct Known<'p> {
    frames: FramePlan<'p>,
    times: TimePlan,
    /// Those of cubics.
    joints: Option<TrackJoints<'p>>,
}

/// What a thread has still to write.
struct Written<'w> {
    keys: &'w mut [[u32; 4]],
    samples: &'w mut [Sample],
    joints: &'w mut [Joint],
    /// The place of the next key among the piece's.
    next_key: usize,
    /// The place of the set's first key, where keys are read as they are stored.
    lent: Option<usize>,
}

/// To look at so many keys one by one takes no longer than to call what looks at lanes.
const FEW: usize = 4;

/// Whether the sign of any key after the first is turned, or may be.
#[inline]
fn any_turns(keys: &[Quat]) -> bool {
    let keys: &[[f32; 4]] = bytemuck::cast_slice(keys);
    if keys.len() > FEW {
        let mut turns = Turns { keys, any: false };
        in_lanes(&mut turns);
        return turns.any;
    }
    (keys.windows(2)).any(|pair| may_turn(pair[0], pair[1]))
}

/// Calls `turn` for each key whose sign those before it turn, where the first one's is
/// given; the sign of the last.
pub(super) fn turned(stretch: &Stretch<'_>, first: f32, mut turn: impl FnMut(usize)) -> f32 {
    if first > 0.0 && !any_turns(stretch.keys) {
        return first;
    }
    let keys: &[[f32; 4]] = bytemuck::cast_slice(stretch.keys);
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
