//! Tumble on the Vulkan device of [wgpu](https://wgpu.rs): its device, its buffers and its command buffers in the types
//! that Tumble takes. The guide "In a renderer that uses wgpu" (docs/wgpu.md) explains each step, and
//! `examples/crowd.rs` is a complete program.
//!
//! ```no_run
//! use tumble::crowd::{Crowd, CrowdError, CrowdLibrary, CrowdValues};
//! use tumble::{Engine, EngineOptions};
//!
//! /// # Safety
//! /// Nothing else submits to wgpu's queue meanwhile, and the crowd is dropped before the device.
//! unsafe fn frame(
//!     device: &wgpu::Device,
//!     queue: &wgpu::Queue,
//!     library: &CrowdLibrary,
//! ) -> Result<(), Box<dyn std::error::Error>> {
//!     let engine = unsafe { Engine::from_vulkan(tumble_wgpu::handles(device)?, &EngineOptions::default())? };
//!     let mut crowd = engine.crowd(library, 1000, 1)?;
//!     let bytes = crowd.output_bytes(CrowdValues::Model);
//!     let matrices = tumble_wgpu::buffer(device, queue, bytes, wgpu::BufferUsages::STORAGE);
//!     let target = unsafe { crowd.target(CrowdValues::Model, tumble_wgpu::range(&matrices)?)? };
//!
//!     crowd.advance(1.0 / 60.0)?;
//!     let posed = tumble_wgpu::record(device, |commands| unsafe { crowd.record(&target, commands) })?;
//!     // … the renderer's encoder, whose commands read `matrices` …
//!     queue.submit([posed]);
//!     Ok(())
//! }
//! ```

use tumble::ash::{khr, vk};
use tumble::vulkan::{VulkanBuffer, VulkanHandles, VulkanQueue};
use wgpu::hal::api::Vulkan;

/// An object of wgpu is not one of its Vulkan backend.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "wgpu's {object} is not one of its Vulkan backend; create the instance with `wgpu::Backends::VULKAN`"
)]
pub struct NotVulkan {
    /// What the object is: "device", "buffer" or "command encoder".
    pub object: &'static str,
}

/// Why commands were not recorded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RecordError<E> {
    /// The device is not a Vulkan device.
    #[error(transparent)]
    NotVulkan(#[from] NotVulkan),
    /// The error of the caller's function.
    #[error(transparent)]
    Refused(E),
}

/// The Vulkan objects of a wgpu device, for `Engine::from_vulkan`, which says what the caller promises. Optional features
/// that the device has are marked. If other threads submit to wgpu's queue, set a `QueueLock`
/// (`VulkanHandles::queue_lock`), because wgpu does not share its own.
///
/// # Errors
/// When the device belongs to another backend of wgpu.
pub fn handles(device: &wgpu::Device) -> Result<VulkanHandles, NotVulkan> {
    // SAFETY: the object is not destroyed here.
    let raw = unsafe { device.as_hal::<Vulkan>() }.ok_or(NotVulkan { object: "device" })?;
    let instance = raw.shared_instance();
    let mut handles = VulkanHandles::new(
        instance.entry().clone(),
        instance.raw_instance().clone(),
        instance.instance_api_version(),
        raw.raw_physical_device(),
        raw.raw_device().clone(),
        VulkanQueue::new(raw.raw_queue(), raw.queue_family_index()),
    );
    handles.shader_int64 = device.features().contains(wgpu::Features::SHADER_INT64);
    let extensions = raw.enabled_device_extensions();
    handles.shader_float_controls = extensions.contains(&khr::shader_float_controls::NAME);
    Ok(handles)
}

/// Creates a buffer of zeros for results, with the usages that Tumble needs (`STORAGE` and `COPY_DST`) and `usage`.
///
/// wgpu fills a buffer with zeros before the first use that it knows of, which would be after Tumble has written it.
/// This buffer is filled and submitted here, so wgpu does not fill it later.
#[must_use]
pub fn buffer(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    size: u64,
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("results of Tumble"),
        size,
        usage: usage | wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: true,
    });
    buffer.unmap();
    // wgpu copies the zeros from the mapped memory in the next submission, which is this one.
    queue.submit([]);
    buffer
}

/// The whole of a buffer, for targets of crowds, clips and passes. The buffer must live as long as the target.
///
/// # Errors
/// When the buffer belongs to another backend of wgpu.
pub fn range(buffer: &wgpu::Buffer) -> Result<VulkanBuffer, NotVulkan> {
    // SAFETY: the object is not destroyed here.
    let raw = unsafe { buffer.as_hal::<Vulkan>() }.ok_or(NotVulkan { object: "buffer" })?;
    // SAFETY: as above.
    let handle = unsafe { raw.raw_handle() };
    Ok(VulkanBuffer::new(handle, buffer.size()))
}

/// Gives a command buffer in the recording state to `record`, which records Tumble's commands into it. Submit the result
/// once, before the commands that read Tumble's results.
///
/// These commands need an encoder without commands of wgpu: wgpu does not see them, and moves its own barriers to before
/// the commands of an encoder.
///
/// # Errors
/// When the device belongs to another backend of wgpu, or `record` fails.
pub fn record<E>(
    device: &wgpu::Device,
    record: impl FnOnce(vk::CommandBuffer) -> Result<(), E>,
) -> Result<wgpu::CommandBuffer, RecordError<E>> {
    let descriptor = wgpu::CommandEncoderDescriptor {
        label: Some("Tumble"),
    };
    let mut encoder = device.create_command_encoder(&descriptor);
    let recorded = |raw: Option<&mut wgpu::hal::vulkan::CommandEncoder>| {
        let object = "command encoder";
        let raw = raw.ok_or(NotVulkan { object })?;
        // SAFETY: the caller only records.
        record(unsafe { raw.raw_handle() }).map_err(RecordError::Refused)
    };
    // SAFETY: the encoder is not ended here.
    unsafe { encoder.as_hal_mut::<Vulkan, _, _>(recorded)? };
    Ok(encoder.finish())
}
