//! Transforms of joints without shear.

use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::Channel;

use crate::motion::Motion;
use crate::motion::sample::Samples;

/// A transform without shear: first the scale, which is equal along all axes, then the rotation and the translation.
#[derive(Clone, Copy)]
pub(crate) struct Similarity {
    pub(crate) scale: f64,
    pub(crate) rotation: DQuat,
    pub(crate) position: DVec3,
}

impl Similarity {
    pub(crate) const IDENTITY: Self = Self {
        scale: 1.0,
        rotation: DQuat::IDENTITY,
        position: DVec3::ZERO,
    };

    pub(crate) fn point(self, point: DVec3) -> DVec3 {
        self.position + self.rotation * (self.scale * point)
    }

    pub(crate) fn point_back(self, point: DVec3) -> DVec3 {
        self.rotation.conjugate() * (point - self.position) / self.scale
    }

    pub(crate) fn then(self, child: Self) -> Self {
        Self {
            scale: self.scale * child.scale,
            rotation: self.rotation * child.rotation,
            position: self.point(child.position),
        }
    }

    /// The transform of a joint at a sample; `None` if its scale differs between its axes.
    pub(crate) fn of_joint(
        clip: &Motion,
        samples: &Samples,
        frame: usize,
        track: usize,
    ) -> Option<Self> {
        let at = frame * clip.set.track_count() + track;
        let scale = samples.scales.get(at).copied();
        let moved = samples.translations.get(at).copied();
        let moved = moved.unwrap_or_else(|| clip.rest(Channel::Translation, track));
        Self::even(
            scale.unwrap_or_else(|| clip.rest(Channel::Scale, track)),
            samples.rotations[at],
            clip.origin(track) + moved.as_dvec3(),
        )
    }

    /// The transform of a joint at rest; `None` if its scale differs between its axes.
    pub(crate) fn at_rest(clip: &Motion, track: usize) -> Option<Self> {
        let rest = clip.skeleton.get(track).map(|joint| joint.rest);
        let rest = rest.unwrap_or_default();
        Self::even(rest.scale, rest.rotation, clip.rest_position(track))
    }

    fn even(scale: Vec3, rotation: Quat, position: DVec3) -> Option<Self> {
        let scale = scale.as_dvec3();
        let is_even = (scale - DVec3::splat(scale.x)).abs().max_element() <= 1e-6 * scale.x;
        (is_even && scale.x > 0.0).then(|| Self {
            scale: scale.x,
            rotation: rotation.as_dquat().normalize(),
            position,
        })
    }
}
