//! Hours of the same work: memory and open files stay as they were, and so do the bits.

use std::fs;
use std::time::{Duration, Instant};

use tumble::{Device, Engine, EngineOptions, Layout, METHODS, SampleTimes};

use super::{Hash, engines, swinging};
use crate::support::vulkan_devices;

/// Resident memory, MB, and open files.
fn held() -> (f64, usize) {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let line = status
        .lines()
        .find(|line| line.starts_with("VmRSS:"))
        .unwrap();
    let kibibytes: f64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
    (
        kibibytes * 1024.0 / 1e6,
        fs::read_dir("/proc/self/fd").unwrap().count(),
    )
}

/// `SOAK_SECONDS` says how long; an hour unless it does.
#[test]
#[ignore = "an hour"]
fn an_hour_of_the_same_work_leaves_nothing_behind() {
    let seconds = std::env::var("SOAK_SECONDS").map_or(3600, |text| text.parse().unwrap());
    let set = swinging(64, 40, 4.0);
    let frames = SampleTimes::fps(500);
    let folder = tempfile::tempdir().unwrap();
    let started = Instant::now();
    let mut expected: Option<Hash> = None;
    let mut after_a_minute = None;
    let (mut rounds, mut peak, mut last_report) = (0u64, (0.0f64, 0), Instant::now());
    while started.elapsed() < Duration::from_secs(seconds) {
        // Engines that are kept, and one that is opened again in each round.
        let mut all = engines(&EngineOptions::default());
        all.extend(
            vulkan_devices()
                .into_iter()
                .take(1)
                .map(|device: Device| Engine::new(device).unwrap()),
        );
        for engine in &all {
            let mut hash = Hash::default();
            for method in METHODS {
                for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                    let rotations = engine
                        .request(&set, method, &frames)
                        .layout(layout)
                        .evaluate()
                        .unwrap();
                    hash.add(rotations.as_quats());
                }
            }
            assert_eq!(
                *expected.get_or_insert(hash),
                hash,
                "round {rounds}, {engine:?}"
            );
        }
        let out = folder.path().join("out");
        let mut output = tumble_formats::output::Output::create(&out, true, &[]).unwrap();
        std::io::Write::write_all(&mut output, &[0; 4096]).unwrap();
        output.commit().unwrap();
        rounds += 1;
        let now = held();
        peak = (peak.0.max(now.0), peak.1.max(now.1));
        if started.elapsed() > Duration::from_secs(60).min(Duration::from_secs(seconds) / 4) {
            let first: &(f64, usize) = after_a_minute.get_or_insert(peak);
            assert!(
                now.0 < first.0 * 1.1 + 16.0,
                "round {rounds}: {now:?}, it was {first:?}"
            );
            assert!(
                now.1 <= first.1,
                "round {rounds}: {now:?}, it was {first:?}"
            );
        }
        if last_report.elapsed() > Duration::from_secs(300) {
            println!(
                "{:.0} s, {rounds} rounds: {now:?}",
                started.elapsed().as_secs_f64()
            );
            last_report = Instant::now();
        }
    }
    println!(
        "{rounds} rounds in {seconds} s: first {after_a_minute:?}, last {:?}, hash {expected:x?}",
        held()
    );
}
