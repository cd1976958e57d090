//! Scalars agree with the textbook, with the same bits on every device.

use glam::DVec3;
use tumble::reference::VectorCurve;
use tumble::{
    Channel, Device, Ends, Engine, Interpolation, Layout, SampleTimes, ScalarQuantity, Scalars,
    TrackError, TrackSet, VectorMethod, WrapMode, method,
};

use crate::support::{Random, vulkan_engines};

struct Case {
    set: TrackSet,
    curves: Vec<VectorCurve>,
}

/// Scalars, some of which share their key times and some of which have tangents, so that packs have every size.
fn case(seed: u64, scalars: usize) -> Case {
    let mut random = Random(seed);
    let mut set = TrackSet::new();
    let mut curves: Vec<VectorCurve> = Vec::new();
    for i in 0..scalars {
        let count = 1 + i % 7;
        let mut time = random.between(-1.0, 1.0);
        let new_times = (0..count).map(|_| {
            time += random.between(0.1, 2.0);
            time
        });
        let new_times: Vec<f64> = new_times.collect();
        let times = match curves.last() {
            Some(before) if i % 5 != 0 => before.times.clone(),
            _ => new_times,
        };
        let number = |random: &mut Random| random.between(-3.0, 3.0) as f32;
        let keys: Vec<f32> = times.iter().map(|_| number(&mut random)).collect();
        let tangents: Vec<[f32; 2]> = match i % 4 {
            3 => Vec::new(),
            _ => (times.iter())
                .map(|_| [number(&mut random), number(&mut random)])
                .collect(),
        };
        let index = set.push_scalar(format!("s{i}"), &times, &keys, &tangents);
        assert_eq!(index, Ok(i));
        let vector = |x: f32| DVec3::new(x.into(), 0.0, 0.0);
        curves.push(VectorCurve {
            method: "",
            ends: Ends::Parabolic,
            times,
            keys: keys.iter().map(|&key| vector(key)).collect(),
            tangents: tangents.iter().map(|both| both.map(vector)).collect(),
        });
    }
    Case { set, curves }
}

fn evaluate(
    engine: &Engine,
    set: &TrackSet,
    quantity: ScalarQuantity,
    how: VectorMethod,
    interpolation: Interpolation,
    frames: &SampleTimes,
) -> Scalars {
    let layout = Layout::TrackMajor;
    engine
        .scalars(set, quantity, how, interpolation, frames, layout)
        .unwrap()
}

fn expected(curve: &VectorCurve, quantity: ScalarQuantity, time: f64) -> f64 {
    match quantity {
        ScalarQuantity::Value => curve.value(time).x,
        ScalarQuantity::Velocity => curve.derivatives(time)[0].x,
        ScalarQuantity::Acceleration => curve.derivatives(time)[1].x,
        other => panic!("the formula of {other} is missing"),
    }
}

#[test]
fn scalars_and_their_rates_are_the_textbook_s() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let Case { set, curves } = case(1, 40);
    for how in VectorMethod::ALL {
        for ends in [Ends::Parabolic, Ends::Natural, Ends::Secant, Ends::Frozen] {
            let interpolation = Interpolation::from(method::SLERP).with_ends(ends);
            for frames in [
                SampleTimes::fps(24),
                SampleTimes::at((-20..260).map(|i| 0.05 * f64::from(i)).collect()),
            ] {
                let timeline = frames.resolve(40, set.time_span()).unwrap();
                for quantity in ScalarQuantity::ALL {
                    let found = evaluate(&engine, &set, quantity, how, interpolation, &frames);
                    for (i, curve) in curves.iter().enumerate() {
                        let curve = VectorCurve {
                            method: how.name(),
                            ends,
                            ..curve.clone()
                        };
                        let samples: Vec<(f64, f64)> = (0..timeline.len())
                            .map(|sample| timeline.time(i, sample).unwrap())
                            .enumerate()
                            // On a key rounding may decide on which side of a jump it lies.
                            .filter(|(_, time)| {
                                curve.times.iter().all(|key| (key - time).abs() > 1e-9)
                            })
                            .map(|(sample, time)| {
                                let value = f64::from(found.get(i, sample).unwrap());
                                (value, expected(&curve, quantity, time))
                            })
                            .collect();
                        let largest = samples
                            .iter()
                            .fold(1.0, |all: f64, (_, b)| all.max(b.abs()));
                        for (value, right) in samples {
                            let bound = 5e-7 * largest;
                            assert!(
                                (value - right).abs() < bound,
                                "{how} {ends:?} {quantity} {value} {right}"
                            );
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn scalars_have_the_same_bits_on_every_device() {
    let cpu = Engine::new(Device::Cpu).unwrap();
    let Case { set, .. } = case(2, 60);
    let modes = WrapMode::ALL;
    for engine in vulkan_engines(|_| ()) {
        for (i, how) in VectorMethod::ALL.into_iter().enumerate() {
            for (j, quantity) in ScalarQuantity::ALL.into_iter().enumerate() {
                let interpolation = Interpolation::from(method::SLERP)
                    .with_before(modes[(i + j) % modes.len()])
                    .with_after(modes[(i + 2 * j + 1) % modes.len()]);
                let frames = SampleTimes::fps(97).between(-20.0, 30.0);
                let [a, b] = [&cpu, &engine].map(|engine| {
                    let found = evaluate(engine, &set, quantity, how, interpolation, &frames);
                    found
                        .as_slice()
                        .iter()
                        .map(|x| x.to_bits())
                        .collect::<Vec<_>>()
                });
                assert!(a == b, "{} {how} {quantity}", engine.device_name());
            }
        }
    }
}

/// A scalar alone, in any pack and in both layouts has the same bits.
#[test]
fn a_scalar_s_bits_do_not_depend_on_others() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let Case { set, .. } = case(3, 30);
    let how = VectorMethod::C2;
    let frames = SampleTimes::fps(50).between(0.0, 9.0);
    for quantity in ScalarQuantity::ALL {
        let interpolation = Interpolation::from(method::SLERP);
        let all = evaluate(&engine, &set, quantity, how, interpolation, &frames);
        let layout = Layout::FrameMajor;
        let by_frame = engine
            .scalars(&set, quantity, how, interpolation, &frames, layout)
            .unwrap();
        let timeline = frames.resolve(30, None).unwrap();
        let each: Vec<f64> = (0..30)
            .flat_map(|i| timeline.times(i).collect::<Vec<_>>())
            .collect();
        let each = evaluate(
            &engine,
            &set,
            quantity,
            how,
            interpolation,
            &SampleTimes::at_each(each),
        );
        for i in 0..set.scalar_count() {
            let keys = set.scalar(i).unwrap();
            let mut alone = TrackSet::new();
            alone
                .push_scalar(keys.name, keys.times, keys.keys, keys.tangents)
                .unwrap();
            let alone = evaluate(&engine, &alone, quantity, how, interpolation, &frames);
            for sample in 0..all.sample_count() {
                let value = all.get(i, sample).map(f32::to_bits);
                assert_eq!(value, alone.get(0, sample).map(f32::to_bits));
                assert_eq!(value, by_frame.get(i, sample).map(f32::to_bits));
                let listed = each.get(i, sample).unwrap();
                assert!((listed - all.get(i, sample).unwrap()).abs() < 1e-4);
            }
        }
    }
}

/// Velocities in copies of a track: of the ends where copies meet, and with the other sign in mirrored copies.
#[test]
fn rates_in_copies_are_those_of_the_track() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let mut set = TrackSet::new();
    set.push_scalar("", &[0.0, 0.3, 1.0], &[0.0, 1.0, 5.0], &[])
        .unwrap();
    set.push("", &[0.0], &[glam::Quat::IDENTITY]).unwrap();
    set.set_translations(0, &[0.0, 0.3, 1.0], &[[0.0; 3], [1.0; 3], [5.0; 3]], &[])
        .unwrap();
    let how = VectorMethod::BesselOverhauser;
    let of = |wrap: WrapMode, quantity, times: &[f64]| {
        let interpolation = Interpolation::from(method::SLERP)
            .with_before(wrap)
            .with_after(wrap);
        let frames = SampleTimes::at(times.to_vec());
        let found = evaluate(&engine, &set, quantity, how, interpolation, &frames);
        let layout = Layout::TrackMajor;
        let rates = engine.vector_rates(
            &set,
            Channel::Translation,
            quantity,
            how,
            interpolation,
            &frames,
            layout,
        );
        let rates: Vec<f32> = rates.unwrap().as_slice().iter().map(|v| v.y).collect();
        assert_eq!(rates, found.as_slice());
        rates
    };
    let [velocity, acceleration] = [ScalarQuantity::Velocity, ScalarQuantity::Acceleration];
    let inside = of(WrapMode::Hold, velocity, &[0.25, 0.75]);
    let bends = of(WrapMode::Hold, acceleration, &[0.25, 0.75]);
    assert_eq!(of(WrapMode::Hold, velocity, &[-0.1, 1.1]), [0.0; 2]);
    assert_eq!(of(WrapMode::Loop, velocity, &[1.25, -0.25]), inside);
    assert_eq!(
        of(WrapMode::Mirror, velocity, &[1.75, 1.25]),
        inside.iter().map(|x| -x).collect::<Vec<_>>()
    );
    assert_eq!(of(WrapMode::Mirror, velocity, &[2.25, 2.75]), inside);
    assert_eq!(of(WrapMode::Mirror, acceleration, &[1.75, 1.25]), bends);
    let ends = of(WrapMode::Hold, velocity, &[0.0, 1.0]);
    assert!(ends.iter().all(|&end| end != 0.0));
    assert_eq!(of(WrapMode::Extrapolate, velocity, &[-3.0, 7.0]), ends);
    assert_eq!(
        of(WrapMode::Extrapolate, acceleration, &[-3.0, 7.0]),
        [0.0; 2]
    );
    // Frames of a rate whose copies do not begin on them.
    let interpolation = Interpolation::from(method::SLERP)
        .with_before(WrapMode::Mirror)
        .with_after(WrapMode::Mirror);
    let frames = SampleTimes::fps(30).between(-2.0, 3.0);
    let found = evaluate(&engine, &set, velocity, how, interpolation, &frames);
    let values = evaluate(
        &engine,
        &set,
        ScalarQuantity::Value,
        how,
        interpolation,
        &frames,
    );
    for sample in 1..150usize {
        let [before, after] = [-1i32, 1].map(|side| {
            values
                .get(0, sample.strict_add_signed(side as isize))
                .unwrap()
        });
        let difference = (after - before) * 15.0;
        let is_near_corner = (sample % 30).min(30 - sample % 30) < 2
            || (sample + 21) % 30 < 3
            || (sample + 9) % 30 < 3;
        if !is_near_corner {
            assert!(
                (difference - found.get(0, sample).unwrap()).abs() < 0.05,
                "{sample}"
            );
        }
    }
}

#[test]
fn sets_keep_their_scalars() {
    let mut set = TrackSet::new();
    assert_eq!(
        set.push_scalar("a", &[2.0, 3.0], &[1.0, f32::NAN], &[])
            .map_err(|e| matches!(e, TrackError::DataNotFinite { .. })),
        Err(true)
    );
    assert!(set.push_scalar("a", &[2.0, 3.0], &[1.0], &[]).is_err());
    assert!(
        set.push_scalar("a", &[2.0], &[1.0], &[[0.0; 2]; 2])
            .is_err()
    );
    assert!(set.push_scalar("a", &[2.0], &[2e30], &[]).is_err());
    assert_eq!((set.scalar_count(), set.time_span()), (0, None));
    set.push_scalar("knee", &[2.0, 3.0], &[1.0, 2.0], &[])
        .unwrap();
    set.push("hip", &[0.0], &[glam::Quat::IDENTITY]).unwrap();
    assert_eq!(set.time_span(), Some((0.0, 3.0)));
    let selected = set.select([]).unwrap();
    assert_eq!(selected.scalar_named("knee"), Some(0));
    assert_eq!(selected.time_span(), Some((2.0, 3.0)));
    assert_eq!(selected.scalar(0), set.scalar(0));
    assert_eq!(selected.scalar(1), None);
    // Without scalars there is nothing to evaluate.
    let engine = Engine::new(Device::Cpu).unwrap();
    let none = evaluate(
        &engine,
        &TrackSet::new(),
        ScalarQuantity::Value,
        VectorMethod::Linear,
        method::SLERP.into(),
        &SampleTimes::fps(1),
    );
    assert!(none.as_slice().is_empty());
}

/// Where copies meet, rounding may put a frame before the first key of its copy; it has the velocity there, and is
/// not held.
#[test]
fn velocities_of_loops_have_no_holes() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let quantity = tumble::Quantity::Velocity(tumble::Axes::Parent);
    for steps in 1..60u32 {
        let last = f64::from(steps) * 0.1;
        let mut set = TrackSet::new();
        set.push_scalar("", &[0.1, 0.1 + last], &[0.0, last as f32], &[])
            .unwrap();
        let keys = [
            glam::Quat::IDENTITY,
            glam::Quat::from_rotation_x(0.05 * steps as f32),
        ];
        set.push("", &[0.1, 0.1 + last], &keys).unwrap();
        for rate in [10, 20, 30, 50] {
            let interpolation = Interpolation::from(method::SLERP)
                .with_before(WrapMode::Loop)
                .with_after(WrapMode::Loop);
            let frames = SampleTimes::fps(rate).between(-30.0, 30.0);
            let linear = VectorMethod::Linear;
            let velocity = ScalarQuantity::Velocity;
            let found = evaluate(&engine, &set, velocity, linear, interpolation, &frames);
            let is_one = |x: &f32| (x - 1.0).abs() < 1e-6;
            assert!(found.as_slice().iter().all(is_one), "{steps} {rate}");
            let interpolation = interpolation.with_quantity(quantity);
            let found = engine
                .rates(&set, interpolation, &frames, Layout::TrackMajor)
                .unwrap();
            let is_half = |v: &glam::Vec4| (v.x - 0.5).abs() < 1e-5;
            assert!(
                found.as_slice().iter().all(is_half),
                "{steps} {rate} rotation"
            );
        }
    }
}
