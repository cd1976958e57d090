//! The layouts that are known by the names of their arrays.

use std::path::Path;

use glam::{DQuat, Quat};
use tumble::{FrameRate, TrackSet};
use tumble_formats::keys::Duplicates;
use tumble_formats::{Code, Format, Limits, Loaded, ReadOptions};

use super::{fixture, mapped, read, sample};
use tumble_formats::npz::read_npz;

fn open(path: &Path) -> Loaded {
    let format = Format::detect(path, &std::fs::read(path).unwrap()[..64]);
    assert_eq!(format.name, "npz");
    format.open(path, &ReadOptions::default()).unwrap()
}

/// The expected rotations of `smplh_like`, by `SciPy`: for each joint shown, at each frame shown.
fn expected() -> (Vec<usize>, Vec<usize>, Vec<f64>) {
    let text = std::fs::read_to_string(sample("expected.json").unwrap()).unwrap();
    let part = |name: &str| {
        let start = text.find(&format!("\"{name}\":")).unwrap() + name.len() + 3;
        let end = text[start..]
            .find(['"', '}'])
            .map_or(text.len(), |end| start + end);
        let numbers = text[start..end].split(|c: char| !"+-.e0123456789".contains(c));
        let numbers = numbers.filter(|number| !number.is_empty());
        numbers
            .map(|number| number.parse().unwrap())
            .collect::<Vec<f64>>()
    };
    let whole = |name| {
        part(name)
            .into_iter()
            .map(|number| number as usize)
            .collect()
    };
    (whole("joints"), whole("frames"), part("rotations"))
}

/// Half the angle between a key and the expected one.
fn apart(key: Quat, expected: &[f64]) -> f64 {
    let expected = DQuat::from_slice(expected);
    let key = key.as_dquat();
    (key - expected).length().min((key + expected).length())
}

#[test]
fn smpl_h_is_read_with_names_parents_rate_and_root() {
    let Some(path) = sample("smplh_like.npz") else {
        return;
    };
    let loaded = open(&path);
    let codes: Vec<Code> = loaded.warnings.iter().map(|warning| warning.code).collect();
    assert_eq!(codes, [], "{:?}", loaded.warnings);
    let clip = &loaded.clips[0];
    assert_eq!(clip.rate, FrameRate::new(120, 1).ok());
    assert_eq!(
        (clip.set.track_count(), clip.set.key_count()),
        (52, 52 * 121)
    );
    assert!(!clip.is_world);
    assert_eq!(clip.set.track(0).times[60], 0.5);
    assert_eq!(clip.set.track(37).name, Some("right_index1"));
    assert_eq!(clip.skeleton[37].parent, Some(21));
    let (joints, frames, rotations) = expected();
    assert_eq!(rotations.len(), 4 * joints.len() * frames.len());
    let mut expected_keys = rotations.chunks_exact(4);
    let mut worst: f64 = 0.0;
    // The expected list is by frame or by joint, which the second joint of the first frame shows. Every
    // entry is checked.
    let by_frame = apart(clip.set.track(joints[1]).keys[frames[0]], &rotations[4..8]) < 1e-3;
    for outer in 0..4 {
        for inner in 0..4 {
            let (f, j) = if by_frame {
                (outer, inner)
            } else {
                (inner, outer)
            };
            let key = clip.set.track(joints[j]).keys[frames[f]];
            worst = worst.max(apart(key, expected_keys.next().unwrap()));
        }
    }
    assert!(worst < 1e-7, "{worst:e}");
    // The rotation vector of joint 1 is longer than π at frame 60 and shorter at frame 61; the
    // keys' signs do not jump.
    for track in clip.set.tracks() {
        assert!(
            track
                .keys
                .windows(2)
                .all(|pair| pair[0].dot(pair[1]) >= 0.0)
        );
    }
    assert!(clip.set.track(1).keys[60].w < 0.0);
}

#[test]
fn smpl_x_has_the_joints_of_smpl_h_and_a_face() {
    let (Some(h), Some(x)) = (sample("smplh_like.npz"), sample("smplx_like.npz")) else {
        return;
    };
    let [h, x] = [h, x].map(|path| open(&path).clips.swap_remove(0));
    assert_eq!(x.rate, FrameRate::new(120, 1).ok(), "120.00004577 is 120");
    assert_eq!(x.set.track_count(), 55);
    for track in h.set.tracks() {
        let other = x
            .set
            .tracks()
            .find(|other| other.name == track.name)
            .unwrap();
        assert_eq!((track.keys, track.times), (other.keys, other.times));
    }
    let jaw = x
        .set
        .tracks()
        .position(|track| track.name == Some("jaw"))
        .unwrap();
    assert_eq!(x.skeleton[jaw].parent, Some(15));
}

#[test]
fn bodies_are_in_the_world() {
    let (Some(h), Some(bodies)) = (sample("smplh_like.npz"), sample("bodies_like.npz")) else {
        return;
    };
    let [h, bodies] = [h, bodies].map(|path| open(&path).clips.swap_remove(0));
    assert!(bodies.is_world && bodies.skeleton.is_empty());
    assert_eq!(bodies.rate, FrameRate::new(30, 1).ok());
    let names: Vec<_> = bodies
        .set
        .tracks()
        .map(|track| track.name.unwrap())
        .collect();
    assert_eq!(names, ["pelvis", "torso", "head", "hand"]);
    // The samples are equal to the first joints of the other file.
    for track in 0..4 {
        for (key, other) in bodies
            .set
            .track(track)
            .keys
            .iter()
            .zip(h.set.track(track).keys)
        {
            assert!(apart(*key, &other.as_dquat().to_array()) < 2e-7);
        }
    }
}

#[test]
fn pieces_are_joints_in_the_order_of_poses() {
    let clip = &read(fixture("npz/pieces.npz")).unwrap().clips[0];
    assert_eq!(clip.set.track_count(), 52);
    assert_eq!(clip.set.track(22).name, Some("left_index1"));
    assert_eq!(clip.skeleton[37].parent, Some(21));
    let alone = &read(fixture("npz/body_alone.npz")).unwrap().clips[0];
    assert_eq!(alone.set.track(21).name, Some("right_wrist"));
}

/// Every type, order and packing of the same numbers is the same clip.
#[test]
fn element_types_orders_and_packings_do_not_matter() {
    let clip = |name: &str| {
        let read = read(fixture(&format!("npz/{name}.npz")));
        read.unwrap_or_else(|error| panic!("{name}: {error}"))
            .clips
            .swap_remove(0)
    };
    let expected = clip("unknown_body");
    for (name, bound) in [
        ("big_f8", 0.0),
        ("fortran", 0.0),
        ("version_2", 0.0),
        ("zip64", 0.0),
        ("little_f4", 1e-6),
        ("big_f4", 1e-6),
        ("little_f2", 2e-3),
        ("big_f2", 2e-3),
    ] {
        let found = clip(name);
        assert_eq!(found.rate, expected.rate);
        for (track, other) in found.set.tracks().zip(expected.set.tracks()) {
            for (key, other) in track.keys.iter().zip(other.keys) {
                assert!(apart(*key, &other.as_dquat().to_array()) <= bound, "{name}");
            }
        }
    }
}

#[test]
fn equal_times_keep_the_key_that_was_asked_for() {
    let keys = |duplicates| {
        let options = ReadOptions {
            duplicates,
            ..ReadOptions::default()
        };
        let loaded = read_npz("t", fixture("npz/equal_times.npz"), &options).unwrap();
        let set: TrackSet = loaded.clips[0].set.clone();
        assert_eq!(set.track(1).times, [0.0, 0.5]);
        set.track(1).keys.to_vec()
    };
    let [first, last] = [Duplicates::First, Duplicates::Last].map(keys);
    assert_eq!(first[0], last[0]);
    assert_ne!(first[1], last[1]);
}

#[test]
fn rates_and_units_come_from_options_where_the_file_has_none() {
    let options = ReadOptions {
        source_rate: FrameRate::new(24, 1).ok(),
        ..ReadOptions::default()
    };
    let clip = &read_npz("t", fixture("npz/no_rate.npz"), &options)
        .unwrap()
        .clips[0];
    assert_eq!(
        (clip.rate, clip.set.track(0).times[3]),
        (options.source_rate, 0.125)
    );
    let options = ReadOptions {
        time_unit: Some(tumble_formats::format::TimeUnit::Milliseconds),
        ..ReadOptions::default()
    };
    let clip = &read_npz("t", fixture("npz/times_whole.npz"), &options)
        .unwrap()
        .clips[0];
    assert_eq!(clip.set.track(0).times, [0.0, 0.5, 0.75]);
    // A number that is no rate is replaced.
    let options = ReadOptions {
        override_rate: FrameRate::new(24, 1).ok(),
        ..ReadOptions::default()
    };
    for (name, rate) in [("rate_zero", "0"), ("two_rates", "an array of 2 numbers")] {
        let bytes = fixture(&format!("npz/{name}.npz"));
        let loaded = read_npz("t", bytes, &options).unwrap();
        let clip = &loaded.clips[0];
        assert_eq!(
            (clip.rate, clip.set.track(0).times[3]),
            (options.override_rate, 0.125)
        );
        let warning = loaded.warnings.iter().find(|it| it.code == Code::TwoRates);
        let message = &warning.unwrap().message;
        assert!(
            message.starts_with(&format!("{rate} is not a frame rate; ")),
            "{message}"
        );
        assert!(
            message.ends_with(" it is read at 24 frames a second"),
            "{message}"
        );
    }
}

/// The unpacked size of a file is known before anything is unpacked.
#[test]
fn archives_that_unpack_to_too_much_are_refused_before_that() {
    let options = ReadOptions {
        limits: Limits {
            file: 3000,
            ..Limits::default()
        },
        ..ReadOptions::default()
    };
    let bytes = fixture("npz/smplh_deflated.npz");
    let error = read_npz("t", bytes.clone(), &options).unwrap_err();
    assert_eq!(error.code, Code::FileTooLong, "{error}");
    assert!(read_npz("t", bytes, &ReadOptions::default()).is_ok());
    let error = read_npz("t", fixture("npz/smpl.npz"), &mapped("rotations=poses,")).unwrap_err();
    assert_eq!(error.code, Code::Map, "{error}");
}
