//! Makes a clip of some joints of a clip, to which the motion of the joints between them is added, so that the kept joints
//! have the same poses in the world.

use glam::{DVec3, Quat, Vec3};
use tumble::{Channel, Engine, Error, SampleTimes, TrackError, TrackSet};

use crate::motion::origin::relative;
use crate::motion::sample::{ChannelMethods, Samples};
use crate::motion::signs::continue_signs;
use crate::motion::similarity::Similarity;
use crate::motion::world::{HierarchyError, parents_first};
use crate::motion::{ChannelInterpolation, Channels, Motion, Transform};

/// Why joints cannot be left out of a clip.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CollapseError {
    /// A joint that is left out has a scale that differs between axes.
    #[error(
        "`{name}` is scaled differently along its axes, which its children cannot take over; keep this joint"
    )]
    Scale {
        /// The name of the joint.
        name: String,
    },
    /// The parents are no hierarchy.
    #[error(transparent)]
    Hierarchy(#[from] HierarchyError),
    /// The keys cannot be evaluated.
    #[error(transparent)]
    Evaluating(#[from] Error),
    /// A track does not exist, or its new keys are invalid.
    #[error(transparent)]
    Track(#[from] TrackError),
}

impl Motion {
    /// The clip of these tracks, in this order, and of all scalars. The other joints are left out, but not their
    /// motion. A child of such a joint becomes a child of its nearest ancestor that is kept, or a root. Its transform
    /// becomes the product of its transform and of those in between, with keys at the key times of all these joints. So
    /// at each key it has the same pose relative to the kept ancestor as before. Between its keys it is interpolated as
    /// these joints are; if their samplers differ, or are cubic splines, it is interpolated by lines.
    ///
    /// All keys of other joints keep their bits. Translations are unknown in a clip [without
    /// offsets](Motion::lacks_offsets), and only its rotations are multiplied. In a clip that [is in the
    /// world](Motion::is_world), only parents change.
    ///
    /// # Errors
    /// When a track does not exist, or a joint that is left out is scaled differently along its axes.
    pub fn collapsed(
        &self,
        tracks: &[usize],
        engine: &Engine,
        methods: &ChannelMethods,
    ) -> Result<Self, CollapseError> {
        let mut kept = self.select(tracks)?;
        parents_first(self, self.set.track_count())?;
        let parent = |track: usize| self.skeleton.get(track).and_then(|joint| joint.parent);
        let new_index = |track: usize| tracks.iter().position(|&other| other == track);
        let (mut set, mut order) = (self.set.clone(), tracks.to_vec());
        let mut products = Vec::new();
        for (index, &track) in tracks.iter().enumerate() {
            let (mut chain, mut above) = (vec![track], parent(track));
            while let Some(left_out) = above.filter(|&it| new_index(it).is_none()) {
                chain.push(left_out);
                above = parent(left_out);
            }
            if chain.len() == 1 {
                continue;
            }
            kept.skeleton[index].parent = above.and_then(new_index);
            if !self.is_world {
                let product = self.product(&chain, engine, methods)?;
                order[index] = set.track_count();
                product.push(self, track, &mut set)?;
                products.push((index, product));
            }
        }
        kept.set = set.select(order)?;
        for (index, product) in products {
            product.finish(index, &mut kept);
        }
        if !tracks.iter().any(|&track| parent(track).is_none()) {
            // The root is left out. The shape of an SMPL body concerns the position of its root, so it does not apply
            // any more.
            kept.body = None;
        }
        Ok(kept)
    }

    /// The product of the transforms of a joint and its ancestors, from the joint upward.
    fn product(
        &self,
        chain: &[usize],
        engine: &Engine,
        methods: &ChannelMethods,
    ) -> Result<Product, CollapseError> {
        let part = self.select(chain)?;
        let times = part.track_key_times();
        let samples = methods.sample(engine, &part, &SampleTimes::at(times.clone()))?;
        let at_rest = part.product_of(|joint| Similarity::at_rest(&part, joint))?;
        let joint_rest = part.skeleton[0].rest;
        let mut product = Product {
            rest: Transform {
                translation: joint_rest.translation,
                rotation: (at_rest.rotation * joint_rest.rotation.as_dquat())
                    .normalize()
                    .as_quat(),
                scale: (at_rest.scale * joint_rest.scale.as_dvec3()).as_vec3(),
            },
            position: at_rest.point(part.rest_position(0)),
            rotations: Vec::with_capacity(times.len()),
            positions: Vec::with_capacity(times.len()),
            scales: Vec::with_capacity(times.len()),
            has_scales: has_keys(&part, Channel::Scale),
            channels: part.joined_channels(),
            times,
        };
        for frame in 0..product.times.len() {
            let above =
                part.product_of(|joint| Similarity::of_joint(&part, &samples, frame, joint))?;
            product.add(&part, &samples, frame, above);
        }
        continue_signs(&mut product.rotations, 1);
        let first = product.positions[0];
        if self.no_world.is_some() {
            // The positions of the joints relative to their parents are unknown.
            product.positions.clear();
            product.position = self.rest_position(chain[0]);
        } else if product.positions.iter().all(|&position| position == first)
            && part.set.vector_keys(Channel::Translation, 0).is_none()
        {
            product.positions.clear();
            product.position = first;
        }
        Ok(product)
    }

    /// The product of the transforms of all tracks but the first, each of which is the parent of the one before it.
    fn product_of(
        &self,
        local: impl Fn(usize) -> Option<Similarity>,
    ) -> Result<Similarity, CollapseError> {
        let ancestors = (1..self.set.track_count()).rev();
        let mut all = ancestors.map(|joint| (joint, local(joint)));
        all.try_fold(Similarity::IDENTITY, |above, (joint, local)| {
            let name = || self.set.track_name(joint);
            let local = local.ok_or_else(|| CollapseError::Scale { name: name() })?;
            Ok(above.then(local))
        })
    }

    /// The samplers of the product of all tracks, of which the first is the joint that is kept.
    fn joined_channels(&self) -> Channels {
        let all: Vec<Channels> = (0..self.set.track_count())
            .map(|track| self.channel(track))
            .collect();
        let turning: Vec<_> = all.iter().map(|channels| channels.rotation).collect();
        let moving = all.iter().map(|channels| channels.translation);
        // The rotation of the joint itself does not move it.
        let moving: Vec<_> = moving.chain(turning[1..].iter().copied()).collect();
        let scaling: Vec<_> = all.iter().map(|channels| channels.scale).collect();
        Channels {
            rotation: joined(&turning),
            translation: joined(&moving),
            scale: joined(&scaling),
        }
    }
}

/// The sampler of a product of channels; those without a sampler are at rest.
fn joined(samplers: &[Option<ChannelInterpolation>]) -> Option<ChannelInterpolation> {
    let mut samplers = samplers.iter().copied().flatten();
    let first = samplers.next()?;
    Some(match first {
        ChannelInterpolation::Step if samplers.all(|it| it == first) => first,
        _ => ChannelInterpolation::Linear,
    })
}

/// Whether any track has keys of a channel.
fn has_keys(clip: &Motion, channel: Channel) -> bool {
    (0..clip.set.track_count()).any(|track| clip.set.vector_keys(channel, track).is_some())
}

/// A joint that has taken over the motion of the joints above it.
struct Product {
    times: Vec<f64>,
    rotations: Vec<Quat>,
    /// Empty if the joint does not move relative to its new parent.
    positions: Vec<DVec3>,
    scales: Vec<Vec3>,
    has_scales: bool,
    channels: Channels,
    /// At rest, except for its position.
    rest: Transform,
    position: DVec3,
}

impl Product {
    /// Adds the pose at a sample, in which `above` is the transform of the joints above it.
    fn add(&mut self, part: &Motion, samples: &Samples, frame: usize, above: Similarity) {
        let at = frame * part.set.track_count();
        let moved = samples.translations.get(at).copied();
        let moved = moved.unwrap_or_else(|| part.rest(Channel::Translation, 0));
        let scale = samples.scales.get(at).copied();
        let scale = scale.unwrap_or_else(|| part.rest(Channel::Scale, 0));
        let rotation = above.rotation * samples.rotations[at].as_dquat();
        self.rotations.push(rotation.normalize().as_quat());
        self.positions
            .push(above.point(part.origin(0) + moved.as_dvec3()));
        self.scales.push((above.scale * scale.as_dvec3()).as_vec3());
    }

    /// Adds the keys to a set, as a new track with the name of a joint.
    fn push(&self, clip: &Motion, track: usize, set: &mut TrackSet) -> Result<(), TrackError> {
        let (name, added) = (clip.set.track(track).name, set.track_count());
        set.push(name.unwrap_or_default(), &self.times, &self.rotations)?;
        if !self.positions.is_empty() {
            let (_, points) = relative(&self.positions);
            set.set_translations(added, &self.times, &points, &[])?;
        }
        if self.has_scales {
            set.set_scales(added, &self.times, &self.scales, &[])?;
        }
        Ok(())
    }

    /// Changes what a clip contains for the joint in addition to its keys.
    fn finish(self, index: usize, clip: &mut Motion) {
        if let Some(channels) = clip.channels.get_mut(index) {
            *channels = Channels {
                translation: self
                    .channels
                    .translation
                    .filter(|_| !self.positions.is_empty()),
                ..self.channels
            };
        }
        if let Some(written) = clip.written_joints.get_mut(index) {
            written.channels.clear();
        }
        if !self.positions.is_empty() {
            clip.set_origin(index, relative(&self.positions).0);
        }
        let parent = clip.skeleton[index].parent;
        clip.skeleton[index].rest = Transform {
            translation: clip.resting_at(index, parent, self.position),
            ..self.rest
        };
        // The robot that the file describes has the joints that were left out.
        clip.robot = None;
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;
    use tumble::{Device, method};

    use super::*;
    use crate::motion::Joint;
    use crate::motion::world::{WorldPose, world};

    /// A root that moves, two joints of the spine with keys at different times, and a head, which stands before its parents.
    fn clip() -> Motion {
        let mut clip = Motion::default();
        for (track, (name, parent, times)) in [
            ("head", Some(2), &[0.0, 0.5, 1.0][..]),
            ("hip", None, &[0.0, 1.0]),
            ("chest", Some(3), &[0.0, 0.25, 1.0]),
            ("belly", Some(1), &[0.0, 0.75, 1.0]),
            ("hand", Some(2), &[0.5]),
        ]
        .into_iter()
        .enumerate()
        {
            let angle = |time: f64| (1.0 + track as f32) * (time as f32 - 0.3);
            let keys = times
                .iter()
                .map(|&time| Quat::from_rotation_z(angle(time)) * Quat::from_rotation_x(0.7));
            clip.set
                .push(name, times, &keys.collect::<Vec<_>>())
                .unwrap();
            let rest = Transform {
                translation: Vec3::new(0.1, 0.5, 0.01 * track as f32),
                ..Transform::default()
            };
            clip.skeleton.push(Joint { parent, rest });
        }
        let moved = [Vec3::Y, Vec3::new(3.0, 1.0, 0.0)];
        clip.set
            .set_translations(1, &[0.0, 1.0], &moved, &[])
            .unwrap();
        clip
    }

    fn poses(clip: &Motion, times: &[f64]) -> Vec<WorldPose> {
        let engine = Engine::new(Device::Cpu).unwrap();
        let methods = ChannelMethods::by(method::SLERP);
        let samples = methods.sample(&engine, clip, &SampleTimes::at(times.to_vec()));
        world(clip, &samples.unwrap()).unwrap()
    }

    fn collapsed(clip: &Motion, tracks: &[usize]) -> Result<Motion, CollapseError> {
        let engine = Engine::new(Device::Cpu).unwrap();
        clip.collapsed(tracks, &engine, &ChannelMethods::by(method::SLERP))
    }

    #[test]
    fn kept_joints_have_the_same_poses_in_the_world_at_their_keys() {
        let clip = clip();
        for (tracks, parents) in [
            (&[1, 0, 4][..], &[None, Some(0), Some(0)][..]),
            (&[0, 3, 1], &[Some(1), Some(2), None]),
            (&[0, 4], &[None, None]),
            (&[1, 2, 3, 0], &[None, Some(2), Some(0), Some(1)]),
        ] {
            let kept = collapsed(&clip, tracks).unwrap();
            let found: Vec<_> = kept.skeleton.iter().map(|joint| joint.parent).collect();
            assert_eq!(found, parents);
            for (index, &track) in tracks.iter().enumerate() {
                assert_eq!(kept.set.track_name(index), clip.set.track_name(track));
                let times = kept.set.track(index).times;
                let (before, after) = (poses(&clip, times), poses(&kept, times));
                for at in 0..times.len() {
                    let before = before[at * clip.set.track_count() + track];
                    let after = after[at * tracks.len() + index];
                    assert!(before.position.distance(after.position) < 1e-6);
                    assert!(before.rotation.dot(after.rotation).abs() > 1.0 - 1e-6);
                }
            }
        }
        let head = collapsed(&clip, &[1, 0]).unwrap();
        assert_eq!(head.set.track(1).times, [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(head.set.track(0).keys, clip.set.track(1).keys);
    }

    /// Joints that do not turn leave an offset, and no keys.
    #[test]
    fn joints_at_rest_become_offsets() {
        let mut clip = clip();
        let mut set = TrackSet::new();
        for track in 0..5 {
            let times = &[0.0, 1.0];
            let angle = if track == 0 { 1.0 } else { 0.0 };
            let keys = [Quat::IDENTITY, Quat::from_rotation_y(angle)];
            set.push(clip.set.track_name(track), times, &keys).unwrap();
        }
        clip.set = set;
        let kept = collapsed(&clip, &[1, 0]).unwrap();
        assert!(kept.set.vector_keys(Channel::Translation, 1).is_none());
        let expected = DVec3::new(0.3, 1.5, 0.05);
        assert!(kept.rest_position(1).distance(expected) < 1e-7);
        let pairs = kept.set.track(1).keys.iter().zip(clip.set.track(0).keys);
        for (found, expected) in pairs {
            assert!(found.abs_diff_eq(*expected, 1e-6));
        }
    }

    #[test]
    fn scales_are_multiplied_if_they_are_even() {
        let mut clip = clip();
        clip.skeleton[3].rest.scale = Vec3::splat(2.0);
        let times = [0.0, 0.5, 1.0];
        let kept = collapsed(&clip, &[1, 0]).unwrap();
        let at = |clip: &Motion, joint: usize| -> Vec<(DVec3, DQuat)> {
            let poses = poses(clip, &times);
            let of_joint = poses.iter().skip(joint).step_by(clip.set.track_count());
            of_joint
                .map(|pose| (pose.position, pose.rotation.as_dquat()))
                .collect()
        };
        for (before, after) in at(&clip, 0).iter().zip(at(&kept, 1)) {
            assert!(before.0.distance(after.0) < 1e-6);
        }
        assert_eq!(kept.skeleton[1].rest.scale, Vec3::splat(2.0));
        clip.skeleton[3].rest.scale.x = 3.0;
        let error = collapsed(&clip, &[1, 0]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "`belly` is scaled differently along its axes, which its children cannot take over; keep this joint"
        );
    }
}
