//! Options are obeyed or refused: every pair of `tumble eval`'s options, on inputs of several formats.
//!
//! A program of its own, since it runs the commands in its own process, a thousand times.

#![allow(clippy::disallowed_methods)] // as in tests/all.rs

use std::collections::HashMap;
use std::ffi::OsString;
use std::fmt::Write;
use std::path::{Path, PathBuf};

const DONE: u8 = 0;
const USAGE: u8 = 2;
/// The exit code of inputs that are not in the format requested.
const INPUT: u8 = 4;

/// Each option with the options that it needs to have an effect. The values are chosen so that they
/// change the result.
const OPTIONS: &[&[&str]] = &[
    &["--method", "c2"],
    &["--method", "kochanek-bartels"],
    &["--method", "kochanek-bartels", "--tension", "0.5"],
    &["--method", "kochanek-bartels", "--continuity", "0.5"],
    &["--method", "kochanek-bartels", "--bias", "0.5"],
    &["--method", "slerp"],
    &["--fps", "30"],
    &["--times", "times.txt"],
    &["--start", "0.3"],
    &["--from-zero"],
    &["--end", "1.3"],
    &["--end-frame", "hold"],
    &["--ends", "natural"],
    &["--signs", "as-authored"],
    &["--speed", "constant"],
    &["--start", "-0.7", "--before", "mirror"],
    &["--end", "3.1", "--after", "loop"],
    &["--tension", "0.5"],
    &["--layout", "frame"],
    &["--layout", "track"],
    &["--order", "wxyz"],
    &["--order", "xyzw"],
    &["--encoding", "f16"],
    &["--quantity", "euler"],
    &["--quantity", "euler", "--sequence", "ZYX"],
    &["--quantity", "matrix"],
    &["--quantity", "matrix", "--major", "column"],
    &["--quantity", "velocity"],
    &["--quantity", "velocity", "--axes", "parent"],
    &["--quantity", "world"],
    &["--quantity", "transform"],
    &["--sequence", "ZYX"],
    &["--major", "column"],
    &["--axes", "parent"],
    &["--parents", "-1,-1"],
    &["--quantity", "world", "--parents", "-1,-1"],
    &["--tracks", "0"],
    &["--to", "csv"],
    &["--to", "npz"],
    &["--to", "bvh"],
    &["--scale", "2"],
    &["--up-axis", "y"],
    &["--linear", "foot"],
    &["--raw-times"],
    &["--bridge-gaps"],
    &["--duplicates", "last"],
    &["--source-fps", "10"],
    &["--override-fps", "10"],
    &["--map", "rotations=keys:wxyz"],
    &["--time-unit", "ms"],
    &["--animation", "0"],
    &["--offsets", "offsets.txt"],
    &["--from", "dat"],
];

/// Options that change no byte of a result: which device computes, what may be read and replaced, and what
/// is reported.
const SILENT: &[&[&str]] = &[
    &["--overwrite"],
    &["--pipes"],
    &["--max-size", "1GiB"],
    &["--max-memory", "1GiB"],
    &["--device", "cpu"],
    &["--explain-route"],
    &["--json"],
    &["--files-from", "list.txt"],
];

/// The bytes of each result by its command line; `None` if the command line was refused as a usage
/// error.
struct Results {
    folder: PathBuf,
    known: HashMap<Vec<&'static str>, Option<Vec<u8>>>,
}

impl Results {
    fn of(&mut self, input: &'static str, options: &[&'static [&'static str]]) -> Option<Vec<u8>> {
        let mut line = vec![input];
        line.extend(options.iter().copied().flatten());
        if let Some(known) = self.known.get(&line) {
            return known.clone();
        }
        let name = if line.contains(&"--to") {
            "out"
        } else {
            "out.npy"
        };
        let out = self.folder.join(name);
        let _ = std::fs::remove_file(&out);
        let file = |word: &str| {
            if word.contains('.') && !word.starts_with("--") {
                Some(self.folder.join(word)).filter(|path| path.exists())
            } else {
                None
            }
        };
        let mut words: Vec<OsString> = vec!["tumble".into(), "eval".into()];
        for word in &line {
            words.push(file(word).map_or_else(|| word.into(), PathBuf::into_os_string));
        }
        // At 25 frames a second, samples are between the keys, where curves differ; at the source's
        // own rate they are at the keys.
        if !line.contains(&"--fps") && !line.contains(&"--times") {
            words.extend(["--fps".into(), "25".into()]);
        }
        words.extend(["-o".into(), out.clone().into_os_string()]);
        let code = tumble_cli::host::run(words);
        let result = match code {
            DONE => Some(std::fs::read(&out).expect("a result")),
            USAGE | INPUT => {
                assert!(!out.exists(), "{line:?}: refused, and a result is there");
                None
            }
            code => panic!("{line:?}: exit code {code}"),
        };
        self.known.insert(line, result.clone());
        result
    }
}

/// Two joints that turn and move, and times that BVH rounds.
fn bvh() -> String {
    let mut text = String::from(
        "HIERARCHY\nROOT hip\n{\n OFFSET 0 1 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation \
         Xrotation Yrotation\n JOINT knee\n {\n  OFFSET 0 -0.5 0.1\n  CHANNELS 3 Zrotation Xrotation \
         Yrotation\n  End Site\n  {\n   OFFSET 0 -0.5 0\n  }\n }\n}\nMOTION\nFrames: 19\nFrame Time: \
         0.133333\n",
    );
    for i in 0..19 {
        let t = f64::from(i);
        let _ = writeln!(
            text,
            "{} 1 {} {} {} 5 {} {} {}",
            t * 0.1,
            t * t * 0.01,
            30.0 * (t * 0.9).sin(),
            20.0 * (t * 0.5).cos(),
            -40.0 * (t * 0.7).sin(),
            t * 3.0,
            12.0 * (t * 1.3).cos()
        );
    }
    text
}

/// The same kind of motion, in our own format.
fn dat() -> String {
    let mut text = String::from("# 2 1.5\n");
    for i in 0..10 {
        let t = f64::from(i);
        let _ = write!(text, "{}", 0.2 + t * 0.2 + t * t * 0.01);
        for track in 0..2 {
            // One key has the other sign: its path is another one.
            let sign = if i == 4 { -1.0 } else { 1.0 };
            let half = 0.9 * (t * (1.1 + f64::from(track))).sin();
            let [w, x, z] = [half.cos(), half.sin() * 0.6, half.sin() * 0.8].map(|n| n * sign);
            let _ = write!(text, " {w} {x} 0 {z}");
        }
        text.push('\n');
    }
    text
}

fn prepare(folder: &Path) {
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write("walk.bvh", &bvh());
    write("keys.dat", &dat());
    write("times.txt", "0.11\n0.31\n0.52\n0.97\n1.61\n");
    write("offsets.txt", "0 0 0\n0 -1 0\n");
    write("list.txt", "");
    let run = |line: &[&str]| {
        let words = line.iter().map(|word| {
            if word.contains('.') {
                folder.join(word).into_os_string()
            } else {
                word.into()
            }
        });
        assert_eq!(tumble_cli::host::run(words), DONE, "{line:?}");
    };
    run(&["tumble", "convert", "walk.bvh", "-o", "walk.glb"]);
    run(&["tumble", "convert", "walk.bvh", "-o", "walk.npz"]);
}

/// An input in a folder of its own.
fn results() -> (tempfile::TempDir, Results) {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let results = Results {
        folder: folder.path().to_owned(),
        known: HashMap::new(),
    };
    (folder, results)
}

/// Every pair of options on one input.
fn walk(input: &'static str) {
    let (_folder, mut results) = results();
    let mut ignored = Vec::new();
    let plain = results
        .of(input, &[])
        .expect("a plain command line succeeds");
    for silent in SILENT {
        let with_option = results.of(input, &[silent]);
        assert_eq!(with_option.as_ref(), Some(&plain), "{input} {silent:?}");
    }
    for (i, &first) in OPTIONS.iter().enumerate() {
        let alone = results.of(input, &[first]);
        if alone.as_ref() == Some(&plain) && !is_redundant(input, first, &[]) {
            ignored.push(format!("{input} {first:?}"));
        }
        for &second in &OPTIONS[i + 1..] {
            // The same option twice is another error.
            if first
                .iter()
                .any(|word| word.starts_with("--") && second.contains(word))
            {
                continue;
            }
            let Some(both) = results.of(input, &[first, second]) else {
                continue;
            };
            for (option, other) in [(first, second), (second, first)] {
                let without = results.of(input, &[other]);
                if without.as_ref() == Some(&both) && !is_redundant(input, option, other) {
                    ignored.push(format!("{input} {other:?} {option:?}"));
                }
            }
        }
    }
    assert!(
        results.known.len() > 1000,
        "{input}: {} command lines",
        results.known.len()
    );
    assert!(
        ignored.is_empty(),
        "ignored silently:\n{}",
        ignored.join("\n")
    );
}

#[test]
fn pairs_on_motion_capture() {
    walk("walk.bvh");
}

#[test]
fn pairs_on_keys() {
    walk("keys.dat");
}

#[test]
fn pairs_on_gltf() {
    walk("walk.glb");
}

#[test]
fn pairs_on_arrays() {
    walk("walk.npz");
}

#[test]
fn every_option_is_obeyed_somewhere() {
    let (_folder, mut results) = results();
    for option in OPTIONS {
        let inputs = ["walk.bvh", "keys.dat", "walk.glb", "walk.npz"];
        let is_obeyed = inputs
            .iter()
            .any(|input| results.of(input, &[option]).is_some());
        // These have an effect only together with the option that they refine.
        let wanting = [
            "--sequence",
            "--major",
            "--axes",
            "--parents",
            "--tension",
            "--linear",
            "--offsets",
            "--map",
            "--bridge-gaps",
            "--scale",
            "--source-fps",
        ];
        assert_eq!(is_obeyed, !wanting.contains(&option[0]), "{option:?}");
    }
}

/// Whether an option, together with another, asks for the default: then it is obeyed, and nothing
/// changes.
fn is_redundant(input: &str, option: &[&str], other: &[&str]) -> bool {
    let has = |word: &str| other.contains(&word);
    let are_frames = has("csv") || has("world") || has("transform");
    match option {
        ["--layout", "track"] | ["--order", "xyzw"] | ["--from", _] => true,
        ["--layout", "frame"] => are_frames,
        ["--order", "wxyz"] => has("csv"),
        // BVH has no times, so the end is a frame; 18 intervals at 10 fps also end at a frame.
        ["--end-frame", _] => has("bvh") || has("--override-fps"),
        // These files have quaternions whose signs continue.
        ["--signs", _] => input != "keys.dat",
        // With milliseconds, the clip has a thousandth of its length, so only one frame.
        _ if has("--time-unit") => true,
        // The keys of the other files are joined by slerp already.
        ["--method", "slerp"] => input != "keys.dat",
        // Only keys.dat begins after 0.
        ["--from-zero"] => input != "keys.dat",
        // In glTF, y points up already.
        ["--up-axis", "y"] => input == "walk.glb",
        // Without parents there is no offset that could be scaled.
        ["--scale", _] => has("--parents"),
        // These options are about cases that do not occur in these files: several animations, two
        // keys at one time, no rate, rounded times, missing keys.
        ["--animation", _] | ["--duplicates", _] | ["--source-fps", _] | ["--raw-times"] => true,
        ["--bridge-gaps"] => true,
        _ => false,
    }
}
