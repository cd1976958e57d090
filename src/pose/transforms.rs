//! Rotations with the translations and the scales beside them.

use glam::{Quat, Vec3, Vec4};

use crate::clip::Clip;
use crate::engine::Engine;
use crate::error::Error;
use crate::evaluate::uploaded::Uploaded;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::VectorMethod;
use crate::output::rotations::{Layout, Rotations};
use crate::prepare::clip_data::ClipData;
use crate::time::frames::Frames;
use crate::tracks::set::TrackSet;
use crate::tracks::vectors::Channel;

/// The transform of every track at every sample: scaled first, then turned, then moved.
#[derive(Debug)]
pub struct Transforms {
    /// Translations; 0 for tracks that have no keys of them.
    pub translations: Vectors,
    /// Rotations.
    pub rotations: Rotations,
    /// Scales; 1 for tracks that have no keys of them.
    pub scales: Vectors,
}

/// A vector of every track at every sample, `x y z 0` in memory.
#[derive(Debug)]
pub struct Vectors(Rotations);

impl Vectors {
    pub(crate) fn new(values: Rotations) -> Self {
        Self(values)
    }

    /// Vectors from elsewhere, of so many tracks, in this order; `None` if their number is not a
    /// multiple of the tracks'.
    #[must_use]
    pub fn of(vectors: &[Vec3], tracks: usize, layout: Layout) -> Option<Self> {
        let rows: Vec<Quat> = vectors
            .iter()
            .map(|v| Quat::from_vec4(v.extend(0.0)))
            .collect();
        Rotations::of(&rows, tracks, layout).map(Self)
    }

    /// As rows of four numbers.
    pub(crate) fn rows(&self) -> &Rotations {
        &self.0
    }

    /// The vector of one track at one sample; `None` out of range.
    #[must_use]
    pub fn get(&self, track: usize, sample: usize) -> Option<Vec3> {
        let [x, y, z, _] = self.0.get(track, sample)?.to_array();
        Some(Vec3::new(x, y, z))
    }

    /// All of them, in the order of the rotations beside them.
    #[must_use]
    pub fn as_slice(&self) -> &[Vec4] {
        bytemuck::cast_slice(self.0.as_quats())
    }
}

impl Engine {
    /// Evaluates rotations, translations and scales of a set at the same frames. Translations and
    /// scales follow the method `vectors`, with the ends and wrap modes of `interpolation`.
    ///
    /// ```
    /// use glam::{Quat, Vec3};
    /// use tumble::{Device, Engine, Frames, Layout, TrackSet, VectorMethod, method};
    /// let mut set = TrackSet::new();
    /// set.push("hip", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_y(1.0)])?;
    /// set.set_translations(0, &[0.0, 2.0], &[Vec3::ZERO, Vec3::X], &[])?;
    /// let engine = Engine::new(Device::Cpu)?;
    /// let frames = Frames::fps(2); // from the first key of anything to the last
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
        frames: &Frames,
        layout: Layout,
    ) -> Result<Transforms, Error> {
        let interpolation = interpolation.into();
        let evaluate = |channel| self.vectors(set, channel, vectors, interpolation, frames, layout);
        Ok(Transforms {
            translations: evaluate(Channel::Translation)?,
            rotations: self.evaluate_as(set, interpolation, frames, layout)?,
            scales: evaluate(Channel::Scale)?,
        })
    }

    /// Evaluates the translations or the scales alone; otherwise as [`Engine::transforms`].
    ///
    /// # Errors
    /// As [`Engine::evaluate`].
    pub fn vectors(
        &self,
        set: &TrackSet,
        channel: Channel,
        method: VectorMethod,
        interpolation: impl Into<Interpolation>,
        frames: &Frames,
        layout: Layout,
    ) -> Result<Vectors, Error> {
        let interpolation = interpolation.into();
        let group_bytes = self.backend.group_bytes();
        let data = ClipData::of_vectors(set, channel, method, &interpolation, group_bytes);
        let uploaded = Uploaded::of_data(&self.backend, data, None)?;
        let clip = Clip::new(self.clone(), uploaded);
        clip.evaluate_as(frames, layout).map(Vectors)
    }
}
