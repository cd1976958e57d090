//! The Khronos validation layer over what the library does: core and synchronization checks, and checks
//! on the device itself. `cli/tests/validation.rs` plants a fault for each kind of check, and does the same
//! for the program.

use std::process::Command;

use crate::layer::Layer;

/// Tests of the engine that use Vulkan, once more; with `VALIDATE_ALL=1` all of them. Evaluations have a
/// test with a layer of its own (`vulkan::the_validation_layer_has_nothing_to_say`).
#[test]
fn no_layer_has_anything_to_say_of_the_library() {
    let mut tests = vec![
        "crowd::application_device::",
        "poses::",
        "every_way_of_copying",
    ];
    #[cfg(target_os = "linux")]
    tests.push("exported_memory_lives");
    if std::env::var_os("VALIDATE_ALL").is_some() {
        tests.extend(["crowd::", "vulkan::", "encoding::", "transforms::"]);
        tests.extend(["bit_identity::", "outside::", "stream::"]);
    }
    let itself = || Command::new(std::env::current_exe().unwrap());
    for of_file in &tests {
        let listed = itself().args([of_file, "--list"]).output().unwrap();
        let listed = String::from_utf8(listed.stdout).unwrap();
        assert!(listed.contains(": test"), "there is no test {of_file}");
    }
    for layer in Layer::all() {
        let mut command = itself();
        command.args(&tests).args(["--nocapture", "--skip"]);
        let messages = layer.messages(command.arg("the_validation_layer_has_nothing_to_say"));
        assert_eq!(messages, Vec::<String>::new(), "{}", layer.name);
    }
}
