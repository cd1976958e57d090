//! The calls, by their numbers, and the clips and samplers that JavaScript has handles of.

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

/// All that lasts from call to call.
#[derive(Default)]
pub(crate) struct Calls {
    engine: Option<Engine>,
    clips: Vec<Option<Motion>>,
    samplers: Vec<Option<KeptSampler>>,
}

/// A sampler, and room for the pose that it gave last.
struct KeptSampler {
    sampler: Sampler,
    pose: Vec<Quat>,
}

/// A sampler that a call is about.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SamplerHeader {
    sampler: usize,
}

/// A clip that a call is about.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ClipHeader {
    clip: usize,
}

/// A track of a clip.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TrackHeader {
    clip: usize,
    track: usize,
}

/// A file whose bytes come behind.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
#[cfg_attr(not(feature = "files"), allow(dead_code))] // no file is read then
struct FileHeader {
    name: String,
    /// The rate of the keys, where the file does not say it.
    source_rate: Option<String>,
}

impl Calls {
    /// Makes a call. `numbers` is what came behind the header.
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

    /// Makes a clip of its packed bytes.
    fn unpack(&mut self, bytes: &[u8]) -> Result<Answer, Fault> {
        let clip = packed::from_bytes(bytes)?;
        Ok(Answer::new(self.keep(clip), Vec::new()))
    }

    /// Refuses files.
    #[cfg(not(feature = "files"))]
    #[allow(clippy::unused_self)] // as where files are read
    fn read(&mut self, file: FileHeader, _: Vec<u8>) -> Result<Answer, Fault> {
        let FileHeader {
            name,
            source_rate: _,
        } = file;
        Err(Fault::new(format!("{name}: this engine reads no files")))
    }

    /// Reads the clips of a file.
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

    /// Makes a sampler of a clip.
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

    /// The rotations of a sampler at a time: of one track, or of every one. Nothing is allocated.
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

    /// The keys of a track.
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

    /// Keeps a clip, and says what JavaScript is to know of it.
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

/// The engine, which is made for the first call that needs it.
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
        // Where in a text that nobody wrote says nothing to anybody.
        let text = error.to_string();
        let message = text.split(" at line ").next().unwrap_or(&text);
        Fault::new(message)
    })
}

/// The version, the methods and the formats.
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

/// The names of the formats that are read.
fn formats() -> Vec<&'static str> {
    #[cfg(feature = "files")]
    return tumble_formats::FORMATS
        .iter()
        .map(|format| format.name)
        .collect();
    #[cfg(not(feature = "files"))]
    Vec::new()
}
