//! Keys are prepared, and paths followed, in the widest vectors that the process may use: those of
//! the processor, or those that `TUMBLE_VECTOR_WIDTH` names. The results of processes with narrower
//! vectors are compared here with those of this process.

use std::fmt::Write as _;
use std::process::Command;

use glam::{DVec3, Quat, Vec3};
use sha2::{Digest, Sha256};
use tumble::paths::{Direction, Follow, PathFrame, PathSpeed};
use tumble::{Device, Engine, Layout, METHODS, SampleTimes, TrackSet, VectorWidth};

/// Steps from 0.01° to 180°, at even and uneven times.
fn rotations() -> TrackSet {
    let mut set = TrackSet::new();
    for track in 0..40 {
        let step = 3.1 * 0.5f32.powi(track % 14);
        let uneven = if track < 20 { 0.0 } else { 0.99 };
        let times: Vec<f64> = (0..23)
            .map(|i| f64::from(i) + uneven * f64::from(i % 2))
            .collect();
        let key = |i: u8| {
            let i = f32::from(i);
            let angle = step * (i + i.sin());
            Quat::from_rotation_y(angle) * Quat::from_rotation_x(0.3 * angle.cos())
        };
        let mut keys: Vec<Quat> = (0..23).map(key).collect();
        if track == 13 {
            keys[7] = keys[6]; // no plane
            keys[9] = Quat::IDENTITY; // half a turn to the next
            keys[10] = Quat::from_xyzw(1.0, 0.0, 0.0, 0.0);
        }
        set.push("", &times, &keys).unwrap();
    }
    set
}

/// Paths of 2 to 24 points; one stands still, and one goes to and fro.
pub(crate) fn paths() -> TrackSet {
    let mut set = TrackSet::new();
    for track in 0..23u8 {
        let scale = f32::from(track % 5);
        let point = |i: u8| {
            let t = f32::from(i) * (0.3 + 0.1 * scale);
            match track {
                7 => Vec3::ONE,
                8 => Vec3::X * f32::from(i % 2),
                _ => Vec3::new((3.0 * t).sin() * scale, t, (t * t).cos()),
            }
        };
        let points: Vec<Vec3> = (0..2 + track).map(point).collect();
        let times: Vec<f64> = (0..2 + track).map(|i| 0.5 * f64::from(i)).collect();
        set.push_path("", &times, &points, &[]).unwrap();
    }
    set
}

/// The hash of each method's curves, and of paths as they are followed, sampled so densely that a bit of a
/// segment shows somewhere.
fn hashes() -> String {
    let engine = Engine::new(Device::Cpu).unwrap();
    let mut said = String::new();
    let mut add = |name: &dyn std::fmt::Debug, parts: &[&[u8]]| {
        let mut hash = Sha256::new();
        parts.iter().for_each(|part| hash.update(part));
        writeln!(said, "{name:?}: {:x?}", hash.finalize()).unwrap();
    };
    let set = rotations();
    for method in METHODS {
        let clip = engine.upload(&set, method).unwrap();
        let found = clip.evaluate(&SampleTimes::fps(997)).unwrap();
        add(&method.name, &[bytemuck::cast_slice(found.as_quats())]);
    }
    let set = paths();
    let base = Follow::default();
    let axes = ["x", "-z"].map(|axis| axis.parse().unwrap());
    let (speed, frame) = (PathSpeed::Constant, PathFrame::Fixed);
    let direction = Direction::Point(DVec3::new(0.0, 2.0, 9.0));
    for follow in [
        base.clone(),
        base.clone().with_axes(axes),
        base.clone().with_speed(speed),
        base.clone().with_frame(frame).with_direction(direction),
        base.with_frame(PathFrame::Frenet),
    ] {
        let frames = SampleTimes::fps(997).between(-0.1, 12.1);
        let found = engine.follow(&set, &follow, &frames, Layout::TrackMajor);
        let found = found.unwrap();
        let positions = bytemuck::cast_slice(found.positions.as_slice());
        let rotations = bytemuck::cast_slice(found.rotations.as_quats());
        add(&follow, &[positions, rotations]);
    }
    said
}

/// The output of these tests in a process whose vectors have a width, and that has no Vulkan device.
fn said_with(width: VectorWidth, tests: &[&str]) -> String {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(tests)
        .arg("--nocapture")
        .env("TUMBLE_VECTOR_WIDTH", format!("{width:?}"))
        .env("VK_DRIVER_FILES", "/none")
        .env("VK_ICD_FILENAMES", "/none")
        .env_remove("VK_ADD_DRIVER_FILES")
        .env_remove("CI")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "{width:?}, {tests:?}: {said}{errors}"
    );
    said
}

/// Catches an instruction set whose code fuses, reorders or divides otherwise where curves are made of
/// keys and of paths.
#[test]
fn every_vector_width_prepares_the_same_curves() {
    let expected = hashes();
    let widths = VectorWidth::available().into_iter();
    for width in widths.filter(|&width| width < VectorWidth::widest()) {
        let said = said_with(width, &["--exact", "widths::prints_hashes", "--ignored"]);
        assert!(said.contains(&format!("in {width:?}")), "{width:?}: {said}");
        for line in expected.lines() {
            assert!(said.contains(line), "{width:?}: not {line}, but {said}");
        }
        let said = said_with(width, &["golden::"]);
        let hashes = "results have their recorded hashes";
        assert!(said.contains(hashes), "{width:?}: {said}");
    }
}

/// The test above runs this in a separate process.
#[test]
#[ignore = "part of every_vector_width_prepares_the_same_curves"]
fn prints_hashes() {
    println!("in {:?}\n{}", VectorWidth::widest(), hashes());
}
