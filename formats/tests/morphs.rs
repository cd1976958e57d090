//! Weights of morph targets in glTF are scalars of the clip, and are written back into their channels.

use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use tumble::{Device, Engine, FrameRate};
use tumble_formats::end_frame::FramesToEnd;
use tumble_formats::format::{Document, MotionOptions};
use tumble_formats::gltf::read_gltf;
use tumble_formats::keyed::keys_for;
use tumble_formats::motion::{ChannelInterpolation, Motion, SampledClip};
use tumble_formats::trim::trim;
use tumble_formats::{Code, Format, Loaded, ReadOptions};

use crate::gltf::{open, sample};
use crate::support::shared_data;

/// The samplers of the file: interpolation, times, and the values of two, two and one morph
/// targets.
type Channel = (&'static str, &'static [f32], &'static [f32]);

const LINEAR: Channel = (
    "LINEAR",
    &[0.0, 0.5, 1.5],
    &[0.0, 1.0, 0.5, 0.25, 1.0, 0.75],
);
const STEP: Channel = ("STEP", &[0.0, 1.0], &[0.25, 0.5, 1.0, 0.125]);
/// An incoming slope, a value and an outgoing slope for each key.
const CUBIC: Channel = (
    "CUBICSPLINE",
    &[0.0, 0.5, 1.5],
    &[9.0, 0.0, 1.0, 0.5, 1.0, -0.5, 2.0, 0.25, 9.0],
);

const NAMES: [&str; 5] = [
    "smile",
    "face.blink",
    "brow.blink",
    "raise",
    "tongue.weights[0]",
];

/// A face, whose meshes have morph targets, and nothing else that moves.
fn face() -> Value {
    let (mut bytes, mut views, mut accessors) = (Vec::new(), Vec::new(), Vec::new());
    let mut push = |numbers: &[f32]| {
        views
            .push(json!({"buffer": 0, "byteOffset": bytes.len(), "byteLength": 4 * numbers.len()}));
        bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        accessors.push(json!({
            "bufferView": views.len() - 1, "componentType": 5126, "count": numbers.len(), "type": "SCALAR",
            "min": [numbers.iter().copied().reduce(f32::min)], "max": [numbers.iter().copied().reduce(f32::max)],
        }));
        accessors.len() - 1
    };
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    for (node, (how, times, values)) in [LINEAR, STEP, CUBIC].into_iter().enumerate() {
        samplers.push(json!({"input": push(times), "output": push(values), "interpolation": how}));
        channels.push(json!({"sampler": node, "target": {"node": node, "path": "weights"}}));
    }
    let points = push(&[0.0; 9]);
    accessors[points] = json!({
        "bufferView": points, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0],
    });
    let target = json!({"POSITION": points});
    let mesh = |names: &[&str], count: usize| {
        let targets = vec![target.clone(); count];
        let primitive = json!({"attributes": target, "targets": targets});
        match names.is_empty() {
            true => json!({"primitives": [primitive]}),
            false => json!({"primitives": [primitive], "extras": {"targetNames": names}}),
        }
    };
    json!({
        "asset": {"version": "2.0"},
        "buffers": [{
            "byteLength": bytes.len(),
            "uri": format!("data:application/octet-stream;base64,{}", STANDARD.encode(&bytes)),
        }],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [mesh(&["smile", "blink"], 2), mesh(&["blink", "raise"], 2), mesh(&[], 1)],
        "nodes": [{"name": "face", "mesh": 0}, {"name": "brow", "mesh": 1}, {"name": "tongue", "mesh": 2}],
        "scenes": [{"nodes": [0, 1, 2]}],
        "scene": 0,
        "animations": [{"name": "talk", "channels": channels, "samplers": samplers}],
    })
}

fn read(bytes: Vec<u8>) -> Loaded {
    read_gltf("face.gltf", bytes, None, &ReadOptions::default()).unwrap()
}

fn read_face(file: &Value) -> Loaded {
    read(file.to_string().into_bytes())
}

/// The weights at a time, by the formulas of glTF's appendix C in f64.
fn expected(time: f64) -> [f64; 5] {
    // The keys before and after a time, and where it is between them.
    let interval = |times: &[f32]| {
        let after = times.partition_point(|&key| f64::from(key) <= time);
        let (from, to) = (after.max(1) - 1, after.min(times.len() - 1));
        let [start, end] = [from, to].map(|key| f64::from(times[key]));
        let length = end - start;
        let part = if length > 0.0 {
            (time - start) / length
        } else {
            0.0
        };
        (from, to, part, length)
    };
    let (from, to, t, _) = interval(LINEAR.1);
    let line = |target: usize| {
        let at = |key: usize| f64::from(LINEAR.2[2 * key + target]);
        at(from) * (1.0 - t) + at(to) * t
    };
    let held = interval(STEP.1).0;
    let step = |target: usize| f64::from(STEP.2[2 * held + target]);
    let (from, to, t, length) = interval(CUBIC.1);
    let part = |key: usize, which: usize| f64::from(CUBIC.2[3 * key + which]);
    let cubic = (2.0 * t.powi(3) - 3.0 * t.powi(2) + 1.0) * part(from, 1)
        + length * (t.powi(3) - 2.0 * t.powi(2) + t) * part(from, 2)
        + (3.0 * t.powi(2) - 2.0 * t.powi(3)) * part(to, 1)
        + length * (t.powi(3) - t.powi(2)) * part(to, 0);
    [line(0), line(1), step(0), step(1), cubic]
}

fn assert_values(clip: &Motion, times: &[f64], bound: f64) {
    let found = sample(clip, times.to_vec());
    for (row, &time) in found.scalars.chunks_exact(5).zip(times) {
        for (name, (&value, expected)) in NAMES.iter().zip(row.iter().zip(expected(time))) {
            assert!(
                (f64::from(value) - expected).abs() < bound,
                "{name} at {time}: {value} {expected}"
            );
        }
    }
}

fn names(clip: &Motion) -> Vec<String> {
    let all = (0..clip.set.scalar_count()).filter_map(|index| clip.set.scalar(index));
    all.map(|keys| keys.name.to_owned()).collect()
}

/// The file with samples at a rate instead of its keys.
fn baked(loaded: &Loaded, fps: u64) -> (Vec<f64>, Vec<u8>) {
    let (document, clip) = (loaded.document.as_ref().unwrap(), &loaded.clips[0]);
    let rate = FrameRate::new(fps, 1).unwrap();
    let frames = document.frames(clip.index, rate).unwrap();
    let times = FramesToEnd::new(clip, frames, document.end_frame())
        .unwrap()
        .times();
    let samples = sample(clip, times.clone());
    let bytes = written(&**document, &samples.of(clip, Some(rate), &[]));
    (times, bytes)
}

fn written(document: &dyn Document, sampled: &SampledClip<'_>) -> Vec<u8> {
    let (mut bytes, options) = (Vec::new(), MotionOptions::default());
    let clips = [(sampled.clip.index, sampled.clone())];
    let warnings = document
        .write(&clips, &options, Path::new("/face.glb"), &mut bytes)
        .unwrap();
    assert_eq!(warnings, []);
    bytes
}

#[test]
fn weights_are_scalars_with_the_names_of_their_targets_and_the_values_of_the_specification() {
    let loaded = read_face(&face());
    assert_eq!(loaded.warnings, []);
    let clip = &loaded.clips[0];
    assert_eq!(names(clip), NAMES);
    // Weights move no node.
    assert_eq!(
        (clip.set.track_count(), clip.set.time_span()),
        (0, Some((0.0, 1.5)))
    );
    assert_eq!(
        loaded.document.as_ref().unwrap().other_contents(),
        ["meshes"]
    );
    assert_values(clip, &[0.0, 0.125, 0.5, 0.75, 1.0, 1.25, 1.5], 1e-6);
}

/// Catches weights that baking copies, drops or mixes up between targets and channels.
#[test]
fn baking_samples_weights_and_keeps_steps() {
    let loaded = read_face(&face());
    let (times, bytes) = baked(&loaded, 8);
    assert_eq!(times.len(), 13);
    let again = read(bytes);
    let clip = &again.clips[0];
    assert_eq!(names(clip), NAMES);
    for index in 0..5 {
        let (keys, scalar) = (clip.set.scalar(index).unwrap(), clip.scalar(index));
        let is_step = (2..4).contains(&index);
        let kept = [ChannelInterpolation::Linear, ChannelInterpolation::Step][usize::from(is_step)];
        assert_eq!(scalar.interpolation, Some(kept), "{}", keys.name);
        let count = if is_step { 2 } else { 13 };
        assert_eq!(
            (keys.times.len(), keys.tangents.len()),
            (count, 0),
            "{}",
            keys.name
        );
    }
    assert_values(clip, &times, 1e-6);
}

#[test]
fn a_part_of_an_animation_has_its_weights() {
    let loaded = read_face(&face());
    let engine = Engine::new(Device::Cpu).unwrap();
    let part = trim(&loaded.clips[0], 0.5, 1.5, &engine).unwrap();
    let glb = Format::named("glb").unwrap();
    let (samples, is_at_keys) = keys_for(&part, glb, true).unwrap();
    assert!(is_at_keys);
    let sampled = SampledClip {
        is_at_keys,
        ..samples.of(&part, None, &[])
    };
    let document = loaded.document.as_ref().unwrap();
    let again = read(written(&**document, &sampled));
    let clip = &again.clips[0];
    assert_eq!(clip.set.time_span(), Some((0.5, 1.5)));
    for index in 0..5 {
        // The slopes before the first key and after the last one have no effect.
        let [found, cut] = [clip, &part].map(|clip| clip.set.scalar(index).unwrap());
        assert_eq!((found.times, found.keys), (cut.times, cut.keys));
        assert_eq!(found.tangents.len(), cut.tangents.len());
    }
    assert_values(clip, &[0.5, 0.75, 1.25, 1.5], 1e-6);
}

/// Catches a conversion to a format without scalars that fails because scalars have other times than the tracks.
#[test]
fn weights_at_other_times_do_not_keep_joints_from_being_written() {
    let mut clip = read_face(&face()).clips.remove(0);
    let keys = [tumble::glam::Quat::IDENTITY; 2];
    clip.set.push("head", &[0.0, 1.0], &keys).unwrap();
    let (samples, is_at_keys) = keys_for(&clip, Format::named("bvh").unwrap(), false).unwrap();
    assert!(!is_at_keys);
    assert_eq!((samples.times, samples.scalars.len()), (vec![0.0, 1.0], 10));
    assert!(keys_for(&clip, Format::named("npz").unwrap(), false).is_err());
}

#[test]
fn weights_may_be_fractions_in_bytes_and_their_count_is_that_of_the_targets() {
    let mut file = face();
    let bytes = [0u8, 255, 51, 102, 255, 204];
    file["buffers"].as_array_mut().unwrap().push(json!({
        "byteLength": bytes.len(),
        "uri": format!("data:application/octet-stream;base64,{}", STANDARD.encode(bytes)),
    }));
    let views = file["bufferViews"].as_array_mut().unwrap();
    views.push(json!({"buffer": 1, "byteLength": bytes.len()}));
    let view = views.len() - 1;
    file["accessors"][1] = json!({
        "bufferView": view, "componentType": 5121, "normalized": true, "count": bytes.len(), "type": "SCALAR",
    });
    let loaded = read_face(&file);
    let keys = |index: usize| loaded.clips[0].set.scalar(index).unwrap().keys.to_vec();
    assert_eq!(
        [keys(0), keys(1)],
        [vec![0.0, 0.2, 1.0], vec![1.0, 0.4, 0.8]]
    );
    // There is one target more than the values have.
    let targets = &mut file["meshes"][0]["primitives"][0]["targets"];
    targets.as_array_mut().unwrap().push(json!({}));
    let refused = read_face(&file).refused;
    assert_eq!(refused[0].code, Code::OutputCount);
    assert!(
        refused[0]
            .message
            .contains("6 values for 3 times of 3 morph targets"),
        "{}",
        refused[0]
    );
}

#[test]
fn a_real_face_is_read_and_comes_back() {
    let Some(data) = shared_data() else { return };
    let loaded = open(&data.join("gltf/AnimatedMorphCube.gltf"));
    let clip = &loaded.clips[0];
    assert_eq!(clip.set.scalar_count(), 2);
    let (times, bytes) = baked(&loaded, 30);
    let again = read(bytes);
    let found = [clip, &again.clips[0]].map(|clip| sample(clip, times.clone()).scalars);
    assert!(found[0].iter().any(|&weight| weight > 0.9));
    for (weight, again) in found[0].iter().zip(&found[1]) {
        assert!((weight - again).abs() < 1e-6, "{weight} {again}");
    }
}
