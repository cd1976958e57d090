//! BVH as it is written: hierarchies, angles, refusals, and all of it read back.

use glam::{DQuat, Quat, Vec3};
use proptest::prelude::*;
use tumble::{EulerSequence, FrameRate, TrackSet};
use tumble_formats::bvh::FORMAT;
use tumble_formats::format::{MotionOptions, WriteError};
use tumble_formats::motion::{
    ChannelInterpolation, Channels, Joint, Motion, SampledClip, Transform,
};
use tumble_formats::{Code, Diagnostic, ReadOptions};

use crate::bvh::{angle, moved, read};

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

fn sampled<'a>(clip: &'a Motion, times: &'a [f64], rotations: &'a [Quat]) -> SampledClip<'a> {
    SampledClip {
        clip,
        times,
        rate: FrameRate::new(30, 1).ok(),
        rotations,
        translations: &[],
        scales: &[],
        scalars: &[],
        notes: &[],
        is_at_keys: false,
    }
}

fn write(
    clips: &[SampledClip<'_>],
    options: &MotionOptions,
) -> Result<(String, Vec<Diagnostic>), WriteError> {
    let mut out = Vec::new();
    let warnings = FORMAT.write_clips(clips, options, &mut out)?;
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

const ANGLE_ORDER: EulerSequence = EulerSequence::XYZ;

#[test]
fn joints_are_written_below_their_parents_with_usable_names() {
    // The parent of the third joint is the fourth, which comes after it.
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
                    Zposition Zrotation Xrotation Yrotation\n  JOINT left leg\n  {\n    OFFSET 0.1 \
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
    let reported: Vec<_> = warnings
        .iter()
        .map(|warning| (warning.code, &*warning.message))
        .collect();
    let no_room = "BVH cannot store this, left out: the scales";
    let changed = "`hips` is called `hips#3` in BVH";
    assert_eq!(
        reported,
        [(Code::NoRoom, no_room), (Code::NameChanged, changed)]
    );
    let back = read(&text, &ReadOptions::default()).unwrap();
    let parents: Vec<_> = back.skeleton.iter().map(|joint| joint.parent).collect();
    assert_eq!(parents, [None, Some(0), Some(0), Some(2), None]);
    let order = [0, 1, 3, 2, 4].map(|track| translations[5 + track]);
    assert_eq!(moved(&back)[5..], order);
}

#[test]
fn what_bvh_cannot_hold_is_refused() {
    let rotations = [Quat::IDENTITY; 2];
    let clip = clip(&[None], &["a"], 2, &rotations);
    let times = [0.0, 1.0 / 30.0];
    let good = sampled(&clip, &times, &rotations);
    let options = MotionOptions::default();
    let refusal = |clips: &[SampledClip<'_>], options: &MotionOptions| match write(clips, options) {
        Err(WriteError::Refused(error)) => {
            assert_eq!(error.code, Code::BvhWrite);
            error.message
        }
        other => panic!("{other:?}"),
    };
    assert!(write(std::slice::from_ref(&good), &options).is_ok());
    let two = refusal(&[good.clone(), good.clone()], &options);
    assert!(two.contains("2 clips"), "{two}");
    let mut bad = good.clone();
    bad.rate = None;
    assert!(refusal(&[bad], &options).contains("constant rate"));
    let mut bad = good.clone();
    bad.times = &[0.0, 0.1];
    assert!(refusal(&[bad], &options).contains("0.1 s is not at the next frame"));
    let mut bad = good.clone();
    bad.translations = &[Vec3::ZERO, Vec3::NAN];
    assert!(refusal(&[bad], &options).contains("not finite"));
    let twice = MotionOptions {
        sequence: "ZXZ".parse().ok(),
        ..MotionOptions::default()
    };
    assert!(refusal(std::slice::from_ref(&good), &twice).contains("an axis twice"));
    let mut circle = clip.clone();
    circle.skeleton[0].parent = Some(0);
    match write(&[sampled(&circle, &times, &rotations)], &options) {
        Err(WriteError::Refused(error)) => {
            assert_eq!(error.code, Code::Parents);
            assert!(error.message.contains("is its own ancestor"), "{error}");
        }
        other => panic!("{other:?}"),
    }
    let empty = Motion::default();
    assert!(refusal(&[sampled(&empty, &times, &[])], &options).contains("nothing to write"));
    let mut bad = good.clone();
    bad.rotations = &rotations[1..];
    assert!(matches!(write(&[bad], &options), Err(WriteError::Io(_))));
    let later = [2.0, 2.0 + 1.0 / 30.0];
    let (_, warnings) = write(&[sampled(&clip, &later, &rotations)], &options).unwrap();
    assert_eq!(warnings[0].code, Code::StartMoved);
}

/// 167/10000 s is no rounded 1/60 s, and is written so that no reader takes it for one.
#[test]
fn frame_times_are_short_and_mean_their_rate() {
    let rotations = [Quat::IDENTITY];
    let clip = clip(&[None], &["a"], 1, &rotations);
    for (frames, seconds, shown) in [
        (25, 1, "0.04"),
        (60_000, 1001, "0.016683333333333335"),
        (10_000, 167, "0.0167000000000000"),
        (1, 2, "2"),
    ] {
        let mut sampled = sampled(&clip, &[0.0], &rotations);
        sampled.rate = FrameRate::new(frames, seconds).ok();
        let (text, _) = write(&[sampled], &MotionOptions::default()).unwrap();
        assert!(text.contains(&format!("\nFrame Time: {shown}\n")), "{text}");
        let back = read(&text, &ReadOptions::default()).unwrap();
        assert_eq!(back.rate, FrameRate::new(frames, seconds).ok());
    }
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
        sequence: Some(ANGLE_ORDER),
        ..MotionOptions::default()
    };
    let (text, _) = write(&[sampled(&clip, &times, &rotations)], &options).unwrap();
    let rows = rows(&text);
    let last = rows.last().unwrap();
    let total = f64::from(3999) * 0.7f64.to_degrees();
    assert!((last[4] - total).abs() < 1e-4, "{last:?} {total}");
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
        // Near gimbal lock: about 90° about one axis, between rotations about other axes.
        lock.prop_map(|(first, middle, a, b, near, down)| {
            let about_axis = |axis: usize, angle| match axis {
                0 => DQuat::from_rotation_x(angle),
                1 => DQuat::from_rotation_y(angle),
                _ => DQuat::from_rotation_z(angle),
            };
            let quarter =
                (std::f64::consts::FRAC_PI_2 + 10f64.powf(near)) * if down { -1.0 } else { 1.0 };
            (about_axis(first, a) * about_axis(middle, quarter) * about_axis(3 - first, b))
                .as_quat()
        }),
    ]
}

proptest! {
    #[test]
    fn what_is_written_reads_back_within_a_microradian(
        rotations in prop::collection::vec(rotation(), 1..40),
        sequence in 0usize..12,
        translations in prop::array::uniform3(-1e3f32..1e3),
    ) {
        let mut sequences = EulerSequence::all();
        sequences.retain(|sequence| sequence.axes()[0] != sequence.axes()[2]);
        prop_assert_eq!(sequences.len(), 12);
        let sequence = sequences[sequence];
        let mut clip = clip(&[None], &["a"], rotations.len(), &rotations);
        clip.channels.push(Channels {
            rotation: Some(ChannelInterpolation::Linear),
            ..Channels::default()
        });
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

        prop_assert_eq!(moved(&back), translations);
        for pair in rows(&text).windows(2) {
            for i in 3..6 {
                prop_assert!((pair[1][i] - pair[0][i]).abs() < 180.0 + 1e-4, "{pair:?}");
            }
        }
    }
}
