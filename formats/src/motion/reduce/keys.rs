//! Finds the keys of a clip within tolerances, joint by joint.

use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::reduce::{
    ReduceError, ReducedCurve, ReducedKeys, reduce_rotations, reduce_together, reduce_vectors,
};
use tumble::{Channel, Layout, SampleTimes, TrackError, TrackSet};

use crate::motion::reduce::{ReduceMotionError, Reduction, Tolerances};
use crate::motion::sample::ChannelMethods;
use crate::motion::scalars::{Scalar, ScalarKind};
use crate::motion::{ChannelInterpolation, Channels, Motion};

/// The largest error in radians that an f32 evaluation adds to an angle.
const ROUNDING: f64 = 4e-7;
/// The largest error that an f32 evaluation adds to a vector, relative to its length.
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
        let mut reduced = Motion {
            channels: (0..joints).map(|joint| self.new_sampler(joint)).collect(),
            ..self.clip.without_tracks()
        };
        if self.options.together {
            self.push_together(&mut reduced, tolerances)?;
            return Ok(reduced);
        }
        reduced = reduced.with_scalars_of(self.clip, 1.0)?;
        let rotations = self.rotations(tolerances)?;
        for (joint, keys) in rotations.into_iter().enumerate() {
            self.push(&mut reduced, joint, &keys)?;
            for channel in CHANNELS {
                let Some((samples, tolerance)) = self.vectors(channel, joint, tolerances) else {
                    continue;
                };
                let sampler = self.sampler(joint).of(channel);
                let keys = match sampler {
                    Some(ChannelInterpolation::Step) => steps(&samples),
                    _ => reduce_vectors(&self.times, &samples, tolerance, self.options.curve)?,
                };
                self.push_vectors(&mut reduced, joint, channel, &keys)?;
            }
        }
        Ok(reduced)
    }

    /// The clip with a key for each sample in channels that move. Vectors have only as many digits as the bound of
    /// distances needs.
    pub(super) fn all(&self) -> Result<Motion, ReduceMotionError> {
        let joints = self.parents.len();
        let mut all = Motion {
            channels: (0..joints).map(|joint| self.new_sampler(joint)).collect(),
            ..self.clip.without_tracks()
        }
        .with_scalars_of(self.clip, 1.0)?;
        let every: Vec<usize> = (0..self.times.len()).collect();
        let is_step =
            |sampler: Option<ChannelInterpolation>| sampler == Some(ChannelInterpolation::Step);
        for joint in 0..joints {
            let samples = self.local(joint);
            let mut keys = steps(&samples);
            if keys.indices.len() > 1 && !is_step(self.sampler(joint).rotation) {
                (keys.indices, keys.keys) = (every.clone(), samples);
            }
            if self.order.first() == Some(&joint) {
                lengthen(&mut keys, self.times.len().saturating_sub(1));
            }
            self.push(&mut all, joint, &keys)?;
            for channel in CHANNELS {
                if self.clip.set.vector_keys(channel, joint).is_none() {
                    continue;
                }
                let samples = match channel {
                    Channel::Translation => &self.samples.translations,
                    Channel::Scale => &self.samples.scales,
                };
                let samples = self.of_joint(samples, joint);
                // Rounding to a power of two is exact, and the lowest bits of f32 become 0.
                let step = libm::log2(self.distance / 64.0).floor().clamp(-60.0, 60.0);
                let step = match channel {
                    Channel::Translation if self.distance > 0.0 => libm::exp2(step),
                    _ => 0.0,
                };
                let rounded = |v: &Vec3| match step > 0.0 {
                    true => (v.as_dvec3() / step).round() * step,
                    false => v.as_dvec3(),
                };
                let samples: Vec<DVec3> = samples.iter().map(rounded).collect();
                let mut keys = steps(&samples);
                if keys.indices.len() > 1 && !is_step(self.sampler(joint).of(channel)) {
                    (keys.indices, keys.keys) = (every.clone(), samples);
                }
                self.push_vectors(&mut all, joint, channel, &keys)?;
            }
        }
        Ok(all)
    }

    /// The keys of each joint's rotations, in an order in which parents come before their children.
    fn rotations(
        &self,
        tolerances: &Tolerances,
    ) -> Result<Vec<ReducedKeys<DQuat>>, ReduceMotionError> {
        let joints = self.parents.len();
        let mut rotations = vec![ReducedKeys::default(); joints];
        // The world rotation of each joint after the reduction, `[joint][sample]`.
        let mut in_world: Vec<Vec<DQuat>> = vec![Vec::new(); joints];
        for &joint in &self.order {
            let parent = self.parents[joint];
            let sampler = self.sampler(joint).rotation;
            // Joints that step or rest do not change. Other joints compensate for the change of their parents.
            let target: Vec<DQuat> = match parent {
                Some(parent) if !matches!(sampler, None | Some(ChannelInterpolation::Step)) => {
                    let poses = self.poses.iter().skip(joint).step_by(joints);
                    let pairs = in_world[parent].iter().zip(poses);
                    pairs
                        .map(|(above, pose)| above.conjugate() * pose.rotation.as_dquat())
                        .collect()
                }
                _ => self.local(joint),
            };
            let tolerance = tolerances.angle(joint);
            let keys = self.rotation_keys(joint, &target, tolerance)?;
            let local = match sampler {
                None => target,
                Some(_) => self.evaluated(&keys, sampler)?,
            };
            in_world[joint] = match parent {
                None => local,
                Some(parent) => {
                    let pairs = in_world[parent].iter().zip(local);
                    pairs
                        .map(|(above, rotation)| (*above * rotation).normalize())
                        .collect()
                }
            };
            rotations[joint] = keys;
        }
        Ok(rotations)
    }

    /// Adds all joints, and the scalars, with keys at the same times.
    fn push_together(
        &self,
        reduced: &mut Motion,
        tolerances: &Tolerances,
    ) -> Result<(), ReduceMotionError> {
        let joints = self.parents.len();
        let samplers = (0..joints).map(|joint| self.sampler(joint));
        if let Some(joint) = samplers
            .into_iter()
            .position(|channels| channels.has(ChannelInterpolation::Step))
        {
            let name = self.clip.set.track_name(joint);
            return Err(ReduceMotionError::Steps { joint, name });
        }
        let keyed: Vec<usize> = (0..joints)
            .filter(|&joint| self.sampler(joint).rotation.is_some())
            .collect();
        let rotations: Vec<(Vec<DQuat>, f64)> = keyed
            .iter()
            .map(|&joint| (self.local(joint), tolerances.angle(joint)))
            .collect();
        let mut moved = Vec::new();
        let mut vectors = Vec::new();
        for joint in 0..joints {
            for channel in CHANNELS {
                if let Some(samples) = self.vectors(channel, joint, tolerances) {
                    moved.push((joint, channel));
                    vectors.push(samples);
                }
            }
        }
        let scalars = 0..self.clip.set.scalar_count();
        vectors.extend(scalars.map(|scalar| self.scalar(scalar)));
        let curve = self.options.curve;
        let mut found = reduce_together(&self.times, &rotations, &vectors, curve)?;
        let last = self.times.len().saturating_sub(1);
        // If nothing moves, a second key stores the length of the clip. Otherwise the moving channels have it.
        let counts = found.rotations.iter().map(|keys| keys.indices.len());
        let moving = counts.chain(found.vectors.iter().map(|keys| keys.indices.len()));
        if moving.max() <= Some(1) {
            for keys in &mut found.rotations {
                lengthen(keys, last);
            }
        }
        let mut keys = found.rotations.into_iter();
        for joint in 0..joints {
            let joint_keys = match keyed.contains(&joint) {
                true => keys.next().unwrap_or_default(),
                false => ReducedKeys::default(),
            };
            self.push(reduced, joint, &joint_keys)?;
        }
        let (of_vectors, of_scalars) = found.vectors.split_at(moved.len());
        for ((joint, channel), keys) in moved.into_iter().zip(of_vectors) {
            self.push_vectors(reduced, joint, channel, keys)?;
        }
        for (index, keys) in of_scalars.iter().enumerate() {
            let name = self.clip.set.scalar(index).map_or("", |scalar| scalar.name);
            let (times, vectors, tangents) = self.keys_of(keys);
            let numbers: Vec<f32> = vectors.iter().map(|vector| vector.x).collect();
            let tangents = tangents.iter().map(|pair| pair.map(|tangent| tangent.x));
            let tangents: Vec<[f32; 2]> = tangents.collect();
            let scalar = Scalar {
                interpolation: self.reduced(Some(ChannelInterpolation::Linear)),
                ..self.clip.scalar(index)
            };
            reduced.add_scalar(scalar, name, &times, &numbers, &tangents)?;
        }
        Ok(())
    }

    /// The samples of a scalar as vectors along x, and the tolerance of its curve: that of the rotations for angles, that
    /// of the positions for lengths, none for numbers of unknown meaning.
    fn scalar(&self, index: usize) -> (Vec<DVec3>, f64) {
        let count = self.clip.set.scalar_count().max(1);
        let samples = self.samples.scalars.iter().skip(index).step_by(count);
        let samples: Vec<DVec3> = samples.map(|&x| DVec3::X * f64::from(x)).collect();
        let size = samples
            .iter()
            .map(|sample| sample.x.abs())
            .fold(0.0, f64::max);
        let tolerance = match self.clip.scalar(index).kind {
            ScalarKind::Angle => self.options.angle,
            ScalarKind::Length => self.distance,
            ScalarKind::Plain | ScalarKind::Contact => 0.0,
        };
        (samples, (tolerance - size * VECTOR_ROUNDING).max(0.0))
    }

    /// A joint's rotations relative to its parent.
    fn local(&self, joint: usize) -> Vec<DQuat> {
        let rotations = self.of_joint(&self.samples.rotations, joint);
        rotations
            .iter()
            .map(|rotation| rotation.as_dquat())
            .collect()
    }

    /// The samples of a channel that has keys, and the tolerance of its curve.
    fn vectors(
        &self,
        channel: Channel,
        joint: usize,
        tolerances: &Tolerances,
    ) -> Option<(Vec<DVec3>, f64)> {
        self.clip.set.vector_keys(channel, joint)?;
        let (samples, tolerance) = match channel {
            Channel::Translation => (&self.samples.translations, tolerances.distances[joint]),
            // A change of the scale by some number moves the children of the joint as far as a rotation by this number
            // in rad.
            Channel::Scale => (&self.samples.scales, tolerances.angles[joint]),
        };
        let stored = self.of_joint(samples, joint);
        let vectors: Vec<DVec3> = stored.iter().map(|vector| vector.as_dvec3()).collect();
        let size = vectors
            .iter()
            .map(|vector| vector.length())
            .fold(0.0, f64::max);
        (!vectors.is_empty()).then_some((vectors, (tolerance - size * VECTOR_ROUNDING).max(0.0)))
    }

    fn rotation_keys(
        &self,
        joint: usize,
        samples: &[DQuat],
        tolerance: f64,
    ) -> Result<ReducedKeys<DQuat>, ReduceError> {
        let keys = match self.sampler(joint).rotation {
            Some(ChannelInterpolation::Step) => steps(samples),
            _ => reduce_rotations(&self.times, samples, tolerance, self.options.curve)?,
        };
        // A clip ends at its last key, so at least one joint needs a key there.
        let is_keyed = |joint: &&usize| self.sampler(**joint).rotation.is_some();
        let mut keys = keys;
        if self.order.iter().find(is_keyed) == Some(&joint) {
            lengthen(&mut keys, self.times.len().saturating_sub(1));
        }
        Ok(keys)
    }

    /// The rotations of keys at all samples, as the engine evaluates them.
    fn evaluated(
        &self,
        keys: &ReducedKeys<DQuat>,
        sampler: Option<ChannelInterpolation>,
    ) -> Result<Vec<DQuat>, ReduceMotionError> {
        let mut one = Motion::default();
        push_rotations(&mut one.set, "", &self.times, keys)?;
        let channels = Channels {
            rotation: self.reduced(sampler),
            ..Channels::default()
        };
        one.channels.push(channels);
        let method = ChannelMethods::AUTHORED
            .method_of(&one)
            .unwrap_or(tumble::method::SLERP);
        let frames = SampleTimes::at(self.times.clone());
        let found = self
            .engine
            .request(&one.set, method, &frames)
            .layout(Layout::TrackMajor)
            .evaluate()?;
        let quats = found.as_quats().iter();
        Ok(quats.map(|quat| quat.as_dquat().normalize()).collect())
    }

    /// The interpolation of a joint's channels in the clip; where it is not specified, every channel with keys has
    /// one.
    fn sampler(&self, joint: usize) -> Channels {
        let keyed = |channel| {
            self.clip
                .set
                .vector_keys(channel, joint)
                .map(|_| ChannelInterpolation::Linear)
        };
        match self.clip.channels.get(joint) {
            Some(&channels) => channels,
            None => Channels {
                rotation: Some(ChannelInterpolation::Linear),
                translation: keyed(Channel::Translation),
                scale: keyed(Channel::Scale),
            },
        }
    }

    /// The interpolation of a channel with few keys; `None` for a curve that files cannot name.
    fn reduced(&self, sampler: Option<ChannelInterpolation>) -> Option<ChannelInterpolation> {
        match (sampler?, self.options.curve) {
            (ChannelInterpolation::Step, _) => Some(ChannelInterpolation::Step),
            (_, ReducedCurve::Linear) => Some(ChannelInterpolation::Linear),
            (_, ReducedCurve::GltfCubic) => Some(ChannelInterpolation::Cubic),
            _ => None,
        }
    }

    fn new_sampler(&self, joint: usize) -> Channels {
        let channels = self.sampler(joint);
        Channels {
            rotation: self.reduced(channels.rotation),
            translation: self.reduced(channels.translation),
            scale: self.reduced(channels.scale),
        }
    }

    fn push(
        &self,
        reduced: &mut Motion,
        joint: usize,
        keys: &ReducedKeys<DQuat>,
    ) -> Result<(), TrackError> {
        let track = self.clip.set.get(joint);
        let name = track.and_then(|track| track.name).unwrap_or_default();
        match self.sampler(joint).rotation {
            Some(_) => push_rotations(&mut reduced.set, name, &self.times, keys),
            // The joint does not move: it keeps a single key.
            None => {
                let (times, keys) =
                    track.map_or((&[][..], &[][..]), |track| (track.times, track.keys));
                reduced.set.push(name, times, keys)
            }
        }
    }

    fn push_vectors(
        &self,
        reduced: &mut Motion,
        joint: usize,
        channel: Channel,
        keys: &ReducedKeys<DVec3>,
    ) -> Result<(), TrackError> {
        let (times, values, tangents) = self.keys_of(keys);
        let set = &mut reduced.set;
        match channel {
            Channel::Translation => set.set_translations(joint, &times, &values, &tangents),
            Channel::Scale => set.set_scales(joint, &times, &values, &tangents),
        }
    }

    /// The times, the values and the tangents of keys, as sets take them.
    fn keys_of(&self, keys: &ReducedKeys<DVec3>) -> (Vec<f64>, Vec<Vec3>, Vec<[Vec3; 2]>) {
        let times = keys.indices.iter().map(|&index| self.times[index]);
        let values = keys.keys.iter().map(|vector| vector.as_vec3());
        let tangents = keys.tangents.iter().map(|pair| pair.map(DVec3::as_vec3));
        (times.collect(), values.collect(), tangents.collect())
    }
}

impl Tolerances {
    /// The tolerance of a joint's rotation against the curve in f64.
    fn angle(&self, joint: usize) -> f64 {
        (self.angles[joint] - ROUNDING).max(0.0)
    }
}

/// The channels of vectors.
const CHANNELS: [Channel; 2] = [Channel::Translation, Channel::Scale];

/// Adds a key at the last sample to a constant channel.
fn lengthen(keys: &mut ReducedKeys<DQuat>, last: usize) {
    if let ([only], &[value]) = (&keys.indices[..], &keys.keys[..])
        && *only < last
    {
        keys.indices.push(last);
        keys.keys.push(value);
        keys.tangents = keys.tangents.repeat(2);
    }
}

/// The keys of a channel with steps: one at each change of the value.
fn steps<T: Copy + PartialEq + Default>(samples: &[T]) -> ReducedKeys<T> {
    let changes = |&sample: &usize| sample == 0 || samples[sample] != samples[sample - 1];
    let mut keys = ReducedKeys::default();
    keys.indices = (0..samples.len()).filter(changes).collect();
    keys.keys = keys.indices.iter().map(|&sample| samples[sample]).collect();
    keys
}

fn push_rotations(
    set: &mut TrackSet,
    name: &str,
    times: &[f64],
    keys: &ReducedKeys<DQuat>,
) -> Result<(), TrackError> {
    let key_times: Vec<f64> = keys.indices.iter().map(|&index| times[index]).collect();
    let quats: Vec<Quat> = keys
        .keys
        .iter()
        .map(|rotation| rotation.as_quat())
        .collect();
    set.push(name, &key_times, &quats)?;
    if keys.tangents.is_empty() {
        return Ok(());
    }
    let tangents = keys.tangents.iter().map(|pair| pair.map(DQuat::as_quat));
    let tangents: Vec<[Quat; 2]> = tangents.collect();
    set.set_tangents(set.track_count() - 1, &tangents)
}
