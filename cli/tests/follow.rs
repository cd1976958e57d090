//! `tumble follow` and `tumble smooth`, run as people run them.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::program::{run, sample_folder, succeed};
use glam::{Quat, Vec3};
use tumble::paths::{Follow, PathSpeed};
use tumble::{Device, Engine, Layout, SampleTimes, Smoothing, TrackSet, VectorMethod, method};

const PATH_CSV: &str =
    "t,x,y,z,ux,uy,uz\n0,0,0,0,,,\n1,1,2,0,,,\n2.5,3,3,1,,,\n3,4,1,2,,,\n4.5,6,0,0,0,1,0\n";

fn set() -> TrackSet {
    let points = [[0, 0, 0], [1, 2, 0], [3, 3, 1], [4, 1, 2], [6, 0, 0]];
    let points = points.map(|point| Vec3::from_array(point.map(|c| c as f32)));
    let mut ups = [None; 5];
    ups[4] = Some(Vec3::Y);
    let mut set = TrackSet::new();
    set.push_path("way", &[0.0, 1.0, 2.5, 3.0, 4.5], &points, &ups)
        .unwrap();
    set
}

fn path_folder() -> tempfile::TempDir {
    let folder = sample_folder();
    fs::create_dir(folder.path().join("paths")).unwrap();
    fs::write(folder.path().join("way.csv"), PATH_CSV).unwrap();
    fs::write(folder.path().join("paths/a.csv"), PATH_CSV).unwrap();
    fs::write(folder.path().join("paths/b.csv"), "x,y,z\n0,0,0\n1,0,0\n").unwrap();
    folder
}

fn numbers(file: &Path) -> (Vec<u64>, Vec<f32>) {
    let bytes = fs::read(file).unwrap();
    let file = npyz::NpyFile::new(&bytes[..]).unwrap();
    (file.shape().to_vec(), file.into_vec::<f32>().unwrap())
}

#[test]
fn results_are_the_library_s_bits() {
    let folder = path_folder();
    let line = [
        "follow",
        "way.csv",
        "--fps",
        "60",
        "-m",
        "c2",
        "--speed",
        "eased:0.2,0.3",
        "--body-forward",
        "-x",
        "--body-up",
        "z",
        "-o",
        "out.npy",
    ];
    succeed(folder.path(), &line);
    let (shape, found) = numbers(&folder.path().join("out.npy"));
    assert_eq!(shape, [271, 1, 7]);
    let follow = Follow::default()
        .with_method(VectorMethod::C2)
        .with_speed(PathSpeed::Eased {
            start: 0.2,
            end: 0.3,
        })
        .with_axes(["-x".parse().unwrap(), "z".parse().unwrap()]);
    let engine = Engine::new(Device::Cpu).unwrap();
    let expected = engine
        .follow(&set(), &follow, &SampleTimes::fps(60), Layout::FrameMajor)
        .unwrap();
    for (sample, row) in found.chunks(7).enumerate() {
        let position = expected.positions.get(0, sample).unwrap();
        let rotation = expected.rotations.get(0, sample).unwrap();
        let all = [position.to_array().to_vec(), rotation.to_array().to_vec()].concat();
        assert_eq!(
            row.iter().map(|c| c.to_bits()).collect::<Vec<_>>(),
            all.iter().map(|c| c.to_bits()).collect::<Vec<_>>()
        );
    }
}

#[test]
fn other_formats_hold_the_same_poses() {
    let folder = path_folder();
    succeed(
        folder.path(),
        &["follow", "way.csv", "--fps", "2", "-o", "out.csv"],
    );
    let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let mut lines = text.lines();
    let header = "frame,time,way.px,way.py,way.pz,way.x,way.y,way.z,way.w";
    assert_eq!(lines.next(), Some(header));
    assert!(lines.nth(2).unwrap().starts_with("2,1,1,2,0,"));
    succeed(
        folder.path(),
        &["follow", "way.csv", "--fps", "2", "-o", "out.glb"],
    );
    succeed(
        folder.path(),
        &[
            "eval",
            "out.glb",
            "--fps",
            "2",
            "--quantity",
            "world",
            "-o",
            "again.npy",
        ],
    );
    succeed(
        folder.path(),
        &["follow", "way.csv", "--fps", "2", "-o", "out.npy"],
    );
    let (_, direct) = numbers(&folder.path().join("out.npy"));
    let (shape, again) = numbers(&folder.path().join("again.npy"));
    assert_eq!(shape, [10, 1, 7]);
    for (pose, again) in direct.chunks(7).zip(again.chunks(7)) {
        let positions = [pose, again].map(|row| Vec3::from_slice(row));
        assert!((positions[0] - positions[1]).length() < 1e-6);
        let rotations = [pose, again].map(|row| Quat::from_slice(&row[3..]));
        assert!(rotations[0].dot(rotations[1]).abs() > 1.0 - 1e-6);
    }
}

#[test]
fn paths_of_a_directory_get_a_file_each() {
    let folder = path_folder();
    // b.csv has no times and fails; the batch continues.
    let some = run(
        folder.path(),
        &["follow", "paths", "-o", "poses", "--overwrite"],
    );
    assert_eq!(some.code, 3, "{}", some.words);
    assert!(
        some.words.contains("b.csv") && some.words.contains("--seconds"),
        "{}",
        some.words
    );
    assert!(folder.path().join("poses/a.npy").exists());
    assert!(!folder.path().join("poses/b.npy").exists());
    succeed(
        folder.path(),
        &[
            "follow",
            "paths/b.csv",
            "--pace",
            "0.5",
            "--fps",
            "1",
            "-o",
            "b.npy",
        ],
    );
    let (shape, _) = numbers(&folder.path().join("b.npy"));
    assert_eq!(shape, [3, 1, 7]);
}

#[test]
fn what_cannot_be_followed_is_refused() {
    let folder = path_folder();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("none.csv", "t,x,y,z\n");
    write("one.csv", "t,x,y,z\n0,1,2,3\n");
    write("still.csv", "t,x,y,z\n0,1,2,3\n1,1,2,3\n");
    write("nan.csv", "t,x,y,z\n0,1,nan,3\n");
    write("order.csv", "t,x,y,z\n1,1,2,3\n1,2,2,3\n");
    write("up.csv", "t,x,y,z,ux,uy,uz\n0,1,2,3,0,0,0\n");
    write(
        "turn.csv",
        "t,x,y,z,ux,uy,uz\n0,0,0,0,0,1,0\n1,1,0,0,0,-1,0\n",
    );
    let refused = |code: i32, words: &str, line: &[&str]| {
        let all = [&["follow", "-o", "out.npy"], line].concat();
        let run = run(folder.path(), &all);
        assert_eq!(run.code, code, "{line:?}: {}", run.words);
        assert!(run.words.contains(words), "{line:?}: {}", run.words);
        assert!(!folder.path().join("out.npy").exists(), "{line:?}");
    };
    refused(4, "no point", &["none.csv"]);
    refused(4, "nan.csv:2", &["nan.csv"]);
    refused(4, "is not after", &["order.csv"]);
    refused(4, "no length", &["up.csv"]);
    refused(4, "--seconds or --pace", &["paths/b.csv"]);
    refused(4, "leave out", &["way.csv", "--seconds", "2"]);
    refused(4, "loop", &["way.csv", "--ends", "loop"]);
    refused(4, "ahead", &["way.csv", "--direction", "ahead:0"]);
    refused(4, "at most 1", &["way.csv", "--speed", "eased:0.6,0.5"]);
    refused(4, "length", &["way.csv", "--up", "0,0,0"]);
    refused(
        4,
        "upward directions at its keys",
        &["way.csv", "--path-frame", "fixed"],
    );
    refused(
        4,
        "faces along the path",
        &[
            "one.csv",
            "--path-frame",
            "frenet",
            "--direction",
            "ahead:1",
        ],
    );
    refused(2, "no track", &["way.csv", "--direction", "at:nobody"]);
    refused(2, "--direction", &["way.csv", "--direction", "sideways"]);
    refused(2, "--seconds", &["paths/b.csv", "--seconds", "0"]);
    refused(4, "axes", &["way.csv", "--body-forward", "y"]);
    refused(
        2,
        "--path-ends has no effect on a path by linear",
        &["way.csv", "-m", "linear", "--path-ends", "natural"],
    );
    refused(
        2,
        "--twist has no effect on other frames than minimal",
        &[
            "paths/b.csv",
            "--pace",
            "1",
            "--path-frame",
            "fixed",
            "--twist",
            "free",
        ],
    );
    refused(
        2,
        "--path-up has no effect on Frenet's frames",
        &[
            "paths/b.csv",
            "--pace",
            "1",
            "--path-frame",
            "frenet",
            "--up",
            "0,0,1",
        ],
    );
    for (name, words) in [
        ("one", "does not move"),
        ("still", "does not move"),
        ("turn", "180°"),
    ] {
        let out = format!("{name}.npy");
        let run = succeed(
            folder.path(),
            &["follow", &format!("{name}.csv"), "-o", &out],
        );
        assert!(run.words.contains(words), "{name}: {}", run.words);
    }
}

#[test]
fn smoothed_keys_are_the_library_s() {
    let folder = path_folder();
    succeed(
        folder.path(),
        &[
            "smooth", "a.dat", "--kernel", "tent:2", "--passes", "2", "-o", "out.npy",
        ],
    );
    let (shape, found) = numbers(&folder.path().join("out.npy"));
    assert_eq!(shape, [2, 5, 4]);
    let (times, keys) = crate::program::pendulum();
    let set = TrackSet::with_shared_times(&times, &keys).unwrap();
    let engine = Engine::new(Device::Cpu).unwrap();
    let frames = SampleTimes::at(times);
    let unsmoothed = engine
        .evaluate(&set, method::BESSEL_OVERHAUSER, &frames)
        .unwrap();
    let smoothing = Smoothing::new("tent:2".parse().unwrap()).with_passes(2);
    let expected = engine.smooth(&unsmoothed, &smoothing).unwrap();
    for (found, expected) in found.chunks(4).zip(expected.as_quats()) {
        assert!(Quat::from_slice(found).dot(*expected).abs() > 1.0 - 1e-6);
    }
    succeed(
        folder.path(),
        &["smooth", "a.dat", "-o", "out.glb", "--fps", "30"],
    );
    assert!(folder.path().join("out.glb").exists());
}

/// At its frequency a low-pass keeps 1/√2 of a motion, at twice of it a quarter, whatever the rate.
#[test]
fn a_low_pass_is_in_hz() {
    let folder = path_folder();
    for rate in [50, 100] {
        let mut text = String::new();
        for sample in 0..=8 * rate {
            let time = f64::from(sample) / f64::from(rate);
            let wave = |hz: f64| (std::f64::consts::TAU * hz * time).sin();
            let _ = writeln!(
                text,
                "{time} {} {} {} 0 0 0 1",
                wave(2.0),
                wave(4.0),
                wave(0.1)
            );
        }
        fs::write(folder.path().join("waves.tum"), text).unwrap();
        let line = [
            "smooth",
            "waves.tum",
            "--low-pass",
            "2",
            "-o",
            "low.tum",
            "--overwrite",
        ];
        succeed(folder.path(), &line);
        let text = fs::read_to_string(folder.path().join("low.tum")).unwrap();
        let rows = text.lines().filter(|line| !line.starts_with('#'));
        let rows = rows.map(|line| {
            let numbers = line
                .split_whitespace()
                .map(|number| number.parse().unwrap());
            numbers.collect::<Vec<f64>>()
        });
        // These samples are far from the ends, where the filter leaves them unchanged.
        let middle: Vec<Vec<f64>> = rows.filter(|row| (2.0..6.0).contains(&row[0])).collect();
        let largest = |column: usize| {
            middle
                .iter()
                .map(|row| row[column].abs())
                .fold(0.0, f64::max)
        };
        let expected = [std::f64::consts::FRAC_1_SQRT_2, 0.25];
        for (column, expected) in [1, 2].into_iter().zip(expected) {
            let found = largest(column);
            assert!(
                (found - expected).abs() < 0.005,
                "{rate} Hz: {found}, not {expected}"
            );
        }
        assert!(largest(3) > 0.999, "{}", largest(3));
    }
    for (hz, words) in [
        ("50", "contain no frequencies above 50 Hz"),
        ("0", "expected a number of Hz above 0"),
    ] {
        let line = ["smooth", "waves.tum", "--low-pass", hz, "-o", "no.tum"];
        let refused = run(folder.path(), &line);
        assert_eq!(refused.code, 2, "{}", refused.words);
        assert!(refused.words.contains(words), "{}", refused.words);
    }
}

#[test]
fn what_cannot_be_smoothed_is_refused() {
    let folder = path_folder();
    fs::write(
        folder.path().join("uneven.dat"),
        "# 1 1\n0 1 0 0 0\n1 1 0 0 0\n3 1 0 0 0\n",
    )
    .unwrap();
    for (code, words, line) in [
        (4, "--fps", &["uneven.dat"][..]),
        (2, "above 0", &["a.dat", "--kernel", "box:0"]),
        (2, "order", &["a.dat", "--kernel", "savitzky-golay:2:5"]),
        (2, "kernel", &["a.dat", "--kernel", "median:3"]),
        (
            2,
            "parabolic",
            &["a.dat", "--kernel", "linear", "--edges", "parabolic"],
        ),
    ] {
        let all = [&["smooth", "-o", "out.npy"], line].concat();
        let run = run(folder.path(), &all);
        assert_eq!(run.code, code, "{line:?}: {}", run.words);
        assert!(run.words.contains(words), "{line:?}: {}", run.words);
    }
    // A kernel may be wider than the track.
    succeed(
        folder.path(),
        &[
            "smooth",
            "a.dat",
            "--kernel",
            "gaussian:30",
            "-o",
            "wide.npy",
        ],
    );
}

/// A path in UTM is followed as the same path about 0 is, and its positions come back in float64: in f32 the
/// bodies would face as much as 17° beside the path.
#[test]
fn a_path_on_a_map_is_followed_as_one_at_zero() {
    let folder = sample_folder();
    let points = |origin: [f64; 3]| {
        let mut text = String::from("t,x,y,z\n");
        for i in 0..20 {
            let angle = f64::from(i) * 0.3;
            let at = [angle.cos() * 4.0, angle.sin() * 4.0, angle * 0.25];
            // Rounded to the bits of an f32 near 4, so that both files contain the same points.
            let at = at.map(|number| (number * 2f64.powi(20)).round() / 2f64.powi(20));
            let [x, y, z] = [0, 1, 2].map(|axis| at[axis] + origin[axis]);
            writeln!(text, "{},{x:?},{y:?},{z:?}", f64::from(i) * 0.5).unwrap();
        }
        text
    };
    fs::write(folder.path().join("zero.csv"), points([0.0; 3])).unwrap();
    let origin = [458_075.0, 5_429_380.0, 0.0];
    fs::write(folder.path().join("map.csv"), points(origin)).unwrap();
    let follow = |name: &str, out: &str, at: &str| {
        let line = [
            "follow",
            name,
            "--fps",
            "30",
            "--path-frame",
            "fixed",
            "--direction",
            at,
            "-o",
            out,
        ];
        succeed(folder.path(), &line);
    };
    follow("zero.csv", "zero.npy", "at:1,2,50");
    follow("map.csv", "map.npy", "at:458076,5429382,50");
    let (shape, zero) = numbers(&folder.path().join("zero.npy"));
    let bytes = fs::read(folder.path().join("map.npy")).unwrap();
    let file = npyz::NpyFile::new(&bytes[..]).unwrap();
    assert_eq!(file.shape(), shape);
    let map: Vec<f64> = file.into_vec().unwrap();
    for (index, (map, zero)) in map.iter().zip(&zero).enumerate() {
        let moved = origin.get(index % 7).copied().unwrap_or(0.0);
        let off = (map - moved - f64::from(*zero)).abs();
        assert!(off <= 1e-6, "{index}: {map} {zero}");
    }
    // All digits are kept in text, and in the clips of motion files.
    follow("map.csv", "map.out.csv", "tangent");
    let text = fs::read_to_string(folder.path().join("map.out.csv")).unwrap();
    let first = text.lines().nth(1).unwrap();
    assert!(first.starts_with("0,0,458079,5429380,0,"), "{first}");
    follow("map.csv", "map.tum", "tangent");
    let text = fs::read_to_string(folder.path().join("map.tum")).unwrap();
    let first = text.lines().find(|line| !line.starts_with('#')).unwrap();
    assert!(first.starts_with("0 458079 5429380 0 "), "{first}");
}
