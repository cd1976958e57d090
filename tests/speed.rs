//! Curves at constant angular speed: the path stays the same, at even steps of its length.

use crate::support::{Random, first_difference, hostile_set, is_due, vulkan_devices};
use glam::{DQuat, Quat};
use tumble::reference::{ReferenceCurve, angle_between};
use tumble::{
    Axes, Device, Ends, Engine, Interpolation, METHODS, Quantity, SampleTimes, Speed, TrackSet,
    WrapMode, method,
};

fn set() -> TrackSet {
    let mut random = Random(1);
    let mut set = TrackSet::new();
    for _ in 0..4 {
        let mut rotation = random.rotation();
        let (mut times, mut keys) = (vec![0.3], vec![rotation.as_quat()]);
        for i in 1..9 {
            times.push(times[i - 1] + random.between(0.2, 1.5));
            let step = DQuat::from_axis_angle(random.direction(), random.between(0.2, 1.6));
            rotation = (rotation * step).normalize();
            keys.push(rotation.as_quat());
        }
        keys[4] = keys[3]; // a rest
        set.push("", &times, &keys).unwrap();
    }
    set.push("still", &[0.0, 1.0, 2.0], &[Quat::IDENTITY; 3])
        .unwrap();
    set
}

fn constant(method: tumble::Method) -> Interpolation {
    Interpolation::from(method).with_speed(Speed::Constant)
}

#[test]
fn rotations_are_where_the_reference_is() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let set = set();
    let frames = SampleTimes::fps(30);
    for method in METHODS {
        let interpolation = constant(method);
        let clip = engine.upload(&set, interpolation).unwrap();
        let timeline = clip.timeline(&frames).unwrap();
        let found = clip.evaluate(&frames).unwrap();
        let mut worst = 0.0f64;
        for (t, track) in set.tracks().enumerate() {
            let curve = ReferenceCurve::of(&interpolation, track);
            for s in 0..found.sample_count() {
                let expected = curve.rotation(timeline.time(t, s).unwrap());
                let off = angle_between(found.get(t, s).unwrap().as_dquat(), expected);
                worst = worst.max(off);
                assert!(off < 5e-6, "{method}, track {t}, sample {s}: {off:e}");
            }
        }
        println!("{method}: {worst:e}");
    }
}

/// Also where the reference does not look: between neighbouring frames every track turns
/// by the same angle.
#[test]
fn every_step_is_as_long() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let mut set = TrackSet::new();
    let mut random = Random(5);
    // Small steps: the arc between frames is as long as the chord.
    let keys: Vec<Quat> = (0..6)
        .map(|i| Quat::from_axis_angle(random.direction().as_vec3(), 0.2 * i as f32))
        .collect();
    set.push("", &[0.0, 0.1, 1.0, 1.5, 3.0, 4.0], &keys)
        .unwrap();
    // Curves without corners, which a step cuts.
    for method in [method::BESSEL_OVERHAUSER, method::C2, method::SQUAD] {
        let found = engine
            .evaluate(&set, constant(method), &SampleTimes::fps(500))
            .unwrap();
        let quats = found.as_quats();
        let steps: Vec<f64> = quats
            .windows(2)
            .map(|pair| angle_between(pair[0].as_dquat(), pair[1].as_dquat()))
            .collect();
        let mean = steps.iter().sum::<f64>() / steps.len() as f64;
        for step in &steps {
            assert!(
                (step / mean - 1.0).abs() < 0.01 + 4e-7 / mean,
                "{method}: {step} {mean}"
            );
        }
        let ends = [(quats[0], keys[0]), (quats[quats.len() - 1], keys[5])];
        for (found, key) in ends {
            assert_eq!(found.to_array(), key.to_array());
        }
    }
}

#[test]
fn velocities_have_one_length_and_go_on() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let set = set();
    let frames = SampleTimes::fps(20).between(-1.0, 12.0);
    for quantity in [
        Quantity::Velocity(Axes::Body),
        Quantity::Acceleration(Axes::Parent),
    ] {
        for method in [method::BESSEL_OVERHAUSER, method::B_SPLINE, method::SLERP] {
            let interpolation = constant(method)
                .with_quantity(quantity)
                .with_after(WrapMode::Extrapolate)
                .with_ends(Ends::Parabolic);
            let layout = tumble::Layout::TrackMajor;
            let found = engine.rates(&set, interpolation, &frames, layout).unwrap();
            for (t, track) in set.tracks().enumerate() {
                let curve = ReferenceCurve::of(&interpolation, track);
                let (first, last) = (track.times[0], track.times[track.times.len() - 1]);
                let speed = curve.velocity(0.5 * (first + last)).length();
                let bend = |i: i32| {
                    let part = f64::from(i) / 400.0;
                    curve.acceleration(first + (last - first) * part).length()
                };
                let largest = (1..400).map(bend).fold(1.0, f64::max);
                for s in 0..found.sample_count() {
                    let time = f64::from(s as u32) / 20.0 - 1.0;
                    let v = found.get(t, s).unwrap();
                    let v = glam::DVec3::new(v.x.into(), v.y.into(), v.z.into());
                    if time < first {
                        assert_eq!(v.length(), 0.0);
                    } else if matches!(quantity, Quantity::Velocity(_)) {
                        assert!(
                            (v.length() - speed).abs() < 2e-6 * (1.0 + speed),
                            "{method}: {v}"
                        );
                    } else if time > last {
                        assert!(v.length() < 1e-6);
                    } else {
                        let at = curve.acceleration(time);
                        let off = (v - curve.rotation(time) * at).length();
                        // At a key the acceleration jumps.
                        let jumps = |other: f64| {
                            (curve.acceleration(other) - at).length() > 0.05 * (1.0 + at.length())
                        };
                        let at_key = jumps(time - 1e-3) || jumps(time + 1e-3);
                        assert!(
                            off < 1e-6 * largest || at_key,
                            "{method}, {t} at {time}: {off:e}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn the_same_bits_on_every_device() {
    let cpu = Engine::new(Device::Cpu).unwrap();
    let devices = vulkan_devices().into_iter().map(Engine::new);
    let devices: Vec<Engine> = devices.collect::<Result<_, _>>().unwrap();
    let set = hostile_set(3, 6);
    let frames = SampleTimes::fps(30).between(-1.0, 30.0);
    for (round, method) in METHODS.into_iter().enumerate() {
        let interpolation = constant(method);
        let expected = cpu.evaluate(&set, interpolation, &frames).unwrap();
        for (index, q) in expected.as_quats().iter().enumerate() {
            let norm = q.as_dquat().length();
            assert!((norm - 1.0).abs() < 1e-6, "{method}, {index}: {q}");
        }
        // Only some devices, because preparing the curves for each takes long.
        for (i, vulkan) in devices.iter().enumerate() {
            if !is_due(round, i, devices.len()) {
                continue;
            }
            let found = vulkan.evaluate(&set, interpolation, &frames).unwrap();
            let difference = first_difference(expected.as_quats(), found.as_quats());
            assert_eq!(difference, None, "{method}, {}", vulkan.device_name());
        }
    }
}
