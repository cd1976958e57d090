//! Skeletons on the page, in a real browser: where joints are drawn, and the texts of the menus.

use std::path::Path;

use clap::Parser;
use glam::{DVec3, EulerRot, Quat, Vec3};
use serde_json::Value;
use tumble::method::{C2, SLERP};
use tumble::{Device, Engine, SampleTimes, TrackSet};
use tumble_formats::motion::{ChannelInterpolation, Channels, Joint, Motion, Transform};
use tumble_formats::sample::{ChannelMethods, MethodChoice};
use tumble_formats::world::{WorldPose, world};

use crate::commands::view::shown::{ResultChoice, ShownClip};

#[path = "../../../tests/support/browser.rs"]
#[allow(dead_code)] // the tests of boxes use the rest of it
mod browser;

#[derive(Parser)]
struct ViewCommandLine {
    #[command(flatten)]
    arguments: super::Arguments,
}

fn arguments(line: &str) -> super::Arguments {
    let start = ["view", "fox.glb", "-o", "view.html", "--device", "cpu"];
    ViewCommandLine::parse_from(start.into_iter().chain(line.split_whitespace())).arguments
}

/// A walk of a body with two legs: the root moves and grows, and a child comes before its parent.
fn walk(name: &str, pace: f32) -> Motion {
    let joints = [
        ("shin.l", Some(2), Vec3::new(0.0, -4.0, 0.0)),
        ("hips", None, Vec3::ZERO),
        ("thigh.l", Some(1), Vec3::new(1.0, -1.0, 0.0)),
        ("thigh.r", Some(1), Vec3::new(-1.0, -1.0, 0.0)),
        ("shin.r", Some(3), Vec3::new(0.0, -4.0, 0.0)),
        ("head", Some(1), Vec3::new(0.0, 5.0, 0.5)),
    ];
    let times: Vec<f64> = (0..7)
        .map(|key| 0.3 + f64::from(key * key) / 20.0)
        .collect();
    let keys = |joint: usize| -> Vec<Quat> {
        let angle = |key: usize| pace * ((key * (joint + 2)) as f32).sin();
        let rotation = |key| Quat::from_euler(EulerRot::XYZ, angle(key), angle(key) * 0.5, 0.1);
        (0..times.len()).map(rotation).collect()
    };
    let mut set = TrackSet::new();
    let mut clip = Motion {
        name: Some(name.to_owned()),
        ..Motion::default()
    };
    for (joint, (name, parent, translation)) in joints.into_iter().enumerate() {
        set.push(name, &times, &keys(joint)).unwrap();
        let rest = Transform {
            translation,
            ..Transform::default()
        };
        clip.skeleton.push(Joint { parent, rest });
        clip.channels.push(Channels {
            rotation: Some(ChannelInterpolation::Linear),
            ..Channels::default()
        });
    }
    let steps = times
        .iter()
        .map(|&time| Vec3::new(1.0, 100.0, 4.0 * time as f32));
    let steps: Vec<Vec3> = steps.collect();
    set.set_translations(1, &times, &steps, &[]).unwrap();
    set.set_scales(1, &[0.5, 1.0], &[Vec3::ONE, Vec3::splat(1.5)], &[])
        .unwrap();
    clip.channels[1].translation = Some(ChannelInterpolation::Linear);
    clip.channels[1].scale = Some(ChannelInterpolation::Step);
    clip.set = set;
    clip
}

/// A thing that moves without a skeleton, keyed for no method.
fn trajectory() -> Motion {
    let times = [0.0, 1.0, 2.0];
    let mut set = TrackSet::new();
    set.push("camera", &times, &[Quat::IDENTITY; 3]).unwrap();
    let positions = [
        Vec3::ZERO,
        Vec3::new(0.0, 0.25, 1.0),
        Vec3::new(0.5, 0.0, 2.0),
    ];
    set.set_translations(0, &times, &positions, &[]).unwrap();
    Motion {
        set,
        ..Motion::default()
    }
}

/// `--end` counts as the file does, for the frames and for the keys that are shown beside them.
#[test]
fn keys_after_the_end_are_not_shown() {
    let clip = Motion {
        time_offset: 1_700_000_000,
        ..trajectory()
    };
    let shown = ShownClip::new(Path::new("a.tum"), clip, None, false);
    let shown = arguments("--end 1700000000.5 --fps 4")
        .sampled(shown)
        .unwrap();
    assert_eq!(shown.times, [0.0, 0.25, 0.5]);
}

fn expected(shown: &ShownClip, argument: MethodChoice) -> Vec<WorldPose> {
    let methods = ChannelMethods {
        method: argument,
        options: arguments("").interpolation.options(),
    };
    let engine = Engine::new(Device::Cpu).unwrap();
    let frames = SampleTimes::at(shown.times.clone());
    let samples = methods.sample(&engine, &shown.clip, &frames).unwrap();
    world(&shown.clip, &samples).unwrap()
}

fn point(value: &Value) -> DVec3 {
    let coordinate = |axis: usize| value[axis].as_f64().unwrap();
    DVec3::new(coordinate(0), coordinate(1), coordinate(2))
}

/// The clips as the program shows them, in a browser; nothing if there is none.
fn opened(clips: Vec<Motion>, folder: &Path) -> (Vec<ShownClip>, Option<browser::Page>) {
    let arguments = arguments("--fps 10");
    let one = |clip| ShownClip::new(Path::new("clips/fox.glb"), clip, None, false);
    let shown: Result<Vec<ShownClip>, _> = clips
        .into_iter()
        .map(|clip| arguments.sampled(one(clip)))
        .collect();
    let mut shown = shown.unwrap();
    let methods = arguments.methods(&shown).unwrap();
    let mut device = arguments.device.open().unwrap();
    let page = arguments.page(&mut shown, &methods, "Animation", &mut device);
    let path = folder.join("view.html");
    std::fs::write(&path, page.unwrap()).unwrap();
    (shown, browser::Page::open(&path))
}

#[test]
fn joints_are_drawn_where_the_engine_puts_them() {
    let folder = tempfile::tempdir().unwrap();
    let clips = vec![walk("Walk", 0.4), walk("Run", 1.2), trajectory()];
    let (shown, Some(mut page)) = opened(clips, folder.path()) else {
        return;
    };
    let texts = |selector: &str| {
        format!("[...document.querySelectorAll('{selector}')].map((e) => e.textContent).join('|')")
    };
    let menu = page.value(&texts("#set option"));
    assert_eq!(menu, "fox.glb: Walk|fox.glb: Run|fox.glb");
    assert_eq!(page.value(&texts("#set-label")), "Animation");
    let mut largest = 0.0f64;
    for (index, one) in shown.iter().enumerate() {
        page.choose("#set", &index.to_string());
        page.value("tumble.loaded().then(() => true)");
        let methods = page.value(&texts("#method option"));
        let authored = MethodChoice(None);
        let has_channels = !one.clip.channels.is_empty();
        // If `authored` was selected for the clip before and this clip states no interpolation, the first method is
        // selected.
        let first = match has_channels {
            true => "authored",
            false => "bessel-overhauser",
        };
        assert_eq!(page.value("tumble.state.method"), first);
        let starts = methods.as_str().unwrap().starts_with("authored|");
        assert_eq!(starts, has_channels, "{methods}");
        let mut shown_by = vec![MethodChoice(Some(SLERP)), MethodChoice(Some(C2))];
        shown_by.extend(has_channels.then_some(authored));
        for argument in shown_by {
            page.choose("#method", argument.name());
            page.value("tumble.loaded().then(() => true)");
            let joints = one.clip.set.track_count();
            let expected = expected(one, argument);
            let positions = || expected.iter().map(|pose| pose.position);
            let size =
                positions().reduce(DVec3::max).unwrap() - positions().reduce(DVec3::min).unwrap();
            // Half a step of 16 bits, plus the rounding of the matrices to f32.
            let tolerance = size.max_element() / 65535.0 / 2.0 + 1e-5;
            let drawn = page.value(&format!(
                "Array.from(tumble.state.input.times, (time) => {{ tumble.seek(time); \
                 return Array.from({{length: {joints}}}, (_, joint) => tumble.ends(joint)) }})"
            ));
            for (at, pose) in expected.iter().enumerate() {
                let (sample, joint) = (at / joints, at % joints);
                let ends = &drawn[sample][joint];
                let off = (point(&ends[0]) - pose.position).abs().max_element();
                assert!(off <= tolerance, "{}, sample {sample}: {off}", one.title);
                largest = largest.max(off);
                let parent = one.clip.skeleton.get(joint).and_then(|joint| joint.parent);
                let Some(parent) = parent else {
                    assert_eq!(ends.as_array().unwrap().len(), 1, "a root has no bone");
                    continue;
                };
                let parent = expected[sample * joints + parent].position;
                let off = (point(&ends[1]) - parent).abs().max_element();
                assert!(
                    off <= 2.0 * tolerance,
                    "{}, parent, {sample}: {off}",
                    one.title
                );
            }
        }
    }
    println!("largest distance along an axis: {largest:.1e}");
    assert!(largest > 0.0, "16 bits leave something");
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn joints_have_names_and_a_click_chooses_one() {
    let folder = tempfile::tempdir().unwrap();
    let (_, Some(mut page)) = opened(vec![walk("Walk", 0.4)], folder.path()) else {
        return;
    };
    let name = "document.querySelector('#box-name').textContent";
    for (joint, expected) in ["shin.l", "hips", "thigh.l"].iter().enumerate() {
        page.choose("#box", &(joint + 1).to_string());
        assert_eq!(page.value(name), *expected);
    }
    assert_eq!(
        page.value("document.querySelector('#box-label').textContent"),
        "Joint"
    );
    let hidden = "!document.querySelector('#arrangement').checkVisibility()";
    assert_eq!(page.value(hidden), true, "joints are where they are");
    let before = page.value("JSON.stringify(tumble.ends(0))");
    page.press("a");
    page.value("tumble.loaded().then(() => true)");
    assert_eq!(page.value("JSON.stringify(tumble.ends(0))"), before);

    // The fifth joint is light blue. A pixel inside the joint has only light blue neighbours.
    let (pixels, width) = page.pixels("#stage");
    let light_blue = |[r, g, b]: [u8; 3]| r > 25 && b / 2 > r && g > r + r / 2;
    let inside = (2 * width + 2..pixels.len() - 2 * width - 2).find(|&at| {
        let round = [at, at - 2, at + 2, at - 2 * width, at + 2 * width];
        round.iter().all(|&near| light_blue(pixels[near]))
    });
    let at = inside.expect("the right shin is seen");
    let area = page.value("(() => { const r = document.querySelector('#stage').getBoundingClientRect(); return [r.x, r.y] })()");
    let (x, y) = ((at % width) as f64, (at / width) as f64);
    page.click_at(area[0].as_f64().unwrap() + x, area[1].as_f64().unwrap() + y);
    page.wait(&format!("tumble.state.picked && {name} === 'shin.r'"));
    // The numbers on the page must be those of the joint's rotation.
    let text = page.value(
        "tumble.seek(0.5), document.querySelector('#box-values').textContent.replaceAll('−', '-')",
    );
    let numbers: Vec<f32> = text
        .as_str()
        .unwrap()
        .split_whitespace()
        .filter_map(|word| word.trim_end_matches(',').parse().ok())
        .collect();
    let expected = walk("Walk", 0.4).set.track(4).keys[2];
    assert_eq!(numbers.len(), 7, "w x y z and a place: {text}");
    let displayed = Quat::from_xyzw(numbers[1], numbers[2], numbers[3], numbers[0]);
    assert!(
        displayed.dot(expected).abs() > 1.0 - 1e-6,
        "{displayed} is not {expected}"
    );
}

#[test]
fn files_without_a_word_of_channels_show_bessel_overhauser_once() {
    let one = ShownClip::new(Path::new("a.tum"), trajectory(), None, false);
    let named = |names: &[&str]| -> Vec<MethodChoice> {
        names
            .iter()
            .map(|name| MethodChoice(tumble::Method::named(name)))
            .collect()
    };
    let names_shown = |names: &[&str]| -> Vec<&str> {
        one.methods(&named(names))
            .iter()
            .map(|choice| choice.name())
            .collect()
    };
    assert_eq!(
        names_shown(&["authored", "slerp"]),
        ["bessel-overhauser", "slerp"]
    );
    let both = ["authored", "slerp", "bessel-overhauser"];
    assert_eq!(names_shown(&both), ["slerp", "bessel-overhauser"]);
}

#[test]
fn what_has_no_place_or_no_room_is_refused() {
    let arguments = arguments("--fps 10");
    let mut device = arguments.device.open().unwrap();
    let mut distant = walk("Far", 0.4);
    let times = [0.3, 2.0];
    for joint in [1, 2] {
        let positions = [Vec3::X, Vec3::splat(9e29)];
        distant
            .set
            .set_translations(joint, &times, &positions, &[])
            .unwrap();
    }
    let sizes = [Vec3::ONE, Vec3::splat(9e29)];
    distant.set.set_scales(1, &times, &sizes, &[]).unwrap();
    let mut circle = walk("Circle", 0.4);
    circle.skeleton[1].parent = Some(0);
    for (clip, message) in [
        (distant, "fox.glb Far: a position is too large for f32"),
        (circle, "fox.glb Circle: joint 0 is its own ancestor"),
    ] {
        let one = ShownClip::new(Path::new("fox.glb"), clip, None, true);
        let one = arguments.sampled(one).unwrap();
        let result = one.result(
            ResultChoice::By(MethodChoice(None)),
            arguments.interpolation,
            &mut device,
        );
        let found = format!("{:?}", result.err());
        assert!(found.contains(message), "{found}");
    }
    // Positions count: 16 bytes a joint instead of the 10 of a box.
    let one = ShownClip::new(Path::new("fox.glb"), walk("Walk", 0.4), None, true);
    assert!((one.bytes(100) - 6.0 * 100.0 * 16.0).abs() < 1e-9);
    let shown = [arguments.sampled(one).unwrap()];
    assert!(arguments.methods(&[]).is_err(), "nothing to show");
    assert!(arguments.methods(&shown).is_ok());
}
