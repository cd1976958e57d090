//! Faults during uses of the library that do not occur in the program.

use std::collections::BTreeMap;
use std::process::Command;

use crate::faults::loader::Loader;
use crate::faults::{DEVICE_LOST, OUT_OF_HOST_MEMORY, is_soaked};
use crate::support::{dense_set, first_difference, hostile_set};
use glam::{Quat, Vec3};
use rayon::prelude::*;
use tumble::crowd::{CrowdError, CrowdLibrary, CrowdValues};
use tumble::vulkan::VulkanError;
use tumble::vulkan::tuning::{PrepareArcs, ReadBack, Transfer, Uploads};
use tumble::{
    Device, Encoding, Engine, EngineOptions, Error, Layout, SampleTimes, Skeleton, TrackSet,
    VectorMethod, method,
};

/// Uses that the program has not: validation, staged results, poses.
/// Each call fails at its first and at its last occurrence, with one error or the other in turn (`SOAK`: with both).
#[test]
fn a_fault_in_the_library_is_an_error_and_leaks_nothing() {
    let Some(loader) = Loader::new() else { return };
    let child = || {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args([
            "--exact",
            "faults::library::library_work",
            "--ignored",
            "--nocapture",
        ]);
        command
    };
    let (undisturbed, log) = loader.run_command(child(), &[("MUST_SUCCEED", "done")]);
    assert_eq!(undisturbed.code, 0, "{}", undisturbed.words);
    assert_eq!(log.left, BTreeMap::new());
    let messenger = "vkCreateDebugUtilsMessengerEXT".to_owned();
    assert!(log.calls.contains_key(&messenger), "{:?}", log.calls);
    let mut faults = Vec::new();
    for (call_index, (call, &count)) in log.calls.iter().enumerate() {
        for (result_index, result) in [OUT_OF_HOST_MEMORY, DEVICE_LOST].into_iter().enumerate() {
            if !(call_index + result_index).is_multiple_of(2) && !is_soaked() {
                continue;
            }
            faults.push(format!("{call},{result},1,1"));
            if count > 1 {
                faults.push(format!("{call},{result},{count},1"));
            }
            faults.push(format!("{call},{result},1,1000000"));
        }
    }
    // The caller gets its memory back only when the device has stopped working in it.
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
    // Even waiting for the whole device fails, so nothing may be destroyed.
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

/// The test above runs this in a separate process.
#[test]
#[ignore = "part of a_fault_in_the_library_is_an_error_and_leaks_nothing"]
fn library_work() {
    let work = || -> Result<(), Error> {
        // With the validation layer, if it is installed.
        let devices = match Device::list_validated() {
            Err(VulkanError::NoValidation) => Device::list()?,
            devices => devices?,
        };
        let mut options = EngineOptions::default();
        options.transfer = Transfer::Staged;
        options.uploads = Uploads::Staged;
        options.read_back = ReadBack::Overlapped;
        options.prepare_arcs = PrepareArcs::OnDevice;
        let engine = Engine::with_options(devices[0].clone(), &options)?;
        let set = hostile_set(2, 8);
        let clip = engine.upload(&set, method::C2)?;
        let frames = SampleTimes::fps(30).between(0.0, 5.0);
        let poses = clip
            .request(&frames)
            .layout(Layout::FrameMajor)
            .evaluate()?;
        engine.blend(&[(&poses, 0.5), (&poses, 1.0)])?;
        #[cfg(target_os = "linux")]
        {
            let exported = clip
                .request(&frames)
                .layout(Layout::FrameMajor)
                .encoding(Encoding::F32)
                .export()?;
            exported.wait()?;
            exported.memory_file()?;
        }
        // Evaluated from segments that are on the device already, from new ones, and directly from
        // keys.
        let arcs = engine.upload(&set, method::SLERP)?;
        let found = arcs.evaluate(&frames)?;
        let expected = Engine::new(Device::Cpu)?.evaluate(&set, method::SLERP, &frames)?;
        assert_eq!(
            first_difference(expected.as_quats(), found.as_quats()),
            None
        );
        for frames in [frames, SampleTimes::at(vec![0.3, 0.7])] {
            let found = engine.evaluate(&set, method::SLERP, &frames)?;
            let expected = Engine::new(Device::Cpu)?.evaluate(&set, method::SLERP, &frames)?;
            assert_eq!(
                first_difference(expected.as_quats(), found.as_quats()),
                None
            );
        }
        let crowd = crowd_work(&engine);
        if std::env::var_os("MUST_SUCCEED").is_some() {
            crowd.unwrap();
        }
        lent_work(devices[0].clone())
    };
    let outcome = work();
    if std::env::var_os("MUST_SUCCEED").is_some() {
        outcome.unwrap();
    }
}

/// A crowd that is submitted, and polled until it is done.
pub(super) fn crowd_work(engine: &Engine) -> Result<(), CrowdError> {
    let skeleton = Skeleton::new(vec![None, Some(0)], vec![Vec3::Y; 2]).unwrap();
    let mut library = CrowdLibrary::new(&skeleton)?;
    let mut set = TrackSet::new();
    for angle in [1.0, -0.5] {
        let keys = [0.0, angle].map(Quat::from_rotation_x);
        set.push("", &[0.0, 1.0], &keys).unwrap();
    }
    library.push(&set, method::SLERP, VectorMethod::Linear)?;
    let cpu = Engine::new(Device::Cpu).unwrap();
    let of = |engine: &Engine| -> Result<Vec<[f32; 4]>, CrowdError> {
        let mut crowd = engine.crowd(&library, 3, 1)?;
        crowd.submit(CrowdValues::Rotations)?;
        while !crowd.poll()? {
            std::thread::yield_now();
        }
        let mut found = vec![[0.0; 4]; crowd.output_len(CrowdValues::Rotations)];
        crowd.wait_into(&mut found)?;
        Ok(found)
    };
    let (expected, found) = (of(&cpu)?, of(engine)?);
    assert_eq!(
        bytemuck::cast_slice::<_, u32>(&expected),
        bytemuck::cast_slice::<_, u32>(&found)
    );
    Ok(())
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
