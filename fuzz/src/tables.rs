//! Tables: what the readers take is valid keys, what they refuse says why and, in text, where.

use tumble_formats::arrow::read_arrow;
use tumble_formats::csv::read::read_csv;
use tumble_formats::format::TimeUnit;
use tumble_formats::parquet::read_parquet;
use tumble_formats::{Diagnostic, Loaded, Location, ReadOptions};

use super::signature;

/// Parquet.
pub(crate) fn parquet(bytes: &[u8]) -> u64 {
    outcome(bytes, read_parquet("fuzz", bytes.to_vec(), &options(bytes)))
}

/// Arrow IPC, files and streams.
pub(crate) fn arrow(bytes: &[u8]) -> u64 {
    outcome(bytes, read_arrow("fuzz", bytes.to_vec(), &options(bytes)))
}

/// CSV.
pub(crate) fn csv(bytes: &[u8]) -> u64 {
    outcome(bytes, read_csv("fuzz", bytes.to_vec(), &options(bytes)))
}

/// Some inputs are read with options, by their length.
fn options(bytes: &[u8]) -> ReadOptions {
    let length = bytes.len();
    ReadOptions {
        time_unit: length.is_multiple_of(3).then_some(TimeUnit::Nanoseconds),
        source_rate: length
            .is_multiple_of(5)
            .then(|| "30".parse().expect("a rate")),
        map: length
            .is_multiple_of(7)
            .then(|| "hand=state[0:4]:wxyz,time=timestamp".to_owned()),
        ..ReadOptions::default()
    }
}

fn outcome(bytes: &[u8], read: Result<Loaded, Diagnostic>) -> u64 {
    match read {
        Ok(loaded) => {
            for clip in &loaded.clips {
                for track in clip.set.tracks() {
                    assert!(!track.keys.is_empty());
                    assert!(track.times.windows(2).all(|pair| pair[0] < pair[1]));
                    for key in track.keys {
                        assert!((key.as_dquat().length() - 1.0).abs() < 1e-6, "{key}");
                    }
                }
            }
            let said = loaded.refused.iter().chain(&loaded.warnings);
            let codes: Vec<_> = said.map(|said| said.code).collect();
            signature((codes, loaded.clips.len().min(3)))
        }
        Err(error) => {
            let lines = bytes.iter().filter(|&&byte| byte == b'\n').count() as u64;
            if let Some(Location::Text { line, column }) = error.location {
                assert!(1 <= line && line <= lines + 1, "line {line} of {lines}");
                assert!(1 <= column && column <= bytes.len() as u64 + 1);
            }
            assert!(!error.message.is_empty());
            let hint: String = error.message.chars().rev().take(12).collect();
            signature((error.code, hint))
        }
    }
}
