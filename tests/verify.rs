//! Results against the f64 reference, by the engine's own report.

use glam::Quat;
use tumble::method::SLERP;
use tumble::reference::{ReferenceCurve, angle_between};
use tumble::verify::{Agreement, Verdict, compare, error_bound, verify};
use tumble::{Device, Ends, Engine, Interpolation, METHODS, SampleTimes, TrackSet, method::Form};

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
        let found = verify(&engine, &set(), method.into(), &SampleTimes::fps(60)).unwrap();
        assert_eq!(found.verdict(), Verdict::ReferenceOnly, "{found:?}");
        assert!(!found.passes(), "no device took part");
        assert_eq!((found.device.as_deref(), found.rotations), (None, 2 * 151));
    }
}

/// A range without a sample, or a set without a track, is not a pass: nothing was compared.
#[test]
fn what_compared_nothing_has_not_passed() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let none = SampleTimes::at(Vec::new());
    for (set, frames) in [(set(), none), (TrackSet::new(), SampleTimes::fps(25))] {
        let found = verify(&engine, &set, METHODS[0].into(), &frames).unwrap();
        assert_eq!((found.rotations, found.verdict()), (0, Verdict::Nothing));
        assert!(!found.passes());
    }
    assert!(Verdict::Failed > Verdict::Nothing && Verdict::Nothing > Verdict::ReferenceOnly);
}

/// Results of other programs: the engine's bits, the other sign of one, glam's slerp, a wrong one, NaN and none.
#[test]
fn results_of_others_are_told_apart() {
    let (set, frames) = (set(), SampleTimes::fps(60));
    let engine = Engine::new(Device::Cpu).unwrap();
    let same = engine.evaluate(&set, SLERP, &frames).unwrap();
    let found = |theirs: &[Quat]| compare(&set, SLERP.into(), &frames, theirs).unwrap();
    let exact = found(same.as_quats());
    assert_eq!(
        (exact.agreement(), exact.rotations, exact.differing),
        (Agreement::SameBits, 302, 0)
    );
    assert_eq!(exact.max_error, exact.engine_error);

    let with = |index: usize, other: Quat| {
        let mut theirs = same.as_quats().to_vec();
        theirs[index] = other;
        found(&theirs)
    };
    let signed = with(160, -same.as_quats()[160]);
    assert_eq!((signed.differing, signed.of_other_sign), (1, 1));
    assert_eq!(signed.agreement(), Agreement::WithinBounds);
    let first = signed.first_difference.unwrap();
    assert_eq!((first.track, first.frame), (1, 9));

    let wrong = with(31, Quat::from_rotation_x(0.5));
    assert_eq!(wrong.agreement(), Agreement::OutsideBounds);
    assert_eq!(
        wrong.worst.map(|worst| (worst.track, worst.frame)),
        Some((0, 31))
    );
    assert!(wrong.to_string().contains("track 0, frame 31"), "{wrong}");
    assert_eq!(with(0, Quat::NAN).agreement(), Agreement::OutsideBounds);
    let long = with(7, same.as_quats()[7] * 1.001);
    assert_eq!(long.agreement(), Agreement::OutsideBounds, "{long}");

    let none = compare(
        &set,
        SLERP.into(),
        &SampleTimes::at(Vec::new()),
        &[[0f32; 4]; 0],
    )
    .unwrap();
    assert_eq!((none.agreement(), none.rotations), (Agreement::Nothing, 0));
    let error = compare(&set, SLERP.into(), &frames, &same.as_quats()[1..]).unwrap_err();
    assert!(error.to_string().contains("301"), "{error}");
    assert!(
        Agreement::OutsideBounds > Agreement::Nothing
            && Agreement::Nothing > Agreement::WithinBounds
    );
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
            // Between two inner rotations by 180°, squad's controls are opposite, so there is no arc.
            let is_meant = |name: &str| keys.len() == 3 || name.starts_with("shoemake");
            for method in METHODS.into_iter().filter(|method| is_meant(method.name)) {
                let found = verify(&engine, &set, method.into(), &SampleTimes::fps(25)).unwrap();
                assert_eq!(
                    found.verdict(),
                    Verdict::ReferenceOnly,
                    "{method}: {found:?}"
                );
            }
        }
    }
}

/// Between far keys and two that are a thousandth of a second apart, curves turn hundreds of times within an interval.
/// Catches derivatives of the reference by differences, whose step is then too long.
#[test]
fn rates_between_uneven_keys_are_within_their_bounds() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let mut set = TrackSet::new();
    let outer = [[0.1, -0.7, 0.4, 0.6], [0.5, 0.5, -0.5, 0.5]].map(Quat::from_array);
    let inner = [[-0.3, 0.2, 0.9, 0.1], [0.6, 0.3, 0.1, -0.7]].map(Quat::from_array);
    let keys = [outer[0], inner[0], inner[1], outer[1]].map(Quat::normalize);
    set.push("far", &[0.0, 0.5, 0.501, 1.0], &keys).unwrap();
    let angles = [0.0, 0.8, 0.801, 0.2].map(Quat::from_rotation_y);
    set.push("near", &[0.0, 0.5, 0.501, 1.0], &angles).unwrap();
    for method in METHODS {
        for ends in [method.ends, Ends::Natural] {
            let interpolation = Interpolation::from(method).with_ends(ends);
            let found = verify(&engine, &set, interpolation, &SampleTimes::fps(25)).unwrap();
            assert_eq!(found.verdict(), Verdict::ReferenceOnly, "{found:?}");
        }
    }
}

/// If every sample is at a key, velocities may be 0 at all samples and large between them.
#[test]
fn samples_on_keys_are_within_their_bounds() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let times: Vec<f64> = (0..8).map(|k| f64::from(k) / 25.0).collect();
    let mut set = TrackSet::new();
    let angles = [0.0, 0.01, 0.05, 0.02, 0.02, -0.1, -0.05, 0.0];
    set.push("", &times, &angles.map(Quat::from_rotation_x))
        .unwrap();
    for method in METHODS {
        let found = verify(&engine, &set, method.into(), &SampleTimes::fps(25)).unwrap();
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
        let found = found.evaluate(&SampleTimes::at(frames.clone())).unwrap();
        let curve = ReferenceCurve::of(&method.into(), set.track(0));
        let errors = (frames.iter().zip(found.as_quats()))
            .map(|(&time, found)| angle_between(curve.rotation(time), found.as_dquat()));
        let error = errors.fold(0.0, f64::max);
        assert!(error < error_bound(Form::Polynomial), "{method}: {error:e}");
    }
}

/// On every machine, a small job is done by the CPU, and a large one never by a software device.
#[test]
fn nothing_slower_than_the_cpu_is_chosen() {
    let small = Engine::auto_for(2000).unwrap();
    assert!(small.device_info().is_none());
    let large = Engine::auto().unwrap();
    let is_software =
        |info: &tumble::vulkan::DeviceInfo| info.kind == tumble::vulkan::DeviceKind::Cpu;
    assert!(!large.device_info().is_some_and(is_software));
    assert!(small.probe_time().unwrap() > std::time::Duration::ZERO);
}
