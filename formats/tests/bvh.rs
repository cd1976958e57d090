//! BVH: files from elsewhere, and what is written read back.

use std::fs;
use std::path::Path;

use glam::{DQuat, Quat, Vec3};
use proptest::prelude::*;
use serde_json::Value;
use tumble::{EulerSequence, FrameRate, TrackSet};
use tumble_formats::bvh::{FORMAT, open_bvh, read_bvh};
use tumble_formats::format::{MotionOptions, WriteError};
use tumble_formats::motion::{Joint, Motion, Sampled, Transform};
use tumble_formats::{Code, Diagnostic, Format, Limits, ReadOptions};

use crate::support::{at, shared_data};

fn open(path: &Path) -> Motion {
    let loaded = open_bvh(path, &ReadOptions::default()).unwrap();
    assert_eq!(loaded.warnings, [], "{}", path.display());
    loaded.clips.into_iter().next().unwrap()
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    std::array::from_fn(|i| value[i].as_f64().unwrap())
}

/// Radians between two rotations.
fn angle(a: DQuat, b: DQuat) -> f64 {
    2.0 * (a.normalize() * b.normalize().conjugate())
        .xyz()
        .length()
        .asin()
}

/// Compares a clip with what another program made of it.
fn compare(name: &str, clip: &Motion, expected: &Value) {
    let joints = expected["joints"].as_array().unwrap();
    assert_eq!(clip.set.track_count(), joints.len(), "{name}");
    let frames = expected["frames"].as_u64().unwrap() as usize;
    let frame_time = expected["frame_time"].as_f64().unwrap();
    let rate = clip.rate.unwrap();
    assert!(
        (rate.time_of(1) - frame_time).abs() < 5e-7,
        "{name}: {rate}"
    );
    for (index, joint) in joints.iter().enumerate() {
        let track = clip.set.track(index);
        assert_eq!(track.name, joint["name"].as_str(), "{name}");
        let parent = joint["parent"].as_u64().map(|parent| parent as usize);
        assert_eq!(clip.skeleton[index].parent, parent, "{name}");
        let offset = Vec3::from_array(numbers(&joint["offset"]).map(|x| x as f32));
        let rest = Transform {
            translation: offset,
            ..Transform::default()
        };
        assert_eq!(clip.skeleton[index].rest, rest, "{name}");
        for (place, frame) in expected["shown"].as_array().unwrap().iter().enumerate() {
            let frame = frame.as_u64().unwrap() as usize;
            assert!(frame < frames);
            let key = frame.min(track.keys.len() - 1);
            if key > 0 {
                assert_eq!(track.keys.len(), frames, "{name}");
                assert_eq!(track.times[key], rate.time_of(frame as u64), "{name}");
            }
            let wanted = DQuat::from_array(numbers(&joint["rotations"][place]));
            let off = angle(track.keys[key].as_dquat(), wanted);
            assert!(
                off < 3e-7,
                "{name}, {:?}, frame {frame}: {off:e}",
                track.name
            );
            let wanted = Vec3::from_array(numbers(&joint["translations"][place]).map(|x| x as f32));
            let found = at(clip, &[rate.time_of(frame as u64)]).1[index];
            assert!(
                found.abs_diff_eq(wanted, 1e-5),
                "{name}, frame {frame}: {found} {wanted}"
            );
        }
    }
}

#[test]
fn files_from_elsewhere_are_what_other_programs_read() {
    let Some(data) = shared_data() else { return };
    let folder = data.join("bvh");
    let json = |path: &str| -> Value {
        serde_json::from_slice(&fs::read(folder.join(path)).unwrap()).unwrap()
    };
    let mut count = 0;
    for (list, beside) in [("expected.json", ""), ("made/expected.json", "made/")] {
        for (name, expected) in json(list).as_object().unwrap() {
            compare(name, &open(&folder.join(beside).join(name)), expected);
            count += 1;
        }
    }
    let cmu = open(&folder.join("cmu_01_01.bvh"));
    compare("cmu", &cmu, &json("cmu_01_01.expected.json"));
    assert_eq!(cmu.rate, FrameRate::new(120, 1).ok());
    // Every `.bvh` of the folders was there.
    let files = ["", "made"].map(|part| fs::read_dir(folder.join(part)).unwrap());
    let files = files
        .into_iter()
        .flatten()
        .map(|entry| entry.unwrap().path());
    let all = files.filter(|path| path.extension().is_some_and(|end| end == "bvh"));
    assert_eq!(all.count(), count + 1);
}

#[test]
fn broken_files_from_elsewhere_are_refused_for_what_they_are() {
    let Some(data) = shared_data() else { return };
    let verdicts = [
        ("channel_count", Code::BvhChannelCount),
        ("channel_twice", Code::BvhChannel),
        ("decimal_comma", Code::Number),
        ("fewer_rows", Code::BvhCut),
        ("hierarchy_again", Code::BvhSecond),
        ("huge_claim", Code::BvhCut),
        ("more_rows", Code::BvhMoreRows),
        ("nan", Code::NotFinite),
        ("no_frames", Code::BvhNoFrames),
        ("no_motion", Code::BvhMotion),
        ("no_offset", Code::BvhOffset),
        ("short_row", Code::BvhRow),
        ("unbalanced", Code::BvhBraces),
        ("unknown_channel", Code::BvhChannel),
        ("zero_frame_time", Code::BvhFrameTime),
    ];
    let folder = data.join("bvh/bad");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), verdicts.len());
    for (name, code) in verdicts {
        let read = open_bvh(
            &folder.join(name).with_extension("bvh"),
            &ReadOptions::default(),
        );
        let said = match read {
            Ok(loaded) => {
                assert_eq!(loaded.clips.len(), 1);
                loaded.warnings
            }
            Err(error) => vec![error],
        };
        assert_eq!(
            said.iter().map(|d| d.code).collect::<Vec<_>>(),
            [code],
            "{name}"
        );
    }
}

#[test]
fn files_are_known_by_their_first_word() {
    for start in ["HIERARCHY\nROOT", "\u{feff}hierarchy\r\n", "\n Hierarchy"] {
        let format = Format::detect(Path::new("walk.txt"), start.as_bytes());
        assert_eq!(format.name, "bvh", "{start:?}");
    }
    assert_eq!(Format::detect(Path::new("walk.bvh"), b"").name, "bvh");
    assert_eq!(Format::detect(Path::new("walk"), b"HIERARCH").name, "dat");
}

const HEAD: &str = "HIERARCHY\nROOT a\n{\nOFFSET 1 2 3\nCHANNELS 4 Yposition Zrotation Xrotation \
                    Yrotation\n}\nMOTION\nFrames: 3\n";

fn read(text: &str, options: &ReadOptions) -> Result<Motion, Diagnostic> {
    read_bvh("t", text.as_bytes(), options).map(|loaded| loaded.clips[0].clone())
}

/// Of a position with one channel the other coordinates are those of OFFSET.
#[test]
fn positions_replace_their_own_coordinate() {
    let text = format!("{HEAD}Frame Time: 0.04\n7 0 0 0\n8 0 0 0\n9 0 0 0\n");
    let clip = read(&text, &ReadOptions::default()).unwrap();
    assert_eq!(at(&clip, &[0.08]).1, [Vec3::new(1.0, 9.0, 3.0)]);
    assert_eq!(clip.set.track(0).keys, [Quat::IDENTITY; 3]);
}

#[test]
fn raw_times_are_multiples_of_the_printed_frame_time() {
    let text = format!("{HEAD}Frame Time: .0083333\n{}", "0 0 0 0\n".repeat(3));
    let clip = read(&text, &ReadOptions::default()).unwrap();
    assert_eq!(clip.set.track(0).times, [0.0, 1.0 / 120.0, 2.0 / 120.0]);
    let raw = ReadOptions {
        raw_times: true,
        ..ReadOptions::default()
    };
    let clip = read(&text, &raw).unwrap();
    assert_eq!(clip.set.track(0).times, [0.0, 0.008_333_3, 0.016_666_6]);
}

/// A long line of the hierarchy costs time in proportion to its length.
#[test]
fn long_lines_are_read_once() {
    let name = "ä ".repeat(200_000);
    let text = HEAD.replace("ROOT a", &format!("ROOT {name}")) + "Frame Time: 1\n";
    let error = read(&text, &ReadOptions::default()).unwrap_err();
    assert_eq!(error.code, Code::BvhCut);
    let deep = "JOINT b {".repeat(200_000);
    let error = read(&HEAD.replace("}", &deep), &ReadOptions::default()).unwrap_err();
    assert_eq!(error.code, Code::BvhBraces);
    let limits = Limits {
        line: 20,
        file: 300,
    };
    let options = ReadOptions {
        limits,
        ..ReadOptions::default()
    };
    assert_eq!(read(HEAD, &options).unwrap_err().code, Code::LineTooLong);
}

/// A clip of `parents.len()` joints, sampled at its own keys; `rotations` are `[sample][track]`.
fn clip(parents: &[Option<usize>], names: &[&str], samples: usize, rotations: &[Quat]) -> Motion {
    let mut set = TrackSet::new();
    let times: Vec<f64> = (0..samples as u64).map(|k| k as f64 / 30.0).collect();
    for (track, name) in names.iter().enumerate() {
        let keys = rotations.iter().skip(track).step_by(names.len());
        set.push(*name, &times, &keys.copied().collect::<Vec<_>>())
            .unwrap();
    }
    let joint = |(track, &parent): (usize, &Option<usize>)| Joint {
        parent,
        rest: Transform {
            translation: Vec3::new(0.1, track as f32, -2.5),
            ..Transform::default()
        },
    };
    Motion {
        set,
        skeleton: parents.iter().enumerate().map(joint).collect(),
        ..Motion::default()
    }
}

fn sampled<'a>(clip: &'a Motion, times: &'a [f64], rotations: &'a [Quat]) -> Sampled<'a> {
    Sampled {
        clip,
        times,
        rate: FrameRate::new(30, 1).ok(),
        rotations,
        translations: &[],
        scales: &[],
        notes: &[],
    }
}

fn write(
    clips: &[Sampled<'_>],
    options: &MotionOptions,
) -> Result<(String, Vec<Diagnostic>), WriteError> {
    let mut out = Vec::new();
    let warnings = FORMAT.write_motion.unwrap()(clips, options, &mut out)?;
    Ok((String::from_utf8(out).unwrap(), warnings))
}

/// The angles of the rows, degrees, behind the first `skip` numbers.
fn rows(text: &str) -> Vec<Vec<f64>> {
    let lines = text
        .lines()
        .skip_while(|line| !line.starts_with("Frame Time"))
        .skip(1);
    lines
        .map(|line| {
            line.split(' ')
                .map(|number| number.parse().unwrap())
                .collect()
        })
        .collect()
}

const TURNED: EulerSequence = EulerSequence::XYZ;

#[test]
fn joints_are_written_below_their_parents_with_usable_names() {
    // The third hangs on the fourth, which comes behind it.
    let parents = [None, Some(0), Some(3), Some(0), None];
    let names = ["hips", "left leg", "", "hips", "prop"];
    let mut rotations = vec![Quat::IDENTITY; 10];
    rotations[7] = Quat::from_rotation_z(0.5);
    let clip = clip(&parents, &names, 2, &rotations);
    let times = [0.0, 1.0 / 30.0];
    let mut sampled = sampled(&clip, &times, &rotations);
    let mut translations = vec![Vec3::new(0.1, 0.7, 0.0); 10];
    translations[8] = Vec3::new(1e-7, 0.25, 3e8);
    sampled.translations = &translations;
    let scales = vec![Vec3::new(1.0, 2.0, 1.0); 10];
    sampled.scales = &scales;
    let (text, warnings) = write(&[sampled], &MotionOptions::default()).unwrap();
    let expected = "HIERARCHY\nROOT hips\n{\n  OFFSET 0.1 0 -2.5\n  CHANNELS 6 Xposition Yposition \
                    Zposition Zrotation Xrotation Yrotation\n  JOINT left_leg\n  {\n    OFFSET 0.1 \
                    0.7 0\n    CHANNELS 3 Zrotation Xrotation Yrotation\n    End Site\n    {\n      \
                    OFFSET 0 0 0\n    }\n  }\n  JOINT hips#3\n  {\n    OFFSET 0.1 3 -2.5\n    \
                    CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n    \
                    JOINT joint2\n";
    assert!(text.starts_with(expected), "{text}");
    assert!(
        text.contains("\nFrame Time: 0.03333333333333333\n"),
        "{text}"
    );
    assert!(
        text.ends_with(" 0.0000001 0.25 300000000 0 0 0 28.64789 0 0 0.1 0.7 0 0 0 0\n"),
        "{text}"
    );
    assert_eq!(
        (warnings.len(), warnings[0].code, warnings[0].count),
        (1, Code::Scales, 5)
    );
    let back = read(&text, &ReadOptions::default()).unwrap();
    let parents: Vec<_> = back.skeleton.iter().map(|joint| joint.parent).collect();
    assert_eq!(parents, [None, Some(0), Some(0), Some(2), None]);
    let read_back = at(&back, &times[1..]).1;
    let order = [0, 1, 3, 2, 4].map(|track| translations[5 + track]);
    assert_eq!(read_back, order);
}

#[test]
fn what_bvh_cannot_hold_is_refused() {
    let rotations = [Quat::IDENTITY; 2];
    let clip = clip(&[None], &["a"], 2, &rotations);
    let times = [0.0, 1.0 / 30.0];
    let good = sampled(&clip, &times, &rotations);
    let options = MotionOptions::default();
    let refusal = |clips: &[Sampled<'_>], options: &MotionOptions| match write(clips, options) {
        Err(WriteError::Refused(error)) => {
            assert_eq!(error.code, Code::BvhWrite);
            error.message
        }
        other => panic!("{other:?}"),
    };
    assert!(write(&[good.clone()], &options).is_ok());
    let two = refusal(&[good.clone(), good.clone()], &options);
    assert!(two.contains("2 clips"), "{two}");
    let mut bad = good.clone();
    bad.rate = None;
    assert!(refusal(&[bad], &options).contains("one rate"));
    let mut bad = good.clone();
    bad.times = &[0.0, 0.1];
    assert!(refusal(&[bad], &options).contains("0.1 s is not on the next frame"));
    let mut bad = good.clone();
    bad.translations = &[Vec3::ZERO, Vec3::NAN];
    assert!(refusal(&[bad], &options).contains("not finite"));
    let twice = MotionOptions {
        sequence: "ZXZ".parse().ok(),
        ..MotionOptions::default()
    };
    assert!(refusal(&[good.clone()], &twice).contains("an axis twice"));
    let mut circle = clip.clone();
    circle.skeleton[0].parent = Some(0);
    assert!(refusal(&[sampled(&circle, &times, &rotations)], &options).contains("circle"));
    let empty = Motion::default();
    assert!(refusal(&[sampled(&empty, &times, &[])], &options).contains("nothing to write"));
    let mut bad = good.clone();
    bad.rotations = &rotations[1..];
    assert!(matches!(write(&[bad], &options), Err(WriteError::Io(_))));
    let later = [2.0, 2.0 + 1.0 / 30.0];
    let (_, warnings) = write(&[sampled(&clip, &later, &rotations)], &options).unwrap();
    assert_eq!(warnings[0].code, Code::StartMoved);
}

/// A wheel that turns on and on, past every multiple of 180°.
#[test]
fn angles_are_unwrapped_and_exact_after_many_turns() {
    let rotations: Vec<Quat> = (0..4000)
        .map(|i| {
            (DQuat::from_rotation_x(0.3) * DQuat::from_rotation_y(f64::from(i) * 0.7)).as_quat()
        })
        .collect();
    let clip = clip(&[None], &["wheel"], rotations.len(), &rotations);
    let times: Vec<f64> = (0..4000).map(|k| f64::from(k) / 30.0).collect();
    let options = MotionOptions {
        sequence: Some(TURNED),
        ..MotionOptions::default()
    };
    let (text, _) = write(&[sampled(&clip, &times, &rotations)], &options).unwrap();
    let rows = rows(&text);
    let last = rows.last().unwrap();
    let turned = f64::from(3999) * 0.7f64.to_degrees();
    assert!((last[4] - turned).abs() < 1e-4, "{last:?} {turned}");
    let back = read(&text, &ReadOptions::default()).unwrap();
    for (read, written) in back.set.track(0).keys.iter().zip(&rotations) {
        assert!(angle(read.as_dquat(), written.as_dquat()) < 1e-6);
    }
}

fn rotation() -> impl Strategy<Value = Quat> {
    let anywhere = prop::array::uniform4(-1.0f64..1.0);
    let anywhere = anywhere.prop_filter("norm", |q| DQuat::from_array(*q).length() > 0.1);
    let lock = (
        0..3usize,
        0..3usize,
        -4.0f64..4.0,
        -4.0f64..4.0,
        -9.0f64..0.0,
        any::<bool>(),
    );
    prop_oneof![
        anywhere.prop_map(|q| DQuat::from_array(q).normalize().as_quat()),
        // Near gimbal lock: a quarter turn about one axis between turns about others.
        lock.prop_map(|(first, middle, a, b, near, down)| {
            let turn = |axis: usize, angle| match axis {
                0 => DQuat::from_rotation_x(angle),
                1 => DQuat::from_rotation_y(angle),
                _ => DQuat::from_rotation_z(angle),
            };
            let quarter =
                (std::f64::consts::FRAC_PI_2 + 10f64.powf(near)) * if down { -1.0 } else { 1.0 };
            (turn(first, a) * turn(middle, quarter) * turn(3 - first, b)).as_quat()
        }),
    ]
}

proptest! {
    #[test]
    fn what_is_written_reads_back_within_a_microradian(
        rotations in prop::collection::vec(rotation(), 1..40),
        sequence in 0usize..24,
        translations in prop::array::uniform3(-1e3f32..1e3),
    ) {
        let sequence = EulerSequence::all()[sequence];
        prop_assume!(sequence.axes()[0] != sequence.axes()[2]);
        let clip = clip(&[None], &["a"], rotations.len(), &rotations);
        let times: Vec<f64> = (0..rotations.len()).map(|k| k as f64 / 30.0).collect();
        let mut sampled = sampled(&clip, &times, &rotations);
        let translations = vec![Vec3::from_array(translations); rotations.len()];
        sampled.translations = &translations;
        let options = MotionOptions { sequence: Some(sequence), ..MotionOptions::default() };
        let (text, warnings) = write(&[sampled], &options).unwrap();
        prop_assert!(warnings.is_empty());
        let back = read(&text, &ReadOptions::default()).unwrap();
        prop_assert_eq!(back.set.track(0).times, &times[..]);
        prop_assert_eq!(back.rate, FrameRate::new(30, 1).ok());
        for (read, written) in back.set.track(0).keys.iter().zip(&rotations) {
            let off = angle(read.as_dquat(), written.as_dquat());
            prop_assert!(off < 1e-6, "{} {:e}", written, off);
        }
        prop_assert_eq!(at(&back, &times).1, translations);
        for pair in rows(&text).windows(2) {
            for i in 3..6 {
                prop_assert!((pair[1][i] - pair[0][i]).abs() < 180.0 + 1e-4, "{pair:?}");
            }
        }
    }

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read_bvh("t", &*bytes, &ReadOptions::default());
        let whole = [HEAD.as_bytes(), &bytes].concat();
        let _ = read_bvh("t", &*whole, &ReadOptions::default());
    }

    /// Nearly right files reach deeper than arbitrary bytes.
    #[test]
    fn damaged_files_never_panic(
        places in prop::collection::vec((0usize..160, any::<u8>()), 0..4),
        from in 0usize..160,
        cut in 100usize..200,
    ) {
        let mut bytes = format!("{HEAD}Frame Time: 0.04\n7 0 0 0\n8 0 1e1 0\n9 0 0 -0.0\n").into_bytes();
        for (place, byte) in places {
            let place = place % bytes.len();
            bytes[place] = byte;
        }
        let piece = bytes[from..(from + 20).min(bytes.len())].to_vec();
        bytes.splice(cut..cut, piece);
        let _ = read_bvh("t", &*bytes, &ReadOptions::default());
    }
}
