//! Smoothing: worked examples, the bounds, and the same bits on every device.

use crate::support::{Random, first_difference, round_robin, vulkan_engines};
use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::reference::angle_between;
use tumble::{
    Channel, Device, Engine, Error, Interpolation, Layout, Rotations, SampleTimes, Smoothing,
    SmoothingEnds, SmoothingError, SmoothingKernel, TrackSet, VectorMethod, Vectors, method,
};

const Y: [f32; 7] = [0.0, 2.0, -1.0, 3.0, 0.0, 1.0, 0.0];

fn cpu() -> Engine {
    Engine::new(Device::Cpu).unwrap()
}

fn kernel(name: &str) -> SmoothingKernel {
    name.parse().unwrap()
}

fn seconds(count: usize) -> Vec<f64> {
    (0..count).map(|i| i as f64).collect()
}

/// The samples themselves as a result of an engine: keys that are held, a second each.
fn rotations(engine: &Engine, tracks: &[Vec<Quat>], layout: Layout) -> Rotations {
    let mut set = TrackSet::new();
    for track in tracks {
        set.push("", &seconds(track.len()), track).unwrap();
    }
    let frames = SampleTimes::fps(1);
    let as_authored = Interpolation::from(method::STEP).with_signs(tumble::KeySigns::AsAuthored);
    engine
        .request(&set, as_authored, &frames)
        .layout(layout)
        .evaluate()
        .unwrap()
}

fn vectors(engine: &Engine, tracks: &[Vec<Vec3>], layout: Layout) -> Vectors {
    let mut set = TrackSet::new();
    for track in tracks {
        set.push_path("", &seconds(track.len()), track, &[])
            .unwrap();
    }
    let (frames, step) = (SampleTimes::fps(1), VectorMethod::Step);
    engine
        .vectors(
            &set,
            Channel::Translation,
            step,
            method::STEP,
            &frames,
            layout,
        )
        .unwrap()
}

fn smoothed_numbers(name: &str, ends: SmoothingEnds, values: &[f32]) -> Vec<f32> {
    let engine = cpu();
    let track: Vec<Vec3> = values.iter().map(|&y| Vec3::new(0.0, y, 0.0)).collect();
    let input = vectors(&engine, &[track], Layout::TrackMajor);
    let smoothing = Smoothing::new(kernel(name)).with_ends(ends);
    let found = engine.smooth_vectors(&input, &smoothing).unwrap();
    (0..values.len())
        .map(|i| found.get(0, i).unwrap().y)
        .collect()
}

#[track_caller]
fn assert_numbers(found: &[f32], expected: &[f64]) {
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            (f64::from(*found) - expected).abs() < 1e-6,
            "{found} instead of {expected}"
        );
    }
}

#[test]
fn numbers_of_the_examples() {
    let keep = SmoothingEnds::Keep;
    assert_numbers(
        &smoothed_numbers("linear", keep, &Y),
        &[0.0, 0.75, 0.75, 1.25, 1.0, 0.5, 0.0],
    );
    let cubic = [0.0, 0.0, 7.0 / 6.0, 11.0 / 12.0, 17.0 / 12.0, 0.0, 0.0];
    assert_numbers(&smoothed_numbers("cubic", keep, &Y), &cubic);
    let parabolic = smoothed_numbers("cubic", SmoothingEnds::Parabolic, &Y);
    assert_numbers(&[parabolic[0], parabolic[6]], &[12.0, 6.0]);
    assert_numbers(&parabolic[1..6], &cubic[1..6]);
    let gaussian = [
        0.0,
        0.590329557,
        0.820002627,
        1.0883031,
        0.912358641,
        0.497973543,
        0.0,
    ];
    assert_numbers(&smoothed_numbers("gaussian:1", keep, &Y), &gaussian);
}

/// Four keys w x y z, normalised.
fn q() -> Vec<Quat> {
    let keys = [
        [1, 0, 0, 0],
        [3, 1, -1, 2],
        [1, 2, 2, 0],
        [0, -1, 3, 1],
        [-2, 1, 1, 1],
        [4, 0, 1, -1],
        [1, 1, 1, 1],
    ];
    let unit =
        |[w, x, y, z]: [i32; 4]| Quat::from_array([x, y, z, w].map(|c| c as f32)).normalize();
    keys.map(unit).to_vec()
}

#[test]
fn rotations_of_the_examples() {
    let engine = cpu();
    let of = |name: &str, track: Vec<Quat>| {
        let input = rotations(&engine, &[track], Layout::TrackMajor);
        engine
            .smooth(&input, &Smoothing::new(kernel(name)))
            .unwrap()
    };
    let third = of("linear", q()).get(0, 2).unwrap().as_dquat();
    let expected = DQuat::from_xyzw(0.474690352, 0.676086068, 0.264208749, 0.497765442);
    assert!(angle_between(third, expected) < 1e-6, "{third}");
    let angles = [0.0, 0.3, 1.1, 2.4, 4.0, 6.1, 6.0];
    let found = of(
        "savitzky-golay:2:2",
        angles.map(Quat::from_rotation_y).to_vec(),
    );
    let expected = [
        0.0,
        0.342857143,
        1.11714286,
        2.36571429,
        4.24857143,
        5.68,
        6.0,
    ];
    for (i, angle) in expected.into_iter().enumerate() {
        let off = angle_between(
            found.get(0, i).unwrap().as_dquat(),
            DQuat::from_rotation_y(angle),
        );
        assert!(off < 1e-6, "{i}: {off:e}");
    }
}

const KERNELS: [&str; 6] = [
    "linear",
    "cubic",
    "box:2.25",
    "tent:3",
    "gaussian:2",
    "savitzky-golay:4:3",
];

/// Tracks of some length: smooth ones, wild ones, still ones, keys of either sign.
fn tracks(random: &mut Random, samples: usize) -> Vec<Vec<Quat>> {
    let track = |wild: f64, random: &mut Random| {
        let mut rotation = random.rotation();
        let mut next = || {
            let step = DQuat::from_axis_angle(random.direction(), random.between(0.0, wild));
            rotation = (rotation * step).normalize();
            rotation.as_quat() * if random.unit() < 0.2 { -1.0 } else { 1.0 }
        };
        (0..samples).map(|_| next()).collect()
    };
    [0.0, 1e-4, 0.05, 0.5, 3.1]
        .map(|wild| track(wild, random))
        .to_vec()
}

/// In f64, as it is written.
fn by_the_book(weights: &[f64], track: &[DQuat], ends: SmoothingEnds) -> Vec<DQuat> {
    let count = track.len() as isize - 1;
    let log = |a: DQuat, b: DQuat| {
        let step = a.inverse() * if a.dot(b) < 0.0 { -b } else { b };
        let v = DVec3::new(step.x, step.y, step.z);
        let sine = v.length();
        if sine == 0.0 {
            v
        } else {
            v * (sine.atan2(step.w) / sine)
        }
    };
    let step = |j: isize| {
        let j = match ends {
            SmoothingEnds::Loop => j.rem_euclid(count),
            _ => {
                let there = j.rem_euclid(2 * count);
                there.min(2 * count - 1 - there)
            }
        } as usize;
        log(track[j], track[j + 1])
    };
    let smoothed = |i: usize| {
        let mut sum = DVec3::ZERO;
        for m in 0..weights.len() - 1 {
            let b: f64 = weights[m + 1..].iter().sum();
            sum += (step((i + m) as isize) - step(i as isize - 1 - m as isize)) * b;
        }
        let angle = sum.length();
        let sinc = if angle > 0.0 {
            angle.sin() / angle
        } else {
            1.0
        };
        let axis = sum * sinc;
        track[i] * DQuat::from_xyzw(axis.x, axis.y, axis.z, angle.cos())
    };
    (0..track.len()).map(smoothed).collect()
}

#[test]
fn rotations_are_smoothed_by_the_book() {
    let engine = cpu();
    let mut random = Random(5);
    let weights = |name: &str| match name {
        "linear" => vec![0.5, 0.25],
        "box:2.25" => vec![2.0 / 9.0, 2.0 / 9.0, 1.0 / 6.0],
        _ => vec![5.0 / 18.0, 4.0 / 18.0, 2.0 / 18.0, 1.0 / 72.0 * 1.0],
    };
    for samples in [2, 3, 4, 40] {
        for name in ["linear", "box:2.25"] {
            for ends in [SmoothingEnds::Keep, SmoothingEnds::Loop] {
                let input = tracks(&mut random, samples);
                let smoothing = Smoothing::new(kernel(name)).with_ends(ends);
                let evaluated = rotations(&engine, &input, Layout::FrameMajor);
                let found = engine.smooth(&evaluated, &smoothing).unwrap();
                for (track, keys) in input.iter().enumerate() {
                    let keys: Vec<DQuat> =
                        keys.iter().map(|key| key.as_dquat().normalize()).collect();
                    // For steps of nearly 180°, rounding decides the sign.
                    if track == 4 {
                        continue;
                    }
                    for (i, expected) in by_the_book(&weights(name), &keys, ends)
                        .into_iter()
                        .enumerate()
                    {
                        let off = angle_between(found.get(track, i).unwrap().as_dquat(), expected);
                        assert!(off < 1e-6, "{name} {ends:?} {track} {i}: {off:e}");
                    }
                }
            }
        }
    }
}

#[test]
fn the_same_bits_on_every_device() {
    let mut random = Random(6);
    let engines = vulkan_engines(|options| options.memory = Some(1 << 20));
    let mut round = 0;
    for samples in [1, 2, 3, 4, 9, 700] {
        let input = tracks(&mut random, samples);
        let positions: Vec<Vec<Vec3>> = input
            .iter()
            .map(|track| {
                track
                    .iter()
                    .map(|q| Vec3::new(q.x * 300.0, q.y, 1e-20 * q.z))
                    .collect()
            })
            .collect();
        for name in KERNELS {
            for ends in [
                SmoothingEnds::Keep,
                SmoothingEnds::Loop,
                SmoothingEnds::Parabolic,
            ] {
                for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                    let smoothing = Smoothing::new(kernel(name)).with_ends(ends).with_passes(2);
                    let on = |engine: &Engine| {
                        let smoothed =
                            engine.smooth(&rotations(&cpu(), &input, layout), &smoothing)?;
                        let moved = engine
                            .smooth_vectors(&vectors(&cpu(), &positions, layout), &smoothing)?;
                        let moved: Vec<Quat> = moved
                            .as_slice()
                            .iter()
                            .map(|v| Quat::from_vec4(*v))
                            .collect();
                        Ok::<_, Error>((smoothed.as_quats().to_vec(), moved))
                    };
                    if ends == SmoothingEnds::Parabolic && name != "cubic" {
                        assert!(matches!(
                            on(&cpu()),
                            Err(Error::Smoothing(SmoothingError::Ends))
                        ));
                        continue;
                    }
                    let expected = on(&cpu()).unwrap();
                    round += 1;
                    for engine in round_robin(&engines, round) {
                        let found = on(engine).unwrap();
                        assert_eq!(
                            first_difference(&found.0, &expected.0),
                            None,
                            "{name} {ends:?} {samples}"
                        );
                        assert_eq!(
                            first_difference(&found.1, &expected.1),
                            None,
                            "{name} {ends:?} {samples}"
                        );
                    }
                    for rotation in expected.0 {
                        assert!((rotation.length() - 1.0).abs() < 1e-6);
                    }
                }
            }
        }
    }
}

#[test]
fn still_tracks_keep_their_bits_and_even_motion_stays() {
    let engine = cpu();
    let mut random = Random(7);
    let still: Vec<Quat> = vec![random.rotation().as_quat(); 30];
    let line: Vec<Vec3> = (0..30)
        .map(|i| Vec3::new(1e6 + 0.5 * i as f32, 3.0, -0.25 * i as f32))
        .collect();
    let (axis, step) = (random.direction(), 0.3);
    let even: Vec<Quat> = (0..30)
        .map(|i| DQuat::from_axis_angle(axis, step * f64::from(i)).as_quat())
        .collect();
    for name in KERNELS {
        let smoothing = Smoothing::new(kernel(name)).with_passes(3);
        let of = |track: &[Quat]| {
            let input = rotations(&engine, &[track.to_vec()], Layout::TrackMajor);
            (
                input.as_quats().to_vec(),
                engine
                    .smooth(&input, &smoothing)
                    .unwrap()
                    .as_quats()
                    .to_vec(),
            )
        };
        let (input, found) = of(&still);
        assert_eq!(first_difference(&found, &input), None, "{name}");
        let positions = vectors(&engine, std::slice::from_ref(&line), Layout::TrackMajor);
        let moved = engine.smooth_vectors(&positions, &smoothing).unwrap();
        for (i, position) in line.iter().enumerate().skip(13).take(4) {
            assert_eq!(moved.get(0, i), Some(*position), "{name}");
        }
        let (_, found) = of(&even);
        for i in 13..17 {
            assert!(
                angle_between(found[i].as_dquat(), even[i].as_dquat()) < 1e-6,
                "{name}"
            );
        }
    }
}

/// Multiplying all samples by a rotation, on the left or on the right, multiplies the result by it.
#[test]
fn smoothing_turns_with_its_samples() {
    let engine = cpu();
    let mut random = Random(9);
    let input = tracks(&mut random, 50)[2].clone();
    let (left, right) = (random.rotation(), random.rotation());
    let rotated = |q: &Quat| (left * q.as_dquat() * right).as_quat();
    for name in KERNELS {
        let of = |track: Vec<Quat>| {
            let evaluated = rotations(&engine, &[track], Layout::TrackMajor);
            engine
                .smooth(&evaluated, &Smoothing::new(kernel(name)))
                .unwrap()
                .as_quats()
                .to_vec()
        };
        let (plain, other) = (of(input.clone()), of(input.iter().map(rotated).collect()));
        for (plain, other) in plain.iter().zip(other) {
            let off = angle_between(rotated(plain).as_dquat(), other.as_dquat());
            assert!(off < 2e-6, "{name}: {off:e}");
        }
    }
}

/// For rotations about one axis the result is that of the filter for numbers, within 3e-7 of the
/// largest and 1e-6 rad.
#[test]
fn about_one_axis_it_is_the_scalar_filter() {
    let mut random = Random(10);
    let angles: Vec<f32> = (0..60).map(|_| random.between(-1.0, 1.0) as f32).collect();
    for name in KERNELS {
        let numbers = smoothed_numbers(name, SmoothingEnds::Keep, &angles);
        let engine = cpu();
        let track = angles
            .iter()
            .map(|&angle| Quat::from_rotation_x(angle))
            .collect();
        let evaluated = rotations(&engine, &[track], Layout::TrackMajor);
        let found = engine
            .smooth(&evaluated, &Smoothing::new(kernel(name)))
            .unwrap();
        for (i, &angle) in numbers.iter().enumerate() {
            let expected = DQuat::from_rotation_x(f64::from(angle));
            let off = angle_between(found.get(0, i).unwrap().as_dquat(), expected);
            assert!(off < 1e-6, "{name} {i}: {off:e}");
        }
    }
}
