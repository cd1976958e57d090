//! Results in chunks: the same bits as in one piece, in order, and nothing left out.

use crate::support::{Random, first_difference, hostile_set, is_due, vulkan_devices};
use glam::{DQuat, Quat};
use tumble::{
    Chunk, Device, Encoding, Engine, EngineOptions, Error, Interpolation, Layout, METHODS,
    SampleTimes, Speed, WrapMode, method,
};

fn devices() -> Vec<Device> {
    [vec![Device::Cpu], vulkan_devices()].concat()
}

/// The chunks put together, as a file would hold them.
#[derive(Default)]
struct Collected {
    rotations: Vec<Quat>,
    chunks: usize,
    largest: usize,
}

impl Collected {
    fn take(&mut self, chunk: &tumble::Chunk<'_>) {
        assert_eq!(chunk.start, self.rotations.len());
        assert_eq!(
            chunk.rotations().unwrap().len(),
            chunk.tracks.len() * chunk.samples.len()
        );
        self.rotations.extend_from_slice(chunk.rotations().unwrap());
        self.chunks += 1;
        self.largest = self.largest.max(chunk.rotations().unwrap().len());
    }
}

#[test]
fn chunks_are_the_whole_in_order() {
    let set = hostile_set(5, 24);
    let explicit = (0..700).map(|i| 0.01 * f64::from((i * 37) % 700)).collect();
    let requests = [
        SampleTimes::fps(60).between(-1.0, 20.0),
        SampleTimes::at(explicit),
    ];
    let mut round = 0;
    for device in devices() {
        let engine = Engine::new(device).unwrap();
        for method in METHODS {
            round += 1;
            let clip = engine.upload(&set, method).unwrap();
            for frames in &requests {
                for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                    let whole = clip.request(frames).layout(layout).evaluate().unwrap();
                    round += 1;
                    let limits = [100, 5000, 1000, usize::MAX].into_iter().enumerate();
                    for (_, limit) in limits.filter(|(i, _)| is_due(round, *i, 2)) {
                        let label = format!("{method}, {layout:?}, {limit}");
                        let mut of_clip = Collected::default();
                        clip.request(frames)
                            .layout(layout)
                            .stream(limit, |chunk| {
                                of_clip.take(&chunk);
                                Ok::<(), Error>(())
                            })
                            .unwrap();
                        let mut of_set = Collected::default();
                        engine
                            .request(&set, method, frames)
                            .layout(layout)
                            .stream(limit, |chunk| {
                                of_set.take(&chunk);
                                Ok::<(), Error>(())
                            })
                            .unwrap();
                        for found in [of_clip, of_set] {
                            assert!(found.largest <= limit, "{label}");
                            assert!(found.chunks > 1 || limit == usize::MAX, "{label}");
                            let difference = first_difference(whole.as_quats(), &found.rotations);
                            assert_eq!(difference, None, "{label}");
                        }
                    }
                }
            }
        }
    }
}

#[derive(Debug)]
enum Stop {
    Enough,
    Engine(Error),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Engine(error)
    }
}

/// Catches a stream that goes on, or hangs, after its sink has failed.
#[test]
fn a_sink_that_fails_ends_the_stream() {
    let set = hostile_set(6, 16);
    for device in devices() {
        let engine = Engine::new(device).unwrap();
        let mut chunks = 0;
        let frames = SampleTimes::fps(120).between(0.0, 10.0);
        let result = engine
            .request(&set, method::SLERP, &frames)
            .layout(Layout::TrackMajor)
            .stream(1500, |_| {
                chunks += 1;
                if chunks == 3 {
                    Err(Stop::Enough)
                } else {
                    Ok(())
                }
            });
        assert!(matches!(result, Err(Stop::Enough)));
        assert_eq!(chunks, 3);
    }
}

#[test]
fn what_cannot_be_evaluated_is_an_error_before_any_chunk() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let frames = SampleTimes::at(vec![0.0, f64::NAN]);
    let result = engine
        .request(&hostile_set(7, 4), method::SLERP, &frames)
        .layout(Layout::TrackMajor)
        .stream(10, |_| Err(Stop::Enough));
    assert!(matches!(result, Err(Stop::Engine(Error::SampleTimes(_)))));
}

#[test]
fn parts_are_those_of_the_whole() {
    let set = hostile_set(24, 5);
    let each: Vec<f64> = (0..5 * 90)
        .map(|i| 0.04 * f64::from((i * 37) % 450))
        .collect();
    let shared = each[..300].to_vec();
    let requests = [
        SampleTimes::fps(40),
        SampleTimes::at(shared),
        SampleTimes::at_each(each),
    ];
    let sequence = tumble::EulerSequence::XYZ;
    for device in devices() {
        let engine = Engine::new(device).unwrap();
        for (wrap, encoding) in [
            (WrapMode::Hold, Encoding::F32),
            (WrapMode::Mirror, Encoding::F32),
            (WrapMode::Loop, Encoding::Euler(sequence)),
        ] {
            let interpolation = Interpolation::from(method::BESSEL_OVERHAUSER).with_after(wrap);
            let clip = engine.upload(&set, interpolation).unwrap();
            for frames in &requests {
                let samples = clip.timeline(frames).unwrap().len();
                let track = samples * encoding.bytes();
                let whole = clip
                    .request(frames)
                    .layout(Layout::TrackMajor)
                    .encoding(encoding)
                    .evaluate_bytes()
                    .unwrap();
                for tracks in [0..5, 1..4, 2..2, 4..5] {
                    // One slice is aligned to 16 bytes, the other is not.
                    for shift in [0, 4] {
                        let mut store = vec![Quat::IDENTITY; tracks.len() * track / 16 + 2];
                        let store: &mut [u8] = bytemuck::cast_slice_mut(&mut store);
                        let part = &mut store[shift..shift + tracks.len() * track];
                        let range = tracks.clone();
                        engine
                            .request(&set, interpolation, frames)
                            .tracks(range)
                            .encoding(encoding)
                            .evaluate_into(part)
                            .unwrap();
                        assert!(*part == whole[tracks.start * track..tracks.end * track]);
                    }
                }
                for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                    let whole = clip
                        .request(frames)
                        .layout(layout)
                        .encoding(encoding)
                        .evaluate_bytes()
                        .unwrap();
                    let (tracks, part) = (1..4, 7..samples / 2);
                    let mut found = vec![0; tracks.len() * part.len() * encoding.bytes()];
                    let request = clip.request(frames).layout(layout).encoding(encoding);
                    let request = request.tracks(tracks.clone()).samples(part.clone());
                    request.evaluate_into(&mut found).unwrap();
                    for (part_track, t) in tracks.clone().enumerate() {
                        for (sample, s) in part.clone().enumerate() {
                            let size = encoding.bytes();
                            let from = layout.index(t, s, 5, samples).unwrap() * size;
                            let to = layout
                                .index(part_track, sample, tracks.len(), part.len())
                                .unwrap()
                                * size;
                            assert_eq!(found[to..to + size], whole[from..from + size]);
                        }
                    }
                    // Only that part of the set is prepared.
                    let of_set = engine.request(&set, interpolation, frames).layout(layout);
                    let of_set = of_set.tracks(tracks.clone()).samples(part.clone());
                    let bytes = of_set.clone().encoding(encoding).evaluate_bytes().unwrap();
                    assert!(bytes == found, "{layout:?}, {encoding}");
                    if encoding == Encoding::F32 {
                        let none = of_set.clone().tracks(2..2);
                        none.stream(50, |_| Err(Error::NotRates)).unwrap();
                        let (mut streamed, mut chunks) = (Vec::new(), 0);
                        let sink = |chunk: Chunk<'_>| {
                            assert_eq!(chunk.start * 16, streamed.len());
                            assert!(chunk.tracks.start >= tracks.start);
                            assert!(chunk.samples.start >= part.start);
                            streamed.extend_from_slice(bytemuck::cast_slice::<_, u8>(chunk.rows));
                            chunks += 1;
                            Ok::<(), Error>(())
                        };
                        of_set.stream(50, sink).unwrap();
                        assert!(streamed == found && chunks > 1, "{layout:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn parts_that_a_result_has_not_are_refused() {
    let set = hostile_set(4, 3);
    let engine = Engine::new(Device::Cpu).unwrap();
    let clip = engine.upload(&set, method::SLERP).unwrap();
    let frames = SampleTimes::at(vec![0.0; 8]);
    let mut bytes = vec![0; 8 * 16];
    let of_tracks = |tracks, encoding, output: &mut [u8]| {
        engine
            .request(&set, method::SLERP, &frames)
            .tracks(tracks)
            .encoding(encoding)
            .evaluate_into(output)
    };
    let backwards = std::ops::Range { start: 2, end: 1 };
    for tracks in [3..4, 2..4, backwards.clone()] {
        let error = of_tracks(tracks, Encoding::F32, &mut bytes).unwrap_err();
        assert!(
            matches!(error, Error::NoSuchPart { whole: (3, 8), .. }),
            "{error}"
        );
    }
    let error = of_tracks(0..1, Encoding::F32, &mut bytes[1..]).unwrap_err();
    assert!(
        matches!(
            error,
            Error::OutputBytes {
                length: 127,
                needed: 128
            }
        ),
        "{error}"
    );
    let of_clip = |tracks, samples, output: &mut [u8]| {
        let request = clip.request(&frames).layout(Layout::FrameMajor);
        request
            .tracks(tracks)
            .samples(samples)
            .evaluate_into(output)
    };
    for (tracks, samples) in [(0..4, 0..2), (0..1, 1..9), (backwards, 0..8)] {
        let error = of_clip(tracks, samples, &mut bytes).unwrap_err();
        assert!(matches!(error, Error::NoSuchPart { .. }), "{error}");
    }
    assert!(of_clip(0..1, 0..8, &mut bytes).is_ok());
    assert!(of_clip(3..3, 0..8, &mut []).is_ok());
}

/// Sets whose segments take more than the engine may use, by every call that asks for samples. Catches a
/// piece that lacks an interval, or whose numbers depend on where it was cut.
#[test]
fn what_takes_too_much_memory_is_made_piece_by_piece_with_the_same_bits() {
    let mut set = hostile_set(11, 16);
    // Long tracks, which are divided, and many short ones.
    let mut random = Random(12);
    for count in [350, 300] {
        let times: Vec<f64> = (0..count).map(|i| 0.01 * f64::from(i)).collect();
        let keys: Vec<Quat> = times
            .iter()
            .map(|time| {
                let noise = DQuat::from_axis_angle(random.direction(), 0.02);
                (DQuat::from_rotation_y(time * 0.7) * noise).as_quat()
            })
            .collect();
        set.push("", &times, &keys).unwrap();
    }
    let (tracks, unlimited) = (set.track_count(), Engine::new(Device::Cpu).unwrap());
    let mut times: Vec<f64> = (0..24).map(|i| 0.15 * f64::from((i * 7) % 24)).collect();
    let each = (0..tracks * 12).map(|i| 0.01 * ((i * 31) % 349) as f64);
    let each = SampleTimes::at_each(each.collect());
    let unordered = SampleTimes::at(times.clone());
    times.sort_by(f64::total_cmp);
    let requests = [
        SampleTimes::fps(13).between(-1.0, 4.5),
        SampleTimes::at(times),
        unordered,
        each,
    ];
    let interpolation = |method, after, speed| {
        let mut interpolation = Interpolation::from(method);
        (interpolation.after, interpolation.speed) = (after, speed);
        interpolation
    };
    let interpolations = [
        interpolation(method::SLERP, WrapMode::Hold, Speed::AsKeyed),
        interpolation(method::C2, WrapMode::Hold, Speed::AsKeyed),
        interpolation(method::STEP, WrapMode::Hold, Speed::AsKeyed),
        interpolation(method::CATMULL_ROM, WrapMode::Loop, Speed::AsKeyed),
        interpolation(
            method::BESSEL_OVERHAUSER,
            WrapMode::Extrapolate,
            Speed::AsKeyed,
        ),
        interpolation(method::SLERP, WrapMode::Hold, Speed::Constant),
    ];
    for (device_index, device) in devices().into_iter().enumerate() {
        let mut options = EngineOptions::default();
        options.memory = Some(50_000);
        let engine = Engine::with_options(device, &options).unwrap();
        for (round, interpolation) in interpolations.into_iter().enumerate() {
            let whole = unlimited.upload(&set, interpolation).unwrap();
            let clip = engine.upload(&set, interpolation).unwrap();
            for (request, frames) in requests.iter().enumerate() {
                if !is_due(device_index + round, request, requests.len()) {
                    continue;
                }
                let label = format!("{interpolation:?}, request {request}, {engine:?}");
                for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                    let expected = whole.request(frames).layout(layout).evaluate().unwrap();
                    let expected = expected.as_quats();
                    let same = |found: &[Quat], strategy: &str| {
                        let difference = first_difference(expected, found);
                        assert_eq!(difference, None, "{strategy}, {layout:?}, {label}");
                    };
                    same(
                        clip.request(frames)
                            .layout(layout)
                            .evaluate()
                            .unwrap()
                            .as_quats(),
                        "clip",
                    );
                    let found = engine
                        .request(&set, interpolation, frames)
                        .layout(layout)
                        .evaluate();
                    same(found.unwrap().as_quats(), "set");
                    let mut streamed = Collected::default();
                    let outcome = engine
                        .request(&set, interpolation, frames)
                        .layout(layout)
                        .stream(300, |chunk| {
                            streamed.take(&chunk);
                            Ok::<(), Error>(())
                        });
                    outcome.unwrap();
                    same(&streamed.rotations, "stream");
                    let (encoding, samples) = (Encoding::F16, clip.timeline(frames).unwrap().len());
                    let expected = whole
                        .request(frames)
                        .layout(layout)
                        .encoding(encoding)
                        .evaluate_bytes()
                        .unwrap();
                    let found = clip
                        .request(frames)
                        .layout(layout)
                        .encoding(encoding)
                        .evaluate_bytes()
                        .unwrap();
                    assert!(found == expected, "encoded, {layout:?}, {label}");
                    if layout == Layout::TrackMajor {
                        let mut part = vec![0; 7 * samples * encoding.bytes()];
                        let start = (tracks - 7) * samples * encoding.bytes();
                        let last = tracks - 7..tracks;
                        engine
                            .request(&set, interpolation, frames)
                            .tracks(last)
                            .encoding(encoding)
                            .evaluate_into(&mut part)
                            .unwrap();
                        assert!(part == expected[start..], "tracks, {label}");
                    }
                }
            }
        }
    }
}

/// An interpolation that a set cannot have is refused when the set is uploaded, even if nothing is prepared yet.
#[test]
fn what_cannot_be_interpolated_is_refused_before_it_is_made_piece_by_piece() {
    let mut options = EngineOptions::default();
    options.memory = Some(1);
    let engine = Engine::with_options(Device::Cpu, &options).unwrap();
    let mut set = hostile_set(4, 3);
    let opposite = [Quat::IDENTITY, -Quat::IDENTITY];
    set.push("", &[0.0, 1.0], &opposite).unwrap();
    let mut interpolation = Interpolation::from(method::SLERP);
    interpolation.signs = tumble::KeySigns::AsAuthored;
    let error = engine.upload(&set, interpolation).unwrap_err();
    assert!(matches!(error, Error::Interpolation(_)), "{error}");
    let sink = |_: tumble::Chunk<'_>| -> Result<(), Error> { panic!("no chunk comes") };
    let (frames, layout) = (SampleTimes::fps(5), Layout::FrameMajor);
    let error = engine
        .request(&set, interpolation, &frames)
        .layout(layout)
        .stream(10, sink);
    assert!(matches!(error, Err(Error::Interpolation(_))));
}
