//! Channels of glTF files have the values that others compute of them.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use glam::{DQuat, DVec3, Vec3};
use serde_json::Value;
use tumble_formats::ReadOptions;
use tumble_formats::gltf::open_gltf;
use tumble_formats::motion::Motion;

use crate::gltf::{json_of, keys_of, open, raw, sample, track_of};
use crate::support::shared_data;

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().unwrap();
    list.iter().map(|number| number.as_f64().unwrap()).collect()
}

/// The largest distance of a file's channels from the values that it should have, radians for
/// rotations, lengths relative to 1 or the value for the others.
fn error_of(clip: &Motion, json: &Value, channel: &Value) -> f64 {
    let track = track_of(clip, json, channel["node"].as_u64().unwrap() as usize);
    let mut times = numbers(&channel["times"]);
    // Times at keys were rounded to 12 digits; just before a key, a step has another value.
    let keys = keys_of(clip, track, channel["path"].as_str().unwrap());
    for time in &mut times {
        let key = keys.iter().find(|key| (**key - *time).abs() < 1e-9);
        *time = key.copied().unwrap_or(*time);
    }
    let found = sample(clip, times.clone());
    let tracks = clip.set.track_count();
    let mut worst = 0.0f64;
    for (frame, expected) in channel["values"].as_array().unwrap().iter().enumerate() {
        let expected = numbers(expected);
        let at = frame * tracks + track;
        let error = match channel["path"].as_str().unwrap() {
            "rotation" => {
                let expected = DQuat::from_slice(&expected).normalize();
                let found = found.rotations[at].as_dquat().normalize();
                2.0 * (found - expected).length().min((found + expected).length())
            }
            path => {
                let list: &[Vec3] = match path {
                    "translation" => &found.translations,
                    _ => &found.scales,
                };
                let expected = DVec3::from_slice(&expected);
                (list[at].as_dvec3() - expected).length() / expected.length().max(1.0)
            }
        };
        worst = worst.max(error);
    }
    worst
}

fn compare(folder: &Path, bound: f64, options: &ReadOptions) -> usize {
    let expected = fs::read_to_string(folder.join("expected.json")).unwrap();
    let files: HashMap<String, Value> = serde_json::from_str(&expected).unwrap();
    let mut compared = 0;
    for (file, animations) in &files {
        let path = folder.join(file);
        let json = json_of(&path);
        let loaded = open_gltf(&path, options).unwrap_or_else(|error| panic!("{error}"));
        assert!(loaded.refused.is_empty(), "{file}: {:?}", loaded.refused);
        let animations = animations.as_array().unwrap();
        assert_eq!(loaded.clips.len(), animations.len(), "{file}");
        for (clip, animation) in loaded.clips.iter().zip(animations) {
            let name = animation["name"].as_str().filter(|name| !name.is_empty());
            assert_eq!(clip.name.as_deref(), name, "{file}");
            for channel in animation["channels"].as_array().unwrap() {
                // Next to a step, the smallest change of a time changes the value.
                if channel["interpolation"] == "STEP" && !options.raw_times {
                    continue;
                }
                let error = error_of(clip, &json, channel);
                assert!(error < bound, "{file}: {error:e} in {channel}");
                compared += 1;
            }
        }
    }
    compared
}

#[test]
fn real_files_have_the_values_of_the_specification() {
    let Some(data) = shared_data() else { return };
    assert_eq!(compare(&data.join("gltf"), 1e-6, &raw()), 30);
    assert!(compare(&data.join("gltf"), 2e-5, &ReadOptions::default()) >= 20);
}

#[test]
fn edge_cases_have_the_values_of_the_specification() {
    let Some(data) = shared_data() else { return };
    assert_eq!(compare(&data.join("gltf/made"), 1e-6, &raw()), 35);
    assert!(compare(&data.join("gltf/made"), 2e-5, &ReadOptions::default()) >= 30);
}

/// Every view that a real file compresses is decoded as meshoptimizer does.
#[test]
fn compressed_files_have_the_keys_of_other_decoders() {
    let Some(data) = shared_data() else { return };
    let expected = fs::read_to_string(data.join("gltf/fox_meshopt.expected.json")).unwrap();
    let files: HashMap<String, Value> = serde_json::from_str(&expected).unwrap();
    for (file, expected) in files {
        let path = data.join("gltf").join(&file);
        let json = json_of(&path);
        let loaded = open(&path);
        assert!(loaded.refused.is_empty(), "{file}: {:?}", loaded.refused);
        let mut compared = 0;
        for (clip, animation) in loaded
            .clips
            .iter()
            .zip(expected["animations"].as_array().unwrap())
        {
            for channel in animation["channels"].as_array().unwrap() {
                let track = track_of(clip, &json, channel["node"].as_u64().unwrap() as usize);
                if channel["path"] != "rotation" {
                    continue;
                }
                let keys = clip.set.track(track);
                assert_eq!(keys.keys.len() as u64, channel["keys"].as_u64().unwrap());
                let last = keys.keys.len() - 1;
                for (end, key) in [("first", 0), ("last", last)] {
                    let expected = &channel[end];
                    let value = DQuat::from_slice(&numbers(&expected[1])).normalize();
                    let found = keys.keys[key].as_dquat().normalize();
                    assert!((found - value).length() < 1e-6, "{file}: {channel}");
                    let time = expected[0].as_f64().unwrap();
                    assert!((keys.times[key] - time).abs() < 1e-6, "{file}: {channel}");
                    compared += 1;
                }
            }
        }
        assert!(compared > 100, "{file}: {compared}");
    }
}

/// A file of many tracks: the same skeleton, and the same curves, as whole numbers.
#[test]
fn quantized_keys_are_near_those_of_the_file_they_were_made_of() {
    let Some(data) = shared_data() else { return };
    let fox = open(&data.join("gltf/Fox.glb"));
    let quantized = open(&data.join("gltf/fox_quantized.glb"));
    assert_eq!(fox.clips.len(), 3);
    for (plain, other) in fox.clips.iter().zip(&quantized.clips) {
        assert_eq!(plain.name, other.name);
        // The last key of `Run` is between two frames of 24 fps and on one of 120 fps, which is not the rate of
        // the keys.
        let is_even = plain.name.as_deref() != Some("Run");
        let rate = tumble::FrameRate::new(24, 1).ok().filter(|_| is_even);
        assert_eq!((plain.rate, other.rate), (rate, rate));
        let (first, last) = plain.set.time_span().unwrap();
        let times: Vec<f64> = (0..50)
            .map(|i| first + (last - first) * f64::from(i) / 49.0)
            .collect();
        let [mine, others] = [plain, other].map(|clip| sample(clip, times.clone()));
        let track = |name: &str| {
            other
                .set
                .tracks()
                .position(|track| track.name == Some(name))
        };
        let mut compared = 0;
        for index in 0..plain.set.track_count() {
            let Some(same) = track(plain.set.track(index).name.unwrap()) else {
                continue;
            };
            for sample in 0..times.len() {
                let a = mine.rotations[sample * plain.set.track_count() + index];
                let b = others.rotations[sample * other.set.track_count() + same];
                let angle = 2.0 * a.as_dquat().dot(b.as_dquat()).abs().min(1.0).acos();
                assert!(angle < 2e-3, "{:?}, track {index}: {angle}", plain.name);
            }
            compared += 1;
        }
        assert!(compared >= 19, "{compared}");
    }
}
