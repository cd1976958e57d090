//! `tumble compare`, by running it.

use serde_json::Value;

use crate::program::{run, sample_folder, succeed};

fn json(folder: &std::path::Path, line: &[&str]) -> (i32, Value) {
    let run = run(folder, line);
    let value = serde_json::from_slice(&run.out);
    (
        run.code,
        value.unwrap_or_else(|error| panic!("{line:?}: {error}: {}", run.words)),
    )
}

#[test]
fn a_motion_and_what_was_made_of_it() {
    let temporary = sample_folder();
    let folder = temporary.path();
    // The same keys, two tracks; the second file has one key turned by 0.2 radians about z.
    let half = 0.1f64;
    let rotation = format!("{} 0 0 {}", half.cos(), half.sin());
    let text = std::fs::read_to_string(folder.join("a.dat")).unwrap();
    let lines: Vec<String> = text
        .lines()
        .map(|line| match line.strip_prefix("0  ") {
            // The first key of the first track is the identity.
            Some(rest) => format!("0  {rotation}  {}", rest.split("  ").nth(1).unwrap()),
            None => line.to_owned(),
        })
        .collect();
    std::fs::write(folder.join("turned.dat"), lines.join("\n") + "\n").unwrap();

    let same = succeed(folder, &["compare", "a.dat", "b.dat", "--tolerance", "0"]);
    let report = String::from_utf8(same.out).unwrap();
    assert!(
        report.contains("2 tracks × 9 samples from 0 to 2 s"),
        "{report}"
    );
    assert!(
        report.contains("18 of 18 rotations are the same, bit for bit"),
        "{report}"
    );

    let (code, found) = json(folder, &["compare", "a.dat", "turned.dat", "--json"]);
    let clip = &found["clips"][0];
    let degrees = 0.2f64.to_degrees();
    let largest = clip["rotation"]["largest"].as_f64().unwrap();
    assert!((largest - degrees).abs() < 1e-4, "{largest} of {degrees}");
    assert_eq!(
        (code, &clip["rotation"]["track"]),
        (0, &Value::from("box1"))
    );
    assert_eq!(clip["rotation"]["time"].as_f64(), Some(0.0));
    let mean = clip["rotation"]["mean"].as_f64().unwrap();
    assert!(mean > 0.0 && mean < largest / 9.0, "{mean}");

    for (tolerance, code) in [("12deg", 0), ("11deg", 8), ("0.21rad", 0), ("0.19rad", 8)] {
        let line = ["compare", "a.dat", "turned.dat", "--tolerance", tolerance];
        let run = run(folder, &line);
        assert_eq!(run.code, code, "{tolerance}: {}", run.words);
        assert_eq!(
            run.words.contains("they differ: angle of"),
            code == 8,
            "{}",
            run.words
        );
    }
    let second = [
        "compare",
        "a.dat",
        "turned.dat",
        "--tracks",
        "box2",
        "--tolerance",
        "0",
    ];
    succeed(folder, &second);
    // At other samples the largest difference is smaller, because the nearest sample is half a frame from the key.
    let fps = ["--fps", "4", "--start", "0.25", "--json"];
    let line = [&["compare", "a.dat", "turned.dat"][..], &fps].concat();
    let (_, found) = json(folder, &line);
    let less = found["clips"][0]["rotation"]["largest"].as_f64().unwrap();
    assert!(less > 0.0 && less < largest, "{less}");
}

#[test]
fn results_number_by_number() {
    let temporary = sample_folder();
    let folder = temporary.path();
    for (name, more) in [
        ("one.npy", &["-m", "slerp"][..]),
        ("same.npy", &["-m", "slerp", "--device", "cpu"]),
        ("half.npy", &["-m", "slerp", "--encoding", "f16"]),
        ("frames.npy", &["-m", "slerp", "--layout", "frame"]),
        ("speed.npy", &["-m", "slerp", "--quantity", "velocity"]),
        ("speed2.npy", &["-m", "c2", "--quantity", "velocity"]),
    ] {
        succeed(folder, &[&["eval", "a.dat", "-o", name][..], more].concat());
    }
    succeed(
        folder,
        &["compare", "one.npy", "same.npy", "--tolerance", "0"],
    );
    let (code, found) = json(folder, &["compare", "one.npy", "half.npy", "--json"]);
    let array = &found["array"];
    let angle = array["rotation"]["largest"].as_f64().unwrap();
    assert!(code == 0 && angle > 0.0 && angle < 0.2, "{angle}");
    assert_eq!(array["shape"], serde_json::json!([2, 51, 4]));
    assert_eq!(array["largest_rotation_at"].as_array().unwrap().len(), 2);
    let exceeded = run(
        folder,
        &["compare", "one.npy", "half.npy", "--tolerance", "1e-6"],
    );
    assert_eq!(exceeded.code, 8, "{}", exceeded.words);
    let (code, found) = json(folder, &["compare", "speed.npy", "speed2.npy", "--json"]);
    assert!(code == 0 && found["array"]["rotation"].is_null());
    assert!(found["array"]["difference"]["largest"].as_f64().unwrap() > 0.1);
    let shapes = run(folder, &["compare", "one.npy", "frames.npy"]);
    assert_eq!(shapes.code, 4);
    assert!(
        shapes.words.contains("has the shape [2, 51, 4] and"),
        "{}",
        shapes.words
    );
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let temporary = sample_folder();
    let folder = temporary.path();
    std::fs::write(folder.join("late.dat"), "# 1 1\n9 1 0 0 0\n10 1 0 0 0\n").unwrap();
    std::fs::write(folder.join("part.dat"), "# 1 1\n0 1 0 0 0\n1 0 1 0 0\n").unwrap();
    for name in ["truth.tum", "other.tum"] {
        let poses = "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 1 1 0 0 0 0 1\n";
        std::fs::write(folder.join(name), poses).unwrap();
    }
    for (line, code, says) in [
        (
            &["compare", "a.dat"][..],
            2,
            "two files or two directories are compared, not 1 file",
        ),
        (
            &["compare", "a.dat", "b.dat", "--exclude", "b.*"],
            2,
            "two files or two directories are compared, not 1 file",
        ),
        (
            &["compare", "-", "-"],
            2,
            "two files or two directories are compared, not 1 file",
        ),
        (&["compare", "a.dat", "b.dat", "folder/a.dat"], 2, "not 3"),
        (
            &["compare", "a.dat", "nope"],
            4,
            "nope: error[E001]: cannot be read: ",
        ),
        (
            &["compare", "folder", "nope"],
            4,
            "nope: error[E001]: cannot be read: ",
        ),
        (&["compare", "folder"], 2, "not 1 directory\n"),
        (
            &["compare", "folder", "a.dat"],
            2,
            "but folder is a directory and a.dat is none",
        ),
        (
            &["compare", "folder", "a.dat", "folder"],
            2,
            "not 2 directories and 1 file",
        ),
        (&["compare", "a.dat", "bad.dat"], 4, "bad.dat:2"),
        (
            &["compare", "part.dat", "late.dat"],
            4,
            "the inputs have no common time",
        ),
        (
            &["compare", "a.dat", "b.dat", "--tolerance", "-1"],
            2,
            "expected a finite number of 0 or more",
        ),
        (
            &["compare", "a.dat", "b.dat", "--start", "1"],
            2,
            "are for --fps",
        ),
        (
            &[
                "compare", "a.dat", "b.dat", "--fps", "10", "--start", "3", "--end", "4",
            ],
            4,
            "times from 3 to 4 s are requested, but both have only times from 0 to 2 s",
        ),
        (
            &["compare", "truth.tum", "other.tum", "--ape", "--csv"],
            2,
            "--csv is for the joints of motions",
        ),
        (
            &[
                "compare",
                "truth.tum",
                "other.tum",
                "--associate",
                "nearest:0.01",
                "--max-gap",
                "1",
            ],
            2,
            "leave out one",
        ),
        (
            &["compare", "a.dat", "part.dat", "--tolerance", "360"],
            8,
            "1 track in only one of the files",
        ),
    ] {
        let run = run(folder, line);
        assert_eq!(run.code, code, "{line:?}: {}", run.words);
        assert!(run.words.contains(says), "{line:?}: {}", run.words);
    }
    // Without a tolerance, the tracks and times common to both are compared, and the others are listed.
    let compared = succeed(folder, &["compare", "a.dat", "part.dat"]);
    assert!(
        compared.words.contains("compared from 0 to 1 s"),
        "{}",
        compared.words
    );
    let report = String::from_utf8(compared.out).unwrap();
    assert!(report.contains("only in a.dat: box2"), "{report}");
}

/// Joints are compared by name and parent; other names, other parents and other animations are refused.
#[test]
fn joints_are_matched_by_name_and_parent() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let joint = |kind: &str, name: &str, inside: &str| {
        let channels = "CHANNELS 3 Zrotation Xrotation Yrotation";
        format!("{kind} {name}\n{{\nOFFSET 1 0 0\n{channels}\n{inside}}}\n")
    };
    let end = "End Site\n{\nOFFSET 0 1 0\n}\n";
    let write = |name: &str, inside: String, row: &str| {
        let root = joint("ROOT", "hip", &inside);
        let rows = format!("Frames: 2\nFrame Time: 0.5\n0 0 0 0 0 0 0 0 0\n{row}\n");
        let text = format!("HIERARCHY\n{root}MOTION\n{rows}");
        std::fs::write(folder.join(name), text).unwrap();
    };
    let of = |name: &str| joint("JOINT", name, end);
    write("one.bvh", of("left") + &of("right"), "10 0 0 20 0 0 30 0 0");
    write(
        "other.bvh",
        of("right") + &of("left"),
        "10 0 0 30 0 0 20 0 0",
    );
    write(
        "named.bvh",
        of("Left") + &of("Right"),
        "10 0 0 20 0 0 30 0 0",
    );
    let left = joint("JOINT", "left", &of("right"));
    write("chain.bvh", left, "10 0 0 20 0 0 10 0 0");
    let text = std::fs::read_to_string(folder.join("one.bvh")).unwrap();
    let text = ["hip", "left", "right"].iter().fold(text, |text, name| {
        text.replace(&format!(" {name}\n"), &format!(" rig_{name}\n"))
    });
    std::fs::write(folder.join("renamed.bvh"), text).unwrap();

    succeed(
        folder,
        &["compare", "one.bvh", "other.bvh", "--tolerance", "0"],
    );
    succeed(
        folder,
        &[
            "compare",
            "one.bvh",
            "other.bvh",
            "--world",
            "--tolerance",
            "0",
        ],
    );
    // One more file of the same motion, whose tracks a table sorts.
    succeed(folder, &["convert", "other.bvh", "-o", "other.parquet"]);
    succeed(
        folder,
        &["compare", "one.bvh", "other.parquet", "--tolerance", "1e-4"],
    );
    let chain = ["compare", "one.bvh", "chain.bvh", "--world"];
    let compared = succeed(folder, &[&chain[..], &["--tolerance", "1e-4"]].concat());
    assert!(compared.words.is_empty(), "{}", compared.words);
    for (line, says) in [
        (
            "compare one.bvh renamed.bvh",
            "none of the same name (`hip` and `rig_hip` are similar, but only equal names match)",
        ),
        (
            "compare one.bvh chain.bvh",
            "`right` has the parent `hip` in one.bvh, but has the parent `left` in chain.bvh; compare them in the world \
             with --world",
        ),
        (
            "compare one.bvh chain.bvh --tracks right",
            "`right` has the parent `hip` in one.bvh",
        ),
        (
            "compare one.bvh a.dat",
            "one.bvh has a joint `hip`, but the joints of a.dat have no names; joints are matched by name, or by \
             index if neither clip has names",
        ),
    ] {
        let run = run(folder, &line.split(' ').collect::<Vec<_>>());
        assert_eq!(run.code, 4, "{line}: {}", run.words);
        assert!(run.words.contains(says), "{line}: {}", run.words);
    }
    // Joints whose names only one file has are left out; the others are compared.
    let compared = succeed(folder, &["compare", "one.bvh", "named.bvh"]);
    let report = String::from_utf8(compared.out).unwrap();
    assert!(report.contains("only in one.bvh: left, right"), "{report}");
    // Tracks without names keep those that they are selected by, and get names in files that need some.
    for (file, tracks) in [("a.glb", "box2"), ("a.bvh", "1")] {
        succeed(folder, &["convert", "a.dat", "-o", file]);
        let compared = succeed(folder, &["compare", "a.dat", file]);
        let report = String::from_utf8(compared.out).unwrap();
        assert!(report.contains("2 tracks × "), "{report}");
        assert!(!report.contains("only in"), "{report}");
        let one = succeed(folder, &["compare", "a.dat", file, "--tracks", tracks]);
        let report = String::from_utf8(one.out).unwrap();
        assert!(report.contains("1 track × "), "{report}");
    }
    // Two paths of one body each need no name, and a warning says that they are taken for the same body.
    let path =
        |name: &str| format!("time,{name}.x,{name}.y,{name}.z,{name}.w\n0,0,0,0,1\n1,0,0,1,0\n");
    std::fs::write(folder.join("odom.csv"), path("odom")).unwrap();
    std::fs::write(folder.join("base.csv"), path("base")).unwrap();
    let compared = succeed(
        folder,
        &["compare", "odom.csv", "base.csv", "--tolerance", "0"],
    );
    let words = "`odom` of odom.csv is compared with `base` of base.csv: each has one track";
    assert!(compared.words.contains(words), "{}", compared.words);
}

/// A chain goes into another format and back, and a part of it into `.dat`, without a bit of
/// difference; contents that `.dat` cannot hold are named.
#[test]
fn keys_come_back_as_dat() {
    let temporary = sample_folder();
    let folder = temporary.path();
    succeed(folder, &["convert", "a.dat", "-o", "a.npz"]);
    succeed(folder, &["convert", "a.npz", "-o", "back.dat"]);
    let same = ["compare", "a.dat", "back.dat", "--tolerance", "0"];
    let report = String::from_utf8(succeed(folder, &same).out).unwrap();
    assert!(
        report.contains("18 of 18 rotations are the same"),
        "{report}"
    );
    let part = [
        "convert", "a.dat", "--start", "0.5", "--end", "1.5", "-o", "part.dat",
    ];
    succeed(folder, &part);
    let text = std::fs::read_to_string(folder.join("part.dat")).unwrap();
    let times: Vec<&str> = text
        .lines()
        .skip(1)
        .map(|line| line.split(' ').next().unwrap())
        .collect();
    assert_eq!(times.len(), 3, "{text}");
    let moved = "HIERARCHY\nROOT hip\n{\n OFFSET 0 1 0\n CHANNELS 6 Xposition Yposition Zposition \
                 Zrotation Xrotation Yrotation\n End Site\n {\n  OFFSET 0 1 0\n }\n}\nMOTION\nFrames: \
                 2\nFrame Time: 0.5\n0 1 0 0 0 0\n1 1 0 90 0 0\n";
    std::fs::write(folder.join("moved.bvh"), moved).unwrap();
    let run = succeed(folder, &["convert", "moved.bvh", "-o", "moved.dat"]);
    assert!(run.words.contains("warning[W208]"), "{}", run.words);
    let line = ["compare", "moved.bvh", "moved.dat", "--tolerance", "1e-4"];
    let report = String::from_utf8(succeed(folder, &line).out).unwrap();
    assert!(report.contains("translation"), "{report}");
}

/// Trajectories in Unix time, one of which starts a second later: the poses of the first that the second
/// reaches, without its gaps.
#[test]
fn an_estimate_beside_its_reference() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let pose = |seconds: f64, x: f64| format!("{} {x} 0 0 0 0 0 1\n", 1_700_000_000.0 + seconds);
    let truth: String = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
        .map(|time| pose(time, time))
        .concat();
    let estimate: String = [1.0, 2.0, 4.0].map(|time| pose(time, time + 1.0)).concat();
    std::fs::write(folder.join("truth.tum"), truth).unwrap();
    std::fs::write(folder.join("estimate.tum"), estimate).unwrap();
    let both = ["compare", "truth.tum", "estimate.tum", "--json"];
    let line = |more: &[&str]| [&both[..], more].concat().join(" ");
    let measure = |more: &[&str]| json(folder, &line(more).split(' ').collect::<Vec<_>>());

    let (_, found) = measure(&["--ape", "--max-gap", "1.5", "--rpe", "1s"]);
    let found = &found["trajectory"];
    // The estimate has fewer poses at the times of both, so that the first is interpolated.
    let counts = ["times_of", "poses", "outside", "in_gaps"].map(|name| found[name].as_u64());
    assert_eq!(counts, [Some(1), Some(2), Some(1), Some(0)]);
    let number = |value: &Value| value.as_f64().unwrap();
    assert!((number(&found["ape"]["translation"]["rmse"]) - 1.0).abs() < 1e-6);
    assert!(number(&found["ape"]["rotation"]["max"]) < 1e-4);
    assert_eq!(found["rpe"]["count"], 1);
    assert!(number(&found["rpe"]["translation"]["max"]) < 1e-6);
    let (_, found) = measure(&["--align", "position"]);
    let found = &found["trajectory"];
    assert_eq!(found["poses"], 2);
    assert!(
        number(&found["ape"]["translation"]["max"]) < 1e-6,
        "{found}"
    );
    assert!((number(&found["alignment"]["translation"][0]) + 1.0).abs() < 1e-6);
    // Without them the motions are compared at the times that both have, in whichever second each begins.
    let (_, found) = measure(&[]);
    let moved = &found["clips"][0]["translation"];
    assert!((number(&moved["largest"]) - 1.0).abs() < 1e-6, "{found}");

    for (line, code, says) in [
        (
            &["--ape", "--distance", "0.5"][..],
            8,
            "distance of 1 over 0.5",
        ),
        (&["--ape", "--fps", "10"], 2, "leave out --fps"),
        (&["--rpe", "100m"], 4, "longer than the whole path"),
        (&["--rpe", "1km"], 2, "1s or 0.5m"),
    ] {
        let line = [&["compare", "truth.tum", "estimate.tum"][..], line].concat();
        let run = run(folder, &line);
        assert_eq!(run.code, code, "{line:?}: {}", run.words);
        assert!(run.words.contains(says), "{line:?}: {}", run.words);
    }
    // The second clip is sampled at the times of the first, although they count from different
    // whole seconds.
    let at = [
        "eval",
        "estimate.tum",
        "--at",
        "truth.tum",
        "--max-gap",
        "1.5",
        "-o",
        "at.tum",
    ];
    let run = succeed(folder, &at);
    assert!(
        run.words.contains("2 of 6 times lie between keys"),
        "{}",
        run.words
    );
    assert!(
        run.words
            .contains("--before and --after select other values"),
        "{}",
        run.words
    );
    let text = std::fs::read_to_string(folder.join("at.tum")).unwrap();
    let poses: Vec<Vec<f64>> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| {
            line.split(' ')
                .map(|number| number.parse().unwrap())
                .collect()
        })
        .collect();
    let times: Vec<f64> = poses.iter().map(|pose| pose[0] - 1_700_000_000.0).collect();
    assert_eq!(times, [0.5, 1.0, 1.5, 2.0]);
    assert_eq!((poses[0][1], poses[1][1], poses[3][1]), (2.0, 2.0, 3.0));
    assert!((poses[2][1] - 2.5).abs() < 0.1, "{}", poses[2][1]);
    let text = succeed(
        folder,
        &["compare", "truth.tum", "estimate.tum", "--align", "yaw"],
    );
    let text = String::from_utf8(text.out).unwrap();
    assert!(
        text.contains(
            "2 poses of the second from 1700000001 to 1700000002 s, 1 without one of the other"
        ),
        "{text}"
    );
}

/// An estimate of keyframes without any error has none, whichever is denser; `evo` finds 0 over the same poses.
#[test]
fn an_estimate_of_few_poses_is_not_interpolated() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let pose = |i: u32| {
        let t = f64::from(i) * 0.1;
        let (sine, cosine) = (0.3 * t).sin_cos();
        format!(
            "{t:.3} {} {} 0 0 0 {sine} {cosine}\n",
            (2.0 * t).cos(),
            (2.0 * t).sin()
        )
    };
    let all: String = (0..101).map(pose).collect();
    let sparse: String = (0..11).map(|i| pose(10 * i)).collect();
    std::fs::write(folder.join("truth.tum"), all).unwrap();
    std::fs::write(folder.join("few.tum"), sparse).unwrap();
    for (first, second, times_of) in [("truth.tum", "few.tum", 1), ("few.tum", "truth.tum", 0)] {
        for how in ["interpolated", "nearest:0.01"] {
            let line = [
                "compare",
                first,
                second,
                "--ape",
                "--associate",
                how,
                "--json",
            ];
            let (_, found) = json(folder, &line);
            let found = &found["trajectory"];
            assert_eq!(
                (&found["poses"], &found["times_of"]),
                (&11.into(), &times_of.into())
            );
            for errors in [&found["ape"]["translation"], &found["ape"]["rotation"]] {
                assert!(errors["max"].as_f64().unwrap() < 1e-4, "{line:?}: {errors}");
            }
        }
    }
}

/// On a line the turn about it is open: the smallest is taken, and a warning says that the errors of rotations mean
/// nothing. A gap in either path is a warning.
#[test]
fn what_an_alignment_cannot_know_is_told() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let write = |name: &str, y: f64, gap: f64| {
        let poses: String = (0..40)
            .map(|i| {
                let t = f64::from(i) * 0.1 + if i < 20 { 0.0 } else { gap };
                format!("{t:.3} {t} {y} 0 0 0 0 1\n")
            })
            .collect();
        std::fs::write(folder.join(name), poses).unwrap();
    };
    write("line.tum", 0.0, 0.0);
    write("beside.tum", 1.0, 0.0);
    write("gap.tum", 0.0, 1.5);
    for align in ["se3", "sim3"] {
        let line = [
            "compare",
            "line.tum",
            "beside.tum",
            "--align",
            align,
            "--json",
        ];
        let (_, found) = json(folder, &line);
        let alignment = &found["trajectory"]["alignment"];
        assert_eq!(alignment["undetermined"], "line", "{alignment}");
        assert!(alignment["degrees"].as_f64().unwrap() < 1e-5, "{alignment}");
        let said = run(folder, &line).words;
        assert!(said.contains("rotation errors have no meaning"), "{said}");
    }
    for line in [["gap.tum", "line.tum"], ["line.tum", "gap.tum"]] {
        let said = succeed(folder, &[&["compare"][..], &line, &["--ape"]].concat()).words;
        assert!(
            said.contains("gap.tum: has no pose for 1.600 s from 1.900 s on"),
            "{said}"
        );
    }
}

/// A walk of two joints as BVH, of which the knee turns most.
fn walk(folder: &std::path::Path, name: &str, knee: f64) {
    let mut text = String::from(
        "HIERARCHY\nROOT hip\n{\n OFFSET 0 1 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation \
         Xrotation Yrotation\n JOINT knee\n {\n  OFFSET 0 -0.5 0\n  CHANNELS 3 Zrotation Xrotation \
         Yrotation\n  End Site\n  {\n   OFFSET 0 -0.5 0\n  }\n }\n}\nMOTION\nFrames: 61\nFrame Time: \
         0.05\n",
    );
    for i in 0..61 {
        let t = f64::from(i) * 0.3;
        let bend = -20.0 * (1.5 * t).cos() + if i == 30 { knee } else { 0.0 };
        text += &format!(
            "{t} 1 {} {} 5 0 {bend} 0 0\n",
            0.2 * (t * 2.0).sin(),
            30.0 * t.sin()
        );
    }
    std::fs::write(folder.join(name), text).unwrap();
}

/// A table has no parents: its rotations relative to parents are none in the world.
#[test]
fn rotations_of_unknown_parents_are_not_compared_in_the_world() {
    let temporary = sample_folder();
    let folder = temporary.path();
    walk(folder, "walk.bvh", 0.0);
    succeed(folder, &["convert", "walk.bvh", "-o", "walk.csv"]);
    succeed(
        folder,
        &["compare", "walk.bvh", "walk.csv", "--tolerance", "1"],
    );
    for pair in [["walk.bvh", "walk.csv"], ["walk.csv", "walk.bvh"]] {
        let refused = run(folder, &[&["compare"][..], &pair, &["--world"]].concat());
        let words = "`knee` has a parent in walk.bvh, and walk.csv has no skeleton, so its poses in the world are not \
                     known; give walk.csv in a format that stores parents";
        assert!(
            refused.code == 4 && refused.words.contains(words),
            "{}",
            refused.words
        );
        let path = [&["compare"][..], &pair, &["--ape", "--tracks", "knee"]].concat();
        let refused = run(folder, &path);
        assert!(
            refused.code == 4 && refused.words.contains(words),
            "{}",
            refused.words
        );
    }
    // Without a joint that has a parent, nothing is assumed.
    succeed(
        folder,
        &[
            "compare", "walk.bvh", "walk.csv", "--world", "--tracks", "hip",
        ],
    );
    // With the parents, the table is where the skeleton is.
    let world = ["-m", "slerp", "--quantity", "world", "-o"];
    let parents = ["--parents", "-1,0"];
    succeed(
        folder,
        &[&["eval", "walk.bvh"][..], &world, &["bvh.npy"]].concat(),
    );
    succeed(
        folder,
        &[&["eval", "walk.csv"][..], &parents, &world, &["csv.npy"]].concat(),
    );
    succeed(
        folder,
        &["compare", "bvh.npy", "csv.npy", "--tolerance", "1e-5"],
    );
    let again = run(
        folder,
        &[&["eval", "walk.bvh"][..], &parents, &world, &["no.npy"]].concat(),
    );
    assert!(
        again
            .words
            .contains("has a skeleton, or poses in the world, already"),
        "{}",
        again.words
    );
}

/// The names of two joints that are called alike say nothing but their order.
#[test]
fn joints_of_one_name_are_told_to_be_matched_by_their_order() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let leg = |inside: &str| {
        format!(
            "JOINT Leg\n{{\nOFFSET 1 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n{inside}}}\n"
        )
    };
    let write = |name: &str, legs: String| {
        let rows = "MOTION\nFrames: 2\nFrame Time: 0.5\n0 0 0 0 0 0 0 0 0\n9 0 0 5 0 0 7 0 0\n";
        let root =
            "HIERARCHY\nROOT hip\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n";
        std::fs::write(folder.join(name), format!("{root}{legs}}}\n{rows}")).unwrap();
    };
    write("beside.bvh", leg("") + &leg(""));
    write("chain.bvh", leg(&leg("")));
    let words = "several joints are called `Leg`; they are matched with those of other clips by their order in the file";
    let beside = succeed(folder, &["compare", "beside.bvh", "beside.bvh"]);
    assert!(beside.words.contains(words), "{}", beside.words);
    // Their parents tell these apart.
    let chain = succeed(folder, &["compare", "chain.bvh", "chain.bvh"]);
    assert!(!chain.words.contains(words), "{}", chain.words);
}

/// The checks that the guides and the help propose hold: a conversion is a copy, between the keys too, and few keys
/// stay within their tolerance.
#[test]
fn documented_checks_hold() {
    let temporary = sample_folder();
    let folder = temporary.path();
    walk(folder, "walk.bvh", 0.0);
    let mut files = vec!["walk.bvh".to_owned()];
    let shared = crate::program::root().join("../shared/data/bvh");
    for name in ["cmu_01_01.bvh", "sinusoidal.bvh"] {
        match shared.join(name).exists() {
            true => files.push(shared.join(name).to_str().unwrap().to_owned()),
            false => eprintln!("{name} is not there: its checks are left out"),
        }
    }
    for file in &files {
        for line in [
            &["convert", file, "-o", "walk.glb", "--overwrite"][..],
            &[
                "compare",
                file,
                "walk.glb",
                "--tolerance",
                "0",
                "--distance",
                "0",
            ],
            &["convert", file, "-o", "walk.npz", "--overwrite"],
            &[
                "compare",
                file,
                "walk.npz",
                "--tolerance",
                "0",
                "--distance",
                "0",
            ],
            &["convert", "walk.glb", "-o", "back.bvh", "--overwrite"],
            &[
                "compare",
                file,
                "back.bvh",
                "--tolerance",
                "0.0001",
                "--distance",
                "0.0001",
            ],
            &[
                "reduce",
                file,
                "--tolerance",
                "0.1deg",
                "-o",
                "reduced.glb",
                "--overwrite",
            ],
            &[
                "compare",
                file,
                "reduced.glb",
                "--world",
                "--tolerance",
                "0.1deg",
                "--distance",
                "0.5",
            ],
            &[
                "reduce",
                file,
                "--tolerance",
                "0.1deg",
                "--method",
                "cubic",
                "-o",
                "take.glb",
                "--overwrite",
            ],
            &[
                "compare",
                file,
                "take.glb",
                "--world",
                "--fps",
                "20",
                "--tolerance",
                "0.1001",
            ],
        ] {
            let run = run(folder, line);
            assert_eq!(run.code, 0, "{line:?}: {}", run.words);
            assert!(!run.words.contains("W208"), "{line:?}: {}", run.words);
        }
    }
    // In the other direction there is a warning.
    for (from, to) in [
        ("a.dat", "a.glb"),
        ("a.dat", "a.bvh"),
        ("walk.bvh", "walk.csv"),
    ] {
        let said = succeed(folder, &["convert", from, "-o", to]).words;
        let curves = [
            "the smooth curves between the keys",
            "the lines and arcs between the keys",
        ];
        assert!(
            said.contains(curves[usize::from(from == "walk.bvh")]),
            "{to}: {said}"
        );
    }
}

/// The joints of two motions, worst first, by frames; a motion has no difference from itself.
#[test]
fn joints_are_listed_worst_first() {
    let temporary = sample_folder();
    let folder = temporary.path();
    walk(folder, "walk.bvh", 0.0);
    walk(folder, "bent.bvh", 7.0);
    let (_, found) = json(folder, &["compare", "walk.bvh", "bent.bvh", "--json"]);
    let joints = found["clips"][0]["joints"].as_array().unwrap();
    let knee = &joints[0];
    assert_eq!((joints.len(), &knee["track"]), (2, &"knee".into()));
    assert!((knee["rotation"]["largest"].as_f64().unwrap() - 7.0).abs() < 1e-4);
    assert_eq!(
        (&knee["rotation"]["frame"], &knee["rotation"]["time"]),
        (&30.0.into(), &1.5.into())
    );
    assert_eq!(joints[1]["rotation"]["largest"], 0.0);
    let (_, found) = json(
        folder,
        &["compare", "walk.bvh", "bent.bvh", "--json", "--top", "1"],
    );
    assert_eq!(found["clips"][0]["joints"].as_array().unwrap().len(), 1);

    let text = succeed(folder, &["compare", "walk.bvh", "bent.bvh"]).out;
    let text = String::from_utf8(text).unwrap();
    assert!(
        text.contains("largest 7° at knee, 1.5 s (frame 30)"),
        "{text}"
    );
    assert!(text.contains("\n  knee "), "{text}");
    assert!(
        !text.contains("more joint"),
        "the other does not differ: {text}"
    );

    let csv = succeed(folder, &["compare", "walk.bvh", "bent.bvh", "--csv"]).out;
    let csv = String::from_utf8(csv).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0][..4], ["first", "second", "joint", "rotation_mean"]);
    assert_eq!((rows.len(), rows[1][2], rows[1][7]), (3, "knee", "30"));

    // The number of joints that are not listed does not count joints without a difference.
    walk(folder, "both.bvh", 7.0);
    let bent = std::fs::read_to_string(folder.join("both.bvh")).unwrap();
    let changed = bent.replace(" 5 0 ", " 6 0 ");
    std::fs::write(folder.join("both.bvh"), changed).unwrap();
    let line = ["compare", "walk.bvh", "both.bvh", "--top", "1"];
    let text = String::from_utf8(succeed(folder, &line).out).unwrap();
    assert!(text.contains("and 1 more joint (--top 2)"), "{text}");

    // One file by two paths, or by a pattern given twice, is compared with itself.
    for pair in [["walk.bvh", "./walk.bvh"], ["wal?.bvh", "wal?.bvh"]] {
        let same = succeed(
            folder,
            &[&["compare"][..], &pair, &["--tolerance", "0"]].concat(),
        );
        let text = String::from_utf8(same.out).unwrap();
        assert!(text.contains("largest 0°"), "{text}");
        assert!(!same.words.contains("named twice"), "{}", same.words);
    }

    // In the world the tip of the leg moves, and nothing above it.
    let line = [
        "compare",
        "walk.bvh",
        "walk.bvh",
        "--tolerance",
        "0",
        "--world",
        "--distance",
        "0",
    ];
    let text = String::from_utf8(succeed(folder, &line).out).unwrap();
    assert!(
        text.contains("rotation     mean 0°, rms 0°, largest 0°\n"),
        "{text}"
    );
}

/// The times of another file that a clip has none of are refused, and times outside the keys can be left out.
#[test]
fn times_outside_the_keys_are_left_out_or_refused() {
    let temporary = sample_folder();
    let folder = temporary.path();
    std::fs::write(folder.join("late.dat"), "# 1 2\n9 1 0 0 0\n10 1 0 0 0\n").unwrap();
    let at = [
        "eval",
        "a.dat",
        "--at",
        "late.dat",
        "-o",
        "at.csv",
        "--overwrite",
    ];
    let refused = run(folder, &at);
    assert_eq!(refused.code, 4, "{}", refused.words);
    let says = "a.dat: none of the requested times, 9 to 10 s, lies between its keys, 0 to 2 s";
    assert!(refused.words.contains(says), "{}", refused.words);
    // Where the motion goes on, these times have values.
    succeed(folder, &[&at[..], &["--after", "loop"]].concat());
    let rows = |line: &str| {
        let line = format!("eval a.dat --overwrite -o out.csv {line}");
        let said = succeed(folder, &line.split(' ').collect::<Vec<_>>());
        let text = std::fs::read_to_string(folder.join("out.csv")).unwrap();
        let times = text
            .lines()
            .skip(1)
            .map(|line| line.split(',').next().unwrap().to_owned());
        let mut times: Vec<String> = times.collect();
        times.dedup();
        (times, said.words)
    };
    let range = "--fps 2 --start -1 --end 3.5";
    assert_eq!(rows(range).0.len(), 10);
    let (times, said) = rows(&format!("{range} --before leave-out --after leave-out"));
    assert_eq!(times.len(), 5, "{times:?}");
    assert!(
        said.contains("5 of 10 times lie outside the keys; they are left out"),
        "{said}"
    );
    assert_eq!(rows(&format!("{range} --after leave-out")).0.len(), 7);
    std::fs::write(folder.join("times.txt"), "-1\n0.3\n1.9\n2.1\n").unwrap();
    let (times, _) = rows("--times times.txt --before leave-out --after leave-out");
    assert_eq!(times.len(), 2, "{times:?}");
    let line = "eval a.dat -o none.csv --fps 2 --start 5 --end 6 --after leave-out";
    let refused = run(folder, &line.split(' ').collect::<Vec<_>>());
    assert!(
        refused.code == 4 && refused.words.contains("none of the requested times"),
        "{}",
        refused.words
    );
}

/// Clocks that are apart: the message has both ranges and the option, and the option makes them one.
#[test]
fn an_offset_joins_two_clocks() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let path = |start: f64| -> String {
        let poses = (0..20).map(|key| {
            let t = f64::from(key) / 10.0;
            format!("{} {} {} 0 0 0 0 1\n", start + t, t.sin(), t * t)
        });
        poses.collect()
    };
    std::fs::write(folder.join("truth.tum"), path(1_700_000_000.0)).unwrap();
    std::fs::write(folder.join("late.tum"), path(1_700_000_500.25)).unwrap();
    for more in [&["--ape"][..], &[]] {
        let refused = run(
            folder,
            &[&["compare", "truth.tum", "late.tum"], more].concat(),
        );
        assert_eq!(refused.code, 4, "{}", refused.words);
        for part in [
            "truth.tum from 1700000000 to 1700000001.9 s, late.tum from 1700000500.25 to 1700000502.15 s",
            "--time-offset adds seconds to the times of the second (-500.25 lets both begin together)",
        ] {
            assert!(refused.words.contains(part), "{}", refused.words);
        }
    }
    let line = [
        "compare",
        "truth.tum",
        "late.tum",
        "--time-offset",
        "-500.25",
    ];
    let (code, found) = json(folder, &[&line[..], &["--ape", "--json"]].concat());
    assert_eq!((code, &found["trajectory"]["poses"]), (0, &Value::from(20)));
    let rmse = found["trajectory"]["ape"]["translation"]["rmse"].as_f64();
    assert!(rmse.unwrap() < 1e-6, "{found}");
    let (_, found) = json(folder, &[&line[..], &["--json"]].concat());
    let span = [1_700_000_000.0, 1_700_000_001.9].map(Value::from);
    assert_eq!(found["clips"][0]["span"], Value::from(span.to_vec()));
}

/// Two clocks are not the age of the universe apart, and times are printed with few digits.
#[test]
fn offsets_of_clocks_are_possible_ones() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let line = ["compare", "a.dat", "b.dat", "--time-offset"];
    let refused = run(folder, &[&line[..], &["1e300"]].concat());
    assert_eq!(refused.code, 2, "{}", refused.words);
    let expected = "1e300 s is too long a time between two clocks; give seconds from -1e11 to 1e11";
    assert!(refused.words.contains(expected), "{}", refused.words);
    let third = succeed(folder, &[&line[..], &["0.333333333333"]].concat());
    let expected =
        "a.dat from 0 to 2 s, b.dat from 0.333333 to 2.333333 s; compared from 0.333333 to 2 s";
    assert!(third.words.contains(expected), "{}", third.words);
}

/// Motions without tracks, such as the joints of a robot, are compared by the names of their scalars.
#[test]
fn scalars_alone_are_compared() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let write = |name: &str, header: &str, last: &str| {
        std::fs::create_dir_all(folder.join(name).parent().unwrap()).unwrap();
        let text = format!("time,{header}\n0,0,0\n1,{last}\n");
        std::fs::write(folder.join(name), text).unwrap();
    };
    write("one/s.csv", "knee.scalar_angle,weight.scalar_plain", "1,1");
    write(
        "two/s.csv",
        "weight.scalar_plain,knee.scalar_angle",
        "1,0.5",
    );
    let (code, found) = json(folder, &["compare", "one/s.csv", "two/s.csv", "--json"]);
    let clip = &found["clips"][0];
    assert_eq!((code, &clip["rotation"]), (0, &Value::Null), "{found}");
    assert_eq!(
        (&clip["tracks"], &clip["scalar_count"]),
        (&0.into(), &2.into())
    );
    assert_eq!(clip["scalars"][0]["track"], "knee");
    let angle = clip["scalars"][0]["largest"].as_f64().unwrap();
    assert!((angle - 0.5f64.to_degrees()).abs() < 1e-4, "{found}");
    assert_eq!(clip["scalars"][1]["largest"], 0.0, "{found}");
    let report = succeed(folder, &["compare", "one/s.csv", "two/s.csv"]);
    let report = String::from_utf8(report.out).unwrap();
    let expected =
        "one/s.csv and two/s.csv: 2 scalars × 3 samples from 0 to 1 s\n  scalar angle mean";
    assert!(report.starts_with(expected), "{report}");
    assert!(!report.contains("rotation"), "{report}");
    let over = ["--tolerance", "1deg"];
    let failed = run(
        folder,
        &[&["compare", "one/s.csv", "two/s.csv"], &over[..]].concat(),
    );
    assert_eq!(failed.code, 8, "{}", failed.words);
    assert!(
        failed.words.contains("angle knee of 28.65°"),
        "{}",
        failed.words
    );
    let folders = succeed(folder, &["compare", "one", "two"]);
    let report = String::from_utf8(folders.out).unwrap();
    assert!(report.contains("s.csv: angle 28.65°\n"), "{report}");
    write("three.csv", "hip.scalar_angle,elbow.scalar_angle", "1,1");
    let refused = run(folder, &["compare", "one/s.csv", "three.csv"]);
    assert_eq!(refused.code, 4, "{}", refused.words);
    let expected = "have 2 and 2 scalars, none of the same name";
    assert!(refused.words.contains(expected), "{}", refused.words);
    // A difference of an angle and a length has no unit.
    write("four.csv", "knee.scalar_length,weight.scalar_plain", "1,1");
    let refused = run(
        folder,
        &["compare", "one/s.csv", "four.csv", "--tolerance", "10"],
    );
    assert_eq!(refused.code, 4, "{}", refused.words);
    let expected = "the scalar `knee` is of the kind `angle` in one/s.csv and `length` in four.csv";
    assert!(refused.words.contains(expected), "{}", refused.words);
}

/// The joint in the line of the largest angle is the first of the table, also where two joints differ equally.
#[test]
fn the_largest_is_the_first_of_the_table() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let body = |x: [f64; 2], angles: &str| {
        let joint = |name: &str| {
            format!(
                " JOINT {name}\n {{\n  OFFSET 0 0 0\n  CHANNELS 4 Xposition Xrotation Yrotation Zrotation\n  End \
                 Site\n  {{\n   OFFSET 0 1 0\n  }}\n }}\n"
            )
        };
        format!(
            "HIERARCHY\nROOT Hips\n{{\n OFFSET 0 0 0\n CHANNELS 3 Xrotation Yrotation Zrotation\n{}{}}}\nMOTION\n\
             Frames: 2\nFrame Time: 0.5\n0 0 0 0 0 0 0 0 0 0 0\n0 0 0 {} {angles} {} {angles}\n",
            joint("Left"),
            joint("Right"),
            x[0],
            x[1]
        )
    };
    std::fs::write(folder.join("a.bvh"), body([0.0, 0.0], "0 0 0")).unwrap();
    std::fs::write(folder.join("b.bvh"), body([0.0, 1.0], "2 0 0")).unwrap();
    let (_, found) = json(
        folder,
        &["compare", "a.bvh", "b.bvh", "--json", "--top", "1"],
    );
    let clip = &found["clips"][0];
    assert_eq!(clip["joints"][0]["track"], "Right", "{found}");
    assert_eq!(clip["rotation"]["track"], "Right", "{found}");
    assert_eq!(clip["translation"]["track"], "Right", "{found}");
}

/// Two directories: the files of one name are compared.
#[test]
fn directories_are_compared_file_by_file() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    let text = std::fs::read_to_string(folder.join("a.dat")).unwrap();
    let rotated = |half: f64| format!("# 1 1\n0 1 0 0 0\n1 {} 0 0 {}\n", half.cos(), half.sin());
    for side in ["before", "after"] {
        write(&format!("{side}/same.dat"), &text);
        write(&format!("{side}/only-{side}.dat"), &text);
    }
    write("before/deep/turn.dat", &rotated(0.1));
    write("after/deep/turn.dat", &rotated(0.2));
    let line = ["compare", "before", "after"];
    let report = String::from_utf8(succeed(folder, &line).out).unwrap();
    let expected = "deep/turn.dat: angle 11.46°\n2 pairs of files: 1 without a difference, 1 with one\n1 file only in \
                    before: only-before.dat\n1 file only in after: only-after.dat\n";
    assert_eq!(report, expected);
    let (code, found) = json(
        folder,
        &[&line[..], &["--json", "--tolerance", "1deg"]].concat(),
    );
    assert_eq!(code, 8);
    assert_eq!(found["missing"][0][0], "only-before.dat");
    assert_eq!(found["pairs"][0]["file"], "deep/turn.dat");
    let angle = found["pairs"][0]["angle"].as_f64().unwrap();
    assert!((angle - 0.2f64.to_degrees()).abs() < 1e-3, "{found}");
    assert_eq!(found["pairs"][1]["angle"], 0.0);
    let failed = run(folder, &[&line[..], &["--tolerance", "1deg"]].concat());
    let expected = "they differ: 1 pair over the limit, 2 files in only one of the directories";
    assert!(failed.words.contains(expected), "{}", failed.words);
    // A result that is cut to half of its length counts as different.
    write("short/same.dat", "# 1 1\n0 1 0 0 0\n2 1 0 0 0\n");
    write("whole/same.dat", "# 1 1\n0 1 0 0 0\n4 1 0 0 0\n");
    let (code, found) = json(
        folder,
        &["compare", "short", "whole", "--json", "--tolerance", "1deg"],
    );
    assert_eq!(
        (code, &found["pairs"][0]["unshared_seconds"]),
        (8, &Value::from(2.0))
    );
    let report = String::from_utf8(succeed(folder, &["compare", "short", "whole"]).out).unwrap();
    assert!(report.contains("same.dat: 2 s in only one\n"), "{report}");
    // If a number is NaN in one of the files, it has no difference.
    for (side, number) in [("nan", f32::NAN), ("number", 1.5)] {
        let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }";
        let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
        bytes.extend(format!("{header:<117}\n").bytes());
        bytes.extend([number, 2.0].iter().flat_map(|number| number.to_le_bytes()));
        std::fs::create_dir(folder.join(side)).unwrap();
        std::fs::write(folder.join(side).join("n.npy"), bytes).unwrap();
    }
    let (code, found) = json(
        folder,
        &["compare", "nan", "number", "--json", "--tolerance", "1"],
    );
    let pair = &found["pairs"][0];
    assert_eq!(
        (code, &pair["number"], &pair["not_finite"]),
        (8, &0.0.into(), &1.into())
    );
    let report = String::from_utf8(succeed(folder, &["compare", "nan", "number"]).out).unwrap();
    let expected = "n.npy: 1 number is NaN or infinite in only one\n";
    assert!(report.contains(expected), "{report}");
    write("after/deep/turn.dat", "# 1 1\n0 1 0\n");
    let failed = run(folder, &line);
    assert_eq!(failed.code, 3, "{}", failed.words);
    let report = String::from_utf8(failed.out).unwrap();
    assert!(report.contains("deep/turn.dat: not compared"), "{report}");
    write("other/x.dat", &text);
    let failed = run(folder, &["compare", "before", "other"]);
    assert!(
        failed.code == 4 && failed.words.contains("no file of before"),
        "{}",
        failed.words
    );
    let failed = run(folder, &["compare", "before", "after", "a.dat"]);
    assert!(
        failed.words.contains("not 2 directories and 1 file"),
        "{}",
        failed.words
    );
    write("before/more.dat", &text);
    let report = String::from_utf8(run(folder, &line).out).unwrap();
    let expected = "2 files only in before: more.dat … (--json lists all)\n";
    assert!(report.contains(expected), "{report}");
    let refused = run(folder, &[&line[..], &["--csv"]].concat());
    assert!(refused.code == 2 && refused.words.contains("(--json lists all pairs of files)"));
}

/// Two directories of trajectories: the errors of every estimate, with the limits of absolute errors.
#[test]
fn directories_of_trajectories_have_a_table_of_errors() {
    let temporary = sample_folder();
    let folder = temporary.path();
    for (side, offset) in [("truth", 0.0), ("estimate", 0.5)] {
        std::fs::create_dir(folder.join(side)).unwrap();
        for (name, factor) in [("a.tum", 1.0), ("b.tum", 2.0)] {
            let x = |second: u32| f64::from(second) + factor * offset;
            let pose = |second: u32| format!("{second} {} 0 0 0 0 0 1\n", x(second));
            let poses: String = (0..5).map(pose).collect();
            std::fs::write(folder.join(side).join(name), poses).unwrap();
        }
    }
    let line = ["compare", "truth", "estimate", "--rpe", "1s"];
    let both = [&line[..], &["--ape"]].concat();
    let report = String::from_utf8(succeed(folder, &both).out).unwrap();
    let expected = "  file   errors    count  translation rmse  max  rotation rmse  max
  a.tum  absolute      5               0.5  0.5             0°   0°
  a.tum  relative      4                 0    0             0°   0°
  b.tum  absolute      5                 1    1             0°   0°
  b.tum  relative      4                 0    0             0°   0°
2 pairs of trajectories
";
    assert_eq!(report, expected);
    let limit = ["--distance", "0.75"];
    let (code, found) = json(folder, &[&both[..], &limit, &["--json"]].concat());
    let rmse = &found["pairs"][1]["trajectory"]["ape"]["translation"]["rmse"];
    assert_eq!((code, rmse), (8, &1.0.into()), "{found}");
    let failed = run(folder, &[&both[..], &limit].concat());
    assert!(
        failed.words.contains("1 pair over the limit"),
        "{}",
        failed.words
    );
    let refused = run(folder, &[&line[..], &limit].concat());
    let expected = "--tolerance and --distance are limits of absolute errors; add --ape";
    assert!(
        refused.code == 2 && refused.words.contains(expected),
        "{}",
        refused.words
    );
}

/// A program that reads the JSON can open the files of these names; a terminal gets no line feed of a name.
#[cfg(unix)]
#[test]
fn names_in_json_are_as_they_are() {
    let temporary = sample_folder();
    let folder = temporary.path();
    for side in ["x", "y"] {
        std::fs::create_dir(folder.join(side)).unwrap();
        std::fs::copy(
            folder.join("a.dat"),
            folder.join(side).join("new\nline.dat"),
        )
        .unwrap();
    }
    std::fs::copy(folder.join("a.dat"), folder.join("x/lone\t.dat")).unwrap();
    let (code, found) = json(folder, &["compare", "x", "y", "--json"]);
    assert_eq!(
        (code, &found["pairs"][0]["file"], &found["missing"][0][0]),
        (0, &"new\nline.dat".into(), &"lone\t.dat".into())
    );
    let report = String::from_utf8(succeed(folder, &["compare", "x", "y"]).out).unwrap();
    assert!(report.contains("only in x: lone\\t.dat\n"), "{report}");
    let files = ["compare", "x/new\nline.dat", "y/new\nline.dat"];
    let (_, found) = json(folder, &[&files[..], &["--json"]].concat());
    assert_eq!(found["clips"][0]["inputs"][0], "x/new\nline.dat");
    let report = String::from_utf8(succeed(folder, &files).out).unwrap();
    assert!(report.starts_with("x/new\\nline.dat and y/"), "{report}");
}

/// Of directories the reason names only what differs: no pair is over the limit where a scalar is missing.
#[test]
fn directories_are_refused_for_the_right_reason() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let write = |name: &str, column: &str, value: &str| {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        let text = format!("time,knee.scalar_angle,{column}.scalar_angle\n0,0,0\n1,{value},1\n");
        std::fs::write(path, text).unwrap();
    };
    write("da/x.csv", "hip", "1");
    write("db/x.csv", "toe", "1.05");
    let of = |more: &str| {
        let line = format!("compare da db {more}");
        run(folder, &line.split(' ').collect::<Vec<_>>())
    };
    for (tolerance, reason) in [
        (
            "--tolerance 10",
            "they differ: 1 pair with tracks or scalars in only one of the files\n",
        ),
        (
            "--tolerance 1",
            "they differ: 1 pair over the limit, 1 pair with tracks or scalars in only one of the files\n",
        ),
    ] {
        let found = of(tolerance);
        assert_eq!(found.code, 8, "{}", found.words);
        assert!(found.words.ends_with(reason), "{}", found.words);
    }
    let empty = run(folder, &["compare", "empty", "empty"]);
    assert!(
        empty
            .words
            .contains("is a directory without files in readable formats"),
        "{}",
        empty.words
    );
    // A clip of tracks and a clip of scalars have nothing to compare.
    for files in [["a.dat", "da/x.csv"], ["da/x.csv", "a.dat"]] {
        let found = run(folder, &[&["compare"][..], &files].concat());
        let expected = "error: da/x.csv has only scalars, and none of them has the name of a scalar of a.dat\n";
        assert!(
            found.code == 4 && found.words.contains(expected),
            "{}",
            found.words
        );
    }
}

/// Options for joints and bounds of other quantities have no effect on scalars alone.
#[test]
fn options_without_effect_on_scalars_are_refused() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let write = |name: &str, kind: &str| {
        let text = format!("time,knee.scalar_{kind}\n0,0\n1,1\n");
        std::fs::write(folder.join(name), text).unwrap();
    };
    write("angle.csv", "angle");
    write("plain.csv", "plain");
    write("length.csv", "length");
    for (line, code) in [
        ("angle.csv --top 2", 2),
        ("angle.csv --top 2 --json", 0),
        ("angle.csv --world", 2),
        ("angle.csv --worst-by distance", 2),
        ("angle.csv --distance 1", 2),
        ("length.csv --distance 1", 0),
        ("length.csv --tolerance 1", 2),
        ("plain.csv --tolerance 1", 2),
        ("plain.csv --tolerance 0", 0),
        ("angle.csv --tolerance 1", 0),
    ] {
        let words: Vec<&str> = line.split(' ').collect();
        let found = run(folder, &[&["compare", words[0]][..], &words].concat());
        assert_eq!(found.code, code, "{line}: {}", found.words);
        if code == 2 {
            let expected = format!(
                "error: {} has no effect where only scalars are compared; ",
                words[1]
            );
            assert!(found.words.contains(&expected), "{line}: {}", found.words);
        }
    }
}

/// In directories the order of the second input applies to the files that have a choice of orders.
#[test]
fn the_order_of_the_second_directory_applies_where_there_is_one() {
    let temporary = sample_folder();
    let folder = temporary.path();
    for (side, components) in [("one", "0.6 0 0 0.8"), ("two", "0.8 0.6 0 0")] {
        std::fs::create_dir(folder.join(side)).unwrap();
        let tum = format!("0 0 0 0 {components}\n1 0 0 0 {components}\n");
        std::fs::write(folder.join(side).join("p.tum"), tum).unwrap();
        std::fs::copy(folder.join("a.dat"), folder.join(side).join("a.dat")).unwrap();
    }
    let line = [
        "compare",
        "one",
        "two",
        "--second-source-order",
        "wxyz",
        "--tolerance",
        "1e-4",
    ];
    succeed(folder, &line);
    assert_eq!(
        run(folder, &["compare", "one", "two", "--tolerance", "1e-4"]).code,
        8
    );
    for side in ["one", "two"] {
        std::fs::remove_file(folder.join(side).join("p.tum")).unwrap();
    }
    let refused = run(folder, &line);
    let expected = "--second-source-order has no effect on dat; it is for ";
    assert!(
        refused.code == 2 && refused.words.contains(expected),
        "{}",
        refused.words
    );
}
