//! States of a library's clips: a crowd's rotations, and rates that agree with their differences.

use std::borrow::Cow;

use super::{clip, skeleton};
use crate::support::{Random, vulkan_devices};
use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::crowd::{
    CrowdError, CrowdLayer, CrowdLibrary, CrowdValues, FrameStep, KeyPrecision, MotionBuilder,
    MotionClip, MotionStates, MotionTables,
};
use tumble::{
    Device, Engine, EngineOptions, Method, TrackSet, VectorMethod, VectorWidth, WrapMode, method,
};

pub(super) const TICKS: u32 = 705_600;

/// Clips without scales, of which states say nothing.
fn library(random: &mut Random, joints: usize, method: Method) -> CrowdLibrary {
    let mut library = CrowdLibrary::with_ticks(&skeleton(random, joints), TICKS).unwrap();
    for set in sets(random, joints) {
        library
            .push(&set, method, VectorMethod::BesselOverhauser)
            .unwrap();
    }
    library
}

pub(super) fn sets(random: &mut Random, joints: usize) -> Vec<TrackSet> {
    let mut sets = Vec::new();
    for keys in [1, 2, 40] {
        let tracks = clip(random, joints, keys);
        let mut set = TrackSet::new();
        for track in tracks.tracks() {
            set.push("", track.times, track.keys).unwrap();
        }
        let times: Vec<f64> = (0..30).map(|k| f64::from(k) * 0.11).collect();
        let mut point = Vec3::ZERO;
        let points: Vec<Vec3> = times
            .iter()
            .map(|_| {
                point += (random.direction() * 0.1).as_vec3();
                point
            })
            .collect();
        set.set_translations(0, &times, &points, &[]).unwrap();
        sets.push(set);
    }
    sets
}

pub(super) struct StateResults {
    pub(super) rotations: Vec<[f32; 4]>,
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) world_rotations: Vec<[f32; 4]>,
    pub(super) velocities: Vec<[f32; 3]>,
    pub(super) angular_velocities: Vec<[f32; 3]>,
}

pub(super) fn states(
    engine: &Engine,
    tables: &MotionTables,
    parts: (&[[u32; 4]], &[[f32; 4]]),
    at: &[(u32, u32)],
) -> StateResults {
    let joints = at.len() * tables.joint_count();
    let mut found = StateResults {
        rotations: vec![[0.0; 4]; joints],
        positions: vec![[0.0; 3]; joints],
        world_rotations: vec![[0.0; 4]; joints],
        velocities: vec![[0.0; 3]; joints],
        angular_velocities: vec![[0.0; 3]; joints],
    };
    let states = MotionStates {
        rotations: &mut found.rotations,
        positions: &mut found.positions,
        world_rotations: &mut found.world_rotations,
        velocities: &mut found.velocities,
        angular_velocities: &mut found.angular_velocities,
    };
    tables.sample_into(engine, parts, at, states).unwrap();
    found
}

/// Instances in every clip, within it, at its ends and behind.
pub(super) fn instances(
    random: &mut Random,
    tables: &MotionTables,
    count: usize,
) -> Vec<(u32, u32)> {
    let one = |i: usize| {
        let clip = i % tables.clip_count();
        let ticks = tables.ticks(clip).unwrap();
        let tick = match i % 7 {
            0 => 0,
            1 => ticks,
            2 => ticks + 5,
            _ => (random.unit() * f64::from(ticks)) as u32,
        };
        (clip as u32, tick)
    };
    (0..count).map(one).collect()
}

#[test]
fn rotations_are_a_crowds_on_every_device_and_at_every_width() {
    let mut random = Random(61);
    for method in [method::SLERP, method::BESSEL_OVERHAUSER, method::STEP] {
        let library = library(&mut random, 11, method);
        let engine = Engine::new(Device::Cpu).unwrap();
        let (tables, spans, cells) = library.clone().into_tables();
        let at = instances(&mut random, &tables, 300);
        let first = states(&engine, &tables, (&spans, &cells), &at);
        let expected = first.rotations.clone();
        let devices = vulkan_devices().into_iter().chain([Device::Cpu]);
        for device in devices {
            let engine = Engine::new(device).unwrap();
            let mut crowd = engine.crowd(&library, at.len(), 1).unwrap();
            for (instance, &(clip, tick)) in at.iter().enumerate() {
                let layer = CrowdLayer::new(clip as usize)
                    .at(tick.into())
                    .with_speed(0.0)
                    .with_wrap(WrapMode::Hold);
                crowd.set(instance, 0, layer).unwrap();
            }
            let mut found = vec![[0.0; 4]; at.len() * 11];
            crowd
                .evaluate_into(CrowdValues::Rotations, &mut found)
                .unwrap();
            assert_eq!(found, expected, "{} {engine:?}", method.name);
            // Whatever the engine's device, states are the same.
            let found = states(&engine, &tables, (&spans, &cells), &at);
            assert_eq!(found.velocities, first.velocities, "{engine:?}");
        }
        for width in VectorWidth::available() {
            let mut options = EngineOptions::default();
            options.vector_width = Some(width);
            options.thread_count = Some(3);
            let engine = Engine::with_options(Device::Cpu, &options).unwrap();
            let found = states(&engine, &tables, (&spans, &cells), &at);
            assert_eq!(found.rotations, expected);
            assert_eq!(found.positions, first.positions);
            assert_eq!(found.world_rotations, first.world_rotations);
            assert_eq!(found.velocities, first.velocities);
            assert_eq!(found.angular_velocities, first.angular_velocities);
        }
    }
}

/// Rates are near the differences of samples a few ticks before and after.
#[test]
fn rates_are_those_of_differences() {
    let mut random = Random(7);
    for method in [method::SLERP, method::BESSEL_OVERHAUSER, method::C2] {
        let (tables, spans, cells) = library(&mut random, 9, method).into_tables();
        let engine = Engine::new(Device::Cpu).unwrap();
        let parts = (&spans[..], &cells[..]);
        let apart = 1000u32;
        let ticks = tables.ticks(2).unwrap();
        let at: Vec<(u32, u32)> = (0..200)
            .map(|_| {
                (
                    2,
                    apart + (random.unit() * f64::from(ticks - 2 * apart)) as u32,
                )
            })
            .collect();
        let moved = |by: i64| -> Vec<(u32, u32)> {
            at.iter()
                .map(|&(clip, tick)| (clip, (i64::from(tick) + by) as u32))
                .collect()
        };
        let found = states(&engine, &tables, parts, &at);
        let before = states(&engine, &tables, parts, &moved(-i64::from(apart)));
        let after = states(&engine, &tables, parts, &moved(i64::from(apart)));
        let seconds = 2.0 * f64::from(apart) / f64::from(TICKS);
        let three = |of: [f32; 3]| Vec3::from_array(of).as_dvec3();
        let four = |of: [f32; 4]| Quat::from_array(of).as_dquat();
        // A rate may jump at a key, and for a few samples a key lies between the two times of the difference.
        let (mut compared, mut jumps) = (0, 0);
        for i in 0..found.rotations.len() {
            let rate = (three(after.positions[i]) - three(before.positions[i])) / seconds;
            let velocity = three(found.velocities[i]);
            let (a, b) = (
                four(before.world_rotations[i]),
                four(after.world_rotations[i]),
            );
            let step: DQuat = b * a.conjugate();
            let step = if step.w < 0.0 { -step } else { step };
            let spin: DVec3 = step.to_scaled_axis() / seconds;
            let angular = three(found.angular_velocities[i]);
            let is_near = (rate - velocity).length() <= 2e-3 * (1.0 + velocity.length())
                && (spin - angular).length() <= 2e-3 * (1.0 + angular.length());
            compared += usize::from(is_near);
            jumps += usize::from(!is_near);
        }
        assert!(
            jumps * 50 < compared,
            "{}: {jumps} of {compared}",
            method.name
        );
    }
}

#[test]
fn positions_lie_along_the_skeleton() {
    let mut random = Random(23);
    let skeleton = tumble::Skeleton::new(vec![None, Some(0)], vec![Vec3::Y, Vec3::X]).unwrap();
    let mut library = CrowdLibrary::new(&skeleton).unwrap();
    let mut set = TrackSet::new();
    let keys = [Quat::IDENTITY, Quat::from_rotation_z(2.0)];
    set.push("", &[0.0, 1.0], &keys).unwrap();
    set.push(
        "",
        &[0.0, 1.0],
        &[Quat::IDENTITY, random.rotation().as_quat()],
    )
    .unwrap();
    library
        .push(&set, method::SLERP, VectorMethod::Linear)
        .unwrap();
    let (tables, spans, cells) = library.into_tables();
    let engine = Engine::new(Device::Cpu).unwrap();
    let found = states(&engine, &tables, (&spans, &cells), &[(0, TICKS / 2)]);
    let (sine, cosine) = (1.0f32.sin(), 1.0f32.cos());
    let near = |a: [f32; 3], b: [f32; 3]| Vec3::from_array(a).distance(Vec3::from_array(b)) < 1e-5;
    assert!(near(found.positions[0], [0.0, 1.0, 0.0]));
    assert!(near(found.positions[1], [cosine, 1.0 + sine, 0.0]));
    assert!(near(found.velocities[1], [-2.0 * sine, 2.0 * cosine, 0.0]));
    assert!(near(found.angular_velocities[0], [0.0, 0.0, 2.0]));
    // At the last key the rates are those with which it is reached.
    let found = states(&engine, &tables, (&spans, &cells), &[(0, TICKS)]);
    assert!(near(found.angular_velocities[0], [0.0, 0.0, 2.0]));
}

#[test]
fn tables_come_back_from_words_and_broken_ones_are_refused() {
    let mut random = Random(2);
    let (tables, spans, cells) = library(&mut random, 5, method::SLERP).into_tables();
    let parts = (&spans[..], &cells[..]);
    let words = tables.words();
    let again = MotionTables::new(words.clone(), parts).unwrap();
    let engine = Engine::new(Device::Cpu).unwrap();
    let at = instances(&mut random, &tables, 70);
    let (a, b) = (
        states(&engine, &tables, parts, &at),
        states(&engine, &again, parts, &at),
    );
    assert_eq!(a.positions, b.positions);
    // Whatever is changed, nothing panics: it is refused, or it can be sampled.
    for _ in 0..3000 {
        let mut broken = words.clone();
        let value = random.pick(&[0, 1, 2, 77, 1 << 24, 3 << 24, u32::MAX]);
        let index = random.next() as usize;
        match random.next() % 5 {
            0 => broken.clips[index % words.clips.len()][index % 3] = value,
            1 => broken.bases[index % words.bases.len()][index % 3] = value,
            2 => broken.channels[index % words.channels.len()][index % 4] = value,
            3 if !words.links.is_empty() => {
                broken.links[index % words.links.len()][index % 2] = value;
            }
            _ => broken.joint_count = value as usize % 9,
        }
        if let Ok(tables) = MotionTables::new(broken, parts) {
            let at: Vec<(u32, u32)> = (0..tables.clip_count() as u32)
                .flat_map(|clip| [(clip, 0), (clip, 12_345), (clip, u32::MAX)])
                .collect();
            let _ = states(&engine, &tables, parts, &at);
            let all: Vec<usize> = (0..tables.clip_count()).collect();
            let _ = tables.select(parts, &all);
        }
    }
    let states = MotionStates::default();
    let missing = tables.sample_into(&engine, parts, &[(3, 0)], states);
    assert!(matches!(missing, Err(CrowdError::Missing { index: 3, .. })));
    let states = MotionStates::default();
    let others = tables.sample_into(&engine, (&spans[1..], &cells), &[(0, 0)], states);
    assert_eq!(others, Err(CrowdError::BrokenTables));
}

#[test]
fn some_clips_have_the_states_that_they_have_among_all() {
    let mut random = Random(83);
    let (joints, engine) = (7, Engine::new(Device::Cpu).unwrap());
    let skeleton = skeleton(&mut random, joints);
    let sets = sets(&mut random, joints);
    for method in [method::SLERP, method::BESSEL_OVERHAUSER, method::STEP] {
        for precision in [KeyPrecision::Exact, KeyPrecision::Packed] {
            let mut builder = MotionBuilder::new(&skeleton, TICKS, precision).unwrap();
            for set in &sets {
                builder.push(set, method, VectorMethod::Linear).unwrap();
            }
            let (tables, spans, cells) = builder.finish();
            let parts = (&spans[..], &cells[..]);
            let at = instances(&mut random, &tables, 120);
            let all = states(&engine, &tables, parts, &at);
            let (some, some_spans, some_cells) = tables.select(parts, &[2, 0]).unwrap();
            let some_parts = (&some_spans[..], &some_cells[..]);
            assert!(some_cells.len() < cells.len() && some.clip_count() == 2);
            // The selected tables pass the checks for tables from files.
            let some = MotionTables::new(some.words(), some_parts).unwrap();
            for (instance, &(clip, tick)) in at.iter().enumerate() {
                let clip = match clip {
                    0 => 1,
                    2 => 0,
                    _ => continue,
                };
                let one = states(&engine, &some, some_parts, &[(clip, tick)]);
                let these = instance * joints..(instance + 1) * joints;
                assert_eq!(
                    one.rotations,
                    all.rotations[these.clone()],
                    "{}",
                    method.name
                );
                assert_eq!(one.positions, all.positions[these.clone()]);
                assert_eq!(one.angular_velocities, all.angular_velocities[these]);
            }
            let missing = tables.select(parts, &[3]).unwrap_err();
            assert!(matches!(missing, CrowdError::Missing { index: 3, .. }));
        }
    }
}

/// The angle between two rotations.
fn angle(a: [f32; 4], b: [f32; 4]) -> f64 {
    let [a, b] = [a, b].map(|q| Quat::from_array(q).as_dquat().normalize());
    let chord = (a - b).length().min((a + b).length());
    4.0 * (chord / 2.0).asin()
}

#[test]
fn tables_of_keys_have_the_bits_of_tables_of_segments_and_packed_ones_are_within_their_bound() {
    let mut random = Random(19);
    let engine = Engine::new(Device::Cpu).unwrap();
    let joints = 11;
    let skeleton = skeleton(&mut random, joints);
    let mut sets = sets(&mut random, joints);
    // Keys at common times, as most files have them, which turn by up to 180°, with signs of both kinds.
    let times: Vec<f64> = (0..50).map(|frame| f64::from(frame) / 30.0).collect();
    let mut even = TrackSet::new();
    for _ in 0..joints {
        let keys: Vec<Quat> = times.iter().map(|_| random.rotation().as_quat()).collect();
        even.push("", &times, &keys).unwrap();
    }
    let points: Vec<Vec3> = times.iter().map(|_| random.direction().as_vec3()).collect();
    even.set_translations(0, &times, &points, &[]).unwrap();
    sets.push(even);
    // Frames that lie on no tick, and keys that turn little: their signs stay.
    let times: Vec<f64> = (0..50).map(|frame| f64::from(frame) / 59.94).collect();
    let mut slow = TrackSet::new();
    for _ in 0..joints {
        let mut key = random.rotation();
        let keys = times.iter().map(|_| {
            key = (key * DQuat::from_scaled_axis(random.direction() * 0.05)).normalize();
            key.as_quat()
        });
        let keys: Vec<Quat> = keys.collect();
        slow.push("", &times, &keys).unwrap();
    }
    sets.push(slow);
    let mut whole = CrowdLibrary::with_ticks(&skeleton, TICKS).unwrap();
    let new = |precision| MotionBuilder::new(&skeleton, TICKS, precision).unwrap();
    let (mut exact, mut packed) = (new(KeyPrecision::Exact), new(KeyPrecision::Packed));
    let (method, vectors) = (method::SLERP, VectorMethod::Linear);
    for set in &sets {
        whole.push(set, method, vectors).unwrap();
        exact.push(set, method, vectors).unwrap();
    }
    let clip = |set| MotionClip {
        set: Cow::Borrowed(set),
        interpolation: method.into(),
        vectors,
    };
    let clip = |index: usize| Ok::<_, CrowdError>(clip(&sets[index]));
    packed.push_all(&engine, sets.len(), clip).unwrap();
    let (tables, spans, cells) = whole.into_tables();
    let at = instances(&mut random, &tables, 2000);
    let expected = states(&engine, &tables, (&spans, &cells), &at);
    let mut sizes = vec![cells.len()];
    for (builder, bound) in [(exact, 0.0), (packed, 1e-5)] {
        let (tables, spans, cells) = builder.finish();
        sizes.push(cells.len());
        let again = MotionTables::new(tables.words(), (&spans, &cells)).unwrap();
        for width in VectorWidth::available() {
            let mut options = EngineOptions::default();
            options.vector_width = Some(width);
            let engine = Engine::with_options(Device::Cpu, &options).unwrap();
            let found = states(&engine, &again, (&spans, &cells), &at);
            if bound == 0.0 {
                assert_eq!(found.rotations, expected.rotations);
                assert_eq!(found.positions, expected.positions);
                assert_eq!(found.world_rotations, expected.world_rotations);
                assert_eq!(found.velocities, expected.velocities);
                assert_eq!(found.angular_velocities, expected.angular_velocities);
            }
            let pairs = found.rotations.iter().zip(&expected.rotations);
            let largest = pairs.map(|(&a, &b)| angle(a, b)).fold(0.0, f64::max);
            assert!(largest <= bound, "{largest}");
        }
    }
    // Tracks with different times, and keys with changing signs, are stored as segments if the bits must stay the same.
    assert!(
        sizes[1] * 3 < sizes[0] * 2 && sizes[2] * 2 < sizes[1],
        "{sizes:?}"
    );
}

#[test]
fn differences_are_those_of_the_two_ticks() {
    let mut random = Random(31);
    let (tables, spans, cells) = library(&mut random, 9, method::SLERP).into_tables();
    let parts = (&spans[..], &cells[..]);
    let engine = Engine::new(Device::Cpu).unwrap();
    let at = instances(&mut random, &tables, 130);
    let frame = TICKS / 30;
    let steps: Vec<FrameStep> = at
        .iter()
        .map(|&(_, tick)| FrameStep {
            ticks: [tick / frame * frame, (tick / frame + 1) * frame],
            per_second: 30.0,
        })
        .collect();
    let count = at.len() * 9;
    let (mut velocities, mut angular) = (vec![[0.0f32; 3]; count], vec![[0.0f32; 3]; count]);
    let arrays = MotionStates {
        velocities: &mut velocities,
        angular_velocities: &mut angular,
        ..MotionStates::default()
    };
    tables
        .differences_into(&engine, parts, &at, &steps, arrays)
        .unwrap();
    for width in VectorWidth::available() {
        let mut options = EngineOptions::default();
        options.vector_width = Some(width);
        let engine = Engine::with_options(Device::Cpu, &options).unwrap();
        let mut found = [vec![[0.0f32; 3]; count], vec![[0.0f32; 3]; count]];
        let [velocities_there, angular_there] = &mut found;
        let arrays = MotionStates {
            velocities: velocities_there,
            angular_velocities: angular_there,
            ..MotionStates::default()
        };
        tables
            .differences_into(&engine, parts, &at, &steps, arrays)
            .unwrap();
        assert_eq!(found, [velocities.clone(), angular.clone()], "{width:?}");
    }
    let of = |end: usize| -> StateResults {
        let at: Vec<(u32, u32)> = (at.iter().zip(&steps))
            .map(|(&(clip, _), step)| (clip, step.ticks[end]))
            .collect();
        states(&engine, &tables, parts, &at)
    };
    let (before, after) = (of(0), of(1));
    for index in 0..count {
        let [a, b] = [before.positions[index], after.positions[index]].map(Vec3::from_array);
        let velocity = Vec3::from_array(velocities[index]);
        assert!(((b - a) * 30.0).distance(velocity) < 1e-4);
        let [a, b] = [before.world_rotations[index], after.world_rotations[index]]
            .map(|q| Quat::from_array(q).as_dquat().normalize());
        let step = b * a.inverse();
        let step = if step.w < 0.0 { -step } else { step };
        let expected = step.to_scaled_axis() * 30.0;
        let found = Vec3::from_array(angular[index]).as_dvec3();
        assert!(expected.distance(found) < 2e-4, "{expected} {found}");
    }
    let refused =
        tables.differences_into(&engine, parts, &at, &steps[1..], MotionStates::default());
    assert!(matches!(refused, Err(CrowdError::OutputLength { .. })));
}
