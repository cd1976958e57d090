//! Vulkan objects of an application's own.

use ash::vk;

use crate::clip::Clip;
use crate::device::EngineOptions;
use crate::engine::{Backend, Engine, Error};
use crate::gpu::device::LogicalDevice;
use crate::gpu::engine::{Job, VulkanEngine};
use crate::gpu::error::VulkanError;
use crate::gpu::in_flight::External;
use crate::gpu::instance::Instance;
use crate::gpu::physical::PhysicalDevice;
use crate::gpu::recovery::Opened;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::shader::spirv::FloatControls;
use crate::time::frames::Frames;

/// An application's instance, device and queue, to evaluate on
/// ([`Engine::from_vulkan`](crate::engine::Engine::from_vulkan)).
///
/// The device needs no features, but is faster with one where it is software
/// ([`VulkanHandles::shader_int64`]). Below Vulkan 1.2, enable
/// `VK_KHR_shader_float_controls` where it is offered.
pub struct VulkanHandles {
    /// The loaded functions; they keep the loader library open.
    pub entry: ash::Entry,
    /// The instance, of Vulkan 1.1 or newer.
    pub instance: ash::Instance,
    /// The version that it was made for (`VkApplicationInfo::apiVersion`).
    pub api_version: u32,
    /// The device's physical device.
    pub physical_device: vk::PhysicalDevice,
    /// The device.
    pub device: ash::Device,
    /// Whether `VK_KHR_shader_float_controls` is enabled; of no account from Vulkan 1.2 on.
    pub shader_float_controls: bool,
    /// Whether the feature `shaderInt64` is enabled, which makes software devices faster.
    pub shader_int64: bool,
    /// A queue of the device that can compute.
    pub queue: vk::Queue,
    /// That queue's family.
    pub queue_family: u32,
}

impl Engine {
    /// Evaluates on an application's own Vulkan device.
    ///
    /// # Errors
    /// As [`Engine::with_options`].
    ///
    /// # Safety
    /// The handles must be valid and belong together, must outlive the engine and
    /// all of its clips and results, and nobody else may use the queue while the
    /// engine does.
    pub unsafe fn from_vulkan(
        handles: VulkanHandles,
        options: &EngineOptions,
    ) -> Result<Self, Error> {
        // SAFETY: promised by the caller.
        let engine = unsafe { VulkanEngine::from_handles(handles, options) }?;
        Ok(Self::with_opened(Opened::trusted(engine, options)?))
    }
}

/// A stretch of a buffer on an application's own device.
#[derive(Debug, Clone, Copy)]
pub struct VulkanBuffer {
    /// The buffer.
    pub buffer: vk::Buffer,
    /// Where the stretch starts, bytes: a multiple of a rotation's.
    pub offset: u64,
    /// Its length, bytes: at least those of the result.
    pub size: u64,
}

impl Clip {
    /// Evaluates into a buffer of the application's own, on the device that the engine
    /// was made from ([`Engine::from_vulkan`]): the rotations stay there, for a
    /// renderer or another kernel. Returns when they are written; what is submitted
    /// to the queue afterwards sees them.
    ///
    /// # Errors
    /// When the engine is the CPU, the frames do not fit the clip, the stretch is not
    /// aligned or too short, or the device fails.
    ///
    /// # Safety
    /// The buffer must belong to the engine's device, have memory, be made for use as
    /// `STORAGE_BUFFER` and `TRANSFER_DST`, have the stretch given, and not be used by
    /// anyone else before this returns.
    pub unsafe fn evaluate_to_buffer(
        &self,
        frames: &Frames,
        layout: Layout,
        encoding: Encoding,
        buffer: VulkanBuffer,
    ) -> Result<(), Error> {
        self.check_encoding(encoding)?;
        let timeline = self.timeline(frames)?;
        let timeline = self.data.folded(&timeline);
        let rotation = encoding.bytes() as u64;
        let needed = (self.track_count() * timeline.len()) as u64 * rotation;
        let Backend::Vulkan(opened) = &*self.engine.backend else {
            return Err(VulkanError::NoDevice.into());
        };
        if !buffer.offset.is_multiple_of(rotation) || buffer.size < needed {
            return Err(Error::Vulkan(VulkanError::OwnBuffer {
                offset: buffer.offset,
                size: buffer.size,
                rotation,
                needed,
            }));
        }
        let external = External {
            raw: buffer.buffer,
            offset: buffer.offset,
        };
        let done = opened.attempt_smaller(|engine| {
            let buffers = self.buffers_on(engine)?;
            let job = Job {
                clip: &self.data,
                buffers: &buffers,
                timeline: &timeline,
                encoding,
            };
            engine.evaluate_to(job, layout, external)
        });
        Ok(done?)
    }
}

impl VulkanEngine {
    /// # Safety
    /// The handles must be valid and belong together, must outlive the engine and
    /// all of its clips and results, and nobody else may use the queue while the
    /// engine does.
    unsafe fn from_handles(
        handles: VulkanHandles,
        options: &EngineOptions,
    ) -> Result<Self, VulkanError> {
        let instance = Instance::borrowed(handles.entry, handles.instance);
        let mut physical = PhysicalDevice::new(&instance, handles.physical_device)?
            .ok_or(VulkanError::NoDevice)?;
        physical.queue_family = handles.queue_family;
        if handles.api_version < vk::API_VERSION_1_2 && !handles.shader_float_controls {
            // What the device could do was not asked for.
            physical.float_controls = FloatControls::default();
        }
        physical.has_int64 &= handles.shader_int64;
        let device =
            LogicalDevice::borrowed(physical, handles.device, handles.queue, options.reads);
        Self::with_device(device, options)
    }
}
