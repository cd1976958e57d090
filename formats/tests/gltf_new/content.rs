//! The content of a new file: nodes, skins, animations and their samplers.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DAffine3, DMat4, Quat, Vec3};
use serde_json::{Value, json};
use tumble_formats::motion::{ChannelInterpolation, Channels, Joint, Motion, Transform};

use crate::gltf_new::{Clip, cameras, channels, glb, integer, leg, numbers, rest, set, written};
use crate::validator::validate;

#[test]
fn a_clip_comes_back_as_nodes_a_skin_and_an_animation() {
    let clip = leg();
    let mut sampled = clip.sampled();
    let notes = [("method", "slerp".to_owned())];
    sampled.notes = &notes;
    let (json, binary) = glb(&written(&[sampled], "glb"));
    assert_eq!(json["asset"]["version"], "2.0");
    assert!(
        json["asset"]["generator"]
            .as_str()
            .unwrap()
            .starts_with("Tumble ")
    );
    assert_eq!(
        (&json["scene"], &json["scenes"]),
        (&json!(0), &json!([{"nodes": [1]}]))
    );
    assert_eq!(json["buffers"], json!([{"byteLength": binary.len()}]));

    let nodes = json["nodes"].as_array().unwrap();
    assert_eq!(nodes.len(), 3);
    for (node, (name, children)) in [
        ("knee", json!([2])),
        ("hip", json!([0])),
        ("foot", Value::Null),
    ]
    .into_iter()
    .enumerate()
    {
        let rest = clip.motion.skeleton[node].rest;
        let node = &nodes[node];
        // Members with glTF's default values are left out.
        let list = |name: &str, default: &[f32]| -> Vec<f32> {
            let numbers = |of: &Value| serde_json::from_value(of.clone()).unwrap();
            node.get(name).map_or(default.to_vec(), numbers)
        };
        assert_eq!(
            (&node["name"], &node["children"]),
            (&json!(name), &children)
        );
        assert_eq!(list("translation", &[0.0; 3]), rest.translation.to_array());
        assert_eq!(
            list("rotation", &[0.0, 0.0, 0.0, 1.0]),
            rest.rotation.to_array()
        );
        assert_eq!(list("scale", &[1.0; 3]), rest.scale.to_array());
    }

    // The matrix of each joint is the inverse of its pose in the world, which is computed here from
    // the root on.
    let skin = &json["skins"][0];
    assert_eq!(json["skins"].as_array().unwrap().len(), 1);
    assert_eq!(
        (&skin["skeleton"], &skin["joints"]),
        (&json!(1), &json!([1, 0, 2]))
    );
    let matrices = numbers(&json, &binary, &skin["inverseBindMatrices"]);
    let mut world = DMat4::IDENTITY;
    for (joint, matrix) in [1, 0, 2].into_iter().zip(matrices.chunks_exact(16)) {
        let Transform {
            translation,
            rotation,
            scale,
        } = clip.motion.skeleton[joint].rest;
        world *= DMat4::from_scale_rotation_translation(
            scale.as_dvec3(),
            rotation.as_dquat(),
            translation.as_dvec3(),
        );
        let inverse = DMat4::from_cols_slice(&matrix.iter().map(|&v| v.into()).collect::<Vec<_>>());
        assert!(
            (world * inverse).abs_diff_eq(DMat4::IDENTITY, 1e-6),
            "{joint}"
        );
        assert_eq!(
            [3, 7, 11, 15].map(|i| matrix[i].to_bits()),
            [0.0f32, 0.0, 0.0, 1.0].map(f32::to_bits)
        );
    }

    let animation = &json["animations"][0];
    assert_eq!(
        (&animation["name"], &animation["extras"]),
        (&json!("Kick"), &json!({"method": "slerp"}))
    );
    let input = &json["accessors"][integer(&animation["samplers"][0]["input"])];
    let bounds = ["min", "max"].map(|bound| input[bound][0].as_f64().unwrap() as f32);
    assert_eq!(bounds, [0.25, 1.1]);
    let channels = channels(&json, &binary, 0);
    let moved: Vec<_> = channels
        .iter()
        .map(|channel| (channel.node, channel.path))
        .collect();
    assert_eq!(
        moved,
        [
            (0, "rotation"),
            (0, "scale"),
            (1, "rotation"),
            (1, "translation")
        ]
    );
    for channel in channels {
        let (node, path) = (channel.node, channel.path);
        assert_eq!(channel.interpolation, "LINEAR");
        assert_eq!(channel.times, [0.25, 0.7, 1.1]);
        let expected: Vec<f32> = (0..3)
            .flat_map(|sample| {
                let at = 3 * sample + node;
                match path {
                    // The sign of the second sample is that of the first.
                    "rotation" => {
                        let rotation = clip.rotations[at];
                        (if rotation.w < 0.0 {
                            -rotation
                        } else {
                            rotation
                        })
                        .to_array()
                        .to_vec()
                    }
                    "translation" => clip.translations[at].to_array().to_vec(),
                    _ => clip.scales[at].to_array().to_vec(),
                }
            })
            .collect();
        assert_eq!(channel.values, expected, "{node} {path}");
    }
    let samplers = animation["samplers"].as_array().unwrap();
    let shared = &samplers[0]["input"];
    assert!(samplers.iter().all(|sampler| sampler["input"] == *shared));
}

#[test]
fn clips_share_nodes_where_their_skeletons_are_equal() {
    let [kick, cameras] = [leg(), cameras()];
    let mut other = leg();
    other.motion.skeleton[2].rest.translation.x = 0.5;
    let clips = [&kick, &cameras, &kick, &other].map(Clip::sampled);
    let (json, binary) = glb(&written(&clips, "glb"));
    let names: Vec<_> = json["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|node| &node["name"])
        .collect();
    let expected = [
        "knee", "hip", "foot", "camera", "lens", "camera#5", "knee#6", "hip#7", "foot#8",
    ];
    assert_eq!(names, expected);
    assert_eq!(json["scenes"][0]["nodes"], json!([1, 3, 4, 5, 7]));
    // Clips without a skeleton have no skin.
    assert_eq!(json["skins"][0]["joints"], json!([1, 0, 2]));
    assert_eq!(json["skins"][1]["joints"], json!([7, 6, 8]));
    assert_eq!(json["skins"].as_array().unwrap().len(), 2);
    let names = [0, 1, 2, 3].map(|i| &json["animations"][i]["name"]);
    assert_eq!(
        names,
        [
            &json!("Kick"),
            &Value::Null,
            &json!("Kick#2"),
            &json!("Kick#3")
        ]
    );
    let moved = |animation| -> Vec<_> {
        let channels = channels(&json, &binary, animation).into_iter();
        channels
            .map(|channel| (channel.node, channel.path))
            .collect()
    };
    assert_eq!(moved(2), moved(0));
    assert_eq!(moved(3)[0], (6, "rotation"));
    // The third camera is translated relative to its node, which rests at the origin.
    let [r, t] = ["rotation", "translation"];
    assert_eq!(moved(1), [(3, r), (3, t), (4, r), (5, r), (5, t)]);
}

#[test]
fn each_tree_of_a_skeleton_has_a_skin() {
    let mut clip = leg();
    clip.motion.skeleton[2].parent = None;
    let (json, _) = glb(&written(&[clip.sampled()], "glb"));
    assert_eq!(json["scenes"][0]["nodes"], json!([1, 2]));
    let skins = [0, 1].map(|skin| {
        (
            &json["skins"][skin]["skeleton"],
            &json["skins"][skin]["joints"],
        )
    });
    assert_eq!(
        skins,
        [(&json!(1), &json!([1, 0])), (&json!(2), &json!([2]))]
    );
}

#[test]
fn text_holds_what_glb_holds() {
    let clip = leg();
    let (binary_json, binary) = glb(&written(&[clip.sampled()], "glb"));
    let mut json: Value = serde_json::from_slice(&written(&[clip.sampled()], "GLTF")).unwrap();
    let uri = json["buffers"][0]
        .as_object_mut()
        .unwrap()
        .remove("uri")
        .unwrap();
    let data = uri
        .as_str()
        .unwrap()
        .strip_prefix("data:application/octet-stream;base64,");
    assert_eq!(STANDARD.decode(data.unwrap()).unwrap(), binary);
    assert_eq!(json, binary_json);
}

/// Walking down from the root again gives the poses in the world.
#[test]
fn poses_in_the_world_become_relative_to_the_parents() {
    let mut clip = leg();
    clip.motion.is_world = true;
    clip.scales.clear();
    for joint in &mut clip.motion.skeleton {
        joint.rest.scale = Vec3::ONE;
    }
    clip.motion.channels.clear();
    let (json, binary) = glb(&written(&[clip.sampled()], "glb"));
    let channels = channels(&json, &binary, 0);
    let of = |node: usize, path: &str| {
        let found = channels
            .iter()
            .find(|channel| (channel.node, channel.path) == (node, path));
        &found.unwrap().values
    };
    for sample in 0..3 {
        let mut world = DAffine3::IDENTITY;
        for node in [1, 0, 2] {
            let q = Quat::from_slice(&of(node, "rotation")[4 * sample..]).as_dquat();
            let t = Vec3::from_slice(&of(node, "translation")[3 * sample..]).as_dvec3();
            world *= DAffine3::from_rotation_translation(q, t);
            let at = 3 * sample + node;
            let expected = DAffine3::from_rotation_translation(
                clip.rotations[at].as_dquat(),
                clip.translations[at].as_dvec3(),
            );
            assert!(
                world.abs_diff_eq(expected, 1e-6),
                "{sample} {node}: {world} {expected}"
            );
        }
    }
}

#[test]
fn steps_stay_steps_and_what_rests_keeps_its_length() {
    let mut clip = leg();
    clip.motion.channels = vec![Channels::default(); 3];
    let (json, binary) = glb(&written(&[clip.sampled()], "glb"));
    let only = channels(&json, &binary, 0);
    assert_eq!((only.len(), only[0].node, only[0].path), (1, 0, "rotation"));
    assert_eq!(only[0].times, [0.25, 0.7, 1.1]);
    clip.motion.channels[1].translation = Some(ChannelInterpolation::Step);
    let (json, binary) = glb(&written(&[clip.sampled()], "glb"));
    let only = channels(&json, &binary, 0);
    assert_eq!(
        (only.len(), only[0].path, only[0].interpolation),
        (1, "translation", "STEP")
    );
}

/// A joint at scale 0 has no inverse; its matrix is the identity, not NaN.
#[test]
fn a_joint_without_size_has_a_matrix() {
    let mut clip = leg();
    clip.motion.skeleton[0].rest.scale = Vec3::ZERO;
    let (json, binary) = glb(&written(&[clip.sampled()], "glb"));
    let matrices = numbers(&json, &binary, &json["skins"][0]["inverseBindMatrices"]);
    let knee: Vec<f64> = matrices[16..32].iter().map(|&v| v.into()).collect();
    assert_eq!(DMat4::from_cols_slice(&knee), DMat4::IDENTITY);
    assert!(matrices.iter().all(|v| v.is_finite()));
}

/// A chain that a recursion would not survive.
#[test]
fn a_long_chain_is_written() {
    let joints = 65_536;
    let joint = |track: usize| Joint {
        parent: track.checked_sub(1),
        rest: rest([0.0, 1.0, 0.0], Quat::IDENTITY, 1.0),
    };
    let clip = Clip {
        motion: Motion {
            set: set(&vec![""; joints]),
            skeleton: (0..joints).map(joint).collect(),
            ..Motion::default()
        },
        times: vec![0.0],
        rotations: vec![Quat::IDENTITY; joints],
        ..Clip::default()
    };
    let (json, binary) = glb(&written(&[clip.sampled()], "glb"));
    let matrices = numbers(&json, &binary, &json["skins"][0]["inverseBindMatrices"]);
    assert_eq!(matrices[16 * (joints - 1) + 13], -65_536.0);
    assert_eq!(json["nodes"][joints - 1]["name"], "box65536");
}

#[test]
fn khronos_finds_no_error_in_new_files() {
    let folder = tempfile::tempdir().unwrap();
    let [kick, cameras] = [leg(), cameras()];
    let mut trees = leg();
    trees.motion.skeleton[2].parent = None;
    let mut one = leg();
    one.times.truncate(1);
    one.rotations.truncate(3);
    one.translations.truncate(3);
    one.scales.truncate(3);
    let mut world = leg();
    world.motion.is_world = true;
    world.scales.clear();
    world.motion.skeleton[0].rest.scale = Vec3::ONE;
    let mut flat = leg();
    flat.motion.skeleton[0].rest.scale = Vec3::ZERO;
    let sets: [&[&Clip]; 7] = [
        &[&kick],
        &[&cameras],
        &[&kick, &cameras, &kick, &trees],
        &[&one],
        &[&world],
        &[&flat],
        &[&trees],
    ];
    let mut files = Vec::new();
    for (i, clips) in sets.into_iter().enumerate() {
        let sampled: Vec<_> = clips.iter().map(|clip| clip.sampled()).collect();
        for format in ["glb", "gltf"] {
            let file = folder.path().join(format!("{i}.{format}"));
            std::fs::write(&file, written(&sampled, format)).unwrap();
            files.push(file);
        }
    }
    for (report, file) in validate(&files).into_iter().flatten().zip(&files) {
        assert!(
            report.errors.is_empty() && report.warnings.is_empty(),
            "{file:?}: {report:?}"
        );
    }
}
