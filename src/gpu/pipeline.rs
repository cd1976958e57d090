//! Compute pipelines: a kernel with its descriptor and pipeline layouts.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use ash::vk;
use tumble_exact::{float_controls, without_decorations};

use crate::gpu::device::LogicalDevice;
use crate::machine::error::VulkanError;
use crate::machine::error::calls::Named;
use crate::shader::{Access, Kernel};
use crate::work::recording::MAX_PUSHED;

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

/// A hash of words (64-bit FNV-1a, a word at a time), the same in every process.
fn hash(words: &[u32]) -> u64 {
    words.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &word| {
        (hash ^ u64::from(word)).wrapping_mul(0x100_0000_01b3)
    })
}

/// The code of a kernel as it is passed to the driver.
fn words(device: &LogicalDevice, code: &[u32], exactness: Exactness) -> Vec<u32> {
    let words = match exactness {
        Exactness::Demanded => float_controls(code, device.physical.float_controls),
        Exactness::LeftToTheDriver => without_decorations(code),
    };
    words.expect("the kernels passed when they were compiled")
}

impl Pipeline {
    /// The number of storage buffers that a kernel binds on a device: all its buffers, or only the one that it
    /// writes.
    pub(crate) fn storage_buffers(device: &LogicalDevice, kernel: Kernel) -> u32 {
        let (.., reads_texels) = kernel.code(device.variants());
        match reads_texels {
            true => 1,
            false => kernel.compiled().bindings.len() as u32,
        }
    }

    /// Whether a kernel runs on a device: it binds no more storage buffers than the device allows, and subgroups can do
    /// all that it needs.
    pub(crate) fn can_run(device: &LogicalDevice, kernel: Kernel) -> bool {
        let physical = &device.physical;
        Self::storage_buffers(device, kernel) <= physical.storage_buffers
            && (!kernel.compiled().subgroups || physical.subgroup_lanes.is_some())
    }

    /// The hash of a kernel's code on this device.
    pub(crate) fn code_hash(device: &LogicalDevice, kernel: Kernel) -> u64 {
        let (_, code, _) = kernel.code(device.variants());
        hash(&words(device, code, Exactness::Demanded))
    }

    pub(crate) fn new(
        device: &Arc<LogicalDevice>,
        kernel: Kernel,
        exactness: Exactness,
    ) -> Result<Self, VulkanError> {
        let (name, code, reads_texels) = kernel.code(device.variants());
        let words = words(device, code, exactness);
        #[cfg(test)]
        let words = faults::planted(kernel, words);
        Self::of_words(device, kernel, (name, &words), reads_texels)
    }

    /// The pipeline of a kernel's code, which differs from the engine's in ways that no bit depends on.
    #[cfg(feature = "lab")]
    pub(crate) fn of_code(
        device: &Arc<LogicalDevice>,
        kernel: Kernel,
        (name, code): (&'static str, &[u32]),
    ) -> Result<Self, VulkanError> {
        let words = words(device, code, Exactness::Demanded);
        Self::of_words(device, kernel, (name, &words), false)
    }

    fn of_words(
        device: &Arc<LogicalDevice>,
        kernel: Kernel,
        (name, words): (&'static str, &[u32]),
        reads_texels: bool,
    ) -> Result<Self, VulkanError> {
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
        // SAFETY: the device is alive, here and below; created objects are destroyed
        // in `drop`, also when a later step fails.
        pipeline.set_layout = unsafe { device.raw.create_descriptor_set_layout(&info, None) }
            .named("vkCreateDescriptorSetLayout")?;
        let set_layouts = [pipeline.set_layout];
        let constants = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
            .size(MAX_PUSHED as u32)];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&set_layouts)
            .push_constant_ranges(&constants);
        // SAFETY: the device is alive; the created object is destroyed with the pipeline.
        pipeline.layout = unsafe { device.raw.create_pipeline_layout(&info, None) }
            .named("vkCreatePipelineLayout")?;

        pipeline.code_hash = hash(words);
        let info = vk::ShaderModuleCreateInfo::default().code(words);
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

/// Drivers that compile a kernel to something else.
#[cfg(test)]
pub(crate) mod faults {
    use std::cell::Cell;

    use crate::shader::Kernel;

    thread_local! {
        /// For tests: a kernel whose pipelines, if this thread creates them, contain an addition instead of a
        /// multiplication.
        pub(crate) static MISCOMPILED: Cell<Option<Kernel>> = const { Cell::new(None) };
    }

    pub(super) fn planted(kernel: Kernel, mut words: Vec<u32>) -> Vec<u32> {
        const ADD: u32 = 129;
        const MULTIPLY: u32 = 133;
        if MISCOMPILED.get() == Some(kernel) {
            let mut at = 5;
            while let Some(word) = words.get_mut(at) {
                at += (*word >> 16).max(1) as usize;
                if *word & 0xffff == MULTIPLY {
                    *word = *word - MULTIPLY + ADD;
                }
            }
        }
        words
    }
}
