//! The program's results against the library's, bit for bit.

use std::fs;

use crate::program::{command, finish, pendulum, run, sample_folder, succeed};
use crate::support::vulkan_devices;
use glam::Quat;
use tumble::{Device, Encoding, Engine, Layout, SampleTimes, TrackSet, method};

fn set() -> TrackSet {
    let (times, keys) = pendulum();
    TrackSet::with_shared_times(&times, &keys).unwrap()
}

/// The library's result for the file of [`sample_folder`].
fn expected(frames: &SampleTimes, layout: Layout) -> Vec<Quat> {
    let engine = Engine::new(Device::Cpu).unwrap();
    engine
        .request(&set(), method::BESSEL_OVERHAUSER, frames)
        .layout(layout)
        .evaluate()
        .unwrap()
        .as_quats()
        .to_vec()
}

fn bits(values: impl IntoIterator<Item = f32>) -> Vec<u32> {
    values.into_iter().map(f32::to_bits).collect()
}

fn read_npy(bytes_of_file: &[u8]) -> (Vec<u64>, Vec<u32>) {
    let file = npyz::NpyFile::new(bytes_of_file).unwrap();
    let shape = file.shape().to_vec();
    (shape, bits(file.into_vec::<f32>().unwrap()))
}

#[test]
fn npy_holds_the_library_s_bits_in_every_layout_and_order() {
    let folder = sample_folder();
    for (layout_flag, layout, shape) in [
        ("track", Layout::TrackMajor, vec![2, 51, 4]),
        ("frame", Layout::FrameMajor, vec![51, 2, 4]),
    ] {
        let quats = expected(&SampleTimes::fps(25), layout);
        for order in ["xyzw", "wxyz"] {
            let line = [
                "eval",
                "a.dat",
                "-o",
                "out.npy",
                "--overwrite",
                "--layout",
                layout_flag,
                "--order",
                order,
            ];
            let run = succeed(folder.path(), &line);
            assert!(
                run.words
                    .contains("2 tracks × 51 frames (25 fps, because its keys have no rate), authored (bessel-overhauser), on "),
                "{}",
                run.words
            );
            let found = read_npy(&fs::read(folder.path().join("out.npy")).unwrap());
            let components = quats.iter().flat_map(|q| match order {
                "xyzw" => [q.x, q.y, q.z, q.w],
                _ => [q.w, q.x, q.y, q.z],
            });
            assert_eq!(
                found,
                (shape.clone(), bits(components)),
                "{layout_flag}, {order}"
            );
        }
    }
}

#[test]
fn csv_holds_the_library_s_bits() {
    let folder = sample_folder();
    succeed(
        folder.path(),
        &["eval", "a.dat", "-o", "out.csv", "--fps", "10"],
    );
    let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    assert_eq!(
        header[..6],
        ["frame", "time", "box1.w", "box1.x", "box1.y", "box1.z"]
    );
    let quats = expected(&SampleTimes::fps(10), Layout::FrameMajor);
    let components = quats.iter().flat_map(|q| [q.w, q.x, q.y, q.z]);
    let found = lines.clone().flat_map(|line| {
        line.split(',')
            .skip(2)
            .map(|value| value.parse::<f32>().unwrap())
            .collect::<Vec<_>>()
    });
    assert_eq!(bits(found), bits(components));
    let last: Vec<&str> = lines.last().unwrap().split(',').take(2).collect();
    assert_eq!((last[0], last[1].parse()), ("20", Ok(2.0)));
}

#[test]
fn half_size_results_are_what_the_library_encodes() {
    let folder = sample_folder();
    let quats = expected(&SampleTimes::fps(25), Layout::TrackMajor);
    let rotations: Vec<[f32; 4]> = quats.iter().map(Quat::to_array).collect();
    for (name, encoding) in [("f16", Encoding::F16), ("snorm16", Encoding::Snorm16)] {
        let line = [
            "eval",
            "a.dat",
            "-o",
            "out.npy",
            "--overwrite",
            "--encoding",
            name,
        ];
        succeed(folder.path(), &line);
        let file = fs::read(folder.path().join("out.npy")).unwrap();
        let mut bytes = vec![0; rotations.len() * encoding.bytes()];
        encoding.encode(&rotations, &mut bytes).unwrap();
        assert!(file.ends_with(&bytes), "{name}");
        assert!(file.len() - bytes.len() <= 128, "{name}: a header, no more");
    }
    let line = ["eval", "a.dat", "-o", "out.csv", "--encoding", "f16"];
    let refused = run(folder.path(), &line);
    assert_eq!(refused.code, 2, "{}", refused.words);
}

#[test]
fn standard_input_and_output_carry_data() {
    let folder = sample_folder();
    // `-` is standard input, even if there is a file of this name.
    fs::write(folder.path().join("-"), "").unwrap();
    let quats = expected(&SampleTimes::fps(25), Layout::TrackMajor);
    let components = || bits(quats.iter().flat_map(Quat::to_array));
    for line in [&["eval", "-", "-o", "-"][..], &["eval", "-"]] {
        let output = command(folder.path(), line)
            .stdin(fs::File::open(folder.path().join("a.dat")).unwrap())
            .output()
            .unwrap();
        let run = finish(output);
        assert_eq!(run.code, 0, "{}", run.words);
        assert_eq!(read_npy(&run.out), (vec![2, 51, 4], components()));
    }
    for format in ["dat", "csv", "npz"] {
        let output = command(folder.path(), &["info", "-", "--from", format])
            .stdin(fs::File::open(folder.path().join("-")).unwrap())
            .output()
            .unwrap();
        let run = finish(output);
        let words = "standard input: error[E010]: the file is empty";
        assert!(run.code == 4 && run.words.contains(words), "{}", run.words);
    }
    let run = succeed(
        folder.path(),
        &["eval", "a.dat", "-o", "-", "--format", "csv"],
    );
    assert!(run.out.starts_with(b"frame,time,box1.w,"));
}

#[test]
fn explicit_times_are_evaluated() {
    let folder = sample_folder();
    let times = vec![0.0, 1.75, 0.3, 0.3];
    fs::write(folder.path().join("times.txt"), "0\n1.75\n0.3\n0.3\n").unwrap();
    succeed(
        folder.path(),
        &["eval", "a.dat", "--times", "times.txt", "-o", "out.npy"],
    );
    let found = read_npy(&fs::read(folder.path().join("out.npy")).unwrap());
    let quats = expected(&SampleTimes::at(times), Layout::TrackMajor);
    assert_eq!(
        found,
        (vec![2, 4, 4], bits(quats.iter().flat_map(Quat::to_array)))
    );
}

#[test]
fn every_device_writes_the_cpu_s_file() {
    let folder = sample_folder();
    for method in tumble::METHODS {
        let line = [
            "eval",
            "a.dat",
            "-m",
            method.name,
            "-o",
            "cpu.npy",
            "--overwrite",
            "--device",
            "cpu",
        ];
        assert!(succeed(folder.path(), &line).words.contains("on CPU in"));
        let expected = fs::read(folder.path().join("cpu.npy")).unwrap();
        for (index, device) in vulkan_devices().iter().enumerate() {
            for by in [index.to_string(), device.name().to_uppercase()] {
                let line = [
                    "eval",
                    "a.dat",
                    "-m",
                    method.name,
                    "-o",
                    "vk.npy",
                    "--overwrite",
                    "--device",
                    &by,
                ];
                let run = succeed(folder.path(), &line);
                assert!(
                    run.words.contains(&format!("on {} in", device.name())),
                    "{}",
                    run.words
                );
                assert!(
                    fs::read(folder.path().join("vk.npy")).unwrap() == expected,
                    "{method}"
                );
            }
        }
    }
}

/// Every output, as NPY and as CSV: its shape, and the names of its components.
#[test]
fn outputs_have_their_shapes_and_names() {
    let folder = sample_folder();
    let mut outputs = vec![
        ("quaternion", vec![2, 3, 4], "box1.w".to_owned()),
        ("velocity", vec![2, 3, 3], "box1.x".to_owned()),
        ("acceleration", vec![2, 3, 3], "box1.x".to_owned()),
        ("transform", vec![3, 2, 10], "box1.tx".to_owned()),
        ("world", vec![3, 2, 7], "box1.px".to_owned()),
    ];
    // Matrices are stored row by row and Euler angles are XYZ, the defaults.
    for encoding in Encoding::kinds() {
        if encoding.stores_rotations() && !encoding.is_quaternion() {
            let shape = [&[2, 3], encoding.shape()].concat();
            let first = format!("box1.{}", encoding.components()[0]);
            outputs.push((encoding.name(), shape, first));
        }
    }
    assert!(outputs.contains(&("matrix-3x4", vec![2, 3, 3, 4], "box1.m00".to_owned())));
    for (output, shape, first) in outputs {
        let of = |out: &str| {
            let line = [
                "eval",
                "a.dat",
                "--quantity",
                output,
                "--fps",
                "1",
                "--overwrite",
                "-o",
                out,
            ];
            succeed(folder.path(), &line);
            fs::read(folder.path().join(out)).unwrap()
        };
        let (found, numbers) = read_npy(&of("out.npy"));
        let lengths: Vec<u64> = shape.iter().map(|&length| length as u64).collect();
        assert_eq!(found, lengths, "{output}");
        let text = String::from_utf8(of("out.csv")).unwrap();
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        assert_eq!((lines.len(), lines[0][2]), (4, &*first), "{output}");
        // The last frame of the first track: the same bits in both.
        let each = numbers.len() / 6;
        let start = if shape[0] == 3 { 4 * each } else { 2 * each };
        let mut expected = numbers[start..start + each].to_vec();
        if output == "quaternion" {
            expected.rotate_right(1);
        }
        let written = lines[3][2..2 + each]
            .iter()
            .map(|number| number.parse().unwrap());
        assert_eq!(bits(written), expected, "{output}");
    }
    // Both boxes hang from the world: neither moves the other.
    let line = [
        "eval",
        "a.dat",
        "--quantity",
        "world",
        "--parents",
        "-1,-1",
        "-o",
        "apart.npy",
    ];
    succeed(folder.path(), &line);
    let (_, apart) = read_npy(&fs::read(folder.path().join("apart.npy")).unwrap());
    assert!(apart.chunks(7).all(|pose| pose[..3] == [0, 0, 0]));
    let parents = |list: &str| {
        let line = [
            "eval",
            "a.dat",
            "--quantity",
            "world",
            "--parents",
            list,
            "-o",
            "no.npy",
        ];
        run(folder.path(), &line).words
    };
    assert!(parents("-1").contains("has 1 where 2 are expected"));
    assert!(parents("1,0").contains("is its own ancestor"));
    assert!(parents("-2,0").contains("-2 is not the index of a track"));
    for (wrong, says) in [
        (
            ["--quantity", "euler", "--sequence", "XXY"],
            "no two neighbours the same",
        ),
        (
            ["--quantity", "matrix", "--encoding", "f16"],
            "for quaternions",
        ),
        (
            ["--quantity", "velocity", "--after", "mirror"],
            "cannot be mirrored",
        ),
    ] {
        let line = [&["eval", "a.dat", "-o", "no.npy"][..], &wrong].concat();
        let refused = run(folder.path(), &line);
        assert!(refused.words.contains(says), "{}", refused.words);
        assert!(!folder.path().join("no.npy").exists());
    }
}
