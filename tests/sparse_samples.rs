//! Few samples of many keys: only the intervals that have one are prepared, and the bits are those of the
//! same samples among many.

use crate::support::{Random, give_key_data};
use glam::{DQuat, Quat, Vec3};
use tumble::{
    Axes, Channel, Device, Encoding, Engine, Error, Interpolation, Layout, METHODS, Quantity,
    SampleTimes, Stop, TrackSet, VectorMethod, WrapMode, method,
};

const QUANTITIES: [Quantity; 3] = [
    Quantity::Rotation,
    Quantity::Velocity(Axes::Parent),
    Quantity::Acceleration(Axes::Body),
];

fn cpu() -> Engine {
    Engine::new(Device::Cpu).unwrap()
}

/// Tracks of many keys at uneven times, with steps from none to nearly half a turn and both signs.
fn long_set(seed: u64, tracks: usize, keys: usize) -> TrackSet {
    let mut random = Random(seed);
    let mut set = TrackSet::new();
    for _ in 0..tracks {
        let (mut time, mut rotation) = (random.between(-1.0, 1.0), random.rotation());
        let (mut times, mut quats) = (Vec::new(), Vec::new());
        for _ in 0..keys {
            times.push(time);
            let sign = random.pick(&[1.0, 1.0, -1.0]);
            quats.push(Quat::from_array(
                rotation.to_array().map(|c| (sign * c) as f32),
            ));
            time += random.between(0.02, 0.5);
            let angle = random.pick(&[0.0, 1e-4, 0.03, 0.5, 2.5]);
            let step = DQuat::from_axis_angle(random.direction(), angle);
            rotation = (rotation * step).normalize();
        }
        set.push("", &times, &quats).unwrap();
    }
    give_key_data(&mut set, seed);
    set
}

/// The values of all tracks at these times, `[track][sample]` or `[sample][track]`, as bits.
fn values(
    engine: &Engine,
    set: &TrackSet,
    interpolation: Interpolation,
    frames: &SampleTimes,
    layout: Layout,
) -> Vec<[u32; 4]> {
    let timeline = frames.resolve(set.track_count(), set.time_span()).unwrap();
    let mut found = vec![[0.0f32; 4]; set.track_count() * timeline.len()];
    engine
        .evaluate_into(set, interpolation, frames, layout, &mut found)
        .unwrap();
    found.iter().map(|value| value.map(f32::to_bits)).collect()
}

/// Catches an interval that is prepared from the wrong keys, a sample at the place of another, and a
/// sample that no part computes.
#[test]
fn few_samples_have_the_bits_of_many() {
    let mut random = Random(91);
    let set = long_set(91, 3, 500);
    let engine = cpu();
    let (first, last) = set.time_span().unwrap();
    let mut sparse: Vec<f64> = (0..9)
        .map(|_| first + (last - first) * random.unit())
        .collect();
    let keys = set.track(1).times;
    sparse.extend([
        keys[0],
        keys[77],
        keys[keys.len() - 1],
        first - 1.0,
        last + 1.5,
    ]);
    let mut dense = sparse.clone();
    dense.extend((0..2000).map(|k| first + (last - first) * f64::from(k) / 2000.0));
    let (sparse_times, dense_times) = (SampleTimes::at(sparse.clone()), SampleTimes::at(dense));
    let wraps = [
        WrapMode::Hold,
        WrapMode::Loop,
        WrapMode::Mirror,
        WrapMode::Extrapolate,
    ];
    let mut compared = 0;
    for (method, quantity, wrap) in METHODS.iter().flat_map(|method| {
        let each = QUANTITIES.into_iter();
        each.flat_map(move |quantity| wraps.map(|wrap| (*method, quantity, wrap)))
    }) {
        let interpolation = Interpolation::from(method)
            .with_quantity(quantity)
            .with_before(wrap)
            .with_after(wrap);
        let is_refused = engine.upload(&set, interpolation).is_err();
        if is_refused {
            continue;
        }
        let route = |frames: &SampleTimes| {
            let route = engine.explain_route(&set, interpolation, frames, Layout::TrackMajor);
            route.unwrap()
        };
        // c2 solves for windows of keys, which pays for longer tracks only (see the next test).
        if method.name != "c2" {
            assert!(
                ["few samples between keys", "fewer samples"]
                    .iter()
                    .any(|words| route(&sparse_times).contains(words)),
                "{}",
                route(&sparse_times)
            );
        }
        let all = values(
            &engine,
            &set,
            interpolation,
            &dense_times,
            Layout::TrackMajor,
        );
        let found = values(
            &engine,
            &set,
            interpolation,
            &sparse_times,
            Layout::TrackMajor,
        );
        let in_frames = values(
            &engine,
            &set,
            interpolation,
            &sparse_times,
            Layout::FrameMajor,
        );
        let (samples, of_all) = (sparse.len(), all.len() / 3);
        for track in 0..3 {
            for sample in 0..samples {
                let expected = all[track * of_all + sample];
                let label = format!(
                    "{} {quantity:?} {wrap:?}: track {track} at {}",
                    method.name, sparse[sample]
                );
                assert_eq!(found[track * samples + sample], expected, "{label}");
                assert_eq!(in_frames[sample * 3 + track], expected, "frames, {label}");
                compared += 1;
            }
        }
    }
    assert!(compared > 3 * 14 * 100, "{compared}");
}

/// The same for frames at a rate, for velocities at times per track, and for c2.
#[test]
fn few_frames_have_the_bits_of_many() {
    let set = long_set(5, 2, 6000);
    let engine = cpu();
    let (first, last) = set.time_span().unwrap();
    for method in [
        method::SLERP,
        method::BESSEL_OVERHAUSER,
        method::B_SPLINE,
        method::C2,
    ] {
        for quantity in QUANTITIES {
            let interpolation = Interpolation::from(method).with_quantity(quantity);
            // A clip has all its segments.
            let clip = engine.upload(&set, interpolation).unwrap();
            for frames in [
                SampleTimes::fps(1).between(first, first + 1.0),
                SampleTimes::fps(30).between(first + 7.0, first + 7.2),
                SampleTimes::fps(1).between(first - 1.5, first + 0.5),
                SampleTimes::fps(1).between(last - 0.5, last + 2.0),
                SampleTimes::fps(1).between(first + 100.0, first + 110.0),
            ] {
                let found = values(&engine, &set, interpolation, &frames, Layout::TrackMajor);
                let mut expected = vec![[0.0f32; 4]; found.len()];
                clip.evaluate_into(&frames, Layout::TrackMajor, &mut expected)
                    .unwrap();
                let expected: Vec<_> = (expected.iter())
                    .map(|value| value.map(f32::to_bits))
                    .collect();
                assert_eq!(found, expected, "{} {quantity:?} {frames:?}", method.name);
            }

            let each = vec![first, last, last - 0.25, first + 0.125];
            let at_each = SampleTimes::at_each(each.clone());
            let found = values(&engine, &set, interpolation, &at_each, Layout::TrackMajor);
            let mut together = each;
            together.extend((0..9000).map(|k| first + (last - first) * f64::from(k) / 9000.0));
            let shared = SampleTimes::at(together);
            let all = values(&engine, &set, interpolation, &shared, Layout::TrackMajor);
            let second = all.len() / 2;
            let expected = [all[0], all[1], all[second + 2], all[second + 3]];
            assert_eq!(found, expected, "{} {quantity:?}", method.name);
        }
    }
}

#[test]
fn few_vectors_and_encodings_have_the_bits_of_many() {
    let mut random = Random(17);
    let mut set = long_set(17, 2, 900);
    let times: Vec<f64> = (0..700).map(f64::from).collect();
    let points: Vec<Vec3> = (0..700)
        .map(|_| Vec3::new(random.unit() as f32, random.unit() as f32, 1.0))
        .collect();
    set.set_translations(1, &times, &points, &[]).unwrap();
    let engine = cpu();
    let sparse = vec![650.5, -3.0, 0.0, 17.25, 699.0, 17.75, 800.0];
    let mut dense = sparse.clone();
    dense.extend((0..1000).map(|k| f64::from(k) * 0.7));
    for method in [
        VectorMethod::Linear,
        VectorMethod::CatmullRom,
        VectorMethod::BesselOverhauser,
        VectorMethod::C2,
        VectorMethod::BSpline,
        VectorMethod::Step,
    ] {
        for wrap in [WrapMode::Hold, WrapMode::Loop, WrapMode::Extrapolate] {
            let how = Interpolation::from(method::SLERP)
                .with_before(wrap)
                .with_after(wrap);
            let of = |times: &[f64]| {
                let frames = SampleTimes::at(times.to_vec());
                let (channel, layout) = (Channel::Translation, Layout::TrackMajor);
                let found = engine.vectors(&set, channel, method, how, &frames, layout);
                let found = found.unwrap();
                found.as_slice()[times.len()..][..sparse.len()].to_vec()
            };
            assert_eq!(of(&sparse), of(&dense), "{method:?} {wrap:?}");
        }
    }
    let encoding = Encoding::Matrix3x3(tumble::MatrixOrder::RowMajor);
    let of = |times: &[f64]| {
        let frames = SampleTimes::at(times.to_vec());
        let mut bytes = vec![0u8; 2 * times.len() * encoding.bytes()];
        let layout = Layout::TrackMajor;
        engine
            .request(&set, method::SQUAD, &frames)
            .layout(layout)
            .encoding(encoding)
            .evaluate_into(&mut bytes)
            .unwrap();
        bytes[..sparse.len() * encoding.bytes()].to_vec()
    };
    assert_eq!(of(&sparse), of(&dense));
}

/// Work can be stopped before it begins and at any stage, also if other threads do it.
#[test]
fn stopped_work_ends() {
    let set = long_set(3, 4, 40_000);
    let engine = cpu();
    for layout in [Layout::TrackMajor, Layout::FrameMajor] {
        let stop = Stop::new();
        let mut output = vec![Quat::IDENTITY; 4 * 500_001];
        let (first, last) = set.time_span().unwrap();
        let frames = SampleTimes::at(
            (0..=500_000)
                .map(|k| first + (last - first) * f64::from(k) / 5e5)
                .collect(),
        );
        let ended = std::thread::scope(|scope| {
            let work = scope.spawn(|| {
                stop.during(|| {
                    // Repeated, so that the stop comes during an evaluation.
                    loop {
                        engine.evaluate_into(&set, method::C2, &frames, layout, &mut output)?;
                    }
                    #[allow(unreachable_code, reason = "the type of the closure")]
                    Ok::<(), Error>(())
                })
            });
            std::thread::sleep(std::time::Duration::from_millis(30));
            stop.stop();
            work.join().unwrap()
        });
        assert!(matches!(ended, Err(Error::Stopped(_))), "{ended:?}");
    }
    // The work of others continues.
    assert!(
        engine
            .evaluate(&set, method::SLERP, &SampleTimes::at(vec![0.0]))
            .is_ok()
    );
}
