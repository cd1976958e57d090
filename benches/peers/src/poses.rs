//! One pose a call, as a game asks for: 60 tracks of ten seconds of motion at 30 Hz, at times that go on.

use std::hint::black_box;

use glam::{DQuat, DVec3, Quat};
use tumble::{Device, Engine, EngineOptions, Method, TrackSet, method};
use ultraviolet::{Bivec3x8, Rotor3x8, Slerp, f32x8};

use crate::{CALLS, Contestant};

const TRACKS: usize = 60;
const KEYS: usize = 300;
const RATE: f64 = 30.0;

/// Up to 4 degrees a step.
fn motion() -> TrackSet {
    let mut random = fastrand::Rng::with_seed(6);
    let mut between = |low: f64, high: f64| low + (high - low) * random.f64();
    let times: Vec<f64> = (0..KEYS).map(|key| key as f64 / RATE).collect();
    let mut set = TrackSet::new();
    for _ in 0..TRACKS {
        let mut rotation = DQuat::IDENTITY;
        let mut key = || {
            let axis = DVec3::from_array([(); 3].map(|()| between(-1.0, 1.0)));
            let step = DQuat::from_axis_angle(axis.normalize_or(DVec3::X), between(0.0, 0.07));
            rotation = (rotation * step).normalize();
            rotation.as_quat()
        };
        let keys: Vec<Quat> = times.iter().map(|_| key()).collect();
        set.push("", &times, &keys).expect("unit keys in order");
    }
    set
}

/// The time of a call: between keys, at 60 a second.
fn time_of(call: usize) -> f64 {
    (call % (2 * KEYS - 4)) as f64 / 60.0 + 0.005
}

/// The interval of a time, and how much of it is over.
fn interval_at(time: f64) -> (usize, f32) {
    let key = (time * RATE).floor();
    (key as usize, (time * RATE - key) as f32)
}

pub fn contestants() -> Vec<Contestant<'static>> {
    let set: &'static TrackSet = Box::leak(Box::new(motion()));
    let sampler = |name, work, method: Method, kept_segments| {
        let mut options = EngineOptions::default();
        options.kept_segments = Some(kept_segments);
        let engine = Engine::with_options(Device::Cpu, &options).expect("a CPU");
        let clip = engine.upload(set, method).expect("good keys");
        let mut sampler = clip.sampler().expect("memory");
        Contestant {
            name,
            work,
            threads: "1",
            bytes_per_key: Some(clip.bytes_per_key()),
            fill: Box::new(move |output: &mut [Quat]| {
                for call in 0..CALLS {
                    let done = sampler.pose(time_of(call), &mut output[..TRACKS]);
                    done.expect("what fits");
                    black_box(&mut *output);
                }
            }),
        }
    };
    let keys: Vec<&[Quat]> = (0..TRACKS).map(|track| set.track(track).keys).collect();
    let by_glam = {
        let keys = keys.clone();
        move |output: &mut [Quat]| {
            for call in 0..CALLS {
                let (key, part) = interval_at(time_of(call));
                for (value, keys) in output[..TRACKS].iter_mut().zip(&keys) {
                    *value = keys[key].slerp(keys[key + 1], part);
                }
                black_box(&mut *output);
            }
        }
    };
    // A pose of each key, eight tracks side by side.
    let rotors: Vec<Rotor3x8> = (0..KEYS)
        .flat_map(|key| (0..TRACKS.div_ceil(8)).map(move |eight| (key, eight)))
        .map(|(key, eight)| {
            let of = |component: usize| {
                let lane = |lane: usize| {
                    keys[(8 * eight + lane).min(TRACKS - 1)][key].to_array()[component]
                };
                f32x8::new(std::array::from_fn(lane))
            };
            Rotor3x8::new(of(3), Bivec3x8::new(-of(2), of(1), -of(0)))
        })
        .collect();
    let by_ultraviolet = move |output: &mut [Quat]| {
        let eights = TRACKS.div_ceil(8);
        for call in 0..CALLS {
            let (key, part) = interval_at(time_of(call));
            let (from, to) = rotors[key * eights..][..2 * eights].split_at(eights);
            for (eight, values) in output[..TRACKS].chunks_mut(8).enumerate() {
                let q = from[eight].slerp(to[eight], f32x8::splat(part));
                let [x, y, z, w] = q.into_quaternion_array().map(f32x8::to_array);
                for (j, value) in values.iter_mut().enumerate() {
                    *value = Quat::from_xyzw(x[j], y[j], z[j], w[j]);
                }
            }
            black_box(&mut *output);
        }
    };
    let by_hand = |name, fill: Box<dyn FnMut(&mut [Quat])>| Contestant {
        name,
        work: "one pose, slerp",
        threads: "1",
        bytes_per_key: Some(16.0),
        fill,
    };
    let (slerp, smooth) = ("one pose, slerp", "one pose, smooth");
    vec![
        sampler("Tumble, segments kept", slerp, method::SLERP, u64::MAX),
        sampler("Tumble, keys kept", slerp, method::SLERP, 0),
        by_hand("glam Quat::slerp, by hand", Box::new(by_glam)),
        by_hand(
            "ultraviolet Rotor3x8::slerp, keys side by side",
            Box::new(by_ultraviolet),
        ),
        sampler(
            "Tumble, segments kept",
            smooth,
            method::BESSEL_OVERHAUSER,
            u64::MAX,
        ),
        sampler("Tumble, keys kept", smooth, method::BESSEL_OVERHAUSER, 0),
    ]
}
