//! States of a library's clips: a crowd's rotations, and rates that agree with their differences.

use super::{clip, skeleton};
use crate::support::{Random, vulkan_devices};
use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::crowd::{
    CrowdError, CrowdLayer, CrowdLibrary, CrowdValues, MotionStates, MotionTables,
};
use tumble::{
    Device, Engine, EngineOptions, Method, TrackSet, VectorMethod, VectorWidth, WrapMode, method,
};

const TICKS: u32 = 705_600;

/// Clips without scales, of which states say nothing.
fn library(random: &mut Random, joints: usize, method: Method) -> CrowdLibrary {
    let mut library = CrowdLibrary::with_ticks(&skeleton(random, joints), TICKS).unwrap();
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
        library
            .push(&set, method, VectorMethod::BesselOverhauser)
            .unwrap();
    }
    library
}

struct StateResults {
    rotations: Vec<[f32; 4]>,
    positions: Vec<[f32; 3]>,
    world_rotations: Vec<[f32; 4]>,
    velocities: Vec<[f32; 3]>,
    angular_velocities: Vec<[f32; 3]>,
}

fn states(
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
fn instances(random: &mut Random, tables: &MotionTables, count: usize) -> Vec<(u32, u32)> {
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
                let layer = CrowdLayer {
                    speed: 0.0,
                    wrap: WrapMode::Hold,
                    ..CrowdLayer::new(clip as usize).at(tick.into())
                };
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
        // At a key a rate may jump: a few samples have one between the two differences.
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
        }
    }
    let states = MotionStates::default();
    let missing = tables.sample_into(&engine, parts, &[(3, 0)], states);
    assert!(matches!(missing, Err(CrowdError::Missing { index: 3, .. })));
    let states = MotionStates::default();
    let others = tables.sample_into(&engine, (&spans[1..], &cells), &[(0, 0)], states);
    assert_eq!(others, Err(CrowdError::BrokenTables));
}
