//! The samples of one animation on their way into its file.

use std::collections::{HashMap, HashSet};
use std::io;
use std::ops::Range;

use serde_json::value::RawValue;

use crate::diagnostic::{Code, Diagnostic};
use crate::format::WriteError;
use crate::gltf::animation::{Read, SampledChannel};
use crate::gltf::channel::Path;
use crate::gltf::edits::Edits;
use crate::gltf::json::{Json, Members};
use crate::gltf::schema::{Animation, Channel};
use crate::motion::Sampled;

/// One animation on its way into the file.
pub(super) struct Baking<'a> {
    json: &'a Json<'a>,
    pointer: String,
    read: &'a Read,
    sampled: &'a Sampled<'a>,
    /// The values of `sampler` of the channels.
    named: Vec<&'a RawValue>,
    /// The samplers of channels that are not sampled.
    kept: HashSet<usize>,
    samplers: Vec<&'a RawValue>,
    samplers_array: &'a RawValue,
    /// The buffer view that the bytes will be.
    view: usize,
    pub(super) bytes: Vec<u8>,
}

/// A sampler that was changed or appended.
struct Made {
    place: usize,
    values: Range<usize>,
}

impl<'a> Baking<'a> {
    /// # Errors
    /// When the samples are not those of the clip.
    pub(super) fn new(
        json: &'a Json<'a>,
        place: usize,
        read: &'a Read,
        sampled: &'a Sampled<'a>,
        edits: &Edits<'_>,
    ) -> Result<Self, WriteError> {
        let pointer = format!("/animations/{place}");
        let animation: Animation<'a> = json.entry("animations", place, &pointer)?;
        let members: Members<'a> = json.entry("animations", place, &pointer)?;
        let sampled_channels: HashSet<usize> = read.sampled.iter().map(|own| own.channel).collect();
        let mut kept = HashSet::new();
        let mut named = Vec::new();
        for (place, raw) in animation.channels.iter().enumerate() {
            if !sampled_channels.contains(&place) {
                kept.insert(json.typed::<Channel>(raw, &pointer)?.sampler);
            }
            let members: Members<'a> = json.typed(raw, &pointer)?;
            named.extend(members.get("sampler"));
        }
        let tracks = sampled.clip.set.track_count();
        let count = sampled.times.len() * tracks;
        let fits = |list: usize, path: Path| {
            let is_moved = read.sampled.iter().any(|channel| channel.path == path);
            list == count || !is_moved
        };
        let is_whole = fits(sampled.rotations.len(), Path::Rotation)
            && fits(sampled.translations.len(), Path::Translation)
            && fits(sampled.scales.len(), Path::Scale)
            && read.sampled.iter().all(|channel| channel.track < tracks);
        let samplers_array = members.get("samplers").filter(|_| is_whole && count > 0);
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
            view: edits.count("bufferViews"),
            bytes: Vec::new(),
        })
    }

    /// Puts the samples in the place of the keys of the channels that are sampled.
    ///
    /// # Errors
    /// When f32 cannot tell times apart.
    pub(super) fn bake(&mut self, edits: &mut Edits<'_>) -> Result<(), WriteError> {
        let times = self.times()?;
        let [first, last] = [times[0], times[times.len() - 1]].map(f64::from);
        let range = format!(",\"min\":[{first:?}],\"max\":[{last:?}]");
        self.bytes
            .extend(times.iter().flat_map(|time| time.to_le_bytes()));
        let input = edits.append_to("accessors", self.accessor(0, times.len(), "SCALAR", &range));
        // By the samplers whose keys the samples stand for.
        let mut made: HashMap<usize, Vec<Made>> = HashMap::new();
        for channel in &self.read.sampled {
            let values = self.values(channel);
            let made = made.entry(channel.sampler).or_default();
            let same = made
                .iter()
                .find(|made| self.bytes[made.values.clone()] == values);
            let sampler = match same {
                Some(made) => made.place,
                None => {
                    let start = self.bytes.len();
                    self.bytes.extend_from_slice(&values);
                    let kind = if channel.path == Path::Rotation {
                        "VEC4"
                    } else {
                        "VEC3"
                    };
                    let accessor = self.accessor(start, times.len(), kind, "");
                    let output = edits.append_to("accessors", accessor);
                    let is_free = made.is_empty() && !self.kept.contains(&channel.sampler);
                    let place = match is_free {
                        true => self.change_sampler(channel.sampler, (input, output), edits)?,
                        false => {
                            let sampler = format!(
                                "{{\"input\":{input},\"output\":{output},\"interpolation\":\"LINEAR\"}}"
                            );
                            edits.append(self.samplers_array, self.samplers.len(), &sampler)
                        }
                    };
                    made.push(Made {
                        place,
                        values: start..self.bytes.len(),
                    });
                    place
                }
            };
            if sampler != channel.sampler {
                edits.replace(self.named[channel.channel], sampler);
            }
        }
        Ok(())
    }

    /// The times of the samples in f32, from the first key time that the file has to the last.
    fn times(&self) -> Result<Vec<f32>, Diagnostic> {
        let mut times: Vec<f32> = self.sampled.times.iter().map(|&time| time as f32).collect();
        let ends = [0, times.len() - 1];
        for ((place, clip), stored) in ends
            .into_iter()
            .zip(self.read.span)
            .zip(self.read.stored_span)
        {
            if self.sampled.times[place] == clip {
                times[place] = stored;
            }
        }
        match times.windows(2).find(|pair| pair[0] >= pair[1]) {
            None => Ok(times),
            Some(pair) => {
                let [one, next] = [pair[0], pair[1]];
                let message =
                    format!("f32 has no time between {one} and {next}; sample at a lower rate");
                Err(self.json.refuse(&self.pointer, Code::TimesInF32, message))
            }
        }
    }

    /// The samples of a channel, as the file holds them.
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
            Path::Rotation => all(bytemuck::cast_slice(self.sampled.rotations)),
            Path::Translation => all(bytemuck::cast_slice(self.sampled.translations)),
            Path::Scale => all(bytemuck::cast_slice(self.sampled.scales)),
        }
    }

    fn accessor(&self, offset: usize, count: usize, kind: &str, more: &str) -> String {
        format!(
            "{{\"bufferView\":{},\"byteOffset\":{offset},\"componentType\":5126,\
             \"count\":{count},\"type\":\"{kind}\"{more}}}",
            self.view
        )
    }

    /// Gives a sampler other keys; its place.
    fn change_sampler(
        &self,
        sampler: usize,
        (input, output): (usize, usize),
        edits: &mut Edits<'_>,
    ) -> Result<usize, Diagnostic> {
        let raw = self.samplers[sampler];
        let members: Members<'a> = self.json.typed(raw, &self.pointer)?;
        let changes = [
            ("input", input.to_string()),
            ("output", output.to_string()),
            ("interpolation", "\"LINEAR\"".to_owned()),
        ];
        for (name, value) in changes {
            if let Some(old) = members.get(name) {
                edits.replace(old, value);
            }
        }
        Ok(sampler)
    }
}
