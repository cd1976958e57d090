//! At any time: every sample is written, and the accuracy does not depend on when a motion takes
//! place.

use glam::{DQuat, DVec3, Quat, Vec3};
use proptest::prelude::*;
use tumble::reference::{ReferenceCurve, angle_between};
use tumble::verify::verify;
use tumble::{
    Channel, Device, Engine, FrameRate, Interpolation, Layout, METHODS, Method, SampleTimes, Speed,
    TrackSet, VectorMethod, WrapMode, method,
};

use crate::support::{Random, first_difference, vulkan_engines};

const MODES: [WrapMode; 4] = [
    WrapMode::Hold,
    WrapMode::Loop,
    WrapMode::Mirror,
    WrapMode::Extrapolate,
];

/// Numbers that no result has, to find samples that were not written.
const POISON: [f32; 4] = [f32::NAN; 4];

/// A time of any magnitude up to 1e18 s.
fn any_time(random: &mut Random) -> f64 {
    let sign = random.pick(&[-1.0, 1.0]);
    match random.next() % 6 {
        0 => 0.0,
        1 => sign * random.pick(&[1.0, 2.5, 1.7e9, 86_400.0, 1e12, 4e16, 1e18]),
        _ => sign * 10f64.powf(random.between(-9.0, 18.0)),
    }
}

/// Tracks whose keys are from 1e-9 s to a million seconds apart, anywhere.
fn any_set(random: &mut Random) -> TrackSet {
    let mut set = TrackSet::new();
    for _ in 0..1 + random.next() % 3 {
        let first = match random.next() % 2 {
            0 => 0.0,
            _ => any_time(random),
        };
        let step = 10f64.powf(random.between(-9.0, 6.0));
        let mut times = vec![first];
        // Long tracks lie in several parts.
        let count = random.pick(&[0, 1, 2, 3, 7, 7, 40, 5000]);
        for key in 1..=count {
            let time = first + step * (f64::from(key) + random.between(-0.3, 0.3));
            times.push(time.max(times[times.len() - 1].next_up()));
        }
        let keys: Vec<Quat> = times.iter().map(|_| random.rotation().as_quat()).collect();
        set.push("", &times, &keys).unwrap();
    }
    set
}

fn any_frames(random: &mut Random, set: &TrackSet) -> SampleTimes {
    let (first, last) = set.time_span().unwrap();
    let near = |random: &mut Random| first + (last - first) * random.between(-3.0, 4.0);
    if random.next().is_multiple_of(3) {
        let mut any = || match random.next() % 2 {
            0 => any_time(random),
            _ => near(random),
        };
        return SampleTimes::at((0..60).map(|_| any()).collect());
    }
    let start = match random.next() % 2 {
        0 => any_time(random),
        _ => near(random),
    };
    // With these rates, a track has a few frames, or a key interval has a few.
    let frames = [1u32, 24, 30, 1000, 1_000_000];
    let rate = match random.next() % 3 {
        0 => FrameRate::new(u64::from(random.pick(&frames)), 1001).unwrap(),
        1 => FrameRate::new(u64::from(random.pick(&frames)), 1).unwrap(),
        _ => {
            let length = (last - first).clamp(1e-9, 1e6);
            format!("{:.9}", random.between(1.0, 300.0) / length)
                .parse()
                .unwrap_or_else(|_| FrameRate::new(25, 1).unwrap())
        }
    };
    let count = random.pick(&[1.0, 2.0, 30.0, 300.0]);
    SampleTimes::rate(rate).between(start, start + count / rate.per_second())
}

/// Every sample of a poisoned output is a rotation, or the call is an error.
fn check_written(seed: u64, engines: &[Engine]) {
    let mut random = Random(seed);
    let set = any_set(&mut random);
    let frames = any_frames(&mut random, &set);
    let interpolation = Interpolation::from(random.pick(&METHODS))
        .with_before(random.pick(&MODES))
        .with_after(random.pick(&MODES));
    let layout = random.pick(&[Layout::TrackMajor, Layout::FrameMajor]);
    let span = set.time_span();
    let count = frames.resolve(set.track_count(), span).unwrap().len() * set.track_count();
    let mut all: Vec<(String, Vec<[f32; 4]>)> = Vec::new();
    for engine in engines {
        for keeps in [false, true] {
            let mut output = vec![POISON; count];
            let done = match keeps {
                false => engine.evaluate_into(&set, interpolation, &frames, layout, &mut output),
                true => engine
                    .upload(&set, interpolation)
                    .and_then(|clip| clip.evaluate_into(&frames, layout, &mut output)),
            };
            let label = format!(
                "seed {seed}, {interpolation:?}, {frames:?}, clip {keeps}, {}",
                engine.device_name()
            );
            if let Err(error) = done {
                // Not every method can close a loop or has a path for each pair of keys.
                let error = error.to_string();
                assert!(!error.contains("bug"), "{label}: {error}");
                continue;
            }
            for (sample, q) in output.iter().enumerate() {
                let norm = Quat::from_array(*q).as_dquat().length();
                assert!(
                    (norm - 1.0).abs() < 1e-5,
                    "{label}: sample {sample} is {q:?}"
                );
            }
            all.push((label, output));
        }
    }
    for pair in all.windows(2) {
        let [a, b] = [&pair[0].1, &pair[1].1].map(|result| bytemuck::cast_slice::<_, Quat>(result));
        assert_eq!(
            first_difference(a, b),
            None,
            "{} and {}",
            pair[0].0,
            pair[1].0
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, ..ProptestConfig::default() })]
    #[test]
    fn no_sample_is_left_unwritten_on_the_cpu(seed in any::<u64>()) {
        let engine = Engine::new(Device::Cpu).unwrap();
        check_written(seed, std::slice::from_ref(&engine));
    }
}

#[test]
fn no_sample_is_left_unwritten_on_a_device() {
    let mut engines = vulkan_engines(|_| {});
    engines.push(Engine::new(Device::Cpu).unwrap());
    for seed in 0..80u64 {
        check_written(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15), &engines);
    }
}

/// Keys that turn at 50 rad/s, one way and then the other.
fn fast_keys(count: usize) -> Vec<Quat> {
    let mut random = Random(11);
    let mut rotation = DQuat::IDENTITY;
    let keys = (0..count).map(|_| {
        let step = DQuat::from_axis_angle(random.direction(), 50.0 / 64.0);
        rotation = (rotation * step).normalize();
        rotation.as_quat()
    });
    keys.collect()
}

/// Units of a second in which times of the following tests are whole: 2^-20 of a frame's numerator.
const UNIT: f64 = (1 << 20) as f64;

/// At every base time from 0 to 1e12 s frames are as near to the textbook as at 0. Where frames lie is
/// computed apart, in whole numbers of 128 bits.
#[test]
fn accuracy_is_the_same_at_every_time() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let keys = fast_keys(40);
    let key_times: Vec<f64> = (0..40).map(|key| f64::from(key) / 64.0).collect();
    let rates = ["60", "1000", "24000/1001", "64"].map(|rate| rate.parse::<FrameRate>().unwrap());
    for base in [
        0.0, 1.0, -1000.0, 86_400.0, 3e6, 1e9, 1.7e9, -1.7e9, 1e10, 1e11, 1e12,
    ] {
        let times: Vec<f64> = key_times.iter().map(|key_time| base + key_time).collect();
        let mut set = TrackSet::new();
        set.push("", &times, &keys).unwrap();
        for (r, rate) in rates.into_iter().enumerate() {
            let numbers = rate.to_string();
            let (frames, seconds) = numbers.split_once('/').unwrap_or((&numbers, "1"));
            let [frames, seconds] = [frames, seconds].map(|text| text.parse::<i128>().unwrap());
            for (w, method) in [method::SLERP, method::BESSEL_OVERHAUSER, method::SQUAD]
                .into_iter()
                .enumerate()
            {
                let after = MODES[(r + w) % 3];
                let interpolation = Interpolation::from(method)
                    .with_after(after)
                    .with_before(after);
                // Samples from before the first key to after the last one.
                let start = base - 0.75 + 1.0 / 4096.0;
                let sampled = SampleTimes::rate(rate).between(start, start + 2.0);
                let found = engine.evaluate(&set, interpolation, &sampled).unwrap();
                let mut track = set.track(0);
                track.times = &key_times;
                let curve = ReferenceCurve::of(&method.into(), track);
                let unit = |seconds: f64| (seconds * UNIT) as i128 * frames;
                let length = unit(key_times[39]);
                for (k, q) in (0..).zip(found.as_quats()) {
                    let position = unit(start - base) + k * seconds * (1 << 20);
                    let wrapped = match after {
                        WrapMode::Loop => position.rem_euclid(length),
                        WrapMode::Mirror => {
                            let unfolded = position.rem_euclid(2 * length);
                            unfolded.min(2 * length - unfolded)
                        }
                        _ => position.clamp(0, length),
                    };
                    let seconds_in = wrapped as f64 / UNIT / frames as f64;
                    let off = angle_between(q.as_dquat(), curve.rotation(seconds_in));
                    assert!(
                        off < 1.1e-6,
                        "{method} at {base} s, {rate} fps, frame {k}, {after:?}: {off:e}"
                    );
                }
                let explicit: Vec<f64> = (0..500).map(|k| base + f64::from(k) / 1024.0).collect();
                if base.abs() < 1e12 {
                    let found = engine
                        .evaluate(&set, interpolation, &SampleTimes::at(explicit.clone()))
                        .unwrap();
                    for (time, q) in explicit.iter().zip(found.as_quats()) {
                        let off = angle_between(q.as_dquat(), curve.rotation(time - base));
                        assert!(off < 1.1e-6, "{method} at {time} s: {off:e}");
                    }
                }
            }
        }
    }
}

/// Curves that rotate far within an interval are divided at times that f64 can represent, and fitted
/// between these.
#[test]
fn curves_of_raw_unix_times_are_as_accurate_as_at_zero() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let keys = fast_keys(60);
    let methods = [
        method::SQUAD,
        method::SHOEMAKE,
        method::C2,
        method::CATMULL_ROM,
        method::BESSEL_OVERHAUSER,
        method::B_SPLINE,
    ];
    for (base, step) in [(1.7e9, 0.01), (1.7e9, 0.003), (-1.7e9, 0.01), (4e12, 0.3)] {
        let times: Vec<f64> = (0..60).map(|key| base + f64::from(key) * step).collect();
        let from_first: Vec<f64> = times.iter().map(|time| time - times[0]).collect();
        let mut set = TrackSet::new();
        set.push("", &times, &keys).unwrap();
        let samples: Vec<f64> = (0..5000)
            .map(|k| times[0] + (times[59] - times[0]) * f64::from(k) / 4999.0)
            .collect();
        let as_keyed = methods.map(|method| (method, Speed::AsKeyed));
        // Curves whose speed changes much, for which the reference integrates at each sample.
        let paced = [method::SQUAD, method::C2].map(|method| (method, Speed::Constant));
        for (method, speed) in as_keyed.into_iter().chain(paced) {
            let mut track = set.track(0);
            track.times = &from_first;
            let interpolation = Interpolation::from(method).with_speed(speed);
            let curve = ReferenceCurve::of(&interpolation, track);
            let found = engine.evaluate(&set, interpolation, &SampleTimes::at(samples.clone()));
            let each = if speed == Speed::Constant { 7 } else { 1 };
            let found = found.unwrap();
            for (time, q) in samples.iter().zip(found.as_quats()).step_by(each) {
                let off = angle_between(q.as_dquat(), curve.rotation(time - times[0]));
                assert!(
                    off < 1.1e-6,
                    "{method} at {time} s, {speed:?}, keys each {step} s: {off:e}"
                );
            }
        }
    }
}

/// A motion that is repeated for 1e12 s agrees with exact arithmetic.
#[test]
fn repeated_motion_is_as_accurate_far_out() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let keys = fast_keys(40);
    let times: Vec<f64> = (0..40).map(|key| f64::from(key) / 64.0).collect();
    let mut set = TrackSet::new();
    set.push("", &times, &keys).unwrap();
    let curve = ReferenceCurve::of(&method::BESSEL_OVERHAUSER.into(), set.track(0));
    let unit = |seconds: f64| (seconds * UNIT) as i128 * 1001;
    let length = unit(times[39]);
    for mode in [WrapMode::Loop, WrapMode::Mirror] {
        let interpolation = Interpolation::from(method::BESSEL_OVERHAUSER)
            .with_before(mode)
            .with_after(mode);
        for start in [10.0, 1e6 + 0.5, 1.7e9, -1.7e9, 1e12, -1e12] {
            let frames =
                SampleTimes::rate(FrameRate::new(1001, 2).unwrap()).between(start, start + 1.0);
            let found = engine.evaluate(&set, interpolation, &frames).unwrap();
            let mut compared = 0;
            for (k, q) in (0i128..).zip(found.as_quats()) {
                let position = unit(start) + k * 2 * (1 << 20);
                let seam = position.rem_euclid(length);
                if mode == WrapMode::Loop
                    && seam.min(length - seam) < unit(1e-9).max(1002)
                    && seam != 0
                {
                    continue; // it jumps there
                }
                let twice = position.rem_euclid(2 * length);
                let wrapped = if mode == WrapMode::Loop {
                    seam
                } else {
                    twice.min(2 * length - twice)
                };
                let expected = curve.rotation(wrapped as f64 / UNIT / 1001.0);
                let off = angle_between(q.as_dquat(), expected);
                assert!(off < 1.1e-6, "{mode:?} from {start} s, frame {k}: {off:e}");
                compared += 1;
            }
            assert!(compared > 450);
        }
    }
}

/// Seconds since 1970 of 0.24 µs a step: a frame at a key's time shows it, also where keys are held.
#[test]
fn frames_at_keys_of_unix_time_show_the_keys() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let rotation_at = |key: u32| Quat::from_rotation_z(0.01 * f64::from(key) as f32);
    let times: Vec<f64> = (0..200)
        .map(|key| 1.7e9 + 0.3 + f64::from(key) * 0.01)
        .collect();
    let keys: Vec<Quat> = (0..200).map(rotation_at).collect();
    let set = TrackSet::with_shared_times(&times, &keys).unwrap();
    let found = engine
        .evaluate(&set, method::STEP, &SampleTimes::fps(100))
        .unwrap();
    assert_eq!(found.as_quats(), keys);
    // A time that is after a key by more than its rounding is not at the key: here 1.2 µs are 6e-5
    // rad.
    let times: Vec<f64> = (0..200)
        .map(|key| 1.7e9 + 0.01 * f64::from(key) + 1.2e-6)
        .collect();
    let frames = SampleTimes::fps(1000).between(1.7e9, 1.7e9 + 1.9);
    let verified = |keys: &[Quat], method: Method| {
        let set = TrackSet::with_shared_times(&times, keys).unwrap();
        let found = verify(&engine, &set, method.into(), &frames).unwrap();
        assert!(
            found.max_error < 1e-6,
            "{method}: {:e} rad at {:?}",
            found.max_error,
            found.worst
        );
    };
    let slow: Vec<Quat> = (0..200).map(rotation_at).collect();
    METHODS
        .into_iter()
        .for_each(|method| verified(&slow, method));
    // 78 rad/s. Curves that are cut into pieces here are not as exact: pieces start at times in f64.
    for method in [method::SLERP, method::BESSEL_OVERHAUSER] {
        verified(&fast_keys(200), method);
    }
}

/// The velocity at the end of a track continues as long as f64 distinguishes the times.
#[test]
fn far_extrapolation_is_finite() {
    let mut set = TrackSet::new();
    let keys = [
        Quat::IDENTITY,
        Quat::from_rotation_x(1.0),
        Quat::from_rotation_y(0.5),
    ];
    set.push("", &[0.0, 4e-5, 1e-4], &keys).unwrap();
    let engine = Engine::new(Device::Cpu).unwrap();
    for before in MODES {
        for after in MODES {
            let interpolation = Interpolation::from(method::BESSEL_OVERHAUSER)
                .with_before(before)
                .with_after(after);
            for start in [1.7e9, -4e16, 4e16, 1e18, -1e18] {
                let frames = SampleTimes::fps(1000).between(start, start + 2.0);
                let mut output = vec![POISON; frames.resolve(1, None).unwrap().len()];
                engine
                    .evaluate_into(
                        &set,
                        interpolation,
                        &frames,
                        Layout::TrackMajor,
                        &mut output,
                    )
                    .unwrap();
                for q in output {
                    let vector = DVec3::new(q[0].into(), q[1].into(), q[2].into());
                    let norm = vector.length().hypot(q[3].into());
                    assert!(
                        (norm - 1.0).abs() < 1e-6,
                        "{before:?} {after:?} at {start}: {q:?}"
                    );
                }
            }
        }
    }
}

/// A curve depends on the ratios of its intervals, and a parameter is a ratio of seconds: keys and samples in another unit
/// have the same bits. Seconds below 2^-64 and reciprocals of seconds above 2^64 are 0 in f32, so that every sample was the
/// middle of its interval.
#[test]
fn the_unit_of_time_changes_no_bits() {
    let mut random = Random(64);
    let mut times = vec![0.0];
    for _ in 1..40 {
        times.push(times[times.len() - 1] + random.between(0.25, 2.0));
    }
    let keys: Vec<Vec<Quat>> = [0.02, 0.4, 3.0]
        .map(|step| {
            let mut rotation = random.rotation();
            let mut next = || {
                let angle = random.between(0.0, step);
                rotation *= DQuat::from_axis_angle(random.direction(), angle);
                rotation.normalize().as_quat()
            };
            times.iter().map(|_| next()).collect()
        })
        .to_vec();
    let points: Vec<Vec3> = (times.iter())
        .map(|_| (random.direction() * 3.0).as_vec3())
        .collect();
    let last = times[times.len() - 1];
    let samples: Vec<f64> = (0..300).map(|_| random.between(-0.5, last + 0.5)).collect();
    let in_unit = |unit: f64| {
        let scaled = |all: &[f64]| -> Vec<f64> { all.iter().map(|time| time * unit).collect() };
        let mut set = TrackSet::new();
        for (track, keys) in keys.iter().enumerate() {
            set.push("", &scaled(&times), keys).unwrap();
            set.set_translations(track, &scaled(&times), &points, &[])
                .unwrap();
        }
        // Every route: few samples straight from the keys, few intervals, batches.
        let counts = [2, 12, 300];
        (
            set,
            counts.map(|count| SampleTimes::at(scaled(&samples[..count]))),
        )
    };
    let evaluated = |engine: &Engine, unit: f64, interpolation: Interpolation| {
        let (set, frames) = in_unit(unit);
        let clip = engine.upload(&set, interpolation).unwrap();
        let mut all = Vec::new();
        for frames in &frames {
            let rotations = engine.evaluate(&set, interpolation, frames).unwrap();
            all.extend(rotations.as_quats().iter().map(Quat::to_array));
            let rotations = clip.evaluate(frames).unwrap();
            all.extend(rotations.as_quats().iter().map(Quat::to_array));
        }
        all
    };
    let moved = |engine: &Engine, unit: f64, method: VectorMethod, how: Interpolation| {
        let (set, frames) = in_unit(unit);
        let found = frames.map(|frames| {
            let channel = Channel::Translation;
            let found = engine.vectors(&set, channel, method, how, &frames, Layout::TrackMajor);
            found.unwrap().as_slice().to_vec()
        });
        found.concat()
    };
    let engine = Engine::new(Device::Cpu).unwrap();
    let units = [-120, -75, -64, -53, 53, 64, 75, 120].map(|power| 2f64.powi(power));
    let different: Vec<String> = METHODS
        .iter()
        .flat_map(|&method| [WrapMode::Hold, WrapMode::Loop].map(|wrap| (method, wrap)))
        .flat_map(|(method, wrap)| {
            let interpolation = Interpolation::from(method)
                .with_before(wrap)
                .with_after(wrap);
            let expected = evaluated(&engine, 1.0, interpolation);
            let is_other = |unit: &f64| evaluated(&engine, *unit, interpolation) != expected;
            let found: Vec<f64> = units.into_iter().filter(is_other).collect();
            (!found.is_empty()).then(|| format!("{method} {wrap:?}: {found:?}"))
        })
        .collect();
    assert!(different.is_empty(), "{}", different.join("\n"));
    for method in VectorMethod::ALL {
        let how = Interpolation::from(method::SLERP);
        let expected = moved(&engine, 1.0, method, how);
        for unit in units {
            let found = moved(&engine, unit, method, how);
            assert!(found == expected, "{method:?} {unit:e}");
        }
    }
    for device in vulkan_engines(|_| {}) {
        for method in [method::SLERP, method::SQUAD] {
            let expected = evaluated(&engine, 1.0, method.into());
            for unit in [2f64.powi(-75), 2f64.powi(75)] {
                let found = evaluated(&device, unit, method.into());
                assert!(
                    found == expected,
                    "{} {method} {unit:e}",
                    device.device_name()
                );
            }
        }
    }
}
