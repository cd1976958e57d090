//! Damaged and arbitrary bytes: an answer, never a panic.

use proptest::prelude::*;
use tumble::FrameRate;
use tumble_formats::ReadOptions;
use tumble_formats::npz::{read_npy, read_npz};

use super::fixture;

fn options(map: &str) -> ReadOptions {
    ReadOptions {
        source_rate: FrameRate::new(30, 1).ok(),
        map: (!map.is_empty()).then(|| map.to_owned()),
        ..ReadOptions::default()
    }
}

fn check(bytes: Vec<u8>, map: &str) {
    for read in [read_npz, read_npy] {
        let Ok(loaded) = read("damaged", bytes.clone(), &options(map)) else {
            continue;
        };
        for track in loaded.clips[0].set.tracks() {
            assert!(!track.keys.is_empty());
            assert!(track.keys.iter().all(|key| key.is_normalized()));
        }
        if let Some(document) = &loaded.document {
            let _ = document.frames(0, FrameRate::new(30, 1).unwrap());
        }
    }
}

const WHOLE: [&str; 7] = [
    "npz/smpl.npz",
    "npz/smplh_deflated.npz",
    "npz/zip64.npz",
    "npz/bodies.npz",
    "npz/own.npz",
    "npz/fortran.npz",
    "npy/no_rate.npy",
];

proptest! {
    #[test]
    fn damaged_files_never_panic(
        file in 0..WHOLE.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
        map in prop::sample::select(vec!["", "rotations=poses,time=fps", "a=arr_0:frame"]),
    ) {
        let mut bytes = fixture(WHOLE[file]);
        for (index, byte) in changes {
            let offset = index.index(bytes.len());
            bytes[offset] = byte;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        check(bytes, map);
    }

    /// Headers say anything.
    #[test]
    fn headers_of_any_shape_never_panic(
        kind in prop::sample::select(vec!["<f8", ">f4", "<f2", "<U0", "|S0", "<c16", "|O", "<U9"]),
        order in prop::sample::select(vec!["True", "False"]),
        shape in prop::collection::vec(
            prop::sample::select(vec![0u64, 1, 2, 3, 4, 1 << 31, 1 << 62, u64::MAX]), 0..4),
        bytes in prop::collection::vec(any::<u8>(), 0..200),
        map in prop::sample::select(vec![
            "rotations=arr_0:track", "a=arr_0[3:7],time=arr_0[0]", "a=arr_0,names=arr_0",
            "rotations=arr_0,parents=arr_0", "a=arr_0:frame,fps=arr_0",
        ]),
    ) {
        let shape: Vec<String> = shape.iter().map(|length| format!("{length},")).collect();
        let text = format!(
            "{{'descr': '{kind}', 'fortran_order': {order}, 'shape': ({})}}", shape.concat());
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend((text.len() as u16).to_le_bytes());
        file.extend(text.bytes());
        file.extend(bytes);
        check(file, map);
    }

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let mut archive = b"PK\x03\x04".to_vec();
        archive.extend(&bytes);
        check(archive, "");
        check([b"\x93NUMPY\x01\x00\x20\x00", &bytes[..]].concat(), "");
    }
}
