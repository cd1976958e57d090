//! Measures Tumble and other Rust libraries, as one contestant of `run.sh`. The workload is 4096 tracks of 26 uneven
//! keys at 1200 frames, written into memory that is reused, or one pose for each call.
//!
//! ```text
//! tumble-peers write KEYS               the keys, for all contestants
//! tumble-peers race KEYS FOLDER         a line of JSON for each contestant, the first row of its result in FOLDER
//! tumble-peers write-poses KEYS         keys and times of the poses, for all contestants
//! tumble-peers race-poses KEYS FOLDER   a line of JSON for each contestant of poses
//! ```

mod bevy;
mod poses;
mod wide;

use std::path::Path;
use std::time::{Duration, Instant};
use std::{env, fs};

use glam::{DQuat, DVec3, Quat};
use rayon::prelude::*;
use tumble::{
    Device, Engine, EngineOptions, Layout, Method, OutputBuffer, SampleTimes, TrackSet, method,
};

const TRACKS: usize = 4096;
const KEYS: usize = 26;
const FRAMES: usize = 1200;
const RATE: f64 = 60.0;
const ROUNDS: usize = 3;
/// The number of calls, each of which gives one rotation.
const CALLS: usize = 10_000;

/// Something that fills the output, [track][frame].
struct Contestant<'a> {
    name: &'static str,
    work: &'static str,
    threads: &'static str,
    fill: Box<dyn FnMut(&mut [Quat]) + 'a>,
}

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["write", keys] => fs::write(keys, packed(&tracks())).expect("keys that can be written"),
        ["race", keys, folder] => {
            let set = unpacked(&fs::read(keys).expect("keys"));
            race(contestants(&set), Path::new(folder));
        }
        ["write-poses", keys] => {
            fs::write(keys, poses::packed()).expect("keys that can be written");
        }
        ["race-poses", ..] => poses::race(),
        _ => panic!("tumble-peers write KEYS | race KEYS FOLDER, or write-poses and race-poses"),
    }
}

fn contestants(set: &TrackSet) -> Vec<Contestant<'_>> {
    let frames = &*Box::leak(Box::new(
        SampleTimes::fps(RATE as u32).between(0.0, (FRAMES - 1) as f64 / RATE),
    ));
    let times: Vec<f32> = (0..FRAMES).map(|k| (k as f64 / RATE) as f32).collect();
    let times: &'static [f32] = times.leak();
    let engine = |threads| {
        let mut options = EngineOptions::default();
        options.thread_count = threads;
        Engine::with_options(Device::Cpu, &options).expect("a CPU")
    };
    let tumble = |name, work, threads, method: Method| {
        let engine = engine((threads == "1").then_some(1));
        let fill = move |output: &mut [Quat]| {
            let done = engine.evaluate_into(set, method, frames, Layout::TrackMajor, output);
            done.expect("what fits");
        };
        Contestant {
            name,
            work,
            threads,
            fill: Box::new(fill),
        }
    };
    let kept = |name, work, method: Method| {
        let clip = engine(None).upload(set, method).expect("good keys");
        let fill = move |output: &mut [Quat]| {
            let done = clip.evaluate_into(frames, Layout::TrackMajor, output);
            done.expect("what fits");
        };
        Contestant {
            name,
            work,
            threads: "all",
            fill: Box::new(fill),
        }
    };
    let of_each = |name, work, threads, row: fn(tumble::Track<'_>, &[f32], &mut [Quat])| {
        let fill = move |output: &mut [Quat]| match threads {
            "1" => {
                let rows = output.chunks_mut(FRAMES).enumerate();
                rows.for_each(|(index, output)| row(set.track(index), times, output));
            }
            _ => {
                let rows = output.par_chunks_mut(FRAMES).enumerate();
                rows.for_each(|(index, output)| row(set.track(index), times, output));
            }
        };
        Contestant {
            name,
            work,
            threads,
            fill: Box::new(fill),
        }
    };
    let write = |output: &mut [Quat]| {
        let value = std::hint::black_box(Quat::IDENTITY);
        let each = output.len().div_ceil(rayon::current_num_threads());
        output
            .par_chunks_mut(each)
            .for_each(|part| part.fill(value));
    };
    let write = Contestant {
        name: "writing memory",
        work: "none",
        threads: "all",
        fill: Box::new(write),
    };
    let mut first = TrackSet::new();
    let track = set.track(0);
    first
        .push("", track.times, track.keys)
        .expect("unit keys in order");
    let small = engine(Some(1))
        .upload(&first, method::SLERP)
        .expect("good keys");
    let one_tumble = move |output: &mut [Quat]| {
        for call in 0..CALLS {
            let at = (call * 7919 % (FRAMES - 1)) as f64 / RATE;
            let one = SampleTimes::fps(RATE as u32).between(at, at);
            let done = small.evaluate_into(&one, Layout::TrackMajor, &mut output[..1]);
            done.expect("what fits");
        }
    };
    let one_glam = move |output: &mut [Quat]| {
        for call in 0..CALLS {
            let at = times[call * 7919 % (FRAMES - 1)];
            output[0] = one_sample(set.track(0), at);
            std::hint::black_box(&mut *output);
        }
    };
    let one = "one sample";
    let mut contestants = vec![
        write,
        tumble("Tumble, from keys", "slerp", "all", method::SLERP),
        tumble("Tumble, from keys, one thread", "slerp", "1", method::SLERP),
        kept("Tumble, a kept clip", "slerp", method::SLERP),
        of_each("glam Quat::slerp, by hand", "slerp", "all", naive),
        of_each("glam Quat::slerp, by hand, one thread", "slerp", "1", naive),
        of_each("ultraviolet Rotor3x8::slerp", "slerp", "all", wide::slerp),
        tumble(
            "Tumble, from keys",
            "smooth",
            "all",
            method::BESSEL_OVERHAUSER,
        ),
        tumble(
            "Tumble, from keys, one thread",
            "smooth",
            "1",
            method::BESSEL_OVERHAUSER,
        ),
        kept("Tumble, a kept clip", "smooth", method::BESSEL_OVERHAUSER),
        Contestant {
            name: "Tumble, a kept clip",
            work: one,
            threads: "1",
            fill: Box::new(one_tumble),
        },
        Contestant {
            name: "glam Quat::slerp, by hand",
            work: one,
            threads: "1",
            fill: Box::new(one_glam),
        },
    ];
    let arcs = bevy::arcs(set);
    contestants.push(Contestant {
        name: "Bevy UnevenSampleAutoCurve",
        work: "slerp",
        threads: "all",
        fill: Box::new(move |output: &mut [Quat]| bevy::sample(&arcs, times, output)),
    });
    #[cfg(feature = "bevy")]
    {
        let hermite = bevy::hermite(set);
        contestants.push(Contestant {
            name: "Bevy CubicRotationCurve",
            work: "smooth",
            threads: "all",
            fill: Box::new(move |output: &mut [Quat]| bevy::sample(&hermite, times, output)),
        });
    }
    contestants
}

/// A loop as one would write it: a cursor for each track.
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

fn one_sample(track: tumble::Track<'_>, time: f32) -> Quat {
    let time = f64::from(time);
    let i = track.times.partition_point(|&key| key <= time);
    let i = i.clamp(1, track.times.len() - 1) - 1;
    let t = (time - track.times[i]) / (track.times[i + 1] - track.times[i]);
    track.keys[i].slerp(track.keys[i + 1], t as f32)
}

/// All contestants one after another, after a round that does not count; the median of each.
fn race(mut contestants: Vec<Contestant<'_>>, folder: &Path) {
    let mut output = OutputBuffer::new(TRACKS * FRAMES).expect("memory");
    output.fill(Quat::IDENTITY);
    let mut times = vec![Vec::new(); contestants.len()];
    for round in 0..=ROUNDS {
        for (contestant, times) in contestants.iter_mut().zip(&mut times) {
            let started = Instant::now();
            (contestant.fill)(&mut output);
            if round > 0 {
                times.push(started.elapsed());
            } else {
                let row = folder.join(row(contestant));
                fs::write(row, bytemuck::cast_slice(&output[..FRAMES])).expect("a row");
            }
            std::hint::black_box(&mut output);
        }
    }
    for (contestant, mut times) in contestants.iter().zip(times) {
        times.sort();
        let median: Duration = times[times.len() / 2];
        println!(
            "{{\"name\": {:?}, \"work\": {:?}, \"threads\": {:?}, \"ms\": {}, \"row\": {:?}}}",
            contestant.name,
            contestant.work,
            contestant.threads,
            1e3 * median.as_secs_f64(),
            row(contestant)
        );
    }
}

fn row(contestant: &Contestant<'_>) -> String {
    let name = contestant.name.replace("::", "-");
    format!("{name}, {}, {}.f32", contestant.work, contestant.threads)
}

/// Tracks, keys, frames and the rate; the times of all keys in f64, their rotations in f32.
fn packed(set: &TrackSet) -> Vec<u8> {
    let mut bytes = Vec::new();
    for count in [TRACKS, KEYS, FRAMES] {
        bytes.extend_from_slice(&(count as u32).to_le_bytes());
    }
    bytes.extend_from_slice(&RATE.to_le_bytes());
    let tracks = || (0..set.track_count()).map(|track| set.track(track));
    tracks().for_each(|track| bytes.extend_from_slice(bytemuck::cast_slice(track.times)));
    tracks().for_each(|track| bytes.extend_from_slice(bytemuck::cast_slice(track.keys)));
    bytes
}

fn unpacked(bytes: &[u8]) -> TrackSet {
    let numbers = &bytes[20..];
    let (times, keys) = numbers.split_at(8 * TRACKS * KEYS);
    let mut set = TrackSet::new();
    for (times, keys) in times
        .chunks_exact(8 * KEYS)
        .zip(keys.chunks_exact(16 * KEYS))
    {
        let times: Vec<f64> = bytemuck::pod_collect_to_vec(times);
        let keys: Vec<Quat> = bytemuck::pod_collect_to_vec(keys);
        set.push("", &times, &keys).expect("unit keys in order");
    }
    set
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
            let step = DQuat::from_axis_angle(axis.normalize_or(DVec3::X), between(0.0, 1.0));
            rotation = (rotation * step).normalize();
            rotation.as_quat()
        };
        let keys: Vec<Quat> = times.iter().map(|_| key()).collect();
        set.push("", &times, &keys).expect("unit keys in order");
    }
    set
}
