//! Numbers that other projects' tests expect. Only numbers are taken; each names
//! where it comes from. Quaternions are written `w x y z`.
#![allow(clippy::approx_constant)] // theirs have fewer digits

use glam::{DQuat, DVec3, Quat};
use tumble::reference::{ReferenceCurve, angle_between, nlerp, slerp, squad};
use tumble::verify::{Verdict, verify};
use tumble::{
    Axes, Device, Ends, Engine, Interpolation, KeySigns, Layout, Method, Quantity, SampleTimes,
    TrackSet, method,
};

fn q(wxyz: [f64; 4]) -> DQuat {
    DQuat::from_xyzw(wxyz[1], wxyz[2], wxyz[3], wxyz[0])
}

fn about(axis: [f64; 3], degrees: f64) -> DQuat {
    DQuat::from_axis_angle(DVec3::from_array(axis).normalize(), degrees.to_radians())
}

fn assert_near(found: DQuat, expected: [f64; 4], tolerance: f64) {
    let expected = q(expected);
    let off = (found - expected).length();
    assert!(off <= tolerance, "{found} is not {expected}: {off:e}");
}

/// The engine's slerp over keys in f32, at any times.
fn engine_slerp(path: KeySigns, times: &[f64], keys: &[DQuat], at: &[f64]) -> Vec<DQuat> {
    let mut set = TrackSet::new();
    let keys: Vec<Quat> = keys.iter().map(|key| key.as_quat()).collect();
    set.push("", times, &keys).unwrap();
    let interpolation = Interpolation::from(method::SLERP).with_signs(path);
    let engine = Engine::new(Device::Cpu).unwrap();
    let rotations = engine
        .evaluate(&set, interpolation, &SampleTimes::at(at.to_vec()))
        .unwrap();
    rotations.as_quats().iter().map(|q| q.as_dquat()).collect()
}

/// mosra/magnum, src/Magnum/Math/Test/QuaternionTest.cpp (MIT).
#[test]
fn magnum_slerp_and_lerp() {
    let (a, b) = (about([1.0; 3], 15.0), about([1.0, 0.0, 0.0], 23.0));
    let expected = [0.9904423, 0.1191653, 0.0491109, 0.0491109];
    assert_near(slerp(a, b, 0.35), expected, 1e-5);
    assert_near(
        nlerp(a, b, 0.35),
        [0.990445, 0.119127, 0.049134, 0.049134],
        1e-5,
    );
    let engine = engine_slerp(KeySigns::Shortest, &[0.0, 1.0], &[a, b], &[0.35]);
    assert_near(engine[0], expected, 1e-5);
}

/// mosra/magnum, the same file (MIT). Its shortest path negates the first key, ours
/// the second, so the sign of its result is the opposite of ours.
#[test]
fn magnum_long_and_short_path() {
    let (a, b) = (about([0.0, 0.0, 1.0], 0.0), about([0.0, 0.0, 1.0], 225.0));
    let (long, short) = (
        [0.881921, 0.0, 0.0, 0.471397],
        [0.95694, 0.0, 0.0, -0.290285],
    );
    assert_near(slerp(a, b, 0.25), long, 1e-5);
    assert_near(slerp(a, -b, 0.25), short, 1e-5);
    assert_near(nlerp(a, b, 0.25), [0.942977, 0.0, 0.0, 0.332859], 1e-5);
    assert_near(nlerp(a, -b, 0.25), [0.964667, 0.0, 0.0, -0.26347], 1e-5);
    let times = [0.0, 1.0];
    assert_near(
        engine_slerp(KeySigns::AsAuthored, &times, &[a, b], &[0.25])[0],
        long,
        1e-5,
    );
    assert_near(
        engine_slerp(KeySigns::Shortest, &times, &[a, b], &[0.25])[0],
        short,
        1e-5,
    );
}

/// mosra/magnum-plugins, src/MagnumPlugins/GltfImporter/Test, animation-patching (MIT):
/// rotations about z by 45° a key, some stored with the other sign.
#[test]
fn magnum_shortest_path_patching() {
    let keys = [
        [-0.382683, 0.0, 0.0, 0.92388],
        [-0.707107, 0.0, 0.0, 0.707107],
        [-0.92388, 0.0, 0.0, 0.382683],
        [-1.0, 0.0, 0.0, 0.0],
        [0.92388, 0.0, 0.0, 0.382683],
        [0.707107, 0.0, 0.0, 0.707107],
        [-0.382683, 0.0, 0.0, -0.92388],
        [0.0, 0.0, 0.0, -1.0],
        [-0.382683, 0.0, 0.0, 0.92388],
    ]
    .map(q);
    let times: Vec<f64> = (0..9).map(f64::from).collect();
    let between: Vec<f64> = (0..8).map(|i| f64::from(i) + 0.5).collect();
    let short = [247.5, 292.5, 337.5, 22.5, 67.5, 112.5, 157.5, 202.5];
    let raw = [247.5, 292.5, 337.5, 202.5, 67.5, -67.5, -202.5, -337.5];
    for (path, expected) in [(KeySigns::Shortest, short), (KeySigns::AsAuthored, raw)] {
        let found = engine_slerp(path, &times, &keys, &between);
        for (rotation, degrees) in found.into_iter().zip(expected) {
            let off = angle_between(rotation, about([0.0, 0.0, 1.0], degrees));
            assert!(
                off.to_degrees() < 1e-3,
                "{path:?}: {rotation} at {degrees}°"
            );
        }
    }
}

/// mrdoob/three.js, test/unit/src/math/Quaternion.tests.js (MIT).
#[test]
fn three_js_slerp() {
    let a = q([
        0.5185120064806223,
        0.6753410084407496,
        0.4087830051091744,
        0.32856700410659473,
    ]);
    let b = q([
        0.5001871596632682,
        0.6602792107657797,
        0.43647413932562285,
        0.35119011210236006,
    ]);
    assert!((slerp(a, b, 0.0) - a).length() < 2.3e-16);
    assert!((slerp(a, b, 1.0) - b).length() < 2.3e-16);
    let middle = slerp(a, b, 0.5);
    assert!((middle.dot(a) - middle.dot(b)).abs() <= 2.3e-16);
    for t in [0.25, 0.5, 0.75] {
        assert!((slerp(a, b, t).length() - 1.0).abs() <= 2.3e-16);
    }
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let (x, z) = (q([0.0, 1.0, 0.0, 0.0]), q([0.0, 0.0, 0.0, 1.0]));
    assert_near(slerp(x, z, 0.5), [0.0, half, 0.0, half], 1e-15);
    let (left, right) = (q([half, 0.0, half, 0.0]), q([half, 0.0, -half, 0.0]));
    assert_near(slerp(left, right, 0.5), [1.0, 0.0, 0.0, 0.0], 1e-15);
}

/// rustgd/cgmath issue 498: nearly opposite quaternions.
#[test]
fn cgmath_nearly_opposite_keys() {
    let a = q([0.00052311074, 0.9999999, 0.00014682197, -1.6342687e-05]);
    let b = q([0.019973433, -0.99980056, -0.00015678025, 1.3882192e-05]);
    let expected = [
        -0.009725671261548996,
        0.9999527335166931,
        0.00015180908667389303,
        -1.5113232620933559e-05,
    ];
    assert_near(slerp(a, -b, 0.5), expected, 2e-6);
    let engine = engine_slerp(KeySigns::Shortest, &[0.0, 1.0], &[a, b], &[0.5]);
    assert_near(engine[0], expected, 2e-6);
}

/// redorav/hlslpp issue 68: a pair so close that an acos became NaN; google/filament
/// pull request 3478: keys a little off unit length, on opposite sides.
#[test]
fn pairs_that_broke_others_give_unit_rotations() {
    let a = q([-0.999254525, -0.011218898, -0.0367633253, -0.00361495349]);
    let b = q([-0.999251783, -0.0114078531, -0.0367971063, -0.00342923636]);
    let found = engine_slerp(KeySigns::Shortest, &[0.0, 1.0], &[a, b], &[0.691265166])[0];
    assert!((found.length() - 1.0).abs() < 4e-7);
    assert!((slerp(a, b, 0.691265166).length() - 1.0).abs() < 1e-15);

    let a = q([0.19, 0.76, 0.39, 0.51]).normalize();
    let b = q([-0.17, -0.72, -0.45, -0.49]).normalize();
    let found = engine_slerp(KeySigns::Shortest, &[0.0, 1.0], &[a, b], &[0.5])[0];
    assert!((found.length() - 1.0).abs() < 4e-7);
    for end in [a, b] {
        assert!(angle_between(found, end).to_degrees() < 6.0);
    }
}

/// KhronosGroup/glTF-Sample-Models, `BoxAnimated` (CC-BY 4.0): keys 180° apart, whose
/// dot product of -4.5e-11 is noise; the signs as stored decide, on every device.
#[test]
fn box_animated_turns_as_its_signs_say() {
    let keys = [
        q([-1.0, 0.0, 0.0, 0.0]),
        q([4.4896593387466766e-11, 1.0, 0.0, 0.0]),
    ];
    for path in [KeySigns::Shortest, KeySigns::AsAuthored] {
        let found = engine_slerp(path, &[1.25, 2.5], &keys, &[1.875])[0];
        let half = std::f64::consts::FRAC_1_SQRT_2;
        assert_near(found, [-half, half, 0.0, 0.0], 1e-6);
    }
}

/// KhronosGroup/glTF-Sample-Models, `AnimatedTriangle` (CC0): keys 1.5e-4 off unit
/// length, and a last step that goes on turning the same way on the short path.
#[test]
fn animated_triangle_keeps_turning() {
    let keys = [
        [1.0, 0.0, 0.0, 0.0],
        [0.707, 0.0, 0.0, 0.707],
        [0.0, 0.0, 0.0, 1.0],
        [-0.707, 0.0, 0.0, 0.707],
        [1.0, 0.0, 0.0, 0.0],
    ]
    .map(q);
    let times: Vec<f64> = (0..5).map(|i| f64::from(i) / 4.0).collect();
    let at: Vec<f64> = (0..=16).map(|i| f64::from(i) / 16.0).collect();
    let found = engine_slerp(KeySigns::Shortest, &times, &keys, &at);
    for (i, rotation) in (0..).zip(found) {
        let off = angle_between(rotation, about([0.0, 0.0, 1.0], 22.5 * f64::from(i)));
        assert!(off < 1e-6, "sample {i}: {off:e}");
    }
}

/// KhronosGroup/glTF-Asset-Generator, `Animation_SamplerType`: LINEAR yaw is linear.
#[test]
fn gltf_linear_yaw_is_linear() {
    let keys = [90.0, 0.0, -90.0, 0.0, 90.0].map(|yaw| about([0.0, 1.0, 0.0], yaw));
    let times: Vec<f64> = (0..5).map(f64::from).collect();
    for (at, yaw) in [(0.25, 67.5), (1.5, -45.0), (2.75, -22.5), (3.9, 81.0)] {
        let found = engine_slerp(KeySigns::Shortest, &times, &keys, &[at])[0];
        assert!(angle_between(found, about([0.0, 1.0, 0.0], yaw)) < 1e-6);
    }
}

/// scipy/scipy, `scipy/spatial/tests/test_slerp.py` (BSD-3-Clause).
#[test]
fn scipy_geometric_slerp() {
    let (start, end) = (q([1.0, 0.0, 0.0, 0.0]), q([0.0, 1.0, 0.0, 0.0]));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for (t, expected) in [
        (0.0, [1.0, 0.0, 0.0, 0.0]),
        (1.0 / 3.0, [0.8660254037844386, 0.5, 0.0, 0.0]),
        (0.5, [half, half, 0.0, 0.0]),
        (2.0 / 3.0, [0.5, 0.8660254037844386, 0.0, 0.0]),
        (1.0, [0.0, 1.0, 0.0, 0.0]),
    ] {
        assert_near(slerp(start, end, t), expected, 1e-15);
        let engine = engine_slerp(KeySigns::Shortest, &[0.0, 1.0], &[start, end], &[t]);
        assert_near(engine[0], expected, 1.2e-7);
    }
}

/// RobotLocomotion/drake, `common/trajectories/test/piecewise_quaternion_test.cc`
/// (BSD-3-Clause): angular velocity is constant between keys and takes the short
/// way where the keys' signs differ. Our keys are f32, hence the tolerance.
#[test]
fn drake_angular_velocity_across_a_sign_flip() {
    let axis = DVec3::new(1.0, 2.0, 3.0).normalize();
    let keys: Vec<Quat> = [1.0, -3.883185307179586, 5.3]
        .map(|angle| DQuat::from_axis_angle(axis, angle).as_quat())
        .to_vec();
    let times = [0.0, 1.6, 2.32];
    let curve = ReferenceCurve::new(
        tumble::method::SLERP.reference(),
        KeySigns::Shortest,
        Ends::default(),
        &times,
        &keys,
    );
    for (time, rate) in [(0.8, 0.875), (2.0, 4.027777777777778)] {
        assert!((curve.velocity(time) - axis * rate).length() < 1e-6);
    }
}

/// One track's rotations at any times.
fn evaluate(set: &TrackSet, interpolation: impl Into<Interpolation>, at: &[f64]) -> Vec<DQuat> {
    let engine = Engine::new(Device::Cpu).unwrap();
    let rotations = engine.evaluate(set, interpolation, &SampleTimes::at(at.to_vec()));
    let rotations = rotations.unwrap();
    rotations.as_quats().iter().map(|q| q.as_dquat()).collect()
}

fn set_of(times: &[f64], keys: &[DQuat]) -> TrackSet {
    let mut set = TrackSet::new();
    let keys: Vec<Quat> = keys.iter().map(|key| key.as_quat()).collect();
    set.push("", times, &keys).unwrap();
    set
}

/// mosra/magnum, src/Magnum/Math/Test/CubicHermiteTest.cpp (MIT): glTF's CUBICSPLINE.
#[test]
fn magnum_gltf_cubic_spline() {
    let keys = [
        q([0.182018, 0.780076, 0.0260025, 0.598059]),
        q([0.462519, -0.711568, 0.391362, 0.355784]),
    ];
    let (leaving, arriving) = (q([0.4, -1.0, 0.0, 0.3]), q([0.5, 5.0, 0.3, 1.1]));
    let mut set = set_of(&[0.0, 1.0], &keys);
    let none = q([0.0; 4]).as_quat();
    set.set_tangents(0, &[[none, leaving.as_quat()], [arriving.as_quat(), none]])
        .unwrap();
    let found = evaluate(&set, method::GLTF_CUBIC, &[0.35, 0.8]);
    let expected = [
        [0.466615, -0.309862, 0.174831, 0.809747],
        [0.283524, -0.911408, 0.23368, 0.185318],
    ];
    let line = [
        [0.426207, 0.392449, 0.234067, 0.780733],
        [0.524396, -0.533196, 0.410685, 0.521583],
    ];
    for (i, t) in [0.35, 0.8].into_iter().enumerate() {
        assert_near(found[i], expected[i], 1e-5);
        assert_near(nlerp(keys[0], keys[1], t), line[i], 1e-5);
    }
    // The signs are as authored: the dot product is negative.
    let raw = Interpolation::from(method::NLERP).with_signs(KeySigns::AsAuthored);
    let found = evaluate(&set, raw, &[0.35, 0.8]);
    assert_near(found[0], line[0], 1e-5);
    assert_near(found[1], line[1], 1e-5);
}

/// KhronosGroup/glTF-Asset-Generator, `Animation_SamplerType`: CUBICSPLINE with tangents of
/// zero is `normalise((1-s) q0 + s q1)`, `s = 3t² - 2t³`.
#[test]
fn gltf_cubic_spline_without_tangents_eases() {
    let keys = [90.0, 0.0, -90.0, 0.0, 90.0].map(|yaw| about([0.0, 1.0, 0.0], yaw));
    let times: Vec<f64> = (0..5).map(f64::from).collect();
    let set = set_of(&times, &keys);
    for at in [0.25, 1.5, 2.75, 3.9f64] {
        let (i, t) = (at.floor() as usize, at.fract());
        let expected = nlerp(keys[i], keys[i + 1], t * t * (3.0 - 2.0 * t));
        let found = evaluate(&set, method::GLTF_CUBIC, &[at])[0];
        assert!(angle_between(found, expected) < 4e-7, "{at}");
    }
}

/// Keys that are none of glTF's cubics, from angles or of a LINEAR sampler, may have any signs. Between a key and the
/// opposite of nearly the same rotation the cubic would pass 0, at any speed.
#[test]
fn gltf_cubic_spline_without_tangents_takes_the_shorter_rotation() {
    let times: Vec<f64> = (0..9).map(f64::from).collect();
    let even =
        [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 20.0, 15.0, 10.0].map(|yaw| about([0.0, 1.0, 0.0], yaw));
    let mut any_signs = even;
    for negated in [1, 2, 5] {
        any_signs[negated] = -any_signs[negated];
    }
    let at = [0.25, 0.5, 1.5, 2.5, 4.75];
    let mut set = set_of(&times, &any_signs);
    let expected = evaluate(&set_of(&times, &even), method::GLTF_CUBIC, &at);
    let found = evaluate(&set, method::GLTF_CUBIC, &at);
    for (found, expected) in found.iter().zip(&expected) {
        assert!(angle_between(*found, *expected) < 4e-7);
    }
    // The curve eases in and out: in the middle of an interval it is 1.5 times as fast as on
    // average.
    let engine = Engine::new(Device::Cpu).unwrap();
    let velocity =
        Interpolation::from(method::GLTF_CUBIC).with_quantity(Quantity::Velocity(Axes::Body));
    let frames = SampleTimes::fps(60);
    let velocities = engine
        .rates(&set, velocity, &frames, Layout::TrackMajor)
        .unwrap();
    let speeds = velocities.as_slice().iter().map(|v| v.length());
    let fastest = f64::from(speeds.fold(0.0, f32::max)).to_degrees();
    assert!((fastest - 7.5).abs() < 0.01, "{fastest}");
    let found = verify(&engine, &set, method::GLTF_CUBIC.into(), &frames).unwrap();
    assert_eq!(found.verdict(), Verdict::ReferenceOnly, "{found:?}");

    // As glTF specifies, keys with tangents keep their signs; with `as-authored` all keys do. Halfway from `p` to
    // `-q` is `p - q`.
    let authored = Interpolation::from(method::GLTF_CUBIC).with_signs(KeySigns::AsAuthored);
    let halfway = (any_signs[0] + any_signs[1]).normalize();
    assert!(angle_between(evaluate(&set, authored, &at)[1], halfway) < 1e-5);
    let still = Quat::from_array([0.0; 4]);
    set.set_tangents(0, &[[still; 2]; 9]).unwrap();
    assert!(angle_between(evaluate(&set, method::GLTF_CUBIC, &at)[1], halfway) < 1e-5);
}

/// Roll, pitch and yaw about fixed axes.
fn rpy(angle: f64) -> DQuat {
    DQuat::from_rotation_z(angle) * DQuat::from_rotation_y(angle) * DQuat::from_rotation_x(angle)
}

/// gazebosim/gz-math, `src/RotationSpline_TEST.cc` (Apache-2.0). Where a neighbour is
/// missing it takes log(1) = 0 for it; a last key equal to the first closes the curve.
#[test]
fn gz_math_squad() {
    let helper = |key: DQuat, neighbours: &[DQuat]| {
        let log = |to: &DQuat| (key.inverse() * *to).to_scaled_axis();
        let sum: DVec3 = neighbours.iter().map(log).sum();
        key * DQuat::from_scaled_axis(-sum / 4.0)
    };
    let (a, b, c) = (rpy(-0.1), rpy(0.2), rpy(0.4));
    // The helpers belong to earlier keys: recalculation was off.
    let (old, new) = (rpy(0.0), rpy(0.2));
    let found = squad([a, helper(old, &[new]), helper(new, &[old]), b], 0.5);
    assert_near(found, [0.998089, 0.0315333, 0.0427683, 0.0315333], 1e-5);
    let found = squad([b, helper(b, &[a, c]), helper(c, &[b]), c], 0.2);
    assert_near(found, [0.978787, 0.107618, 0.137159, 0.107618], 1e-5);
    let closed = set_of(&[0.0, 1.0, 2.0], &[rpy(0.0), rpy(0.4), rpy(0.0)]);
    let looped = Interpolation::from(method::SQUAD).with_ends(Ends::Loop);
    for found in evaluate(&closed, looped, &[0.5, 1.5]) {
        assert_near(found, [0.987225, 0.077057, 0.11624, 0.077057], 1e-5);
    }
}

/// scipy/scipy, `scipy/spatial/transform/tests/test_rotation_spline.py` (BSD-3-Clause): with
/// two keys it is slerp.
#[test]
fn scipy_rotation_spline_of_two_keys_is_slerp() {
    let [x, y, z] = [10.0, -20.0, 30.0].map(f64::to_radians);
    let end = DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y) * DQuat::from_rotation_x(x);
    let keys = [DQuat::IDENTITY, end];
    let set = set_of(&[0.0, 10.0], &keys);
    let found = evaluate(&set, method::C2, &[0.0, 2.5, 5.0, 9.0]);
    for (found, t) in found.into_iter().zip([0.0, 0.25, 0.5, 0.9]) {
        assert!(angle_between(found, slerp(keys[0], keys[1], t)) < 3e-7);
    }
    let curve = curve(method::C2, &[0.0, 10.0], &keys);
    let rate = end.to_scaled_axis() / 10.0;
    for time in [0.0, 5.0, 10.0] {
        assert!((curve.velocity(time) - rate).length() < 1e-7);
        assert!(curve.acceleration(time).length() < 1e-9);
    }
}

fn curve(method: Method, times: &[f64], keys: &[DQuat]) -> ReferenceCurve {
    let keys: Vec<Quat> = keys.iter().map(|key| key.as_quat()).collect();
    ReferenceCurve::new(
        method.reference(),
        KeySigns::Shortest,
        method.ends,
        times,
        &keys,
    )
}
