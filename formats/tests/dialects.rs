//! Motion of robots in the layouts of the programs that learn from it.

use std::path::PathBuf;

use tumble::Channel;
use tumble::glam::{Quat, Vec3};
use tumble_formats::motion::{Motion, ScalarKind};
use tumble_formats::npy::read_numbers;
use tumble_formats::pickle::Contents;
use tumble_formats::robot::Robot;
use tumble_formats::{Code, Format, Loaded, ReadOptions};

use crate::support::shared_data;

fn layouts() -> Option<PathBuf> {
    Some(shared_data()?.join("robots/layouts"))
}

fn open(file: &str) -> Loaded {
    let path = layouts().unwrap().join(file);
    Format::open_detected(&path, &ReadOptions::default()).unwrap()
}

/// An array of `expected.npz`.
fn expected(name: &str) -> Vec<f64> {
    let path = layouts().unwrap().join("expected.npz");
    let mut zip = zip::ZipArchive::new(std::fs::File::open(path).unwrap()).unwrap();
    let mut bytes = Vec::new();
    let mut member = zip.by_name(&format!("{name}.npy")).unwrap();
    std::io::Read::read_to_end(&mut member, &mut bytes).unwrap();
    read_numbers(name, &bytes, |_| Ok(())).unwrap().values
}

/// The same bits; of numbers in centimetres and degrees in f32, within a step of f32.
fn assert_near(file: &str, found: &[f32], expected: &[f32]) {
    if file != "bones_seed_g1.csv" {
        assert_eq!(found, expected, "{file}");
        return;
    }
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            (found - expected).abs() <= f32::EPSILON * expected.abs(),
            "{found} {expected}"
        );
    }
}

/// The root's positions and the joints are those of `expected.npz` to the last bit of f32, its rotations as near as f32
/// is.
fn check(file: &str, clip: &Motion, of: &str) {
    let (positions, rotations, joints) = match of {
        "" => (
            "root_pos".to_owned(),
            "root_quat_wxyz".to_owned(),
            "joint_pos".to_owned(),
        ),
        of => (
            format!("{of}_root_pos"),
            format!("{of}_root_quat_wxyz"),
            format!("{of}_joint_pos"),
        ),
    };
    let keys = clip
        .set
        .vector_keys(tumble::Channel::Translation, 0)
        .unwrap();
    let found: Vec<f32> = keys.keys.iter().flat_map(Vec3::to_array).collect();
    let stored = |name: &str| -> Vec<f32> { expected(name).iter().map(|&n| n as f32).collect() };
    assert_near(file, &found, &stored(&positions));
    let rotation =
        |q: &[f64; 4]| Quat::from_xyzw(q[1] as f32, q[2] as f32, q[3] as f32, q[0] as f32);
    let values = expected(&rotations);
    for (found, expected) in clip.set.track(0).keys.iter().zip(values.as_chunks::<4>().0) {
        let expected = rotation(expected);
        let off = (*found - expected)
            .length()
            .min((*found + expected).length());
        assert!(off < 3e-7, "{file}: {found} {expected}");
    }
    let count = clip.set.scalar_count();
    let frames = clip.set.track(0).keys.len();
    assert_eq!((count, values.len()), (13, 4 * frames), "{file}");
    let all: Vec<f32> = (0..frames)
        .flat_map(|frame| (0..count).map(move |joint| (frame, joint)))
        .map(|(frame, joint)| clip.set.scalar(joint).unwrap().keys[frame])
        .collect();
    assert_near(file, &all, &stored(&joints));
    assert_eq!(clip.scalar(0).kind, ScalarKind::Angle, "{file}");
}

/// Every file of one motion in other programs' layouts holds its numbers.
#[test]
fn files_of_robots_hold_the_stored_numbers() {
    if layouts().is_none() {
        return;
    }
    for (file, of, codes) in [
        ("gmr_p2.pkl", "", vec![Code::UnnamedJoints]),
        ("gmr_p4.pkl", "", vec![Code::UnnamedJoints]),
        ("gmr_p5.pkl", "", vec![Code::UnnamedJoints]),
        ("motion_lib.pkl", "", vec![Code::UnnamedJoints]),
        ("motion_lib_zlib.pkl", "", vec![Code::UnnamedJoints]),
        ("motion_lib_lz4.pkl", "", vec![Code::UnnamedJoints]),
        (
            "protomotions.motion",
            "",
            vec![Code::InertObjects, Code::UnnamedJoints],
        ),
        ("mimickit.pkl", "", vec![Code::UnnamedJoints]),
        ("mjlab.npz", "peer50", vec![Code::UnnamedJoints]),
        ("isaaclab_amp.npz", "", vec![]),
        (
            "unitree_lafan1.csv",
            "",
            vec![Code::AssumedRate, Code::UnnamedJoints],
        ),
        ("bones_seed_g1.csv", "", vec![Code::AssumedRate]),
    ] {
        let loaded = open(file);
        assert_eq!(
            (loaded.clips.len(), &loaded.refused),
            (1, &Vec::new()),
            "{file}"
        );
        let found: Vec<Code> = loaded.warnings.iter().map(|warning| warning.code).collect();
        assert_eq!(found, codes, "{file}: {:?}", loaded.warnings);
        check(file, &loaded.clips[0], of);
    }
    let library = open("motion_lib.pkl");
    assert_eq!(library.clips[0].name.as_deref(), Some("walk__A001"));
    assert_eq!(library.clips[0].set.track_name(0), "root");
    let named = open("isaaclab_amp.npz");
    assert_eq!(named.clips[0].set.scalar(0).unwrap().name, "waist_yaw");
    // The same layout with w first is recognised only by its first line.
    let path = layouts().unwrap().join("kimodo_qpos.csv");
    let codes =
        |loaded: &Loaded| -> Vec<Code> { loaded.warnings.iter().map(|it| it.code).collect() };
    let order = "wxyz".parse().ok();
    let loaded = Format::open_detected(
        &path,
        &ReadOptions {
            source_order: order,
            ..ReadOptions::default()
        },
    );
    let loaded = loaded.unwrap();
    check("kimodo_qpos.csv", &loaded.clips[0], "");
    assert_eq!(codes(&loaded), [Code::AssumedRate, Code::UnnamedJoints]);
    let doubtful = open("kimodo_qpos.csv");
    assert!(codes(&doubtful).contains(&Code::QuaternionOrder));
    assert_eq!(
        open("bones_seed_g1.csv").clips[0]
            .set
            .scalar(0)
            .unwrap()
            .name,
        "waist_yaw"
    );
    // A person, whose pelvis is where `transl` has it.
    let person = open("gvhmr.pt");
    assert_eq!(codes(&person), [Code::AssumedRate]);
    let path = layouts().unwrap().join("gvhmr.pt");
    let stored = Contents::open(&path, &ReadOptions::default()).unwrap();
    let stored = stored.numbers("smpl_params_global.transl").unwrap().values;
    let set = &person.clips[0].set;
    let keys = set.vector_keys(tumble::Channel::Translation, 0).unwrap();
    let found: Vec<f64> = keys
        .keys
        .iter()
        .flat_map(|key| key.as_dvec3().to_array())
        .collect();
    assert_eq!((found, set.track_count()), (stored, 22));
    // The joints are breadth first, and nothing in the file says so; they are still counted.
    assert_eq!(open("beyondmimic.npz").clips[0].set.scalar_count(), 13);
}

fn at_rate(file: &str, rate: u64) -> Loaded {
    let options = ReadOptions {
        source_rate: tumble::FrameRate::new(rate, 1).ok(),
        ..ReadOptions::default()
    };
    Format::open_detected(&layouts().unwrap().join(file), &options).unwrap()
}

fn positions(clip: &Motion, track: usize) -> Vec<f32> {
    let keys = clip.set.vector_keys(tumble::Channel::Translation, track);
    keys.unwrap().keys.iter().flat_map(Vec3::to_array).collect()
}

/// The numbers of a pickle, as they are stored.
fn stored(file: &str, name: &str) -> Vec<f32> {
    let path = layouts().unwrap().join(file);
    let contents = Contents::open(&path, &ReadOptions::default()).unwrap();
    contents
        .numbers(name)
        .unwrap()
        .values
        .iter()
        .map(|&number| number as f32)
        .collect()
}

/// The scalars of a clip, `[frame][scalar]`.
fn scalars(clip: &Motion) -> Vec<f32> {
    let count = clip.set.scalar_count();
    let frames = clip.set.scalar(0).unwrap().keys.len();
    let all = (0..frames).flat_map(|frame| (0..count).map(move |scalar| (frame, scalar)));
    all.map(|(frame, scalar)| clip.set.scalar(scalar).unwrap().keys[frame])
        .collect()
}

/// People of WHAM, TRAM and Kimodo: numbers bit for bit, bodies and joints by name, frames by their numbers.
#[test]
fn files_of_people_hold_the_stored_numbers() {
    if layouts().is_none() {
        return;
    }
    let wham = at_rate("wham_output.pkl", 25);
    let [clip] = &wham.clips[..] else {
        panic!("{:?}", wham.refused)
    };
    assert_eq!(
        positions(clip, 0),
        stored("wham_output.pkl", "0.trans_world")
    );
    assert_eq!(
        (clip.set.track_count(), &*clip.set.track_name(23)),
        (24, "right_hand")
    );
    assert_eq!(clip.set.track(0).times[1], 0.04);
    let pose = stored("wham_output.pkl", "0.pose_world");
    for (frame, key) in clip.set.track(1).keys.iter().enumerate() {
        let vector = [0, 1, 2].map(|axis| f64::from(pose[72 * frame + 3 + axis]));
        let expected = tumble::glam::DQuat::from_scaled_axis(vector.into());
        let off = 1.0 - key.as_dquat().normalize().dot(expected).abs();
        assert!(off < 1e-12, "{frame}: {off}");
    }
    let tram = at_rate("tram_hps_track_0.npy", 25);
    let [clip] = &tram.clips[..] else {
        panic!("{:?}", tram.refused)
    };
    assert_eq!((clip.set.track_count(), positions(clip, 0).len()), (24, 93));
    assert!(
        clip.set
            .tracks()
            .all(|track| track.keys.iter().all(|key| *key == Quat::IDENTITY))
    );
    let kimodo = at_rate("kimodo.npz", 30);
    let [clip] = &kimodo.clips[..] else {
        panic!("{:?}", kimodo.refused)
    };
    let bodies = expected("exact30_body_pos_w");
    let rotations = expected("exact30_body_quat_w");
    assert_eq!((clip.set.track_count(), clip.set.scalar_count()), (17, 4));
    assert_eq!(clip.scalar(0).kind, ScalarKind::Contact);
    // z up and x forward were converted to y up and z forward.
    let to_y_up = tumble::glam::DQuat::from_xyzw(-0.5, -0.5, -0.5, 0.5);
    for body in 0..17 {
        let found = positions(clip, body);
        for frame in 0..31 {
            let [x, y, z] = [0, 1, 2].map(|axis| bodies[(frame * 17 + body) * 3 + axis] as f32);
            assert_eq!(found[3 * frame..][..3], [y, z, x], "{body} {frame}");
            let [w, x, y, z] = [0, 1, 2, 3].map(|i| rotations[(frame * 17 + body) * 4 + i]);
            let rotation = tumble::glam::DQuat::from_xyzw(x, y, z, w);
            let expected = to_y_up * rotation * to_y_up.inverse();
            let key = clip.set.track(body).keys[frame].as_dquat().normalize();
            assert!(
                key.dot(expected).abs() > 1.0 - 1e-12,
                "{body} {frame}: {key} {expected}"
            );
        }
    }
}

/// `DeepMimic`'s 44 numbers: each joint from its columns, w first, at a rate or at the times that durations lead to.
#[test]
fn frames_of_deepmimic_are_its_joints() {
    let read = |durations: [f64; 3], width: usize| {
        let frame = |(index, duration): (usize, &f64)| {
            let mut row = vec![0.0; width];
            row[0] = *duration;
            row[1..4].copy_from_slice(&[index as f64, 0.9, 0.25]);
            // Each ball has a rotation that depends on its number.
            for (ball, first) in [4, 8, 12, 16, 21, 25, 30, 35, 39].into_iter().enumerate() {
                let angle = 0.1 * (ball + index) as f64;
                row[first] = angle.cos();
                row[first + 1 + ball % 3] = angle.sin();
            }
            for (hinge, column) in [20, 29, 34, 43].into_iter().enumerate() {
                row[column] = hinge as f64 - 0.5 * index as f64;
            }
            row
        };
        let frames: Vec<Vec<f64>> = durations.iter().enumerate().map(frame).collect();
        let text = serde_json::json!({"Loop": "wrap", "Frames": frames}).to_string();
        let format = Format::named("robot-json").unwrap();
        (format.read_bytes)("walk.txt", text.into_bytes(), &ReadOptions::default())
    };
    let loaded = read([0.05; 3], 44).unwrap();
    let clip = &loaded.clips[0];
    assert_eq!(
        (clip.rate.unwrap().per_second(), clip.is_world),
        (20.0, false)
    );
    for (ball, name) in [
        "root",
        "chest",
        "neck",
        "right_hip",
        "right_ankle",
        "right_shoulder",
        "left_hip",
        "left_ankle",
        "left_shoulder",
    ]
    .into_iter()
    .enumerate()
    {
        let track = clip.set.track(ball);
        assert_eq!(
            (track.name, track.times),
            (Some(name), &[0.0, 0.05, 0.1][..])
        );
        for (index, key) in track.keys.iter().enumerate() {
            let axis = [Vec3::X, Vec3::Y, Vec3::Z][ball % 3];
            let expected = Quat::from_axis_angle(axis, 0.2 * (ball + index) as f32);
            assert!(
                key.dot(expected).abs() > 1.0 - 1e-6,
                "{name}: {key} {expected}"
            );
        }
    }
    let root = clip.set.vector_keys(Channel::Translation, 0).unwrap();
    assert_eq!(root.keys[2], Vec3::new(2.0, 0.9, 0.25));
    for (hinge, name) in ["right_knee", "right_elbow", "left_knee", "left_elbow"]
        .into_iter()
        .enumerate()
    {
        let keys = clip.set.scalar(hinge).unwrap();
        let number = hinge as f32;
        assert_eq!(
            (keys.name, keys.keys),
            (name, &[number, number - 0.5, number - 1.0][..])
        );
    }
    let uneven = read([0.05, 0.25, 9.0], 44).unwrap();
    let times = uneven.clips[0].set.track(0).times.to_vec();
    assert!(
        (times[1] - 0.05).abs() < 1e-12 && (times[2] - 0.3).abs() < 1e-12,
        "{times:?}"
    );
    assert_eq!(read([0.05; 3], 45).unwrap_err().code, Code::Shape);
}

/// Robots in JSON and in the tables of `LeRobot`, and libraries of clips.
#[test]
fn files_of_joints_hold_the_stored_numbers() {
    if layouts().is_none() {
        return;
    }
    let joints: Vec<f32> = expected("joint_pos")
        .iter()
        .map(|&number| number as f32)
        .collect();
    let amp = open("amp.txt");
    let [clip] = &amp.clips[..] else {
        panic!("{:?}", amp.refused)
    };
    assert_eq!(clip.rate.unwrap().per_second(), 30.0);
    for (found, expected) in scalars(clip).iter().zip(&joints) {
        // It stores seven digits.
        assert!((found - expected).abs() < 1e-7, "{found} {expected}");
    }
    assert_eq!((clip.set.track_count(), clip.set.scalar_count()), (1, 13));
    let episode = open("xr_teleoperate.json");
    let [clip] = &episode.clips[..] else {
        panic!("{:?}", episode.refused)
    };
    let names: Vec<String> = (0..8)
        .map(|i| clip.set.scalar(i).unwrap().name.to_owned())
        .collect();
    assert_eq!(names[0], "states.left_arm.kLeftShoulderPitch");
    assert_eq!(names[3], "states.right_arm.kRightElbow");
    assert_eq!(names[4], "actions.left_arm.kLeftShoulderPitch");
    let column =
        |joint: usize| -> Vec<f32> { joints.iter().skip(joint).step_by(13).copied().collect() };
    // left_shoulder_pitch, left_elbow, right_shoulder_pitch, right_elbow
    for (scalar, joint) in [(0, 3), (1, 4), (2, 1), (3, 2)] {
        assert_eq!(
            clip.set.scalar(scalar).unwrap().keys,
            column(joint),
            "{scalar}"
        );
    }
    // With the robot, motors get the names of its joints, and the commanded values are left out.
    let robot = shared_data().unwrap().join("robots/robots/pico.xml");
    let robot = Robot::open(&robot).unwrap();
    let mut episode = open("xr_teleoperate.json");
    robot
        .assign(&mut episode, "xr_teleoperate.json", None)
        .unwrap();
    let clip = &episode.clips[0];
    let elbow = clip.set.scalar_named("left_elbow").unwrap();
    assert_eq!(clip.set.scalar(elbow).unwrap().keys, column(4));
    assert_eq!(clip.set.scalar_count(), 4);
    for (folder, tables) in [
        (
            "lerobot_v21",
            vec!["episode_000000.parquet", "episode_000001.parquet"],
        ),
        ("lerobot_v30", vec!["file-000.parquet"]),
    ] {
        let mut found = Vec::new();
        for table in tables {
            let loaded = open(&format!("{folder}/data/chunk-000/{table}"));
            assert!(loaded.refused.is_empty(), "{:?}", loaded.refused);
            for clip in &loaded.clips {
                let first = clip.set.scalar(0).unwrap();
                assert_eq!(first.name, "observation.state.waist_yaw");
                assert_eq!(clip.set.scalar(13).unwrap().name, "action.0");
                assert_eq!(clip.rate.unwrap().per_second(), 30.0);
                for frame in scalars(clip).chunks(26) {
                    assert_eq!(frame[..13], frame[13..]);
                    found.extend_from_slice(&frame[..13]);
                }
            }
        }
        assert_eq!(found, joints, "{folder}");
    }
    let library = open("protomotions_library.pt");
    let [clip] = &library.clips[..] else {
        panic!("{:?}", library.refused)
    };
    assert_eq!(clip.name.as_deref(), Some("walk.motion"));
    check("protomotions_library.pt", clip, "");
    assert_eq!(at_rate("transposed.pt", 30).clips[0].set.track_count(), 22);
}

/// These tests read every file of the layouts.
#[test]
fn every_file_of_the_layouts_is_read() {
    let Some(folder) = layouts() else { return };
    let mut folders = vec![folder];
    let mut count = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            // These files have the expected values, and the description of a data set.
            if ["expected.npz", "info.json"].contains(&&*name) {
                continue;
            }
            let loaded = Format::open_detected(&path, &ReadOptions::default());
            let rate = tumble::FrameRate::new(30, 1).ok();
            let with_rate = || {
                let options = ReadOptions {
                    source_rate: rate,
                    ..ReadOptions::default()
                };
                Format::open_detected(&path, &options)
            };
            // Only a rate may be missing.
            let loaded = match loaded {
                Err(error) if error.code == Code::NoRate => with_rate(),
                Ok(loaded) if loaded.clips.is_empty() => with_rate(),
                loaded => loaded,
            };
            let loaded = loaded.unwrap_or_else(|error| panic!("{name}: {error}"));
            assert!(
                !loaded.clips.is_empty() && loaded.refused.is_empty(),
                "{name}: {:?}",
                loaded.refused
            );
            count += 1;
        }
    }
    assert_eq!(count, 25);
}
