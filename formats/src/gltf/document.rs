//! A file that is kept as it was read, and written again with the samples of its animations instead of their keys.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::value::RawValue;
use tumble::{FrameRate, SampleTimes};

use crate::diagnostic::{Code, Diagnostic};
use crate::format::{Document, Format, JointClip, MotionOptions, WriteError, check_times};
use crate::gltf::FORMAT;
use crate::gltf::animation::ReadAnimation;
use crate::gltf::bake::{AnimationBaker, is_cut, is_part};
use crate::gltf::character;
use crate::gltf::container::{Container, check_length};
use crate::gltf::data::BufferData;
use crate::gltf::edits::Edits;
use crate::gltf::gather;
use crate::gltf::json::{Json, JsonMembers};
use crate::gltf::nodes::Nodes;
use crate::gltf::prune::{prune, prune_replaced};
use crate::gltf::reader::GltfReader;
use crate::gltf::schema::{Animation, Channel, TargetPath};
use crate::gltf::skins;
use crate::gltf::uri;
use crate::limits::Limits;
use crate::motion::carried_mesh::CarriedMesh;
use crate::motion::end_frame::{EndFrame, RateFrames, is_on_frame};
use crate::motion::{Motion, SampledClip};
use crate::rate::Precision;
use crate::warnings::Warnings;

/// A file that was read.
#[derive(Debug)]
pub(super) struct GltfDocument {
    /// The file's name in messages.
    pub(super) name: String,
    pub(super) container: Container,
    /// The folder of the files that it names.
    pub(super) folder: Option<PathBuf>,
    /// The largest sizes of these files that are read.
    pub(super) limits: Limits,
    /// The animations; `None` for those that are written unchanged.
    pub(super) animations: Vec<Option<ReadAnimation>>,
}

impl Document for GltfDocument {
    fn frames(&self, clip: usize, rate: FrameRate) -> Result<RateFrames, Diagnostic> {
        let found = |times: Vec<f64>, end: f64| RateFrames {
            frames: SampleTimes::at(times),
            rate,
            end,
        };
        let Some(read) = self.animations.get(clip).and_then(Option::as_ref) else {
            return Ok(found(Vec::new(), 0.0));
        };
        let [first, last] = read.span;
        let spacing = Precision::F32.ulp(first.abs().max(last.abs()));
        if spacing * rate.per_second() > 1.0 {
            let fits = 1.0 / spacing;
            let fits = if fits >= 1.0 { fits.floor() } else { fits };
            let message = format!(
                "at {last} s, steps of f32 are {spacing} s, longer than the {} s of a frame at {rate} fps; give \
                 --fps {fits} or less",
                1.0 / rate.per_second()
            );
            return Err(self.refuse(clip, Code::TimesInF32, message));
        }
        let start = (first * rate.per_second()).floor() as i64;
        let end = (last * rate.per_second()).ceil() as i64;
        let time = |frame: i64| rate.time_of(frame.unsigned_abs()) * frame.signum() as f64;
        // The ends are exact times, but they may have been rounded from frames. If frames are much longer than
        // rounding, an ulp is tolerated (see `grid`).
        let near = if spacing * rate.per_second() < 0.01 {
            1.0
        } else {
            0.5
        };
        let is_near = |time: f64, end: f64| (time - end).abs() <= near * Precision::F32.ulp(time);
        let frames = || (start..=end).map(time);
        let is_within = |time: f64| {
            first < time && time < last && !is_near(time, first) && !is_near(time, last)
        };
        let mut times = vec![first];
        times.extend(frames().filter(|&time| is_within(time)));
        let last_frame = times[times.len() - 1];
        let is_frame =
            frames().any(|time| is_near(time, last)) || is_on_frame(last, last_frame, rate);
        times.extend((last > first && is_frame).then_some(last));
        Ok(found(times, last))
    }

    fn end_frame(&self) -> EndFrame {
        EndFrame::Key
    }

    fn writes(&self, format: &Format) -> bool {
        format.name == FORMAT.name
    }

    fn other_contents(&self) -> Vec<String> {
        let Ok(json) = Json::parse(&self.name, &self.container.text) else {
            return Vec::new();
        };
        let lists = [
            "meshes",
            "materials",
            "textures",
            "images",
            "cameras",
            "extensionsUsed",
        ];
        let has = |list: &&str| !json.optional::<&RawValue>(list).is_empty();
        let lists = lists.into_iter().filter(has).map(str::to_owned);
        let animations: Vec<Animation<'_>> = json.optional("animations");
        let channels = animations.iter().enumerate().flat_map(|(animation, all)| {
            let channels = all.channels.iter().enumerate();
            channels.map(move |(channel, raw)| (animation, channel, raw))
        });
        let mut others: Vec<String> = channels
            .filter_map(|(animation, index, raw)| {
                let channel: Channel = serde_json::from_str(raw.get()).ok()?;
                let is_read = match channel.target.moves() {
                    // Weights of a node without morph targets are not read.
                    Some((_, TargetPath::Weights)) => self.reads(animation, index),
                    moved => moved.is_some(),
                };
                (!is_read).then_some(channel.target.path)
            })
            .map(|path| format!("channels of `{path}`"))
            .collect();
        others.sort();
        others.dedup();
        lists.chain(others).collect()
    }

    fn carried_mesh(&self, clip: &Motion) -> Result<Option<CarriedMesh>, Diagnostic> {
        let mut json = Json::parse(&self.name, &self.container.text)?;
        for list in skins::LISTS {
            json.take_apart(list)?;
        }
        let warnings = Warnings::new(&self.name);
        let folder = self.folder.as_deref();
        let reader = GltfReader::new(&json, &self.container, folder, self.limits, warnings)?;
        skins::carried(&reader, clip)
    }

    fn write(
        &self,
        clips: &[(usize, SampledClip<'_>)],
        options: &MotionOptions,
        path: &Path,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError> {
        for (_, sampled) in clips {
            check_times(sampled, &options.name)?;
        }
        self.rewrite(&Change::Keys(clips), options, path, out)
    }

    fn write_instead(
        &self,
        clips: &[&Motion],
        options: &MotionOptions,
        path: &Path,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError> {
        self.rewrite(&Change::Animations(clips), options, path, out)
    }

    fn write_joints(
        &self,
        clips: &[JointClip<'_>],
        options: &MotionOptions,
        path: &Path,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError> {
        self.rewrite(&Change::Joints(clips), options, path, out)
    }
}

/// The parts that are written with other contents than were read.
enum Change<'a> {
    /// The keys of some animations.
    Keys(&'a [(usize, SampledClip<'a>)]),
    /// All animations.
    Animations(&'a [&'a Motion]),
    /// The channels of joints in the animations that these clips were read from.
    Joints(&'a [JointClip<'a>]),
}

impl GltfDocument {
    fn rewrite(
        &self,
        change: &Change<'_>,
        options: &MotionOptions,
        path: &Path,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError> {
        let json = Json::parse(&self.name, &self.container.text)?;
        let warnings = Warnings::new(&self.name);
        let folder = self.folder.as_deref();
        let reader = GltfReader::new(&json, &self.container, folder, self.limits, warnings)?;
        let extension = path.extension().unwrap_or_default();
        let is_text = extension.eq_ignore_ascii_case("gltf");
        self.check_folder(&reader, path, is_text)?;
        let mut edits = Edits::new(&json);
        let mut data = match (self.container.is_glb(), is_text) {
            (true, _) => {
                BufferData::of_file(&json, &reader, self.container.bin().unwrap_or_default())?
            }
            (false, true) => BufferData::in_uri(&json),
            (false, false) => gather::buffers(&reader, &mut edits)?,
        };
        let more = match change {
            Change::Keys(clips) => self.baked(clips).map(sample_bytes).sum(),
            Change::Animations(clips) => character::key_bytes(clips.iter().copied()),
            Change::Joints(clips) => {
                let both = clips.iter().flat_map(|clip| [clip.joints, clip.weights]);
                character::key_bytes(both)
            }
        };
        check_length(&json, data.length_with(more))?;
        if !self.container.is_glb() && !is_text {
            gather::images(&reader, &mut edits, &mut data)?;
        }
        let is_changed = match change {
            Change::Keys(clips) => {
                let quantize = options.quantize.is_some();
                self.bake(&reader, (clips, quantize), &mut edits, &mut data)?
            }
            Change::Animations(_) | Change::Joints(_) => {
                let (nodes, name) = (Nodes::read(&json)?, &options.name);
                let bytes = match change {
                    Change::Joints(clips) => {
                        for clip in *clips {
                            self.note_whole(&reader, clip.joints.index, |read| {
                                is_part(read, clip.weights)
                            });
                        }
                        let clips = (*clips, &self.animations[..]);
                        character::replace_joints(&reader, &nodes, clips, name, &mut edits)?
                    }
                    Change::Animations(clips) => {
                        character::replace_animations(&reader, &nodes, clips, name, &mut edits)?
                    }
                    Change::Keys(_) => Vec::new(),
                };
                data.append(&mut edits, &bytes);
                !bytes.is_empty()
            }
        };
        let mut bin = data.finish(&json, &mut edits);
        let mut text = edits.finish();
        if is_changed {
            let length = |parts: &Vec<&[u8]>| parts.iter().map(|part| part.len()).sum();
            let length = bin.as_ref().map_or(0, length);
            let cut;
            (text, cut) = match change {
                Change::Keys(_) => prune(&json, text, length),
                Change::Animations(_) | Change::Joints(_) => prune_replaced(&json, text, length),
            };
            bin = bin.map(|parts| cut.kept(&parts));
        }
        if is_text {
            out.write_all(text.as_bytes())?;
        } else {
            let bytes = bin.iter().flatten().map(|part| part.len()).sum::<usize>() + text.len();
            check_length(&json, bytes as u64)?;
            self.container.write_glb(&text, bin.as_deref(), out)?;
        }
        // All other warnings were already reported when the file was read.
        let mut warnings = reader.warnings.into_inner().into_list();
        warnings.retain(|warning| [Code::StaysOutside, Code::StaysWhole].contains(&warning.code));
        if let Change::Animations(clips) = change
            && clips.iter().any(|clip| clip.set.scalar_count() > 0)
        {
            let message =
                "animations of another file have no morph targets here, left out: the scalars";
            warnings.push(Diagnostic::new(&options.name, Code::NoRoom, message));
        }
        Ok(warnings)
    }

    /// Whether a channel of an animation is in the clip.
    fn reads(&self, animation: usize, channel: usize) -> bool {
        let read = self.animations.get(animation).and_then(Option::as_ref);
        read.is_some_and(|read| {
            let mut channels = read.sampled.iter().chain(&read.others);
            channels.any(|read| read.channel == channel)
        })
    }

    /// The clips whose keys are written, with their animations.
    fn baked<'a>(
        &'a self,
        clips: &'a [(usize, SampledClip<'a>)],
    ) -> impl Iterator<Item = (&'a ReadAnimation, &'a (usize, SampledClip<'a>))> {
        let read = |index: usize| self.animations.get(index).and_then(Option::as_ref);
        clips
            .iter()
            .filter_map(move |clip| Some((read(clip.0)?, clip)))
    }

    /// Writes samples or keys into animations; gives whether any was changed.
    fn bake<'a>(
        &'a self,
        reader: &GltfReader<'a>,
        (clips, quantize): (&'a [(usize, SampledClip<'a>)], bool),
        edits: &mut Edits<'a>,
        data: &mut BufferData<'a>,
    ) -> Result<bool, WriteError> {
        let mut is_baked = false;
        for (read, (index, sampled)) in self.baked(clips) {
            let cuts = is_cut(read, sampled);
            self.note_whole(reader, *index, |_| cuts);
            if !read.sampled.is_empty() || cuts {
                let json = reader.json;
                let mut baking =
                    AnimationBaker::new(json, *index, read, (sampled, quantize), edits)?;
                baking.bake(edits)?;
                data.append(edits, baking.bytes.bytes());
                is_baked = true;
            }
        }
        Ok(is_baked)
    }

    /// Warns of channels that stay as long as they are in an animation that is cut.
    fn note_whole(
        &self,
        reader: &GltfReader<'_>,
        index: usize,
        is_cut: impl Fn(&ReadAnimation) -> bool,
    ) {
        let Some(Some(read)) = self.animations.get(index) else {
            return;
        };
        if read.beside == 0 || !is_cut(read) {
            return;
        }
        reader.warn(Code::StaysWhole, &format!("/animations/{index}"), || {
            let channels = match read.beside {
                1 => "1 channel of another property is".to_owned(),
                count => format!("{count} channels of other properties are"),
            };
            format!(
                "{channels} not cut but copied whole, at their times; the animation is as long as its longest channel"
            )
        });
    }

    fn refuse(&self, animation: usize, code: Code, message: String) -> Diagnostic {
        Diagnostic::new(&self.name, code, message).inside(format!("/animations/{animation}"))
    }

    /// Checks that URIs of other files stay valid: they are relative to the folder of the file.
    fn check_folder(
        &self,
        reader: &GltfReader<'_>,
        path: &Path,
        is_text: bool,
    ) -> Result<(), Diagnostic> {
        if is_text && self.container.is_glb() {
            let message = "a GLB cannot be written as .gltf; end the name of the output in .glb";
            return Err(Diagnostic::new(&self.name, Code::GltfFolder, message));
        }
        let is_gathered = !is_text && !self.container.is_glb();
        let Some((pointer, uri)) = named_file(reader.json).filter(|_| !is_gathered) else {
            return Ok(());
        };
        let canonical = |folder: &Path| {
            let here = folder.as_os_str().is_empty();
            std::fs::canonicalize(if here { Path::new(".") } else { folder }).ok()
        };
        let source_folder = self.folder.as_deref().and_then(canonical);
        let target = canonical(path.parent().unwrap_or(Path::new("")));
        if source_folder.is_some() && source_folder == target {
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

/// The first buffer or image in another file: its JSON pointer and its URI.
fn named_file(json: &Json<'_>) -> Option<(String, String)> {
    ["buffers", "images"].iter().find_map(|list| {
        json.entries(list)
            .iter()
            .enumerate()
            .find_map(|(index, raw)| {
                let members: JsonMembers<'_> = json.typed(raw, "").ok()?;
                let uri: String = json.typed(members.get("uri")?, "").ok()?;
                (!uri::is_data(&uri)).then(|| (format!("/{list}/{index}/uri"), uri))
            })
    })
}

/// How many bytes the samples of a clip take.
fn sample_bytes((read, (_, sampled)): (&ReadAnimation, &(usize, SampledClip<'_>))) -> u64 {
    let widths = read.sampled.iter();
    let widths = widths.map(|channel| channel.path.width() * channel.elements);
    let numbers = 1 + widths.sum::<usize>();
    4 * numbers as u64 * sampled.times.len() as u64
}
