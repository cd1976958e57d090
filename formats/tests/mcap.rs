//! MCAP: logs that the libraries of others wrote, as tracks.

mod clocks;
mod log;

use std::fs;
use std::path::Path;

use glam::{Quat, Vec3};
use proptest::prelude::*;
use tumble::{Channel, FrameRate};
use tumble_formats::mcap::read_mcap;
use tumble_formats::{Code, Loaded, Location, ReadOptions};

fn fixture(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/mcap");
    fs::read(folder.join(name)).unwrap()
}

fn read(name: &str) -> Loaded {
    let loaded = read_mcap(name, &fixture(name), &ReadOptions::default());
    loaded.unwrap_or_else(|error| panic!("{error}"))
}

/// The numbers of `make.py`, of every compression.
#[test]
fn topics_and_pairs_of_frames_are_tracks() {
    for name in ["good.mcap", "lz4.mcap"] {
        let loaded = read(name);
        assert_eq!(loaded.refused, []);
        let codes: Vec<Code> = loaded.warnings.iter().map(|warning| warning.code).collect();
        assert_eq!(codes, [Code::McapOthers]);
        assert!(
            loaded.warnings[0]
                .message
                .ends_with("`/log` (std_msgs/msg/String)")
        );
        let clip = &loaded.clips[0];
        // The first stamp is 0.5 s before the second with which the others begin.
        assert_eq!(clip.time_offset, 1_699_999_999);
        let of = |name: &str| {
            let index = clip.set.tracks().position(|track| track.name == Some(name));
            index.unwrap_or_else(|| panic!("{name}"))
        };
        let close = |found: Quat, angle: f32| {
            let off = found.dot(Quat::from_rotation_z(angle)).abs();
            assert!(off > 1.0 - 1e-6, "{found} {angle}");
        };
        let moved = |track: usize| {
            let keys = clip.set.vector_keys(Channel::Translation, track).unwrap();
            (keys.times.to_vec(), keys.keys.to_vec())
        };
        let positions: Vec<Vec3> = (0..6u8)
            .map(|i| Vec3::new(0.5 * f32::from(i), 2.0, -1.0))
            .collect();
        for (name, first) in [("/pose", 0.999), ("/odom", 0.999), ("/unstamped", 1.0)] {
            let (times, keys) = moved(of(name));
            let expected = (0..6u8).map(|i| first + 0.1 * f64::from(i));
            let mut pairs = times.iter().zip(expected);
            assert!(
                pairs.all(|(found, expected)| (found - expected).abs() < 1e-9),
                "{name} {times:?}"
            );
            assert_eq!(keys, positions, "{name}");
            close(clip.set.track(of(name)).keys[3], 0.3);
        }
        // The last message of this topic contains the whole path.
        let (times, keys) = moved(of("/path"));
        assert_eq!(keys, positions);
        assert!((times[5] - times[0] - 0.25).abs() < 1e-9);
        let (times, keys) = moved(of("odom/base"));
        assert!((times[0] - 1.009).abs() < 1e-9);
        assert_eq!(keys[2], Vec3::new(1.0, 0.0, 1.0));
        close(clip.set.track(of("odom/base")).keys[2], -0.8);
        assert_eq!(moved(of("map/odom")).1[4], Vec3::new(1.0, 0.0, 1.0));
        // Messages that overtook each other are put in order.
        let (times, keys) = moved(of("/back"));
        assert!(times.is_sorted());
        assert_eq!(keys[0], positions[5]);
        assert_eq!(clip.set.track_count(), 7);
    }
    let plain = read("plain.mcap");
    assert_eq!(plain.clips[0].set.track_count(), 3);
    assert_eq!(plain.clips[0].rate, FrameRate::new(100, 1).ok());
}

/// The other clips are complete.
#[test]
fn a_topic_that_is_broken_is_refused_alone() {
    let loaded = read("twice.mcap");
    assert_eq!(loaded.clips[0].set.track_count(), 1);
    let [refused] = &loaded.refused[..] else {
        panic!("{:?}", loaded.refused);
    };
    assert_eq!(refused.code, Code::EqualTimes);
    assert!(
        matches!(&refused.location, Some(Location::Inside(path)) if path.starts_with("/twice at byte "))
    );
    let loaded = read("cut.mcap");
    assert!(
        loaded
            .warnings
            .iter()
            .any(|warning| warning.code == Code::McapCut)
    );
    assert!(loaded.clips[0].set.track(0).keys.len() < 6);
}

proptest! {
    #[test]
    fn damaged_files_never_panic(offset in 0usize..16_000, byte in any::<u8>(), cut in 0usize..20_000) {
        for name in ["good.mcap", "plain.mcap", "lz4.mcap"] {
            let mut bytes = fixture(name);
            let offset = offset % bytes.len();
            bytes[offset] = byte;
            bytes.truncate(cut);
            let _ = read_mcap("t", &bytes, &ReadOptions::default());
        }
    }
}
