//! Sampled at a rate, a clip that ends between two frames keeps its last moment, from every format into every other: a
//! loop continues as before.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3, Quat};
use tumble::{Device, Engine, FrameRate, SampleTimes};
use tumble_formats::end_frame::{EndFrame, sample_to_end};
use tumble_formats::format::{FormatOption, MotionOptions, ReadOptions};
use tumble_formats::keyed::keyed;
use tumble_formats::motion::{ChannelInterpolation, Channels, Motion};
use tumble_formats::sample::{ChannelMethods, Samples};
use tumble_formats::{FORMATS, Feature, Format};

/// Frames of 24 a second in one turn of the loop, which lasts 1.125 s: 33.75 frames of 30 a second.
const FRAMES: u64 = 27;

fn rate(per_second: u64) -> FrameRate {
    FrameRate::new(per_second, 1).unwrap()
}

/// A body that sways and comes back to where it was, in full swing.
fn looping() -> Motion {
    let times: Vec<f64> = (0..=FRAMES).map(|frame| rate(24).time_of(frame)).collect();
    let phase = |frame: u64| TAU * (frame % FRAMES) as f64 / FRAMES as f64;
    let angles = (0..=FRAMES).map(|frame| 0.8 * phase(frame).sin());
    let keys: Vec<Quat> = angles
        .map(|angle| DQuat::from_rotation_z(angle).as_quat())
        .collect();
    let points: Vec<DVec3> = (0..=FRAMES)
        .map(|frame| DVec3::new(phase(frame).cos(), phase(frame).sin(), 1.0))
        .collect();
    let mut clip = Motion {
        rate: Some(rate(24)),
        ..Motion::default()
    };
    clip.set.push("body", &times, &keys).unwrap();
    clip.set_positions(0, &times, &points).unwrap();
    let line = Some(ChannelInterpolation::Linear);
    clip.channels = vec![Channels {
        rotation: line,
        translation: line,
        scale: None,
    }];
    clip
}

fn read(format: &Format, bytes: Vec<u8>, per_second: u64) -> Motion {
    let options = ReadOptions {
        source_rate: states_no_rate(format).then(|| rate(per_second)),
        ..ReadOptions::default()
    };
    let loaded = (format.read_bytes)("clip", bytes, &options).unwrap();
    loaded.clips.into_iter().next().unwrap()
}

/// Whether the rate of a file must be given.
fn states_no_rate(format: &Format) -> bool {
    format.takes(FormatOption::SourceRate) && !format.supports(Feature::UnevenTimes)
}

fn write(format: &Format, clip: &Motion, samples: &Samples, rate: Option<FrameRate>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let sampled = [samples.of(clip, rate, &[])];
    let written = format.write_clips(&sampled, &MotionOptions::default(), &mut bytes);
    written.unwrap_or_else(|error| panic!("{}: {error}", format.name));
    bytes
}

/// The angle in degrees from the last rotation of a clip to its first, and the distance of the positions.
fn seam(engine: &Engine, clip: &Motion) -> (f64, f64) {
    let (first, last) = clip.set.time_span().unwrap();
    let ends = SampleTimes::at(vec![first, last]);
    let ends = ChannelMethods::AUTHORED
        .sample(engine, clip, &ends)
        .unwrap();
    let [a, b] = [0, 1].map(|index| ends.rotations[index].as_dquat().normalize());
    let angle = 2.0 * (a * b.conjugate()).xyz().length().asin();
    let distance = match &*ends.translations {
        [a, b] => f64::from(a.distance(*b)),
        _ => 0.0,
    };
    (angle.to_degrees(), distance)
}

#[test]
fn the_last_moment_of_a_loop_survives_between_all_formats() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let clip = looping();
    let length = FRAMES as f64 / 24.0;
    let storing_keys = || FORMATS.iter().filter(|format| format.writes_clips());
    let mut pairs = 0;
    for from in storing_keys() {
        let bytes = write(from, &clip, &keyed(&clip).unwrap(), clip.rate);
        let input = read(from, bytes, 24);
        for to in storing_keys() {
            let of = format!("{} to {}", from.name, to.name);
            let (_, last) = input.set.time_span().unwrap();
            assert!((last - length).abs() < 1e-12, "{of}: {last}");
            let frames = SampleTimes::rate(rate(30));
            let timeline = frames.resolve(1, input.set.time_span()).unwrap();
            assert_eq!(timeline.len(), 34);
            let end = EndFrame::of_clips(to).sample(&timeline, rate(30), last);
            let samples = sample_to_end(&ChannelMethods::AUTHORED, &engine, &input, &frames, end);
            let even = end.is_some_and(|end| end.is_held()).then(|| rate(30));
            let bytes = write(to, &input, &samples.unwrap(), even);
            let found = read(to, bytes, 30);
            let (first, last) = found.set.time_span().unwrap();
            let expected = match to.supports(Feature::UnevenTimes) {
                true => length,
                false => 34.0 / 30.0,
            };
            assert!(
                first == 0.0 && (last - expected).abs() < 1e-7,
                "{of}: {first} {last}"
            );
            let (angle, distance) = seam(&engine, &found);
            assert!(angle < 1e-4 && distance < 1e-6, "{of}: {angle}° {distance}");
            pairs += 1;
        }
    }
    assert!(pairs >= 64, "{pairs}");
    // What this test would miss, were the swing slow at the seam.
    let frames = SampleTimes::rate(rate(30));
    let cut = ChannelMethods::AUTHORED
        .sample(&engine, &clip, &frames)
        .unwrap();
    let cut = clip.with_keys(&cut).unwrap();
    assert!(seam(&engine, &cut).0 > 5.0);
}
