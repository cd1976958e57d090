//! Every configuration of the software drivers gives the CPU's bits, or is
//! caught by a self-test, named and refused.
#![cfg(target_os = "linux")]

use std::path::Path;

use crate::program::{Run, command, finish};
use crate::support::vulkan_devices;
use rayon::prelude::*;

const LAVAPIPE: &str = "/usr/share/vulkan/icd.d/lvp_icd.x86_64.json";
const SWIFTSHADER: &str = "/usr/lib/chromium/vk_swiftshader_icd.json";

/// Whether a driver is installed; on CI it must be.
fn is_there(driver: &str) -> bool {
    let there = Path::new(driver).exists() && !vulkan_devices().is_empty();
    assert!(
        there || std::env::var_os("CI").is_none(),
        "{driver} is not there"
    );
    if !there {
        eprintln!("NOT TESTED: {driver} is not there");
    }
    there
}

/// These methods, and all that follows from rotations, by one driver and by the CPU.
fn verify(driver: &str, methods: &str, environment: &[(&str, &str)]) -> Run {
    verify_with(&[], driver, methods, environment)
}

/// As [`verify`], with more options.
fn verify_with(more: &[&str], driver: &str, methods: &str, environment: &[(&str, &str)]) -> Run {
    let root = &crate::program::root();
    let files = ["data/pendulum.dat", "data/pendulum-random.dat"];
    let line = [
        &["verify"][..],
        &files,
        &["-m", methods, "--device", "vulkan"],
        more,
    ]
    .concat();
    let mut command = command(root, &line);
    command
        .env("VK_DRIVER_FILES", driver)
        .env_remove("VK_ADD_DRIVER_FILES")
        // The cache would return kernels of other settings.
        .env("MESA_SHADER_CACHE_DISABLE", "true")
        .envs(environment.to_vec());
    finish(command.output().unwrap())
}

#[test]
fn lavapipe_gives_the_same_bits_at_every_width_and_number_of_threads() {
    if !is_there(LAVAPIPE) {
        return;
    }
    let widths = ["128", "256", "512"];
    let all = (1..=4).flat_map(|threads| widths.map(|width| (width, threads.to_string())));
    // Each configuration compiles every kernel again. Therefore every width and every number of threads
    // is tried once; with `SOAK` set, all pairs are tried.
    let is_all = std::env::var_os("SOAK").is_some();
    let tried = |(index, _): &(usize, _)| is_all || [0, 4, 8, 9].contains(index);
    let all: Vec<(&str, String)> = all
        .enumerate()
        .filter(tried)
        .map(|(_, configuration)| configuration)
        .collect();
    all.par_iter().for_each(|(width, threads)| {
        let environment = [
            ("LP_NATIVE_VECTOR_WIDTH", *width),
            ("LP_NUM_THREADS", threads),
        ];
        // These two methods use all kernels of both forms; other methods differ only on the host.
        let run = verify(LAVAPIPE, "slerp,c2", &environment);
        let output = String::from_utf8(run.out).unwrap();
        assert_eq!(run.code, 0, "{environment:?}: {output}{}", run.words);
        assert!(output.contains(&format!("{width} bits")), "{output}");
        assert!(
            output.contains(" CPU: 0 differ"),
            "{environment:?}: {output}"
        );
    });
}

#[test]
fn swiftshader_gives_the_same_bits() {
    if !is_there(SWIFTSHADER) {
        return;
    }
    let run = verify(SWIFTSHADER, "all", &[]);
    let output = String::from_utf8(run.out).unwrap();
    assert_eq!(run.code, 0, "{output}{}", run.words);
    assert!(
        output.contains("SwiftShader") && output.contains(" CPU: 0 differ"),
        "{output}"
    );
}

/// Without SSE, Mesa's compiler makes code that rounds otherwise: which self-test
/// finds that first depends on the processor.
#[test]
fn a_driver_that_is_not_exact_is_named_and_refused() {
    if !is_there(LAVAPIPE) {
        return;
    }
    let run = verify(LAVAPIPE, "all", &[("GALLIUM_NOSSE", "1")]);
    assert_eq!(run.code, 6, "{}", run.words);
    for word in ["llvmpipe", "--allow-inexact"] {
        assert!(run.words.contains(word), "{word}: {}", run.words);
    }
    let self_tests = ["contraction", "re-association of a sum"];
    let is_reported = |check| (run.words).contains(&format!("is not exact: self-test `{check}`"));
    assert!(self_tests.into_iter().any(is_reported), "{}", run.words);
    // If the device is used nevertheless, its results differ from the CPU's. Exit code 6 is about the device, 8
    // about results.
    let run = verify_with(
        &["--allow-inexact"],
        LAVAPIPE,
        "slerp",
        &[("GALLIUM_NOSSE", "1")],
    );
    assert_eq!(run.code, 8, "{}", run.words);
    assert!(run.words.contains("bits differ"), "{}", run.words);
}
