//! The method c2: its angular acceleration is continuous where a solution is found, else it says so.

use glam::{DQuat, DVec3, Quat, Vec4};
use tumble::{
    Axes, Device, Ends, Engine, Interpolation, InterpolationWarning, KeySigns, Layout, Quantity,
    SampleTimes, TrackSet, method, reference::ReferenceCurve,
};

use crate::support::{Random, hostile_set};

/// Rotations whose steps have these sizes in radians, about any axes.
fn walk(random: &mut Random, steps: impl Fn(&mut Random) -> f64, keys: usize) -> Vec<Quat> {
    let mut rotation = random.rotation();
    let mut all = vec![rotation.as_quat()];
    for _ in 1..keys {
        let step = DQuat::from_axis_angle(random.direction(), steps(random));
        rotation = (rotation * step).normalize();
        all.push(rotation.as_quat());
    }
    all
}

/// Times whose gaps have the ratio `ratio` at most: the shortest is 1 and the longest `ratio`.
fn times(random: &mut Random, keys: usize, ratio: f64) -> Vec<f64> {
    let mut gaps: Vec<f64> = (1..keys).map(|_| ratio.powf(random.unit())).collect();
    let ends = [0; 2].map(|_| random.next() as usize % gaps.len());
    (gaps[ends[0]], gaps[ends[1]]) = (1.0, ratio);
    let mut time = 0.0;
    let mut all = vec![time];
    for gap in gaps {
        time += gap;
        all.push(time);
    }
    all
}

/// The angular accelerations just before and just after each inner key, and the largest speed in
/// radians per second, on which rounding depends.
fn accelerations(set: &TrackSet, interpolation: Interpolation) -> Vec<[DVec3; 2]> {
    let engine = Engine::new(Device::Cpu).unwrap();
    let of = interpolation.with_quantity(Quantity::Acceleration(Axes::Body));
    let keys = set.track(0).times.to_vec();
    let inner = &keys[1..keys.len() - 1];
    let asked: Vec<f64> = inner
        .iter()
        .flat_map(|&time| [time.next_down(), time])
        .collect();
    let found = engine
        .rates(set, of, &SampleTimes::at(asked), Layout::TrackMajor)
        .unwrap();
    let vector = |v: &Vec4| v.truncate().as_dvec3();
    let all: Vec<DVec3> = found.as_slice().iter().map(vector).collect();
    all.as_chunks().0.to_vec()
}

fn one(times: &[f64], keys: &[Quat]) -> TrackSet {
    let mut set = TrackSet::new();
    set.push("", times, keys).unwrap();
    set
}

/// The jump of the acceleration, relative to the largest acceleration at any key.
fn jump(set: &TrackSet, interpolation: Interpolation) -> f64 {
    let all = accelerations(set, interpolation);
    let largest = all.iter().flatten().map(|v| v.length()).fold(0.0, f64::max);
    let jumps = all
        .iter()
        .map(|[before, behind]| (*behind - *before).length());
    jumps.fold(0.0, f64::max) / largest
}

/// 20° about x, y and z, one step of them in a twentieth of the time: numbers of `SciPy`'s
/// `RotationSpline`, iterated until it converges.
#[test]
fn a_short_interval_between_long_ones_is_as_scipy_has_it() {
    let angle = 20f64.to_radians();
    let mut rotation = DQuat::IDENTITY;
    let mut keys = vec![rotation.as_quat()];
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        rotation *= DQuat::from_axis_angle(axis, angle);
        keys.push(rotation.as_quat());
    }
    let set = one(&[0.0, 1.0, 1.05, 2.0], &keys);
    let [first, second] = *accelerations(&set, method::C2.into()) else {
        panic!("two inner keys");
    };
    let expected = DVec3::new(1.191_498, 27.074_055, -0.045_048);
    for side in first {
        assert!((side - expected).length() < 2e-5, "{side}");
    }
    let expected = DVec3::new(-0.038_769, -28.355_148, 1.439_698);
    for side in second {
        assert!((side - expected).length() < 2e-5, "{side}");
    }
    let engine = Engine::new(Device::Cpu).unwrap();
    let at = SampleTimes::at(vec![0.5, 1.5]);
    let found = engine.evaluate(&set, method::C2, &at).unwrap();
    let expected = [
        DQuat::from_xyzw(0.106_921_98, -0.405_388_18, -0.070_785_59, 0.905_106_36),
        DQuat::from_xyzw(0.154_295_10, 0.540_664_39, 0.154_773_95, 0.812_354_64),
    ];
    for (found, expected) in found.as_quats().iter().zip(expected) {
        let off = (found.as_dquat() - expected).length();
        assert!(off < 2e-7, "{found}: {off:e}");
    }
}

/// Steps of 0.3 to 2 radians, gaps up to 100 : 1 apart: every one is solved, with free and closed ends
/// too.
#[test]
fn the_acceleration_is_continuous_however_keys_are_spaced() {
    let mut random = Random(41);
    let mut worst = 0.0f64;
    for trial in 0..60 {
        let keys = 3 + random.next() as usize % 14;
        let ratio = 100f64.powf(random.unit());
        let size = random.between(0.3, 2.0);
        let mut rotations = walk(&mut random, |_| size, keys);
        let ends = [Ends::Secant, Ends::Natural, Ends::Parabolic, Ends::Loop][trial % 4];
        if ends == Ends::Loop {
            rotations[keys - 1] = rotations[0];
        }
        let set = one(&times(&mut random, keys, ratio), &rotations);
        let interpolation = Interpolation::from(method::C2).with_ends(ends);
        assert_eq!(interpolation.warnings(&set), []);
        let jump = jump(&set, interpolation);
        worst = worst.max(jump);
        assert!(jump < 1e-4, "trial {trial}: {jump:e}");
    }
    println!("the largest jump is {worst:e} of the largest acceleration");
}

/// Steps of nearly a whole turn on the long way round are passed too fast: the curve is one with
/// continuous velocity, and a warning names the first key.
#[test]
fn keys_at_which_the_acceleration_jumps_are_named() {
    let mut random = Random(5);
    let mut rotations = walk(&mut random, |_| 0.05, 24);
    for (index, rotation) in rotations.iter_mut().enumerate() {
        if index % 2 == 1 {
            *rotation = -*rotation;
        }
    }
    let set = one(&times(&mut random, 24, 10.0), &rotations);
    let interpolation = Interpolation::from(method::C2).with_signs(KeySigns::AsAuthored);
    let found = interpolation.warnings(&set);
    let [
        InterpolationWarning::AccelerationJumps {
            track: 0,
            key,
            count,
        },
    ] = *found
    else {
        panic!("{found:?}");
    };
    let text = format!("jumps at {count} keys, the first is key {key}");
    assert!(found[0].to_string().contains(&text), "{}", found[0]);
    assert!(jump(&set, interpolation) > 1e-3);
    // By the shorter way the curve is solvable, and other methods have no warning.
    assert_eq!(Interpolation::from(method::C2).warnings(&set), []);
    let other = Interpolation::from(method::BESSEL_OVERHAUSER).with_signs(KeySigns::AsAuthored);
    assert_eq!(other.warnings(&set), []);
}

/// For hostile keys the reference's acceleration, which is a difference of velocities along the curve, is the same
/// on both sides of every key but those that the engine's warning counts: both took one solution.
#[test]
fn engine_and_reference_take_one_solution_of_hostile_keys() {
    let (mut counted, mut seen) = (0, 0);
    for seed in 0..24 {
        let set = hostile_set(seed, 64);
        let interpolation = Interpolation::from(method::C2);
        let mut of_tracks = vec![0; set.track_count()];
        for warning in interpolation.warnings(&set) {
            let InterpolationWarning::AccelerationJumps { track, count, .. } = warning else {
                panic!("{warning}");
            };
            of_tracks[track] = count;
        }
        for (index, track) in set.tracks().enumerate() {
            let curve = ReferenceCurve::of(&interpolation, track);
            let mut jumps = 0;
            for key in 1..track.times.len().saturating_sub(1) {
                let steps = [key - 1, key].map(|i| track.times[i + 1] - track.times[i]);
                let at_keys = [
                    curve.segment_velocity(key - 1, 0.0),
                    curve.segment_velocity(key, 0.0),
                    curve.segment_velocity(key, 1.0),
                ];
                let speeds = at_keys.map(DVec3::length);
                let fastest = speeds.into_iter().fold(0.0, f64::max);
                // Differences follow a few turns in an interval, not thousands.
                let largest_angle =
                    (speeds[0].max(speeds[1]) * steps[0]).max(speeds[1].max(speeds[2]) * steps[1]);
                if largest_angle > 20.0 {
                    continue;
                }
                seen += 1;
                let sides = [
                    curve.segment_acceleration(key - 1, 1.0),
                    curve.segment_acceleration(key, 0.0),
                ];
                let size =
                    (fastest + 3.0 / steps[0] + 3.0 / steps[1]) * (1.0 / steps[0] + 1.0 / steps[1]);
                jumps += usize::from((sides[1] - sides[0]).length() > 1e-7 * size);
            }
            let warned = of_tracks[index];
            assert!(
                jumps <= warned,
                "seed {seed}, track {index}: {jumps} jumps, {warned} in the warning"
            );
            counted += warned;
        }
    }
    println!("{seen} keys seen, the acceleration jumps at {counted}");
    assert!(counted > 0 && seen > 10_000, "{counted}, {seen}");
}

/// After steps of nearly 360°, only the keys next to them lose the continuous acceleration.
#[test]
fn long_steps_cost_other_keys_nothing() {
    let mut random = Random(8);
    let mut rotations = walk(&mut random, |_| 0.1, 3000);
    for index in (1300..1340).step_by(2) {
        rotations[index] = -rotations[index];
    }
    let even: Vec<f64> = (0..3000).map(f64::from).collect();
    let interpolation = Interpolation::from(method::C2).with_signs(KeySigns::AsAuthored);
    let found = interpolation.warnings(&one(&even, &rotations));
    let [InterpolationWarning::AccelerationJumps { key, count, .. }] = *found else {
        panic!("{found:?}");
    };
    assert_eq!((key, count), (1299, 41));
}
