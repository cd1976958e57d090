//! Translations and scales that are evaluated together with rotations agree with the textbook, with the same bits on
//! every device.

use crate::support::{KERNEL_OPTIONS, Random, is_due, vulkan_engines};
use glam::{DVec3, Quat, Vec3};
use tumble::reference::VectorCurve;
use tumble::{
    Device, Ends, Engine, Interpolation, Layout, SampleTimes, TrackError, TrackSet, Transforms,
    VectorMethod, WrapMode, method,
};

const ENDS: [Ends; 5] = [
    Ends::Parabolic,
    Ends::Natural,
    Ends::Secant,
    Ends::Frozen,
    Ends::Clamped {
        start: DVec3::ZERO,
        end: DVec3::ZERO,
    },
];

struct Case {
    set: TrackSet,
    curves: Vec<Option<VectorCurve>>,
}

fn case(seed: u64) -> Case {
    let mut random = Random(seed);
    let mut set = TrackSet::new();
    let mut curves = Vec::new();
    for track in 0..24 {
        let times = [0.0, random.between(1.0, 9.0)];
        let keys = [random.rotation().as_quat(), random.rotation().as_quat()];
        set.push("", &times, &keys).unwrap();
        if track % 5 == 4 {
            curves.push(None);
            continue;
        }
        let mut vector = || (random.direction() * random.between(0.0, 50.0)).as_vec3();
        let count = 1 + track % 7;
        let keys: Vec<Vec3> = (0..count).map(|_| vector()).collect();
        let tangents: Vec<[Vec3; 2]> = (0..count).map(|_| [vector(), vector()]).collect();
        let mut time = random.between(-1.0, 1.0);
        let times: Vec<f64> = (0..count)
            .map(|_| {
                time += random.between(0.1, 2.0);
                time
            })
            .collect();
        let tangents = if track % 3 == 0 { vec![] } else { tangents };
        set.set_translations(track, &times, &keys, &tangents)
            .unwrap();
        curves.push(Some(VectorCurve {
            method: "",
            ends: Ends::Parabolic,
            times,
            keys: keys.iter().map(|key| key.as_dvec3()).collect(),
            tangents: tangents
                .iter()
                .map(|both| both.map(glam::Vec3::as_dvec3))
                .collect(),
        }));
    }
    Case { set, curves }
}

fn bits(found: &Transforms) -> Vec<u32> {
    let vectors = [&found.translations, &found.scales].map(tumble::Vectors::as_slice);
    let numbers = vectors.concat();
    let rotations = found
        .rotations
        .as_quats()
        .iter()
        .flat_map(glam::Quat::to_array);
    let all = numbers
        .iter()
        .flat_map(glam::Vec4::to_array)
        .chain(rotations);
    all.map(f32::to_bits).collect()
}

#[test]
fn translations_are_the_textbook_s() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let Case { set, curves } = case(1);
    for vectors in VectorMethod::ALL {
        for ends in ENDS {
            let interpolation = Interpolation::from(method::SLERP).with_ends(ends);
            for frames in [
                SampleTimes::fps(24),
                SampleTimes::at((0..200).map(|i| 0.05 * f64::from(i)).collect()),
            ] {
                let layout = Layout::TrackMajor;
                let found = engine.transforms(&set, interpolation, vectors, &frames, layout);
                let found = found.unwrap();
                let timeline = frames.resolve(24, set.time_span()).unwrap();
                for (track, curve) in curves.iter().enumerate() {
                    for sample in 0..timeline.len() {
                        let translation = found.translations.get(track, sample).unwrap();
                        assert_eq!(found.scales.get(track, sample), Some(Vec3::ONE));
                        let Some(curve) = curve else {
                            assert_eq!(translation, Vec3::ZERO);
                            continue;
                        };
                        let curve = VectorCurve {
                            method: vectors.name(),
                            ends,
                            ..curve.clone()
                        };
                        let time = timeline.time(track, sample).unwrap();
                        // On a key rounding may decide on which side of a jump it lies.
                        if curve.times.iter().any(|key| (key - time).abs() < 1e-9) {
                            continue;
                        }
                        let off = (translation.as_dvec3() - curve.value(time)).length();
                        assert!(
                            off < 3e-5,
                            "{vectors}, {ends:?}, track {track} at {time}: {off:e}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn the_same_bits_on_every_device() {
    let cpu = Engine::new(Device::Cpu).unwrap();
    let Case { set, .. } = case(2);
    let sides = [
        WrapMode::Hold,
        WrapMode::Loop,
        WrapMode::Mirror,
        WrapMode::Extrapolate,
    ];
    let engines: Vec<Engine> = [None, Some(20_000)]
        .into_iter()
        .flat_map(|memory| vulkan_engines(|options| options.memory = memory))
        .collect();
    let frames = SampleTimes::fps(12).between(-5.0, 20.0);
    for (i, vectors) in VectorMethod::ALL.into_iter().enumerate() {
        for (j, (before, after)) in sides.into_iter().zip(sides.into_iter().rev()).enumerate() {
            let interpolation = Interpolation::from(method::BESSEL_OVERHAUSER)
                .with_before(before)
                .with_after(after);
            for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                let of = |engine: &Engine| {
                    let found = engine.transforms(&set, interpolation, vectors, &frames, layout);
                    bits(&found.unwrap())
                };
                let expected = of(&cpu);
                for (k, vulkan) in engines.iter().enumerate() {
                    if !is_due(i + j, k, KERNEL_OPTIONS.len()) {
                        continue;
                    }
                    assert!(of(vulkan) == expected, "{vectors}, {before:?}, {after:?}");
                }
            }
        }
    }
}

#[test]
fn a_lift_goes_on_rising() {
    let mut set = TrackSet::new();
    set.push("lift", &[0.0], &[Quat::IDENTITY]).unwrap();
    let keys = [Vec3::ZERO, Vec3::new(0.0, 2.0, 0.0)];
    set.set_translations(0, &[0.0, 1.0], &keys, &[]).unwrap();
    set.set_scales(0, &[0.5], &[Vec3::splat(3.0)], &[]).unwrap();
    let engine = Engine::new(Device::Cpu).unwrap();
    let rising = Interpolation::from(method::SLERP)
        .with_before(WrapMode::Extrapolate)
        .with_after(WrapMode::Extrapolate);
    let frames = SampleTimes::fps(1).between(-2.0, 3.0);
    let linear = VectorMethod::Linear;
    let found = engine
        .transforms(&set, rising, linear, &frames, Layout::TrackMajor)
        .unwrap();
    let heights: Vec<f32> = (0..6)
        .map(|s| found.translations.get(0, s).unwrap().y)
        .collect();
    assert_eq!(heights, [-4.0, -2.0, 0.0, 2.0, 4.0, 6.0]);
    assert_eq!(found.scales.get(0, 3), Some(Vec3::splat(3.0)));
    assert_eq!(found.translations.get(1, 0), None);
    let part = set.select(0..1).unwrap();
    let again = engine
        .transforms(&part, rising, linear, &frames, Layout::TrackMajor)
        .unwrap();
    assert!(bits(&found) == bits(&again));
}

#[test]
fn vectors_that_are_none_are_refused() {
    let mut set = TrackSet::new();
    set.push("", &[0.0], &[Quat::IDENTITY]).unwrap();
    let error = set
        .set_scales(0, &[0.0, 0.0], &[Vec3::ONE; 2], &[])
        .unwrap_err();
    assert!(matches!(
        error,
        TrackError::TimeNotIncreasing { key: 1, .. }
    ));
    let error = set.set_scales(0, &[0.0], &[Vec3::NAN], &[]).unwrap_err();
    assert!(matches!(error, TrackError::DataNotFinite { key: 0, .. }));
    let error = set
        .set_translations(1, &[0.0], &[Vec3::ONE], &[])
        .unwrap_err();
    assert_eq!(
        error,
        TrackError::NoSuchTrack {
            track: 1,
            tracks: 1
        }
    );
    let tangents = [[Vec3::ZERO; 2]; 2];
    let error = set
        .set_translations(0, &[0.0], &[Vec3::ONE], &tangents)
        .unwrap_err();
    assert!(matches!(error, TrackError::DataLength { values: 2, .. }));
    assert_eq!("linear".parse(), Ok(VectorMethod::Linear));
    assert!("slerp".parse::<VectorMethod>().is_err());
}
