//! The readers of arrays, and the writer of archives.

use tumble::{FrameRate, TrackSet};
use tumble_formats::format::{Loaded, MotionOptions};
use tumble_formats::motion::SampledClip;
use tumble_formats::npz::write::write_npz;
use tumble_formats::npz::{read_npy, read_npz};
use tumble_formats::{Diagnostic, Limits, ReadOptions};

use super::{bits, signature};

fn options(map: Option<&str>) -> ReadOptions {
    ReadOptions {
        limits: Limits {
            line: 4096,
            file: 65_536,
            memory: None,
        },
        source_rate: FrameRate::new(30, 1).ok(),
        map: map.map(str::to_owned),
        ..ReadOptions::default()
    }
}

/// What is read is a clip of unit keys at increasing times, and reads back bit for bit when it is
/// written in our layout.
fn outcome(read: Result<Loaded, Diagnostic>) -> u64 {
    let loaded = match read {
        Ok(loaded) => loaded,
        Err(error) => {
            assert!(!error.message.is_empty());
            let hint: String = error.message.chars().rev().take(12).collect();
            return signature((error.code, hint));
        }
    };
    let clip = &loaded.clips[0];
    for track in clip.set.tracks() {
        assert!(!track.keys.is_empty());
        assert!(track.times.windows(2).all(|pair| pair[0] < pair[1]));
        for key in track.keys {
            assert!((key.as_dquat().length() - 1.0).abs() < 1e-6, "{key}");
        }
    }
    let frames = clip.set.track(0).times.len();
    let tracks = || clip.set.tracks();
    let rotations: Vec<_> = (0..frames)
        .flat_map(|frame| tracks().map(move |track| track.keys[frame]))
        .collect();
    let sampled = SampledClip {
        clip,
        times: clip.set.track(0).times,
        rate: None,
        rotations: &rotations,
        translations: &[],
        scales: &[],
        notes: &[],
        is_at_keys: false,
    };
    let mut written = Vec::new();
    write_npz(&[sampled], &MotionOptions::default(), &mut written).expect("memory takes it");
    let again =
        read_npz("again", written, &ReadOptions::default()).expect("a written file is read again");
    assert_eq!(bits(&again.clips[0].set), bits(&clip.set));
    let names = |set: &TrackSet| {
        let names = set.tracks().map(|track| track.name.map(str::to_owned));
        names.collect::<Vec<_>>()
    };
    assert_eq!(names(&again.clips[0].set), names(&clip.set));
    let codes: Vec<_> = loaded.warnings.iter().map(|warning| warning.code).collect();
    signature((codes, clip.set.track_count().min(5), frames.min(3)))
}

/// Archives, by the names of their arrays.
pub(crate) fn npz(bytes: &[u8]) -> u64 {
    outcome(read_npz("fuzz", bytes.to_vec(), &options(None)))
}

/// An array alone, as it is and by maps.
pub(crate) fn npy(bytes: &[u8]) -> u64 {
    let maps = [
        None,
        Some("rotations=arr_0:wxyz:track"),
        Some("time=arr_0[0],a=arr_0[1:5]"),
    ];
    let outcomes = maps.map(|map| outcome(read_npy("fuzz", bytes.to_vec(), &options(map))));
    signature(outcomes)
}
