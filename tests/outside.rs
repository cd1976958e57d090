//! Before the first key and after the last one: held, repeated, mirrored, or extrapolated.

use crate::support::{Random, first_difference, give_key_data, round_robin, vulkan_engines};
use glam::{DQuat, DVec3, Quat};
use tumble::reference::{ReferenceCurve, angle_between};
use tumble::{
    Axes, Device, Engine, Interpolation, Layout, METHODS, Quantity, SampleTimes, Track, TrackSet,
    WrapMode, method,
};

const ALL: [WrapMode; 4] = [
    WrapMode::Hold,
    WrapMode::Loop,
    WrapMode::Mirror,
    WrapMode::Extrapolate,
];

fn set(seed: u64, keys: usize) -> TrackSet {
    let mut random = Random(seed);
    let mut set = TrackSet::new();
    for track in 0..9 {
        let (mut times, mut quats) = (Vec::new(), Vec::new());
        let (mut time, mut rotation) = (random.between(-1.0, 1.0), random.rotation());
        // Tracks have one, two and more keys, some of which are at whole frames.
        for _ in 0..[1, 2, 3, keys][track.min(3)] {
            times.push(time);
            quats.push(rotation.as_quat());
            time += if track % 2 == 0 {
                0.4
            } else {
                random.between(0.2, 0.9)
            };
            let step = DQuat::from_axis_angle(random.direction(), random.between(0.0, 1.5));
            rotation = (rotation * step).normalize();
        }
        set.push("", &times, &quats).unwrap();
    }
    give_key_data(&mut set, seed);
    set
}

/// The reference's rotation, with the wrap modes as the documentation defines them.
fn expected(curve: &ReferenceCurve, track: Track, sides: [WrapMode; 2], time: f64) -> DQuat {
    let (first, last) = (track.times[0], track.times[track.times.len() - 1]);
    let length = last - first;
    let side = if time < first { sides[0] } else { sides[1] };
    if (first..=last).contains(&time) && !(time == last && side == WrapMode::Loop) || length == 0.0
    {
        return curve.rotation(time);
    }
    match side {
        WrapMode::Hold => curve.rotation(time),
        WrapMode::Loop => curve.rotation(first + (time - first).rem_euclid(length)),
        WrapMode::Mirror => {
            let offset = (time - first).rem_euclid(2.0 * length);
            curve.rotation(
                first
                    + if offset > length {
                        2.0 * length - offset
                    } else {
                        offset
                    },
            )
        }
        WrapMode::Extrapolate => {
            let end = time.clamp(first, last);
            let velocity: DVec3 = curve.velocity(end);
            curve.rotation(end) * DQuat::from_scaled_axis(velocity * (time - end))
        }
        other => panic!("the formula of {other} is missing"),
    }
}

#[test]
fn outside_is_what_the_words_say() {
    let set = set(1, 11);
    let engine = Engine::new(Device::Cpu).unwrap();
    let mut random = Random(3);
    let times: Vec<f64> = (0..300).map(|_| random.between(-14.0, 16.0)).collect();
    for method in METHODS {
        for before in ALL {
            for after in ALL {
                let interpolation = Interpolation::from(method)
                    .with_before(before)
                    .with_after(after);
                for frames in [
                    SampleTimes::fps(24).between(-12.0, 14.0),
                    SampleTimes::at(times.clone()),
                ] {
                    let clip = engine.upload(&set, interpolation).unwrap();
                    let timeline = clip.timeline(&frames).unwrap();
                    let found = clip.evaluate(&frames).unwrap();
                    for (t, track) in set.tracks().enumerate() {
                        let curve = ReferenceCurve::of(&interpolation, track);
                        let steps = method == method::STEP;
                        for s in 0..found.sample_count() {
                            let time = timeline.time(t, s).unwrap();
                            if (steps || before == WrapMode::Loop || after == WrapMode::Loop)
                                && near_a_seam(track, time)
                            {
                                continue; // it jumps there
                            }
                            let expected = expected(&curve, track, [before, after], time);
                            let off = angle_between(found.get(t, s).unwrap().as_dquat(), expected);
                            assert!(
                                off < 1.2e-6,
                                "{method}, {before:?} {after:?}, track {t} at {time}: {off:e}"
                            );
                        }
                    }
                }
            }
        }
    }
}

/// Whether rounding decides on which side of a jump a time is.
fn near_a_seam(track: Track, time: f64) -> bool {
    let (first, last) = (track.times[0], track.times[track.times.len() - 1]);
    let length = (last - first).max(1e-300);
    track.times.iter().any(|key| {
        [time - key, time + key - 2.0 * first]
            .iter()
            .any(|distance| {
                let offset = distance.rem_euclid(length);
                offset < 1e-9 || length - offset < 1e-9
            })
    })
}

#[test]
fn the_same_bits_on_every_device_however_it_is_cut() {
    // Also a track so long that it is prepared in pieces.
    let mut long = set(5, 40);
    let mut random = Random(9);
    let times: Vec<f64> = (0..9000).map(|i| 0.01 * f64::from(i)).collect();
    let keys: Vec<Quat> = times.iter().map(|_| random.rotation().as_quat()).collect();
    long.push("long", &times, &keys).unwrap();
    let explicit = (0..400).map(|i| 0.7 * f64::from(i) - 120.0).collect();
    let cpu = Engine::new(Device::Cpu).unwrap();
    let memory = [None, Some(50_000)].into_iter();
    let of_memory = |memory| vulkan_engines(|options| options.memory = memory);
    let engines: Vec<Engine> = memory.flat_map(of_memory).collect();
    let mut round = 0;
    for frames in [
        SampleTimes::fps(12).between(-130.0, 200.0),
        SampleTimes::at(explicit),
    ] {
        for method in [method::SLERP, method::BESSEL_OVERHAUSER, method::B_SPLINE] {
            for [before, after] in [
                [WrapMode::Loop, WrapMode::Mirror],
                [WrapMode::Mirror, WrapMode::Loop],
                [WrapMode::Extrapolate, WrapMode::Loop],
                [WrapMode::Hold, WrapMode::Extrapolate],
            ] {
                let interpolation = Interpolation::from(method)
                    .with_before(before)
                    .with_after(after);
                let expected = cpu.evaluate(&long, interpolation, &frames).unwrap();
                let mut streamed = Vec::new();
                let layout = Layout::TrackMajor;
                cpu.request(&long, interpolation, &frames)
                    .layout(layout)
                    .stream(1000, |chunk| {
                        streamed.extend_from_slice(chunk.rotations().unwrap());
                        Ok::<(), tumble::Error>(())
                    })
                    .unwrap();
                let label = format!("{method}, {before:?} {after:?}");
                assert_eq!(
                    first_difference(expected.as_quats(), &streamed),
                    None,
                    "{label}"
                );
                // Each kind of frames has twelve cases.
                for engine in round_robin(&engines, round + round / 12) {
                    let found = engine.evaluate(&long, interpolation, &frames).unwrap();
                    let difference = first_difference(expected.as_quats(), found.as_quats());
                    assert_eq!(difference, None, "{label}, {}", engine.device_name());
                }
                round += 1;
            }
        }
    }
}

/// `SciPy`, `scipy/spatial/transform/tests/test_rotation_spline.py` (BSD-3-Clause): two keys
/// are slerp, extended outside of them too, and turn at a constant rate.
#[test]
fn two_keys_go_on_turning() {
    let [x, y, z] = [10.0, -20.0, 30.0].map(f64::to_radians);
    let end = DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y) * DQuat::from_rotation_x(x);
    let mut set = TrackSet::new();
    let keys = [Quat::IDENTITY, end.as_quat()];
    set.push("", &[0.0, 10.0], &keys).unwrap();
    let engine = Engine::new(Device::Cpu).unwrap();
    let at = [-1.0, 5.0, 12.0];
    for quantity in [Quantity::Rotation, Quantity::Velocity(Axes::Body)] {
        let interpolation = Interpolation::from(method::C2)
            .with_before(WrapMode::Extrapolate)
            .with_after(WrapMode::Extrapolate)
            .with_quantity(quantity);
        let frames = SampleTimes::at(at.to_vec());
        let mut found = [[0.0; 4]; 3];
        let layout = Layout::TrackMajor;
        engine
            .evaluate_into(&set, interpolation, &frames, layout, &mut found)
            .unwrap();
        for (q, time) in found.map(Quat::from_array).into_iter().zip(at) {
            let velocity = end.to_scaled_axis() / 10.0;
            let off = match quantity {
                Quantity::Rotation => {
                    angle_between(q.as_dquat(), DQuat::from_scaled_axis(velocity * time))
                }
                _ => (DVec3::new(q.x.into(), q.y.into(), q.z.into()) - velocity).length(),
            };
            assert!(off < 3e-7, "{quantity:?} at {time}: {off:e}");
        }
    }
    let mirrored = Interpolation::from(method::C2)
        .with_after(WrapMode::Mirror)
        .with_quantity(Quantity::Velocity(Axes::Body));
    let refused = engine
        .rates(&set, mirrored, &SampleTimes::fps(1), Layout::TrackMajor)
        .unwrap_err();
    assert_eq!(
        refused.to_string(),
        "velocities cannot be mirrored; hold, loop or extrapolate them"
    );
}

/// However far away, a repeated or extrapolated motion consists of rotations. (Found by fuzzing.)
#[test]
fn times_beyond_counting_give_rotations() {
    let set = set(3, 6);
    let distant = [1e16, 1e39, 1e300, f64::MAX];
    let times: Vec<f64> = distant.iter().flat_map(|&time| [time, -time]).collect();
    let engine = Engine::new(Device::Cpu).unwrap();
    for method in METHODS {
        for outside in ALL {
            let interpolation = Interpolation::from(method)
                .with_before(outside)
                .with_after(outside);
            let frames = SampleTimes::at(times.clone());
            let rotations = engine.evaluate(&set, interpolation, &frames).unwrap();
            for q in rotations.as_quats() {
                let norm = q.as_dquat().length();
                assert!((norm - 1.0).abs() < 1e-6, "{method}, {outside:?}: {q}");
            }
        }
    }
}

/// Turns of nearly 360° within a nanosecond, as authored: c2's iteration diverges, and the result
/// is its curve without the bends. (Found by fuzzing.)
#[test]
fn wild_turns_as_authored_give_rotations() {
    let mut set = TrackSet::new();
    let still = Quat::IDENTITY;
    let opposite = Quat::from_xyzw(-0.002_937_95, -0.003_484_545, -0.000_204_973, -0.999_989_6);
    let times: Vec<f64> = [3.6]
        .into_iter()
        .chain((0..7).map(|i| 5.7 + f64::from(i) * 1e-9))
        .collect();
    let keys = [still, opposite, still, still, still, still, still, still];
    set.push("", &times, &keys).unwrap();
    let engine = Engine::new(Device::Cpu).unwrap();
    for method in METHODS {
        let interpolation = Interpolation::from(method)
            .with_signs(method.signs.unwrap_or(tumble::KeySigns::AsAuthored));
        let rotations = engine
            .evaluate(&set, interpolation, &SampleTimes::fps(100))
            .unwrap();
        for q in rotations.as_quats() {
            let norm = q.as_dquat().length();
            assert!((norm - 1.0).abs() < 1e-6, "{method}: {q}");
        }
    }
}
