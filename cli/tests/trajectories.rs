//! Trajectories of TUM, `EuRoC`, KITTI and MCAP through the program: out of each into every other, and times that
//! lie in gaps.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::program::{Run, root, run, sample_folder, succeed};

fn line(folder: &Path, line: &str) -> Run {
    succeed(folder, &line.split(' ').collect::<Vec<_>>())
}

fn refused(folder: &Path, line: &str, words: &str) {
    let run = run(folder, &line.split(' ').collect::<Vec<_>>());
    assert_ne!(run.code, 0, "{line}");
    assert!(run.words.contains(words), "{line}: {}", run.words);
}

/// Five poses at 10 a second of Unix time, but for a gap of half a second before the last.
const PATH: &str = "\
1305031098.6 1 2 3 0 0 0 1
1305031098.7 1.25 2 3 0 0 0.6 0.8
1305031098.8 1.5 2 3 0 0.6 0 0.8
1305031099.3 2 2 3 0.6 0 0 0.8
";

/// A reader of clips would refuse them, so no file is written; the rows of tables have any order.
#[test]
fn samples_out_of_order_are_no_clip() {
    let folder = sample_folder();
    let at = folder.path();
    fs::write(at.join("path.tum"), PATH).unwrap();
    for (times, words) in [
        ("1\n0.75\n", "time 1305031099 is followed by 1305031098.75"),
        ("1\n1\n", "time 1305031099 is followed by 1305031099"),
    ] {
        fs::write(at.join("times.txt"), times).unwrap();
        for ending in ["dat", "glb", "gltf", "bvh", "npz", "tum", "euroc", "kitti"] {
            let words = format!("out.{ending}: error[E026]: {words}");
            let output = format!("eval path.tum --times times.txt -o out.{ending}");
            refused(at, &output, &words);
            assert!(!at.join(format!("out.{ending}")).exists(), "{ending}");
        }
        line(at, "eval path.tum --times times.txt --overwrite -o out.npy");
        line(at, "eval path.tum --times times.txt --overwrite -o out.csv");
    }
}

#[test]
fn smoothed_positions_are_in_tables_and_npy_says_that_it_has_none() {
    let folder = sample_folder();
    let at = folder.path();
    let path = "0 1 2 3 0 0 0 1\n1 2 2 3 0 0 0.6 0.8\n2 4 4 4 0 0.6 0 0.8\n3 4 5 6 0 0 0 1\n";
    fs::write(at.join("path.tum"), path).unwrap();
    for ending in ["csv", "parquet", "arrow", "npz"] {
        let smooth = format!("smooth path.tum --kernel linear -o smooth.{ending}");
        let words = line(at, &smooth).words;
        assert!(!words.contains("warning"), "{words}");
        line(at, &format!("convert smooth.{ending} -o {ending}.tum"));
        let smooth = fs::read_to_string(at.join(format!("{ending}.tum"))).unwrap();
        // (1 + 2 × 2 + 4) / 4, (2 + 2 × 2 + 4) / 4, (3 + 2 × 3 + 4) / 4
        let mut lines = smooth.lines();
        let expected = "1 2.25 2.5 3.25 ";
        assert!(lines.any(|line| line.starts_with(expected)), "{smooth}");
    }
    let words = line(at, "smooth path.tum --kernel linear -o smooth.npy").words;
    let left_out = "smooth.npy: warning[W208]: NPY cannot store this, left out: the translations";
    assert!(words.contains(left_out), "{words}");
}

#[test]
fn every_trajectory_becomes_every_other() {
    let folder = sample_folder();
    let at = folder.path();
    fs::write(at.join("path.tum"), PATH).unwrap();
    line(at, "convert path.tum -o path.euroc");
    let euroc = fs::read_to_string(at.join("path.euroc")).unwrap();
    assert!(euroc.starts_with("#timestamp [ns],p_RS_R_x [m],"));
    assert!(
        euroc.contains("\n1305031098700000000,1.25,2,3,0.8,0,0,0.6\n"),
        "{euroc}"
    );
    // The input's format is recognised by its heading, whatever its name is; `--to` selects that of
    // the output, whatever its name is.
    fs::rename(at.join("path.euroc"), at.join("data.csv")).unwrap();
    line(
        at,
        "convert data.csv --to kitti -o poses.txt --times-out times.txt",
    );
    let kitti = fs::read_to_string(at.join("poses.txt")).unwrap();
    let second = kitti.lines().nth(1).unwrap().split(' ');
    let second: Vec<f64> = second.map(|word| word.parse().unwrap()).collect();
    let expected = [
        0.28, -0.96, 0.0, 1.25, 0.96, 0.28, 0.0, 2.0, 0.0, 0.0, 1.0, 3.0,
    ];
    let mut pairs = second.iter().zip(expected);
    assert!(
        pairs.all(|(found, expected)| (found - expected).abs() < 1e-7),
        "{kitti}"
    );
    let times = fs::read_to_string(at.join("times.txt")).unwrap();
    assert_eq!(times.lines().nth(2), Some("1305031098.8"));
    line(at, "convert poses.txt --source-times times.txt -o back.tum");
    let compared = line(at, "compare path.tum back.tum --ape --json");
    let found: Value = serde_json::from_slice(&compared.out).unwrap();
    let found = &found["trajectory"];
    assert_eq!(found["poses"], 4);
    for of in ["translation", "rotation"] {
        let largest = found["ape"][of]["max"].as_f64().unwrap();
        assert!(largest < 1e-5, "{of}: {largest}");
    }
    // Poses that are sampled at a rate need no file of times; the message states the rate.
    let sampled = line(at, "eval path.tum --fps 20 -o path.kitti");
    assert!(
        sampled
            .words
            .contains("the poses are at 20 fps, from 1305031098.6 s on"),
        "{}",
        sampled.words
    );
    line(
        at,
        "smooth path.kitti --source-fps 20 -o smooth.kitti --times-out smooth.txt",
    );
    assert_eq!(
        fs::read_to_string(at.join("smooth.txt"))
            .unwrap()
            .lines()
            .nth(1),
        Some("0.05")
    );

    refused(at, "convert path.tum -o uneven.kitti", "with --times-out");
    refused(
        at,
        "convert path.tum -o other.tum --times-out t.txt",
        "--times-out is for kitti",
    );
    refused(
        at,
        "convert path.tum data.csv -o out --to kitti --times-out t.txt",
        "a single input",
    );
    refused(
        at,
        "convert path.tum -o k.kitti --times-out times.txt",
        "exists",
    );
    refused(
        at,
        "convert path.tum -o k.kitti --times-out k.kitti",
        "would be written twice by this command",
    );
    refused(at, "info poses.txt", "--source-times");
    refused(
        at,
        "info path.tum --source-times times.txt",
        "has no effect on tum",
    );
    fs::write(at.join("few.txt"), "0\n1\n").unwrap();
    refused(at, "info poses.txt --source-times few.txt", "E507");
    assert!(!at.join("k.kitti").exists());
}

/// Poses of a log, the transform between two frames among them.
#[test]
fn a_topic_of_a_log_becomes_a_trajectory() {
    let folder = sample_folder();
    let at = folder.path();
    let log = root().join("formats/tests/fixtures/mcap/good.mcap");
    fs::copy(log, at.join("run.mcap")).unwrap();
    line(at, "convert run.mcap --tracks odom/base -o base.tum");
    let text = fs::read_to_string(at.join("base.tum")).unwrap();
    assert_eq!(
        text.lines().filter(|line| !line.starts_with('#')).count(),
        6
    );
    assert!(text.contains("\n1700000000.109"), "{text}");
    let found = line(at, "info run.mcap --json");
    let found: Value = serde_json::from_slice(&found.out).unwrap();
    assert_eq!(found[0]["tracks"], 7);
}

#[test]
fn times_in_gaps_are_left_out_held_or_refused() {
    let folder = sample_folder();
    let at = folder.path();
    fs::write(at.join("path.tum"), PATH).unwrap();
    let times = "1305031098.65 0 0 0 0 0 0 1\n1305031098.8 0 0 0 0 0 0 1\n1305031098.9 0 0 0 0 0 0 1\n\
                 1305031099.2 0 0 0 0 0 0 1\n1305031099.3 0 0 0 0 0 0 1\n";
    fs::write(at.join("times.tum"), times).unwrap();
    let positions = |file: &str| -> Vec<String> {
        let text = fs::read_to_string(at.join(file)).unwrap();
        let lines = text.lines().filter(|line| !line.starts_with('#'));
        let words = |line: &str| line.split(' ').take(2).collect::<Vec<_>>().join(" ");
        lines.map(words).collect()
    };
    let eval = "eval path.tum -m slerp --at times.tum --max-gap 0.2";
    let said = line(at, &format!("{eval} -o left.tum --json"));
    let found: Value = serde_json::from_slice(&said.out).unwrap();
    assert_eq!(
        (&found[0]["in_gaps"], &found[0]["frames"]),
        (&2.into(), &3.into())
    );
    assert!(
        said.words.contains("3 frames (2 in gaps left out)"),
        "{}",
        said.words
    );
    assert_eq!(positions("left.tum").len(), 3);
    let said = line(at, &format!("{eval} --in-gaps hold -o held.tum --json"));
    let found: Value = serde_json::from_slice(&said.out).unwrap();
    assert_eq!(
        (&found[0]["in_gaps"], &found[0]["frames"]),
        (&2.into(), &5.into())
    );
    assert!(
        said.words.contains("5 frames (2 in gaps held)"),
        "{}",
        said.words
    );
    let held = positions("held.tum");
    assert_eq!(
        held[2..4],
        ["1305031098.900000000 1.5", "1305031099.200000000 1.5"]
    );
    assert_eq!(held[4], "1305031099.300000000 2");
    // The same for a table of numbers.
    line(
        at,
        &format!("{eval} --in-gaps hold --quantity world -o held.csv"),
    );
    let text = fs::read_to_string(at.join("held.csv")).unwrap();
    let third = text.lines().nth(3).unwrap();
    assert!(third.starts_with("2,1305031098.9,"), "{text}");
    refused(
        at,
        &format!("{eval} --in-gaps refuse -o no.tum"),
        "2 of 5 times lie between keys",
    );
    refused(
        at,
        &format!("{eval} --in-gaps hold --quantity velocity -o no.npy"),
        "has no velocity",
    );
    refused(
        at,
        "eval path.tum --at times.tum --in-gaps hold -o no.tum",
        "--max-gap",
    );
    assert!(!at.join("no.tum").exists() && !at.join("no.npy").exists());
}

/// Gaps are found however the sample times are chosen.
#[test]
fn frames_and_listed_times_lie_in_gaps_too() {
    let folder = sample_folder();
    let at = folder.path();
    let keys = "t,x,y,z,w\n0,0,0,0,1\n1,0,0,0.6,0.8\n4,0,0,1,0\n5,0,0,1,0\n";
    fs::write(at.join("gap.csv"), keys).unwrap();
    fs::write(at.join("times.txt"), "0.5\n1\n2.5\n3\n4\n").unwrap();
    let column = |file: &str| -> Vec<(String, String)> {
        let text = fs::read_to_string(at.join(file)).unwrap();
        let rows = text.lines().skip(1).map(|row| {
            let cells: Vec<&str> = row.split(',').collect();
            (cells[1].to_owned(), cells[5].to_owned())
        });
        rows.collect()
    };
    let times = |file: &str| -> Vec<String> { column(file).into_iter().map(|(t, _)| t).collect() };
    let eval = "eval gap.csv -m slerp --max-gap 1.5";
    line(at, &format!("{eval} --fps 2 -o rate.csv"));
    assert_eq!(times("rate.csv"), ["0", "0.5", "1", "4", "4.5", "5"]);
    line(at, &format!("{eval} --times times.txt -o listed.csv"));
    assert_eq!(times("listed.csv"), ["0.5", "1", "4"]);
    line(at, &format!("{eval} --fps 1 --in-gaps hold -o held.csv"));
    let held = column("held.csv");
    assert_eq!(held.len(), 6);
    assert_eq!(held[1].1, "0.6");
    assert_eq!(held[2], ("2".to_owned(), "0.6".to_owned()));
    assert_eq!(held[3], ("3".to_owned(), "0.6".to_owned()));
    let refuse = format!("{eval} --fps 1 --in-gaps refuse -o no.csv");
    refused(at, &refuse, "2 of 6 times lie between keys");
    // In a copy of a file no frames can be left out.
    line(at, "convert gap.csv -o kept.glb");
    let kept = "eval kept.glb --max-gap 1.5 -m slerp -o no.glb";
    refused(at, kept, "leave out --max-gap, or write another format");
    assert!(!at.join("no.glb").exists() && !at.join("no.csv").exists());
    // If no frame is in a gap, the result has the same frames.
    line(
        at,
        "eval gap.csv -m slerp --fps 3 --start 0 --end 1 --max-gap 1 -o with.csv",
    );
    line(
        at,
        "eval gap.csv -m slerp --fps 3 --start 0 --end 1 -o without.csv",
    );
    let read = |file: &str| fs::read_to_string(at.join(file)).unwrap();
    assert_eq!(read("with.csv"), read("without.csv"));
}

/// Times in messages are those of the file, whatever second the clip counts from.
#[test]
fn messages_have_the_clock_of_the_file() {
    let folder = sample_folder();
    let at = folder.path();
    fs::write(at.join("path.tum"), PATH).unwrap();
    for (command, words) in [
        ("reduce path.tum -o r.tum", "(body, 1305031098.600 s)"),
        (
            "eval path.tum --fps 7 -o a.bvh",
            "the clip ends at 1305031099.3 s, between two frames at 7 fps; a last frame, at 1305031099.314286 s",
        ),
        (
            "verify path.tum -m slerp --fps 4 --device cpu",
            "at 130503109",
        ),
    ] {
        let run = succeed(at, &command.split(' ').collect::<Vec<_>>());
        let text = format!("{}{}", String::from_utf8_lossy(&run.out), run.words);
        assert!(text.contains(words), "{command}: {text}");
    }
    let gaps = "eval path.tum --max-gap 0.2 --in-gaps refuse --fps 7 -o b.npy";
    refused(at, gaps, "the first at 1305031098.885714 s;");
}

/// Would catch times since 1970 that lose their date in some formats or some quantities.
#[test]
fn times_since_1970_are_kept_by_every_table() {
    let folder = sample_folder();
    let at = folder.path();
    let keys = "t,x,y,z,w\n1700000000.123456789,0,0,0,1\n1700000000.623456789,0,0,0.6,0.8\n\
                1700000001.123456789,0,0,1,0\n";
    fs::write(at.join("keys.csv"), keys).unwrap();
    fs::write(at.join("path.tum"), PATH).unwrap();
    for (command, first) in [
        ("eval keys.csv --fps 4 -m slerp", "1700000000.123456789"),
        (
            "eval keys.csv --fps 4 -m slerp --quantity euler",
            "1700000000.123456789",
        ),
        (
            "eval keys.csv --fps 4 -m slerp --quantity velocity",
            "1700000000.123456789",
        ),
        ("eval path.tum --fps 10", "1305031098.6"),
        ("eval path.tum --fps 10 --quantity world", "1305031098.6"),
        (
            "eval path.tum --fps 10 --quantity transform",
            "1305031098.6",
        ),
        ("smooth keys.csv --kernel linear", "1700000000.123456789"),
        ("convert keys.csv", "1700000000.123456789"),
    ] {
        line(at, &format!("{command} --to csv --overwrite -o out.csv"));
        let text = fs::read_to_string(at.join("out.csv")).unwrap();
        let mut rows = text.lines().map(|row| row.split(',').collect::<Vec<_>>());
        let titles = rows.next().unwrap();
        let time = titles
            .iter()
            .position(|title| matches!(*title, "time" | "t"));
        let row = rows.next().unwrap();
        assert_eq!(row[time.unwrap()], first, "{command}: {text}");
        // Only poses are read again.
        if ["euler", "velocity"]
            .iter()
            .any(|quantity| command.ends_with(quantity))
        {
            continue;
        }
        line(
            at,
            &format!("{command} --to parquet --overwrite -o out.parquet"),
        );
        let said = line(at, "info out.parquet --json");
        let found: Value = serde_json::from_slice(&said.out).unwrap();
        let whole: i64 = first.split('.').next().unwrap().parse().unwrap();
        assert_eq!(found[0]["time_offset"], whole, "{command}: {found}");
    }
}

/// A time may be requested as it is in the file, or counted from the second from which the clip's times
/// are counted.
#[test]
fn times_of_the_file_may_be_asked_for() {
    let folder = sample_folder();
    let at = folder.path();
    let keys = "t,x,y,z,w\n1700000000.25,0,0,0,1\n1700000000.75,0,0,0.6,0.8\n1700000001.25,0,0,0.96,0.28\n";
    fs::write(at.join("keys.csv"), keys).unwrap();
    fs::write(at.join("files.txt"), "1700000000.75\n1700000001\n").unwrap();
    fs::write(at.join("counted.txt"), "0.75\n1\n").unwrap();
    let made = |options: &str| {
        let said = line(
            at,
            &format!("eval keys.csv -m slerp {options} --to csv --overwrite -o out.csv"),
        );
        assert!(
            !said.words.contains("requested times"),
            "{options}: {}",
            said.words
        );
        fs::read_to_string(at.join("out.csv")).unwrap()
    };
    let listed = made("--times files.txt");
    assert_eq!(listed, made("--times counted.txt"));
    assert!(
        listed.contains("\n0,1700000000.75,0.8,0,0,0.6\n"),
        "{listed}"
    );
    let part = made("--fps 2 --start 1700000000.75 --end 1700000001.25");
    assert_eq!(part, made("--fps 2 --start 0.75 --end 1.25"));
    assert!(part.contains("\n1,1700000001.25,"), "{part}");
    line(at, "convert keys.csv --start 1700000000.75 -o part.tum");
    let text = fs::read_to_string(at.join("part.tum")).unwrap();
    let mut rows = text.lines().filter(|row| !row.starts_with('#'));
    assert!(
        rows.next_back().unwrap().starts_with("1700000001.25"),
        "{text}"
    );
    let said = line(at, "eval keys.csv --start 1699999999 --fps 1 -o before.csv");
    let words =
        "from 1699999999 to 1700000001.25 s exceed the keys, 1700000000.25 to 1700000001.25 s";
    assert!(said.words.contains(words), "{}", said.words);
    // Times near 0 are those of the file, not seconds since 1970.
    fs::write(
        at.join("late.tum"),
        "5.25 0 0 0 0 0 0 1\n7.25 2 0 0 0 0 0 1\n",
    )
    .unwrap();
    line(
        at,
        "eval late.tum -m slerp --fps 1 --start 6.25 -o late.csv",
    );
    let text = fs::read_to_string(at.join("late.csv")).unwrap();
    assert!(
        text.contains("6.25,") && text.lines().count() == 3,
        "{text}"
    );
}
