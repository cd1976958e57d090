//! Arrays whose meaning a map gives, and single arrays.

use glam::Quat;
use tumble::{FrameRate, Layout, TrackSet};
use tumble_formats::npz::{read_npy, read_npz};
use tumble_formats::{Code, Diagnostic, Loaded, ReadOptions};

use super::{fixture, mapped, sample};

/// An NPY file of f8.
fn npy(shape: &str, numbers: impl IntoIterator<Item = f64>) -> Vec<u8> {
    let text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.bytes());
    bytes.extend(numbers.into_iter().flat_map(f64::to_le_bytes));
    bytes
}

fn read(bytes: Vec<u8>, map: Option<&str>, rate: u64) -> Result<Loaded, Diagnostic> {
    let options = ReadOptions {
        source_rate: FrameRate::new(rate, 1).ok(),
        map: map.map(str::to_owned),
        ..ReadOptions::default()
    };
    read_npy("t.npy", bytes, &options)
}

/// The quaternion that stands for key `frame` of `track`, and its numbers.
fn key(track: usize, frame: usize) -> Quat {
    Quat::from_rotation_x(0.1 + track as f32 + 0.01 * frame as f32)
}

fn numbers(order: [(usize, usize); 6]) -> Vec<f64> {
    let keys = order.map(|(track, frame)| key(track, frame).to_array());
    keys.into_iter().flatten().map(f64::from).collect()
}

fn check(set: &TrackSet) {
    assert_eq!((set.track_count(), set.key_count()), (2, 6));
    for (index, track) in set.tracks().enumerate() {
        let expected: Vec<Quat> = (0..3).map(|frame| key(index, frame)).collect();
        assert_eq!(track.keys, expected, "{index}");
    }
}

const TRACK_MAJOR: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)];
const FRAME_MAJOR: [(usize, usize); 6] = [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2)];

#[test]
fn results_are_read_back_when_it_is_said_which_axis_comes_first() {
    for (shape, order, map) in [
        ("(2, 3, 4)", TRACK_MAJOR, "rotations=arr_0:track"),
        ("(3, 2, 4)", FRAME_MAJOR, "rotations=arr_0:xyzw:frame"),
    ] {
        let bytes = npy(shape, numbers(order));
        let clip = &read(bytes.clone(), Some(map), 24).unwrap().clips[0];
        check(&clip.set);
        assert_eq!(clip.set.track(1).times, [0.0, 1.0 / 24.0, 2.0 / 24.0]);
        let error = read(bytes, None, 24).unwrap_err();
        assert_eq!(error.code, Code::Ambiguous, "{error}");
    }
    let one = npy("(6, 4)", numbers(TRACK_MAJOR));
    assert_eq!(
        read(one, None, 24).unwrap().clips[0]
            .set
            .track(0)
            .keys
            .len(),
        6
    );
}

/// The NPY files that the program writes.
#[test]
fn our_own_results_are_read_back_bit_for_bit() {
    use tumble::Encoding;
    use tumble_formats::npy::NpyWriter;
    use tumble_formats::quaternion::ComponentOrder;
    for (order, word) in [
        (ComponentOrder::Xyzw, "xyzw"),
        (ComponentOrder::Wxyz, "wxyz"),
    ] {
        let mut writer = NpyWriter::new(Vec::new(), 2, 3, order, Encoding::F32).unwrap();
        writer
            .write(&TRACK_MAJOR.map(|(track, frame)| key(track, frame)))
            .unwrap();
        let map = format!("rotations=arr_0:{word}:track");
        let loaded = read(writer.finish().unwrap(), Some(&map), 30).unwrap();
        check(&loaded.clips[0].set);
    }
}

#[test]
fn columns_of_a_table_are_times_and_tracks() {
    // Time, then two quaternions of w x y z, then a position.
    let row = |frame: usize| {
        let quat = |track| {
            let [x, y, z, w] = key(track, frame).to_array().map(f64::from);
            [w, x, y, z]
        };
        let time = [0.25 * frame as f64];
        [&time[..], &quat(0), &quat(1), &[frame as f64, 2.0, 3.0]].concat()
    };
    let bytes = npy("(3, 12)", (0..3).flat_map(row));
    let map = "time=arr_0[0],hip=arr_0[1:5]:wxyz,knee=arr_0[5:9]:wxyz,translations=arr_0[9:12]";
    let clip = &read(bytes.clone(), Some(map), 0).unwrap().clips[0];
    check(&clip.set);
    assert_eq!(clip.set.track(0).times, [0.0, 0.25, 0.5]);
    assert_eq!(clip.set.track(1).name, Some("knee"));
    let mut expected = TrackSet::new();
    for (track, name) in ["hip", "knee"].into_iter().enumerate() {
        expected
            .push(name, &[0.0, 0.25, 0.5], clip.set.track(track).keys)
            .unwrap();
    }
    let moved = [0.0, 1.0, 2.0].map(|x| glam::Vec3::new(x, 2.0, 3.0));
    expected
        .set_translations(0, &[0.0, 0.25, 0.5], &moved, &[])
        .unwrap();
    assert_eq!(clip.set, expected);
    for (map, code) in [
        ("time=arr_0,hip=arr_0[1:5]", Code::Shape),
        ("time=arr_0[12],hip=arr_0[1:5]", Code::Shape),
        ("hip=arr_0[9:13]", Code::Shape),
        ("hip=arr_0[1:4]", Code::Shape),
        ("hip=arr_0", Code::Shape),
        ("hip=keys[1:5]", Code::Map),
        ("time=arr_0[0]", Code::Map),
        ("hip=arr_0[1:5]:wzyx", Code::Map),
        ("hip=arr_0[1:5],names=arr_0", Code::ElementType),
    ] {
        let error = read(bytes.clone(), Some(map), 1).unwrap_err();
        assert_eq!(error.code, code, "{map}: {error}");
    }
}

#[test]
fn arrays_of_any_names_are_told_by_a_map() {
    let fixture = fixture("npz/unknown_arrays.npz");
    let loaded = read_npz("t", fixture, &mapped("rotations=keys,time=t")).unwrap();
    assert_eq!(loaded.clips[0].set.track(1).times, [0.0, 1.0, 2.0]);
    assert!(loaded.document.is_none());
    let Some(path) = sample("own_names.npz") else {
        return;
    };
    let bytes = std::fs::read(path).unwrap();
    let map = "rotations=keys:wxyz,time=times,names=names";
    let loaded = read_npz("own_names.npz", bytes.clone(), &mapped(map)).unwrap();
    let clip = &loaded.clips[0];
    assert_eq!((clip.set.track_count(), clip.rate), (4, None));
    assert_eq!(clip.set.track(3).name, Some("d"));
    // As stored, w first: 0.8755611 -0.1415907 -0.2659065 -0.37767524 at 0.06707358 s.
    let first = clip.set.track(0);
    assert_eq!(
        first.keys[0],
        Quat::from_xyzw(-0.1415907, -0.2659065, -0.377_675_24, 0.8755611)
    );
    assert!((first.times[0] - 0.067_073_58).abs() < 5e-9);
    let bodies = std::fs::read(sample("bodies_like.npz").unwrap()).unwrap();
    let bodies = read_npz("b", bodies, &ReadOptions::default()).unwrap();
    for (track, other) in clip.set.tracks().zip(bodies.clips[0].set.tracks()) {
        assert_eq!(track.keys, other.keys);
    }
    // Without the map the arrays are named.
    let error = read_npz("own_names.npz", bytes, &ReadOptions::default()).unwrap_err();
    assert_eq!(error.code, Code::UnknownArrays);
    assert!(error.message.contains("`keys` (4, 121, 4) f4"), "{error}");
}

/// Times, or names, tell the axes apart; where both lengths are the same only the map does.
#[test]
fn lengths_tell_the_axes() {
    let square = npy("(2, 2, 4)", numbers(TRACK_MAJOR).into_iter().take(16));
    let error = read(square.clone(), Some("rotations=arr_0"), 30).unwrap_err();
    assert_eq!(error.code, Code::Ambiguous);
    assert!(read(square, Some("rotations=arr_0:frame"), 30).is_ok());
    let bytes = fixture("npz/own.npz");
    for (map, code) in [
        ("rotations=rotations,time=times", None),
        (
            "rotations=rotations,names=names,fps=parents",
            Some(Code::FrameRate),
        ),
        ("rotations=rotations,time=times,parents=parents", None),
        (
            "rotations=rotations,time=parents,names=names",
            Some(Code::Shape),
        ),
    ] {
        let found = read_npz("t", bytes.clone(), &mapped(map));
        assert_eq!(found.err().map(|error| error.code), code, "{map}");
    }
    assert_eq!(
        Layout::TrackMajor,
        "a=b:track"
            .parse::<tumble_formats::map::Map>()
            .unwrap()
            .entries[0]
            .layout
            .unwrap()
    );
}
