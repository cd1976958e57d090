//! Every remedy that a message names works: a line that is refused, its message, and the corrected line.

use std::fs;
use std::path::Path;

use crate::program::{run, sample_folder, succeed};

/// A line, a part of its message, and the lines that the message leads to.
const REMEDIES: &[(&str, &str, &[&str])] = &[
    (
        "follow way.csv --path-frame fixed -o o.npy",
        "(--path-frame minimal, --no-ups)",
        &[
            "follow way.csv --path-frame minimal -o o.npy",
            "follow way.csv --path-frame fixed --no-ups -o o.npy",
        ],
    ),
    (
        "follow points.csv -o o.npy",
        "give --seconds or --pace",
        &[
            "follow points.csv --seconds 2 -o o.npy",
            "follow points.csv --pace 2 -o o.npy",
        ],
    ),
    (
        "follow path.csv --seconds 2 -o o.npy",
        "leave out --seconds and --pace",
        &["follow path.csv -o o.npy"],
    ),
    (
        "eval a.dat -o old.npy",
        "give --overwrite",
        &["eval a.dat -o old.npy --overwrite"],
    ),
    (
        "eval a.dat b.dat -o done",
        "--resume skips what is done",
        &[
            "eval a.dat b.dat -o done --resume",
            "eval a.dat b.dat -o done --overwrite",
        ],
    ),
    (
        "eval a.dat b.dat -o sharded",
        "--resume continues",
        &["merge sharded"],
    ),
    (
        "eval a.dat b.dat -o theirs",
        "or --overwrite to replace it",
        &[
            "eval a.dat b.dat -o theirs --overwrite",
            "eval a.dat b.dat -o other",
        ],
    ),
    (
        "smooth uneven.dat -o o.npy",
        "give --fps",
        &["smooth uneven.dat --fps 30 -o o.npy"],
    ),
    (
        "eval m.gltf -o o.npy",
        "choose one with --animation, or give a directory for all of them: -o RESULTS/",
        &[
            "eval m.gltf --animation Run -o o.npy",
            "eval m.gltf -o all/",
        ],
    ),
    (
        "reduce a.dat --method bessel-overhauser -o o.glb",
        "choose --method linear or cubic, or write .npz",
        &[
            "reduce a.dat --method linear -o o.glb",
            "reduce a.dat --method cubic -o o.glb",
            "reduce a.dat --method bessel-overhauser -o o.npz",
        ],
    ),
    (
        "eval twice.tum -o o.npy",
        "--duplicates first or --duplicates last keeps one of them, --duplicates both makes a jump",
        &[
            "eval twice.tum --duplicates first -o o.npy",
            "eval twice.tum --duplicates last -o o.npy",
            "eval twice.tum --duplicates both -o o.npy",
        ],
    ),
    // Times that are equal in f32 (E182), in a new file and in a file that is written again.
    (
        "eval late.dat --fps 60 -o o.glb",
        "give --fps 16 or less",
        &["eval late.dat --fps 16 -o o.glb"],
    ),
    (
        "eval late.glb --fps 60 -o o.glb",
        "give --fps 16 or less",
        &["eval late.glb --fps 16 -o o.glb"],
    ),
    // A rate that a dialect cannot hold (E918).
    (
        "eval take.csv --robot robot.xml --dialect mjlab --fps 29.97 -o o.npz",
        "give --fps 30",
        &["eval take.csv --robot robot.xml --dialect mjlab --fps 30 -o o.npz"],
    ),
    (
        "eval a.dat --quantity velocity --order wxyz -o o.npy",
        "leave it out",
        &["eval a.dat --quantity velocity -o o.npy"],
    ),
    (
        "route hill.obj -o o.csv",
        "give --start-point and --end-point",
        &["route hill.obj --start-point 1,0,1 --end-point 8,0,8 -o o.csv"],
    ),
    (
        "route hill.obj --by line --start-point 1,0,1 --end-point 8,0,8 -o o.csv",
        "are for nets",
        &["route hill.obj --start-point 1,0,1 --end-point 8,0,8 -o o.csv"],
    ),
    ("eval pipe.dat -o o.npy", "(--pipes reads named pipes)", &[]),
    (
        "eval a.dat --max-size 10B -o o.npy",
        "(--max-size)",
        &["eval a.dat --max-size 1MiB -o o.npy"],
    ),
    (
        "eval a.dat --json -o -",
        "give -o FILE",
        &["eval a.dat --json -o o.npy"],
    ),
    (
        "compare a.dat b.dat --start 1",
        "add it",
        &["compare a.dat b.dat --fps 30 --start 1"],
    ),
    (
        "convert uneven.dat -o o.bvh",
        "`tumble eval --fps` makes frames at a constant rate",
        &["eval uneven.dat --fps 30 -o o.bvh"],
    ),
    (
        "eval a.dat -o o.tum",
        "a trajectory has one: choose one without a parent, such as --tracks 0",
        &["eval a.dat --tracks 0 -o o.tum"],
    ),
    (
        "smooth waves.tum --low-pass 40 -o o.tum",
        "give a lower frequency",
        &["smooth waves.tum --low-pass 2 -o o.tum"],
    ),
];

fn folder() -> tempfile::TempDir {
    let temporary = sample_folder();
    let folder = temporary.path();
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
    write("points.csv", "x,y,z\n0,0,0\n1,0,0\n1,1,0\n");
    write("path.csv", "t,x,y,z\n0,0,0,0\n1,1,0,0\n2,1,1,0\n");
    write("uneven.dat", "# 1 1\n0 1 0 0 0\n1 1 0 0 0\n3 1 0 0 0\n");
    write(
        "twice.tum",
        "0 0 0 0 0 0 0 1\n1 0 0 0 0.6 0 0 0.8\n1 0 0 0 0 0 0 1\n",
    );
    let waves = (0..100).map(|i| format!("{} {} 0 0 0 0 0 1\n", f64::from(i) / 50.0, i % 7));
    write("waves.tum", &waves.collect::<String>());
    write("m.gltf", &crate::attack::two_animations());
    write("robot.xml", crate::robots::ROBOT);
    write("take.csv", &crate::robots::take());
    write("late.dat", "# 1 1\n1000000 1 0 0 0\n1000002 0.8 0.6 0 0\n");
    succeed(folder, &words("eval late.dat --fps 1 -o late.glb"));
    succeed(folder, &["generate", "--hill", "-o", "hill.obj"]);
    // The paths of `route` have upward directions.
    let route = "route hill.obj --start-point 1,0,1 --end-point 8,0,8 -o ups.csv";
    succeed(folder, &words(route));
    let points = fs::read_to_string(folder.join("ups.csv")).unwrap();
    assert!(points.starts_with("x,y,z,ux,uy,uz\n"), "{points}");
    let timed = points.lines().enumerate().map(|(at, line)| match at {
        0 => format!("t,{line}\n"),
        at => format!("{at},{line}\n"),
    });
    write("way.csv", &timed.collect::<String>());
    fs::create_dir(folder.join("theirs")).unwrap();
    write("theirs/manifest.jsonl", "notes\n");
    succeed(folder, &words("eval a.dat b.dat -o done"));
    succeed(folder, &words("eval a.dat b.dat -o sharded --shard 1/1"));
    crate::attack::pipe(&folder.join("pipe.dat"));
    temporary
}

fn clear(at: &Path) {
    for name in ["o.npy", "o.csv", "o.npz", "o.glb", "o.tum", "o.bvh"] {
        let _ = fs::remove_file(at.join(name));
    }
}

fn words(line: &str) -> Vec<&str> {
    line.split(' ').collect()
}

#[test]
fn what_a_message_says_to_do_works() {
    let temporary = folder();
    let folder: &Path = temporary.path();
    let mut wrong = Vec::new();
    for (line, message, remedies) in REMEDIES {
        clear(folder);
        let refused = run(folder, &words(line));
        if refused.code == 0 || !refused.words.contains(message) {
            wrong.push(format!(
                "{line}: {}, not `{message}`: {}",
                refused.code, refused.words
            ));
        }
        for remedy in *remedies {
            clear(folder);
            let done = run(folder, &words(remedy));
            if done.code != 0 {
                wrong.push(format!("{remedy}: {}: {}", done.code, done.words));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
