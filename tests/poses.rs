//! Poses from poses: layers that are blended, mixed and added, and local poses that are converted
//! to the world. They have the same bits on every device, and are near the textbook formulas.

#[cfg(feature = "vulkan")]
mod buffers;

use crate::support::{Random, hostile_set, vulkan_devices};
use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::reference::{angle_between, slerp};
use tumble::{
    Device, Engine, EngineOptions, Error, Layout, PoseError, Rotations, SampleTimes, Skeleton,
    TrackSet, WorldPoses, method,
};

fn engines() -> Vec<Engine> {
    let mut engines = vec![Engine::new(Device::Cpu).unwrap()];
    for device in vulkan_devices() {
        for memory in [None, Some(100_000)] {
            let mut options = EngineOptions::default();
            options.memory = memory;
            engines.push(Engine::with_options(device.clone(), &options).unwrap());
        }
    }
    engines
}

fn layers(layout: Layout) -> Vec<Rotations> {
    let engine = Engine::new(Device::Cpu).unwrap();
    let frames = SampleTimes::fps(30).between(0.0, 5.0);
    (0..3)
        .map(|seed| {
            let set = hostile_set(seed, 64);
            let method = [method::SLERP, method::BESSEL_OVERHAUSER, method::STEP][seed as usize];
            engine
                .request(&set, method, &frames)
                .layout(layout)
                .evaluate()
                .unwrap()
        })
        .collect()
}

fn bits(values: &[Quat]) -> Vec<[u32; 4]> {
    values
        .iter()
        .map(|q| q.to_array().map(f32::to_bits))
        .collect()
}

fn exact(layer: &Rotations, index: usize) -> DQuat {
    layer.as_quats()[index].as_dquat().normalize()
}

/// Asserts the same bits of all engines; the result of the first.
fn agreed(label: &str, of: impl Fn(&Engine) -> Rotations) -> Rotations {
    let engines = engines();
    let first = of(&engines[0]);
    for engine in &engines[1..] {
        let found = of(engine);
        assert!(
            bits(first.as_quats()) == bits(found.as_quats()),
            "{label} on {}",
            engine.device_name()
        );
    }
    first
}

#[test]
fn a_blend_is_the_normalised_sum() {
    let layers = layers(Layout::TrackMajor);
    let weights = [0.5, 0.3, 0.4];
    let pairs: Vec<_> = layers.iter().zip(weights).collect();
    let found = agreed("blend", |engine| engine.blend(&pairs).unwrap());
    for i in 0..found.as_quats().len() {
        let first = exact(&layers[0], i);
        let mut sum = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        for (layer, weight) in &pairs {
            let rotation = exact(layer, i);
            let sign = if rotation.dot(first) < 0.0 { -1.0 } else { 1.0 };
            sum += rotation * (sign * f64::from(*weight));
        }
        let off = angle_between(found.as_quats()[i].as_dquat(), sum.normalize());
        // At a right angle, the sign depends on rounding.
        let doubtful = pairs
            .iter()
            .any(|(layer, _)| exact(layer, i).dot(first).abs() < 1e-6);
        assert!(off < 2e-6 || doubtful, "{i}: {off:e}");
    }
}

#[test]
fn a_mix_is_slerp() {
    let layers = layers(Layout::FrameMajor);
    for weight in [0.0, 0.25, 0.7, 1.0] {
        let mix = |engine: &Engine| engine.mix(&layers[0], &layers[1], weight).unwrap();
        let found = agreed("mix", mix);
        for i in 0..found.as_quats().len() {
            let (a, b) = (exact(&layers[0], i), exact(&layers[1], i));
            if a.dot(b).abs() < 1e-6 {
                continue; // either way
            }
            let near = if a.dot(b) < 0.0 { -b } else { b };
            let expected = slerp(a, near, f64::from(weight));
            let off = angle_between(found.as_quats()[i].as_dquat(), expected);
            assert!(off < 2e-6, "{i}, {weight}: {off:e}");
        }
    }
}

#[test]
fn an_added_layer_turns_the_base_on() {
    for layout in [Layout::TrackMajor, Layout::FrameMajor] {
        let layers = layers(layout);
        let mut random = Random(8);
        let reference: Vec<Quat> = (0..64).map(|_| random.rotation().as_quat()).collect();
        for weight in [0.0, 0.4, 1.0] {
            let add = |engine: &Engine| {
                engine
                    .add(&layers[0], &layers[1], &reference, weight)
                    .unwrap()
            };
            let found = agreed("add", add);
            for (track, reference) in reference.iter().enumerate() {
                for sample in 0..found.sample_count() {
                    let get = |layer: &Rotations| layer.get(track, sample).unwrap().as_dquat();
                    let difference = reference.as_dquat().normalize().inverse() * get(&layers[1]);
                    if difference.w.abs() < 1e-6 {
                        continue; // half a turn, either way
                    }
                    let difference = if difference.w < 0.0 {
                        -difference
                    } else {
                        difference
                    };
                    let part = slerp(DQuat::IDENTITY, difference, f64::from(weight));
                    let off = angle_between(get(&found), get(&layers[0]) * part);
                    assert!(off < 3e-6, "{track}, {sample}: {off:e}");
                }
            }
        }
    }
}

fn world_bits(poses: &WorldPoses) -> Vec<u32> {
    let values = poses.as_slice().as_flattened();
    values.iter().map(|value| value.to_bits()).collect()
}

/// A tree whose tracks are in no order.
#[test]
fn worlds_follow_their_parents() {
    let mut random = Random(5);
    let tracks = 64;
    // Track 7 is the root; the parent of every other track is one that has its parent already.
    let mut order: Vec<usize> = (0..tracks).collect();
    order.swap(0, 7);
    for i in (2..tracks).rev() {
        order.swap(i, 1 + (random.next() as usize) % i);
    }
    let mut parents = vec![None; tracks];
    for i in 1..tracks {
        let ancestor = (random.next() as usize) % i;
        parents[order[i]] = (i % 20 != 0).then_some(order[ancestor]);
    }
    let offsets: Vec<Vec3> = (0..tracks)
        .map(|_| (random.direction() * random.between(0.0, 3.0)).as_vec3())
        .collect();
    let skeleton = Skeleton::new(parents.clone(), offsets.clone()).unwrap();
    for layout in [Layout::TrackMajor, Layout::FrameMajor] {
        let local = &layers(layout)[1];
        let engines = engines();
        let found = engines[0].world(local, &skeleton).unwrap();
        for engine in &engines[1..] {
            let other = engine.world(local, &skeleton).unwrap();
            assert!(
                world_bits(&found) == world_bits(&other),
                "{}",
                engine.device_name()
            );
        }
        for sample in 0..local.sample_count() {
            let mut world = vec![(DQuat::IDENTITY, DVec3::ZERO); tracks];
            for &track in &order {
                let local_rotation = local.get(track, sample).unwrap().as_dquat();
                let hung = offsets[track].as_dvec3();
                world[track] = match parents[track] {
                    None => (local_rotation, hung),
                    Some(parent) => {
                        let (above, at): (DQuat, DVec3) = world[parent];
                        ((above * local_rotation).normalize(), at + above * hung)
                    }
                };
                let rotation = found.rotation(track, sample).unwrap().as_dquat();
                assert!(angle_between(rotation, world[track].0) < 6e-6);
                let position = found.position(track, sample).unwrap().as_dvec3();
                assert!((position - world[track].1).length() < 1e-4);
            }
        }
        assert_eq!(found.position(tracks, 0), None);
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let all = layers(Layout::TrackMajor);
    let set = hostile_set(1, 3);
    let short = engine
        .evaluate(&set, method::SLERP, &SampleTimes::fps(2))
        .unwrap();
    let refused = |result: Result<Rotations, Error>| match result {
        Err(Error::Pose(error)) => error,
        other => panic!("{other:?}"),
    };
    assert_eq!(refused(engine.blend(&[])), PoseError::NoLayer);
    assert!(matches!(
        refused(engine.blend(&[(&short, f32::NAN)])),
        PoseError::WeightNotFinite { layer: 0, .. }
    ));
    assert!(matches!(
        refused(engine.mix(&short, &all[0], 0.5)),
        PoseError::Shape { layer: 1, .. }
    ));
    assert_eq!(
        refused(engine.mix(&short, &short, 1.5)),
        PoseError::WeightOutOfRange { weight: 1.5 }
    );
    assert_eq!(
        refused(engine.add(&short, &short, &[], 0.5)),
        PoseError::References {
            references: 0,
            tracks: 3
        }
    );
    let world = engine.world(&short, &Skeleton::chain(2, 1.0).unwrap());
    assert!(matches!(
        world,
        Err(Error::Pose(PoseError::Skeleton {
            skeleton_tracks: 2,
            tracks: 3
        }))
    ));
    let nothing = engine
        .evaluate(&TrackSet::new(), method::SLERP, &SampleTimes::fps(2))
        .unwrap();
    let world = engine
        .world(&nothing, &Skeleton::chain(0, 1.0).unwrap())
        .unwrap();
    assert_eq!((world.track_count(), world.as_slice().len()), (0, 0));
}
