//! The keys of one channel as a file has them: at times of their own, with their own sampler.

use glam::Quat;
use tumble::Channel;

use crate::gltf::channel::Path;
use crate::motion::{Motion, Sampler};
use crate::signs::continue_signs;

/// The keys of a channel of a clip.
pub(super) struct OwnKeys {
    /// Seconds.
    pub(super) times: Vec<f64>,
    /// A value for each time; of cubics the arriving tangent, the value and the leaving tangent.
    pub(super) values: Vec<f32>,
    pub(super) sampler: Sampler,
}

impl OwnKeys {
    /// The keys with which a clip moves a track; nothing where it rests.
    pub(super) fn of(clip: &Motion, track: usize, path: Path) -> Option<Self> {
        let samplers = clip.channels.get(track);
        match path {
            Path::Rotation => Self::of_rotations(clip, track, samplers.map(|own| own.rotation)),
            Path::Translation => {
                let sampler = samplers.map(|own| own.translation);
                Self::of_vectors(clip, track, Channel::Translation, sampler)
            }
            Path::Scale => {
                let sampler = samplers.map(|own| own.scale);
                Self::of_vectors(clip, track, Channel::Scale, sampler)
            }
        }
    }

    /// `sampler` is nothing where the clip says nothing of its tracks, and nothing inside where the
    /// track rests.
    fn of_rotations(clip: &Motion, track: usize, sampler: Option<Option<Sampler>>) -> Option<Self> {
        let own = clip.set.get(track)?;
        let sampler = lasting(sampler.unwrap_or(Some(Sampler::Linear))?, own.times);
        let mut values = Vec::new();
        let mut keys = own.keys.to_vec();
        // The signs of cubics are part of their curves.
        if sampler != Sampler::Cubic {
            continue_signs(&mut keys, 1);
        }
        for (place, &key) in keys.iter().enumerate() {
            if sampler == Sampler::Cubic {
                let none = [Quat::from_array([0.0; 4]); 2];
                let [arriving, leaving] = own.tangents.get(place).copied().unwrap_or(none);
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
            times: own.times.to_vec(),
            values,
            sampler,
        })
    }

    fn of_vectors(
        clip: &Motion,
        track: usize,
        channel: Channel,
        sampler: Option<Option<Sampler>>,
    ) -> Option<Self> {
        let own = clip.set.vector_keys(channel, track)?;
        let sampler = lasting(sampler.unwrap_or(Some(Sampler::Linear))?, own.times);
        let mut values = Vec::new();
        for (place, key) in own.keys.iter().enumerate() {
            match sampler {
                Sampler::Cubic => {
                    let tangents = own.tangents.get(place).copied().unwrap_or_default();
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
            times: own.times.to_vec(),
            values,
            sampler,
        })
    }
}

/// glTF's cubics have two keys at least; one key lasts, whatever joins keys.
fn lasting(sampler: Sampler, times: &[f64]) -> Sampler {
    match (sampler, times.len()) {
        (Sampler::Cubic, 0 | 1) => Sampler::Linear,
        _ => sampler,
    }
}
