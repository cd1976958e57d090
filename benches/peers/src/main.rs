//! Tumble beside the libraries that people use today, in one run, in turns: 4096
//! tracks of 26 uneven keys, 1200 frames, all threads, into memory that is used again.
//!
//! ```text
//! cd benches/peers && RUSTFLAGS="-C target-cpu=native" cargo run --release
//! ```
//!
//! `native`, because the peers choose their vectors when they are compiled; Tumble
//! chooses at run time and gains nothing by it.

mod bevy;
mod wide;

use std::time::{Duration, Instant};

use glam::{DQuat, DVec3, Quat};
use rayon::prelude::*;
use tumble::{Device, Engine, Frames, Layout, OutputBuffer, TrackSet, method};

const TRACKS: usize = 4096;
const KEYS: usize = 26;
const FRAMES: usize = 1200;
const RATE: f64 = 60.0;
const ROUNDS: usize = 9;

/// Something that fills the output, [track][frame].
type Contestant<'a> = (&'static str, Box<dyn FnMut(&mut [Quat]) + 'a>);

fn main() {
    let set = tracks();
    let engine = Engine::new(Device::Cpu).expect("a CPU");
    let frames = Frames::fps(RATE as u32).between(0.0, (FRAMES - 1) as f64 / RATE);
    let times: Vec<f32> = (0..FRAMES).map(|k| (k as f64 / RATE) as f32).collect();
    let tumble = |method| {
        let (engine, set, frames) = (&engine, &set, &frames);
        let from_keys: Box<dyn FnMut(&mut [Quat])> = Box::new(move |output| {
            let layout = Layout::TrackMajor;
            let done = engine.evaluate_into(set, method, frames, layout, output);
            done.expect("what fits");
        });
        let clip = engine.upload(set, method).expect("good keys");
        let evaluation: Box<dyn FnMut(&mut [Quat])> = Box::new(move |output| {
            let done = clip.evaluate_into(frames, Layout::TrackMajor, output);
            done.expect("what fits");
        });
        (from_keys, evaluation)
    };
    let (slerp_from_keys, slerp) = tumble(method::SLERP);
    let (cubic_from_keys, cubic) = tumble(method::BESSEL_OVERHAUSER);
    let arcs = bevy::arcs(&set);
    let hermite = bevy::hermite(&set);
    let contestants: Vec<Contestant<'_>> = vec![
        (
            "memory write rate",
            Box::new(|output| {
                let value = std::hint::black_box(Quat::IDENTITY);
                let each = output.len().div_ceil(rayon::current_num_threads());
                output.par_chunks_mut(each).for_each(|part| part.fill(value));
            }),
        ),
        ("tumble slerp, from keys", slerp_from_keys),
        ("tumble slerp, evaluation alone", slerp),
        (
            "glam Quat::slerp, a cursor a track",
            Box::new(|output| each_track(&set, output, |track, row| naive(track, &times, row))),
        ),
        (
            "ultraviolet Rotor3x8::slerp",
            Box::new(|output| each_track(&set, output, |track, row| wide::slerp(track, &times, row))),
        ),
        (
            "bevy UnevenSampleAutoCurve (slerp)",
            Box::new(|output| bevy::sample(&arcs, &times, output)),
        ),
        ("tumble bessel-overhauser, from keys", cubic_from_keys),
        ("tumble bessel-overhauser, evaluation alone", cubic),
        (
            "bevy CubicRotationCurve (glTF Hermite)",
            Box::new(|output| bevy::sample(&hermite, &times, output)),
        ),
    ];
    report(race(contestants));
}

fn each_track(
    set: &TrackSet,
    output: &mut [Quat],
    evaluate: impl Fn(tumble::Track<'_>, &mut [Quat]) + Sync,
) {
    let rows = output.par_chunks_mut(FRAMES).enumerate();
    rows.for_each(|(index, row)| evaluate(set.track(index), row));
}

fn naive(track: tumble::Track<'_>, times: &[f32], row: &mut [Quat]) {
    let mut i = 0;
    for (&time, rotation) in times.iter().zip(row) {
        let time = f64::from(time);
        while i + 2 < track.times.len() && track.times[i + 1] <= time {
            i += 1;
        }
        let t = (time - track.times[i]) / (track.times[i + 1] - track.times[i]);
        *rotation = track.keys[i].slerp(track.keys[i + 1], t as f32);
    }
}

/// Medians, every contestant in turn, after a round that does not count.
fn race(mut contestants: Vec<Contestant<'_>>) -> Vec<(&'static str, Duration)> {
    let mut output = OutputBuffer::new(TRACKS * FRAMES).unwrap();
    output.fill(Quat::IDENTITY);
    let mut times = vec![Vec::new(); contestants.len()];
    for round in 0..=ROUNDS {
        for ((_, fill), times) in contestants.iter_mut().zip(&mut times) {
            let started = Instant::now();
            fill(&mut output);
            if round > 0 {
                times.push(started.elapsed());
            }
            std::hint::black_box(&mut output);
        }
    }
    let names = contestants.iter().map(|(name, _)| *name);
    let median = |mut times: Vec<Duration>| {
        times.sort();
        times[times.len() / 2]
    };
    names.zip(times.into_iter().map(median)).collect()
}

fn report(rows: Vec<(&'static str, Duration)>) {
    let rotations = (TRACKS * FRAMES) as f64;
    let write = rows[0].1.as_secs_f64();
    println!("{:44} {:>8} {:>8} {:>8}", "", "ms", "M/s", "writing");
    for (name, time) in rows {
        let seconds = time.as_secs_f64();
        println!(
            "{name:44} {:>8.2} {:>8.0} {:>7.2}x",
            seconds * 1e3,
            rotations / seconds / 1e6,
            write / seconds
        );
    }
}

/// Keys at steps of 1/4 to 7/4 of the mean, each up to a radian from the last.
fn tracks() -> TrackSet {
    let mut random = fastrand::Rng::with_seed(1);
    let mut between = |low: f64, high: f64| low + (high - low) * random.f64();
    let mut set = TrackSet::new();
    for _ in 0..TRACKS {
        let mut times = vec![0.0];
        for key in 1..KEYS {
            times.push(times[key - 1] + between(0.25, 1.75));
        }
        let scale = FRAMES as f64 / RATE / times[KEYS - 1];
        times.iter_mut().for_each(|time| *time *= scale);
        let mut rotation = DQuat::IDENTITY;
        let mut key = || {
            let axis = DVec3::from_array([(); 3].map(|()| between(-1.0, 1.0)));
            let turn = DQuat::from_axis_angle(axis.normalize_or(DVec3::X), between(0.0, 1.0));
            rotation = (rotation * turn).normalize();
            rotation.as_quat()
        };
        let keys: Vec<Quat> = times.iter().map(|_| key()).collect();
        set.push("", &times, &keys).expect("unit keys in order");
    }
    set
}
