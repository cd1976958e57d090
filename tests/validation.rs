//! The Khronos validation layer over what the library does: core and synchronization checks, and checks
//! on the device itself. `cli/tests/validation.rs` plants a fault for each kind of check, and does the same
//! for the program.

use std::process::Command;

use crate::layer::{Layer, messages_in};

/// Tests of the engine that use Vulkan, once more; with `VALIDATE_ALL=1` all of them. Evaluations have a
/// test with a layer of its own (`vulkan::the_validation_layer_has_nothing_to_say`).
#[test]
fn no_layer_has_anything_to_say_of_the_library() {
    let mut tests = vec![
        "crowd::application_device::",
        "poses::",
        "every_way_of_copying",
        "engines_on_one_queue_take_turns",
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

/// A race needs two invocations. An older layer reports races of a single one; only these messages are
/// ignored.
#[test]
fn only_a_race_of_an_invocation_with_itself_is_left_out_of_an_older_layer() {
    let race = |one, other| {
        format!(
            "(ERROR / SPEC): msgNum: 1 - Validation Error: [ SharedMemoryDataRace-RaceOnStore ]\n\
             vkCmdDispatch(): A data race was detected on the shared memory variable \"sums\" in local invocation \
             index {one} while performing a store operation. (Likely against local invocation index {other})\n"
        )
    };
    let (old, new) = (Some([1, 4, 350]), Some([1, 4, 354]));
    let other = "VUID-VkBufferCreateInfo-size-00912: size is 0\n";
    assert_eq!(messages_in(&race(64, 64), old), Vec::<String>::new());
    for (text, version, count) in [
        (race(64, 64), new, 1),
        (race(64, 64), None, 1),
        (race(64, 6), old, 1),
        (race(6, 64), old, 1),
        (other.to_owned() + &race(3, 3), old, 1),
        (race(3, 3) + other, old, 1),
        (race(3, 3) + &race(3, 4), old, 1),
    ] {
        assert_eq!(messages_in(&text, version).len(), count, "{text}");
    }
}
