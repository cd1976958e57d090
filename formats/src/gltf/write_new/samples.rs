//! Converts the samples of one clip to those of the channels of a glTF file: one joint at a time, relative to its
//! parent.

use std::io;

use glam::{DQuat, Quat, Vec3};

use tumble::signs_differ;

use crate::gltf::schema::TargetPath;
use crate::motion::{ChannelInterpolation, Channels, SampledClip, Transform};

/// The property that a channel moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Property {
    Rotation,
    Translation,
    Scale,
}

impl Property {
    pub(super) const ALL: [Self; 3] = [Self::Rotation, Self::Translation, Self::Scale];

    /// The path of a channel's target.
    pub(super) fn path(self) -> TargetPath {
        match self {
            Self::Rotation => TargetPath::Rotation,
            Self::Translation => TargetPath::Translation,
            Self::Scale => TargetPath::Scale,
        }
    }
}

/// A clip whose lists have the right lengths.
#[derive(Clone, Copy)]
pub(super) struct ClipSamples<'a> {
    clip: &'a SampledClip<'a>,
    pub(super) tracks: usize,
}

impl<'a> ClipSamples<'a> {
    /// # Errors
    /// `InvalidInput` when a list is too short or too long.
    pub(super) fn of(clip: &'a SampledClip<'a>) -> io::Result<Self> {
        clip.checked_len()?;
        let tracks = clip.clip.set.track_count();
        Ok(Self { clip, tracks })
    }

    pub(super) fn clip(self) -> &'a SampledClip<'a> {
        self.clip
    }

    /// The number of samples.
    pub(super) fn len(self) -> usize {
        self.clip.times.len()
    }

    /// Whether its poses are relative to the world, and scaled parents must be taken into account.
    pub(super) fn has_scaled_parents_in_world(self) -> bool {
        let clip = self.clip.clip;
        let has_scales = !self.clip.scales.is_empty()
            || clip
                .skeleton
                .iter()
                .any(|joint| joint.rest.scale != Vec3::ONE);
        clip.is_world && has_scales && clip.skeleton.iter().any(|joint| joint.parent.is_some())
    }

    /// The interpolation of a property of a track in the file; `None` if it has no channel: rotations of tracks
    /// without keys, and translations and scales that always equal the rest transform.
    pub(super) fn interpolation(self, track: usize, property: Property) -> Option<&'static str> {
        const ALL: Channels = Channels {
            rotation: Some(ChannelInterpolation::Linear),
            translation: Some(ChannelInterpolation::Linear),
            scale: Some(ChannelInterpolation::Linear),
        };
        let channels = self.clip.clip.channels.get(track).unwrap_or(&ALL);
        let rest = self.rest(track);
        let (sampler, moves) = match property {
            Property::Rotation => (channels.rotation, true),
            Property::Translation => {
                let rest = rest.translation.to_array();
                let moves = self
                    .translations(track)
                    .any(|translation| translation != rest);
                (channels.translation, moves)
            }
            Property::Scale => {
                let rest = rest.scale.to_array();
                (
                    channels.scale,
                    self.scales(track).any(|sampled| sampled != rest),
                )
            }
        };
        match sampler? {
            _ if !moves => None,
            ChannelInterpolation::Step => Some("STEP"),
            ChannelInterpolation::Linear | ChannelInterpolation::Cubic => Some("LINEAR"),
        }
    }

    /// The rotations of a track, with continued signs.
    pub(super) fn rotations(self, track: usize) -> impl Iterator<Item = [f32; 4]> + use<'a> {
        let mut before = None;
        (0..self.len()).map(move |sample| {
            let rotation = self.rotation(sample, track);
            let is_negated = before.is_some_and(|before: Quat| signs_differ(before, rotation));
            before
                .insert(if is_negated { -rotation } else { rotation })
                .to_array()
        })
    }

    /// The translations of a track; empty if the clip has none.
    pub(super) fn translations(self, track: usize) -> impl Iterator<Item = [f32; 3]> + use<'a> {
        let samples = self.clip.translations.len() / self.tracks.max(1);
        (0..samples).map(move |sample| self.translation(sample, track).to_array())
    }

    /// The scales of a track; empty if the clip has none.
    pub(super) fn scales(self, track: usize) -> impl Iterator<Item = [f32; 3]> + use<'a> {
        let scales = self.clip.scales.get(track..).unwrap_or_default();
        scales
            .iter()
            .step_by(self.tracks.max(1))
            .map(Vec3::to_array)
    }

    fn rest(self, track: usize) -> Transform {
        let joint = self.clip.clip.skeleton.get(track);
        joint.map(|joint| joint.rest).unwrap_or_default()
    }

    /// The parent of a track in a clip whose poses are relative to the world.
    fn parent_in_world(self, track: usize) -> Option<usize> {
        let clip = self.clip.clip;
        clip.skeleton.get(track)?.parent.filter(|_| clip.is_world)
    }

    fn rotation(self, sample: usize, track: usize) -> Quat {
        let in_world = self.clip.rotations[sample * self.tracks + track];
        match self.parent_in_world(track) {
            None => in_world,
            Some(parent) => (self.inverse_rotation(sample, parent) * in_world.as_dquat()).as_quat(),
        }
    }

    fn translation(self, sample: usize, track: usize) -> Vec3 {
        match self.parent_in_world(track) {
            None => self.clip.translation(sample, track),
            Some(parent) => {
                let arm = self.clip.position(sample, track) - self.clip.position(sample, parent);
                (self.inverse_rotation(sample, parent) * arm).as_vec3()
            }
        }
    }

    /// The inverse of a track's rotation.
    fn inverse_rotation(self, sample: usize, track: usize) -> DQuat {
        let rotation = self.clip.rotations[sample * self.tracks + track];
        rotation.as_dquat().normalize().conjugate()
    }
}
