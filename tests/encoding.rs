//! Results in other forms: the same bits from every device, namely those that the f32
//! result gives.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use crate::support::{KERNEL_OPTIONS, hostile_set, is_due, vulkan_engines};
use glam::Quat;
use tumble::vulkan::tuning::{Mapping, Reads};
use tumble::{
    Axes, Clip, Device, Encoding, Engine, Error, Interpolation, Layout, MatrixOrder, Quantity,
    SampleTimes, TrackSet, method,
};

/// The six numbers are the first two columns of the matrix; on the threads of an engine, too.
#[test]
fn encodings_on_threads_have_the_same_bits_and_6d_is_two_columns_of_the_matrix() {
    let rotation = |i: u16| Quat::from_rotation_y(0.1 * f32::from(i)) * Quat::from_rotation_x(0.3);
    let rotations: Vec<[f32; 4]> = (0..1000).map(|i| rotation(i).to_array()).collect();
    let engine = Engine::new(Device::Cpu).unwrap();
    for encoding in Encoding::ALL {
        for count in [0, 1, 256, 1000] {
            let rotations = &rotations[..count];
            let mut expected = vec![0; encoding.bytes() * count];
            encoding.encode(rotations, &mut expected).unwrap();
            let mut found = vec![1; expected.len()];
            engine.encode(rotations, encoding, &mut found).unwrap();
            assert_eq!(found, expected, "{encoding}");
        }
        let refused = engine.encode(&rotations[..2], encoding, &mut [0; 5]);
        assert!(matches!(refused, Err(Error::EncodingLength(_))));
    }
    let mut columns = vec![0.0_f32; 9 * rotations.len()];
    let bytes = bytemuck::cast_slice_mut(&mut columns);
    let by_columns = Encoding::Matrix3x3(MatrixOrder::ColumnMajor);
    by_columns.encode(&rotations, bytes).unwrap();
    let mut six = vec![0.0_f32; 6 * rotations.len()];
    let bytes = bytemuck::cast_slice_mut(&mut six);
    Encoding::SixD.encode(&rotations, bytes).unwrap();
    let first = columns.chunks(9).flat_map(|matrix| &matrix[..6]);
    assert!(six.iter().eq(first));
}

/// The shorter way, whichever quaternion of a rotation it is; on the threads of an engine, too.
#[test]
fn rotation_vectors_are_the_axis_times_the_angle() {
    let axis = glam::DVec3::new(0.6, -0.48, 0.64);
    let angles: Vec<f64> = (0..1000).map(|i| 0.00314 * f64::from(i)).collect();
    let rotation = |(i, &angle): (usize, &f64)| {
        let q = glam::DQuat::from_axis_angle(axis, angle).as_quat();
        if i.is_multiple_of(2) {
            q.to_array()
        } else {
            (-q).to_array()
        }
    };
    let rotations: Vec<[f32; 4]> = angles.iter().enumerate().map(rotation).collect();
    let engine = Engine::new(Device::Cpu).unwrap();
    let mut all = vec![f32::NAN; 3000];
    engine.rotation_vectors_into(&rotations, &mut all).unwrap();
    for (found, &angle) in all.chunks_exact(3).zip(&angles) {
        // Quaternion and vector are rounded to f32.
        let distance = glam::Vec3::from_slice(found)
            .as_dvec3()
            .distance(axis * angle);
        assert!(distance < 6e-7, "{angle} {found:?}");
    }
    for count in [0, 1, 256, 257] {
        let mut some = vec![f32::NAN; 3 * count];
        engine
            .rotation_vectors_into(&rotations[..count], &mut some)
            .unwrap();
        assert_eq!(some, all[..3 * count]);
    }
    let minus_one = [0.0, 0.0, 0.0, -1.0];
    let mut none = [f32::NAN; 3];
    engine
        .rotation_vectors_into(&[minus_one], &mut none)
        .unwrap();
    assert_eq!(none.map(f32::to_bits), [0; 3]);
    let refused = engine.rotation_vectors_into(&rotations[..2], &mut [0.0; 7]);
    assert!(matches!(refused, Err(Error::EncodingLength(_))));
}

/// Frame by frame, on cards neighbouring invocations evaluate the same run of neighbouring tracks: more tracks than fill
/// their lanes, keys on frames and off them, listed times, parts of a result, and components that are nearly 0.
#[test]
fn tracks_with_the_same_times_have_the_bits_of_the_cpu_frame_by_frame() {
    const TRACKS: usize = 45;
    let times = [0.0, 0.25, 0.9, 1.0, 2.013, 4.0, 4.5];
    let key = |i: usize| {
        let angle = if i.is_multiple_of(5) {
            1e-21
        } else {
            0.1 * (i % 7) as f32
        };
        Quat::from_rotation_x(angle) * Quat::from_rotation_z(0.2 * (i % 3) as f32)
    };
    let keys: Vec<Quat> = (0..times.len() * TRACKS).map(key).collect();
    let set = TrackSet::with_shared_times(&times, &keys).unwrap();
    let listed = (0..90).map(|i| 0.051 * f64::from(i) - 0.1).collect();
    let requests = [
        (SampleTimes::fps(60).between(-0.2, 4.7), &Encoding::ALL[..]),
        (SampleTimes::at(listed), &[Encoding::F32, Encoding::F16][..]),
    ];
    let cpu = Engine::new(Device::Cpu).unwrap();
    let engines = vulkan_engines(|_| {});
    let is_as_cards = |options: &&(Reads, Mapping)| options.1 == Mapping::Samples;
    let others = KERNEL_OPTIONS
        .iter()
        .take_while(|options| !is_as_cards(options))
        .count();
    for method in [method::SLERP, method::BESSEL_OVERHAUSER] {
        let of_cpu = cpu.upload(&set, method).unwrap();
        for (frames, encodings) in &requests {
            for engine in engines.iter().skip(others).step_by(KERNEL_OPTIONS.len()) {
                let clip = engine.upload(&set, method).unwrap();
                for &encoding in *encodings {
                    for (tracks, samples) in [(0..TRACKS, 0..80), (3..40, 11..70)] {
                        let part = |clip: &Clip| {
                            let request = clip.request(frames).layout(Layout::FrameMajor);
                            let request = request.tracks(tracks.clone()).samples(samples.clone());
                            request.encoding(encoding).evaluate_bytes().unwrap()
                        };
                        assert!(
                            part(&clip) == part(&of_cpu),
                            "{:?}, {method}, {encoding:?}, tracks {tracks:?}",
                            engine.device_name()
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn every_device_encodes_like_the_host() {
    let mut set = hostile_set(12, 24);
    // Rotations so small that their squares, or the rounding errors of the squares, are subnormal.
    for tiny in 40..72 {
        let tiny_rotation = Quat::from_xyzw(-(0.7 * 0.5f32.powi(tiny)), 0.0, 0.0, 1.0);
        let tiny_rotations = [
            tiny_rotation,
            tiny_rotation * tiny_rotation,
            tiny_rotation.conjugate(),
        ];
        set.push("", &[0.0, 5.0, 20.0], &tiny_rotations).unwrap();
    }
    let explicit = (0..500)
        .map(|i| 0.013 * f64::from((i * 29) % 500))
        .collect();
    let requests = [
        SampleTimes::fps(25).between(-1.0, 25.0),
        SampleTimes::at(explicit),
    ];
    let cpu = Engine::new(Device::Cpu).unwrap();
    let engines: Vec<Engine> = [None, Some(500_000)]
        .into_iter()
        .flat_map(|memory| vulkan_engines(|options| options.memory = memory))
        .chain([cpu.clone()])
        .collect();
    let mut round = 0;
    // Both forms, and nothing but constants.
    for method in [method::SLERP, method::BESSEL_OVERHAUSER, method::STEP] {
        let of_cpu = cpu.upload(&set, method).unwrap();
        let clips: Vec<_> = engines
            .iter()
            .map(|engine| engine.upload(&set, method).unwrap())
            .collect();
        for frames in &requests {
            for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                let rotations = of_cpu.request(frames).layout(layout).evaluate().unwrap();
                let quats: &[[f32; 4]] = bytemuck::cast_slice(rotations.as_quats());
                for encoding in Encoding::ALL {
                    let mut expected = vec![0; quats.len() * encoding.bytes()];
                    encoding.encode(quats, &mut expected).unwrap();
                    round += 1;
                    for (i, (engine, clip)) in engines.iter().zip(&clips).enumerate() {
                        if !is_due(round, i, KERNEL_OPTIONS.len()) {
                            continue;
                        }
                        let device = engine.device_name();
                        let found = clip
                            .request(frames)
                            .layout(layout)
                            .encoding(encoding)
                            .evaluate_bytes()
                            .unwrap();
                        let label = format!("{device:?}, {method}, {layout:?}, {encoding:?}");
                        assert!(found == expected, "{label}");
                        if is_due(round, i, 2 * KERNEL_OPTIONS.len()) {
                            let mut into = vec![0xff; expected.len()];
                            let request = clip.request(frames).layout(layout);
                            request.encoding(encoding).evaluate_into(&mut into).unwrap();
                            assert!(into == expected, "{label}");
                        }
                    }
                }
            }
        }
    }
}

const BEGIN: &str =
    "<!-- outputs: written by `UPDATE_EXPECTED=1 cargo test -p tumble --test all encoding` -->\n";
const END: &str = "<!-- end of outputs -->\n";

/// The guide's table of outputs is the engine's list.
#[test]
fn every_encoding_is_in_the_guide() {
    let mut table = String::from("| name | numbers | bytes | what it is |\n|---|---|---|---|\n");
    for encoding in Encoding::kinds() {
        let numbers = encoding.components().join(" ");
        let (name, bytes, summary) = (encoding.name(), encoding.bytes(), encoding.summary());
        writeln!(table, "| `{name}` | `{numbers}` | {bytes} | {summary} |").unwrap();
    }
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/methods.md");
    let text = fs::read_to_string(&page).unwrap();
    let (before, behind) = text.split_once(BEGIN).expect("the page has the table");
    let (found, after) = behind.split_once(END).expect("the table ends");
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        fs::write(&page, format!("{before}{BEGIN}{table}{END}{after}")).unwrap();
        return;
    }
    assert_eq!(
        found, table,
        "UPDATE_EXPECTED=1 writes the table of docs/methods.md"
    );
}

#[test]
fn memory_of_another_size_is_refused() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let clip = engine.upload(&hostile_set(1, 2), method::SLERP).unwrap();
    let frames = SampleTimes::at(vec![0.0, 1.0]);
    let result = (clip.request(&frames).encoding(Encoding::F16)).evaluate_into(&mut [0_u8; 33]);
    let expected = "the output has 33 bytes; the result has 32";
    assert!(matches!(&result, Err(Error::OutputBytes { .. })));
    assert_eq!(result.unwrap_err().to_string(), expected);
}

/// A velocity has no axis and no angle; as it is, or as three numbers, it can be stored.
#[test]
fn velocities_are_not_stored_as_rotations() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let velocity = Interpolation::from(method::SLERP).with_quantity(Quantity::Velocity(Axes::Body));
    let set = hostile_set(1, 8);
    let clip = engine.upload(&set, velocity).unwrap();
    let frames = SampleTimes::at(vec![0.0, 0.5, 1.0]);
    let whole = clip.rates(&frames, Layout::TrackMajor).unwrap();
    for encoding in Encoding::ALL {
        let found = clip
            .request(&frames)
            .layout(Layout::TrackMajor)
            .encoding(encoding)
            .evaluate_bytes();
        match (encoding, found) {
            (Encoding::F32 | Encoding::Vector, Ok(found)) => {
                let first = &found[..encoding.bytes()];
                let expected = whole.as_arrays()[0];
                assert_eq!(encoding.decode(first), Ok(expected));
            }
            (_, Err(Error::EncodesRotations { encoding: refused })) => {
                assert_eq!(refused, encoding);
            }
            (_, other) => panic!("{encoding:?}: {other:?}"),
        }
    }
}
