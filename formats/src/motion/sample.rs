//! Sampling clips: each channel by its own sampler, or all by one method.

use std::fmt;
use std::str::FromStr;

use glam::{Quat, Vec3, Vec4};
use tumble::{
    Channel, Engine, Error, FrameRate, Interpolation, InterpolationOptions, Layout, METHODS,
    Method, PerTrack, SampleTimes, ScalarQuantity, TrackSet, UnknownNameError, VectorMethod,
    method,
};

use crate::motion::signs::continue_signs;
use crate::motion::{ChannelInterpolation, Channels, Motion, SampledClip};

/// A method for every channel that is not STEP; `None`: as each channel's sampler says, and
/// [`method::BESSEL_OVERHAUSER`] where the file names none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MethodChoice(pub Option<Method>);

impl MethodChoice {
    /// Every channel as its sampler says.
    pub const AUTHORED: Self = Self(None);

    /// The name that programs use: `authored`, or that of the method.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.0.map_or("authored", |method| method.name)
    }

    /// The purpose, in one sentence.
    #[must_use]
    pub fn summary(self) -> &'static str {
        let authored =
            "as the file states for each channel; bessel-overhauser where it states none";
        self.0.map_or(authored, |method| method.summary)
    }

    /// `authored`, then all methods.
    pub fn all() -> impl Iterator<Item = Self> {
        let methods = METHODS.into_iter().map(Some);
        std::iter::once(None).chain(methods).map(Self)
    }
}

impl fmt::Display for MethodChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for MethodChoice {
    type Err = UnknownNameError;

    fn from_str(name: &str) -> Result<Self, UnknownNameError> {
        if name == Self::AUTHORED.name() {
            return Ok(Self::AUTHORED);
        }
        name.parse()
            .map(Some)
            .map(Self)
            .map_err(|mut error: UnknownNameError| {
                error.known.insert(0, Self::AUTHORED.name());
                error
            })
    }
}

/// The methods by which the channels of clips are interpolated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ChannelMethods {
    /// The method.
    pub method: MethodChoice,
    /// The options of every method, such as ends and wrap modes.
    pub options: InterpolationOptions,
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
    /// In the order `[sample][scalar]`.
    pub scalars: Vec<f32>,
}

impl ChannelMethods {
    /// Every channel as its sampler says, with the default options.
    pub const AUTHORED: Self = Self {
        method: MethodChoice::AUTHORED,
        options: InterpolationOptions::DEFAULT,
    };

    /// One method for all channels that are not STEP, with the default options.
    #[must_use]
    pub fn by(method: Method) -> Self {
        Self {
            method: MethodChoice(Some(method)),
            options: InterpolationOptions::DEFAULT,
        }
    }

    /// The method for the rotations of each track.
    #[must_use]
    pub fn methods<'a>(&self, clip: &'a Motion) -> impl ExactSizeIterator<Item = Method> + use<'a> {
        let (this, resting) = (*self, self.resting_method(clip));
        (0..clip.set.track_count())
            .map(move |track| this.rotation_method(clip.channel(track), resting))
    }

    /// The interpolation of each track's rotations.
    #[must_use]
    pub fn interpolations(&self, clip: &Motion) -> PerTrack<Interpolation> {
        let with = |method| self.options.with(method);
        match self.method_of(clip) {
            Some(method) => PerTrack::All(with(method)),
            None => PerTrack::Each(self.methods(clip).map(with).collect()),
        }
    }

    /// The one method for the rotations of all tracks; `None` where their samplers differ.
    #[must_use]
    pub fn method_of(&self, clip: &Motion) -> Option<Method> {
        let mut methods = self.methods(clip);
        let first = (methods.next()).unwrap_or_else(|| self.resting_method(clip));
        methods
            .all(|method| method.name == first.name)
            .then_some(first)
    }

    /// The name of the one method for the rotations of all tracks, or for the scalars of a clip without tracks; `None`
    /// where their samplers differ.
    #[must_use]
    pub fn name_of(&self, clip: &Motion) -> Option<&'static str> {
        if clip.set.track_count() > 0 {
            return self.method_of(clip).map(|method| method.name);
        }
        let scalars = 0..clip.set.scalar_count();
        let mut methods = scalars.map(|index| self.scalar_method(clip.scalar(index).interpolation));
        let first = methods.next()?;
        methods.all(|method| method == first).then(|| first.name())
    }

    /// The one method for all rotations that change; [`method::SLERP`] if none does.
    ///
    /// # Errors
    /// The names of the first two methods, where there are several.
    pub fn moving_method_of(&self, clip: &Motion) -> Result<Method, [&'static str; 2]> {
        let moves = |track: usize| {
            let track = clip.set.get(track);
            track.is_some_and(|track| track.keys.iter().any(|key| *key != track.keys[0]))
        };
        let methods = self.methods(clip).enumerate();
        let mut moving = methods
            .filter(|&(track, _)| moves(track))
            .map(|(_, method)| method);
        let first = moving.next().unwrap_or(method::SLERP);
        match moving.find(|method| *method != first) {
            Some(second) => Err([first.name, second.name]),
            None => Ok(first),
        }
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
        self.method.0.unwrap_or_else(|| most_common_method(clip))
    }

    fn rotation_method(&self, channels: Channels, resting: Method) -> Method {
        match channels.rotation {
            Some(ChannelInterpolation::Step) => method::STEP,
            Some(ChannelInterpolation::Linear) => self.method.0.unwrap_or(method::SLERP),
            Some(ChannelInterpolation::Cubic) => self.method.0.unwrap_or(method::GLTF_CUBIC),
            None => resting,
        }
    }

    pub(super) fn vector_method(&self, sampler: Option<ChannelInterpolation>) -> VectorMethod {
        self.method_by(sampler, |method| method.vector_method)
    }

    /// The method of a scalar, by its sampler.
    fn scalar_method(&self, sampler: Option<ChannelInterpolation>) -> VectorMethod {
        self.method_by(sampler, |method| method.scalar_method())
    }

    fn method_by(
        &self,
        sampler: Option<ChannelInterpolation>,
        of: impl Fn(Method) -> VectorMethod,
    ) -> VectorMethod {
        match (sampler, self.method.0) {
            (Some(ChannelInterpolation::Step), _) => VectorMethod::Step,
            (Some(ChannelInterpolation::Linear), None) => VectorMethod::Linear,
            (Some(ChannelInterpolation::Cubic), None) => VectorMethod::GltfCubic,
            (None, None) => VectorMethod::BesselOverhauser,
            (_, Some(method)) => of(method),
        }
    }

    /// Evaluates the scalars of a clip, or how fast they change, each by its own sampler, in the order
    /// `[sample][scalar]`. [Origins](crate::motion::Scalar::origin) are not added.
    ///
    /// # Errors
    /// As [`Engine::scalars`].
    pub fn scalars(
        &self,
        engine: &Engine,
        clip: &Motion,
        frames: &SampleTimes,
        quantity: ScalarQuantity,
    ) -> Result<Vec<f32>, Error> {
        let count = clip.set.scalar_count();
        if count == 0 {
            return Ok(Vec::new());
        }
        let timeline = frames.resolve(clip.set.track_count(), clip.set.time_span())?;
        // Frames are exact where their rate is known, and times in f64 are not.
        let frames = frames
            .clone()
            .spanning(clip.set.time_span().unwrap_or_default());
        let frames = match frames.resolve(0, None) {
            Ok(_) => frames,
            Err(_) => SampleTimes::at(timeline.times(0).collect()),
        };
        let layout = Layout::FrameMajor;
        let methods: Vec<VectorMethod> = (0..count)
            .map(|index| self.scalar_method(clip.scalar(index).interpolation))
            .collect();
        let mut all = vec![0.0; timeline.len() * count];
        for (first, &method) in methods.iter().enumerate() {
            if methods[..first].contains(&method) {
                continue;
            }
            // The scalars with this method are evaluated together, as a separate set.
            let of_method: Vec<usize> = (first..count)
                .filter(|&index| methods[index] == method)
                .collect();
            let mut set = TrackSet::new();
            for keys in of_method.iter().filter_map(|&index| clip.set.scalar(index)) {
                set.push_scalar("", keys.times, keys.keys, keys.tangents)?;
            }
            // c2 and the B-spline use the ends that they have for rotations.
            let of_ends = match method {
                VectorMethod::C2 => method::C2,
                VectorMethod::BSpline => method::B_SPLINE,
                _ => method::SLERP,
            };
            let how = self.options.with(of_ends);
            let found = engine.scalars(&set, quantity, method, how, &frames, layout)?;
            let rows = found.as_slice().chunks_exact(of_method.len());
            for (row, found) in all.chunks_exact_mut(count).zip(rows) {
                for (&index, &value) in of_method.iter().zip(found) {
                    row[index] = value;
                }
            }
        }
        Ok(all)
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
        let timeline = frames.resolve(tracks, clip.set.time_span())?;
        let times: Vec<f64> = timeline.times(0).collect();
        let layout = Layout::FrameMajor;
        let mut samples = Samples {
            rotations: self.rotations(engine, clip, frames, layout)?,
            times,
            ..Samples::default()
        };
        continue_signs(&mut samples.rotations, tracks);
        samples.translations = self.vectors(engine, clip, frames, Channel::Translation)?;
        samples.scales = self.vectors(engine, clip, frames, Channel::Scale)?;
        samples.scalars = self.scalars(engine, clip, frames, ScalarQuantity::Value)?;
        Ok(samples)
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
        let request = engine.request(&clip.set, self.interpolations(clip), frames);
        Ok(request.layout(layout).evaluate()?.as_quats().to_vec())
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
        let request = engine.request(&clip.set, self.interpolations(clip), frames);
        Ok(request.layout(layout).rates()?.as_slice().to_vec())
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
        let method = |track: usize| self.vector_method(clip.channel(track).of(channel));
        let first_keyed = (0..tracks).find(|&track| is_keyed(track)).unwrap_or(0);
        // A track without keys goes with others: its vectors are replaced.
        let methods =
            (0..tracks).map(|track| method(if is_keyed(track) { track } else { first_keyed }));
        let methods: Vec<VectorMethod> = methods.collect();
        let (how, layout) = (self.options.with(method::SLERP), Layout::FrameMajor);
        let found = engine.vectors(&clip.set, channel, methods, how, frames, layout)?;
        let of_track = (0..tracks).cycle().zip(found.as_slice());
        let vector = |(track, found): (usize, &Vec4)| match is_keyed(track) {
            true => found.truncate(),
            false => rests[track],
        };
        Ok(of_track.map(vector).collect())
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
            scalars: &self.scalars,
            notes,
            is_at_keys: false,
        }
    }
}

/// The method for which most of the rotations are keyed.
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
        let methods = ChannelMethods::AUTHORED;
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
