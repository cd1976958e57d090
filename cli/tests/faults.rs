//! Everything that Vulkan can do wrong, done on purpose: by a loader that stands
//! between the program and the system's (`tests/fault_loader`) without the program knowing.
#![cfg(target_os = "linux")]

mod card;
mod library;
mod loader;
mod odd;
mod recorded;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::time::Instant;

use crate::faults::loader::{Loader, example};
use crate::program::{command, finish, sample_folder, succeed};
use rayon::prelude::*;

const OUT_OF_HOST_MEMORY: i32 = -1;
const OUT_OF_DEVICE_MEMORY: i32 = -2;
const INITIALIZATION_FAILED: i32 = -3;
const DEVICE_LOST: i32 = -4;
const TIMEOUT: i32 = 2;

/// The codes with which calls fail; waiting may also time out.
const RESULTS: [i32; 4] = [
    OUT_OF_HOST_MEMORY,
    OUT_OF_DEVICE_MEMORY,
    INITIALIZATION_FAILED,
    DEVICE_LOST,
];

/// Whether all faults are tried (`SOAK`); else a fixed part of them.
fn is_soaked() -> bool {
    std::env::var_os("SOAK").is_some()
}

/// The loader's list of calls is complete: a call that never fails proves nothing.
#[test]
fn every_call_that_can_fail_is_made_to() {
    let root = crate::program::root();
    let loader = fs::read_to_string(root.join("cli/tests/fault_loader/lib.rs")).unwrap();
    let mut names = 0;
    let folders = [
        "src/gpu",
        "src/gpu/engine",
        "src/gpu/physical",
        "src/gpu/kernel_check",
    ];
    let entries = folders.map(|folder| fs::read_dir(root.join(folder)).unwrap());
    let files = entries
        .into_iter()
        .flatten()
        .map(|entry| entry.unwrap().path());
    for file in files.filter(|path| path.is_file()) {
        let text = fs::read_to_string(file).unwrap();
        for part in text.split("named(\"").skip(1) {
            let name = part.split('"').next().unwrap();
            assert!(loader.contains(&format!("{name}(")), "{name}");
            names += 1;
        }
    }
    assert!(names >= 28, "only {names} calls are named");
}

/// An evaluation on that device.
fn on(device: &str) -> Vec<&str> {
    let line = "eval a.dat -o o.npy --overwrite -m c2 --device";
    line.split(' ').chain([device]).collect()
}

/// Each call fails once, at each of its occurrences in turn; and each with each error, at its last occurrence too
/// where there is time (`SOAK`).
/// A result comes all the same, by Vulkan or by the CPU, with the same bits, and nothing
/// is left behind.
#[test]
fn a_fault_anywhere_changes_no_bit_and_leaks_nothing() {
    let Some(loader) = Loader::new() else { return };
    let folder = sample_folder();
    let (undisturbed, log) = loader.run(folder.path(), &on("first"), &[]);
    assert_eq!(undisturbed.code, 0, "{}", undisturbed.words);
    assert_eq!(log.left, BTreeMap::new(), "an undisturbed run leaks");
    let expected = fs::read(folder.path().join("o.npy")).unwrap();

    let mut faults: Vec<(String, i32, usize)> = Vec::new();
    for (call, &count) in &log.calls {
        let results = RESULTS
            .iter()
            .chain((call == "vkWaitForFences").then_some(&TIMEOUT));
        for (index, &result) in results.enumerate() {
            for occurrence in 1..=count {
                let sampled = occurrence == 1 || occurrence == count && is_soaked();
                if sampled || occurrence % RESULTS.len() == index {
                    faults.push((call.clone(), result, occurrence));
                }
            }
        }
    }
    assert!(faults.len() > 200, "{} faults", faults.len());
    let wrong: Vec<String> = faults
        .par_iter()
        .filter_map(|(call, result, occurrence)| {
            let folder = sample_folder();
            let fault = format!("{call},{result},{occurrence},1");
            let (run, log) = loader.run(folder.path(), &on("first"), &[("FAULTS", &fault)]);
            let output = fs::read(folder.path().join("o.npy")).unwrap_or_default();
            let clean = log.left.is_empty() || *result == TIMEOUT;
            let right = run.code == 0 && output == expected && clean;
            (!right).then(|| format!("{fault}: {} {:?} {}", run.code, log.left, run.words))
        })
        .collect();
    assert!(
        wrong.is_empty(),
        "{} of {}: {}",
        wrong.len(),
        faults.len(),
        wrong.join("\n")
    );
}

/// A call that fails for good, with half of the errors in turn: the CPU does the work; where Vulkan was demanded
/// the program says so, and leaves no output.
#[test]
fn a_fault_that_stays_ends_vulkan() {
    let Some(loader) = Loader::new() else { return };
    let folder = sample_folder();
    let (_, log) = loader.run(folder.path(), &on("first"), &[]);
    let expected = fs::read(folder.path().join("o.npy")).unwrap();
    let harmless = [
        "vkGetQueryPoolResults",
        "vkDeviceWaitIdle",
        "vkCreatePipelineCache",
        "vkGetPipelineCacheData",
        "vkMergePipelineCaches",
    ];
    let faults: Vec<(&String, i32)> = (log.calls.keys())
        .filter(|call| !harmless.contains(&call.as_str()))
        .flat_map(|call| RESULTS.map(|result| (call, result)))
        .enumerate()
        .filter(|(index, _)| (index + index / RESULTS.len()).is_multiple_of(2) || is_soaked())
        .map(|(_, fault)| fault)
        .collect();
    faults.par_iter().for_each(|(call, result)| {
        let folder = sample_folder();
        let fault = format!("{call},{result},1,1000000");
        let (run, log) = loader.run(folder.path(), &on("first"), &[("FAULTS", &fault)]);
        assert_eq!(run.code, 0, "{fault}: {}", run.words);
        assert!(run.words.contains("on CPU ("), "{fault}: {}", run.words);
        assert_eq!(fs::read(folder.path().join("o.npy")).unwrap(), expected);
        assert_eq!(log.left, BTreeMap::new(), "{fault}");

        fs::remove_file(folder.path().join("o.npy")).unwrap();
        let (run, log) = loader.run(folder.path(), &on("vulkan"), &[("FAULTS", &fault)]);
        let absent = *result == INITIALIZATION_FAILED || run.words.contains("no Vulkan device");
        assert!(
            run.code == 6 || absent && run.code == 5,
            "{fault}: {}",
            run.words
        );
        assert!(
            run.words.contains(call.as_str()) || absent,
            "{fault}: {}",
            run.words
        );
        assert!(!folder.path().join("o.npy").exists(), "{fault}");
        assert_eq!(log.left, BTreeMap::new(), "{fault}");
    });
}

/// A lost device is opened again, three times for one piece of work and no more.
#[test]
fn a_lost_device_is_opened_again_three_times() {
    let Some(loader) = Loader::new() else { return };
    let folder = sample_folder();
    let line = on("vulkan");
    let (_, log) = loader.run(folder.path(), &line, &[]);
    let expected = fs::read(folder.path().join("o.npy")).unwrap();
    let last = log.calls["vkQueueSubmit"];
    for call in ["vkQueueSubmit", "vkWaitForFences"] {
        for losses in 1..=5 {
            let fault = format!("{call},{DEVICE_LOST},{last},{losses}");
            let _ = fs::remove_file(folder.path().join("o.npy"));
            let (run, log) = loader.run(folder.path(), &line, &[("FAULTS", &fault)]);
            assert_eq!(log.left, BTreeMap::new(), "{fault}");
            if losses <= 3 {
                assert_eq!(run.code, 0, "{fault}: {}", run.words);
                assert!(!run.words.contains("CPU"), "{fault}: {}", run.words);
                assert_eq!(fs::read(folder.path().join("o.npy")).unwrap(), expected);
                assert!(log.calls["vkCreateDevice"] > 1, "{fault}");
            } else {
                assert_eq!(run.code, 6, "{fault}: {}", run.words);
                assert!(run.words.contains("DEVICE_LOST"), "{fault}: {}", run.words);
                assert!(!folder.path().join("o.npy").exists());
            }
        }
    }
}

/// A device with little memory: pieces are halved until they fit, and the CPU does what
/// does not fit at all.
#[test]
fn too_little_memory_makes_smaller_pieces() {
    let Some(loader) = Loader::new() else { return };
    let folder = sample_folder();
    let long = |device: &'static str| {
        let line = ["eval", "a.dat", "-o", "o.npy", "--overwrite"];
        [&line[..], &["--fps", "1000000", "--device", device]].concat()
    };
    succeed(folder.path(), &long("cpu"));
    let expected = fs::read(folder.path().join("o.npy")).unwrap();
    let enough = (64 << 20).to_string();
    for (memory, fits) in [
        (enough.as_str(), true),
        ("9000000", true),
        ("300000", false),
    ] {
        for device in ["first", "vulkan"] {
            let _ = fs::remove_file(folder.path().join("o.npy"));
            let (run, log) = loader.run(folder.path(), &long(device), &[("FAULT_MEMORY", memory)]);
            assert_eq!(log.left, BTreeMap::new());
            if fits || device == "first" {
                assert_eq!(run.code, 0, "{memory}: {}", run.words);
                assert!(fs::read(folder.path().join("o.npy")).unwrap() == expected);
                assert_eq!(
                    run.words.contains("CPU ("),
                    !fits,
                    "{memory}: {}",
                    run.words
                );
            } else {
                assert_eq!(run.code, 6, "{memory}: {}", run.words);
                assert!(!folder.path().join("o.npy").exists());
            }
            let is_short = memory != enough;
            assert_eq!(log.short > 0, is_short, "{memory}: {log:?}");
        }
    }
}

/// Systems take a device from a program that keeps it busy: work that takes longer than 100 ms
/// is handed over in smaller pieces from then on, down to a smallest.
#[test]
fn a_slow_device_gets_less_at_once() {
    let Some(loader) = Loader::new() else { return };
    let folder = sample_folder();
    let line = [
        "eval",
        "a.dat",
        "-o",
        "o.npy",
        "--overwrite",
        "--fps",
        "2000000",
        "--device",
        "first",
    ];
    let submissions = |nanoseconds: &str| {
        let (run, log) = loader.run(folder.path(), &line, &[("FAULT_SLOW", nanoseconds)]);
        assert_eq!(run.code, 0, "{}", run.words);
        (
            log.calls["vkQueueSubmit"],
            fs::read(folder.path().join("o.npy")).unwrap(),
        )
    };
    let (below_limit, expected) = submissions("99000000");
    let (above_limit, found) = submissions("101000000");
    assert!(found == expected);
    let rotations = expected.len() / 16;
    assert!(
        above_limit > 2 * below_limit,
        "{below_limit} and {above_limit}"
    );
    assert!(
        above_limit < below_limit + rotations / (1 << 16) + 8,
        "{below_limit} and {above_limit}"
    );
}

/// Faults before there is a device: no loader, and drivers that are missing, broken or crash.
#[test]
fn absence_is_told_within_a_second() {
    let Some(loader) = Loader::new() else { return };
    let folder = sample_folder();
    let broken = tempfile::tempdir().unwrap();
    fs::write(broken.path().join("libvulkan.so.1"), "no library").unwrap();
    let crashing = folder.path().join("crash.json");
    let library = example("crashing_driver");
    let manifest = format!(
        r#"{{"file_format_version": "1.0.0", "ICD": {{"library_path": {library:?}, "api_version": "1.3.0"}}}}"#
    );
    fs::write(&crashing, manifest).unwrap();
    // One manifest is not JSON; the other names a library that is not one.
    let [no_manifest, no_library] =
        ["garbage.json", "library.json"].map(|name| folder.path().join(name));
    fs::write(&no_manifest, "garbage").unwrap();
    let garbage = folder.path().join("garbage.so");
    fs::write(&garbage, "\x7fELF\x02\x01\x01 garbage").unwrap();
    let manifest = fs::read_to_string(&crashing).unwrap();
    let manifest = manifest.replace(&format!("{library:?}"), &format!("{garbage:?}"));
    fs::write(&no_library, manifest).unwrap();
    let set = |variable: &'static str, value: &Path| (variable, value.as_os_str().to_owned());
    let cases = [
        (
            "a manifest of garbage",
            set("VK_DRIVER_FILES", &no_manifest),
        ),
        ("a library of garbage", set("VK_DRIVER_FILES", &no_library)),
        ("no loader", set("LD_LIBRARY_PATH", broken.path())),
        (
            "no driver",
            set("VK_DRIVER_FILES", Path::new("/nonexistent")),
        ),
        ("no device", set("FAULT_DEVICES", Path::new("none"))),
        ("no compute", set("FAULT_DEVICES", Path::new("no-compute"))),
        ("a driver that crashes", set("VK_DRIVER_FILES", &crashing)),
        ("a driver that ends", set("VK_DRIVER_FILES", &crashing)),
        ("a driver that exits", set("VK_DRIVER_FILES", &crashing)),
    ];
    for (case, (variable, value)) in cases {
        for device in ["first", "vulkan"] {
            let mut command = loader.command(command(folder.path(), &on(device)));
            if variable == "VK_DRIVER_FILES" {
                command.env("VK_ICD_FILENAMES", &value);
            }
            if case == "a driver that ends" {
                command.env("CRASH_STATUS", "0");
            }
            if case == "a driver that exits" {
                command.env("CRASH_STATUS", "exit");
            }
            let started = Instant::now();
            let run = finish(command.env(variable, &value).output().unwrap());
            assert!(
                started.elapsed().as_secs_f64() < 1.0,
                "{case}: {:?}",
                started.elapsed()
            );
            let code = if device == "first" { 0 } else { 5 };
            assert_eq!(run.code, code, "{case}: {}", run.words);
            let words = if device == "first" {
                "on CPU ("
            } else {
                "no Vulkan device: "
            };
            assert!(run.words.contains(words), "{case}: {}", run.words);
            assert!(!run.words.contains("memory"), "{case}: {}", run.words);
        }
    }
}
