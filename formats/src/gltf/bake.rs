//! A file written again with the samples of its animations instead of their keys.

use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path as FilePath, PathBuf};

use serde_json::value::RawValue;
use tumble::FrameRate;

use crate::diagnostic::{Code, Diagnostic, Place};
use crate::format::{Document, Format, MotionOptions, WriteError};
use crate::gltf::FORMAT;
use crate::gltf::animation::{Read, SampledChannel};
use crate::gltf::channel::Path;
use crate::gltf::container::Container;
use crate::gltf::data::{Data, check_length};
use crate::gltf::edits::Edits;
use crate::gltf::gather;
use crate::gltf::json::{Json, Members};
use crate::gltf::reader::Reader;
use crate::gltf::schema::{Animation, Channel};
use crate::gltf::uri;
use crate::grid::Precision;
use crate::motion::Sampled;
use crate::warnings::Warnings;

/// A file that was read.
#[derive(Debug)]
pub(super) struct Gltf {
    /// What messages call it.
    pub(super) name: String,
    pub(super) container: Container,
    /// Where the files are that it names.
    pub(super) folder: Option<PathBuf>,
    /// The longest of them that is read.
    pub(super) most: u64,
    /// `None` for those that are kept as they are.
    pub(super) animations: Vec<Option<Read>>,
}

impl Document for Gltf {
    fn times(&self, clip: usize, rate: FrameRate) -> Result<Vec<f64>, Diagnostic> {
        let Some(read) = self.animations.get(clip).and_then(Option::as_ref) else {
            return Ok(Vec::new());
        };
        let [first, last] = read.span;
        let spacing = Precision::F32.ulp(first.abs().max(last.abs()));
        if spacing * rate.per_second() > 1.0 {
            let fits = 1.0 / spacing;
            let fits = if fits >= 1.0 { fits.floor() } else { fits };
            let message = format!(
                "at {last} s, times in f32 are {spacing} s apart, and frames at {rate} fps {} s; \
                 {fits} fps fits",
                1.0 / rate.per_second()
            );
            return Err(self.refuse(clip, Code::TimesInF32, message));
        }
        let start = (first * rate.per_second()).floor() as i64;
        let end = (last * rate.per_second()).ceil() as i64;
        let time = |frame: i64| rate.time_of(frame.unsigned_abs()) * frame.signum() as f64;
        let ends = [first, last].map(|end| (end, Precision::F32.ulp(end) / 2.0));
        let is_end = |time: f64| {
            ends.iter()
                .any(|&(end, near)| (time - end).abs() <= near || time as f32 == end as f32)
        };
        let within = (start..=end)
            .map(time)
            .filter(|&time| first < time && time < last && !is_end(time));
        let mut times = vec![first];
        times.extend(within);
        times.extend((last > first).then_some(last));
        Ok(times)
    }

    fn writes(&self, format: &Format) -> bool {
        format.name == FORMAT.name
    }

    fn write(
        &self,
        clips: &[(usize, Sampled<'_>)],
        _: &MotionOptions,
        path: &FilePath,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError> {
        let json = Json::parse(&self.name, &self.container.text)?;
        let warnings = Warnings::new(&self.name);
        let folder = self.folder.as_deref();
        let reader = Reader::new(&json, &self.container, folder, self.most, warnings)?;
        let extension = path.extension().unwrap_or_default();
        let is_text = extension.eq_ignore_ascii_case("gltf");
        self.check_folder(&reader, path, is_text)?;
        let mut edits = Edits::new(&json);
        let mut data = match (self.container.is_glb(), is_text) {
            (true, _) => Data::of_file(&json, &reader, self.container.bin().unwrap_or_default())?,
            (false, true) => Data::in_uri(&json),
            (false, false) => gather::buffers(&reader, &mut edits)?,
        };
        let baked = |&(place, _): &(usize, _)| self.animations.get(place).and_then(Option::as_ref);
        let clips: Vec<_> = clips
            .iter()
            .filter_map(|clip| Some((baked(clip)?, clip)))
            .collect();
        let more = clips.iter().map(|(read, (_, sampled))| {
            let numbers = 1 + read
                .sampled
                .iter()
                .map(|channel| channel.path.width())
                .sum::<usize>();
            4 * numbers as u64 * sampled.times.len() as u64
        });
        check_length(&json, data.length_with(more.sum()))?;
        if !self.container.is_glb() && !is_text {
            gather::images(&reader, &mut edits, &mut data)?;
        }
        for (read, (place, sampled)) in clips {
            if !read.sampled.is_empty() {
                let mut baking = Baking::new(&json, *place, read, sampled, &edits)?;
                baking.bake(&mut edits)?;
                data.append(&mut edits, &baking.bytes);
            }
        }
        let bin = data.finish(&json, &mut edits);
        let text = edits.finish();
        if is_text {
            out.write_all(text.as_bytes())?;
        } else {
            let length = |part: &&[u8]| part.len() as u64;
            let bytes = text.len() as u64 + bin.iter().flatten().map(length).sum::<u64>();
            check_length(&json, bytes)?;
            self.container.write_glb(&text, bin.as_deref(), out)?;
        }
        drop(data);
        Ok(reader.warnings.into_inner().into_list())
    }
}

impl Gltf {
    fn refuse(&self, animation: usize, code: Code, message: String) -> Diagnostic {
        Diagnostic::new(&self.name, code, message).inside(format!("/animations/{animation}"))
    }

    /// URIs of files beside are right in the file's own folder alone.
    fn check_folder(
        &self,
        reader: &Reader<'_>,
        path: &FilePath,
        is_text: bool,
    ) -> Result<(), Diagnostic> {
        if is_text && self.container.is_glb() {
            let message = "a GLB is written as a GLB; name the output .glb";
            return Err(Diagnostic::new(&self.name, Code::GltfFolder, message));
        }
        let is_gathered = !is_text && !self.container.is_glb();
        let Some((pointer, uri)) = named_file(reader.json).filter(|_| !is_gathered) else {
            return Ok(());
        };
        let canonical = |folder: &FilePath| {
            let here = folder.as_os_str().is_empty();
            std::fs::canonicalize(if here { FilePath::new(".") } else { folder }).ok()
        };
        let own = self.folder.as_deref().and_then(canonical);
        let target = canonical(path.parent().unwrap_or(FilePath::new("")));
        if own.is_some() && own == target {
            return Ok(());
        }
        if is_text {
            let message = format!(
                "`{uri}` would not be found from {}; write beside the input, or name the output .glb",
                path.display()
            );
            return Err(reader.json.refuse(&pointer, Code::GltfFolder, message));
        }
        reader.warn(Code::StaysOutside, &pointer, || {
            format!(
                "`{uri}` is not found from {}; copy it there",
                path.display()
            )
        });
        Ok(())
    }
}

/// The first buffer or image that is a file beside: its pointer and its URI.
fn named_file(json: &Json<'_>) -> Option<(String, String)> {
    ["buffers", "images"].iter().find_map(|list| {
        json.entries(list)
            .iter()
            .enumerate()
            .find_map(|(index, raw)| {
                let members: Members<'_> = json.typed(raw, "").ok()?;
                let uri: String = json.typed(members.get("uri")?, "").ok()?;
                (!uri::is_data(&uri)).then(|| (format!("/{list}/{index}/uri"), uri))
            })
    })
}

/// One animation on its way into the file.
struct Baking<'a> {
    json: &'a Json<'a>,
    pointer: String,
    read: &'a Read,
    sampled: &'a Sampled<'a>,
    channels: Vec<Channel>,
    /// The values of `sampler` of these channels.
    named: Vec<&'a RawValue>,
    samplers: Vec<&'a RawValue>,
    samplers_array: &'a RawValue,
    /// The buffer view that the bytes will be.
    view: usize,
    bytes: Vec<u8>,
}

/// A sampler that was changed or appended.
struct Made {
    /// Whose keys the samples stand for.
    old: usize,
    new: usize,
    values: Range<usize>,
}

impl<'a> Baking<'a> {
    fn new(
        json: &'a Json<'a>,
        place: usize,
        read: &'a Read,
        sampled: &'a Sampled<'a>,
        edits: &Edits<'_>,
    ) -> Result<Self, WriteError> {
        let pointer = format!("/animations/{place}");
        let animation: Animation<'a> = json.entry("animations", place, &pointer)?;
        let members: Members<'a> = json.entry("animations", place, &pointer)?;
        let mut channels = Vec::new();
        let mut named = Vec::new();
        for raw in &animation.channels {
            channels.push(json.typed(raw, &pointer)?);
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
            channels,
            named,
            samplers: animation.samplers,
            samplers_array,
            view: edits.count("bufferViews"),
            bytes: Vec::new(),
        })
    }

    fn bake(&mut self, edits: &mut Edits<'_>) -> Result<(), WriteError> {
        let times = self.times()?;
        let [first, last] = [times[0], times[times.len() - 1]].map(f64::from);
        let range = format!(",\"min\":[{first:?}],\"max\":[{last:?}]");
        self.bytes
            .extend(times.iter().flat_map(|time| time.to_le_bytes()));
        let input = edits.append_to("accessors", self.accessor(0, times.len(), "SCALAR", &range));
        let mut made: Vec<Made> = Vec::new();
        for channel in &self.read.sampled {
            let values = self.values(channel);
            let same = made.iter().find(|made| {
                made.old == channel.sampler && self.bytes[made.values.clone()] == values
            });
            let sampler = match same {
                Some(made) => made.new,
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
                    let is_free = made.iter().all(|made| made.old != channel.sampler)
                        && !self.is_kept(channel.sampler);
                    let new = match is_free {
                        true => self.change_sampler(channel.sampler, (input, output), edits)?,
                        false => {
                            let sampler = format!(
                                "{{\"input\":{input},\"output\":{output},\"interpolation\":\"LINEAR\"}}"
                            );
                            edits.append(self.samplers_array, self.samplers.len(), &sampler)
                        }
                    };
                    made.push(Made {
                        old: channel.sampler,
                        new,
                        values: start..self.bytes.len(),
                    });
                    new
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
            Some(pair) => Err(Diagnostic {
                place: Some(Place::Inside(self.pointer.clone())),
                ..Diagnostic::new(
                    self.json.name,
                    Code::TimesInF32,
                    format!(
                        "f32 has no time between {} and {}; sample at a lower rate",
                        pair[0], pair[1]
                    ),
                )
            }),
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

    /// Whether a channel that is not sampled has this sampler.
    fn is_kept(&self, sampler: usize) -> bool {
        let is_sampled = |place| self.read.sampled.iter().any(|own| own.channel == place);
        let mut channels = self.channels.iter().enumerate();
        channels.any(|(place, channel)| channel.sampler == sampler && !is_sampled(place))
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
