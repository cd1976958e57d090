//! Trajectories: files of other programs, and our own files read back.

use std::fs;
use std::path::Path;

use glam::{Quat, Vec3};
use proptest::prelude::*;
use tumble::{FrameRate, TrackSet};
use tumble_formats::format::{MotionOptions, WriteError};
use tumble_formats::keyed::keyed;
use tumble_formats::keys::Duplicates;
use tumble_formats::motion::{Motion, SampledClip};
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::tum::{FORMAT, open_tum, read_tum};
use tumble_formats::{Code, Diagnostic, Format, Location, ReadOptions};

use crate::support::shared_data;

fn read(text: &str) -> Motion {
    let loaded = read_tum("t", text.as_bytes(), &ReadOptions::default()).unwrap();
    loaded.clips[0].clone()
}

fn write(clips: &[SampledClip<'_>]) -> Result<(String, Vec<Diagnostic>), WriteError> {
    let mut out = Vec::new();
    let warnings = FORMAT.write_clips(clips, &MotionOptions::default(), &mut out)?;
    Ok((String::from_utf8(out).unwrap(), warnings))
}

/// The keys of a clip as they are.
fn written(clip: &Motion) -> String {
    write(&[keyed(clip).unwrap().of(clip, clip.rate, &[])])
        .unwrap()
        .0
}

/// Times that are near frames, but not at frames, do not change when they are read again.
#[test]
fn times_near_frames_stay_what_they_are() {
    let line = |time: &str| format!("{time} 0 0 0 0 0 0 1\n");
    let clip = read(&["0.12500", "0.15830", "0.19170"].map(line).concat());
    assert_eq!(clip.set.track(0).times, [0.125, 0.1583, 0.1917]);
    let text = written(&clip);
    assert!(text.contains("\n0.158300000 "), "{text}");
    assert_eq!(read(&text).set.track(0).times, [0.125, 0.1583, 0.1917]);
    // Times that were rounded to four decimals lie on frames.
    let clip = read(&["0.1250", "0.1583", "0.1917"].map(line).concat());
    assert_eq!(clip.rate, FrameRate::new(30, 1).ok());
    assert_eq!(
        read(&written(&clip)).set.track(0).times,
        clip.set.track(0).times
    );
}

#[test]
fn a_path_at_unix_times_keeps_every_digit() {
    let Some(data) = shared_data() else { return };
    let path = data.join("tum/freiburg1_xyz-groundtruth.txt");
    let text = fs::read_to_string(&path).unwrap();
    let detected = Format::detect(&path, &text.as_bytes()[..64]);
    assert_eq!(detected.name, "tum");
    let loaded = open_tum(&path, &ReadOptions::default()).unwrap();
    assert_eq!(loaded.warnings, []);
    let clip = &loaded.clips[0];
    assert_eq!((clip.set.track_count(), clip.set.key_count()), (1, 3000));
    assert_eq!((clip.time_offset, clip.rate), (1_305_031_098, None));
    let track = clip.set.track(0);
    assert_eq!((track.name, track.times[0]), (Some("body"), 0.6659));
    // The file has 1305031128.7555; the nearest f64 is 1305031128.7555001.
    assert_eq!(track.times[2999], 30.7555);
    let again = written(clip);
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let found = again.lines().filter(|line| !line.starts_with('#'));
    let numbers = |line: &str| -> Vec<f64> {
        let numbers = line.split(' ').skip(1);
        numbers.map(|number| number.parse().unwrap()).collect()
    };
    let mut count = 0;
    for (line, found) in lines.zip(found) {
        let [input, shown] = [line, found].map(|line| line.split_once(' ').unwrap().0);
        let short = |time: &str| time.trim_end_matches('0').trim_end_matches('.').to_owned();
        assert_eq!(short(input), short(shown));
        let (input, shown) = (numbers(line), numbers(found));
        let norm = input[3..].iter().map(|x| x * x).sum::<f64>().sqrt();
        for i in 0..7 {
            let expected = if i < 3 { input[i] } else { input[i] / norm };
            // Keys whose norm is within 4e-7 of 1 keep their digits.
            assert!((shown[i] - expected).abs() < 5e-7, "{line}: {found}");
        }
        count += 1;
    }
    assert_eq!(count, 3000);
    assert_eq!(bits(&read(&again)), bits(clip));
}

fn bits(clip: &Motion) -> (i64, Vec<u64>, Vec<[u32; 7]>) {
    let samples = keyed(clip).unwrap();
    let times = samples.times.iter().map(|time| time.to_bits()).collect();
    let rows = samples.rotations.iter().enumerate().map(|(row, q)| {
        let position = samples.translations.get(row).copied().unwrap_or_default();
        let [x, y, z] = (clip.origin(0) + position.as_dvec3()).as_vec3().to_array();
        let [qx, qy, qz, qw] = q.to_array();
        [x, y, z, qx, qy, qz, qw].map(f32::to_bits)
    });
    (clip.time_offset, times, rows.collect())
}

#[test]
fn files_are_known_by_their_heading_or_ending() {
    let detect = |path: &str, start: &str| Format::detect(Path::new(path), start.as_bytes()).name;
    assert_eq!(
        detect("path.txt", "# timestamp tx ty tz qx qy qz qw\n"),
        "tum"
    );
    assert_eq!(detect("path.tum", "0 0 0 0 0 0 0 1\n"), "tum");
    // EuRoC's positions alone are a table.
    let positions = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m]";
    assert_eq!(detect("data.csv", positions), "csv");
    let poses = format!("{positions},q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n");
    assert_eq!(detect("data.csv", &poses), "euroc");
    let reordered = format!("{positions},q_RS_x [],q_RS_y [],q_RS_z [],q_RS_w []\n");
    assert_eq!(detect("data.csv", &reordered), "csv");
    assert_eq!(detect("a.dat", "# 4 3.0\n# tx ty tz"), "dat");
}

#[test]
fn times_on_frames_are_frames_of_a_rate() {
    let rate = FrameRate::new(25, 1).ok();
    let clip = read("7.04 0 0 0 0 0 0 1\n7.08 0 0 0 0 0 0 1\n8 0 0 0 0 0 0 1\n");
    assert_eq!((clip.time_offset, clip.rate), (0, rate));
    assert_eq!(clip.set.track(0).times, [176.0 / 25.0, 177.0 / 25.0, 8.0]);
    // Large times are counted from a whole second.
    let clip = read(
        "1700000007.04 0 0 0 0 0 0 1\n1700000007.08 0 0 0 0 0 0 1\n1700000008 0 0 0 0 0 0 1\n",
    );
    assert_eq!((clip.time_offset, clip.rate), (1_700_000_007, rate));
    assert_eq!(clip.set.track(0).times, [1.0 / 25.0, 2.0 / 25.0, 1.0]);
    let before = read("-1700000000.75 0 0 0 0 0 0 1\n-1699999999.5 0 0 0 0 0 0 1\n");
    assert_eq!(
        (before.time_offset, before.set.track(0).times),
        (-1_700_000_001, &[0.25, 1.5][..])
    );
    let before = read("-0.75 0 0 0 0 0 0 1\n.5 0 0 0 0 0 0 1\n");
    assert_eq!(
        (before.time_offset, before.set.track(0).times),
        (0, &[-0.75, 0.5][..])
    );
}

/// ORB-SLAM writes nanoseconds, as whole numbers or with zeros behind them.
#[test]
fn nanoseconds_keep_their_digits() {
    for end in ["", ".000000"] {
        let line = |ns: u64| format!("{ns}{end} 0 0 0 0 0 0 1\n");
        let text: String = (0..4)
            .map(|k| line(1_403_636_579_763_555_584 + k * 50_000_000))
            .collect();
        let options = ReadOptions::default();
        let loaded = read_tum("t", text.as_bytes(), &options).unwrap();
        let clip = &loaded.clips[0];
        assert_eq!(
            (clip.time_offset, clip.rate),
            (1_403_636_579, FrameRate::new(20, 1).ok())
        );
        assert_eq!(clip.set.track(0).times[..2], [0.763_555_584, 0.813_555_584]);
        assert_eq!(loaded.warnings[0].code, Code::TimeUnit);
        let options = ReadOptions {
            time_unit: Some(tumble_formats::format::TimeUnit::Nanoseconds),
            ..options
        };
        let said = read_tum("t", text.as_bytes(), &options).unwrap();
        assert_eq!(bits(&said.clips[0]), bits(clip));
        assert!(said.warnings.is_empty());
        assert!(written(clip).contains("\n1403636579.813555584 0 0 0"));
    }
}

#[test]
fn equal_times_keep_the_pose_that_is_asked_for() {
    let text = "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n3 3 0 0 0 0 0 1\n";
    let both = ReadOptions {
        duplicates: Duplicates::Both,
        ..ReadOptions::default()
    };
    let loaded = read_tum("t", text.as_bytes(), &both).unwrap();
    let jump = keyed(&loaded.clips[0]).unwrap();
    assert_eq!(jump.translations, [0.0, 1.0, 2.0, 3.0].map(|x| Vec3::X * x));
    assert_eq!(jump.times, [1.0, 2.0 - f64::from(f32::EPSILON), 2.0, 3.0]);
    for (duplicates, kept) in [(Duplicates::First, 1.0), (Duplicates::Last, 2.0)] {
        let options = ReadOptions {
            duplicates,
            ..ReadOptions::default()
        };
        let loaded = read_tum("t", text.as_bytes(), &options).unwrap();
        let positions = keyed(&loaded.clips[0]).unwrap().translations;
        assert_eq!(positions, [0.0, kept, 3.0].map(|x| Vec3::X * x));
    }
}

#[test]
fn what_a_trajectory_cannot_hold_is_refused() {
    let clip = read("1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n");
    let samples = keyed(&clip).unwrap();
    let notes = [("method", "slerp\nor so".to_owned())];
    let good = samples.of(&clip, None, &notes);
    let (text, warnings) = write(std::slice::from_ref(&good)).unwrap();
    let expected = "# timestamp tx ty tz qx qy qz qw\n# method: slerp or so\n1 0 0 0 0 0 0 1\n2 1 0 \
                    0 0 0 0 1\n";
    assert_eq!((text.as_str(), warnings), (expected, Vec::new()));
    let refusal = |clips: &[SampledClip<'_>]| match write(clips) {
        Err(WriteError::Refused(error)) => {
            assert_eq!(error.code, Code::TumWrite);
            error.message
        }
        other => panic!("{other:?}"),
    };
    assert!(refusal(&[]).contains("0 clips"));
    let mut two = clip.clone();
    two.set.push("other", &[0.0], &[Quat::IDENTITY]).unwrap();
    let mut bad = good.clone();
    bad.clip = &two;
    assert!(refusal(&[bad]).contains("2 tracks"));
    let mut bad = good.clone();
    bad.times = &[0.0, 1e30];
    assert!(refusal(&[bad]).contains("out of range"));
    let mut bad = good.clone();
    bad.translations = &[Vec3::ZERO, Vec3::INFINITY];
    assert!(refusal(&[bad]).contains("not finite"));
    let mut bad = good.clone();
    bad.times = &[0.0];
    assert!(matches!(write(&[bad]), Err(WriteError::Io(_))));
    let mut scaled = good.clone();
    let scales = [Vec3::ONE, Vec3::splat(2.0)];
    scaled.scales = &scales;
    assert_eq!(write(&[scaled]).unwrap().1[0].code, Code::NoRoom);
}

proptest! {
    #[test]
    fn what_is_written_reads_back_bit_for_bit(
        axes in prop::collection::vec(prop::array::uniform3(-4.0f32..4.0), 1..20),
        positions in prop::array::uniform3(-1e6f32..1e6),
        offset in prop_oneof![Just(0i64), Just(1_700_000_000), 1_000_000i64..2_000_000, -100i64..100],
        start in 0.0f64..1.0,
        step in 1e-6f64..10.0,
    ) {
        let keys: Vec<Quat> =
            axes.iter().map(|&[x, y, z]| Quat::from_scaled_axis([x, y, z].into())).collect();
        // Times of a clock have nanoseconds.
        let stored = |time: f64| match offset.abs() > 100 {
            true => (time * 1e9).round() / 1e9,
            false => time,
        };
        let times: Vec<f64> = (0..keys.len()).map(|i| stored(start + i as f64 * step)).collect();
        let mut set = TrackSet::with_shared_times(&times, &keys).unwrap();
        let moved: Vec<Vec3> =
            (0..keys.len()).map(|i| Vec3::from_array(positions) * (i as f32 + 0.1)).collect();
        set.set_translations(0, &times, &moved, &[]).unwrap();
        let clip = Motion { set, time_offset: offset, ..Motion::default() };
        let raw = ReadOptions { raw_times: true, ..ReadOptions::default() };
        let back = read_tum("t", written(&clip).as_bytes(), &raw).unwrap();
        let (found, expected) = (bits(&back.clips[0]), bits(&clip));
        if offset.abs() > 100 {
            prop_assert_eq!(found, expected);
            return Ok(());
        }
        // Times near 0 are counted from 0: the digits of a time stand for all numbers within half a step of f64, and the
        // sum is rounded.
        prop_assert_eq!(found.0, 0);
        prop_assert_eq!(found.2, expected.2);
        for (found, time) in back.clips[0].set.track(0).times.iter().zip(&times) {
            let sum = offset as f64 + time;
let step = (offset.abs() as f64 + time) * f64::EPSILON;
            prop_assert!((found - sum).abs() <= step, "{found}, {sum}");
        }
    }

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read_tum("t", &*bytes, &ReadOptions::default());
    }

    #[test]
    fn damaged_files_never_panic(offset in 0usize..80, byte in any::<u8>(), cut in 0usize..90) {
        let mut bytes = b"1700000000.125 1 2 3 0 0 0 1\n1.7000000015e9,1e-3,2,3,0,0.6,0,.8 # x\n".to_vec();
        let offset = offset % bytes.len();
        bytes[offset] = byte;
        bytes.truncate(cut);
        let _ = read_tum("t", &*bytes, &ReadOptions::default());
    }
}

#[test]
fn quaternions_of_another_order_are_read_by_an_option() {
    let text = "0 1 2 3 1 0 0 0\n0.1 1 2 3 0.8 0 0 0.6\n";
    let options = ReadOptions {
        source_order: Some(ComponentOrder::Wxyz),
        ..ReadOptions::default()
    };
    let loaded = read_tum("t", text.as_bytes(), &options).unwrap();
    let keys = loaded.clips[0].set.track(0).keys;
    assert_eq!(keys, [Quat::IDENTITY, Quat::from_xyzw(0.0, 0.0, 0.6, 0.8)]);
}

#[test]
fn poses_with_nan_are_left_out_if_asked() {
    let text =
        "0 1 2 3 0 0 0 1\n1 nan nan nan 0 0 0 1\n2 1 2 3 NaN -nan 0 1\n3 4 5 6 0 0 0.6 0.8\n";
    let refused = read_tum("t", text.as_bytes(), &ReadOptions::default()).unwrap_err();
    assert_eq!(refused.code, Code::NotFinite);
    assert!(
        refused
            .message
            .ends_with("leave the pose out with --bridge-gaps"),
        "{refused}"
    );
    let options = ReadOptions {
        bridge_gaps: true,
        ..ReadOptions::default()
    };
    let loaded = read_tum("t", text.as_bytes(), &options).unwrap();
    assert_eq!(loaded.clips[0].set.track(0).times, [0.0, 3.0]);
    let warning = &loaded.warnings[0];
    assert_eq!((warning.code, warning.count), (Code::Bridged, 2));
    assert_eq!(
        warning.location,
        Some(Location::Text { line: 2, column: 1 })
    );
    for bad in [
        "0 nan 0 0 0 0 0 1\n",
        "nan 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n",
    ] {
        let refused = read_tum("t", bad.as_bytes(), &options).unwrap_err();
        assert_eq!(refused.code, Code::NotFinite, "{bad}");
    }
}
