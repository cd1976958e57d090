//! Everything that Vulkan can do wrong, done on purpose: by a loader of our own in the
//! place of the system's (`tests/fault_loader`), which the program knows nothing of.
#![cfg(target_os = "linux")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use crate::program::{Run, command, finish, sample_folder, succeed};
use crate::support::{dense_set, first_difference, hostile_set, lavapipe, vulkan_devices};
use glam::Quat;
use rayon::prelude::*;
use tumble::{Device, Engine, EngineOptions, Error, Frames, Layout, Transfer, VulkanError, method};

const OUT_OF_HOST_MEMORY: i32 = -1;
const OUT_OF_DEVICE_MEMORY: i32 = -2;
const INITIALIZATION_FAILED: i32 = -3;
const DEVICE_LOST: i32 = -4;
const TIMEOUT: i32 = 2;

/// What calls fail with; waiting also takes too long.
const RESULTS: [i32; 4] = [
    OUT_OF_HOST_MEMORY,
    OUT_OF_DEVICE_MEMORY,
    INITIALIZATION_FAILED,
    DEVICE_LOST,
];

/// The system's loader, and a folder in which ours has its name.
struct Loader {
    real: PathBuf,
    own: tempfile::TempDir,
}

/// A library that `cargo test` has built among the examples.
fn example(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_BIN_EXE_tumble")).parent().unwrap();
    let profile = if folder.ends_with("release") {
        "release"
    } else {
        "dev"
    };
    let built = Command::new(env!("CARGO"))
        .args(["build", "--quiet", "--example", name, "--profile", profile])
        .status();
    assert!(built.unwrap().success(), "the example {name} builds");
    folder.join(format!("examples/lib{name}.so"))
}

impl Loader {
    /// Nothing where there is no Vulkan to go wrong.
    fn new() -> Option<Self> {
        if vulkan_devices().is_empty() {
            return None;
        }
        let list = Command::new("/sbin/ldconfig").arg("-p").output().unwrap();
        let list = String::from_utf8(list.stdout).unwrap();
        let line = list.lines().find(|line| line.contains("libvulkan.so.1 "));
        let real = line.and_then(|line| line.split("=> ").nth(1)).unwrap();
        let own = tempfile::tempdir().unwrap();
        fs::copy(example("fault_loader"), own.path().join("libvulkan.so.1")).unwrap();
        Some(Self {
            real: real.trim().into(),
            own,
        })
    }

    fn command(&self, mut command: Command) -> Command {
        command
            .env("LD_LIBRARY_PATH", self.own.path())
            .env("REAL_LOADER", &self.real);
        // One device: what fails is then the one that is asked for.
        if let Some(lavapipe) = lavapipe() {
            command.env("VK_DRIVER_FILES", lavapipe);
            command.env_remove("VK_ADD_DRIVER_FILES");
        }
        command
    }

    /// A run with these faults, and what it logged.
    fn run(&self, place: &Path, line: &[&str], environment: &[(&str, &str)]) -> (Run, Log) {
        self.run_command(command(place, line), environment)
    }

    fn run_command(&self, command: Command, environment: &[(&str, &str)]) -> (Run, Log) {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log");
        let mut command = self.command(command);
        command.env("FAULT_LOG", &log).envs(environment.to_vec());
        let run = finish(command.output().unwrap());
        assert!(
            !run.words.contains("internal error") && !run.words.contains("panicked"),
            "{environment:?}: {}",
            run.words
        );
        (run, Log::new(&fs::read_to_string(log).unwrap_or_default()))
    }
}

/// What the loader saw.
#[derive(Debug)]
struct Log {
    /// Calls of the process that made most of them (the other one probed the drivers).
    calls: BTreeMap<String, usize>,
    /// Objects created and not destroyed, in all processes.
    left: BTreeMap<String, i64>,
    /// Allocations that were refused for want of memory.
    short: usize,
}

impl Log {
    fn new(text: &str) -> Self {
        let mut calls: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
        let (mut left, mut short) = (BTreeMap::new(), 0);
        for line in text.lines() {
            let words: Vec<&str> = line.split(' ').collect();
            let name = words[2].to_owned();
            match words[1] {
                "call" => {
                    let process = calls.entry(words[0].to_owned()).or_default();
                    *process.entry(name).or_default() += 1;
                }
                "made" => *left.entry(name).or_default() += 1,
                "gone" => *left.entry(name).or_default() -= 1,
                _ => short += 1,
            }
        }
        left.retain(|_, count| *count != 0);
        let most = |calls: &BTreeMap<String, usize>| calls.values().sum::<usize>();
        Self {
            calls: calls.into_values().max_by_key(most).unwrap_or_default(),
            left,
            short,
        }
    }
}

/// Whether the loader's own list is whole: a call that nobody makes fail proves nothing.
#[test]
fn every_call_that_can_fail_is_made_to() {
    let root = crate::program::root();
    let loader = fs::read_to_string(root.join("cli/tests/fault_loader/lib.rs")).unwrap();
    let mut names = 0;
    for entry in fs::read_dir(root.join("src/gpu")).unwrap() {
        let text = fs::read_to_string(entry.unwrap().path()).unwrap();
        for part in text.split("named(\"").skip(1) {
            let name = part.split('"').next().unwrap();
            assert!(loader.contains(&format!("{name}(")), "{name}");
            names += 1;
        }
    }
    assert!(names >= 28, "only {names} calls are named");
}

const EVAL: [&str; 7] = ["eval", "a.dat", "-o", "o.npy", "--overwrite", "-m", "c2"];

/// Each call fails once, at each of its occurrences in turn; and each with each error.
/// A result comes all the same, by Vulkan or by the CPU, with the same bits, and nothing
/// is left behind.
#[test]
fn a_fault_anywhere_changes_no_bit_and_leaks_nothing() {
    let Some(loader) = Loader::new() else { return };
    let place = sample_folder();
    let (undisturbed, log) = loader.run(place.path(), &EVAL, &[]);
    assert_eq!(undisturbed.code, 0, "{}", undisturbed.words);
    assert_eq!(log.left, BTreeMap::new(), "an undisturbed run leaks");
    let expected = fs::read(place.path().join("o.npy")).unwrap();

    let mut faults: Vec<(String, i32, usize)> = Vec::new();
    for (call, &count) in &log.calls {
        let results = RESULTS
            .iter()
            .chain((call == "vkWaitForFences").then_some(&TIMEOUT));
        for (turn, &result) in results.enumerate() {
            for occurrence in 1..=count {
                let sampled = [1, count].contains(&occurrence);
                if sampled || occurrence % RESULTS.len() == turn {
                    faults.push((call.clone(), result, occurrence));
                }
            }
        }
    }
    assert!(faults.len() > 200, "{} faults", faults.len());
    let wrong: Vec<String> = faults
        .par_iter()
        .filter_map(|(call, result, occurrence)| {
            let place = sample_folder();
            let fault = format!("{call},{result},{occurrence},1");
            let (run, log) = loader.run(place.path(), &EVAL, &[("FAULTS", &fault)]);
            let output = fs::read(place.path().join("o.npy")).unwrap_or_default();
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

/// A call that fails for good: the CPU does the work; where Vulkan was demanded the
/// program says so, and leaves no output.
#[test]
fn a_fault_that_stays_ends_vulkan() {
    let Some(loader) = Loader::new() else { return };
    let place = sample_folder();
    let (_, log) = loader.run(place.path(), &EVAL, &[]);
    let expected = fs::read(place.path().join("o.npy")).unwrap();
    let harmless = ["vkGetQueryPoolResults", "vkDeviceWaitIdle"];
    let faults: Vec<(&String, i32)> = (log.calls.keys())
        .filter(|call| !harmless.contains(&call.as_str()))
        .flat_map(|call| RESULTS.map(|result| (call, result)))
        .collect();
    faults.par_iter().for_each(|(call, result)| {
        let place = sample_folder();
        let fault = format!("{call},{result},1,1000000");
        let (run, log) = loader.run(place.path(), &EVAL, &[("FAULTS", &fault)]);
        assert_eq!(run.code, 0, "{fault}: {}", run.words);
        assert!(run.words.contains("on CPU ("), "{fault}: {}", run.words);
        assert_eq!(fs::read(place.path().join("o.npy")).unwrap(), expected);
        assert_eq!(log.left, BTreeMap::new(), "{fault}");

        fs::remove_file(place.path().join("o.npy")).unwrap();
        let demanded = [&EVAL[..], &["--device", "vulkan"]].concat();
        let (run, log) = loader.run(place.path(), &demanded, &[("FAULTS", &fault)]);
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
        assert!(!place.path().join("o.npy").exists(), "{fault}");
        assert_eq!(log.left, BTreeMap::new(), "{fault}");
    });
}

/// A lost device is opened again, three times for one piece of work and no more.
#[test]
fn a_lost_device_is_opened_again_three_times() {
    let Some(loader) = Loader::new() else { return };
    let place = sample_folder();
    let line = [&EVAL[..], &["--device", "vulkan"]].concat();
    let (_, log) = loader.run(place.path(), &line, &[]);
    let expected = fs::read(place.path().join("o.npy")).unwrap();
    let last = log.calls["vkQueueSubmit"];
    for call in ["vkQueueSubmit", "vkWaitForFences"] {
        for losses in 1..=5 {
            let fault = format!("{call},{DEVICE_LOST},{last},{losses}");
            let _ = fs::remove_file(place.path().join("o.npy"));
            let (run, log) = loader.run(place.path(), &line, &[("FAULTS", &fault)]);
            assert_eq!(log.left, BTreeMap::new(), "{fault}");
            if losses <= 3 {
                assert_eq!(run.code, 0, "{fault}: {}", run.words);
                assert!(!run.words.contains("CPU"), "{fault}: {}", run.words);
                assert_eq!(fs::read(place.path().join("o.npy")).unwrap(), expected);
                assert!(log.calls["vkCreateDevice"] > 1, "{fault}");
            } else {
                assert_eq!(run.code, 6, "{fault}: {}", run.words);
                assert!(run.words.contains("DEVICE_LOST"), "{fault}: {}", run.words);
                assert!(!place.path().join("o.npy").exists());
            }
        }
    }
}

/// A device with little memory: pieces are halved until they fit, and the CPU does what
/// does not fit at all.
#[test]
fn too_little_memory_makes_smaller_pieces() {
    let Some(loader) = Loader::new() else { return };
    let place = sample_folder();
    let long = |device: &'static str| {
        let line = ["eval", "a.dat", "-o", "o.npy", "--overwrite"];
        [&line[..], &["--fps", "1000000", "--device", device]].concat()
    };
    succeed(place.path(), &long("cpu"));
    let expected = fs::read(place.path().join("o.npy")).unwrap();
    let enough = (64 << 20).to_string();
    for (memory, fits) in [
        (enough.as_str(), true),
        ("9000000", true),
        ("300000", false),
    ] {
        for device in ["first", "vulkan"] {
            let _ = fs::remove_file(place.path().join("o.npy"));
            let (run, log) = loader.run(place.path(), &long(device), &[("FAULT_MEMORY", memory)]);
            assert_eq!(log.left, BTreeMap::new());
            if fits || device == "first" {
                assert_eq!(run.code, 0, "{memory}: {}", run.words);
                assert!(fs::read(place.path().join("o.npy")).unwrap() == expected);
                assert_eq!(
                    run.words.contains("CPU ("),
                    !fits,
                    "{memory}: {}",
                    run.words
                );
            } else {
                assert_eq!(run.code, 6, "{memory}: {}", run.words);
                assert!(!place.path().join("o.npy").exists());
            }
            let is_short = memory != enough;
            assert_eq!(log.short > 0, is_short, "{memory}: {log:?}");
        }
    }
}

/// Systems take a device from whoever keeps it busy: work that takes longer than 100 ms
/// is handed over in smaller pieces from then on, down to a smallest.
#[test]
fn a_slow_device_gets_less_at_once() {
    let Some(loader) = Loader::new() else { return };
    let place = sample_folder();
    let line = [
        "eval",
        "a.dat",
        "-o",
        "o.npy",
        "--overwrite",
        "--fps",
        "2000000",
    ];
    let submissions = |nanoseconds: &str| {
        let (run, log) = loader.run(place.path(), &line, &[("FAULT_SLOW", nanoseconds)]);
        assert_eq!(run.code, 0, "{}", run.words);
        (
            log.calls["vkQueueSubmit"],
            fs::read(place.path().join("o.npy")).unwrap(),
        )
    };
    let (usual, expected) = submissions("99000000");
    let (more, found) = submissions("101000000");
    assert!(found == expected);
    let rotations = expected.len() / 16;
    assert!(more > 2 * usual, "{usual} and {more}");
    assert!(
        more < usual + rotations / (1 << 16) + 8,
        "{usual} and {more}"
    );
}

/// What is wrong before there is a device.
#[test]
fn absence_is_told_within_a_second() {
    let Some(loader) = Loader::new() else { return };
    let place = sample_folder();
    let broken = tempfile::tempdir().unwrap();
    fs::write(broken.path().join("libvulkan.so.1"), "no library").unwrap();
    let crashing = place.path().join("crash.json");
    let library = example("crashing_driver");
    let manifest = format!(
        r#"{{"file_format_version": "1.0.0", "ICD": {{"library_path": {library:?}, "api_version": "1.3.0"}}}}"#
    );
    fs::write(&crashing, manifest).unwrap();
    let set = |variable: &'static str, value: &Path| (variable, value.as_os_str().to_owned());
    let cases = [
        ("no loader", set("LD_LIBRARY_PATH", broken.path())),
        (
            "no driver",
            set("VK_DRIVER_FILES", Path::new("/nonexistent")),
        ),
        ("no device", set("FAULT_DEVICES", Path::new("none"))),
        ("no compute", set("FAULT_DEVICES", Path::new("no-compute"))),
        ("a driver that crashes", set("VK_DRIVER_FILES", &crashing)),
    ];
    for (what, (variable, value)) in cases {
        for device in ["first", "vulkan"] {
            let line = [&EVAL[..], &["--device", device]].concat();
            let mut command = loader.command(command(place.path(), &line));
            if variable == "VK_DRIVER_FILES" {
                command.env("VK_ICD_FILENAMES", &value);
            }
            let started = Instant::now();
            let run = finish(command.env(variable, &value).output().unwrap());
            assert!(
                started.elapsed().as_secs_f64() < 1.0,
                "{what}: {:?}",
                started.elapsed()
            );
            let code = if device == "first" { 0 } else { 5 };
            assert_eq!(run.code, code, "{what}: {}", run.words);
            let words = if device == "first" {
                "on CPU ("
            } else {
                "no Vulkan device: "
            };
            assert!(run.words.contains(words), "{what}: {}", run.words);
        }
    }
}

/// What the program never does: validation, results that are staged, poses put together.
/// Each call fails at its first and at its last occurrence.
#[test]
fn a_fault_in_the_library_is_an_error_and_leaks_nothing() {
    let Some(loader) = Loader::new() else { return };
    let child = || {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args([
            "--exact",
            "faults::library_work",
            "--ignored",
            "--nocapture",
        ]);
        command
    };
    let (undisturbed, log) = loader.run_command(child(), &[("WANTED", "done")]);
    assert_eq!(undisturbed.code, 0, "{}", undisturbed.words);
    assert_eq!(log.left, BTreeMap::new());
    let messenger = "vkCreateDebugUtilsMessengerEXT".to_owned();
    assert!(log.calls.contains_key(&messenger), "{:?}", log.calls);
    let mut faults = Vec::new();
    for (call, &count) in &log.calls {
        for result in [OUT_OF_HOST_MEMORY, DEVICE_LOST] {
            faults.extend([1, count].map(|first| format!("{call},{result},{first},1")));
            faults.push(format!("{call},{result},1,1000000"));
        }
    }
    // The caller's memory does not come back before what works on it has ended.
    let last = log.calls["vkWaitForFences"];
    let waits = format!("vkWaitForFences,-1,{last},1 vkDeviceWaitIdle,-2,1,3");
    let (run, log) = loader.run_command(child(), &[("FAULTS", &waits)]);
    assert_eq!(
        (run.code, &log.left),
        (0, &BTreeMap::new()),
        "{}",
        run.words
    );
    assert_eq!(log.calls["vkDeviceWaitIdle"], 4, "{log:?}");
    // Not even waiting for everything works, so that nothing may be destroyed.
    let idle = "vkWaitForFences,-1,1,1000000 vkDeviceWaitIdle,-2,1,1000000";
    let (run, log) = loader.run_command(child(), &[("FAULTS", idle)]);
    assert_eq!(run.code, 0, "{}", run.words);
    assert!(log.calls.contains_key("vkDeviceWaitIdle"), "{log:?}");
    faults.par_iter().for_each(|fault| {
        let (run, log) = loader.run_command(child(), &[("FAULTS", fault)]);
        assert_eq!(run.code, 0, "{fault}: {}", run.words);
        assert_eq!(log.left, BTreeMap::new(), "{fault}");
    });
}

/// Run by the test above, in a process of its own.
#[test]
#[ignore = "part of a_fault_in_the_library_is_an_error_and_leaks_nothing"]
fn library_work() {
    let work = || -> Result<(), Error> {
        // With the validation layer where there is one.
        let devices = match Device::list_with(true) {
            Err(VulkanError::NoValidation) => Device::list()?,
            devices => devices?,
        };
        let mut options = EngineOptions::default();
        options.transfer = Transfer::Staged;
        let engine = Engine::with_options(devices[0].clone(), &options)?;
        let set = hostile_set(2, 8);
        let clip = engine.upload(&set, method::C2)?;
        let frames = Frames::fps(30).between(0.0, 5.0);
        let poses = clip.evaluate_as(&frames, Layout::FrameMajor)?;
        engine.blend(&[(&poses, 0.5), (&poses, 1.0)])?;
        // By segments, and straight from keys.
        for frames in [frames, Frames::at(vec![0.3, 0.7])] {
            let found = engine.evaluate(&set, method::SLERP, &frames)?;
            let expected = Engine::new(Device::Cpu)?.evaluate(&set, method::SLERP, &frames)?;
            assert_eq!(
                first_difference(expected.as_quats(), found.as_quats()),
                None
            );
        }
        lent_work(devices[0].clone())
    };
    let outcome = work();
    if std::env::var_os("WANTED").is_some() {
        outcome.unwrap();
    }
}

/// More than a megabyte of keys and of results, which software devices work on where they
/// are: straight from keys, and by segments.
fn lent_work(device: Device) -> Result<(), Error> {
    let (cpu, engine) = (Engine::new(Device::Cpu)?, Engine::new(device)?);
    let (dense, frames) = dense_set(70, 1100, 0.0);
    let expected = cpu.evaluate(&dense, method::SLERP, &frames)?;
    let mut found = vec![Quat::IDENTITY; expected.as_quats().len()];
    engine.evaluate_into(
        &dense,
        method::SLERP,
        &frames,
        Layout::TrackMajor,
        &mut found,
    )?;
    assert_eq!(first_difference(expected.as_quats(), &found), None);
    found.fill(Quat::IDENTITY);
    let clip = engine.upload(&dense, method::SLERP)?;
    clip.evaluate_into(&frames, Layout::TrackMajor, &mut found)?;
    assert_eq!(first_difference(expected.as_quats(), &found), None);
    Ok(())
}
