//! `--end-frame` through the program: the last sample of a result whose clip ends between two frames.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::program::{root, run, sample_folder, succeed};

/// Three keys on frames of 24 fps; the last one, at 1.125 s, is at frame 33.75 of 30 fps.
const LOOP: &str = "0 0 0 0 0 0 0 1\n0.5 1 0 0 0 0 0.6 0.8\n1.125 0 0 0 0 0 0 1\n";

fn line(folder: &Path, line: &str) -> String {
    succeed(folder, &line.split(' ').collect::<Vec<_>>()).words
}

/// The frames, and the first and the last time of a result.
fn evaluated(folder: &Path, options: &str) -> (u64, f64, f64) {
    let arguments = format!("eval {options} --json --overwrite");
    let run = succeed(folder, &arguments.split(' ').collect::<Vec<_>>());
    let report: Value = serde_json::from_slice(&run.out).unwrap();
    let report = &report[0];
    let number = |name: &str| report[name].as_f64().unwrap();
    (
        report["frames"].as_u64().unwrap(),
        number("first_time"),
        number("last_time"),
    )
}

#[test]
fn clips_end_with_a_key_or_a_held_frame_and_arrays_with_a_frame() {
    let folder = sample_folder();
    let at = folder.path();
    fs::write(at.join("loop.tum"), LOOP).unwrap();
    let (length, before, after) = (1.125, 33.0 / 30.0, 34.0 / 30.0);
    for (output, frames, last) in [
        ("out.glb", 35, length),
        ("out.npz", 35, length),
        ("out.csv", 35, length),
        ("out.parquet", 35, length),
        ("out.dat", 35, length),
        ("out.tum", 35, length),
        ("out.bvh", 35, after),
        ("out.kitti", 35, after),
        ("out.kitti --times-out out.txt", 35, length),
        ("out.npy", 34, before),
        ("out.csv --quantity velocity", 34, before),
        ("out.npy --quantity world", 34, before),
        ("out.npy --end-frame hold", 35, after),
        ("out.npy --end-frame hold --layout frame", 35, after),
        ("out.npy --end-frame hold --quantity velocity", 35, after),
        ("out.csv --end-frame key --quantity world", 35, length),
        ("out.npz --end-frame hold", 35, after),
        ("out.bvh --end-frame leave-out", 34, before),
        ("out.csv --end-frame leave-out", 34, before),
        ("out.csv --end 1", 31, 1.0),
        ("out.csv --end 1.05", 33, 1.05),
        ("out.csv --max-gap 0.55", 17, length),
        ("out.csv --max-gap 0.55 --in-gaps hold", 35, length),
    ] {
        let found = evaluated(at, &format!("loop.tum --fps 30 -o {output}"));
        assert_eq!((found.0, found.1), (frames, 0.0), "{output}");
        assert!((found.2 - last).abs() < 1e-12, "{output}: {}", found.2);
    }
    let csv = fs::read_to_string(at.join("out.csv")).unwrap();
    assert!(csv.contains("\n34,1.125000000,"), "{csv}");
}

/// Rotations that are streamed have the bits of those without an end, and the end behind them.
#[test]
fn frames_keep_their_bits_beside_an_end() {
    let folder = sample_folder();
    let at = folder.path();
    let values = |options: &str| {
        line(
            at,
            &format!("eval data/pendulum.dat --fps 24.33 -o out.npy --overwrite {options}"),
        );
        let bytes = fs::read(at.join("out.npy")).unwrap();
        bytes[bytes.len() % 16..]
            .chunks_exact(16)
            .skip(8)
            .map(<[u8]>::to_vec)
            .collect::<Vec<_>>()
    };
    fs::create_dir_all(at.join("data")).unwrap();
    fs::copy(
        root().join("data/pendulum.dat"),
        at.join("data/pendulum.dat"),
    )
    .unwrap();
    for (layout, by_track) in [("track", true), ("frame", false)] {
        let cut = values(&format!("--layout {layout}"));
        let held = values(&format!("--layout {layout} --end-frame hold"));
        let (tracks, frames) = (4, cut.len() / 4);
        assert_eq!(held.len(), tracks * (frames + 1));
        for track in 0..tracks {
            for frame in 0..frames {
                let index = |frames: usize| match by_track {
                    true => track * frames + frame,
                    false => frame * tracks + track,
                };
                assert_eq!(
                    cut[index(frames)],
                    held[index(frames + 1)],
                    "{layout} {track} {frame}"
                );
            }
        }
    }
}

#[test]
fn an_end_that_is_moved_or_left_out_is_told() {
    let folder = sample_folder();
    let at = folder.path();
    fs::write(at.join("loop.tum"), LOOP).unwrap();
    let eval = |options: &str| {
        line(
            at,
            &format!("eval loop.tum --fps 30 --overwrite -o {options}"),
        )
    };
    let words = eval("out.bvh");
    let expected = "out.bvh: warning[W210]: the clip ends at 1.125 s, between two frames at 30 fps; a last frame, \
                    at 1.133333 s, repeats the end";
    assert!(words.contains(expected), "{words}");
    let words = eval("out.npy");
    let expected =
        "1 track × 34 frames (0.025 s of the clip, after the last frame, are left out), ";
    assert!(words.contains(expected), "{words}");
    for asked in [
        "out.bvh --end-frame hold",
        "out.npy --end-frame leave-out",
        "out.glb",
    ] {
        let words = eval(asked);
        assert!(
            !words.contains("W210") && !words.contains("after the last"),
            "{words}"
        );
    }
}

#[test]
fn an_end_that_a_format_cannot_store_is_refused() {
    let folder = sample_folder();
    let at = folder.path();
    fs::write(at.join("loop.tum"), LOOP).unwrap();
    line(at, "convert loop.tum -o loop.glb");
    for (arguments, words) in [
        (
            "loop.tum -o out.bvh --end-frame key",
            "bvh stores frames of a rate and no times",
        ),
        (
            "loop.tum -o out.npy --end-frame key",
            "npy stores frames of a rate and no times",
        ),
        (
            "loop.tum -o out.kitti --end-frame key",
            "kitti stores the times of frames only in a separate file, and none is written; give --times-out",
        ),
    ] {
        let arguments = format!("eval --fps 30 {arguments}");
        let run = run(at, &arguments.split(' ').collect::<Vec<_>>());
        assert!(
            run.code != 0 && run.words.contains(words),
            "{arguments}: {}",
            run.words
        );
    }
}

/// An archive with a rate holds the end for a frame. An archive with times has the end at its time, and still
/// states the rate of its frames.
#[test]
fn archives_keep_their_ends() {
    let folder = sample_folder();
    let at = folder.path();
    fs::write(at.join("loop.tum"), LOOP).unwrap();
    line(at, "eval loop.tum --fps 30 -o loop.npz");
    let again = evaluated(at, "loop.npz --fps 20 -o again.npz");
    assert_eq!(again, (24, 0.0, 1.125));
    let words = line(at, "info again.npz");
    assert!(words.is_empty(), "no warning of two rates: {words}");
    let back = evaluated(at, "again.npz --fps 30 -o back.glb");
    assert_eq!(back, (35, 0.0, 1.125));
}

/// A rewritten file ends like a new one, and as `--end-frame` says.
#[test]
fn files_that_are_kept_end_as_they_are_asked_to() {
    let folder = sample_folder();
    let at = folder.path();
    fs::write(at.join("loop.tum"), LOOP).unwrap();
    line(at, "convert loop.tum -o loop.glb");
    for (end_frame, frames, last) in [
        ("", 35, 1.125),
        (" --end-frame key", 35, 1.125),
        (" --end-frame hold", 35, 34.0 / 30.0),
        (" --end-frame leave-out", 34, 33.0 / 30.0),
    ] {
        let found = evaluated(at, &format!("loop.glb --fps 30 -o out.glb{end_frame}"));
        assert_eq!((found.0, found.1), (frames, 0.0), "{end_frame}");
        assert!((found.2 - last).abs() < 1e-12, "{end_frame}: {}", found.2);
    }
    // An end on a frame is the last frame.
    assert_eq!(
        evaluated(at, "loop.glb --fps 24 -o out.glb"),
        (28, 0.0, 1.125)
    );
}

/// A reduction of the frames of a rate lasts as long as its clip.
#[test]
fn reductions_of_frames_keep_the_end() {
    let folder = sample_folder();
    let at = folder.path();
    fs::write(at.join("loop.tum"), LOOP).unwrap();
    line(at, "reduce loop.tum --fps 30 -o few.glb");
    assert_eq!(
        evaluated(at, "few.glb --fps 24 -o out.csv"),
        (28, 0.0, 1.125)
    );
}

/// A rate for files that state none leaves the others alone, and one that replaces a rate is reported.
#[test]
fn rates_of_options_contradict_no_file_silently() {
    let folder = sample_folder();
    let at = folder.path();
    let bvh = "HIERARCHY\nROOT hip\n{\n OFFSET 0 0 0\n CHANNELS 3 Zrotation Xrotation Yrotation\n}\nMOTION\nFrames: 3\n\
               Frame Time: 0.0166\n0 0 0\n1 0 0\n2 0 0\n";
    fs::write(at.join("hip.bvh"), bvh).unwrap();
    line(at, "convert hip.bvh -o as-stated.csv");
    assert!(
        fs::read_to_string(at.join("as-stated.csv"))
            .unwrap()
            .contains("\n2,0.03333333333333333,")
    );
    let words = line(at, "convert hip.bvh --override-fps 10 -o overridden.csv");
    let expected = "the file states 60 frames a second; because of --override-fps it is read at 10";
    assert!(words.contains(expected), "{words}");
    assert!(
        fs::read_to_string(at.join("overridden.csv"))
            .unwrap()
            .contains("\n2,0.2,")
    );
    for (option, words) in [
        ("--source-fps 10", "--source-fps has no effect on bvh"),
        ("--source-fps 10 --override-fps 10", "cannot be used with"),
    ] {
        let arguments = format!("convert hip.bvh {option} -o out.csv");
        let run = run(at, &arguments.split(' ').collect::<Vec<_>>());
        assert!(
            run.code != 0 && run.words.contains(words),
            "{option}: {}",
            run.words
        );
    }
}

/// Without `--fps` a result has the frames of its input, whose keys they are; where keys have no rate of frames, a line
/// says which was assumed.
#[test]
fn frames_are_those_of_the_source() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: String| fs::write(folder.path().join(name), text).unwrap();
    let keys = |count: u32, per_second: f64| {
        let each = (0..count).map(|key| {
            let (sine, cosine) = (f64::from(key) * 0.1).sin_cos();
            format!(
                "{} {key} 0 0 0 0 {sine} {cosine}\n",
                f64::from(key) / per_second
            )
        });
        each.collect::<String>()
    };
    write("fast.tum", keys(61, 120.0));
    write("slow.tum", keys(5, 2.0));
    let frames = |line: &str| {
        let run = succeed(folder.path(), &line.split(' ').collect::<Vec<_>>());
        let out = fs::read_to_string(folder.path().join("out.csv")).unwrap();
        (out.lines().count() - 1, run.words)
    };
    let (count, words) = frames("eval fast.tum --quantity quaternion -o out.csv --overwrite");
    assert_eq!(count, 61, "{words}");
    assert!(!words.contains("fps"), "{words}");
    let (count, words) = frames("eval slow.tum --quantity quaternion -o out.csv --overwrite");
    assert_eq!(count, 51, "{words}");
    assert!(
        words.contains("51 frames (25 fps, because its keys have no rate), "),
        "{words}"
    );
    let (again, words) = frames("eval slow.tum --quantity quaternion -f 25 -o out.csv --overwrite");
    assert_eq!((again, words.contains("fps")), (51, false), "{words}");
    // Device and reference are also compared between the keys.
    let run = succeed(
        folder.path(),
        &"verify fast.tum --device cpu -m slerp --json"
            .split(' ')
            .collect::<Vec<_>>(),
    );
    let lines: serde_json::Value = serde_json::from_slice(&run.out).unwrap();
    assert_eq!(lines[0]["rotations"], 121);
}
