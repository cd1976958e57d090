//! A clip as one piece of bytes: what the npm package makes of arrays, and what the page of `tumble view` carries.
//!
//! Four bytes say how long the header is, a whole number; then the header, JSON; then the numbers of one track
//! after the other, little-endian: key times (f64) unless they are those of the track before; angular
//! velocities, then tension, continuity and bias (f64); keys `x y z w`, then tangents (f32); of translations,
//! then of scales, times (f64), vectors and tangents (f32); the origin (f64); the rest, translation, rotation and
//! scale (f32). What a track does not have is left out, and its header says so.

use glam::{DVec3, Quat, Vec3};
use serde::{Deserialize, Serialize};
use tumble::{Channel, Tcb, Track, TrackError, VectorKeys};

use crate::motion::{ChannelInterpolation, Channels, Joint, Motion, Transform};

/// Why bytes are no clip. Tracks count from 0.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PackedError {
    /// The header is missing or says what no header says.
    #[error("no header of a clip: {reason}")]
    Header {
        /// Why.
        reason: String,
    },
    /// There are fewer numbers than the header says.
    #[error("track {track}: the bytes end before its {missing}")]
    Short {
        /// The track.
        track: usize,
        /// The missing part of the track.
        missing: &'static str,
    },
    /// There are more numbers than the header says.
    #[error("{bytes} bytes are left after the last track")]
    Left {
        /// How many.
        bytes: usize,
    },
    /// The first track has the times of the one before it.
    #[error("track 0 cannot share the times of a track before it")]
    NothingShared,
    /// The numbers make no track.
    #[error(transparent)]
    Track(#[from] TrackError),
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields, default)]
struct ClipHeader {
    name: Option<String>,
    is_world: bool,
    no_world: Option<String>,
    /// Whether tracks are joints, with parents and rests.
    has_skeleton: bool,
    /// Whether samplers are known.
    has_channels: bool,
    tracks: Vec<TrackHeader>,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields, default)]
struct TrackHeader {
    name: String,
    keys: usize,
    shares_times: bool,
    velocities: bool,
    tcb: bool,
    tangents: bool,
    translations: usize,
    translation_tangents: bool,
    scales: usize,
    scale_tangents: bool,
    parent: Option<usize>,
    rotation_sampler: Option<ChannelInterpolation>,
    translation_sampler: Option<ChannelInterpolation>,
    scale_sampler: Option<ChannelInterpolation>,
    origin: bool,
    rest: bool,
}

/// The bytes of a clip: all that its samples depend on.
#[must_use]
#[expect(
    clippy::missing_panics_doc,
    reason = "names are strings and numbers are whole: JSON has them all"
)]
pub fn to_bytes(clip: &Motion) -> Vec<u8> {
    let set = &clip.set;
    let mut header = ClipHeader {
        name: clip.name.clone(),
        is_world: clip.is_world,
        no_world: clip.no_world.clone(),
        has_skeleton: !clip.skeleton.is_empty(),
        has_channels: !clip.channels.is_empty(),
        tracks: Vec::with_capacity(set.track_count()),
    };
    let mut numbers = Vec::new();
    let mut before: &[f64] = &[];
    for (index, track) in set.tracks().enumerate() {
        let vectors = |channel| set.vector_keys(channel, index);
        let joint = clip.skeleton.get(index);
        let written = PackedTrack {
            track,
            shares_times: index > 0 && track.times == before,
            translations: vectors(Channel::Translation),
            scales: vectors(Channel::Scale),
            origin: clip.origin(index),
            rest: joint.map(|joint| joint.rest),
        };
        before = track.times;
        header
            .tracks
            .push(written.header(joint, clip.channel(index)));
        written.write(&mut numbers);
    }
    let header = serde_json::to_vec(&header).expect("names are strings and numbers are whole");
    let mut bytes = Vec::with_capacity(4 + header.len() + numbers.len());
    bytes.extend((header.len() as u32).to_le_bytes());
    bytes.extend(header);
    bytes.append(&mut numbers);
    bytes
}

/// The parts of a track that are written.
struct PackedTrack<'a> {
    track: Track<'a>,
    shares_times: bool,
    translations: Option<VectorKeys<'a>>,
    scales: Option<VectorKeys<'a>>,
    origin: DVec3,
    rest: Option<Transform>,
}

impl PackedTrack<'_> {
    fn header(&self, joint: Option<&Joint>, channels: Channels) -> TrackHeader {
        let has_tangents =
            |keys: Option<VectorKeys<'_>>| keys.is_some_and(|vectors| !vectors.tangents.is_empty());
        TrackHeader {
            name: self.track.name.unwrap_or_default().to_owned(),
            keys: self.track.keys.len(),
            shares_times: self.shares_times,
            velocities: !self.track.velocities.is_empty(),
            tcb: !self.track.tcb.is_empty(),
            tangents: !self.track.tangents.is_empty(),
            translations: self.translations.map_or(0, |vectors| vectors.keys.len()),
            translation_tangents: has_tangents(self.translations),
            scales: self.scales.map_or(0, |vectors| vectors.keys.len()),
            scale_tangents: has_tangents(self.scales),
            parent: joint.and_then(|joint| joint.parent),
            rotation_sampler: channels.rotation,
            translation_sampler: channels.translation,
            scale_sampler: channels.scale,
            origin: self.origin != DVec3::ZERO,
            rest: self.rest.is_some(),
        }
    }

    fn write(&self, out: &mut Vec<u8>) {
        let Track {
            times,
            keys,
            velocities,
            tangents,
            tcb,
            ..
        } = self.track;
        if !self.shares_times {
            doubles(times.iter().copied(), out);
        }
        doubles(velocities.iter().flat_map(DVec3::to_array), out);
        let tcb = tcb
            .iter()
            .flat_map(|tcb| [tcb.tension, tcb.continuity, tcb.bias]);
        doubles(tcb, out);
        singles(keys.iter().flat_map(Quat::to_array), out);
        singles(tangents.as_flattened().iter().flat_map(Quat::to_array), out);
        for vectors in [self.translations, self.scales].into_iter().flatten() {
            doubles(vectors.times.iter().copied(), out);
            singles(vectors.keys.iter().flat_map(Vec3::to_array), out);
            let tangents = vectors.tangents.as_flattened();
            singles(tangents.iter().flat_map(Vec3::to_array), out);
        }
        if self.origin != DVec3::ZERO {
            doubles(self.origin.to_array().into_iter(), out);
        }
        if let Some(rest) = self.rest {
            singles(rest.translation.to_array().into_iter(), out);
            singles(rest.rotation.to_array().into_iter(), out);
            singles(rest.scale.to_array().into_iter(), out);
        }
    }
}

fn doubles(numbers: impl Iterator<Item = f64>, out: &mut Vec<u8>) {
    out.extend(numbers.flat_map(f64::to_le_bytes));
}

fn singles(numbers: impl Iterator<Item = f32>, out: &mut Vec<u8>) {
    out.extend(numbers.flat_map(f32::to_le_bytes));
}

/// The clip of which these are the bytes.
///
/// # Errors
/// When the header is none, there are fewer or more numbers than it says, or they make no tracks.
pub fn from_bytes(bytes: &[u8]) -> Result<Motion, PackedError> {
    let refuse = |reason: String| PackedError::Header { reason };
    let (length, rest) = bytes
        .split_first_chunk()
        .ok_or_else(|| refuse("there are fewer than 4 bytes".to_owned()))?;
    let length = u32::from_le_bytes(*length) as usize;
    let (header, numbers) = rest.split_at_checked(length).ok_or_else(|| {
        refuse(format!(
            "it has {length} bytes, and there are {}",
            rest.len()
        ))
    })?;
    let header: ClipHeader =
        serde_json::from_slice(header).map_err(|error| refuse(error.to_string()))?;
    let mut clip = Motion {
        name: header.name,
        is_world: header.is_world,
        no_world: header.no_world,
        ..Motion::default()
    };
    let mut numbers = PackedNumbers {
        bytes: numbers,
        track: 0,
    };
    let mut times = Vec::new();
    for (index, track) in header.tracks.into_iter().enumerate() {
        numbers.track = index;
        if track.shares_times && index == 0 {
            return Err(PackedError::NothingShared);
        }
        if !track.shares_times {
            times = numbers.doubles(track.keys, "key times")?;
        }
        numbers.read_track(&track, &times, &mut clip)?;
        if header.has_skeleton {
            let rest = match track.rest {
                true => numbers.rest()?,
                false => Transform::default(),
            };
            clip.skeleton.push(Joint {
                parent: track.parent,
                rest,
            });
        }
        if header.has_channels {
            clip.channels.push(Channels {
                rotation: track.rotation_sampler,
                translation: track.translation_sampler,
                scale: track.scale_sampler,
            });
        }
    }
    match numbers.bytes.len() {
        0 => Ok(clip),
        bytes => Err(PackedError::Left { bytes }),
    }
}

/// The numbers that are not read yet.
struct PackedNumbers<'a> {
    bytes: &'a [u8],
    track: usize,
}

impl PackedNumbers<'_> {
    fn take<const BYTES: usize, T>(
        &mut self,
        count: usize,
        components: usize,
        quantity: &'static str,
        number: fn([u8; BYTES]) -> T,
    ) -> Result<Vec<T>, PackedError> {
        let track = self.track;
        let short = || PackedError::Short {
            track,
            missing: quantity,
        };
        let length = count
            .checked_mul(components)
            .and_then(|numbers| numbers.checked_mul(BYTES))
            .ok_or_else(short)?;
        let (bytes, rest) = self.bytes.split_at_checked(length).ok_or_else(short)?;
        self.bytes = rest;
        let (numbers, _) = bytes.as_chunks();
        Ok(numbers.iter().map(|&bytes| number(bytes)).collect())
    }

    fn doubles(&mut self, count: usize, quantity: &'static str) -> Result<Vec<f64>, PackedError> {
        self.take(count, 1, quantity, f64::from_le_bytes)
    }

    fn triples(&mut self, count: usize, quantity: &'static str) -> Result<Vec<DVec3>, PackedError> {
        let numbers = self.take(count, 3, quantity, f64::from_le_bytes)?;
        Ok(numbers.chunks_exact(3).map(DVec3::from_slice).collect())
    }

    fn quats(&mut self, count: usize, quantity: &'static str) -> Result<Vec<Quat>, PackedError> {
        let numbers = self.take(count, 4, quantity, f32::from_le_bytes)?;
        Ok(numbers.chunks_exact(4).map(Quat::from_slice).collect())
    }

    fn vectors(&mut self, count: usize, quantity: &'static str) -> Result<Vec<Vec3>, PackedError> {
        let numbers = self.take(count, 3, quantity, f32::from_le_bytes)?;
        Ok(numbers.chunks_exact(3).map(Vec3::from_slice).collect())
    }

    /// The numbers of a track up to its rest, and the track.
    fn read_track(
        &mut self,
        header: &TrackHeader,
        times: &[f64],
        clip: &mut Motion,
    ) -> Result<(), PackedError> {
        let index = self.track;
        let keyed = |has: bool| if has { header.keys } else { 0 };
        let velocities = self.triples(keyed(header.velocities), "angular velocities")?;
        let tcb = self.triples(keyed(header.tcb), "tension, continuity and bias")?;
        let keys = self.quats(header.keys, "keys")?;
        let tangents = self.quats(keyed(header.tangents).saturating_mul(2), "tangents")?;
        let set = &mut clip.set;
        set.push(&*header.name, times, &keys)?;
        if header.velocities {
            set.set_velocities(index, &velocities)?;
        }
        if header.tcb {
            let tcb = tcb.iter().map(|numbers| Tcb {
                tension: numbers.x,
                continuity: numbers.y,
                bias: numbers.z,
            });
            set.set_tcb(index, &tcb.collect::<Vec<_>>())?;
        }
        if header.tangents {
            set.set_tangents(index, tangents.as_chunks().0)?;
        }
        if header.translations > 0 {
            let times = self.doubles(header.translations, "times of translations")?;
            let keys = self.vectors(header.translations, "translations")?;
            let tangents = self.tangents(header.translations, header.translation_tangents)?;
            let tangents = tangents.as_chunks().0;
            clip.set.set_translations(index, &times, &keys, tangents)?;
        }
        if header.scales > 0 {
            let times = self.doubles(header.scales, "times of scales")?;
            let keys = self.vectors(header.scales, "scales")?;
            let tangents = self.tangents(header.scales, header.scale_tangents)?;
            let tangents = tangents.as_chunks().0;
            clip.set.set_scales(index, &times, &keys, tangents)?;
        }
        if header.origin {
            let origin = self.triples(1, "origin")?;
            clip.set_origin(index, origin[0]);
        }
        Ok(())
    }

    fn tangents(&mut self, keys: usize, has_any: bool) -> Result<Vec<Vec3>, PackedError> {
        let count = if has_any { keys.saturating_mul(2) } else { 0 };
        self.vectors(count, "tangents")
    }

    fn rest(&mut self) -> Result<Transform, PackedError> {
        let translation = self.vectors(1, "rest")?;
        let rotation = self.quats(1, "rest")?;
        let scale = self.vectors(1, "rest")?;
        Ok(Transform {
            translation: translation[0],
            rotation: rotation[0],
            scale: scale[0],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tumble::TrackSet;

    fn clip() -> Motion {
        let mut set = TrackSet::new();
        let times = [0.1, 0.5, 2.0];
        let keys = [0.0, 0.5, 1.0].map(Quat::from_rotation_y);
        set.push("hip", &times, &keys).unwrap();
        set.push("", &times, &keys).unwrap();
        set.push("hand", &[7.0], &keys[..1]).unwrap();
        set.set_velocities(0, &[DVec3::X, DVec3::Y, DVec3::splat(1.0 / 3.0)])
            .unwrap();
        set.set_tangents(1, &[[keys[0], keys[1]]; 3]).unwrap();
        let tcb = Tcb {
            tension: 0.1,
            continuity: 0.2,
            bias: -0.3,
        };
        set.set_tcb(0, &[tcb; 3]).unwrap();
        let tangents = [[Vec3::X, Vec3::Y]; 2];
        set.set_translations(0, &[0.0, 9.0], &[Vec3::ONE, Vec3::X], &tangents)
            .unwrap();
        set.set_scales(1, &[3.0], &[Vec3::splat(0.5)], &[]).unwrap();
        let mut clip = Motion {
            name: Some("walk".to_owned()),
            set,
            ..Motion::default()
        };
        for parent in [None, Some(0), Some(1)] {
            let rest = Transform {
                translation: Vec3::new(0.0, 1.5, 0.0),
                rotation: keys[2],
                ..Transform::default()
            };
            clip.skeleton.push(Joint { parent, rest });
            clip.channels.push(Channels {
                rotation: parent.map(|_| ChannelInterpolation::Cubic),
                translation: Some(ChannelInterpolation::Linear),
                scale: None,
            });
        }
        clip.set_origin(2, DVec3::new(5e5, 0.1, 0.0));
        clip
    }

    #[test]
    fn a_clip_comes_back_with_all_that_its_samples_depend_on() {
        let clip = clip();
        let found = from_bytes(&to_bytes(&clip)).unwrap();
        let all = |clip: &Motion| {
            let indices = 0..clip.set.track_count();
            let channels = [Channel::Translation, Channel::Scale];
            let vectors =
                indices.map(|track| channels.map(|channel| clip.set.vector_keys(channel, track)));
            let tracks: Vec<Track<'_>> = clip.set.tracks().collect();
            let beside = Motion {
                set: TrackSet::new(),
                ..clip.clone()
            };
            let vectors: Vec<_> = vectors.collect();
            format!(
                "{tracks:?} {vectors:?} {beside:?} {:?}",
                clip.set.time_span()
            )
        };
        assert_eq!(all(&found), all(&clip));
        let empty = from_bytes(&to_bytes(&Motion::default())).unwrap();
        assert_eq!(format!("{empty:?}"), format!("{:?}", Motion::default()));
    }

    #[test]
    fn bytes_of_any_other_length_are_refused() {
        let bytes = to_bytes(&clip());
        for length in 0..bytes.len() {
            let error = from_bytes(&bytes[..length]).expect_err("numbers are missing");
            let is_named = matches!(
                error,
                PackedError::Header { .. } | PackedError::Short { .. }
            );
            assert!(is_named, "{length}: {error}");
        }
        let longer = [&bytes[..], &[0, 0, 0]].concat();
        let error = from_bytes(&longer).unwrap_err().to_string();
        assert_eq!(error, "3 bytes are left after the last track");
    }

    #[test]
    fn headers_that_say_nonsense_are_refused() {
        let packed = |header: &str| {
            let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
            bytes.extend(header.bytes());
            from_bytes(&bytes).unwrap_err().to_string()
        };
        let found = packed(&format!(r#"{{"tracks":[{{"keys":{}}}]}}"#, usize::MAX));
        assert_eq!(found, "track 0: the bytes end before its key times");
        let found = packed(r#"{"tracks":[{"sharesTimes":true}]}"#);
        assert_eq!(found, "track 0 cannot share the times of a track before it");
        let found = packed(r#"{"tracks":[{"kyes":1}]}"#);
        assert!(found.contains("unknown field `kyes`"), "{found}");
        let found = packed(r#"{"tracks":[{"keys":0}]}"#);
        assert!(found.contains("track 0"), "{found}");
    }
}
