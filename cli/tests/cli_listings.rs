//! Listings of files, devices and methods, and benchmarks: as text and as JSON.

use std::fs;

use crate::program::{run, sample_folder, succeed};
use crate::support::vulkan_devices;

#[test]
fn verify_passes_on_good_data_and_says_what_it_compared() {
    let folder = sample_folder();
    let run = succeed(folder.path(), &["verify", "a.dat", "b.dat", "--json"]);
    let lines: serde_json::Value = serde_json::from_slice(&run.out).unwrap();
    assert_eq!(lines.as_array().unwrap().len(), 2 * tumble::METHODS.len());
    for line in lines.as_array().unwrap() {
        assert_eq!(
            (&line["pass"], &line["differing"]),
            (&true.into(), &0.into()),
            "{line}"
        );
        assert_eq!(line["rotations"], 102);
    }
    let table = String::from_utf8(succeed(folder.path(), &["verify", "a.dat"]).out).unwrap();
    for method in tumble::METHODS {
        assert!(table.contains(method.name), "{table}");
    }
    if let Some(device) = vulkan_devices().first() {
        assert_eq!(lines[0]["device"], device.name());
        // For 102 rotations by each method: four rates, a pose of two values, and the encodings.
        let rotations = 102 * tumble::METHODS.len() as u64;
        let outputs = lines[0]["outputs"].as_array().unwrap();
        let values = outputs
            .iter()
            .map(|output| output["values"].as_u64().unwrap());
        let derived = values.sum::<u64>() * tumble::METHODS.len() as u64;
        let total = format!(
            "total: {rotations} rotations, and {derived} values derived from them (velocities, \
             accelerations, poses, encodings), compared between {} and the CPU: 0 differ\n",
            device.name()
        );
        assert!(table.ends_with(&total), "{table}");
    }
}

/// The joint with the largest error is named; a track without a name has its number alone.
#[test]
fn verify_names_the_joint_of_a_sample() {
    let folder = sample_folder();
    let quaternions = "0 1 0 0 0\n1 0.8 0.6 0 0\n2.5 0.6 0 0.8 0\n";
    std::fs::write(
        folder.path().join("one.dat"),
        format!("# 1 3\n{quaternions}"),
    )
    .unwrap();
    let bvh = "HIERARCHY\nROOT b_Hip_01\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n\
               End Site\n{\nOFFSET 0 1 0\n}\n}\n\
               MOTION\nFrames: 3\nFrame Time: 0.5\n10 0 0\n50 20 0\n0 0 70\n";
    std::fs::write(folder.path().join("one.bvh"), bvh).unwrap();
    for (file, words, name) in [
        ("one.dat", "worst: track 0, frame ", None),
        (
            "one.bvh",
            "worst: track 0 (b_Hip_01), frame ",
            Some("b_Hip_01"),
        ),
    ] {
        let line = ["verify", file, "-m", "slerp", "--device", "cpu"];
        let table = String::from_utf8(succeed(folder.path(), &line).out).unwrap();
        assert!(table.contains(words), "{table}");
        let json = succeed(folder.path(), &[&line[..], &["--json"]].concat()).out;
        let lines: serde_json::Value = serde_json::from_slice(&json).unwrap();
        let line = &lines[0];
        assert_eq!(line["worst_track_name"].as_str(), name, "{line}");
        assert_eq!(line["worst"]["track"], 0);
        assert!(line["first_difference_track_name"].is_null(), "{line}");
    }
}

#[test]
fn devices_and_info_speak_json() {
    let folder = sample_folder();
    let run = succeed(folder.path(), &["devices", "--json"]);
    let listing: serde_json::Value = serde_json::from_slice(&run.out).unwrap();
    let found = listing["devices"].as_array().unwrap();
    for (entry, device) in found.iter().zip(&vulkan_devices()) {
        assert_eq!(entry["name"], device.name());
        assert_eq!(entry["exact"], true, "{entry}");
        assert!(entry["self_tests"].as_array().unwrap().len() >= 8);
        assert!(entry["kernels"]["all"].as_u64().unwrap() >= 98, "{entry}");
        assert!(entry["kernels"]["differing"].as_array().unwrap().is_empty());
    }
    assert_eq!(found.len(), vulkan_devices().len());

    let run = succeed(folder.path(), &["info", "a.dat", "--json"]);
    let info: serde_json::Value = serde_json::from_slice(&run.out).unwrap();
    let expected = [
        ("tracks", 2.0),
        ("keys", 10.0),
        ("first_time", 0.0),
        ("last_time", 2.0),
    ];
    for (name, value) in expected
        .into_iter()
        .chain([("box_length", 3.0), ("longest_step", 0.5)])
    {
        assert_eq!(info[0][name].as_f64(), Some(value), "{name}: {info}");
    }
    assert_eq!(info[0]["uniform"], true);
    let degrees = info[0]["largest_rotation_degrees"].as_f64().unwrap();
    assert!((degrees - 0.9f64.to_degrees()).abs() < 1e-3, "{degrees}");
}

/// A robot whose depth-first order of bodies differs from the breadth-first order.
pub(crate) const ARM: &str = r#"<mujoco model="arm"><worldbody><body name="base">
  <body name="lower"><joint name="swing" axis="0 0 2" range="-90 90"/>
    <body name="hand"><joint name="reach" type="slide" range="0 0.5"/></body></body>
  <body name="lamp"/></body></worldbody>
  <equality><joint joint1="swing" joint2="reach"/></equality>
  <keyframe><key name="home" qpos="0 0.1"/></keyframe></mujoco>"#;

#[test]
fn info_lists_the_bodies_and_joints_of_robots() {
    let folder = sample_folder();
    std::fs::write(folder.path().join("arm.xml"), ARM).unwrap();
    let run = succeed(folder.path(), &["info", "arm.xml"]);
    let text = String::from_utf8(run.out).unwrap();
    let expected = [
        "robot              arm, mjcf",
        "joints             2; hinges and slides have 2 values in all",
        "poses              home",
        "1 relation between joints (<equality>) not applied",
        "0     0  base   fixed",
        "1     1  lower  hinge swing -1.5708 to 1.5708 rad",
        "2     3  hand   slide reach 0.0000 to 0.5000 m",
        "3     2  lamp   fixed",
    ];
    for line in expected {
        assert!(text.contains(line), "{line}:\n{text}");
    }
    let run = succeed(folder.path(), &["info", "--json", "arm.xml", "a.dat"]);
    let info: serde_json::Value = serde_json::from_slice(&run.out).unwrap();
    assert_eq!(info[0]["robot"], "mjcf");
    assert_eq!(
        info[0]["joint_names"],
        serde_json::json!(["swing", "reach"])
    );
    assert_eq!(info[0]["bodies"][2]["breadth_first"], 3);
    assert_eq!(info[0]["bodies"][1]["joints"][0]["axis"][2], 1.0);
    assert_eq!(info[1]["tracks"], 2);
    // The message about a fault has its line.
    std::fs::write(
        folder.path().join("bad.urdf"),
        "<robot>\n<link name='a'/><link name='b'/></robot>",
    )
    .unwrap();
    let refused = crate::program::run(folder.path(), &["info", "bad.urdf"]);
    let expected = "bad.urdf:1:1: error[E901]: `a` and `b` have no parent";
    assert!(refused.words.contains(expected), "{}", refused.words);
}

#[test]
fn generate_is_deterministic_and_can_be_read_back() {
    let folder = sample_folder();
    let line = [
        "generate",
        "--boxes",
        "3",
        "--keys",
        "7",
        "--seconds",
        "4",
        "--random",
        "-o",
    ];
    let write = |name: &str, seed: &str| {
        succeed(
            folder.path(),
            &[&line[..], &[name, "--seed", seed]].concat(),
        );
        fs::read(folder.path().join(name)).unwrap()
    };
    let first = write("g1.dat", "5");
    assert!(
        first == write("g2.dat", "5"),
        "the same seed gave another file"
    );
    assert!(
        first != write("g3.dat", "6"),
        "another seed gave the same file"
    );
    assert!(first == succeed(folder.path(), &[&line[..], &["-", "--seed", "5"]].concat()).out);
    let info = succeed(folder.path(), &["info", "g1.dat", "--json"]).out;
    let info: serde_json::Value = serde_json::from_slice(&info).unwrap();
    assert_eq!(
        (&info[0]["tracks"], &info[0]["keys"]),
        (&3.into(), &21.into())
    );
    assert_eq!(info[0]["last_time"].as_f64(), Some(4.0));
    assert_eq!(info[0]["warnings"], serde_json::json!([]));
}

#[test]
fn listings_say_what_there_is() {
    let folder = sample_folder();
    let methods = String::from_utf8(succeed(folder.path(), &["methods"]).out).unwrap();
    for method in tumble::METHODS {
        assert!(
            methods.contains(method.name) && methods.contains(method.summary),
            "{methods}"
        );
    }
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script =
            String::from_utf8(succeed(folder.path(), &["completions", shell]).out).unwrap();
        // clap writes completions of values only for these shells.
        let values = ["bash", "zsh", "fish"].contains(&shell);
        assert!(script.contains("method"), "{shell} does not complete flags");
        assert!(
            script.contains("bessel-overhauser") || !values,
            "{shell} does not complete methods"
        );
    }
    let version = String::from_utf8(succeed(folder.path(), &["--version"]).out).unwrap();
    assert_eq!(
        version.trim(),
        format!("tumble {}", env!("CARGO_PKG_VERSION"))
    );
    for line in [&["--help"][..], &["eval", "--help"], &["verify", "--help"]] {
        let help = String::from_utf8(succeed(folder.path(), line).out).unwrap();
        assert!(help.contains("Examples:"), "{help}");
    }
}

#[test]
fn bench_reads_and_resamples_clips_of_every_format() {
    let folder = sample_folder();
    let line = "bench files --json --rounds 1 --shrink 1500";
    let line: Vec<&str> = line.split(' ').collect();
    let report: serde_json::Value =
        serde_json::from_slice(&succeed(folder.path(), &line).out).unwrap();
    let sections = report["sections"].as_array().unwrap();
    let formats: Vec<&str> = (sections.iter())
        .map(|section| section["method"].as_str().unwrap())
        .collect();
    assert!(
        formats.contains(&"bvh") && formats.contains(&"parquet"),
        "{formats:?}"
    );
    for section in sections {
        // Each of the two clips has 22 joints and 240 frames at 30 a second, so 479 at 60.
        assert_eq!(section["rotations"], 2 * 22 * 479, "{section}");
        assert!(
            section["file_bytes"].as_u64().unwrap() > 2 * 22 * 240 * 12,
            "{section}"
        );
        for row in section["rows"].as_array().unwrap() {
            assert!(
                row["share_of_reading_rate"].as_f64().unwrap() > 0.0,
                "{row}"
            );
        }
    }
}

#[test]
fn bench_measures_single_poses() {
    let folder = sample_folder();
    let line = [
        "bench", "--json", "--rounds", "1", "--shrink", "30", "poses",
    ];
    let report: serde_json::Value =
        serde_json::from_slice(&succeed(folder.path(), &line).out).unwrap();
    let sections = report["sections"].as_array().unwrap();
    let labels: Vec<&str> = (sections.iter().map(|it| it["method"].as_str().unwrap())).collect();
    let expected = ["slerp", "bessel-overhauser"]
        .map(|method| [1, 2, 33].map(|tracks| format!("{method}, {tracks} tracks a call")));
    assert_eq!(labels, expected.concat());
    for section in sections {
        let rows = section["rows"].as_array().unwrap();
        assert_eq!(rows.len(), 6, "{section}");
        assert!(
            rows[5]["ratio_to_naive"].as_f64().unwrap() > 0.0,
            "{section}"
        );
    }
}

#[test]
fn bench_measures_characters() {
    let folder = sample_folder();
    let line = [
        "bench",
        "--json",
        "--rounds",
        "1",
        "--shrink",
        "1000",
        "characters",
    ];
    let report: serde_json::Value =
        serde_json::from_slice(&succeed(folder.path(), &line).out).unwrap();
    let devices = report["devices"].as_array().unwrap().len();
    for (section, label) in [(0, "slerp, rotations"), (1, "slerp, model matrices")] {
        let section = &report["sections"][section];
        assert_eq!(section["method"], label);
        assert_eq!(section["rotations"], 600);
        let names: Vec<&str> = (section["rows"].as_array().unwrap().iter())
            .map(|row| row["name"].as_str().unwrap())
            .collect();
        assert_eq!(names[..2], ["naive (glam, rayon)", "CPU"]);
        assert_eq!(names.len(), 2 + devices);
    }
}

/// Everything is measured and reported; speed is not tested.
#[test]
fn bench_measures_every_workload_in_one_run() {
    let folder = sample_folder();
    let workloads = ["sparse", "motion", "dense", "small", "crowd", "long"];
    let mut line = vec!["bench", "--json", "--rounds", "2", "--shrink", "2000"];
    line.extend(workloads);
    let report: serde_json::Value =
        serde_json::from_slice(&succeed(folder.path(), &line).out).unwrap();
    let devices = report["devices"].as_array().unwrap();
    assert!(!devices.is_empty() || std::env::var_os("CI").is_none());
    for device in devices {
        for field in ["driver", "uuid"] {
            assert!(!device[field].as_str().unwrap().is_empty(), "{device}");
        }
        for chosen in ["mapping", "transfer", "read_back", "uploads"] {
            assert!(device["choices"][chosen].is_string(), "{device}");
        }
        // The host prepares arcs for software devices.
        assert!(device["choices"]["arcs_prepared_from"].is_null());
        assert!(device["choices"]["windows_in_flight"].as_u64().unwrap() >= 2);
        assert!(device["driver_version"].as_u64().is_some(), "{device}");
        for rate in ["store", "fill"] {
            assert!(
                device["write_rates"][rate].as_f64().unwrap() > 0.0,
                "{device}"
            );
        }
    }
    let sections = report["sections"].as_array().unwrap();
    assert_eq!(sections.len(), 2 * workloads.len());
    for section in sections {
        let rows = section["rows"].as_array().unwrap();
        let names: Vec<&str> = rows.iter().map(|r| r["name"].as_str().unwrap()).collect();
        assert_eq!(
            names[..3],
            [
                "host memory write rate",
                "naive (glam, rayon)",
                "CPU, evaluation alone"
            ]
        );
        assert!(names.contains(&"CPU, from keys"), "{names:?}");
        for row in rows {
            assert!(row["milliseconds"].as_f64().unwrap() > 0.0, "{row}");
            assert!(row["ratio_to_naive"].as_f64().unwrap() > 0.0, "{row}");
        }
        // The segments of dense keys are not kept on a device.
        if std::env::var_os("CI").is_some() && section["workload"] != "dense" {
            let resident: Vec<_> = (rows.iter())
                .filter(|row| row["name"].as_str().unwrap().ends_with(", resident"))
                .collect();
            assert!(!resident.is_empty(), "{names:?}");
            for row in resident {
                // The time is measured by the device's clock; it is the first of the parts.
                assert_eq!(row["parts"][0][1], row["milliseconds"], "{row}");
                let share = row["share_of_device_write_rate"].as_f64().unwrap();
                assert!(share > 0.0, "{row}");
            }
            let device = rows
                .iter()
                .find(|row| row["parts"][1][0] == "submit to fence");
            assert!(device.unwrap()["parts"][1][1].as_f64().unwrap() > 0.0);
        }
    }
}

/// Ten microseconds beside intervals of a second: the curve through these keys with a continuous acceleration
/// would turn thousands of times between them.
#[test]
fn an_acceleration_that_jumps_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, times: [f64; 6]| {
        let mut rotation = glam::DQuat::IDENTITY;
        let mut text = String::from("# 1 1\n");
        let axes = [glam::DVec3::X, glam::DVec3::Y, glam::DVec3::Z];
        for (time, axis) in times.into_iter().zip(axes.into_iter().cycle()) {
            let [x, y, z, w] = rotation.to_array().map(|component| component as f32);
            text += &format!("{time} {w} {x} {y} {z}\n");
            rotation *= glam::DQuat::from_axis_angle(axis, 1.0);
        }
        fs::write(folder.path().join(name), text).unwrap();
    };
    write("short.dat", [0.0, 1.0, 2.0, 2.00001, 3.0, 4.0]);
    write("even.dat", [0.0, 1.0, 2.0, 2.01, 3.0, 4.0]);
    let said =
        "short.dat:track 1: warning[W014]: the angular acceleration of c2 jumps at key 2, at 1 s";
    for line in [
        &[
            "eval",
            "short.dat",
            "-m",
            "c2",
            "-o",
            "out.npy",
            "--overwrite",
        ][..],
        &[
            "plot",
            "short.dat",
            "-m",
            "slerp,c2",
            "-o",
            "out.svg",
            "--overwrite",
        ],
        &["verify", "short.dat", "-m", "c2,squad", "--device", "cpu"],
        &["info", "short.dat"],
    ] {
        // `verify` may fail: such velocities may exceed their bounds, whatever the method.
        let output = match line[0] {
            "verify" => run(folder.path(), line),
            _ => succeed(folder.path(), line),
        };
        let text = output.words + &String::from_utf8(output.out).unwrap();
        assert_eq!(text.matches("W014").count(), 1, "{line:?}: {text}");
        assert!(text.contains(said), "{line:?}: {text}");
        // The same keys have a c2 curve if their intervals differ only by a factor of a hundred; other methods never
        // have this warning.
        let even: Vec<&str> = line
            .iter()
            .map(|word| {
                if *word == "short.dat" {
                    "even.dat"
                } else {
                    word
                }
            })
            .collect();
        let output = succeed(folder.path(), &even);
        let text = output.words + &String::from_utf8(output.out).unwrap();
        assert!(!text.contains("W014"), "{even:?}: {text}");
    }
    let line = [
        "eval",
        "short.dat",
        "-o",
        "out.npy",
        "--overwrite",
        "--fps",
        "9",
    ];
    assert!(!succeed(folder.path(), &line).words.contains("W014"));
}
