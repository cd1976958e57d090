//! A card that the loader simulates on the software device: it has a queue that only copies, and memory of the device,
//! of the host, and of both.

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

use crate::application::Application;
use crate::faults::library::crowd_work;
use crate::faults::loader::{Loader, Log};
use crate::faults::{DEVICE_LOST, OUT_OF_DEVICE_MEMORY, on};
use crate::program::sample_folder;
use crate::support::{dense_set, first_difference, hostile_set};
use glam::Quat;
use rayon::prelude::*;
use tumble::vulkan::DeviceKind;
use tumble::vulkan::tuning::Mapping;
use tumble::{Device, Encoding, Engine, EngineOptions, Layout, SampleTimes, Skeleton, method};

/// The memory types of the loader's card, as it logs them.
const DEVICE: &str = "memory 0";
const HOST: &str = "memory 1";
const BOTH: &str = "memory 2";
const CACHED: &str = "memory 3";

fn run(loader: &Loader, card: &str) -> Log {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args([
        "--exact",
        "faults::card::card_work",
        "--ignored",
        "--nocapture",
    ]);
    let (run, log) = loader.run_command(command, &[("FAULT_CARD", card)]);
    assert_eq!(run.code, 0, "{card}: {}", run.words);
    assert_eq!(log.left, BTreeMap::new(), "{card}");
    log
}

/// Catches a copy that does not wait for its kernels, kernels that overwrite what is still to be copied,
/// and an upload in memory that it should not lie in. The loader runs copies as late as it may.
#[test]
fn a_card_copies_beside_its_kernels_and_is_written_where_the_host_sees_it() {
    let Some(loader) = Loader::new() else { return };
    for card in ["rebar", "window", "full"] {
        let log = run(&loader, card);
        let count = |event: &str| log.card.get(event).copied().unwrap_or_default();
        assert!(count("copies") > 20, "{card}: {log:?}");
        assert!(count("beside") > 10, "{card}: {log:?}");
        assert_eq!(count("disorder"), 0, "{card}: {log:?}");
        // Results are in the device's memory and are copied to cached memory of the host; both
        // families of queues may use these buffers.
        assert!(count(DEVICE) > 0 && count(CACHED) > 0, "{card}: {log:?}");
        assert!(count("shared") > 0, "{card}: {log:?}");
        // Uploads are in memory that is device-local and host-visible, if there is enough of it.
        assert!(count(BOTH) > 0, "{card}: {log:?}");
        assert_eq!(count(HOST) > 0, card != "rebar", "{card}: {log:?}");
    }
}

/// The test above runs this in a separate process.
#[test]
#[ignore = "part of a_card_copies_beside_its_kernels_and_is_written_where_the_host_sees_it"]
fn card_work() {
    let devices = Device::list().unwrap();
    let Device::Vulkan(card) = &devices[0] else {
        panic!("a Vulkan device")
    };
    assert_eq!(card.info().kind, DeviceKind::Discrete);
    let cpu = Engine::new(Device::Cpu).unwrap();
    let set = hostile_set(2, 40);
    // This set has more segments than fit into a 64th of a small window.
    let (dense, dense_frames) = dense_set(40, 1000, 0.2);
    let requests = [
        SampleTimes::fps(60).between(0.0, 9.0),
        SampleTimes::at(vec![0.3, 0.7]),
    ];
    for memory in [None, Some(300_000), Some(20_000)] {
        let mut options = EngineOptions::default();
        options.memory = memory;
        let engine = Engine::with_options(devices[0].clone(), &options).unwrap();
        let assert_same = |expected: &[Quat], found: &[Quat], label: &str| {
            assert_eq!(
                first_difference(expected, found),
                None,
                "{label}, {memory:?}"
            );
        };
        for method in [method::STEP, method::SLERP, method::C2] {
            let clip = engine.upload(&set, method).unwrap();
            let kept = cpu.upload(&set, method).unwrap();
            for frames in &requests {
                for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                    let expected = kept.request(frames).layout(layout).evaluate().unwrap();
                    let found = clip.request(frames).layout(layout).evaluate().unwrap();
                    assert_same(expected.as_quats(), found.as_quats(), method.name);
                    let encoded = memory == Some(300_000);
                    for encoding in Encoding::ALL.into_iter().filter(|_| encoded) {
                        let expected = kept
                            .request(frames)
                            .layout(layout)
                            .encoding(encoding)
                            .evaluate_bytes()
                            .unwrap();
                        let found = clip
                            .request(frames)
                            .layout(layout)
                            .encoding(encoding)
                            .evaluate_bytes()
                            .unwrap();
                        assert!(expected == found, "{method}, {encoding:?}, {memory:?}");
                    }
                }
            }
        }
        // Evaluated from segments of large angles, and directly from keys, of which there are more
        // than samples.
        let both = [method::SLERP, method::CATMULL_ROM];
        for method in both.into_iter().filter(|_| memory != Some(20_000)) {
            let expected = cpu.evaluate(&dense, method, &dense_frames).unwrap();
            let found = engine.evaluate(&dense, method, &dense_frames).unwrap();
            assert_same(expected.as_quats(), found.as_quats(), method.name);
            let clip = engine.upload(&dense, method).unwrap();
            let found = clip.evaluate(&dense_frames).unwrap();
            assert_same(expected.as_quats(), found.as_quats(), method.name);
        }
        crowd_work(&engine).unwrap();
        let skeleton = Skeleton::chain(40, 1.0).unwrap();
        let of = |engine: &Engine| -> Vec<Quat> {
            let poses = engine.evaluate(&set, method::SLERP, &requests[0]).unwrap();
            let world = engine.world(&poses, &skeleton).unwrap();
            let samples = 0..world.sample_count();
            let all = samples.filter_map(|sample| world.rotation(39, sample));
            all.collect()
        };
        let (expected, found) = (of(&cpu), of(&engine));
        assert!(!expected.is_empty());
        assert_same(&expected, &found, "world");
    }
}

/// An application's device copies on the queue that the application names, and on no other.
#[test]
fn an_application_names_the_queue_that_copies() {
    let Some(loader) = Loader::new() else { return };
    for (name, named) in [("one_queue", false), ("two_queues", true)] {
        let test = format!("faults::card::{name}");
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", &test, "--ignored", "--nocapture"]);
        let (run, log) = loader.run_command(command, &[("FAULT_CARD", "rebar")]);
        assert_eq!(run.code, 0, "{name}: {}", run.words);
        assert_eq!(log.left, BTreeMap::new(), "{name}");
        assert_eq!(log.card.contains_key("copies"), named, "{name}: {log:?}");
        assert!(!log.card.contains_key("disorder"), "{name}: {log:?}");
    }
}

fn check_application_device(change: impl Fn(&mut Application)) {
    let mut application = Application::new();
    assert!(
        application.copy_queue.is_some(),
        "the card has such a queue"
    );
    change(&mut application);
    let engine = application.engine(Mapping::Automatic);
    let set = hostile_set(4, 32);
    let frames = SampleTimes::fps(30).between(0.0, 20.0);
    for method in [method::SLERP, method::C2] {
        let found = engine.evaluate(&set, method, &frames).unwrap();
        let cpu = Engine::new(Device::Cpu).unwrap();
        let expected = cpu.evaluate(&set, method, &frames).unwrap();
        let difference = first_difference(expected.as_quats(), found.as_quats());
        assert_eq!(difference, None, "{method}");
    }
}

/// The test above runs this in a separate process.
#[test]
#[ignore = "part of an_application_names_the_queue_that_copies"]
fn one_queue() {
    check_application_device(|application| application.copy_queue = None);
}

/// The test above runs this in a separate process.
#[test]
#[ignore = "part of an_application_names_the_queue_that_copies"]
fn two_queues() {
    check_application_device(|_| {});
}

/// As `a_fault_anywhere_changes_no_bit_and_leaks_nothing`, on the card: the calls for a second queue,
/// its semaphores, and memory that is both.
#[test]
fn a_fault_on_a_card_changes_no_bit_and_leaks_nothing() {
    let Some(loader) = Loader::new() else { return };
    let folder = sample_folder();
    let card = ("FAULT_CARD", "rebar");
    let (undisturbed, log) = loader.run(folder.path(), &on("first"), &[card]);
    assert_eq!(undisturbed.code, 0, "{}", undisturbed.words);
    assert!(log.card.contains_key("copies"), "{log:?}");
    assert_eq!(log.left, BTreeMap::new());
    let expected = fs::read(folder.path().join("o.npy")).unwrap();
    let calls = [
        "vkCreateSemaphore",
        "vkCreateDevice",
        "vkCreateBuffer",
        "vkAllocateMemory",
        "vkMapMemory",
        "vkCreateCommandPool",
        "vkCreateFence",
        "vkBeginCommandBuffer",
        "vkEndCommandBuffer",
        "vkQueueSubmit",
        "vkWaitForFences",
        "vkResetFences",
    ];
    let mut faults = Vec::new();
    for call in calls {
        let count = log.calls[call];
        for result in [OUT_OF_DEVICE_MEMORY, DEVICE_LOST] {
            let mut occurrences = vec![1, count.div_ceil(2), count - count.min(2) + 1, count];
            occurrences.dedup();
            faults.extend(
                occurrences
                    .into_iter()
                    .map(|first| format!("{call},{result},{first},1")),
            );
            faults.push(format!("{call},{result},1,1000000"));
        }
    }
    faults.par_iter().for_each(|fault| {
        let folder = sample_folder();
        let (run, log) = loader.run(folder.path(), &on("first"), &[card, ("FAULTS", fault)]);
        assert_eq!(run.code, 0, "{fault}: {}", run.words);
        let output = fs::read(folder.path().join("o.npy")).unwrap();
        assert!(output == expected, "{fault}: {}", run.words);
        assert_eq!(log.left, BTreeMap::new(), "{fault}: {}", run.words);
        assert!(!log.card.contains_key("disorder"), "{fault}");
    });
}
