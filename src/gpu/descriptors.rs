//! Descriptor sets: the buffers that dispatches see.

use std::sync::Arc;

use ash::vk;

use crate::gpu::device::LogicalDevice;
use crate::gpu::error::{Named, VulkanError};
use crate::gpu::pipeline::Pipeline;
use crate::gpu::submission::Binding;

/// The most buffers that a kernel binds.
const MOST_BINDINGS: u32 = 6;

/// A pool of descriptor sets. Whoever has one drops it when no submitted work uses its sets any more.
pub(crate) struct DescriptorPool {
    device: Arc<LogicalDevice>,
    /// Null while there is no room.
    raw: vk::DescriptorPool,
    /// Sets that it can hold.
    room: u32,
}

impl DescriptorPool {
    /// A pool without room.
    pub(crate) fn new(device: &Arc<LogicalDevice>) -> Self {
        Self {
            device: Arc::clone(device),
            raw: vk::DescriptorPool::null(),
            room: 0,
        }
    }

    /// Takes back all sets, which no submitted work may use any more, and has room for so many.
    pub(crate) fn make_room(&mut self, sets: u32) -> Result<(), VulkanError> {
        let raw = &self.device.raw;
        if sets <= self.room {
            if self.room > 0 {
                let flags = vk::DescriptorPoolResetFlags::empty();
                // SAFETY: no set is in use.
                unsafe { raw.reset_descriptor_pool(self.raw, flags) }
                    .named("vkResetDescriptorPool")?;
            }
            return Ok(());
        }
        let sizes = [
            vk::DescriptorType::STORAGE_BUFFER,
            vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
        ]
        .map(|kind| {
            vk::DescriptorPoolSize::default()
                .ty(kind)
                .descriptor_count(sets * MOST_BINDINGS)
        });
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(sets)
            .pool_sizes(&sizes);
        // SAFETY: no set of the old pool is in use; null is allowed.
        unsafe { raw.destroy_descriptor_pool(self.raw, None) };
        (self.raw, self.room) = (vk::DescriptorPool::null(), 0);
        // SAFETY: the device is alive; the pool is destroyed above or in `drop`.
        self.raw =
            unsafe { raw.create_descriptor_pool(&info, None) }.named("vkCreateDescriptorPool")?;
        self.room = sets;
        Ok(())
    }

    /// A set with one buffer for each binding of a pipeline.
    pub(crate) fn set(
        &mut self,
        pipeline: &Pipeline,
        bindings: &[Binding],
    ) -> Result<vk::DescriptorSet, VulkanError> {
        debug_assert_eq!(bindings.len(), pipeline.bindings as usize);
        let raw = &self.device.raw;
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.raw)
            .set_layouts(&layouts);
        // SAFETY: `make_room` made room for this set.
        let set =
            unsafe { raw.allocate_descriptor_sets(&info) }.named("vkAllocateDescriptorSets")?[0];
        for (place, binding) in (0..).zip(bindings) {
            let info = [vk::DescriptorBufferInfo::default()
                .buffer(binding.buffer)
                .offset(binding.offset)
                .range(binding.size)];
            let views = [binding.view];
            let kind = pipeline.kind(place);
            let write = vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(place)
                .descriptor_type(kind);
            let write = match kind {
                vk::DescriptorType::STORAGE_BUFFER => write.buffer_info(&info),
                _ => write.texel_buffer_view(&views),
            };
            // SAFETY: nothing uses the set yet, and the buffers are alive.
            unsafe { raw.update_descriptor_sets(&[write], &[]) };
        }
        Ok(set)
    }
}

impl Drop for DescriptorPool {
    fn drop(&mut self) {
        if self.device.may_destroy() {
            // SAFETY: created from this device, and no submitted work uses its sets any more (see the
            // type); null is allowed.
            unsafe { self.device.raw.destroy_descriptor_pool(self.raw, None) };
        }
    }
}
