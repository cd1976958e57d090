//! Features for learning through the program, against values by NumPy where the sample files are there.

use std::collections::HashMap;
use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use serde_json::Value;
use zip::write::SimpleFileOptions;

use crate::program::{Run, root, run, succeed};

fn line(folder: &Path, line: &str) -> Run {
    succeed(folder, &line.split_whitespace().collect::<Vec<_>>())
}

fn shared() -> Option<PathBuf> {
    let folder = root().join("../shared/data/robots");
    if !folder.is_dir() {
        eprintln!("{} is not there: nothing compared", folder.display());
        return None;
    }
    Some(folder)
}

/// The arrays of floats of a file, with their shapes.
fn arrays(path: &Path) -> HashMap<String, (Vec<usize>, Vec<f64>)> {
    let mut archive = zip::ZipArchive::new(fs::File::open(path).unwrap()).unwrap();
    let mut all = HashMap::new();
    for index in 0..archive.len() {
        let mut member = archive.by_index(index).unwrap();
        let name = member.name().unwrap().trim_end_matches(".npy").to_owned();
        let mut bytes = Vec::new();
        member.read_to_end(&mut bytes).unwrap();
        if let Ok(found) = tumble_formats::npy::read_numbers(&name, &bytes, |_| Ok(())) {
            all.insert(name, (found.shape, found.values));
        } else if bytes.windows(3).any(|three| three == b"<i8") {
            let start = bytes.iter().position(|&byte| byte == b'\n').unwrap() + 1;
            let numbers = bytes[start..].as_chunks::<8>().0.iter();
            let numbers: Vec<f64> = numbers
                .map(|&eight| i64::from_le_bytes(eight) as f64)
                .collect();
            all.insert(name, (vec![numbers.len()], numbers));
        }
    }
    all
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        Value::Bool(value) => vec![f64::from(u8::from(*value))],
        number => vec![number.as_f64().unwrap()],
    }
}

fn assert_near(found: &[f64], expected: &[f64], tolerance: f64, of: &str) {
    assert_eq!(found.len(), expected.len(), "{of}");
    for (index, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!(
            (found - expected).abs() <= tolerance,
            "{of} {index}: {found} {expected}"
        );
    }
}

/// The bodies of a robot: contacts, headings and mirrors of the test data.
#[test]
fn features_of_a_robot_are_those_of_numpy() {
    let Some(shared) = shared() else { return };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let text = fs::read_to_string(shared.join("features/features.json")).unwrap();
    let expected: Value = serde_json::from_str(&text).unwrap();
    let of = |path: &str| shared.join(path).to_str().unwrap().to_owned();
    let (take, robot) = (of("layouts/gmr_p4.pkl"), of("robots/pico.xml"));
    let features =
        format!("features {take} --robot {robot} -m slerp --fps 30 --vertical z --mirror-axis y");
    line(
        folder,
        &format!("{features} --sets contacts,heading,mirror,positions -o a.npz"),
    );
    line(
        folder,
        &format!("{features} --sets contacts --contact-speed 1.0 --contact-height 0.2 -o b.npz"),
    );
    let [a, b] = ["a.npz", "b.npz"].map(|file| arrays(&folder.join(file)));
    assert_eq!(a["contacts"].1, numbers(&expected["contacts"]["0.15/0.1"]));
    assert_eq!(b["contacts"].1, numbers(&expected["contacts"]["1.0/0.2"]));
    assert!(b["contacts"].1.contains(&1.0) && b["contacts"].1.contains(&0.0));
    let headings = numbers(&expected["heading_of_root"]["values"]);
    let twists: Vec<f64> = headings.iter().step_by(2).copied().collect();
    assert_near(&a["heading"].1, &twists, 1e-6, "heading");
    // The first frame, with left and right exchanged.
    let mirror = &expected["mirror"];
    let pairs: Vec<usize> = a["mirror_pairs"]
        .1
        .iter()
        .map(|&pair| pair as usize)
        .collect();
    assert!(pairs.iter().enumerate().any(|(body, &pair)| body != pair));
    assert!(
        pairs
            .iter()
            .enumerate()
            .all(|(body, &pair)| pairs[pair] == body)
    );
    let positions = numbers(&mirror["positions"]["after"]);
    let rotations = numbers(&mirror["rotations_wxyz"]["after"]);
    for (body, &pair) in pairs.iter().enumerate() {
        let found = &a["mirrored_positions"].1[3 * body..][..3];
        assert_near(
            found,
            &positions[3 * pair..][..3],
            1e-6,
            "mirrored positions",
        );
        let found = &a["mirrored_rotations"].1[4 * body..][..4];
        let [w, x, y, z] = *rotations[4 * pair..].first_chunk::<4>().unwrap();
        let sign = if found[3] * w < 0.0 { -1.0 } else { 1.0 };
        assert_near(
            found,
            &[x, y, z, w].map(|it| sign * it),
            1e-6,
            "mirrored rotations",
        );
    }
    assert_eq!(a["positions"].0, [31, 17, 3]);
    assert_eq!(a["velocities"].0, [31, 17, 3]);
}

/// An array as a member of an NPZ file.
pub(crate) fn npy(shape: &str, numbers: &[f64]) -> Vec<u8> {
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (10 + header.len() + 1).next_multiple_of(64);
    header += &" ".repeat(length - 10 - header.len() - 1);
    header += "\n";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(
        numbers
            .iter()
            .flat_map(|&number| (number as f32).to_le_bytes()),
    );
    bytes
}

/// Writes an NPZ file with these arrays: names, shapes and numbers.
fn write_arrays(path: &Path, arrays: &[(&str, String, &[f64])]) {
    let mut archive = zip::ZipWriter::new(fs::File::create(path).unwrap());
    for (name, shape, numbers) in arrays {
        archive
            .start_file(format!("{name}.npy"), SimpleFileOptions::default())
            .unwrap();
        archive.write_all(&npy(shape, numbers)).unwrap();
    }
    archive.finish().unwrap();
}

/// The offsets of an SMPL body's 22 joints, each with its mirror image.
const BODY: [[f64; 3]; 22] = [
    [0.0, -0.2, 0.02],
    [0.07, -0.09, 0.0],
    [-0.07, -0.09, 0.0],
    [0.0, 0.11, 0.0],
    [0.03, -0.38, 0.0],
    [-0.03, -0.38, 0.0],
    [0.0, 0.13, 0.0],
    [-0.01, -0.4, -0.04],
    [0.01, -0.4, -0.04],
    [0.0, 0.05, 0.02],
    [0.02, -0.06, 0.12],
    [-0.02, -0.06, 0.12],
    [0.0, 0.21, -0.03],
    [0.08, 0.12, 0.0],
    [-0.08, 0.12, 0.0],
    [0.0, 0.09, 0.05],
    [0.09, 0.03, 0.0],
    [-0.09, 0.03, 0.0],
    [0.26, -0.01, 0.0],
    [-0.26, -0.01, 0.0],
    [0.25, 0.0, 0.0],
    [-0.25, 0.0, 0.0],
];

/// Writes a body that stands with its feet on the ground and walks forward at 1 m/s, in the layout of AMASS with z up, or with y
/// up as other programs write it; and its offsets as text.
pub(crate) fn write_bodies(folder: &Path) {
    let frames = 31;
    let [pelvis_y, pelvis_z] = [BODY[0][1], BODY[0][2]];
    for (name, is_z_up) in [("amass", true), ("y_up", false)] {
        let (mut poses, mut trans) = (Vec::new(), Vec::new());
        for frame in 0..frames {
            let forward = f64::from(frame) / 30.0;
            let root = if is_z_up {
                std::f64::consts::FRAC_PI_2
            } else {
                0.0
            };
            poses.extend([root, 0.0, 0.0]);
            poses.extend([0.0; 63]);
            // The pelvis is 0.93 m above the ground, where its toes are.
            let pelvis = match is_z_up {
                true => [0.0, -forward, 0.93],
                false => [0.0, 0.93, forward],
            };
            trans.extend([pelvis[0], pelvis[1] - pelvis_y, pelvis[2] - pelvis_z]);
        }
        write_arrays(
            &folder.join(format!("{name}.npz")),
            &[
                ("poses", format!("({frames}, 66)"), &poses),
                ("trans", format!("({frames}, 3)"), &trans),
                ("mocap_framerate", "()".to_owned(), &[30.0]),
            ],
        );
    }
    let lines = BODY.map(|[x, y, z]| format!("{x} {y} {z}\n"));
    fs::write(folder.join("offsets.txt"), lines.concat()).unwrap();
}

/// Kimodo and HumanML3D have y up, and headings and contacts depend on what points up. Files of bodies do not state it, and
/// most have z up.
#[test]
fn bodies_with_z_up_are_converted_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_bodies(folder);
    let features = |file: &str, rest: &str| {
        let words = format!("features {file} --offsets offsets.txt {rest}");
        run(folder, &words.split_whitespace().collect::<Vec<_>>())
    };
    for set in ["kimodo", "humanml3d", "heading", "contacts"] {
        let refused = features("amass.npz", &format!("--sets {set} -o z.npz"));
        let said = format!(
            "the body stands along z, from its feet to its head, and {set} is computed with y up; --up-axis y"
        );
        assert_eq!(refused.code, 4, "{}", refused.words);
        assert!(refused.words.contains(&said), "{}", refused.words);
    }
    for (index, (file, rest, said)) in [
        ("amass.npz", "--up-axis y", None),
        ("y_up.npz", "", None),
        ("y_up.npz", "--vertical y", None),
        (
            "amass.npz",
            "--vertical y",
            Some("along z, from its feet to its head, and --vertical states that y points up"),
        ),
        (
            "y_up.npz",
            "--up-axis y",
            Some("along -z, from its feet to its head, and --up-axis states that y points up"),
        ),
        ("amass.npz", "--contact-speed 2 --vertical z", None),
    ]
    .into_iter()
    .enumerate()
    {
        let set = if rest.ends_with(" z") {
            "contacts"
        } else {
            "kimodo"
        };
        let made = features(file, &format!("--sets {set} {rest} -o {index}.npz"));
        assert_eq!(made.code, 0, "{}", made.words);
        match said {
            Some(said) => assert!(made.words.contains(said), "{}", made.words),
            None => assert!(!made.words.contains("warning"), "{}", made.words),
        }
    }
    let converted = &arrays(&folder.join("0.npz"))["kimodo"].1;
    let numbers = converted.len() / 31;
    assert_near(
        converted,
        &arrays(&folder.join("1.npz"))["kimodo"].1,
        5e-6,
        "converted",
    );
    let first = &converted[..numbers];
    // The height of the hips, the heading, the head, and the axes of the hips.
    assert_near(&first[1..5], &[0.93, first[2], 1.0, 0.0], 1e-6, "root");
    assert_near(
        &first[5 + 3 * 15 + 1..][..1],
        &[0.93 + 0.11 + 0.13 + 0.05 + 0.21 + 0.09],
        1e-6,
        "head",
    );
    assert_near(
        &first[5 + 66..][..6],
        &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        1e-6,
        "axes",
    );
    // Differences of frames times the rate: 1 m/s forward.
    assert_near(
        &first[5 + 66 + 132..][..3],
        &[0.0, 0.0, 1.0],
        1e-5,
        "velocity",
    );
    // With z up, the toes are on the ground and the head is not.
    let contacts = &arrays(&folder.join("5.npz"))["contacts"].1;
    assert_eq!([contacts[10], contacts[15]], [1.0, 0.0]);
}

/// The axis that is taken to point up in a body's root motion is said, unless it is stated.
#[test]
fn root_motion_of_bodies_says_what_points_up() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_bodies(folder);
    for (options, is_said) in [("", true), ("--vertical z", false), ("--up-axis y", false)] {
        let words = format!(
            "eval amass.npz --offsets offsets.txt {options} --root-motion in-place -o a.npz --overwrite"
        );
        let made = line(folder, &words);
        let said = "files of SMPL bodies do not state what points up, so y is taken";
        assert_eq!(made.words.contains(said), is_said, "{}", made.words);
    }
}

/// Rotations of Kimodo are those of joints that rest in a T-pose.
#[test]
fn kimodo_of_other_rest_poses_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let human = crate::retarget::human(|role| role);
    let lowered = human.replace("OFFSET 27 0 0", "OFFSET 0 -27 0");
    let lowered = lowered.replace("OFFSET 28 0 0", "OFFSET 0 -28 0");
    for (name, text, is_refused) in [("t", human, false), ("lowered", lowered, true)] {
        fs::write(folder.join(format!("{name}.bvh")), text).unwrap();
        let words =
            format!("features {name}.bvh --fps 100 --scale 0.01 --sets kimodo -o {name}.npz");
        let run = run(folder, &words.split_whitespace().collect::<Vec<_>>());
        assert_eq!(run.code != 0, is_refused, "{}", run.words);
        let said = "the direction from `leftUpperArm` to `leftHand` is 90° away from that at rest; `tumble retarget --onto`";
        assert_eq!(run.words.contains(said), is_refused, "{}", run.words);
    }
}

/// The 263 numbers of HumanML3D, of joints in the world.
#[test]
fn humanml3d_is_that_of_numpy() {
    let Some(shared) = shared() else { return };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let expected = arrays(&shared.join("features/humanml3d.npz"));
    let joints = &expected["joints"].1;
    let frames = joints.len() / 66;
    let matrices = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0].repeat(frames * 22);
    let roots: Vec<f64> = joints
        .chunks(66)
        .flat_map(|frame| &frame[..3])
        .copied()
        .collect();
    write_arrays(
        &folder.join("people.npz"),
        &[
            ("posed_joints", format!("({frames}, 22, 3)"), joints),
            (
                "global_rot_mats",
                format!("({frames}, 22, 3, 3)"),
                &matrices,
            ),
            ("local_rot_mats", format!("({frames}, 22, 3, 3)"), &matrices),
            ("root_positions", format!("({frames}, 3)"), &roots),
        ],
    );
    let run = line(
        folder,
        "features people.npz --source-fps 20 -m slerp --sets humanml3d,six-rows -o f.npz --json",
    );
    let json: Value = serde_json::from_slice(&run.out).unwrap();
    assert_eq!(
        json[0]["arrays"],
        serde_json::json!(["humanml3d", "six_rows"])
    );
    let found = arrays(&folder.join("f.npz"));
    assert_eq!(found["humanml3d"].0, [frames - 1, 263]);
    assert_near(
        &found["humanml3d"].1,
        &expected["features"].1,
        2e-6,
        "humanml3d",
    );
    assert_eq!(found["six_rows"].1[..6], [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    assert_eq!(found["times"].1[1], 0.05);
}

/// Velocities of a skeleton are those of its motion: half a turn a second about an axis a metre away.
#[test]
fn velocities_of_skeletons_are_those_of_the_motion() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let joint = "{ OFFSET 0 1 0 CHANNELS 3 Zrotation Xrotation Yrotation";
    let mut bvh = format!(
        "HIERARCHY ROOT hips {joint} JOINT tip {joint} End Site {{ OFFSET 0 1 0 }} }} }}\nMOTION\nFrames: 31\n"
    );
    bvh += "Frame Time: 0.033333333333\n";
    for frame in 0..31 {
        bvh += &format!("{} 0 0 0 0 0\n", 6 * frame);
    }
    fs::write(folder.join("a.bvh"), bvh).unwrap();
    line(
        folder,
        "features a.bvh -m slerp --fps 10 --sets positions,contacts,heading -o a.npz",
    );
    let found = arrays(&folder.join("a.npz"));
    assert_eq!(found["velocities"].0, [11, 2, 3]);
    for frame in found["velocities"].1.chunks(6) {
        let speed = frame[3..]
            .iter()
            .map(|part| part * part)
            .sum::<f64>()
            .sqrt();
        assert!((speed - std::f64::consts::PI).abs() < 1e-3, "{speed}");
        assert_eq!(frame[..3], [0.0; 3]);
    }
    fs::copy(root().join("data/walk.bvh"), folder.join("walk.bvh")).unwrap();
    // Neither slow nor low.
    assert!(
        found["contacts"]
            .1
            .iter()
            .skip(1)
            .step_by(2)
            .all(|&touches| touches == 0.0)
    );
    for (words, part) in [
        ("features a.bvh -o x.npz", "--sets"),
        (
            "features a.bvh --sets humanml3d -o x.npz",
            "humanml3d needs the 22 joints of SMPL: the joints are not those of a known human skeleton: no joint has a known \
             name for spine, head, ",
        ),
        (
            "features walk.bvh --sets humanml3d -o x.npz",
            "the skeleton is that of Mixamo, and no joint has a known name for chest, upperChest, leftToes, rightToes, \
             leftShoulder, rightShoulder; `tumble retarget --onto FILE --bones FILE`",
        ),
        ("features a.bvh --sets heading -o x.bvh", ".npz"),
        ("features a.bvh --sets six -o x.npz", "six-columns"),
        (
            "features a.bvh --sets contacts --contact-window 2 -o x.npz",
            "odd",
        ),
        ("features a.bvh --sets heading --to npy -o x", "npz"),
    ] {
        let run = run(folder, &words.split_whitespace().collect::<Vec<_>>());
        assert_ne!(run.code, 0, "{words}");
        assert!(run.words.contains(part), "{words}: {}", run.words);
    }
    assert!(!folder.join("x.npz").exists());
}

/// HumanML3D's numbers are steps at 20 frames a second, in metres.
#[test]
fn humanml3d_of_other_units_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let human = crate::retarget::human(|role| role);
    fs::write(folder.join("take.bvh"), human).unwrap();
    let made = line(folder, "features take.bvh --sets humanml3d -o a.npz --json");
    let json: Value = serde_json::from_slice(&made.out).unwrap();
    let warnings = json[0]["warnings"].as_array().unwrap();
    let codes: Vec<&Value> = warnings.iter().map(|warning| &warning["code"]).collect();
    assert_eq!(codes, ["W930", "W931"], "{json}");
    for part in [
        "HumanML3D has 20 frames a second, and its numbers are steps from frame to frame; these are of 25 frames a \
         second (--fps 20)",
        "HumanML3D is in metres, and the body is ",
    ] {
        assert!(made.words.contains(part), "{}", made.words);
    }
    let made = line(
        folder,
        "features take.bvh --fps 20 --scale 0.01 --sets humanml3d -o b.npz",
    );
    assert!(!made.words.contains("warning"), "{}", made.words);
}

/// A joint that names a side is not mirrored in place without a word.
#[test]
fn joints_without_a_partner_are_said() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let walk = fs::read_to_string(root().join("data/walk.bvh")).unwrap();
    let renamed = walk.replace("LeftFoot", "LeftPaw");
    for (name, text, is_said) in [("a", walk, false), ("b", renamed, true)] {
        fs::write(folder.join(format!("{name}.bvh")), text).unwrap();
        let made = line(
            folder,
            &format!("features {name}.bvh --sets mirror -o {name}.npz"),
        );
        let said = "mirrored in place: 2 joints with the name of a side and no partner on the other (the first: ";
        assert_eq!(made.words.contains(said), is_said, "{}", made.words);
    }
}
