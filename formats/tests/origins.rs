//! Positions far from 0 keep their digits through every format that can store them.

use glam::{DQuat, DVec3, Quat};
use tumble::{Channel, Device, Engine, SampleTimes, TrackSet};
use tumble_formats::adjust::adjust;
use tumble_formats::format::{FormatOption, MotionOptions};
use tumble_formats::keyed::keyed;
use tumble_formats::motion::{Joint, Motion, Transform};
use tumble_formats::path::read_paths;
use tumble_formats::sample::ChannelMethods;
use tumble_formats::tum::read_tum;
use tumble_formats::world::world;
use tumble_formats::{FORMATS, Feature, Format, ReadOptions};

/// A path in UTM, 1 cm a frame, in the middle of Europe.
const UTM: DVec3 = DVec3::new(458_074.604_29, 5_429_380.172_09, 162.906);

/// A clip of one body on frames of 10 fps, `step` apart.
fn utm(step: f64) -> (Motion, Vec<DVec3>) {
    let rate = tumble::FrameRate::new(10, 1).unwrap();
    let times: Vec<f64> = (0..5).map(|frame| rate.time_of(frame)).collect();
    let points = (0..5).map(|frame| UTM + f64::from(frame) * step * DVec3::new(1.0, 1.0, 0.5));
    let points: Vec<DVec3> = points.collect();
    let mut set = TrackSet::new();
    set.push("body", &times, &[Quat::IDENTITY; 5]).unwrap();
    let mut clip = Motion {
        set,
        rate: Some(rate),
        skeleton: vec![Joint {
            parent: None,
            rest: Transform::default(),
        }],
        ..Motion::default()
    };
    clip.set_positions(0, &times, &points).unwrap();
    (clip, points)
}

/// The positions of a clip's only track at its keys.
fn positions(clip: &Motion) -> Vec<DVec3> {
    let keys = clip.set.vector_keys(Channel::Translation, 0).unwrap().keys;
    keys.iter()
        .map(|key| clip.origin(0) + key.as_dvec3())
        .collect()
}

/// Positions are equal to the expected ones within a relative error of 1e-9, or within the rounding
/// of f32 for their extent.
fn assert_near(found: &[DVec3], expected: &[DVec3], case: &str) {
    let extent = (expected[expected.len() - 1] - expected[0]).length();
    assert_eq!(found.len(), expected.len(), "{case}");
    for (found, expected) in found.iter().zip(expected) {
        let rounding = DVec3::splat(extent * f64::from(f32::EPSILON) / 2.0);
        let bound = (1e-9 * expected.abs()).max(rounding);
        let off = (*found - *expected).abs();
        assert!(off.cmple(bound).all(), "{case}: {found} {expected}");
    }
}

#[test]
fn a_map_s_positions_come_back_from_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let holding = FORMATS
        .iter()
        .copied()
        .filter(|format| format.supports(Feature::Translations));
    let mut names = Vec::new();
    for format in holding.filter(|format| format.writes_clips()) {
        for step in [0.01, 3.0, 2000.0] {
            let case = format!("{} {step}", format.name);
            let (clip, points) = utm(step);
            let samples = keyed(&clip).unwrap();
            let sampled = [samples.of(&clip, clip.rate, &[])];
            let options = MotionOptions {
                name: "a".to_owned(),
                format: format.name.to_owned(),
                ..MotionOptions::default()
            };
            let mut bytes = Vec::new();
            format.write_clips(&sampled, &options, &mut bytes).unwrap();
            let file = folder.path().join(format!("a.{}", format.name));
            std::fs::write(&file, &bytes).unwrap();
            // A format without times does not store the rate of such a clip.
            let source_rate = clip.rate.filter(|_| format.takes(FormatOption::TimesApart));
            let read = ReadOptions {
                source_rate,
                ..ReadOptions::default()
            };
            let found = format.open(&file, &read).unwrap();
            let [found] = &*found.clips else {
                panic!("{case}: {} clips", found.clips.len());
            };
            assert_eq!(found.set.track_count(), 1, "{case}");
            assert_near(&positions(found), &points, &case);
            // A file that is read and written again is the same to the last byte.
            let samples = keyed(found).unwrap();
            let mut again = Vec::new();
            let sampled = [samples.of(found, found.rate, &[])];
            format.write_clips(&sampled, &options, &mut again).unwrap();
            assert!(bytes == again, "{case}: other bytes");
        }
        names.push(format.name);
    }
    for format in ["tum", "csv", "npz", "bvh", "glb"] {
        assert!(names.contains(&format), "{format} of {names:?}");
    }
}

/// The example that lost a centimetre: `eval` of two poses at 10 fps.
#[test]
fn between_two_keys_of_a_map_lie_their_millimetres() {
    let text = "0 458074.60429 5429380.17209 162.906 0 0 0 1\n1 458074.61429 5429380.18209 162.906 0 0 0 1\n";
    let loaded = read_tum("utm.tum", text.as_bytes(), &ReadOptions::default()).unwrap();
    let clip = &loaded.clips[0];
    assert_eq!(clip.origins, [DVec3::new(458_075.0, 5_429_380.0, 163.0)]);
    let engine = Engine::new(Device::Cpu).unwrap();
    let methods = ChannelMethods::AUTHORED;
    let samples = methods
        .sample(&engine, clip, &SampleTimes::fps(10))
        .unwrap();
    let poses = world(clip, &samples).unwrap();
    for (frame, pose) in poses.iter().enumerate() {
        let moved = frame as f64 * 0.001 * DVec3::new(1.0, 1.0, 0.0);
        let off = pose.position - UTM - moved;
        assert!(off.length() < 1e-5, "{frame}: {off}");
    }
    // Written again, the keys have the same digits.
    let samples = keyed(clip).unwrap();
    let mut bytes = Vec::new();
    let options = MotionOptions {
        name: "a".to_owned(),
        ..MotionOptions::default()
    };
    let format = Format::named("tum").unwrap();
    let sampled = [samples.of(clip, None, &[])];
    format.write_clips(&sampled, &options, &mut bytes).unwrap();
    let written = String::from_utf8(bytes).unwrap();
    let rows: Vec<&str> = written.lines().skip(1).collect();
    assert_eq!(rows, text.lines().collect::<Vec<_>>());
}

#[test]
fn each_track_has_its_origin() {
    let text = "time,a.x,a.y,a.z,a.w,a.tx,a.ty,a.tz,b.x,b.y,b.z,b.w,b.tx,b.ty,b.tz\n\
                0,0,0,0,1,5400000.25,1,2,0,0,0,1,-70000.5,1,2\n\
                1,0,0,0,1,5400000.75,1,3,0,0,0,1,-70000.25,1,2\n";
    let loaded =
        tumble_formats::csv::read::read_csv("a.csv", text.into(), &ReadOptions::default()).unwrap();
    let clip = &loaded.clips[0];
    assert_eq!(
        clip.origins,
        [DVec3::X * 5_400_001.0, DVec3::X * -70_000.0].map(|origin| origin - DVec3::ZERO)
    );
    let second = clip.select(&[1]).unwrap();
    assert_near(
        &positions(&second),
        &[
            DVec3::new(-70_000.5, 1.0, 2.0),
            DVec3::new(-70_000.25, 1.0, 2.0),
        ],
        "select",
    );
    // Scaled to kilometres and rotated, the keys are at the expected points.
    let quarter = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let adjusted = adjust(clip, 0.001, quarter).unwrap();
    let expected = [
        DVec3::new(5_400.000_25, -0.002, 0.001),
        DVec3::new(5_400.000_75, -0.003, 0.001),
    ];
    let found = positions(&adjusted);
    for (found, expected) in found.iter().zip(expected) {
        assert!((*found - expected).length() < 1e-9, "{found} {expected}");
    }
}

/// All paths of a file share an origin, so that a body can look at another.
#[test]
fn paths_of_a_map_keep_their_shape() {
    let text = "t,x,y,z\n0,500000,4200000,100\n1,500000.785,4200000.706825181,100\n";
    let paths = read_paths("a.csv", "a", text.as_bytes(), None).unwrap();
    assert_eq!(paths.origins, [DVec3::new(500_000.0, 4_200_000.0, 100.0)]);
    let keys = paths.set.vector_keys(Channel::Translation, 0).unwrap().keys;
    let step = (keys[1] - keys[0]).as_dvec3();
    let expected = DVec3::new(0.785, 0.706_825_181, 0.0);
    assert!((step - expected).length() < 1e-7, "{step}");
}

/// Catches a root without keys of translation, whose position f32 alone would move by up to a quarter of a metre.
#[test]
fn a_root_that_rests_on_a_map_comes_back() {
    let text = format!(
        "HIERARCHY\nROOT hips\n{{\nOFFSET {} {} {}\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT knee\n{{\n\
         OFFSET 0 0.5 0\nCHANNELS 0\n}}\n}}\nMOTION\nFrames: 2\nFrame Time: 0.1\n1 2 3\n4 5 6\n",
        UTM.x, UTM.y, UTM.z
    );
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, bytes: &[u8]| {
        let file = folder.path().join(name);
        std::fs::write(&file, bytes).unwrap();
        let loaded = Format::open_detected(&file, &ReadOptions::default()).unwrap();
        loaded.clips.into_iter().next().unwrap()
    };
    let root = |clip: &Motion| clip.origin(0) + clip.skeleton[0].rest.translation.as_dvec3();
    let clip = read("a.bvh", text.as_bytes());
    for name in ["bvh", "npz"] {
        let format = FORMATS.iter().find(|format| format.name == name).unwrap();
        let samples = keyed(&clip).unwrap();
        let sampled = [samples.of(&clip, clip.rate, &[])];
        let mut bytes = Vec::new();
        let options = MotionOptions::default();
        format.write_clips(&sampled, &options, &mut bytes).unwrap();
        let again = read(&format!("b.{name}"), &bytes);
        for clip in [&clip, &again] {
            assert!(
                (root(clip) - UTM).abs().max_element() < 1e-5,
                "{name}: {}",
                root(clip)
            );
            assert_eq!(clip.origin(1), DVec3::ZERO);
        }
    }
}

/// Catches a joint that rests far from its parent, as one of a map whose root is its 0: f32 alone would move it by
/// up to a quarter of a metre.
#[test]
fn a_joint_that_rests_far_from_its_parent_comes_back() {
    let rest = DVec3::new(5_000_000.123, 0.5, -2_000_000.456);
    let text = format!(
        "HIERARCHY\nROOT map\n{{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT near\n{{\n\
         OFFSET 4096 0 0\nCHANNELS 0\nJOINT remote\n{{\nOFFSET {} {} {}\nCHANNELS 0\n}}\n}}\n}}\n\
         MOTION\nFrames: 2\nFrame Time: 0.1\n0 0 0\n0 0 90\n",
        rest.x, rest.y, rest.z
    );
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, bytes: &[u8]| {
        let file = folder.path().join(name);
        std::fs::write(&file, bytes).unwrap();
        let loaded = Format::open_detected(&file, &ReadOptions::default()).unwrap();
        loaded.clips.into_iter().next().unwrap()
    };
    let at_rest = |clip: &Motion, track: usize| {
        clip.origin(track) + clip.skeleton[track].rest.translation.as_dvec3()
    };
    let clip = read("a.bvh", text.as_bytes());
    // A position that f32 has exactly needs no origin.
    assert_eq!(clip.origin(1), DVec3::ZERO);
    let samples = keyed(&clip).unwrap();
    let poses = world(&clip, &samples).unwrap();
    let rotated = DVec3::new(rest.z, rest.y, -4096.0 - rest.x);
    let expected = [DVec3::X * 4096.0 + rest, rotated];
    for (pose, expected) in poses.iter().skip(2).step_by(3).zip(expected) {
        // The rotation is a key in f32: a ten millionth of the distance.
        let bound = 1e-7
            * if pose.position == expected {
                0.0
            } else {
                rest.length()
            };
        assert!(
            (pose.position - expected).length() <= bound.max(1e-6),
            "{}",
            pose.position
        );
    }
    for format in FORMATS
        .iter()
        .copied()
        .filter(|format| format.writes_clips() && format.supports(Feature::Skeleton))
    {
        let name = format.name;
        let sampled = [samples.of(&clip, clip.rate, &[])];
        let options = MotionOptions {
            format: name.to_owned(),
            ..MotionOptions::default()
        };
        let mut bytes = Vec::new();
        format.write_clips(&sampled, &options, &mut bytes).unwrap();
        let again = read(&format!("b.{name}"), &bytes);
        for clip in [&clip, &again] {
            let off = (at_rest(clip, 2) - rest).abs().max_element();
            assert!(off < 1e-6, "{name}: {off}");
            assert_eq!(at_rest(clip, 1), DVec3::X * 4096.0, "{name}");
        }
    }
}
