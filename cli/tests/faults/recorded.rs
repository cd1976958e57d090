//! Recording into an application's commands asks Vulkan for no object and no memory, whatever is recorded.
#![allow(unsafe_code)] // the device, the buffers and the commands are the application's

use std::collections::BTreeMap;
use std::process::Command;

use tumble::vulkan::PosePass;
use tumble::vulkan::tuning::Mapping;
use tumble::{Device, Engine, Layout, SampleTimes, method};

use crate::application::{Application, ApplicationBuffer, Commands};
use crate::faults::loader::Loader;
use crate::support::hostile_set;

/// How often a result is recorded.
const RECORDS: &str = "RECORDS";

/// The calls that make something, or take a descriptor set from a pool.
fn allocations(calls: &BTreeMap<String, usize>) -> BTreeMap<&str, usize> {
    let allocates = |call: &str| call.contains("Create") || call.contains("Allocate");
    let all = calls.iter().map(|(call, &count)| (call.as_str(), count));
    all.filter(|(call, _)| allocates(call)).collect()
}

/// A hundred results at different offsets of the buffer use the descriptor sets of one.
#[test]
fn what_is_recorded_elsewhere_takes_the_same_descriptors() {
    let Some(loader) = Loader::new() else { return };
    let calls = ["1", "100"].map(|records| {
        let mut command = Command::new(std::env::current_exe().unwrap());
        let test = "faults::recorded::records_at_many_places";
        command.args(["--exact", test, "--ignored", "--nocapture"]);
        let (run, log) = loader.run_command(command, &[(RECORDS, records)]);
        assert_eq!(run.code, 0, "{records}: {}", run.words);
        assert_eq!(log.left, BTreeMap::new(), "{records}");
        log.calls
    });
    let [once, often] = calls.each_ref().map(allocations);
    assert!(once.contains_key("vkAllocateDescriptorSets"), "{once:?}");
    assert!(once.contains_key("vkAllocateMemory"), "{once:?}");
    assert_eq!(once, often);
}

/// The test above runs this in a separate process.
#[test]
#[ignore = "part of what_is_recorded_elsewhere_takes_the_same_descriptors"]
fn records_at_many_places() {
    let records: u64 = std::env::var(RECORDS).unwrap().parse().unwrap();
    const TRACKS: usize = 21;
    let application = Application::new();
    let set = hostile_set(4, TRACKS);
    let frames = SampleTimes::fps(30).between(0.0, 2.0);
    let layout = Layout::FrameMajor;
    let engine = application.engine(Mapping::Samples);
    let cpu = Engine::new(Device::Cpu).unwrap();
    for method in [method::SLERP, method::C2] {
        let expected = cpu.request(&set, method, &frames).layout(layout);
        let expected = expected.evaluate().unwrap();
        let rotations: &[u8] = bytemuck::cast_slice(expected.as_quats());
        // There is a gap of one rotation between two results.
        let (size, stride) = (rotations.len() as u64, rotations.len() as u64 + 16);
        let buffer = vec![0xff; 100 * stride as usize];
        let buffer = ApplicationBuffer::of(&application, &buffer);
        let clip = engine.upload(&set, method).unwrap();
        let request = clip.request(&frames).layout(layout);
        // SAFETY: the buffer is as it must be, and outlives the target.
        let target = unsafe { request.target(buffer.range(0, 100 * stride)) }.unwrap();
        let mixed = ApplicationBuffer::of(&application, &vec![0; rotations.len()]);
        let pass = PosePass::Blend {
            layers: &[
                (buffer.range(stride, size), 0.5),
                (buffer.range(0, size), 0.5),
            ],
        };
        let pass = engine.pass(pass, TRACKS, expected.sample_count(), layout);
        // SAFETY: as above.
        let pass = unsafe { pass.target(mixed.range(0, size)) }.unwrap();
        let commands = Commands::new(&application);
        let recorded = commands.recorded(|command_buffer| {
            for record in 0..records {
                // SAFETY: the commands are in recording, and the targets outlive them.
                unsafe {
                    target.record(command_buffer, record * stride).unwrap();
                    pass.record(command_buffer);
                }
            }
        });
        commands.run(&[recorded]);
        let found = buffer.bytes();
        for (record, found) in (0..).zip(found.chunks(stride as usize)) {
            let (found, beside) = found.split_at(rotations.len());
            assert!(beside.iter().all(|&byte| byte == 0xff));
            match record < records {
                true => assert!(found == rotations, "{method}, {record}"),
                false => assert!(found.iter().all(|&byte| byte == 0xff)),
            }
        }
        if records > 1 {
            let layers = [(&expected, 0.5), (&expected, 0.5)];
            let expected = cpu.blend(&layers).unwrap();
            assert!(mixed.bytes() == bytemuck::cast_slice::<_, u8>(expected.as_quats()));
        }
    }
}
