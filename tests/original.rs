//! The original program, transcribed from its formulas: a linked pendulum drawn at
//! 25 frames a second, frame k of a segment with n frames at t = k/n, the first and
//! the last segments frozen. Its inner segments must be ours, within 2e-6.

use glam::{DQuat, DVec3, Quat};
use tumble::reference::angle_between;
use tumble::{Device, Engine, Interpolation, KeySigns, METHODS, Method, SampleTimes, TrackSet};
use tumble_formats::ReadOptions;
use tumble_formats::dat::open_dat;
use tumble_formats::generate::{Generate, KeySpacing};

const FRAME_RATE: f64 = 25.0;

fn log(q: DQuat) -> DVec3 {
    let v = DVec3::new(q.x, q.y, q.z);
    let length = v.length();
    if length == 0.0 {
        DVec3::ZERO
    } else {
        v * (length.atan2(q.w) / length)
    }
}

fn exp(a: DVec3) -> DQuat {
    let angle = a.length();
    let v = if angle == 0.0 {
        a
    } else {
        a * (angle.sin() / angle)
    };
    DQuat::from_xyzw(v.x, v.y, v.z, angle.cos())
}

fn power(q: DQuat, exponent: f64) -> DQuat {
    exp(log(q) * exponent)
}

/// The curve's control points of the segment from `q[1]` to `q[2]`, given four keys
/// and their times in frames.
fn control_points(method: Method, q: [DQuat; 4], time: [f64; 4]) -> [DQuat; 4] {
    let [q0, q1, q2, q3] = q;
    let step = |a: DQuat, b: DQuat| a.inverse() * b;
    if method.name == "catmull-rom" {
        let plus = q1 * power(step(q0, q2), 1.0 / 6.0);
        let minus = q2 * power(step(q1, q3), -1.0 / 6.0);
        return [q1, plus, minus, q2];
    }
    let dist = |a: usize, b: usize| time[b] - time[a];
    let tangent = |before: DQuat, after: DQuat, h_before: f64, h_after: f64| {
        let slope_before = power(before, 1.0 / h_before);
        let slope_after = power(after, 1.0 / h_after);
        let top = power(slope_before, h_after) * power(slope_after, h_before);
        power(top, 1.0 / (h_before + h_after))
    };
    let t1 = tangent(step(q0, q1), step(q1, q2), dist(0, 1), dist(1, 2));
    let t2 = tangent(step(q1, q2), step(q2, q3), dist(1, 2), dist(2, 3));
    let third = dist(1, 2) / 3.0;
    [q1, q1 * power(t1, third), q2 * power(t2, -third), q2]
}

/// The product of powers over the sums of Bernstein polynomials.
fn curve(points: [DQuat; 4], t: f64) -> DQuat {
    let bernstein = [
        (1.0 - t).powi(3),
        3.0 * t * (1.0 - t).powi(2),
        3.0 * t * t * (1.0 - t),
        t.powi(3),
    ];
    (1..4).fold(points[0], |product, j| {
        let weight: f64 = bernstein[j..].iter().sum();
        product * exp(log(points[j - 1].inverse() * points[j]) * weight)
    })
}

/// Frame by frame, as the original printed them; `None` where it is frozen.
fn original_frames(method: Method, times: &[f64], keys: &[DQuat]) -> Vec<Option<DQuat>> {
    let mut frames = Vec::new();
    for p in 0..keys.len() - 1 {
        let count = ((times[p + 1] - times[p]) * FRAME_RATE).round() as usize;
        let inner = p > 0 && p + 2 < keys.len();
        for frame in 0..count {
            let t = frame as f64 / count as f64;
            frames.push(if method.name == "slerp" {
                Some(keys[p] * power(keys[p].inverse() * keys[p + 1], t))
            } else if inner {
                let four = std::array::from_fn(|i| keys[p - 1 + i]);
                let time = std::array::from_fn(|i| times[p - 1 + i] * FRAME_RATE);
                Some(curve(control_points(method, four, time), t))
            } else {
                None
            });
        }
    }
    frames
}

fn assert_matches_the_original(set: &TrackSet, label: &str) {
    let engine = Engine::new(Device::Cpu).unwrap();
    for method in METHODS
        .into_iter()
        .filter(|method| ["slerp", "catmull-rom", "bessel-overhauser"].contains(&method.name))
    {
        // The original program does not change the signs of keys.
        let interpolation = Interpolation::from(method).with_signs(KeySigns::AsAuthored);
        let rotations = engine
            .evaluate(set, interpolation, &SampleTimes::fps(25))
            .unwrap();
        let (mut compared, mut worst) = (0, 0.0f64);
        for (t, track) in set.tracks().enumerate() {
            let keys: Vec<DQuat> = track
                .keys
                .iter()
                .map(|key: &Quat| key.as_dquat().normalize())
                .collect();
            let original = original_frames(method, track.times, &keys);
            for (frame, expected) in original.into_iter().enumerate() {
                let Some(expected) = expected else { continue };
                let found = rotations.get(t, frame).unwrap().as_dquat();
                worst = worst.max(angle_between(found, expected));
                compared += 1;
            }
        }
        println!("{label}, {method}: {compared} frames, at most {worst:e} rad apart");
        assert!(
            compared > 400 && worst <= 2e-6,
            "{label}, {method}: {worst:e} rad"
        );
    }
}

#[test]
fn generated_pendulums_match_the_original_program() {
    for seed in 1..6 {
        let set = Generate {
            seed,
            ..Generate::default()
        }
        .track_set()
        .unwrap();
        assert_matches_the_original(&set, &format!("seed {seed}"));
    }
}

/// Uneven steps of whole frames (the original rounds to them), gentle enough that
/// the original's tangents do not wrap.
#[test]
fn uneven_pendulums_match_the_original_program() {
    let generate = Generate {
        seconds: 10.0,
        spacing: KeySpacing::Random,
        ..Generate::default()
    };
    let smooth = generate.track_set().unwrap();
    let mut set = TrackSet::new();
    for track in smooth.tracks() {
        let mut times: Vec<f64> = track
            .times
            .iter()
            .map(|time| (time * FRAME_RATE).round() / FRAME_RATE)
            .collect();
        for i in 1..times.len() {
            times[i] = times[i].max(times[i - 1] + 1.0 / FRAME_RATE);
        }
        times = times
            .iter()
            .map(|time| (time * FRAME_RATE).round() / FRAME_RATE)
            .collect();
        set.push("", &times, track.keys).unwrap();
    }
    assert_matches_the_original(&set, "uneven");
}

/// `ORIGINAL_DATA=file.dat cargo test --test all original:: -- --nocapture` compares on a
/// file of the user's, such as the original program's.
#[test]
fn files_of_ones_own_match_the_original_program() {
    let Some(path) = std::env::var_os("ORIGINAL_DATA") else {
        return;
    };
    let loaded = open_dat(path.as_ref(), &ReadOptions::default()).unwrap();
    assert_matches_the_original(&loaded.clips[0].set, &path.to_string_lossy());
}
