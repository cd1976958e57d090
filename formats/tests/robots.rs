//! Robots: against `MuJoCo` and pinocchio, and their scalars against `SciPy`, where the sample files are there, and files that are refused.

use std::fs;
use std::io::Read;
use std::path::Path;
use std::time::{Duration, Instant};

use proptest::prelude::*;
use tumble::crowd::{BodyStates, BodyTables, KeyPrecision, MotionBuilder};
use tumble::glam::{DQuat, DVec3};
use tumble::trees::{
    BodyMotion, BodyOrder, BodyPose, BodyVelocity, Configuration, ConfigurationRates, JointKind,
    Siblings, Tree,
};
use tumble::{Device, Ends, Engine, Interpolation, Layout, SampleTimes, ScalarQuantity, TrackSet};
use tumble::{VectorMethod, method};
use tumble_formats::motion::Motion;
use tumble_formats::npy::read_numbers;
use tumble_formats::robot::{Robot, RobotFormat, RobotTracks};
use tumble_formats::{Code, Diagnostic, Location};

use crate::support::shared_data;

/// The arrays of a file by NumPy.
struct Arrays(zip::ZipArchive<fs::File>);

impl Arrays {
    fn open(name: &str) -> Option<Self> {
        let path = shared_data()?.join("robots/fk").join(name);
        Some(Self(
            zip::ZipArchive::new(fs::File::open(path).unwrap()).unwrap(),
        ))
    }

    fn bytes(&mut self, name: &str) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut member = self.0.by_name(&format!("{name}.npy")).unwrap();
        member.read_to_end(&mut bytes).unwrap();
        bytes
    }

    /// The rows of an array.
    fn rows(&mut self, name: &str) -> Vec<Vec<f64>> {
        let array = read_numbers(name, &self.bytes(name), |_| Ok(())).unwrap();
        let width = array.shape[1..].iter().product::<usize>().max(1);
        array.values.chunks(width).map(<[f64]>::to_vec).collect()
    }

    fn indices(&mut self, name: &str) -> Vec<usize> {
        let bytes = self.bytes(name);
        let numbers = npyz::NpyFile::new(&bytes[..]).unwrap().into_vec::<i64>();
        numbers.unwrap().into_iter().map(|i| i as usize).collect()
    }
}

fn robot(name: &str) -> Robot {
    Robot::open(&shared_data().unwrap().join("robots/robots").join(name)).unwrap()
}

fn quaternion(q: &[f64]) -> DQuat {
    DQuat::from_xyzw(q[1], q[2], q[3], q[0])
}

/// The joints at the numbers of `MuJoCo`'s `qpos` and `qvel`.
fn at_qpos(tree: &Tree, mut q: &[f64], mut v: &[f64]) -> (Configuration, ConfigurationRates) {
    let (mut configuration, mut rates) = (tree.rest(), tree.no_rates());
    let (mut free, mut balls, mut scalars) = (0, 0, 0);
    for joint in tree.joints() {
        let (values, of_rates) = match joint.kind {
            JointKind::Free => {
                let rotation = quaternion(&q[3..]);
                configuration.free[free] = BodyPose {
                    position: DVec3::from_slice(q),
                    rotation,
                };
                // MuJoCo's are in the body's axes.
                rates.free[free] = BodyVelocity {
                    linear: DVec3::from_slice(v),
                    angular: rotation.normalize() * DVec3::from_slice(&v[3..]),
                };
                free += 1;
                (7, 6)
            }
            JointKind::Ball => {
                configuration.balls[balls] = quaternion(q);
                rates.balls[balls] = DVec3::from_slice(v);
                balls += 1;
                (4, 3)
            }
            JointKind::Hinge | JointKind::Slide => {
                configuration.scalars[scalars] = q[0];
                rates.scalars[scalars] = v[0];
                scalars += 1;
                (1, 1)
            }
        };
        (q, v) = (&q[values..], &v[of_rates..]);
    }
    (configuration, rates)
}

/// The joints of a robot without a free joint at the numbers of a file.
fn at_base(tree: &Tree, arrays: &mut Arrays) -> Vec<(Configuration, ConfigurationRates)> {
    let [
        positions,
        rates,
        root_positions,
        root_rotations,
        linear,
        angular,
    ] = [
        "joint_pos",
        "joint_vel",
        "root_pos",
        "root_quat",
        "root_lin_vel",
        "root_ang_vel",
    ]
    .map(|name| arrays.rows(name));
    let at = |row: usize| {
        let configuration = Configuration {
            base: BodyPose {
                position: DVec3::from_slice(&root_positions[row]),
                rotation: quaternion(&root_rotations[row]),
            },
            scalars: positions[row].clone(),
            ..tree.rest()
        };
        let of_base = BodyVelocity {
            linear: DVec3::from_slice(&linear[row]),
            angular: DVec3::from_slice(&angular[row]),
        };
        let rates = ConfigurationRates {
            base: of_base,
            scalars: rates[row].clone(),
            ..tree.no_rates()
        };
        (configuration, rates)
    };
    (0..positions.len()).map(at).collect()
}

/// An eighth of a second, in whose middle the joints have these values and rates.
fn clip_around(tree: &Tree, at: &Configuration, rates: &ConfigurationRates) -> Motion {
    const HALF: f64 = 1.0 / 16.0;
    let (mut motion, times) = (Motion::default(), [0.0, 2.0 * HALF]);
    let ends = |rate: DVec3| [-HALF * rate, HALF * rate];
    let rotated = |rotation: DQuat, spin: DVec3| {
        ends(spin).map(|angle| (DQuat::from_scaled_axis(angle) * rotation).as_quat())
    };
    let moved = |set: &mut TrackSet, name: &str, pose: BodyPose, rate: BodyVelocity| {
        let keys = rotated(pose.rotation.normalize(), rate.angular);
        let track = set.track_count();
        set.push(name, &times, &keys).unwrap();
        let points = ends(rate.linear).map(|step| (pose.position + step).as_vec3());
        set.set_translations(track, &times, &points, &[]).unwrap();
    };
    if at.free.is_empty() {
        moved(&mut motion.set, &tree.bodies()[0].name, at.base, rates.base);
    }
    let (mut free, mut ball, mut scalar) = (0, 0, 0);
    for joint in tree.joints() {
        let set = &mut motion.set;
        match joint.kind {
            JointKind::Free => {
                moved(set, &joint.name, at.free[free], rates.free[free]);
                free += 1;
            }
            JointKind::Ball => {
                let rotation = at.balls[ball].normalize();
                let keys = rotated(rotation, rotation * rates.balls[ball]);
                set.push(&*joint.name, &times, &keys).unwrap();
                ball += 1;
            }
            JointKind::Hinge | JointKind::Slide if joint.mimic.is_none() => {
                let (value, rate) = (at.scalars[scalar], rates.scalars[scalar]);
                let keys = [-HALF, HALF].map(|time| (value + time * rate) as f32);
                set.push_scalar(&joint.name, &times, &keys, &[]).unwrap();
                scalar += 1;
            }
            JointKind::Hinge | JointKind::Slide => {}
        }
    }
    motion
}

/// The bodies that a library in f32 has of these configurations, beside those of a file: the largest errors of positions
/// and of rotations (rad), and those of velocities relative to the largest velocity.
fn errors_of_library(
    tree: &Tree,
    configurations: &[(Configuration, ConfigurationRates)],
    all: &[Vec<Vec<f64>>; 4],
) -> [f64; 4] {
    let clip = |(at, rates): &(Configuration, ConfigurationRates)| clip_around(tree, at, rates);
    let clips: Vec<Motion> = configurations.iter().map(clip).collect();
    let tracks = RobotTracks::new(tree, &clips);
    let order: Vec<usize> = (0..tree.bodies().len()).collect();
    let frames = tracks.frames(&order, &[]).unwrap().with_w_first();
    let ticks = 1 << 20;
    let precision = KeyPrecision::Exact;
    let mut builder = MotionBuilder::new(&tracks.skeleton().unwrap(), ticks, precision).unwrap();
    for clip in &clips {
        let set = tracks.set(clip).unwrap();
        builder
            .push(&set, method::SLERP, VectorMethod::Linear)
            .unwrap();
    }
    let (tables, spans, cells) = builder.finish();
    let tables = BodyTables::new(tables, frames).unwrap();
    let at: Vec<(u32, u32)> = (0..clips.len())
        .map(|clip| (clip as u32, ticks / 16))
        .collect();
    let count = clips.len() * order.len();
    let mut vectors = [(); 3].map(|()| vec![[0f32; 3]; count]);
    let mut rotations = vec![[0f32; 4]; count];
    let [positions, velocities, angular_velocities] = &mut vectors;
    let states = BodyStates {
        positions,
        rotations: &mut rotations,
        velocities,
        angular_velocities,
        ..BodyStates::default()
    };
    let engine = Engine::new(Device::Cpu).unwrap();
    let parts = (&spans[..], &cells[..]);
    tables
        .sample_into(&engine, parts, &at, None, states)
        .unwrap();
    let of_file = |rows: &[Vec<f64>]| rows.concat();
    let apart = |found: &[[f32; 3]], rows: &[Vec<f64>]| {
        let pairs = found.iter().zip(of_file(rows).as_chunks::<3>().0.to_vec());
        let distance = |(found, expected): (&[f32; 3], [f64; 3])| {
            DVec3::from_array(found.map(f64::from)).distance(DVec3::from_array(expected))
        };
        pairs.map(distance).fold(0.0, f64::max)
    };
    let largest = |rows: &[Vec<f64>]| of_file(rows).iter().fold(0f64, |a, b| a.max(b.abs()));
    let pairs = rotations
        .iter()
        .zip(of_file(&all[1]).as_chunks::<4>().0.to_vec());
    let angles = pairs.map(|(found, expected)| {
        let [found, expected] = [found.map(f64::from), expected].map(|q| quaternion(&q));
        2.0 * (found - expected).length().min((found + expected).length())
    });
    [
        apart(&vectors[0], &all[0]),
        angles.fold(0.0, f64::max),
        apart(&vectors[1], &all[2]) / largest(&all[2]),
        apart(&vectors[2], &all[3]) / largest(&all[3]),
    ]
}

/// The bound that `docs/robots.md` states.
#[test]
fn bodies_of_libraries_are_those_of_mujoco_and_pinocchio() {
    for (file, expected) in [
        ("tangle.xml", "tangle.npz"),
        ("pico.xml", "pico.npz"),
        ("claw.urdf", "claw_urdf.npz"),
    ] {
        let Some(mut arrays) = Arrays::open(expected) else {
            return;
        };
        let tree = robot(file).tree;
        let configurations: Vec<_> = match tree.counts().free {
            0 => at_base(&tree, &mut arrays),
            _ => {
                let (qpos, qvel) = (arrays.rows("qpos"), arrays.rows("qvel"));
                let at = |(q, v): (&Vec<f64>, &Vec<f64>)| at_qpos(&tree, q, v);
                qpos.iter().zip(&qvel).map(at).collect()
            }
        };
        let errors = errors_of_library(&tree, &configurations, &bodies(&mut arrays));
        println!("{file}: {errors:?}");
        let bounds = [1e-6, 2e-6, 1e-5, 1e-5];
        let is_within = errors
            .iter()
            .zip(bounds)
            .all(|(&error, bound)| error < bound);
        assert!(is_within, "{file}: {errors:?}");
    }
}

/// The largest differences of positions and velocities, and of rotations.
fn differences(motions: &[BodyMotion], row: usize, arrays: &[Vec<Vec<f64>>; 4]) -> [f64; 2] {
    let [positions, rotations, linear, angular] = arrays.each_ref().map(|rows| &rows[row]);
    let (mut of_vectors, mut of_rotations) = (0f64, 0f64);
    for (i, motion) in motions.iter().enumerate() {
        let three = |list: &[f64]| DVec3::from_slice(&list[3 * i..]);
        of_vectors = of_vectors
            .max((motion.pose.position - three(positions)).length())
            .max((motion.velocity.linear - three(linear)).length())
            .max((motion.velocity.angular - three(angular)).length());
        let expected = quaternion(&rotations[4 * i..]);
        let found = motion.pose.rotation;
        let distance = (found - expected).length().min((found + expected).length());
        of_rotations = of_rotations.max(distance);
    }
    [of_vectors, of_rotations]
}

fn bodies(arrays: &mut Arrays) -> [Vec<Vec<f64>>; 4] {
    [
        "body_pos_w",
        "body_quat_w",
        "body_lin_vel_w",
        "body_ang_vel_w",
    ]
    .map(|name| arrays.rows(name))
}

fn check_orders(tree: &Tree, arrays: &mut Arrays) {
    let orders = [
        ("order_depth_first", BodyOrder::DepthFirst, Siblings::File),
        (
            "order_breadth_first",
            BodyOrder::BreadthFirst,
            Siblings::File,
        ),
        (
            "order_depth_first_by_name",
            BodyOrder::DepthFirst,
            Siblings::BodyName,
        ),
        (
            "order_breadth_first_by_name",
            BodyOrder::BreadthFirst,
            Siblings::BodyName,
        ),
    ];
    for (name, order, siblings) in orders {
        assert_eq!(tree.order(order, siblings), arrays.indices(name), "{name}");
    }
}

#[test]
fn bodies_of_mjcf_are_where_mujoco_has_them() {
    for (file, expected) in [("tangle.xml", "tangle.npz"), ("pico.xml", "pico.npz")] {
        let Some(mut arrays) = Arrays::open(expected) else {
            return;
        };
        let robot = robot(file);
        assert_eq!(robot.format, RobotFormat::Mjcf);
        let tree = &robot.tree;
        let (qpos, qvel) = (arrays.rows("qpos"), arrays.rows("qvel"));
        let all = bodies(&mut arrays);
        let of_masses = arrays.rows("body_com_lin_vel_w");
        let mut largest = [0f64; 3];
        for (row, (q, v)) in qpos.iter().zip(&qvel).enumerate() {
            let (configuration, rates) = at_qpos(tree, q, v);
            let motions = tree.motions(&configuration, &rates).unwrap();
            let [vectors, rotations] = differences(&motions, row, &all);
            largest[0] = largest[0].max(vectors);
            largest[1] = largest[1].max(rotations);
            for (i, (motion, body)) in motions.iter().zip(tree.bodies()).enumerate() {
                let Some(centre) = body.mass_centre else {
                    continue;
                };
                let expected = DVec3::from_slice(&of_masses[row][3 * i..]);
                largest[2] = largest[2].max(motion.velocity_at(centre).distance(expected));
            }
        }
        println!("{file}: {largest:?}");
        assert!(
            largest.iter().all(|&error| error < 1e-12),
            "{file}: {largest:?}"
        );
        check_orders(tree, &mut arrays);
        // The first row is the rest position of the robot's file: all joints are at their reference values.
        let rest = at_qpos(tree, &qpos[0], &qvel[0]).0;
        assert_eq!(rest.scalars, tree.rest().scalars);
        for (joint, range) in tree.joints().zip(arrays.rows("joint_ranges")) {
            let expected = range.iter().all(|limit| limit.is_finite()).then_some(range);
            let found = joint.limits.map(|limits| limits.to_vec());
            let near = match (&found, &expected) {
                (Some(found), Some(expected)) => found
                    .iter()
                    .zip(expected)
                    .all(|(a, b)| (a - b).abs() < 1e-12),
                (found, expected) => found.is_none() && expected.is_none(),
            };
            assert!(near, "{}: {found:?}, {expected:?}", joint.name);
        }
    }
}

#[test]
fn bodies_of_urdf_are_where_pinocchio_has_them() {
    for (file, expected) in [
        ("claw.urdf", "claw_urdf.npz"),
        ("pico.urdf", "pico_urdf.npz"),
    ] {
        let Some(mut arrays) = Arrays::open(expected) else {
            return;
        };
        let robot = robot(file);
        assert_eq!(robot.format, RobotFormat::Urdf);
        let tree = &robot.tree;
        let all = bodies(&mut arrays);
        let mut largest = [0f64; 2];
        for (row, (configuration, rates)) in at_base(tree, &mut arrays).iter().enumerate() {
            let motions = tree.motions(configuration, rates).unwrap();
            let [vectors, rotations] = differences(&motions, row, &all);
            largest = [largest[0].max(vectors), largest[1].max(rotations)];
        }
        println!("{file}: {largest:?}");
        assert!(
            largest.iter().all(|&error| error < 1e-12),
            "{file}: {largest:?}"
        );
        check_orders(tree, &mut arrays);
    }
}

#[test]
fn a_robot_is_the_same_in_mjcf_and_in_urdf() {
    if shared_data().is_none() {
        return;
    }
    let (mjcf, urdf) = (robot("pico.xml").tree, robot("pico.urdf").tree);
    let names = |tree: &Tree| -> Vec<String> {
        tree.scalar_joints()
            .map(|joint| joint.name.clone())
            .collect()
    };
    assert_eq!(names(&mjcf), names(&urdf));
    let scalars: Vec<f64> = (0..mjcf.counts().scalars)
        .map(|i| 0.1 * i as f64 - 0.5)
        .collect();
    let of_mjcf = Configuration {
        scalars: scalars.clone(),
        ..mjcf.rest()
    };
    let of_urdf = Configuration {
        base: of_mjcf.free[0],
        scalars,
        ..urdf.rest()
    };
    let (a, b) = (mjcf.poses(&of_mjcf).unwrap(), urdf.poses(&of_urdf).unwrap());
    for (a, b) in a.iter().zip(&b) {
        assert!(a.position.distance(b.position) < 1e-14);
        assert!((a.rotation - b.rotation).length() < 1e-14);
    }
}

#[test]
fn scalars_are_those_of_scipy() {
    let Some(data) = shared_data() else { return };
    let text = fs::read_to_string(data.join("robots/scalars/curves.json")).unwrap();
    let data: serde_json::Value = serde_json::from_str(&text).unwrap();
    let list = |value: &serde_json::Value| -> Vec<f64> {
        value
            .as_array()
            .unwrap()
            .iter()
            .map(|x| x.as_f64().unwrap())
            .collect()
    };
    let keys: Vec<f32> = list(&data["keys"]).iter().map(|&key| key as f32).collect();
    let tangents = data["tangents"].as_array().unwrap().iter().map(|both| {
        let both = list(both);
        [both[0] as f32, both[1] as f32]
    });
    let (times, tangents) = (list(&data["times"]), tangents.collect::<Vec<_>>());
    let mut set = TrackSet::new();
    set.push_scalar("", &times, &keys, &tangents).unwrap();
    let frames = SampleTimes::at(list(&data["at"]));
    let engine = Engine::new(Device::Cpu).unwrap();
    let curves = data["curves"].as_object().unwrap();
    assert_eq!(curves.len(), 11);
    for (name, curve) in curves {
        let (how, ends) = name.split_once('/').unwrap_or((name, "parabolic"));
        let how = if how == "hermite" { "gltf-cubic" } else { how };
        let interpolation = Interpolation::from(method::SLERP).with_ends(match ends {
            "natural" => Ends::Natural,
            "clamped" => Ends::Clamped {
                start: DVec3::ZERO,
                end: DVec3::ZERO,
            },
            "secant" => Ends::Secant,
            _ => Ends::Parabolic,
        });
        let how: VectorMethod = how.parse().unwrap();
        for (quantity, list_name) in
            ScalarQuantity::ALL
                .into_iter()
                .zip(["values", "velocities", "accelerations"])
        {
            let right = list(&curve[list_name]);
            let layout = Layout::TrackMajor;
            let found = engine
                .scalars(&set, quantity, how, interpolation, &frames, layout)
                .unwrap();
            let largest = right.iter().fold(1e-9, |all: f64, x| all.max(x.abs()));
            for (value, right) in found.as_slice().iter().zip(right) {
                let bound = 2e-7 * largest;
                assert!(
                    (f64::from(*value) - right).abs() <= bound,
                    "{name} {quantity}: {value}, {right}"
                );
            }
        }
    }
}

/// Reads a robot whose file has this text, beside other files.
fn read(text: &str, others: &[(&str, &str)]) -> Result<Robot, Diagnostic> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in others {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let path = folder.path().join("robot.xml");
    fs::write(&path, text).unwrap();
    Robot::open(&path)
}

#[test]
fn names_poses_and_couplings_are_read() {
    let text = r#"<mujoco model="one"><worldbody>
      <body pos="0 0 1"><freejoint/><body name="arm"><joint/><joint name="b" type="ball"/></body></body>
      </worldbody><equality><joint joint1="joint1" joint2="b"/></equality>
      <keyframe><key name="home" qpos="1 2 3 1 0 0 0 0.5 0 1 0 0"/><key/></keyframe></mujoco>"#;
    let robot = read(text, &[]).unwrap();
    let names: Vec<&str> = robot.tree.bodies().iter().map(|body| &*body.name).collect();
    assert_eq!(names, ["body0", "arm"]);
    let names: Vec<&str> = robot.tree.joints().map(|joint| &*joint.name).collect();
    assert_eq!(names, ["body0", "joint1", "b"]);
    assert_eq!((robot.name.as_str(), robot.couplings), ("one", 1));
    let [(home, pose), (unnamed, rest)] = &robot.poses[..] else {
        panic!()
    };
    assert_eq!((home.as_str(), unnamed.as_str()), ("home", "key1"));
    assert_eq!(pose.free[0].position, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(
        (pose.scalars[0], pose.balls[0]),
        (0.5, DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0))
    );
    assert_eq!(*rest, robot.tree.rest());
    assert_eq!(rest.free[0].position, DVec3::Z);
}

#[test]
fn bodies_that_mujoco_merges_are_named() {
    let text = "<mujoco>\n<compiler fusestatic='true'/><worldbody><body/></worldbody></mujoco>";
    let warnings = read(text, &[]).unwrap().warnings;
    assert_eq!(warnings[0].code, Code::RobotMerged);
    assert_eq!(warnings.len(), 1);
}

#[test]
fn files_that_are_no_robots_are_refused_where_they_are_wrong() {
    let body = |inner: &str| {
        format!("<mujoco><worldbody>\n<body name='a'>{inner}</body></worldbody></mujoco>")
    };
    let urdf = |inner: &str| format!("<robot name='r'>\n{inner}</robot>");
    let joint = |kind: &str, parent: &str, child: &str| {
        format!(
            "<joint name='{kind}{child}' type='{kind}'><parent link='{parent}'/><child link='{child}'/></joint>"
        )
    };
    let links = "<link name='a'/><link name='b'/>";
    let cases = [
        ("<mujoco>".to_owned(), Code::RobotXml, 1, ""),
        (
            "<!DOCTYPE x [<!ENTITY a 'b'>]><mujoco/>".to_owned(),
            Code::RobotXml,
            1,
            "",
        ),
        ("<scene/>".to_owned(), Code::OtherFormat, 1, "<scene>"),
        ("<mujoco/>".to_owned(), Code::RobotTree, 1, "no <body>"),
        (
            body("<joint axis='0 0 0'/>"),
            Code::RobotTree,
            2,
            "no direction",
        ),
        (body("<joint axis='0 one 0'/>"), Code::Number, 2, "`one`"),
        (
            body("<joint axis='0 1'/>"),
            Code::RobotTree,
            2,
            "has 2 numbers, and takes 3",
        ),
        (body("<joint type='screw'/>"), Code::RobotTree, 2, "`screw`"),
        (body("<joint class='legs'/>"), Code::RobotTree, 2, "`legs`"),
        (
            body("<joint name='j'/><joint name='j'/>"),
            Code::RobotTree,
            1,
            "`j`",
        ),
        (body("<freejoint/><joint/>"), Code::RobotTree, 1, "alone"),
        (
            body("<body><freejoint/></body>"),
            Code::RobotTree,
            2,
            "in another body",
        ),
        (
            body("<body quat='0 0 0 0'/>"),
            Code::RobotTree,
            2,
            "no rotation",
        ),
        (
            body("<body quat='1 0 0 0' euler='0 0 0'/>"),
            Code::RobotTree,
            2,
            "both",
        ),
        (body("<body mocap='true'/>"), Code::RobotElement, 2, "mocap"),
        (
            body("<replicate count='9'/>"),
            Code::RobotElement,
            2,
            "<replicate>",
        ),
        (
            body("<include file='../x.xml'/>"),
            Code::RobotInclude,
            2,
            "leads out",
        ),
        (
            body("<include file='robot.xml'/>"),
            Code::RobotInclude,
            2,
            "twice",
        ),
        (body("<include file='missing.xml'/>"), Code::Open, 0, ""),
        (
            "<mujoco><compiler coordinate='global'/></mujoco>".to_owned(),
            Code::RobotElement,
            1,
            "`global`",
        ),
        (urdf(""), Code::RobotTree, 1, "no <link>"),
        (urdf(links), Code::RobotTree, 1, "`a` and `b`"),
        (
            urdf(&(links.to_owned() + &joint("planar", "a", "b"))),
            Code::RobotElement,
            2,
            "planar",
        ),
        (
            urdf(&(links.to_owned() + &joint("fixed", "a", "c"))),
            Code::RobotTree,
            2,
            "`c`",
        ),
        (
            urdf(&(links.to_owned() + &joint("fixed", "a", "b") + &joint("fixed", "b", "a"))),
            Code::RobotTree,
            1,
            "circle",
        ),
        (
            "<robot xmlns:xacro='http://ros.org/wiki/xacro'>\n<xacro:leg/></robot>".to_owned(),
            Code::RobotElement,
            2,
            "xacro",
        ),
    ];
    for (text, code, line, message) in cases {
        let error = read(&text, &[]).unwrap_err();
        assert_eq!(error.code, code, "{text}: {error}");
        assert!(error.message.contains(message), "{error}");
        match error.location {
            Some(Location::Text { line: found, .. }) => assert_eq!(found, line, "{error}"),
            _ => assert_eq!(line, 0, "{error}"),
        }
    }
}

#[test]
fn included_files_take_the_place_of_their_elements() {
    let arm = "<mujocoinclude>\n<body name='b'/><include file='c.xml'/></mujocoinclude>";
    let text = "<mujoco><worldbody><body name='a'/><include file='b.xml'/><body name='d'/></worldbody></mujoco>";
    let others = [("b.xml", arm), ("c.xml", "<x><body name='c'/></x>")];
    let robot = read(text, &others).unwrap();
    let names: String = robot.tree.bodies().iter().map(|body| &*body.name).collect();
    assert_eq!(names, "abcd");
    // A message names the file in which the fault is.
    let error = read(text, &[("b.xml", "<x>\n\n<replicate/></x>"), others[1]]).unwrap_err();
    assert!(
        error.file.ends_with("b.xml") && error.code == Code::RobotElement,
        "{error}"
    );
}

#[test]
fn large_and_deep_files_end_soon() {
    let deep = |count: usize| {
        format!(
            "<mujoco><worldbody>{}{}</worldbody></mujoco>",
            "<body>".repeat(count),
            "</body>".repeat(count)
        )
    };
    assert_eq!(read(&deep(500), &[]).unwrap().tree.bodies().len(), 500);
    let refused = [
        (deep(100_000), Code::RobotTree),
        (
            format!("<mujoco>{}</mujoco>", " ".repeat(4 << 20)),
            Code::FileTooLong,
        ),
    ];
    for (text, code) in refused {
        assert_eq!(read(&text, &[]).unwrap_err().code, code);
    }
    // Reading these files takes at most seconds, although they are large.
    let many: String = (0..60_000)
        .map(|i| format!("<body name='b{i}'/>"))
        .collect();
    let attributes: String = (0..300_000).map(|i| format!(" a{i}='>'")).collect();
    let classes: String = (0..50_000)
        .map(|i| format!("<default class='c{i}'>"))
        .collect();
    let closed = "</default>".repeat(50_000);
    let mimics: String = (0..15_000)
        .map(|i| {
            let next = i + 1;
            format!("<link name='{next}'/><joint name='j{i}' type='revolute'><parent link='{i}'/><child link='{next}'/><mimic joint='j{next}'/></joint>")
        })
        .collect();
    let texts = [
        format!("<mujoco><worldbody>{many}</worldbody></mujoco>"),
        format!("<mujoco{attributes}/>"),
        format!(
            "<mujoco><default>{classes}{closed}</default><worldbody><body/></worldbody></mujoco>"
        ),
        format!("<robot><link name='0'/>{mimics}</robot>"),
    ];
    for text in texts {
        let start = Instant::now();
        let _ = read(&text, &[]);
        assert!(start.elapsed() < Duration::from_secs(60), "{}", &text[..60]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Files of which a part is missing or doubled are read or refused.
    #[test]
    fn damaged_files_do_not_panic(from in 0usize..2000, length in 0usize..200, doubled: bool) {
        if let Some(data) = shared_data() {
            for name in ["tangle.xml", "claw.urdf"] {
                let text = fs::read_to_string(data.join("robots/robots").join(name)).unwrap();
                let start = text.floor_char_boundary(from % text.len());
                let end = text.floor_char_boundary((start + length).min(text.len()));
                let part = if doubled { text[start..end].repeat(2) } else { String::new() };
                let joints = fs::read_to_string(data.join("robots/robots/tangle_joints.xml")).unwrap();
                let damaged = format!("{}{part}{}", &text[..start], &text[end..]);
                if let Ok(robot) = read(&damaged, &[("tangle_joints.xml", &joints)]) {
                    robot.tree.poses(&robot.tree.rest()).unwrap();
                }
            }
        }
    }
}

#[test]
fn robots_are_known_by_their_extensions() {
    assert!(
        Robot::has_extension(Path::new("a/g1.XML")) && Robot::has_extension(Path::new("x.urdf"))
    );
    assert!(!Robot::has_extension(Path::new("a.bvh")) && !Robot::has_extension(Path::new("xml")));
}
