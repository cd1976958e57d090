//! Scalars of clips: stored with the clip, and changed or kept with it by every operation.

use tumble::glam::{DQuat, Quat};
use tumble::reduce::ReducedCurve;
use tumble::{
    Device, Engine, Layout, SampleTimes, ScalarQuantity, Smoothing, SmoothingKernel, VectorMethod,
    method,
};
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

/// Each scalar by its own sampler: lines, and steps for contacts, whatever the requested method is.
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
        all.map(|scalar| (scalar.kind, scalar.limits, scalar.interpolation))
            .collect::<Vec<_>>()
    };
    assert_eq!(kinds(again), kinds(&clip));
    // Other formats warn that they cannot store scalars.
    for name in ["bvh", "glb", "tum"] {
        let format = Format::named(name).unwrap();
        let warnings = format.write_clips(&sampled, &MotionOptions::default(), &mut Vec::new());
        let warnings = warnings.unwrap();
        let left_out = warnings.iter().find(|warning| warning.code == Code::NoRoom);
        let message = &left_out.unwrap().message;
        assert!(message.contains("the scalars"), "{name}: {message}");
    }
}

/// Catches joints that are interpolated by lines because the root of their robot stands still.
#[test]
fn numbers_that_do_not_change_have_no_say_in_the_method() {
    let mut arm = Motion::default();
    arm.set.push("base", &TIMES, &[Quat::IDENTITY; 4]).unwrap();
    arm.set
        .set_translations(0, &TIMES, &[tumble::glam::Vec3::X; 4], &[])
        .unwrap();
    arm.push_scalar(Scalar::of(ScalarKind::Angle), clip().set.scalar(0).unwrap())
        .unwrap();
    let authored = ChannelMethods::AUTHORED;
    assert_eq!(
        arm.numbers_method(&authored),
        Some(VectorMethod::BesselOverhauser)
    );
    assert_eq!(
        arm.numbers_method(&ChannelMethods::by(method::C2)),
        Some(VectorMethod::C2)
    );
    arm.scalars[0].interpolation = Some(ChannelInterpolation::Linear);
    assert_eq!(arm.numbers_method(&authored), Some(VectorMethod::Linear));
    let points = [0.0f32, 1.0, 2.0, 4.0].map(|x| tumble::glam::Vec3::new(x, 0.0, 0.0));
    arm.set.set_translations(0, &TIMES, &points, &[]).unwrap();
    assert_eq!(arm.numbers_method(&authored), None);
}

/// Two joints with the same name are two joints: the second gets another name, with a warning.
#[test]
fn equal_names_of_scalars_are_told_apart() {
    let mut clip = clip();
    let keys = [0.5, 0.25, 0.0, 0.125];
    clip.set.push_scalar("knee", &TIMES, &keys, &[]).unwrap();
    clip.scalars.push(Scalar::of(ScalarKind::Angle));
    let samples = keyed(&clip).unwrap();
    let sampled = [samples.of(&clip, Some("2".parse().unwrap()), &[])];
    let mut bytes = Vec::new();
    let format = Format::named("npz").unwrap();
    format
        .write_clips(&sampled, &MotionOptions::default(), &mut bytes)
        .unwrap();
    let again = read_npz("a.npz", bytes, &ReadOptions::default()).unwrap();
    assert_eq!(again.warnings[0].code, Code::SameName);
    assert_eq!(self::keys(&again.clips[0], "knee#3").1, keys);
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

/// Smoothing also smooths scalars, three at a time, and does not change steps.
#[test]
fn smoothing_smooths_scalars() {
    let clip = clip();
    let smoothing = Smoothing::new(SmoothingKernel::Box(1.0));
    let job = SmoothJob::new(&clip, smoothing, None, None).unwrap();
    let smoothed = job.run(&engine(), &clip).unwrap();
    let found = job.clip(&clip, &smoothed).unwrap();
    let knee = keys(&found, "knee").1;
    // The weights of the kernel are 1/4, 1/2, 1/4.
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
        offset: 0.0,
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

/// Tables store scalars beside the keys of tracks and alone, with their names and kinds, and read the same bits.
#[test]
fn tables_store_scalars() {
    let alone = || {
        let mut clip = clip();
        let mut bare = Motion::default();
        for (index, scalar) in std::mem::take(&mut clip.scalars).into_iter().enumerate() {
            bare.push_scalar(scalar, clip.set.scalar(index).unwrap())
                .unwrap();
        }
        bare
    };
    for (format, clip) in ["csv", "parquet", "arrow", "npz"]
        .into_iter()
        .flat_map(|it| [(it, clip()), (it, alone())])
    {
        let format = Format::named(format).unwrap();
        let samples = keyed(&clip).unwrap();
        let mut bytes = Vec::new();
        let options = MotionOptions::default();
        let warnings = format.write_clips(&[samples.of(&clip, None, &[])], &options, &mut bytes);
        let warnings = warnings.unwrap();
        let lost = warnings
            .iter()
            .map(|it| it.message.clone())
            .collect::<String>();
        assert!(!lost.contains("scalars"), "{}: {lost}", format.name);
        let loaded = (format.read_bytes)("a", bytes, &ReadOptions::default()).unwrap();
        let found = &loaded.clips[0];
        assert_eq!(
            found.set.track_count(),
            clip.set.track_count(),
            "{}",
            format.name
        );
        assert_eq!(
            found.set.scalar_count(),
            clip.set.scalar_count(),
            "{}",
            format.name
        );
        for index in 0..clip.set.scalar_count() {
            let [found_keys, keys] = [found, &clip].map(|clip| clip.set.scalar(index).unwrap());
            assert_eq!(
                (found_keys.name, found_keys.times, found_keys.keys),
                (keys.name, keys.times, keys.keys)
            );
            let [found, stored] = [found, &clip].map(|clip| clip.scalar(index));
            assert_eq!(found.kind, stored.kind, "{}", format.name);
            // CSV has no place for limits and interpolations.
            if format.name != "csv" {
                let rest = |it: Scalar| (it.limits, it.interpolation);
                assert_eq!(rest(found), rest(stored), "{}", format.name);
            }
        }
    }
}

/// `--map` names scalars: of columns, of parts of lists and of arrays, in degrees where it says so.
#[test]
fn maps_name_scalars() {
    let read = |text: &str, map: &str| {
        let options = ReadOptions {
            map: Some(map.to_owned()),
            ..ReadOptions::default()
        };
        (Format::named("csv").unwrap().read_bytes)("a.csv", text.as_bytes().to_vec(), &options)
    };
    let text = "time,a,b\n0,90,1\n0.5,180,2\n";
    let loaded = read(text, "knee=a:scalar:angle:deg,lift=b:scalar:length").unwrap();
    let clip = &loaded.clips[0];
    assert_eq!((clip.set.track_count(), clip.set.scalar_count()), (0, 2));
    let knee = clip.set.scalar(0).unwrap();
    assert_eq!(
        (knee.name, knee.keys[0], knee.times),
        ("knee", std::f32::consts::FRAC_PI_2, &[0.0, 0.5][..])
    );
    assert_eq!(
        (clip.scalar(0).kind, clip.scalar(1).kind),
        (ScalarKind::Angle, ScalarKind::Length)
    );
    assert_eq!(clip.set.scalar(1).unwrap().keys, [1.0, 2.0]);
    let refused = |map: &str| read(text, map).unwrap_err();
    assert_eq!(refused("knee=c:scalar").code, Code::ColumnMissing);
    assert_eq!(refused("knee=a:scalar:deg").code, Code::Map);
    assert_eq!(refused("knee=a:scalar:wxyz").code, Code::Map);
    assert_eq!(refused("knee=a[0]:scalar").code, Code::ColumnType);
    assert_eq!(
        read("time,a\n0,x\n", "knee=a:scalar").unwrap_err().code,
        Code::Number
    );
    let missing = read("time,a\n0,1\n1,nan\n", "knee=a:scalar").unwrap_err();
    assert_eq!(missing.code, Code::NotFinite);
    // A scalar may be a part of an array.
    let numbers: Vec<f32> = (0..6).map(|i| i as f32).collect();
    let mut array =
        b"\x93NUMPY\x01\x00\x46\x00{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }"
            .to_vec();
    array.resize(79, b' ');
    array.push(b'\n');
    array.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    let options = ReadOptions {
        map: Some("arm=arr_0[1:3]:scalar:angle".to_owned()),
        source_rate: tumble::FrameRate::new(2, 1).ok(),
        ..ReadOptions::default()
    };
    let loaded = (Format::named("npy").unwrap().read_bytes)("a.npy", array, &options).unwrap();
    let clip = &loaded.clips[0];
    let names: Vec<&str> = (0..2)
        .map(|index| clip.set.scalar(index).unwrap().name)
        .collect();
    assert_eq!(names, ["arm_0", "arm_1"]);
    assert_eq!(clip.set.scalar(1).unwrap().keys, [2.0, 5.0]);
    assert_eq!(clip.set.scalar(1).unwrap().times, [0.0, 0.5]);
}

/// If a method of vectors has the same name, it is used for scalars: `c2` is the same curve.
#[test]
fn scalars_take_the_method_that_is_asked_for() {
    let mut clip = Motion::default();
    let keys = [0.0, 1.0, -1.0, 0.5];
    clip.set.push_scalar("a", &TIMES, &keys, &[]).unwrap();
    let engine = Engine::new(Device::Cpu).unwrap();
    let (frames, velocity) = (SampleTimes::fps(20), ScalarQuantity::Velocity);
    for (named, method) in [
        (method::C2, VectorMethod::C2),
        (method::B_SPLINE, VectorMethod::BSpline),
        (method::BESSEL_OVERHAUSER, VectorMethod::BesselOverhauser),
        (method::SQUAD, method::SQUAD.vector_method),
    ] {
        let found = ChannelMethods::by(named)
            .scalars(&engine, &clip, &frames, velocity)
            .unwrap();
        let expected = engine
            .scalars(
                &clip.set,
                velocity,
                method,
                named,
                &frames,
                Layout::FrameMajor,
            )
            .unwrap();
        assert_eq!(found, expected.as_slice(), "{}", named.name);
    }
}
