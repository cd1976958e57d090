//! The errors of the engine against textbook formulas, in radians, with stated bounds: slerp 6e-7
//! (largest) and 1e-7 (rms), cubic methods 1e-6 and 1e-7, norms 4e-7.

use crate::method_lists::{Column, assert_stated};
use crate::support::{Random, give_key_data, hostile_set, is_due};
use glam::{DQuat, Quat};
use tumble::reference::{ReferenceCurve, angle_between};
use tumble::{
    Clip, Device, Ends, Engine, FrameRate, Interpolation, KeySigns, METHODS, Rotations,
    SampleTimes, Track, TrackSet, method::Form,
};

/// Largest and rms error in radians, largest | |q| - 1 |.
#[derive(Debug, Default)]
struct Errors {
    largest: f64,
    rms: f64,
    norm: f64,
}

fn clip(set: &TrackSet, interpolation: Interpolation) -> Clip {
    let engine = Engine::new(Device::Cpu).unwrap();
    engine.upload(set, interpolation).unwrap()
}

fn errors(set: &TrackSet, interpolation: Interpolation, frames: &SampleTimes) -> Errors {
    let clip = clip(set, interpolation);
    let timeline = clip.timeline(frames).unwrap();
    let rotations = clip.evaluate(frames).unwrap();
    let mut errors = Errors::default();
    let mut undefined = 0;
    let method = interpolation.method;
    for (t, track) in set.tracks().enumerate() {
        let curve = ReferenceCurve::of(&interpolation, track);
        for s in 0..rotations.sample_count() {
            let found = rotations.get(t, s).unwrap().as_dquat();
            let time = timeline.time(t, s).unwrap();
            let error = angle_between(found, curve.rotation(time));
            // Controls are opposite only if they are the bisectors themselves (`shoemake`).
            let may_be_none = method == tumble::method::SHOEMAKE;
            if may_be_none && error > 1e-6 && !is_defined(&interpolation, track, time) {
                undefined += 1;
                continue;
            }
            // `max` would swallow NaN.
            assert!(
                error.is_finite(),
                "{method}: track {t}, sample {s}: {found}"
            );
            errors.largest = errors.largest.max(error);
            errors.rms += error * error;
            errors.norm = errors.norm.max((found.length() - 1.0).abs());
        }
    }
    assert!(
        undefined * 1000 <= rotations.as_quats().len(),
        "{undefined} undefined"
    );
    errors.rms = (errors.rms / rotations.as_quats().len() as f64).sqrt();
    errors
}

/// Whether there is a curve to compare with: not where the last bit of a key moves it by
/// a thousandth of a radian, as between opposite control rotations.
fn is_defined(interpolation: &Interpolation, track: Track, time: f64) -> bool {
    let plain = ReferenceCurve::of(interpolation, track).rotation(time);
    (0..track.keys.len()).all(|key| {
        let mut keys = track.keys.to_vec();
        let largest = keys[key]
            .to_array()
            .map(f32::abs)
            .into_iter()
            .fold(0.0, f32::max);
        let nudge = Quat::from_xyzw(0.3, -0.7, 0.5, 0.4) * (largest * f32::EPSILON);
        keys[key] += nudge;
        let mut nudged: Track<'_> = track;
        nudged.keys = &keys;
        angle_between(
            plain,
            ReferenceCurve::of(interpolation, nudged).rotation(time),
        ) < 1e-3
    })
}

fn assert_within_bounds(
    set: &TrackSet,
    interpolation: Interpolation,
    frames: &SampleTimes,
    label: &str,
) {
    let (largest, rms) = match interpolation.method.form {
        Form::Arc => (6e-7, 1e-7),
        _ => (1e-6, 1e-7),
    };
    let errors = errors(set, interpolation, frames);
    let method = interpolation.method;
    println!("{method}, {label}: {errors:?}");
    assert!(
        errors.largest <= largest && errors.rms <= rms && errors.norm <= 4e-7,
        "{interpolation:?}, {label}: {errors:?}"
    );
    let column = match label {
        HOSTILE => Column::Hostile,
        _ => Column::Largest,
    };
    assert_stated(method, column, errors.largest);
    assert_stated(method, Column::Rms, errors.rms);
    assert_stated(method, Column::Norm, errors.norm);
}

const HOSTILE: &str = "hostile keys";

const RATES: [&str; 5] = ["25", "60", "120", "30000/1001", "999"];

fn rate(text: &str) -> FrameRate {
    text.parse().unwrap()
}

/// Chains that turn by up to `step` radians between keys `start` seconds on.
fn smooth_set(seed: u64, start: f64, step: f64) -> TrackSet {
    let mut random = Random(seed);
    let mut set = TrackSet::new();
    for _ in 0..48 {
        let (mut times, mut keys) = (Vec::new(), Vec::new());
        let (mut time, mut rotation) = (start, random.rotation());
        for _ in 0..26 {
            times.push(time);
            keys.push(rotation.as_quat());
            time += 0.8 * random.between(0.5, 1.5);
            let rotation_step =
                DQuat::from_axis_angle(random.direction(), random.between(0.0, step));
            rotation = (rotation * rotation_step).normalize();
        }
        set.push("", &times, &keys).unwrap();
    }
    give_key_data(&mut set, seed);
    set
}

#[test]
fn every_method_is_within_its_bounds_for_steps_up_to_half_a_turn() {
    let set = smooth_set(1, 0.0, std::f64::consts::PI);
    for method in METHODS {
        for fps in RATES {
            assert_within_bounds(&set, method.into(), &SampleTimes::rate(rate(fps)), fps);
        }
    }
}

/// Keys as dense as in motion capture, whose curves are prepared without fits, and keys that are
/// just too far apart for this; at even and uneven times.
#[test]
fn every_method_is_within_its_bounds_for_keys_near_each_other() {
    for (seed, step) in [(12, 0.02), (13, 0.1), (14, 0.25)] {
        let uneven = smooth_set(seed, 0.0, step);
        let mut even = TrackSet::new();
        for track in uneven.tracks() {
            let times: Vec<f64> = (0..track.keys.len()).map(|i| i as f64 / 120.0).collect();
            even.push("", &times, track.keys).unwrap();
        }
        give_key_data(&mut even, seed);
        for method in METHODS {
            let frames = SampleTimes::rate(rate("999"));
            assert_within_bounds(&even, method.into(), &frames, "near and even");
            assert_within_bounds(&uneven, method.into(), &SampleTimes::fps(60), "near");
        }
    }
}

/// Arcs of up to 360°, which consist of two.
#[test]
fn slerp_is_within_its_bounds_the_long_way_too() {
    let mut random = Random(15);
    let mut set = TrackSet::new();
    for track in smooth_set(15, 0.0, 3.0).tracks() {
        let mut sign = || random.pick(&[1.0, -1.0]);
        let keys: Vec<Quat> = track.keys.iter().map(|&key| key * sign()).collect();
        set.push("", track.times, &keys).unwrap();
    }
    let interpolation = Interpolation::from(tumble::method::SLERP).with_signs(KeySigns::AsAuthored);
    for fps in RATES {
        let frames = SampleTimes::rate(rate(fps));
        assert_within_bounds(&set, interpolation, &frames, "the long way");
    }
}

/// Catches a time kept in f32: at 24 hours its unit is 8 ms.
#[test]
fn accuracy_does_not_decay_by_hour_24() {
    let set = smooth_set(2, 86_400.0, 1.6);
    for (i, method) in METHODS.into_iter().enumerate() {
        let rates = RATES.into_iter().enumerate();
        for (_, fps) in rates.filter(|(j, _)| is_due(i, *j, 2)) {
            assert_within_bounds(&set, method.into(), &SampleTimes::rate(rate(fps)), "24 h");
        }
    }
}

/// A clip of 24 hours sampled in its last second.
#[test]
fn accuracy_does_not_decay_along_a_day() {
    let mut random = Random(6);
    let mut set = TrackSet::new();
    // A key every ten seconds, and at the end, where the track is sampled, one every second.
    let sparse = (0..8600).map(|i| 10.0 * f64::from(i));
    let times: Vec<f64> = sparse.chain((86_000..=86_400).map(f64::from)).collect();
    let keys: Vec<Quat> = times.iter().map(|_| random.rotation().as_quat()).collect();
    set.push("", &times, &keys).unwrap();
    for (i, method) in METHODS.into_iter().enumerate() {
        for (j, fps) in RATES.into_iter().enumerate() {
            if !is_due(i, j, RATES.len()) {
                continue;
            }
            let frames = SampleTimes::rate(rate(fps)).between(86_390.0, 86_400.0);
            assert_within_bounds(
                &set,
                method.into(),
                &frames,
                "the last ten seconds of a day",
            );
        }
    }
}

/// The bounds also hold for gaps of one frame next to long ones, tiny angles and large tangents.
#[test]
fn hostile_keys_are_within_the_bounds() {
    for seed in 0..4 {
        let set = hostile_set(seed, 64);
        for method in METHODS {
            let frames = SampleTimes::fps(60).between(-1.0, 40.0);
            assert_within_bounds(&set, method.into(), &frames, HOSTILE);
        }
    }
}

#[test]
fn arbitrary_times_are_within_the_bounds() {
    let mut random = Random(3);
    let set = smooth_set(3, 1e5, 2.0);
    let times = (0..2000)
        .map(|_| 1e5 + random.between(-1.0, 25.0))
        .collect();
    let frames = SampleTimes::at(times);
    for method in METHODS {
        assert_within_bounds(&set, method.into(), &frames, "arbitrary times");
    }
}

#[test]
fn every_option_is_within_the_bounds() {
    let mut set = smooth_set(4, 0.0, 2.0);
    // Also too short to have an inner key, or more than one.
    for (from, keys) in [(0, 2), (1, 2), (2, 3), (3, 4)] {
        let track = set.track(from);
        let (times, keys) = (track.times[..keys].to_vec(), track.keys[..keys].to_vec());
        set.push("short", &times, &keys).unwrap();
    }
    let spin = glam::DVec3::new(0.5, -1.0, 0.25);
    for method in METHODS {
        for ends in [
            Ends::Parabolic,
            Ends::Natural,
            Ends::Secant,
            Ends::Clamped {
                start: spin,
                end: -spin,
            },
            Ends::Frozen,
        ] {
            let interpolation = Interpolation::from(method).with_ends(ends);
            assert_within_bounds(&set, interpolation, &SampleTimes::fps(60), "ends");
        }
        let interpolation = Interpolation::from(method).with_signs(KeySigns::AsAuthored);
        assert_within_bounds(&set, interpolation, &SampleTimes::fps(60), "as authored");
    }
    let mut closed = TrackSet::new();
    for track in set.tracks() {
        let mut keys = track.keys.to_vec();
        *keys.last_mut().unwrap() = -keys[0];
        closed.push("", track.times, &keys).unwrap();
    }
    for method in METHODS {
        let interpolation = Interpolation::from(method).with_ends(Ends::Loop);
        assert_within_bounds(&closed, interpolation, &SampleTimes::fps(60), "loop");
    }
}

fn bits(q: Quat) -> [u32; 4] {
    q.to_array().map(f32::to_bits)
}

/// A sample at a key has exactly the key's bits, at frames and at explicit times, also after 24
/// hours, whatever the stored sign of the key is.
#[test]
fn keys_are_reproduced_exactly() {
    for start in [0.0, -3.5, 86_400.0] {
        let mut random = Random(9);
        let mut set = TrackSet::new();
        for _ in 0..20 {
            let times: Vec<f64> = (0..26).map(|i| start + f64::from(i) * 0.8).collect();
            let keys: Vec<Quat> = times.iter().map(|_| random.rotation().as_quat()).collect();
            set.push("", &times, &keys).unwrap();
        }
        for method in METHODS.into_iter().filter(|method| method.interpolates) {
            for ends in [Ends::Parabolic, Ends::Natural, Ends::Frozen] {
                let clip = clip(&set, Interpolation::from(method).with_ends(ends));
                let frames = clip.evaluate(&SampleTimes::fps(25)).unwrap();
                let times = clip
                    .evaluate(&SampleTimes::at(set.track(0).times.to_vec()))
                    .unwrap();
                for (t, track) in set.tracks().enumerate() {
                    for (k, &key) in track.keys.iter().enumerate() {
                        let found = frames.get(t, 20 * k).unwrap();
                        assert_eq!(bits(found), bits(key), "{method}, track {t}, key {k}");
                        assert_eq!(bits(times.get(t, k).unwrap()), bits(key));
                    }
                }
            }
        }
    }
}

#[test]
fn end_values_are_held_outside_the_keys() {
    let mut set = TrackSet::new();
    let keys = [0.0, 1.0, 0.4, 0.9].map(Quat::from_rotation_x);
    set.push("short", &[1.0, 2.0, 3.0, 4.0], &keys).unwrap();
    set.push("single", &[2.5], &keys[1..2]).unwrap();
    for method in METHODS {
        let clip = clip(&set, method.into());
        let frames = clip
            .evaluate(&SampleTimes::fps(10).between(0.0, 9.0))
            .unwrap();
        let held = |a, b| bits(frames.get(0, a).unwrap()) == bits(frames.get(0, b).unwrap());
        assert!(held(0, 9) && held(40, 90) && !held(9, 25), "{method}");
        for s in 0..frames.sample_count() {
            assert_eq!(bits(frames.get(1, s).unwrap()), bits(keys[1]), "{method}");
        }
        if method.interpolates {
            assert_eq!(bits(frames.get(0, 0).unwrap()), bits(keys[0]));
            assert_eq!(bits(frames.get(0, 90).unwrap()), bits(keys[3]));
        }
    }
}

/// `times[k] = start + k / fps` means the samples that frames mean.
#[test]
fn times_of_frames_are_within_rounding_of_frames() {
    let set = smooth_set(11, 0.0, 2.0);
    for method in METHODS {
        let clip = clip(&set, method.into());
        let frames = SampleTimes::fps(60);
        let timeline = clip.timeline(&frames).unwrap();
        let times = (0..timeline.len())
            .map(|s| timeline.time(0, s).unwrap())
            .collect();
        let by_frame: Rotations = clip.evaluate(&frames).unwrap();
        let by_time = clip.evaluate(&SampleTimes::at(times)).unwrap();
        for (a, b) in by_frame.as_quats().iter().zip(by_time.as_quats()) {
            assert!(
                angle_between(a.as_dquat(), b.as_dquat()) < 2e-6,
                "{method}: {a} {b}"
            );
        }
    }
}

/// Catches infinities times zero: intervals between neighbouring numbers of f64.
#[test]
fn keys_next_to_nothing_apart_give_unit_quaternions() {
    let tiny = 5e-324;
    let (a, b) = (Quat::from_rotation_x(0.3), Quat::from_rotation_y(2.0));
    for times in [
        [0.0, tiny, 1.0, 2.0],
        [0.0, 1.0, 1.0 + f64::EPSILON, 2.0],
        [0.0, tiny, 2.0 * tiny, 1e30],
    ] {
        for keys in [[a; 4], [a, b, b, a], [a, b, a, b]] {
            let mut set = TrackSet::new();
            set.push("", &times, &keys).unwrap();
            let mut samples = times.to_vec();
            samples.extend([0.1, 0.5, 0.9, 1.0 + 1e-9, 1.5, 1e20]);
            for method in METHODS {
                for ends in [Ends::Parabolic, Ends::Natural] {
                    let interpolation = Interpolation::from(method).with_ends(ends);
                    let clip = clip(&set, interpolation);
                    let found = clip.evaluate(&SampleTimes::at(samples.clone())).unwrap();
                    for q in found.as_quats() {
                        let label = format!("{method}, {ends:?}, {times:?}, {keys:?}: {q}");
                        assert!((q.length() - 1.0).abs() < 1e-5, "{label}");
                    }
                }
            }
        }
    }
}

#[test]
fn end_velocities_that_cannot_be_met_are_refused() {
    let set = smooth_set(5, 0.0, 1.0);
    let engine = Engine::new(Device::Cpu).unwrap();
    for bad in [f64::NAN, f64::INFINITY, 1e13] {
        let ends = Ends::Clamped {
            start: glam::DVec3::X * bad,
            end: glam::DVec3::ZERO,
        };
        for method in METHODS {
            let interpolation = Interpolation::from(method).with_ends(ends);
            let error = engine.upload(&set, interpolation).unwrap_err();
            assert!(error.to_string().contains("end velocity"), "{error}");
        }
    }
}
