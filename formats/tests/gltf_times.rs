//! The times at which a glTF file is sampled, and inputs that are refused before sampling.

use std::path::Path;

use tumble::FrameRate;
use tumble_formats::Code;
use tumble_formats::format::MotionOptions;
use tumble_formats::motion::SampledClip;

use crate::gltf::open;
use crate::gltf_bake::{document, refused, times};
use crate::support::shared_data;

#[test]
fn frames_that_f32_cannot_tell_apart_are_refused_with_the_rate_that_fits() {
    let Some(data) = shared_data() else { return };
    let loaded = open(&data.join("gltf/made/after_a_day.gltf"));
    let rate = |fps| FrameRate::new(fps, 1).unwrap();
    let refused = document(&loaded).frames(0, rate(240)).unwrap_err();
    assert_eq!(refused.code, Code::TimesInF32);
    let said = refused.to_string();
    assert!(said.contains("/animations/0: error[E182]"), "{said}");
    assert!(
        said.contains("steps of f32 are 0.0078125 s") && said.contains("give --fps 128 or less"),
        "{said}"
    );
    let found = times(document(&loaded), &loaded.clips[0], rate(128));
    assert_eq!(
        (found.len(), found[0], found[128]),
        (129, 86_399.0, 86_400.0)
    );
}

#[test]
fn times_are_whole_frames_and_both_ends() {
    let Some(data) = shared_data() else { return };
    let of_file = |file: &str, fps| {
        let loaded = open(&data.join("gltf").join(file));
        let rate = FrameRate::new(fps, 1).unwrap();
        times(document(&loaded), &loaded.clips[0], rate)
    };
    assert_eq!(
        of_file("made/start_late.gltf", 2),
        [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    );
    assert_eq!(of_file("made/single_key.gltf", 60).len(), 43);
    // 17 frames of 24 fps end on a frame of 120, and not on one of 50.
    let fox = open(&data.join("gltf/Fox.glb"));
    let walk = fox
        .clips
        .iter()
        .find(|clip| clip.name.as_deref() == Some("Walk"))
        .unwrap();
    let of = |fps| times(document(&fox), walk, FrameRate::new(fps, 1).unwrap());
    assert_eq!((of(120).len(), of(120)[85]), (86, 17.0 / 24.0));
    assert_eq!(
        (of(50).len(), of(50)[35], of(50)[36]),
        (37, 0.7, 17.0 / 24.0)
    );
}

#[test]
fn more_than_a_glb_holds_is_refused_before_any_work() {
    let Some(data) = shared_data() else { return };
    let loaded = open(&data.join("gltf/Fox.glb"));
    let times: Vec<f64> = (0..6_000_000).map(f64::from).collect();
    let sampled = |clip| SampledClip {
        clip,
        times: &times,
        rate: None,
        rotations: &[],
        translations: &[],
        scales: &[],
        scalars: &[],
        notes: &[],
        is_at_keys: false,
    };
    let clips: Vec<_> = loaded.clips.iter().map(sampled).enumerate().collect();
    let mut out = Vec::new();
    let written = document(&loaded).write(
        &clips,
        &MotionOptions::default(),
        Path::new("/a.glb"),
        &mut out,
    );
    assert_eq!(refused(written.unwrap_err()).code, Code::GlbTooLong);
    assert!(out.is_empty());
}
