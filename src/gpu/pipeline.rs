//! The kernels as pipelines: one binding list, one entry point, one layout.

use std::sync::Arc;

use ash::vk;

use super::device::LogicalDevice;
use super::error::{Named, VulkanError};
use crate::encoding::Encoding;
use crate::method::Form;
use crate::segment::Launch;
use crate::spirv;

/// A shader that the build compiled.
pub(super) struct Shader {
    name: &'static str,
    code: &'static [u8],
}

macro_rules! shader {
    ($name:literal) => {
        Shader {
            name: $name,
            code: include_bytes!(concat!(env!("OUT_DIR"), "/", $name, ".spv")),
        }
    };
}

pub(super) static CANARY: Shader = shader!("canary");

/// What a sample's distance is counted in: frames, or explicit times in seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Clock {
    Frames,
    Times,
}

/// The kernel of a form, a clock and an encoding.
pub(super) fn kernel(form: Form, clock: Clock, encoding: Encoding) -> &'static Shader {
    macro_rules! kernels {
        ($($name:literal),+) => {{
            static SHADERS: [Shader; 12] = [$(shader!($name)),+];
            &SHADERS
        }};
    }
    let shaders = kernels!(
        "arc_frames_f32",
        "arc_frames_f16",
        "arc_frames_snorm16",
        "arc_times_f32",
        "arc_times_f16",
        "arc_times_snorm16",
        "polynomial_frames_f32",
        "polynomial_frames_f16",
        "polynomial_frames_snorm16",
        "polynomial_times_f32",
        "polynomial_times_f16",
        "polynomial_times_snorm16"
    );
    &shaders[kernel_index(form, clock, encoding)]
}

/// Kernels that there are.
pub(super) const KERNELS: usize = 12;

/// The place of a kernel among all.
pub(super) fn kernel_index(form: Form, clock: Clock, encoding: Encoding) -> usize {
    let form = match form {
        Form::Arc => 0,
        Form::Polynomial => 1,
    };
    let clock = match clock {
        Clock::Frames => 0,
        Clock::Times => 1,
    };
    let encoding = match encoding {
        Encoding::F32 => 0,
        Encoding::F16 => 1,
        Encoding::Snorm16 => 2,
    };
    (form * 2 + clock) * 3 + encoding
}

/// Number of storage buffers that `kernel.wgsl` binds.
pub(super) const KERNEL_BINDINGS: u32 = 5;
/// Number of storage buffers that `canary.wgsl` binds.
pub(super) const CANARY_BINDINGS: u32 = 2;

/// A compute pipeline with its layouts.
pub(super) struct Pipeline {
    device: Arc<LogicalDevice>,
    pub(super) raw: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    pub(super) set_layout: vk::DescriptorSetLayout,
    pub(super) bindings: u32,
}

impl Pipeline {
    /// A pipeline whose set 0 binds `bindings` storage buffers.
    pub(super) fn new(
        device: &Arc<LogicalDevice>,
        shader: &Shader,
        bindings: u32,
        exactness: Exactness,
    ) -> Result<Self, VulkanError> {
        let mut pipeline = Self {
            device: Arc::clone(device),
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            bindings,
        };
        let list: Vec<_> = (0..bindings)
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
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
            .size(size_of::<Launch>() as u32)];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&set_layouts)
            .push_constant_ranges(&constants);
        // SAFETY: as above.
        pipeline.layout = unsafe { device.raw.create_pipeline_layout(&info, None) }
            .named("vkCreatePipelineLayout")?;

        let words = words(shader, device, exactness);
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the words are valid SPIR-V: the build made them.
        let module = unsafe { device.raw.create_shader_module(&info, None) }
            .named("vkCreateShaderModule")?;
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main");
        let info = [vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(pipeline.layout)];
        let cache = vk::PipelineCache::null();
        // SAFETY: the module has an entry point `main` that fits the layout.
        let created = unsafe { device.raw.create_compute_pipelines(cache, &info, None) };
        // SAFETY: a module is not needed once its pipeline exists.
        unsafe { device.raw.destroy_shader_module(module, None) };
        pipeline.raw = created
            .map_err(|(_, result)| result)
            .named("vkCreateComputePipelines")?[0];
        device.name(pipeline.raw, shader.name);
        Ok(pipeline)
    }
}

/// Whether a driver is told to compute as written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Exactness {
    /// Decorations and float controls: what every evaluation uses.
    Demanded,
    /// Neither: what the negative control uses, to prove that they matter.
    #[cfg_attr(not(test), expect(dead_code))]
    LeftToTheDriver,
}

fn words(shader: &Shader, device: &LogicalDevice, exactness: Exactness) -> Vec<u32> {
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(shader.code);
    let passed = match exactness {
        Exactness::Demanded => spirv::float_controls(&words, device.physical.float_controls),
        Exactness::LeftToTheDriver => spirv::without_decorations(&words),
    };
    passed.expect("the build validated its shaders")
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
