//! Rotations together with translations and scales.

use crate::engine::Engine;
use crate::engine::clip::Clip;
use crate::error::Error;
use crate::evaluate::uploaded::Uploaded;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::VectorMethod;
use crate::output::rotations::{Layout, Rotations, Samples, Vectors};
use crate::prepare::clip_data::ClipData;
use crate::time::frames::SampleTimes;
use crate::tracks::set::TrackSet;
use crate::tracks::set::vectors::Channel;

/// The transform of every track at every sample: first scaled, then rotated, then translated.
#[derive(Debug)]
pub struct Transforms {
    /// Translations; 0 for tracks without translation keys.
    pub translations: Vectors,
    /// Rotations.
    pub rotations: Rotations,
    /// Scales; 1 for tracks without scale keys.
    pub scales: Vectors,
    /// Whether each track has translation keys. [`local_to_model`](Engine::local_to_model) uses the skeleton's
    /// offsets for the others.
    pub has_translation: Vec<bool>,
}

impl Engine {
    /// Evaluates rotations, translations and scales of a set at the same times. Translations and scales are
    /// interpolated by the method `vectors`, with the ends and wrap modes of `interpolation`.
    ///
    /// ```
    /// use glam::{Quat, Vec3};
    /// use tumble::{Device, Engine, SampleTimes, Layout, TrackSet, VectorMethod, method};
    /// let mut set = TrackSet::new();
    /// set.push("hip", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_y(1.0)])?;
    /// set.set_translations(0, &[0.0, 2.0], &[Vec3::ZERO, Vec3::X], &[])?;
    /// let engine = Engine::new(Device::Cpu)?;
    /// let frames = SampleTimes::fps(2); // from the first key of anything to the last
    /// let linear = VectorMethod::Linear;
    /// let found = engine.transforms(&set, method::SLERP, linear, &frames, Layout::TrackMajor)?;
    /// assert_eq!(found.translations.get(0, 1), Some(Vec3::new(0.25, 0.0, 0.0)));
    /// assert_eq!(found.scales.get(0, 4), Some(Vec3::ONE));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Engine::evaluate`].
    pub fn transforms(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        vectors: VectorMethod,
        frames: &SampleTimes,
        layout: Layout,
    ) -> Result<Transforms, Error> {
        let interpolation = interpolation.into();
        let evaluate = |channel| self.vectors(set, channel, vectors, interpolation, frames, layout);
        Ok(Transforms {
            translations: evaluate(Channel::Translation)?,
            rotations: self
                .request(set, interpolation, frames)
                .layout(layout)
                .evaluate()?,
            scales: evaluate(Channel::Scale)?,
            has_translation: (0..set.track_count())
                .map(|track| set.vectors(Channel::Translation, track).is_some())
                .collect(),
        })
    }

    /// Evaluates only translations or only scales; otherwise as [`Engine::transforms`].
    ///
    /// # Errors
    /// As [`Engine::evaluate`].
    pub fn vectors(
        &self,
        set: &TrackSet,
        channel: Channel,
        method: VectorMethod,
        interpolation: impl Into<Interpolation>,
        frames: &SampleTimes,
        layout: Layout,
    ) -> Result<Vectors, Error> {
        let interpolation = interpolation.into();
        interpolation.check()?;
        let group_bytes = self.backend.limits().group_bytes;
        let timeline = frames.resolve(set.track_count(), set.time_span())?;
        let only_for = Some(&timeline);
        let data =
            ClipData::of_vectors(set, channel, method, &interpolation, group_bytes, only_for)?;
        self.samples_of(data, frames, layout)
    }

    /// Evaluates prepared tracks.
    pub(super) fn samples_of<T>(
        &self,
        data: ClipData,
        frames: &SampleTimes,
        layout: Layout,
    ) -> Result<Samples<T>, Error> {
        let uploaded = Uploaded::of_data(&self.backend, data, None)?;
        let clip = Clip::new(self.clone(), uploaded);
        clip.samples(&clip.timeline(frames)?, layout)
    }
}
