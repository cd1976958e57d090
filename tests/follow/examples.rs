//! Paths whose frames are known, by the reference.

use glam::{DQuat, DVec3};
use std::f64::consts::{PI, TAU};
use tumble::Ends;
use tumble::reference::{
    Follower, FollowerDirection, FollowerFrame, FollowerSpeed, FollowerWalk, VectorCurve, eased,
};

fn vectors(keys: &[[f64; 3]]) -> Vec<DVec3> {
    keys.iter().map(|&key| DVec3::from_array(key)).collect()
}

/// Five keys at uneven times.
pub(super) fn k(method: &'static str, ends: Ends) -> Follower {
    let keys = [
        [0.0, 0.0, 0.0],
        [1.0, 2.0, 0.0],
        [3.0, 3.0, 1.0],
        [4.0, 1.0, 2.0],
        [6.0, 0.0, 0.0],
    ];
    following(VectorCurve {
        method,
        ends,
        times: vec![0.0, 1.0, 2.5, 3.0, 4.5],
        keys: vectors(&keys),
        tangents: Vec::new(),
    })
}

/// A closed path.
pub(super) fn c() -> Follower {
    let keys = [
        [0, 0, 0],
        [2, 0, 1],
        [3, 2, -1],
        [1, 3, 2],
        [-1, 1, 0],
        [0, 0, 0],
    ];
    let follower = following(VectorCurve {
        method: "bessel-overhauser",
        ends: Ends::Loop,
        times: (0..6).map(f64::from).collect(),
        keys: keys
            .map(|key| DVec3::from_array(key.map(f64::from)))
            .to_vec(),
        tangents: Vec::new(),
    });
    Follower {
        spread: true,
        ..follower
    }
}

pub(super) fn following(curve: VectorCurve) -> Follower {
    Follower {
        curve,
        heading: FollowerDirection::Tangent,
        frame: FollowerFrame::Minimal,
        up: DVec3::Y,
        ups: Vec::new(),
        spread: false,
        travel: FollowerSpeed::Keys,
    }
}

/// A curve of one cubic over times 0 to 1, by its ends and its slopes there.
pub(super) fn cubic(start: DVec3, leaving: DVec3, arriving: DVec3, end: DVec3) -> Follower {
    following(VectorCurve {
        method: "gltf-cubic",
        ends: Ends::Parabolic,
        times: vec![0.0, 1.0],
        keys: vec![start, end],
        tangents: vec![[DVec3::ZERO, leaving], [arriving, DVec3::ZERO]],
    })
}

/// A smooth closed curve, by many of its points and its slopes there.
fn closed(point: impl Fn(f64) -> DVec3) -> Follower {
    let count = 400;
    let at = |i: i32| TAU * f64::from(i) / f64::from(count);
    let slope = |t: f64| (point(t + 1e-5) - point(t - 1e-5)) / 2e-5;
    let follower = following(VectorCurve {
        method: "gltf-cubic",
        ends: Ends::Parabolic,
        times: (0..=count).map(at).collect(),
        keys: (0..=count).map(|i| point(at(i % count))).collect(),
        tangents: (0..=count).map(|i| [slope(at(i % count)); 2]).collect(),
    });
    Follower {
        spread: true,
        ..follower
    }
}

/// A rotation w x y z of either sign, to the nine digits that are known.
#[track_caller]
pub(super) fn assert_rotation(found: DQuat, [w, x, y, z]: [f64; 4], bound: f64) {
    let expected = DQuat::from_xyzw(x, y, z, w);
    let found = if found.dot(expected) < 0.0 {
        -found
    } else {
        found
    };
    let off = (found - expected).length();
    assert!(off < bound, "{found:?} instead of {expected:?}: {off:e}");
}

#[track_caller]
fn assert_near(found: DVec3, expected: [f64; 3], bound: f64) {
    let off = (found - DVec3::from_array(expected)).length();
    assert!(off < bound, "{found} instead of {expected:?}: {off:e}");
}

/// The angle modulo a whole turn.
#[track_caller]
fn assert_angle(found: f64, expected: f64, bound: f64) {
    let off = (found - expected + PI).rem_euclid(TAU) - PI;
    assert!(off.abs() < bound, "{found} instead of {expected}");
}

fn axes(walk: &FollowerWalk<'_>, time: f64) -> [DVec3; 3] {
    let (_, rotation) = walk.pose(time);
    [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| rotation * axis)
}

pub(super) const MINIMAL: [f64; 4] = [0.671926648, -0.149196506, 0.585260859, 0.428631204];
pub(super) const MINIMAL_AT_END: [f64; 4] = [-0.0881917708, 0.69898784, 0.673833218, 0.222681398];
pub(super) const FIXED: [f64; 4] = [0.768473354, -0.315216319, 0.515197577, 0.211326369];
pub(super) const FRENET: [f64; 4] = [-0.110444253, 0.470237989, 0.379033118, 0.789311216];
pub(super) const UP_AT_END: [f64; 4] = [0.760114465, -0.295908259, 0.526524617, 0.239658361];
pub(super) const LOOP: [f64; 4] = [0.281688536, -0.27308274, 0.0516313436, 0.918374428];

#[test]
fn the_path_of_five_keys() {
    let follower = k("bessel-overhauser", Ends::Parabolic);
    let walk = follower.walk();
    assert_near(walk.pose(1.75).0, [1.86875, 3.30625, 0.2375], 1e-9);
    assert!((walk.length() - 12.115_238_5).abs() < 5e-8);
    assert_rotation(walk.pose(1.75).1, MINIMAL, 2e-9);
    assert_rotation(walk.pose(4.5).1, MINIMAL_AT_END, 2e-9);
    let with = |frame| Follower {
        frame,
        ..follower.clone()
    };
    assert_rotation(with(FollowerFrame::Fixed).walk().pose(1.75).1, FIXED, 2e-9);
    assert_rotation(
        with(FollowerFrame::Frenet).walk().pose(1.75).1,
        FRENET,
        2e-9,
    );
    let mut ups = vec![None; 5];
    ups[4] = Some(DVec3::Y);
    let with_up = Follower {
        ups,
        ..follower.clone()
    };
    assert_rotation(with_up.walk().pose(1.75).1, UP_AT_END, 2e-9);
    assert_near(
        with_up.walk().pose(4.5).1 * DVec3::X,
        [-0.67, 0.0, 0.0],
        2.0,
    );
}

#[test]
fn splines_with_continuous_curvature() {
    let at = |ends| k("c2", ends).curve.value(1.75);
    assert_near(at(Ends::Natural), [1.83366935, 3.51814516, 0.125], 1e-8);
    assert_near(
        at(Ends::Parabolic),
        [1.83928571, 3.50714286, 0.146428571],
        1e-8,
    );
}

#[test]
fn a_closed_path() {
    let follower = c();
    let walk = follower.walk();
    assert_rotation(walk.pose(2.5).1, LOOP, 2e-9);
    assert!(
        (walk.left_over - 0.0272464337).abs() < 1e-9,
        "{}",
        walk.left_over
    );
    let (start, end) = (walk.pose(0.0).1, walk.pose(5.0).1);
    assert!(start.dot(end).abs() > 1.0 - 1e-12);
}

#[test]
fn frenet_s_frame() {
    let follower = Follower {
        frame: FollowerFrame::Frenet,
        ..cubic(DVec3::ZERO, DVec3::X, DVec3::new(1.0, 2.0, 3.0), DVec3::ONE)
    };
    let [u, v, w] = axes(&follower.walk(), 0.5);
    assert_near(w, [0.624695048, 0.624695048, 0.468521286], 2e-9);
    assert_near(u, [0.38411064, -0.76822128, 0.51214752], 2e-9);
    assert_near(v, [0.679864041, -0.139972008, -0.719856043], 2e-9);
}

/// (t, t³, 0) from -1 to 1: at the inflection the normal jumps to the other side, and the repaired
/// frame does not.
#[test]
fn frenet_s_frame_past_an_inflection() {
    let slope = DVec3::new(2.0, 6.0, 0.0);
    let follower = Follower {
        frame: FollowerFrame::Frenet,
        ..cubic(
            DVec3::new(-1.0, -1.0, 0.0),
            slope,
            slope,
            DVec3::new(1.0, 1.0, 0.0),
        )
    };
    let walk = follower.walk();
    let lectured = |t: f64| {
        let [_, velocity, bend] =
            [t.powi(3), 3.0 * t * t, 6.0 * t].map(|y| DVec3::new(0.0, y, 0.0));
        (velocity + DVec3::X).cross(bend).normalize()
    };
    assert_eq!([lectured(-0.5), lectured(0.5)], [-DVec3::Z, DVec3::Z]);
    assert_near(axes(&walk, 0.25)[0], [0.0, 0.0, -1.0], 1e-12);
    let [u, v, _] = axes(&walk, 0.75);
    assert_near(u, [0.0, 0.0, -1.0], 1e-12);
    assert_near(v, [-0.6, 0.8, 0.0], 1e-12);
}

#[test]
fn the_fixed_frame() {
    let keys = vectors(&[[0.0; 3], [1.0; 3]]);
    let curve = VectorCurve {
        method: "linear",
        ends: Ends::Parabolic,
        times: vec![0.0, 1.0],
        keys,
        tangents: vec![],
    };
    let follower = Follower {
        frame: FollowerFrame::Fixed,
        ..following(curve)
    };
    let expected = [0.880476239, -0.279848142, 0.3647052, 0.115916896];
    assert_rotation(follower.walk().pose(0.3).1, expected, 2e-9);
}

/// On a helix the body rotates by the torsion; on closed curves by the sum of the torsion.
#[test]
fn what_is_left_over_after_a_round() {
    let helix = Follower {
        spread: false,
        ..closed(|t| DVec3::new(t.cos(), t.sin(), t))
    };
    let mut helix = helix;
    let last = helix.curve.keys.len() - 1;
    let slope = |t: f64| DVec3::new(-t.sin(), t.cos(), 1.0);
    for (i, key) in helix.curve.keys.iter_mut().enumerate() {
        let t = helix.curve.times[i];
        *key = DVec3::new(t.cos(), t.sin(), t);
        helix.curve.tangents[i] = [slope(t); 2];
    }
    let normal = -DVec3::X;
    helix.up = normal;
    helix.ups = vec![None; last + 1];
    helix.ups[last] = Some(normal);
    // From the minimal frame at the end to Frenet's, which has turned with the torsion.
    assert_angle(helix.walk().left_over, -TAU / 2f64.sqrt(), 1e-6);
    assert_angle(-TAU / 2f64.sqrt(), 1.84030237, 5e-9);
    let trefoil = closed(|t| {
        let (a, b) = (2.0 * t, 3.0 * t);
        DVec3::new(t.sin() + 2.0 * a.sin(), t.cos() - 2.0 * a.cos(), -b.sin())
    });
    assert_angle(trefoil.walk().left_over, -2.22504064, 2e-5);
    let saddle = closed(|t| DVec3::new(t.cos(), t.sin(), 0.5 * (2.0 * t).sin()));
    assert_angle(saddle.walk().left_over, 0.0, 2e-5);
    let on_sphere =
        closed(|t| DVec3::new(t.cos(), t.sin(), 0.3 * (3.0 * t).sin() + 0.2).normalize());
    assert_angle(on_sphere.walk().left_over, 0.0, 2e-5);
}

#[test]
fn lengths() {
    let of = |start, leaving, arriving, end| {
        let follower = cubic(
            DVec3::from_array(start),
            DVec3::from_array(leaving),
            DVec3::from_array(arriving),
            DVec3::from_array(end),
        );
        follower.walk().length()
    };
    let parabola = of([0.0; 3], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [1.0, 1.0, 0.0]);
    assert!((parabola - 1.4789428575).abs() < 1e-9);
    let twisted = cubic(DVec3::ZERO, DVec3::X, DVec3::new(1.0, 2.0, 3.0), DVec3::ONE);
    assert!((twisted.walk().length() - 1.8630229825).abs() < 1e-9);
    let steady = Follower {
        travel: FollowerSpeed::Constant,
        ..twisted
    };
    assert!((steady.walk().pose(0.5).0.x - 0.67967939055).abs() < 1e-9);
    // (t², t³) from -1 to 1 has a cusp in the middle.
    let cusp = of(
        [1.0, -1.0, 0.0],
        [-4.0, 6.0, 0.0],
        [4.0, 6.0, 0.0],
        [1.0, 1.0, 0.0],
    );
    assert!((cusp - 2.8794197467).abs() < 1e-9, "{cusp}");
}

#[test]
fn eased_speed() {
    let expected = [
        (0.1, 0.025),
        (0.2, 2.0 / 15.0),
        (0.5, 8.0 / 15.0),
        (0.7, 0.8),
        (0.9, 0.987654321),
    ];
    for (x, s) in expected {
        assert!((eased(0.2, 0.3, x) - s).abs() < 1e-9, "{x}");
    }
}
