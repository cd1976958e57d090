//! The loader that fails on purpose, and its log.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::program::{Run, command, finish};
use crate::support::{lavapipe, vulkan_devices};

/// The system's loader, and a folder in which ours has its name.
pub(super) struct Loader {
    real: PathBuf,
    folder: tempfile::TempDir,
}

/// A library that `cargo test` builds among the examples. If only some tests were requested, it may be
/// missing or old. Then it is built here. This compiles the engine again, because one package alone enables
/// other features than all packages together.
pub(super) fn example(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_BIN_EXE_tumble")).parent().unwrap();
    let library = folder.join(format!("examples/lib{name}.so"));
    let source = crate::program::root().join(format!("cli/tests/{name}/lib.rs"));
    let changed = |path: &Path| fs::metadata(path).and_then(|found| found.modified());
    let is_current = changed(&library).is_ok_and(|built| built > changed(&source).unwrap());
    if !is_current {
        let is_release = folder.ends_with("release");
        let profile = if is_release { "release" } else { "dev" };
        let built = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "--example", name, "--profile", profile])
            .status();
        assert!(built.unwrap().success(), "the example {name} builds");
    }
    library
}

impl Loader {
    /// `None` if there is no Vulkan in which calls could fail.
    pub(super) fn new() -> Option<Self> {
        if vulkan_devices().is_empty() {
            return None;
        }
        let list = Command::new("/sbin/ldconfig").arg("-p").output().unwrap();
        let list = String::from_utf8(list.stdout).unwrap();
        let line = list.lines().find(|line| line.contains("libvulkan.so.1 "));
        let real = line.and_then(|line| line.split("=> ").nth(1)).unwrap();
        let folder = tempfile::tempdir().unwrap();
        fs::copy(
            example("fault_loader"),
            folder.path().join("libvulkan.so.1"),
        )
        .unwrap();
        Some(Self {
            real: real.trim().into(),
            folder,
        })
    }

    pub(super) fn command(&self, mut command: Command) -> Command {
        command
            .env("LD_LIBRARY_PATH", self.folder.path())
            .env("REAL_LOADER", &self.real);
        // One device, so that the one that fails is the one requested.
        if let Some(lavapipe) = lavapipe() {
            command.env("VK_DRIVER_FILES", lavapipe);
            command.env_remove("VK_ADD_DRIVER_FILES");
        }
        command
    }

    /// A run with these faults, and its log.
    pub(super) fn run(
        &self,
        folder: &Path,
        line: &[&str],
        environment: &[(&str, &str)],
    ) -> (Run, Log) {
        self.run_command(command(folder, line), environment)
    }

    pub(super) fn run_command(&self, command: Command, environment: &[(&str, &str)]) -> (Run, Log) {
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

/// The events that the loader recorded.
#[derive(Debug)]
pub(super) struct Log {
    /// Calls of the process that made most of them (the other one probed the drivers).
    pub(super) calls: BTreeMap<String, usize>,
    /// Objects created and not destroyed, in all processes.
    pub(super) left: BTreeMap<String, i64>,
    /// Allocations that were refused for want of memory.
    pub(super) short: usize,
    /// How often each event of a card occurred (`FAULT_CARD`).
    pub(super) card: BTreeMap<String, usize>,
}

impl Log {
    fn new(text: &str) -> Self {
        let mut calls: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
        let (mut left, mut short) = (BTreeMap::new(), 0);
        let mut card: BTreeMap<String, usize> = BTreeMap::new();
        for line in text.lines() {
            let words: Vec<&str> = line.split(' ').collect();
            let name = words[2].to_owned();
            match words[1] {
                "call" => {
                    let process = calls.entry(words[0].to_owned()).or_default();
                    *process.entry(name).or_default() += 1;
                }
                "made" => *left.entry(name).or_default() += 1,
                "destroyed" => *left.entry(name).or_default() -= 1,
                "card" => *card.entry(words[2..].join(" ")).or_default() += 1,
                _ => short += 1,
            }
        }
        left.retain(|_, count| *count != 0);
        let total = |calls: &BTreeMap<String, usize>| calls.values().sum::<usize>();
        Self {
            calls: calls.into_values().max_by_key(total).unwrap_or_default(),
            left,
            short,
            card,
        }
    }
}
