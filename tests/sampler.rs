//! `Clip::sampler`: single samples and poses, with the bits of `evaluate` at the same times.

use glam::{DQuat, DVec3, Quat, Vec4};
use tumble::vulkan::tuning::PrepareArcs;
use tumble::{
    Axes, Clip, Device, Ends, Engine, EngineOptions, Error, Interpolation, KeySigns, Layout,
    METHODS, Quantity, SampleTimes, Speed, TrackSet, VectorWidth, WrapMode, method,
};

use crate::support::{Random, first_difference, hostile_set, vulkan_engines};

fn cpu() -> Engine {
    Engine::new(Device::Cpu).unwrap()
}

/// Times that jump, at keys and next to them, then stay the same, run forwards and run backwards.
fn times(set: &TrackSet, random: &mut Random) -> Vec<f64> {
    let mut times: Vec<f64> = (0..60).map(|_| random.between(-30.0, 70.0)).collect();
    for &key in set.tracks().flat_map(|track| track.times).step_by(7) {
        times.extend([key.next_down(), key, key.next_up()]);
    }
    times.extend([1e300, -1e300, 0.0, -0.0, 5e-324, 1e9]);
    let mut sorted = times.clone();
    sorted.sort_by(f64::total_cmp);
    let slowly = (0..200).map(|i| 1.0 + 0.013 * f64::from(i));
    times.extend(sorted.iter().chain(sorted.iter().rev()));
    times.extend(slowly);
    times.extend([3.3; 5]);
    times
}

/// A sampler, asked for poses and for single samples, gives what `evaluate` gives.
#[track_caller]
fn assert_sampled(clip: &Clip, times: &[f64], label: &str) {
    let tracks = clip.track_count();
    let expected = clip.evaluate(&SampleTimes::at(times.to_vec())).unwrap();
    let mut sampler = clip.sampler().unwrap();
    let mut one_by_one = sampler.clone();
    let mut found = vec![Quat::IDENTITY; expected.as_quats().len()];
    let mut pose = vec![Quat::IDENTITY; tracks];
    for (index, &time) in times.iter().enumerate() {
        sampler.pose(time, &mut pose).unwrap();
        for (track, &value) in pose.iter().enumerate() {
            found[track * times.len() + index] = value;
        }
    }
    let check = |found: &[Quat], how: &str| {
        if let Some(index) = first_difference(expected.as_quats(), found) {
            let (track, sample) = (index / times.len(), index % times.len());
            panic!(
                "{label}, {how}: track {track} at {:e} s: {} instead of {}",
                times[sample],
                found[index],
                expected.as_quats()[index]
            );
        }
    };
    check(&found, "poses");
    for (index, value) in found.iter_mut().enumerate() {
        let (track, sample) = (index / times.len(), index % times.len());
        *value = one_by_one.sample(track, times[sample]).unwrap();
    }
    check(&found, "one by one");
}

#[test]
fn samples_have_the_bits_of_evaluate() {
    let set = hostile_set(3, 20);
    let mut random = Random(2);
    let times = times(&set, &mut random);
    for (index, method) in METHODS.into_iter().enumerate() {
        for (before, after) in WrapMode::ALL.into_iter().enumerate() {
            let interpolation = Interpolation::from(method)
                .with_before(WrapMode::ALL[(index + before) % 4])
                .with_after(after);
            let clip = cpu().upload(&set, interpolation).unwrap();
            assert_sampled(&clip, &times, &format!("{method}, {before}, {after}"));
        }
    }
    let constant = Interpolation::from(method::C2).with_speed(Speed::Constant);
    let clip = cpu().upload(&set, constant).unwrap();
    assert_sampled(&clip, &times, "constant speed");
}

/// Clips keep packed segments; sets are evaluated from unpacked ones, or from keys.
#[test]
fn packed_segments_have_the_bits_of_whole_ones() {
    let set = motion_set(31);
    let mut sampled = times(&set, &mut Random(32));
    sampled.truncate(600);
    let frames = [24, 60, 480].map(SampleTimes::fps);
    let velocity = Interpolation::from(method::BESSEL_OVERHAUSER)
        .with_quantity(Quantity::Velocity(Axes::Body));
    for width in VectorWidth::available() {
        let mut options = EngineOptions::default();
        options.vector_width = Some(width);
        let engine = Engine::with_options(Device::Cpu, &options).unwrap();
        for interpolation in [
            method::BESSEL_OVERHAUSER.into(),
            method::C2.into(),
            velocity,
        ] {
            let clip = engine.upload(&set, interpolation).unwrap();
            for frames in frames.iter().chain([&SampleTimes::at(sampled.clone())]) {
                for layout in Layout::ALL {
                    let [expected, found] = [
                        engine.request(&set, interpolation, frames),
                        clip.request(frames),
                    ]
                    .map(|request| request.layout(layout).evaluate_bytes().unwrap());
                    let label =
                        format!("{width:?}, {}, {frames:?}, {layout}", interpolation.method);
                    assert!(expected == found, "{label}");
                }
            }
        }
        let clip = engine.upload(&set, method::BESSEL_OVERHAUSER).unwrap();
        assert_sampled(&clip, &sampled, "packed");
    }
}

/// `Clip::bytes_per_key` of polynomials: 144 for small angles, 208 for large ones.
#[test]
fn polynomials_of_small_angles_take_less_memory() {
    let times: Vec<f64> = (0..1000).map(|key| f64::from(key) / 30.0).collect();
    let bytes_of = |degrees: f64| {
        let step = DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), degrees.to_radians());
        let mut rotation = Random(33).rotation();
        let mut set = TrackSet::new();
        let keys: Vec<Quat> = (times.iter())
            .map(|_| {
                rotation = (rotation * step).normalize();
                rotation.as_quat()
            })
            .collect();
        set.push("", &times, &keys).unwrap();
        let clip = cpu().upload(&set, method::BESSEL_OVERHAUSER).unwrap();
        clip.bytes_per_key()
    };
    let (small, large) = (bytes_of(2.0), bytes_of(60.0));
    assert!((143.0..145.0).contains(&small), "{small}");
    assert!((207.0..209.0).contains(&large), "{large}");
}

/// Arcs of more than half a turn, which are divided: tracks with the same key times have different spans.
#[test]
fn arcs_of_any_length_have_the_bits_of_evaluate() {
    let mut random = Random(7);
    let mut set = TrackSet::new();
    for _ in 0..6 {
        let keys: Vec<Quat> = (0..9).map(|_| random.rotation().as_quat()).collect();
        let times: Vec<f64> = (0..9).map(f64::from).collect();
        set.push("", &times, &keys).unwrap();
    }
    let authored = Interpolation::from(method::SLERP).with_signs(KeySigns::AsAuthored);
    let clip = cpu().upload(&set, authored).unwrap();
    assert_sampled(&clip, &times(&set, &mut random), "as authored");
}

/// Tracks of several parts, which share their times, at times of a clock that counts from 1970.
#[test]
fn long_tracks_have_the_bits_of_evaluate() {
    let mut random = Random(4);
    let start = 1.7e9;
    let times: Vec<f64> = (0..9000).map(|key| start + f64::from(key) * 0.01).collect();
    let mut set = TrackSet::new();
    for _ in 0..2 {
        let mut rotation = random.rotation();
        let keys: Vec<Quat> = (0..times.len())
            .map(|_| {
                let step = DQuat::from_axis_angle(random.direction(), random.between(0.0, 0.4));
                rotation = (rotation * step).normalize();
                rotation.as_quat()
            })
            .collect();
        set.push("", &times, &keys).unwrap();
    }
    set.push("shorter", &times[..9], &[Quat::IDENTITY; 9])
        .unwrap();
    let mut sampled: Vec<f64> = (0..300)
        .map(|_| start + random.between(-10.0, 110.0))
        .collect();
    sampled.extend((0..300).map(|frame| start + 40.9 + f64::from(frame) / 300.0));
    sampled.extend(times.iter().skip(4090).take(12));
    for (method, after) in [
        (method::SLERP, WrapMode::Hold),
        (method::BESSEL_OVERHAUSER, WrapMode::Mirror),
        (method::STEP, WrapMode::Loop),
    ] {
        let interpolation = Interpolation::from(method).with_after(after);
        let clip = cpu().upload(&set, interpolation).unwrap();
        assert_sampled(&clip, &sampled, &format!("{method}, {after}"));
    }
}

#[test]
fn an_interpolation_for_each_track_is_sampled() {
    let set = hostile_set(5, 12);
    let looped = Interpolation::from(method::SQUAD).with_after(WrapMode::Loop);
    let each = [looped, method::SLERP.into(), method::C2.into()];
    let each: Vec<Interpolation> = each.into_iter().cycle().take(12).collect();
    let clip = cpu().upload(&set, each).unwrap();
    assert_sampled(&clip, &times(&set, &mut Random(6)), "of each track");
}

/// Also those whose arcs the device computes itself.
#[test]
fn clips_of_devices_are_sampled_on_the_host() {
    let set = hostile_set(9, 12);
    let times = times(&set, &mut Random(8));
    for prepare_arcs in [PrepareArcs::OnDevice, PrepareArcs::OnHost] {
        for engine in vulkan_engines(|options| options.prepare_arcs = prepare_arcs) {
            for method in [method::SLERP, method::BESSEL_OVERHAUSER] {
                let expected = cpu().upload(&set, method).unwrap();
                let expected = expected.evaluate(&SampleTimes::at(times.clone())).unwrap();
                let clip = engine.upload(&set, method).unwrap();
                let mut sampler = clip.sampler().unwrap();
                drop(clip);
                for (sample, &time) in times.iter().enumerate() {
                    for track in 0..12 {
                        let found = sampler.sample(track, time).unwrap();
                        let expected = expected.get(track, sample).unwrap();
                        let label = format!("{engine:?}, {method}, {track} at {time}");
                        assert_eq!(first_difference(&[expected], &[found]), None, "{label}");
                    }
                }
            }
        }
    }
}

/// An engine whose clips keep keys beyond so many bytes of segments, within a limit of memory.
fn keeping(kept_segments: u64, memory: Option<u64>) -> Engine {
    let mut options = EngineOptions::default();
    (options.kept_segments, options.memory) = (Some(kept_segments), memory);
    Engine::with_options(Device::Cpu, &options).unwrap()
}

/// Tracks of motion at uneven times: steps are small, but for one of sixteen; some keys have the other sign, and tracks
/// of one, two and three keys are among them.
fn motion_set(seed: u64) -> TrackSet {
    let mut random = Random(seed);
    let mut set = TrackSet::new();
    let all: Vec<f64> = (0..160).map(|key| f64::from(key) / 30.0).collect();
    let mut uneven = all.clone();
    for time in &mut uneven[1..] {
        *time += random.between(-0.01, 0.01);
    }
    for track in 0..37 {
        let times = if track < 20 { &all } else { &uneven };
        let count = match track {
            3..6 => track - 2,
            _ => times.len(),
        };
        let mut rotation = random.rotation();
        let keys: Vec<Quat> = (0..count)
            .map(|_| {
                let angle = match random.next() % 16 {
                    0 => random.between(0.2, 3.1),
                    _ => random.between(0.0, 0.07),
                };
                let sign = if track % 5 == 4 && random.next().is_multiple_of(8) {
                    -1.0
                } else {
                    1.0
                };
                let step = DQuat::from_axis_angle(random.direction(), angle);
                rotation = (rotation * step).normalize() * sign;
                rotation.as_quat()
            })
            .collect();
        set.push("", &times[..count], &keys).unwrap();
    }
    set
}

/// Clips that keep keys, and segments only where a cubic rotates far, give what segments give.
#[test]
fn kept_keys_have_the_bits_of_segments() {
    let set = motion_set(21);
    let mut sampled = times(&set, &mut Random(22));
    sampled.extend((0..1000).map(|frame| f64::from(frame) / 173.0));
    let (of_segments, of_keys) = (keeping(u64::MAX, None), keeping(0, None));
    let natural = Interpolation::from(method::CATMULL_ROM).with_ends(Ends::Natural);
    let interpolations: [Interpolation; 4] = [
        method::SLERP.into(),
        method::BESSEL_OVERHAUSER.into(),
        method::CATMULL_ROM.into(),
        natural,
    ];
    for interpolation in interpolations {
        let label = format!("{}, {:?}", interpolation.method, interpolation.ends);
        let (segments, keys) = [&of_segments, &of_keys]
            .map(|engine| engine.upload(&set, interpolation).unwrap())
            .into();
        let [each, of_each]: [f64; 2] = [segments.bytes_per_key(), keys.bytes_per_key()];
        assert!(
            of_each >= 16.0 && of_each < 0.5 * each,
            "{label}: {of_each} of {each}"
        );
        assert_eq!(keys.sampler().unwrap().bytes_per_key(), of_each);
        let frames = [24, 60, 97, 480].map(SampleTimes::fps);
        for frames in frames.iter().chain([&SampleTimes::at(sampled.clone())]) {
            for layout in Layout::ALL {
                let [expected, found] = [&segments, &keys]
                    .map(|clip| clip.request(frames).layout(layout).evaluate().unwrap());
                let difference = first_difference(expected.as_quats(), found.as_quats());
                assert_eq!(difference, None, "{label}, {layout}");
            }
        }
        assert_sampled(&keys, &sampled, &label);
        let frames = SampleTimes::fps(60);
        let said = keys.request(&frames).explain().unwrap();
        assert!(said.starts_with("from the clip's keys: "), "{said}");
        let said = segments.request(&frames).explain().unwrap();
        assert!(said.starts_with("from the clip's segments"), "{said}");
    }
    // Curves that are not computed from keys, and curves that rotate far everywhere, have segments.
    let hostile = hostile_set(23, 12);
    for (set, method) in [(&set, method::SQUAD), (&hostile, method::BESSEL_OVERHAUSER)] {
        let clip = of_keys.upload(set, method).unwrap();
        assert!(
            clip.bytes_per_key() > 100.0,
            "{method}: {}",
            clip.bytes_per_key()
        );
    }
    let each: Vec<Interpolation> = interpolations.into_iter().cycle().take(37).collect();
    let clip = of_keys.upload(&set, each).unwrap();
    assert!(clip.bytes_per_key() < 60.0);
    assert_sampled(&clip, &sampled, "of each track");
}

/// Where segments exceed the limit of memory, keys within it serve for samplers; a smaller limit refuses these.
#[test]
fn kept_keys_keep_a_budget() {
    let set = motion_set(24);
    let needed = 64 * set.key_count() as u64;
    for method in [method::SLERP, method::BESSEL_OVERHAUSER] {
        let clip = keeping(u64::MAX, Some(needed))
            .upload(&set, method)
            .unwrap();
        let bytes = clip.bytes_per_key() * set.key_count() as f64;
        assert!(bytes <= needed as f64, "{method}: {bytes} of {needed}");
        assert_sampled(&clip, &times(&set, &mut Random(25)), "within a limit");
        let clip = keeping(0, Some(1000)).upload(&set, method).unwrap();
        assert!(matches!(clip.sampler(), Err(Error::OutOfMemory(_))));
    }
}

#[test]
fn velocities_are_sampled_as_vectors() {
    let set = hostile_set(11, 9);
    let velocity = Interpolation::from(method::BESSEL_OVERHAUSER)
        .with_quantity(Quantity::Velocity(Axes::Body));
    let clip = cpu().upload(&set, velocity).unwrap();
    let times = times(&set, &mut Random(10));
    let frames = SampleTimes::at(times.clone());
    let expected = clip.rates(&frames, tumble::Layout::FrameMajor).unwrap();
    let mut sampler = clip.sampler().unwrap();
    let tracks = [8, 0, 3];
    let mut found = [Vec4::ZERO; 3];
    for (sample, &time) in times.iter().enumerate() {
        sampler.pose_of(&tracks, time, &mut found).unwrap();
        for (&track, found) in tracks.iter().zip(found) {
            let expected = expected.get(track, sample).unwrap();
            let bits = found.truncate().to_array().map(f32::to_bits);
            assert_eq!(bits, expected.to_array().map(f32::to_bits), "{time}");
        }
    }
    assert!(matches!(sampler.sample(0, 0.0), Err(Error::NotRotations)));
}

/// Clones move independently, on two threads, after the clip is gone.
#[test]
fn two_threads_sample_one_clip() {
    let set = hostile_set(13, 9);
    let clip = cpu().upload(&set, method::BESSEL_OVERHAUSER).unwrap();
    let times: Vec<f64> = (0..2000)
        .map(|frame| f64::from(frame) * 0.02 - 3.0)
        .collect();
    let expected = clip.evaluate(&SampleTimes::at(times.clone())).unwrap();
    let sampler = clip.sampler().unwrap();
    drop(clip);
    std::thread::scope(|scope| {
        for is_backwards in [false, true] {
            let mut sampler = sampler.clone();
            let (times, expected) = (&times, &expected);
            scope.spawn(move || {
                for i in 0..times.len() {
                    let sample = if is_backwards { times.len() - 1 - i } else { i };
                    let mut pose = [Quat::IDENTITY; 9];
                    sampler.pose(times[sample], &mut pose).unwrap();
                    let expected: Vec<Quat> = (0..9)
                        .map(|track| expected.get(track, sample).unwrap())
                        .collect();
                    assert_eq!(first_difference(&expected, &pose), None, "{sample}");
                }
            });
        }
    });
}

#[test]
fn what_cannot_be_sampled_is_refused() {
    let set = hostile_set(15, 3);
    let clip = cpu().upload(&set, method::SLERP).unwrap();
    let mut sampler = clip.sampler().unwrap();
    let mut pose = [Quat::from_array([9.0; 4]); 3];
    for time in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let refused = sampler.pose(time, &mut pose).unwrap_err();
        assert!(refused.to_string().contains("finite"), "{refused}");
    }
    let refused = sampler.sample(3, 0.0).unwrap_err();
    assert_eq!(refused.to_string(), "there is no track 3; the set has 3");
    assert!(sampler.pose_of(&[0, 1, 3], 0.0, &mut pose).is_err());
    assert!(sampler.pose(0.0, &mut pose[..2]).is_err());
    assert!(sampler.pose(0.0, &mut [Vec4::ZERO; 3]).is_err());
    assert_eq!(pose, [Quat::from_array([9.0; 4]); 3]);

    let mut options = EngineOptions::default();
    options.memory = Some(1);
    let engine = Engine::with_options(Device::Cpu, &options).unwrap();
    let clip = engine.upload(&set, method::SLERP).unwrap();
    assert!(matches!(clip.sampler(), Err(Error::OutOfMemory(_))));
    let none = cpu().upload(&TrackSet::new(), method::SLERP).unwrap();
    none.sampler().unwrap().pose::<Quat>(0.0, &mut []).unwrap();
}
