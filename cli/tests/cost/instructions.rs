//! The instructions for a rotation and for a key: counted, not timed, so that a loop that is no longer
//! vectorised is found on any machine. The engine is counted as it is shipped:
//! its profile for tests has no checks for overflow either, which would keep loops scalar.

use std::path::Path;
use std::process::{Child, Command, Stdio};

use glam::Quat;
use tumble::{Device, Engine, SampleTimes, TrackSet, VectorWidth, method};

/// Instructions that `tumble` executes to evaluate a file, on one thread; nothing
/// where valgrind is not installed, which in CI it must be.
fn instructions(file: &Path, method: &str, fps: u32, width: &str) -> Option<u64> {
    instructions_with(&[], file, method, fps, width)
}

/// The same with some options.
fn instructions_with(
    options: &[&str],
    file: &Path,
    method: &str,
    fps: u32,
    width: &str,
) -> Option<u64> {
    counted(width, |valgrind| {
        (valgrind.arg(env!("CARGO_BIN_EXE_tumble")).arg("eval"))
            .arg(file)
            .args(["-m", method, "--fps", &fps.to_string(), "--device", "cpu"])
            .args(["-o", "-"])
            .args(options)
    })
}

/// Instructions of a program with these vectors; `run` adds it and its arguments.
fn counted(width: &str, run: impl FnOnce(&mut Command) -> &mut Command) -> Option<u64> {
    let mut valgrind = Command::new("valgrind");
    valgrind.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]);
    let run = run(&mut valgrind)
        .env("RAYON_NUM_THREADS", "1")
        .env("TUMBLE_VECTOR_WIDTH", width)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .and_then(Child::wait_with_output);
    let output = match run {
        Ok(output) => output,
        Err(error) => {
            assert!(std::env::var_os("CI").is_none(), "valgrind: {error}");
            eprintln!("valgrind: {error}: this test counted nothing");
            return None;
        }
    };
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{words}");
    let count = words
        .lines()
        .find_map(|line| line.split("Collected : ").nth(1));
    Some(count.expect(&words).trim().parse().expect("a number"))
}

const TRACKS: u64 = 32;

fn generate(folder: &Path, keys: u32, motion: &[&str]) -> std::path::PathBuf {
    let file = folder.join(format!("{keys}.dat"));
    let run = Command::new(env!("CARGO_BIN_EXE_tumble"))
        .args(["generate", "--boxes", &TRACKS.to_string()])
        .args(motion)
        .args(["--keys", &keys.to_string(), "--seconds", "20", "-o"])
        .arg(&file)
        .output()
        .unwrap();
    assert!(run.status.success());
    // Reading text would take most of the instructions.
    let read = file.with_extension("npz");
    let run = Command::new(env!("CARGO_BIN_EXE_tumble"))
        .arg("convert")
        .arg(&file)
        .arg("-o")
        .arg(&read)
        .output()
        .unwrap();
    assert!(run.status.success(), "{run:?}");
    read
}

/// Bounds are a quarter above the numbers that were counted when they were set. Incremental compilation was
/// off, as in `scripts/test.sh`, because it inlines fewer functions.
#[test]
fn rotations_and_keys_cost_no_more_than_they_did() {
    let folder = tempfile::tempdir().unwrap();
    let random = |keys| generate(folder.path(), keys, &["--random"]);
    let (sparse, many) = (random(26), random(260));
    let has_avx2 = VectorWidth::available().contains(&VectorWidth::Avx2);
    let bounds = [
        ("baseline", [22.0, 49.0, 49.0], [2650.0, 18_000.0]),
        ("avx2", [9.5, 20.0, 20.0], [1300.0, 8700.0]),
    ];
    let methods = ["slerp", "bessel-overhauser", "kochanek-bartels"];
    for (width, a_rotation, a_key) in bounds {
        if width == "avx2" && !has_avx2 {
            eprintln!("no AVX2 here: not counted");
            continue;
        }
        let mut per_keys = Vec::new();
        for (method, bound) in methods.into_iter().zip(a_rotation) {
            let count = |file, fps| instructions(file, method, fps, width);
            let (Some(coarse), Some(fine), Some(dense)) =
                (count(&sparse, 60), count(&sparse, 240), count(&many, 60))
            else {
                return;
            };
            let rotations = TRACKS * 20 * (240 - 60);
            let each = (fine - coarse) as f64 / rotations as f64;
            println!("{width}, {method}: {each:.1} instructions a rotation");
            assert!(each < bound, "{width}, {method}: {each:.1} a rotation");
            per_keys.push((dense - coarse) as f64);
        }
        // The instructions that all methods spend on a key, such as reading it, are not counted.
        let keys = (TRACKS * (260 - 26)) as f64;
        for ((method, cost), bound) in methods.into_iter().zip(&per_keys).skip(1).zip(a_key) {
            let each = (cost - per_keys[0]) / keys;
            println!("{width}, {method}: {each:.0} instructions a key more than an arc");
            assert!(each < bound, "{width}, {method}: {each:.0} a key");
        }
    }
}

/// Catches curves of small angles, which nearly all of motion are, that are evaluated with the whole degree.
#[test]
fn rotations_of_small_angles_cost_less() {
    let folder = tempfile::tempdir().unwrap();
    let motion = generate(folder.path(), 600, &[]);
    let has_avx2 = VectorWidth::available().contains(&VectorWidth::Avx2);
    for (width, bound) in [("baseline", 39.0), ("avx2", 16.8)] {
        if width == "avx2" && !has_avx2 {
            eprintln!("no AVX2 here: not counted");
            continue;
        }
        let count = |fps| instructions(&motion, "bessel-overhauser", fps, width);
        let (Some(coarse), Some(fine)) = (count(300), count(600)) else {
            return;
        };
        let each = (fine - coarse) as f64 / (TRACKS * 20 * 300) as f64;
        println!("{width}: {each:.1} instructions a rotation of small angles");
        assert!(
            each < bound,
            "{width}: {each:.1} a rotation of small angles"
        );
    }
}

/// Where keys are denser than samples and near each other, nothing is prepared: to prepare
/// and fit a cubic would take thousands of instructions for each sample.
#[test]
fn samples_straight_from_keys_cost_no_more_than_they_did() {
    let folder = tempfile::tempdir().unwrap();
    let dense = generate(folder.path(), 2400, &[]);
    let has_avx2 = VectorWidth::available().contains(&VectorWidth::Avx2);
    for (width, bounds) in [("baseline", [131.0, 1000.0]), ("avx2", [81.0, 500.0])] {
        if width == "avx2" && !has_avx2 {
            eprintln!("no AVX2 here: not counted");
            continue;
        }
        for (method, bound) in ["slerp", "bessel-overhauser"].into_iter().zip(bounds) {
            let count = |fps| instructions(&dense, method, fps, width);
            let (Some(coarse), Some(fine)) = (count(24), count(96)) else {
                return;
            };
            let samples = TRACKS * 20 * (96 - 24);
            let each = (fine - coarse) as f64 / samples as f64;
            println!("{width}, {method}: {each:.1} instructions a sample of dense keys");
            assert!(each < bound, "{width}, {method}: {each:.1} a sample");
        }
    }
}

/// Keys at 30 Hz at 60 frames a second, as most motion is played: every other frame is a key, and a segment has one
/// frame between its keys. Catches frames whose segments are looked for in each track anew.
#[test]
fn frames_between_neighbouring_keys_cost_no_more_than_they_did() {
    let folder = tempfile::tempdir().unwrap();
    let motion = generate(folder.path(), 600, &[]);
    let has_avx2 = VectorWidth::available().contains(&VectorWidth::Avx2);
    for (width, bounds) in [("baseline", [45.0, 56.0]), ("avx2", [31.0, 27.0])] {
        if width == "avx2" && !has_avx2 {
            eprintln!("no AVX2 here: not counted");
            continue;
        }
        for (method, bound) in ["slerp", "bessel-overhauser"].into_iter().zip(bounds) {
            let count = |fps| instructions(&motion, method, fps, width);
            let (Some(keys), Some(between)) = (count(30), count(60)) else {
                return;
            };
            let each = (between - keys) as f64 / (TRACKS * 20 * 30) as f64;
            println!("{width}, {method}: {each:.1} instructions a frame between keys");
            assert!(
                each < bound,
                "{width}, {method}: {each:.1} a frame between keys"
            );
        }
    }
}

/// Clips that are kept: rotations of small angles, which come from packed segments, by long runs and by poses of a
/// sampler.
#[test]
fn rotations_of_kept_clips_cost_no_more_than_they_did() {
    if !VectorWidth::available().contains(&VectorWidth::Avx2) {
        eprintln!("no AVX2 here: not counted");
        return;
    }
    for (case, bound) in [(RUNS, 36.0), (POSES, 129.0)] {
        let count = |rounds: u32| {
            counted("avx2", |valgrind| {
                (valgrind.arg(std::env::current_exe().unwrap()))
                    .args(["--exact", "instructions::evaluates_a_kept_clip"])
                    .args(["--ignored", "--test-threads=1"])
                    .env("TUMBLE_TEST_KEPT", format!("{rounds} {case}"))
            })
        };
        let (Some(one), Some(three)) = (count(1), count(3)) else {
            return;
        };
        let each = (three - one) as f64 / 2.0 / KEPT_ROTATIONS as f64;
        println!("{case}: {each:.1} instructions a rotation of a kept clip");
        assert!(each < bound, "{case}: {each:.1} a rotation");
    }
}

const RUNS: &str = "runs";
const POSES: &str = "poses";

const KEPT_ROTATIONS: usize = 16 * 600;

/// The test above runs this in a separate process.
#[test]
#[ignore = "part of rotations_of_kept_clips_cost_no_more_than_they_did"]
fn evaluates_a_kept_clip() {
    let Ok(request) = std::env::var("TUMBLE_TEST_KEPT") else {
        return;
    };
    let (rounds, case) = request.split_once(' ').unwrap();
    let (tracks, seconds) = (16, if case == RUNS { 3 } else { 10 });
    let times: Vec<f64> = (0..=seconds * 30)
        .map(|key| f64::from(key) / 30.0)
        .collect();
    let mut set = TrackSet::new();
    for track in 0..tracks {
        let key = |key: usize| {
            let at = (track + key) as f32 * 0.05;
            Quat::from_rotation_y(at.sin()) * Quat::from_rotation_x((at * 0.7).cos())
        };
        let keys: Vec<Quat> = (0..times.len()).map(key).collect();
        set.push("", &times, &keys).unwrap();
    }
    let engine = Engine::new(Device::Cpu).unwrap();
    let clip = engine.upload(&set, method::BESSEL_OVERHAUSER).unwrap();
    assert!(clip.bytes_per_key() < 145.0);
    let mut sampler = clip.sampler().unwrap();
    let frames = KEPT_ROTATIONS / tracks;
    let frame_times = SampleTimes::fps(240);
    let mut output = vec![Quat::IDENTITY; KEPT_ROTATIONS];
    for _ in 0..rounds.parse().unwrap() {
        if case == POSES {
            for (frame, pose) in output.chunks_mut(tracks).enumerate() {
                sampler.pose(frame as f64 / 60.0, pose).unwrap();
            }
        } else {
            let request = clip.request(&frame_times).samples(0..frames);
            request
                .evaluate_into(bytemuck::cast_slice_mut::<_, u8>(&mut output))
                .unwrap();
        }
    }
}

/// Catches velocities of few samples for which more is prepared than these samples take: whole tracks, or
/// curves one by one instead of beside each other.
#[test]
fn velocities_of_few_samples_cost_no_more_than_they_did() {
    if !VectorWidth::available().contains(&VectorWidth::Avx2) {
        eprintln!("no AVX2 here: not counted");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let dense = generate(folder.path(), 600, &[]);
    for (method, bound) in [("slerp", 4_750.0), ("bessel-overhauser", 19_600.0)] {
        let count = |fps| {
            let options = ["--quantity", "velocity", "--format", "npy"];
            instructions_with(&options, &dense, method, fps, "avx2")
        };
        let (Some(coarse), Some(fine)) = (count(1), count(3)) else {
            return;
        };
        let samples = TRACKS * 20 * (3 - 1);
        let each = (fine - coarse) as f64 / samples as f64;
        println!("{method}: {each:.0} instructions a velocity of few");
        assert!(each < bound, "{method}: {each:.0} a velocity of few");
    }
}
