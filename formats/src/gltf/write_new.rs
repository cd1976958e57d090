//! Writes clips of any format as a new glTF file: a node for each track, skins so that programs show the joints as
//! bones, and an animation for each clip. The binary data contains the inverse bind matrices, then the times and the
//! samples of each animation.

mod binary;
mod json;
mod rig;
mod samples;

use std::collections::HashMap;
use std::io::{self, BufWriter, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;

use crate::diagnostic::{Code, Diagnostic};
use crate::format::{MotionOptions, Quantization, WriteError, no_offsets};
use crate::gltf::schema::AnimationExtras;
use crate::gltf::write_new::binary::{AccessorData, Binary};
use crate::gltf::write_new::json::{
    Animation, Asset, Buffer, Channel, MESHOPT, Root, Sampler, Scene, Skin, Target,
};
use crate::gltf::write_new::rig::NewNodes;
use crate::gltf::write_new::samples::{ClipSamples, Property};
use crate::gltf::written_keys::WrittenKeys;
use crate::motion::{self, SampledClip};
use crate::warnings::Warnings;

pub(super) use crate::gltf::write_new::json::{
    Animation as NewAnimation, Channel as NewChannel, FLOAT, SHORT, Sampler as NewSampler,
    Target as NewTarget,
};
pub(super) use crate::gltf::write_new::rig::UniqueNames;

/// Bytes of a GLB in addition to its JSON and its binary data: a header of 12, and 8 for each of these two chunks.
const HEADERS: u64 = 28;

/// Writes clips as GLB, or, if the options' `format` is `gltf`, as text with embedded binary data. Text is built in
/// memory.
///
/// Joints with the same names and parents are the same nodes in all clips, so that clips of parts of one skeleton
/// stay clips of one skeleton. Clips whose joints rest at different positions get separate nodes. Tracks of a clip
/// without a skeleton are roots without a skin. Poses relative to the world are converted to poses relative to the
/// parents. Rotations are f32 unless the options quantize them, with continued signs. Translations and scales are
/// written for joints where they differ from the rest pose. Steps stay steps; all other samples are joined by
/// straight lines and arcs. Keys that are written as keys ([`SampledClip::is_at_keys`]) keep their interpolation.
///
/// # Errors
/// When writing fails; [`Code::NothingToAnimate`], [`Code::NotTrees`], [`Code::TimesInF32`],
/// [`Code::TimesBelowZero`], [`Code::GlbTooLong`]; `InvalidInput` if the lengths of a clip's lists do not fit. Only
/// after an error of the system may a part of the file have been written.
pub fn write_new(
    clips: &[SampledClip<'_>],
    options: &MotionOptions,
    out: &mut dyn Write,
) -> Result<Vec<Diagnostic>, WriteError> {
    let mut nodes = NewNodes::default();
    let parts = parts(clips, options, &mut nodes)?;
    let mut binary = Binary::default();
    let mut skins = Vec::new();
    for (joints, matrices) in nodes.skins() {
        skins.push(Skin {
            inverse_bind_matrices: binary.push(AccessorData::Matrices(matrices)),
            skeleton: joints[0],
            joints,
        });
    }
    let mut names = UniqueNames::default();
    let mut animations = Vec::new();
    for (index, (part, clip)) in parts.into_iter().zip(clips).enumerate() {
        // Only a compressed view has a filter.
        let quantize = options.quantize.map(|bits| match bits {
            Quantization::Filtered(_) if !options.meshopt => Quantization::Components,
            bits => bits,
        });
        let mut animation = animation(&mut binary, part, quantize);
        let name = clip.clip.name.clone();
        animation.name = name.map(|name| names.unique(name, index));
        let notes = clip.notes.iter();
        animation.extras = notes
            .map(|(key, note)| ((*key).to_owned(), Value::from(note.as_str())))
            .collect();
        if let Some(reason) = (clip.clip.no_world.as_ref()).filter(|_| clip.clip.lacks_offsets()) {
            let name = AnimationExtras::NO_WORLD.to_owned();
            animation.extras.insert(name, Value::from(reason.as_str()));
        }
        animations.push(animation);
    }
    let accessors = |binary: &mut Binary<'_>| std::mem::take(&mut binary.accessors);
    let (bytes, buffers, extensions): (_, Vec<Buffer>, &[&str]) = match options.meshopt {
        true => {
            let (bytes, buffers) = binary.compress();
            (Some(bytes), buffers.into(), &[MESHOPT])
        }
        false => {
            let whole = Buffer {
                uri: None,
                byte_length: binary.length(),
                extensions: None,
            };
            (None, vec![whole], &[])
        }
    };
    let root = Root {
        extensions_used: extensions,
        extensions_required: extensions,
        asset: Asset {
            version: "2.0",
            generator: concat!("Tumble ", env!("CARGO_PKG_VERSION")),
        },
        scene: 0,
        scenes: [Scene { nodes: nodes.roots }],
        nodes: nodes.list,
        skins,
        animations,
        accessors: accessors(&mut binary),
        buffers,
        buffer_views: binary.views.clone(),
    };
    let json = serde_json::to_vec(&root).map_err(io::Error::from)?;
    let chunk = Chunk {
        length: root.buffers[0].byte_length,
        compressed: bytes,
        binary,
    };
    let length = glb_length(json.len() as u64, chunk.length)
        .map_err(|why| Diagnostic::new(&options.name, Code::GlbTooLong, why))?;
    let mut out = BufWriter::new(out);
    if options.format.eq_ignore_ascii_case("gltf") {
        write_text(root, &chunk, &mut out)?;
    } else {
        write_glb(json, &chunk, length, &mut out)?;
    }
    out.flush()?;
    let unplaced = clips.iter().find_map(|clip| no_offsets(clip.clip, options));
    Ok(unplaced
        .into_iter()
        .chain(moved_starts(clips, options))
        .collect())
}

/// Warnings about clips whose times count from whole seconds that an f32 cannot store in addition.
fn moved_starts(clips: &[SampledClip<'_>], options: &MotionOptions) -> Vec<Diagnostic> {
    let mut warnings = Warnings::new(&options.name);
    for offset in clips.iter().map(|clip| clip.clip.time_offset) {
        if offset != 0 {
            warnings.warn(Code::StartMoved, || {
                let message = format!(
                    "times are relative to {offset} s, because glTF stores times in f32, which cannot hold the full \
                     times"
                );
                (None, message)
            });
        }
    }
    warnings.into_list()
}

/// A clip to be written.
struct WritableClip<'a> {
    samples: ClipSamples<'a>,
    times: Vec<f32>,
    /// The keys of its channels, each with its times, if they are written instead of the samples.
    keys: Option<Vec<KeyedChannel>>,
    /// The node of each track.
    nodes: Vec<usize>,
}

/// A channel whose keys are written.
struct KeyedChannel {
    track: usize,
    property: Property,
    times: Vec<f32>,
    keys: WrittenKeys,
}

/// The channels of a clip whose keys are written; `None` if its samples are written.
fn keyed_channels(samples: ClipSamples<'_>) -> Result<Option<Vec<KeyedChannel>>, (Code, String)> {
    let clip = samples.clip();
    if !clip.is_at_keys || clip.clip.is_world {
        return Ok(None);
    }
    let mut channels = Vec::new();
    for track in 0..samples.tracks {
        for property in Property::ALL {
            if let Some(keys) = WrittenKeys::of(clip.clip, track, property.path()) {
                channels.push(KeyedChannel {
                    track,
                    property,
                    times: f32_times(samples.tracks, &keys.times)?,
                    keys,
                });
            }
        }
    }
    Ok(Some(channels))
}

/// Checks all clips, and adds their nodes.
fn parts<'a>(
    clips: &'a [SampledClip<'a>],
    options: &MotionOptions,
    nodes: &mut NewNodes,
) -> Result<Vec<WritableClip<'a>>, WriteError> {
    let mut parts = Vec::new();
    for (index, clip) in clips.iter().enumerate() {
        let refuse = |(code, why): (Code, String)| {
            let name = clip.clip.name.as_deref().map(|name| format!(" ({name})"));
            let message = format!("clip {}{}: {why}", index + 1, name.unwrap_or_default());
            Diagnostic::new(&options.name, code, message)
        };
        let samples = ClipSamples::of(clip)?;
        let times = f32_times(samples.tracks, clip.times).map_err(refuse)?;
        let keys = keyed_channels(samples).map_err(refuse)?;
        if samples.has_scaled_parents_in_world() {
            let why = "its poses are in the world and its joints have scales, so they cannot be \
                       made relative to their parents; write it without scales";
            return Err(refuse((Code::NotTrees, why.to_owned())).into());
        }
        let added = nodes.add(clip.clip);
        parts.push(WritableClip {
            samples,
            times,
            keys,
            nodes: added.map_err(|why| refuse((Code::NotTrees, why)))?,
        });
    }
    if parts.is_empty() {
        let message = "there is no clip to write; give one at least";
        return Err(Diagnostic::new(&options.name, Code::NothingToAnimate, message).into());
    }
    Ok(parts)
}

/// The binary data of a file.
struct Chunk<'a> {
    /// Number of bytes.
    length: u64,
    /// The compressed bytes, if the data is compressed.
    compressed: Option<Vec<u8>>,
    binary: Binary<'a>,
}

impl Chunk<'_> {
    fn write(&self, out: &mut impl Write) -> io::Result<()> {
        match &self.compressed {
            Some(bytes) => out.write_all(bytes),
            None => self.binary.write(out),
        }
    }
}

/// Writes JSON whose first buffer is a data URI.
fn write_text(mut root: Root, chunk: &Chunk<'_>, out: &mut impl Write) -> io::Result<()> {
    let mut bytes = Vec::new();
    chunk.write(&mut bytes)?;
    let encoded = STANDARD.encode(bytes);
    root.buffers[0].uri = Some(format!("data:application/octet-stream;base64,{encoded}"));
    serde_json::to_writer(out, &root).map_err(io::Error::from)
}

/// Writes a GLB of `length` bytes. JSON is padded with blanks to a multiple of 4 bytes.
fn write_glb(
    mut json: Vec<u8>,
    chunk: &Chunk<'_>,
    length: u32,
    out: &mut impl Write,
) -> io::Result<()> {
    json.resize(json.len().next_multiple_of(4), b' ');
    write_words(out, [GLTF, 2, length])?;
    // `length` includes the two chunks that follow.
    write_words(out, [json.len() as u32, JSON])?;
    out.write_all(&json)?;
    write_words(out, [chunk.length as u32, BIN])?;
    chunk.write(out)
}

const GLTF: u32 = u32::from_le_bytes(*b"glTF");
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");

fn write_words<const N: usize>(out: &mut impl Write, words: [u32; N]) -> io::Result<()> {
    let mut words = words.into_iter();
    words.try_for_each(|word| out.write_all(&word.to_le_bytes()))
}

/// The length of a GLB with this JSON and binary data, or why it is too long.
fn glb_length(json: u64, binary: u64) -> Result<u32, String> {
    let length = HEADERS + json.next_multiple_of(4) + binary;
    u32::try_from(length).map_err(|_| {
        format!(
            "it would take {length} bytes, and a GLB has 4294967295 at most; write fewer samples, \
             or the clips to several files"
        )
    })
}

/// The times of a clip of some tracks in f32, or why they cannot be stored so.
pub(super) fn f32_times(tracks: usize, seconds: &[f64]) -> Result<Vec<f32>, (Code, String)> {
    // Adding 0 changes -0 to +0.
    let times: Vec<f32> = seconds.iter().map(|&time| time as f32 + 0.0).collect();
    let (Some(&first), Some(&last)) = (times.first(), times.last()) else {
        let why = "it has no samples; give a time at least";
        return Err((Code::NothingToAnimate, why.to_owned()));
    };
    if tracks == 0 {
        return Err((Code::NothingToAnimate, "it has no tracks".to_owned()));
    }
    if first < 0.0 {
        let why = format!(
            "its first sample is at {} s, and times in glTF begin at 0; `tumble convert --start 0` cuts the part \
             before",
            seconds[0]
        );
        return Err((Code::TimesBelowZero, why));
    }
    if !last.is_finite() {
        let time = seconds[seconds.len() - 1];
        let why = format!(
            "{time} s is too large for f32, in which glTF stores times; --end SECONDS ends the clip before"
        );
        return Err((Code::TimesInF32, why));
    }
    if let Some(index) = times.windows(2).position(|pair| pair[0] >= pair[1]) {
        let spacing = f64::from(last.next_up()) - f64::from(last);
        let why = format!(
            "{} s and {} s are the same time in f32, in which glTF stores times; its step there is {spacing} s: give \
             --fps {} or less",
            seconds[index],
            seconds[index + 1],
            1.0 / spacing,
        );
        return Err((Code::TimesInF32, why));
    }
    Ok(times)
}

/// The animation of a clip, without name.
fn animation<'a>(
    binary: &mut Binary<'a>,
    part: WritableClip<'a>,
    quantize: Option<Quantization>,
) -> Animation {
    let samples = part.samples;
    binary.begin_view();
    if let Some(channels) = part.keys.filter(|channels| !channels.is_empty()) {
        return keyed_animation(binary, channels, &part.nodes, quantize);
    }
    let input = binary.push(AccessorData::Times(part.times));
    let mut channels = Vec::new();
    for track in 0..samples.tracks {
        for property in Property::ALL {
            if let Some(interpolation) = samples.interpolation(track, property) {
                channels.push((track, property, interpolation));
            }
        }
    }
    // An animation needs at least one channel; its length is that of its channels.
    if channels.is_empty() {
        channels.push((0, Property::Rotation, "LINEAR"));
    }
    let mut animation = Animation::default();
    for (sampler, (track, property, interpolation)) in channels.into_iter().enumerate() {
        animation.samplers.push(Sampler {
            input,
            output: {
                let data = AccessorData::Channel(samples, track, property);
                binary.push(match quantize {
                    Some(quantization) => data.quantized(quantization),
                    None => data,
                })
            },
            interpolation,
        });
        let target = Target {
            node: part.nodes[track],
            path: property.path().name(),
        };
        animation.channels.push(Channel { sampler, target });
    }
    animation
}

/// The animation of channels with separate keys; equal times are written once.
fn keyed_animation(
    binary: &mut Binary<'_>,
    channels: Vec<KeyedChannel>,
    nodes: &[usize],
    quantize: Option<Quantization>,
) -> Animation {
    let mut animation = Animation::default();
    let mut inputs: HashMap<Vec<u32>, usize> = HashMap::new();
    for (sampler, channel) in channels.into_iter().enumerate() {
        let bits = channel.times.iter().map(|time| time.to_bits()).collect();
        let input = *inputs
            .entry(bits)
            .or_insert_with(|| binary.push(AccessorData::Times(channel.times)));
        let values = AccessorData::Keys(channel.property, channel.keys.values);
        let values = match quantize
            .filter(|_| channel.keys.sampler != motion::ChannelInterpolation::Cubic)
        {
            Some(quantization) => values.quantized(quantization),
            None => values,
        };
        animation.samplers.push(Sampler {
            input,
            output: binary.push(values),
            interpolation: channel.keys.sampler.name(),
        });
        let target = Target {
            node: nodes[channel.track],
            path: channel.property.path().name(),
        };
        animation.channels.push(Channel { sampler, target });
    }
    animation
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_glb_has_up_to_four_gibibytes() {
        let limit = u64::from(u32::MAX) - HEADERS;
        assert_eq!(glb_length(100, limit - 103), Ok(u32::MAX - 3));
        assert_eq!(glb_length(101, 4), Ok(28 + 104 + 4));
        let error = glb_length(104, limit - 103).unwrap_err();
        assert!(error.contains("4294967296 bytes"), "{error}");
    }
}
