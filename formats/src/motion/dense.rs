//! The key times of a clip, and clips whose keys are samples.

use glam::{Quat, Vec3};
use tumble::{Channel, Engine, Error, FrameRate, SampleTimes, TrackError, TrackSet};

use crate::motion::end_frame::{EndFrame, FramesToEnd, RateFrames, sample_to_end};
use crate::motion::sample::{ChannelMethods, Samples};
use crate::motion::{ChannelInterpolation, Channels, Motion};

impl Motion {
    /// The key times of all channels, in increasing order, without repetitions.
    #[must_use]
    pub fn key_times(&self) -> Vec<f64> {
        let mut times: Vec<f64> = Vec::new();
        let mut last: Option<&[f64]> = None;
        for list in self.key_lists() {
            // Tracks usually share their times.
            if last != Some(list) {
                times.extend_from_slice(list);
                last = Some(list);
            }
        }
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// The clip with its samples at some times as keys, joined by straight lines and arcs. Channels with steps keep
    /// their steps.
    ///
    /// # Errors
    /// As [`Engine::evaluate`].
    pub fn sampled(&self, engine: &Engine, frames: &SampleTimes) -> Result<Self, Error> {
        let methods = ChannelMethods::AUTHORED;
        Ok(self.with_keys(&methods.sample(engine, self, frames)?)?)
    }

    /// The clip with its samples at the frames of a rate as keys, and one at its end
    /// ([`EndFrame::Key`]).
    ///
    /// # Errors
    /// As [`Engine::evaluate`].
    pub fn sampled_at_rate(&self, engine: &Engine, rate: FrameRate) -> Result<Self, Error> {
        let frames = RateFrames {
            frames: SampleTimes::rate(rate),
            rate,
            end: self.set.time_span().map_or(0.0, |span| span.1),
        };
        let FramesToEnd { frames, end, .. } = FramesToEnd::new(self, frames, EndFrame::Key)?;
        let samples = sample_to_end(&ChannelMethods::AUTHORED, engine, self, &frames, end)?;
        Ok(self.with_keys(&samples)?)
    }

    /// The clip with `samples` as keys, as [`sampled`](Self::sampled) makes it.
    ///
    /// # Errors
    /// When a sample is not a valid key.
    pub fn with_keys(&self, samples: &Samples) -> Result<Self, TrackError> {
        let dense = self.with_track_keys(samples)?;
        dense.with_sampled_scalars_of(self, samples)
    }

    /// As [`with_keys`](Self::with_keys), without the scalars.
    ///
    /// # Errors
    /// As there.
    pub(crate) fn with_track_keys(&self, samples: &Samples) -> Result<Self, TrackError> {
        let tracks = self.set.track_count();
        let mut set = TrackSet::new();
        for track in 0..tracks {
            let of_track = |all: &[Vec3]| -> Vec<Vec3> {
                all.iter().skip(track).step_by(tracks).copied().collect()
            };
            let name = self.set.get(track).and_then(|track| track.name);
            let keys: Vec<Quat> = (samples.rotations.iter())
                .skip(track)
                .step_by(tracks)
                .copied()
                .collect();
            set.push(name.unwrap_or_default(), &samples.times, &keys)?;
            if self.set.vector_keys(Channel::Translation, track).is_some() {
                set.set_translations(track, &samples.times, &of_track(&samples.translations), &[])?;
            }
            if self.set.vector_keys(Channel::Scale, track).is_some() {
                set.set_scales(track, &samples.times, &of_track(&samples.scales), &[])?;
            }
        }
        let line = |sampler| match sampler {
            Some(ChannelInterpolation::Cubic) => Some(ChannelInterpolation::Linear),
            other => other,
        };
        let channels = self.channels.iter().map(|channels| Channels {
            rotation: line(channels.rotation),
            translation: line(channels.translation),
            scale: line(channels.scale),
        });
        Ok(Self {
            set,
            channels: channels.collect(),
            rate: None,
            ..self.without_tracks()
        })
    }

    /// The samples at the first and the last key time only, for formats that write the keys of the clip
    /// ([`SampledClip::is_at_keys`](crate::motion::SampledClip::is_at_keys)) instead.
    ///
    /// # Errors
    /// As [`Engine::evaluate`].
    pub fn ends(&self, engine: &Engine) -> Result<Samples, Error> {
        let (first, last) = self.set.time_span().unwrap_or_default();
        let mut times = vec![first, last];
        times.dedup();
        let methods = ChannelMethods::AUTHORED;
        methods.sample(engine, self, &SampleTimes::at(times))
    }

    /// Number of keys of all channels.
    #[must_use]
    pub fn key_count(&self) -> usize {
        self.key_lists().map(<[f64]>::len).sum()
    }

    /// The key times of each channel that has keys, and of each scalar.
    pub(crate) fn key_lists(&self) -> impl Iterator<Item = &[f64]> {
        let scalars = self.scalar_keys().map(|keys| keys.times);
        self.track_key_lists().chain(scalars)
    }

    /// The key times of each channel that has keys.
    fn track_key_lists(&self) -> impl Iterator<Item = &[f64]> {
        let channels = [Channel::Translation, Channel::Scale];
        (0..self.set.track_count()).flat_map(move |track| {
            let vectors = channels.map(|channel| self.set.vector_keys(channel, track));
            let rotations = self.set.get(track).map(|track| track.times);
            let vectors = vectors.into_iter().flatten().map(|keys| keys.times);
            rotations.into_iter().chain(vectors)
        })
    }

    /// The key times of all channels, each once, in order.
    pub(crate) fn track_key_times(&self) -> Vec<f64> {
        let mut times: Vec<f64> = self.track_key_lists().flatten().copied().collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }
}
