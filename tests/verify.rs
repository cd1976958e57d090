//! Results against the f64 reference, by the engine's own report.

use glam::Quat;
use tumble::reference::{Curve, angle_between};
use tumble::verify::{Verdict, error_bound, verify};
use tumble::{Device, Engine, Form, Frames, METHODS, TrackSet};

fn set() -> TrackSet {
    let mut set = TrackSet::new();
    let times = [0.0, 0.5, 2.0, 2.5];
    let keys = [0.0, 1.0, -0.4, 2.0].map(Quat::from_rotation_z);
    set.push("", &times, &keys).unwrap();
    let keys = keys.map(|key| key * Quat::from_rotation_x(1.2));
    set.push("", &times, &keys).unwrap();
    set
}

#[test]
fn the_cpu_is_within_its_bounds_and_says_that_no_device_took_part() {
    let engine = Engine::new(Device::Cpu).unwrap();
    for method in METHODS {
        let found = verify(&engine, &set(), method.into(), &Frames::fps(60)).unwrap();
        assert_eq!(found.verdict(), Verdict::ReferenceOnly, "{found:?}");
        assert!(!found.passes(), "no device took part");
        assert_eq!((found.device.as_deref(), found.rotations), (None, 2 * 151));
    }
}

/// A range without a sample, and a set without a track: a comparison of nothing is no pass.
#[test]
fn what_compared_nothing_has_not_passed() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let none = Frames::at(Vec::new());
    for (set, frames) in [(set(), none), (TrackSet::new(), Frames::fps(25))] {
        let found = verify(&engine, &set, METHODS[0].into(), &frames).unwrap();
        assert_eq!((found.rotations, found.verdict()), (0, Verdict::Nothing));
        assert!(!found.passes());
    }
    assert!(Verdict::Failed > Verdict::Nothing && Verdict::Nothing > Verdict::ReferenceOnly);
}

/// A key and its opposite half turn, there and back: where a definition has no bisector, the engine and
/// the reference choose alike.
#[test]
fn half_turns_there_and_back_are_within_their_bounds() {
    let engine = Engine::new(Device::Cpu).unwrap();
    for axis in [
        Quat::from_xyzw(1.0, 0.0, 0.0, 0.0),
        Quat::from_xyzw(0.0, 0.6, -0.8, 0.0),
    ] {
        for keys in [
            vec![Quat::IDENTITY, axis, Quat::IDENTITY],
            vec![axis, Quat::IDENTITY, axis, Quat::IDENTITY, -axis],
        ] {
            let mut set = TrackSet::new();
            let times: Vec<f64> = (0..keys.len()).map(|i| i as f64).collect();
            set.push("", &times, &keys).unwrap();
            // Between two inner half turns squad's controls are opposite to each other: it has no arc.
            let is_meant = |name: &str| keys.len() == 3 || name.starts_with("shoemake");
            for method in METHODS.into_iter().filter(|method| is_meant(method.name)) {
                let found = verify(&engine, &set, method.into(), &Frames::fps(25)).unwrap();
                assert_eq!(
                    found.verdict(),
                    Verdict::ReferenceOnly,
                    "{method}: {found:?}"
                );
            }
        }
    }
}

/// Where every sample is a key, rates may be 0 at all samples, and large between them.
#[test]
fn samples_on_keys_are_within_their_bounds() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let times: Vec<f64> = (0..8).map(|k| f64::from(k) / 25.0).collect();
    let mut set = TrackSet::new();
    let angles = [0.0, 0.01, 0.05, 0.02, 0.02, -0.1, -0.05, 0.0];
    set.push("", &times, &angles.map(Quat::from_rotation_x))
        .unwrap();
    for method in METHODS {
        let found = verify(&engine, &set, method.into(), &Frames::fps(25)).unwrap();
        assert_eq!(found.verdict(), Verdict::ReferenceOnly, "{found:?}");
    }
}

/// A track of more intervals than are prepared at once. Catches a part that ignores the signs of the
/// keys before it, and lanes that mix up parts.
#[test]
fn a_long_track_is_within_its_bounds_in_all_its_parts() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let count = 3 * 4096 + 17;
    let times: Vec<f64> = (0..count)
        .map(|i| f64::from(i) + 0.3 * f64::from(i % 3))
        .collect();
    let key = |i: i32| {
        let key = Quat::from_rotation_y(i as f32 * 0.7) * Quat::from_rotation_x(i as f32);
        if i * i % 7 == 2 { -key } else { key }
    };
    let keys: Vec<Quat> = (0..count).map(key).collect();
    let mut set = TrackSet::new();
    set.push("", &times, &keys).unwrap();
    let frames: Vec<f64> = (0..30_000).map(|k| f64::from(k) * 0.517).collect();
    for method in METHODS {
        let found = engine.upload(&set, method).unwrap();
        let found = found.evaluate(&Frames::at(frames.clone())).unwrap();
        let curve = Curve::of(&method.into(), set.track(0));
        let errors = (frames.iter().zip(found.as_quats()))
            .map(|(&time, found)| angle_between(curve.rotation(time), found.as_dquat()));
        let error = errors.fold(0.0, f64::max);
        assert!(error < error_bound(Form::Polynomial), "{method}: {error:e}");
    }
}

/// Wherever the tests run: a small job goes to the CPU, a large one never to a device that is one.
#[test]
fn nothing_slower_than_the_cpu_is_chosen() {
    let small = Engine::auto_for(2000).unwrap();
    assert!(small.device_info().is_none());
    let large = Engine::auto().unwrap();
    let is_software = |info: &tumble::DeviceInfo| info.kind == tumble::DeviceKind::Cpu;
    assert!(!large.device_info().is_some_and(is_software));
    assert!(small.probe_time().unwrap() > std::time::Duration::ZERO);
}
