//! glTF files are read as their specification says: broken files, and cases that are in no fixture.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use glam::Vec3;
use proptest::prelude::*;
use serde_json::Value;
use tumble::{Channel, Device, Engine, NORM_TOLERANCE, SampleTimes};
use tumble_formats::gltf::{open_gltf, read_gltf};
use tumble_formats::keys::Duplicates;
use tumble_formats::motion::{ChannelInterpolation, Motion};
use tumble_formats::sample::{ChannelMethods, Samples};
use tumble_formats::world::world;
use tumble_formats::{Code, Diagnostic, Format, Limits, Loaded, ReadOptions};

use crate::support::shared_data;

pub(crate) fn fixture(name: &str) -> PathBuf {
    crate::cases::folder("glb").join(name)
}

pub(crate) fn open(path: &Path) -> Loaded {
    open_gltf(path, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

pub(crate) fn raw() -> ReadOptions {
    ReadOptions {
        raw_times: true,
        ..ReadOptions::default()
    }
}

/// A clip's channels at these times, each by its own sampler.
pub(crate) fn sample(clip: &Motion, times: Vec<f64>) -> Samples {
    let engine = Engine::new(Device::Cpu).unwrap();
    let methods = ChannelMethods::AUTHORED;
    methods
        .sample(&engine, clip, &SampleTimes::at(times))
        .unwrap()
}

pub(crate) fn json_of(path: &Path) -> Value {
    let bytes = fs::read(path).unwrap();
    let text = if bytes.starts_with(b"glTF") {
        let length = u32::from_le_bytes(*bytes[12..].first_chunk().unwrap());
        &bytes[20..20 + length as usize]
    } else {
        &bytes
    };
    serde_json::from_slice(text).unwrap()
}

/// The track of a node, by the names that nodes have.
pub(crate) fn track_of(clip: &Motion, json: &Value, node: usize) -> usize {
    let named = json["nodes"][node]["name"].as_str().unwrap_or_default();
    let names = match named {
        "" => [format!("node{node}"), String::new()],
        name => [format!("{name}#{node}"), name.to_owned()],
    };
    let found = names.iter().find_map(|name| {
        let mut tracks = clip.set.tracks();
        tracks.position(|track| track.name == Some(name))
    });
    found.unwrap_or_else(|| panic!("node {node} is no track"))
}

/// The key times of one channel.
pub(crate) fn keys_of<'a>(clip: &'a Motion, track: usize, path: &str) -> &'a [f64] {
    let vectors = |channel| clip.set.vector_keys(channel, track).map(|keys| keys.times);
    let times = match path {
        "rotation" => Some(clip.set.track(track).times),
        "translation" => vectors(Channel::Translation),
        _ => vectors(Channel::Scale),
    };
    times.unwrap_or_default()
}

#[test]
fn broken_files_are_refused_or_read_with_a_warning() {
    let Some(data) = shared_data() else { return };
    let verdicts = [
        ("bom.glb", Code::NoAnimations, "/animations"),
        (
            "channel_duplicate_targets.gltf",
            Code::TwoChannels,
            "/animations/0/channels/1/target",
        ),
        (
            "channel_node_matrix.gltf",
            Code::NodeMatrix,
            "/nodes/0/matrix",
        ),
        (
            "invalid_input_values.gltf",
            Code::NegativeTime,
            "/animations/0/samplers/0/input",
        ),
        ("invalid_length.gltf", Code::NoAnimations, "/animations"),
        ("invalid_magic.glb", Code::Json, "1:1"),
        (
            "invalid_sparse_count_and_stride.gltf",
            Code::NoAnimations,
            "/animations",
        ),
        ("invalid_uri_data.gltf", Code::NoAnimations, "/animations"),
        ("length_mismatch.glb", Code::Glb, ""),
        ("no_bin_chunk.glb", Code::NoAnimations, "/animations"),
        ("not_found.gltf", Code::NoAnimations, "/animations"),
        ("only_bin_chunk.glb", Code::Glb, ""),
        (
            "quaternion_non_unit_values.gltf",
            Code::EqualTimes,
            "/animations/0/samplers/0/input",
        ),
        (
            "sampler_input_format_invalid.gltf",
            Code::AccessorType,
            "/animations/0/samplers/0/input",
        ),
        (
            "sampler_output_count_invalid.gltf",
            Code::OutputCount,
            "/animations/0/samplers/0/output",
        ),
        (
            "sampler_too_few_cubic_frames.gltf",
            Code::KeyNorm,
            "/animations/0/samplers/0/output",
        ),
        ("truncated_chunk_data.glb", Code::Glb, ""),
        (
            "unresolved_channel_target.gltf",
            Code::IndexRange,
            "/animations/0/channels/0/target",
        ),
        (
            "unresolved_sampler_input.gltf",
            Code::IndexRange,
            "/animations/0/samplers/0/input",
        ),
    ];
    for (file, code, location) in verdicts {
        let path = data.join("gltf/bad").join(file);
        let said = match open_gltf(&path, &ReadOptions::default()) {
            Err(error) => vec![error],
            Ok(loaded) => [loaded.refused, loaded.warnings].concat(),
        };
        let said: Vec<_> = said
            .iter()
            .map(|diagnostic| (diagnostic.code, location_of(diagnostic)))
            .collect();
        assert!(
            said.contains(&(code, location.to_owned())),
            "{file}: {said:?}"
        );
    }
}

fn location_of(diagnostic: &Diagnostic) -> String {
    let location = diagnostic.location.as_ref();
    location.map(ToString::to_string).unwrap_or_default()
}

#[test]
fn tracks_are_nodes_that_are_moved_or_carry_such() {
    let loaded = open(&fixture("matrix_that_rests.gltf"));
    let clip = &loaded.clips[0];
    let names: Vec<_> = clip.set.tracks().map(|track| track.name.unwrap()).collect();
    assert_eq!(names, ["base", "arm"]);
    assert_eq!(clip.skeleton[1].parent, Some(0));
    assert_eq!(clip.skeleton[0].parent, None);
    assert_eq!(clip.channels[0].rotation, None);
    assert_eq!(
        clip.channels[1].rotation,
        Some(ChannelInterpolation::Linear)
    );
    // The base does not move. It is rotated, translated and scaled by 2; its only key is at the
    // clip's first time.
    let rest = clip.skeleton[0].rest;
    assert_eq!(
        (rest.translation, rest.scale),
        (Vec3::new(3.0, 4.0, 5.0), Vec3::splat(2.0))
    );
    assert_eq!(
        (clip.set.track(0).times, clip.set.track(0).keys),
        (&[0.0][..], &[rest.rotation][..])
    );
    let poses = world(clip, &sample(clip, vec![0.0])).unwrap();
    assert_eq!(poses[1].position, rest.translation.as_dvec3());
    let sheared = open(&fixture("matrix_that_shears.gltf"));
    let clip = &sheared.clips[0];
    let refused = world(clip, &sample(clip, vec![0.0])).unwrap_err();
    assert!(refused.to_string().contains("`base` shears"), "{refused}");
}

#[test]
fn names_are_those_of_nodes_and_told_apart() {
    let Some(data) = shared_data() else { return };
    let loaded = open(&data.join("gltf/made/names_twice_and_none.gltf"));
    let tracks = loaded.clips[0].set.tracks();
    let names: Vec<_> = tracks.map(|track| track.name.unwrap()).collect();
    assert_eq!(names, ["hand", "hand#1", "node2"]);
}

#[test]
fn times_are_on_their_frames_unless_they_are_wanted_raw() {
    let bytes = fs::read(fixture("one_key.gltf")).unwrap();
    let read = |options: &ReadOptions| {
        let loaded = read_gltf("t", bytes.clone(), None, options).unwrap();
        (loaded.clips[0].set.track(0).times[0], loaded.clips[0].rate)
    };
    assert_eq!(
        read(&ReadOptions::default()),
        // It lies on a frame of 30 fps; one key has no rate.
        (0.7, None)
    );
    assert_eq!(read(&raw()), (f64::from(0.7f32), None));
}

#[test]
fn of_different_keys_at_one_time_the_one_that_is_asked_for_stays() {
    let bytes = fs::read(fixture("different_keys_at_one_time.gltf")).unwrap();
    for (duplicates, x) in [(Duplicates::First, 0.6), (Duplicates::Last, 0.0)] {
        let options = ReadOptions {
            duplicates,
            ..ReadOptions::default()
        };
        let loaded = read_gltf("t", bytes.clone(), None, &options).unwrap();
        let track = loaded.clips[0].set.track(0);
        assert_eq!((track.keys.len(), track.keys[1].x), (2, x));
    }
}

#[test]
fn half_turns_go_the_way_of_a_product_that_is_not_negative() {
    let Some(data) = shared_data() else { return };
    for (file, count) in [("box_animated.gltf", 1), ("made/half_turns.gltf", 1)] {
        let loaded = open(&data.join("gltf").join(file));
        let found = loaded
            .warnings
            .iter()
            .filter(|diagnostic| diagnostic.code == Code::HalfTurn);
        assert_eq!(found.count(), count, "{file}: {:?}", loaded.warnings);
    }
}

/// A file that is missing or not followed is an error at the buffer that names it, once for all animations.
#[test]
fn files_beside_that_are_missing_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.gltf");
    fs::copy(fixture("uri_beside.gltf"), &path).unwrap();
    let loaded = open(&path);
    assert!(loaded.clips.is_empty());
    let refused = loaded.refused[0].to_string();
    let not_found = io::Error::from_raw_os_error(2); // on Linux, macOS and Windows
    let expected =
        format!("/buffers/0/uri: error[E001]: keys beside.bin: cannot be read: {not_found}");
    assert!(refused.ends_with(&expected), "{refused}");
    let bytes = fs::read(&path).unwrap();
    let loaded = read_gltf("-", bytes, None, &ReadOptions::default()).unwrap();
    assert_eq!(loaded.refused[0].code, Code::Uri);
}

#[test]
fn limits_refuse_before_memory_runs_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.glb");
    let mut file = File::create(&path).unwrap();
    file.write_all(b"glTF\x02\0\0\0").unwrap();
    // The file is sparse, so it takes no disk space.
    file.set_len((1 << 32) + 8).unwrap();
    let refused = open_gltf(&path, &ReadOptions::default()).unwrap_err();
    assert_eq!(refused.code, Code::FileTooLong);
    let options = ReadOptions {
        limits: Limits {
            file: 100,
            ..Limits::default()
        },
        ..ReadOptions::default()
    };
    let refused = open_gltf(&fixture("whole.glb"), &options).unwrap_err();
    assert_eq!(refused.code, Code::FileTooLong);
}

#[test]
fn files_are_known_by_their_first_bytes() {
    let named = |start: &[u8]| Format::detect(Path::new("walk"), start).name;
    for start in [
        &b"glTF\x02"[..],
        b"{\"asset\":",
        b"\xef\xbb\xbf \n{ \"asset\" :",
    ] {
        assert_eq!(named(start), "glb");
    }
    assert_ne!(named(b"{\"nodes\":"), "glb");
    assert_eq!(Format::of(Path::new("walk.gltf")).unwrap().name, "glb");
}

fn damaged() -> impl Strategy<Value = Vec<u8>> {
    let names = [
        "sparse.gltf",
        "cubic.gltf",
        "whole.glb",
        "matrix_that_shears.gltf",
    ];
    let edits = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4);
    let digits = prop::collection::vec((any::<prop::sample::Index>(), b'0'..=b'9'), 0..4);
    (prop::sample::select(names.to_vec()), edits, digits).prop_map(|(name, edits, digits)| {
        let mut bytes = fs::read(fixture(name)).unwrap();
        for (index, byte) in edits {
            let offset = index.index(bytes.len());
            bytes[offset] = byte;
        }
        // Changed numbers get further in the reader than changed letters.
        for (index, digit) in digits {
            let all = bytes
                .iter()
                .enumerate()
                .filter(|(_, byte)| byte.is_ascii_digit());
            let offsets: Vec<usize> = all.map(|(offset, _)| offset).collect();
            bytes[offsets[index.index(offsets.len())]] = digit;
        }
        bytes
    })
}

proptest! {
    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300), glb: bool) {
        let mut file = if glb { b"glTF\x02\0\0\0".to_vec() } else { b"{\"asset\":".to_vec() };
        file.extend(bytes);
        let _ = read_gltf("t", file, None, &ReadOptions::default());
    }

    #[test]
    fn damaged_files_never_panic_and_what_is_read_is_whole(bytes in damaged()) {
        if let Ok(loaded) = read_gltf("t", bytes, None, &ReadOptions::default()) {
            for clip in &loaded.clips {
                let tracks = clip.set.track_count();
                prop_assert_eq!((tracks, tracks), (clip.skeleton.len(), clip.channels.len()));
                for track in clip.set.tracks() {
                    let unit = |key: &glam::Quat| (f64::from(key.length()) - 1.0).abs() < NORM_TOLERANCE;
                    prop_assert!(track.keys.iter().all(unit));
                }
            }
        }
    }
}

/// Each clip has the names of its tracks, and a name may be as long as the file: the memory of all of them counts.
#[test]
fn a_long_name_counts_in_every_animation() {
    let animation = r#"{"samplers":[{"input":0,"output":1}],"channels":[{"sampler":0,"target":{"node":0,"path":"rotation"}}]}"#;
    let file = |name: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":20,"uri":"data:;base64,AAAAAAAAAAAAAAAAAAAAAAAAgD8="}}],
            "bufferViews":[{{"buffer":0,"byteLength":20}}],"accessors":[
            {{"bufferView":0,"componentType":5126,"count":1,"type":"SCALAR"}},
            {{"bufferView":0,"byteOffset":4,"componentType":5126,"count":1,"type":"VEC4"}}],
            "nodes":[{{"name":"{name}"}}],"animations":[{}]}}"#,
            vec![animation; 20].join(",")
        )
    };
    let options = ReadOptions {
        limits: Limits {
            memory: Some(1 << 20),
            ..Limits::default()
        },
        ..ReadOptions::default()
    };
    let read = |name: &str| read_gltf("t.gltf", file(name).into_bytes(), None, &options);
    let loaded = read("hip").unwrap();
    assert_eq!((loaded.clips.len(), loaded.refused.len()), (20, 0));
    let refused = read(&"hip".repeat(40_000)).unwrap_err();
    assert_eq!(refused.code, Code::Memory, "{refused}");
}
