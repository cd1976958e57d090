//! The keys of a clip as samples, for formats that store all joints at the same times.

use glam::{Quat, Vec3};
use tumble::{Channel, Device, Engine, Error, SampleTimes, ScalarKeys, ScalarQuantity};

use crate::feature::Feature;
use crate::format::Format;
use crate::motion::sample::{ChannelMethods, Samples};
use crate::motion::signs::continue_signs;
use crate::motion::{ChannelInterpolation, Motion};

/// Why the keys of a clip cannot serve as samples.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum KeyedError {
    /// Channels have keys at different times.
    #[error(
        "track {track} (`{name}`) has keys at other times than other tracks or scalars, and the format has one list of \
         times; sample them together with `tumble eval --fps`, or write Parquet or Arrow, in which each track may \
         have its own times"
    )]
    TimesDiffer {
        /// Index of the first track whose times differ, from 0.
        track: usize,
        /// Name of that track.
        name: String,
    },
    /// A scalar has keys at other times than the others.
    #[error(
        "the scalar {scalar} (`{name}`) has keys at other times than the tracks, or tangents; sample them \
         together with `tumble eval --fps`"
    )]
    Scalar {
        /// Index of the first such scalar, from 0.
        scalar: usize,
        /// Name of that scalar.
        name: String,
    },
    /// A channel is a cubic spline with tangents, which samples do not contain.
    #[error(
        "track {track} (`{name}`) is a cubic spline with tangents, which keys alone do not contain; \
         sample it with `tumble eval --fps`"
    )]
    Cubic {
        /// Index of the first such track, from 0.
        track: usize,
        /// Name of that track.
        name: String,
    },
}

/// Why the keys of a clip cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum KeysError {
    /// The format stores all channels at the same times, and the keys of the clip are not samples.
    #[error(transparent)]
    Keyed(#[from] KeyedError),
    /// The first and the last sample could not be evaluated.
    #[error(transparent)]
    Evaluating(#[from] Error),
}

/// The keys of a clip as a file of `format` stores them, as samples with a flag. If the flag is `true`, the format
/// takes the keys of each channel or of each track from the clip, at their separate times
/// ([`SampledClip::is_at_keys`](crate::motion::SampledClip::is_at_keys)), and the samples are only those at the first
/// and the last key. The flag is `true` in a format with separate key times if the keys are not samples ([`keyed`]), or
/// if `is_kept` is set: then the input's file is written again with other keys.
///
/// # Errors
/// When the keys are not samples, and the format has no separate key times or the poses are relative to the world;
/// when the samples cannot be evaluated.
pub fn keys_for(
    clip: &Motion,
    format: &Format,
    is_kept: bool,
) -> Result<(Samples, bool), KeysError> {
    let keys_per_channel = format.supports(Feature::TimesPerChannel);
    let has_one_list = |track| {
        track_times(clip, track).is_some() && !clip.channel(track).has(ChannelInterpolation::Cubic)
    };
    let takes_keys = match keys_per_channel {
        true => !clip.is_world,
        false => {
            let has_lists = format.supports(Feature::TimesPerTrack) && clip.set.scalar_count() == 0;
            has_lists && (0..clip.set.track_count()).all(has_one_list)
        }
    };
    let keyed = match format.supports(Feature::Scalars) {
        true => keyed(clip),
        false => keyed_tracks(clip),
    };
    match keyed {
        Ok(mut samples) if !(is_kept && keys_per_channel) => {
            // Scalars that the format cannot store may have other key times, so they are sampled at these times.
            if samples.scalars.is_empty() && clip.set.scalar_count() > 0 {
                let (engine, times) = (Engine::new(Device::Cpu)?, samples.times.clone());
                let (methods, frames) = (ChannelMethods::AUTHORED, SampleTimes::at(times));
                samples.scalars = methods.scalars(&engine, clip, &frames, ScalarQuantity::Value)?;
            }
            Ok((samples, false))
        }
        Err(error) if !takes_keys => Err(error.into()),
        _ => Ok((clip.ends(&Engine::new(Device::Cpu)?)?, true)),
    }
}

/// The keys of all tracks at their common times, with continued signs. A channel that has one key or none is
/// constant.
///
/// # Errors
/// When the key times of channels differ, or a channel is a cubic spline with tangents.
pub fn keyed(clip: &Motion) -> Result<Samples, KeyedError> {
    let scalars: Vec<ScalarKeys<'_>> = clip.scalar_keys().collect();
    keys_of(clip, &scalars)
}

/// As [`keyed`], without the scalars of the clip, which may have other times.
///
/// # Errors
/// As [`keyed`].
pub(crate) fn keyed_tracks(clip: &Motion) -> Result<Samples, KeyedError> {
    keys_of(clip, &[])
}

fn keys_of(clip: &Motion, scalars: &[ScalarKeys<'_>]) -> Result<Samples, KeyedError> {
    let set = &clip.set;
    let tracks = set.track_count();
    let channels = [Channel::Translation, Channel::Scale];
    let lists = |track: usize| {
        let vectors = channels
            .into_iter()
            .filter_map(move |it| set.vector_keys(it, track));
        std::iter::once(set.track(track).times).chain(vectors.map(|keys| keys.times))
    };
    let all = (0..tracks).flat_map(lists);
    let times = all
        .chain(scalars.iter().map(|keys| keys.times))
        .max_by_key(|times| times.len())
        .unwrap_or_default()
        .to_vec();
    for track in 0..tracks {
        let name = set.track_name(track);
        if lists(track).any(|list| list.len() > 1 && list != times) {
            return Err(KeyedError::TimesDiffer { track, name });
        }
        let channels = clip.channel(track);
        if channels.has(ChannelInterpolation::Cubic) {
            return Err(KeyedError::Cubic { track, name });
        }
    }
    for (scalar, keys) in scalars.iter().enumerate() {
        if keys.times.len() > 1 && keys.times != times || !keys.tangents.is_empty() {
            let name = keys.name.to_owned();
            return Err(KeyedError::Scalar { scalar, name });
        }
    }
    let mut samples = Samples {
        times,
        ..Samples::default()
    };
    let mut is_filled = [false; 2];
    for (filled, channel) in is_filled.iter_mut().zip(channels) {
        let rest = Motion::default().rest(channel, 0);
        *filled = (0..tracks).any(|track| {
            set.vector_keys(channel, track).is_some() || clip.rest(channel, track) != rest
        });
    }
    for sample in 0..samples.times.len() {
        for track in 0..tracks {
            let keys = set.track(track).keys;
            samples
                .rotations
                .push(at(keys, sample).unwrap_or(Quat::IDENTITY));
            let vector = |channel| -> Vec3 {
                let keys = set.vector_keys(channel, track);
                keys.and_then(|keys| at(keys.keys, sample))
                    .unwrap_or_else(|| clip.rest(channel, track))
            };
            if is_filled[0] {
                samples.translations.push(vector(Channel::Translation));
            }
            if is_filled[1] {
                samples.scales.push(vector(Channel::Scale));
            }
        }
    }
    for sample in 0..samples.times.len() {
        let values = scalars.iter().filter_map(|keys| at(keys.keys, sample));
        samples.scalars.extend(values);
    }
    continue_signs(&mut samples.rotations, tracks);
    Ok(samples)
}

/// The times of all channels of a track that have several keys; `None` if they differ.
pub(crate) fn track_times(clip: &Motion, track: usize) -> Option<&[f64]> {
    let channels = [Channel::Translation, Channel::Scale];
    let vectors = channels
        .into_iter()
        .filter_map(|channel| clip.set.vector_keys(channel, track));
    let rotations = clip.set.track(track).times;
    let mut longest = rotations;
    for keys in vectors {
        let has_several = keys.times.len() > 1 && longest.len() > 1;
        if has_several && keys.times != longest {
            return None;
        }
        if keys.times.len() > longest.len() {
            longest = keys.times;
        }
    }
    Some(longest)
}

/// The key at the index `sample`, or the last key if there are fewer.
pub(crate) fn at<T: Copy>(keys: &[T], sample: usize) -> Option<T> {
    keys.get(sample).or(keys.last()).copied()
}
