//! The reference against the textbook: what must hold of these curves whatever the
//! keys. The engine is measured against the reference in `accuracy.rs`.

mod support;

use std::f64::consts::TAU;

use glam::{DQuat, DVec3, Quat};
use proptest::prelude::*;
use support::Random;
use tumble::reference::{
    Curve, Kind, angle_between, slerp, slerp_from_end, slerp_from_end_left, slerp_from_start,
    slerp_from_start_left,
};
use tumble::{Ends, Path};

const KINDS: [Kind; 4] = [
    Kind::Slerp,
    Kind::CatmullRom,
    Kind::BesselOverhauser,
    Kind::BSpline,
];
const THROUGH_KEYS: [Kind; 3] = [Kind::Slerp, Kind::CatmullRom, Kind::BesselOverhauser];

fn curve(kind: Kind, ends: Ends, times: &[f64], keys: &[Quat]) -> Curve {
    Curve::new(kind, Path::Shortest, ends, times, keys)
}

/// `count` keys, each up to `step` radians from the one before.
fn random_keys(random: &mut Random, count: usize, step: f64) -> Vec<Quat> {
    let mut rotation = random.rotation();
    (0..count)
        .map(|_| {
            let turn = DQuat::from_axis_angle(random.direction(), random.between(0.0, step));
            rotation = (rotation * turn).normalize();
            rotation.as_quat()
        })
        .collect()
}

fn even_times(count: usize) -> Vec<f64> {
    (0..count).map(|i| 0.8 * i as f64).collect()
}

fn uneven_times(random: &mut Random, count: usize) -> Vec<f64> {
    let mut time = random.between(-5.0, 5.0);
    (0..count)
        .map(|_| {
            time += random.between(0.4, 1.6);
            time
        })
        .collect()
}

/// Samples over the whole of a curve, not on keys.
fn samples(times: &[f64]) -> impl Iterator<Item = f64> {
    let (first, last) = (times[0], times[times.len() - 1]);
    (0..=200).map(move |i| first + (last - first) * f64::from(i) / 200.0)
}

fn unit_quaternion() -> impl Strategy<Value = DQuat> {
    any::<u64>().prop_map(|seed| Random(seed).rotation())
}

proptest! {
    /// Four algebraic forms and the geometric one: a wrong order of factors shows.
    #[test]
    fn the_five_forms_of_slerp_agree(a in unit_quaternion(), b in unit_quaternion(), t in 0.0..=1.0f64) {
        let b = if a.dot(b) < 0.0 { -b } else { b };
        let geometric = slerp(a, b, t);
        for form in [slerp_from_start, slerp_from_start_left, slerp_from_end, slerp_from_end_left] {
            prop_assert!((form(a, b, t) - geometric).length() < 1e-13);
        }
    }

    #[test]
    fn slerp_is_symmetric_bisects_and_has_constant_speed(a in unit_quaternion(), b in unit_quaternion(), t in 0.0..=1.0f64) {
        let b = if a.dot(b) < 0.0 { -b } else { b };
        prop_assert!((slerp(a, b, t) - slerp(b, a, 1.0 - t)).length() < 1e-14);
        prop_assert!((slerp(a, b, 0.5) - (a + b).normalize()).length() < 1e-14);
        let whole = angle_between(a, b);
        prop_assert!((angle_between(a, slerp(a, b, t)) - whole * t).abs() < 1e-14 * 20.0);
    }
}

/// `p_{k+1} = 2 cos(δ) p_k - p_{k-1}` is exact on paper; its rounding grows with the
/// square of the number of steps, which is why nothing here uses it.
#[test]
fn the_recurrence_for_equal_steps_decays_where_slerp_does_not() {
    let (a, b) = (DQuat::IDENTITY, DQuat::from_rotation_x(1.0));
    let error_after = |steps: usize| {
        let delta = 0.5 / steps as f64;
        let (mut before, mut now) = (a, slerp(a, b, 1.0 / steps as f64));
        for _ in 1..steps {
            (before, now) = (now, now * (2.0 * delta.cos()) - before);
        }
        (now - b).length()
    };
    let (short, long) = (error_after(1_000), error_after(1_000_000));
    assert!(
        long > 1e4 * short.max(1e-16) || long > 1e-7,
        "{short:e} {long:e}"
    );
    assert!((slerp(a, b, 1.0) - b).length() < 1e-15);
}

#[test]
fn keys_are_met_with_all_ends() {
    let mut random = Random(1);
    let spin = DVec3::new(1.0, 2.0, -0.5);
    for _ in 0..20 {
        let keys = random_keys(&mut random, 9, 2.5);
        let times = uneven_times(&mut random, 9);
        for kind in THROUGH_KEYS {
            for ends in [
                Ends::Parabolic,
                Ends::Natural,
                Ends::Clamped {
                    start: spin,
                    end: spin,
                },
                Ends::Frozen,
            ] {
                let curve = curve(kind, ends, &times, &keys);
                for (&time, key) in times.iter().zip(&keys) {
                    assert!(angle_between(curve.rotation(time), key.as_dquat()) < 1e-13);
                }
            }
        }
    }
}

#[test]
fn velocity_is_the_derivative_of_the_rotation() {
    let mut random = Random(2);
    let keys = random_keys(&mut random, 8, 2.0);
    let times = uneven_times(&mut random, 8);
    let h = 1e-5;
    for kind in KINDS {
        let curve = curve(kind, Ends::Natural, &times, &keys);
        for time in samples(&times).skip(1).take(198) {
            // Not across a key, where acceleration jumps.
            if times.iter().any(|key| (key - time).abs() < 2.0 * h) {
                continue;
            }
            let (before, after) = (curve.rotation(time - h), curve.rotation(time + h));
            let turn = before.inverse() * after;
            let numeric = DVec3::new(turn.x, turn.y, turn.z) * turn.w.signum() / h;
            let exact = curve.velocity(time);
            assert!(
                (numeric - exact).length() < 1e-6,
                "{kind:?} at {time}: {numeric} {exact}"
            );
        }
    }
}

/// The velocities on both sides of each inner key.
fn velocity_jumps(curve: &Curve, segments: usize) -> f64 {
    (1..segments)
        .map(|i| (curve.segment_velocity(i, 0.0) - curve.segment_velocity(i - 1, 1.0)).length())
        .fold(0.0, f64::max)
}

#[test]
fn velocity_is_continuous_where_it_is_promised() {
    let mut random = Random(3);
    for _ in 0..20 {
        let keys = random_keys(&mut random, 10, 2.0);
        let (even, uneven) = (even_times(10), uneven_times(&mut random, 10));
        let jumps =
            |kind, times: &[f64]| velocity_jumps(&curve(kind, Ends::Parabolic, times, &keys), 9);
        assert!(jumps(Kind::BesselOverhauser, &uneven) < 1e-12);
        assert!(jumps(Kind::BesselOverhauser, &even) < 1e-12);
        assert!(jumps(Kind::CatmullRom, &even) < 1e-12);
        assert!(jumps(Kind::BSpline, &even) < 1e-12);
        // Documented: Catmull-Rom ignores time.
        assert!(jumps(Kind::CatmullRom, &uneven) > 0.05);
    }
}

#[test]
fn the_b_spline_has_continuous_angular_acceleration() {
    let mut random = Random(4);
    let keys = random_keys(&mut random, 10, 2.0);
    let times = even_times(10);
    let curve = curve(Kind::BSpline, Ends::Natural, &times, &keys);
    let h = 1e-4;
    for i in 1..9 {
        let slope = |segment: usize, a: f64, b: f64| {
            (curve.segment_velocity(segment, b) - curve.segment_velocity(segment, a)) / (b - a)
        };
        // Three-point differences on either side of the key.
        let left = 2.0 * slope(i - 1, 1.0 - h, 1.0) - slope(i - 1, 1.0 - 2.0 * h, 1.0);
        let right = 2.0 * slope(i, 0.0, h) - slope(i, 0.0, 2.0 * h);
        assert!((left - right).length() < 1e-5, "key {i}: {left} {right}");
    }
}

#[test]
fn bessel_overhauser_equals_catmull_rom_on_uniform_keys() {
    let mut random = Random(5);
    for _ in 0..50 {
        let keys = random_keys(&mut random, 8, 3.0);
        let times = even_times(8);
        for ends in [Ends::Parabolic, Ends::Natural] {
            let a = curve(Kind::BesselOverhauser, ends, &times, &keys);
            let b = curve(Kind::CatmullRom, ends, &times, &keys);
            for time in samples(&times) {
                assert!(angle_between(a.rotation(time), b.rotation(time)) < 1e-12);
            }
        }
    }
}

#[test]
fn constant_velocity_keys_give_constant_velocity_to_the_very_ends() {
    let mut random = Random(6);
    let (axis, rate) = (random.direction(), 1.3);
    let uneven = uneven_times(&mut random, 9);
    let cases = [
        (Kind::Slerp, uneven.clone()),
        (Kind::BesselOverhauser, uneven),
        (Kind::CatmullRom, even_times(9)),
        (Kind::BSpline, even_times(9)),
    ];
    for (kind, times) in cases {
        let key = |time: &f64| DQuat::from_axis_angle(axis, rate * time).as_quat();
        let keys: Vec<Quat> = times.iter().map(key).collect();
        let curve = curve(kind, Ends::Parabolic, &times, &keys);
        for time in samples(&times) {
            // Keys are f32.
            let off = (curve.velocity(time) - axis * rate).length();
            assert!(off < 2e-6, "{kind:?} at {time}: {off:e}");
        }
    }
}

/// Multiplying by `i` only swaps and negates components: exact, also in f32.
#[test]
fn turning_all_keys_turns_every_sample() {
    let mut random = Random(7);
    let keys = random_keys(&mut random, 8, 2.0);
    let times = uneven_times(&mut random, 8);
    let turn = Quat::from_xyzw(1.0, 0.0, 0.0, 0.0);
    let exact = turn.as_dquat();
    for kind in KINDS {
        let own = curve(kind, Ends::Parabolic, &times, &keys);
        let left: Vec<Quat> = keys.iter().map(|&key| turn * key).collect();
        let right: Vec<Quat> = keys.iter().map(|&key| key * turn).collect();
        let left = curve(kind, Ends::Parabolic, &times, &left);
        let right = curve(kind, Ends::Parabolic, &times, &right);
        for time in samples(&times) {
            let rotation = own.rotation(time);
            assert!(
                angle_between(left.rotation(time), exact * rotation) < 1e-13,
                "{kind:?}"
            );
            assert!(
                angle_between(right.rotation(time), rotation * exact) < 1e-13,
                "{kind:?}"
            );
        }
    }
}

#[test]
fn the_signs_of_keys_do_not_matter_on_the_shortest_path() {
    let mut random = Random(8);
    for _ in 0..20 {
        let keys = random_keys(&mut random, 9, 2.5);
        let times = uneven_times(&mut random, 9);
        let flip = |&key: &Quat| {
            if random.next().is_multiple_of(2) {
                -key
            } else {
                key
            }
        };
        let flipped: Vec<Quat> = keys.iter().map(flip).collect();
        for kind in KINDS {
            let a = curve(kind, Ends::Parabolic, &times, &keys);
            let b = curve(kind, Ends::Parabolic, &times, &flipped);
            for time in samples(&times) {
                assert!(
                    angle_between(a.rotation(time), b.rotation(time)) < 1e-14,
                    "{kind:?}"
                );
            }
        }
    }
}

#[test]
fn slerp_reversed_in_time_is_the_same_slerp() {
    let mut random = Random(9);
    let keys = random_keys(&mut random, 9, 3.0);
    let times = uneven_times(&mut random, 9);
    let backwards: Vec<f64> = times.iter().rev().map(|time| -time).collect();
    let reversed: Vec<Quat> = keys.iter().rev().copied().collect();
    let a = curve(Kind::Slerp, Ends::Parabolic, &times, &keys);
    let b = curve(Kind::Slerp, Ends::Parabolic, &backwards, &reversed);
    for time in samples(&times) {
        assert!(angle_between(a.rotation(time), b.rotation(-time)) < 1e-13);
    }
}

/// Trap: a short fast step before a long one. The tangent's logarithm is longer than
/// pi; on its principal branch the curve would first run backwards, although every
/// key is met and the velocity continuous.
#[test]
fn a_tangent_longer_than_pi_points_forwards() {
    let step = 1.0; // half-angles of 0.5 about x, at growing intervals
    let key = |i: i32| Quat::from_rotation_x((step * f64::from(i)) as f32);
    let keys: Vec<Quat> = (0..4).map(key).collect();
    let times = [0.0, 0.1, 0.9, 1.7];
    let curve = curve(Kind::BesselOverhauser, Ends::Parabolic, &times, &keys);
    // L = 8 · 0.5, R = 0.5 / 8: their sum is 4.06, longer than pi.
    let expected = 2.0 * (8.0 * 0.5 + 0.5 / 8.0) / 0.9;
    let found = curve.velocity(0.1);
    assert!((found - DVec3::X * expected).length() < 1e-5, "{found}");
    // The principal branch lies a whole turn of 2 pi below.
    let wrapped = expected - 2.0 * TAU / 0.9;
    assert!(wrapped < -4.0, "the case must wrap: {wrapped}");
    // By how much that would show: the handle's difference, midway.
    let difference = (expected - wrapped) * 0.8 / 3.0 * 0.375;
    assert!(difference.to_degrees() > 30.0, "{difference}");
}

#[test]
fn natural_ends_have_no_angular_acceleration() {
    let mut random = Random(10);
    let keys = random_keys(&mut random, 6, 1.5);
    let times = uneven_times(&mut random, 6);
    for kind in [Kind::CatmullRom, Kind::BesselOverhauser] {
        let natural = curve(kind, Ends::Natural, &times, &keys);
        let h = 1e-6;
        let at_start = (natural.segment_velocity(0, h) - natural.segment_velocity(0, 0.0)) / h;
        let at_end = (natural.segment_velocity(4, 1.0) - natural.segment_velocity(4, 1.0 - h)) / h;
        assert!(
            at_start.length() < 1e-4 && at_end.length() < 1e-4,
            "{at_start} {at_end}"
        );
    }
}

#[test]
fn clamped_ends_have_the_velocities_given() {
    let mut random = Random(11);
    let keys = random_keys(&mut random, 6, 1.5);
    let (start, end) = (DVec3::new(0.5, -1.0, 2.0), DVec3::new(-0.25, 0.0, 1.0));
    let ends = Ends::Clamped { start, end };
    for (kind, times) in [
        (Kind::CatmullRom, uneven_times(&mut random, 6)),
        (Kind::BesselOverhauser, uneven_times(&mut random, 6)),
        (Kind::BSpline, even_times(6)),
    ] {
        let clamped = curve(kind, ends, &times, &keys);
        assert!(
            (clamped.segment_velocity(0, 0.0) - start).length() < 1e-12,
            "{kind:?}"
        );
        assert!(
            (clamped.segment_velocity(4, 1.0) - end).length() < 1e-12,
            "{kind:?}"
        );
    }
}

#[test]
fn loops_are_smooth_across_the_seam() {
    let mut random = Random(12);
    for _ in 0..20 {
        let mut keys = random_keys(&mut random, 8, 1.5);
        keys[7] = if random.next().is_multiple_of(2) {
            keys[0]
        } else {
            -keys[0]
        };
        for (kind, times) in [
            (Kind::BesselOverhauser, uneven_times(&mut random, 8)),
            (Kind::CatmullRom, even_times(8)),
            (Kind::BSpline, even_times(8)),
        ] {
            let closed = curve(kind, Ends::Loop, &times, &keys);
            let (end, start) = (
                closed.segment_velocity(6, 1.0),
                closed.segment_velocity(0, 0.0),
            );
            assert!((end - start).length() < 1e-6, "{kind:?}: {end} {start}");
            let gap = angle_between(closed.rotation(times[7]), closed.rotation(times[0]));
            assert!(gap < 1e-6, "{kind:?}: {gap}");
        }
    }
}

#[test]
fn frozen_ends_stand_still_like_the_original() {
    let mut random = Random(13);
    let keys = random_keys(&mut random, 6, 1.5);
    let times = even_times(6);
    for kind in [Kind::CatmullRom, Kind::BesselOverhauser, Kind::BSpline] {
        let frozen = curve(kind, Ends::Frozen, &times, &keys);
        let at =
            |time, key: usize| angle_between(frozen.rotation(time), keys[key].as_dquat()) < 1e-14;
        assert!(
            at(0.0, 0) && at(0.79, 0) && at(3.3, 4) && at(3.99, 4) && at(4.0, 5),
            "{kind:?}"
        );
        assert_eq!(frozen.velocity(0.3), DVec3::ZERO);
    }
}

#[test]
fn two_keys_are_joined_by_slerp_and_one_stands_still() {
    let mut random = Random(14);
    let keys = random_keys(&mut random, 2, 3.0);
    let times = [1.0, 2.5];
    for kind in KINDS {
        for ends in [Ends::Parabolic, Ends::Natural, Ends::Frozen] {
            let two = curve(kind, ends, &times, &keys);
            let middle = slerp(keys[0].as_dquat(), keys[1].as_dquat(), 0.5);
            let sign = if keys[0].dot(keys[1]) < 0.0 {
                None
            } else {
                Some(middle)
            };
            if let Some(middle) = sign {
                assert!(angle_between(two.rotation(1.75), middle) < 1e-7, "{kind:?}");
            }
            let one = curve(kind, ends, &times[..1], &keys[..1]);
            assert_eq!(one.rotation(9.0), one.rotation(-9.0));
        }
    }
}
