//! Writing: our own layout, and files again in the layout that they were read in.

use glam::{Quat, Vec3};
use std::path::Path;
use tumble::{FrameRate, SampleTimes, TrackSet};
use tumble_formats::diagnostic::Code;
use tumble_formats::format::{MotionOptions, WriteError};
use tumble_formats::motion::{Joint, Motion, SampledClip, Transform};
use tumble_formats::npz::read_npz;
use tumble_formats::npz::write::write_npz;
use tumble_formats::{Loaded, ReadOptions};

use super::{Picked, fixture, read, sample};

/// Two joints that turn and move, off every grid of times.
fn clip() -> (Motion, Vec<Quat>, Vec<Vec3>) {
    let times = [0.1, 0.2 + 1e-9, 0.7];
    let mut clip = Motion {
        name: Some("Größe 走".to_owned()),
        ..Motion::default()
    };
    let (mut rotations, mut vectors) = (Vec::new(), Vec::new());
    for frame in 0..3 {
        for track in 0..2 {
            let sign = if frame == 1 { -1.0 } else { 1.0 };
            let q = Quat::from_euler(glam::EulerRot::XYZ, 0.3 * frame as f32, track as f32, 0.2);
            rotations.push(q * sign);
            vectors.push(Vec3::new(0.1 * frame as f32, track as f32, -3.5e-9));
        }
    }
    for (track, name) in ["hüfte", ""].into_iter().enumerate() {
        let of_track = |i: usize| 2 * i + track;
        let keys: Vec<Quat> = (0..3).map(|i| rotations[of_track(i)]).collect();
        clip.set.push(name, &times, &keys).unwrap();
        let keys: Vec<Vec3> = (0..3).map(|i| vectors[of_track(i)]).collect();
        clip.set
            .set_translations(track, &times, &keys, &[])
            .unwrap();
        clip.set.set_scales(track, &times, &keys, &[]).unwrap();
        let rest = Transform {
            translation: Vec3::new(0.0, track as f32, 0.1),
            rotation: Quat::from_rotation_y(0.5),
            scale: Vec3::splat(1.5),
        };
        let parent = (track == 1).then_some(0);
        clip.skeleton.push(Joint { parent, rest });
    }
    (clip, rotations, vectors)
}

#[test]
fn our_layout_reads_back_as_written() {
    let (clip, rotations, vectors) = clip();
    let sampled = SampledClip {
        clip: &clip,
        times: clip.set.track(0).times,
        rate: None,
        rotations: &rotations,
        translations: &vectors,
        scales: &vectors,
        scalars: &[],
        notes: &[("method", "slerp".to_owned()), ("names", "odd".to_owned())],
        is_at_keys: false,
    };
    let mut bytes = Vec::new();
    let warnings = write_npz(
        std::slice::from_ref(&sampled),
        &MotionOptions::default(),
        &mut bytes,
    )
    .unwrap();
    assert!(warnings.is_empty());
    let loaded = read(bytes.clone()).unwrap();
    let found = &loaded.clips[0];
    assert_eq!(found.set, clip.set);
    assert_eq!(found.skeleton, clip.skeleton);
    assert_eq!(
        (&found.name, found.rate, found.is_world),
        (&clip.name, None, false)
    );
    // Writing the clip that was read gives the same file, except for the notes.
    let again = SampledClip {
        clip: found,
        ..sampled.clone()
    };
    let mut second = Vec::new();
    write_npz(&[again], &MotionOptions::default(), &mut second).unwrap();
    assert_eq!(second, bytes);

    let two = [sampled.clone(), sampled.clone()];
    for (clips, code) in [(&two[..], Code::OneClip), (&[], Code::OneClip)] {
        let error = write_npz(clips, &MotionOptions::default(), &mut Vec::new()).unwrap_err();
        assert_refused(error, code);
    }
    let short = SampledClip {
        rotations: &rotations[1..],
        ..sampled
    };
    let error = write_npz(&[short], &MotionOptions::default(), &mut Vec::new()).unwrap_err();
    assert_refused(error, Code::Layout);
}

fn assert_refused(error: WriteError, code: Code) {
    match error {
        WriteError::Refused(diagnostic) => assert_eq!(diagnostic.code, code, "{diagnostic}"),
        WriteError::Io(error) => panic!("{error}"),
    }
}

#[test]
fn worlds_and_rates_are_kept() {
    let clip = Motion {
        is_world: true,
        ..clip().0
    };
    let picked = Picked {
        times: (0..3)
            .map(|k| FrameRate::new(30_000, 1001).unwrap().time_of(k))
            .collect(),
        rotations: vec![Quat::IDENTITY; 6],
        translations: Vec::new(),
        scalars: Vec::new(),
    };
    let rate = FrameRate::new(30_000, 1001).ok();
    let sampled = SampledClip {
        rate,
        ..picked.sampled(&clip)
    };
    let mut bytes = Vec::new();
    write_npz(&[sampled], &MotionOptions::default(), &mut bytes).unwrap();
    let found = read(bytes).unwrap().clips.swap_remove(0);
    assert_eq!((found.rate, found.is_world), (rate, true));
    assert_eq!(found.set.track(0).times, picked.times);
}

/// Reads a file, writes each second frame at half its rate, and reads that.
fn halved(loaded: &Loaded, linear: &[&str]) -> (Vec<u8>, Loaded, Vec<String>) {
    let clip = &loaded.clips[0];
    let rate = FrameRate::new(clip.rate.unwrap().per_second() as u64 / 2, 1).unwrap();
    let document = loaded.document.as_ref().unwrap();
    let picked = Picked::of(clip, 2);
    let frames = document.frames(0, rate).unwrap().frames;
    assert_eq!(frames, SampleTimes::at(picked.times.clone()));
    let sampled = SampledClip {
        rate: Some(rate),
        ..picked.sampled(clip)
    };
    let options = MotionOptions {
        linear: linear.iter().map(|&name| name.to_owned()).collect(),
        ..MotionOptions::default()
    };
    let mut bytes = Vec::new();
    let warnings = document
        .write(&[(0, sampled)], &options, Path::new("out.npz"), &mut bytes)
        .unwrap();
    let warnings = warnings.iter().map(ToString::to_string).collect();
    let again = read(bytes.clone()).unwrap();
    assert_eq!(again.clips[0].rate, Some(rate));
    assert_eq!(again.clips[0].skeleton, clip.skeleton);
    for (track, other) in again.clips[0].set.tracks().zip(clip.set.tracks()) {
        assert_eq!(track.name, other.name);
        for (frame, key) in track.keys.iter().enumerate() {
            let apart = (*key - other.keys[2 * frame]).length();
            assert!(apart < 3e-7, "{:?}, frame {frame}: {apart}", track.name);
        }
    }
    (bytes, again, warnings)
}

/// The bytes of a stored member: from its header to the next one.
fn member<'a>(archive: &'a [u8], name: &str) -> Option<&'a [u8]> {
    let find = |part: &[u8], from: usize| {
        let at = archive[from..]
            .windows(part.len())
            .position(|window| window == part);
        at.map(|at| at + from)
    };
    let array = find(b"\x93NUMPY", find(name.as_bytes(), 0)?)?;
    let end = find(b"PK", array)?;
    Some(&archive[array..end])
}

#[test]
fn smpl_is_written_again_with_its_constants_and_the_new_rate() {
    let Some(path) = sample("smplh_like.npz") else {
        return;
    };
    let original = std::fs::read(path).unwrap();
    let loaded = read(original.clone()).unwrap();
    let (bytes, _, warnings) = halved(&loaded, &[]);
    for constant in ["betas.npy", "gender.npy"] {
        assert_eq!(
            member(&bytes, constant).unwrap(),
            member(&original, constant).unwrap()
        );
    }
    assert!(member(&bytes, "dmpls.npy").is_none());
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0].contains("W302") && warnings[0].contains("`dmpls`;"),
        "{}",
        warnings[0]
    );

    let (bytes, _, warnings) = halved(&loaded, &["dmpls"]);
    assert!(warnings.is_empty());
    let dmpls = member(&bytes, "dmpls.npy").unwrap();
    let header = npyz_shape(dmpls);
    assert_eq!(header, [61, 8]);
}

fn npyz_shape(array: &[u8]) -> Vec<u64> {
    npyz::NpyHeader::from_reader(array)
        .unwrap()
        .shape()
        .to_vec()
}

/// If a file has both `poses` and the arrays of its parts, all of them are written.
#[test]
fn poses_and_their_pieces_stay_the_same() {
    let Some(path) = sample("smplx_like.npz") else {
        return;
    };
    let loaded = read(std::fs::read(path).unwrap()).unwrap();
    let (bytes, _, warnings) = halved(&loaded, &[]);
    assert!(warnings.is_empty(), "{warnings:?}");
    // Without `poses`, the arrays of its parts are read.
    let mut pieces = bytes.clone();
    for at in 0..pieces.len() - 9 {
        if &pieces[at..at + 9] == b"poses.npy" {
            pieces[at] = b'q';
        }
    }
    let [whole, pieces] = [bytes, pieces].map(|bytes| read(bytes).unwrap().clips.swap_remove(0));
    assert_eq!(whole.set, pieces.set);
    assert_eq!(whole.skeleton, pieces.skeleton);
}

#[test]
fn bodies_and_our_own_files_are_written_again() {
    if let Some(path) = sample("bodies_like.npz") {
        let original = std::fs::read(path).unwrap();
        let loaded = read(original.clone()).unwrap();
        let (bytes, again, warnings) = halved(&loaded, &[]);
        assert!(again.clips[0].is_world);
        assert!(warnings.is_empty(), "{warnings:?}");
        let [scalar, before] = [&again, &loaded].map(|it| it.clips[0].set.scalar(1).unwrap());
        let halved: Vec<f32> = before.keys.iter().step_by(2).copied().collect();
        assert_eq!((scalar.name, scalar.keys), (before.name, &halved[..]));
        for constant in ["body_names.npy", "dof_names.npy"] {
            assert_eq!(
                member(&bytes, constant).unwrap(),
                member(&original, constant).unwrap()
            );
        }
    }
    let loaded = read(fixture("npz/own_fps.npz")).unwrap();
    let (_, again, warnings) = halved(&loaded, &[]);
    assert!(warnings.is_empty());
    assert_eq!(again.clips[0].set.track(1).times.len(), 2);
}

#[test]
fn what_does_not_fit_the_layout_is_refused() {
    let loaded = read(fixture("npz/smpl.npz")).unwrap();
    let clip = &loaded.clips[0];
    let document = loaded.document.as_ref().unwrap();
    let picked = Picked::of(clip, 1);
    let rated = SampledClip {
        rate: clip.rate,
        ..picked.sampled(clip)
    };
    let write = |clips: &[(usize, SampledClip<'_>)], linear: &str| {
        let linear = linear.split_whitespace().map(str::to_owned).collect();
        let options = MotionOptions {
            linear,
            ..MotionOptions::default()
        };
        document
            .write(clips, &options, Path::new("out.npz"), &mut Vec::new())
            .unwrap_err()
    };
    assert_refused(write(&[(1, rated.clone())], ""), Code::OneClip);
    assert_refused(write(&[(0, picked.sampled(clip))], ""), Code::Layout);
    assert_refused(write(&[(0, rated.clone())], "dmpls"), Code::NotPerFrame);
    assert_refused(write(&[(0, rated)], "trans"), Code::NotPerFrame);
    let other = Motion {
        set: TrackSet::with_shared_times(&[0.0], &[Quat::IDENTITY]).unwrap(),
        ..Motion::default()
    };
    let single = Picked::of(&other, 1);
    let sampled = SampledClip {
        rate: clip.rate,
        ..single.sampled(&other)
    };
    assert_refused(write(&[(0, sampled)], ""), Code::Layout);
    let rate = FrameRate::new(1 << 50, 1).unwrap();
    assert_eq!(document.frames(0, rate).unwrap_err().code, Code::Layout);
}

/// If the rate of a file was stated by an option, the rewritten file states it.
#[test]
fn a_rate_is_added_where_there_was_none() {
    let options = ReadOptions {
        source_rate: FrameRate::new(60, 1).ok(),
        ..ReadOptions::default()
    };
    let loaded = read_npz("t", fixture("npz/no_rate.npz"), &options).unwrap();
    halved(&loaded, &[]);
}
