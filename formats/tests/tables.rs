//! Parquet and Arrow: everything of the sample data against values that pyarrow reads, and damage of
//! every kind.

use std::fs;
use std::path::{Path, PathBuf};

use glam::Quat;
use proptest::prelude::*;
use tumble::{Channel, FrameRate};
use tumble_formats::arrow::read_arrow;
use tumble_formats::motion::Motion;
use tumble_formats::parquet::read_parquet;
use tumble_formats::{Code, Diagnostic, Format, Loaded, Location, ReadOptions};

use crate::support::shared_data;

fn open(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    Format::of(path).unwrap().open(path, options)
}

fn mapped(map: &str) -> ReadOptions {
    ReadOptions {
        map: Some(map.to_owned()),
        ..ReadOptions::default()
    }
}

/// The track of that name: its times and keys.
fn track<'a>(clip: &'a Motion, name: &str) -> (&'a [f64], &'a [Quat]) {
    let found = clip.set.tracks().find(|track| track.name == Some(name));
    let found = found.unwrap();
    (found.times, found.keys)
}

#[test]
fn a_row_for_each_key_is_read_whatever_packs_it_and_in_any_order() {
    let Some(folder) = shared_data() else { return };
    for name in [
        "long.parquet",
        "long_zstd.parquet",
        "long_shuffled.parquet",
        "long.arrow",
    ] {
        let loaded = open(&folder.join("parquet").join(name), &ReadOptions::default()).unwrap();
        let codes: Vec<Code> = loaded.warnings.iter().map(|it| it.code).collect();
        let expected: &[Code] = match name {
            "long_shuffled.parquet" => &[Code::RowsSorted],
            _ => &[],
        };
        assert_eq!(codes, expected, "{name}");
        let [clip] = &loaded.clips[..] else {
            panic!("{name}")
        };
        assert_eq!((clip.set.track_count(), clip.rate), (3, None));
        let ends = [
            ("hip", 40, 0.016_153_022_932_769_167, 4.189_106_851_275_248),
            ("knee", 25, 0.094_262_101_998_338_72, 2.778_290_515_002_093),
            ("ankle", 60, 0.185_678_206_283_440_34, 6.118_053_068_898_618),
        ];
        for (track_name, keys, first, last) in ends {
            let (times, found) = track(clip, track_name);
            assert_eq!(
                (times.len(), found.len()),
                (keys, keys),
                "{name}: {track_name}"
            );
            assert_eq!(
                (times[0], times[keys - 1]),
                (first, last),
                "{name}: {track_name}"
            );
        }
        // The first key, one in the middle and the last one are equal bit for bit.
        let keys = [
            (
                "hip",
                0,
                [-0.145_888_97, 0.003_622_808_3, -0.939_782_26, -0.309_051_04],
            ),
            (
                "knee",
                20,
                [-0.437_714_2, 0.533_780_46, 0.324_650_17, 0.646_596_5],
            ),
            (
                "ankle",
                59,
                [0.010_121_805, -0.383_638_95, -0.619_620_44, -0.684_681_83],
            ),
        ];
        for (track_name, key, numbers) in keys {
            let found = track(clip, track_name).1[key];
            assert_eq!(found, Quat::from_array(numbers), "{name}: {track_name}");
        }
    }
}

#[test]
fn a_row_for_each_time_is_read() {
    let Some(folder) = shared_data() else { return };
    let loaded = open(
        &folder.join("parquet/wide.parquet"),
        &ReadOptions::default(),
    )
    .unwrap();
    let clip = &loaded.clips[0];
    assert_eq!(clip.set.track_count(), 3);
    assert_eq!(clip.rate, FrameRate::new(30, 1).ok());
    let names: Vec<String> = (0..3).map(|track| clip.set.track_name(track)).collect();
    assert_eq!(names, ["hip", "knee", "ankle"]);
    let last = [
        (
            "hip",
            [-0.573_079_2, -0.492_342_77, -0.130_395_8, -0.642_009_14],
        ),
        (
            "knee",
            [0.774_278_94, 0.026_970_813, -0.601_485_8, 0.194_883_42],
        ),
        (
            "ankle",
            [0.521_682_9, -0.137_662_52, 0.127_630_86, 0.832_229_73],
        ),
    ];
    for (name, numbers) in last {
        let (times, keys) = track(clip, name);
        assert_eq!((keys.len(), times[0], times[49]), (50, 0.0, 49.0 / 30.0));
        assert_eq!(keys[49], Quat::from_array(numbers), "{name}");
    }
}

#[test]
fn episodes_are_clips_and_parts_of_lists_are_tracks() {
    let Some(folder) = shared_data() else { return };
    let path = folder.join("parquet/episodes.parquet");
    let options = mapped(
        "hand=observation.state[3:7]:xyzw,hand.translation=observation.state[0:3],tool=action:wxyz",
    );
    let loaded = open(&path, &options).unwrap();
    let shape = |clip: &Motion| (clip.name.clone().unwrap(), clip.set.key_count());
    let shapes: Vec<_> = loaded.clips.iter().map(shape).collect();
    assert_eq!(
        shapes,
        [("episode_0".to_owned(), 60), ("episode_1".to_owned(), 40)]
    );
    for clip in &loaded.clips {
        assert_eq!(clip.rate, FrameRate::new(30, 1).ok());
    }
    let second = &loaded.clips[1];
    let (times, hand) = track(second, "hand");
    assert_eq!((times[0], times[19]), (0.0, 19.0 / 30.0));
    // The values of row 49: the numbers 3 to 6 of the list, and 0 to 2.
    assert_eq!(
        hand[19],
        Quat::from_xyzw(-0.614_580_7, 0.670_267_3, 0.149_022_85, 0.388_361_36)
    );
    let moved = second
        .set
        .vector_keys(Channel::Translation, 0)
        .unwrap()
        .keys[19];
    assert_eq!(moved.to_array(), [-0.611_278_3, 0.151_563_84, 1.233_337_5]);
    // The values of row 30, with w first.
    let tool = track(second, "tool").1[0];
    assert_eq!(
        tool,
        Quat::from_xyzw(-0.162_410_54, -0.342_512_94, -0.868_039_85, 0.320_647_1)
    );
    // Each clip is refused by itself.
    let refused = open(&path, &mapped("hand=observation.state[5:9]:xyzw"))
        .unwrap()
        .refused;
    let locations: Vec<String> = refused
        .iter()
        .map(|r| r.location.clone().unwrap().to_string())
        .collect();
    assert_eq!(
        locations,
        [
            "column observation.state, row 0",
            "column observation.state, row 30"
        ]
    );
    assert_eq!(refused[0].code, Code::ListLength);
    assert!(refused[0].message.contains("8 numbers"), "{}", refused[0]);
}

#[test]
fn a_null_and_a_cut_are_refused_where_they_are() {
    let Some(folder) = shared_data() else { return };
    let error = open(
        &folder.join("parquet/bad_null.parquet"),
        &ReadOptions::default(),
    )
    .unwrap_err();
    let location = Location::Inside("column x, row 7".to_owned());
    assert_eq!((error.code, error.location), (Code::Null, Some(location)));
    let error = open(
        &folder.join("parquet/bad_cut.parquet"),
        &ReadOptions::default(),
    )
    .unwrap_err();
    assert_eq!(error.code, Code::TableDamaged);
}

fn fixtures(format: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures")
        .join(format);
    let paths = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut matching: Vec<PathBuf> = paths
        .filter(|path| Format::of(path).is_some_and(|of| of.name == format))
        .collect();
    matching.sort();
    matching
}

/// The content of a table does not depend on how it is packed.
#[test]
fn every_way_to_pack_a_table_gives_the_same_keys() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    let keys = |name: &str| {
        let loaded = open(&folder.join(name), &ReadOptions::default()).unwrap();
        let clip = &loaded.clips[0];
        assert_eq!(clip.rate, FrameRate::new(30, 1).ok(), "{name}");
        ["hip", "knee"].map(|name| {
            let (times, keys) = track(clip, name);
            (times.to_vec(), keys.to_vec())
        })
    };
    let expected = keys("parquet/long.parquet");
    assert_eq!(expected[1].0, [0.0, 1.0 / 30.0, 2.0 / 30.0]);
    for name in [
        "parquet/packed_snappy.parquet",
        "parquet/packed_lz4.parquet",
        "parquet/packed_none.parquet",
        "parquet/pages_of_version_2.parquet",
        "parquet/byte_stream_split.parquet",
        "arrow/long.arrow",
        "arrow/packed_lz4.arrow",
        "arrow/packed_zstd.arrow",
        "arrow/stream.arrows",
    ] {
        assert_eq!(keys(name), expected, "{name}");
    }
}

#[test]
fn stamps_keep_their_nanoseconds() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    for name in ["parquet/timestamps.parquet", "arrow/timestamps.arrow"] {
        let loaded = open(&folder.join(name), &ReadOptions::default()).unwrap();
        let clip = &loaded.clips[0];
        assert_eq!(clip.time_offset, 1_403_636_579);
        assert_eq!(
            track(clip, "hip").0,
            [0.763_555_584, 0.813_555_584, 0.863_555_584]
        );
    }
    let loaded = open(
        &folder.join("arrow/durations.arrow"),
        &ReadOptions::default(),
    )
    .unwrap();
    assert_eq!(track(&loaded.clips[0], "knee").0, [0.0, 0.04, 0.08]);
}

/// A page that claims 134 MB and numbers that claim 40 MB are refused by their headers.
#[test]
fn claims_are_refused_before_any_work() {
    for path in [
        "parquet/page_claims.parquet",
        "parquet/number_claims.parquet",
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/fixtures")
            .join(path);
        let started = std::time::Instant::now();
        let error = open(&path, &ReadOptions::default()).unwrap_err();
        assert_eq!(error.code, Code::TableClaims, "{error}");
        assert!(
            started.elapsed().as_millis() < 500,
            "{:?}",
            started.elapsed()
        );
    }
}

/// The places of damaged bytes, and their new values.
fn damage() -> impl Strategy<Value = Vec<(usize, u8)>> {
    prop::collection::vec((any::<usize>(), any::<u8>()), 1..6)
}

fn damaged(format: &str, file: usize, damage: &[(usize, u8)]) -> Vec<u8> {
    let paths = fixtures(format);
    let mut bytes = fs::read(&paths[file % paths.len()]).unwrap();
    if !bytes.is_empty() {
        for &(offset, byte) in damage {
            let length = bytes.len();
            bytes[offset % length] = byte;
        }
    }
    bytes
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(
        std::env::var("TABLE_CASES").map_or(400, |text| text.parse().unwrap())
    ))]

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let options = ReadOptions::default();
        for magic in [&b""[..], b"PAR1", b"ARROW1\0\0", b"\xff\xff\xff\xff\x40\0\0\0"] {
            let mut all = [magic, &bytes].concat();
            all.extend_from_slice(&magic[..magic.len().min(6)]);
            let _ = read_parquet("t", all.clone(), &options);
            let _ = read_arrow("t", all, &options);
        }
    }

    #[test]
    fn damaged_parquet_never_panics(file in any::<usize>(), damage in damage()) {
        let bytes = damaged("parquet", file, &damage);
        if let Ok(loaded) = read_parquet("t", bytes, &ReadOptions::default()) {
            check(&loaded);
        }
    }

    #[test]
    fn damaged_arrow_never_panics(file in any::<usize>(), damage in damage(), cut in 0usize..3000) {
        let mut bytes = damaged("arrow", file, &damage);
        for _ in 0..2 {
            if let Ok(loaded) = read_arrow("t", bytes.clone(), &ReadOptions::default()) {
                check(&loaded);
            }
            bytes.truncate(cut);
        }
    }
}

/// A clip that is read in spite of damage still has increasing times and unit quaternions.
fn check(loaded: &Loaded) {
    for clip in &loaded.clips {
        for track in clip.set.tracks() {
            assert!(track.times.windows(2).all(|pair| pair[0] < pair[1]));
            assert!(
                track
                    .keys
                    .iter()
                    .all(|key| (key.length() - 1.0).abs() < 1e-5)
            );
        }
    }
}
