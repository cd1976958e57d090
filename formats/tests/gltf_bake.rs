//! glTF files written again with samples instead of keys: everything else comes back byte for byte.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use tumble::FrameRate;
use tumble_formats::end_frame::FramesToEnd;
use tumble_formats::format::{Document, MotionOptions, WriteError};
use tumble_formats::gltf::read_gltf;
use tumble_formats::motion::{ChannelInterpolation, Motion, SampledClip};
use tumble_formats::sample::Samples;
use tumble_formats::{Diagnostic, Loaded, ReadOptions};

use crate::glb::{Glb, Text, members, text_of};
use crate::gltf::{fixture, keys_of, open, sample};
use crate::support::shared_data;
use crate::validator::{Report, validate};

/// The times at which a clip of a file is sampled, its end among them.
pub(crate) fn times(document: &dyn Document, clip: &Motion, rate: FrameRate) -> Vec<f64> {
    let frames = document.frames(clip.index, rate).unwrap();
    let to_end = FramesToEnd::new(clip, frames, document.end_frame());
    to_end.unwrap().times()
}

/// A file with all its animations sampled at `fps`, as the file of that name.
fn baked(loaded: &Loaded, fps: u64, to: &Path) -> Result<(Vec<u8>, Vec<Diagnostic>), WriteError> {
    let document = loaded.document.as_ref().unwrap();
    let rate = FrameRate::new(fps, 1).unwrap();
    let samples: Vec<Samples> = (loaded.clips.iter())
        .map(|clip| sample(clip, times(&**document, clip, rate)))
        .collect();
    let clips: Vec<(usize, SampledClip<'_>)> = (loaded.clips.iter().zip(&samples))
        .map(|(clip, samples)| (clip.index, samples.of(clip, Some(rate), &[])))
        .collect();
    let mut bytes = Vec::new();
    let warnings = document.write(&clips, &MotionOptions::default(), to, &mut bytes)?;
    Ok((bytes, warnings))
}

/// A GLB baked from a file, for a folder elsewhere.
fn glb_of(path: &Path, fps: u64) -> (Loaded, Glb) {
    let loaded = open(path);
    let (bytes, _) = baked(&loaded, fps, Path::new("/out.glb")).unwrap();
    (loaded, Glb::parse(&bytes))
}

/// Files with animations whose reading is tested elsewhere.
fn files() -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = Vec::new();
    let folders = shared_data()
        .into_iter()
        .flat_map(|data| [data.join("gltf"), data.join("gltf/made")]);
    for folder in folders.chain([fixture("")]) {
        let paths = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().path());
        files.extend(paths.filter(|path| {
            let is_gltf = path
                .extension()
                .is_some_and(|extension| extension == "gltf" || extension == "glb");
            let read = || tumble_formats::gltf::open_gltf(path, &ReadOptions::default());
            is_gltf && read().is_ok_and(|loaded| !loaded.clips.is_empty())
        }));
    }
    files.sort();
    files
}

/// The bytes of a view: the compressed ones, if it has such.
fn view_bytes<'a>(glb: &'a Glb, json: &Value, index: u64) -> &'a [u8] {
    let view = &json["bufferViews"][index as usize];
    let compressed = ["EXT_meshopt_compression", "KHR_meshopt_compression"]
        .into_iter()
        .find_map(|name| view["extensions"].get(name));
    let view = compressed.unwrap_or(view);
    let number = |name: &str| view[name].as_u64().unwrap_or(0) as usize;
    // The data behind a kept URI is in another file.
    match json["buffers"][number("buffer")].get("uri") {
        None => &glb.bin[number("byteOffset")..][..number("byteLength")],
        Some(_) => &[],
    }
}

/// An accessor and its bytes, without where they are.
fn accessor_content(glb: &Glb, json: &Value, index: u64) -> (Value, Vec<u8>) {
    let mut accessor = json["accessors"][index as usize].clone();
    let members = accessor.as_object_mut().unwrap();
    let Some(view) = members.remove("bufferView") else {
        return (accessor, Vec::new());
    };
    let offset = members.remove("byteOffset");
    let offset = offset.and_then(|it| it.as_u64()).unwrap_or(0) as usize;
    let view = view.as_u64().unwrap();
    let bytes = view_bytes(glb, json, view);
    let is_compressed = json["bufferViews"][view as usize]["extensions"].is_object();
    let sizes = [
        ("SCALAR", 1),
        ("VEC2", 2),
        ("VEC3", 3),
        ("VEC4", 4),
        ("MAT4", 16),
    ];
    let width = sizes
        .into_iter()
        .find(|(kind, _)| accessor["type"] == *kind);
    let component = match accessor["componentType"].as_u64() {
        Some(5120 | 5121) => 1,
        Some(5122 | 5123) => 2,
        _ => 4,
    };
    let element = component * width.map_or(1, |(_, width)| width);
    let count = accessor["count"].as_u64().unwrap() as usize;
    let stride = json["bufferViews"][view as usize]["byteStride"].as_u64();
    let stride = stride.map_or(element, |stride| stride as usize);
    let length = count.saturating_sub(1) * stride + element;
    let part = match is_compressed || bytes.is_empty() {
        true => bytes,
        false => &bytes[offset..offset + length],
    };
    (accessor, part.to_vec())
}

/// The accessors that meshes and skins refer to, in order, and those of animations.
fn referred(json: &Value) -> (Vec<u64>, Vec<u64>) {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let mut all = Vec::new();
    let mut add = |object: &Value| {
        let members = object.as_object().into_iter().flatten();
        all.extend(members.filter_map(|(_, index)| index.as_u64()));
    };
    for primitive in list(&json["meshes"])
        .iter()
        .flat_map(|mesh| list(&mesh["primitives"]))
    {
        add(&primitive["attributes"]);
        add(&serde_json::json!({"indices": primitive["indices"]}));
        list(&primitive["targets"]).iter().for_each(&mut add);
    }
    for skin in list(&json["skins"]) {
        add(&serde_json::json!({"matrices": skin["inverseBindMatrices"]}));
    }
    let samplers = list(&json["animations"])
        .into_iter()
        .flat_map(|it| list(&it["samplers"]));
    let keys = samplers.flat_map(|it| {
        [
            it["input"].as_u64().unwrap(),
            it["output"].as_u64().unwrap(),
        ]
    });
    (all, keys.collect())
}

/// Every file keeps all that is not animation, loses the keys that samples replace, and gives the samples when it is
/// read again.
#[test]
fn everything_but_the_samples_comes_back() {
    let files = files();
    assert!(files.len() >= 35, "{}", files.len());
    for path in &files {
        let label = path.display();
        let is_glb = path.extension().unwrap() == "glb";
        let (loaded, glb) = glb_of(path, 60);
        let (old_text, new_text) = (text_of(path), glb.text.clone());
        let (old, new) = (
            members(old_text.trim_start_matches('\u{feff}')),
            members(&new_text),
        );
        // Meshes, skins and images refer to objects whose indices may change.
        let renumbered = [
            "animations",
            "accessors",
            "bufferViews",
            "buffers",
            "meshes",
            "skins",
            "images",
        ];
        for (name, value) in &old {
            let changed = renumbered.contains(&&**name);
            assert!(changed || new[name].get() == value.get(), "{label}: {name}");
        }
        assert!(new.keys().eq(old.keys()), "{label}");
        // The same file as a GLB, with its keys as they are.
        let mut whole = Vec::new();
        let document = loaded.document.as_ref().unwrap();
        let options = MotionOptions::default();
        document
            .write(&[], &options, Path::new("/out.glb"), &mut whole)
            .unwrap();
        let whole = Glb::parse(&whole);
        let (before, after) = (whole.json(), glb.json());
        let ((kept, old_keys), (now, keys)) = (referred(&before), referred(&after));
        assert_eq!(kept.len(), now.len(), "{label}");
        for (kept, now) in kept.iter().zip(&now) {
            let content = accessor_content(&whole, &before, *kept);
            assert!(
                content == accessor_content(&glb, &after, *now),
                "{label}: {kept}"
            );
        }
        let images = |json: &Value| json["images"].as_array().cloned().unwrap_or_default();
        for (kept, now) in images(&before).iter().zip(&images(&after)) {
            if let (Some(kept), Some(now)) =
                (kept["bufferView"].as_u64(), now["bufferView"].as_u64())
            {
                let bytes = view_bytes(&whole, &before, kept);
                assert!(bytes == view_bytes(&glb, &after, now), "{label}");
            }
        }
        let distinct = |all: [&[u64]; 2]| -> std::collections::BTreeSet<u64> {
            all.concat().into_iter().collect()
        };
        let count = |json: &Value, list: &str| json[list].as_array().map_or(0, Vec::len);
        let unused = count(&before, "accessors") - distinct([&kept, &old_keys]).len();
        let still = count(&after, "accessors") - distinct([&now, &keys]).len();
        // Numbers in the unknown extensions of this file may be indices, so the data that they may
        // refer to is kept.
        let is_pinned = path.ends_with("keep_everything.gltf");
        assert!(
            unused == still || is_pinned,
            "{label}: {still} accessors that nothing uses"
        );
        if is_glb {
            assert_eq!(
                glb.others,
                Glb::parse(&fs::read(path).unwrap()).others,
                "{label}"
            );
        }
        check_new_entries(&glb, &old, &label.to_string());
        let again = read_gltf("t", glb.bytes.clone(), None, &ReadOptions::default()).unwrap();
        assert_eq!(again.refused.len(), loaded.refused.len(), "{label}");
        check_clips(&loaded, &again.clips, &label.to_string());
        // Samples of a second bake replace those of the first.
        let (twice, _) = baked(&again, 60, Path::new("/out.glb")).unwrap();
        let twice = Glb::parse(&twice).json();
        for list in ["accessors", "bufferViews", "buffers"] {
            let is_same = count(&twice, list) == count(&after, list);
            assert!(is_same || is_pinned, "{label}: {list}");
        }
    }
}

/// Written data is aligned, and the animations keep their names.
fn check_new_entries(glb: &Glb, old: &Text, label: &str) {
    let json = glb.json();
    for view in json["bufferViews"].as_array().unwrap().iter().rev().take(1) {
        assert_eq!(view["byteOffset"].as_u64().unwrap_or(0) % 4, 0, "{label}");
    }
    for sampler in json["animations"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|it| it["samplers"].as_array().unwrap())
    {
        let output = &json["accessors"][sampler["output"].as_u64().unwrap() as usize];
        assert_eq!(output["byteOffset"].as_u64().unwrap_or(0) % 4, 0, "{label}");
    }
    let names = |json: &Value| -> Vec<Value> {
        let all = json["animations"].as_array().unwrap().iter();
        all.map(|animation| animation["name"].clone()).collect()
    };
    let animations: Value = serde_json::from_str(old["animations"].get()).unwrap();
    assert_eq!(
        names(&serde_json::json!({ "animations": animations })),
        names(&json),
        "{label}"
    );
}

/// Channels that were sampled have the samples as keys, all others the keys that they had.
fn check_clips(loaded: &Loaded, again: &[Motion], label: &str) {
    assert_eq!(loaded.clips.len(), again.len(), "{label}");
    let document = loaded.document.as_ref().unwrap();
    for (clip, new) in loaded.clips.iter().zip(again) {
        let rate = FrameRate::new(60, 1).unwrap();
        let times = times(&**document, clip, rate);
        let samples = sample(clip, times.clone());
        // If times are read as they are stored, they are equal to the last bit (see the next test).
        let ends = |clip: &Motion| clip.set.time_span().unwrap();
        let (old, written) = (ends(clip), ends(new));
        let is_near = (old.0 - written.0).abs() <= 2e-7 && (old.1 - written.1).abs() <= 2e-7;
        assert!(is_near, "{label}: {old:?} {written:?}");
        let tracks = clip.set.track_count();
        for track in 0..tracks {
            let old = clip.channel(track);
            for (path, sampler) in [
                ("rotation", old.rotation),
                ("translation", old.translation),
                ("scale", old.scale),
            ] {
                let (before, after) = (keys_of(clip, track, path), keys_of(new, track, path));
                let is_sampled = before.len() > 1
                    && sampler.is_some_and(|kind| kind != ChannelInterpolation::Step);
                if !is_sampled {
                    assert_eq!(before, after, "{label}: {path} of track {track}");
                    continue;
                }
                let near = times
                    .iter()
                    .zip(after)
                    .all(|(a, b)| (a - b).abs() <= 1e-7 * a.abs().max(1.0));
                assert!(
                    near && times.len() == after.len(),
                    "{label}: {times:?} {after:?}"
                );
                let channels = new.channel(track);
                let now = match path {
                    "rotation" => channels.rotation,
                    "translation" => channels.translation,
                    _ => channels.scale,
                };
                assert_eq!(now, Some(ChannelInterpolation::Linear), "{label}");
            }
            if old
                .rotation
                .is_some_and(|kind| kind != ChannelInterpolation::Step)
                && clip.set.track(track).keys.len() > 1
            {
                for (at, key) in new.set.track(track).keys.iter().enumerate() {
                    let expected = samples.rotations[at * tracks + track];
                    // A sample whose norm is off by more than 4e-7 is normalised as a key.
                    let is_near = expected.abs_diff_eq(*key, 6e-7);
                    assert!(
                        is_near,
                        "{label}: track {track}, sample {at}: {expected} {key}"
                    );
                }
            }
        }
    }
}

/// The largest time of any sampler of an animation, as stored, moved channels or not.
#[test]
fn an_animation_is_as_long_as_before_to_the_last_bit() {
    let Some(data) = shared_data() else { return };
    for (file, fps) in [
        ("Fox.glb", 30),
        ("Fox.glb", 120),
        ("fox_meshopt_khr.glb", 50),
        ("box_animated.gltf", 60),
        ("made/summed_times.gltf", 60),
        ("made/start_late.gltf", 7),
        ("made/after_a_day.gltf", 100),
    ] {
        let path = data.join("gltf").join(file);
        let raw_times = crate::gltf::raw();
        let before = tumble_formats::gltf::open_gltf(&path, &raw_times).unwrap();
        let (_, glb) = glb_of(&path, fps);
        let after = read_gltf("t", glb.bytes, None, &raw_times).unwrap();
        for (a, b) in before.clips.iter().zip(&after.clips) {
            assert_eq!(a.set.time_span(), b.set.time_span(), "{file}, {:?}", a.name);
        }
    }
}

#[test]
fn nothing_to_bake_is_the_same_file() {
    for name in [
        "whole.glb",
        "unknown_chunk.glb",
        "step_scale.gltf",
        "uri_percent.gltf",
    ] {
        let loaded = open(&fixture(name));
        let mut bytes = Vec::new();
        let document = loaded.document.as_ref().unwrap();
        let to = PathBuf::from("/out").with_extension(Path::new(name).extension().unwrap());
        let warnings = document
            .write(&[], &MotionOptions::default(), &to, &mut bytes)
            .unwrap();
        assert_eq!(warnings, []);
        assert!(bytes == fs::read(fixture(name)).unwrap(), "{name}");
    }
    // A file that has only steps does not change either.
    let (bytes, _) = baked(&open(&fixture("step_scale.gltf")), 60, Path::new("/a.gltf")).unwrap();
    assert!(bytes == fs::read(fixture("step_scale.gltf")).unwrap());
}

/// JSON that is nested deeper than a thread's stack is copied.
#[test]
fn deeply_nested_extras_are_copied() {
    let extras = format!("{}7{}", "[".repeat(100_000), "]".repeat(100_000));
    for start in [r#""extras":"#, r#""extensions":{"VENDOR_x":"#] {
        let end = if start.ends_with("extras\":") {
            ""
        } else {
            "}"
        };
        let text = fs::read_to_string(fixture("names_twice_elsewhere.gltf")).unwrap();
        let nested =
            format!(r#"{{"extensionsRequired":[],{start}{extras}{end},"x":["extensions"],"#);
        let text = text
            .replacen('{', &nested, 1)
            .replace("\"extras\": {", "\"extra\": {");
        let options = ReadOptions::default();
        let loaded = read_gltf("t.gltf", text.into_bytes(), None, &options).unwrap();
        let (bytes, _) = baked(&loaded, 2, Path::new("/out.gltf")).unwrap();
        assert!(String::from_utf8(bytes).unwrap().contains(&nested));
    }
}

#[test]
fn text_is_changed_where_it_has_to_be_and_nowhere_else() {
    let name = "names_twice_elsewhere.gltf";
    let (bytes, _) = baked(&open(&fixture(name)), 2, Path::new("/out.gltf")).unwrap();
    let (old, new) = (
        fs::read_to_string(fixture(name)).unwrap(),
        String::from_utf8(bytes).unwrap(),
    );
    let extras = old.find("\"extras\"").unwrap()..old.find("\"nodes\"").unwrap();
    assert_eq!(old[..extras.end], new[..extras.end]);
    assert!(old[extras].contains(r#""a": 1, "a": 1e400, "b": 123456789012345678901234567890"#));
    let json: Value =
        serde_json::from_str(&new.replace("1e400", "1").replace("\\ud83d", "")).unwrap();
    // The keys that the samples replace are left out, with their buffer.
    let of_samples =
        serde_json::json!({"byteLength": 3 * 4 + 3 * 16, "uri": json["buffers"][0]["uri"]});
    assert_eq!(json["buffers"], serde_json::json!([of_samples]));
    assert_eq!(json["bufferViews"].as_array().unwrap().len(), 1);
    assert_eq!(
        json["animations"][0]["samplers"][0],
        serde_json::json!({"input": 0, "output": 1})
    );
}

/// A sampler of a channel that stays is left alone, and one that several nodes share stays shared.
#[test]
fn shared_samplers_are_replaced_only_where_others_need_them() {
    let (_, glb) = glb_of(&fixture("sampler_of_a_node_and_a_material.gltf"), 4);
    let json = glb.json();
    let animation = &json["animations"][0];
    assert_eq!(
        animation["samplers"][0],
        serde_json::json!({"input": 0, "output": 1})
    );
    let new = serde_json::json!({"input": 2, "output": 3, "interpolation": "LINEAR"});
    assert_eq!(animation["samplers"][1], new);
    let of = |channel: usize| animation["channels"][channel]["sampler"].as_u64();
    assert_eq!((of(0), of(1)), (Some(1), Some(0)));
    let (_, glb) = glb_of(&fixture("sampler_of_two_nodes.gltf"), 4);
    let json = glb.json();
    assert_eq!(
        json["animations"][0]["samplers"].as_array().unwrap().len(),
        1
    );
    assert_eq!(json["accessors"].as_array().unwrap().len(), 2);
}

/// Khronos' validator finds no error in a written file that it did not find in the file before.
#[test]
fn no_error_is_new_to_khronos_validator() {
    let folder = tempfile::tempdir().unwrap();
    let mut pairs = Vec::new();
    // The validator reports times below 0, and then also that those from 0 on do not increase.
    let is_valid = |path: &PathBuf| !path.ends_with("negative_time.gltf");
    for (number, path) in files().into_iter().filter(is_valid).enumerate() {
        let to = folder.path().join(format!("{number}.glb"));
        fs::write(&to, glb_of(&path, 30).1.bytes).unwrap();
        pairs.extend([path, to]);
    }
    let Some(reports) = validate(&pairs) else {
        return;
    };
    for (paths, both) in pairs.chunks(2).zip(reports.chunks(2)) {
        // The code and the pointer of each error, without indices, because unused entries are left out and the others
        // get new indices.
        let errors = |report: &Report| -> Vec<String> {
            let cut = |error: &String| {
                let pointer = error.split(": ").next().unwrap();
                pointer.replace(|letter: char| letter.is_ascii_digit(), "")
            };
            report.errors.iter().map(cut).collect()
        };
        let (old, new) = (errors(&both[0]), errors(&both[1]));
        let new: Vec<_> = new.iter().filter(|error| !old.contains(error)).collect();
        assert!(
            new.is_empty(),
            "{}: {new:#?} beside {old:#?}",
            paths[0].display()
        );
    }
}

pub(crate) fn refused(error: WriteError) -> Diagnostic {
    match error {
        WriteError::Refused(diagnostic) => diagnostic,
        WriteError::Io(error) => panic!("{error}"),
    }
}

pub(crate) fn document(loaded: &Loaded) -> &dyn Document {
    loaded.document.as_deref().unwrap()
}
