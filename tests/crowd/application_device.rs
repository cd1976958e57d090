//! Crowds on an application's device, recorded into its command buffers.
#![allow(unsafe_code)] // the device, the buffers and the commands are the application's

use tumble::crowd::{CrowdError, CrowdLayer, CrowdOutput, CrowdValues};
use tumble::method;
use tumble::vulkan::tuning::Mapping;
use tumble::vulkan::{CrowdTarget, VulkanBuffer};

use super::{ALL, cpu, layer, library};
use crate::application::{Application, Commands};
use crate::support::{Random, vulkan_devices};

/// Several frames in flight, each in another buffer, in every encoding and with each choice of kernels, have the
/// CPU's bits.
#[test]
fn frames_are_recorded_into_an_applications_commands() {
    if vulkan_devices().is_empty() {
        return;
    }
    for mapping in [Mapping::Runs, Mapping::Samples] {
        assert_frames_are_recorded(mapping);
    }
}

fn assert_frames_are_recorded(mapping: Mapping) {
    const FRAMES: usize = 3;
    let application = Application::new();
    let engine = application.engine(mapping);
    let mut random = Random(29);
    let library = library(&mut random, 21, &[method::SLERP, method::BESSEL_OVERHAUSER]);
    let outputs = ALL
        .into_iter()
        .flat_map(|values| [CrowdOutput::from(values), CrowdOutput::half(values)]);
    for output in outputs {
        let (mut crowd, mut expected) = (
            engine.crowd(&library, 33, 2).unwrap(),
            cpu().crowd(&library, 33, 2).unwrap(),
        );
        let commands = Commands::new(&application);
        let offset = 256;
        let size = (crowd.output_len(output) * output.bytes() / output.vector_count()) as u64;
        let buffers = [0; FRAMES].map(|_| application.buffer(offset + size));
        let targets: Vec<CrowdTarget> = (buffers.iter())
            .map(|&(buffer, _)| {
                let slice = |offset, size| VulkanBuffer::new(buffer, size).at(offset);
                // SAFETY: the buffer is as it must be, and outlives the target.
                unsafe {
                    let small = crowd.target(output, slice(offset, size - 1)).unwrap_err();
                    assert!(matches!(small, CrowdError::Buffer { .. }), "{small}");
                    let after_end = crowd.target(output, slice(offset + 256, size)).unwrap_err();
                    assert!(
                        after_end.to_string().contains("ends beyond the buffer"),
                        "{after_end}"
                    );
                    crowd.target(output, slice(offset, size)).unwrap()
                }
            })
            .collect();
        let (mut frames, mut results) = (Vec::new(), Vec::new());
        for (frame, target) in targets.iter().enumerate() {
            for slot in 0..66 {
                if frame == 0 || random.next().is_multiple_of(7) {
                    let plays = layer(&mut random, &library);
                    crowd.set(slot / 2, slot % 2, plays).unwrap();
                    expected.set(slot / 2, slot % 2, plays).unwrap();
                }
            }
            crowd.advance(0.1).unwrap();
            expected.advance(0.1).unwrap();
            frames.push(commands.recorded(|command_buffer| {
                // SAFETY: the commands are in recording, and submitted below in this order.
                unsafe { crowd.record(target, command_buffer) }.unwrap();
            }));
            let mut bytes = vec![0u8; size as usize];
            match output.is_half {
                true => {
                    let values: &mut [[u16; 4]] = bytemuck::cast_slice_mut(&mut bytes);
                    expected.evaluate_half_into(output.values, values).unwrap();
                }
                false => {
                    let values: &mut [[f32; 4]] = bytemuck::cast_slice_mut(&mut bytes);
                    expected.evaluate_into(output.values, values).unwrap();
                }
            }
            results.push(bytes);
        }
        commands.run(&frames);
        for (&(_, memory), bytes) in buffers.iter().zip(&results) {
            let found = application.bytes(memory, offset + size);
            assert!(found[offset as usize..] == *bytes, "{output:?}");
        }
        drop(targets);
        for (buffer, memory) in buffers {
            // SAFETY: nothing is in flight.
            unsafe {
                application.device.destroy_buffer(buffer, None);
                application.device.free_memory(memory, None);
            }
        }
    }
}

/// The changes of a frame that is never submitted do not reach the device until `forget_recorded` is called.
#[test]
fn thrown_away_frames_are_told() {
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let engine = application.engine(Mapping::Automatic);
    let mut random = Random(31);
    let library = library(&mut random, 3, &[method::SLERP]);
    let mut crowd = engine.crowd(&library, 5, 1).unwrap();
    let size = 5 * 3 * 16;
    let (buffer, memory) = application.buffer(size);
    let range = VulkanBuffer::new(buffer, size);
    // SAFETY: the buffer is as it must be, and outlives the target.
    let target = unsafe { crowd.target(CrowdValues::Rotations, range) }.unwrap();
    let commands = Commands::new(&application);
    crowd.set(2, 0, CrowdLayer::new(0).at(77_777)).unwrap();
    // SAFETY: never submitted; `forget_recorded` follows.
    commands.recorded(|command_buffer| unsafe { crowd.record(&target, command_buffer) }.unwrap());
    crowd.forget_recorded();
    // SAFETY: submitted below.
    let recorded = commands
        .recorded(|command_buffer| unsafe { crowd.record(&target, command_buffer) }.unwrap());
    commands.run(&[recorded]);
    let found = application.bytes(memory, size);
    let mut expected = cpu().crowd(&library, 5, 1).unwrap();
    expected.set(2, 0, CrowdLayer::new(0).at(77_777)).unwrap();
    let expected = super::evaluated(&mut expected, CrowdValues::Rotations);
    assert!(found == bytemuck::cast_slice::<_, u8>(&expected));

    // Another crowd's target, and the CPU, are refused.
    let mut other = engine.crowd(&library, 5, 1).unwrap();
    commands.recorded(|command_buffer| {
        // SAFETY: nothing is recorded.
        let refused = unsafe { other.record(&target, command_buffer) };
        assert_eq!(refused.unwrap_err(), CrowdError::OtherCrowd);
    });
    let crowd = cpu().crowd(&library, 5, 1).unwrap();
    // SAFETY: nothing uses the buffer.
    let refused = unsafe { crowd.target(CrowdValues::Rotations, range) };
    assert_eq!(refused.unwrap_err(), CrowdError::OtherDevice);
    drop(target);
    // SAFETY: nothing is in flight.
    unsafe {
        application.device.destroy_buffer(buffer, None);
        application.device.free_memory(memory, None);
    }
}

/// Recorded frames with lists of instances and scattered changes have the rows of the CPU's whole crowd, in a
/// buffer with room for some of them.
#[test]
fn frames_of_visible_instances_are_recorded() {
    if vulkan_devices().is_empty() {
        return;
    }
    for mapping in [Mapping::Runs, Mapping::Samples] {
        assert_visible_instances_are_recorded(mapping);
    }
}

fn assert_visible_instances_are_recorded(mapping: Mapping) {
    const INSTANCES: usize = 400;
    const ROOM: usize = 40;
    let application = Application::new();
    let engine = application.engine(mapping);
    let mut random = Random(37);
    let library = library(&mut random, 7, &[method::SLERP, method::BESSEL_OVERHAUSER]);
    for output in [
        CrowdOutput::from(CrowdValues::Model),
        CrowdOutput::half(CrowdValues::Rotations),
    ] {
        let (mut crowd, mut expected) = (
            engine.crowd(&library, INSTANCES, 2).unwrap(),
            cpu().crowd(&library, INSTANCES, 2).unwrap(),
        );
        let each = 7 * output.bytes();
        let size = (ROOM * each) as u64;
        let (buffer, memory) = application.buffer(size);
        let range = VulkanBuffer::new(buffer, size);
        // SAFETY: the buffer is as it must be, and outlives the target.
        let refused = unsafe { crowd.target(output, range) }.unwrap_err();
        assert!(matches!(refused, CrowdError::Buffer { .. }));
        crowd.set_visible(&[0]).unwrap();
        // SAFETY: as above.
        let target = unsafe { crowd.target(output, range) }.unwrap();
        let commands = Commands::new(&application);
        for (frame, count) in [3, ROOM, 0, 17, 17].into_iter().enumerate() {
            let list = super::visible::some(&mut random, INSTANCES, count);
            crowd.set_visible(&list).unwrap();
            for slot in 0..2 * INSTANCES {
                if frame == 0 || random.next().is_multiple_of(30) {
                    let plays = layer(&mut random, &library);
                    crowd.set(slot / 2, slot % 2, plays).unwrap();
                    expected.set(slot / 2, slot % 2, plays).unwrap();
                }
            }
            crowd.advance(0.1).unwrap();
            expected.advance(0.1).unwrap();
            let recorded = commands.recorded(|command_buffer| {
                // SAFETY: the commands are in recording, and submitted below.
                unsafe { crowd.record(&target, command_buffer) }.unwrap();
            });
            commands.run(&[recorded]);
            let found = application.bytes(memory, size);
            let mut bytes = vec![0u8; INSTANCES * each];
            match output.is_half {
                true => {
                    let values: &mut [[u16; 4]] = bytemuck::cast_slice_mut(&mut bytes);
                    expected.evaluate_half_into(output.values, values).unwrap();
                }
                false => {
                    let values: &mut [[f32; 4]] = bytemuck::cast_slice_mut(&mut bytes);
                    expected.evaluate_into(output.values, values).unwrap();
                }
            }
            for (row, &instance) in found.chunks_exact(each).zip(&list) {
                let of_all = &bytes[instance * each..][..each];
                assert!(row == of_all, "{output:?}, frame {frame}, {instance}");
            }
        }
        let list = super::visible::some(&mut random, INSTANCES, ROOM + 1);
        crowd.set_visible(&list).unwrap();
        commands.recorded(|command_buffer| {
            // SAFETY: nothing is recorded.
            let refused = unsafe { crowd.record(&target, command_buffer) }.unwrap_err();
            let needed = ((ROOM + 1) * each) as u64;
            let offset = 0;
            assert_eq!(
                refused,
                CrowdError::Buffer {
                    offset,
                    size,
                    needed
                }
            );
        });
        drop(target);
        // SAFETY: nothing is in flight.
        unsafe {
            application.device.destroy_buffer(buffer, None);
            application.device.free_memory(memory, None);
        }
    }
}
