//! The readers and the writers of every format. Clips that are read are valid, and errors say why and where;
//! clips that are written in a format, and files that are written again with samples, are read again.

use std::collections::HashMap;
use std::path::Path;

use glam::Vec3;
use tumble::{Device, Engine, FrameRate, SampleTimes};
use tumble_formats::end_frame::FramesToEnd;
use tumble_formats::format::{FormatOption, MotionOptions, TimeUnit, WriteError};
use tumble_formats::keyed::keyed;
use tumble_formats::motion::Motion;
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::sample::{ChannelMethods, Samples};
use tumble_formats::{
    Code, Diagnostic, FORMATS, Feature, Format, Limits, Loaded, ReadOptions, Severity,
};

use super::{location_is_inside, signature};

/// A file of one format.
pub(crate) fn format(format: &Format, bytes: &[u8]) -> u64 {
    let options = options(format, bytes.len());
    let loaded = match (format.read_bytes)("fuzz", bytes.to_vec(), &options) {
        Ok(loaded) => loaded,
        Err(error) => {
            is_reported(bytes, &error, Severity::Error);
            let end: String = error.message.chars().rev().take(12).collect();
            return signature((error.code, end));
        }
    };
    for error in &loaded.refused {
        is_reported(bytes, error, Severity::Error);
    }
    for warning in &loaded.warnings {
        is_reported(bytes, warning, Severity::Warning);
    }
    let reported = loaded.refused.iter().chain(&loaded.warnings);
    let mut codes: Vec<Option<Code>> = reported.map(|reported| Some(reported.code)).collect();
    // If the format cannot be written, its clips are written as NPZ, which holds clips of any kind.
    let other = FORMATS.iter().find(|other| other.name == "npz");
    let other = other.expect("NPZ is always there");
    for clip in &loaded.clips {
        is_valid(clip);
        codes.push(if format.writes_clips() {
            rewritten(clip, format)
        } else {
            rewritten(clip, other)
        });
    }
    codes.extend(kept(&loaded, format));
    let first = loaded.clips.first().map(|clip| {
        let keys = clip.set.tracks().map(|track| track.keys.len());
        (clip.set.track_count().min(5), keys.max().min(Some(3)))
    });
    signature((codes, loaded.clips.len().min(3), first))
}

/// Some of the options that a format takes, chosen by the length of the file.
fn options(format: &Format, length: usize) -> ReadOptions {
    let takes = |option, is_chosen| is_chosen && format.takes(option);
    let maps = [
        "rotations=arr_0:wxyz:track",
        "time=arr_0[0],a=arr_0[1:5]",
        "hand=state[0:4]:wxyz,time=timestamp",
    ];
    let map = maps.get(length % 6).copied();
    ReadOptions {
        limits: Limits {
            line: 4096,
            file: 65_536,
            memory: None,
        },
        source_rate: takes(FormatOption::SourceRate, !length.is_multiple_of(5))
            .then(|| FrameRate::new(30, 1).expect("a rate")),
        time_unit: takes(FormatOption::TimeUnit, length.is_multiple_of(3))
            .then_some(TimeUnit::Nanoseconds),
        map: map
            .filter(|_| format.takes(FormatOption::Map))
            .map(str::to_owned),
        source_order: takes(FormatOption::SourceOrder, length.is_multiple_of(3))
            .then_some(ComponentOrder::Wxyz),
        bridge_gaps: takes(FormatOption::BridgeGaps, length.is_multiple_of(2)),
        keyframes: takes(FormatOption::Keyframes, length.is_multiple_of(2)),
        ..ReadOptions::default()
    }
}

/// A message says something, about a line that is there.
fn is_reported(bytes: &[u8], found: &Diagnostic, severity: Severity) {
    location_is_inside(bytes, found);
    assert!(!found.message.is_empty(), "{found}");
    assert_eq!(found.code.severity(), severity, "{found}");
}

/// Unit keys at increasing times, of joints that are trees.
fn is_valid(clip: &Motion) {
    let tracks = clip.set.track_count();
    for track in clip.set.tracks() {
        assert!(!track.keys.is_empty());
        assert_eq!(track.times.len(), track.keys.len());
        assert!(track.times.windows(2).all(|pair| pair[0] < pair[1]));
        for key in track.keys {
            assert!((key.as_dquat().length() - 1.0).abs() < 1e-6, "{key}");
        }
    }
    assert!([0, tracks].contains(&clip.skeleton.len()));
    assert!([0, tracks].contains(&clip.channels.len()));
    for start in 0..clip.skeleton.len() {
        let above = |joint: &usize| clip.skeleton[*joint].parent;
        let ancestors = std::iter::successors(Some(start), above);
        assert!(ancestors.take(tracks + 1).count() <= tracks, "a circle");
    }
}

/// Writes the keys of a clip and reads them: the clip is alike, and from then on each file is the same to the last
/// byte. Gives why that is refused.
fn rewritten(clip: &Motion, format: &Format) -> Option<Code> {
    let Ok(samples) = keyed(clip) else {
        return None; // channels at separate times, or tangents
    };
    let rate = clip.rate.or_else(|| clip.rate_of_keys());
    let (bytes, warnings) = match written(clip, &samples, rate, format) {
        Ok(written) => written,
        Err(refused) => return Some(refused),
    };
    let options = ReadOptions {
        source_rate: rate.filter(|_| format.takes(FormatOption::TimesApart)),
        ..ReadOptions::default()
    };
    let read = |bytes: Vec<u8>| {
        let again = (format.read_bytes)("fuzz", bytes, &options);
        let mut again = again.expect("a written file is read again");
        assert_eq!((again.clips.len(), &again.refused), (1, &Vec::new()));
        again.clips.remove(0)
    };
    let again = read(bytes);
    is_valid(&again);
    are_alike(&again, clip, &samples, format, &warnings);
    let write = |clip: &Motion| {
        let samples = keyed(clip).expect("one list of times, as it was written");
        let written = written(clip, &samples, clip.rate.or(rate), format);
        written.expect("as before").0
    };
    // The first time, zeros may lose their sign; angles and matrices are rounded each time.
    if format.supports(Feature::Quaternions) {
        let second = write(&again);
        let third = write(&read(second.clone()));
        assert!(second == third, "other bytes when it is written again");
    }
    None
}

fn written(
    clip: &Motion,
    samples: &Samples,
    rate: Option<FrameRate>,
    format: &Format,
) -> Result<(Vec<u8>, Vec<Diagnostic>), Code> {
    let options = MotionOptions {
        name: "fuzz".to_owned(),
        format: format.name.to_owned(),
        ..MotionOptions::default()
    };
    let mut bytes = Vec::new();
    match format.write_clips(&[samples.of(clip, rate, &[])], &options, &mut bytes) {
        Ok(warnings) => Ok((bytes, warnings)),
        Err(WriteError::Refused(error)) => {
            assert!(!error.message.is_empty());
            Err(error.code)
        }
        Err(WriteError::Io(error)) => panic!("{error}"),
    }
}

/// The same tracks at the same times, as far as a format has room for them.
fn are_alike(
    again: &Motion,
    clip: &Motion,
    samples: &Samples,
    format: &Format,
    warnings: &[Diagnostic],
) {
    let tracks = clip.set.track_count();
    assert_eq!(again.set.track_count(), tracks);
    let found = keyed(again).expect("one list of times, as it was written");
    assert_eq!(found.times.len(), samples.times.len());
    let says = |code| warnings.iter().any(|warning| warning.code == code);
    if !says(Code::StartMoved) {
        for (time, other) in samples.times.iter().zip(&found.times) {
            let [time, other] =
                [(time, clip), (other, again)].map(|(time, clip)| time + clip.time_offset as f64);
            let off = (time - other).abs();
            assert!(off <= 1e-6 * time.abs().max(1.0), "{time} {other}");
        }
    }
    // Joints may come in another order, parents first: names tell which is which.
    let names = |clip: &Motion| {
        (0..tracks)
            .map(|track| clip.set.track_name(track))
            .collect()
    };
    let (before, after): (Vec<String>, Vec<String>) = (names(clip), names(again));
    let index: HashMap<&str, usize> = (after.iter().map(String::as_str).zip(0..)).collect();
    let is_named = format.supports(Feature::TrackNames)
        && index.len() == tracks
        && !says(Code::NameChanged)
        && !says(Code::SameName);
    let order: Vec<usize> = match is_named {
        true => (before.iter())
            .map(|name| *index.get(&**name).expect("a track of each name"))
            .collect(),
        false => (0..tracks).collect(),
    };
    if clip.is_world != again.is_world {
        return; // relative to the parents now
    }
    let vector = |list: &[Vec3], index: usize| list.get(index).copied().unwrap_or_default();
    for sample in 0..samples.times.len() {
        for (track, &other) in order.iter().enumerate() {
            let [at, other] = [track, other].map(|track| sample * tracks + track);
            let (expected, rotation) = (samples.rotations[at], found.rotations[other]);
            let is_same = rotation == expected || rotation == -expected;
            let (left, right) = (
                expected.as_dquat().normalize(),
                rotation.as_dquat().normalize(),
            );
            let off = 2.0 * (left.conjugate() * right).xyz().length();
            let is_near = !format.supports(Feature::Quaternions) && off < 1e-6;
            assert!(is_same || is_near, "{expected} {rotation} {off:e}");
            if format.supports(Feature::Translations) {
                let expected = clip.origin(track).as_vec3() + vector(&samples.translations, at);
                let other =
                    again.origin(order[track]).as_vec3() + vector(&found.translations, other);
                let off = (expected - other).length();
                let bound = 1e-6 * expected.length().max(other.length());
                assert!(off <= bound, "{expected} {other}");
            }
        }
    }
}

/// Writes a file that is kept with samples of its clips, under each ending of its format; it is read again with as
/// many clips. Gives why that is refused.
fn kept(loaded: &Loaded, format: &Format) -> Vec<Option<Code>> {
    let Some(document) = &loaded.document else {
        return Vec::new();
    };
    let engine = Engine::new(Device::Cpu).expect("the CPU");
    let methods = ChannelMethods::AUTHORED;
    let rate = FrameRate::new(7, 1).expect("a rate");
    let sampled = loaded.clips.iter().filter_map(|clip| {
        let frames = document.frames(clip.index, rate).ok()?;
        let to_end = FramesToEnd::new(clip, frames, document.end_frame()).ok()?;
        let times = to_end.times();
        let is_short = (1..500).contains(&times.len());
        is_short.then(|| {
            assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "{times:?}");
            let samples = methods.sample(&engine, clip, &SampleTimes::at(times));
            (clip, samples.expect("unit keys in order"), to_end.rate)
        })
    });
    let sampled: Vec<(&Motion, Samples, Option<FrameRate>)> = sampled.collect();
    let clips: Vec<_> = (sampled.iter())
        .map(|(clip, samples, rate)| (clip.index, samples.of(clip, *rate, &[])))
        .collect();
    let endings = std::iter::once(&format.name).chain(format.extensions);
    let outcomes = endings.map(|ending| {
        let name = format!("/fuzz.{ending}");
        let mut out = Vec::new();
        match document.write(
            &clips,
            &MotionOptions::default(),
            Path::new(&name),
            &mut out,
        ) {
            Ok(warnings) => {
                let again = (format.read_bytes)("fuzz", out, &ReadOptions::default());
                let again = again.expect("a written file is read again");
                assert_eq!(again.clips.len(), loaded.clips.len(), "{:?}", again.refused);
                warnings.first().map(|warning| warning.code)
            }
            Err(WriteError::Refused(error)) => Some(error.code),
            Err(WriteError::Io(error)) => panic!("{error}"),
        }
    });
    outcomes.collect()
}
