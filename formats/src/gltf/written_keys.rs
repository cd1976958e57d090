//! The keys of one channel as a file stores them: with separate times and a separate sampler.

use std::ops::Range;

use glam::Quat;
use tumble::{Channel, ScalarKeys};

use crate::gltf::schema::TargetPath;
use crate::motion::signs::continue_signs;
use crate::motion::{ChannelInterpolation, Motion};

/// The keys of a channel of a clip.
pub(super) struct WrittenKeys {
    /// Times in seconds.
    pub(super) times: Vec<f64>,
    /// A value for each time; for cubics the arriving tangent, the value and the leaving tangent.
    pub(super) values: Vec<f32>,
    pub(super) sampler: ChannelInterpolation,
}

impl WrittenKeys {
    /// The keys by which a clip moves a track; `None` if the track is at rest.
    pub(super) fn of(clip: &Motion, track: usize, path: TargetPath) -> Option<Self> {
        let samplers = clip.channels.get(track);
        match path {
            TargetPath::Rotation => {
                Self::of_rotations(clip, track, samplers.map(|channels| channels.rotation))
            }
            TargetPath::Translation => {
                let sampler = samplers.map(|channels| channels.translation);
                Self::of_vectors(clip, track, Channel::Translation, sampler)
            }
            TargetPath::Scale => {
                let sampler = samplers.map(|channels| channels.scale);
                Self::of_vectors(clip, track, Channel::Scale, sampler)
            }
            // Weights do not belong to a track.
            TargetPath::Weights => None,
        }
    }

    /// The keys of neighbouring scalars, which are the weights of one channel; `None` if they do not have the same times and
    /// the same interpolation.
    pub(super) fn of_scalars(clip: &Motion, scalars: Range<usize>) -> Option<Self> {
        let (first, stated) = (clip.set.scalar(scalars.start)?, clip.scalar(scalars.start));
        let all: Option<Vec<ScalarKeys<'_>>> = scalars
            .map(|index| {
                let keys = clip.set.scalar(index)?;
                let is_same = keys.times == first.times
                    && clip.scalar(index).interpolation == stated.interpolation;
                is_same.then_some(keys)
            })
            .collect();
        let all = all?;
        let sampler = stated.interpolation.unwrap_or(ChannelInterpolation::Linear);
        let sampler = lasting(sampler, first.times);
        let mut values = Vec::new();
        for key in 0..first.times.len() {
            let slope = |keys: &ScalarKeys<'_>, side: usize| {
                keys.tangents.get(key).map_or(0.0, |slopes| slopes[side])
            };
            if sampler == ChannelInterpolation::Cubic {
                values.extend(all.iter().map(|keys| slope(keys, 0)));
            }
            values.extend(all.iter().map(|keys| keys.keys[key]));
            if sampler == ChannelInterpolation::Cubic {
                values.extend(all.iter().map(|keys| slope(keys, 1)));
            }
        }
        Some(Self {
            times: first.times.to_vec(),
            values,
            sampler,
        })
    }

    /// `sampler` is `None` if the clip does not specify the interpolation of its tracks, and `Some(None)` if the
    /// track is at rest.
    fn of_rotations(
        clip: &Motion,
        track: usize,
        sampler: Option<Option<ChannelInterpolation>>,
    ) -> Option<Self> {
        let rotations = clip.set.get(track)?;
        let sampler = lasting(
            sampler.unwrap_or(Some(ChannelInterpolation::Linear))?,
            rotations.times,
        );
        let mut values = Vec::new();
        let mut keys = rotations.keys.to_vec();
        // The tangents of cubics depend on the signs of the keys, so these signs are kept.
        if sampler != ChannelInterpolation::Cubic {
            continue_signs(&mut keys, 1);
        }
        for (index, &key) in keys.iter().enumerate() {
            if sampler == ChannelInterpolation::Cubic {
                let none = [Quat::from_array([0.0; 4]); 2];
                let [arriving, leaving] = rotations.tangents.get(index).copied().unwrap_or(none);
                values.extend(
                    [arriving, key, leaving]
                        .map(|q| q.to_array())
                        .as_flattened(),
                );
                continue;
            }
            values.extend(key.to_array());
        }
        Some(Self {
            times: rotations.times.to_vec(),
            values,
            sampler,
        })
    }

    fn of_vectors(
        clip: &Motion,
        track: usize,
        channel: Channel,
        sampler: Option<Option<ChannelInterpolation>>,
    ) -> Option<Self> {
        let vectors = clip.set.vector_keys(channel, track)?;
        let sampler = lasting(
            sampler.unwrap_or(Some(ChannelInterpolation::Linear))?,
            vectors.times,
        );
        let mut values = Vec::new();
        for (index, key) in vectors.keys.iter().enumerate() {
            match sampler {
                ChannelInterpolation::Cubic => {
                    let tangents = vectors.tangents.get(index).copied().unwrap_or_default();
                    let [arriving, leaving] = tangents;
                    values.extend(
                        [arriving, *key, leaving]
                            .map(|v| v.to_array())
                            .as_flattened(),
                    );
                }
                _ => values.extend(key.to_array()),
            }
        }
        Some(Self {
            times: vectors.times.to_vec(),
            values,
            sampler,
        })
    }
}

/// Cubics of glTF have at least two keys. A single key therefore becomes a constant, with any interpolation.
fn lasting(sampler: ChannelInterpolation, times: &[f64]) -> ChannelInterpolation {
    match (sampler, times.len()) {
        (ChannelInterpolation::Cubic, 0 | 1) => ChannelInterpolation::Linear,
        _ => sampler,
    }
}
