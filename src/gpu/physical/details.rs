//! Details of a device in addition to [`DeviceInfo`](crate::gpu::physical::DeviceInfo), as the driver reports them:
//! loader, memory, queues and address on the bus.

use ash::{ext, vk};

use crate::gpu::physical::PhysicalDevice;

/// Details that Vulkan reports of a device.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct DeviceDetails {
    /// The loader's Vulkan version.
    pub loader: String,
    /// The driver's version number, in the driver's format.
    pub driver_version: u32,
    /// The memory heaps, in Vulkan's order.
    pub heaps: Vec<MemoryHeap>,
    /// The memory types, in Vulkan's order.
    pub memory_types: Vec<MemoryType>,
    /// The queue families, in Vulkan's order.
    pub queue_families: Vec<QueueFamily>,
    /// The unit of time stamps, nanoseconds.
    pub timestamp_period: f64,
    /// The limits that affect the engine.
    pub limits: Limits,
    /// The properties of f32 arithmetic.
    pub float_controls: FloatControlsReport,
    /// The address on the PCI bus, `0000:01:00.0`, if the driver reports it.
    pub pci_address: Option<String>,
}

/// A memory heap.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct MemoryHeap {
    /// The size in bytes.
    pub bytes: u64,
    /// Whether the heap is device-local.
    pub is_device_local: bool,
}

/// A memory type.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct MemoryType {
    /// The index of the heap.
    pub heap: u32,
    /// The flags: `device-local`, `host-visible`, `host-coherent`, `host-cached`, and others as a number.
    pub properties: Vec<String>,
}

/// A queue family.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct QueueFamily {
    /// The number of queues.
    pub queues: u32,
    /// The flags: `graphics`, `compute`, `transfer`, `sparse`, and others as a number.
    pub abilities: Vec<String>,
    /// The number of valid bits of time stamps; 0 if there are none.
    pub timestamp_bits: u32,
}

/// Limits of a device, with Vulkan's names.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[allow(missing_docs)] // the names are Vulkan's
#[non_exhaustive]
pub struct Limits {
    pub max_storage_buffer_range: u32,
    pub max_per_stage_descriptor_storage_buffers: u32,
    pub max_texel_buffer_elements: u32,
    pub max_push_constants_size: u32,
    pub max_memory_allocation_count: u32,
    pub max_compute_shared_memory_size: u32,
    pub max_compute_work_group_invocations: u32,
    pub max_compute_work_group_size: [u32; 3],
    pub max_compute_work_group_count: [u32; 3],
    pub min_storage_buffer_offset_alignment: u64,
    pub non_coherent_atom_size: u64,
    pub subgroup_size: u32,
}

/// Properties of a device's f32 arithmetic (`VkPhysicalDeviceFloatControlsProperties`).
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[allow(missing_docs)] // the names are Vulkan's
#[non_exhaustive]
pub struct FloatControlsReport {
    pub preserves_signed_zero_inf_nan: bool,
    pub rounds_to_nearest_even: bool,
    pub preserves_denormals: bool,
    pub flushes_denormals: bool,
}

/// The names of the flags that are set; a flag without a name is reported as a number.
fn names(flags: u32, known: &[(u32, &str)]) -> Vec<String> {
    let named = known.iter().filter(|(flag, _)| flags & flag != 0);
    let mut all: Vec<String> = named.map(|(_, name)| (*name).to_owned()).collect();
    let rest = known.iter().fold(flags, |rest, (flag, _)| rest & !flag);
    if rest != 0 {
        all.push(format!("{rest:#x}"));
    }
    all
}

fn version(number: u32) -> String {
    let (major, minor) = (vk::api_version_major(number), vk::api_version_minor(number));
    format!("{major}.{minor}.{}", vk::api_version_patch(number))
}

impl PhysicalDevice {
    /// The details of the device.
    pub(crate) fn details(&self) -> DeviceDetails {
        let instance = &self.instance.raw;
        // SAFETY: the physical device belongs to the instance, here and below.
        let properties = unsafe { instance.get_physical_device_properties(self.raw) };
        // SAFETY: the physical device belongs to the instance.
        let families = unsafe { instance.get_physical_device_queue_family_properties(self.raw) };
        // SAFETY: the physical device belongs to the instance.
        let extensions = unsafe { instance.enumerate_device_extension_properties(self.raw) };
        let extensions = extensions.unwrap_or_default();
        let has = |name| {
            let mut all = extensions.iter();
            all.any(|extension| extension.extension_name_as_c_str() == Ok(name))
        };
        let core_1_2 = properties.api_version >= vk::API_VERSION_1_2;
        let mut controls = vk::PhysicalDeviceFloatControlsProperties::default();
        let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
        let mut bus = vk::PhysicalDevicePCIBusInfoPropertiesEXT::default();
        let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut subgroup);
        if core_1_2 || has(ash::khr::shader_float_controls::NAME) {
            all = all.push_next(&mut controls);
        }
        let has_bus = has(ext::pci_bus_info::NAME);
        if has_bus {
            all = all.push_next(&mut bus);
        }
        // SAFETY: Vulkan 1.1; only structures that the device knows are chained.
        unsafe { instance.get_physical_device_properties2(self.raw, &mut all) };
        let limits = &properties.limits;
        DeviceDetails {
            loader: version(self.instance.loader_version()),
            driver_version: properties.driver_version,
            heaps: (self.memory.memory_heaps_as_slice().iter())
                .map(|heap| MemoryHeap {
                    bytes: heap.size,
                    is_device_local: heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL),
                })
                .collect(),
            memory_types: (self.memory.memory_types_as_slice().iter())
                .map(|kind| MemoryType {
                    heap: kind.heap_index,
                    properties: names(
                        kind.property_flags.as_raw(),
                        &[
                            (1, "device-local"),
                            (2, "host-visible"),
                            (4, "host-coherent"),
                            (8, "host-cached"),
                        ],
                    ),
                })
                .collect(),
            queue_families: (families.iter())
                .map(|family| QueueFamily {
                    queues: family.queue_count,
                    abilities: names(
                        family.queue_flags.as_raw(),
                        &[
                            (1, "graphics"),
                            (2, "compute"),
                            (4, "transfer"),
                            (8, "sparse"),
                        ],
                    ),
                    timestamp_bits: family.timestamp_valid_bits,
                })
                .collect(),
            timestamp_period: f64::from(limits.timestamp_period),
            limits: Limits {
                max_storage_buffer_range: limits.max_storage_buffer_range,
                max_per_stage_descriptor_storage_buffers: limits
                    .max_per_stage_descriptor_storage_buffers,
                max_texel_buffer_elements: limits.max_texel_buffer_elements,
                max_push_constants_size: limits.max_push_constants_size,
                max_memory_allocation_count: limits.max_memory_allocation_count,
                max_compute_shared_memory_size: limits.max_compute_shared_memory_size,
                max_compute_work_group_invocations: limits.max_compute_work_group_invocations,
                max_compute_work_group_size: limits.max_compute_work_group_size,
                max_compute_work_group_count: limits.max_compute_work_group_count,
                min_storage_buffer_offset_alignment: limits.min_storage_buffer_offset_alignment,
                non_coherent_atom_size: limits.non_coherent_atom_size,
                subgroup_size: subgroup.subgroup_size,
            },
            float_controls: FloatControlsReport {
                preserves_signed_zero_inf_nan: self.float_controls.preserve_signed_zero_inf_nan,
                rounds_to_nearest_even: self.float_controls.round_to_nearest_even,
                preserves_denormals: controls.shader_denorm_preserve_float32 == vk::TRUE,
                flushes_denormals: controls.shader_denorm_flush_to_zero_float32 == vk::TRUE,
            },
            pci_address: has_bus.then(|| {
                let (domain, bus_number) = (bus.pci_domain, bus.pci_bus);
                format!(
                    "{domain:04x}:{bus_number:02x}:{:02x}.{:x}",
                    bus.pci_device, bus.pci_function
                )
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_have_names_and_the_rest_is_a_number() {
        let known = [(1, "graphics"), (2, "compute"), (4, "transfer")];
        assert_eq!(names(0, &known), Vec::<String>::new());
        assert_eq!(names(6, &known), ["compute", "transfer"]);
        assert_eq!(names(0x26, &known), ["compute", "transfer", "0x20"]);
    }

    #[test]
    fn versions_have_three_parts() {
        assert_eq!(version(vk::make_api_version(0, 1, 3, 239)), "1.3.239");
    }
}
