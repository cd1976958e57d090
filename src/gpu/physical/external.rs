//! Memory and semaphores that a device can import or export.

use ash::vk;

use crate::gpu::physical::PhysicalDevice;

/// The handle type of imported memory: host allocations of this process.
pub(crate) const HOST_ALLOCATION: vk::ExternalMemoryHandleTypeFlags =
    vk::ExternalMemoryHandleTypeFlags::HOST_ALLOCATION_EXT;

/// The handle type of exported memory: an opaque file descriptor.
pub(crate) const FILE: vk::ExternalMemoryHandleTypeFlags =
    vk::ExternalMemoryHandleTypeFlags::OPAQUE_FD;

/// The handle type of exported semaphores: an opaque file descriptor.
pub(crate) const SEMAPHORE_FILE: vk::ExternalSemaphoreHandleTypeFlags =
    vk::ExternalSemaphoreHandleTypeFlags::OPAQUE_FD;

/// The usage of buffers.
pub(crate) fn usage(is_texels: bool) -> vk::BufferUsageFlags {
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER
        | vk::BufferUsageFlags::TRANSFER_SRC
        | vk::BufferUsageFlags::TRANSFER_DST;
    match is_texels {
        true => usage | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER,
        false => usage,
    }
}

/// Whether a device can import host allocations for a buffer.
pub(crate) fn may_be_imported(physical: &PhysicalDevice, is_texels: bool) -> bool {
    let features = external_features(physical, is_texels, HOST_ALLOCATION);
    features.contains(vk::ExternalMemoryFeatureFlags::IMPORTABLE)
}

/// Whether a device can export the memory of a buffer of results as a file descriptor.
pub(crate) fn may_be_exported(physical: &PhysicalDevice) -> bool {
    let features = external_features(physical, false, FILE);
    features.contains(vk::ExternalMemoryFeatureFlags::EXPORTABLE)
}

fn external_features(
    physical: &PhysicalDevice,
    is_texels: bool,
    handle_type: vk::ExternalMemoryHandleTypeFlags,
) -> vk::ExternalMemoryFeatureFlags {
    let info = vk::PhysicalDeviceExternalBufferInfo::default()
        .usage(usage(is_texels))
        .handle_type(handle_type);
    let mut found = vk::ExternalBufferProperties::default();
    let instance = &physical.instance.raw;
    // SAFETY: Vulkan 1.1, and a device of the instance.
    unsafe {
        instance.get_physical_device_external_buffer_properties(physical.raw, &info, &mut found);
    }
    found.external_memory_properties.external_memory_features
}

/// Whether a device can export timeline semaphores as file descriptors.
pub(crate) fn timelines_may_be_exported(physical: &PhysicalDevice) -> bool {
    let mut kind =
        vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
    let info = vk::PhysicalDeviceExternalSemaphoreInfo::default()
        .handle_type(SEMAPHORE_FILE)
        .push_next(&mut kind);
    let mut found = vk::ExternalSemaphoreProperties::default();
    let instance = &physical.instance.raw;
    // SAFETY: Vulkan 1.2, which knows the structure that is chained, and a device of the instance.
    unsafe {
        instance.get_physical_device_external_semaphore_properties(physical.raw, &info, &mut found);
    }
    let features = found.external_semaphore_features;
    features.contains(vk::ExternalSemaphoreFeatureFlags::EXPORTABLE)
}
