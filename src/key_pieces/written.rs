//! What a kernel reads of a piece: its keys with their signs, where the samples lie, and joints.

use glam::Quat;
use rayon::prelude::*;

use super::{KeyJob, KeyPiece, Part, What};
use crate::clock::{FramesError, Ticks};
use crate::cpu::{Turns, in_lanes};
use crate::frame_clock::FrameClock;
use crate::joints::TrackJoints;
use crate::plan::{FramePlan, Stretch, time_sample};
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

    /// Writes what the kernel reads.
    pub(crate) fn write(
        &self,
        mut keys: &mut [[u32; 4]],
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
        places
            .into_par_iter()
            .try_for_each_init(new, |known, (task, mut written)| {
                match &task.what {
                    What::Part(part) => self.write_part(part, known, &mut written)?,
                    What::Tracks(tracks) => {
                        for index in tracks.clone() {
                            self.write_part(&self.job.track(index), known, &mut written)?;
                        }
                    }
                }
                Ok(())
            })
    }

    fn write_part<'p>(
        &self,
        part: &Part<'p>,
        (plan, joints): &mut (FramePlan<'p>, Option<TrackJoints<'p>>),
        written: &mut Written<'_>,
    ) -> Result<(), FramesError> {
        let first_key = written.next_key;
        let keys: &[[u32; 4]] = bytemuck::cast_slice(part.stretch.keys);
        let (own, others) = std::mem::take(&mut written.keys).split_at_mut(keys.len());
        own.copy_from_slice(keys);
        turned(&part.stretch, part.sign, |key| own[key][0] |= TURNED);
        written.keys = others;
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
    keys: &'w mut [[u32; 4]],
    samples: &'w mut [Sample],
    joints: &'w mut [Joint],
    /// The place of the next key among the piece's.
    next_key: usize,
}

/// To look at so many keys one by one takes no longer than to call what looks at lanes.
const FEW: usize = 4;

/// Calls `turn` for each key whose sign those before it turn, where the first one's is
/// given; the sign of the last.
pub(super) fn turned(stretch: &Stretch<'_>, first: f32, mut turn: impl FnMut(usize)) -> f32 {
    let keys: &[[f32; 4]] = bytemuck::cast_slice(stretch.keys);
    let any = if keys.len() > FEW {
        let mut turns = Turns { keys, any: false };
        in_lanes(&mut turns);
        turns.any
    } else {
        let mut pairs = keys.windows(2);
        pairs.any(|pair| may_turn(pair[0], pair[1]))
    };
    if !any && first > 0.0 {
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
