//! Results keep what the data of their inputs belong to: rates, clocks, joints, positions, names. What is assumed is
//! said, and what cannot be is refused.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::program::{Run, root, run, sample_folder, succeed};
use crate::robots::{ROBOT, take};

fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

fn line(folder: &Path, line: &str) -> Run {
    succeed(folder, &words(line))
}

/// The command fails, with this in its message; the result is not there.
fn refused(folder: &Path, line: &str, part: &str) {
    let run = run(folder, &words(line));
    assert_ne!(run.code, 0, "{line}");
    assert!(run.words.contains(part), "{line}: {}", run.words);
    let out = line.split(" -o ").nth(1).unwrap_or("none");
    let out = out.split_whitespace().next().unwrap();
    assert!(!folder.join(out).is_file(), "{line}");
}

fn says(run: &Run, part: &str) {
    assert!(run.words.contains(part), "{part}: {}", run.words);
}

/// A robot with a slide, a hinge, and a hinge that follows it the other way round.
const CLAW: &str = r#"<robot name="claw"><link name="base"/><link name="arm"/><link name="a"/><link name="b"/>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1"/></joint>
  <joint name="grip" type="revolute"><parent link="arm"/><child link="a"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1"/></joint>
  <joint name="mirror" type="revolute"><parent link="arm"/><child link="b"/><axis xyz="0 1 0"/>
    <mimic joint="grip" multiplier="-1"/></joint></robot>"#;

const CLAW_TAKE: &str = "\
time,lift,grip,mirror
0,0.1,0.2,-0.2
0.1,0.2,0.3,-0.3
0.2,0.3,0.5,-0.45
";

const CLAW_MAP: &str =
    "--map time=time,lift=lift:scalar:length,grip=grip:scalar:angle,mirror=mirror:scalar:angle";

fn claw() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("claw.urdf"), CLAW).unwrap();
    fs::write(folder.path().join("take.csv"), CLAW_TAKE).unwrap();
    folder
}

#[test]
fn joints_that_follow_others_are_computed() {
    let temporary = claw();
    let folder = temporary.path();
    let eval = format!("eval take.csv {CLAW_MAP} --robot claw.urdf --fps 10 --json -o out.npz");
    let made = line(folder, &eval);
    says(
        &made,
        "warning[W916]: joint `mirror` follows `grip` (mimic), and is computed from it; the file's values are up to \
         5.00e-2 from these",
    );
    let info = line(folder, "info out.npz --json");
    let info: Value = serde_json::from_slice(&info.out).unwrap();
    let names = info[0]["scalars"].as_array().unwrap().iter();
    let names: Vec<&str> = names
        .map(|scalar| scalar["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["lift", "grip"]);
}

#[test]
fn a_slide_is_not_written_in_degrees() {
    let temporary = claw();
    let eval = format!(
        "eval take.csv {CLAW_MAP} --robot claw.urdf --fps 10 --dialect bones-seed -o out.csv"
    );
    refused(
        temporary.path(),
        &eval,
        "`lift` slides, and bones-seed has an angle in degrees",
    );
}

#[test]
fn limits_that_cross_are_refused() {
    let temporary = claw();
    let folder = temporary.path();
    let crossed = CLAW.replace("lower=\"0\" upper=\"1\"", "lower=\"1\" upper=\"0\"");
    fs::write(folder.join("crossed.urdf"), crossed).unwrap();
    refused(
        folder,
        "info crossed.urdf",
        "error[E901]: the limits are 1 and 0; the smaller comes first",
    );
}

#[test]
fn an_order_of_joints_that_nothing_shows_is_said() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    fs::write(folder.join("robot.xml"), ROBOT).unwrap();
    fs::write(folder.join("take.csv"), take()).unwrap();
    let eval = "eval take.csv --robot robot.xml --dialect mjlab -f 30 -o";
    let made = line(folder, &format!("{eval} out.npz"));
    says(
        &made,
        "warning[W906]: the file does not name its joints, and has no bodies that would show their order",
    );
    let made = line(
        folder,
        &format!("{eval} stated.npz --source-body-order depth-first"),
    );
    assert!(!made.words.contains("W906"), "{}", made.words);
    // Angles in degrees, which exceed the limits of joints if they are read as radians.
    let degrees = take().lines().fold(String::new(), |mut text, line| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let cells = cells.iter().enumerate().map(|(index, cell)| match index {
            7.. => (cell.to_degrees() + 100.0).to_string(),
            _ => cell.to_string(),
        });
        let _ = writeln!(text, "{}", cells.collect::<Vec<_>>().join(","));
        text
    });
    fs::write(folder.join("degrees.csv"), degrees).unwrap();
    let made = line(
        folder,
        "eval degrees.csv --robot robot.xml --dialect mjlab -f 30 -o far.npz",
    );
    says(&made, " rad (first at 0.03");
    says(&made, "are the file's angles in degrees?");
}

/// A robot's z points up: what moves over the ground is x and y.
#[test]
fn the_ground_of_a_robot_is_x_and_y() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    fs::write(folder.join("robot.xml"), ROBOT).unwrap();
    fs::write(folder.join("take.csv"), take()).unwrap();
    let eval =
        "eval take.csv --robot robot.xml --dialect unitree-csv -f 30 --root-motion in-place -o";
    line(folder, &format!("{eval} default.csv"));
    line(folder, &format!("{eval} stated.csv --vertical z"));
    let [found, stated] =
        ["default.csv", "stated.csv"].map(|name| fs::read(folder.join(name)).unwrap());
    assert_eq!(found, stated);
    let text = String::from_utf8(found).unwrap();
    for row in text.lines() {
        let numbers: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        assert!(
            numbers[0].abs() < 1e-6 && numbers[1].abs() < 1e-6 && (numbers[2] - 1.0).abs() < 1e-6
        );
    }
}

#[test]
fn positions_are_found_beside_orientations_and_never_invented() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let mut ros = "%time,field.pose.position.x,field.pose.position.y,field.pose.position.z,\
                   field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,\
                   field.pose.orientation.w\n"
        .to_owned();
    let mut imu = "t,qx,qy,qz,qw\n".to_owned();
    for key in 0..20 {
        let _ = writeln!(
            ros,
            "{},{key},2,3,0,0,0,1",
            1_700_000_000_000_000_000u64 + key * 50_000_000
        );
        let _ = writeln!(imu, "{},0,0,0,1", key as f64 / 20.0);
    }
    fs::write(folder.join("ros.csv"), ros).unwrap();
    fs::write(folder.join("imu.csv"), imu).unwrap();
    let made = line(folder, "convert ros.csv --map time=%time -o ros.tum");
    assert!(!made.words.contains("W214"), "{}", made.words);
    let poses = fs::read_to_string(folder.join("ros.tum")).unwrap();
    assert!(
        poses.lines().last().unwrap().ends_with(" 19 2 3 0 0 0 1"),
        "{poses}"
    );
    for result in ["imu.tum", "imu.kitti"] {
        let made = line(folder, &format!("convert imu.csv -o {result}"));
        says(
            &made,
            "warning[W214]: the clip has no positions; 0 0 0 is written for all poses",
        );
    }
    refused(
        folder,
        "compare imu.csv imu.csv --ape",
        "imu.csv has no positions",
    );
}

/// Text that `numpy.savetxt` writes of Unix times: 20 Hz, exact to the step of an f64.
#[test]
fn digits_of_an_f64_show_its_rate() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let mut text = String::new();
    for key in 0..40 {
        let time = 1_700_000_000.0 + f64::from(key) * 0.05;
        let _ = writeln!(text, "{time:.18e} {key} 0 0 0 0 0 1");
    }
    fs::write(folder.join("log.tum"), text).unwrap();
    let made = line(folder, "eval log.tum -o out.tum");
    says(&made, "1 track × 40 frames");
    let other = "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n";
    fs::write(folder.join("other.tum"), other).unwrap();
    refused(
        folder,
        "compare log.tum other.tum --ape",
        "log.tum from 1700000000 to 1700000001.95 s, other.tum from 0 to 1 s; both must use the same clock",
    );
}

/// A clip that was evaluated at a rate has this rate when it is read again, though its end lies between two frames.
#[test]
fn a_second_step_has_the_rate_of_the_first() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let walk = root().join("data/walk.bvh");
    fs::copy(walk, folder.join("walk.bvh")).unwrap();
    for (rate, name) in [("12", "12"), ("30000/1001", "ntsc")] {
        for format in ["npz", "glb", "parquet", "csv"] {
            let first = format!("first-{name}.{format}");
            line(folder, &format!("eval walk.bvh --fps {rate} -o {first}"));
            let made = line(folder, &format!("eval {first} -o second.bvh --overwrite"));
            assert!(!made.words.contains("no rate"), "{first}: {}", made.words);
            let second = fs::read_to_string(folder.join("second.bvh")).unwrap();
            let period = second
                .lines()
                .find_map(|line| line.strip_prefix("Frame Time: "))
                .unwrap();
            let period: f64 = period.parse().unwrap();
            let expected = if name == "12" {
                1.0 / 12.0
            } else {
                1001.0 / 30_000.0
            };
            assert!((period - expected).abs() < 1e-9, "{first}: {period}");
        }
    }
}

#[test]
fn a_loop_that_does_not_close_is_not_smoothed_silently() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    // A turn that ends between two frames of 10 a second, and one that does not come back.
    fs::write(
        folder.join("between.dat"),
        "# 1 1\n0 1 0 0 0\n0.5 0.8 0.6 0 0\n0.95 1 0 0 0\n",
    )
    .unwrap();
    fs::write(
        folder.join("open.dat"),
        "# 1 1\n0 1 0 0 0\n0.5 0.8 0.6 0 0\n1 0.8 0.6 0 0\n",
    )
    .unwrap();
    let smooth = "--fps 10 --kernel gaussian:1 --edges loop -o out.csv";
    refused(
        folder,
        &format!("smooth between.dat {smooth}"),
        "--edges loop needs a sample at the end of the clip, 0.95 s, where the loop closes, and the last is at 0.9 s; \
         --fps 20 has one",
    );
    let made = line(folder, &format!("smooth open.dat {smooth}"));
    says(
        &made,
        "--edges loop joins the last sample to the first, but they are up to 73.7° apart",
    );
}

#[test]
fn a_picture_of_nothing_is_refused() {
    let temporary = claw();
    let folder = temporary.path();
    line(folder, &format!("convert take.csv {CLAW_MAP} -o take.npz"));
    refused(
        folder,
        "plot take.npz -o p.png",
        "take.npz: has no tracks of rotations, only 3 scalars; --show scalars draws them",
    );
    refused(
        folder,
        "eval take.npz --fps 10 -o p.npy",
        "only 3 scalars; write NPZ, CSV or Parquet, or add --quantity scalars",
    );
    refused(
        folder,
        "render take.npz -o p.png",
        "has no tracks of rotations, only 3 scalars",
    );
    line(folder, "plot take.npz --show scalars -o p.png");
}

/// A file whose second animation has a sampler that is not there.
const BROKEN: &str = r#"{"asset":{"version":"2.0"},"nodes":[{}],
"buffers":[{"uri":"data:application/octet-stream;base64,AAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/AAAAAA==","byteLength":40}],
"bufferViews":[{"buffer":0,"byteLength":40}],
"accessors":[{"bufferView":0,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[1]},
{"bufferView":0,"byteOffset":8,"componentType":5126,"count":2,"type":"VEC4"}],
"animations":[{"name":"one","channels":[{"sampler":0,"target":{"node":0,"path":"rotation"}}],"samplers":[{"input":0,"output":1}]},
{"name":"two","channels":[{"sampler":7,"target":{"node":0,"path":"rotation"}}],"samplers":[{"input":0,"output":1}]}]}"#;

#[test]
fn an_animation_that_cannot_be_read_is_not_written_again() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    fs::write(folder.join("broken.gltf"), BROKEN).unwrap();
    for command in [
        "eval broken.gltf --fps 30",
        "convert broken.gltf",
        "reduce broken.gltf --tolerance 1deg",
    ] {
        let part = "the result would contain the animation that cannot be read; repair or remove it, or write another format";
        refused(folder, &format!("{command} -o out.glb"), part);
    }
}

/// Names in JSON are those of the files, not as a terminal shows them.
#[cfg(unix)]
#[test]
fn json_has_the_names_of_files() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir(folder.join("in")).unwrap();
    for name in ["a\nb.dat", "a\\nb.dat"] {
        fs::copy(folder.join("a.dat"), folder.join("in").join(name)).unwrap();
    }
    let made = line(folder, "eval in -o out --json --device cpu");
    let records: Vec<Value> = serde_json::from_slice(&made.out).unwrap();
    let names: Vec<&str> = records
        .iter()
        .map(|it| it["input"].as_str().unwrap())
        .collect();
    assert_eq!(names.len(), 2);
    assert!(
        names.contains(&"in/a\nb.dat") && names.contains(&"in/a\\nb.dat"),
        "{names:?}"
    );
}

/// A dry run says of which inputs it is known that they fail.
#[test]
fn a_dry_run_names_what_failed_before() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir(folder.join("in")).unwrap();
    for name in ["a.dat", "bad.dat"] {
        fs::copy(folder.join(name), folder.join("in").join(name)).unwrap();
    }
    let made = run(folder, &words("eval in -o out --device cpu"));
    assert_eq!(made.code, 3, "{}", made.words);
    says(&made, "1 of 2 inputs failed");
    let dry = line(folder, "eval in -o out --resume --dry-run --device cpu");
    let text = String::from_utf8(dry.out.clone()).unwrap() + &dry.words;
    assert!(
        text.contains("in/bad.dat → out/bad.npy (it failed in the last run (E020))"),
        "{text}"
    );
    assert!(
        text.contains("1 result would be made (1 of inputs that failed in the last run)"),
        "{text}"
    );
    // If an input cannot be read any more, its result belongs to other bytes of the input.
    fs::write(folder.join("in/a.dat"), "# 2 3\n0 1 0 0\n").unwrap();
    let again = run(folder, &words("eval in -o out --resume --device cpu"));
    says(
        &again,
        "1 failed input has a result of an earlier run, made from other bytes, which stay: out/a.npy is the first",
    );
    fs::copy(folder.join("b.dat"), folder.join("in/a.dat")).unwrap();
    fs::remove_file(folder.join("out/a.npy")).unwrap();
    let check = run(folder, &words("check out"));
    says(&check, "1 of 1 result missing or unreadable");
}

/// Loaders of robots' motions look for `*.pkl`.
#[test]
fn pickles_are_called_pkl() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    fs::create_dir(folder.join("in")).unwrap();
    fs::write(folder.join("robot.xml"), ROBOT).unwrap();
    fs::write(folder.join("in/take.csv"), take()).unwrap();
    line(
        folder,
        "eval in --robot robot.xml --dialect gmr -f 30 -o out",
    );
    assert!(folder.join("out/take.pkl").is_file());
    refused(
        folder,
        "eval in/take.csv --robot robot.xml --dialect gmr -f 30 --velocity-at mass -o mass.pkl",
        "--velocity-at has no effect on gmr",
    );
}

/// The message is about the input, not about an output that would also be refused; and no empty report looks like a
/// success.
#[test]
fn inputs_that_do_not_exist_are_the_fault_that_is_reported() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let unmatched = run(folder, &words("eval nothing/*.bvh -o out"));
    assert_eq!(unmatched.code, 4, "{}", unmatched.words);
    says(&unmatched, "nothing/*.bvh: no file matches this pattern");
    assert!(!unmatched.words.contains("end the output"));
    let missing = run(folder, &words("verify none.dat --device cpu"));
    assert_eq!((missing.code, &*missing.out), (4, &b""[..]));
    says(&missing, "none.dat: error[E001]");
    // The unknown track is the only message.
    fs::copy(root().join("data/walk.bvh"), folder.join("walk.bvh")).unwrap();
    let unknown = run(folder, &words("eval walk.bvh --tracks nothing -o x.npy"));
    says(&unknown, "there is no `nothing`");
    assert!(!unknown.words.contains("W208"), "{}", unknown.words);
}

/// Frames of several clips are not the frames of one.
#[test]
fn the_clips_of_a_result_are_counted() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    fs::write(folder.join("m.gltf"), crate::attack::two_animations()).unwrap();
    let made = line(folder, "eval m.gltf --fps 10 -o out.glb");
    says(&made, "2 clips of 1 track, 22 frames in all");
}

/// Ranges are shown in words, not in Rust's syntax.
#[test]
fn numbers_out_of_range_are_refused_with_the_range() {
    let temporary = tempfile::tempdir().unwrap();
    for boxes in ["0", "65537", "many"] {
        let refused = run(
            temporary.path(),
            &["generate", "--boxes", boxes, "-o", "o.dat"],
        );
        assert_eq!(refused.code, 2, "{}", refused.words);
        says(&refused, "give a whole number from 1 to 65536");
    }
}

/// A joint of the input without a partner is named, and how far it rotates.
#[test]
fn rotations_that_are_lost_are_said() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let walk = fs::read_to_string(root().join("data/walk.bvh")).unwrap();
    let (hierarchy, motion) = walk.split_once("MOTION").unwrap();
    let (body, _) = hierarchy.rsplit_once('}').unwrap();
    let (heads, rows) = motion.split_at(motion.find("Frame Time").unwrap());
    let mut rows = rows.trim_end().lines();
    let mut text = format!(
        "{body}  JOINT Tail\n  {{\n    OFFSET 0 1 0\n    CHANNELS 3 Zrotation Xrotation Yrotation\n    End Site\n    \
         {{\n      OFFSET 0 1 0\n    }}\n  }}\n}}\nMOTION{heads}{}\n",
        rows.next().unwrap()
    );
    for row in rows {
        let _ = writeln!(text, "{row} 30 0 0");
    }
    fs::write(folder.join("tail.bvh"), text).unwrap();
    fs::write(folder.join("walk.bvh"), walk).unwrap();
    let made = line(folder, "retarget tail.bvh --onto walk.bvh -o out.bvh");
    says(
        &made,
        "warning[W917]: 1 joint of the input has no partner, so its rotations are lost; the largest is that of `Tail`, 30.0°",
    );
}

/// A robot with a wheel, whose angle has no limits.
const CART: &str = r#"<robot name="cart"><link name="base"/><link name="rim"/><joint name="wheel" type="continuous">
  <parent link="base"/><child link="rim"/><axis xyz="0 1 0"/></joint></robot>"#;

/// A wheel that turns for long has coarse angles in f32, and the step is said.
#[test]
fn coarse_steps_of_angles_are_said() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    fs::write(folder.join("cart.urdf"), CART).unwrap();
    for (name, last) in [("short", 100), ("long", 4000)] {
        let mut text = "t,wheel.scalar_angle\n".to_owned();
        for key in 0..=last {
            let angle = (2.5 * f64::from(key)).rem_euclid(std::f64::consts::TAU);
            let _ = writeln!(text, "{},{angle}", f64::from(key) / 4.0);
        }
        fs::write(folder.join(format!("{name}.csv")), text).unwrap();
    }
    let made = line(folder, "convert long.csv --robot cart.urdf -o long.npz");
    says(
        &made,
        "warning[W918]: `wheel` reaches 5001 rad on each side of its middle: keys are f32, whose steps are 4.9e-4 rad there; shorter \
         files have finer steps",
    );
    let made = line(folder, "convert short.csv --robot cart.urdf -o short.npz");
    assert!(!made.words.contains("W918"), "{}", made.words);
}

/// A wheel that turns by more than half a turn between two keys: its angles count turns, so that none was wrapped.
#[test]
fn angles_that_count_turns_are_not_unwrapped() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    fs::write(folder.join("cart.urdf"), CART).unwrap();
    for step in [4.0, -33.0] {
        let mut text = "t,wheel.scalar_angle\n".to_owned();
        for key in 0..=100 {
            let _ = writeln!(text, "{},{}", f64::from(key) / 10.0, step * f64::from(key));
        }
        fs::write(folder.join("wheel.csv"), text).unwrap();
        line(
            folder,
            "eval wheel.csv --robot cart.urdf --quantity scalars -o out.csv --overwrite",
        );
        let found = fs::read_to_string(folder.join("out.csv")).unwrap();
        let last = found.trim_end().rsplit([',', '\n']).next().unwrap();
        let last: f64 = last.parse().unwrap();
        assert!((last - 100.0 * step).abs() < 1e-3, "{found}");
    }
}

/// The states of a data set are the robot's joints, and its actions are left out, which is said.
#[test]
fn a_group_of_scalars_is_the_robot() {
    let temporary = claw();
    let folder = temporary.path();
    let column = |group: &str, joint: &str, kind: &str| format!("{group}{joint}.scalar_{kind}");
    let write = |name: &str, groups: &[&str]| {
        let joints = [("lift", "length"), ("grip", "angle")];
        let columns = groups
            .iter()
            .flat_map(|group| joints.map(|(joint, kind)| column(group, joint, kind)));
        let columns: Vec<String> = columns.collect();
        let mut text = format!("t,{}\n", columns.join(","));
        for row in 0..3 {
            let cells = (0..columns.len()).map(|cell| format!("0.{row}{cell}"));
            let _ = writeln!(text, "0.{row},{}", cells.collect::<Vec<_>>().join(","));
        }
        fs::write(folder.join(name), text).unwrap();
    };
    let both = ["observation.state.", "action."];
    write("both.csv", &both);
    let made = line(folder, "convert both.csv --robot claw.urdf -o both.npz");
    says(
        &made,
        "warning[W919]: the joints of the robot are those called `observation.state.…`; these scalars are left out: \
         `action.lift`, `action.grip`",
    );
    let info = line(folder, "info both.npz --json");
    let info: Value = serde_json::from_slice(&info.out).unwrap();
    let scalars = info[0]["scalars"].as_array().unwrap();
    assert_eq!(scalars.len(), 2, "{info}");
    assert_eq!(scalars[1]["name"], "grip");
    let largest = scalars[1]["range"][1].as_f64().unwrap();
    assert!((largest - 0.21).abs() < 1e-6, "{info}");
    write("two.csv", &["left.", "right."]);
    refused(
        folder,
        "convert two.csv --robot claw.urdf -o two.npz",
        "the file has the robot's joints more than once, as `left.…`, `right.…`",
    );
}

/// A table in text has no place for the limits of joints.
#[test]
fn limits_that_are_lost_are_said() {
    let temporary = claw();
    let folder = temporary.path();
    let convert = format!("convert take.csv {CLAW_MAP} --robot claw.urdf -o");
    let made = line(folder, &format!("{convert} out.csv"));
    says(
        &made,
        "CSV cannot store this, left out: the limits of the joints",
    );
    let made = line(folder, &format!("{convert} out.npz"));
    assert!(!made.words.contains("W208"), "{}", made.words);
}

/// Text that ends inside its last number, as an interrupted copy leaves it.
#[test]
fn a_cut_last_number_is_said() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let walk = fs::read_to_string(root().join("data/walk.bvh")).unwrap();
    let poses = (0..9).fold(String::new(), |mut text, key| {
        let _ = writeln!(
            text,
            "{key}.25 0.5000 0.2500 0.1250 0.0000 0.0000 0.6000 0.8000"
        );
        text
    });
    let table = format!("t,x,y,z,qx,qy,qz,qw\n{}", poses.replace(' ', ","));
    for (name, text) in [
        ("walk.bvh", &walk),
        ("poses.tum", &poses),
        ("poses.csv", &table),
    ] {
        let text = text.trim_end();
        fs::write(folder.join(name), text).unwrap();
        let made = line(folder, &format!("convert {name} -o whole.npz --overwrite"));
        assert!(!made.words.contains("W006"), "{name}: {}", made.words);
        // Also for lengths that remain numbers near enough to those of a rotation.
        let cut = text.trim_end_matches('0').len() - usize::from(name == "walk.bvh");
        fs::write(folder.join(name), &text[..cut]).unwrap();
        let made = line(folder, &format!("convert {name} -o cut.npz --overwrite"));
        says(
            &made,
            "warning[W006]: the file ends in the middle of a line",
        );
    }
}

/// Results of clips that a file no longer has are not made again by --resume, as changed ones are.
#[test]
fn results_of_clips_that_are_gone_are_told_apart() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    fs::create_dir(folder.join("in")).unwrap();
    let two = BROKEN.replace("\"sampler\":7", "\"sampler\":0");
    fs::write(folder.join("in/hero.gltf"), &two).unwrap();
    let eval = "eval in -o out --fps 10 --to npz --device cpu";
    line(folder, eval);
    let one = two.split(",\n{\"name\":\"two\"").next().unwrap();
    fs::write(folder.join("in/hero.gltf"), format!("{one}]}}")).unwrap();
    let stale = run(folder, &words("check out"));
    assert_eq!(stale.code, 8, "{}", stale.words);
    says(&stale, "2 of 2 results changed");
    line(folder, &format!("{eval} --resume"));
    let check = run(folder, &words("check out"));
    assert_eq!(check.code, 8, "{}", check.words);
    for part in [
        "out/hero.one.npz: its input in/hero.gltf has no such clip any more",
        "2 of 3 results of clips that are gone; `tumble eval … --resume --prune` removes them",
    ] {
        says(&check, part);
    }
    line(folder, &format!("{eval} --resume --prune"));
    line(folder, "check out");
}

#[test]
fn results_that_differ_in_case_alone_are_said() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir(folder.join("in")).unwrap();
    for name in ["WALK.dat", "Walk.dat", "run.dat"] {
        fs::copy(folder.join("a.dat"), folder.join("in").join(name)).unwrap();
    }
    if fs::read_dir(folder.join("in")).unwrap().count() < 3 {
        return; // this file system ignores case
    }
    let made = line(folder, "eval in -o out --device cpu");
    says(
        &made,
        "warning: WALK.npy and Walk.npy differ in case alone: copied to Windows or macOS, one would replace the other",
    );
}

#[test]
fn expressions_of_xacro_are_called_so() {
    let temporary = claw();
    let folder = temporary.path();
    let text = CLAW.replace("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 ${up}\"/>");
    fs::write(folder.join("macro.urdf"), text).unwrap();
    refused(
        folder,
        "info macro.urdf",
        "`xyz` has `${up}`, an expression of xacro, which is not computed; write the URDF by `xacro FILE > robot.urdf`",
    );
}
