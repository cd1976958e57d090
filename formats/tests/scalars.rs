//! Scalars of clips: stored with the clip, and changed or kept with it by every operation.

use tumble::glam::{DQuat, Quat};
use tumble::reduce::ReducedCurve;
use tumble::{Device, Engine, SampleTimes, Smoothing, SmoothingKernel};
use tumble_formats::adjust::adjust;
use tumble_formats::compare::ClipPair;
use tumble_formats::format::MotionOptions;
use tumble_formats::keyed::{KeyedError, keyed};
use tumble_formats::motion::{ChannelInterpolation, Motion, Scalar, ScalarKind};
use tumble_formats::npz::read_npz;
use tumble_formats::reduce::{ReduceOptions, reduce};
use tumble_formats::sample::ChannelMethods;
use tumble_formats::smooth::SmoothJob;
use tumble_formats::trim::trim;
use tumble_formats::{Code, Format, ReadOptions};

const TIMES: [f64; 4] = [0.0, 0.5, 1.0, 1.5];

/// A root that does not move, a hinge with limits, a slide and a contact.
fn clip() -> Motion {
    let mut clip = Motion::default();
    clip.set.push("root", &TIMES, &[Quat::IDENTITY; 4]).unwrap();
    let knee = Scalar {
        limits: Some([-1.0, 2.0]),
        interpolation: Some(ChannelInterpolation::Linear),
        ..Scalar::of(ScalarKind::Angle)
    };
    let lift = Scalar {
        interpolation: Some(ChannelInterpolation::Linear),
        ..Scalar::of(ScalarKind::Length)
    };
    for (name, scalar, keys) in [
        ("knee", knee, [0.0, 1.0, -1.0, 0.5]),
        ("lift", lift, [0.25, 0.5, 0.75, 1.0]),
        (
            "touch",
            Scalar::of(ScalarKind::Contact),
            [0.0, 1.0, 1.0, 0.0],
        ),
    ] {
        let index = clip.set.push_scalar(name, &TIMES, &keys, &[]).unwrap();
        assert_eq!(index, clip.scalars.len());
        clip.scalars.push(scalar);
    }
    clip
}

fn keys(clip: &Motion, name: &str) -> (Vec<f64>, Vec<f32>) {
    let scalar = clip
        .set
        .scalar(clip.set.scalar_named(name).unwrap())
        .unwrap();
    (scalar.times.to_vec(), scalar.keys.to_vec())
}

fn engine() -> Engine {
    Engine::new(Device::Cpu).unwrap()
}

/// Each by its own sampler: lines, and steps of contacts, whatever method is asked for.
#[test]
fn scalars_are_sampled_by_their_samplers() {
    let frames = SampleTimes::at(vec![0.25, 0.75]);
    let samples = ChannelMethods::AUTHORED
        .sample(&engine(), &clip(), &frames)
        .unwrap();
    assert_eq!(samples.scalars, [0.5, 0.375, 0.0, 0.0, 0.625, 1.0]);
}

#[test]
fn our_npz_keeps_scalars_with_names_kinds_and_limits() {
    let clip = clip();
    let samples = keyed(&clip).unwrap();
    let format = Format::named("npz").unwrap();
    let mut bytes = Vec::new();
    let sampled = [samples.of(&clip, Some("2".parse().unwrap()), &[])];
    let warnings = format
        .write_clips(&sampled, &MotionOptions::default(), &mut bytes)
        .unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    let again = read_npz("a.npz", bytes, &ReadOptions::default()).unwrap();
    assert_eq!(again.warnings, []);
    let again = &again.clips[0];
    assert_eq!(again.set, clip.set);
    let kinds = |clip: &Motion| {
        let all = clip.scalars.iter();
        all.map(|scalar| (scalar.kind, scalar.limits))
            .collect::<Vec<_>>()
    };
    assert_eq!(kinds(again), kinds(&clip));
    // Other formats say that they cannot.
    for name in ["bvh", "glb", "tum", "csv"] {
        let format = Format::named(name).unwrap();
        let warnings = format.write_clips(&sampled, &MotionOptions::default(), &mut Vec::new());
        let warnings = warnings.unwrap();
        let left_out = warnings.iter().find(|warning| warning.code == Code::NoRoom);
        let message = &left_out.unwrap().message;
        assert!(message.contains("the scalars"), "{name}: {message}");
    }
}

/// An angle without limits that goes from one end of a turn to the other is probably a wrapped one.
#[test]
fn wrapped_angles_are_noticed() {
    let times = TIMES.map(|time| time * 2.0);
    let mut clip = Motion::default();
    clip.set.push("root", &times, &[Quat::IDENTITY; 4]).unwrap();
    let keys = [3.0, -3.0, -2.5, -2.0];
    clip.set.push_scalar("wheel", &times, &keys, &[]).unwrap();
    clip.scalars.push(Scalar::of(ScalarKind::Angle));
    let warning = |clip: &Motion| {
        let samples = keyed(clip).unwrap();
        let sampled = [samples.of(clip, Some("1".parse().unwrap()), &[])];
        let mut bytes = Vec::new();
        let format = Format::named("npz").unwrap();
        let written = format.write_clips(&sampled, &MotionOptions::default(), &mut bytes);
        written.unwrap();
        let read = read_npz("a.npz", bytes, &ReadOptions::default()).unwrap();
        let mut warnings = read.warnings.into_iter();
        warnings.find(|warning| warning.code == Code::AngleJumps)
    };
    let message = warning(&clip).unwrap().message;
    let expected = "`wheel` changes by -344° between its keys at 0 and 1 s; ";
    assert!(message.starts_with(expected), "{message}");
    clip.scalars[0].limits = Some([-3.1, 3.1]);
    assert_eq!(warning(&clip), None);
}

#[test]
fn operations_keep_scalars_or_change_them_with_the_clip() {
    let (clip, engine) = (clip(), engine());
    let selected = clip.select(&[0]).unwrap();
    assert_eq!(selected.scalars, clip.scalars);
    assert_eq!(keys(&selected, "touch"), keys(&clip, "touch"));
    let trimmed = trim(&clip, 0.25, 1.0, &engine).unwrap();
    assert_eq!(
        keys(&trimmed, "knee"),
        (vec![0.25, 0.5, 1.0], vec![0.5, 1.0, -1.0])
    );
    assert_eq!(trimmed.scalars, clip.scalars);
    let metres = adjust(&clip, 0.01, DQuat::IDENTITY).unwrap();
    assert_eq!(keys(&metres, "knee"), keys(&clip, "knee"));
    assert_eq!(keys(&metres, "lift").1, [0.0025, 0.005, 0.0075, 0.01]);
    let dense = clip
        .sampled(&engine, &SampleTimes::at(vec![0.25, 0.75]))
        .unwrap();
    assert_eq!(keys(&dense, "lift"), (vec![0.25, 0.75], vec![0.375, 0.625]));
    assert_eq!(dense.scalars, clip.scalars);
    assert_eq!(
        (clip.key_count(), clip.rate_of_keys()),
        (16, Some("2".parse().unwrap()))
    );
}

/// Smoothing takes scalars along, three at a time, and leaves steps as they are.
#[test]
fn smoothing_smooths_scalars() {
    let clip = clip();
    let smoothing = Smoothing::new(SmoothingKernel::Box(1.0));
    let job = SmoothJob::new(&clip, smoothing, None, None).unwrap();
    let smoothed = job.run(&engine(), &clip).unwrap();
    let found = job.clip(&clip, &smoothed).unwrap();
    let knee = keys(&found, "knee").1;
    // A quarter, a half, a quarter.
    assert_eq!(knee[1..3], [0.25, -0.125]);
    assert_eq!(keys(&found, "touch"), keys(&clip, "touch"));
}

/// Scalars at other times are refused where all share theirs, by name.
#[test]
fn scalars_at_other_times_are_named() {
    let mut clip = clip();
    clip.set
        .push_scalar("late", &[0.0, 0.75], &[0.0, 1.0], &[])
        .unwrap();
    let refused = keyed(&clip).unwrap_err();
    assert_eq!(
        refused,
        KeyedError::Scalar {
            scalar: 3,
            name: "late".to_owned()
        }
    );
}

/// Formats with one list of times get reduced scalars, which stay within the tolerance of their kind.
#[test]
fn scalars_are_reduced_with_the_tracks() {
    let count = 31;
    let times: Vec<f64> = (0..count).map(|key| f64::from(key) / 30.0).collect();
    let mut clip = Motion::default();
    let still = vec![Quat::IDENTITY; count as usize];
    clip.set.push("root", &times, &still).unwrap();
    let bent: Vec<f32> = (0..count)
        .map(|key| (f64::from(key) * 0.1).sin() as f32)
        .collect();
    let linear = Some(ChannelInterpolation::Linear);
    for (name, kind) in [("knee", ScalarKind::Angle), ("number", ScalarKind::Plain)] {
        let scalar = Scalar {
            interpolation: linear,
            ..Scalar::of(kind)
        };
        let keys = match kind {
            ScalarKind::Plain => &vec![0.5; count as usize],
            _ => &bent,
        };
        clip.set.push_scalar(name, &times, keys, &[]).unwrap();
        clip.scalars.push(scalar);
    }
    let options = ReduceOptions {
        curve: ReducedCurve::Linear,
        angle: 0.01,
        distance: Some(0.01),
        shell: 0.0,
        together: true,
        quantize: None,
    };
    let reduced = reduce(&clip, &engine(), &options).unwrap();
    let samples = keyed(&reduced.clip).unwrap();
    assert!(
        (3..16).contains(&samples.times.len()),
        "{} of {count}",
        samples.times.len()
    );
    assert_eq!(samples.times.last(), times.last());
    let frames = SampleTimes::at(times);
    let found = ChannelMethods::AUTHORED
        .sample(&engine(), &reduced.clip, &frames)
        .unwrap();
    for (sample, expected) in bent.iter().enumerate() {
        let [knee, number] = [0, 1].map(|scalar| found.scalars[sample * 2 + scalar]);
        assert!(
            (knee - expected).abs() <= 0.01,
            "{sample}: {knee} {expected}"
        );
        assert_eq!(number, 0.5);
    }
}

/// Angles in degrees, other numbers as they are; by names, whatever their order.
#[test]
fn scalars_are_compared_by_name() {
    let [first, mut second] = [clip(), Motion::default()];
    second
        .set
        .push("root", &TIMES, &[Quat::IDENTITY; 4])
        .unwrap();
    for name in ["touch", "knee"] {
        let index = first.set.scalar_named(name).unwrap();
        let scalar = first.set.scalar(index).unwrap();
        let keys: Vec<f32> = scalar.keys.iter().map(|key| key + 0.5).collect();
        second.set.push_scalar(name, &TIMES, &keys, &[]).unwrap();
        second.scalars.push(first.scalars[index]);
    }
    let pair = ClipPair {
        inputs: ["first", "second"],
        clips: [&first, &second],
    };
    let frames = SampleTimes::at(TIMES.to_vec());
    let found = pair.differences(&engine(), &frames, false).unwrap();
    assert_eq!(found.scalar_count, 2);
    assert_eq!(found.missing_scalars, [vec!["lift".to_owned()], Vec::new()]);
    let [angle, contact] = &found.scalars[..] else {
        panic!("two kinds: {:?}", found.scalars);
    };
    assert_eq!((angle.kind, &*angle.difference.track), ("angle", "knee"));
    assert!((angle.difference.spread.largest - 0.5f64.to_degrees()).abs() < 1e-12);
    assert_eq!(
        (contact.kind, contact.difference.spread.mean),
        ("contact", 0.5)
    );
}
