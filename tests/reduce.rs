//! Keys are removed: the curve through the remaining ones, as the engine evaluates it, is near every
//! sample.

use glam::{DQuat, DVec3, Quat, Vec3};
use proptest::prelude::*;
use tumble::reduce::{
    ReduceError, ReducedCurve, reduce_rotations, reduce_together, reduce_vectors,
};
use tumble::{Channel, Device, Engine, Layout, SampleTimes, TrackSet, VectorMethod, method};

use crate::support::Random;

const CURVES: [ReducedCurve; 3] = [
    ReducedCurve::Linear,
    ReducedCurve::BesselOverhauser,
    ReducedCurve::GltfCubic,
];

/// The error that an evaluation in f32 may add: radians, or for positions a part of their size.
const ROUNDING: f64 = 1e-6;

fn angle(a: DQuat, b: DQuat) -> f64 {
    let step = a.conjugate() * b;
    2.0 * step.xyz().length().atan2(step.w.abs())
}

/// Samples of a motion that is smooth, or has corners, or stands still for a while.
fn motion(seed: u64, count: usize) -> (Vec<f64>, Vec<DQuat>, Vec<DVec3>) {
    let mut random = Random(seed);
    let speeds: [f64; 6] = std::array::from_fn(|_| random.between(-3.0, 3.0));
    let axis = random.direction();
    let corner = random.between(0.0, 2.0);
    let noise = random.pick(&[0.0, 1e-4, 1e-2]);
    let mut times = Vec::new();
    let mut rotations = Vec::new();
    let mut positions = Vec::new();
    let mut time = random.between(-2.0, 2.0);
    let start = time;
    for _ in 0..count {
        let t = (time - start).min(corner) + 0.3 * (time - start - corner).max(0.0).powi(2);
        let wave = |a: f64, b: f64| (a * t).sin() + (b * t * 1.7).cos();
        let shake = random.direction() * noise;
        rotations.push(
            DQuat::from_scaled_axis(axis * wave(speeds[0], speeds[1]) * 2.0)
                * DQuat::from_rotation_x(wave(speeds[2], speeds[3]))
                * DQuat::from_scaled_axis(shake),
        );
        positions.push(DVec3::new(wave(speeds[4], 1.0), t, wave(speeds[5], speeds[0])) + shake);
        times.push(time);
        time += random.pick(&[0.01, 0.02, 0.05]);
    }
    (times, rotations, positions)
}

fn pick<T: Copy>(all: &[T], indices: &[usize]) -> Vec<T> {
    indices.iter().map(|&i| all[i]).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_sample_is_near(seed in any::<u64>(), count in 2usize..200, power in -4f64..-0.5) {
        let tolerance = 10f64.powf(power);
        let (times, samples, positions) = motion(seed, count);
        let engine = Engine::new(Device::Cpu).unwrap();
        let frames = SampleTimes::at(times.clone());
        for curve in CURVES {
            let found = reduce_rotations(&times, &samples, tolerance, curve).unwrap();
            prop_assert!(found.error <= tolerance, "{curve:?}: {} over {tolerance}", found.error);
            prop_assert!(found.indices.is_sorted_by(|a, b| a < b));
            let last = *found.indices.last().unwrap();
            prop_assert!(found.indices[0] == 0 && (last == count - 1 || found.indices.len() == 1));
            let keys: Vec<Quat> = found.keys.iter().map(|key| key.as_quat()).collect();
            let key_times = pick(&times, &found.indices);
            let mut set = TrackSet::new();
            set.push("", &key_times, &keys).unwrap();
            let how = match curve {
                ReducedCurve::Linear => method::SLERP,
                ReducedCurve::BesselOverhauser => method::BESSEL_OVERHAUSER,
                _ => method::GLTF_CUBIC,
            };
            if curve == ReducedCurve::GltfCubic {
                let tangents = found.tangents.iter().map(|pair| pair.map(DQuat::as_quat));
                set.set_tangents(0, &tangents.collect::<Vec<_>>()).unwrap();
            }
            let evaluated = engine.evaluate(&set, how, &frames).unwrap();
            for (sample, (found, expected)) in evaluated.as_quats().iter().zip(&samples).enumerate() {
                let apart = angle(found.as_dquat(), *expected);
                prop_assert!(apart <= tolerance + ROUNDING, "{curve:?} {sample}: {apart}");
            }

            let found = reduce_vectors(&times, &positions, tolerance, curve).unwrap();
            prop_assert!(found.error <= tolerance, "{curve:?}: {} over {tolerance}", found.error);
            let keys: Vec<Vec3> = found.keys.iter().map(|key| key.as_vec3()).collect();
            let tangents = found.tangents.iter().map(|pair| pair.map(DVec3::as_vec3));
            let tangents: Vec<[Vec3; 2]> = tangents.collect();
            let key_times = pick(&times, &found.indices);
            set.set_translations(0, &key_times, &keys, &tangents).unwrap();
            let how = match curve {
                ReducedCurve::Linear => VectorMethod::Linear,
                ReducedCurve::BesselOverhauser => VectorMethod::BesselOverhauser,
                _ => VectorMethod::GltfCubic,
            };
            let (channel, layout) = (Channel::Translation, Layout::TrackMajor);
            let evaluated = engine
                .vectors(&set, channel, how, method::SLERP, &frames, layout)
                .unwrap();
            for (sample, (found, expected)) in evaluated.as_slice().iter().zip(&positions).enumerate() {
                let apart = found.truncate().as_dvec3().distance(*expected);
                let rounding = ROUNDING * (1.0 + expected.length());
                prop_assert!(apart <= tolerance + rounding, "{curve:?} {sample}: {apart}");
            }
        }
    }

    #[test]
    fn together_each_channel_has_its_own_tolerance(seed in any::<u64>(), power in -3f64..-1.0) {
        let tolerance = 10f64.powf(power);
        let (times, samples, positions) = motion(seed, 120);
        let (_, others, _) = motion(seed ^ 1, 120);
        for curve in CURVES {
            let rotations = [(samples.clone(), tolerance), (others.clone(), 3.0 * tolerance)];
            let vectors = [(positions.clone(), 2.0 * tolerance)];
            let all = reduce_together(&times, &rotations, &vectors, curve).unwrap();
            let bounds = [tolerance, 3.0 * tolerance];
            for (found, bound) in all.rotations.iter().zip(bounds) {
                prop_assert!(found.error <= bound, "{curve:?}: {} over {bound}", found.error);
                prop_assert_eq!(&found.indices, &all.vectors[0].indices);
            }
            prop_assert!(all.vectors[0].error <= 2.0 * tolerance, "{curve:?}");
            // A channel that shares its keys with no other has the keys that it has alone.
            let single = [(samples.clone(), tolerance)];
            let single = reduce_together(&times, &single, &[], curve).unwrap();
            let alone = reduce_rotations(&times, &samples, tolerance, curve).unwrap();
            prop_assert_eq!(&single.rotations[0], &alone, "{:?}", curve);
        }
    }
}

#[test]
fn what_needs_few_keys_gets_few() {
    let times: Vec<f64> = (0..201).map(|i| f64::from(i) * 0.01).collect();
    let about = |angle: fn(f64) -> f64| -> Vec<DQuat> {
        times
            .iter()
            .map(|&t| DQuat::from_rotation_z(angle(t)))
            .collect()
    };
    let even = about(|t| 1.2 * t);
    let corner = about(|t| if t < 0.7 { t } else { 1.4 - t });
    let still = about(|_| 0.3);
    for (samples, curve, keys) in [
        (&even, ReducedCurve::Linear, &[0, 200][..]),
        (&corner, ReducedCurve::Linear, &[0, 70, 200]),
        (&still, ReducedCurve::Linear, &[0]),
        (&still, ReducedCurve::GltfCubic, &[0]),
        (&still, ReducedCurve::BesselOverhauser, &[0]),
        (&even, ReducedCurve::BesselOverhauser, &[0, 200]),
    ] {
        let found = reduce_rotations(&times, samples, 1e-6, curve).unwrap();
        assert_eq!(found.indices, keys, "{curve:?}");
    }
    // A cubic needs only its two end keys.
    let cubic: Vec<DVec3> = times
        .iter()
        .map(|&t| DVec3::new(t * t * t, t * t - t, 1.0 - 2.0 * t))
        .collect();
    let found = reduce_vectors(&times, &cubic, 1e-5, ReducedCurve::GltfCubic).unwrap();
    assert_eq!(found.indices, [0, 200]);
    let leaving = found.tangents[0][1];
    assert!(
        leaving.distance(DVec3::new(0.0, -1.0, -2.0)) < 1e-3,
        "{leaving}"
    );
    // The tangents of a joint that does not move are 0.
    let found = reduce_rotations(&times, &still, 1e-6, ReducedCurve::GltfCubic).unwrap();
    assert_eq!(
        found.tangents[0].map(|tangent| tangent.to_array()),
        [[0.0; 4]; 2]
    );
    // Either sign of a quaternion is the same rotation.
    let signs: Vec<DQuat> = even
        .iter()
        .zip(0..)
        .map(|(q, i)| if i % 3 == 0 { -*q } else { *q })
        .collect();
    let found = reduce_rotations(&times, &signs, 1e-6, ReducedCurve::GltfCubic).unwrap();
    let plain = reduce_rotations(&times, &even, 1e-6, ReducedCurve::GltfCubic).unwrap();
    assert_eq!(found.indices, plain.indices);
}

/// A curve through 26 keys that is sampled densely is reduced to about as many keys.
#[test]
fn samples_of_a_curve_need_few_of_its_keys() {
    let mut random = Random(3);
    let times: Vec<f64> = (0..26).map(|i| f64::from(i) * 0.8).collect();
    let mut key = DQuat::IDENTITY;
    let keys: Vec<Quat> = times
        .iter()
        .map(|_| {
            key = (key * DQuat::from_scaled_axis(random.direction() * 0.9)).normalize();
            key.as_quat()
        })
        .collect();
    let mut set = TrackSet::new();
    set.push("", &times, &keys).unwrap();
    let engine = Engine::new(Device::Cpu).unwrap();
    let dense = engine
        .evaluate(&set, method::BESSEL_OVERHAUSER, &SampleTimes::fps(100))
        .unwrap();
    let samples: Vec<DQuat> = dense.as_quats().iter().map(|q| q.as_dquat()).collect();
    let times: Vec<f64> = (0..samples.len()).map(|i| i as f64 * 0.01).collect();
    let tolerance = 0.1f64.to_radians();
    let count = |curve| {
        let found = reduce_rotations(&times, &samples, tolerance, curve).unwrap();
        println!(
            "{curve:?}: {} of {} keys",
            found.indices.len(),
            samples.len()
        );
        found.indices.len()
    };
    let [linear, bessel, cubic] = CURVES.map(count);
    assert!(
        cubic <= 30 && bessel <= 140 && linear <= 300,
        "{linear} {bessel} {cubic}"
    );
}

#[test]
fn what_cannot_be_reduced_is_refused() {
    let (times, rotations, positions) = motion(1, 20);
    let curve = ReducedCurve::Linear;
    let refused = |times: &[f64], rotations: &[DQuat], tolerance| {
        reduce_rotations(times, rotations, tolerance, curve).unwrap_err()
    };
    let lengths = ReduceError::Lengths {
        samples: 20,
        times: 19,
    };
    assert_eq!(refused(&times[1..], &rotations, 0.1), lengths);
    for tolerance in [-1.0, f64::INFINITY] {
        assert_eq!(
            refused(&times, &rotations, tolerance),
            ReduceError::Tolerance { tolerance }
        );
    }
    let mut wrong = times.clone();
    wrong[7] = wrong[6];
    let time = wrong[7];
    assert_eq!(
        refused(&wrong, &rotations, 0.1),
        ReduceError::Time { index: 7, time }
    );
    let mut wrong = positions.clone();
    wrong[3].y = f64::NAN;
    let found = reduce_vectors(&times, &wrong, 0.1, curve).unwrap_err();
    assert_eq!(found, ReduceError::Sample { index: 3 });
    let mut wrong = rotations.clone();
    wrong[5] = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    assert_eq!(
        refused(&times, &wrong, 0.1),
        ReduceError::Sample { index: 5 }
    );
    for curve in CURVES {
        assert!(
            reduce_rotations(&[], &[], 0.1, curve)
                .unwrap()
                .indices
                .is_empty()
        );
        assert_eq!(
            reduce_vectors(&[0.0], &[DVec3::X], 0.0, curve)
                .unwrap()
                .indices,
            [0]
        );
    }
}
