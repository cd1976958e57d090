//! A conversion keeps all that it does not change: channels and End Sites of BVH, names, skeletons that
//! several animations share, joints of a skin that rest, files that are written again.

use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::{Quat, Vec3};
use serde_json::{Value, json};
use tumble::{Channel, Device, Engine};
use tumble_formats::adjust::{adjust, set_offsets};
use tumble_formats::bvh::read_bvh;
use tumble_formats::csv::read::read_csv;
use tumble_formats::format::MotionOptions;
use tumble_formats::gltf::read_gltf;
use tumble_formats::keyed::keyed;
use tumble_formats::motion::{Motion, SampledClip};
use tumble_formats::npz::read_npz;
use tumble_formats::trim::trim;
use tumble_formats::{Code, Diagnostic, Format, Loaded, ReadOptions};

const BVH: &str = "HIERARCHY
ROOT Bip01 Pelvis
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
  JOINT Bip01 L Thigh
  {
    OFFSET 0 -40 0
    CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
    JOINT toe
    {
      OFFSET 0 0 2
      CHANNELS 1 Xrotation
      End Site
      {
        OFFSET 0 -4.5 3
      }
    }
  }
  JOINT chest
  {
    OFFSET 0 10 0
    CHANNELS 3 Xrotation Yrotation Zrotation
  }
}
MOTION
Frames: 2
Frame Time: 0.04
0 90 0 1 2 3 0 -40 0 4 5 6 7 10 20 30
1 90 0 1 2 3 0 -40 0 5 5 6 8 11 20 30
";

fn bvh() -> Motion {
    let loaded = read_bvh("t", BVH.as_bytes(), &ReadOptions::default()).unwrap();
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.clips.into_iter().next().unwrap()
}

fn written(clips: &[&Motion], format: &str, options: &MotionOptions) -> Vec<u8> {
    let samples: Vec<_> = clips.iter().map(|clip| keyed(clip).unwrap()).collect();
    let pairs = clips.iter().zip(&samples);
    let sampled: Vec<SampledClip<'_>> = pairs
        .map(|(clip, samples)| samples.of(clip, clip.rate, &[]))
        .collect();
    let mut bytes = Vec::new();
    let format = Format::named(format).unwrap();
    format.write_clips(&sampled, options, &mut bytes).unwrap();
    bytes
}

fn as_bvh(clip: &Motion, sequence: Option<&str>) -> String {
    let options = MotionOptions {
        sequence: sequence.map(|axes| axes.parse().unwrap()),
        ..MotionOptions::default()
    };
    String::from_utf8(written(&[clip], "bvh", &options)).unwrap()
}

/// Asserts the same words, and the same numbers within the accuracy that f32 has for angles.
fn assert_same(text: &str) {
    let [written, expected] = [text, BVH].map(|text| text.split_once("Frame Time").unwrap());
    assert_eq!(written.0, expected.0);
    let [found, expected] = [written.1, expected.1].map(|text| {
        let numbers = text.split_ascii_whitespace().skip(1);
        numbers
            .map(|word| word.parse::<f64>().unwrap())
            .collect::<Vec<_>>()
    });
    assert_eq!(found.len(), expected.len());
    let mut pairs = found.iter().zip(&expected);
    assert!(
        pairs.all(|(found, expected)| (found - expected).abs() < 1e-5),
        "{text}"
    );
}

/// The same through glTF and NPZ, which have no such channels.
#[test]
fn bvh_comes_back_word_for_word() {
    let clip = bvh();
    assert_same(&as_bvh(&clip, None));
    let options = MotionOptions::default();
    let glb = read_gltf(
        "t",
        written(&[&clip], "glb", &options),
        None,
        &ReadOptions::default(),
    );
    let npz = read_npz(
        "t",
        written(&[&clip], "npz", &options),
        &ReadOptions::default(),
    );
    for loaded in [glb.unwrap(), npz.unwrap()] {
        assert_same(&as_bvh(&loaded.clips[0], None));
    }
}

#[test]
fn a_sequence_that_is_asked_for_is_that_of_all_joints() {
    let text = as_bvh(&bvh(), Some("XYZ"));
    let lines: Vec<&str> = text
        .lines()
        .filter(|line| line.contains("CHANNELS"))
        .collect();
    assert_eq!(lines.len(), 4);
    for line in lines {
        assert!(line.ends_with(" Xrotation Yrotation Zrotation"), "{line}");
    }
}

/// A joint that turns about other axes than its file has channels for gets more of them.
#[test]
fn channels_are_added_where_the_motion_needs_them() {
    let mut clip = bvh();
    let keys = [Quat::from_rotation_y(0.3), Quat::from_rotation_z(0.2)];
    let times = clip.set.track(0).times.to_vec();
    let mut set = tumble::TrackSet::new();
    for track in clip.set.tracks() {
        let is_toe = track.name == Some("toe");
        set.push(
            track.name.unwrap(),
            &times,
            if is_toe { &keys } else { track.keys },
        )
        .unwrap();
    }
    set.set_translations(3, &times, &[Vec3::Y * 10.0, Vec3::Y * 11.0], &[])
        .unwrap();
    clip.set = set;
    let text = as_bvh(&clip, None);
    assert!(
        text.contains("CHANNELS 3 Xrotation Yrotation Zrotation\n      End Site"),
        "{text}"
    );
    let chest = "CHANNELS 6 Xposition Yposition Zposition Xrotation Yrotation Zrotation\n  }";
    assert!(text.contains(chest), "{text}");
    let again = read_bvh("t", text.as_bytes(), &ReadOptions::default()).unwrap();
    let toe = again.clips[0].set.track(2).keys;
    assert!(
        toe.iter()
            .zip(keys)
            .all(|(rotation, key)| rotation.dot(key).abs() > 1.0 - 1e-6),
        "{toe:?}"
    );
}

/// A file with two animations, each of which turns one node: LINEAR at first, then with STEP.
fn gltf(more: &[(&str, Value)]) -> Value {
    let numbers: Vec<f32> = [0.0f32, 1.0, 2.0]
        .into_iter()
        .chain([0.0, 0.0, 0.0, 1.0])
        .chain([0.6, 0.0, 0.0, 0.8])
        .chain([0.0, 0.6, 0.0, 0.8])
        .collect();
    let bytes: Vec<u8> = numbers
        .iter()
        .flat_map(|number| number.to_le_bytes())
        .collect();
    let uri = format!(
        "data:application/octet-stream;base64,{}",
        STANDARD.encode(&bytes)
    );
    let animation = |name: &str, node: usize, how: &str| {
        json!({
            "name": name,
            "channels": [{"sampler": 0, "target": {"node": node, "path": "rotation"}}],
            "samplers": [{"input": 0, "output": 1, "interpolation": how}],
        })
    };
    let mut file = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": bytes.len(), "uri": uri}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 12},
            {"buffer": 0, "byteOffset": 12, "byteLength": 48},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "SCALAR", "min": [0], "max": [2]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC4"},
        ],
        "nodes": [
            {"name": "root", "children": [1, 2]},
            {"name": "arm"},
            {"name": "hand of the other arm", "translation": [0, 1, 0]},
        ],
        "animations": [animation("one", 1, "LINEAR"), animation("two", 0, "STEP")],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    });
    for (name, value) in more {
        file[*name] = value.clone();
    }
    file
}

fn read(file: &Value) -> Loaded {
    let bytes = file.to_string().into_bytes();
    read_gltf("t.gltf", bytes, None, &ReadOptions::default()).unwrap()
}

/// The JSON of a GLB.
fn json_of(glb: &[u8]) -> Value {
    let length = u32::from_le_bytes(*glb[12..].first_chunk().unwrap()) as usize;
    serde_json::from_slice(&glb[20..20 + length]).unwrap()
}

#[test]
fn animations_of_one_skeleton_stay_of_one() {
    let loaded = read(&gltf(&[]));
    let clips: Vec<&Motion> = loaded.clips.iter().collect();
    let counts: Vec<usize> = clips.iter().map(|clip| clip.set.track_count()).collect();
    assert_eq!(counts, [2, 1]);
    for clips in [clips.clone(), clips.into_iter().rev().collect()] {
        let glb = written(&clips, "glb", &MotionOptions::default());
        let found = json_of(&glb);
        let names = found["nodes"].as_array().unwrap().iter();
        let mut names: Vec<&str> = names.map(|node| node["name"].as_str().unwrap()).collect();
        names.sort_unstable();
        assert_eq!(names, ["arm", "root"], "{found}");
        assert_eq!(found["skins"].as_array().unwrap().len(), 1);
        assert_eq!(found["scenes"][0]["nodes"].as_array().unwrap().len(), 1);
        let again = read_gltf("t", glb, None, &ReadOptions::default()).unwrap();
        for (clip, found) in clips.iter().zip(&again.clips) {
            let name = |track: usize| clip.set.track_name(track);
            let moved =
                (0..clip.set.track_count()).find(|&track| clip.set.track(track).keys.len() > 1);
            let moved = moved.unwrap();
            let mut tracks = found.set.tracks();
            let same = tracks
                .find(|track| track.name == Some(&*name(moved)))
                .unwrap();
            assert_eq!(same.keys, clip.set.track(moved).keys);
        }
    }
    // Skeletons count as different if their rest positions differ.
    let mut other = loaded.clips[0].clone();
    other.skeleton[1].rest.translation = Vec3::X;
    let glb = written(
        &[&loaded.clips[0], &other],
        "glb",
        &MotionOptions::default(),
    );
    assert_eq!(json_of(&glb)["nodes"].as_array().unwrap().len(), 4);
}

#[test]
fn all_joints_of_a_skin_are_tracks() {
    let loaded = read(&gltf(&[("skins", json!([{"joints": [1, 2.0]}]))]));
    let names = |clip: &Motion| -> Vec<String> {
        (0..clip.set.track_count())
            .map(|track| clip.set.track_name(track))
            .collect()
    };
    assert_eq!(
        names(&loaded.clips[0]),
        ["root", "arm", "hand of the other arm"]
    );
    // The root is no joint of the skin.
    assert_eq!(names(&loaded.clips[1]), ["root"]);
    assert_eq!(loaded.clips[0].skeleton[2].rest.translation, Vec3::Y);
    // Malformed skins are ignored.
    for skins in [
        json!(3),
        json!([{"joints": [77]}]),
        json!([{"joints": "all"}]),
    ] {
        assert_eq!(
            read(&gltf(&[("skins", skins)])).clips[0].set.track_count(),
            2
        );
    }
}

#[test]
fn indices_may_be_written_with_a_point() {
    let text = gltf(&[]).to_string();
    for (plain, pointed) in [
        ("\"children\":[1,2]", "\"children\":[1.0,2e0]"),
        ("\"node\":1", "\"node\":1.0"),
        ("\"bufferView\":1", "\"bufferView\":1.0"),
        ("\"count\":3", "\"count\":3.0"),
        ("\"byteOffset\":12", "\"byteOffset\":12.0"),
        ("\"componentType\":5126", "\"componentType\":5126.0"),
        ("\"sampler\":0", "\"sampler\":0.0"),
    ] {
        assert!(text.contains(plain), "{plain}");
        let bytes = text.replace(plain, pointed).into_bytes();
        let loaded = read_gltf("t", bytes, None, &ReadOptions::default()).unwrap();
        assert_eq!(
            (loaded.clips.len(), loaded.refused.len()),
            (2, 0),
            "{pointed}"
        );
    }
    let half = text.replace("\"node\":1", "\"node\":1.5").into_bytes();
    let loaded = read_gltf("t", half, None, &ReadOptions::default()).unwrap();
    assert_eq!(loaded.refused[0].code, Code::Property);
}

/// A part of an animation: every channel is cut, steps too, and all else stays.
#[test]
fn a_part_of_a_file_is_the_file_with_shorter_animations() {
    let file = gltf(&[("materials", json!([{"name": "skin"}]))]);
    let loaded = read(&file);
    let (parts, glb, warnings) = cut(&loaded);
    assert_eq!(warnings, []);
    let document = loaded.document.as_ref().unwrap();
    assert_eq!(document.other_contents(), ["materials"]);
    assert_eq!(json_of(&glb)["materials"], json!([{"name": "skin"}]));
    let again = read_gltf("t", glb, None, &ReadOptions::default()).unwrap();
    for (part, found) in parts.iter().zip(&again.clips) {
        assert_eq!(found.set.time_span(), Some((0.5, 1.5)));
        assert_eq!(found.channels, part.channels);
        for (track, other) in part.set.tracks().zip(found.set.tracks()) {
            assert_eq!(track.keys, other.keys);
            // A joint that does not move has only one key, which may be at another time.
            let is_moved = track.keys.len() > 1;
            assert!(!is_moved || track.times == other.times, "{:?}", other.times);
        }
    }
    // Without clips, everything stays.
    let mut text = Vec::new();
    let options = MotionOptions::default();
    document
        .write(&[], &options, Path::new("t.gltf"), &mut text)
        .unwrap();
    assert_eq!(serde_json::from_slice::<Value>(&text).unwrap(), file);
}

/// Catches channels of unknown properties that are cut like transforms, and an animation that stays long without a
/// warning.
#[test]
fn channels_that_are_not_read_are_not_cut_and_that_is_said() {
    let mut file = gltf(&[]);
    let weights = json!({"sampler": 0, "target": {"node": 1, "path": "weights"}}); // of a node without a mesh
    let channels = file["animations"][0]["channels"].as_array_mut().unwrap();
    channels.push(weights.clone());
    let (_, glb, warnings) = cut(&read(&file));
    let [warning] = &warnings[..] else {
        panic!("{warnings:?}");
    };
    assert_eq!(warning.code, Code::StaysWhole);
    assert!(
        warning
            .to_string()
            .contains(":/animations/0: warning[W111]: 1 channel of another property is not cut"),
        "{warning}"
    );
    let written = json_of(&glb);
    let mut channels = written["animations"][0]["channels"]
        .as_array()
        .unwrap()
        .iter();
    assert!(channels.any(|channel| *channel == weights), "{written}");
}

/// The clips of a file from 0.5 to 1.5 s, the file with them, and the warnings.
fn cut(loaded: &Loaded) -> (Vec<Motion>, Vec<u8>, Vec<Diagnostic>) {
    let engine = Engine::new(Device::Cpu).unwrap();
    let parts: Vec<Motion> = (loaded.clips.iter())
        .map(|clip| trim(clip, 0.5, 1.5, &engine).unwrap())
        .collect();
    let ends: Vec<_> = parts
        .iter()
        .map(|part| part.ends(&engine).unwrap())
        .collect();
    let clips: Vec<(usize, SampledClip<'_>)> = parts
        .iter()
        .zip(&ends)
        .map(|(part, ends)| {
            let sampled = ends.of(part, None, &[]);
            (
                part.index,
                SampledClip {
                    is_at_keys: true,
                    ..sampled
                },
            )
        })
        .collect();
    let document = loaded.document.as_ref().unwrap();
    let mut glb = Vec::new();
    let options = MotionOptions::default();
    let warnings = document.write(&clips, &options, Path::new("o.glb"), &mut glb);
    (parts, glb, warnings.unwrap())
}

/// The body's pelvis is at `trans` plus an offset by its shape; `trans` is written again without it.
#[test]
fn the_pelvis_of_a_body_is_at_both_its_places() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/npz/smpl.npz");
    let bytes = std::fs::read(file).unwrap();
    let loaded = read_npz("t", bytes.clone(), &ReadOptions::default()).unwrap();
    let positions = |clip: &Motion| -> Vec<Vec3> {
        let keys = clip.set.vector_keys(Channel::Translation, 0);
        keys.unwrap().keys.to_vec()
    };
    let before = positions(&loaded.clips[0]);
    let mut clip = loaded.clips[0].clone();
    let joints = clip.set.track_count();
    let pelvis = Vec3::new(-0.25, -0.5, 0.125);
    let mut offsets = vec![0.5; 3 * joints];
    offsets[..3].copy_from_slice(&pelvis.as_dvec3().to_array());
    set_offsets(&mut clip, &offsets).unwrap();
    let expected: Vec<Vec3> = before.iter().map(|at| *at + pelvis).collect();
    let near = |found: &[Vec3], other: &[Vec3]| {
        found
            .iter()
            .zip(other)
            .all(|(found, other)| found.distance(*other) < 1e-6)
    };
    assert!(near(&positions(&clip), &expected));
    // Setting them again replaces them; they are not added.
    set_offsets(&mut clip, &offsets).unwrap();
    assert!(near(&positions(&clip), &expected));
    let quarter_turn = glam::DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let rotated: Vec<Vec3> = expected
        .iter()
        .map(|at| Vec3::new(at.x, at.z, -at.y))
        .collect();
    assert!(near(
        &positions(&adjust(&clip, 1.0, quarter_turn).unwrap()),
        &rotated
    ));
    let samples = keyed(&clip).unwrap();
    let sampled = samples.of(&clip, clip.rate, &[]);
    let document = loaded.document.as_ref().unwrap();
    let mut out = Vec::new();
    let options = MotionOptions::default();
    document
        .write(&[(0, sampled)], &options, Path::new("o.npz"), &mut out)
        .unwrap();
    let again = read_npz("t", out, &ReadOptions::default()).unwrap();
    assert!(near(&positions(&again.clips[0]), &before));
    assert!(
        document.other_contents().is_empty(),
        "{:?}",
        document.other_contents()
    );
    // A copy has the same arrays, byte for byte.
    let mut copy = Vec::new();
    document
        .write(&[], &options, Path::new("o.npz"), &mut copy)
        .unwrap();
    let again = read_npz("t", copy, &ReadOptions::default()).unwrap();
    assert_eq!(
        again.clips[0].set.track(3).keys,
        loaded.clips[0].set.track(3).keys
    );
    assert_eq!(
        again.document.unwrap().other_contents(),
        document.other_contents()
    );
}

/// The usual columns of trajectories, with others behind them, need no map; `EuRoC`'s need one.
#[test]
fn tables_of_poses_are_read_by_their_usual_columns() {
    let euroc = "time=#timestamp,tx=p_RS_R_x [m],ty=p_RS_R_y [m],tz=p_RS_R_z [m],x=q_RS_x [],\
                 y=q_RS_y [],z=q_RS_z [],w=q_RS_w []";
    for (header, map) in [
        ("timestamp,tx,ty,tz,qx,qy,qz,qw,speed", None),
        ("t,x,y,z,qx,qy,qz,qw,speed", None),
        ("time,px,py,pz,x,y,z,w,speed", None),
        (
            "time,cam.x,cam.y,cam.z,cam.qx,cam.qy,cam.qz,cam.qw,speed",
            None,
        ),
        (
            "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_x [], q_RS_y [], q_RS_z [], q_RS_w [],v",
            Some(euroc),
        ),
    ] {
        let text = format!("{header}\n0.5,1,2,3,0.6,0,0,0.8,7\n0.75,4,5,6,0,0,0.6,0.8,7\n");
        let options = ReadOptions {
            map: map.map(str::to_owned),
            ..ReadOptions::default()
        };
        let loaded = read_csv("t.csv", text.into_bytes(), &options);
        let loaded = loaded.unwrap_or_else(|error| panic!("{header}: {error}"));
        let clip = &loaded.clips[0];
        assert_eq!(clip.set.track(0).times, [0.5, 0.75], "{header}");
        assert_eq!(
            clip.set.track(0).keys[1],
            Quat::from_xyzw(0.0, 0.0, 0.6, 0.8),
            "{header}"
        );
        let moved = clip.set.vector_keys(Channel::Translation, 0).unwrap().keys;
        assert_eq!(
            moved,
            [Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)],
            "{header}"
        );
    }
}
