//! Mirrored clips, against the mirror images of their poses in the world.

use tumble::glam::{DQuat, DVec3, Quat, Vec3};
use tumble::trees::BodyPose;
use tumble::{Channel, Device, Engine, SampleTimes};
use tumble_formats::learning::{
    Mirror, MirrorError, mirror_pairs, mirrored, mirrored_point, mirrored_rotation,
};
use tumble_formats::motion::{Joint, Motion, Scalar, ScalarKind, Transform};
use tumble_formats::robot::Robot;
use tumble_formats::sample::ChannelMethods;
use tumble_formats::world::{WorldPose, world};

const NAMES: [&str; 5] = ["hips", "left_hip", "left_foot", "right_hip", "right_foot"];
const PARENTS: [Option<usize>; 5] = [None, Some(0), Some(1), Some(0), Some(3)];
/// Where the joints are at rest: the x axis points from left to right.
const POSITIONS: [[f64; 3]; 5] = [
    [0.0, 1.0, 0.0],
    [-0.1, 0.9, 0.0],
    [-0.2, 0.0, 0.1],
    [0.1, 0.9, 0.0],
    [0.2, 0.0, 0.1],
];
const TIMES: [f64; 3] = [0.0, 0.5, 1.0];

/// A rotation that depends on a number.
fn rotation_of(number: usize) -> DQuat {
    let n = number as f64;
    let axis = DVec3::new((n * 1.7).sin(), (n * 2.3).cos(), (n * 0.9).sin() + 0.1);
    DQuat::from_axis_angle(axis.normalize(), (n * 0.77).sin())
}

/// A body whose joints have these rotations at rest, in the world; all joints turn, the hips and the left foot move.
fn body(rest: impl Fn(usize) -> DQuat) -> Motion {
    let mut clip = Motion::default();
    for (joint, parent) in PARENTS.into_iter().enumerate() {
        let (above, at) = parent.map_or((DQuat::IDENTITY, DVec3::ZERO), |parent| {
            (rest(parent), DVec3::from(POSITIONS[parent]))
        });
        let local = above.conjugate() * rest(joint);
        let offset = above.conjugate() * (DVec3::from(POSITIONS[joint]) - at);
        let keys: Vec<Quat> = (0..3)
            .map(|key| (local * rotation_of(7 * joint + key)).as_quat())
            .collect();
        clip.set.push(NAMES[joint], &TIMES, &keys).unwrap();
        if joint == 0 || joint == 2 {
            let moved = |key: usize| (offset + rotation_of(key + 40).xyz()).as_vec3();
            let moved: Vec<Vec3> = (0..3).map(moved).collect();
            clip.set
                .set_translations(joint, &TIMES, &moved, &[])
                .unwrap();
        }
        clip.skeleton.push(Joint {
            parent,
            rest: Transform {
                translation: offset.as_vec3(),
                rotation: local.as_quat(),
                ..Transform::default()
            },
        });
    }
    clip
}

fn poses(clip: &Motion) -> Vec<WorldPose> {
    let engine = Engine::new(Device::Cpu).unwrap();
    // Between the keys too.
    let times = SampleTimes::at(vec![0.0, 0.3, 0.5, 0.8, 1.0]);
    let samples = ChannelMethods::AUTHORED
        .sample(&engine, clip, &times)
        .unwrap();
    world(clip, &samples).unwrap()
}

const ACROSS_X: Mirror<'static> = Mirror {
    axis: 0,
    tree: None,
};

#[test]
fn joints_are_where_their_partners_were_in_the_mirror() {
    let rests: [fn(usize) -> DQuat; 2] = [|_| DQuat::IDENTITY, |joint| rotation_of(joint + 90)];
    for (index, rest) in rests.into_iter().enumerate() {
        let clip = body(rest);
        let (result, report) = mirrored(&clip, ACROSS_X).unwrap();
        assert_eq!(report.alone, ["hips"]);
        assert_eq!(
            report.pairs[1],
            ["left_foot", "right_foot"].map(str::to_owned)
        );
        assert!(report.asymmetry.unwrap().1 < 1e-6);
        let partners = mirror_pairs(&NAMES);
        let (before, after) = (poses(&clip), poses(&result));
        for (sample, found) in after.chunks_exact(5).enumerate() {
            for (joint, found) in found.iter().enumerate() {
                let partner = partners[joint];
                let other = before[5 * sample + partner];
                let position = mirrored_point(other.position, 0);
                assert!(
                    (found.position - position).length() < 1e-6,
                    "{joint} at {sample}: {found:?}, {position}"
                );
                let from_rest = other.rotation.as_dquat() * rest(partner).conjugate();
                let expected = mirrored_rotation(from_rest, 0) * rest(joint);
                let found = found.rotation.as_dquat().normalize();
                let along = found.dot(expected.normalize()).abs();
                assert!(along > 1.0 - 1e-12, "{joint} at {sample}: {along}");
            }
        }
        let (twice, _) = mirrored(&result, ACROSS_X).unwrap();
        for joint in 0..5 {
            let [one, two] = [&clip, &twice].map(|clip| clip.set.track(joint).keys.to_vec());
            let moved = |clip: &Motion| {
                let keys = clip.set.vector_keys(Channel::Translation, joint);
                keys.map(|keys| keys.keys.to_vec())
            };
            if index == 0 {
                let bits = |keys: &[Quat]| -> Vec<[u32; 4]> {
                    keys.iter()
                        .map(|q| q.to_array().map(f32::to_bits))
                        .collect()
                };
                assert_eq!(bits(&one), bits(&two));
            }
            let mut keys = one.iter().zip(&two);
            assert!(keys.all(|(one, two)| one.abs_diff_eq(*two, 2e-7)));
            match (moved(&clip), moved(&twice)) {
                (None, None) => {}
                (Some(one), Some(two)) => {
                    let mut keys = one.iter().zip(&two);
                    assert!(keys.all(|(one, two)| one.abs_diff_eq(*two, 3e-7)));
                }
                _ => panic!("{joint} has lost or got translations"),
            }
        }
    }
}

#[test]
fn sides_must_fit_and_others_are_reported() {
    let mut clip = body(|_| DQuat::IDENTITY);
    clip.skeleton[2].rest.translation.z += 0.2;
    let (_, report) = mirrored(&clip, ACROSS_X).unwrap();
    let (joint, apart) = report.asymmetry.unwrap();
    assert!(joint.ends_with("_foot") && apart > 0.15, "{joint} {apart}");
    clip.skeleton[2].parent = Some(0);
    let refused = mirrored(&clip, ACROSS_X).unwrap_err();
    assert!(matches!(refused, MirrorError::Parents { .. }), "{refused}");
    let said = "`left_foot` and `right_foot` are a pair by their names, but their parents `hips` and `right_hip` are none; ";
    assert!(refused.to_string().starts_with(said), "{refused}");
    // A joint on one side alone.
    let mut clip = body(|_| DQuat::IDENTITY);
    clip.set.set_name(2, "tail").unwrap();
    let refused = mirrored(&clip, ACROSS_X).unwrap_err().to_string();
    let said = "`tail` has no partner, but its parent `left_hip` is mirrored to `right_hip`; ";
    assert!(refused.starts_with(said), "{refused}");
}

/// Two legs; the axes of the right one point the other way, and a joint has a reference.
const ROBOT: &str = r#"<mujoco><compiler angle="radian"/><worldbody><body name="pelvis" pos="0 0 1"><freejoint name="root"/>
<body name="left_leg" pos="0 0.1 0"><joint name="left_roll" axis="1 0 0"/><joint name="left_pitch" axis="0 1 0" ref="0.2"/>
<body name="left_foot" pos="0.1 0 -0.5"><joint name="left_slide" type="slide" axis="0 1 0"/></body></body>
<body name="right_leg" pos="0 -0.1 0"><joint name="right_roll" axis="-1 0 0"/><joint name="right_pitch" axis="0 1 0" ref="0.1"/>
<body name="right_foot" pos="0.1 0 -0.5"><joint name="right_slide" type="slide" axis="0 1 0"/></body></body>
<body name="head" pos="0 0 0.4"><joint name="neck" axis="0 0 1"/></body></body></worldbody></mujoco>"#;

#[test]
fn bodies_of_robots_are_mirrored() {
    let robot = Robot::read("robot.xml", ROBOT.as_bytes().to_vec()).unwrap();
    let tree = &robot.tree;
    let mut clip = Motion::default();
    let root = rotation_of(3).as_quat();
    clip.set.push("root", &[0.0], &[root]).unwrap();
    let position = Vec3::new(0.3, 0.2, 0.9);
    clip.set
        .set_translations(0, &[0.0], &[position], &[])
        .unwrap();
    for (index, joint) in tree.scalar_joints().enumerate() {
        let number = 0.1 + 0.07 * index as f32;
        let kind = match joint.name.ends_with("slide") {
            true => ScalarKind::Length,
            false => ScalarKind::Angle,
        };
        clip.set
            .push_scalar(&joint.name, &[0.0], &[number], &[])
            .unwrap();
        clip.scalars.push(Scalar {
            kind,
            ..Scalar::default()
        });
    }
    clip.set
        .push_scalar("left_foot.contact", &[0.0], &[1.0], &[])
        .unwrap();
    clip.set
        .push_scalar("right_foot.contact", &[0.0], &[0.0], &[])
        .unwrap();
    for _ in 0..2 {
        clip.scalars.push(Scalar {
            kind: ScalarKind::Contact,
            ..Scalar::default()
        });
    }
    let mirror = Mirror {
        axis: 1,
        tree: Some(tree),
    };
    let (result, report) = mirrored(&clip, mirror).unwrap();
    assert_eq!(report.alone, ["root", "neck"]);
    assert!(report.asymmetry.unwrap().1 < 1e-12);
    let joints = tree.scalar_joints().count();
    let contact = |index: usize| result.set.scalar(joints + index).unwrap().keys[0];
    assert_eq!([contact(0), contact(1)], [0.0, 1.0]);
    let bodies = |clip: &Motion| {
        let mut configuration = tree.rest();
        let moved = clip.set.vector_keys(Channel::Translation, 0).unwrap();
        configuration.free[0] = BodyPose {
            position: moved.keys[0].as_dvec3(),
            rotation: clip.set.track(0).keys[0].as_dquat(),
        };
        let values = configuration.scalars.iter_mut().enumerate();
        values.for_each(|(index, value)| {
            *value = f64::from(clip.set.scalar(index).unwrap().keys[0]);
        });
        tree.poses(&configuration).unwrap()
    };
    let (before, after) = (bodies(&clip), bodies(&result));
    let names: Vec<&str> = tree.bodies().iter().map(|body| &*body.name).collect();
    let partners = mirror_pairs(&names);
    for (body, pose) in after.iter().enumerate() {
        let other = &before[partners[body]];
        let apart = (pose.position - mirrored_point(other.position, 1)).length();
        assert!(apart < 1e-6, "{} {apart}", names[body]);
        let expected = mirrored_rotation(other.rotation, 1);
        assert!(
            pose.rotation.dot(expected).abs() > 1.0 - 1e-12,
            "{}",
            names[body]
        );
    }
    let (twice, _) = mirrored(&result, mirror).unwrap();
    for index in 0..clip.set.scalar_count() {
        let [one, two] = [&clip, &twice].map(|clip| clip.set.scalar(index).unwrap().keys[0]);
        assert!((one - two).abs() < 1e-7);
    }
    let refused = mirrored(&clip, ACROSS_X).unwrap_err();
    assert!(matches!(refused, MirrorError::NoAxis { .. }), "{refused}");
    let skewed = ROBOT.replace(r#"right_roll" axis="-1 0 0"#, r#"right_roll" axis="1 0 1"#);
    let robot = Robot::read("robot.xml", skewed.into_bytes()).unwrap();
    let mirror = Mirror {
        axis: 1,
        tree: Some(&robot.tree),
    };
    let refused = mirrored(&clip, mirror).unwrap_err();
    assert!(matches!(refused, MirrorError::Axes { .. }), "{refused}");
}
