//! The programs in `examples/`, run.

use std::path::PathBuf;
use std::process::Command;

use crate::support::vulkan_devices;

/// A program that was built beside this one.
pub(crate) fn program(name: &str) -> PathBuf {
    let tests = std::env::current_exe().unwrap();
    let folder = tests.parent().unwrap().parent().unwrap().join("examples");
    let program = folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    let is_built = program.exists();
    assert!(
        is_built,
        "{name} is not built: `cargo build --workspace --examples` builds it"
    );
    program
}

#[test]
fn every_example_runs_and_says_what_it_found() {
    let has_vulkan = !vulkan_devices().is_empty();
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            continue; // a workspace of its own, with dependencies of its own
        }
        let name = path.file_stem().unwrap().to_str().unwrap();
        let drawn = std::env::temp_dir().join(format!("tumble-crowd-{}.svg", std::process::id()));
        let drawn = drawn.to_str().unwrap();
        let (arguments, says): (&[&str], &str) = match name {
            "crowd" if !has_vulkan => continue, // in CI its absence has failed already
            "crowd" => (&["300", drawn], " 0 differ from the CPU's, 0 allocations"),
            "into_memory" => (&["8", "3", "5"], "0."),
            "application_device" if !has_vulkan => continue, // in CI its absence has failed already
            "application_device" => (
                &[],
                "60 joints of two clips mixed, in the world, 0 values differ",
            ),
            "same_bits" => (&[], ""),
            _ => panic!("{name}: say here what it prints"),
        };
        let run = Command::new(program(name))
            .args(arguments)
            .output()
            .unwrap();
        let (out, words) = (
            String::from_utf8_lossy(&run.stdout),
            String::from_utf8_lossy(&run.stderr),
        );
        assert!(run.status.success(), "{name}: {out}{words}");
        assert!(out.contains(says), "{name}: {out}{words}");
        if name == "crowd" {
            let picture = std::fs::read_to_string(drawn).unwrap();
            std::fs::remove_file(drawn).unwrap();
            // Fifty figures of 59 bones.
            assert_eq!(picture.matches("<path").count(), 50 * 59);
        }
    }
}
