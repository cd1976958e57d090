//! Replaces the keys of one animation in its file by samples, or by the keys of a clip that was cut.

use std::collections::{HashMap, HashSet};
use std::io;
use std::ops::Range;

use serde_json::value::RawValue;

use crate::diagnostic::{Code, Diagnostic};
use crate::format::WriteError;
use crate::gltf::animation::{ReadAnimation, SampledChannel};
use crate::gltf::edits::Edits;
use crate::gltf::json::{Json, JsonMembers};
use crate::gltf::key_bytes::{KeyBytes, bytes_of};
use crate::gltf::quantized::quantized;
use crate::gltf::schema::{Animation, Channel, TargetPath};
use crate::gltf::write_new::{FLOAT, SHORT};
use crate::gltf::written_keys::WrittenKeys;
use crate::motion::{self, Motion, SampledClip};

/// Converts f32 rotations to 16 bits for each component.
fn shorts_of(bytes: &[u8]) -> Vec<u8> {
    let numbers = bytes.as_chunks::<4>().0.iter();
    let numbers: Vec<f32> = numbers.map(|&bytes| f32::from_le_bytes(bytes)).collect();
    let each = numbers
        .as_chunks::<4>()
        .0
        .iter()
        .copied()
        .flat_map(quantized);
    each.flat_map(i16::to_le_bytes).collect()
}

/// One animation that is being written to the file.
pub(super) struct AnimationBaker<'a> {
    json: &'a Json<'a>,
    pointer: String,
    read: &'a ReadAnimation,
    sampled: &'a SampledClip<'a>,
    /// The values of `sampler` of the channels.
    named: Vec<&'a RawValue>,
    /// The samplers of channels that are not sampled.
    kept: HashSet<usize>,
    samplers: Vec<&'a RawValue>,
    samplers_array: &'a RawValue,
    /// Whether the clip was cut, so that all its channels get other keys.
    is_cut: bool,
    /// Whether rotations have 16 bits for each component.
    quantize: bool,
    pub(super) bytes: KeyBytes,
}

/// A sampler that was changed or appended.
struct BakedSampler {
    sampler: usize,
    input: usize,
    interpolation: &'static str,
    values: Range<usize>,
}

/// Whether only a part of the animation is written.
pub(super) fn is_cut(read: &ReadAnimation, sampled: &SampledClip<'_>) -> bool {
    sampled.is_at_keys && is_part(read, sampled.clip)
}

/// Whether a clip is only a part of the animation.
pub(super) fn is_part(read: &ReadAnimation, clip: &Motion) -> bool {
    let span = clip.set.time_span();
    span.is_some_and(|(first, last)| [first, last] != read.span)
}

impl<'a> AnimationBaker<'a> {
    /// # Errors
    /// When the samples are not those of the clip.
    pub(super) fn new(
        json: &'a Json<'a>,
        index: usize,
        read: &'a ReadAnimation,
        (sampled, quantize): (&'a SampledClip<'a>, bool),
        edits: &Edits<'_>,
    ) -> Result<Self, WriteError> {
        let pointer = format!("/animations/{index}");
        let animation: Animation<'a> = json.entry("animations", index, &pointer)?;
        let members: JsonMembers<'a> = json.entry("animations", index, &pointer)?;
        let is_cut = is_cut(read, sampled);
        let others = read.others.iter().filter(|_| is_cut);
        let changed = read.sampled.iter().chain(others);
        let sampled_channels: HashSet<usize> = changed
            .map(|sampled_channel| sampled_channel.channel)
            .collect();
        let mut kept = HashSet::new();
        let mut named = Vec::new();
        for (channel_index, raw) in animation.channels.iter().enumerate() {
            if !sampled_channels.contains(&channel_index) {
                kept.insert(json.typed::<Channel>(raw, &pointer)?.sampler);
            }
            let members: JsonMembers<'a> = json.typed(raw, &pointer)?;
            named.extend(members.get("sampler"));
        }
        let tracks = sampled.clip.set.track_count();
        let count = sampled.times.len() * tracks;
        let fits = |list: usize, path: TargetPath| {
            let is_moved = read.sampled.iter().any(|channel| channel.path == path);
            list == count || !is_moved
        };
        let scalars = sampled.clip.set.scalar_count();
        let is_there = |channel: &SampledChannel| match channel.path {
            TargetPath::Weights => {
                let keys = WrittenKeys::of_scalars(sampled.clip, channel.scalars());
                channel.scalars().end <= scalars && (keys.is_some() || !sampled.is_at_keys)
            }
            _ => channel.track < tracks,
        };
        let is_whole = fits(sampled.rotations.len(), TargetPath::Rotation)
            && fits(sampled.translations.len(), TargetPath::Translation)
            && fits(sampled.scales.len(), TargetPath::Scale)
            && sampled.scalars.len() == sampled.times.len() * scalars
            && read.sampled.iter().all(is_there);
        let is_whole = is_whole && !sampled.times.is_empty();
        let samplers_array = members.get("samplers").filter(|_| is_whole);
        let samplers_array = samplers_array.ok_or_else(|| {
            io::Error::new(
                io::ErrorKind::InvalidInput,
                "the samples are not those of this clip",
            )
        })?;
        Ok(Self {
            json,
            pointer,
            read,
            sampled,
            named,
            kept,
            samplers: animation.samplers,
            samplers_array,
            is_cut,
            quantize,
            bytes: KeyBytes::new(edits),
        })
    }

    /// Replaces the keys of the channels that are sampled by the samples.
    ///
    /// # Errors
    /// When f32 cannot tell times apart.
    pub(super) fn bake(&mut self, edits: &mut Edits<'_>) -> Result<(), WriteError> {
        let shared = self.input(self.sampled.times, edits)?;
        // The new samplers, by the samplers whose keys they replace.
        let mut made: HashMap<usize, Vec<BakedSampler>> = HashMap::new();
        let read = self.read;
        let others = read.others.iter().filter(|_| self.is_cut);
        let channels: Vec<&SampledChannel> = read.sampled.iter().chain(others).collect();
        for channel in channels {
            let clip = self.sampled.clip;
            let written = match (self.sampled.is_at_keys, channel.path) {
                (true, TargetPath::Weights) => WrittenKeys::of_scalars(clip, channel.scalars()),
                (true, path) => WrittenKeys::of(clip, channel.track, path),
                (false, _) => None,
            };
            let (input, interpolation) = match &written {
                Some(keys) => (self.input(&keys.times, edits)?, keys.sampler.name()),
                None => (shared, "LINEAR"),
            };
            let values =
                written.map_or_else(|| self.values(channel), |written| bytes_of(&written.values));
            let count = values.len() / (4 * channel.path.width());
            let is_short = self.quantize
                && channel.path == TargetPath::Rotation
                && interpolation != motion::ChannelInterpolation::Cubic.name();
            let values = if is_short { shorts_of(&values) } else { values };
            let made = made.entry(channel.sampler).or_default();
            let same = made.iter().find(|made| {
                self.bytes.bytes()[made.values.clone()] == values
                    && (made.input, made.interpolation) == (input, interpolation)
            });
            let sampler = match same {
                Some(made) => made.sampler,
                None => {
                    let start = self.bytes.bytes().len();
                    let shorts = (SHORT, ",\"normalized\":true");
                    let (component, more) = if is_short { shorts } else { (FLOAT, "") };
                    let accessor = (count, component, channel.path.kind());
                    let output = self.bytes.push(&values, accessor, more, edits);
                    let is_free = made.is_empty()
                        && !self.kept.contains(&channel.sampler)
                        && self.takes(channel.sampler, interpolation)?;
                    let sampler = match is_free {
                        true => {
                            let keys = (input, output, interpolation);
                            self.change_sampler(channel.sampler, keys, edits)?
                        }
                        false => {
                            let sampler = format!(
                                "{{\"input\":{input},\"output\":{output},\"interpolation\":\"{interpolation}\"}}"
                            );
                            edits.append(self.samplers_array, self.samplers.len(), &sampler)
                        }
                    };
                    made.push(BakedSampler {
                        sampler,
                        input,
                        interpolation,
                        values: start..self.bytes.bytes().len(),
                    });
                    sampler
                }
            };
            if sampler != channel.sampler {
                edits.replace(self.named[channel.channel], sampler);
            }
        }
        Ok(())
    }

    /// The accessor of times; equal lists of times share one.
    fn input(&mut self, seconds: &[f64], edits: &mut Edits<'_>) -> Result<usize, Diagnostic> {
        let times = self.times(seconds)?;
        Ok(self.bytes.input(&times, edits))
    }

    /// Times in f32. The first and the last key of the file keep the times that the file has.
    fn times(&self, seconds: &[f64]) -> Result<Vec<f32>, Diagnostic> {
        let mut times: Vec<f32> = seconds.iter().map(|&time| time as f32).collect();
        for (time, &second) in times.iter_mut().zip(seconds) {
            let ends = self.read.span.iter().zip(self.read.stored_span);
            for (_, stored) in ends.filter(|&(&end, _)| end == second) {
                *time = stored;
            }
        }
        match times.windows(2).find(|pair| pair[0] >= pair[1]) {
            None => Ok(times),
            Some(pair) => {
                let [one, next] = [pair[0], pair[1]];
                let message =
                    format!("f32 has no time between {one} and {next}; give a lower rate (--fps)");
                Err(self.json.refuse(&self.pointer, Code::TimesInF32, message))
            }
        }
    }

    /// The samples of a channel, as the file stores them.
    fn values(&self, channel: &SampledChannel) -> Vec<u8> {
        let tracks = self.sampled.clip.set.track_count();
        let all = |list: &[f32]| -> Vec<u8> {
            let width = channel.path.width();
            let rows = list.chunks_exact(width * tracks);
            rows.flat_map(|row| row[channel.track * width..][..width].iter())
                .flat_map(|number| number.to_le_bytes())
                .collect()
        };
        match channel.path {
            TargetPath::Rotation => all(bytemuck::cast_slice(self.sampled.rotations)),
            TargetPath::Translation => all(bytemuck::cast_slice(self.sampled.translations)),
            TargetPath::Scale => all(bytemuck::cast_slice(self.sampled.scales)),
            TargetPath::Weights => {
                let scalars = self.sampled.clip.set.scalar_count();
                let rows = self.sampled.scalars.chunks_exact(scalars);
                rows.flat_map(|row| &row[channel.scalars()])
                    .flat_map(|number| number.to_le_bytes())
                    .collect()
            }
        }
    }

    /// Whether a sampler's interpolation can be changed in the JSON; linear is the default.
    fn takes(&self, sampler: usize, interpolation: &str) -> Result<bool, Diagnostic> {
        let raw = self.samplers[sampler];
        let members: JsonMembers<'a> = self.json.typed(raw, &self.pointer)?;
        Ok(interpolation == "LINEAR" || members.get("interpolation").is_some())
    }

    /// Replaces the keys of a sampler; returns its index.
    fn change_sampler(
        &self,
        sampler: usize,
        (input, output, interpolation): (usize, usize, &str),
        edits: &mut Edits<'_>,
    ) -> Result<usize, Diagnostic> {
        let raw = self.samplers[sampler];
        let members: JsonMembers<'a> = self.json.typed(raw, &self.pointer)?;
        let changes = [
            ("input", input.to_string()),
            ("output", output.to_string()),
            ("interpolation", format!("\"{interpolation}\"")),
        ];
        for (name, value) in changes {
            if let Some(old) = members.get(name) {
                edits.replace(old, value);
            }
        }
        Ok(sampler)
    }
}
