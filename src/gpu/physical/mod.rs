//! The properties of a Vulkan device.

#[cfg(test)]
pub(crate) mod cards;
#[cfg(feature = "lab")]
pub(crate) mod details;
pub(crate) mod external;
pub(crate) mod queues;
pub(crate) mod shapes;
pub(crate) mod upload_memory;

use std::sync::Arc;
use std::time::Duration;

use ash::{ext, khr, vk};
use tumble_exact::FloatControls;

use crate::gpu::instance::{self, Instance};
use crate::gpu::physical::queues::{Copies, check_family, compute_family, copies};
use crate::gpu::physical::upload_memory::is_unified;
use crate::machine::ListedDevice;
use crate::machine::error::VulkanError;
use crate::machine::error::calls::Named;
use crate::machine::options::{EngineOptions, Mapping, Reads, Transfer};
pub(crate) use crate::machine::reports::{DeviceInfo, DeviceKind};
use crate::shader::MAX_SUBGROUP_POSITIONS;

/// Bytes of one texel of the texel buffers that kernels read.
const TEXEL_BYTES: u64 = 16;

/// The maximum number of storage buffers that a kernel binds without texel buffers, except for kernels over whole
/// instances of crowds, which others can replace. Vulkan guarantees 4.
const MAX_STORAGE_BUFFERS: u32 = 6;

/// A physical device, not yet opened.
#[derive(Clone)]
pub(crate) struct PhysicalDevice {
    pub(crate) instance: Arc<Instance>,
    pub(crate) raw: vk::PhysicalDevice,
    pub(crate) queue_family: u32,
    /// The driver's version number, in the driver's format.
    pub(crate) driver_version: u32,
    families: Vec<vk::QueueFamilyProperties>,
    /// The unit of time stamps, nanoseconds.
    timestamp_period: f64,
    pub(crate) float_controls: FloatControls,
    /// Whether the float-controls extension must be enabled, because the device is older than Vulkan 1.2.
    pub(crate) float_controls_extension: bool,
    pub(crate) memory: vk::PhysicalDeviceMemoryProperties,
    /// Whether the device has timeline semaphores.
    pub(crate) has_timelines: bool,
    /// Whether the extension of timeline semaphores must be enabled, because the device is older than Vulkan 1.2.
    pub(crate) timelines_extension: bool,
    max_texel_buffer_elements: u32,
    /// The size and alignment in bytes in which non-coherent memory is invalidated and flushed.
    pub(crate) non_coherent_atom: u64,
    /// The maximum number of storage buffers that a kernel may bind.
    pub(crate) storage_buffers: u32,
    /// Whether the device implements a subset of Vulkan (`MoltenVK`), whose extension must be enabled.
    pub(crate) portability_subset: bool,
    /// The expected header of a pipeline cache: vendor, device and the cache's UUID.
    pub(crate) pipeline_cache: (u32, u32, [u8; 16]),
    /// Whether shaders may use integers of 64 bits.
    pub(crate) has_int64: bool,
    /// Whether kernels may use the device's conversion to half precision: it rounds to nearest, ties to even, keeps
    /// subnormal numbers (also if f32 operations flush them), and buffers may contain halves.
    pub(crate) converts_halves: bool,
    /// The lanes of a subgroup, if they are as many as kernels need and can vote and shuffle in them.
    pub(crate) subgroup_lanes: Option<u32>,
    /// Whether memory and semaphores can be exported as file descriptors (`VK_KHR_external_memory_fd`,
    /// `VK_KHR_external_semaphore_fd`).
    pub(crate) memory_files: bool,
    pub(crate) semaphore_files: bool,
    /// The alignment of imported memory in bytes; `None` if memory cannot be imported.
    pub(crate) lent_alignment: Option<u64>,
    pub(crate) info: DeviceInfo,
}

/// As [`list`], for engines.
pub(crate) fn listed(validation: bool) -> Result<Vec<Arc<dyn ListedDevice>>, VulkanError> {
    let devices = list(validation)?.into_iter();
    Ok(devices.map(|device| Arc::new(device) as _).collect())
}

/// Lists every device with a compute queue and Vulkan 1.1, fastest kind first; devices of one kind in the loader's
/// order.
pub(crate) fn list(validation: bool) -> Result<Vec<PhysicalDevice>, VulkanError> {
    let instance = Instance::new(validation)?;
    let mut devices = Vec::new();
    let mut failed = None;
    // SAFETY: the instance is alive.
    let all = unsafe { instance.raw.enumerate_physical_devices() };
    for raw in all.named("vkEnumeratePhysicalDevices")? {
        match PhysicalDevice::new(&instance, raw) {
            Ok(device) => devices.extend(device),
            // The search continues, because other devices may work.
            Err(error) => failed = Some(error),
        }
    }
    if let (true, Some(error)) = (devices.is_empty(), failed) {
        return Err(error);
    }
    if devices.is_empty() && instance::lacks_nvidia_driver() {
        return Err(VulkanError::NoNvidiaDriver);
    }
    devices.sort_by_key(|device| device.info.kind);
    Ok(devices)
}

impl PhysicalDevice {
    /// Reads a device's properties; `None` if it cannot compute or has only Vulkan 1.0.
    pub(crate) fn new(
        instance: &Arc<Instance>,
        raw: vk::PhysicalDevice,
    ) -> Result<Option<Self>, VulkanError> {
        let vk_instance = &instance.raw;
        // SAFETY: `raw` was enumerated from this instance, here and below.
        let families = unsafe { vk_instance.get_physical_device_queue_family_properties(raw) };
        // SAFETY: `raw` was enumerated from this instance.
        let properties = unsafe { vk_instance.get_physical_device_properties(raw) };
        let Some(queue_family) = compute_family(&families) else {
            return Ok(None);
        };
        if properties.api_version < vk::API_VERSION_1_1 {
            return Ok(None);
        }
        // SAFETY: `raw` was enumerated from this instance.
        let extensions = unsafe { vk_instance.enumerate_device_extension_properties(raw) }
            .named("vkEnumerateDeviceExtensionProperties")?;
        let has = |name| {
            extensions
                .iter()
                .any(|e| e.extension_name_as_c_str() == Ok(name))
        };
        let core_1_2 = properties.api_version >= vk::API_VERSION_1_2;
        let reports_controls = core_1_2 || has(khr::shader_float_controls::NAME);

        let mut controls = vk::PhysicalDeviceFloatControlsProperties::default();
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut maintenance = vk::PhysicalDeviceMaintenance3Properties::default();
        let mut imported = vk::PhysicalDeviceExternalMemoryHostPropertiesEXT::default();
        let mut id = vk::PhysicalDeviceIDProperties::default();
        let mut subgroups = vk::PhysicalDeviceSubgroupProperties::default();
        let mut all = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut maintenance)
            .push_next(&mut id)
            .push_next(&mut subgroups);
        let borrows = has(ext::external_memory_host::NAME);
        if borrows {
            all = all.push_next(&mut imported);
        }
        if reports_controls {
            all = all.push_next(&mut controls);
        }
        if core_1_2 || has(khr::driver_properties::NAME) {
            all = all.push_next(&mut driver);
        }
        // SAFETY: Vulkan 1.1; only structures that the device knows are chained.
        unsafe { vk_instance.get_physical_device_properties2(raw, &mut all) };
        // SAFETY: `raw` was enumerated from this instance.
        let memory = unsafe { vk_instance.get_physical_device_memory_properties(raw) };
        let mut timelines = vk::PhysicalDeviceTimelineSemaphoreFeatures::default();
        let mut features = vk::PhysicalDeviceFeatures2::default();
        let reports_timelines = core_1_2 || has(khr::timeline_semaphore::NAME);
        if reports_timelines {
            features = features.push_next(&mut timelines);
        }
        let mut halves = vk::PhysicalDeviceShaderFloat16Int8Features::default();
        let mut stored_halves = vk::PhysicalDevice16BitStorageFeatures::default();
        if core_1_2 {
            features = features
                .push_next(&mut halves)
                .push_next(&mut stored_halves);
        }
        // SAFETY: Vulkan 1.1; the device knows the structures that are chained.
        unsafe { vk_instance.get_physical_device_features2(raw, &mut features) };
        let has_int64 = features.features.shader_int64 == vk::TRUE;
        let converts_halves = [
            halves.shader_float16,
            stored_halves.storage_buffer16_bit_access,
            stored_halves.uniform_and_storage_buffer16_bit_access,
            controls.shader_rounding_mode_rte_float16,
            controls.shader_rounding_mode_rte_float32,
            controls.shader_denorm_preserve_float16,
        ];
        let converts_halves = converts_halves.iter().all(|is_there| *is_there == vk::TRUE)
            && controls.denorm_behavior_independence != vk::ShaderFloatControlsIndependence::NONE;
        let float_controls = FloatControls::default()
            .with_preserve_signed_zero_inf_nan(
                controls.shader_signed_zero_inf_nan_preserve_float32 == vk::TRUE,
            )
            .with_round_to_nearest_even(controls.shader_rounding_mode_rte_float32 == vk::TRUE);
        let limits = &properties.limits;
        let text = |name: Result<&std::ffi::CStr, _>| {
            name.map(|name| name.to_string_lossy().into_owned())
                .unwrap_or_default()
        };
        let version = properties.api_version;
        let heaps = memory.memory_heaps_as_slice().iter();
        let local = |h: &&vk::MemoryHeap| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL);
        let driver = [driver.driver_name_as_c_str(), driver.driver_info_as_c_str()];
        let info = DeviceInfo {
            name: text(properties.device_name_as_c_str()),
            driver: driver.map(text).join(" ").trim().to_owned(),
            kind: kind(properties.device_type),
            api_version: format!(
                "{}.{}.{}",
                vk::api_version_major(version),
                vk::api_version_minor(version),
                vk::api_version_patch(version)
            ),
            vendor_id: properties.vendor_id,
            device_id: properties.device_id,
            uuid: uuid(id.device_uuid),
            max_storage_buffer_range: u64::from(limits.max_storage_buffer_range),
            max_memory_allocation_size: maintenance.max_memory_allocation_size,
            max_compute_work_group_invocations: limits.max_compute_work_group_invocations,
            max_compute_work_group_count: limits.max_compute_work_group_count,
            min_storage_buffer_offset_alignment: limits.min_storage_buffer_offset_alignment,
            device_local_memory: heaps.filter(local).map(|heap| heap.size).sum(),
            preserves_signed_zero_inf_nan: float_controls.preserve_signed_zero_inf_nan,
            rounds_to_nearest_even: float_controls.round_to_nearest_even,
        };
        Ok(Some(Self {
            instance: Arc::clone(instance),
            raw,
            queue_family,
            driver_version: properties.driver_version,
            families,
            timestamp_period: f64::from(limits.timestamp_period),
            float_controls,
            float_controls_extension: reports_controls && !core_1_2,
            memory,
            has_timelines: timelines.timeline_semaphore == vk::TRUE,
            timelines_extension: reports_timelines && !core_1_2,
            has_int64,
            converts_halves,
            subgroup_lanes: subgroup_lanes(&subgroups),
            max_texel_buffer_elements: limits.max_texel_buffer_elements,
            non_coherent_atom: limits.non_coherent_atom_size.max(1),
            storage_buffers: limits.max_per_stage_descriptor_storage_buffers,
            portability_subset: has(khr::portability_subset::NAME),
            memory_files: cfg!(unix) && has(khr::external_memory_fd::NAME),
            semaphore_files: cfg!(unix) && core_1_2 && has(khr::external_semaphore_fd::NAME),
            pipeline_cache: (
                properties.vendor_id,
                properties.device_id,
                properties.pipeline_cache_uuid,
            ),
            lent_alignment: borrows.then_some(imported.min_imported_host_pointer_alignment),
            info,
        }))
    }

    /// Whether the device's kernels read texel buffers and store 64 bits at once. Hardware combines the loads of
    /// neighbouring lanes. Lavapipe loads lane by lane, and 32 bits of a storage buffer take longer than a texel of
    /// 128 bits.
    pub(crate) fn reads_texels(&self, reads: Reads) -> bool {
        let longest = u64::from(self.max_texel_buffer_elements) * TEXEL_BYTES;
        let can = self.has_int64 && longest >= self.info.max_memory_allocation_size;
        match reads {
            // Some devices can bind few storage buffers, but texel buffers in addition to them.
            Reads::Automatic => {
                can && (self.info.kind == DeviceKind::Cpu
                    || self.storage_buffers < MAX_STORAGE_BUFFERS)
            }
            Reads::StorageBuffers => false,
            Reads::TexelBuffers => can,
        }
    }

    /// Whether neighbouring invocations evaluate neighbouring samples. Hardware runs neighbouring lanes together, and
    /// writes their stores to neighbouring addresses as whole lines; software devices store lane by lane.
    pub(crate) fn maps_samples(&self, mapping: Mapping) -> bool {
        match mapping {
            Mapping::Automatic => {
                self.storage_buffers >= MAX_STORAGE_BUFFERS
                    && !matches!(self.info.kind, DeviceKind::Cpu | DeviceKind::Other)
            }
            Mapping::Runs => false,
            Mapping::Samples => true,
        }
    }

    /// Whether the host reads results where kernels write them; otherwise they are copied from device memory.
    pub(crate) fn in_place(&self, transfer: Transfer) -> bool {
        match (transfer, self.info.kind) {
            (Transfer::InPlace, _)
            | (Transfer::Automatic, DeviceKind::Integrated | DeviceKind::Cpu) => true,
            (Transfer::Staged, _) | (Transfer::Automatic, DeviceKind::Discrete) => false,
            (Transfer::Automatic, DeviceKind::Virtual | DeviceKind::Other) => {
                is_unified(&self.memory)
            }
        }
    }

    /// The method of copying staged results.
    pub(crate) fn copies(&self, options: &EngineOptions) -> Copies {
        if self.in_place(options.transfer) || !self.has_timelines {
            return Copies::Together;
        }
        let is_software = matches!(self.info.kind, DeviceKind::Cpu | DeviceKind::Other);
        copies(
            &self.families,
            self.queue_family,
            options.read_back,
            is_software,
        )
    }

    /// Refuses a queue family that does not exist, or has none of the flags `any_of`.
    pub(crate) fn check_family(
        &self,
        family: u32,
        any_of: vk::QueueFlags,
        work: &'static str,
    ) -> Result<(), VulkanError> {
        check_family(&self.families, family, any_of, work)
    }

    /// Refuses a size that kernels cannot access as one buffer.
    pub(crate) fn check_range(&self, subject: &'static str, bytes: u64) -> Result<(), VulkanError> {
        let limit = self.info.max_storage_buffer_range;
        match bytes > limit {
            true => Err(VulkanError::TooLarge {
                subject,
                bytes,
                limit,
            }),
            false => Ok(()),
        }
    }

    /// The number of valid bits of time stamps of the compute queue; 0 if there are none.
    pub(crate) fn timestamp_bits(&self) -> u32 {
        let family = self.families.get(self.queue_family as usize);
        family.map_or(0, |family| family.timestamp_valid_bits)
    }

    /// The time between two stamps.
    pub(crate) fn between(&self, start: u64, end: u64) -> Duration {
        let bits = self.timestamp_bits();
        let ticks = end.wrapping_sub(start) & (u64::MAX >> (64 - bits.clamp(1, 64)));
        Duration::from_nanos((ticks as f64 * self.timestamp_period) as u64)
    }

    /// Whether memory of a type is coherent: the host and the device see each other's writes without flushing.
    pub(crate) fn is_coherent(&self, memory_type: u32) -> bool {
        let flags = self.memory.memory_types[memory_type as usize].property_flags;
        flags.contains(vk::MemoryPropertyFlags::HOST_COHERENT)
    }

    /// The first memory type of `allowed` with all of `required`, and with the first of `preferred` that any type
    /// has.
    pub(crate) fn memory_type(
        &self,
        allowed: u32,
        required: vk::MemoryPropertyFlags,
        preferred: &[vk::MemoryPropertyFlags],
    ) -> Option<u32> {
        let types = self.memory.memory_types_as_slice();
        let find = |properties| {
            (0..types.len() as u32).find(|&i| {
                allowed & (1 << i) != 0 && types[i as usize].property_flags.contains(properties)
            })
        };
        let mut preferred = preferred.iter();
        let found = preferred.find_map(|&flags| find(required | flags));
        found.or_else(|| find(required))
    }
}

/// The number of lanes of a subgroup of a compute kernel; `None` if kernels cannot use the subgroups. They can if there
/// are enough lanes to divide among positions, not more lanes than a ballot of two words has bits, and if the lanes can
/// vote and shuffle.
fn subgroup_lanes(properties: &vk::PhysicalDeviceSubgroupProperties<'_>) -> Option<u32> {
    const LANES: std::ops::RangeInclusive<u32> = 2 * MAX_SUBGROUP_POSITIONS..=64;
    let needed = vk::SubgroupFeatureFlags::BASIC
        | vk::SubgroupFeatureFlags::BALLOT
        | vk::SubgroupFeatureFlags::SHUFFLE;
    let can = (properties.supported_stages).contains(vk::ShaderStageFlags::COMPUTE)
        && properties.supported_operations.contains(needed);
    let lanes = properties.subgroup_size;
    (can && LANES.contains(&lanes) && lanes.is_power_of_two()).then_some(lanes)
}

fn kind(device_type: vk::PhysicalDeviceType) -> DeviceKind {
    match device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
        vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
        vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
        vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
        _ => DeviceKind::Other,
    }
}

/// The UUID in the notation of RFC 9562.
fn uuid(bytes: [u8; 16]) -> String {
    let digits: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    let parts = [0..8, 8..12, 12..16, 16..20, 20..32];
    parts.map(|part| &digits[part]).join("-")
}
