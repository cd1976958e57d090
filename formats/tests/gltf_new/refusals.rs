//! Clips that no new file can hold are refused.

use std::io;

use glam::Vec3;
use tumble_formats::Code;
use tumble_formats::format::WriteError;
use tumble_formats::gltf::write_new::write_new;
use tumble_formats::motion::SampledClip;

use crate::gltf_new::{Clip, glb, leg, options, written};

/// Refused, with that code and these words, before a byte is written.
fn assert_refused(clips: &[SampledClip<'_>], code: Code, words: &[&str]) {
    let mut bytes = Vec::new();
    let error = write_new(clips, &options("glb"), &mut bytes).unwrap_err();
    let WriteError::Refused(diagnostic) = error else {
        panic!("{error}");
    };
    assert_eq!(diagnostic.code, code);
    for word in words {
        assert!(diagnostic.to_string().contains(word), "{diagnostic}");
    }
    assert!(bytes.is_empty());
}

#[test]
fn what_gltf_cannot_hold_is_refused() {
    assert_refused(&[], Code::NothingToAnimate, &["out: error[E180]"]);
    let empty = Clip {
        times: vec![0.0],
        ..Clip::default()
    };
    assert_refused(
        &[leg().sampled(), empty.sampled()],
        Code::NothingToAnimate,
        &["clip 2: ", "no tracks"],
    );
    let mut clip = leg();
    clip.times.clear();
    clip.rotations.clear();
    clip.translations.clear();
    clip.scales.clear();
    assert_refused(
        &[clip.sampled()],
        Code::NothingToAnimate,
        &["clip 1 (Kick): ", "no samples"],
    );

    let mut circle = leg();
    circle.motion.skeleton[1].parent = Some(2);
    assert_refused(
        &[circle.sampled()],
        Code::NotTrees,
        &["is its own ancestor"],
    );
    circle.motion.skeleton[1].parent = Some(7);
    assert_refused(&[circle.sampled()], Code::NotTrees, &["track 7"]);
    let mut broken = leg();
    broken.motion.skeleton[2].rest.scale.y = f32::NAN;
    assert_refused(
        &[broken.sampled()],
        Code::NotTrees,
        &["`foot`", "not finite"],
    );
    let mut world = leg();
    world.motion.is_world = true;
    assert_refused(&[world.sampled()], Code::NotTrees, &["scales"]);

    let mut early = leg();
    early.times[0] = -1.5;
    assert_refused(&[early.sampled()], Code::TimesBelowZero, &["-1.5 s"]);
    let mut late = leg();
    late.times[2] = 1e39;
    assert_refused(&[late.sampled()], Code::TimesInF32, &["too large for f32"]);
}

/// After a day, the step of f32 is 7.8 ms: enough for 120 frames a second, too little for 240.
#[test]
fn times_that_f32_cannot_tell_apart_are_refused() {
    let at = |rate: f64| {
        let mut clip = leg();
        clip.times = (0..3)
            .map(|frame| 86_400.0 + f64::from(frame) / rate)
            .collect();
        clip
    };
    let words = [
        "86400.00416666667 s and 86400.00833",
        "0.0078125 s",
        "--fps 128 or less",
    ];
    assert_refused(&[at(240.0).sampled()], Code::TimesInF32, &words);
    let (json, _) = glb(&written(&[at(120.0).sampled()], "glb"));
    assert_eq!(json["accessors"][1]["max"][0], 86_400.015625);
}

#[test]
fn lists_of_other_lengths_are_no_clip() {
    let changes: [fn(&mut Clip); 5] = [
        |clip| clip.rotations.truncate(8),
        |clip| clip.translations.push(Vec3::ZERO),
        |clip| clip.scales.truncate(3),
        |clip| clip.motion.skeleton.truncate(2),
        |clip| clip.motion.channels.truncate(1),
    ];
    for change in changes {
        let mut clip = leg();
        change(&mut clip);
        let mut bytes = Vec::new();
        let error = write_new(&[clip.sampled()], &options("glb"), &mut bytes).unwrap_err();
        let WriteError::Io(error) = error else {
            panic!("{error}");
        };
        assert_eq!(
            (error.kind(), bytes.len()),
            (io::ErrorKind::InvalidInput, 0)
        );
    }
}
