//! The keys of a clip for given tolerances, joint after joint.

use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::reduce::{ReduceError, ReducedCurve, ReducedKeys, reduce_rotations, reduce_vectors};
use tumble::{Channel, Frames, Layout, TrackError, TrackSet};

use crate::motion::{Channels, Motion, Sampler};
use crate::reduce::{ReduceMotionError, Reduction, Tolerances, methods};

/// What an evaluation in f32 adds to an angle at most, radians.
const ROUNDING: f64 = 4e-7;
/// The same of vectors, as a part of their size.
const VECTOR_ROUNDING: f64 = 4e-7;

impl Reduction<'_> {
    /// One channel's values, one for each sample.
    fn of_joint<T: Copy>(&self, all: &[T], joint: usize) -> Vec<T> {
        let joints = self.parents.len().max(1);
        all.iter().skip(joint).step_by(joints).copied().collect()
    }

    /// The clip with keys for these tolerances.
    pub(super) fn attempt(&self, tolerances: &Tolerances) -> Result<Motion, ReduceMotionError> {
        let joints = self.parents.len();
        let mut rotations: Vec<Option<ReducedKeys<DQuat>>> = vec![None; joints];
        // How each joint is turned in the world after the reduction, `[joint][sample]`.
        let mut turned: Vec<Vec<DQuat>> = vec![Vec::new(); joints];
        for &joint in &self.order {
            let parent = self.parents[joint];
            let wanted: Vec<DQuat> = match parent {
                None => self
                    .of_joint(&self.samples.rotations, joint)
                    .iter()
                    .map(|own| own.as_dquat())
                    .collect(),
                Some(parent) => {
                    let own = self.poses.iter().skip(joint).step_by(joints);
                    let above = turned[parent].iter();
                    above
                        .zip(own)
                        .map(|(above, own)| above.conjugate() * own.rotation.as_dquat())
                        .collect()
                }
            };
            let tolerance = (tolerances.angles[joint] - ROUNDING).max(0.0);
            let keys = self.rotation_keys(joint, &wanted, tolerance)?;
            let local = self.evaluated(&keys, self.sampler(joint).rotation)?;
            turned[joint] = match parent {
                None => local,
                Some(parent) => {
                    let pairs = turned[parent].iter().zip(local);
                    pairs
                        .map(|(above, own)| (*above * own).normalize())
                        .collect()
                }
            };
            rotations[joint] = Some(keys);
        }
        let mut reduced = Motion {
            set: TrackSet::new(),
            channels: (0..joints).map(|joint| self.new_sampler(joint)).collect(),
            skeleton: self.clip.skeleton.clone(),
            name: self.clip.name.clone(),
            no_world: self.clip.no_world.clone(),
            ..*self.clip
        };
        for (joint, keys) in rotations.into_iter().flatten().enumerate() {
            self.push(&mut reduced, joint, keys)?;
            self.push_vectors(&mut reduced, joint, tolerances)?;
        }
        Ok(reduced)
    }

    fn rotation_keys(
        &self,
        joint: usize,
        wanted: &[DQuat],
        tolerance: f64,
    ) -> Result<ReducedKeys<DQuat>, ReduceError> {
        let keys = match self.sampler(joint).rotation {
            Some(Sampler::Step) => steps(wanted),
            _ => reduce_rotations(&self.times, wanted, tolerance, self.options.curve)?,
        };
        // A clip lasts as long as its keys: one joint at least has a key at its end.
        let last = self.times.len().saturating_sub(1);
        let is_first = self.order.first() == Some(&joint);
        Ok(match keys.places[..] {
            [only] if is_first && last > only && self.sampler(joint).rotation.is_some() => {
                let value = keys.keys[0];
                let mut both = keys;
                both.places.push(last);
                both.keys.push(value);
                both.tangents = both.tangents.repeat(2);
                both
            }
            _ => keys,
        })
    }

    /// The rotations of keys at all samples, as the engine evaluates them.
    fn evaluated(
        &self,
        keys: &ReducedKeys<DQuat>,
        sampler: Option<Sampler>,
    ) -> Result<Vec<DQuat>, ReduceMotionError> {
        let mut one = Motion::default();
        push_rotations(&mut one.set, "", &self.times, keys)?;
        let channels = Channels {
            rotation: self.reduced(sampler),
            ..Channels::default()
        };
        one.channels.push(channels);
        let method = methods().method_of(&one).unwrap_or(tumble::method::SLERP);
        let frames = Frames::at(self.times.clone());
        let found = self
            .engine
            .evaluate_as(&one.set, method, &frames, Layout::TrackMajor)?;
        let quats = found.as_quats().iter();
        Ok(quats.map(|quat| quat.as_dquat().normalize()).collect())
    }

    /// How a joint's channels are keyed in the clip: one that says nothing keys all that has keys.
    fn sampler(&self, joint: usize) -> Channels {
        let keyed = |channel| {
            self.clip
                .set
                .vector_keys(channel, joint)
                .map(|_| Sampler::Linear)
        };
        match self.clip.channels.get(joint) {
            Some(&own) => own,
            None => Channels {
                rotation: Some(Sampler::Linear),
                translation: keyed(Channel::Translation),
                scale: keyed(Channel::Scale),
            },
        }
    }

    /// The sampler of a channel with few keys; nothing for a curve that no file names.
    fn reduced(&self, sampler: Option<Sampler>) -> Option<Sampler> {
        match (sampler?, self.options.curve) {
            (Sampler::Step, _) => Some(Sampler::Step),
            (_, ReducedCurve::Linear) => Some(Sampler::Linear),
            (_, ReducedCurve::GltfCubic) => Some(Sampler::Cubic),
            _ => None,
        }
    }

    fn new_sampler(&self, joint: usize) -> Channels {
        let own = self.sampler(joint);
        Channels {
            rotation: self.reduced(own.rotation),
            translation: self.reduced(own.translation),
            scale: self.reduced(own.scale),
        }
    }

    fn push(
        &self,
        reduced: &mut Motion,
        joint: usize,
        keys: ReducedKeys<DQuat>,
    ) -> Result<(), TrackError> {
        let name = self
            .clip
            .set
            .get(joint)
            .and_then(|track| track.name)
            .unwrap_or_default();
        match self.sampler(joint).rotation {
            Some(_) => push_rotations(&mut reduced.set, name, &self.times, &keys),
            // It rests, at its one key.
            None => {
                let own = self.clip.set.get(joint);
                let (times, keys) = own.map_or((&[][..], &[][..]), |own| (own.times, own.keys));
                reduced.set.push(name, times, keys)
            }
        }
    }

    fn push_vectors(
        &self,
        reduced: &mut Motion,
        joint: usize,
        tolerances: &Tolerances,
    ) -> Result<(), ReduceMotionError> {
        let channels = [
            (
                Channel::Translation,
                &self.samples.translations,
                self.sampler(joint).translation,
            ),
            (
                Channel::Scale,
                &self.samples.scales,
                self.sampler(joint).scale,
            ),
        ];
        for (channel, samples, sampler) in channels {
            if self.clip.set.vector_keys(channel, joint).is_none() || samples.is_empty() {
                continue;
            }
            let wanted = self.of_joint(samples, joint);
            let wanted: Vec<DVec3> = wanted.iter().map(|own| own.as_dvec3()).collect();
            let size = wanted.iter().map(|own| own.length()).fold(0.0, f64::max);
            let tolerance = match channel {
                Channel::Translation => tolerances.distances[joint],
                // A scale moves what hangs on the joint as far as an angle of that size would.
                Channel::Scale => tolerances.angles[joint],
            };
            let tolerance = (tolerance - size * VECTOR_ROUNDING).max(0.0);
            let keys = match sampler {
                Some(Sampler::Step) => steps(&wanted),
                _ => reduce_vectors(&self.times, &wanted, tolerance, self.options.curve)?,
            };
            let times: Vec<f64> = keys.places.iter().map(|&place| self.times[place]).collect();
            let values: Vec<Vec3> = keys.keys.iter().map(|own| own.as_vec3()).collect();
            let tangents = keys.tangents.iter().map(|pair| pair.map(DVec3::as_vec3));
            let tangents: Vec<[Vec3; 2]> = tangents.collect();
            let set = &mut reduced.set;
            match channel {
                Channel::Translation => set.set_translations(joint, &times, &values, &tangents)?,
                Channel::Scale => set.set_scales(joint, &times, &values, &tangents)?,
            }
        }
        Ok(())
    }
}

/// The keys of a channel that holds each until the next one: where the value changes.
fn steps<T: Copy + PartialEq + Default>(samples: &[T]) -> ReducedKeys<T> {
    let changes = |&place: &usize| place == 0 || samples[place] != samples[place - 1];
    let mut keys = ReducedKeys::default();
    keys.places = (0..samples.len()).filter(changes).collect();
    keys.keys = keys.places.iter().map(|&place| samples[place]).collect();
    keys
}

fn push_rotations(
    set: &mut TrackSet,
    name: &str,
    times: &[f64],
    keys: &ReducedKeys<DQuat>,
) -> Result<(), TrackError> {
    let own: Vec<f64> = keys.places.iter().map(|&place| times[place]).collect();
    let quats: Vec<Quat> = keys.keys.iter().map(|own| own.as_quat()).collect();
    set.push(name, &own, &quats)?;
    if keys.tangents.is_empty() {
        return Ok(());
    }
    let tangents = keys.tangents.iter().map(|pair| pair.map(DQuat::as_quat));
    let tangents: Vec<[Quat; 2]> = tangents.collect();
    set.set_tangents(set.track_count() - 1, &tangents)
}
