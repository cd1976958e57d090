//! Sampled at a rate, a clip that ends between two frames keeps its last moment, from every format into every other: a
//! loop continues as before.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3, Quat};
use tumble::{Device, Engine, FrameRate, SampleTimes};
use tumble_formats::end_frame::{EndFrame, EndSample, sample_to_end};
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

/// A body that swings and returns to its first pose with its full speed.
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
            let end = EndFrame::where_times_are(to.supports(Feature::UnevenTimes)).sample(
                &timeline,
                rate(30),
                last,
            );
            let samples = sample_to_end(&ChannelMethods::AUTHORED, &engine, &input, &frames, end);
            let even = end.is_some_and(EndSample::is_held).then(|| rate(30));
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
    // The swing is fast at the seam: otherwise a lost end would not be noticed.
    let frames = SampleTimes::rate(rate(30));
    let cut = ChannelMethods::AUTHORED
        .sample(&engine, &clip, &frames)
        .unwrap();
    let cut = clip.with_keys(&cut).unwrap();
    assert!(seam(&engine, &cut).0 > 5.0);
}

/// The picture of the documents: the end of the loop, sampled in each of the three ways.
fn picture() -> String {
    const WIDTH: f64 = 760.0;
    const ROW: f64 = 130.0;
    let length = FRAMES as f64 / 24.0;
    let (from, to) = (0.9, 1.2);
    let x = |time: f64| 20.0 + (time - from) / (to - from) * (WIDTH - 40.0);
    let value = |time: f64| (TAU * time / length).sin();
    let frames = SampleTimes::rate(rate(30)).between(0.0, length);
    let timeline = frames.resolve(1, None).unwrap();
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {}\" font-family=\"sans-serif\" \
         font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
        3.0 * ROW + 20.0
    );
    for (row, end_frame) in EndFrame::ALL.into_iter().enumerate() {
        let top = 10.0 + row as f64 * ROW;
        let y = |value: f64| top + 55.0 - 55.0 * value;
        let said = match end_frame {
            EndFrame::Key => "key: a sample at the end (formats with times)",
            EndFrame::Hold => "hold: one more frame, with the value of the end (formats of frames)",
            EndFrame::LeaveOut => "leave-out: the last frame before the end; a loop jumps from it",
        };
        let mut lines = format!(
            "<text x=\"24\" y=\"{:.1}\" fill=\"#222\">{said}</text>\n",
            top + 14.0
        );
        for frame in 27..=36u64 {
            let at = x(rate(30).time_of(frame));
            lines += &format!(
                "<path d=\"M{at:.1} {:.1}V{:.1}\" stroke=\"#ddd\"/>\n",
                top + 22.0,
                top + 118.0
            );
        }
        let end = x(length);
        lines += &format!(
            "<path d=\"M{end:.1} {:.1}V{:.1}\" stroke=\"#b33\" stroke-dasharray=\"4 3\"/>\n\
             <text x=\"{end:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-size=\"11\" fill=\"#b33\">end</text>\n",
            top + 22.0,
            top + 118.0,
            top + 18.0
        );
        let curve = (0..=90).map(|step| from + f64::from(step) / 90.0 * (length - from));
        let points: Vec<String> = curve
            .map(|time| format!("{:.1},{:.1}", x(time), y(value(time))))
            .collect();
        lines += &format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"#888\" stroke-width=\"2\"/>\n",
            points.join(" ")
        );
        let last = end_frame.sample(&timeline, rate(30), length);
        let frames = timeline.times(0).map(|time| (time, time));
        let samples = frames.chain(last.map(|end| (end.time, end.at)));
        for (time, at) in samples.filter(|(time, _)| *time >= from) {
            lines += &format!(
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"5\" fill=\"#2a6db0\"/>\n",
                x(time),
                y(value(at))
            );
        }
        svg += &lines;
    }
    let under = 3.0 * ROW + 12.0;
    let mut label = |at: f64, text: &str| {
        svg += &format!(
            "<text x=\"{:.1}\" y=\"{under:.1}\" text-anchor=\"middle\" font-size=\"11\" fill=\"#666\">{text}</text>\n",
            x(at)
        );
    };
    for frame in 28..=35u64 {
        label(rate(30).time_of(frame), &format!("frame {frame}"));
    }
    svg + "</svg>\n"
}

/// `UPDATE_EXPECTED=1` writes it.
#[test]
fn the_picture_of_the_documents_is_that_of_the_rule() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/end-frame.svg");
    let picture = picture();
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        std::fs::write(path, &picture).unwrap();
    }
    assert_eq!(std::fs::read_to_string(path).unwrap(), picture);
}
