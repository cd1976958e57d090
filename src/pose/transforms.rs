//! Rotations together with translations and scales.

use crate::engine::Engine;
use crate::engine::clip::Clip;
use crate::engine::groups::fill_by_group;
use crate::error::Error;
use crate::evaluate::uploaded::Uploaded;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::{ScalarQuantity, VectorMethod};
use crate::output::buffer::OutputBuffer;
use crate::output::encoded::EncodedOutput;
use crate::output::rotations::{Layout, Rotations, Samples, Vectors};
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::time::frames::{SampleTimes, Timeline};
use crate::tracks::per_track::PerTrack;
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
    /// interpolated by the method `vectors`, with the ends and wrap modes of `interpolations`. Both are for all tracks,
    /// or [for each](PerTrack).
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
        interpolations: impl Into<PerTrack<Interpolation>>,
        vectors: impl Into<PerTrack<VectorMethod>>,
        times: &SampleTimes,
        layout: Layout,
    ) -> Result<Transforms, Error> {
        let (interpolations, vectors) = (interpolations.into(), vectors.into());
        let evaluate = |channel| {
            let (vectors, interpolations) = (vectors.clone(), interpolations.clone());
            self.vectors(set, channel, vectors, interpolations, times, layout)
        };
        Ok(Transforms {
            translations: evaluate(Channel::Translation)?,
            scales: evaluate(Channel::Scale)?,
            rotations: self
                .request(set, interpolations, times)
                .layout(layout)
                .evaluate()?,
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
        methods: impl Into<PerTrack<VectorMethod>>,
        interpolations: impl Into<PerTrack<Interpolation>>,
        times: &SampleTimes,
        layout: Layout,
    ) -> Result<Vectors, Error> {
        let tracks = set.track_count();
        let all = methods.into().zip(interpolations.into(), tracks)?;
        let timeline = times.resolve(tracks, set.time_span())?;
        if let Some((method, interpolation)) = all.uniform(tracks) {
            let clip = self.clip_of_vectors(set, channel, method, interpolation, &timeline)?;
            return clip.samples(&timeline, layout);
        }
        let groups = all.groups(tracks)?;
        let lists = groups.iter().map(|group| &*group.tracks);
        let window = Window::whole(tracks, timeline.len(), layout);
        let mut quats = OutputBuffer::new(window.len())?;
        let output = bytemuck::cast_slice_mut(&mut quats);
        let output = EncodedOutput::of_values(output);
        fill_by_group(lists, &window, output, |group, part, found| {
            let (method, interpolation) = groups[group].value;
            let tracks = &groups[group].tracks[part];
            let set = set.select(tracks.iter().copied())?;
            let timeline = timeline.of_listed(tracks);
            let clip = self.clip_of_vectors(&set, channel, method, interpolation, &timeline)?;
            let whole = Window::whole(tracks.len(), timeline.len(), layout);
            clip.fill_window(&timeline, &whole, found)
        })?;
        Ok(Samples::new(
            Box::new(quats),
            tracks,
            timeline.len(),
            layout,
        ))
    }

    /// The vectors of a set, prepared for some sample times.
    fn clip_of_vectors(
        &self,
        set: &TrackSet,
        channel: Channel,
        method: VectorMethod,
        interpolation: Interpolation,
        only_for: &Timeline,
    ) -> Result<Clip, Error> {
        let value = ScalarQuantity::Value;
        let request = self.vector_request(value, method, &interpolation, only_for)?;
        let data = ClipData::of_vectors(set, channel, &request)?;
        self.clip_of(data)
    }

    /// Evaluates prepared tracks.
    pub(super) fn samples_of<T>(
        &self,
        data: ClipData,
        times: &SampleTimes,
        layout: Layout,
    ) -> Result<Samples<T>, Error> {
        let clip = self.clip_of(data)?;
        clip.samples(&clip.timeline(times)?, layout)
    }

    pub(super) fn clip_of(&self, data: ClipData) -> Result<Clip, Error> {
        let uploaded = Uploaded::of_data(&self.machine, data)?;
        Ok(Clip::new(self.clone(), uploaded, 0))
    }
}
