//! The kernels as pipelines: one binding list, one entry point, one layout.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use ash::vk;

use super::device::LogicalDevice;
use super::error::{Named, VulkanError};
use crate::encoding::Encoding;
use crate::method::Form;
use crate::segment::Launch;
use crate::spirv;

/// A shader that the build compiled: its name and its words.
pub(super) type Shader = (&'static str, &'static [u8]);

/// All of them: the canary, then the kernels by form, listing and encoding, those that read
/// storage buffers before those that read texels, then those of poses, then those from keys,
/// likewise.
static SHADERS: &[Shader] = include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

/// Every kernel that a Vulkan device may be given: its name and its SPIR-V, words with the
/// least significant byte first, before the float controls that depend on the device.
pub fn kernels() -> impl Iterator<Item = (&'static str, &'static [u8])> {
    SHADERS.iter().copied()
}

pub(super) fn canary() -> Shader {
    SHADERS[0]
}

/// How a window's work is listed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Listing {
    /// Runs of samples, whose distances are frames.
    Frames,
    /// Runs of samples at explicit times, whose distances are seconds.
    Times,
    /// Samples one by one, with their parameters.
    Singles,
}

/// What a kernel binds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bindings {
    pub(super) count: u32,
    /// A bit for each that is a texel buffer; the others are storage buffers.
    pub(super) texels: u32,
}

impl Bindings {
    /// So many storage buffers.
    pub(super) const fn storage(count: u32) -> Self {
        Self { count, texels: 0 }
    }

    /// Of a kernel that reads `read` as texels, or not.
    fn read(as_texels: bool, count: u32, read: u32) -> Self {
        let texels = if as_texels { read } else { 0 };
        Self { count, texels }
    }

    pub(super) fn kind(self, binding: u32) -> vk::DescriptorType {
        if self.texels >> binding & 1 == 1 {
            vk::DescriptorType::UNIFORM_TEXEL_BUFFER
        } else {
            vk::DescriptorType::STORAGE_BUFFER
        }
    }
}

/// Kernels that there are, from storage buffers or from texels.
pub(super) const KERNELS: usize = 48;
const _: () = assert!(SHADERS.len() == 1 + 2 * KERNELS + POSES + 2 * SAMPLED);

/// Kernels over poses that are already there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PoseKernel {
    Blend,
    Mix,
    Add,
    World,
}

/// How many of them there are.
pub(super) const POSES: usize = 4;

pub(super) fn pose_shader(kernel: PoseKernel) -> Shader {
    SHADERS[1 + 2 * KERNELS + kernel as usize]
}

/// Kernels from keys to samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SampledKernel {
    Arcs,
    Pairs,
    Cubics,
}

/// How many of them there are, from storage buffers or from texels.
pub(super) const SAMPLED: usize = 3;

impl SampledKernel {
    pub(super) fn shader(self, as_texels: bool) -> Shader {
        let first = 1 + 2 * KERNELS + POSES + SAMPLED * usize::from(as_texels);
        SHADERS[first + self as usize]
    }

    /// Keys, samples, rotations; and joints.
    pub(super) fn bindings(self, as_texels: bool) -> Bindings {
        match self {
            Self::Arcs | Self::Pairs => Bindings::read(as_texels, 3, 0b11),
            Self::Cubics => Bindings::read(as_texels, 4, 0b1011),
        }
    }
}

/// A kernel, and its place among all that read in the same way.
pub(super) fn kernel(
    as_texels: bool,
    form: Form,
    listing: Listing,
    encoding: Encoding,
) -> (Shader, usize) {
    let form = match form {
        Form::Arc => 0,
        Form::Polynomial => 1,
    };
    let encoding = match encoding {
        Encoding::F32 => 0,
        Encoding::F16 => 1,
        Encoding::Snorm16 => 2,
        Encoding::AxisAngle => 3,
        Encoding::Matrix3x3(_) => 4,
        Encoding::Matrix3x4(_) => 5,
        Encoding::Euler(_) => 6,
        Encoding::Vector => 7,
    };
    let place = (form * 3 + listing as usize) * 8 + encoding;
    (SHADERS[1 + KERNELS * usize::from(as_texels) + place], place)
}

/// What `kernel.wgsl` binds: segments, constants, items, distances, and its output.
/// `kernel_singles.wgsl` has no distances.
pub(super) fn kernel_bindings(as_texels: bool) -> Bindings {
    Bindings::read(as_texels, MOST_BINDINGS, 0b1111)
}

/// No kernel binds more.
pub(super) const MOST_BINDINGS: u32 = 5;
/// What a `pose_*.wgsl` binds: three inputs and the output.
pub(super) const POSE_BINDINGS: Bindings = Bindings::storage(4);
/// What `canary.wgsl` binds.
pub(super) const CANARY_BINDINGS: Bindings = Bindings::storage(2);

/// A compute pipeline with its layouts.
pub(super) struct Pipeline {
    device: Arc<LogicalDevice>,
    pub(super) raw: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    pub(super) set_layout: vk::DescriptorSetLayout,
    pub(super) bindings: Bindings,
    pub(super) has_run: AtomicBool,
}

impl Pipeline {
    /// A pipeline whose set 0 is that.
    pub(super) fn new(
        device: &Arc<LogicalDevice>,
        shader: Shader,
        bindings: Bindings,
        exactness: Exactness,
    ) -> Result<Self, VulkanError> {
        let mut pipeline = Self {
            device: Arc::clone(device),
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            bindings,
            has_run: AtomicBool::new(false),
        };
        let list: Vec<_> = (0..bindings.count)
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(bindings.kind(binding))
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
        device.name(pipeline.raw, shader.0);
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

fn words(shader: Shader, device: &LogicalDevice, exactness: Exactness) -> Vec<u32> {
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(shader.1);
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
