//! Motions on other skeletons.

use tumble::glam::{DQuat, DVec3, Quat, Vec3};
use tumble_formats::motion::{Joint, Motion, Transform};
use tumble_formats::retarget::{
    HipsScale, RestAlignment, RetargetError, RetargetOptions, Role, recognise, retarget,
};

use crate::support::shared_data;

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    match value {
        serde_json::Value::Array(list) => list.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

fn rotations(value: &serde_json::Value) -> Vec<DQuat> {
    let numbers = numbers(value);
    let four = numbers.as_chunks::<4>().0.iter();
    four.map(|&[w, x, y, z]| DQuat::from_xyzw(x, y, z, w))
        .collect()
}

fn points(value: &serde_json::Value) -> Vec<DVec3> {
    let numbers = numbers(value);
    numbers
        .as_chunks::<3>()
        .0
        .iter()
        .map(|&p| DVec3::from_array(p))
        .collect()
}

/// A skeleton whose joints have these keys, `[sample][joint]`.
fn clip(
    names: &[&str],
    parents: &[Option<usize>],
    rest: &[(DQuat, DVec3)],
    times: &[f64],
    keys: &[DQuat],
) -> Motion {
    let mut clip = Motion::default();
    for (joint, name) in names.iter().enumerate() {
        let of_joint: Vec<Quat> = keys
            .iter()
            .skip(joint)
            .step_by(names.len())
            .map(|q| q.as_quat())
            .collect();
        clip.set.push(*name, times, &of_joint).unwrap();
        let (rotation, translation) = (rest[joint].0.as_quat(), rest[joint].1.as_vec3());
        let rest = Transform {
            rotation,
            translation,
            scale: Vec3::ONE,
        };
        clip.skeleton.push(Joint {
            parent: parents[joint],
            rest,
        });
    }
    clip
}

/// Names and parents of Mixamo's skeleton, and where its joints are.
const MIXAMO: [(&str, Option<usize>, [f64; 3]); 22] = [
    ("mixamorig:Hips", None, [0.0, 100.0, 0.0]),
    ("mixamorig:Spine", Some(0), [0.0, 10.0, 0.0]),
    ("mixamorig:Spine1", Some(1), [0.0, 12.0, 0.0]),
    ("mixamorig:Spine2", Some(2), [0.0, 13.0, 0.0]),
    ("mixamorig:Neck", Some(3), [0.0, 15.0, 0.0]),
    ("mixamorig:Head", Some(4), [0.0, 10.0, 3.0]),
    ("mixamorig:LeftShoulder", Some(3), [6.0, 10.0, 0.0]),
    ("mixamorig:LeftArm", Some(6), [12.0, 0.0, 0.0]),
    ("mixamorig:LeftForeArm", Some(7), [27.0, 0.0, 0.0]),
    ("mixamorig:LeftHand", Some(8), [28.0, 0.0, 0.0]),
    ("mixamorig:RightShoulder", Some(3), [-6.0, 10.0, 0.0]),
    ("mixamorig:RightArm", Some(10), [-12.0, 0.0, 0.0]),
    ("mixamorig:RightForeArm", Some(11), [-27.0, 0.0, 0.0]),
    ("mixamorig:RightHand", Some(12), [-28.0, 0.0, 0.0]),
    ("mixamorig:LeftUpLeg", Some(0), [9.0, -5.0, 0.0]),
    ("mixamorig:LeftLeg", Some(14), [0.0, -44.0, 0.0]),
    ("mixamorig:LeftFoot", Some(15), [0.0, -44.0, -2.0]),
    ("mixamorig:LeftToeBase", Some(16), [0.0, -7.0, 14.0]),
    ("mixamorig:RightUpLeg", Some(0), [-9.0, -5.0, 0.0]),
    ("mixamorig:RightLeg", Some(18), [0.0, -44.0, 0.0]),
    ("mixamorig:RightFoot", Some(19), [0.0, -44.0, -2.0]),
    ("mixamorig:RightToeBase", Some(20), [0.0, -7.0, 14.0]),
];

fn mixamo(keys: impl Fn(usize, usize) -> DQuat, samples: usize) -> Motion {
    let names = MIXAMO.map(|(name, ..)| name);
    let parents = MIXAMO.map(|(_, parent, _)| parent);
    let rest = MIXAMO.map(|(.., offset)| (DQuat::IDENTITY, DVec3::from_array(offset)));
    let keys: Vec<DQuat> = (0..samples)
        .flat_map(|k| (0..22).map(move |j| (k, j)))
        .map(|(k, j)| keys(k, j))
        .collect();
    let times: Vec<f64> = (0..samples).map(|k| k as f64 / 30.0).collect();
    clip(&names, &parents, &rest, &times, &keys)
}

fn bent(k: usize, j: usize) -> DQuat {
    let angle = 0.4 * (0.3 * k as f64 + j as f64).sin();
    DQuat::from_axis_angle(DVec3::new(1.0, 0.3 * j as f64, -0.5).normalize(), angle)
}

#[test]
fn rotations_are_those_of_the_formulas() {
    let Some(folder) = shared_data() else { return };
    let text = std::fs::read_to_string(folder.join("robots/retarget/transfer.json")).unwrap();
    let data: serde_json::Value = serde_json::from_str(&text).unwrap();
    let texts = |value: &serde_json::Value| -> Vec<String> {
        value
            .as_array()
            .unwrap()
            .iter()
            .map(|it| it.as_str().unwrap().to_owned())
            .collect()
    };
    let parents = |value: &serde_json::Value| -> Vec<Option<usize>> {
        numbers(value)
            .iter()
            .map(|&it| (it >= 0.0).then_some(it as usize))
            .collect()
    };
    let (source, target) = (&data["source"], &data["target"]);
    let keys = rotations(&source["local_wxyz"]);
    let names = texts(&source["names"]);
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let count = keys.len() / names.len();
    let times: Vec<f64> = (0..count).map(|k| k as f64 / 30.0).collect();
    let rest: Vec<_> = rotations(&source["rest"])
        .into_iter()
        .zip(points(&source["offsets"]))
        .collect();
    let mut from = clip(&names, &parents(&source["parents"]), &rest, &times, &keys);
    from.set_positions(0, &times, &points(&source["root"]))
        .unwrap();
    let names = texts(&target["names"]);
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let rest_rotations = rotations(&target["rest_local_wxyz"]);
    let rest: Vec<_> = rest_rotations
        .iter()
        .copied()
        .zip(points(&target["rest_positions"]))
        .collect();
    let to = clip(
        &names,
        &parents(&target["parents"]),
        &rest,
        &[0.0],
        &rest_rotations,
    );
    let bones = data["map"].as_object().unwrap().iter();
    let bones: Vec<_> = bones
        .map(|(to, from)| (to.clone(), from.as_str().unwrap().to_owned()))
        .collect();
    for (name, rest) in [
        ("fixed", RestAlignment::Directions),
        ("plain", RestAlignment::Same),
        ("fixed", RestAlignment::Auto),
    ] {
        let expected = &data["result"][name];
        let options = RetargetOptions {
            bones: bones.clone(),
            rest,
            scale: HipsScale::Factor(expected["scale"].as_f64().unwrap()),
            axes: Some(rotations(&data["axes_wxyz"])[0]),
            ..RetargetOptions::default()
        };
        let (found, report) = retarget(&from, &to, &options).unwrap();
        let local = rotations(&expected["local_wxyz"]);
        for (joint, track) in found.set.tracks().enumerate() {
            assert_eq!((track.times, track.name), (&times[..], Some(names[joint])));
            for (sample, key) in track.keys.iter().enumerate() {
                let expected = local[sample * names.len() + joint];
                assert!(
                    key.as_dquat().dot(expected).abs() > 1.0 - 1e-7,
                    "{name} {joint} {sample}"
                );
                let distance = (key.as_dquat() - expected)
                    .length()
                    .min((key.as_dquat() + expected).length());
                assert!(distance < 1e-6, "{name} {joint} {sample}: {distance}");
            }
        }
        let root = found
            .set
            .vector_keys(tumble::Channel::Translation, 0)
            .unwrap();
        for (key, expected) in root.keys.iter().zip(points(&expected["root"])) {
            assert!((key.as_dvec3() + found.origin(0) - expected).length() < 1e-6);
        }
        assert_eq!(report.dropped, ["Spine2"]);
        assert_eq!(report.aligned.is_empty(), rest == RestAlignment::Same);
    }
}

#[test]
fn a_motion_on_its_skeleton_stays_as_it_is() {
    let mut source = mixamo(bent, 12);
    let times: Vec<f64> = source.set.track(0).times.to_vec();
    let moved: Vec<DVec3> = (0..12)
        .map(|k| DVec3::new(f64::from(k), 100.0, 0.5 * f64::from(k)))
        .collect();
    source.set_positions(0, &times, &moved).unwrap();
    let (found, report) = retarget(&source, &source, &RetargetOptions::default()).unwrap();
    for (found, expected) in found.set.tracks().zip(source.set.tracks()) {
        assert_eq!(found.times, expected.times);
        for (found, expected) in found.keys.iter().zip(expected.keys) {
            assert!((found.as_dquat().dot(expected.as_dquat()).abs() - 1.0).abs() < 1e-7);
            assert!(
                (*found - *expected)
                    .length()
                    .min((*found + *expected).length())
                    < 2e-7
            );
        }
    }
    assert_eq!(
        (report.scale, report.pairs.len(), report.dropped.len()),
        (1.0, 22, 0)
    );
    assert!(report.aligned.is_empty() && !report.are_axes_assumed);
    assert_eq!(report.axes.w, 1.0);
}

/// Joints that are no parts of a body are paired by name below partners; the others are named.
#[test]
fn joints_of_one_name_follow_and_lost_rotations_are_said() {
    let with = |extra: &[(&str, usize)]| {
        let mut names = MIXAMO.map(|(name, ..)| name).to_vec();
        let mut parents = MIXAMO.map(|(_, parent, _)| parent).to_vec();
        let mut rest = MIXAMO
            .map(|(.., at)| (DQuat::IDENTITY, DVec3::from_array(at)))
            .to_vec();
        for &(name, parent) in extra {
            names.push(name);
            parents.push(Some(parent));
            rest.push((DQuat::IDENTITY, DVec3::Y));
        }
        let keys: Vec<DQuat> = (0..2 * names.len())
            .map(|index| bent(index / names.len(), index % names.len()))
            .collect();
        clip(&names, &parents, &rest, &[0.0, 1.0], &keys)
    };
    // An ear below the head, a ring below the ear, and a tail that only the source has.
    let source = with(&[("ear", 5), ("ring", 22), ("tail", 0)]);
    let target = with(&[("ear", 5), ("ring", 22)]);
    let (found, report) = retarget(&source, &target, &RetargetOptions::default()).unwrap();
    for name in ["ear", "ring"] {
        assert!(
            report.pairs.contains(&(name.to_owned(), name.to_owned())),
            "{name}"
        );
    }
    for joint in 0..24 {
        let [a, b] = [&found, &source].map(|clip| clip.set.track(joint).keys[1].as_dquat());
        assert!((a.dot(b).abs() - 1.0).abs() < 1e-7, "{joint}");
    }
    assert_eq!(report.dropped, ["tail"]);
    let (joint, degrees) = report.furthest_dropped.unwrap();
    let expected = [0, 1].map(|k| 2.0 * bent(k, 24).w.abs().min(1.0).acos().to_degrees());
    assert_eq!(joint, "tail");
    assert!(
        (degrees - expected[0].max(expected[1])).abs() < 1e-4,
        "{degrees} {expected:?}"
    );
    // An ear below another joint is another ear.
    let other = with(&[("ear", 13)]);
    let (_, report) = retarget(&source, &other, &RetargetOptions::default()).unwrap();
    assert_eq!(report.resting, ["ear"]);
}

#[test]
fn a_smaller_skeleton_with_z_up_walks_as_far_as_its_legs_are_long() {
    let source = mixamo(bent, 3);
    // Half as tall, in metres, z up.
    let to_z = DQuat::from_xyzw(0.5f64.sqrt(), 0.0, 0.0, 0.5f64.sqrt());
    let names = [
        "pelvis",
        "spine1",
        "spine2",
        "spine3",
        "neck",
        "head",
        "left_collar",
        "left_shoulder",
        "left_elbow",
        "left_wrist",
        "right_collar",
        "right_shoulder",
        "right_elbow",
        "right_wrist",
        "left_hip",
        "left_knee",
        "left_ankle",
        "left_foot",
        "right_hip",
        "right_knee",
        "right_ankle",
        "right_foot",
    ];
    let parents = MIXAMO.map(|(_, parent, _)| parent);
    let rest =
        MIXAMO.map(|(.., offset)| (DQuat::IDENTITY, to_z * DVec3::from_array(offset) / 200.0));
    let target = clip(&names, &parents, &rest, &[0.0], &[DQuat::IDENTITY; 22]);
    let (found, report) = retarget(&source, &target, &RetargetOptions::default()).unwrap();
    assert!((report.scale - 1.0 / 200.0).abs() < 1e-9);
    assert!((report.axes.dot(to_z).abs() - 1.0).abs() < 1e-12);
    for (joint, track) in found.set.tracks().enumerate() {
        for (k, key) in track.keys.iter().enumerate() {
            let expected = to_z * bent(k, joint) * to_z.inverse();
            let key = key.as_dquat();
            assert!((key - expected).length().min((key + expected).length()) < 2e-7);
        }
    }
    let by_legs = RetargetOptions {
        scale: HipsScale::Legs,
        ..RetargetOptions::default()
    };
    assert!((retarget(&source, &target, &by_legs).unwrap().1.scale - 1.0 / 200.0).abs() < 1e-9);
}

#[test]
fn skeletons_are_recognised_by_names_and_places() {
    if let Some(folder) = shared_data() {
        let text = std::fs::read_to_string(folder.join("robots/retarget/names.json")).unwrap();
        let data: serde_json::Value = serde_json::from_str(&text).unwrap();
        let parents = MIXAMO.map(|(_, parent, _)| parent);
        for (kind, names) in data["names"].as_object().unwrap() {
            let names: Vec<String> = Role::ALL
                .iter()
                .map(|role| names[role.name()].as_str().unwrap().to_owned())
                .collect();
            let roles = recognise(&names, &parents).unwrap();
            assert_eq!(roles.kind.to_lowercase(), *kind);
            assert_eq!(roles.joints, std::array::from_fn(Some));
        }
    }
    let names = MIXAMO.map(|(name, ..)| name.to_owned());
    let parents = MIXAMO.map(|(_, parent, _)| parent);
    let mut displaced = parents;
    // The hand hangs on the other arm.
    displaced[9] = Some(12);
    assert_eq!(recognise(&names, &displaced), Err(vec!["leftHand"]));
    let other = clip(
        &["a"],
        &[None],
        &[(DQuat::IDENTITY, DVec3::ZERO)],
        &[0.0],
        &[DQuat::IDENTITY],
    );
    let error = retarget(&mixamo(bent, 2), &other, &RetargetOptions::default()).unwrap_err();
    assert!(error.to_string().starts_with(
        "the joints of the target are not those of a known human skeleton: no joint has a known name for hips, "
    ));
    let error = retarget(&Motion::default(), &other, &RetargetOptions::default()).unwrap_err();
    assert!(matches!(
        error,
        RetargetError::NoSkeleton { which: "source" }
    ));
    let bones = vec![("a".to_owned(), "mixamorig:Hip".to_owned())];
    let unknown = RetargetOptions {
        bones,
        ..RetargetOptions::default()
    };
    let error = retarget(&mixamo(bent, 2), &other, &unknown).unwrap_err();
    assert_eq!(
        error.to_string(),
        "bones: the source has no joint `mixamorig:Hip`, or it is paired twice"
    );
}
