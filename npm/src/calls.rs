//! The calls of the interface, by number, and the clips and samplers to which JavaScript has handles.

use glam::Quat;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use tumble::{Channel, Device, Engine, METHODS, Sampler};
use tumble_formats::motion::Motion;
use tumble_formats::packed;
#[cfg(feature = "files")]
use tumble_formats::{Diagnostic, Format, ReadOptions};

use crate::answer::{Answer, Array, Fault};
use crate::sampling::{self, SampleCall};

/// The state between calls. A handle in JavaScript is an index into `clips` or `samplers`; freed slots are `None`.
#[derive(Default)]
pub(crate) struct Calls {
    engine: Option<Engine>,
    clips: Vec<Option<Motion>>,
    samplers: Vec<Option<KeptSampler>>,
}

/// A sampler with memory for one pose, so that sampling does not allocate. JavaScript reads the pose from there.
struct KeptSampler {
    sampler: Sampler,
    pose: Vec<Quat>,
}

/// The header of calls about a sampler: its handle.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SamplerHeader {
    sampler: usize,
}

/// The header of calls about a clip: its handle.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ClipHeader {
    clip: usize,
}

/// The header of calls about one track: the clip's handle and the index of the track.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TrackHeader {
    clip: usize,
    track: usize,
}

/// The header of the call `read`. The bytes of the file follow it.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
#[cfg_attr(not(feature = "files"), allow(dead_code))] // without the feature, `read` refuses every file
struct FileHeader {
    name: String,
    /// The rate of the keys [frames per second], for files that state none.
    source_rate: Option<String>,
}

impl Calls {
    /// Executes a call. `numbers` are the bytes after the header: sample times, packed tracks, or a file.
    pub(crate) fn call(
        &mut self,
        call: u32,
        header: &[u8],
        numbers: Vec<u8>,
    ) -> Result<Answer, Fault> {
        match call {
            0 => Ok(about()),
            1 => self.unpack(&numbers),
            2 => self.read(read_header(header)?, numbers),
            3 => self.sample(&read_header(header)?, &numbers),
            4 => self.keys(&read_header(header)?),
            5 => self.free(&read_header(header)?),
            6 => self.sampler(&read_header(header)?),
            7 => self.free_sampler(&read_header(header)?),
            _ => Err(Fault::new(format!("there is no call {call}"))),
        }
    }

    /// Stores a clip from the packed bytes that `core.js` or `tumble view` made (`tumble_formats::packed`).
    fn unpack(&mut self, bytes: &[u8]) -> Result<Answer, Fault> {
        let clip = packed::from_bytes(bytes)?;
        Ok(Answer::new(self.keep(clip), Vec::new()))
    }

    /// Refuses the file: pages of `tumble view` contain an engine without formats, because it is smaller.
    #[cfg(not(feature = "files"))]
    #[allow(clippy::unused_self)] // the same signature as with the feature `files`
    fn read(&mut self, file: FileHeader, _: Vec<u8>) -> Result<Answer, Fault> {
        let FileHeader {
            name,
            source_rate: _,
        } = file;
        Err(Fault::new(format!("{name}: this engine reads no files")))
    }

    /// Reads the clips of a file and stores them. Fails if no clip can be read; otherwise `refused` lists the errors.
    #[cfg(feature = "files")]
    fn read(&mut self, file: FileHeader, bytes: Vec<u8>) -> Result<Answer, Fault> {
        let mut options = ReadOptions::default();
        if let Some(rate) = &file.source_rate {
            options.source_rate = Some(rate.parse()?);
        }
        let loaded = Format::read_detected(&file.name, bytes, &options)
            .map_err(|fault| Fault::of_file(&fault))?;
        let texts = |list: &[Diagnostic]| -> Vec<String> {
            list.iter().map(Diagnostic::to_string).collect()
        };
        if let (true, [fault, ..]) = (loaded.clips.is_empty(), &loaded.refused[..]) {
            return Err(Fault::of_file(fault));
        }
        let (warnings, refused) = (texts(&loaded.warnings), texts(&loaded.refused));
        let clips: Vec<Value> = (loaded.clips.into_iter())
            .map(|clip| self.keep(clip))
            .collect();
        let json = json!({"clips": clips, "warnings": warnings, "refused": refused});
        Ok(Answer::new(json, Vec::new()))
    }

    fn sample(&mut self, call: &SampleCall, numbers: &[u8]) -> Result<Answer, Fault> {
        let engine = made(&mut self.engine)?;
        sampling::sample(engine, find(&self.clips, call.clip)?, call, numbers)
    }

    /// Uploads a clip and creates a sampler of it. The sampler stays valid after the clip is freed.
    fn sampler(&mut self, call: &SampleCall) -> Result<Answer, Fault> {
        let engine = made(&mut self.engine)?;
        let sampler = sampling::sampler(engine, find(&self.clips, call.clip)?, call)?;
        let tracks = sampler.track_count();
        let pose = vec![Quat::IDENTITY; tracks.max(1)];
        let slot = put(&mut self.samplers, KeptSampler { sampler, pose });
        Ok(Answer::new(
            json!({"sampler": slot, "tracks": tracks}),
            Vec::new(),
        ))
    }

    /// The rotations of a sampler at a time: of one track, or of all if `track` is `None`. Does not allocate.
    pub(crate) fn pose(
        &mut self,
        sampler: usize,
        track: Option<usize>,
        time: f64,
    ) -> Result<&[Quat], Fault> {
        let found = self.samplers.get_mut(sampler).and_then(Option::as_mut);
        let KeptSampler { sampler, pose } = found.ok_or_else(|| no_sampler(sampler))?;
        match track {
            Some(track) => {
                pose[0] = sampler.sample(track, time)?;
                Ok(&pose[..1])
            }
            None => {
                let all = &mut pose[..sampler.track_count()];
                sampler.pose(time, all)?;
                Ok(all)
            }
        }
    }

    fn free_sampler(&mut self, of: &SamplerHeader) -> Result<Answer, Fault> {
        let slot = self.samplers.get_mut(of.sampler);
        let freed = slot.and_then(Option::take);
        freed.ok_or_else(|| no_sampler(of.sampler))?;
        Ok(Answer::new(json!({}), Vec::new()))
    }

    /// The keys of a track: times [s], rotations, and translations and scales if it has any.
    fn keys(&self, of: &TrackHeader) -> Result<Answer, Fault> {
        let set = &find(&self.clips, of.clip)?.set;
        let track = set.get(of.track).ok_or_else(|| {
            let tracks = set.track_count();
            Fault::new(format!(
                "there is no track {} of {tracks}; they count from 0",
                of.track
            ))
        })?;
        let mut arrays = vec![
            ("times", Array::F64(track.times.to_vec())),
            ("rotations", Array::Quats(track.keys.to_vec())),
        ];
        for (channel, times, values) in [
            (Channel::Translation, "translationTimes", "translations"),
            (Channel::Scale, "scaleTimes", "scales"),
        ] {
            if let Some(keys) = set.vector_keys(channel, of.track) {
                arrays.push((times, Array::F64(keys.times.to_vec())));
                arrays.push((values, Array::Vectors(keys.keys.to_vec())));
            }
        }
        Ok(Answer::new(json!({}), arrays))
    }

    fn free(&mut self, of: &ClipHeader) -> Result<Answer, Fault> {
        find(&self.clips, of.clip)?;
        self.clips[of.clip] = None;
        Ok(Answer::new(json!({}), Vec::new()))
    }

    /// Stores a clip. Returns its handle (`clip`) and the properties that JavaScript's `Clip` shows.
    fn keep(&mut self, clip: Motion) -> Value {
        let set = &clip.set;
        let tracks = 0..set.track_count();
        let parents = tracks.clone().map(|track| {
            let joint = clip.skeleton.get(track);
            joint.and_then(|joint| joint.parent)
        });
        let mut found = json!({
            "name": clip.name,
            "names": tracks.clone().map(|track| set.track_name(track)).collect::<Vec<_>>(),
            "parents": parents.collect::<Vec<_>>(),
            "isWorld": clip.is_world,
            "span": set.time_span(),
            "keys": set.key_count(),
            "rate": clip.rate.map(|rate| rate.to_string()),
        });
        found["clip"] = put(&mut self.clips, clip).into();
        found
    }
}

/// The engine. It is created by the first call that needs it.
fn made(engine: &mut Option<Engine>) -> Result<&Engine, Fault> {
    Ok(match engine {
        Some(engine) => engine,
        none => none.insert(Engine::new(Device::Cpu)?),
    })
}

/// Puts a value in the first free slot; returns the slot.
fn put<T>(slots: &mut Vec<Option<T>>, value: T) -> usize {
    let free = slots.iter().position(Option::is_none);
    let slot = free.unwrap_or(slots.len());
    if free.is_none() {
        slots.push(None);
    }
    slots[slot] = Some(value);
    slot
}

fn no_sampler(sampler: usize) -> Fault {
    Fault::new(format!("there is no sampler {sampler}; it was freed"))
}

fn find(clips: &[Option<Motion>], clip: usize) -> Result<&Motion, Fault> {
    let found = clips.get(clip).and_then(Option::as_ref);
    found.ok_or_else(|| Fault::new(format!("there is no clip {clip}; it was freed")))
}

fn read_header<T: DeserializeOwned>(header: &[u8]) -> Result<T, Fault> {
    serde_json::from_slice(header).map_err(|error| {
        // The JSON is generated by core.js, so its line and column would not help a user: they are removed.
        let text = error.to_string();
        let message = text.split(" at line ").next().unwrap_or(&text);
        Fault::new(message)
    })
}

/// The answer to the call `about`: the version, the methods and the formats.
fn about() -> Answer {
    let methods = METHODS.iter().map(|method| {
        json!({
            "name": method.name,
            "summary": method.summary,
            "interpolates": method.interpolates,
        })
    });
    let json = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "methods": methods.collect::<Vec<_>>(),
        "formats": formats(),
    });
    Answer::new(json, Vec::new())
}

/// The names of the formats that `read` supports; none without the feature `files`.
fn formats() -> Vec<&'static str> {
    #[cfg(feature = "files")]
    return tumble_formats::FORMATS
        .iter()
        .map(|format| format.name)
        .collect();
    #[cfg(not(feature = "files"))]
    Vec::new()
}
