//! Crowds give the engine's results of each clip alone, at each instance's time, with the same bits on every
//! device, in any second of any day.

mod application_device;
mod bodies;
mod compact;
mod device_motions;
mod fades;
mod refusals;
mod stages;
mod states;
mod visible;

use glam::{Affine3A, Quat, Vec3};
use proptest::prelude::*;
use tumble::crowd::{
    Crowd, CrowdError, CrowdLayer, CrowdLibrary, CrowdOutput, CrowdValues, LayerBlend,
};
use tumble::vulkan::tuning::{Mapping, Transfer};
use tumble::{
    Device, Engine, EngineOptions, JointMatchError, Layout, METHODS, Method, SampleTimes, Skeleton,
    TrackSet, VectorMethod, VectorWidth, WrapMode, method,
};

use crate::support::{Random, vulkan_devices};

const ALL: [CrowdValues; 4] = [
    CrowdValues::Rotations,
    CrowdValues::Local,
    CrowdValues::Model,
    CrowdValues::Skinning,
];

/// A skeleton whose joints hang from random ones before them; some are roots.
pub(crate) fn skeleton(random: &mut Random, joints: usize) -> Skeleton {
    let parents = (0..joints)
        .map(|joint| match random.next() % 8 {
            0 => None,
            _ => (joint > 0).then(|| (random.next() % joint as u64) as usize),
        })
        .collect();
    let offsets = (0..joints)
        .map(|_| (random.direction() * random.between(0.1, 1.0)).as_vec3())
        .collect();
    Skeleton::new(parents, offsets).unwrap()
}

/// Keys as games have them: most joints at the same times, some at other times, some constant;
/// a few with translations and scales.
pub(crate) fn clip(random: &mut Random, joints: usize, keys: usize) -> TrackSet {
    let mut shared = Vec::new();
    let mut time = random.between(-1.0, 2.0);
    for _ in 0..keys {
        shared.push(time);
        time += match random.next() % 4 {
            0 => random.between(0.01, 0.7),
            _ => 0.1,
        };
    }
    let mut set = TrackSet::new();
    for joint in 0..joints {
        let key_times: Vec<f64> = match random.next() % 5 {
            0 => shared.iter().step_by(3).copied().collect(),
            1 => shared
                .iter()
                .take(1 + keys / 2)
                .map(|t| t + 0.033)
                .collect(),
            2 => vec![shared[0]],
            _ => shared.clone(),
        };
        let mut rotation = random.rotation();
        let mut rotations = Vec::new();
        for _ in &key_times {
            rotations.push(rotation.as_quat());
            let step = glam::DQuat::from_axis_angle(random.direction(), random.between(0.0, 0.9));
            rotation = (rotation * step).normalize();
        }
        set.push(format!("{joint}"), &key_times, &rotations)
            .unwrap();
        let vectors = |random: &mut Random, from: f64, to: f64| -> Vec<Vec3> {
            let times = shared.iter().step_by(2);
            times
                .map(|_| (random.direction() * random.between(from, to)).as_vec3())
                .collect()
        };
        let times: Vec<f64> = shared.iter().step_by(2).copied().collect();
        if joint.is_multiple_of(3) {
            let keys = vectors(random, 0.0, 2.0);
            set.set_translations(joint, &times, &keys, &[]).unwrap();
        }
        if joint % 4 == 1 {
            let keys: Vec<Vec3> = vectors(random, 0.0, 0.5);
            let keys: Vec<Vec3> = keys.into_iter().map(|key| key + 1.0).collect();
            set.set_scales(joint, &times, &keys, &[]).unwrap();
        }
    }
    set
}

pub(crate) fn cpu() -> Engine {
    Engine::new(Device::Cpu).unwrap()
}

pub(crate) fn bits(values: &[[f32; 4]]) -> Vec<[u32; 4]> {
    values.iter().map(|value| value.map(f32::to_bits)).collect()
}

pub(crate) fn evaluated(crowd: &mut Crowd, values: CrowdValues) -> Vec<[f32; 4]> {
    let mut found = vec![[f32::NAN; 4]; crowd.output_len(values)];
    crowd.evaluate_into(values, &mut found).unwrap();
    found
}

/// Every tick of a clip, each by an instance that stands there, beside the engine's frames.
#[test]
fn every_tick_is_the_engines_frame() {
    const TICKS: u32 = 50;
    let mut random = Random(1);
    for method in METHODS {
        for _ in 0..3 {
            let joints = 7;
            let skeleton = skeleton(&mut random, joints);
            let set = clip(&mut random, joints, 9);
            let mut library = CrowdLibrary::with_ticks(&skeleton, TICKS).unwrap();
            let vectors = VectorMethod::BesselOverhauser;
            match library.push(&set, method, vectors) {
                Ok(_) => {}
                Err(error) if error.to_string().contains("rotates too fast") => continue,
                Err(error) => panic!("{method}: {error}"),
            }
            let period = library.ticks(0).unwrap();
            let count = period as usize;
            let mut crowd = cpu().crowd(&library, count, 1).unwrap();
            for tick in 0..count {
                let still = CrowdLayer::new(0).with_speed(0.0);
                crowd.set(tick, 0, still.at(tick as i64)).unwrap();
            }
            let frames = SampleTimes::fps(TICKS);
            let layout = Layout::FrameMajor;
            let local = cpu()
                .transforms(&set, method, vectors, &frames, layout)
                .unwrap();
            let rotations = evaluated(&mut crowd, CrowdValues::Rotations);
            let expected = &local.rotations.as_arrays()[..rotations.len()];
            assert_eq!(bits(&rotations), bits(expected), "{method}");

            let model = cpu().local_to_model(&local, &skeleton, None).unwrap();
            let found = evaluated(&mut crowd, CrowdValues::Model);
            let expected = model.as_arrays().as_flattened();
            for (index, (found, expected)) in found.iter().zip(expected).enumerate() {
                for (found, expected) in found.iter().zip(expected) {
                    let off = (found - expected).abs() / (1.0 + expected.abs());
                    assert!(off < 2e-6, "{method}, {index}: {found}, {expected}");
                }
            }
        }
    }
}

/// A library of several clips, with masks, references and inverse bind matrices.
pub(crate) fn library(random: &mut Random, joints: usize, methods: &[Method]) -> CrowdLibrary {
    let mut library = CrowdLibrary::new(&skeleton(random, joints)).unwrap();
    for (index, &method) in methods.iter().enumerate() {
        // A clip that rotates too far between keys is refused, and the library stays as it was.
        while library.clip_count() == index {
            let set = clip(random, joints, 2 + 3 * index);
            match library.push(&set, method, VectorMethod::CatmullRom) {
                Ok(_) | Err(CrowdError::TooWild { .. }) => {}
                Err(error) => panic!("{method}: {error}"),
            }
        }
    }
    for mask in 0..2 {
        let weights: Vec<f32> = (0..joints)
            .map(|joint| match (joint + mask) % 3 {
                0 => 0.0,
                1 => 1.0,
                _ => random.unit() as f32,
            })
            .collect();
        library.push_mask(&weights).unwrap();
    }
    library.set_reference(0, methods.len() - 1, 5000).unwrap();
    let bind: Vec<Affine3A> = (0..joints)
        .map(|_| {
            let moved = random.direction().as_vec3();
            Affine3A::from_rotation_translation(random.rotation().as_quat(), moved)
        })
        .collect();
    library.set_inverse_bind(&bind).unwrap();
    library
}

pub(crate) fn layer(random: &mut Random, library: &CrowdLibrary) -> CrowdLayer {
    let clip = (random.next() % library.clip_count() as u64) as usize;
    CrowdLayer::new(clip)
        .at(random.between(-3e6, 3e6) as i64)
        .with_speed(random.pick(&[0.0, 1.0, 1.0, -1.0, 0.37, -2.25, 100.0]))
        .with_wrap(random.pick(&[WrapMode::Hold, WrapMode::Loop, WrapMode::Mirror]))
        .with_weight(random.pick(&[0.0, 1.0, 0.25, 0.7]))
        .with_blend(match random.next().is_multiple_of(2) {
            true => LayerBlend::Additive,
            false => LayerBlend::Over,
        })
        .with_mask(random.pick(&[None, Some(0), Some(1)]))
}

/// Crowds on the CPU at every width and on every Vulkan device, there with a kernel for each step and with one for
/// whole instances, which play the same.
fn crowds(library: &CrowdLibrary, instances: usize, layers: usize) -> Vec<(String, Crowd)> {
    let mut all = Vec::new();
    for width in VectorWidth::available() {
        let mut options = EngineOptions::default();
        options.vector_width = Some(width);
        let engine = Engine::with_options(Device::Cpu, &options).unwrap();
        let crowd = engine.crowd(library, instances, layers).unwrap();
        all.push((format!("CPU, {width:?}"), crowd));
    }
    for device in vulkan_devices() {
        for (transfer, mapping) in [
            (Transfer::InPlace, Mapping::Runs),
            (Transfer::Staged, Mapping::Runs),
            (Transfer::InPlace, Mapping::Samples),
            (Transfer::Staged, Mapping::Samples),
        ] {
            let mut options = EngineOptions::default();
            options.mapping = mapping;
            options.transfer = transfer;
            if transfer == Transfer::Staged {
                crate::support::stage(&mut options, instances);
                options.memory = Some(4096); // so that windows are as short as they may be
            }
            let engine = Engine::with_options(device.clone(), &options).unwrap();
            let crowd = engine.crowd(library, instances, layers).unwrap();
            let name = engine.device_name();
            all.push((format!("{name}, {transfer:?}, {mapping:?}"), crowd));
        }
    }
    all
}

const SOME: [Method; 4] = [
    method::SLERP,
    method::BESSEL_OVERHAUSER,
    method::STEP,
    method::CATMULL_ROM,
];

/// Crowds of one layer of arcs, whose instances have one time base or several: on cards subgroups evaluate them.
#[test]
fn crowds_of_arcs_have_the_bits_of_the_cpu() {
    const JOINTS: usize = 16;
    const INSTANCES: usize = 37;
    let mut random = Random(11);
    for shares_times in [true, false] {
        let mut library = CrowdLibrary::new(&skeleton(&mut random, JOINTS)).unwrap();
        for keys in [9, 61] {
            let mut set = clip(&mut random, JOINTS, keys);
            if shares_times {
                let times: Vec<f64> = (0..keys).map(|key| key as f64 / 8.0).collect();
                set = TrackSet::new();
                for _ in 0..JOINTS {
                    let first = random.rotation().as_quat();
                    let later = |key: usize| first * Quat::from_rotation_y(0.4 * key as f32);
                    let rotations: Vec<Quat> = (0..keys).map(later).collect();
                    set.push("", &times, &rotations).unwrap();
                }
            }
            library
                .push(&set, method::SLERP, VectorMethod::Linear)
                .unwrap();
        }
        let mut all = crowds(&library, INSTANCES, 1);
        let layers: Vec<_> = (0..INSTANCES)
            .map(|_| layer(&mut random, &library))
            .collect();
        let plays = |layer: &CrowdLayer| layer.with_mask(None).with_blend(LayerBlend::Over);
        for ticks in [0, 11_760, 1 << 33] {
            let mut expected = None;
            for (name, crowd) in &mut all {
                if ticks == 0 {
                    let slots = layers.iter().map(plays).enumerate();
                    slots.for_each(|(slot, layer)| crowd.set(slot, 0, layer).unwrap());
                }
                crowd.advance_ticks(ticks).unwrap();
                let found = bits(&evaluated(crowd, CrowdValues::Rotations));
                let expected = expected.get_or_insert_with(|| found.clone());
                assert!(found == *expected, "{name}, {shares_times}, {ticks}");
            }
        }
    }
}

/// Random libraries, instances, layers, wrap modes and times: the same bits everywhere, when some
/// instances change and when only the clock moves.
#[test]
fn every_device_has_the_bits_of_the_cpu() {
    let mut random = Random(7);
    for (round, (joints, instances, layers)) in [(1, 3, 1), (60, 37, 1), (19, 150, 2), (33, 65, 4)]
        .into_iter()
        .enumerate()
    {
        let library = library(&mut random, joints, &SOME[..=round]);
        let mut all = crowds(&library, instances, layers);
        for step in 0..4 {
            let changed: Vec<_> = (0..instances * layers)
                .filter(|_| step == 0 || random.next().is_multiple_of(5))
                .collect();
            let plays: Vec<_> = (changed.into_iter())
                .map(|slot| (slot, layer(&mut random, &library)))
                .collect();
            let ticks = [0, 11_760, 1 << 33, 61_000_000_000][step];
            let mut expected: Vec<Vec<[u32; 4]>> = Vec::new();
            for (name, crowd) in &mut all {
                for &(slot, plays) in &plays {
                    crowd.set(slot / layers, slot % layers, plays).unwrap();
                }
                crowd.advance_ticks(ticks).unwrap();
                for (i, values) in ALL.into_iter().enumerate() {
                    let found = bits(&evaluated(crowd, values));
                    match expected.get(i) {
                        None => expected.push(found),
                        Some(expected) => {
                            let first = expected.iter().zip(&found).position(|(a, b)| a != b);
                            assert_eq!(first, None, "{name}, {values:?}, step {step}");
                        }
                    }
                    let mut half = vec![[0; 4]; crowd.output_len(values)];
                    crowd.evaluate_half_into(values, &mut half).unwrap();
                    let same = |(half, single): (&[u16; 4], &[u32; 4])| {
                        (half.iter().zip(single)).all(|(&half, &single)| {
                            let nearest = half::f16_bits(f32::from_bits(single));
                            half == nearest
                        })
                    };
                    let rounded = half.iter().zip(&expected[i]).all(same);
                    assert!(rounded, "{name}, {values:?} in 16 bits");
                }
            }
            // Every value was written, and none is NaN or infinite (the memory was filled with NaN).
            let numbers = expected.iter().flatten().flatten();
            assert!(
                numbers
                    .into_iter()
                    .all(|&bits| f32::from_bits(bits).is_finite())
            );
        }
    }
}

/// Instances that are too large for a workgroup's memory, by their joints or by their time bases, of which up to 100
/// joints have one each; and those that are just small enough.
#[test]
fn instances_that_are_too_large_for_a_workgroup_have_the_same_bits() {
    let mut random = Random(83);
    for (joints, layers) in [(256, 1), (257, 1), (32, 4), (33, 4)] {
        let mut library = CrowdLibrary::new(&skeleton(&mut random, joints)).unwrap();
        let mut set = TrackSet::new();
        for joint in 0..joints {
            let times = [0.0, 0.5, 1.1, 1.6].map(|time| time + 0.01 * (joint % 100) as f64);
            let keys = times.map(|_| random.rotation().as_quat());
            set.push(format!("{joint}"), &times, &keys).unwrap();
        }
        library
            .push(&set, method::SLERP, VectorMethod::Linear)
            .unwrap();
        library
            .set_inverse_bind(&vec![Affine3A::from_translation(Vec3::ONE); joints])
            .unwrap();
        let plays: Vec<_> = (0..40 * layers)
            .map(|slot| (slot / layers, slot % layers))
            .map(|(instance, layer)| {
                let time = random.between(0.0, 1e6) as i64;
                let plays = CrowdLayer::new(0).at(time);
                (instance, layer, plays.with_weight(0.6))
            })
            .collect();
        let mut expected = Vec::new();
        for (name, mut crowd) in crowds(&library, 40, layers) {
            crowd.set_all(&plays).unwrap();
            let found = ALL.map(|values| bits(&evaluated(&mut crowd, values)));
            if expected.is_empty() {
                expected = found.to_vec();
            }
            assert!(
                found[..] == expected,
                "{name}, {joints} joints, {layers} layers"
            );
        }
    }
}

/// Half precision, by the definition: the nearest half, ties to even.
mod half {
    pub(super) fn f16_bits(value: f32) -> u16 {
        let sign = ((value.to_bits() >> 16) & 0x8000) as u16;
        let size = f64::from(value.abs());
        // All halves from 0 on lie in the order of their bits.
        let of = |bits: u16| match bits >> 10 {
            0 => f64::from(bits) * 2f64.powi(-24),
            exponent => f64::from(bits & 0x3ff | 0x400) * 2f64.powi(i32::from(exponent) - 25),
        };
        let (mut above, mut end) = (0u16, 0x7c00u16);
        while above < end {
            let middle = above.midpoint(end);
            match of(middle) < size {
                true => above = middle + 1,
                false => end = middle,
            }
        }
        if above == 0 {
            return sign;
        }
        let below = above - 1;
        let (down, up) = (size - of(below), of(above) - size);
        let nearer = match down.partial_cmp(&up) {
            Some(std::cmp::Ordering::Less) => below,
            Some(std::cmp::Ordering::Greater) => above,
            _ => below + below % 2,
        };
        sign | nearer
    }
}

/// In a loop, days and whole periods change nothing.
#[test]
fn a_day_later_the_bits_are_those_of_the_first_second() {
    let mut random = Random(11);
    let library = library(&mut random, 12, &[method::SLERP]);
    let period = u64::from(library.ticks(0).unwrap());
    let day = 24 * 3600 * u64::from(library.ticks_per_second());
    let whole = day.div_ceil(period) * period;
    for (_, mut crowd) in crowds(&library, 40, 1) {
        for instance in 0..40 {
            let plays = CrowdLayer::new(0)
                .at(instance as i64 * 12_345)
                .with_speed(random.pick(&[1.0, -1.0, 2.0]))
                .with_wrap(WrapMode::Loop);
            crowd.set(instance, 0, plays).unwrap();
        }
        crowd.set_clock(4_321).unwrap();
        let first = bits(&evaluated(&mut crowd, CrowdValues::Model));
        for days in [1, 2, 30, 400] {
            crowd.set_clock(4_321 + days * whole).unwrap();
            assert_eq!(
                bits(&evaluated(&mut crowd, CrowdValues::Model)),
                first,
                "{days}"
            );
        }
        // And back again.
        crowd.set_clock(4_321).unwrap();
        assert_eq!(bits(&evaluated(&mut crowd, CrowdValues::Model)), first);
    }
}

/// Many steps and one jump give the same state; a time in the clip and the clock's are the same.
#[test]
fn steps_add_up_without_a_rounding() {
    let mut random = Random(13);
    let library = library(&mut random, 5, &[method::SLERP, method::BESSEL_OVERHAUSER]);
    let engine = cpu();
    let [mut slow, mut fast] = [0; 2].map(|_| engine.crowd(&library, 60, 2).unwrap());
    for slot in 0..120 {
        let plays = layer(&mut random, &library);
        for crowd in [&mut slow, &mut fast] {
            crowd.set(slot / 2, slot % 2, plays).unwrap();
        }
    }
    for _ in 0..1000 {
        slow.advance(1.0 / 60.0).unwrap();
    }
    fast.advance_ticks(1000 * 11_760).unwrap();
    let [a, b] = [&mut slow, &mut fast].map(|crowd| bits(&evaluated(crowd, CrowdValues::Local)));
    assert_eq!(a, b);
    // Setting the layer that `get` returns changes nothing where speeds are whole.
    for slot in 0..120 {
        let layer = slow.get(slot / 2, slot % 2).unwrap();
        if layer.speed.fract() == 0.0 {
            slow.set(slot / 2, slot % 2, layer).unwrap();
        }
    }
    assert_eq!(bits(&evaluated(&mut slow, CrowdValues::Local)), a);
}

/// Layers are those of `mix` and `add`.
#[test]
fn layers_are_mixed_and_added_as_poses_are() {
    let mut random = Random(17);
    let joints = 9;
    let skeleton = skeleton(&mut random, joints);
    let sets = [0; 2].map(|_| clip(&mut random, joints, 6));
    let mut library = CrowdLibrary::new(&skeleton).unwrap();
    for set in &sets {
        library
            .push(set, method::SLERP, VectorMethod::Linear)
            .unwrap();
    }
    let engine = cpu();
    let mut crowd = engine.crowd(&library, 1, 2).unwrap();
    let still = |clip| {
        CrowdLayer::new(clip)
            .with_speed(0.0)
            .with_wrap(WrapMode::Hold)
    };
    let sources = [0, 1].map(|clip| {
        crowd.set(0, 0, still(clip).at(300_000)).unwrap();
        evaluated(&mut crowd, CrowdValues::Rotations)
    });
    crowd.set(0, 0, still(1)).unwrap();
    let reference = evaluated(&mut crowd, CrowdValues::Rotations);
    let quats = |values: &[[f32; 4]]| -> Vec<Quat> {
        values.iter().map(|&q| Quat::from_array(q)).collect()
    };
    let rotations = |values: &[[f32; 4]]| {
        let mut set = TrackSet::new();
        for (joint, key) in quats(values).into_iter().enumerate() {
            set.push(format!("{joint}"), &[0.0], &[key]).unwrap();
        }
        engine
            .evaluate(&set, method::STEP, &SampleTimes::at(vec![0.0]))
            .unwrap()
    };
    let [below, above] = [&sources[0], &sources[1]].map(|values| rotations(values));
    crowd.set(0, 0, still(0).at(300_000)).unwrap();
    for weight in [0.25, 0.5, 1.0] {
        let over = still(1).at(300_000).with_weight(weight);
        crowd.set(0, 1, over).unwrap();
        let expected = engine.mix(&below, &above, weight).unwrap();
        let found = evaluated(&mut crowd, CrowdValues::Rotations);
        assert_eq!(bits(&found), bits(expected.as_arrays()));
        let additive = over.with_blend(LayerBlend::Additive);
        crowd.set(0, 1, additive).unwrap();
        let expected = engine
            .add(&below, &above, &quats(&reference), weight)
            .unwrap();
        let found = evaluated(&mut crowd, CrowdValues::Rotations);
        assert_eq!(bits(&found), bits(expected.as_arrays()));
    }
}

/// A game may change the local transforms between the stages; where it changes nothing, the bits are those of a crowd that
/// evaluates all stages at once.
#[test]
fn stages_have_the_bits_of_the_whole() {
    let mut random = Random(31);
    let library = library(&mut random, 13, &[method::SLERP, method::BESSEL_OVERHAUSER]);
    let mut crowd = cpu().crowd(&library, 37, 2).unwrap();
    for entry in 0..2 * 37 {
        let plays = layer(&mut random, &library);
        crowd.set(entry / 2, entry % 2, plays).unwrap();
    }
    let mut poses = evaluated(&mut crowd, CrowdValues::Local);
    // In parts, as several threads do it.
    let (front, back) = poses.split_at_mut(3 * 13 * 20);
    for part in [front, back, &mut []] {
        library.local_to_model(part).unwrap();
    }
    let expected = evaluated(&mut crowd, CrowdValues::Model);
    assert_eq!(bits(&poses), bits(&expected));
    library.model_to_skinning(&mut poses).unwrap();
    let expected = evaluated(&mut crowd, CrowdValues::Skinning);
    assert_eq!(bits(&poses), bits(&expected));
    let refused = library.local_to_model(&mut [[0.0; 4]; 40]).unwrap_err();
    assert_eq!(
        refused,
        CrowdError::PartOfPose {
            length: 40,
            each: 39
        }
    );
    let unbound = CrowdLibrary::new(&skeleton(&mut random, 2)).unwrap();
    let refused = unbound.model_to_skinning(&mut [[0.0; 4]; 6]).unwrap_err();
    assert_eq!(refused, CrowdError::NoInverseBind);
}

/// Clips whose tracks are in another order have the same bits, and clips of other joints are refused, without a change
/// of the library.
#[test]
fn joints_are_matched_by_name() {
    let mut random = Random(23);
    let joints = 9;
    let skeleton = skeleton(&mut random, joints);
    let first = clip(&mut random, joints, 6);
    let order = [4, 0, 8, 2, 6, 1, 3, 7, 5];
    let shuffled = first.select(order).unwrap();
    let names: Vec<String> = (0..joints).map(|joint| first.track_name(joint)).collect();
    let linear = VectorMethod::Linear;
    for named in [false, true] {
        let skeleton = match named {
            false => skeleton.clone(),
            true => skeleton.clone().with_names(names.clone()).unwrap(),
        };
        let mut library = CrowdLibrary::new(&skeleton).unwrap();
        assert_eq!(library.joint_names().is_empty(), !named);
        // Without names, the first clip is in the order of the skeleton.
        let sets = match named {
            false => [&first, &shuffled],
            true => [&shuffled, &first],
        };
        for set in sets {
            library.push(set, method::SLERP, linear).unwrap();
        }
        assert_eq!(library.joint_names(), names);
        let mut other = first.clone();
        other.set_name(3, "Third").unwrap();
        let refused = library.push(&other, method::SLERP, linear).unwrap_err();
        assert_eq!(
            refused.to_string(),
            format!(
                "the library has a joint `{}`, the clip has none of that name",
                names[3]
            )
        );
        let unnamed: Vec<&[Quat]> = first.tracks().map(|track| track.keys).collect();
        let mut set = TrackSet::new();
        for (track, keys) in unnamed.into_iter().enumerate() {
            set.push("", first.track(track).times, keys).unwrap();
        }
        let refused = library.push(&set, method::SLERP, linear).unwrap_err();
        assert!(
            matches!(&refused, CrowdError::OtherJoints(error) if matches!(**error, JointMatchError::Unnamed { .. })),
            "{refused}"
        );
        assert_eq!(library.clip_count(), 2);
        let mut crowd = cpu().crowd(&library, 2, 1).unwrap();
        for instance in 0..2 {
            let plays = CrowdLayer::new(instance).at(300_000);
            crowd.set(instance, 0, plays).unwrap();
        }
        for values in [CrowdValues::Model, CrowdValues::Rotations] {
            let found = bits(&evaluated(&mut crowd, values));
            let (one, other) = found.split_at(found.len() / 2);
            assert_eq!(one, other, "{values:?}");
        }
    }
    let refused = skeleton.with_names(["one"]).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "1 name for 9 tracks; give one for each"
    );
}

proptest! {
    /// A time and the same time whole periods later are one, whatever the clock says.
    #[test]
    fn whole_periods_change_nothing(
        (time, periods, clock) in (0i64..1 << 40, -1000i64..1000, 0u64..1 << 50),
        speed in -100.0f32..100.0,
    ) {
        let mut set = TrackSet::new();
        let keys = [0.0, 1.0, 0.3].map(Quat::from_rotation_x);
        set.push("", &[0.0, 0.4, 1.1], &keys).unwrap();
        let mut library = CrowdLibrary::new(&Skeleton::chain(1, 1.0).unwrap()).unwrap();
        library.push(&set, method::SLERP, VectorMethod::Linear).unwrap();
        let period = i64::from(library.ticks(0).unwrap());
        let mut crowd = cpu().crowd(&library, 2, 1).unwrap();
        crowd.set_clock(clock).unwrap();
        for (instance, time) in [time, time + 2 * periods * period].into_iter().enumerate() {
            for wrap in [WrapMode::Loop, WrapMode::Mirror] {
                let plays = CrowdLayer::new(0).at(time).with_speed(speed).with_wrap(wrap);
                crowd.set(instance, 0, plays).unwrap();
            }
        }
        crowd.advance(0.7).unwrap();
        let found = bits(&evaluated(&mut crowd, CrowdValues::Rotations));
        prop_assert_eq!(found[0], found[1]);
    }
}

/// Work in flight is polled, waited for and taken once; changes made meanwhile take effect in the next submission.
#[test]
fn submissions_are_taken_once() {
    let mut random = Random(19);
    let library = library(&mut random, 8, &[method::SLERP, method::CATMULL_ROM]);
    for (name, mut crowd) in crowds(&library, 20, 1) {
        let still = evaluated(&mut crowd, CrowdValues::Rotations);
        let mut found = vec![[0.0; 4]; still.len()];
        assert!(crowd.poll().is_err() && crowd.wait_into(&mut found).is_err());
        crowd.submit(CrowdValues::Rotations).unwrap();
        crowd.set(3, 0, CrowdLayer::new(1).at(100_000)).unwrap();
        assert!(crowd.submit(CrowdValues::Local).is_err(), "{name}");
        let at_once = crowd.evaluate_into(CrowdValues::Rotations, &mut found);
        assert_eq!(at_once.unwrap_err(), CrowdError::StillSubmitted, "{name}");
        let mut half = vec![[0; 4]; still.len()];
        assert!(crowd.wait_half_into(&mut half).is_err());
        while !crowd.poll().unwrap() {
            std::thread::yield_now();
        }
        crowd.wait_into(&mut found).unwrap();
        assert_eq!(bits(&found), bits(&still), "{name}");
        crowd
            .submit(CrowdOutput::from(CrowdValues::Rotations))
            .unwrap();
        crowd.wait_into(&mut found).unwrap();
        let moved: Vec<_> = (0..still.len()).filter(|&i| found[i] != still[i]).collect();
        assert!(
            !moved.is_empty() && moved.iter().all(|index| index / 8 == 3),
            "{name}: {moved:?}"
        );
    }
}
