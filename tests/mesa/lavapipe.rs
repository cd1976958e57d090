//! Tests a lavapipe that is newer than the system's by years: the recorded hashes, the self-test, and one way of
//! reading compared with the CPU.

use std::path::Path;
use std::process::Command;

use super::{newer, with_driver};
use tumble::Device;

/// The tests that are run once more. The golden hashes have every method, store, layout and pass;
/// the longest tests, of tens of millions of rotations, every memory budget and every way to read, are
/// left to the system's driver.
const TESTS: [&str; 2] = ["golden::", "vulkan::every_device_passes_every_check"];

/// And where there is time (`SOAK`).
const SOAKED: &str = "bit_identity::arbitrary_times_have_the_same_bits";

#[test]
fn the_newer_lavapipe_gives_the_same_bits() {
    let Some(manifest) = newer("lvp") else {
        return;
    };
    // The tests share a cache that is empty at first, so kernels are compiled once.
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mesa-lavapipe");
    let _ = std::fs::remove_dir_all(&cache);
    std::fs::create_dir_all(&cache).unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(std::env::current_exe().unwrap());
        let output = with_driver(command.args(arguments), &manifest)
            .env("MESA_SHADER_CACHE_DISABLE", "false")
            .env("MESA_SHADER_CACHE_DIR", &cache)
            .env("TUMBLE_TEST_ONE_WAY", "1")
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {said}{errors}");
        said
    };
    let one = "mesa::lavapipe::names_its_driver";
    let said = run(&["--exact", one, "--ignored", "--nocapture"]);
    let version = said.split("llvmpipe Mesa ").nth(1).expect(&said);
    let version: u32 = version.split('.').next().unwrap().parse().unwrap();
    assert!(version >= 25, "{said}");
    let mut tests = TESTS.to_vec();
    tests.extend(std::env::var_os("SOAK").map(|_| SOAKED));
    let said = run(&tests);
    for test in tests {
        let has_run = said.contains(&format!("test {test}"));
        assert!(has_run, "no test is `{test}`: {said}");
    }
    std::fs::remove_dir_all(&cache).unwrap();
}

/// The test above runs this in a separate process.
#[test]
#[ignore = "says which driver there is; run by the_newer_lavapipe_gives_the_same_bits"]
fn names_its_driver() {
    for device in Device::list().unwrap() {
        let Device::Vulkan(device) = device else {
            continue;
        };
        println!("{}", device.info().driver);
    }
}
