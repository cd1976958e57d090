//! Drivers with other properties than lavapipe: they do not support all of Vulkan, bind few storage buffers, or take
//! long.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Instant, SystemTime};

use crate::application::Application;
use crate::faults::library::crowd_work;
use crate::faults::loader::{Loader, Log};
use crate::faults::on;
use crate::program::{command, finish, sample_folder};
use crate::support::{dense_set, first_difference, hostile_set};
use glam::Quat;
use tumble::crowd::{CrowdLibrary, CrowdValues};
use tumble::vulkan::VulkanError;
use tumble::vulkan::tuning::{Mapping, Reads, Transfer};
use tumble::{
    Device, Engine, EngineOptions, Error, Layout, SampleTimes, Skeleton, TrackSet, VectorMethod,
    method,
};

/// Catches an instance that does not ask for such devices, and a device that is opened without the word
/// that it is one.
#[test]
fn a_device_that_has_not_all_of_vulkan_is_listed_and_opened() {
    let Some(loader) = Loader::new() else { return };
    let folder = sample_folder();
    let (run, _) = loader.run(folder.path(), &on("vulkan"), &[]);
    assert_eq!(run.code, 0, "{}", run.words);
    let expected = fs::read(folder.path().join("o.npy")).unwrap();
    fs::remove_file(folder.path().join("o.npy")).unwrap();
    let portability = ("FAULT_PORTABILITY", "1");
    let (run, log) = loader.run(folder.path(), &on("vulkan"), &[portability]);
    assert_eq!(run.code, 0, "{}", run.words);
    assert_eq!(log.left, BTreeMap::new());
    assert!(fs::read(folder.path().join("o.npy")).unwrap() == expected);
}

/// Vulkan promises four storage buffers for a kernel. Kernels that read texel buffers need no more; what
/// needs more is refused by name.
#[test]
fn what_binds_more_storage_buffers_than_there_are_is_refused_by_name() {
    let Some(loader) = Loader::new() else { return };
    let (run, log) = loader.run_command(child("four_buffers"), &[("FAULT_STORAGE_BUFFERS", "4")]);
    assert_eq!(run.code, 0, "{}", run.words);
    assert_eq!(log.left, BTreeMap::new());
}

/// The test above runs this in a separate process.
#[test]
#[ignore = "part of what_binds_more_storage_buffers_than_there_are_is_refused_by_name"]
fn four_buffers() {
    let device = Device::list().unwrap().remove(0);
    let engine = Engine::new(device.clone()).unwrap();
    let cpu = Engine::new(Device::Cpu).unwrap();
    let set = hostile_set(2, 40);
    for frames in [
        SampleTimes::fps(60).between(0.0, 9.0),
        SampleTimes::at((0..50).map(|i| f64::from(i) * 0.1).collect()),
    ] {
        for method in [method::SLERP, method::C2] {
            let found = engine
                .upload(&set, method)
                .unwrap()
                .evaluate(&frames)
                .unwrap();
            let expected = cpu.evaluate(&set, method, &frames).unwrap();
            let difference = first_difference(expected.as_quats(), found.as_quats());
            assert_eq!(difference, None, "{method}");
        }
    }
    engine.warm(method::SLERP, tumble::Encoding::F16).unwrap();
    let known = engine.known_kernels();
    assert!(known.len() > 40 && !known.iter().any(|kernel| kernel.name == "crowd_rotations"));
    let refused = |error: &dyn std::fmt::Display| {
        let text = error.to_string();
        let expected = "binds 5 storage buffers, and the device allows 4";
        assert!(text.contains(expected), "{text}");
    };
    let mut library = CrowdLibrary::new(&Skeleton::chain(40, 1.0).unwrap()).unwrap();
    library
        .push(&set, method::SLERP, VectorMethod::Linear)
        .unwrap();
    let mut crowd = engine.crowd(&library, 10, 1).unwrap();
    refused(&crowd.submit(CrowdValues::Local).unwrap_err());
    let mut options = EngineOptions::default();
    options.reads = Reads::StorageBuffers;
    if let Err(error) = Engine::with_options(device, &options) {
        refused(&error);
    }
}

/// Catches results that are read before the host invalidated the mapped memory, and inputs that it did not flush:
/// the host's memory is separate there, and holds rubbish.
#[test]
fn memory_that_is_cached_and_not_coherent_is_made_visible() {
    let Some(loader) = Loader::new() else { return };
    let (run, log) = loader.run_command(
        child("incoherent"),
        &[("FAULT_INCOHERENT", "1"), ("TUMBLE_CACHE_DIR", "")],
    );
    assert_eq!(run.code, 0, "{}", run.words);
    assert_eq!(log.left, BTreeMap::new());
    assert!(log.card["invalidated"] > 20, "{log:?}");
    assert!(log.card["flushed"] > 0, "{log:?}");
}

/// The test above runs this in a separate process.
#[test]
#[ignore = "part of memory_that_is_cached_and_not_coherent_is_made_visible"]
fn incoherent() {
    let device = Device::list().unwrap().remove(0);
    let cpu = Engine::new(Device::Cpu).unwrap();
    let (set, frames) = (hostile_set(2, 40), SampleTimes::fps(60).between(0.0, 9.0));
    for transfer in [Transfer::InPlace, Transfer::Staged] {
        let mut options = EngineOptions::default();
        (options.transfer, options.memory) = (transfer, Some(300_000));
        let engine = Engine::with_options(device.clone(), &options).unwrap();
        for method in [method::SLERP, method::C2, method::SQUAD] {
            let clip = engine.upload(&set, method).unwrap();
            let expected = cpu.evaluate(&set, method, &frames).unwrap();
            let found = clip.evaluate(&frames).unwrap();
            let difference = first_difference(expected.as_quats(), found.as_quats());
            assert_eq!(difference, None, "{method}, {transfer:?}");
        }
        let (dense, dense_frames) = dense_set(40, 1000, 0.2);
        let expected = cpu.evaluate(&dense, method::SLERP, &dense_frames).unwrap();
        let found = engine
            .evaluate(&dense, method::SLERP, &dense_frames)
            .unwrap();
        let difference = first_difference(expected.as_quats(), found.as_quats());
        assert_eq!(difference, None, "{transfer:?}");
        crowd_work(&engine).unwrap();
        let poses = engine.evaluate(&set, method::SLERP, &frames).unwrap();
        let expected = cpu.blend(&[(&poses, 0.5), (&poses, 1.0)]).unwrap();
        let found = engine.blend(&[(&poses, 0.5), (&poses, 1.0)]).unwrap();
        let difference = first_difference(expected.as_quats(), found.as_quats());
        assert_eq!(difference, None, "{transfer:?}");
    }
}

fn child(test: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    let test = format!("faults::odd::{test}");
    command.args(["--exact", &test, "--ignored", "--nocapture"]);
    command
}

/// The files of a cache directory whose names begin so, with their contents and when they were written.
fn kept(folder: &Path, start: &str) -> BTreeMap<String, (Vec<u8>, SystemTime)> {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap);
    let named = entries.map(|entry| (entry.file_name().into_string().unwrap(), entry.path()));
    let files = named.filter(|(name, _)| name.starts_with(start));
    files
        .map(|(name, path)| {
            let changed = fs::metadata(&path).unwrap().modified().unwrap();
            (name, (fs::read(path).unwrap(), changed))
        })
        .collect()
}

/// A model of card is probed in one process, and known in the next, which then does not even open it where the CPU
/// is faster.
#[test]
fn a_card_is_probed_once() {
    let Some(loader) = Loader::new() else { return };
    let cache = tempfile::tempdir().unwrap();
    let settings = [
        ("FAULT_CARD", "rebar"),
        ("TUMBLE_CACHE_DIR", cache.path().to_str().unwrap()),
    ];
    let opened = |log: &Log| log.calls.get("vkCreateDevice").copied().unwrap_or_default();
    let (run, log) = loader.run_command(child("automatic"), &settings);
    assert_eq!(run.code, 0, "{}", run.words);
    assert_eq!(opened(&log), 1, "{log:?}");
    let first = kept(cache.path(), "probe-");
    assert_eq!(first.len(), 1, "{first:?}");
    // Lavapipe, as a card, is slower than the CPU.
    let (run, log) = loader.run_command(child("automatic"), &settings);
    assert_eq!(run.code, 0, "{}", run.words);
    assert_eq!(opened(&log), 0, "{log:?}");
    assert_eq!(kept(cache.path(), "probe-"), first);
    // A card that is known to be fast is opened and not probed.
    let (name, (bytes, _)) = first.first_key_value().unwrap();
    let mut changed = bytes[..bytes.len() - 16].to_vec();
    let time = 1_000_u64.to_le_bytes();
    let sum = name
        .bytes()
        .chain(time)
        .fold(0xcbf2_9ce4_8422_2325, |sum: u64, byte| {
            (sum ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
        });
    changed.extend(sum.to_le_bytes());
    changed.extend(time);
    fs::write(cache.path().join(name), changed).unwrap();
    let (run, log) = loader.run_command(child("automatic"), &settings);
    assert_eq!(run.code, 0, "{}", run.words);
    assert_eq!(opened(&log), 1, "{log:?}");
    assert!(run.words.contains("chosen: llvmpipe") || run.words.contains("chosen: lavapipe"));
}

/// The test above runs this in separate processes.
#[test]
#[ignore = "part of a_card_is_probed_once"]
fn automatic() {
    eprintln!("chosen: {}", Engine::auto().unwrap().device_name());
}

/// The driver's compiled kernels are kept when a process ends, and written again only when there are more of them.
#[test]
fn what_the_driver_compiled_is_kept() {
    let Some(loader) = Loader::new() else { return };
    let cache = tempfile::tempdir().unwrap();
    let settings = [("TUMBLE_CACHE_DIR", cache.path().to_str().unwrap())];
    let mut before = None;
    for round in 0..3 {
        if round == 2 {
            let name = before.iter().flat_map(BTreeMap::keys).next().cloned();
            let path: &Path = &cache.path().join::<String>(name.unwrap());
            fs::write(path, "rubbish").unwrap();
        }
        let (run, log) = loader.run_command(child("warm"), &settings);
        assert_eq!(run.code, 0, "{}", run.words);
        assert_eq!(log.left, BTreeMap::new());
        assert!(log.calls["vkCreatePipelineCache"] > 0, "{log:?}");
        let found = kept(cache.path(), "pipelines-");
        assert_eq!(found.len(), 1, "{found:?}");
        let contents = |files: &BTreeMap<String, (Vec<u8>, SystemTime)>| -> Vec<Vec<u8>> {
            files.values().map(|(bytes, _)| bytes.clone()).collect()
        };
        match &before {
            // A damaged file is replaced.
            Some(before) if round == 2 => assert_eq!(contents(before), contents(&found)),
            Some(before) => assert_eq!(*before, found),
            None => assert!(contents(&found)[0].len() > 32),
        }
        before = Some(found);
    }
}

/// The test above runs this in separate processes.
#[test]
#[ignore = "part of what_the_driver_compiled_is_kept"]
fn warm() {
    let engine = Engine::new(Device::list().unwrap().remove(0)).unwrap();
    engine.warm(method::C2, tumble::Encoding::F32).unwrap();
}

/// An application's device is never waited for as a whole, because the application may submit meanwhile: not even
/// where a wait for the engine's work fails.
#[test]
fn an_applications_device_is_not_waited_for() {
    let Some(loader) = Loader::new() else { return };
    let (run, log) = loader.run_command(child("borrowed"), &[]);
    assert_eq!(run.code, 0, "{}", run.words);
    let idle = |log: &Log| {
        log.calls
            .get("vkDeviceWaitIdle")
            .copied()
            .unwrap_or_default()
    };
    let (undisturbed, waits) = (idle(&log), log.calls["vkWaitForFences"]);
    for first in [1, waits / 2, waits] {
        let faults = format!("vkWaitForFences,-1,{first},3");
        let settings = [("FAULTS", faults.as_str()), ("MAY_FAIL", "1")];
        let (run, log) = loader.run_command(child("borrowed"), &settings);
        assert_eq!(run.code, 0, "{faults}: {}", run.words);
        assert_eq!(idle(&log), undisturbed, "{faults}");
        assert_eq!(log.left, BTreeMap::new(), "{faults}");
    }
}

/// The test above runs this in separate processes.
#[test]
#[ignore = "part of an_applications_device_is_not_waited_for"]
fn borrowed() {
    let application = Application::new();
    let work = || -> Result<(), Error> {
        let engine = application.try_engine(Mapping::Automatic)?;
        let set = hostile_set(2, 40);
        let clip = engine.upload(&set, method::C2)?;
        clip.request(&SampleTimes::fps(60).between(0.0, 9.0))
            .layout(Layout::FrameMajor)
            .evaluate()?;
        Ok(())
    };
    let outcome = work();
    if std::env::var_os("MAY_FAIL").is_none() {
        outcome.unwrap();
    }
}

/// Segments of 30 MB on a device that has 24 MB, by an engine that may use 4: a clip and a stream frame by frame ask for
/// no more than there is.
#[test]
fn clips_and_streams_keep_to_the_memory_of_a_device() {
    let Some(loader) = Loader::new() else { return };
    let memory = [("FAULT_MEMORY", "24000000")];
    let (run, log) = loader.run_command(child("bounded"), &memory);
    assert_eq!(run.code, 0, "{}", run.words);
    assert_eq!((log.short, log.left), (0, BTreeMap::new()));
}

/// The test above runs this in a separate process.
#[test]
#[ignore = "part of clips_and_streams_keep_to_the_memory_of_a_device"]
fn bounded() {
    let mut options = EngineOptions::default();
    options.memory = Some(4_000_000);
    let device = Device::list().unwrap().remove(0);
    let engine = Engine::with_options(device, &options).unwrap();
    let cpu = Engine::new(Device::Cpu).unwrap();
    let times: Vec<f64> = (0..8000).map(|key| f64::from(key) * 0.01).collect();
    let mut set = TrackSet::new();
    for track in 0..20 {
        let key = |&time: &f64| Quat::from_rotation_y((time * 0.8 + f64::from(track)) as f32);
        let keys: Vec<Quat> = times.iter().map(key).collect();
        set.push("", &times, &keys).unwrap();
    }
    let (frames, layout, method) = (
        SampleTimes::fps(25),
        Layout::FrameMajor,
        method::BESSEL_OVERHAUSER,
    );
    let expected = cpu
        .request(&set, method, &frames)
        .layout(layout)
        .evaluate()
        .unwrap();
    let clip = engine.upload(&set, method).unwrap();
    let found = clip.request(&frames).layout(layout).evaluate().unwrap();
    let difference = first_difference(expected.as_quats(), found.as_quats());
    assert_eq!(difference, None);
    let mut streamed: Vec<Quat> = Vec::new();
    let sink = |chunk: tumble::Chunk<'_>| {
        streamed.extend(chunk.rotations().unwrap());
        Ok::<(), Error>(())
    };
    let done = engine
        .request(&set, method, &frames)
        .layout(layout)
        .stream(1 << 14, sink);
    done.unwrap();
    assert_eq!(first_difference(expected.as_quats(), &streamed), None);
}

/// Scaled down: cards without the persistence daemon take tens of seconds.
#[test]
fn drivers_that_take_long_are_waited_for_and_then_not_called_broken() {
    let Some(loader) = Loader::new() else { return };
    let folder = sample_folder();
    for (wait, patience, code) in [("4000", "1", 5), ("300", "30", 0)] {
        let mut command = loader.command(command(folder.path(), &on("vulkan")));
        command
            .env("FAULT_WAIT", wait)
            .env("TUMBLE_DRIVER_SECONDS", patience);
        let started = Instant::now();
        let run = finish(command.output().unwrap());
        assert_eq!(run.code, code, "{}", run.words);
        if code == 5 {
            assert!(started.elapsed().as_secs_f64() < 3.0);
            assert!(
                run.words.contains("did not answer within 1 s"),
                "{}",
                run.words
            );
            assert!(!run.words.contains("remove it"), "{}", run.words);
        }
    }
    assert!(matches!(
        VulkanError::SlowDriver { seconds: 60 }.to_string(),
        words if words.contains("persistence daemon")
    ));
}
