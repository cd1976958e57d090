//! The golden hashes (`tumble_verify::golden`) on the CPU at every vector width and on every Vulkan
//! device, however its kernels read.
//!
//! `UPDATE_GOLDEN=1 cargo test golden` records them anew, `UPDATE_GOLDEN=new` only those of cases that
//! are not there yet; a change of a hash is a change of the engine's promise and belongs into the
//! changelog.

use std::fmt::Write as _;
use std::path::Path;

use crate::support::{round_robin, vulkan_engines};
use tumble::{Device, Engine, EngineOptions, VectorWidth};
use tumble_verify::golden::Golden;

/// The CPU at every vector width.
fn every_width() -> Vec<Engine> {
    let at = |width| {
        let mut options = EngineOptions::default();
        options.vector_width = Some(width);
        Engine::with_options(Device::Cpu, &options).unwrap()
    };
    VectorWidth::available().into_iter().map(at).collect()
}

/// Writes the CPU's hashes of all cases into the table; with `new`, only of cases that are not in
/// it.
fn record(golden: &Golden, update: &str) {
    let engine = Engine::new(Device::Cpu).unwrap();
    let mut table = String::new();
    for case in 0..golden.case_count() {
        let name = golden.name(case);
        let known = Golden::recorded(name).filter(|_| update == "new");
        let evaluate = || golden.evaluate(case, &engine).unwrap().hash;
        let hash = known.map_or_else(evaluate, str::to_owned);
        writeln!(table, "{hash} {name}").expect("memory takes everything");
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("verify/src/golden.txt");
    std::fs::write(path, table).unwrap();
    println!("recorded; what is compared is what was compiled: run the test again");
}

#[test]
fn results_have_the_recorded_hashes() {
    let golden = Golden::new();
    if let Some(update) = std::env::var_os("UPDATE_GOLDEN") {
        return record(&golden, &update.to_string_lossy());
    }
    assert_eq!(
        Golden::recorded_count(),
        golden.case_count(),
        "verify/src/golden.txt has other cases"
    );
    let mut wrong = Vec::new();
    let (widths, vulkan) = (every_width(), vulkan_engines(|_| {}));
    let mut compared = 0;
    for case in 0..golden.case_count() {
        let name = golden.name(case);
        let recorded = Golden::recorded(name);
        // The options change with each case, and also with each method, which has six cases.
        for engine in widths.iter().chain(round_robin(&vulkan, case + case / 6)) {
            let found = golden.evaluate(case, engine).unwrap();
            assert!(found.bytes > 0, "{name}");
            compared += 1;
            if recorded != Some(&found.hash) {
                wrong.push(format!("{name}: {} on {engine:?}", found.hash));
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "{} of {compared}:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
    println!(
        "{} results have their recorded hashes, {compared} times",
        golden.case_count()
    );
}

/// Hashes are recorded by names.
#[test]
fn no_two_cases_have_one_name() {
    let golden = Golden::new();
    let mut names: Vec<&str> = (0..golden.case_count())
        .map(|case| golden.name(case))
        .collect();
    names.sort_unstable();
    let twice = names.windows(2).find(|pair| pair[0] == pair[1]);
    assert_eq!(twice, None);
}
