//! BVH as it is read: files from elsewhere, odd ones, arbitrary ones.

use std::fs;
use std::path::Path;

use glam::{DQuat, Quat, Vec3};
use proptest::prelude::*;
use serde_json::Value;
use tumble::FrameRate;
use tumble_formats::bvh::{open_bvh, read_bvh};
use tumble_formats::keyed::keyed;
use tumble_formats::motion::{Motion, Transform};
use tumble_formats::{Code, Diagnostic, Format, Limits, ReadOptions};

use crate::support::shared_data;

fn open(path: &Path) -> Motion {
    let loaded = open_bvh(path, &ReadOptions::default()).unwrap();
    assert_eq!(loaded.warnings, [], "{}", path.display());
    loaded.clips.into_iter().next().unwrap()
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    std::array::from_fn(|i| value[i].as_f64().unwrap())
}

/// Radians between two rotations.
pub(crate) fn angle(a: DQuat, b: DQuat) -> f64 {
    2.0 * (a.normalize() * b.normalize().conjugate())
        .xyz()
        .length()
        .asin()
}

/// The translations of all joints, `[frame][joint]`.
pub(crate) fn moved(clip: &Motion) -> Vec<Vec3> {
    keyed(clip).unwrap().translations
}

/// Compares a clip with the numbers of another program.
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
    let found = moved(clip);
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
        for (i, frame) in expected["shown"].as_array().unwrap().iter().enumerate() {
            let frame = frame.as_u64().unwrap() as usize;
            assert!(frame < frames);
            let key = frame.min(track.keys.len() - 1);
            if key > 0 {
                assert_eq!(track.keys.len(), frames, "{name}");
                assert_eq!(track.times[key], rate.time_of(frame as u64), "{name}");
            }
            let rotation = DQuat::from_array(numbers(&joint["rotations"][i]));
            let off = angle(track.keys[key].as_dquat(), rotation);
            assert!(
                off < 3e-7,
                "{name}, {:?}, frame {frame}: {off:e}",
                track.name
            );
            let translation =
                Vec3::from_array(numbers(&joint["translations"][i]).map(|x| x as f32));
            // A file whose joints are all at rest has no list of translations.
            let found = found.get(frame * joints.len() + index);
            assert_eq!(
                found.copied().unwrap_or_default(),
                translation,
                "{name}, frame {frame}"
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
    // Every `.bvh` file of the folders was compared above.
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

pub(crate) fn read(text: &str, options: &ReadOptions) -> Result<Motion, Diagnostic> {
    read_bvh("t", text.as_bytes(), options).map(|loaded| loaded.clips[0].clone())
}

/// If a position has only one channel, the other coordinates are those of OFFSET.
#[test]
fn positions_replace_their_own_coordinate() {
    let text = format!("{HEAD}Frame Time: 0.04\n7 0 0 0\n8 0 0 0\n9 0 0 0\n");
    let clip = read(&text, &ReadOptions::default()).unwrap();
    assert_eq!(moved(&clip)[2], Vec3::new(1.0, 9.0, 3.0));
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

/// A rate of the options replaces a frame time that is that of no rate.
#[test]
fn a_frame_time_without_a_rate_is_replaced() {
    let rate = FrameRate::new(30, 1).unwrap();
    for raw_times in [false, true] {
        let options = ReadOptions {
            override_rate: Some(rate),
            raw_times,
            ..ReadOptions::default()
        };
        for written in ["0", "-0.1", "1e300", "nan"] {
            let text = format!("{HEAD}Frame Time: {written}\n{}", "0 0 0 0\n".repeat(3));
            let loaded = read_bvh("t", text.as_bytes(), &options).unwrap();
            assert_eq!(loaded.clips[0].rate, Some(rate));
            let [warning] = &*loaded.warnings else {
                panic!("{:?}", loaded.warnings);
            };
            let message = format!(
                "a frame time of {written} s is out of range (1e-9 to 1e9 s); because of --override-fps it is read at \
                 30 frames a second"
            );
            assert_eq!((warning.code, &warning.message), (Code::TwoRates, &message));
        }
        let text = format!("{HEAD}Frame Time: fast\n{}", "0 0 0 0\n".repeat(3));
        assert_eq!(read(&text, &options).unwrap_err().code, Code::Number);
    }
}

#[test]
fn joints_without_a_word_for_a_name_get_one() {
    let text = "HIERARCHY\nROOT {\nOFFSET 0 0 0\nJOINT linke Größe{ OFFSET 0 0 0 CHANNELS 1 Xrotation \
                End Site { OFFSET 0 1 0 } }\nJOINT joint0 { OFFSET 1 0 0\n} }\nMOTION\nFrames: 1\n\
                Frame Time: 1\n90\n";
    let clip = read(text, &ReadOptions::default()).unwrap();
    let names: Vec<_> = clip.set.tracks().map(|track| track.name.unwrap()).collect();
    assert_eq!(names, ["joint0", "linke Größe", "joint0#2"]);
    let rotated = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
    assert!(clip.set.track(1).keys[0].abs_diff_eq(rotated, 1e-7));
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
        memory: None,
    };
    let options = ReadOptions {
        limits,
        ..ReadOptions::default()
    };
    assert_eq!(read(HEAD, &options).unwrap_err().code, Code::LineTooLong);
}

proptest! {
    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read_bvh("t", &*bytes, &ReadOptions::default());
        let whole = [HEAD.as_bytes(), &bytes].concat();
        let _ = read_bvh("t", &*whole, &ReadOptions::default());
    }

    /// Nearly right files reach deeper than arbitrary bytes.
    #[test]
    fn damaged_files_never_panic(
        changes in prop::collection::vec((0usize..160, any::<u8>()), 0..4),
        from in 0usize..160,
        cut in 100usize..200,
    ) {
        let mut bytes = format!("{HEAD}Frame Time: 0.04\n7 0 0 0\n8 0 1e1 0\n9 0 0 -0.0\n").into_bytes();
        for (offset, byte) in changes {
            let offset = offset % bytes.len();
            bytes[offset] = byte;
        }
        let (from, cut) = (from % bytes.len(), cut % bytes.len());
        let piece = bytes[from..(from + 20).min(bytes.len())].to_vec();
        bytes.splice(cut..cut, piece);
        let _ = read_bvh("t", &*bytes, &ReadOptions::default());
    }
}
