//! Reading FBX: files of Maya, 3ds Max, `MotionBuilder` and Blender are compared with the numbers of Autodesk's SDK and
//! with `ufbx` itself; other files are generated.

use std::fs;
use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use tumble::{Device, Engine, FrameRate, SampleTimes};
use tumble_formats::fbx::read_fbx;
use tumble_formats::motion::{ChannelInterpolation, Motion};
use tumble_formats::sample::ChannelMethods;
use tumble_formats::world::world;
use tumble_formats::{Code, Format, Limits, Loaded, ReadOptions};

use crate::support::shared_data;

fn read(path: &Path, options: &ReadOptions) -> Loaded {
    let name = path.file_name().unwrap().to_str().unwrap();
    let loaded = read_fbx(name, &fs::read(path).unwrap(), options).unwrap();
    assert_eq!(loaded.refused, [], "{name}");
    loaded
}

fn fixture(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/fbx");
    folder.join(name).with_extension("fbx")
}

/// Whole frames of a rate that is not the file's, and the ends of the clip.
fn times(clip: &Motion) -> Vec<f64> {
    let (first, last) = clip.set.time_span().unwrap();
    let frames = ((last - first) * 97.0).floor() as u64;
    let frames = (0..=frames).map(|frame| first + frame as f64 / 97.0);
    let mut times: Vec<f64> = frames.filter(|&time| time < last).collect();
    times.push(last);
    times
}

/// Every node of every file is where `ufbx` says in f64, at frames between its keys.
#[test]
fn clips_follow_the_curves_of_files() {
    let Some(folder) = shared_data() else { return };
    let engine = Engine::new(Device::Cpu).unwrap();
    let mut files: Vec<PathBuf> = fs::read_dir(folder.join("fbx"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| !path.to_str().unwrap().contains("fuzz_"))
        .collect();
    files.sort();
    files.extend(["walk", "steps", "scale_nodes"].map(fixture));
    assert!(files.len() >= 20, "{}", files.len());
    for path in files {
        let name = path.file_name().unwrap().to_str().unwrap();
        let loaded = read(&path, &ReadOptions::default());
        let options = ufbx::LoadOpts {
            ignore_geometry: true,
            inherit_mode_handling: ufbx::InheritModeHandling::Compensate,
            ..ufbx::LoadOpts::default()
        };
        let scene = ufbx::load_memory(&fs::read(&path).unwrap(), options).unwrap();
        assert_eq!(loaded.clips.len(), scene.anim_stacks.len(), "{name}");
        for (clip, stack) in loaded.clips.iter().zip(&scene.anim_stacks) {
            let times = times(clip);
            let frames = SampleTimes::at(times.clone());
            let samples = ChannelMethods::AUTHORED
                .sample(&engine, clip, &frames)
                .unwrap();
            let sampled = samples.of(clip, None, &[]);
            let tracks = clip.set.track_count();
            let nodes = scene.nodes.iter().filter(|node| !node.is_root);
            assert_eq!(tracks, nodes.clone().count(), "{name}");
            for (track, node) in nodes.enumerate() {
                let exact = |time: f64| ufbx::evaluate_transform(&stack.anim, node, time);
                let at = |time: f64| {
                    let t = exact(time).translation;
                    DVec3::new(t.x, t.y, t.z)
                };
                // For vectors, the tolerance is relative to the largest number.
                let size = times.iter().map(|&time| at(time).length());
                let size = size.fold(0.1, f64::max);
                for (sample, &time) in times.iter().enumerate() {
                    let t = at(time);
                    let exact = exact(time);
                    let of = format!("{name}, {}, {time} s", &*node.element.name);
                    let q = &exact.rotation;
                    let q = DQuat::from_xyzw(q.x, q.y, q.z, q.w);
                    let found = samples.rotations[sample * tracks + track]
                        .as_dquat()
                        .normalize();
                    let off = 2.0 * (found * q.conjugate()).xyz().length();
                    assert!(off < 3e-6, "{of}: {off:e} rad");
                    let off = sampled.position(sample, track).distance(t);
                    assert!(off < 3e-6 * size, "{of}: {off:e} of {t}");
                    let s = DVec3::new(exact.scale.x, exact.scale.y, exact.scale.z);
                    let scale = if samples.scales.is_empty() {
                        clip.skeleton[track].rest.scale
                    } else {
                        samples.scales[sample * tracks + track]
                    };
                    let off = scale.as_dvec3().distance(s);
                    assert!(off < 3e-6 * s.length(), "{of}: {off:e} of {s}");
                }
            }
        }
    }
}

/// Where `FBX2glTF` 0.9.7, that is Autodesk's SDK, has the point 1 2 3 of these nodes in the world, in metres and
/// with y up: file, clip, node, time in frames of 24, position.
#[rustfmt::skip]
const SDK: &[(&str, usize, &str, u32, [f64; 3])] = &[
    ("blender_279_sausage_7400_binary.fbx", 1, "Top_end", 0, [1.0, 7.6, 3.0]),
    ("blender_279_sausage_7400_binary.fbx", 1, "Top_end", 10, [-1.06593, 7.6, -2.977214]),
    ("blender_279_sausage_7400_binary.fbx", 1, "Top_end", 19, [1.033326, 7.600001, 2.988684]),
    ("blender_279_sausage_7400_binary.fbx", 2, "Top", 5, [-1.415336, 5.671471, 2.999999]),
    ("blender_279_sausage_7400_binary.fbx", 2, "Top", 13, [-3.613376, 3.738757, 3.0]),
    ("max2009_cube_anim_6100_binary.fbx", 0, "Box01", 0, [0.0254, 0.0762, -0.0508]),
    ("max2009_cube_anim_6100_binary.fbx", 0, "Box01", 7, [-0.3293461, 0.0762, -0.04373168]),
    ("max2009_cube_anim_6100_binary.fbx", 0, "Box01", 24, [-1.7272, 0.0762, 0.0254]),
    ("max2009_cube_anim_6100_binary.fbx", 0, "Box01", 41, [1.033586, 0.0762, 0.05523104]),
    ("maya_anim_extrapolation_7700_ascii.fbx", 0, "pCube1", 1, [0.01, 0.02, 0.03]),
    ("maya_anim_extrapolation_7700_ascii.fbx", 0, "pCube1", 12, [0.05674118, 0.02, 0.03]),
    ("maya_anim_extrapolation_7700_ascii.fbx", 0, "pCube1", 24, [0.11, 0.02, 0.03]),
    ("maya_anim_interpolation_7700_binary.fbx", 0, "pCube1", 3, [-0.001327965, 0.02, 0.03]),
    ("maya_anim_interpolation_7700_binary.fbx", 0, "pCube1", 9, [-0.0125, 0.02, 0.03]),
    ("maya_anim_interpolation_7700_binary.fbx", 0, "pCube1", 20, [-0.05, 0.02, 0.03]),
    ("maya_anim_interpolation_7700_binary.fbx", 0, "pCube1", 31, [-0.105, 0.02, 0.03]),
    ("maya_anim_interpolation_7700_binary.fbx", 0, "pCube1", 40, [-0.15, 0.02, 0.03]),
    ("maya_anim_interpolation_6100_ascii.fbx", 0, "pCube1", 9, [-0.0125, 0.02, 0.03]),
    ("maya_anim_interpolation_6100_ascii.fbx", 0, "pCube1", 31, [-0.105, 0.02, 0.03]),
    ("maya_anim_layers_7500_ascii.fbx", 0, "pCube1", 1, [0.01, 0.02, 0.03]),
    ("maya_anim_layers_7500_ascii.fbx", 0, "pCube1", 6, [0.02622905, 0.01860619, 0.0421769]),
    ("maya_anim_layers_7500_ascii.fbx", 0, "pCube1", 13, [0.09531854, 0.08634474, 0.07721445]),
    ("maya_anim_layers_7500_ascii.fbx", 0, "pCube1", 20, [0.13, 0.12, 0.08999999]),
    ("maya_anim_linear_7700_ascii.fbx", 0, "pCube1", 2, [0.015, 0.04, 0.03]),
    ("maya_anim_linear_7700_ascii.fbx", 0, "pCube1", 7, [0.0275, 0.02333333, 0.03]),
    ("maya_anim_pivot_rotate_7700_ascii.fbx", 0, "pCube1", 0, [0.01, 0.02, 0.03]),
    ("maya_anim_pivot_rotate_7700_ascii.fbx", 0, "pCube1", 2, [0.01, -0.01348076, 0.02799038]),
    ("maya_anim_pivot_rotate_7700_ascii.fbx", 0, "pCube1", 5, [0.01, -0.02299038, -0.01848076]),
    ("maya_keyframe_spacing_7700_ascii.fbx", 0, "pCube1", 4, [0.03, 0.02, 0.03]),
    ("maya_keyframe_spacing_7700_ascii.fbx", 0, "pCube1", 17, [0.06777777, 0.02, 0.03]),
    ("maya_transform_animation_7500_ascii.fbx", 0, "pCube1", 1, [0.01, 0.02, 0.03]),
    ("maya_transform_animation_7500_ascii.fbx", 0, "pCube1", 8, [0.01597192, 0.03201719, 0.04599416]),
    ("maya_transform_animation_7500_ascii.fbx", 0, "pCube1", 20, [0.007241992, 0.01426964, 0.02092432]),
    ("motionbuilder_tangent_tcb_7700_ascii.fbx", 0, "pCube1", 3, [-0.03546875, 0.02, 0.03]),
    ("motionbuilder_tangent_tcb_7700_ascii.fbx", 0, "pCube1", 20, [0.0437037, 0.02, 0.03]),
    ("motionbuilder_tangent_tcb_7700_ascii.fbx", 0, "pCube1", 50, [0.03875667, 0.02, 0.03]),
    ("casegen_rotation_order_7500_binary.fbx", 0, "Node_00_00", 1, [0.01, 0.02, 0.03]),
    ("casegen_rotation_order_7500_binary.fbx", 0, "Node_02_04", 1, [0.1882843, -0.01414214, 0.1]),
    ("casegen_rotation_order_7500_binary.fbx", 0, "Node_04_09", 1, [0.3670711, 0.01, 0.1953553]),
    ("casegen_rotation_order_7500_binary.fbx", 0, "Node_07_01", 1, [0.05, -0.007071068, 0.3153553]),
    ("casegen_rotation_order_7500_binary.fbx", 0, "Node_09_03", 1, [0.1129289, 0.0212132, 0.39]),
    ("casegen_rotation_order_7500_binary.fbx", 0, "Node_11_12", 1, [0.51, 0.02, 0.43]),
    ("casegen_rotation_space_7500_ascii.fbx", 0, "Node_00_05", 1, [0.21, 0.02, 0.03]),
    ("casegen_rotation_space_7500_ascii.fbx", 0, "Node_05_00", 1, [0.01, 0.02, 0.23]),
    ("casegen_rotation_space_7500_ascii.fbx", 0, "Node_09_09", 1, [0.3576795, 0.03616025, 0.3693301]),
    ("maya_pivots_7500_binary.fbx", 0, "pCube1", 1, [0.02177803, 0.04168012, 0.01929987]),
    ("maya_human_ik_7400_binary.fbx", 0, "Character1_RightHand", 1, [0.2829014, 3.46589, 3.0]),
    ("maya_human_ik_7400_binary.fbx", 0, "Character1_Ctrl_RightToeBase", 1, [1.011634, 1.937136, 3.129552]),
    ("maya_character_7500_binary.fbx", 0, "Character1_Spine", 1, [0.01, 1.09, 0.03]),
    ("maya_character_7500_binary.fbx", 0, "Character1_Head", 1, [0.01, 1.67, 0.03]),
];

/// Rotation orders, pivots, pre and post rotation, layers, extrapolation and tangents are those of the SDK.
#[test]
fn joints_are_where_autodesks_sdk_has_them() {
    let Some(folder) = shared_data() else { return };
    let engine = Engine::new(Device::Cpu).unwrap();
    for &(file, clip, node, frame, expected) in SDK {
        let time = f64::from(frame) / 24.0;
        let loaded = read(&folder.join("fbx").join(file), &ReadOptions::default());
        let space = loaded.space.unwrap();
        let clip = &loaded.clips[clip];
        let frames = SampleTimes::at(vec![time]);
        let samples = ChannelMethods::AUTHORED
            .sample(&engine, clip, &frames)
            .unwrap();
        let poses = world(clip, &samples).unwrap();
        let tracks = clip.set.tracks();
        let track = tracks
            .enumerate()
            .position(|(_, track)| track.name == Some(node))
            .unwrap();
        let to_y_up = DQuat::from_rotation_arc(space.up, DVec3::Y);
        let pose = &poses[track];
        let point = pose.rotation.as_dquat() * DVec3::new(1.0, 2.0, 3.0);
        let found = to_y_up * (pose.position + point) * space.metres;
        let expected = DVec3::from_array(expected);
        let size = expected.length().max(0.1);
        let off = found.distance(expected);
        assert!(
            off < 2e-5 * size,
            "{file} {node} {time}: {found}, {expected}"
        );
    }
}

#[test]
fn nodes_become_a_skeleton_in_the_units_of_the_file() {
    let loaded = read(&fixture("walk"), &ReadOptions::default());
    let space = loaded.space.unwrap();
    assert_eq!((space.up, space.metres), (DVec3::Z, 0.01));
    // glTF requires metres and y up.
    let warning = |format: &str| {
        let format = Format::named(format).unwrap();
        let warning = loaded.space_warning(format, "out");
        warning.map(|warning| (warning.code, warning.message))
    };
    let (code, message) = warning("glb").unwrap();
    assert_eq!(code, Code::OtherSpace);
    assert!(message.contains("units of 0.01 m and z up"), "{message}");
    assert_eq!(warning("npz"), None);
    let [clip] = &loaded.clips[..] else {
        panic!("{:?}", loaded.clips);
    };
    assert_eq!(clip.name.as_deref(), Some("walk"));
    assert_eq!(clip.rate, FrameRate::new(30, 1).ok());
    let names: Vec<_> = clip.set.tracks().map(|track| track.name).collect();
    assert_eq!(names, [Some("hips"), Some("knee")]);
    let parents: Vec<_> = clip.skeleton.iter().map(|joint| joint.parent).collect();
    assert_eq!(parents, [None, Some(0)]);
    let samplers = clip
        .channels
        .iter()
        .map(|all| (all.rotation, all.translation));
    let expected = [
        (None, Some(ChannelInterpolation::Linear)),
        (Some(ChannelInterpolation::Cubic), None),
    ];
    assert_eq!(samplers.collect::<Vec<_>>(), expected);
    let steps = read(&fixture("steps"), &ReadOptions::default());
    assert_eq!(
        steps.clips[0].channels[1].rotation,
        Some(ChannelInterpolation::Step)
    );
    let same = read(&fixture("two_of_one_name"), &ReadOptions::default());
    let names: Vec<_> = same.clips[0].set.tracks().map(|track| track.name).collect();
    assert_eq!(names, ["hips", "knee", "knee#2", "node3"].map(Some));
}

/// The rotations and translations of a track at some times.
fn sampled(clip: &Motion, track: usize, times: &[f64]) -> Vec<(DQuat, DVec3)> {
    let engine = Engine::new(Device::Cpu).unwrap();
    let frames = SampleTimes::at(times.to_vec());
    let samples = ChannelMethods::AUTHORED
        .sample(&engine, clip, &frames)
        .unwrap();
    let sampled = samples.of(clip, None, &[]);
    let index = |sample: usize| sample * clip.set.track_count() + track;
    (0..times.len())
        .map(|sample| {
            let rotation = samples.rotations[index(sample)].as_dquat().normalize();
            (rotation, sampled.position(sample, track))
        })
        .collect()
}

fn degrees(from: DQuat, to: DQuat) -> f64 {
    let sine = (from * to.conjugate()).xyz().length();
    (2.0 * sine.min(1.0).asin()).to_degrees()
}

/// As Autodesk's SDK has them: a muted layer has no effect, and the weight of a layer that overrides others scales its
/// translations.
#[test]
fn layers_have_the_effect_that_they_have_in_the_sdk() {
    for (name, expected) in [
        ("layer_muted", [[0.0; 3], [2.0, 2.5, 3.0], [4.0, 5.0, 6.0]]),
        (
            "layer_weight",
            [[0.5; 3], [0.75, 1.0, -1.5], [1.0, 1.5, -3.5]],
        ),
        ("layer_solo", [[1.0; 3], [3.5, 4.5, 0.0], [6.0, 8.0, -1.0]]),
    ] {
        let loaded = read(&fixture(name), &ReadOptions::default());
        let found = sampled(&loaded.clips[0], 0, &[0.0, 0.5, 1.0]);
        for ((_, found), expected) in found.into_iter().zip(expected) {
            let off = found.distance(DVec3::from_array(expected));
            assert!(off < 1e-5, "{name}: {found}, {expected:?}");
        }
    }
}

/// The rate that the file states does not matter.
#[test]
fn the_rate_is_that_of_the_keys() {
    for (name, frames, seconds) in [
        ("rate_119_88", 120_000, 1001),
        ("rate_29_97_in_30", 30_000, 1001),
        ("rate_144_in_24", 144, 1),
        ("walk", 30, 1),
    ] {
        let rate = FrameRate::new(frames, seconds).unwrap();
        let clip = &read(&fixture(name), &ReadOptions::default()).clips[0];
        assert_eq!(clip.rate, Some(rate), "{name}");
        if name != "walk" {
            let times: Vec<f64> = (0..=12).map(|frame| rate.time_of(frame)).collect();
            assert_eq!(clip.set.track(1).times, times, "{name}");
        }
    }
}

#[test]
fn an_end_that_was_rounded_to_f32_is_that_of_the_last_key() {
    let clip = &read(&fixture("take_stop"), &ReadOptions::default()).clips[0];
    assert_eq!(clip.set.track(1).times, [0.0, 8.0 / 24.0, 16.0 / 24.0]);
    assert_eq!(clip.rate_of_keys(), FrameRate::new(3, 1).ok());
}

/// As the SDK, Blender and three.js read it.
#[test]
fn the_spheric_order_is_read_as_xyz() {
    let loaded = read(&fixture("spheric"), &ReadOptions::default());
    let codes: Vec<Code> = loaded.warnings.iter().map(|warning| warning.code).collect();
    assert_eq!(codes, [Code::FbxSpheric]);
    let found = sampled(&loaded.clips[0], 0, &[0.0, 0.5, 1.0]);
    for ((found, _), [x, y, z]) in
        (found.into_iter()).zip([[10.0, 20.0, 30.0], [30.0, -5.0, 55.0], [50.0, -30.0, 80.0]])
    {
        let [x, y, z] = [x, y, z].map(f64::to_radians);
        let expected =
            DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y) * DQuat::from_rotation_x(x);
        let off = degrees(found, expected);
        assert!(off < 1e-4, "{found}, {expected}: {off}°");
    }
}

/// A key that is constant until the next one has the value that is stored with it at its time, and that of the next
/// one after it.
#[test]
fn the_value_of_the_next_key_holds_after_a_key() {
    let loaded = read(&fixture("constant_next"), &ReadOptions::default());
    let times = [0.0, 1e-6, 0.2, 8.0 / 24.0, 0.35, 16.0 / 24.0, 0.7, 1.0];
    let found = sampled(&loaded.clips[0], 1, &times);
    let expected: [f64; 8] = [0.0, 10.0, 10.0, 10.0, 20.0, 20.0, 60.0, 60.0];
    for (((found, _), expected), time) in found.into_iter().zip(expected).zip(times) {
        let off = degrees(found, DQuat::from_rotation_z(expected.to_radians()));
        assert!(off < 1e-4, "{time} s: {off}° from {expected}°");
    }
}

/// Only the keys of the file, except for rotations that the arcs between them would not follow.
#[test]
fn keyframes_are_those_of_the_file() {
    let options = ReadOptions {
        keyframes: true,
        ..ReadOptions::default()
    };
    let walk = read(&fixture("walk"), &options);
    let knee = walk.clips[0].set.track(1);
    assert_eq!(knee.times, [0.0, 0.5, 1.0]);
    assert_eq!(
        walk.clips[0].channels[1].rotation,
        Some(ChannelInterpolation::Linear)
    );
    let followed = read(&fixture("walk"), &ReadOptions::default());
    assert!(followed.clips[0].set.track(1).times.len() > 3);
}

/// Twelve full rotations between two keys: the rotation is the identity at their ends, thirds and
/// quarters.
#[test]
fn whole_turns_between_two_keys_are_kept() {
    for keyframes in [false, true] {
        let options = ReadOptions {
            keyframes,
            ..ReadOptions::default()
        };
        let spin = read(&fixture("spin"), &options);
        let keys = spin.clips[0].set.track(1).keys;
        let arcs = keys.windows(2).map(|pair| {
            let [a, b] = [pair[0], pair[1]].map(|key| key.as_dquat().normalize());
            a.angle_between(b)
        });
        let revolutions = arcs.sum::<f64>() / std::f64::consts::TAU;
        assert!(
            (revolutions - 12.0).abs() < 1e-4,
            "{keyframes}: {revolutions}, {}",
            keys.len()
        );
    }
}

/// The same skeleton whose nodes hang below each other, so many.
fn deep(nodes: usize) -> String {
    let text = fs::read_to_string(fixture("rests")).unwrap();
    let (mut models, mut links) = (String::new(), String::new());
    for node in 0..nodes {
        let (number, parent) = (2000 + node, if node == 0 { 2 } else { 1999 + node });
        models += &format!("\tModel: {number}, \"Model::n{node}\", \"LimbNode\" {{\n\t}}\n");
        links += &format!("\tC: \"OO\",{number},{parent}\n");
    }
    text.replace("Objects:  {\n", &format!("Objects:  {{\n{models}"))
        .replace("Connections:  {\n", &format!("Connections:  {{\n{links}"))
}

#[test]
fn depth_work_and_memory_are_limited() {
    let refused = |text: &str, options: &ReadOptions| {
        read_fbx("f.fbx", text.as_bytes(), options)
            .unwrap_err()
            .code
    };
    let options = ReadOptions::default();
    assert!(read_fbx("f.fbx", deep(900).as_bytes(), &options).is_ok());
    assert_eq!(refused(&deep(1100), &options), Code::FbxDepth);
    let memory = ReadOptions {
        limits: Limits {
            memory: Some(100_000),
            ..Limits::default()
        },
        ..ReadOptions::default()
    };
    assert_eq!(refused(&deep(900), &memory), Code::Memory);
    // Following the curves of these nodes takes the most keys; each of them goes through all
    // layers.
    let spin = fs::read_to_string(fixture("spin")).unwrap();
    let (mut objects, mut links) = (String::new(), String::new());
    for number in 2000..2030 {
        objects += &format!("\tModel: {number}, \"Model::\", \"LimbNode\" {{\n\t}}\n");
        links += &format!("\tC: \"OO\",{number},0\n\tC: \"OP\",11,{number}, \"Lcl Rotation\"\n");
    }
    // Layers that move none of these nodes cost nothing.
    let layers = |count: u32, moves: bool| {
        let (mut objects, mut links) = (objects.clone(), links.clone());
        for number in 3000..3000 + count {
            objects += &format!("\tAnimationLayer: {number}, \"AnimLayer::\", \"\" {{\n\t}}\n");
            links += &format!("\tC: \"OO\",{number},1000\n");
            if !moves {
                continue;
            }
            let curves = number + 10_000;
            objects += &format!(
                "\tAnimationCurveNode: {curves}, \"AnimCurveNode::Lcl Rotation\", \"\" {{\n\t}}\n"
            );
            links += &format!("\tC: \"OO\",{curves},{number}\n\tC: \"OP\",10,{curves}, \"d|X\"\n");
            for node in 2000..2030 {
                links += &format!("\tC: \"OP\",{curves},{node}, \"Lcl Rotation\"\n");
            }
        }
        spin.replace("Objects:  {\n", &format!("Objects:  {{\n{objects}"))
            .replace("Connections:  {\n", &format!("Connections:  {{\n{links}"))
    };
    assert_eq!(refused(&layers(200, true), &options), Code::FbxWork);
    let still = read_fbx("f.fbx", layers(400, false).as_bytes(), &options);
    assert!(still.is_ok(), "{:?}", still.err());
}

#[test]
fn broken_files_are_refused() {
    let Some(folder) = shared_data() else { return };
    for (name, code) in [
        ("fuzz_0000", Code::FbxDamaged),
        ("fuzz_0007", Code::FbxDamaged),
        ("fuzz_0010", Code::FbxDamaged),
    ] {
        let path = folder.join("fbx").join(name).with_extension("fbx");
        let bytes = fs::read(path).unwrap();
        let error = read_fbx(name, &bytes, &ReadOptions::default()).unwrap_err();
        assert_eq!(error.code, code, "{error}");
    }
    // Truncated files, and files with a changed bit.
    for name in [
        "maya_anim_interpolation_7700_binary",
        "max2009_cube_anim_6100_binary",
    ] {
        let path = folder.join("fbx").join(name).with_extension("fbx");
        let bytes = fs::read(path).unwrap();
        for cut in (0..bytes.len()).step_by(bytes.len() / 12) {
            let _ = read_fbx(name, &bytes[..cut], &ReadOptions::default());
        }
        for i in (27..bytes.len()).step_by(bytes.len() / 40) {
            let mut bytes = bytes.clone();
            bytes[i] ^= 1 << (i % 8);
            let _ = read_fbx(name, &bytes, &ReadOptions::default());
        }
    }
}
