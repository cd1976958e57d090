//! Vulkan's side of the bargain: devices, canaries, validation, handles.

mod support;

use support::{first_difference, hostile_set, vulkan_devices};
use tumble::{Device, Engine, EngineOptions, Frames, Layout, METHODS, Transfer, VulkanError};

#[test]
fn every_device_passes_every_canary() {
    for device in vulkan_devices() {
        let engine = Engine::new(device).unwrap();
        assert_eq!(engine.canaries().len(), 10);
        for canary in engine.canaries() {
            assert!(canary.total > 0, "{canary:?}");
            assert_eq!(canary.differing, 0, "{}: {canary:?}", engine.device_name());
        }
        let info = engine.device_info().unwrap();
        assert!(
            info.max_storage_buffer_range >= 1 << 27,
            "Vulkan guarantees 128 MiB: {info:?}"
        );
    }
}

/// Core and synchronization checks over everything an evaluation does.
#[test]
fn the_validation_layer_has_nothing_to_say() {
    let devices = match Device::list_with(true) {
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
    let requests = [
        Frames::fps(60).between(0.0, 20.0),
        Frames::at(vec![0.5, 0.25, 7.0]),
    ];
    for device in devices {
        for transfer in [Transfer::InPlace, Transfer::Staged] {
            let mut options = EngineOptions::default();
            options.transfer = transfer;
            options.memory = Some(1_000_000);
            let engine = Engine::with_options(device.clone(), &options).unwrap();
            for method in METHODS {
                let clip = engine.upload(&set, method).unwrap();
                for frames in &requests {
                    for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                        clip.evaluate_as(frames, layout).unwrap();
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

/// A renderer hands in what it has.
#[test]
#[allow(unsafe_code)] // creating a device is the application's part
fn an_applications_own_device_gives_the_same_bits() {
    use ash::vk;
    use tumble::VulkanHandles;

    if vulkan_devices().is_empty() {
        return;
    }
    // SAFETY: plain creation; everything is destroyed below, after the engine.
    let (entry, instance) = unsafe {
        let entry = ash::Entry::load().unwrap();
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_1);
        let info = vk::InstanceCreateInfo::default().application_info(&application);
        let instance = entry.create_instance(&info, None).unwrap();
        (entry, instance)
    };
    // SAFETY: as above.
    let (physical_device, device, queue) = unsafe {
        let physical_device = instance.enumerate_physical_devices().unwrap()[0];
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(0)
            .queue_priorities(&[1.0])];
        let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues);
        let device = instance
            .create_device(physical_device, &info, None)
            .unwrap();
        let queue = device.get_device_queue(0, 0);
        (physical_device, device, queue)
    };
    let handles = VulkanHandles {
        entry,
        instance: instance.clone(),
        physical_device,
        device: device.clone(),
        queue,
        queue_family: 0,
    };
    // SAFETY: the handles belong together and outlive the engine.
    let engine = unsafe { Engine::from_vulkan(handles, &EngineOptions::default()) }.unwrap();
    let set = hostile_set(4, 32);
    let frames = Frames::fps(30).between(0.0, 20.0);
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
    drop(engine);
    // SAFETY: the engine and its clips are gone.
    unsafe {
        device.destroy_device(None);
        instance.destroy_instance(None);
    }
}
