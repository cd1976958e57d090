//! Clips that are recorded into an application's commands, at times that are known only when they
//! are recorded.
#![allow(unsafe_code)] // the device, the buffers and the commands are the application's

use tumble::vulkan::tuning::Mapping;
use tumble::vulkan::{CommandScopes, CommandUsers, TimedTarget, VulkanError};
use tumble::{
    Device, Encoding, Engine, Error, Interpolation, Layout, SampleTimes, SampleTimesError,
    WrapMode, method,
};

use crate::application::{Application, ApplicationBuffer, Commands};
use crate::support::{Random, hostile_set, vulkan_devices};

/// Bytes around a result, which nothing may write.
const UNTOUCHED: u8 = 0xa5;

/// Two poses at other times in each of some frames, in one command buffer: the bits of the CPU at these times, also of
/// samples before, between and after keys, of clips that repeat, and of those that only the host can compute.
#[test]
fn recorded_times_have_the_bits_of_an_evaluation() {
    if vulkan_devices().is_empty() {
        return;
    }
    let cpu = Engine::new(Device::Cpu).unwrap();
    let mut random = Random(71);
    let set = hostile_set(5, 70);
    for application in Application::all() {
        for (mapping, interpolation, encoding, layout, samples) in [
            (
                Mapping::Runs,
                method::SLERP.into(),
                Encoding::F32,
                Layout::TrackMajor,
                1,
            ),
            (
                Mapping::Samples,
                method::C2.into(),
                Encoding::F32,
                Layout::FrameMajor,
                3,
            ),
            (
                Mapping::Samples,
                Interpolation::new(method::SLERP).with_after(WrapMode::Loop),
                Encoding::F16,
                Layout::TrackMajor,
                1,
            ),
            (
                Mapping::Runs,
                Interpolation::new(method::CATMULL_ROM).with_after(WrapMode::Mirror),
                Encoding::F32,
                Layout::FrameMajor,
                9,
            ),
        ] {
            let engine = application.engine(mapping);
            let clip = engine.upload(&set, interpolation).unwrap();
            let expected = cpu.upload(&set, interpolation).unwrap();
            let count = SampleTimes::at(vec![0.0; samples]);
            let request = clip.request(&count).encoding(encoding).layout(layout);
            let of_set = engine.request(&set, interpolation, &count);
            let of_set = of_set.encoding(encoding).layout(layout).tracks(3..60);
            for (request, tracks) in [(request, 0..70), (of_set, 3..60)] {
                let each = tracks.len() * samples * encoding.bytes();
                let buffer = ApplicationBuffer::of(&application, &vec![UNTOUCHED; 2 * each + 768]);
                // SAFETY: the buffer is as it must be, and outlives the target.
                let target = unsafe { request.timed_target(buffer.range(256, 2 * each as u64)) };
                let target = target.unwrap();
                assert_eq!(target.bytes(), each as u64);
                let commands = Commands::new(&application);
                for _ in 0..4 {
                    let times = [(); 2].map(|()| {
                        let time =
                            |_| random.pick(&[-9.0, 0.0, 1.0, 2.5]) + random.between(0.0, 4.0);
                        Vec::from_iter((0..samples).map(time))
                    });
                    let recorded = commands.recorded(|command_buffer| {
                        let kernels = CommandScopes::default().with_before(CommandUsers::Kernels);
                        // SAFETY: the commands are in recording, and submitted below.
                        unsafe {
                            target.record(command_buffer, 0, &times[0]).unwrap();
                            let offset = each as u64;
                            let recorded =
                                target.record_between(command_buffer, offset, &times[1], kernels);
                            recorded.unwrap();
                        }
                    });
                    commands.run(&[recorded]);
                    let found = buffer.bytes();
                    let (before, others) = found.split_at(256);
                    let (poses, after) = others.split_at(2 * each);
                    assert!(before.iter().chain(after).all(|&byte| byte == UNTOUCHED));
                    for (pose, times) in poses.chunks_exact(each).zip(times) {
                        let times = SampleTimes::at(times);
                        let expected = expected.request(&times).encoding(encoding).layout(layout);
                        let expected = expected.tracks(tracks.clone()).evaluate_bytes().unwrap();
                        assert!(pose == expected, "{interpolation:?}, {times:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn times_and_offsets_that_do_not_fit_are_refused() {
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let engine = application.engine(Mapping::Automatic);
    let set = hostile_set(7, 4);
    let clip = engine.upload(&set, method::SLERP).unwrap();
    let times = SampleTimes::at(vec![0.0; 2]);
    let request = clip.request(&times);
    let buffer = ApplicationBuffer::of(&application, &[0; 512]);
    let made = |offset, size| -> Result<TimedTarget, Error> {
        // SAFETY: ranges that are refused, or in the buffer, which outlives the target.
        unsafe { request.timed_target(buffer.range(offset, size)) }
    };
    for (offset, size) in [
        (0, 127),
        (8, 128),
        (496, 128),
        (u64::MAX, 128),
        (16, u64::MAX),
    ] {
        let refused = made(offset, size).unwrap_err();
        assert!(
            matches!(refused, Error::Vulkan(_)),
            "{offset}, {size}: {refused}"
        );
    }
    let target = made(256, 160).unwrap();
    Commands::new(&application).recorded(|command_buffer| {
        // SAFETY: nothing is recorded.
        let refused = |offset, times: &[f64]| unsafe {
            target.record(command_buffer, offset, times).unwrap_err()
        };
        for times in [&[][..], &[1.0], &[1.0; 3]] {
            let (times, samples) = (times.len(), 2);
            let found = refused(0, &vec![1.0; times]);
            assert_eq!(found, SampleTimesError::Count { times, samples }.into());
        }
        for time in [f64::NAN, f64::INFINITY] {
            let found = refused(0, &[0.0, time]);
            let is_time = |error: &Error| {
                matches!(
                    error,
                    Error::SampleTimes(SampleTimesError::TimeNotFinite { index: 1, .. })
                )
            };
            assert!(is_time(&found), "{found}");
        }
        for offset in [8, 48, u64::MAX] {
            let found = refused(offset, &[0.0, 1.0]);
            let is_range = matches!(found, Error::Vulkan(VulkanError::ResultOffset { .. }));
            assert!(is_range, "{offset}: {found}");
        }
    });
    let on_cpu = Engine::new(Device::Cpu).unwrap();
    let on_cpu = on_cpu.upload(&set, method::SLERP).unwrap();
    // SAFETY: the CPU refuses.
    let refused = unsafe { on_cpu.request(&times).timed_target(buffer.range(0, 512)) };
    assert_eq!(refused.unwrap_err(), Error::BufferOnCpu);
}
