//! Every device gives the CPU's bits, for every method, at any frames, however the work is divided.

use crate::support::{
    KERNEL_OPTIONS, Random, first_difference, give_key_data, hostile_set, is_due, round_robin,
    stage, vulkan_devices, vulkan_engines,
};
use glam::{DQuat, DVec3, Quat};
use tumble::reference::{ReferenceCurve, angle_between};
use tumble::vulkan::tuning::{PrepareArcs, Transfer};
use tumble::{
    Device, Encoding, Ends, Engine, EngineOptions, Interpolation, KeySigns, Layout, METHODS,
    Rotations, SampleTimes, TrackSet, VectorWidth, WrapMode, method,
};

const ENDS: [Ends; 5] = [
    Ends::Parabolic,
    Ends::Natural,
    Ends::Secant,
    Ends::Clamped {
        start: DVec3::new(1.0, -2.0, 0.5),
        end: DVec3::ZERO,
    },
    Ends::Frozen,
];

fn cpu() -> Engine {
    Engine::new(Device::Cpu).unwrap()
}

fn engine(device: &Device, change: impl FnOnce(&mut EngineOptions)) -> Engine {
    let mut options = EngineOptions::default();
    change(&mut options);
    Engine::with_options(device.clone(), &options).unwrap()
}

/// An engine on the CPU for each vector width, the narrowest first.
fn widths(streaming_stores: Option<bool>) -> Vec<Engine> {
    let of_width = |width| {
        engine(&Device::Cpu, |options| {
            options.vector_width = Some(width);
            options.streaming_stores = streaming_stores;
        })
    };
    VectorWidth::available().into_iter().map(of_width).collect()
}

fn assert_same_bits(expected: &[Quat], found: &[Quat], label: &str) {
    if let Some(index) = first_difference(expected, found) {
        panic!(
            "{label}: rotation {index} is {} on the CPU, {}",
            expected[index], found[index]
        );
    }
}

/// `SOAK` compares ten times as many.
#[test]
fn twenty_million_hostile_rotations_have_the_same_bits() {
    let (cpu, engines) = (cpu(), vulkan_engines(|_| {}));
    if engines.is_empty() {
        return;
    }
    let mut random = Random(1);
    let enough = match std::env::var_os("SOAK") {
        Some(_) => 200_000_000,
        None => 20_000_000,
    };
    let mut compared = 0;
    for seed in 0.. {
        let set = hostile_set(seed, 256);
        let rate = random.pick(&["24", "25", "30000/1001", "60", "120", "1000/3"]);
        let frames = SampleTimes::rate(rate.parse().unwrap()).between(-1.0, 20.0);
        for (i, method) in METHODS.into_iter().enumerate() {
            let interpolation = Interpolation::from(method).with_ends(random.pick(&ENDS));
            let expected = cpu.evaluate(&set, interpolation, &frames).unwrap();
            for vulkan in round_robin(&engines, seed as usize + i) {
                let found = vulkan.evaluate(&set, interpolation, &frames).unwrap();
                let name = vulkan.device_name();
                let label = format!("{name}, {interpolation:?}, {rate} fps, seed {seed}");
                assert_same_bits(expected.as_quats(), found.as_quats(), &label);
            }
            compared += expected.as_quats().len();
        }
        if compared >= enough {
            break;
        }
    }
    println!("{compared} rotations of each device, its ways of reading in turn, 0 differ");
}

/// Catches an instruction set whose code fuses or reorders.
#[test]
fn every_vector_width_and_thread_count_gives_the_same_bits() {
    let set = hostile_set(77, 300);
    let frames = SampleTimes::fps(60).between(-1.0, 30.0);
    for method in METHODS {
        let expected = cpu().evaluate(&set, method, &frames).unwrap();
        for width in VectorWidth::available() {
            for threads in [1, 3] {
                let engine = engine(&Device::Cpu, |options| {
                    options.vector_width = Some(width);
                    options.thread_count = Some(threads);
                });
                let found = engine.evaluate(&set, method, &frames).unwrap();
                let label = format!("{method}, {width:?}, {threads} threads");
                assert_same_bits(expected.as_quats(), found.as_quats(), &label);
            }
        }
    }
}

/// Catches samples that are begun too early or too late, in runs of every length: of frames and of
/// times, with ordinary and with streaming stores, with vectors of every width.
#[test]
fn runs_of_every_length_have_the_bits_of_single_samples() {
    // Each length occurs once; long runs follow short ones.
    let lengths = (0..140u16).map(|i| f64::from(1 + i * 61 % 140));
    let ends = lengths.scan(0.0, |end, length| {
        *end += length;
        Some(*end)
    });
    let times: Vec<f64> = std::iter::once(0.0).chain(ends).collect();
    let mut set = TrackSet::new();
    for tiny in [0.3, 2.0f32.powi(-50)] {
        let key = |i: usize| {
            let (sine, cosine) = (0.7 * i as f32).sin_cos();
            Quat::from_xyzw(sine, tiny, 0.0, cosine).normalize()
        };
        let keys: Vec<Quat> = (0..times.len()).map(key).collect();
        set.push("", &times, &keys).unwrap();
    }
    let listed: Vec<f64> = (0..=9870).map(f64::from).collect();
    let widths = [false, true].map(|streams| widths(Some(streams))).concat();
    for method in [method::SLERP, method::BESSEL_OVERHAUSER] {
        let clip = cpu().upload(&set, method).unwrap();
        for frames in [SampleTimes::fps(1), SampleTimes::at(listed.clone())] {
            let mut expected = vec![Quat::IDENTITY; 2 * 9871];
            // So few samples are evaluated one by one.
            for (track, row) in expected.chunks_mut(9871).enumerate() {
                for (pair, pair_samples) in row.chunks_mut(2).enumerate() {
                    let samples = 2 * pair..2 * pair + pair_samples.len();
                    let request = clip.request(&frames).tracks(track..track + 1);
                    request
                        .samples(samples)
                        .evaluate_into(pair_samples)
                        .unwrap();
                }
            }
            for engine in &widths {
                let clip = engine.upload(&set, method).unwrap();
                let found = clip.evaluate(&frames).unwrap();
                let label = format!("{method}, {engine:?}");
                assert_same_bits(&expected, found.as_quats(), &label);
            }
        }
    }
}

/// Catches a result that depends on where a window of work starts, and a budget
/// that is ignored until memory runs out.
#[test]
fn every_memory_budget_transfer_and_layout_gives_the_same_bits() {
    let set = hostile_set(5, 30);
    let frames = SampleTimes::fps(25).between(-1.0, 20.0);
    let budgets = [None, Some(1), Some(10_000), Some(200_000), Some(5_000_000)];
    let expected = METHODS.map(|method| cpu().evaluate(&set, method, &frames).unwrap());
    let transfers = [Transfer::InPlace, Transfer::Staged];
    let variants = transfers.map(|transfer| KERNEL_OPTIONS.map(|kernel| (transfer, kernel)));
    for (variant, (transfer, (reads, mapping))) in variants.concat().into_iter().enumerate() {
        for (budget, memory) in budgets.into_iter().enumerate() {
            // Opening a device takes longer than evaluating on it.
            if !is_due(variant, budget, 2) {
                continue;
            }
            for device in vulkan_devices() {
                let engine = engine(&device, |options| {
                    options.transfer = transfer;
                    if transfer == Transfer::Staged {
                        stage(options, variant + budget);
                    }
                    (options.reads, options.mapping) = (reads, mapping);
                    // Both occur with each memory limit.
                    options.prepare_arcs = match (variant + budget / 2) % 2 {
                        0 => PrepareArcs::OnDevice,
                        _ => PrepareArcs::OnHost,
                    };
                    options.memory = memory;
                });
                for (i, (method, expected)) in METHODS.iter().zip(&expected).enumerate() {
                    if !is_due(variant + budget / 2, i, KERNEL_OPTIONS.len()) {
                        continue;
                    }
                    let label = format!("{method}, {transfer:?}, {mapping:?}, {memory:?} bytes");
                    let found = engine.evaluate(&set, *method, &frames).unwrap();
                    assert_same_bits(expected.as_quats(), found.as_quats(), &label);
                    let layout = Layout::FrameMajor;
                    let transposed = engine
                        .request(&set, *method, &frames)
                        .layout(layout)
                        .evaluate()
                        .unwrap();
                    assert_transposed(expected, &transposed);
                }
            }
        }
    }
}

/// On processors where this is faster, long results are written past the caches. Catches values
/// that such stores leave out.
#[test]
fn long_results_have_the_bits_of_short_ones() {
    let set = hostile_set(7, 1800);
    let frames = SampleTimes::fps(60).between(-1.0, 20.0);
    let ordinary = engine(&Device::Cpu, |options| {
        options.streaming_stores = Some(false);
    });
    for method in [method::SLERP, method::BESSEL_OVERHAUSER, method::SQUAD] {
        let expected = ordinary.evaluate(&set, method, &frames).unwrap();
        assert!(16 * expected.as_quats().len() > 33 << 20);
        let long = cpu().evaluate(&set, method, &frames).unwrap();
        assert_same_bits(expected.as_quats(), long.as_quats(), &method.to_string());
        let kept = cpu().upload(&set, method).unwrap();
        let kept = kept.evaluate(&frames).unwrap();
        assert_same_bits(expected.as_quats(), kept.as_quats(), "kept");
        let samples = expected.sample_count();
        let short = cpu().evaluate(&set.select(900..910).unwrap(), method, &frames);
        let found = &expected.as_quats()[900 * samples..910 * samples];
        assert_same_bits(short.unwrap().as_quats(), found, "ten tracks of many");
    }
}

/// Streaming stores change no bit, and none beside the output: of frames, of times in any order and of
/// track copies, on arcs and on polynomials, with vectors of every width, from a clip and from a
/// set, for every alignment of the output.
#[test]
fn streaming_stores_have_the_bits_of_others() {
    let set = hostile_set(7, 16);
    let engines = widths(Some(false)).into_iter().zip(widths(Some(true)));
    for (ordinary, streaming) in engines {
        for (method, after) in [
            (method::SLERP, WrapMode::Hold),
            (method::BESSEL_OVERHAUSER, WrapMode::Hold),
            (method::BESSEL_OVERHAUSER, WrapMode::Loop),
            (method::SQUAD, WrapMode::Hold),
        ] {
            let interpolation = Interpolation::from(method).with_after(after);
            let clip = streaming.upload(&set, interpolation).unwrap();
            let times = (0..700).map(|k| f64::from(k * 617 % 700) * 0.04 - 2.0);
            for frames in [
                SampleTimes::fps(60).between(0.0, 16.0),
                SampleTimes::fps(24).between(3.01, 17.0),
                SampleTimes::fps(40).between(-3.0, 20.0),
                SampleTimes::at(times.collect()),
            ] {
                let expected = ordinary.evaluate(&set, interpolation, &frames).unwrap();
                let count = expected.as_quats().len();
                for shift in 0..4 {
                    for from_set in [false, true] {
                        let mut memory = vec![Quat::from_array([9.0; 4]); count + 4];
                        let (before, rest) = memory.split_at_mut(shift);
                        let (found, behind) = rest.split_at_mut(count);
                        let layout = Layout::TrackMajor;
                        match from_set {
                            true => {
                                streaming.evaluate_into(&set, interpolation, &frames, layout, found)
                            }
                            false => clip.evaluate_into(&frames, layout, found),
                        }
                        .unwrap();
                        let label =
                            format!("{method}, {after:?}, {streaming:?}, shifted by {shift}");
                        assert_same_bits(expected.as_quats(), found, &label);
                        let mut beside = before.iter().chain(&*behind);
                        assert!(beside.all(|q| q.to_array() == [9.0; 4]), "{label}");
                    }
                }
            }
        }
    }
}

#[test]
fn layouts_are_transposes_of_each_other() {
    let set = hostile_set(9, 40);
    let frames = SampleTimes::fps(25).between(-1.0, 20.0);
    for method in METHODS {
        let rows = cpu().evaluate(&set, method, &frames).unwrap();
        let columns = cpu()
            .request(&set, method, &frames)
            .layout(Layout::FrameMajor)
            .evaluate()
            .unwrap();
        assert_transposed(&rows, &columns);
    }
}

fn assert_transposed(rows: &Rotations, columns: &Rotations) {
    for track in 0..rows.track_count() {
        for sample in 0..rows.sample_count() {
            let bits = |q: Option<Quat>| q.unwrap().to_array().map(f32::to_bits);
            assert_eq!(
                bits(rows.get(track, sample)),
                bits(columns.get(track, sample)),
                "track {track}, sample {sample}"
            );
        }
    }
}

#[test]
fn arbitrary_times_have_the_same_bits() {
    let set = hostile_set(13, 200);
    let mut random = Random(4);
    let mut times: Vec<f64> = (0..800).map(|_| random.between(-3.0, 40.0)).collect();
    times.extend_from_slice(set.track(5).times); // exactly on keys
    times.extend([1e300, -1e300, 0.0]);
    let mut sorted = times.clone();
    sorted.sort_by(f64::total_cmp);
    let each: Vec<f64> = (0..200 * 50).map(|_| random.between(-3.0, 40.0)).collect();
    let requests = [
        SampleTimes::at(times),
        SampleTimes::at(sorted),
        SampleTimes::at_each(each),
    ];
    let of_method = |method| {
        let found = requests
            .each_ref()
            .map(|frames| cpu().evaluate(&set, method, frames));
        found.map(Result::unwrap)
    };
    let expected = METHODS.map(of_method);
    let settings = [
        (None, Transfer::Automatic),
        (Some(100_000), Transfer::Staged),
    ];
    for (case, (memory, transfer)) in settings.into_iter().enumerate() {
        let engines = vulkan_engines(|options| {
            options.memory = memory;
            options.transfer = transfer;
            if transfer == Transfer::Staged {
                stage(options, 1);
            }
        });
        for (round, (method, expected)) in METHODS.into_iter().zip(&expected).enumerate() {
            if !is_due(round, case, 2) {
                continue;
            }
            for vulkan in round_robin(&engines, (round + case) / 2) {
                for (frames, expected) in requests.iter().zip(expected) {
                    let found = vulkan.evaluate(&set, method, frames).unwrap();
                    let label = format!("{method}, {memory:?} bytes");
                    assert_same_bits(expected.as_quats(), found.as_quats(), &label);
                }
            }
        }
    }
}

#[test]
fn the_path_as_authored_has_the_same_bits() {
    // The rotations are random, so half of the steps as authored are the longer way.
    let mut random = Random(21);
    let mut set = TrackSet::new();
    for _ in 0..200 {
        let keys: Vec<Quat> = (0..20).map(|_| random.rotation().as_quat()).collect();
        let times: Vec<f64> = (0..20)
            .map(|i| f64::from(i) + random.between(0.0, 0.9))
            .collect();
        set.push("", &times, &keys).unwrap();
    }
    let frames = SampleTimes::fps(60);
    let engines = vulkan_engines(|_| {});
    for (round, method) in METHODS.into_iter().enumerate() {
        let interpolation = Interpolation::from(method).with_signs(KeySigns::AsAuthored);
        let expected = cpu().evaluate(&set, interpolation, &frames).unwrap();
        for vulkan in round_robin(&engines, round + 1) {
            let found = vulkan.evaluate(&set, interpolation, &frames).unwrap();
            assert_same_bits(expected.as_quats(), found.as_quats(), method.name);
        }
    }
}

#[test]
fn closed_loops_have_the_same_bits() {
    let mut random = Random(8);
    let mut set = TrackSet::new();
    for _ in 0..50 {
        let mut keys: Vec<Quat> = (0..9).map(|_| random.rotation().as_quat()).collect();
        keys.push(-keys[0]); // the same rotation
        let times: Vec<f64> = (0..10)
            .map(|i| f64::from(i) + random.between(0.0, 0.9))
            .collect();
        set.push("", &times, &keys).unwrap();
    }
    let frames = SampleTimes::fps(120);
    let engines = vulkan_engines(|_| {});
    for (round, method) in METHODS.into_iter().enumerate() {
        let interpolation = Interpolation::from(method).with_ends(Ends::Loop);
        let expected = cpu().evaluate(&set, interpolation, &frames).unwrap();
        for vulkan in round_robin(&engines, round + 2) {
            let found = vulkan.evaluate(&set, interpolation, &frames).unwrap();
            assert_same_bits(expected.as_quats(), found.as_quats(), method.name);
        }
    }
}

/// A long track lies in many parts; any stretch of it must find the right ones,
/// also where a part ends on a frame, before its first key and after its last.
#[test]
fn stretches_of_a_long_track_have_the_bits_of_the_whole() {
    let mut random = Random(17);
    let count = 40_000;
    let keys: Vec<Quat> = (0..count).map(|_| random.rotation().as_quat()).collect();
    let times: Vec<f64> = (0..count).map(|i| f64::from(i) * 0.1).collect();
    let mut set = TrackSet::new();
    set.push("", &times, &keys).unwrap();
    for method in METHODS {
        let clip = cpu().upload(&set, method).unwrap();
        let from = -500.0;
        let whole = clip
            .evaluate(&SampleTimes::fps(10).between(from, 4500.0))
            .unwrap();
        for _ in 0..40 {
            let first = random.next() as usize % 49_000;
            let last = first + random.next() as usize % 900;
            let time = |frame: usize| from + frame as f64 / 10.0;
            let frames = SampleTimes::fps(10).between(time(first), time(last));
            let found = clip.evaluate(&frames).unwrap();
            let expected = &whole.as_quats()[first..=last];
            // Frames are counted from another start here, so only those at keys have the same bits.
            // Every frame is at a key or outside the keys.
            if method.interpolates {
                assert_same_bits(expected, found.as_quats(), &format!("{method}, {first}"));
            }
        }
    }
}

/// A clip is evaluated again and again, in changing sizes, into memory that other
/// results have used.
#[test]
fn reused_buffers_hold_nothing_of_older_results() {
    let set = hostile_set(3, 64);
    for vulkan in vulkan_engines(|_| {}) {
        let clip = vulkan.upload(&set, method::BESSEL_OVERHAUSER).unwrap();
        let reference = cpu().upload(&set, method::BESSEL_OVERHAUSER).unwrap();
        for end in [30.0, 3.0, 20.0, 0.0, 29.0, 1.0] {
            let frames = SampleTimes::fps(30).between(0.0, end);
            let expected = reference.evaluate(&frames).unwrap();
            let found = clip.evaluate(&frames).unwrap();
            assert_same_bits(
                expected.as_quats(),
                found.as_quats(),
                &format!("to {end} s"),
            );
            let mut samples = vec![Quat::NAN; expected.as_quats().len()];
            clip.evaluate_into(&frames, Layout::TrackMajor, &mut samples)
                .unwrap();
            assert_same_bits(expected.as_quats(), &samples, &format!("to {end} s"));
        }
    }
}

/// Several threads evaluate one clip at the same time; a Vulkan queue takes one submission at a time.
#[test]
fn several_threads_share_an_engine() {
    let set = hostile_set(31, 32);
    let frames = SampleTimes::fps(60).between(0.0, 10.0);
    for vulkan in vulkan_engines(|_| {}) {
        let clip = vulkan.upload(&set, method::CATMULL_ROM).unwrap();
        let expected = cpu().evaluate(&set, method::CATMULL_ROM, &frames).unwrap();
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..5 {
                        let found = clip.evaluate(&frames).unwrap();
                        assert_same_bits(expected.as_quats(), found.as_quats(), "threads");
                    }
                });
            }
        });
    }
}

#[test]
fn nothing_to_evaluate_is_no_error() {
    let frames = SampleTimes::fps(25);
    for engine in vulkan_engines(|_| {}).into_iter().chain([cpu()]) {
        for method in METHODS {
            let empty = engine.evaluate(&TrackSet::new(), method, &frames).unwrap();
            assert_eq!((empty.track_count(), empty.as_quats().len()), (0, 0));
            let set = hostile_set(1, 3);
            let none = engine
                .evaluate(&set, method, &SampleTimes::at(Vec::new()))
                .unwrap();
            assert_eq!((none.track_count(), none.sample_count()), (3, 0));
        }
    }
}

/// The types that callers move into threads and share between them.
#[test]
fn engines_clips_and_results_are_send_and_sync() {
    fn check<T: Send + Sync>() {}
    check::<Engine>();
    check::<tumble::Clip>();
    check::<tumble::Rotations>();
    check::<Device>();
    check::<TrackSet>();
    check::<tumble::Error>();
}

/// The CPU at every width, and every Vulkan device. Opening them takes longer than most evaluations
/// by them.
fn everywhere() -> Vec<Engine> {
    let widths = VectorWidth::available().into_iter().map(|width| {
        let mut options = EngineOptions::default();
        options.vector_width = Some(width);
        Engine::with_options(Device::Cpu, &options)
    });
    let all = widths.chain(vulkan_devices().into_iter().map(Engine::new));
    all.collect::<Result<_, _>>().unwrap()
}

/// Asserts that all engines give these bits from keys.
fn assert_everywhere(
    engines: &[Engine],
    expected: &Rotations,
    set: &TrackSet,
    interpolation: Interpolation,
    frames: &SampleTimes,
) {
    for engine in engines {
        let found = engine.evaluate(set, interpolation, frames).unwrap();
        let label = format!("{interpolation:?}, {frames:?}, {}", engine.device_name());
        assert_same_bits(expected.as_quats(), found.as_quats(), &label);
    }
}

/// Fewer samples than keys take another route on the CPU, arcs by no segments, cubics by
/// fewer: the same bits, at every width, for frames and for times, wherever they begin
/// and end.
#[test]
fn few_samples_of_many_keys_have_the_same_bits() {
    let mut random = Random(77);
    let mut set = TrackSet::new();
    for track in 0..40 {
        let count = [1, 2, 3, 64, 65, 66, 127, 128, 400][track % 9];
        let mut time = random.between(-3.0, 3.0);
        let (mut times, mut keys) = (Vec::new(), Vec::new());
        for _ in 0..count {
            times.push(time);
            let sign = if random.next().is_multiple_of(3) {
                -1.0
            } else {
                1.0
            };
            keys.push(random.rotation().as_quat() * sign);
            // Some keys are on whole frames, some are very near the key before, some far from it.
            time = match random.next() % 16 {
                0 => ((time * 25.0).floor() + 2.0) / 25.0,
                1 => time + 1e-9,
                2 => time + 40.0,
                _ => time + random.between(0.001, 0.05),
            };
        }
        set.push("", &times, &keys).unwrap();
    }
    let (start, end) = set.time_span().unwrap();
    let mut any = |count: usize, start: f64, end: f64| -> Vec<f64> {
        (0..count).map(|_| random.between(start, end)).collect()
    };
    let scattered = any(50, start - 1.0, end + 1.0);
    let of_each = any(40 * 7, start - 1.0, start + 4.0);
    let requests = [
        SampleTimes::fps(25).between(start, start + 3.0),
        SampleTimes::fps(25).between(start + 1.0, start + 2.5),
        SampleTimes::rate("1/31".parse().unwrap()),
        SampleTimes::at(scattered),
        SampleTimes::at(set.track(8).times.iter().copied().step_by(9).collect()),
        SampleTimes::at_each(of_each),
    ];
    let engines = everywhere();
    let paths = [KeySigns::Shortest, KeySigns::AsAuthored];
    let pairs = METHODS.into_iter().enumerate();
    let pairs = pairs.flat_map(|(m, method)| [0, 1].map(|p| (m + p, method, paths[p])));
    for (round, method, path) in pairs {
        let interpolation = Interpolation::from(method).with_signs(path);
        let clip = cpu().upload(&set, interpolation).unwrap();
        for (request, frames) in requests.iter().enumerate() {
            if !is_due(round, request, 2) {
                continue;
            }
            let expected = clip.evaluate(frames).unwrap();
            assert!(expected.as_quats().len() < set.key_count(), "few samples");
            assert_everywhere(&engines, &expected, &set, interpolation, frames);
        }
    }
}

/// Keys near each other, as motion capture has them, among some that are not: signs at
/// random, times even, uneven, a hair and a day apart.
fn near_keys(random: &mut Random, count: usize, time: f64, step: f64) -> (Vec<f64>, Vec<Quat>) {
    let even = random.next().is_multiple_of(2);
    let (mut times, mut keys) = (Vec::new(), Vec::new());
    let (mut time, mut key) = (time, random.rotation());
    for _ in 0..count {
        times.push(time);
        let sign = random.pick(&[1.0, 1.0, 1.0, 1.0, 1.0, -1.0]);
        keys.push(key.as_quat() * sign);
        let step = match random.next() % 64 {
            0 => 3.0,
            1 => 20.0 * step,
            2 => 0.0,
            _ => step,
        };
        key *= DQuat::from_axis_angle(random.direction(), random.between(0.0, step));
        key = key.normalize();
        time += match random.next() % 64 {
            _ if even => 1.0 / 120.0,
            0 => 1e-9,
            1 => 40.0,
            2 => 86_400.0,
            _ => random.between(0.004, 0.012),
        };
    }
    (times, keys)
}

/// Curves that turn little are made straight from four keys, by every device, and those
/// beside them that turn more are not: the same bits as by segments, at any ends, for frames
/// and for times.
#[test]
fn few_samples_of_keys_near_each_other_have_the_same_bits() {
    let mut random = Random(82);
    let mut set = TrackSet::new();
    for track in 0..48 {
        let count = [3, 4, 5, 64, 65, 66, 1, 2, 128, 700][track % 10];
        let start = random.between(-3.0, 3.0);
        let (times, mut keys) = near_keys(&mut random, count, start, 0.08);
        let last = keys.len() - 1;
        keys[last] = -keys[0]; // the same rotation: a loop
        set.push("", &times, &keys).unwrap();
    }
    let mut any =
        |count: usize| -> Vec<f64> { (0..count).map(|_| random.between(-4.0, 9.0)).collect() };
    let requests = [
        SampleTimes::fps(25).between(-1.0, 2.0),
        SampleTimes::fps(120).between(-1.0, -0.5),
        SampleTimes::rate("1/31".parse().unwrap()).between(0.0, 2000.0),
        SampleTimes::at(any(90)),
        SampleTimes::at(set.track(9).times.iter().copied().step_by(9).collect()),
        SampleTimes::at_each(any(48 * 7)),
    ];
    let spin = DVec3::new(0.3, -2.0, 1.0);
    let clamped = Ends::Clamped {
        start: spin,
        end: -spin,
    };
    let engines = everywhere();
    for method in [method::CATMULL_ROM, method::BESSEL_OVERHAUSER] {
        for ends in [
            Ends::Parabolic,
            Ends::Natural,
            Ends::Secant,
            Ends::Loop,
            Ends::Frozen,
            clamped,
        ] {
            let interpolation = Interpolation::from(method).with_ends(ends);
            let clip = cpu().upload(&set, interpolation).unwrap();
            for frames in &requests {
                let expected = clip.evaluate(frames).unwrap();
                assert!(expected.as_quats().len() < set.key_count(), "few samples");
                assert_everywhere(&engines, &expected, &set, interpolation, frames);
            }
        }
    }
}

/// Curves that turn little, moderately and far are fitted by different routes, those of many
/// tracks side by side: a track's bits do not depend on its neighbours.
#[test]
fn tracks_have_the_same_bits_whatever_is_beside_them() {
    let mut random = Random(84);
    let mut tracks = Vec::new();
    for track in 0..60 {
        // The first track has two keys, with nothing before them in their block.
        let count = [2, 3, 4, 26, 2, 27, 64, 5, 65, 2, 130, 66][track % 12];
        let longest = random.pick(&[0.03, 0.3, 0.7, 1.2, 3.1]);
        let (mut times, mut keys) = (Vec::new(), Vec::new());
        let (mut time, mut key) = (random.between(0.0, 1.0), random.rotation());
        for _ in 0..count {
            times.push(time);
            keys.push(key.as_quat() * random.pick(&[1.0, 1.0, -1.0]));
            let largest = random.pick(&[longest, longest, longest, 2.5]);
            let angle = random.between(0.01, largest);
            key = (key * DQuat::from_axis_angle(random.direction(), angle)).normalize();
            time += random.between(0.02, 0.4);
        }
        tracks.push((times, keys));
    }
    let set_of = |tracks: &[(Vec<f64>, Vec<Quat>)]| {
        let mut set = TrackSet::new();
        for (times, keys) in tracks {
            set.push("", times, keys).unwrap();
        }
        set
    };
    let mut closed = tracks.clone();
    for (_, keys) in &mut closed {
        let last = keys.len() - 1;
        keys[last] = keys[0];
    }
    let frames = SampleTimes::fps(240).between(-1.0, 4.0);
    let ends = [Ends::Parabolic, Ends::Natural, Ends::Loop, Ends::Frozen];
    let outside = [WrapMode::Hold, WrapMode::Extrapolate];
    for (method, path) in [
        (method::CATMULL_ROM, KeySigns::Shortest),
        (method::BESSEL_OVERHAUSER, KeySigns::Shortest),
        (method::BESSEL_OVERHAUSER, KeySigns::AsAuthored),
    ] {
        for (ends, after) in ends.into_iter().flat_map(|end| outside.map(|o| (end, o))) {
            let interpolation = Interpolation::from(method)
                .with_signs(path)
                .with_ends(ends)
                .with_after(after);
            let evaluate = |set: &TrackSet| {
                let rotations = cpu().evaluate(set, interpolation, &frames).unwrap();
                rotations.as_quats().to_vec()
            };
            let mut tracks = match ends {
                Ends::Loop => closed.clone(),
                _ => tracks.clone(),
            };
            let alone = tracks.chunks(1).map(|track| evaluate(&set_of(track)));
            let mut alone: Vec<Vec<Quat>> = alone.collect();
            assert_same_bits(&alone.concat(), &evaluate(&set_of(&tracks)), method.name);
            tracks.reverse();
            alone.reverse();
            assert_same_bits(&alone.concat(), &evaluate(&set_of(&tracks)), method.name);
        }
    }
}

/// The same of one long track, which the threads share and devices get in stretches, and of
/// one most of whose keys are far apart.
#[test]
fn few_samples_of_a_long_track_of_near_keys_have_the_same_bits() {
    let mut random = Random(83);
    let engines = everywhere();
    let small = vulkan_engines(|options| options.memory = Some(1 << 20));
    for (count, step) in [(90_000, 0.06), (20_000, 0.14)] {
        let (_, keys) = near_keys(&mut random, count, 0.0, step);
        let uneven = |i: usize| 3.0 + 0.01 * (i as f64 + random.between(0.0, 0.9));
        let times: Vec<f64> = (0..count).map(uneven).collect();
        let mut set = TrackSet::new();
        set.push("", &times, &keys).unwrap();
        for (case, method) in [method::CATMULL_ROM, method::BESSEL_OVERHAUSER]
            .into_iter()
            .enumerate()
        {
            let clip = cpu().upload(&set, method).unwrap();
            let requests = [
                SampleTimes::fps(53),
                SampleTimes::fps(60).between(100.0, 400.0),
                SampleTimes::at(times.iter().map(|time| time + 0.001).step_by(13).collect()),
            ];
            for (round, frames) in requests.iter().enumerate() {
                let expected = clip.evaluate(frames).unwrap();
                assert!(expected.as_quats().len() < set.key_count(), "few samples");
                assert_everywhere(&engines, &expected, &set, method.into(), frames);
                for engine in round_robin(&small, round + case) {
                    let found = engine.evaluate(&set, method, frames).unwrap();
                    assert_same_bits(expected.as_quats(), found.as_quats(), method.name);
                }
            }
        }
    }
}

/// The same of one long track, which the threads share.
#[test]
fn few_samples_of_a_long_track_have_the_same_bits() {
    let mut random = Random(78);
    let (mut times, mut keys) = (Vec::new(), Vec::new());
    let mut time = 3.0;
    for _ in 0..70_000 {
        times.push(time);
        keys.push(random.rotation().as_quat());
        time += random.between(0.001, 0.1);
    }
    let mut set = TrackSet::new();
    set.push("", &times, &keys).unwrap();
    let slerp = method::SLERP;
    let clip = cpu().upload(&set, slerp).unwrap();
    let memory = [None, Some(1 << 20)].into_iter();
    let of_memory = |memory| vulkan_engines(|options| options.memory = memory);
    let engines: Vec<Engine> = memory.flat_map(of_memory).collect();
    let requests = [
        SampleTimes::fps(7),
        SampleTimes::fps(15).between(100.0, 900.0),
        SampleTimes::rate("1/1000".parse().unwrap()),
        SampleTimes::at(times.iter().copied().step_by(13).collect()),
    ];
    for (round, frames) in requests.iter().enumerate() {
        let expected = clip.evaluate(frames).unwrap();
        let found = cpu().evaluate(&set, slerp, frames).unwrap();
        let label = format!("{frames:?}").chars().take(60).collect::<String>();
        assert_same_bits(expected.as_quats(), found.as_quats(), &label);
        // A device with little memory gets the track in stretches, and those with many
        // samples in pieces.
        for engine in round_robin(&engines, round) {
            let found = engine.evaluate(&set, slerp, frames).unwrap();
            assert_same_bits(expected.as_quats(), found.as_quats(), &label);
        }
    }
}

/// A long track goes through the CPU, and through a device with little memory, in stretches
/// that are prepared, evaluated and forgotten, by every method: the same bits as of a clip, whatever its keys' signs are, and
/// the same refusals.
#[test]
fn long_tracks_in_stretches_have_the_same_bits() {
    let mut random = Random(81);
    let (mut times, mut keys) = (Vec::new(), Vec::new());
    let (mut time, mut key) = (-20.0, random.rotation());
    for _ in 0..20_000 {
        times.push(time);
        let sign = random.pick(&[1.0, 1.0, 1.0, -1.0]);
        keys.push(key.as_quat() * sign);
        time += random.between(0.01, 0.1);
        key = (DQuat::from_axis_angle(random.direction(), 0.3) * key).normalize();
    }
    let mut set = TrackSet::new();
    set.push("", &times, &keys).unwrap();
    let (start, end) = set.time_span().unwrap();
    let requests = [
        SampleTimes::fps(30),
        SampleTimes::fps(2).between(start - 3.0, end + 3.0),
        SampleTimes::fps(24).between(start + 50.0, start + 300.0),
    ];
    let small = vulkan_engines(|options| options.memory = Some(2 << 20));
    let methods = METHODS.into_iter().zip(ENDS.into_iter().cycle());
    for (round, (method, ends)) in methods.enumerate() {
        let interpolation = Interpolation::from(method).with_ends(ends);
        let clip = cpu().upload(&set, interpolation).unwrap();
        for (request, frames) in requests.iter().enumerate() {
            let expected = clip.evaluate(frames).unwrap();
            let found = cpu().evaluate(&set, interpolation, frames).unwrap();
            assert_same_bits(expected.as_quats(), found.as_quats(), method.name);
            // A device whose memory is too small for the whole track.
            for engine in round_robin(&small, round + request) {
                let found = engine.evaluate(&set, interpolation, frames).unwrap();
                assert_same_bits(expected.as_quats(), found.as_quats(), method.name);
            }
        }
    }
    keys[9000] = -keys[8999];
    let mut set = TrackSet::new();
    set.push("", &times, &keys).unwrap();
    let as_authored = Interpolation::from(method::CATMULL_ROM).with_signs(KeySigns::AsAuthored);
    let refused = cpu().evaluate(&set, as_authored, &requests[0]);
    let words = refused.unwrap_err().to_string();
    assert!(words.contains("keys 8999 and 9000"), "{words}");
}

/// In a gap of more than 2^32 frames, frames cannot be counted. Every route reports the key before
/// the gap, also in a piece of a long track, and after divided intervals.
#[test]
fn a_gap_too_long_is_named_by_its_key() {
    let mut random = Random(85);
    let gap = 9000;
    let (mut times, mut keys) = (Vec::new(), Vec::new());
    for i in 0..10_000 {
        times.push(f64::from(i) + if i > gap { 1e12 } else { 0.0 });
        keys.push(random.rotation().as_quat());
    }
    let mut set = TrackSet::new();
    set.push("", &[0.0, 1.0, 2.0], &keys[..3]).unwrap();
    set.push("", &times, &keys).unwrap();
    let start = times[9000] + 1.5;
    let frames = SampleTimes::fps(1).between(start, start + 3.0);
    for engine in vulkan_devices()
        .into_iter()
        .map(Engine::new)
        .chain([Ok(cpu())])
    {
        let engine = engine.unwrap();
        for method in [method::SLERP, method::CATMULL_ROM, method::SQUAD] {
            let clip = engine.upload(&set, method).unwrap();
            let kept = clip.evaluate(&frames).unwrap_err().to_string();
            let at_once = engine.evaluate(&set, method, &frames).unwrap_err();
            let device = engine.device_name();
            for words in [kept, at_once.to_string()] {
                let named = words.contains("track 1: 1.000e12 frames between key 9000 and");
                assert!(named, "{device}, {method}: {words}");
            }
        }
    }
}

/// Where a segment's middle is more than 2^24 frames away f32 has not every whole number:
/// the same bits on both sides of that, and across it.
#[test]
fn frames_far_from_their_segments_middle_have_the_same_bits() {
    let mut random = Random(86);
    let mut set = TrackSet::new();
    for _ in 0..3 {
        let keys: Vec<Quat> = (0..4).map(|_| random.rotation().as_quat()).collect();
        set.push("", &[0.0, 1e6, 2e6, 3e6], &keys).unwrap();
    }
    let limit = (3e7 - 16_777_216.0) / 60.0; // of the first segment
    let engines = vulkan_engines(|_| {});
    for start in [10.0, limit - 3.0, 1e6 - limit - 3.0, 5e5] {
        let frames = SampleTimes::fps(60).between(start, start + 6.0);
        for method in [method::SLERP, method::BESSEL_OVERHAUSER] {
            let expected = cpu().evaluate(&set, method, &frames).unwrap();
            for width in VectorWidth::available() {
                let narrow = engine(&Device::Cpu, |options| options.vector_width = Some(width));
                let found = narrow.evaluate(&set, method, &frames).unwrap();
                assert_same_bits(expected.as_quats(), found.as_quats(), "a width");
            }
            for vulkan in &engines {
                let found = vulkan.evaluate(&set, method, &frames).unwrap();
                assert_same_bits(expected.as_quats(), found.as_quats(), method.name);
            }
        }
    }
}

/// Sets whose tracks all have two keys take another route on the CPU, with polynomials that
/// were not fitted: the same bits as by segments, at every width, and near the reference.
#[test]
fn crowds_of_two_keys_have_the_same_bits() {
    let mut random = Random(79);
    let mut set = TrackSet::new();
    for track in 0..200 {
        let first = random.rotation();
        let step = [0.0, 1e-7, 1e-3, 0.4, 1.5, 3.0, 3.1, std::f64::consts::PI][track % 8];
        let rotation = DQuat::from_axis_angle(random.direction(), step);
        // As authored, the arc between opposite keys is not defined.
        let sign = if track % 3 == 0 && step > 0.1 {
            -1.0
        } else {
            1.0
        };
        let keys = [first.as_quat(), (first * rotation).as_quat() * sign];
        let start = random.between(-1.0, 1.0);
        let times = [start, start + random.pick(&[1e-5, 0.04, 1.0, 500.0])];
        let count = if track % 11 == 0 { 1 } else { 2 };
        set.push("", &times[..count], &keys[..count]).unwrap();
    }
    let track_times = (0..set.track_count()).map(|track| {
        let track = set.track(track);
        let (first, last) = (track.times[0], track.times[track.times.len() - 1]);
        first + random.between(-0.1, 1.1) * (last - first)
    });
    let requests = [
        SampleTimes::at_each(track_times.collect()),
        SampleTimes::at(vec![0.3]),
        SampleTimes::rate("1/1000".parse().unwrap()),
        SampleTimes::fps(1).between(0.0, 0.0),
    ];
    let engines = everywhere();
    for (method, path) in METHODS
        .into_iter()
        .flat_map(|method| [KeySigns::Shortest, KeySigns::AsAuthored].map(|path| (method, path)))
    {
        let interpolation = Interpolation::from(method).with_signs(path);
        for frames in &requests {
            let timeline = frames.resolve(set.track_count(), set.time_span()).unwrap();
            let clip = cpu().upload(&set, interpolation).unwrap();
            let expected = clip.evaluate(frames).unwrap();
            assert!(expected.as_quats().len() < set.key_count(), "few samples");
            assert_everywhere(&engines, &expected, &set, interpolation, frames);
            // At exactly 180° both ways are equally short.
            for track in (0..set.track_count()).filter(|track| track % 8 != 7) {
                let curve = ReferenceCurve::of(&interpolation, set.track(track));
                let reference = curve.rotation(timeline.time(track, 0).unwrap());
                let found = expected.get(track, 0).unwrap().as_dquat();
                let error = angle_between(found, reference);
                assert!(
                    error < 1e-6,
                    "{method}, {path:?}, track {track}: {error:.1e} rad"
                );
            }
        }
    }
}

/// A few times of each track are searched one by one: the same bits as in a run, between keys, at
/// keys and next to keys, in tracks of any length.
#[test]
fn few_times_of_each_track_have_the_bits_of_many() {
    let mut random = Random(84);
    let mut set = TrackSet::new();
    let mut asked: Vec<Vec<f64>> = Vec::new();
    for track in 0..120 {
        let count = if track == 77 {
            9000
        } else {
            [1, 2, 3, 9, 40][track % 5]
        };
        let step = [0.05, 1.0, 3.0][track % 3];
        let start = random.between(-3.0, 3.0);
        let (times, keys) = near_keys(&mut random, count, start, step);
        let some_key = |random: &mut Random| times[random.next() as usize % count];
        let on_key = some_key(&mut random);
        let between = some_key(&mut random) + random.between(0.0, 0.01);
        let anywhere = random.between(-4.0, 4.0);
        asked.push(match track % 4 {
            0 => vec![on_key, between, anywhere],
            1 => vec![between, anywhere, between],
            _ => vec![anywhere, between, on_key],
        });
        set.push("", &times, &keys).unwrap();
    }
    give_key_data(&mut set, 84);
    // Evaluated in one window and group, and in many; some of these contain their tracks whole.
    let small = |options: &mut EngineOptions| options.memory = Some(300_000);
    let staged = |options: &mut EngineOptions| stage(options, 2);
    let mut engines = vulkan_engines(|_| {});
    engines.push(cpu());
    let mut others = vulkan_engines(small);
    others.extend(vulkan_engines(staged));
    for (round, method) in METHODS.into_iter().enumerate() {
        let many = cpu().upload(&set, method).unwrap();
        for count in 1..=3 {
            let some = |copies: usize| -> Vec<f64> {
                let of = |times: &Vec<f64>| times[..count].repeat(copies);
                asked.iter().flat_map(of).collect()
            };
            let many = many.evaluate(&SampleTimes::at_each(some(4))).unwrap();
            let of_track = |row: &[Quat]| row[..count].to_vec();
            let rows = many.as_quats().chunks(4 * count);
            let expected: Vec<Quat> = rows.flat_map(of_track).collect();
            let others = others.iter().filter(|_| count == 2);
            let frames = SampleTimes::at_each(some(1));
            for (i, engine) in engines.iter().chain(others).enumerate() {
                if !is_due(round + count, i, KERNEL_OPTIONS.len()) {
                    continue;
                }
                let clip = engine.upload(&set, method).unwrap();
                let found = clip.evaluate(&frames).unwrap();
                assert_same_bits(&expected, found.as_quats(), method.name);
                let found = clip
                    .request(&frames)
                    .layout(Layout::FrameMajor)
                    .evaluate()
                    .unwrap();
                for (row, track) in expected.chunks(count).zip(0..) {
                    for (sample, &rotation) in row.iter().enumerate() {
                        let found = found.get(track, sample).unwrap();
                        assert_same_bits(&[rotation], &[found], method.name);
                    }
                }
            }
        }
    }
}

/// Where a kept clip has no more samples than spans, a device gets a list of single samples: the
/// CPU's bits, in many windows and groups, between keys, on them and outside, of curves that
/// the host evaluates, beside gaps of more frames than f32 counts, as any encoding.
#[test]
fn few_samples_of_a_kept_clip_have_the_same_bits() {
    let mut random = Random(91);
    let mut set = TrackSet::new();
    for (count, step) in [(1, 1.0), (400, 3.0), (9000, 0.05), (2, 1.0), (300, 1.0)] {
        let (times, keys) = near_keys(&mut random, count, 0.5, step);
        set.push("", &times, &keys).unwrap();
    }
    // These keys are on frames, and the last one is far after the others.
    let mut times: Vec<f64> = (0..700).map(|key| f64::from(key) / 250.0).collect();
    times.extend([3.001, 3e6]);
    let keys: Vec<Quat> = times.iter().map(|_| random.rotation().as_quat()).collect();
    set.push("", &times, &keys).unwrap();
    let times: Vec<f64> = (0..90).map(|_| random.between(-1.0, 9.0)).collect();
    let requests = [
        SampleTimes::fps(25).between(-1.0, 6.0),
        SampleTimes::fps(125).between(1.0, 4.0),
        SampleTimes::at(times),
    ];
    let mut engines = Vec::new();
    for change in [
        |_: &mut EngineOptions| {},
        |options: &mut EngineOptions| options.memory = Some(300_000),
        |options: &mut EngineOptions| stage(options, 0),
    ] {
        engines.extend(vulkan_engines(change));
    }
    let cases = [
        (method::SLERP, WrapMode::Hold),
        (method::SLERP, WrapMode::Extrapolate),
        (method::CATMULL_ROM, WrapMode::Hold),
        (method::CATMULL_ROM, WrapMode::Extrapolate),
        (method::STEP, WrapMode::Hold),
    ];
    for (round, (method, outside)) in cases.into_iter().enumerate() {
        let interpolation = Interpolation::from(method)
            .with_before(outside)
            .with_after(outside);
        let kept = cpu().upload(&set, interpolation).unwrap();
        let clips: Vec<_> = round_robin(&engines, round)
            .map(|engine| (engine, engine.upload(&set, interpolation).unwrap()))
            .collect();
        for (request, frames) in requests.iter().enumerate() {
            let samples = kept.evaluate(frames).unwrap().as_quats().len();
            assert!(samples < set.key_count(), "few samples");
            for (kind, encoding) in Encoding::ALL.into_iter().enumerate() {
                if !is_due(round + request, kind, 2) {
                    continue;
                }
                let layout = Layout::TrackMajor;
                let expected = kept
                    .request(frames)
                    .layout(layout)
                    .encoding(encoding)
                    .evaluate_bytes()
                    .unwrap();
                for (engine, clip) in &clips {
                    let found = clip
                        .request(frames)
                        .layout(layout)
                        .encoding(encoding)
                        .evaluate_bytes()
                        .unwrap();
                    let device = engine.device_name();
                    let label = format!("{method}, {outside:?}, {frames:?}, {device}");
                    assert!(expected == found, "{encoding:?}, {label}");
                }
            }
        }
    }
}

/// Far more keys than samples go to a device piece by piece, and only those intervals that
/// hold a sample: the same bits, and errors that name the tracks of the whole set.
#[test]
fn dense_sets_go_piece_by_piece() {
    let mut random = Random(80);
    let (tracks, count) = (1000, 2000);
    let times: Vec<f64> = (0..count).map(|key| f64::from(key) / 120.0).collect();
    let pool: Vec<DQuat> = (0..97).map(|_| random.rotation()).collect();
    let mut keys = Vec::new();
    for track in 0..tracks {
        let base = random.rotation();
        let rotation = |key: i32| pool[(key / 64) as usize % 97].slerp(pool[track % 97], 0.5);
        keys.extend((0..count).map(|key| (base * rotation(key)).as_quat()));
    }
    let set = TrackSet::with_shared_times(&times, &keys).unwrap();
    let frames = SampleTimes::fps(7).between(1.0 / 240.0, 16.0);
    let mut engines = vulkan_engines(|_| {});
    engines.extend(vulkan_engines(|options| options.memory = Some(2 << 20)));
    for (round, method) in [method::SLERP, method::BESSEL_OVERHAUSER]
        .into_iter()
        .enumerate()
    {
        let expected = cpu().upload(&set, method).unwrap();
        let expected = expected.evaluate(&frames).unwrap();
        let on_cpu = cpu().evaluate(&set, method, &frames).unwrap();
        assert_same_bits(expected.as_quats(), on_cpu.as_quats(), method.name);
        for engine in round_robin(&engines, round) {
            let found = engine.evaluate(&set, method, &frames).unwrap();
            assert_same_bits(expected.as_quats(), found.as_quats(), method.name);
        }
        for engine in round_robin(&engines, round + 1) {
            let layout = Layout::FrameMajor;
            let columns = engine
                .request(&set, method, &frames)
                .layout(layout)
                .evaluate()
                .unwrap();
            assert_transposed(&expected, &columns);
        }
    }
    keys[990 * count as usize + 5] = -keys[990 * count as usize + 4];
    let set = TrackSet::with_shared_times(&times, &keys).unwrap();
    let as_authored =
        Interpolation::from(method::BESSEL_OVERHAUSER).with_signs(KeySigns::AsAuthored);
    for engine in round_robin(&engines, 2).chain([&cpu()]) {
        let refused = engine.evaluate(&set, as_authored, &frames);
        let words = refused.unwrap_err().to_string();
        assert!(words.contains("track 990: keys 4 and 5"), "{words}");
    }
}
