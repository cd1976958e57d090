//! Angular velocities and accelerations: the derivatives of the formulas, near the
//! reference's and with the same bits on every device.

use crate::method_lists::{Column, assert_stated};
use crate::support::{
    Random, first_difference, give_key_data, hostile_set, round_robin, vulkan_engines,
};
use glam::{DQuat, DVec3, Quat};
use tumble::reference::ReferenceCurve;
use tumble::verify::RATE_BOUND;
use tumble::{
    Axes, Device, Ends, Engine, Error, Interpolation, Layout, METHODS, Quantity, SampleTimes,
    Track, TrackSet, method,
};

const QUANTITIES: [Quantity; 4] = [
    Quantity::Velocity(Axes::Body),
    Quantity::Velocity(Axes::Parent),
    Quantity::Acceleration(Axes::Body),
    Quantity::Acceleration(Axes::Parent),
];

fn set(seed: u64, step: f64) -> TrackSet {
    let mut random = Random(seed);
    let mut set = TrackSet::new();
    for _ in 0..12 {
        let (mut times, mut keys) = (Vec::new(), Vec::new());
        let (mut time, mut rotation) = (random.between(0.0, 1.0), random.rotation());
        for _ in 0..12 {
            times.push(time);
            keys.push(rotation.as_quat());
            time += random.between(0.3, 1.3);
            let rotation_step =
                DQuat::from_axis_angle(random.direction(), random.between(0.0, step));
            rotation = (rotation * rotation_step).normalize();
        }
        set.push("", &times, &keys).unwrap();
    }
    give_key_data(&mut set, seed);
    set
}

fn expected(curve: &ReferenceCurve, quantity: Quantity, time: f64) -> DVec3 {
    let (body, axes) = match quantity {
        Quantity::Velocity(axes) => (curve.velocity(time), axes),
        Quantity::Acceleration(axes) => (curve.acceleration(time), axes),
        _ => unreachable!(),
    };
    match axes {
        Axes::Body => body,
        Axes::Parent => curve.rotation(time) * body,
    }
}

/// The largest error, in parts of the largest value within the same key interval.
fn largest_error(set: &TrackSet, interpolation: Interpolation, frames: &SampleTimes) -> f64 {
    let engine = Engine::new(Device::Cpu).unwrap();
    let clip = engine.upload(set, interpolation).unwrap();
    let timeline = clip.timeline(frames).unwrap();
    let found = clip.rates(frames, Layout::TrackMajor).unwrap();
    assert!(found.as_slice().iter().all(|vector| vector.w == 0.0));
    let mut largest = 0.0f64;
    for (t, track) in set.tracks().enumerate() {
        let curve = ReferenceCurve::of(&interpolation, track);
        let mut scales = vec![None; track.times.len() + 1];
        for s in 0..found.sample_count() {
            let time = timeline.time(t, s).unwrap();
            let found = found.get(t, s).unwrap().as_dvec3();
            assert!(found.is_finite());
            let error = (found - expected(&curve, interpolation.quantity, time)).length();
            let interval = track.times.partition_point(|&key| key <= time);
            let scale = scales[interval]
                .get_or_insert_with(|| scale(&curve, track, interpolation.quantity, interval));
            largest = largest.max(error / *scale);
        }
    }
    largest
}

/// The largest value in the interval before key `i`; before the first key and behind the last one
/// nothing moves.
fn scale(curve: &ReferenceCurve, track: Track, quantity: Quantity, i: usize) -> f64 {
    let Some((from, to)) = i
        .checked_sub(1)
        .map(|i| track.times[i])
        .zip(track.times.get(i))
    else {
        return 1e-3;
    };
    let value = |k| {
        let at = from + (to - from) * (0.02 + 0.96 * f64::from(k) / 8.0);
        expected(curve, quantity, at).length()
    };
    (0..=8).map(value).fold(1e-3, f64::max)
}

#[test]
fn velocities_and_accelerations_are_those_of_the_reference() {
    let set = set(1, 2.0);
    let mut random = Random(4);
    let times = (0..400).map(|_| random.between(-1.0, 16.0)).collect();
    for frames in [SampleTimes::fps(30), SampleTimes::at(times)] {
        for method in METHODS {
            for quantity in QUANTITIES {
                let interpolation = Interpolation::from(method).with_quantity(quantity);
                let error = largest_error(&set, interpolation, &frames);
                println!("{method}, {quantity:?}: {error:e}");
                assert!(error < RATE_BOUND, "{method}, {quantity:?}: {error:e}");
                let column = match quantity {
                    Quantity::Acceleration(_) => Column::Acceleration,
                    _ => Column::Velocity,
                };
                assert_stated(method, column, error);
            }
        }
    }
}

#[test]
fn ends_move_as_they_are_told() {
    let set = set(2, 1.5);
    let spin = DVec3::new(1.0, -2.0, 0.5);
    let clamped = Ends::Clamped {
        start: spin,
        end: -spin,
    };
    for method in METHODS {
        for ends in [Ends::Natural, Ends::Secant, Ends::Frozen, clamped] {
            let interpolation = Interpolation::from(method)
                .with_quantity(Quantity::Velocity(Axes::Body))
                .with_ends(ends);
            let error = largest_error(&set, interpolation, &SampleTimes::fps(24));
            assert!(error < RATE_BOUND, "{method}, {ends:?}: {error:e}");
        }
    }
}

#[test]
fn the_same_bits_on_every_device() {
    let cpu = Engine::new(Device::Cpu).unwrap();
    let engines = vulkan_engines(|_| {});
    for seed in 0..2 {
        let set = hostile_set(seed, 48);
        let frames = SampleTimes::fps(30).between(-1.0, 20.0);
        for (i, method) in METHODS.into_iter().enumerate() {
            for (j, quantity) in QUANTITIES.into_iter().enumerate() {
                let interpolation = Interpolation::from(method).with_quantity(quantity);
                let layout = Layout::TrackMajor;
                let expected = cpu.rates(&set, interpolation, &frames, layout).unwrap();
                let expected: &[Quat] = bytemuck::cast_slice(expected.as_slice());
                assert!(expected.iter().all(|q| q.is_finite()));
                for vulkan in round_robin(&engines, seed as usize + i + j) {
                    let found = vulkan.rates(&set, interpolation, &frames, layout).unwrap();
                    let found: &[Quat] = bytemuck::cast_slice(found.as_slice());
                    let difference = first_difference(expected, found);
                    assert_eq!(difference, None, "{method}, {quantity:?}, seed {seed}");
                }
            }
        }
    }
}

/// The last key's velocity is that with which it is reached; behind it nothing moves.
#[test]
fn a_door_turns_until_its_last_key() {
    let mut set = TrackSet::new();
    let keys = [0.0, 1.0, 3.0].map(Quat::from_rotation_y);
    set.push("door", &[0.0, 1.0, 2.0], &keys).unwrap();
    set.push("wall", &[0.5], &keys[..1]).unwrap();
    let engine = Engine::new(Device::Cpu).unwrap();
    let velocity =
        Interpolation::from(method::SLERP).with_quantity(Quantity::Velocity(Axes::Parent));
    let frames = SampleTimes::fps(2).between(-1.0, 3.0);
    let times = SampleTimes::at((-2..=6).map(|i| f64::from(i) * 0.5).collect());
    for frames in [frames, times] {
        let layout = Layout::TrackMajor;
        let found = engine.rates(&set, velocity, &frames, layout).unwrap();
        let speeds: Vec<f32> = found.as_slice()[..9].iter().map(|v| v.y).collect();
        let expected = [0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0, 0.0, 0.0];
        for (found, expected) in speeds.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{speeds:?}");
        }
        assert!(
            found.as_slice()[9..]
                .iter()
                .all(|v| v.to_array() == [0.0; 4])
        );
        let refused = engine.rates(&set, method::SLERP.into(), &frames, layout);
        assert!(matches!(refused, Err(Error::NotRates)));
    }
}
