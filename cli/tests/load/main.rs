//! Sizes that ordinary tests do not reach. On demand, one at a time:
//!
//! ```text
//! cargo test --release --test load -- --ignored --nocapture --test-threads 1
//! ```
//!
//! Each prints its figures; docs/testing.md has those of one machine.
#![allow(clippy::disallowed_methods)] // as in tests/all.rs
#![cfg(target_os = "linux")]

#[path = "../support/program.rs"]
mod program;
mod soak;
#[path = "../../../tests/support/mod.rs"]
mod support;

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use glam::Quat;
use program::finish;
use support::vulkan_devices;
use tumble::{
    Chunk, Device, Engine, EngineOptions, Error, Interpolation, Layout, Method, SampleTimes,
    TrackSet, method,
};

/// A hash of rotations that depends on every bit and on their order, and costs less than
/// evaluating them.
#[derive(Default, Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Hash(u64);

impl Hash {
    pub(crate) fn add(&mut self, rotations: &[Quat]) {
        let words: &[u64] = bytemuck::cast_slice(rotations);
        for word in words {
            self.0 = (self.0.rotate_left(5) ^ word).wrapping_mul(0x517c_c1b7_2722_0a95);
        }
    }
}

/// Tracks that turn to and fro, all different, `rate` keys a second.
pub(crate) fn swinging(tracks: usize, keys: usize, rate: f64) -> TrackSet {
    let times: Vec<f64> = (0..keys).map(|i| i as f64 / rate).collect();
    let mut rotations = vec![Quat::IDENTITY; keys];
    let mut set = TrackSet::new();
    for track in 0..tracks {
        let phase = track as f64 * 0.618;
        for (key, time) in rotations.iter_mut().zip(&times) {
            let [a, b] = [phase + time * 1.7, phase * 1.3 + time * 0.9].map(f64::sin);
            *key = Quat::from_scaled_axis(glam::Vec3::new(a as f32, b as f32, (a * b) as f32));
        }
        set.push("", &times, &rotations).unwrap();
    }
    set
}

/// The CPU, and the first Vulkan device.
pub(crate) fn engines(options: &EngineOptions) -> Vec<Engine> {
    let devices = [Device::Cpu]
        .into_iter()
        .chain(vulkan_devices().into_iter().take(1));
    devices
        .map(|device| Engine::with_options(device, options).unwrap())
        .collect()
}

/// The most memory that this process, or one of its children, has had, MB.
fn peak_memory(of: &str) -> f64 {
    let status = fs::read_to_string(of).unwrap();
    let line = status
        .lines()
        .find(|line| line.starts_with("VmHWM:"))
        .unwrap();
    line.split_whitespace()
        .nth(1)
        .unwrap()
        .parse::<f64>()
        .unwrap()
        * 1024.0
        / 1e6
}

fn forget_peak() {
    fs::write("/proc/self/clear_refs", "5").unwrap();
}

/// Streams a set through every engine; all give the same hash.
fn stream_all(
    label: &str,
    set: &TrackSet,
    method: Method,
    frames: &SampleTimes,
    options: &EngineOptions,
) {
    let mut hashes = Vec::new();
    for engine in engines(options) {
        forget_peak();
        let (mut hash, mut count) = (Hash::default(), 0usize);
        let started = Instant::now();
        engine
            .request(set, method, frames)
            .layout(Layout::TrackMajor)
            .stream(1 << 20, |chunk: Chunk<'_>| {
                hash.add(chunk.rotations().unwrap());
                count += chunk.rotations().unwrap().len();
                Ok::<(), Error>(())
            })
            .unwrap();
        println!(
            "{label}, {method}, {}: {:.1} M rotations in {:.2} s, peak {:.0} MB",
            engine.device_name(),
            count as f64 / 1e6,
            started.elapsed().as_secs_f64(),
            peak_memory("/proc/self/status"),
        );
        hashes.push(hash);
    }
    assert!(
        hashes.windows(2).all(|pair| pair[0] == pair[1]),
        "{label}: {hashes:x?}"
    );
}

/// As [`stream_all`], an arc and a cubic.
fn stream_both(label: &str, set: &TrackSet, fps: u32) {
    for method in [method::SLERP, method::BESSEL_OVERHAUSER] {
        let frames = SampleTimes::fps(fps);
        stream_all(label, set, method, &frames, &EngineOptions::default());
    }
}

#[test]
#[ignore = "10 GB of memory"]
fn seven_gigabytes_of_keys() {
    let set = swinging(46_250, 10_000, 100.0);
    assert!(set.key_count() * size_of::<Quat>() >= 7_400_000_000);
    stream_both("7.4 GB of keys", &set, 10);
}

#[test]
#[ignore = "some minutes"]
fn sixteen_gigabytes_of_output() {
    let set = swinging(4096, 26, 1.0);
    let frames = SampleTimes::fps(9765); // 244 126 samples of each
    forget_peak();
    stream_all(
        "16 GB of output",
        &set,
        method::SLERP,
        &frames,
        &EngineOptions::default(),
    );
    stream_all(
        "16 GB of output",
        &set,
        method::C2,
        &frames,
        &EngineOptions::default(),
    );
    assert!(peak_memory("/proc/self/status") < 4.3e3);
}

/// A result of more than 2^32 rotations, compared with single samples of it.
#[test]
#[ignore = "69 GB of rotations, some minutes"]
fn indices_beyond_32_bits() {
    let set = swinging(3, 20, 1.0);
    let engine = Engine::new(Device::Cpu).unwrap();
    let interpolation = Interpolation::from(method::SLERP);
    let rate = 76_000_000u32;
    let frames = SampleTimes::fps(rate); // 1 444 000 001 samples of each of three tracks
    let mut next = 0usize;
    let started = Instant::now();
    engine
        .request(&set, interpolation, &frames)
        .layout(Layout::TrackMajor)
        .stream(1 << 20, |chunk: Chunk<'_>| {
            assert_eq!(chunk.start, next);
            next += chunk.rotations().unwrap().len();
            if chunk.start % (1 << 26) < 1 << 20 || chunk.start > 1 << 32 {
                // A request for this sample alone gives the same bits.
                let (track, sample) = (chunk.tracks.start, chunk.samples.start);
                let time = sample as f64 / f64::from(rate);
                let selected = set.select(track..track + 1)?;
                let alone = SampleTimes::rate(tumble::FrameRate::new(u64::from(rate), 1).unwrap());
                let alone =
                    engine.evaluate(&selected, interpolation, &alone.between(time, time))?;
                let angle = alone.as_quats()[0].angle_between(chunk.rotations().unwrap()[0]);
                assert!(angle < 1e-3, "track {track}, sample {sample}: {angle}");
            }
            Ok::<(), Error>(())
        })
        .unwrap();
    assert!(next > 1 << 32, "{next}");
    println!(
        "{next} rotations in one result: {:.1} s",
        started.elapsed().as_secs_f64()
    );

    // Frame by frame, near the end of the result; a device divides it into other windows.
    let wide = swinging(2048, 3, 1.0);
    let mut hashes = Vec::new();
    for engine in engines(&EngineOptions::default()) {
        let clip = engine.upload(&wide, method::SLERP).unwrap();
        let frames = SampleTimes::fps(1_100_000); // 2 200 001 × 2048 = 4.5e9
        let (mut last, mut total) = (Hash::default(), 0usize);
        let started = Instant::now();
        let stopped =
            clip.request(&frames)
                .layout(Layout::FrameMajor)
                .stream(1 << 20, |chunk: Chunk<'_>| {
                    total = chunk.start + chunk.rotations().unwrap().len();
                    if total > 1 << 32 {
                        last.add(chunk.rotations().unwrap());
                    }
                    Ok::<(), Error>(())
                });
        stopped.unwrap();
        println!(
            "{total} rotations by frames, {}: {:.1} s, the last {} hash to {last:x?}",
            engine.device_name(),
            started.elapsed().as_secs_f64(),
            total - (1 << 32),
        );
        hashes.push(last);
    }
    assert!(
        hashes.windows(2).all(|pair| pair[0] == pair[1]),
        "{hashes:x?}"
    );
}

#[test]
#[ignore = "some seconds"]
fn one_track_of_ten_million_keys() {
    let set = swinging(1, 10_000_000, 120.0);
    stream_both("1 × 10 M keys", &set, 240);
}

#[test]
#[ignore = "some seconds"]
fn a_million_tracks_of_two_keys() {
    let set = swinging(1_000_000, 2, 1.0);
    stream_both("1 M tracks × 2 keys", &set, 30);
}

#[test]
#[ignore = "some seconds"]
fn limits_of_256_mib_give_the_same_bits() {
    let set = swinging(20_000, 300, 30.0);
    let mut options = EngineOptions::default();
    stream_all(
        "6 M keys",
        &set,
        method::BESSEL_OVERHAUSER,
        &SampleTimes::fps(60),
        &options,
    );
    options.memory = Some(256 << 20);
    stream_all(
        "the same in 256 MiB",
        &set,
        method::BESSEL_OVERHAUSER,
        &SampleTimes::fps(60),
        &options,
    );

    // The program within a limit of address space: reading, then writing.
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.dat"), dat(4, 2000, 1)).unwrap();
    let eval = |limit: &str, out: &str| {
        let program = env!("CARGO_BIN_EXE_tumble");
        let line =
            format!("{limit} '{program}' eval a.dat --device cpu --fps 500000 -o {out} 2>&1");
        let mut shell = Command::new("sh");
        let run = finish(
            shell
                .current_dir(folder.path())
                .args(["-c", &line])
                .output()
                .unwrap(),
        );
        assert_eq!(
            run.code,
            0,
            "{}{}",
            String::from_utf8_lossy(&run.out),
            run.words
        );
    };
    eval("", "free.npy");
    // One arena, because an allocator's arenas take address space that is not used.
    eval("ulimit -v 262144; MALLOC_ARENA_MAX=1", "limited.npy");
    let same = Command::new("cmp")
        .current_dir(folder.path())
        .args(["free.npy", "limited.npy"])
        .status();
    assert!(same.unwrap().success());
    let bytes = fs::metadata(folder.path().join("free.npy")).unwrap().len();
    println!(
        "{} MB of output in 256 MiB of address space",
        bytes / 1_000_000
    );
}

/// A file of some boxes, each with keys 1/30 s apart.
fn dat(boxes: usize, keys: usize, seed: usize) -> String {
    let set = swinging(boxes, keys.min(64), 30.0);
    let mut text = format!("# {boxes} 1\n");
    for key in 0..keys {
        let _ = write!(text, "{:.4}", key as f64 / 30.0);
        for track in set.tracks() {
            let q = track.keys[(key + seed) % track.keys.len()];
            let _ = write!(text, " {:.6} {:.6} {:.6} {:.6}", q.w, q.x, q.y, q.z);
        }
        text.push('\n');
    }
    text
}

/// Evaluates a folder with the program; seconds and peak memory.
fn batch(folder: &Path, out: &str, more: &[&str]) {
    let line = [&["eval", "in", "-o", out, "--fps", "60"], more].concat();
    let started = Instant::now();
    let log = fs::File::create(folder.join("log")).unwrap();
    let mut child = program::command(folder, &line).stderr(log).spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0.0f64;
    while child.try_wait().unwrap().is_none() {
        if fs::read_to_string(&status).is_ok_and(|text| text.contains("VmHWM:")) {
            peak = peak.max(peak_memory(&status));
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    assert!(child.wait().unwrap().success());
    println!(
        "{out}, {more:?}: {:.1} s, peak {peak:.0} MB",
        started.elapsed().as_secs_f64()
    );
}

fn same_trees(folder: &Path, a: &str, b: &str) {
    let diff = Command::new("diff")
        .current_dir(folder)
        .args(["-rq", "--exclude=manifest.jsonl", a, b])
        .status();
    assert!(diff.unwrap().success(), "{a} and {b} differ");
}

#[test]
#[ignore = "some minutes, 5 GB of disk"]
fn a_motion_capture_library() {
    let temporary = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let folder = temporary.path();
    fs::create_dir(folder.join("in")).unwrap();
    let (mut tracks, mut keys) = (0, 0);
    for clip in 0..2500 {
        // A clip has 44 or 45 boxes, and each box 86 to 586 keys.
        let boxes = 44 + usize::from(clip % 5 < 3);
        let keys_per_track = 86 + (clip * 37) % 501;
        tracks += boxes;
        keys += boxes * keys_per_track;
        fs::write(
            folder.join(format!("in/{clip:04}.dat")),
            dat(boxes, keys_per_track, clip),
        )
        .unwrap();
    }
    println!(
        "2500 clips, {tracks} tracks, {:.1} M keys",
        keys as f64 / 1e6
    );
    batch(folder, "cpu", &["--device", "cpu"]);
    batch(folder, "first", &[]);
    same_trees(folder, "cpu", "first");
    let check = Instant::now();
    program::succeed(folder, &["check", "cpu"]);
    println!("checked in {:.1} s", check.elapsed().as_secs_f64());
    batch(folder, "cpu", &["--device", "cpu", "--resume"]);
}

#[test]
#[ignore = "some minutes"]
fn a_hundred_thousand_small_files() {
    let temporary = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let folder = temporary.path();
    for i in 0..100_000 {
        let group = folder.join(format!("in/{:03}", i / 1000));
        if i % 1000 == 0 {
            fs::create_dir_all(&group).unwrap();
        }
        fs::write(group.join(format!("{i:06}.dat")), dat(2, 3, i)).unwrap();
    }
    batch(folder, "cpu", &["--device", "cpu"]);
    batch(folder, "cpu", &["--device", "cpu", "--resume"]);
    let check = Instant::now();
    program::succeed(folder, &["check", "cpu"]);
    println!("checked in {:.1} s", check.elapsed().as_secs_f64());
}
