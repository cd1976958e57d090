//! Motion of robots through the program: the layouts of other programs, their orders, and refusals.

use std::collections::HashMap;
use std::fmt::Write;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use tumble_formats::ReadOptions;
use tumble_formats::pickle::Contents;

use crate::program::{Run, run, succeed};

/// Two arms of two hinges each on a body that moves freely: depth first and breadth first differ.
pub(crate) const ROBOT: &str = r#"<mujoco model="two arms"><compiler angle="radian"/><worldbody>
  <body name="chest" pos="0 0 1"><freejoint name="free"/><inertial pos="0 0 0.1" mass="1"/>
    <body name="left_upper" pos="0 0.2 0.3"><joint name="left_shoulder" axis="0 1 0" range="-1 0.25"/>
      <inertial pos="0 0.05 0" mass="1"/>
      <body name="left_lower" pos="0 0.1 -0.3"><joint name="left_elbow" axis="1 0 0"/>
        <inertial pos="0 0 -0.1" mass="1"/></body></body>
    <body name="right_upper" pos="0 -0.2 0.3"><joint name="right_shoulder" axis="0 1 0"/>
      <inertial pos="0 -0.05 0" mass="1"/>
      <body name="right_lower" pos="0 -0.1 -0.3"><joint name="right_elbow" axis="1 0 0"/>
        <inertial pos="0 0 -0.1" mass="1"/></body></body>
  </body></worldbody></mujoco>"#;

/// A folder with the robot and its motion.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("robot.xml"), ROBOT).unwrap();
    fs::write(folder.path().join("take.csv"), take()).unwrap();
    folder
}

/// 31 frames of the robot's motion in Unitree's layout, joints depth first.
pub(crate) fn take() -> String {
    let mut text = String::new();
    for frame in 0..31 {
        let t = f32::from(frame as u8) / 30.0;
        let half = 0.4 * t;
        let numbers = [
            t,
            0.1 * (3.0 * t).sin(),
            1.0,
            0.0,
            0.0,
            half.sin(),
            half.cos(),
            0.3 * (4.0 * t).sin(),
            0.5 * t,
            -0.2 * t * t,
            0.4 * (2.0 * t).cos(),
        ];
        let cells: Vec<String> = numbers.iter().map(ToString::to_string).collect();
        writeln!(text, "{}", cells.join(",")).unwrap();
    }
    text
}

fn line(folder: &Path, line: &str) -> Run {
    succeed(folder, &line.split_whitespace().collect::<Vec<_>>())
}

fn run_words(folder: &Path, words: &str) -> Run {
    run(folder, &words.split_whitespace().collect::<Vec<_>>())
}

fn refused(folder: &Path, words: &str, code: &str) {
    let run = run_words(folder, words);
    assert_ne!(run.code, 0, "{words}");
    assert!(run.words.contains(code), "{words}: {}", run.words);
}

/// The arrays of numbers of a file by NumPy.
fn arrays(path: &Path) -> HashMap<String, Vec<f64>> {
    let mut archive = zip::ZipArchive::new(fs::File::open(path).unwrap()).unwrap();
    let names: Vec<String> = archive
        .file_names()
        .map(|name| name.unwrap().into_owned())
        .collect();
    let mut all = HashMap::new();
    for name in names {
        let mut bytes = Vec::new();
        archive
            .by_name(&name)
            .unwrap()
            .read_to_end(&mut bytes)
            .unwrap();
        let numbers = tumble_formats::npy::read_numbers(&name, &bytes, |_| Ok(()));
        if let Ok(numbers) = numbers {
            all.insert(name.trim_end_matches(".npy").to_owned(), numbers.values);
        }
    }
    all
}

fn numbers(path: &Path) -> Vec<f64> {
    let text = fs::read_to_string(path).unwrap();
    let cells = text.lines().flat_map(|line| line.split(','));
    cells.map(|cell| cell.parse().unwrap()).collect()
}

fn largest_difference(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let pairs = found.iter().zip(expected);
    pairs
        .map(|(found, expected)| (found - expected).abs())
        .fold(0.0, f64::max)
}

/// From Unitree's lines to each dialect and back: positions and joints to the last bit, rotations within a step of f32.
/// Values that are stored as centimetres and degrees are rounded once more.
#[test]
fn every_dialect_is_read_back() {
    let folder = folder();
    let folder = folder.path();
    let expected = numbers(&folder.join("take.csv"));
    for (dialect, ending) in [
        ("mjlab", "npz"),
        ("beyondmimic", "npz"),
        ("isaaclab", "npz"),
        ("unitree-csv", "csv"),
        ("kimodo-csv", "csv"),
        ("bones-seed", "csv"),
        ("gmr", "pkl"),
        ("motion-lib", "pkl"),
        ("mimickit", "pkl"),
        ("protomotions", "motion"),
    ] {
        let out = format!("{dialect}.{ending}");
        line(
            folder,
            &format!("convert take.csv --robot robot.xml --dialect {dialect} -o {out}"),
        );
        let order = match dialect {
            "kimodo-csv" => "--source-order wxyz",
            "bones-seed" => "--source-fps 30",
            _ => "",
        };
        let back = format!("{dialect}.back.csv");
        let read =
            format!("convert {out} {order} --robot robot.xml --dialect unitree-csv -o {back}");
        line(folder, &read);
        let found = numbers(&folder.join(back));
        assert_eq!(found.len(), expected.len(), "{dialect}");
        for (row, (found, expected)) in found.chunks(11).zip(expected.chunks(11)).enumerate() {
            let off = largest_difference(&found[3..7], &expected[3..7]);
            assert!(off < 2e-7, "{dialect}, frame {row}: {off:e}");
            let rest = |numbers: &[f64]| [&numbers[..3], &numbers[7..]].concat();
            let off = largest_difference(&rest(found), &rest(expected));
            let allowed = if dialect == "bones-seed" { 6e-8 } else { 0.0 };
            assert!(off <= allowed, "{dialect}, frame {row}: {off:e}");
        }
    }
}

/// The bytes of tensors begin where `torch.load` maps them, and its pickle names nothing but tensors of f32.
#[test]
fn files_of_protomotions_are_archives_of_torch() {
    let folder = folder();
    let folder = folder.path();
    fs::create_dir(folder.join("takes")).unwrap();
    fs::rename(folder.join("take.csv"), folder.join("takes/take.csv")).unwrap();
    let eval = "eval takes -o out --robot robot.xml --dialect protomotions --fps 30 -m slerp";
    line(folder, eval);
    let library = eval.replace("takes -o out", "takes/take.csv -o take.pt");
    refused(folder, &library, "end the output in .motion");
    let path = folder.join("out/take.motion");
    let mut archive = zip::ZipArchive::new(fs::File::open(&path).unwrap()).unwrap();
    let mut members = Vec::new();
    for index in 0..archive.len() {
        let mut member = archive.by_index(index).unwrap();
        assert_eq!(member.compression(), zip::CompressionMethod::Stored);
        let name = member.name().unwrap().into_owned();
        assert_eq!(member.data_start().unwrap() % 64, 0, "{name}");
        let mut bytes = Vec::new();
        member.read_to_end(&mut bytes).unwrap();
        members.push((name, bytes));
    }
    let names: Vec<&str> = members.iter().map(|(name, _)| &**name).collect();
    let mut expected = vec!["archive/data.pkl", "archive/byteorder"];
    let data = [
        "archive/data/0",
        "archive/data/1",
        "archive/data/2",
        "archive/data/3",
        "archive/data/4",
        "archive/data/5",
    ];
    expected.extend(data);
    expected.push("archive/version");
    assert_eq!(names, expected);
    assert_eq!(
        (&*members[1].1, &*members[8].1),
        (&b"little"[..], &b"3\n"[..])
    );
    let pickle = String::from_utf8_lossy(&members[0].1);
    assert!(members[0].1.starts_with(b"\x80\x02}("));
    assert_eq!(
        pickle
            .matches("ctorch._utils\n_rebuild_tensor_v2\n")
            .count(),
        6
    );
    assert_eq!(pickle.matches("ctorch\nFloatStorage\n").count(), 6);
    // Of rotations: 31 frames, 5 bodies, four numbers, the last one nearest in memory.
    let int = |number: i32| [&b"J"[..], &number.to_le_bytes()].concat();
    let lengths = |numbers: &[i32]| {
        let all: Vec<u8> = numbers.iter().flat_map(|&number| int(number)).collect();
        [&b"("[..], &all, b"t"].concat()
    };
    let rotations = [
        b"X\x03\0\0\0cpu".to_vec(),
        int(31 * 5 * 4),
        b"tQ".to_vec(),
        int(0),
        lengths(&[31, 5, 4]),
        lengths(&[20, 4, 1]),
        b"\x89ccollections\nOrderedDict\n)RtR".to_vec(),
    ];
    let (rotations, pickle) = (rotations.concat(), &members[0].1);
    assert!(
        pickle
            .windows(rotations.len())
            .any(|part| part == rotations)
    );
    let contents = Contents::open(&path, &ReadOptions::default()).unwrap();
    let found = contents
        .entries()
        .into_iter()
        .map(|entry| (entry.name, entry.kind));
    let found: HashMap<String, String> = found.collect();
    for (name, kind) in [
        ("fps", "() i8"),
        ("dof_pos", "(31, 4) f4"),
        ("dof_vel", "(31, 4) f4"),
        ("rigid_body_pos", "(31, 5, 3) f4"),
        ("rigid_body_rot", "(31, 5, 4) f4"),
        ("rigid_body_vel", "(31, 5, 3) f4"),
        ("rigid_body_ang_vel", "(31, 5, 3) f4"),
    ] {
        assert_eq!(found.get(name).map(String::as_str), Some(kind), "{name}");
    }
    assert_eq!(found.len(), 7, "{found:?}");
    // The numbers are those of mjlab's file, but for the order of quaternions.
    let mjlab = eval.replace("protomotions", "mjlab").replace("out", "npz");
    line(folder, &mjlab);
    let mjlab = arrays(&folder.join("npz/take.npz"));
    let stored = |name: &str| contents.numbers(name).unwrap().values;
    assert_eq!(stored("dof_vel"), mjlab["joint_vel"]);
    assert_eq!(stored("rigid_body_vel"), mjlab["body_lin_vel_w"]);
    assert_eq!(stored("rigid_body_ang_vel"), mjlab["body_ang_vel_w"]);
    let first = mjlab["body_quat_w"]
        .chunks(4)
        .flat_map(|q| [q[1], q[2], q[3], q[0]]);
    assert_eq!(stored("rigid_body_rot"), first.collect::<Vec<f64>>());
}

/// Loaders look the clip of a motion library up by the name of its file, up to the first point.
#[test]
fn clips_of_libraries_have_the_name_of_their_file() {
    let folder = folder();
    let folder = folder.path();
    let convert = "--robot robot.xml --dialect motion-lib -o";
    let clip = |file: &str| {
        let contents = Contents::open(&folder.join(file), &ReadOptions::default()).unwrap();
        let name = contents.entries().remove(0).name;
        name.split_once('.').unwrap().0.to_owned()
    };
    line(folder, &format!("convert take.csv {convert} walk01.v2.pkl"));
    assert_eq!(clip("walk01.v2.pkl"), "walk01");
    fs::create_dir(folder.join("takes")).unwrap();
    fs::rename(folder.join("take.csv"), folder.join("takes/dance.csv")).unwrap();
    line(folder, &format!("eval takes --fps 30 {convert} out"));
    assert_eq!(clip("out/dance.pkl"), "dance");
    // A name in the input is kept.
    line(
        folder,
        &format!("convert walk01.v2.pkl {convert} again.pkl"),
    );
    assert_eq!(clip("again.pkl"), "walk01");
}

/// Links that are fixed: a sensor without mass, and a plate that carries the elbow.
const LINKS: &str = r#"<robot name="arm">
  <link name="base"><inertial><mass value="2"/></inertial></link>
  <link name="sensor"/>
  <joint name="sensor_mount" type="fixed"><parent link="base"/><child link="sensor"/><origin xyz="0 0 1"/></joint>
  <link name="right"><inertial><origin xyz="0 0 0.1"/><mass value="1"/></inertial></link>
  <joint name="right_joint" type="continuous"><parent link="base"/><child link="right"/><axis xyz="0 1 0"/></joint>
  <link name="plate"><inertial><origin xyz="0.1 0 0"/><mass value="3"/></inertial></link>
  <joint name="plate_mount" type="fixed"><parent link="right"/><child link="plate"/>
    <origin xyz="0 0 0.5" rpy="0 0 1.5707963267948966"/></joint>
  <link name="elbow"><inertial><mass value="1"/></inertial></link>
  <joint name="elbow_joint" type="continuous"><parent link="plate"/><child link="elbow"/>
    <origin xyz="0 0 1"/><axis xyz="0 1 0"/></joint>
  <link name="left"><inertial><mass value="1"/></inertial></link>
  <joint name="left_joint" type="continuous"><parent link="base"/><child link="left"/>
    <origin xyz="0 2 0"/><axis xyz="0 1 0"/></joint>
</robot>"#;

/// `IsaacLab` merges links that are fixed: a level below them is a level higher, and centres of mass are those of all.
#[test]
fn fixed_links_are_merged_as_simulators_do() {
    let folder = folder();
    let folder = folder.path();
    fs::write(folder.join("arm.urdf"), LINKS).unwrap();
    // The root rests; the right joint turns at 2 rad/s, the elbow and the left one do not turn.
    let rows = (0..11).map(|frame| {
        let angle = 2.0 * f64::from(frame) / 30.0;
        format!("0,0,0,0,0,0,1,{angle},0.3,-0.2")
    });
    fs::write(folder.join("take.csv"), rows.collect::<Vec<_>>().join("\n")).unwrap();
    let eval = "eval take.csv --robot arm.urdf --fps 30 -m slerp --json --dialect";
    let report = |words: &str| -> serde_json::Value {
        let made = line(folder, &format!("{eval} {words}"));
        serde_json::from_slice::<serde_json::Value>(&made.out).unwrap()[0]["robot"].clone()
    };
    let merged = report("beyondmimic -o merged.npz");
    let bodies = serde_json::json!(["base", "right", "left", "elbow"]);
    assert_eq!(merged["bodies"], bodies);
    assert_eq!(
        merged["merged_bodies"],
        serde_json::json!(["sensor", "plate"])
    );
    let joints = serde_json::json!(["right_joint", "left_joint", "elbow_joint"]);
    assert_eq!(merged["joints"], joints);
    // The centre of mass of `right` and `plate` is at (0, 3 · 0.1, 0.1 + 3 · 0.5) / 4 = (0, 0.075, 0.4).
    let found = arrays(&folder.join("merged.npz"));
    let first = &found["body_lin_vel_w"][3..6];
    assert!(
        largest_difference(first, &[0.8, 0.0, 0.0]) < 1e-6,
        "{first:?}"
    );
    let elbow = &found["body_pos_w"][9..12];
    assert!(
        largest_difference(elbow, &[0.0, 0.0, 1.5]) < 1e-6,
        "{elbow:?}"
    );
    // A file of these bodies is read with the robot of all links, and its order is found.
    line(
        folder,
        "convert merged.npz --robot arm.urdf --dialect unitree-csv -o back.csv",
    );
    let [found, expected] = ["back.csv", "take.csv"].map(|file| numbers(&folder.join(file)));
    assert!(largest_difference(&found, &expected) < 1e-6);
    // Kept links without mass have the velocity of their origin.
    let kept = report("beyondmimic --fixed-bodies keep -o kept.npz");
    let bodies = serde_json::json!(["base", "sensor", "right", "left", "plate", "elbow"]);
    assert_eq!(kept["bodies"], bodies);
    let velocities = &arrays(&folder.join("kept.npz"))["body_lin_vel_w"];
    assert!(largest_difference(&velocities[6..9], &[0.2, 0.0, 0.0]) < 1e-6);
    assert!(largest_difference(&velocities[12..15], &[1.0, 0.0, 0.0]) < 1e-6);
    // mjlab's robots are MJCF, whose bodies stay.
    let mjlab = report("mjlab -o mjlab.npz");
    assert_eq!(mjlab["bodies"].as_array().map(Vec::len), Some(6));
    assert!(mjlab.get("merged_bodies").is_none());
    refused(
        folder,
        "convert take.csv --robot arm.urdf --dialect gmr --fixed-bodies merge -o x.pkl",
        "--fixed-bodies has no effect on gmr",
    );
}

/// In breadth-first order, each level of the tree comes before the next one, and joints are in the order of their
/// bodies. The file does not state the order; it follows from the poses of its bodies.
#[test]
fn orders_are_stated_and_checked() {
    let folder = folder();
    let folder = folder.path();
    let eval = "eval take.csv --fps 50 --robot robot.xml";
    line(folder, &format!("{eval} --dialect mjlab -o depth.npz"));
    let json = line(
        folder,
        &format!("{eval} --dialect beyondmimic --json -o breadth.npz"),
    );
    let report: serde_json::Value = serde_json::from_slice(&json.out).unwrap();
    let robot = &report[0]["robot"];
    assert_eq!(robot["body_order"], "breadth-first", "{report}");
    assert_eq!(robot["velocity_at"], "mass");
    let upper = [
        "left_shoulder",
        "right_shoulder",
        "left_elbow",
        "right_elbow",
    ];
    assert_eq!(robot["joints"], serde_json::json!(upper));
    let bodies = [
        "chest",
        "left_upper",
        "right_upper",
        "left_lower",
        "right_lower",
    ];
    assert_eq!(robot["bodies"], serde_json::json!(bodies));
    let [depth, breadth] = ["depth.npz", "breadth.npz"].map(|file| arrays(&folder.join(file)));
    let column = |array: &[f64], width: usize, at: usize| -> Vec<f64> {
        array.chunks(width).map(|row| row[at]).collect()
    };
    for (to, from) in [0, 2, 1, 3].into_iter().enumerate() {
        let name = "joint_pos";
        assert_eq!(column(&breadth[name], 4, to), column(&depth[name], 4, from));
    }
    for (to, from) in [0, 1, 3, 2, 4].into_iter().enumerate() {
        let name = "body_pos_w";
        assert_eq!(
            column(&breadth[name], 15, 3 * to),
            column(&depth[name], 15, 3 * from)
        );
    }
    assert_ne!(breadth["body_lin_vel_w"], depth["body_lin_vel_w"]);
    let mut archive =
        zip::ZipArchive::new(fs::File::open(folder.join("depth.npz")).unwrap()).unwrap();
    let mut fps = Vec::new();
    archive
        .by_name("fps.npy")
        .unwrap()
        .read_to_end(&mut fps)
        .unwrap();
    let fps = npyz::NpyFile::new(&fps[..]).unwrap();
    assert_eq!(fps.shape(), [1]);
    assert_eq!(fps.into_vec::<i64>().unwrap(), [50]);
    // Both orders are recognised, and an option that names the other one is refused.
    for file in ["depth", "breadth"] {
        line(
            folder,
            &format!("convert {file}.npz --robot robot.xml --dialect unitree-csv -o {file}.csv"),
        );
    }
    assert_eq!(
        numbers(&folder.join("depth.csv")),
        numbers(&folder.join("breadth.csv"))
    );
    let read = "convert breadth.npz --robot robot.xml --dialect gmr -o x.pkl";
    refused(
        folder,
        &format!("{read} --source-body-order depth-first"),
        "E907",
    );
    refused(folder, &format!("{read} --source-order xyzw"), "E907");
    refused(
        folder,
        "convert breadth.npz --source-order zyxw -o x.npz",
        "zyxw",
    );
    line(folder, &format!("{read} --source-body-order breadth-first"));
    // If the file has the names of its joints, they decide the order.
    line(
        folder,
        &format!("{eval} --dialect beyondmimic --describe -o named.npz"),
    );
    let info = line(folder, "info named.npz");
    let text = String::from_utf8(info.out).unwrap();
    assert!(
        !info.words.contains("W906") && text.contains("right_elbow"),
        "{text} {}",
        info.words
    );
}

#[test]
fn joints_of_another_robot_are_refused() {
    let folder = folder();
    let folder = folder.path();
    let fewer = ROBOT.replace(r#"<joint name="left_elbow" axis="1 0 0"/>"#, "");
    fs::write(folder.join("fewer.xml"), fewer).unwrap();
    refused(
        folder,
        "convert take.csv --robot fewer.xml --dialect gmr -o x.pkl",
        "E904",
    );
    line(
        folder,
        "convert take.csv --robot robot.xml --dialect isaaclab -o named.npz",
    );
    refused(
        folder,
        "convert named.npz --robot fewer.xml --dialect gmr -o x.pkl",
        "left_elbow",
    );
    // With other lengths of the limbs, joints with names are read with a warning; the order of joints
    // without names is unknown.
    fs::write(
        folder.join("longer.xml"),
        ROBOT.replace("0.1 -0.3", "0.1 -0.4"),
    )
    .unwrap();
    let run = line(
        folder,
        "convert named.npz --robot longer.xml --dialect gmr -o y.pkl",
    );
    assert!(run.words.contains("W914"), "{}", run.words);
    line(
        folder,
        "convert take.csv --robot robot.xml --dialect mjlab -o unnamed.npz",
    );
    refused(
        folder,
        "convert unnamed.npz --robot longer.xml --dialect gmr -o x.pkl",
        "E904",
    );
    let massless = ROBOT.replace(r#"<inertial pos="0 0.05 0" mass="1"/>"#, "");
    fs::write(folder.join("massless.xml"), massless).unwrap();
    refused(
        folder,
        "convert take.csv --robot massless.xml --dialect beyondmimic -o x.npz",
        "E905",
    );
    line(
        folder,
        "convert take.csv --robot massless.xml --dialect beyondmimic --velocity-at origin -o z.npz",
    );
    // The file has fewer columns than the robot has joints; the other joints rest.
    let text = fs::read_to_string(folder.join("take.csv")).unwrap();
    let heading = "Frame,root_translateX,root_translateY,root_translateZ,root_rotateX,root_rotateY,root_rotateZ,\
                   left_elbow_dof\n";
    let rows = text.lines().enumerate();
    let rows: Vec<String> = rows
        .map(|(i, _)| format!("{i},0,0,100,0,0,0,{i}"))
        .collect();
    fs::write(
        folder.join("elbow.csv"),
        format!("{heading}{}", rows.join("\n")),
    )
    .unwrap();
    let run = line(
        folder,
        "convert elbow.csv --robot robot.xml --dialect mjlab -o elbow.npz",
    );
    assert!(
        run.words.contains("W913") && run.words.contains("right_elbow"),
        "{}",
        run.words
    );
    assert!(!folder.join("x.pkl").exists() && !folder.join("x.npz").exists());
}

#[test]
fn limits_are_reported_kept_or_refused() {
    let folder = folder();
    let folder = folder.path();
    let eval = "eval take.csv --fps 60 -m slerp --robot robot.xml --dialect mjlab";
    let reported = line(folder, &format!("{eval} -o report.npz"));
    assert!(
        reported.words.contains("W904") && reported.words.contains("left_shoulder"),
        "{}",
        reported.words
    );
    line(folder, &format!("{eval} --limits clamp -o clamp.npz"));
    refused(
        folder,
        &format!("{eval} --limits refuse -o refuse.npz"),
        "E919",
    );
    let [report, clamp] = ["report.npz", "clamp.npz"].map(|file| arrays(&folder.join(file)));
    let joints = report["joint_pos"].iter().zip(&clamp["joint_pos"]);
    let rates = report["joint_vel"].iter().zip(&clamp["joint_vel"]);
    let mut clamped = 0;
    for (index, ((before, after), (rate, kept))) in joints.zip(rates).enumerate() {
        if index % 4 == 0 && *before > 0.25 {
            assert_eq!((*after, *kept), (0.25, 0.0));
            clamped += 1;
        } else {
            assert_eq!((before, rate), (after, kept));
        }
    }
    assert!(clamped > 5, "{clamped}");
}

#[test]
fn options_without_effect_are_refused() {
    let folder = folder();
    let folder = folder.path();
    refused(
        folder,
        "eval take.csv --robot robot.xml --dialect mjlab --fps 29.5 -o x.npz",
        "E918",
    );
    for words in [
        "eval take.csv --dialect mjlab -o x.npz",
        "eval take.csv --robot robot.xml --body-order breadth-first -o x.npz",
        "eval take.csv --robot robot.xml --dialect mjlab --fps 50 -o x.csv",
        "eval take.csv --robot robot.xml --dialect gmr --fps 50 --to npz -o x",
        "eval take.csv --robot robot.xml --dialect gmr --fps 50 --describe -o x.pkl",
        "eval take.csv --robot robot.xml --dialect gmr --fps 50 --order wxyz -o x.pkl",
        "eval take.csv --robot robot.xml --dialect gmr --fps 50 --quantity euler -o x.pkl",
        "eval take.csv --robot robot.xml --dialect gmr --at keys -o x.pkl",
        "convert take.csv --robot robot.xml --dialect gmr --sequence XYZ -o x.pkl",
        "eval take.csv --robot take.csv --fps 50 -o x.npz",
    ] {
        let run = run_words(folder, words);
        assert_ne!(run.code, 0, "{words}: {}", run.words);
    }
    let files = fs::read_dir(folder).unwrap().count();
    assert_eq!(files, 2, "nothing is written");
}

/// Limits without a dialect: of clips, and of joints alone, whose velocities are 0 where they are kept inside.
#[test]
fn limits_hold_in_every_result() {
    let folder = folder();
    let folder = folder.path();
    let eval = "eval take.csv --fps 60 -m slerp --robot robot.xml";
    for (result, of) in [
        ("clip.npz", ""),
        ("joints.npy", "--quantity scalars"),
        ("rates.npy", "--quantity scalar-velocities"),
    ] {
        let reported = line(folder, &format!("{eval} {of} -o report_{result}"));
        assert!(
            reported.words.contains("W904") && reported.words.contains("left_shoulder"),
            "{}",
            reported.words
        );
        line(folder, &format!("{eval} {of} --limits clamp -o {result}"));
        refused(
            folder,
            &format!("{eval} {of} --limits refuse -o no_{result}"),
            "E919",
        );
        assert!(!folder.join(format!("no_{result}")).exists());
    }
    let numbers = |file: &str| {
        let bytes = fs::read(folder.join(file)).unwrap();
        tumble_formats::npy::read_numbers(file, &bytes, |_| Ok(()))
            .unwrap()
            .values
    };
    let [before, after] = ["report_joints.npy", "joints.npy"].map(numbers);
    let [rates_before, rates_after] = ["report_rates.npy", "rates.npy"].map(numbers);
    let mut clamped = 0;
    for (index, (before, after)) in before.iter().zip(&after).enumerate() {
        let is_outside = index % 4 == 0 && *before > 0.25;
        assert_eq!(*after, if is_outside { 0.25 } else { *before });
        assert_eq!(
            rates_after[index],
            if is_outside { 0.0 } else { rates_before[index] }
        );
        clamped += usize::from(is_outside);
    }
    assert!(clamped > 5, "{clamped}");
    assert!(
        arrays(&folder.join("clip.npz"))["scalars"]
            .iter()
            .take(61)
            .all(|value| *value <= 0.25)
    );
    refused(
        folder,
        "convert take.csv --robot robot.xml --limits clamp -o x.npz",
        "tumble eval",
    );
    refused(
        folder,
        "eval take.csv --limits clamp --fps 60 -o x.npz",
        "--robot",
    );
}

/// A robot in several files: results are made again where an included one has changed.
#[test]
fn included_files_belong_to_the_robot() {
    let folder = folder();
    let folder = folder.path();
    let (start, end) = (
        ROBOT.find("<worldbody>").unwrap(),
        ROBOT.find("</mujoco>").unwrap(),
    );
    let body = format!("<mujoco>{}</mujoco>", &ROBOT[start..end]);
    fs::write(folder.join("body.xml"), &body).unwrap();
    let main = format!("{}<include file=\"body.xml\"/></mujoco>", &ROBOT[..start]);
    fs::write(folder.join("robot.xml"), main).unwrap();
    fs::create_dir(folder.join("takes")).unwrap();
    fs::copy(folder.join("take.csv"), folder.join("takes/a.csv")).unwrap();
    let eval = "eval takes -o out --fps 50 --robot robot.xml --dialect mjlab --resume";
    line(folder, eval);
    let first = fs::read(folder.join("out/a.npz")).unwrap();
    fs::write(
        folder.join("body.xml"),
        body.replace("0 0.2 0.3", "0 0.25 0.3"),
    )
    .unwrap();
    line(folder, eval);
    assert_ne!(fs::read(folder.join("out/a.npz")).unwrap(), first);
}

/// The commands of the guides about robots, features and other skeletons do what they say.
#[test]
fn commands_of_the_guides_run() {
    let folder = folder();
    let folder = folder.path();
    for name in ["arm.xml", "g1.xml"] {
        fs::write(folder.join(name), ROBOT).unwrap();
    }
    line(
        folder,
        "convert take.csv --robot robot.xml --dialect gmr -o walk.pkl",
    );
    let human = crate::retarget::human(|role| role);
    for name in ["walk.bvh", "take.bvh"] {
        fs::write(folder.join(name), &human).unwrap();
    }
    line(folder, "convert take.bvh -o character.glb");
    fs::write(
        folder.join("bones.json"),
        r#"{"hips": "hips", "spine": "spine", "head": "head"}"#,
    )
    .unwrap();
    fs::write(folder.join("log.csv"), "time,knee_deg\n0,10\n1,20\n").unwrap();
    let mut log = zip::ZipWriter::new(fs::File::create(folder.join("log.npz")).unwrap());
    for (name, shape, count) in [("t", "(2,)", 2), ("joint_pos", "(2, 7)", 14)] {
        let numbers: Vec<f64> = (0..count).map(f64::from).collect();
        log.start_file(
            format!("{name}.npy"),
            zip::write::SimpleFileOptions::default(),
        )
        .unwrap();
        std::io::Write::write_all(&mut log, &crate::features::npy(shape, &numbers)).unwrap();
    }
    log.finish().unwrap();
    fs::create_dir(folder.join("data")).unwrap();
    let arm = crate::program::root().join("data/arm.xml");
    fs::copy(arm, folder.join("data/arm.xml")).unwrap();
    let mut count = 0;
    for (guide, takes) in [
        ("robots", "take.csv"),
        ("features", "take.csv"),
        ("retarget", "take.bvh"),
    ] {
        let _ = fs::remove_dir_all(folder.join("takes"));
        fs::create_dir(folder.join("takes")).unwrap();
        fs::copy(folder.join(takes), folder.join("takes").join(takes)).unwrap();
        let text =
            fs::read_to_string(crate::program::root().join(format!("docs/{guide}.md"))).unwrap();
        // Models of bodies are not free.
        let commands = text
            .lines()
            .filter(|line| line.starts_with("tumble ") && !line.contains("amass"));
        for words in commands {
            let command = words.split(" # ").next().unwrap();
            let command = command.replace('\'', "");
            let _ = fs::remove_dir_all(folder.join("out"));
            let parts: Vec<&str> = command.split_whitespace().skip(1).collect();
            if let Some(out) = parts.iter().position(|part| *part == "-o") {
                let made = folder.join(parts[out + 1]);
                // A command before may have made an input of the same name.
                if made.is_file() && !parts[..out].contains(&parts[out + 1]) {
                    fs::remove_file(made).unwrap();
                }
            }
            let _ = fs::remove_file(folder.join("pairs.json"));
            let run = run(folder, &parts);
            assert_eq!(run.code, 0, "docs/{guide}.md: {words}: {}", run.words);
            count += 1;
        }
    }
    assert!(count >= 15, "{count}");
}

/// Only the joints, as numbers: an array (frames, joints), and columns with their names.
#[test]
fn scalars_are_evaluated_alone() {
    let folder = folder();
    let folder = folder.path();
    let eval = "eval take.csv --fps 50 --robot robot.xml";
    line(folder, &format!("{eval} --dialect mjlab -o bodies.npz"));
    let bodies = arrays(&folder.join("bodies.npz"));
    for (output, array) in [("scalars", "joint_pos"), ("scalar-velocities", "joint_vel")] {
        line(
            folder,
            &format!("{eval} --quantity {output} -o {output}.npy"),
        );
        let bytes = fs::read(folder.join(format!("{output}.npy"))).unwrap();
        let found = tumble_formats::npy::read_numbers(output, &bytes, |_| Ok(())).unwrap();
        assert_eq!(
            (found.shape, &found.values),
            (vec![51, 4], &bodies[array]),
            "{output}"
        );
    }
    line(folder, &format!("{eval} --quantity scalars -o scalars.csv"));
    let text = fs::read_to_string(folder.join("scalars.csv")).unwrap();
    let heading = "frame,time,left_shoulder,left_elbow,right_shoulder,right_elbow";
    assert_eq!(text.lines().next(), Some(heading));
    let last: Vec<f32> = text
        .lines()
        .last()
        .unwrap()
        .split(',')
        .map(|cell| cell.parse().unwrap())
        .collect();
    let joints = bodies["joint_pos"].last_chunk::<4>().unwrap();
    let joints = joints.map(|value| value as f32);
    assert_eq!(last, [&[50.0, 1.0], &joints[..]].concat());
    // Without the robot, joints are numbered, and their angles are not unwrapped.
    let run = line(
        folder,
        "eval take.csv --fps 10 --quantity scalar-accelerations -o a.csv",
    );
    assert!(run.words.contains("4 scalars"), "{}", run.words);
    assert!(
        run.words
            .contains("left out: the rotations, the translations; -o"),
        "{}",
        run.words
    );
    fs::write(folder.join("a.tum"), "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n").unwrap();
    for words in [
        "eval a.tum --quantity scalars --fps 30 -o x.npy",
        "eval take.csv --quantity scalars --fps 30 --tracks 0 -o x.npy",
        "eval take.csv --quantity scalars --fps 30 --order wxyz -o x.npy",
        "eval take.csv --quantity scalars --fps 30 --axes parent -o x.npy",
        "eval take.csv --quantity scalars --fps 30 -o x.glb",
    ] {
        let run = run_words(folder, words);
        assert_ne!(run.code, 0, "{words}: {}", run.words);
    }
    assert!(!folder.join("x.npy").exists());
}

/// Joints stay within the tolerance at all samples, as the file is read again.
#[test]
fn reduced_joints_stay_within_the_tolerance() {
    let folder = folder();
    let folder = folder.path();
    let scalars = |file: &str| {
        let eval = format!("eval {file} --fps 30 --quantity scalars --overwrite -o s.npy");
        line(folder, &eval);
        let bytes = fs::read(folder.join("s.npy")).unwrap();
        let found = tumble_formats::npy::read_numbers(file, &bytes, |_| Ok(()));
        found.unwrap().values
    };
    let reduce = "reduce take.csv --robot robot.xml --tolerance 4deg --distance 10 -o few.npz";
    let run = line(folder, reduce);
    assert!(run.words.contains(" times fewer"), "{}", run.words);
    let error = largest_difference(&scalars("few.npz"), &scalars("take.csv"));
    let bound = 4f64.to_radians();
    assert!(error > 0.1 * bound && error <= bound * 1.0001, "{error}");
}

/// Batches in the layout of another program are resumed, and made again where the robot is another.
#[test]
fn batches_of_robots_are_resumed() {
    let folder = folder();
    let folder = folder.path();
    fs::create_dir_all(folder.join("takes/more")).unwrap();
    for name in ["takes/a.csv", "takes/more/b.csv"] {
        fs::copy(folder.join("take.csv"), folder.join(name)).unwrap();
    }
    let eval = "eval takes -o out --fps 50 --robot robot.xml --dialect mjlab --resume";
    line(folder, eval);
    let bytes = fs::read(folder.join("out/more/b.npz")).unwrap();
    fs::remove_file(folder.join("out/a.npz")).unwrap();
    let again = line(folder, eval);
    assert!(again.words.contains("1 "), "{}", again.words);
    assert_eq!(fs::read(folder.join("out/a.npz")).unwrap(), bytes);
    fs::write(
        folder.join("robot.xml"),
        ROBOT.replace("0 0.2 0.3", "0 0.25 0.3"),
    )
    .unwrap();
    line(folder, eval);
    assert_ne!(fs::read(folder.join("out/more/b.npz")).unwrap(), bytes);
    line(
        folder,
        "eval takes -o plain --fps 50 --robot robot.xml --to npz",
    );
    let info = line(folder, "info plain/a.npz");
    assert!(String::from_utf8(info.out).unwrap().contains("left_elbow"));
}

/// The motion of `pico` in every layout of the test data, at 30 and 50 frames a second: joints and bodies as `MuJoCo`
/// has them, with the last frame; and by differences as mjlab and `BeyondMimic` compute it, which lose the last.
#[test]
fn files_of_other_programs_become_those_of_mjlab() {
    let shared = crate::program::root().join("../shared/data/robots");
    if !shared.is_dir() {
        eprintln!("{} is not there: nothing compared", shared.display());
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let expected = arrays(&shared.join("layouts/expected.npz"));
    let text = |path: PathBuf| path.to_str().unwrap().to_owned();
    let (pico, urdf) = (
        text(shared.join("robots/pico.xml")),
        text(shared.join("robots/pico.urdf")),
    );
    let check = |found: &HashMap<String, Vec<f64>>,
                 of: &str,
                 rows: Option<usize>,
                 lin: &str,
                 velocity_rows: usize| {
        for name in [
            "joint_pos",
            "joint_vel",
            "body_pos_w",
            "body_quat_w",
            "body_lin_vel_w",
            "body_ang_vel_w",
        ] {
            let array = if name == "body_lin_vel_w" { lin } else { name };
            let (found, expected) = (&found[name], &expected[&format!("{of}_{array}")]);
            let width = match name {
                "joint_pos" | "joint_vel" => 13,
                "body_quat_w" => 17 * 4,
                _ => 17 * 3,
            };
            let is_rate = name.contains("vel");
            let rows = if is_rate && velocity_rows > 0 {
                Some(velocity_rows)
            } else {
                rows
            };
            let count = rows.map_or(expected.len(), |rows| rows * width);
            if rows.is_none() {
                assert_eq!(found.len(), expected.len(), "{of} {name}");
            }
            let pairs = found[..count].iter().zip(&expected[..count]);
            let off = match name {
                // Either sign is the same rotation.
                "body_quat_w" => found[..count]
                    .chunks(4)
                    .zip(expected[..count].chunks(4))
                    .map(|(a, b)| {
                        let apart = |sign: f64| -> f64 {
                            a.iter().zip(b).map(|(a, b)| (a - sign * b).abs()).sum()
                        };
                        apart(1.0).min(apart(-1.0))
                    })
                    .fold(0.0, f64::max),
                _ => pairs
                    .map(|(a, b)| (a - b).abs() / b.abs().max(1.0))
                    .fold(0.0, f64::max),
            };
            assert!(off < 1e-5, "{of} {name}: {off:e}");
        }
    };
    for (file, options) in [
        ("gmr_p2.pkl", ""),
        ("gmr_p5.pkl", ""),
        ("motion_lib_lz4.pkl", ""),
        ("protomotions.motion", ""),
        ("mimickit.pkl", ""),
        ("isaaclab_amp.npz", ""),
        ("unitree_lafan1.csv", ""),
        ("kimodo_qpos.csv", "--source-order wxyz"),
        ("bones_seed_g1.csv", "--source-fps 30"),
    ] {
        let input = text(shared.join("layouts").join(file));
        for fps in [30, 50] {
            let out = format!("{file}.{fps}.npz");
            let eval = format!(
                "eval {input} {options} -m slerp --fps {fps} --robot {pico} --dialect mjlab -o {out}"
            );
            line(folder, &eval);
            check(
                &arrays(&folder.join(out)),
                &format!("exact{fps}"),
                None,
                "body_lin_vel_w",
                0,
            );
        }
    }
    let input = text(shared.join("layouts/gmr_p4.pkl"));
    let eval = format!("eval {input} -m slerp --fps 50 --dialect");
    // The base of a robot without a free joint moves as its root does.
    line(folder, &format!("{eval} mjlab --robot {urdf} -o urdf.npz"));
    check(
        &arrays(&folder.join("urdf.npz")),
        "exact50",
        None,
        "body_lin_vel_w",
        0,
    );
    line(
        folder,
        &format!("{eval} mjlab --velocity-at mass --robot {pico} -o mass.npz"),
    );
    check(
        &arrays(&folder.join("mass.npz")),
        "exact50",
        None,
        "body_com_lin_vel_w",
        0,
    );
    line(
        folder,
        &format!("{eval} mjlab --velocities differences --robot {pico} -o peers.npz"),
    );
    let peers = arrays(&folder.join("peers.npz"));
    // In the last row, the difference is one-sided.
    check(&peers, "peer50", Some(50), "body_lin_vel_w", 49);
    assert_eq!(peers["joint_pos"].len(), 51 * 13);
    // Files of these programs are read in their orders.
    for (file, of) in [
        ("mjlab.npz", "body_lin_vel_w"),
        ("beyondmimic.npz", "body_com_lin_vel_w"),
    ] {
        let input = text(shared.join("layouts").join(file));
        let point = if of == "body_lin_vel_w" {
            "origin"
        } else {
            "mass"
        };
        let out = format!("again.{file}");
        line(
            folder,
            &format!(
                "convert {input} --robot {pico} --dialect mjlab --velocity-at {point} \
                               --velocities differences -o {out}"
            ),
        );
        check(&arrays(&folder.join(out)), "peer50", Some(50), of, 49);
    }
}

/// Tables of differences have a row for each scalar; pictures have none of them, and say so.
#[test]
fn scalars_are_compared_one_by_one_and_told_where_they_are_not_drawn() {
    let temporary = folder();
    let folder = temporary.path();
    let text = take();
    let lines = text.lines().enumerate().map(|(frame, line)| match frame {
        10 => {
            let (others, last) = line.rsplit_once(',').unwrap();
            format!("{others},{}\n", last.parse::<f64>().unwrap() + 0.1)
        }
        _ => format!("{line}\n"),
    });
    fs::write(folder.join("bent.csv"), lines.collect::<String>()).unwrap();
    let compared = line(folder, "compare take.csv bent.csv --robot robot.xml --csv");
    let text = String::from_utf8(compared.out).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|row| row.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|it| *it == name).unwrap();
    let scalars: Vec<&Vec<&str>> = rows[1..]
        .iter()
        .filter(|row| row[column("scalar_kind")] == "angle")
        .collect();
    let names: Vec<&str> = scalars.iter().map(|row| row[column("joint")]).collect();
    assert_eq!(scalars.len(), 4, "{text}");
    assert_eq!(names[0], "right_elbow", "the worst first: {text}");
    let worst: f64 = scalars[0][column("scalar_largest")].parse().unwrap();
    assert!((worst - 0.1f64.to_degrees()).abs() < 1e-4, "{text}");
    assert_eq!(scalars[0][column("scalar_frame")], "10");
    assert_eq!(scalars[1][column("scalar_largest")], "0");
    let top = line(
        folder,
        "compare take.csv bent.csv --robot robot.xml --csv --top 1",
    );
    assert_eq!(String::from_utf8(top.out).unwrap().lines().count(), 3);

    for drawing in [
        "plot take.csv -o o.svg",
        "view take.csv -o o.html",
        "render take.csv -o o.png",
    ] {
        let drawn = line(folder, &format!("{drawing} --robot robot.xml --device cpu"));
        let note = "take.csv: 4 scalars are not drawn";
        assert!(drawn.words.contains(note), "{drawing}: {}", drawn.words);
    }
    let unnamed = line(folder, "info take.csv");
    let both = String::from_utf8(unnamed.out).unwrap() + &unnamed.words;
    assert!(
        both.contains("W906") && both.contains("--robot FILE"),
        "{both}"
    );
}

/// Catches root motion that is left in, velocities of joints that change with it, and options without effect.
#[test]
fn roots_stay_in_place_or_are_carried() {
    let folder = folder();
    let folder = folder.path();
    let eval = "eval take.csv --robot robot.xml --vertical z";
    for (rule, out) in [("keep", "kept"), ("in-place", "still")] {
        let root = match rule {
            "keep" => "eval take.csv --robot robot.xml".to_owned(),
            rule => format!("{eval} --root-motion {rule}"),
        };
        line(folder, &format!("{root} --fps 50 -o {out}.npz"));
        line(
            folder,
            &format!("{root} --fps 50 --dialect mjlab -o {out}-mjlab.npz"),
        );
    }
    let [kept, still] = ["kept.npz", "still.npz"].map(|file| arrays(&folder.join(file)));
    let root = |arrays: &HashMap<String, Vec<f64>>| arrays["translations"].clone();
    assert!(root(&kept).chunks(3).any(|position| position[0] > 0.9));
    assert!(
        root(&still)
            .chunks(3)
            .all(|position| position[..2] == [0.0, 0.0] && position[2] == 1.0)
    );
    // The chest turns about z alone.
    let rotations = still["rotations"].chunks(4);
    assert!(
        rotations
            .into_iter()
            .all(|rotation| rotation[..3].iter().all(|part| part.abs() < 1e-7))
    );
    let [kept, still] =
        ["kept-mjlab.npz", "still-mjlab.npz"].map(|file| arrays(&folder.join(file)));
    for array in ["joint_pos", "joint_vel"] {
        assert_eq!(kept[array], still[array], "{array}");
    }
    let numbers_of_row = 4 * still["body_pos_w"].len() / still["joint_pos"].len();
    assert!(
        still["body_pos_w"]
            .chunks(numbers_of_row)
            .all(|row| row[..2].iter().all(|part| part.abs() < 1e-6))
    );
    line(
        folder,
        &format!("{eval} --root-motion extract --fps 50 -o carried.npz"),
    );
    let json = String::from_utf8(line(folder, "info carried.npz --json").out).unwrap();
    assert!(json.contains("root_motion"), "{json}");
    for (more, says) in [
        (
            "--vertical z -o a.npz",
            "--vertical has no effect on roots that keep their motion",
        ),
        (
            "--root-motion in-place --quantity scalars -o a.csv",
            "--root-motion changes translations as well as rotations",
        ),
        (
            "--root-motion extract --dialect mjlab --fps 50 -o a.npz",
            "which has no joint for it",
        ),
        (
            "--root-motion in-place --root-joint hand -o a.npz",
            "no joint is called `hand`",
        ),
    ] {
        refused(
            folder,
            &format!("eval take.csv --robot robot.xml {more}"),
            says,
        );
    }
}
