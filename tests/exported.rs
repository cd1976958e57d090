//! Results in memory that a device exports have the bits of the CPU, in whatever order their objects are dropped.

use std::fs::File;
use std::os::unix::fs::FileExt;

use tumble::vulkan::{ExportedResult, VulkanError};
use tumble::{Device, Encoding, Engine, EngineOptions, Error, Layout, SampleTimes, method};

use crate::support::{dense_set, hostile_set, vulkan_devices};

/// The bytes in the memory. Some drivers' file is the memory; lavapipe's begins with a header, whose
/// second word says where the memory starts.
fn bytes(result: &ExportedResult) -> Vec<u8> {
    let file = File::from(result.memory_file().unwrap());
    let mut word = [0; 8];
    file.read_exact_at(&mut word, 8).unwrap();
    let spare = file.metadata().unwrap().len() - result.memory_bytes();
    let start = Some(u64::from_ne_bytes(word)).filter(|&start| start <= spare);
    let start = start.unwrap_or(0);
    let mut found = vec![0; usize::try_from(result.bytes()).unwrap()];
    file.read_exact_at(&mut found, start).unwrap();
    found
}

#[test]
fn exported_results_have_the_bits_of_the_cpu() {
    let cpu = Engine::new(Device::Cpu).unwrap();
    let set = hostile_set(12, 9);
    let many = SampleTimes::fps(10_000).between(0.0, 25.0); // several windows
    let mut exported = 0;
    for device in vulkan_devices() {
        let engine = Engine::new(device).unwrap();
        for (frames, layout, encoding) in [
            (SampleTimes::fps(25), Layout::TrackMajor, Encoding::F32),
            (SampleTimes::fps(25), Layout::FrameMajor, Encoding::F16),
            (many.clone(), Layout::TrackMajor, Encoding::F32),
        ] {
            let expected = cpu.upload(&set, method::BESSEL_OVERHAUSER).unwrap();
            let expected = expected
                .request(&frames)
                .layout(layout)
                .encoding(encoding)
                .evaluate_bytes()
                .unwrap();
            let clip = engine.upload(&set, method::BESSEL_OVERHAUSER).unwrap();
            let found = match clip
                .request(&frames)
                .layout(layout)
                .encoding(encoding)
                .export()
            {
                Err(Error::Vulkan(VulkanError::NoExport { .. })) => continue, // none of its memory can be
                found => found.unwrap(),
            };
            exported += 1;
            drop(clip); // while the device may still write
            assert_eq!(found.bytes(), expected.len() as u64);
            assert!(found.memory_bytes() >= found.bytes());
            found.wait().unwrap();
            assert!(found.is_written().unwrap());
            let name = found.device_name();
            assert!(
                bytes(&found) == expected,
                "{name}, {layout:?}, {encoding:?}"
            );
        }
    }
    assert!(exported > 0, "no device of this machine exports memory");
}

/// The memory outlives its clip, its engine and all handles of ours; dropping a result waits for its work.
#[test]
fn exported_memory_lives_as_long_as_somebody_has_it() {
    let cpu = Engine::new(Device::Cpu).unwrap();
    let (set, frames) = dense_set(8, 20_000, 0.1);
    let expected = cpu.upload(&set, method::SLERP).unwrap();
    let expected = expected
        .request(&frames)
        .layout(Layout::TrackMajor)
        .encoding(Encoding::F32)
        .evaluate_bytes();
    let expected = expected.unwrap();
    for device in vulkan_devices() {
        let engine = Engine::new(device).unwrap();
        let clip = engine.upload(&set, method::SLERP).unwrap();
        let export = || {
            clip.request(&frames)
                .layout(Layout::TrackMajor)
                .encoding(Encoding::F32)
                .export()
        };
        let Ok(first) = export() else { continue };
        for _ in 0..8 {
            drop(export().unwrap());
        }
        let last = export().unwrap();
        let other = last.clone();
        drop((clip, engine, last));
        for result in [first, other] {
            result.wait().unwrap();
            assert!(bytes(&result) == expected);
        }
    }
}

#[test]
fn what_cannot_be_exported_is_said() {
    let set = hostile_set(3, 2);
    let cpu = Engine::new(Device::Cpu).unwrap();
    let clip = cpu.upload(&set, method::SLERP).unwrap();
    let export = |frames: &SampleTimes, encoding| {
        clip.request(frames)
            .layout(Layout::TrackMajor)
            .encoding(encoding)
            .export()
    };
    let found = export(&SampleTimes::fps(10), Encoding::F32).unwrap_err();
    assert!(matches!(found, Error::ExportOnCpu), "{found}");
    for device in vulkan_devices() {
        let options = EngineOptions::default();
        let engine = Engine::with_options(device, &options).unwrap();
        let clip = engine.upload(&set, method::SLERP).unwrap();
        let layout = Layout::TrackMajor;
        let found = clip
            .request(&SampleTimes::at(vec![f64::NAN]))
            .layout(layout)
            .encoding(Encoding::F32)
            .export();
        assert!(matches!(found, Err(Error::SampleTimes(_))), "{found:?}");
        if let Err(found) = clip
            .request(&SampleTimes::fps(10))
            .layout(layout)
            .encoding(Encoding::F32)
            .export()
        {
            let said = found.to_string();
            assert!(
                said.contains("cannot share the memory of results with other APIs"),
                "{said}"
            );
        }
    }
}
