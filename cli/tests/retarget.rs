//! Motions on other skeletons through the program: exact values, the file of a character, and what is refused.

use std::fs;
use std::path::Path;

use glam::{DQuat, DVec3, Quat, Vec3};
use serde_json::Value;
use tumble::Channel;
use tumble_formats::format::MotionOptions;
use tumble_formats::motion::{Joint, Motion, SampledClip, Transform};
use tumble_formats::{Format, ReadOptions};

use crate::program::{Run, root, run, succeed};

fn line(folder: &Path, line: &str) -> Run {
    succeed(folder, &line.split_whitespace().collect::<Vec<_>>())
}

fn refused(folder: &Path, words: &str, part: &str) {
    let run = run(folder, &words.split_whitespace().collect::<Vec<_>>());
    assert_ne!(run.code, 0, "{words}");
    assert!(run.words.contains(part), "{words}: {}", run.words);
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

fn rotations(value: &Value) -> Vec<DQuat> {
    let numbers = numbers(value);
    let four = numbers.as_chunks::<4>().0.iter();
    four.map(|&[w, x, y, z]| DQuat::from_xyzw(x, y, z, w))
        .collect()
}

fn points(value: &Value) -> Vec<DVec3> {
    let numbers = numbers(value);
    numbers
        .as_chunks::<3>()
        .0
        .iter()
        .map(|&point| DVec3::from_array(point))
        .collect()
}

/// Writes a clip of joints as GLB: their rest poses, and for each sample a rotation of each and a position of the first.
fn write(path: &Path, skeleton: &Value, rest: &[(DQuat, DVec3)], keys: &[DQuat], hips: &[DVec3]) {
    let mut clip = Motion::default();
    let joints = skeleton["names"].as_array().unwrap();
    let samples = keys.len() / joints.len();
    let times: Vec<f64> = (0..samples).map(|k| k as f64 / 30.0).collect();
    for (joint, name) in joints.iter().enumerate() {
        let of_joint = keys.iter().skip(joint).step_by(joints.len());
        let of_joint: Vec<Quat> = of_joint.map(|key| key.as_quat()).collect();
        clip.set
            .push(name.as_str().unwrap(), &times, &of_joint)
            .unwrap();
        let parent = skeleton["parents"][joint].as_i64().unwrap();
        clip.skeleton.push(Joint {
            parent: usize::try_from(parent).ok(),
            rest: Transform {
                rotation: rest[joint].0.as_quat(),
                translation: rest[joint].1.as_vec3(),
                scale: Vec3::ONE,
            },
        });
    }
    if !hips.is_empty() {
        clip.set_positions(0, &times, hips).unwrap();
    }
    let rotations: Vec<Quat> = keys.iter().map(|key| key.as_quat()).collect();
    let translations: Vec<Vec3> = (0..samples)
        .flat_map(|sample| {
            let moved = hips.get(sample).map_or(rest[0].1, |at| *at).as_vec3();
            std::iter::once(moved)
                .chain(rest[1..].iter().map(|rest| rest.1.as_vec3()))
                .collect::<Vec<_>>()
        })
        .collect();
    let sampled = SampledClip {
        clip: &clip,
        rate: None,
        times: &times,
        rotations: &rotations,
        translations: &translations,
        scales: &[],
        scalars: &[],
        is_at_keys: true,
        notes: &[],
    };
    let format = Format::named("glb").unwrap();
    let mut bytes = Vec::new();
    format
        .write_clips(&[sampled], &MotionOptions::default(), &mut bytes)
        .unwrap();
    fs::write(path, bytes).unwrap();
}

/// A file of the test data; says so where it is not there.
fn test_data(name: &str) -> Option<Value> {
    let file = root().join(format!("../shared/data/robots/retarget/{name}.json"));
    let Ok(text) = fs::read_to_string(&file) else {
        eprintln!("{} is not there: nothing compared", file.display());
        return None;
    };
    Some(serde_json::from_str(&text).unwrap())
}

/// The rest-pose transfer of the test data, through the program: between other axes, units and rest poses.
#[test]
fn rotations_are_those_of_the_formulas() {
    let Some(data) = test_data("transfer") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (source, target) = (&data["source"], &data["target"]);
    let rest: Vec<_> = rotations(&source["rest"])
        .into_iter()
        .zip(points(&source["offsets"]))
        .collect();
    let hips = points(&source["root"]);
    write(
        &folder.join("take.glb"),
        source,
        &rest,
        &rotations(&source["local_wxyz"]),
        &hips,
    );
    let rest_rotations = rotations(&target["rest_local_wxyz"]);
    let rest: Vec<_> = rest_rotations
        .iter()
        .copied()
        .zip(points(&target["rest_positions"]))
        .collect();
    write(
        &folder.join("character.glb"),
        target,
        &rest,
        &rest_rotations,
        &[],
    );
    fs::write(folder.join("bones.json"), data["map"].to_string()).unwrap();
    for (name, rest) in [
        ("fixed", "directions"),
        ("plain", "same"),
        ("fixed", "auto"),
    ] {
        let expected = &data["result"][name];
        let scale = expected["scale"].as_f64().unwrap();
        let command = format!(
            "retarget take.glb --up-axis z --onto character.glb --bones bones.json --rest {rest} --hips-scale {scale} \
             -o {rest}.glb --report {rest}.json"
        );
        line(folder, &command);
        let path = folder.join(format!("{rest}.glb"));
        let loaded = Format::open_detected(&path, &ReadOptions::default()).unwrap();
        let clip = &loaded.clips[0];
        let local = rotations(&expected["local_wxyz"]);
        let count = target["names"].as_array().unwrap().len();
        assert_eq!(clip.set.track_count(), count);
        for (joint, track) in clip.set.tracks().enumerate() {
            for (sample, key) in track.keys.iter().enumerate() {
                let expected = local[sample * count + joint];
                let key = key.as_dquat();
                let off = (key - expected).length().min((key + expected).length());
                assert!(off < 1e-6, "{name} {joint} {sample}: {off}");
            }
        }
        // Times are those of the source, and none is added or lost.
        assert_eq!(clip.set.track(0).times.len(), hips.len());
        let root = clip.set.vector_keys(Channel::Translation, 0).unwrap();
        for (key, expected) in root.keys.iter().zip(points(&expected["root"])) {
            assert!((key.as_dvec3() - expected).length() < 1e-6, "{name}");
        }
        let report = fs::read_to_string(folder.join(format!("{rest}.json"))).unwrap();
        let report: Value = serde_json::from_str(&report).unwrap();
        assert_eq!(report[0]["dropped"], serde_json::json!(["Spine2"]));
        assert_eq!(report[0]["pairs"]["head"], "Head");
        assert!(report[0]["largest_difference"].as_f64().unwrap() < 2e-6);
        assert_eq!(report[0]["frames"], hips.len());
        assert_eq!(
            report[0]["aligned"].as_object().unwrap().is_empty(),
            rest == "same"
        );
    }
}

/// Every kind of skeleton of the test data, recognised by its names through the program, onto every other one.
#[test]
fn skeletons_are_recognised_by_their_names() {
    let Some(data) = test_data("names") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (kind, names) in data["names"].as_object().unwrap() {
        fs::write(
            folder.join(format!("{kind}.bvh")),
            human(|role| names[role].as_str().unwrap()),
        )
        .unwrap();
    }
    for kind in data["names"].as_object().unwrap().keys() {
        let run = line(
            folder,
            &format!("retarget {kind}.bvh --onto vrm.bvh -o to_{kind}.bvh --json"),
        );
        let json: Value = serde_json::from_slice(&run.out).unwrap();
        let pairs = json[0]["pairs"].as_object().unwrap();
        assert_eq!(pairs.len(), HUMAN.len(), "{kind}");
        assert_eq!(
            pairs["leftLowerLeg"], data["names"][kind]["leftLowerLeg"],
            "{kind}"
        );
        // The same keys, because both skeletons are the same but for their names.
        let [found, expected] = [format!("to_{kind}.bvh"), format!("{kind}.bvh")].map(|file| {
            let loaded =
                Format::open_detected(&folder.join(file), &ReadOptions::default()).unwrap();
            let set = &loaded.clips[0].set;
            let keys = set.tracks().flat_map(|track| track.keys.to_vec());
            keys.collect::<Vec<Quat>>()
        });
        for (found, expected) in found.iter().zip(&expected) {
            assert!(found.dot(*expected).abs() > 1.0 - 1e-6, "{kind}");
        }
    }
}

/// An SMPL body rests in the axes of its model, with y up, whichever axis points up in its file; and it walks on the ground.
#[test]
fn bodies_stand_upright_on_other_skeletons() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    crate::features::write_bodies(folder);
    fs::write(folder.join("character.bvh"), human(|role| role)).unwrap();
    for (input, is_found) in [
        ("amass.npz", true),
        ("amass.npz --up-axis y", false),
        ("y_up.npz", false),
    ] {
        let words = format!(
            "retarget {input} --offsets offsets.txt --onto character.bvh --rest same -o a.bvh --overwrite"
        );
        let made = line(folder, &words);
        let said = "the body stands along z on average, so it is rotated until y points up";
        assert_eq!(made.words.contains(said), is_found, "{}", made.words);
        let loaded = Format::open_detected(&folder.join("a.bvh"), &ReadOptions::default());
        let clip = &loaded.unwrap().clips[0];
        let hips = clip.set.vector_keys(Channel::Translation, 0).unwrap().keys;
        // Both skeletons stand on their toes at rest, 0.93 and 100 below their hips.
        for (key, expected) in [
            (0, Vec3::new(0.0, 100.0, 0.0)),
            (30, Vec3::new(0.0, 100.0, 100.0 / 0.93)),
        ] {
            assert!(
                hips[key].distance(expected) < 1e-3,
                "{input}: {}",
                hips[key]
            );
        }
        for track in clip.set.tracks() {
            assert!(
                track.keys.iter().all(|key| key.w.abs() > 1.0 - 1e-6),
                "{input}"
            );
        }
    }
    refused(
        folder,
        "retarget amass.npz --onto character.bvh -o b.bvh",
        "--body-model",
    );
}

/// Roles, their parents in the list, and their offsets.
const HUMAN: [(&str, Option<usize>, [f64; 3]); 22] = [
    ("hips", None, [0.0, 100.0, 0.0]),
    ("spine", Some(0), [0.0, 10.0, 0.0]),
    ("chest", Some(1), [0.0, 12.0, 0.0]),
    ("upperChest", Some(2), [0.0, 13.0, 0.0]),
    ("neck", Some(3), [0.0, 15.0, 0.0]),
    ("head", Some(4), [0.0, 10.0, 3.0]),
    ("leftShoulder", Some(3), [6.0, 10.0, 0.0]),
    ("leftUpperArm", Some(6), [12.0, 0.0, 0.0]),
    ("leftLowerArm", Some(7), [27.0, 0.0, 0.0]),
    ("leftHand", Some(8), [28.0, 0.0, 0.0]),
    ("rightShoulder", Some(3), [-6.0, 10.0, 0.0]),
    ("rightUpperArm", Some(10), [-12.0, 0.0, 0.0]),
    ("rightLowerArm", Some(11), [-27.0, 0.0, 0.0]),
    ("rightHand", Some(12), [-28.0, 0.0, 0.0]),
    ("leftUpperLeg", Some(0), [9.0, -5.0, 0.0]),
    ("leftLowerLeg", Some(14), [0.0, -44.0, 0.0]),
    ("leftFoot", Some(15), [0.0, -44.0, -2.0]),
    ("leftToes", Some(16), [0.0, -7.0, 14.0]),
    ("rightUpperLeg", Some(0), [-9.0, -5.0, 0.0]),
    ("rightLowerLeg", Some(18), [0.0, -44.0, 0.0]),
    ("rightFoot", Some(19), [0.0, -44.0, -2.0]),
    ("rightToes", Some(20), [0.0, -7.0, 14.0]),
];

/// A BVH of the skeleton, of three frames.
pub(crate) fn human<'a>(name: impl Fn(&'static str) -> &'a str) -> String {
    fn joint<'a>(index: usize, name: &dyn Fn(&'static str) -> &'a str, text: &mut String) {
        let (role, parent, [x, y, z]) = HUMAN[index];
        let (word, channels) = match parent {
            None => (
                "ROOT",
                "6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
            ),
            Some(_) => ("JOINT", "3 Zrotation Xrotation Yrotation"),
        };
        *text += &format!(
            "{word} {}\n{{\nOFFSET {x} {y} {z}\nCHANNELS {channels}\n",
            name(role)
        );
        let children = (0..HUMAN.len()).filter(|&child| HUMAN[child].1 == Some(index));
        let children: Vec<usize> = children.collect();
        children.iter().for_each(|&child| joint(child, name, text));
        if children.is_empty() {
            *text += "End Site\n{\nOFFSET 0 1 0\n}\n";
        }
        *text += "}\n";
    }
    let mut text = "HIERARCHY\n".to_owned();
    joint(0, &name, &mut text);
    text += "MOTION\nFrames: 3\nFrame Time: 0.04\n";
    for frame in 0..3 {
        text += &format!("{frame} 100 0");
        for number in 0..66 {
            text += &format!(" {}", 5 * frame + number % 7);
        }
        text += "\n";
    }
    text
}

/// A character with a mesh and without animations becomes one with an animation; all else of its file stays.
#[test]
fn the_file_of_a_character_keeps_its_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("take.bvh"), human(|role| role)).unwrap();
    let mut nodes: Vec<Value> = Vec::new();
    for (index, (role, _, [x, y, z])) in HUMAN.iter().enumerate() {
        let children: Vec<usize> = (0..HUMAN.len())
            .filter(|&child| HUMAN[child].1 == Some(index))
            .collect();
        let mut node =
            serde_json::json!({"name": role, "translation": [x / 100.0, y / 100.0, z / 100.0]});
        if !children.is_empty() {
            node["children"] = children.into();
        }
        nodes.push(node);
    }
    nodes.push(serde_json::json!({"name": "skin", "mesh": 0, "skin": 0}));
    let mesh =
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let file = serde_json::json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 22]}], "nodes": nodes,
        "skins": [{"joints": (0..22).collect::<Vec<_>>()}],
        "materials": [{"name": "cloth"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": mesh}],
    });
    fs::write(folder.join("character.gltf"), file.to_string()).unwrap();
    let run = line(
        folder,
        "retarget take.bvh --onto character.gltf -o walking.gltf",
    );
    assert!(
        run.words
            .contains("22 of 22 joints are mapped, translations of the hips × 0.0100"),
        "{}",
        run.words
    );
    let text = fs::read_to_string(folder.join("walking.gltf")).unwrap();
    let found: Value = serde_json::from_str(&text).unwrap();
    for part in ["meshes", "materials", "nodes", "skins", "scenes"] {
        assert_eq!(found[part], file[part], "{part}");
    }
    assert_eq!(found["buffers"][0], file["buffers"][0]);
    // Onto a character that moves: its animation is replaced, and its keys are gone.
    line(
        folder,
        "retarget take.bvh --onto walking.gltf -o again.gltf",
    );
    let [first, again] =
        ["walking.gltf", "again.gltf"].map(|file| fs::read(folder.join(file)).unwrap());
    assert_eq!(first.len(), again.len());
    let info = line(folder, "info again.gltf --json");
    let info: Value = serde_json::from_slice(&info.out).unwrap();
    assert_eq!(info.as_array().map_or(1, Vec::len), 1, "{info}");
    let loaded =
        Format::open_detected(&folder.join("again.gltf"), &ReadOptions::default()).unwrap();
    let clip = &loaded.clips[0];
    assert_eq!(
        (loaded.clips.len(), clip.set.track(0).times),
        (1, &[0.0, 0.04, 0.08][..])
    );
    let hips = clip.set.vector_keys(Channel::Translation, 0).unwrap();
    assert!(
        (hips.keys[2] - Vec3::new(0.02, 1.0, 0.0)).length() < 1e-6,
        "{:?}",
        hips.keys
    );
    // Another skeleton of the same file, and the pose of a frame as the rest pose.
    line(
        folder,
        "retarget take.bvh --onto character.gltf --rest-frame 1 --rest same -o rest.glb",
    );
    let loaded = Format::open_detected(&folder.join("rest.glb"), &ReadOptions::default()).unwrap();
    for track in loaded.clips[0].set.tracks() {
        assert!(
            track.keys[1].w.abs() > 1.0 - 1e-6,
            "frame 1 is the rest pose: {:?}",
            track.name
        );
    }
}

#[test]
fn batches_are_made_again_for_another_character() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::create_dir(folder.join("takes")).unwrap();
    for name in ["takes/a.bvh", "takes/b.bvh", "character.bvh"] {
        fs::write(folder.join(name), human(|role| role)).unwrap();
    }
    let command = "retarget takes --onto character.bvh -o out --to bvh --resume";
    line(folder, command);
    let first = fs::read(folder.join("out/a.bvh")).unwrap();
    let again = line(folder, command);
    assert!(again.words.contains("2 "), "{}", again.words);
    let longer = human(|role| role).replace("OFFSET 0 -44 0", "OFFSET 0 -50 0");
    fs::write(folder.join("character.bvh"), longer).unwrap();
    line(folder, command);
    assert_ne!(fs::read(folder.join("out/a.bvh")).unwrap(), first);
}

#[test]
fn what_does_not_fit_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("take.bvh"), human(|role| role)).unwrap();
    fs::write(
        folder.join("other.bvh"),
        human(|role| role).replace("leftLowerLeg", "flipper"),
    )
    .unwrap();
    fs::write(folder.join("bones.json"), r#"{"hips": "tail"}"#).unwrap();
    fs::write(folder.join("list.json"), "[1]").unwrap();
    fs::write(folder.join("number.json"), r#"{"hips": 1}"#).unwrap();
    let retarget = "retarget take.bvh --onto take.bvh -o x.bvh";
    refused(
        folder,
        "retarget take.bvh --onto other.bvh -o x.bvh",
        "E917",
    );
    refused(
        folder,
        "retarget other.bvh --onto take.bvh -o x.bvh",
        "other.bvh: error[E917]",
    );
    refused(
        folder,
        &format!("{retarget} --bones bones.json"),
        "no joint `tail`",
    );
    refused(
        folder,
        &format!("{retarget} --bones list.json"),
        "list.json",
    );
    refused(
        folder,
        &format!("{retarget} --bones number.json"),
        "`hips` is 1",
    );
    refused(folder, &format!("{retarget} --bones none.json"), "E001");
    refused(
        folder,
        &format!("{retarget} --rest-frame 3"),
        "the source has 3",
    );
    refused(folder, &format!("{retarget} --hips-scale 0"), "above 0");
    refused(folder, "retarget take.bvh -o x.bvh", "--onto");
    refused(folder, "retarget take.bvh --onto none.glb -o x.bvh", "E001");
    refused(
        folder,
        "retarget take.bvh --onto take.bvh -o x.npy",
        "holds results",
    );
    refused(
        folder,
        "retarget take.bvh other.bvh --onto take.bvh -o out --to bvh --report r.json",
        "single input",
    );
    assert!(!folder.join("x.bvh").exists());
}

/// Joints that move away from where they rest, other than the hips, lose this motion with a warning.
#[test]
fn lost_translations_are_said() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let rotations = "Zrotation Xrotation Yrotation";
    let take = format!(
        "HIERARCHY ROOT a {{ OFFSET 0 1 0 CHANNELS 3 {rotations} JOINT b {{ OFFSET 0 1 0 CHANNELS 6 Xposition Yposition \
         Zposition {rotations} End Site {{ OFFSET 0 1 0 }} }} }}\nMOTION\nFrames: 2\nFrame Time: 0.5\n\
         0 0 0 0 1 0 0 0 0\n0 0 0 0 1.5 0 0 0 0\n"
    );
    fs::write(folder.join("take.bvh"), take).unwrap();
    fs::write(folder.join("bones.json"), r#"{"a": "a", "b": "b"}"#).unwrap();
    let run = line(
        folder,
        "retarget take.bvh --onto take.bvh --bones bones.json -o out.bvh",
    );
    assert!(
        run.words.contains("W910") && run.words.contains("0.5000"),
        "{}",
        run.words
    );
}
