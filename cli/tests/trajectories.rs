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
    // By its heading, whatever it is called; to a format, whatever the file is called.
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
    // Sampled at a rate, poses need no file of times, and the rate is reported.
    let sampled = line(at, "eval path.tum --fps 20 -o path.kitti");
    assert!(
        sampled
            .words
            .contains("poses come at 20 a second, from 1305031098.6 s on"),
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

    refused(at, "convert path.tum -o uneven.kitti", "give --times-out");
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
    // Numbers alone, likewise.
    line(
        at,
        &format!("{eval} --in-gaps hold --output world -o held.csv"),
    );
    let text = fs::read_to_string(at.join("held.csv")).unwrap();
    assert!(text.lines().nth(3).unwrap().starts_with("2,0.9"), "{text}");
    refused(
        at,
        &format!("{eval} --in-gaps refuse -o no.tum"),
        "2 of 5 times lie between keys",
    );
    refused(
        at,
        &format!("{eval} --in-gaps hold --output velocity -o no.npy"),
        "has no velocity",
    );
    refused(
        at,
        "eval path.tum --at times.tum --in-gaps hold -o no.tum",
        "--max-gap",
    );
    assert!(!at.join("no.tum").exists() && !at.join("no.npy").exists());
}
