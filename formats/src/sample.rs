//! Sampling clips: each channel by its own sampler, or all by one method.

use std::borrow::Cow;

use glam::{Quat, Vec3, Vec4};
use tumble::{
    Channel, Engine, Error, FrameRate, Interpolation, Layout, Method, Rotations, SampleTimes,
    TrackSet, VectorMethod, Vectors, method,
};

use crate::motion::{ChannelInterpolation, Channels, Motion, SampledClip};
use crate::signs::continue_signs;

/// The methods by which the channels of clips are interpolated.
#[derive(Clone, Copy)]
pub struct ChannelMethods<'a> {
    /// The method for all channels that are not STEP; `None`: as each channel's sampler says, and
    /// [`method::BESSEL_OVERHAUSER`] where the file names none.
    pub method: Option<Method>,
    /// What else is said of the interpolation, such as ends and wrap modes, for a method.
    pub with: &'a dyn Fn(Method) -> Interpolation,
}

/// The rotations, translations and scales of a clip, in the order `[sample][track]`.
#[derive(Debug, Clone, Default)]
pub struct Samples {
    /// Seconds, increasing or in any order that was asked for.
    pub times: Vec<f64>,
    /// Unit quaternions.
    pub rotations: Vec<Quat>,
    /// Empty where no track has translations.
    pub translations: Vec<Vec3>,
    /// Empty where no track has scales.
    pub scales: Vec<Vec3>,
}

impl ChannelMethods<'static> {
    /// Every channel as its sampler says, with the default options.
    pub const AUTHORED: Self = Self {
        method: None,
        with: &|method| Interpolation::from(method),
    };
}

impl ChannelMethods<'_> {
    /// The one method for the rotations of all tracks; `None` where their samplers differ.
    #[must_use]
    pub fn method_of(&self, clip: &Motion) -> Option<Method> {
        let resting = self.resting_method(clip);
        let mut methods = (0..clip.set.track_count())
            .map(|track| self.rotation_method(clip.channel(track), resting));
        let first = methods.next().unwrap_or(resting);
        methods
            .all(|method| method.name == first.name)
            .then_some(first)
    }

    /// The one method for the translations and scales of all tracks; `None` where their samplers
    /// differ. Keys that are all the same count for none: every method holds them.
    #[must_use]
    pub fn vector_method_of(&self, clip: &Motion) -> Option<VectorMethod> {
        let channels = [Channel::Translation, Channel::Scale];
        let tracks = 0..clip.set.track_count();
        let all = tracks.flat_map(|track| channels.map(|channel| (track, channel)));
        let mut methods = all.filter_map(|(track, channel)| {
            let keys = clip.set.vector_keys(channel, track)?;
            let moves =
                !keys.tangents.is_empty() || keys.keys.iter().any(|key| *key != keys.keys[0]);
            moves.then(|| self.vector_method(clip.channel(track).of(channel)))
        });
        let first = methods.next().unwrap_or_default();
        methods.all(|method| method == first).then_some(first)
    }

    /// The method of tracks whose rotation has no sampler. One at rest has one key, which every
    /// method holds: it goes with most of the others.
    fn resting_method(&self, clip: &Motion) -> Method {
        self.method.unwrap_or_else(|| most_common_method(clip))
    }

    fn rotation_method(&self, channels: Channels, resting: Method) -> Method {
        match channels.rotation {
            Some(ChannelInterpolation::Step) => method::STEP,
            Some(ChannelInterpolation::Linear) => self.method.unwrap_or(method::SLERP),
            Some(ChannelInterpolation::Cubic) => self.method.unwrap_or(method::GLTF_CUBIC),
            None => resting,
        }
    }

    fn vector_method(&self, sampler: Option<ChannelInterpolation>) -> VectorMethod {
        match (sampler, self.method) {
            (Some(ChannelInterpolation::Step), _) => VectorMethod::Step,
            (Some(ChannelInterpolation::Linear), None) => VectorMethod::Linear,
            (Some(ChannelInterpolation::Cubic), None) => VectorMethod::GltfCubic,
            (None, None) => VectorMethod::BesselOverhauser,
            (_, Some(method)) => method.vector_method,
        }
    }

    /// Evaluates all channels of a clip.
    ///
    /// # Errors
    /// As [`Engine::evaluate`].
    pub fn sample(
        &self,
        engine: &Engine,
        clip: &Motion,
        frames: &SampleTimes,
    ) -> Result<Samples, Error> {
        let tracks = clip.set.track_count();
        let frames = over(clip, frames);
        let timeline = frames.resolve(tracks, None)?;
        let times: Vec<f64> = timeline.times(0).collect();
        let layout = Layout::FrameMajor;
        let mut samples = Samples {
            rotations: self.rotations(engine, clip, &frames, layout)?,
            times,
            ..Samples::default()
        };
        continue_signs(&mut samples.rotations, tracks);
        samples.translations = self.vectors(engine, clip, &frames, Channel::Translation)?;
        samples.scales = self.vectors(engine, clip, &frames, Channel::Scale)?;
        Ok(samples)
    }

    /// The tracks of a clip by the methods of their rotations.
    #[must_use]
    pub fn groups_of(&self, clip: &Motion) -> Vec<(Method, Vec<usize>)> {
        let resting = self.resting_method(clip);
        let method = |track: usize| self.rotation_method(clip.channel(track), resting);
        groups(clip.set.track_count(), |track| method(track).name)
            .into_iter()
            .map(|group| (method(group[0]), group))
            .collect()
    }

    /// Evaluates the rotations of a clip, each track by its own sampler.
    ///
    /// # Errors
    /// As [`Engine::evaluate`].
    pub fn rotations(
        &self,
        engine: &Engine,
        clip: &Motion,
        frames: &SampleTimes,
        layout: Layout,
    ) -> Result<Vec<Quat>, Error> {
        let frames = over(clip, frames);
        let evaluate =
            |set: &TrackSet, how| engine.request(set, how, &frames).layout(layout).evaluate();
        self.by_method(clip, layout, evaluate, Rotations::as_quats)
    }

    /// As [`ChannelMethods::rotations`], the angular velocities or accelerations, each followed by
    /// 0.
    ///
    /// # Errors
    /// As [`Engine::rates`].
    pub fn rates(
        &self,
        engine: &Engine,
        clip: &Motion,
        frames: &SampleTimes,
        layout: Layout,
    ) -> Result<Vec<Vec4>, Error> {
        let frames = over(clip, frames);
        let evaluate = |set: &TrackSet, how| engine.rates(set, how, &frames, layout);
        self.by_method(clip, layout, evaluate, Vectors::as_slice)
    }

    /// The values of all tracks; `evaluate` gives those of tracks with one method.
    fn by_method<S, T: Copy + Default>(
        &self,
        clip: &Motion,
        layout: Layout,
        evaluate: impl Fn(&TrackSet, Interpolation) -> Result<tumble::Samples<S>, Error>,
        values: fn(&tumble::Samples<S>) -> &[T],
    ) -> Result<Vec<T>, Error> {
        let tracks = clip.set.track_count();
        let mut all = Vec::new();
        for (method, group) in self.groups_of(clip) {
            let interpolation = (self.with)(method);
            let set = selected(clip, &group)?;
            let found = evaluate(&set, interpolation)?;
            all.resize(tracks * found.sample_count(), T::default());
            scatter(values(&found), &group, tracks, layout, &mut all);
        }
        Ok(all)
    }

    /// The vectors of all tracks; none where no track has keys of them and no rest matters.
    fn vectors(
        &self,
        engine: &Engine,
        clip: &Motion,
        frames: &SampleTimes,
        channel: Channel,
    ) -> Result<Vec<Vec3>, Error> {
        let tracks = clip.set.track_count();
        let is_keyed = |track: usize| clip.set.vector_keys(channel, track).is_some();
        let rests: Vec<Vec3> = (0..tracks).map(|track| clip.rest(channel, track)).collect();
        let nothing = Motion::default().rest(channel, 0);
        if !(0..tracks).any(is_keyed) && rests.iter().all(|&rest| rest == nothing) {
            return Ok(Vec::new());
        }
        let samples = frames.resolve(tracks, None)?.len();
        let mut all: Vec<Vec3> = (0..samples).flat_map(|_| rests.iter().copied()).collect();
        let method = |track: usize| self.vector_method(clip.channel(track).of(channel));
        for group in groups(tracks, |track| {
            is_keyed(track).then(|| method(track).name())
        }) {
            if !is_keyed(group[0]) {
                continue;
            }
            let set = selected(clip, &group)?;
            let interpolation = (self.with)(method::SLERP);
            let method = method(group[0]);
            let layout = Layout::FrameMajor;
            let found = engine.vectors(&set, channel, method, interpolation, frames, layout)?;
            let found: Vec<Vec3> = found.as_slice().iter().map(|v| v.truncate()).collect();
            scatter(&found, &group, tracks, layout, &mut all);
        }
        Ok(all)
    }
}

impl Samples {
    /// The samples as writers take them. `notes` say what made them.
    #[must_use]
    pub fn of<'a>(
        &'a self,
        clip: &'a Motion,
        rate: Option<FrameRate>,
        notes: &'a [(&'a str, String)],
    ) -> SampledClip<'a> {
        SampledClip {
            clip,
            times: &self.times,
            rate,
            rotations: &self.rotations,
            translations: &self.translations,
            scales: &self.scales,
            notes,
            is_at_keys: false,
        }
    }
}

/// Some tracks as a separate set; borrowed where the group is all tracks.
fn selected<'a>(clip: &'a Motion, group: &[usize]) -> Result<Cow<'a, TrackSet>, Error> {
    if group.len() == clip.set.track_count() {
        return Ok(Cow::Borrowed(&clip.set));
    }
    Ok(Cow::Owned(clip.set.select(group.iter().copied())?))
}

/// What most of the rotations are keyed for.
fn most_common_method(clip: &Motion) -> Method {
    let count = |sampler| {
        let keyed = clip
            .channels
            .iter()
            .filter(|channels| channels.rotation == Some(sampler));
        keyed.count()
    };
    let samplers = [
        (count(ChannelInterpolation::Linear), method::SLERP),
        (count(ChannelInterpolation::Cubic), method::GLTF_CUBIC),
        (count(ChannelInterpolation::Step), method::STEP),
    ];
    let commonest = samplers.into_iter().rev().max_by_key(|(count, _)| *count);
    match commonest {
        Some((count, method)) if count > 0 => method,
        _ => method::BESSEL_OVERHAUSER,
    }
}

/// Frames over the whole of a clip: all tracks are sampled at the same times, whatever their own keys
/// span and whichever of them are evaluated together.
fn over(clip: &Motion, frames: &SampleTimes) -> SampleTimes {
    let span = clip.set.time_span();
    span.map_or_else(|| frames.clone(), |span| frames.clone().spanning(span))
}

/// Tracks with the same property, in lists, by the first of each.
fn groups<P: PartialEq>(tracks: usize, property: impl Fn(usize) -> P) -> Vec<Vec<usize>> {
    let mut groups: Vec<(P, Vec<usize>)> = Vec::new();
    for track in 0..tracks {
        let value = property(track);
        match groups.iter_mut().find(|(known, _)| *known == value) {
            Some((_, group)) => group.push(track),
            None => groups.push((value, vec![track])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// Puts the values of a group of tracks where they belong among those of all.
fn scatter<T: Copy>(values: &[T], group: &[usize], tracks: usize, layout: Layout, all: &mut [T]) {
    let samples = values.len() / group.len();
    for (index, &track) in group.iter().enumerate() {
        for sample in 0..samples {
            let to = layout.index(track, sample, tracks, samples);
            let from = layout.index(index, sample, group.len(), samples);
            if let (Some(to), Some(from)) = (to, from) {
                all[to] = values[from];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tracks_of_other_methods_and_spans_are_sampled_at_the_same_times() {
        let mut clip = Motion::default();
        let keys = [Quat::IDENTITY, Quat::from_rotation_x(1.0)];
        for (last, sampler) in [
            (1.0, ChannelInterpolation::Linear),
            (3.0, ChannelInterpolation::Step),
        ] {
            clip.set.push("", &[0.0, last], &keys).unwrap();
            clip.channels.push(Channels {
                rotation: Some(sampler),
                ..Channels::default()
            });
        }
        let methods = ChannelMethods {
            method: None,
            with: &Interpolation::from,
        };
        let engine = Engine::new(tumble::Device::Cpu).unwrap();
        let (frames, layout) = (SampleTimes::fps(2), Layout::TrackMajor);
        let found = methods.rotations(&engine, &clip, &frames, layout).unwrap();
        assert_eq!(found.len(), 2 * 7);
        assert_eq!(
            [found[2], found[6], found[12], found[13]],
            [keys[1], keys[1], keys[0], keys[1]]
        );
    }

    #[test]
    fn still_vectors_go_with_every_method() {
        let mut clip = Motion::default();
        for _ in 0..3 {
            clip.set.push("", &[0.0], &[Quat::IDENTITY]).unwrap();
        }
        let methods = ChannelMethods::AUTHORED;
        assert_eq!(methods.vector_method_of(&clip), Some(VectorMethod::Linear));
        let (times, moving) = ([0.0, 1.0], [Vec3::ZERO, Vec3::X]);
        clip.channels = [
            ChannelInterpolation::Step,
            ChannelInterpolation::Cubic,
            ChannelInterpolation::Linear,
        ]
        .map(|sampler| Channels {
            translation: Some(sampler),
            scale: Some(sampler),
            ..Channels::default()
        })
        .to_vec();
        clip.set
            .set_translations(0, &times, &[Vec3::Y; 2], &[])
            .unwrap();
        clip.set.set_translations(2, &times, &moving, &[]).unwrap();
        assert_eq!(methods.vector_method_of(&clip), Some(VectorMethod::Linear));
        let tangents = [[Vec3::Z; 2]; 2];
        clip.set
            .set_scales(1, &times, &[Vec3::ONE; 2], &tangents)
            .unwrap();
        assert_eq!(methods.vector_method_of(&clip), None);
    }
}
