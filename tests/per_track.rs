//! An interpolation for each track: the bits of every track are those that it has alone, by the same interpolation.

use crate::support::{hostile_set, vulkan_devices};
use tumble::glam::Quat;
use tumble::{
    Axes, Channel, Device, Encoding, Ends, Engine, EngineOptions, Error, Interpolation,
    InterpolationError, KeySigns, Layout, PerTrack, Quantity, SampleTimes, Speed, TrackSet,
    VectorMethod, WrapMode, method,
};

const LAYOUTS: [Layout; 2] = [Layout::TrackMajor, Layout::FrameMajor];

/// The CPU, with little memory too, and the Vulkan devices.
fn engines() -> Vec<Engine> {
    let mut little = EngineOptions::default();
    little.memory = Some(1 << 14);
    let devices = [vec![Device::Cpu], vulkan_devices()].concat();
    let engines = devices
        .into_iter()
        .map(|device| Engine::new(device).unwrap());
    let little = Engine::with_options(Device::Cpu, &little).unwrap();
    std::iter::once(little).chain(engines).collect()
}

/// Five interpolations in turn, so that the tracks of each are between those of others.
fn alternating(tracks: usize) -> Vec<Interpolation> {
    let looped = Interpolation::from(method::SQUAD)
        .with_before(WrapMode::Loop)
        .with_after(WrapMode::Mirror);
    let extrapolated = Interpolation::from(method::BESSEL_OVERHAUSER)
        .with_after(WrapMode::Extrapolate)
        .with_speed(Speed::AsKeyed);
    let different = [
        method::SLERP.into(),
        looped,
        method::STEP.into(),
        method::SLERP.into(),
        extrapolated,
    ];
    different.into_iter().cycle().take(tracks).collect()
}

/// The bytes of one value, by the track's own interpolation.
fn alone(
    engine: &Engine,
    set: &TrackSet,
    each: &[Interpolation],
    times: &[SampleTimes],
    encoding: Encoding,
) -> Vec<Vec<u8>> {
    (0..set.track_count())
        .map(|track| {
            let one = set.select([track]).unwrap();
            let request = engine.request(&one, each[track], &times[track]);
            request.encoding(encoding).evaluate_bytes().unwrap()
        })
        .collect()
}

#[test]
fn every_track_has_the_bits_that_it_has_alone() {
    let set = hostile_set(7, 23);
    let (tracks, span) = (set.track_count(), set.time_span().unwrap());
    let each = alternating(tracks);
    let lists: Vec<f64> = (0..tracks * 40)
        .map(|i| 0.11 * (i * 7 % 97) as f64 - 0.7)
        .collect();
    let one_list: Vec<f64> = (0..90).map(|i| 0.17 * f64::from(i * 37 % 90)).collect();
    let all_times = [
        SampleTimes::fps(20).between(-1.0, 4.0),
        SampleTimes::at(one_list),
        SampleTimes::at_each(lists.clone()),
    ];
    for engine in engines() {
        for (number, frames) in all_times.iter().enumerate() {
            let of_track = |track: usize| match number {
                2 => SampleTimes::at(lists[track * 40..][..40].to_vec()),
                _ => frames.clone().spanning(span),
            };
            let times: Vec<SampleTimes> = (0..tracks).map(of_track).collect();
            let samples = frames.resolve(tracks, Some(span)).unwrap().len();
            let clip = engine.upload(&set, each.clone()).unwrap();
            assert_eq!(clip.timeline(frames).unwrap().len(), samples);
            for encoding in [Encoding::F32, Encoding::F16] {
                let size = encoding.bytes();
                let expected = alone(&engine, &set, &each, &times, encoding);
                for layout in LAYOUTS {
                    for (part, at) in [
                        (0..tracks, 0..samples),
                        (3..tracks - 1, 5..samples - 3),
                        (2..3, 0..samples),
                        (4..4, 0..samples),
                    ] {
                        let of_set = engine.request(&set, each.clone(), frames);
                        for request in [of_set, clip.request(frames)] {
                            let request = request.layout(layout).encoding(encoding);
                            let request = request.tracks(part.clone()).samples(at.clone());
                            let found = request.evaluate_bytes().unwrap();
                            assert_eq!(found.len(), part.len() * at.len() * size);
                            for track in part.clone() {
                                for sample in at.clone() {
                                    let index = layout
                                        .index(
                                            track - part.start,
                                            sample - at.start,
                                            part.len(),
                                            at.len(),
                                        )
                                        .unwrap();
                                    assert_eq!(
                                        found[index * size..][..size],
                                        expected[track][sample * size..][..size],
                                        "track {track}, sample {sample}, {layout}, {encoding}"
                                    );
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn chunks_are_the_whole_in_order() {
    let set = hostile_set(3, 17);
    let (each, frames) = (
        alternating(set.track_count()),
        SampleTimes::fps(40).between(-1.0, 9.0),
    );
    for engine in engines() {
        let clip = engine.upload(&set, each.clone()).unwrap();
        for layout in LAYOUTS {
            let whole = engine.request(&set, each.clone(), &frames).layout(layout);
            let whole = whole.evaluate().unwrap();
            for limit in [50, 3000, usize::MAX] {
                let of_set = engine.request(&set, each.clone(), &frames);
                for request in [of_set, clip.request(&frames)] {
                    let mut found: Vec<[f32; 4]> = Vec::new();
                    let streamed = request.layout(layout).stream(limit, |chunk| {
                        assert_eq!(chunk.start, found.len());
                        assert!(chunk.rows.len() <= limit);
                        found.extend_from_slice(chunk.rows);
                        Ok::<(), Error>(())
                    });
                    streamed.unwrap();
                    assert!(found == whole.as_arrays(), "{layout}, {limit}");
                }
            }
        }
    }
}

#[test]
fn equal_interpolations_are_one() {
    let set = hostile_set(9, 5);
    let engine = Engine::new(Device::Cpu).unwrap();
    let frames = SampleTimes::fps(30).between(0.0, 3.0);
    let each: Vec<Interpolation> = vec![method::SQUAD.into(); set.track_count()];
    let clip = engine.upload(&set, each).unwrap();
    assert!(format!("{clip:?}").contains("method: "), "{clip:?}");
    let expected = engine.evaluate(&set, method::SQUAD, &frames).unwrap();
    let found = clip.evaluate(&frames).unwrap();
    assert_eq!(found.as_quats(), expected.as_quats());
}

#[test]
fn rates_have_a_quantity_for_all_tracks() {
    let set = hostile_set(9, 6);
    let velocity = |method: tumble::Method| {
        Interpolation::from(method).with_quantity(Quantity::Velocity(Axes::Body))
    };
    let methods = [method::SLERP, method::SQUAD];
    let methods = methods.into_iter().cycle().take(set.track_count());
    let mut each: Vec<Interpolation> = methods.map(velocity).collect();
    let engine = Engine::new(Device::Cpu).unwrap();
    let frames = SampleTimes::fps(30).between(0.0, 3.0);
    let found = engine.request(&set, each.clone(), &frames).rates().unwrap();
    for (track, &how) in each.iter().enumerate() {
        let one = set.select([track]).unwrap();
        let times = frames.clone();
        let expected = engine.rates(&one, how, &times, Layout::TrackMajor).unwrap();
        let samples = found.sample_count();
        let found = &found.as_arrays()[track * samples..][..samples];
        assert!(found == expected.as_arrays(), "track {track}");
    }
    each[3] = method::SQUAD.into();
    let error = engine.request(&set, each.clone(), &frames).rates();
    let error = error.unwrap_err().to_string();
    assert_eq!(
        error,
        "the quantity of track 0 is velocity-in-body, and of track 3 rotation; ask for one of them at a time"
    );
    let uploaded = engine.upload(&set, each);
    assert!(matches!(
        uploaded,
        Err(Error::MixedQuantities { track: 3, .. })
    ));
}

#[test]
fn lists_of_another_length_are_refused() {
    let set = hostile_set(9, 6);
    let engine = Engine::new(Device::Cpu).unwrap();
    let frames = SampleTimes::fps(30).between(0.0, 3.0);
    let two: Vec<Interpolation> = vec![method::SLERP.into(); 2];
    let refused = [
        engine
            .request(&set, two.clone(), &frames)
            .size()
            .unwrap_err(),
        engine.evaluate(&set, two.clone(), &frames).unwrap_err(),
        engine.upload(&set, two).unwrap_err(),
    ];
    let tracks = set.track_count();
    for error in refused {
        assert!(matches!(error, Error::PerTrackCount(_)));
        assert_eq!(
            error.to_string(),
            format!(
                "a list of 2 is given for {tracks} tracks; give one for each track, or a single one for all"
            )
        );
    }
}

/// The error of a group counts among all tracks.
#[test]
fn errors_name_the_track_of_the_whole_set() {
    let mut set = TrackSet::new();
    let rotated = Quat::from_rotation_x(1.0);
    for keys in [
        [Quat::IDENTITY, rotated],
        [Quat::IDENTITY, rotated],
        [rotated, -rotated],
    ] {
        set.push("", &[0.0, 1.0], &keys).unwrap();
    }
    let as_authored = Interpolation::from(method::SLERP).with_signs(KeySigns::AsAuthored);
    let each = vec![as_authored, method::STEP.into(), as_authored];
    let engine = Engine::new(Device::Cpu).unwrap();
    let frames = SampleTimes::fps(30).between(0.0, 3.0);
    for error in [
        engine.evaluate(&set, each.clone(), &frames).unwrap_err(),
        engine.upload(&set, each).unwrap_err(),
    ] {
        assert!(
            matches!(
                error,
                Error::Interpolation(InterpolationError::Antipodal { track: 2, .. })
            ),
            "{error}"
        );
    }
}

#[test]
fn vectors_have_a_method_for_each_track() {
    let mut set = hostile_set(4, 6);
    let tracks = set.track_count();
    let (times, last) = ([0.0, 0.4, 1.5, 2.0], 3);
    for track in (0..tracks).filter(|track| track % 3 != 2) {
        let at = |key: u8| {
            tumble::glam::Vec3::new(f32::from(key), track as f32, 0.5 * f32::from(key * key))
        };
        let points: Vec<_> = (0..=last).map(at).collect();
        set.set_translations(track, &times, &points, &[]).unwrap();
    }
    let methods = [VectorMethod::Step, VectorMethod::C2, VectorMethod::Linear];
    let methods: Vec<_> = methods.into_iter().cycle().take(tracks).collect();
    let frozen = Interpolation::from(method::SLERP).with_ends(Ends::Frozen);
    let mut each: Vec<Interpolation> = vec![method::SLERP.into(); tracks];
    each[4] = frozen;
    let frames = SampleTimes::fps(24).between(0.0, 3.0);
    let channel = Channel::Translation;
    for engine in engines() {
        for layout in LAYOUTS {
            let found = engine
                .vectors(
                    &set,
                    channel,
                    methods.clone(),
                    each.clone(),
                    &frames,
                    layout,
                )
                .unwrap();
            let both = engine.transforms(&set, each.clone(), methods.clone(), &frames, layout);
            assert!(both.unwrap().translations.as_arrays() == found.as_arrays());
            for track in 0..tracks {
                let one = set.select([track]).unwrap();
                let (how, layout) = (PerTrack::All(each[track]), Layout::TrackMajor);
                let expected = engine.vectors(&one, channel, methods[track], how, &frames, layout);
                let expected = expected.unwrap();
                for sample in 0..found.sample_count() {
                    assert_eq!(found.get(track, sample), expected.get(0, sample));
                }
            }
        }
    }
}
