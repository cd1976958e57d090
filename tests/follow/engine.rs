//! The engine against worked examples and the reference, and the same bits on every device.

use super::examples::{
    FIXED, FRENET, LOOP, MINIMAL, MINIMAL_AT_END, UP_AT_END, assert_rotation, c, following, k,
};
use crate::support::{Random, round_robin, vulkan_engines};
use crate::widths::paths;
use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::paths::{
    Direction, Follow, FollowError, FollowWarning, Followed, PathFrame, PathSpeed, Twist,
};
use tumble::reference::{
    self, Follower, FollowerDirection, FollowerSpeed, VectorCurve, angle_between,
};
use tumble::{
    Device, Ends, Engine, EngineOptions, Error, Layout, SampleTimes, TrackError, TrackSet,
    VectorMethod, VectorWidth,
};

fn set_of(follower: &Follower) -> TrackSet {
    let mut set = TrackSet::new();
    push(&mut set, follower);
    set
}

fn push(set: &mut TrackSet, follower: &Follower) {
    let keys: Vec<Vec3> = follower
        .curve
        .keys
        .iter()
        .map(|key| key.as_vec3())
        .collect();
    let ups: Vec<Option<Vec3>> = follower
        .ups
        .iter()
        .map(|up| up.map(DVec3::as_vec3))
        .collect();
    let track = set
        .push_path("", &follower.curve.times, &keys, &ups)
        .unwrap();
    if !follower.curve.tangents.is_empty() {
        let tangents: Vec<[Vec3; 2]> = follower
            .curve
            .tangents
            .iter()
            .map(|both| both.map(DVec3::as_vec3))
            .collect();
        set.set_translations(track, &follower.curve.times, &keys, &tangents)
            .unwrap();
    }
}

fn cpu() -> Engine {
    Engine::new(Device::Cpu).unwrap()
}

/// An engine on the CPU for each vector width.
fn widths() -> Vec<Engine> {
    let at = |width: VectorWidth| {
        let mut options = EngineOptions::default();
        options.vector_width = Some(width);
        Engine::with_options(Device::Cpu, &options).unwrap()
    };
    VectorWidth::available().into_iter().map(at).collect()
}

fn follow_of(follower: &Follower) -> Follow {
    Follow::default()
        .with_method(follower.curve.method.parse().unwrap())
        .with_ends(follower.curve.ends)
        .with_direction(match follower.heading {
            FollowerDirection::Tangent => Direction::Tangent,
            FollowerDirection::Ahead(distance) => Direction::Ahead(distance),
            FollowerDirection::At(point) => Direction::Point(point),
        })
        .with_frame(match follower.frame {
            reference::FollowerFrame::Minimal => PathFrame::Minimal,
            reference::FollowerFrame::Fixed => PathFrame::Fixed,
            reference::FollowerFrame::Frenet => PathFrame::Frenet,
        })
        .with_up(follower.up)
        .with_twist(if follower.spread {
            Twist::Spread
        } else {
            Twist::Free
        })
        .with_speed(match follower.travel {
            FollowerSpeed::Keys => PathSpeed::Keys,
            FollowerSpeed::Constant => PathSpeed::Constant,
            FollowerSpeed::Eased(start, end) => PathSpeed::Eased { start, end },
        })
}

fn at(follower: &Follower, times: &[f64]) -> Followed {
    let frames = SampleTimes::at(times.to_vec());
    cpu()
        .follow(
            &set_of(follower),
            &follow_of(follower),
            &frames,
            Layout::TrackMajor,
        )
        .unwrap()
}

fn rotation(found: &Followed, sample: usize) -> DQuat {
    found.rotations.get(0, sample).unwrap().as_dquat()
}

#[test]
fn examples_come_out() {
    let follower = k("bessel-overhauser", Ends::Parabolic);
    let found = at(&follower, &[1.75, 4.5]);
    let position = found.positions.get(0, 0).unwrap();
    assert!((position - Vec3::new(1.86875, 3.30625, 0.2375)).length() < 1e-6);
    assert_rotation(rotation(&found, 0), MINIMAL, 3e-7);
    assert_rotation(rotation(&found, 1), MINIMAL_AT_END, 3e-7);
    let with = |frame| Follower {
        frame,
        ..follower.clone()
    };
    assert_rotation(
        rotation(&at(&with(reference::FollowerFrame::Fixed), &[1.75]), 0),
        FIXED,
        3e-7,
    );
    assert_rotation(
        rotation(&at(&with(reference::FollowerFrame::Frenet), &[1.75]), 0),
        FRENET,
        3e-7,
    );
    let mut ups = vec![None; 5];
    ups[4] = Some(DVec3::Y);
    let with_up = Follower { ups, ..follower };
    assert_rotation(rotation(&at(&with_up, &[1.75]), 0), UP_AT_END, 3e-7);
    let round = at(&c(), &[2.5, 0.0, 5.0]);
    assert_rotation(rotation(&round, 0), LOOP, 3e-7);
    assert_eq!(round.rotations.get(0, 1), round.rotations.get(0, 2));
    let natural = at(&k("c2", Ends::Natural), &[1.75])
        .positions
        .get(0, 0)
        .unwrap();
    assert!((natural.as_dvec3() - DVec3::new(1.83366935, 3.51814516, 0.125)).length() < 1e-6);
}

/// The straight stretch between two bends: after a quarter of the length it has turned by a quarter of the angle.
#[test]
fn frenet_s_frame_turns_evenly_on_straight_stretches() {
    let (a, b) = (DVec3::Y, DVec3::new(0.0, -0.5, 0.75f64.sqrt()));
    // Arcs in the planes of these normals' opposites, joined by a line along x.
    let keys = [
        DVec3::new(-1.0, -1.0, 0.0) * 0.0 - DVec3::X + a * -0.5,
        DVec3::ZERO,
        DVec3::X * 4.0,
        DVec3::X * 5.0 - b * 0.5,
    ];
    let tangents = [
        [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0)],
        [DVec3::X; 2],
        [DVec3::X * 4.0; 2],
        [DVec3::X - b; 2],
    ];
    let mut tangents = tangents.to_vec();
    tangents[1] = [DVec3::X, DVec3::X * 4.0];
    tangents[2] = [DVec3::X * 4.0, DVec3::X];
    let mut follower = following(VectorCurve {
        method: "gltf-cubic",
        ends: Ends::Parabolic,
        times: vec![0.0, 1.0, 2.0, 3.0],
        keys: keys.to_vec(),
        tangents,
    });
    follower.frame = reference::FollowerFrame::Frenet;
    let found = at(&follower, &[1.0, 1.25, 2.0]);
    let y = |sample| rotation(&found, sample) * DVec3::Y;
    let quarter = 15f64.to_radians();
    let expected = DVec3::new(0.0, quarter.cos(), -quarter.sin());
    let sign = y(0).y.signum();
    assert!((y(0) * sign - DVec3::Y).length() < 1e-6, "{}", y(0));
    assert!((y(1) * sign - expected).length() < 1e-6, "{}", y(1));
    assert!((y(2) * sign + b).length() < 1e-6, "{}", y(2));
}

/// At a cusp the body makes half a turn about y; Frenet's normal and the inflection of (t, t³).
#[test]
fn cusps_and_inflections() {
    let cusp = |t: f64| DVec3::new(t * t, t * t * t, 0.0);
    let slope = |t: f64| DVec3::new(2.0 * t, 3.0 * t * t, 0.0) * 2.0;
    let mut follower = following(VectorCurve {
        method: "gltf-cubic",
        ends: Ends::Parabolic,
        times: vec![0.0, 1.0],
        keys: vec![cusp(-1.0), cusp(1.0)],
        tangents: vec![[DVec3::ZERO, slope(-1.0)], [slope(1.0), DVec3::ZERO]],
    });
    follower.up = DVec3::Z;
    let found = at(&follower, &[0.49, 0.4999999, 0.5000001, 0.51]);
    for (sample, expected) in [(1, -DVec3::X), (2, DVec3::X)] {
        let forward = rotation(&found, sample) * DVec3::Z;
        assert!((forward - expected).length() < 1e-5, "{forward}");
        let up = rotation(&found, sample) * DVec3::Y;
        assert!((up - DVec3::Z).length() < 1e-6, "{up}");
    }
    follower.travel = FollowerSpeed::Constant;
    let frames = SampleTimes::fps(240);
    let found = cpu()
        .follow(
            &set_of(&follower),
            &follow_of(&follower),
            &frames,
            Layout::TrackMajor,
        )
        .unwrap();
    let steps: Vec<f32> = (0..240)
        .map(|i| {
            (found.positions.get(0, i + 1).unwrap() - found.positions.get(0, i).unwrap()).length()
        })
        .collect();
    // Chords of a curve, but for those next to the cusp, are nearly as long as their arcs.
    let length = 2.8794197467 / 240.0;
    assert!(
        steps
            .iter()
            .filter(|&&step| (f64::from(step) / length - 1.0).abs() < 1e-3)
            .count()
            > 220
    );
    let slope = DVec3::new(2.0, 6.0, 0.0);
    let bend = Follower {
        frame: reference::FollowerFrame::Frenet,
        ..super::examples::cubic(
            DVec3::new(-1.0, -1.0, 0.0),
            slope,
            slope,
            DVec3::new(1.0, 1.0, 0.0),
        )
    };
    let found = at(&bend, &[0.25, 0.75]);
    let axis = |sample, axis| rotation(&found, sample) * axis;
    assert!((axis(0, DVec3::X) + DVec3::Z).length() < 1e-6);
    assert!((axis(1, DVec3::X) + DVec3::Z).length() < 1e-6);
    assert!((axis(1, DVec3::Y) - DVec3::new(-0.6, 0.8, 0.0)).length() < 1e-6);
}

/// Random walks that turn by up to about a right angle at each key.
fn walk(random: &mut Random, method: &'static str, closed: bool) -> Follower {
    let count = 3 + (random.next() % 8) as usize;
    let mut position = random.direction() * random.between(0.0, 20.0);
    let mut direction = random.direction();
    let mut time = random.between(-1.0, 1.0);
    let (mut times, mut keys) = (Vec::new(), Vec::new());
    for _ in 0..count {
        times.push(time);
        keys.push(position.as_vec3().as_dvec3());
        let step = random.between(0.5, 2.0);
        time += step * random.between(0.7, 1.4);
        direction = (direction + random.direction() * 0.8).normalize();
        position += direction * step;
    }
    if closed {
        let angle = |i: usize| std::f64::consts::TAU * i as f64 / count as f64;
        for (i, key) in keys.iter_mut().enumerate() {
            let round = DVec3::new(angle(i).cos(), angle(i).sin(), 0.0) * 5.0;
            *key = (round + random.direction() * 0.6).as_vec3().as_dvec3();
        }
        keys.push(keys[0]);
        times.push(time);
    }
    let ends = if closed { Ends::Loop } else { Ends::Parabolic };
    let curve = VectorCurve {
        method,
        ends,
        times,
        keys,
        tangents: Vec::new(),
    };
    let mut up = random.direction();
    while up.dot(direction).abs() > 0.9 {
        up = random.direction();
    }
    Follower {
        spread: closed,
        up: up.as_vec3().as_dvec3(),
        ..following(curve)
    }
}

#[test]
fn followers_are_the_reference_s() {
    let mut random = Random(11);
    let (mut squares, mut count) = (0.0f64, 0.0f64);
    let mut largest = [0.0f64; 3];
    for round in 0..60 {
        let method = [
            "bessel-overhauser",
            "c2",
            "b-spline",
            "catmull-rom",
            "linear",
        ][round % 5];
        let mut follower = walk(&mut random, method, round % 3 == 2);
        follower.frame = match round % 7 {
            0 if method != "linear" => reference::FollowerFrame::Frenet,
            3 => reference::FollowerFrame::Fixed,
            _ => reference::FollowerFrame::Minimal,
        };
        follower.heading = match round % 8 {
            _ if follower.frame == reference::FollowerFrame::Frenet => FollowerDirection::Tangent,
            5 => FollowerDirection::Ahead(0.7),
            6 => FollowerDirection::At(DVec3::new(40.0, 30.0, -20.0)),
            _ => FollowerDirection::Tangent,
        };
        follower.travel = match round % 4 {
            1 => FollowerSpeed::Constant,
            2 => FollowerSpeed::Eased(0.2, 0.3),
            _ => FollowerSpeed::Keys,
        };
        if follower.frame == reference::FollowerFrame::Minimal && round % 5 == 1 {
            follower.ups = follower.curve.keys.iter().map(|_| None).collect();
            follower.ups[1] = Some(random.direction().as_vec3().as_dvec3());
        }
        let walk = follower.walk();
        let times = &follower.curve.times;
        let (first, last) = (times[0], times[times.len() - 1]);
        let samples: Vec<f64> = (0..150)
            .map(|i| first + (last - first) * (f64::from(i) + 0.37) / 150.0)
            .collect();
        let found = at(&follower, &samples);
        let scale = follower
            .curve
            .keys
            .iter()
            .fold(0.0f64, |scale, key| scale.max(key.abs().max_element()));
        for (sample, &time) in samples.iter().enumerate() {
            if times.iter().any(|key| (key - time).abs() < 1e-6) {
                continue;
            }
            let (position, expected) = walk.pose(time);
            let off =
                (found.positions.get(0, sample).unwrap().as_dvec3() - position).length() / scale;
            let angle = angle_between(rotation(&found, sample), expected);
            let aside = (rotation(&found, sample) * DVec3::Z).angle_between(expected * DVec3::Z);
            largest = [largest[0].max(off), largest[1], largest[2].max(aside)];
            assert!(
                off < 2e-7,
                "{round} {method} at {time}: position off by {off:e}"
            );
            // Where the point ahead passes a corner, the direction's derivative jumps, so the reference's integration
            // has an error in that step.
            let ahead = matches!(follower.heading, FollowerDirection::Ahead(_));
            let bound = if ahead && method == "linear" {
                5e-6
            } else {
                1e-6
            };
            assert!(
                aside < 1e-6,
                "{round} {method} at {time}: forward off by {aside:e}"
            );
            assert!(
                angle < bound,
                "{round} {method} {:?} {:?} at {time}: {angle:e}",
                follower.frame,
                follower.heading
            );
            if bound == 1e-6 {
                largest[1] = largest[1].max(angle);
                squares += angle * angle;
                count += 1.0;
            }
        }
    }
    let rms = (squares / count).sqrt();
    eprintln!(
        "positions {:.2e}, rotations {:.2e} (rms {rms:.2e}), forward {:.2e}",
        largest[0], largest[1], largest[2]
    );
    assert!(rms < 1e-7, "{rms:e}");
}

/// Difficult paths: stops, reversals, corners, straight lines, vertical ones, a single point.
pub(super) fn trouble() -> TrackSet {
    let mut random = Random(3);
    let mut set = TrackSet::new();
    for track in 0..9 {
        let count = 1 + track % 9;
        let mut time = random.between(-1.0, 1.0);
        let mut position = DVec3::ZERO;
        let (mut times, mut keys) = (Vec::new(), Vec::new());
        for key in 0..count {
            times.push(time);
            keys.push(position.as_vec3());
            time += random.pick(&[1e-4, 0.1, 1.0, 3.0]);
            position += match (track + key) % 6 {
                0 => DVec3::ZERO,
                1 => DVec3::Y * random.between(-2.0, 2.0),
                2 => -position,
                3 => DVec3::X,
                _ => random.direction() * random.pick(&[1e-6, 1.0, 300.0]),
            };
        }
        if track % 4 == 0 && count > 1 {
            keys[count - 1] = keys[0];
        }
        let ups: Vec<Option<Vec3>> = match track % 5 {
            0 => (0..count)
                .map(|key| (key % 2 == 1).then_some(Vec3::Z))
                .collect(),
            _ => Vec::new(),
        };
        set.push_path("", &times, &keys, &ups).unwrap();
    }
    set
}

fn bits(found: &Followed) -> Vec<u32> {
    let positions = found
        .positions
        .as_slice()
        .iter()
        .flat_map(glam::Vec4::to_array);
    let rotations = found.rotations.as_quats().iter().flat_map(Quat::to_array);
    positions.chain(rotations).map(f32::to_bits).collect()
}

pub(super) fn option_sets() -> Vec<Follow> {
    let mut all = Vec::new();
    let directions = [
        Direction::Tangent,
        Direction::Ahead(0.5),
        Direction::Point(DVec3::ZERO),
        Direction::Track(3),
    ];
    let speeds = [
        PathSpeed::Keys,
        PathSpeed::Constant,
        PathSpeed::Eased {
            start: 0.3,
            end: 0.7,
        },
    ];
    for (i, direction) in directions.into_iter().enumerate() {
        for (j, speed) in speeds.into_iter().enumerate() {
            for frame in [PathFrame::Minimal, PathFrame::Fixed, PathFrame::Frenet] {
                if frame == PathFrame::Frenet && i > 0 {
                    continue;
                }
                let method = VectorMethod::ALL[(i + j + all.len()) % 7];
                all.push(
                    Follow::default()
                        .with_method(method)
                        .with_direction(direction)
                        .with_speed(speed)
                        .with_frame(frame),
                );
            }
        }
    }
    all
}

/// The set without the tracks that these options refuse.
pub(super) fn accepted(set: &TrackSet, follow: &Follow) -> TrackSet {
    let mut subset = TrackSet::new();
    for track in 0..set.track_count() {
        let keys = set
            .vector_keys(tumble::Channel::Translation, track)
            .unwrap();
        let ups = match follow.frame {
            PathFrame::Minimal if track % 5 == 0 => (0..keys.keys.len())
                .map(|key| (key % 2 == 1).then_some(Vec3::Z))
                .collect(),
            _ => Vec::new(),
        };
        subset.push_path("", keys.times, keys.keys, &ups).unwrap();
    }
    subset
}

/// Every rotation is a unit quaternion, at every time of every path, and all devices and widths give
/// the same bits.
#[test]
fn the_same_bits_on_every_device() {
    let set = trouble();
    let frames = SampleTimes::fps(50).between(-2.0, 9.0);
    let devices = vulkan_engines(|_| {});
    let widths = widths();
    for (i, follow) in option_sets().into_iter().enumerate() {
        let subset = accepted(&set, &follow);
        let layout = [Layout::TrackMajor, Layout::FrameMajor][i % 2];
        let expected = cpu().follow(&subset, &follow, &frames, layout).unwrap();
        for &rotation in expected.rotations.as_quats() {
            let norm = rotation.as_dquat().length();
            assert!((norm - 1.0).abs() < 6e-7, "{follow:?}: {rotation:?} {norm}");
        }
        let expected = bits(&expected);
        // Only some engines, because preparing the paths for each takes long.
        for engine in round_robin(&devices, i + i / 3).chain([&widths[i % widths.len()]]) {
            assert!(
                bits(&engine.follow(&subset, &follow, &frames, layout).unwrap()) == expected,
                "{follow:?}, {engine:?}"
            );
        }
    }
}

/// Catches lanes that mix up paths or pieces of them.
#[test]
fn paths_are_followed_together_as_alone() {
    let set = paths();
    let base = Follow::default();
    let follows = [
        base.clone(),
        base.clone()
            .with_axes(["x", "-z"].map(|axis| axis.parse().unwrap())),
        base.clone().with_speed(PathSpeed::Constant),
        base.clone()
            .with_frame(PathFrame::Fixed)
            .with_direction(Direction::Point(DVec3::new(0.0, 2.0, 9.0))),
        base.with_frame(PathFrame::Frenet),
    ];
    let frames = SampleTimes::fps(100).between(-0.1, 12.1);
    let found = |engine: &Engine, set: &TrackSet, follow: &Follow| {
        bits(
            &engine
                .follow(set, follow, &frames, Layout::TrackMajor)
                .unwrap(),
        )
    };
    for follow in follows {
        let together = found(&cpu(), &set, &follow);
        // Positions of all tracks, then rotations of all tracks.
        let (positions, rotations) = together.split_at(together.len() / 2);
        let tracks = positions.len() / 23;
        for track in 0..23 {
            let alone = found(&cpu(), &set.select([track]).unwrap(), &follow);
            let range = track * tracks..(track + 1) * tracks;
            let expected = [&positions[range.clone()], &rotations[range]].concat();
            assert!(alone == expected, "{track}, {follow:?}");
        }
    }
}

/// A body faces another one that does not face it: the direction at each time is that to the other's
/// position.
#[test]
fn a_body_looks_at_another() {
    let mut random = Random(8);
    let follower = walk(&mut random, "bessel-overhauser", false);
    let other = walk(&mut random, "bessel-overhauser", false);
    let away = |key: &DVec3| (*key + DVec3::splat(60.0)).as_vec3();
    let keys: Vec<Vec3> = other.curve.keys.iter().map(away).collect();
    let mut set = set_of(&follower);
    set.push_path("", &other.curve.times, &keys, &[]).unwrap();
    let eased = PathSpeed::Eased {
        start: 0.4,
        end: 0.1,
    };
    for speed in [PathSpeed::Keys, PathSpeed::Constant, eased] {
        let follow = Follow::default().with_speed(speed);
        let frames = SampleTimes::fps(60);
        let at = |direction| {
            let follow = follow.clone().with_direction(direction);
            cpu().follow(&set, &follow, &frames, Layout::TrackMajor)
        };
        let error = at(Direction::Track(2)).unwrap_err();
        assert!(matches!(
            error,
            Error::Follow(FollowError::Target {
                track: 0,
                target: 2
            })
        ));
        let (found, plain) = (
            at(Direction::Track(1)).unwrap(),
            at(Direction::Tangent).unwrap(),
        );
        for sample in 0..found.rotations.sample_count() {
            let position = |track| found.positions.get(track, sample).unwrap().as_dvec3();
            let forward = found.rotations.get(0, sample).unwrap().as_dquat() * DVec3::Z;
            let off = (forward - (position(1) - position(0)).normalize()).length();
            assert!(off < 1e-6, "{speed:?} {sample}: {off:e}");
            // The other body faces along its path.
            assert_eq!(
                found.rotations.get(1, sample),
                plain.rotations.get(1, sample)
            );
        }
    }
}

#[test]
fn what_cannot_be_followed_is_refused() {
    let mut set = TrackSet::new();
    let none: Vec<f64> = Vec::new();
    assert!(set.push_path("", &none, &[Vec3::ZERO; 0], &[]).is_err());
    let nan = set.push_path("", &[0.0], &[Vec3::NAN], &[]).unwrap_err();
    assert!(matches!(nan, TrackError::DataNotFinite { key: 0, .. }));
    let order = set
        .push_path("", &[0.0, 0.0], &[Vec3::ZERO; 2], &[])
        .unwrap_err();
    assert!(matches!(order, TrackError::TimeNotIncreasing { .. }));
    let up = set
        .push_path("", &[0.0], &[Vec3::ZERO], &[Some(Vec3::ZERO)])
        .unwrap_err();
    assert!(matches!(up, TrackError::NoUp { key: 0, .. }));
    let too_large = set.push_path("", &[0.0], &[Vec3::splat(2e30)], &[]);
    let too_large = too_large.unwrap_err();
    assert!(matches!(too_large, TrackError::DataTooLarge { key: 0, .. }));
    // A refused path leaves no track.
    assert_eq!((set.track_count(), set.time_span()), (0, None));

    let standing = |keys: &[Vec3]| {
        let mut set = TrackSet::new();
        let times: Vec<f64> = (0..keys.len()).map(|i| i as f64).collect();
        set.push_path("", &times, keys, &[]).unwrap();
        let frames = SampleTimes::at(vec![0.5]);
        cpu()
            .follow(&set, &Follow::default(), &frames, Layout::TrackMajor)
            .unwrap()
    };
    for keys in [&[Vec3::ONE][..], &[Vec3::ONE; 4]] {
        let found = standing(keys);
        assert_eq!(found.warnings, [FollowWarning::StandsStill { track: 0 }]);
        assert_eq!(found.rotations.get(0, 0), Some(Quat::IDENTITY));
        assert_eq!(found.positions.get(0, 0), Some(Vec3::ONE));
    }

    let set = set_of(&k("bessel-overhauser", Ends::Parabolic));
    let refused = |follow: Follow| match cpu().follow(
        &set,
        &follow,
        &SampleTimes::fps(1),
        Layout::TrackMajor,
    ) {
        Err(Error::Follow(error)) => error,
        other => panic!("{other:?}"),
    };
    let base = Follow::default;
    assert!(matches!(
        refused(base().with_ends(Ends::Loop)),
        FollowError::OpenLoop { track: 0, .. }
    ));
    assert!(matches!(
        refused(base().with_up(DVec3::ZERO)),
        FollowError::Up { .. }
    ));
    for distance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            refused(base().with_direction(Direction::Ahead(distance))),
            FollowError::Ahead { .. }
        ));
    }
    let speed = PathSpeed::Eased {
        start: 0.6,
        end: 0.5,
    };
    assert!(matches!(
        refused(base().with_speed(speed)),
        FollowError::Eased { .. }
    ));
    let aside = base()
        .with_frame(PathFrame::Frenet)
        .with_direction(Direction::Ahead(1.0));
    assert_eq!(refused(aside), FollowError::FrenetAside);
    let axes = ["z".parse().unwrap(), "-z".parse().unwrap()];
    assert_eq!(refused(base().with_axes(axes)), FollowError::Axes);
    let mut rotations = TrackSet::new();
    rotations.push("", &[0.0], &[Quat::IDENTITY]).unwrap();
    let error = cpu().follow(
        &rotations,
        &base(),
        &SampleTimes::fps(1),
        Layout::TrackMajor,
    );
    assert!(matches!(
        error,
        Err(Error::Follow(FollowError::NoPath { track: 0 }))
    ));
}

/// An up direction along the path is ignored with a warning, and so is a leftover of half a turn, whose sign is arbitrary.
#[test]
fn what_is_unusual_is_said() {
    let keys = [Vec3::ZERO, Vec3::Y, Vec3::Y * 2.0];
    let mut set = TrackSet::new();
    set.push_path("", &[0.0, 1.0, 2.0], &keys, &[]).unwrap();
    let frames = SampleTimes::at(vec![0.0, 1.5]);
    let found = cpu()
        .follow(&set, &Follow::default(), &frames, Layout::TrackMajor)
        .unwrap();
    assert!(found.warnings.is_empty());
    let forward = found.rotations.get(0, 1).unwrap() * Vec3::Z;
    assert!((forward - Vec3::Y).length() < 1e-6);
    let mut set = TrackSet::new();
    let line = [Vec3::ZERO, Vec3::X];
    set.push_path("", &[0.0, 1.0], &line, &[Some(Vec3::Y), Some(-Vec3::Y)])
        .unwrap();
    let found = cpu()
        .follow(&set, &Follow::default(), &frames, Layout::TrackMajor)
        .unwrap();
    assert_eq!(found.warnings, [FollowWarning::HalfTurn { track: 0 }]);
}

/// Renamed axes rotate the body in its local frame.
#[test]
fn other_axes_face_forward() {
    let set = set_of(&k("bessel-overhauser", Ends::Parabolic));
    let frames = SampleTimes::at(vec![1.75]);
    let of = |forward: &str, up: &str| {
        let axes = [forward.parse().unwrap(), up.parse().unwrap()];
        let follow = Follow::default().with_axes(axes);
        cpu()
            .follow(&set, &follow, &frames, Layout::TrackMajor)
            .unwrap()
            .rotations
            .get(0, 0)
            .unwrap()
    };
    let (default_rotation, other) = (of("z", "y"), of("-x", "z"));
    assert!((default_rotation * Vec3::Z + other * Vec3::X).length() < 1e-6);
    assert!((default_rotation * Vec3::Y - other * Vec3::Z).length() < 1e-6);
}
