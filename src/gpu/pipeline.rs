//! Compute pipelines: a kernel with its descriptor and pipeline layouts; and the driver's compiled kernels, kept in a
//! file from process to process.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use ash::vk;

use crate::gpu::device::LogicalDevice;
use crate::gpu::physical::PhysicalDevice;
use crate::machine::cache::{Cache, sum};
use crate::machine::error::VulkanError;
use crate::machine::error::calls::Named;
use crate::machine::options::CacheFiles;
use crate::shader::{
    Access, CrowdWholeDispatch, Dispatch, Grid, Kernel, PoseDispatch, RowShape, spirv,
};
use crate::threads::lock;

/// The maximum size of push constants, bytes; Vulkan guarantees at least 128.
const PUSHED: u32 = {
    let size = size_of::<CrowdWholeDispatch>();
    assert!(size_of::<Dispatch>() <= size && size_of::<Grid>() <= size);
    assert!(size_of::<RowShape>() <= size && size_of::<PoseDispatch>() <= size);
    assert!(size <= 128);
    size as u32
};

/// A compute pipeline with its layouts.
pub(crate) struct Pipeline {
    pub(crate) device: Arc<LogicalDevice>,
    pub(crate) raw: vk::Pipeline,
    pub(crate) layout: vk::PipelineLayout,
    pub(crate) set_layout: vk::DescriptorSetLayout,
    pub(crate) kernel: Kernel,
    /// Whether its input buffers are texel buffers, not storage buffers.
    reads_texels: bool,
    /// The kernel's name, as in [`kernels`](crate::shader::kernels).
    pub(crate) name: &'static str,
    /// A hash of the code that was passed to the driver.
    pub(crate) code_hash: u64,
    pub(crate) has_run: AtomicBool,
}

/// The code of a kernel as it is passed to the driver.
fn words(device: &LogicalDevice, code: &[u32], exactness: Exactness) -> Vec<u32> {
    let words = match exactness {
        Exactness::Demanded => spirv::float_controls(code, device.physical.float_controls),
        Exactness::LeftToTheDriver => spirv::without_decorations(code),
    };
    words.expect("the kernels passed when they were compiled")
}

impl Pipeline {
    /// The number of storage buffers that a kernel binds on a device: all its buffers, or only the one that it
    /// writes.
    pub(crate) fn storage_buffers(device: &LogicalDevice, kernel: Kernel) -> u32 {
        let (.., reads_texels) = kernel.code(device.reads_texels);
        match reads_texels {
            true => 1,
            false => kernel.compiled().bindings.len() as u32,
        }
    }

    /// The hash of a kernel's code on this device.
    pub(crate) fn code_hash(device: &LogicalDevice, kernel: Kernel) -> u64 {
        let (_, code, _) = kernel.code(device.reads_texels);
        spirv::hash(&words(device, code, Exactness::Demanded))
    }

    pub(crate) fn new(
        device: &Arc<LogicalDevice>,
        kernel: Kernel,
        exactness: Exactness,
    ) -> Result<Self, VulkanError> {
        let (name, code, reads_texels) = kernel.code(device.reads_texels);
        let mut pipeline = Self {
            device: Arc::clone(device),
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            kernel,
            reads_texels,
            name,
            code_hash: 0,
            has_run: AtomicBool::new(false),
        };
        let (needed, limit) = (
            Self::storage_buffers(device, kernel),
            device.physical.storage_buffers,
        );
        if needed > limit {
            let kernel = name;
            return Err(VulkanError::StorageBuffers {
                kernel,
                needed,
                limit,
            });
        }
        let list: Vec<_> = (0..kernel.compiled().bindings.len() as u32)
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(pipeline.kind(binding))
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&list);
        // SAFETY: the device is alive, here and below; what is created is destroyed
        // in `drop`, also when a later step fails.
        pipeline.set_layout = unsafe { device.raw.create_descriptor_set_layout(&info, None) }
            .named("vkCreateDescriptorSetLayout")?;
        let set_layouts = [pipeline.set_layout];
        let constants = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
            .size(PUSHED)];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&set_layouts)
            .push_constant_ranges(&constants);
        // SAFETY: as above.
        pipeline.layout = unsafe { device.raw.create_pipeline_layout(&info, None) }
            .named("vkCreatePipelineLayout")?;

        let words = words(device, code, exactness);
        pipeline.code_hash = spirv::hash(&words);
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the words are valid SPIR-V: naga made and validated them, and the passes keep them valid.
        let module = unsafe { device.raw.create_shader_module(&info, None) }
            .named("vkCreateShaderModule")?;
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main");
        let info = [vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(pipeline.layout)];
        let cache = device.pipelines.raw;
        // SAFETY: the module has an entry point `main` that fits the layout.
        let created = unsafe { device.raw.create_compute_pipelines(cache, &info, None) };
        // SAFETY: a module is not needed once its pipeline exists.
        unsafe { device.raw.destroy_shader_module(module, None) };
        pipeline.raw = created
            .map_err(|(_, result)| result)
            .named("vkCreateComputePipelines")?[0];
        device.pipelines.note();
        device.name(pipeline.raw, name);
        Ok(pipeline)
    }

    pub(crate) fn kind(&self, binding: u32) -> vk::DescriptorType {
        let access = self.kernel.compiled().bindings[binding as usize];
        match self.reads_texels && access == Access::Read {
            true => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
            false => vk::DescriptorType::STORAGE_BUFFER,
        }
    }
}

/// Whether a driver must not change the shader's operations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exactness {
    /// With decorations and float controls, as in all evaluations.
    Demanded,
    /// Without them, as in the negative control, which shows that they have an effect.
    LeftToTheDriver,
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        if self.device.may_destroy() {
            // SAFETY: created from this device, no longer in use; null is allowed.
            unsafe {
                self.device.raw.destroy_pipeline(self.raw, None);
                self.device.raw.destroy_pipeline_layout(self.layout, None);
                self.device
                    .raw
                    .destroy_descriptor_set_layout(self.set_layout, None);
            }
        }
    }
}

/// The maximum size of a cache, bytes: all kernels of a card take a few MB.
const MAX_BYTES: usize = 64 << 20;

/// A pipeline cache of Vulkan; null if it could not be made, which only costs time.
pub(crate) struct PipelineCache {
    pub(crate) raw: vk::PipelineCache,
    /// Whether it is an application's, which keeps it as it likes.
    is_of_application: bool,
    files: Cache,
    name: String,
    /// The expected header of the driver.
    driver: (u32, u32, [u8; 16]),
    /// The checksum of the data that was last read or written.
    known: Mutex<u64>,
    /// Whether a pipeline was made since then.
    has_grown: AtomicBool,
}

impl PipelineCache {
    /// Makes a cache with the stored data of the device's driver, if there are any.
    pub(crate) fn new(device: &ash::Device, physical: &PhysicalDevice, files: &CacheFiles) -> Self {
        let mut cache = Self::unread(physical, Cache::new(files));
        let kept = cache.kept();
        cache.known = Mutex::new(sum(&cache.name, &kept));
        cache.raw = Self::with(device, &kept);
        cache
    }

    /// An application's cache, of which nothing is stored.
    pub(crate) fn of_application(raw: vk::PipelineCache, physical: &PhysicalDevice) -> Self {
        Self {
            raw,
            is_of_application: true,
            ..Self::unread(physical, Cache::new(&CacheFiles::Off))
        }
    }

    /// A cache without a Vulkan object.
    fn unread(physical: &PhysicalDevice, files: Cache) -> Self {
        let (vendor, model, uuid) = physical.pipeline_cache;
        let digits: String = uuid.iter().map(|byte| format!("{byte:02x}")).collect();
        let name = format!("pipelines-{vendor:x}-{model:x}-{digits}");
        Self {
            raw: vk::PipelineCache::null(),
            is_of_application: false,
            files,
            name,
            driver: physical.pipeline_cache,
            known: Mutex::new(0),
            has_grown: AtomicBool::new(false),
        }
    }

    /// The stored data of the driver; empty if there are only other drivers' data.
    fn kept(&self) -> Vec<u8> {
        let kept = self.files.read(&self.name, MAX_BYTES);
        kept.filter(|kept| is_for(kept, self.driver))
            .unwrap_or_default()
    }

    /// Makes a pipeline cache of Vulkan with data of the driver; null if that fails.
    fn with(device: &ash::Device, data: &[u8]) -> vk::PipelineCache {
        let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
        // SAFETY: the device is alive, and the data is headed as its driver heads it; whoever calls destroys
        // what is made.
        unsafe { device.create_pipeline_cache(&info, None) }.unwrap_or_default()
    }

    /// Records that a pipeline was made.
    pub(crate) fn note(&self) {
        self.has_grown.store(true, Ordering::Relaxed);
    }

    /// Stores the pipelines that were compiled since then, if any, together with those that other processes have
    /// stored.
    pub(crate) fn keep(&self, device: &ash::Device) {
        let null = vk::PipelineCache::null();
        if self.is_of_application
            || self.raw == null
            || !self.has_grown.swap(false, Ordering::Relaxed)
        {
            return;
        }
        let mut known = lock(&self.known);
        let kept = self.kept();
        let others = match sum(&self.name, &kept) == *known {
            true => null,
            false => Self::with(device, &kept),
        };
        // SAFETY: both caches are this device's, and nobody else uses `others`.
        let data = unsafe {
            if others == null {
                device.get_pipeline_cache_data(self.raw)
            } else {
                let merged = device.merge_pipeline_caches(others, &[self.raw]);
                let data = merged.and_then(|()| device.get_pipeline_cache_data(others));
                device.destroy_pipeline_cache(others, None);
                data
            }
        };
        let Ok(data) = data else { return };
        let current = sum(&self.name, &data);
        if current != *known && data.len() <= MAX_BYTES {
            self.files.write(&self.name, &data);
            *known = current;
        }
    }

    /// # Safety
    /// Nothing may use the cache any more, and the device must be alive.
    pub(crate) unsafe fn destroy(&self, device: &ash::Device) {
        if self.is_of_application {
            return;
        }
        self.keep(device);
        // SAFETY: promised by the caller; null is allowed.
        unsafe { device.destroy_pipeline_cache(self.raw, None) };
    }
}

/// Whether data start with this driver's header: its length, 1, vendor, device and UUID.
fn is_for(data: &[u8], (vendor, model, uuid): (u32, u32, [u8; 16])) -> bool {
    let mut header = Vec::with_capacity(32);
    for number in [32, 1, vendor, model] {
        header.extend(u32::to_le_bytes(number));
    }
    header.extend(uuid);
    data.starts_with(&header)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_another_driver_compiled_is_left_alone() {
        let driver = (0x10de, 0x2335, [7; 16]);
        let mut data: Vec<u8> = [32u32, 1, 0x10de, 0x2335].map(u32::to_le_bytes).concat();
        data.extend([7; 16]);
        assert!(is_for(&data, driver));
        data.extend(b"compiled kernels");
        assert!(is_for(&data, driver));
        for byte in 0..32 {
            let mut other = data.clone();
            other[byte] ^= 1;
            assert!(!is_for(&other, driver), "{byte}");
            assert!(!is_for(&data[..byte], driver), "{byte}");
        }
    }
}
