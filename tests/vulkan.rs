//! Vulkan devices, self-tests, validation, and handles.

use crate::support::{
    KERNEL_OPTIONS, dense_set, first_difference, hostile_set, is_due, stage, vulkan_devices,
    vulkan_engines,
};
use std::collections::BTreeMap;

use bytemuck::Pod;
use glam::Quat;
use tumble::vulkan::tuning::{Mapping, Reads, Transfer};
use tumble::vulkan::{VulkanBuffer, VulkanError};
use tumble::{
    Device, Encoding, Engine, EngineOptions, Layout, METHODS, SampleTimes, Skeleton, TrackSet,
    method,
};

#[test]
fn every_device_passes_every_check() {
    for device in vulkan_devices() {
        let engine = Engine::new(device).unwrap();
        assert_eq!(engine.self_tests().len(), 10);
        for check in engine.self_tests() {
            assert!(check.total > 0, "{check:?}");
            assert_eq!(check.differing, 0, "{}: {check:?}", engine.device_name());
        }
        let info = engine.device_info().unwrap();
        assert!(
            info.max_storage_buffer_range >= 1 << 27,
            "Vulkan guarantees 128 MiB: {info:?}"
        );
    }
}

/// All of the table, in storage buffers and, where the device can, in texel buffers.
#[test]
fn every_kernel_has_the_bits_of_its_twin_on_every_device() {
    for device in vulkan_devices() {
        let mut checked = BTreeMap::new();
        for reads in [Reads::StorageBuffers, Reads::TexelBuffers] {
            let mut options = EngineOptions::default();
            options.reads = reads;
            let engine = Engine::with_options(device.clone(), &options).unwrap();
            for check in engine.check_kernels().unwrap() {
                assert!(check.total > 100, "{check:?}");
                assert_eq!(check.differing, 0, "{}: {check:?}", device.name());
                assert!(!check.remembered, "{check:?}");
                checked.insert(check.name, check.total);
            }
            // Now all results of the self-tests are known, also to other engines of this process.
            let engine = Engine::with_options(device.clone(), &options).unwrap();
            for check in engine.check_unknown_kernels().unwrap() {
                assert!(check.remembered && check.total == 0, "{check:?}");
                assert!(checked.contains_key(check.name), "{check:?}");
            }
        }
        let has = |part| checked.keys().any(|name| name.contains(part));
        let (has_texels, converts) = (has("_texels"), has("_converting"));
        // Some subgroups have too few lanes: SwiftShader's have four.
        let by_subgroups = has("_subgroup_rotations");
        let names: Vec<_> = tumble::vulkan::kernels().map(|(name, _)| name).collect();
        for &name in &names {
            // A device that converts by its instruction does not use the other variant.
            let is_replaced = converts && names.contains(&&*format!("{name}_converting"));
            let can = (has_texels || !name.ends_with("_texels"))
                && (converts || !name.ends_with("_converting"))
                && (by_subgroups || !name.contains("_subgroup_rotations"))
                && !is_replaced;
            assert_eq!(
                checked.contains_key(name),
                can,
                "{name} on {}",
                device.name()
            );
        }
        assert!(checked.len() >= 98, "{}", checked.len());
    }
    let cpu = Engine::new(Device::Cpu).unwrap();
    assert_eq!(cpu.check_kernels().unwrap(), []);
    assert!(cpu.negative_control().unwrap().is_none());
}

/// A comparison that cannot fail proves nothing: left free, lavapipe folds `(a + b) - a`.
#[test]
fn the_comparison_finds_a_driver_that_is_left_free() {
    let mut must_differ = 0;
    for device in vulkan_devices() {
        let engine = Engine::new(device.clone()).unwrap();
        let control = engine.negative_control().unwrap().unwrap();
        assert!(control.is_conclusive(), "{}: {control:?}", device.name());
        assert_eq!(control.expressions.len(), 10);
        assert!(
            control
                .expressions
                .iter()
                .all(|expression| expression.total == 1003)
        );
        if control.must_differ {
            must_differ += 1;
            let sum = &control.expressions[1];
            assert_eq!(sum.name, "re-association of a sum");
            assert!(sum.differing > 100, "{control:?}");
            // If a device that is known to differ does not differ, nothing is proved.
            let mut blind = control.clone();
            for expression in &mut blind.expressions {
                expression.differing = 0;
            }
            assert!(!blind.is_conclusive());
        }
    }
    assert!(
        must_differ > 0 || std::env::var_os("CI").is_none(),
        "CI must have lavapipe"
    );
}

/// Core and synchronization checks over everything an evaluation does.
#[test]
fn the_validation_layer_has_nothing_to_say() {
    let devices = match Device::list_validated() {
        Ok(devices) => devices,
        Err(error) => {
            assert!(std::env::var_os("CI").is_none(), "{error}");
            assert!(matches!(
                error,
                VulkanError::NoValidation | VulkanError::NoLoader { .. }
            ));
            eprintln!("{error}: nothing was validated");
            return;
        }
    };
    let set = hostile_set(2, 64);
    let reference = [glam::Quat::IDENTITY; 64];
    let requests = [
        SampleTimes::fps(60).between(0.0, 20.0),
        SampleTimes::at(vec![0.5, 0.25, 7.0]),
    ];
    for device in devices {
        let transfers = [Transfer::InPlace, Transfer::Staged];
        let variants = transfers.map(|transfer| KERNEL_OPTIONS.map(|kernel| (transfer, kernel)));
        for (variant, (transfer, (reads, mapping))) in variants.concat().into_iter().enumerate() {
            let mut options = EngineOptions::default();
            options.transfer = transfer;
            if transfer == Transfer::Staged {
                stage(&mut options, variant);
            }
            (options.reads, options.mapping) = (reads, mapping);
            options.memory = Some(1_000_000);
            let engine = Engine::with_options(device.clone(), &options).unwrap();
            // `step` has only constants; the other methods have the two forms.
            let methods = [method::STEP, method::SLERP, method::C2];
            for (round, method) in methods.into_iter().enumerate() {
                if !is_due(round, variant / 3 + variant, KERNEL_OPTIONS.len()) {
                    continue;
                }
                let clip = engine.upload(&set, method).unwrap();
                for frames in &requests {
                    let layouts = [Layout::TrackMajor, Layout::FrameMajor].into_iter();
                    for (layout_index, layout) in layouts.enumerate() {
                        let poses = clip.request(frames).layout(layout).evaluate().unwrap();
                        engine.blend(&[(&poses, 0.5), (&poses, 1.0)]).unwrap();
                        engine.mix(&poses, &poses, 0.5).unwrap();
                        engine.add(&poses, &poses, &reference, 0.5).unwrap();
                        engine
                            .world(&poses, &Skeleton::chain(64, 1.0).unwrap())
                            .unwrap();
                        let encodings = Encoding::ALL.into_iter().enumerate();
                        for (_, encoding) in
                            encodings.filter(|(e, _)| is_due(variant / 3 + layout_index, *e, 2))
                        {
                            clip.request(frames)
                                .layout(layout)
                                .encoding(encoding)
                                .evaluate_bytes()
                                .unwrap();
                        }
                    }
                }
            }
            assert_eq!(
                engine.validation_messages(),
                Vec::<String>::new(),
                "{device:?}"
            );
        }
    }
}

/// Catches a copy that does not wait for its kernels, a window that overwrites what is still to be
/// copied, and an upload that kernels see in part: many windows, by segments and from keys, with each
/// way of staging. `validation.rs` runs it under the newer layer.
#[test]
fn every_way_of_copying_gives_the_same_bits() {
    let cpu = Engine::new(Device::Cpu).unwrap();
    let set = hostile_set(6, 40);
    let (dense, dense_frames) = dense_set(40, 300, 0.1);
    let frames = SampleTimes::fps(60).between(0.0, 9.0);
    for device in vulkan_devices() {
        for (round, (reads, mapping)) in KERNEL_OPTIONS.into_iter().enumerate() {
            for memory in [None, Some(100_000)] {
                let mut options = EngineOptions::default();
                stage(&mut options, round);
                (options.reads, options.mapping) = (reads, mapping);
                options.memory = memory;
                let engine = Engine::with_options(device.clone(), &options).unwrap();
                for (set, frames) in [(&set, &frames), (&dense, &dense_frames)] {
                    for method in [method::SLERP, method::CATMULL_ROM] {
                        let expected = cpu.evaluate(set, method, frames).unwrap();
                        let clip = engine.upload(set, method).unwrap();
                        let kept = clip.evaluate(frames).unwrap();
                        let found = engine.evaluate(set, method, frames).unwrap();
                        for found in [kept, found] {
                            let difference =
                                first_difference(expected.as_quats(), found.as_quats());
                            assert_eq!(difference, None, "{method}, {options:?}");
                        }
                    }
                }
            }
        }
    }
}

/// A renderer passes its instance, device and queue to the engine.
#[test]
fn an_applications_own_device_gives_the_same_bits() {
    if vulkan_devices().is_empty() {
        return;
    }
    let application = crate::application::Application::new();
    let engine = application.engine(Mapping::Automatic);
    let set = hostile_set(4, 32);
    let frames = SampleTimes::fps(30).between(0.0, 20.0);
    for method in METHODS {
        let found = engine.evaluate(&set, method, &frames).unwrap();
        let cpu = Engine::new(Device::Cpu).unwrap();
        let expected = cpu.evaluate(&set, method, &frames).unwrap();
        assert_eq!(
            first_difference(expected.as_quats(), found.as_quats()),
            None,
            "{method}"
        );
    }
}

/// Results in a renderer's buffer are not copied to the host.
#[test]
fn results_stay_in_an_applications_own_buffer() {
    if vulkan_devices().is_empty() {
        return;
    }
    for mapping in [Mapping::Runs, Mapping::Samples] {
        assert_stays_in_application_buffer(mapping);
    }
}

#[allow(unsafe_code)] // the buffer is the application's
fn assert_stays_in_application_buffer(mapping: Mapping) {
    use crate::application::ApplicationBuffer;
    let application = crate::application::Application::new();
    let engine = application.engine(mapping);
    // Some intervals rotate so far that the host computes their samples.
    let mut set = hostile_set(4, 32);
    let about_x = |angle| glam::Quat::from_rotation_x(angle);
    let keys = [0.0, 3.0, 0.5, 2.5, 1.0].map(about_x);
    set.push("wild", &[0.0, 0.001, 2.0, 2.001, 5.0], &keys)
        .unwrap();
    let frames = SampleTimes::fps(30).between(0.0, 20.0);
    let sparse = SampleTimes::at(vec![0.3, 7.0]);
    for method in METHODS {
        let clip = engine.upload(&set, method).unwrap();
        let requests = [&frames, &sparse].into_iter();
        let requests = requests.flat_map(|frames| Encoding::ALL.map(|encoding| (frames, encoding)));
        for (frames, encoding) in requests {
            let expected = clip
                .request(frames)
                .layout(Layout::FrameMajor)
                .encoding(encoding)
                .evaluate_bytes()
                .unwrap();
            // The range does not begin at the start of the buffer, nor at an alignment that devices
            // prefer.
            let offset = 5 * encoding.bytes() as u64;
            let size = expected.len() as u64;
            let (buffer, memory) = application.buffer(offset + size);
            let stretch = |offset, size| VulkanBuffer::new(buffer, size).at(offset);
            let write = |stretch| {
                // SAFETY: the buffer is as it must be, and nothing else uses it.
                unsafe {
                    clip.request(frames)
                        .layout(Layout::FrameMajor)
                        .encoding(encoding)
                        .to_buffer(stretch)
                }
            };
            write(stretch(offset, size)).unwrap();
            let found = application.bytes(memory, offset + size);
            assert!(
                found[offset as usize..] == expected,
                "{method}, {encoding:?}"
            );
            let refused = [
                (stretch(offset + 1, size), "ends beyond the buffer"),
                (stretch(offset, size - 1), "does not fit"),
            ];
            for (stretch, expected) in refused {
                let error = write(stretch).unwrap_err();
                assert!(error.to_string().contains(expected), "{error}");
            }
            // SAFETY: the device has written all that it will.
            unsafe {
                application.device.destroy_buffer(buffer, None);
                application.device.free_memory(memory, None);
            }
        }
    }
    let cpu = Engine::new(Device::Cpu).unwrap();
    // Some samples of some tracks of a set: only the segments that they need are prepared.
    for (frames, samples) in [(&frames, 100..150), (&sparse, 1..2)] {
        for method in [method::SLERP, method::C2] {
            let part = |engine: &Engine| {
                let request = engine.request(&set, method, frames);
                let request = request.layout(Layout::FrameMajor).tracks(3..33);
                let request = request.samples(samples.clone());
                let bytes = request.evaluate_bytes().unwrap();
                let buffer = ApplicationBuffer::of(&application, &vec![0; bytes.len()]);
                let range = buffer.range(0, bytes.len() as u64);
                if std::ptr::eq(engine, &raw const cpu) {
                    return [bytes.clone(), bytes];
                }
                // SAFETY: the buffer is as it must be, and nothing else uses it.
                unsafe { request.to_buffer(range) }.unwrap();
                let found = buffer.bytes();
                // SAFETY: as above.
                let target = unsafe { request.target(range) }.unwrap();
                assert_eq!(target.bytes(), bytes.len() as u64);
                [bytes, found]
            };
            assert!(part(&engine) == part(&cpu), "{method}");
        }
    }
    let clip = cpu.upload(&set, method::SLERP).unwrap();
    let nowhere = VulkanBuffer::new(ash::vk::Buffer::null(), u64::MAX);
    // SAFETY: the CPU refuses.
    let result = unsafe { clip.request(&frames).to_buffer(nowhere) };
    assert!(result.is_err());
}

/// Catches a store beside the caller's memory, which software devices write in place, and samples that are
/// left out: at any offset in its pages, in windows, repaired by the host, in every encoding.
#[test]
fn the_callers_memory_gets_the_result_and_nothing_else() {
    let cpu = Engine::new(Device::Cpu).unwrap();
    let set = hostile_set(5, 256);
    let frames = SampleTimes::fps(60).between(0.0, 9.0);
    let engines = vulkan_engines(|_| {});
    for (index, method) in [method::SLERP, method::C2].into_iter().enumerate() {
        let expected_of = cpu.upload(&set, method).unwrap();
        let upload = |engine: &Engine| engine.upload(&set, method).unwrap();
        let clips: Vec<_> = engines.iter().map(upload).collect();
        let layout = [Layout::TrackMajor, Layout::FrameMajor][index];
        let expected = expected_of
            .request(&frames)
            .layout(layout)
            .evaluate()
            .unwrap();
        assert!(expected.as_quats().len() > 1 << 16, "too few to lend");
        for (clip, beside) in clips
            .iter()
            .zip([1, 3, 256 + index].into_iter().cycle().skip(index))
        {
            assert_between(&SENTINEL, beside, expected.as_quats(), |output| {
                clip.evaluate_into(&frames, layout, output).unwrap();
            });
        }
        for (round, encoding) in Encoding::ALL.into_iter().enumerate() {
            let expected = (expected_of
                .request(&frames)
                .layout(layout)
                .encoding(encoding)
                .evaluate_bytes())
            .unwrap();
            let shifts = [encoding.bytes(), 16, 4099].into_iter().enumerate();
            for (shift, beside) in shifts {
                let is_next = |(clip_index, _): &(usize, _)| {
                    is_due(round + shift, *clip_index, KERNEL_OPTIONS.len())
                };
                for (_, clip) in clips.iter().enumerate().filter(is_next) {
                    assert_between(&0xa5, beside, &expected, |output| {
                        let request = clip.request(&frames).layout(layout);
                        request.encoding(encoding).evaluate_into(output).unwrap();
                    });
                }
            }
        }
    }
}

/// The same straight from keys, which are read where they are unless one turns the sign.
#[test]
fn the_callers_keys_are_read_where_they_are() {
    let cpu = Engine::new(Device::Cpu).unwrap();
    let of_two = |negated: f64| {
        let (pairs, _) = dense_set(1, 140_000, negated);
        let mut set = TrackSet::new();
        for keys in pairs.track(0).keys.chunks(2) {
            set.push("", &[0.0, 1.0], keys).unwrap();
        }
        let times: Vec<f64> = (0..70_000).map(|t| f64::from(t % 1000) * 0.00101).collect();
        (set, SampleTimes::at_each(times))
    };
    let apart = || {
        let (together, frames) = dense_set(70, 1100, 0.0);
        let mut set = TrackSet::new();
        for (index, track) in together.tracks().enumerate() {
            let slower = |time: &f64| time * (1.0 + index as f64 * 1e-4);
            let times: Vec<f64> = track.times.iter().map(slower).collect();
            set.push("", &times, track.keys).unwrap();
        }
        (set, frames)
    };
    let cases = [
        ("many", dense_set(70, 1100, 0.0)),
        ("many, each with its times", apart()),
        ("many, some turned", dense_set(70, 1100, 1e-4)),
        ("long", dense_set(1, 90_000, 0.0)),
        ("long, some turned", dense_set(1, 90_000, 1e-4)),
        ("pairs", of_two(0.0)),
        ("pairs, some turned", of_two(0.01)),
    ];
    for engine in vulkan_engines(|_| {}) {
        let (set, nothing) = (&cases[0].1.0, SampleTimes::at(Vec::new()));
        let found = engine.evaluate(set, method::SLERP, &nothing).unwrap();
        assert!(found.as_quats().is_empty());
        for (label, (set, frames)) in &cases {
            for method in [method::SLERP, method::CATMULL_ROM] {
                let layout = Layout::TrackMajor;
                let expected = cpu.evaluate(set, method, frames).unwrap();
                assert!(
                    expected.as_quats().len() > 1 << 16,
                    "{label}: too few to lend"
                );
                assert_between(&SENTINEL, 5, expected.as_quats(), |output| {
                    let done = engine.evaluate_into(set, method, frames, layout, output);
                    done.unwrap_or_else(|error| panic!("{label}, {method}: {error}"));
                });
            }
        }
    }
}

/// No result has this value, so samples that were not written are found.
const SENTINEL: Quat = Quat::from_xyzw(7.0, 7.0, 7.0, 7.0);

/// That `work` writes what is expected, and nothing `beside` it on either side.
fn assert_between<T: Pod>(outside: &T, beside: usize, expected: &[T], work: impl FnOnce(&mut [T])) {
    let mut all = vec![*outside; expected.len() + 2 * beside];
    work(&mut all[beside..][..expected.len()]);
    let (before, rest) = all.split_at(beside);
    let (found, after) = rest.split_at(expected.len());
    let bytes = |values: &[T]| bytemuck::cast_slice::<T, u8>(values).to_vec();
    assert!(bytes(found) == bytes(expected), "beside {beside}");
    for values in [before, after] {
        assert!(
            bytes(values) == bytes(&vec![*outside; beside]),
            "beside {beside}"
        );
    }
}

/// Queues that an application cannot have meant: of families that are not there or cannot compute, and one
/// queue for both.
#[test]
fn queues_that_cannot_do_their_work_are_refused() {
    use crate::application::Application;
    use tumble::Error;
    use tumble::vulkan::VulkanQueue;
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    for family in [1000, u32::MAX] {
        let error = application.refused(|handles| handles.queue_family = family);
        let Error::Vulkan(VulkanError::QueueFamily { family: found, .. }) = error else {
            panic!("{error}");
        };
        assert_eq!(found, family);
    }
    let queue = application.queue;
    let copies = |family| Some(VulkanQueue::new(queue, family));
    let error = application.refused(|handles| handles.copy_queue = copies(1000));
    assert!(
        error.to_string().contains("family 1000, which cannot copy"),
        "{error}"
    );
    let error = application.refused(|handles| handles.copy_queue = copies(0));
    assert!(
        matches!(error, Error::Vulkan(VulkanError::SameQueue)),
        "{error}"
    );
}

/// The application's device has its own `vkQueueSubmit`, which looks whether the thread that calls it has the lock: two
/// threads that submit at the same time would only sometimes be noticed.
#[test]
#[allow(unsafe_code)] // the device is the application's
fn an_engine_submits_within_the_application_s_lock() {
    use crate::application::Application;
    use ash::vk;
    use std::cell::Cell;
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use tumble::vulkan::QueueLock;

    thread_local! { static HAS_LOCK: Cell<bool> = const { Cell::new(false) }; }
    static OF_DRIVER: OnceLock<vk::PFN_vkQueueSubmit> = OnceLock::new();
    static WITH_LOCK: AtomicUsize = AtomicUsize::new(0);
    static WITHOUT: AtomicUsize = AtomicUsize::new(0);
    unsafe extern "system" fn submit(
        queue: vk::Queue,
        count: u32,
        submits: *const vk::SubmitInfo<'_>,
        fence: vk::Fence,
    ) -> vk::Result {
        let counter = if HAS_LOCK.get() { &WITH_LOCK } else { &WITHOUT };
        counter.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the arguments of the caller.
        unsafe { OF_DRIVER.get().unwrap()(queue, count, submits, fence) }
    }

    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let device = &application.device;
    let mut functions = device.fp_v1_0().clone();
    OF_DRIVER.set(functions.queue_submit).unwrap();
    functions.queue_submit = submit;
    let mut handles = application.handles();
    handles.device = ash::Device::from_parts_1_3(
        device.handle(),
        functions,
        device.fp_v1_1().clone(),
        device.fp_v1_2().clone(),
        device.fp_v1_3().clone(),
    );
    handles.copy_queue = None; // engines use it alone, without a lock
    handles.queue_lock = Some(QueueLock::new(|work| {
        HAS_LOCK.set(true);
        work();
        HAS_LOCK.set(false);
    }));
    // SAFETY: the handles belong together and outlive the engine.
    let engine = unsafe { Engine::from_vulkan(handles, &EngineOptions::default()) }.unwrap();
    let set = hostile_set(3, 40);
    for frames in [
        SampleTimes::fps(60).between(0.0, 5.0),
        SampleTimes::at(vec![0.3]),
    ] {
        for method in [method::SLERP, method::C2] {
            let before = WITH_LOCK.load(Ordering::Relaxed);
            engine.evaluate(&set, method, &frames).unwrap();
            let clip = engine.upload(&set, method).unwrap();
            clip.evaluate(&frames).unwrap();
            assert!(WITH_LOCK.load(Ordering::Relaxed) > before);
        }
    }
    assert_eq!(WITHOUT.load(Ordering::Relaxed), 0);
}

/// An application that submits from another thread while the engine evaluates, each with the queue's lock: neither waits
/// for the other forever.
#[test]
fn an_application_and_an_engine_share_a_queue_by_its_lock() {
    use crate::application::{Application, Commands};
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let engine = application.engine(Mapping::Automatic);
    let set = hostile_set(3, 40);
    let frames = SampleTimes::fps(60).between(0.0, 5.0);
    let expected = Engine::new(Device::Cpu)
        .unwrap()
        .evaluate(&set, method::C2, &frames);
    let expected = expected.unwrap();
    std::thread::scope(|scope| {
        let submit = || {
            let commands = Commands::new(&application);
            let empty = commands.recorded(|_| ());
            for _ in 0..200 {
                commands.run(&[empty]);
            }
        };
        let other = scope.spawn(submit);
        while !other.is_finished() {
            let found = engine.evaluate(&set, method::C2, &frames).unwrap();
            assert_eq!(
                first_difference(expected.as_quats(), found.as_quats()),
                None
            );
        }
    });
}

/// Engines of one application's device use the same queue, without a lock of the application. The validation layers
/// report two threads that submit at the same time.
#[test]
#[allow(unsafe_code)] // the device is the application's
fn engines_on_one_queue_take_turns() {
    use crate::application::Application;
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let engine = || {
        let mut handles = application.handles();
        handles.queue_lock = None;
        // SAFETY: the handles belong together and outlive the engine.
        unsafe { Engine::from_vulkan(handles, &EngineOptions::default()) }.unwrap()
    };
    let engines: Vec<Engine> = (0..4).map(|_| engine()).collect();
    let set = hostile_set(2, 8);
    let frames = SampleTimes::fps(30).between(0.0, 1.0);
    let evaluate = |engine: &Engine| engine.evaluate(&set, method::SLERP, &frames).unwrap();
    let expected = evaluate(&Engine::new(Device::Cpu).unwrap());
    std::thread::scope(|scope| {
        for engine in &engines {
            scope.spawn(|| {
                for _ in 0..300 {
                    let found = evaluate(engine);
                    assert_eq!(
                        first_difference(expected.as_quats(), found.as_quats()),
                        None
                    );
                }
            });
        }
    });
}

/// Handles that are null, and versions that are too old.
#[test]
fn handles_that_cannot_be_are_refused() {
    use crate::application::Application;
    use ash::vk;
    use tumble::vulkan::VulkanQueue;
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let refused =
        |change: &dyn Fn(&mut tumble::vulkan::VulkanHandles)| match application.refused(change) {
            tumble::Error::Vulkan(error) => error,
            error => panic!("{error}"),
        };
    let null = |name| VulkanError::NullHandle { name };
    let queue = vk::Queue::null();
    assert_eq!(refused(&|handles| handles.queue = queue), null("queue"));
    let copies = Some(VulkanQueue::new(queue, 0));
    let found = refused(&|handles| handles.copy_queue = copies);
    assert_eq!(found, null("copy_queue"));
    let found = refused(&|handles| handles.physical_device = vk::PhysicalDevice::null());
    assert_eq!(found, null("physical_device"));
    let cache = Some(vk::PipelineCache::null());
    let found = refused(&|handles| handles.pipeline_cache = cache);
    assert_eq!(found, null("pipeline_cache"));
    for stated in [
        0,
        vk::API_VERSION_1_0,
        vk::make_api_version(1, 1, 1, 0),
        u32::MAX,
    ] {
        let found = refused(&|handles| handles.api_version = stated);
        assert_eq!(found, VulkanError::ApiVersion { stated });
    }
    // An application may state a newer version than its loader has.
    for stated in [vk::API_VERSION_1_1, vk::make_api_version(0, 1, 1000, 0)] {
        let mut handles = application.handles();
        handles.api_version = stated;
        // SAFETY: the handles belong together and outlive the engine.
        #[allow(unsafe_code)]
        unsafe { Engine::from_vulkan(handles, &EngineOptions::default()) }.unwrap();
    }
}

/// Null buffers and ranges that end beyond their buffer, some behind 2^64, at once and recorded.
#[test]
#[allow(unsafe_code)] // the buffer is the application's
fn ranges_beyond_their_buffer_are_refused() {
    use crate::application::{Application, ApplicationBuffer};
    use ash::vk;
    use tumble::Error;
    use tumble::vulkan::PosePass;
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let engine = application.engine(Mapping::Automatic);
    let mut set = TrackSet::new();
    set.push("one", &[0.0, 1.0], &[Quat::IDENTITY; 2]).unwrap();
    let clip = engine.upload(&set, method::SLERP).unwrap();
    let frames = SampleTimes::fps(30);
    let buffer = ApplicationBuffer::of(&application, &[0; 4096]);
    let request = clip.request(&frames);
    let null = VulkanBuffer::new(vk::Buffer::null(), 4096);
    // 31 rotations take 496 bytes.
    let at_end = u64::MAX / 256 * 256;
    let mut wrong = vec![null];
    for (offset, size) in [
        (1 << 20, 512),
        (256, 1 << 20),
        (at_end, 512),
        (256, u64::MAX),
        (0, u64::MAX),
    ] {
        wrong.push(buffer.range(offset, size));
    }
    for range in wrong {
        let expected = |error: Error| match error {
            Error::Vulkan(VulkanError::NullHandle { name: "buffer" }) => {
                range.buffer == null.buffer
            }
            Error::Vulkan(VulkanError::BufferEnd {
                offset,
                size,
                memory,
            }) => (offset, size) == (range.offset, range.size) && memory >= 4096,
            error => panic!("{range:?}: {error}"),
        };
        let pass = |from, result| {
            let weight = 0.5;
            let to = buffer.range(2048, 1024);
            let mix = PosePass::Mix { from, to, weight };
            // SAFETY: a wrong range is refused, the others are as they must be.
            unsafe {
                engine
                    .pass(mix, 1, 31, Layout::TrackMajor)
                    .to_buffer(result)
            }
        };
        let good = buffer.range(512, 512);
        // SAFETY: a wrong range is refused before it is used.
        let errors = unsafe {
            [
                request.to_buffer(range).unwrap_err(),
                request.target(range).map(|_| ()).unwrap_err(),
                pass(range, good).unwrap_err(),
                pass(good, range).unwrap_err(),
            ]
        };
        for error in errors {
            assert!(expected(error), "{range:?}");
        }
    }
    // An engine that opened its device cannot be given another device's buffer.
    let other = Engine::new(vulkan_devices().swap_remove(0)).unwrap();
    let clip = other.upload(&set, method::SLERP).unwrap();
    // SAFETY: as above.
    let error = unsafe { clip.request(&frames).to_buffer(buffer.range(0, 512)) };
    assert!(matches!(error, Err(Error::BufferOfOther)), "{error:?}");
}

/// An engine reads and writes files only where its options say.
#[test]
fn files_are_written_only_where_the_options_say() {
    if vulkan_devices().is_empty() {
        return;
    }
    let (user, named) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let files_after = |cache: &str| {
        let program = std::env::current_exe().unwrap();
        let output = std::process::Command::new(program)
            .args(["--exact", "vulkan::engines_with_files", "--ignored"])
            .env("TUMBLE_CACHE_DIR", user.path())
            .env("ENGINE_CACHE", cache)
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        [&user, &named].map(|folder| {
            let kind = |entry: std::io::Result<std::fs::DirEntry>| {
                let name = entry.unwrap().file_name().into_string().unwrap();
                name.split('-').next().unwrap().to_owned()
            };
            let all = std::fs::read_dir(folder.path()).unwrap().map(kind);
            all.collect::<std::collections::BTreeSet<_>>()
        })
    };
    let none: [&str; 0] = [];
    let [of_user, of_named] = files_after("off");
    assert!(of_user.is_empty() && of_named.is_empty(), "{of_user:?}");
    let with_pipelines = format!("pipelines {}", named.path().display());
    let [of_user, of_named] = files_after(&with_pipelines);
    assert_eq!((of_user.len(), of_named), (0, ["kernel".to_owned()].into()));
    let [of_user, of_named] = files_after(&named.path().display().to_string());
    let both = ["kernel".to_owned(), "pipelines".to_owned()];
    assert_eq!(of_user.iter().collect::<Vec<_>>(), none);
    assert_eq!(of_named, both.clone().into());
    assert_eq!(files_after("user")[0], both.into());
}

/// The test above runs each of these in a child process.
#[test]
#[ignore = "run by files_are_written_only_where_the_options_say"]
#[allow(unsafe_code)] // the device is the application's
fn engines_with_files() {
    use crate::application::Application;
    use tumble::CacheFiles;
    let cache = std::env::var("ENGINE_CACHE").unwrap();
    let (brings_cache, folder) = match cache.strip_prefix("pipelines ") {
        Some(folder) => (true, folder),
        None => (false, &*cache),
    };
    let mut options = EngineOptions::default();
    options.cache_files = match folder {
        "user" => CacheFiles::OfUser,
        "off" => CacheFiles::Off,
        folder => CacheFiles::Within(folder.into()),
    };
    let application = Application::new();
    let mut handles = application.handles();
    let info = ash::vk::PipelineCacheCreateInfo::default();
    // SAFETY: plain creation; destroyed below.
    let pipelines = unsafe { application.device.create_pipeline_cache(&info, None) }.unwrap();
    handles.pipeline_cache = brings_cache.then_some(pipelines);
    // SAFETY: the handles belong together and outlive the engine.
    let engine = unsafe { Engine::from_vulkan(handles, &options) }.unwrap();
    engine.warm(method::SLERP, Encoding::F32).unwrap();
    drop(engine);
    // SAFETY: the engine is gone, and has left the cache alive.
    unsafe { application.device.get_pipeline_cache_data(pipelines) }.unwrap();
    // SAFETY: as above.
    unsafe { application.device.destroy_pipeline_cache(pipelines, None) };
}

/// The kernels compiled beforehand are those that evaluating uses, and they are kept for the next process.
#[test]
fn kernels_are_compiled_beforehand() {
    for engine in vulkan_engines(|_| {}) {
        engine.warm(method::C2, Encoding::F32).unwrap();
        engine.warm(method::SLERP, Encoding::F16).unwrap();
        let mut velocity = tumble::Interpolation::from(method::C2);
        velocity.quantity = tumble::Quantity::Velocity(tumble::Axes::Body);
        assert!(engine.warm(velocity, Encoding::F16).is_err());
    }
    let cpu = Engine::new(Device::Cpu).unwrap();
    cpu.warm(method::C2, Encoding::F32).unwrap();
}
