//! The reference against the textbook: properties of these curves for all keys.
//! The engine is measured against the reference in `accuracy.rs`.

use std::f64::consts::TAU;

use crate::support::Random;
use glam::{DQuat, DVec3, Quat};
use proptest::prelude::*;
use tumble::reference::{
    ReferenceCurve, angle_between, slerp, slerp_from_end, slerp_from_end_left, slerp_from_start,
    slerp_from_start_left,
};
use tumble::{
    Ends, KeySigns, METHODS, Method,
    method::{self, Continuity, Keys},
};

/// Every method except those whose curves jump.
fn moving() -> impl Iterator<Item = Method> {
    METHODS.into_iter().filter(|&method| method != method::STEP)
}

/// Methods that follow from the keys alone, also at the ends.
fn free() -> impl Iterator<Item = Method> {
    let with_tangents = [method::HERMITE, method::GLTF_CUBIC];
    moving().filter(move |method| !with_tangents.contains(method))
}

fn curve(method: Method, ends: Ends, times: &[f64], keys: &[Quat]) -> ReferenceCurve {
    ReferenceCurve::new(method.reference(), KeySigns::Shortest, ends, times, keys)
}

/// `count` keys, each up to `step` radians from the one before.
fn random_keys(random: &mut Random, count: usize, step: f64) -> Vec<Quat> {
    let mut rotation = random.rotation();
    (0..count)
        .map(|_| {
            let rotation_step =
                DQuat::from_axis_angle(random.direction(), random.between(0.0, step));
            rotation = (rotation * rotation_step).normalize();
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
    /// Four algebraic forms and the geometric one: they would differ if the order of factors were
    /// wrong.
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
        for method in METHODS.into_iter().filter(|m| m.interpolates) {
            for ends in [
                Ends::Parabolic,
                Ends::Natural,
                Ends::Clamped {
                    start: spin,
                    end: spin,
                },
                Ends::Frozen,
            ] {
                let curve = curve(method, ends, &times, &keys);
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
    for method in moving() {
        let curve = curve(method, Ends::Natural, &times, &keys);
        for time in samples(&times).skip(1).take(198) {
            // The difference is not taken across a key, where the acceleration jumps.
            if times.iter().any(|key| (key - time).abs() < 2.0 * h) {
                continue;
            }
            let (before, after) = (curve.rotation(time - h), curve.rotation(time + h));
            let difference = before.inverse() * after;
            let numeric =
                DVec3::new(difference.x, difference.y, difference.z) * difference.w.signum() / h;
            let exact = curve.velocity(time);
            assert!(
                (numeric - exact).length() < 1e-6,
                "{method:?} at {time}: {numeric} {exact}"
            );
        }
    }
}

/// The velocities on both sides of each inner key.
fn velocity_jumps(curve: &ReferenceCurve, segments: usize) -> f64 {
    (1..segments)
        .map(|i| (curve.segment_velocity(i, 0.0) - curve.segment_velocity(i - 1, 1.0)).length())
        .fold(0.0, f64::max)
}

/// The same for angular accelerations.
fn acceleration_jumps(curve: &ReferenceCurve, segments: usize) -> f64 {
    (1..segments)
        .map(|i| {
            let before = curve.segment_acceleration(i - 1, 1.0);
            (curve.segment_acceleration(i, 0.0) - before).length()
        })
        .fold(0.0, f64::max)
}

/// Also checks that a method is not smoother than stated.
#[test]
fn continuity_is_what_is_promised() {
    let mut random = Random(3);
    let (even, uneven) = (even_times(10), uneven_times(&mut random, 10));
    for method in moving() {
        for (times, promised) in [
            (&uneven, method.continuity),
            (&even, method.continuity_on_even_keys),
        ] {
            let (mut velocity, mut acceleration) = (0.0f64, 0.0f64);
            for _ in 0..20 {
                let keys = random_keys(&mut random, 10, 2.0);
                let curve = curve(method, method.ends, times, &keys);
                velocity = velocity.max(velocity_jumps(&curve, 9));
                acceleration = acceleration.max(acceleration_jumps(&curve, 9));
            }
            let found = match (velocity < 1e-9, acceleration < 1e-6) {
                (true, true) => Continuity::C2,
                (true, false) => Continuity::C1,
                _ => Continuity::C0,
            };
            let label = format!("{method}: {velocity:e} {acceleration:e}");
            assert_eq!(found, promised, "{label}");
            assert!(found >= Continuity::C1 || velocity > 0.01, "{label}");
        }
    }
}

#[test]
fn bessel_overhauser_equals_catmull_rom_on_uniform_keys() {
    let mut random = Random(5);
    for _ in 0..50 {
        let keys = random_keys(&mut random, 8, 3.0);
        let times = even_times(8);
        for ends in [Ends::Parabolic, Ends::Natural] {
            let a = curve(method::BESSEL_OVERHAUSER, ends, &times, &keys);
            let b = curve(method::CATMULL_ROM, ends, &times, &keys);
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
    let (even, uneven) = (even_times(9), uneven_times(&mut random, 9));
    for method in moving() {
        for (times, kept) in [
            (&uneven, method.keeps_constant_velocity == Keys::Any),
            (&even, method.keeps_constant_velocity != Keys::Never),
        ] {
            let key = |time: &f64| DQuat::from_axis_angle(axis, rate * time).as_quat();
            let keys: Vec<Quat> = times.iter().map(key).collect();
            let curve = curve(method, method.ends, times, &keys);
            let off = samples(times)
                .map(|time| (curve.velocity(time) - axis * rate).length())
                .fold(0.0, f64::max);
            // Keys are f32.
            assert!(
                if kept { off < 4e-6 } else { off > 1e-3 },
                "{method}: {off:e}"
            );
        }
    }
}

/// Multiplying by `i` only swaps and negates components: exact, also in f32.
#[test]
fn turning_all_keys_turns_every_sample() {
    let mut random = Random(7);
    let keys = random_keys(&mut random, 8, 2.0);
    let times = uneven_times(&mut random, 8);
    let factor = Quat::from_xyzw(1.0, 0.0, 0.0, 0.0);
    let exact = factor.as_dquat();
    for method in moving() {
        let plain = curve(method, Ends::Parabolic, &times, &keys);
        let left: Vec<Quat> = keys.iter().map(|&key| factor * key).collect();
        let right: Vec<Quat> = keys.iter().map(|&key| key * factor).collect();
        let left = curve(method, Ends::Parabolic, &times, &left);
        let right = curve(method, Ends::Parabolic, &times, &right);
        for time in samples(&times) {
            let rotation = plain.rotation(time);
            assert!(
                angle_between(left.rotation(time), exact * rotation) < 1e-13,
                "{method:?}"
            );
            assert!(
                angle_between(right.rotation(time), rotation * exact) < 1e-13,
                "{method:?}"
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
        for method in moving() {
            let a = curve(method, Ends::Parabolic, &times, &keys);
            let b = curve(method, Ends::Parabolic, &times, &flipped);
            for time in samples(&times) {
                assert!(
                    angle_between(a.rotation(time), b.rotation(time)) < 1e-14,
                    "{method:?}"
                );
            }
        }
    }
}

#[test]
fn a_symmetric_method_takes_the_same_way_backwards() {
    let mut random = Random(9);
    for method in free() {
        let mut off = 0.0f64;
        for _ in 0..20 {
            let keys = random_keys(&mut random, 9, 2.5);
            let times = uneven_times(&mut random, 9);
            let backwards: Vec<f64> = times.iter().rev().map(|time| -time).collect();
            let reversed: Vec<Quat> = keys.iter().rev().copied().collect();
            let a = curve(method, method.ends, &times, &keys);
            let b = curve(method, method.ends, &backwards, &reversed);
            for time in samples(&times) {
                off = off.max(angle_between(a.rotation(time), b.rotation(-time)));
            }
        }
        let same = if method.symmetric {
            off < 1e-11
        } else {
            off > 1e-3
        };
        assert!(same, "{method}: {off:e}");
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
    let curve = curve(method::BESSEL_OVERHAUSER, Ends::Parabolic, &times, &keys);
    // L = 8 · 0.5, R = 0.5 / 8: their sum is 4.06, longer than pi.
    let expected = 2.0 * (8.0 * 0.5 + 0.5 / 8.0) / 0.9;
    let found = curve.velocity(0.1);
    assert!((found - DVec3::X * expected).length() < 1e-5, "{found}");
    // The principal branch lies a whole turn of 2 pi below.
    let wrapped = expected - 2.0 * TAU / 0.9;
    assert!(wrapped < -4.0, "the case must wrap: {wrapped}");
    // The effect of a wrong branch: the difference of the handles, at the middle of the interval.
    let difference = (expected - wrapped) * 0.8 / 3.0 * 0.375;
    assert!(difference.to_degrees() > 30.0, "{difference}");
}

/// A squad's natural ends are so in flat space only: on the sphere there is no closed form.
#[test]
fn natural_ends_have_no_angular_acceleration() {
    let mut random = Random(10);
    for method in with_ends().filter(|&method| method != method::SQUAD) {
        let keys = random_keys(&mut random, 6, 1.5);
        let times = uneven_times(&mut random, 6);
        let natural = curve(method, Ends::Natural, &times, &keys);
        let ends = [(0, 0.0), (4, 1.0)].map(|(i, t)| natural.segment_acceleration(i, t).length());
        assert!(ends[0] < 1e-8 && ends[1] < 1e-8, "{method}: {ends:?}");
    }
}

/// Methods that have boundary conditions.
fn with_ends() -> impl Iterator<Item = Method> {
    METHODS.into_iter().filter(|method| method.uses_neighbours)
}

#[test]
fn clamped_ends_have_the_velocities_given() {
    let mut random = Random(11);
    let (start, end) = (DVec3::new(0.5, -1.0, 2.0), DVec3::new(-0.25, 0.0, 1.0));
    for method in with_ends() {
        let keys = random_keys(&mut random, 6, 1.5);
        let times = uneven_times(&mut random, 6);
        let clamped = curve(method, Ends::Clamped { start, end }, &times, &keys);
        let off = [
            clamped.segment_velocity(0, 0.0) - start,
            clamped.segment_velocity(4, 1.0) - end,
        ];
        assert!(
            off[0].length() < 1e-11 && off[1].length() < 1e-11,
            "{method}: {off:?}"
        );
        let secant = curve(method, Ends::Secant, &times, &keys);
        let slerp = curve(method::SLERP, Ends::Secant, &times, &keys);
        for (i, t) in [(0, 0.0), (4, 1.0)] {
            let off = secant.segment_velocity(i, t) - slerp.segment_velocity(i, t);
            assert!(off.length() < 1e-11, "{method}: {off}");
        }
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
        for method in with_ends() {
            let times = match method.continuity {
                Continuity::C0 => even_times(8),
                _ => uneven_times(&mut random, 8),
            };
            let closed = curve(method, Ends::Loop, &times, &keys);
            let (end, start) = (
                closed.segment_velocity(6, 1.0),
                closed.segment_velocity(0, 0.0),
            );
            assert!((end - start).length() < 2e-6, "{method}: {end} {start}");
            let gap = angle_between(closed.rotation(times[7]), closed.rotation(times[0]));
            assert!(gap < 1e-6, "{method}: {gap}");
            if method.continuity == Continuity::C2 {
                let end = closed.segment_acceleration(6, 1.0);
                let off = (closed.segment_acceleration(0, 0.0) - end).length();
                assert!(off < 1e-4, "{method}: {off:e}");
            }
        }
    }
}

#[test]
fn frozen_ends_stand_still_like_the_original() {
    let mut random = Random(13);
    let keys = random_keys(&mut random, 6, 1.5);
    let times = even_times(6);
    for method in [
        method::CATMULL_ROM,
        method::BESSEL_OVERHAUSER,
        method::B_SPLINE,
    ] {
        let frozen = curve(method, Ends::Frozen, &times, &keys);
        let at =
            |time, key: usize| angle_between(frozen.rotation(time), keys[key].as_dquat()) < 1e-14;
        assert!(
            at(0.0, 0) && at(0.79, 0) && at(3.3, 4) && at(3.99, 4) && at(4.0, 5),
            "{method:?}"
        );
        assert_eq!(frozen.velocity(0.3), DVec3::ZERO);
    }
}

#[test]
fn two_keys_are_joined_by_slerp_and_one_stands_still() {
    let mut random = Random(14);
    let keys = random_keys(&mut random, 2, 3.0);
    let times = [1.0, 2.5];
    for method in moving() {
        for ends in [Ends::Parabolic, Ends::Natural, Ends::Frozen] {
            let two = curve(method, ends, &times, &keys);
            let middle = slerp(keys[0].as_dquat(), keys[1].as_dquat(), 0.5);
            let sign = if keys[0].dot(keys[1]) < 0.0 {
                None
            } else {
                Some(middle)
            };
            if let Some(middle) = sign {
                assert!(
                    angle_between(two.rotation(1.75), middle) < 1e-7,
                    "{method:?}"
                );
            }
            let one = curve(method, ends, &times[..1], &keys[..1]);
            assert_eq!(one.rotation(9.0), one.rotation(-9.0));
        }
    }
}
