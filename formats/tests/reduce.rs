//! Clips with few keys: their errors, measured apart from the code that reduces them.

use std::path::Path;

use glam::{DVec3, Quat, Vec3};
use tumble::reduce::ReducedCurve;
use tumble::{Channel, Device, Engine, EngineOptions, SampleTimes, TrackSet, method};
use tumble_formats::format::{MotionOptions, Quantization};
use tumble_formats::motion::{
    ChannelInterpolation, Channels, Joint, Motion, SampledClip, Transform,
};
use tumble_formats::reduce::{ReduceMotionError, ReduceOptions, Reduced, quantize_all, reduce};
use tumble_formats::sample::ChannelMethods;
use tumble_formats::world::{WorldPose, world};
use tumble_formats::{Format, ReadOptions};

use crate::validator::validate;

const TENTH: f64 = 0.1 * std::f64::consts::PI / 180.0;

fn options(curve: ReducedCurve) -> ReduceOptions {
    ReduceOptions {
        curve,
        angle: TENTH,
        distance: None,
        shell: 0.0,
        together: false,
        quantize: None,
    }
}

fn poses(clip: &Motion, times: &[f64]) -> Vec<WorldPose> {
    let engine = Engine::new(Device::Cpu).unwrap();
    let methods = ChannelMethods::AUTHORED;
    let samples = methods
        .sample(&engine, clip, &SampleTimes::at(times.to_vec()))
        .unwrap();
    world(clip, &samples).unwrap()
}

/// The largest angle and the largest distance of joints, and of points about them.
fn apart(clip: &Motion, reduced: &Motion, shell: f64) -> [f64; 2] {
    let times = clip.key_times();
    let mut largest = [0.0f64; 2];
    for (a, b) in poses(clip, &times).iter().zip(poses(reduced, &times)) {
        let angle = a
            .rotation
            .as_dquat()
            .normalize()
            .angle_between(b.rotation.as_dquat().normalize());
        largest[0] = largest[0].max(angle.min(std::f64::consts::TAU - angle));
        for axis in [
            DVec3::ZERO,
            DVec3::X,
            DVec3::NEG_X,
            DVec3::Y,
            DVec3::NEG_Y,
            DVec3::Z,
            DVec3::NEG_Z,
        ] {
            let point =
                |pose: &WorldPose| pose.position + pose.rotation.as_dquat() * (axis * shell);
            largest[1] = largest[1].max(point(a).distance(point(&b)));
        }
    }
    largest
}

fn check(clip: &Motion, reduced: &Reduced, options: &ReduceOptions) -> [f64; 2] {
    let found = apart(clip, &reduced.clip, options.shell);
    // `angle_between` loses half its digits near 0.
    assert!(found[0] <= options.angle + 1e-7, "{found:?}");
    let distance = options.distance.unwrap_or(reduced.bounds[1]);
    assert!(
        found[1] <= distance * (1.0 + 1e-6),
        "{found:?} over {distance}"
    );
    let reported = [0, 1].map(|kind| {
        reduced
            .errors
            .iter()
            .map(|error| error[kind])
            .fold(0.0, f64::max)
    });
    assert!(
        (reported[0] - found[0]).abs() < 2e-7,
        "{reported:?} {found:?}"
    );
    assert!(
        (reported[1] - found[1]).abs() <= 1e-6 * (1.0 + found[1]),
        "{reported:?} {found:?}"
    );
    assert_eq!(reduced.keys, [clip.key_count(), reduced.clip.key_count()]);
    assert_eq!(reduced.clip.set.time_span(), clip.set.time_span());
    found
}

/// A captured walk stays within its bounds in the world, with fewer keys than gltf-transform 4.5
/// (`resample`) takes: at a tolerance of 2.5e-4 it keeps 64 136 keys, up to 0.1183° and 0.0202 away.
#[test]
fn a_captured_walk_is_near_everywhere() {
    let path = Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../shared/data/bvh/cmu_01_01.bvh"
    ));
    if !path.exists() {
        eprintln!("{} is not there: nothing was reduced", path.display());
        return;
    }
    let engine = Engine::new(Device::Cpu).unwrap();
    let loaded = Format::open_detected(path, &ReadOptions::default()).unwrap();
    let clip = &loaded.clips[0];
    for (curve, distance, shell, max_keys) in [
        (ReducedCurve::Linear, Some(0.0202), 0.0, 64_136),
        (ReducedCurve::Linear, None, 0.0, 53_000),
        (ReducedCurve::GltfCubic, Some(0.0202), 0.0, 23_000),
        (ReducedCurve::GltfCubic, Some(0.05), 3.0, 23_000),
    ] {
        let options = ReduceOptions {
            distance,
            shell,
            ..options(curve)
        };
        let reduced = reduce(clip, &engine, &options).unwrap();
        check(clip, &reduced, &options);
        assert!(
            reduced.keys[1] <= max_keys,
            "{curve:?}: {} keys",
            reduced.keys[1]
        );
        assert!(reduced.keys[0] == 88_064);
    }
    assert_bytes_of_keys(clip);
}

/// Motion is kept in 16 bytes a key and segments for few intervals, at the rate of the capture and at that of animations.
fn assert_bytes_of_keys(clip: &Motion) {
    let mut options = EngineOptions::default();
    options.kept_segments = Some(0);
    let engine = Engine::with_options(Device::Cpu, &options).unwrap();
    for rate in [120, 30] {
        let frames = SampleTimes::fps(rate);
        let rotations = engine.evaluate(&clip.set, method::SLERP, &frames).unwrap();
        let times: Vec<f64> = (0..rotations.sample_count())
            .map(|frame| frame as f64 / f64::from(rate))
            .collect();
        let set = TrackSet::with_shared_times(&times, rotations.as_quats()).unwrap();
        for (method, bound) in [
            (method::SLERP, 16.5),
            (method::CATMULL_ROM, 36.0),
            (method::BESSEL_OVERHAUSER, 36.0),
        ] {
            let bytes = engine.upload(&set, method).unwrap().bytes_per_key();
            println!("{method} at {rate} Hz: {bytes:.1} bytes a key");
            assert!(
                (16.0..bound).contains(&bytes),
                "{method} at {rate} Hz: {bytes}"
            );
        }
    }
}

/// A chain of three joints, the child before its parent; the last one steps, one rests, one scales.
fn chain() -> Motion {
    let times: Vec<f64> = (0..90).map(|i| f64::from(i) / 30.0).collect();
    let mut clip = Motion::default();
    let swing = |i: usize, speed: f32| Quat::from_rotation_z((i as f32 * 0.05 * speed).sin());
    for track in 0..4 {
        let keys: Vec<Quat> = (0..90)
            .map(|i| match track {
                2 => swing(i / 30, 9.0),
                _ => swing(i, 1.0 + track as f32) * Quat::from_rotation_x(0.2 * track as f32),
            })
            .collect();
        let key_count = if track == 3 { 1 } else { 90 };
        clip.set
            .push(
                format!("joint{track}"),
                &times[..key_count],
                &keys[..key_count],
            )
            .unwrap();
        let rest = Transform {
            translation: Vec3::Y * 2.0,
            ..Transform::default()
        };
        clip.skeleton.push(Joint {
            parent: [Some(1), None, Some(0), Some(2)][track],
            rest,
        });
        let sampler = [
            ChannelInterpolation::Linear,
            ChannelInterpolation::Linear,
            ChannelInterpolation::Step,
            ChannelInterpolation::Linear,
        ][track];
        clip.channels.push(Channels {
            rotation: (track != 3).then_some(sampler),
            translation: (track == 1).then_some(ChannelInterpolation::Linear),
            scale: (track == 0).then_some(ChannelInterpolation::Linear),
        });
    }
    let positions: Vec<Vec3> = (0..90)
        .map(|i| Vec3::new(i as f32 * 0.1, 1.0, (i as f32 * 0.2).sin()))
        .collect();
    clip.set
        .set_translations(1, &times, &positions, &[])
        .unwrap();
    let sizes: Vec<Vec3> = (0..90)
        .map(|i| Vec3::splat(1.0 + i as f32 * 0.01))
        .collect();
    clip.set.set_scales(0, &times, &sizes, &[]).unwrap();
    clip
}

#[test]
fn steps_rests_and_scales_are_kept() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let clip = chain();
    for curve in [ReducedCurve::Linear, ReducedCurve::GltfCubic] {
        let options = options(curve);
        let reduced = reduce(&clip, &engine, &options).unwrap();
        check(&clip, &reduced, &options);
        let set = &reduced.clip.set;
        let step = set.track(2);
        assert_eq!(step.times, [0.0, 1.0, 2.0]);
        assert_eq!(
            reduced.clip.channels[2].rotation,
            Some(ChannelInterpolation::Step)
        );
        assert_eq!(reduced.clip.channels[3].rotation, None);
        assert_eq!(set.track(3).keys, clip.set.track(3).keys);
        // The scales change linearly, so two keys are enough.
        assert_eq!(set.vector_keys(Channel::Scale, 0).unwrap().times.len(), 2);
        assert!(reduced.keys[1] < reduced.keys[0] / 2, "{:?}", reduced.keys);
    }
}

/// Rotations read from 16 bits are within the bounds, compressed or not, and a file is smaller; the validator
/// finds nothing in it.
#[test]
fn rotations_of_16_bits_stay_within_the_bounds() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let mut clip = chain();
    clip.skeleton[3].rest.rotation = clip.set.track(3).keys[0];
    let folder = tempfile::tempdir().unwrap();
    let (mut files, mut sizes) = (Vec::new(), Vec::new());
    let (plain, packed) = (Quantization::Components, Quantization::Filtered(32767));
    for (quantize, meshopt) in [(None, false), (Some(plain), false), (Some(packed), true)] {
        let options = ReduceOptions {
            quantize,
            ..options(ReducedCurve::Linear)
        };
        let reduced = reduce(&clip, &engine, &options).unwrap();
        let ends = reduced.clip.ends(&engine).unwrap();
        let sampled = SampledClip {
            is_at_keys: true,
            ..ends.of(&reduced.clip, None, &[])
        };
        let mut bytes = Vec::new();
        let motion = MotionOptions {
            quantize,
            meshopt,
            ..MotionOptions::default()
        };
        let glb = Format::named("glb").unwrap();
        glb.write_clips(&[sampled], &motion, &mut bytes).unwrap();
        sizes.push(bytes.len());
        let file = folder
            .path()
            .join(format!("{}{meshopt}.glb", quantize.is_some()));
        std::fs::write(&file, &bytes).unwrap();
        let loaded = glb.open(&file, &ReadOptions::default()).unwrap();
        assert_eq!(loaded.warnings, []);
        let [again] = &loaded.clips[..] else {
            panic!("{}", loaded.clips.len());
        };
        let found = apart(&clip, again, 0.0);
        assert!(found[0] <= TENTH + 1e-7, "{found:?}");
        assert!(found[1] <= reduced.bounds[1] * (1.0 + 1e-6), "{found:?}");
        // The reported errors are those of the rotations as read.
        let reported = reduced
            .errors
            .iter()
            .map(|pair| pair[0])
            .fold(0.0, f64::max);
        assert!((reported - found[0]).abs() < 2e-7, "{reported:e} {found:?}");
        let off = |track: usize| {
            let pairs = again
                .set
                .track(track)
                .keys
                .iter()
                .zip(reduced.clip.set.track(track).keys);
            pairs
                .map(|(a, b)| (*a - *b).length().min((*a + *b).length()))
                .fold(0.0, f32::max)
        };
        assert_eq!(off(0) > 1e-6, quantize.is_some(), "{:e}", off(0));
        assert_eq!(again.set.track(3).keys, reduced.clip.set.track(3).keys);
        files.push(file);
    }
    // A file as short as this one is mostly JSON, so only the order of the sizes is checked.
    assert!(sizes[1] < sizes[0] && sizes[2] < sizes[0], "{sizes:?}");
    for report in validate(&files).into_iter().flatten() {
        assert_eq!(report.errors, [] as [String; 0]);
    }
    // All samples of fewer bits are within the bounds too.
    let options_of = options(ReducedCurve::Linear);
    let (all, bits) = quantize_all(&clip, &engine, &options_of).unwrap().unwrap();
    assert!(
        matches!(bits, Quantization::Filtered(256..=16_384)),
        "{bits:?}"
    );
    assert!(
        all.errors
            .iter()
            .all(|pair| pair[0] <= TENTH && pair[1] <= all.bounds[1])
    );
    assert_eq!(all.clip.set.track(0).times.len(), 90);
    // Half a step of 16 bits is larger than this tolerance.
    let fine = ReduceOptions {
        angle: 1e-5,
        quantize: Some(plain),
        ..options(ReducedCurve::Linear)
    };
    let refused = reduce(&clip, &engine, &fine).unwrap_err().to_string();
    assert!(
        refused.contains("keys are of 16 bits; give a larger tolerance"),
        "{refused}"
    );
}

#[test]
fn keys_at_the_same_times_are_near_too() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let mut clip = chain();
    let together = |curve| ReduceOptions {
        together: true,
        ..options(curve)
    };
    let refused = reduce(&clip, &engine, &together(ReducedCurve::Linear)).unwrap_err();
    assert!(
        matches!(refused, ReduceMotionError::Steps { joint: 2, .. }),
        "{refused}"
    );
    clip.channels[2].rotation = None;
    let kept = clip.set.track(2).keys[..1].to_vec();
    clip.set = {
        let mut set = clip.set.select([0, 1]).unwrap();
        set.push("joint2", &[0.0], &kept).unwrap();
        set.push("joint3", &[0.0], clip.set.track(3).keys).unwrap();
        set
    };
    for curve in [ReducedCurve::Linear, ReducedCurve::BesselOverhauser] {
        let options = together(curve);
        let mut clip = clip.clone();
        if curve == ReducedCurve::BesselOverhauser {
            clip.channels.clear();
        }
        let reduced = reduce(&clip, &engine, &options).unwrap();
        check(&clip, &reduced, &options);
        let times = reduced.clip.set.track(0).times;
        assert!(times.len() < 89, "{curve:?}: {} keys", times.len());
        let moved = reduced
            .clip
            .set
            .vector_keys(Channel::Translation, 1)
            .unwrap();
        assert_eq!(
            (reduced.clip.set.track(1).times, moved.times),
            (times, times)
        );
    }
}

#[test]
fn bounds_that_f32_cannot_hold_are_refused() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let clip = chain();
    let tiny = ReduceOptions {
        angle: 1e-9,
        ..options(ReducedCurve::Linear)
    };
    let refused = reduce(&clip, &engine, &tiny).unwrap_err().to_string();
    assert!(
        refused.contains("keys are f32; give a larger tolerance"),
        "{refused}"
    );
    for wrong in [-1.0, f64::NAN] {
        let wrong = ReduceOptions {
            shell: wrong,
            ..options(ReducedCurve::Linear)
        };
        assert!(reduce(&clip, &engine, &wrong).is_err());
    }
    let still = reduce(&Motion::default(), &engine, &options(ReducedCurve::Linear)).unwrap();
    assert_eq!(still.keys, [0, 0]);
}
