//! The keys of a clip as samples: for formats that hold all joints at the same times.

use glam::{Quat, Vec3};
use tumble::{Channel, Device, Engine, Error};

use crate::feature::Feature;
use crate::format::Format;
use crate::motion::{ChannelInterpolation, Motion};
use crate::sample::Samples;
use crate::signs::continue_signs;

/// Why the keys of a clip are no samples.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum KeyedError {
    /// Channels have keys at different times.
    #[error(
        "track {track} (`{name}`) has keys at other times than those before it; sample them \
         together with `tumble eval --fps`"
    )]
    TimesDiffer {
        /// The first track whose times differ, from 0.
        track: usize,
        /// Its name.
        name: String,
    },
    /// Keys are meant for cubics with given tangents, which would be lost.
    #[error(
        "track {track} (`{name}`) is a cubic spline with tangents, which keys alone do not contain; \
         sample it with `tumble eval --fps`"
    )]
    Cubic {
        /// The first such track, from 0.
        track: usize,
        /// Its name.
        name: String,
    },
}

/// Why the keys of a clip cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum KeysError {
    /// The format holds all channels at the same times.
    #[error(transparent)]
    Keyed(#[from] KeyedError),
    /// The first and the last sample could not be evaluated.
    #[error(transparent)]
    Evaluating(#[from] Error),
}

/// The keys of a clip as a file of that format takes them, and whether it takes each channel's from the clip itself
/// ([`SampledClip::is_at_keys`](crate::motion::SampledClip::is_at_keys)): at its own times, where channels
/// differ or `is_kept`, the input's file with other keys.
///
/// # Errors
/// When the format has no room for channels that have their own times.
pub fn keys_for(
    clip: &Motion,
    format: &Format,
    is_kept: bool,
) -> Result<(Samples, bool), KeysError> {
    let keys_per_channel = format.supports(Feature::TimesPerChannel);
    match keyed(clip) {
        Ok(samples) if !(is_kept && keys_per_channel) => Ok((samples, false)),
        Err(error) if !keys_per_channel || clip.is_world => Err(error.into()),
        _ => Ok((clip.ends(&Engine::new(Device::Cpu)?)?, true)),
    }
}

/// The keys of all tracks at their common times, with signs that continue. Channels with one key, and
/// those at rest, hold.
///
/// # Errors
/// When the times of channels differ, or one is a cubic with tangents.
pub fn keyed(clip: &Motion) -> Result<Samples, KeyedError> {
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
    continue_signs(&mut samples.rotations, tracks);
    Ok(samples)
}

/// The key at a sample, or the last one.
fn at<T: Copy>(keys: &[T], sample: usize) -> Option<T> {
    keys.get(sample).or(keys.last()).copied()
}
