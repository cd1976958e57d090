//! Calls as JavaScript makes them, but from Rust. `npm/tests` has those that need JavaScript.

use glam::{Quat, Vec3};
use serde_json::{Value, json};
use tumble::{Device, Engine, Interpolation, METHODS, SampleTimes, TrackSet, WrapMode, method};
use tumble_formats::motion::Motion;
use tumble_formats::packed;

use crate::answer::Answer;
use crate::calls::Calls;

fn clip() -> Motion {
    let mut set = TrackSet::new();
    for track in 0..3_u8 {
        let angle = |key: u8| f32::from(key * key + track) * 0.3;
        let keys: Vec<Quat> = (0..5)
            .map(|key| Quat::from_rotation_z(angle(key)) * Quat::from_rotation_x(0.2 * angle(key)))
            .collect();
        set.push("", &[0.0, 0.5, 0.75, 2.0, 3.0], &keys).unwrap();
    }
    let steps = [Vec3::X, Vec3::Y];
    set.set_translations(0, &[0.0, 3.0], &steps, &[]).unwrap();
    Motion {
        set,
        ..Motion::default()
    }
}

fn call(calls: &mut Calls, call: u32, header: Value, numbers: Vec<u8>) -> Result<Answer, String> {
    let header = header.to_string();
    let answer = calls.call(call, header.as_bytes(), numbers);
    answer.map_err(|fault| fault.message)
}

fn json(answer: &Answer) -> Value {
    serde_json::from_str(&answer.json).unwrap()
}

fn bytes(numbers: &[f64]) -> Vec<u8> {
    numbers
        .iter()
        .flat_map(|number| number.to_le_bytes())
        .collect()
}

#[test]
fn samples_have_the_engine_s_bits_in_both_orders() {
    let (clip, mut calls) = (clip(), Calls::default());
    let kept = call(&mut calls, 1, json!({}), packed::to_bytes(&clip)).unwrap();
    assert_eq!(json(&kept)["clip"], 0);
    assert_eq!(json(&kept)["span"], json!([0.0, 3.0]));
    let times = [0.1, 2.9, 1.0, 0.5];
    let engine = Engine::new(Device::Cpu).unwrap();
    for method in METHODS {
        let right = engine
            .evaluate(&clip.set, method, &SampleTimes::at(times.to_vec()))
            .unwrap();
        for layout in ["track", "frame"] {
            let header = json!({
                "clip": 0, "quantity": "pose", "method": method.name, "layout": layout
            });
            let answer = call(&mut calls, 3, header, bytes(&times)).unwrap();
            let arrays = json(&answer)["arrays"].clone();
            assert_eq!(arrays[0]["name"], "rotations");
            assert_eq!(arrays[1]["bytes"], 3 * 4 * 12);
            let found: Vec<f32> = bytemuck::pod_collect_to_vec(answer.arrays[0].bytes());
            for track in 0..3 {
                for sample in 0..4 {
                    let at = match layout {
                        "track" => track * 4 + sample,
                        _ => sample * 3 + track,
                    };
                    let rotation = Quat::from_slice(&found[4 * at..]);
                    let right = right.get(track, sample).unwrap();
                    // Neighbouring samples of a track get the nearer sign here, as in files; the engine returns either.
                    assert!(
                        rotation == right || rotation == -right,
                        "{method} {layout} {at}"
                    );
                }
            }
        }
    }
}

/// Poses and single tracks of a sampler have the bits of samples at listed times, also after its clip was freed.
#[test]
fn samplers_have_the_bits_of_listed_times() {
    let (clip, mut calls) = (clip(), Calls::default());
    call(&mut calls, 1, json!({}), packed::to_bytes(&clip)).unwrap();
    let header = json!({"clip": 0, "quantity": "pose", "method": "c2", "after": "loop"});
    let made = call(&mut calls, 6, header, Vec::new()).unwrap();
    assert_eq!(
        (&json(&made)["sampler"], &json(&made)["tracks"]),
        (&json!(0), &json!(3))
    );
    call(&mut calls, 5, json!({"clip": 0}), Vec::new()).unwrap();
    let times = [0.1, 2.9, -1.0, 7.3];
    let interpolation = Interpolation::from(method::C2).with_after(WrapMode::Loop);
    let engine = Engine::new(Device::Cpu).unwrap();
    let frames = SampleTimes::at(times.to_vec());
    let right = engine.evaluate(&clip.set, interpolation, &frames).unwrap();
    for (i, time) in times.into_iter().enumerate() {
        let expected: Vec<Quat> = (0..3).map(|track| right.get(track, i).unwrap()).collect();
        assert_eq!(calls.pose(0, None, time).unwrap(), expected);
        assert_eq!(calls.pose(0, Some(2), time).unwrap(), &expected[2..]);
    }
    let refused = |found: Result<&[Quat], crate::answer::Fault>| found.unwrap_err().message;
    assert!(refused(calls.pose(0, None, f64::NAN)).contains("NaN"));
    assert!(refused(calls.pose(0, Some(3), 0.0)).contains('3'));
    call(&mut calls, 7, json!({"sampler": 0}), Vec::new()).unwrap();
    let words = "there is no sampler 0; it was freed";
    assert_eq!(refused(calls.pose(0, None, 0.0)), words);
    let again = call(&mut calls, 7, json!({"sampler": 0}), Vec::new());
    assert_eq!(again.err().unwrap(), words);
}

#[test]
fn places_of_freed_clips_are_taken_again() {
    let (clip, mut calls) = (packed::to_bytes(&clip()), Calls::default());
    for expected in [0, 1, 2] {
        let kept = call(&mut calls, 1, json!({}), clip.clone()).unwrap();
        assert_eq!(json(&kept)["clip"], expected);
    }
    call(&mut calls, 5, json!({"clip": 1}), Vec::new()).unwrap();
    let error = call(&mut calls, 5, json!({"clip": 1}), Vec::new()).err();
    assert_eq!(error.unwrap(), "there is no clip 1; it was freed");
    let kept = call(&mut calls, 1, json!({}), clip).unwrap();
    assert_eq!(json(&kept)["clip"], 1);
}

#[test]
fn what_cannot_be_done_is_refused_in_words() {
    let mut calls = Calls::default();
    call(&mut calls, 1, json!({}), packed::to_bytes(&clip())).unwrap();
    for (number, header, words) in [
        (9, json!({}), "there is no call 9"),
        (3, json!({"clip": 0}), "missing field `quantity`"),
        (
            3,
            json!({"clip": 7, "quantity": "pose"}),
            "there is no clip 7",
        ),
        (
            3,
            json!({"clip": 0, "quantity": "pose", "method": "slurp"}),
            "there is no method `slurp`; there are authored, ",
        ),
        (
            3,
            json!({"clip": 0, "quantity": "pose", "rate": "0/0"}),
            "`0/0` is not a frame rate",
        ),
        (
            3,
            json!({"clip": 0, "quantity": "pose", "tension": "soft"}),
            "tension is `soft`, which is not a number",
        ),
        (
            4,
            json!({"clip": 0, "track": 3}),
            "there is no track 3 of 3",
        ),
        (2, json!({"name": "a.glb"}), "a.glb"),
    ] {
        let error = call(&mut calls, number, header, Vec::new()).err().unwrap();
        assert!(error.contains(words), "{error}");
    }
}
