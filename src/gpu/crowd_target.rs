//! Where a crowd's results go on a device: a buffer, with the descriptor sets that lead there.

use std::sync::Arc;

use ash::vk;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::crowd::{CrowdPipelines, CrowdSets, CrowdSteps, DeviceCrowd};
use crate::gpu::error::{Named, VulkanError};
use crate::gpu::pipeline::Pipeline;
use crate::gpu::submission::Binding;
use crate::shader::CrowdPlace;

/// The most sets that a window needs, and the most buffers of each.
const SETS: u32 = 5;
const BINDINGS: u32 = 5;

/// A buffer that results are written to, and all that an evaluation into it needs: nothing is made
/// while it is recorded.
pub(crate) struct CrowdTarget {
    /// What it was made for; its buffers are in the sets.
    crowd: Arc<DeviceCrowd>,
    pub(crate) steps: CrowdSteps,
    pub(crate) pipelines: CrowdPipelines,
    /// Instances of a window.
    pub(crate) window: u32,
    pub(crate) windows: Vec<CrowdSets>,
    pool: vk::DescriptorPool,
    /// Where each layer of a window's instances stands.
    places: Buffer,
    /// Values of a window before they are rounded to 16 bits.
    whole: Option<Buffer>,
}

impl CrowdTarget {
    /// Bytes of a result.
    pub(crate) fn bytes(crowd: &DeviceCrowd, steps: CrowdSteps) -> u64 {
        let vectors = u64::from(crowd.shape.joints) * u64::from(steps.vectors());
        u64::from(crowd.shape.instances) * vectors * steps.vector_bytes()
    }

    /// For a range of a buffer from `offset` on, which is as long as the result.
    pub(crate) fn new(
        crowd: &Arc<DeviceCrowd>,
        steps: CrowdSteps,
        buffer: vk::Buffer,
        offset: u64,
    ) -> Result<Self, VulkanError> {
        let (engine, shape) = (&crowd.engine, &crowd.shape);
        let window = crowd.window();
        let count = shape.instances.div_ceil(window);
        let device = &engine.device;
        let new = |name, each: u64| {
            Buffer::new(device, name, u64::from(window) * each, Residence::Device)
        };
        let vectors = u64::from(shape.joints) * u64::from(steps.vectors());
        let place = size_of::<CrowdPlace>() as u64;
        let places = new(
            "tumble crowd places",
            place * u64::from(shape.layers) * u64::from(shape.bases),
        )?;
        let whole = match steps.half {
            true => Some(new("tumble crowd values", vectors * 16)?),
            false => None,
        };
        let mut target = Self {
            crowd: Arc::clone(crowd),
            steps,
            pipelines: CrowdPipelines::new(crowd, steps)?,
            window,
            windows: Vec::new(),
            pool: vk::DescriptorPool::null(),
            places,
            whole,
        };
        let sizes = [
            vk::DescriptorType::STORAGE_BUFFER,
            vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
        ]
        .map(|kind| {
            vk::DescriptorPoolSize::default()
                .ty(kind)
                .descriptor_count(count * SETS * BINDINGS)
        });
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(count * SETS)
            .pool_sizes(&sizes);
        // SAFETY: the device is alive; the pool is destroyed in `drop`.
        target.pool = unsafe { device.raw.create_descriptor_pool(&info, None) }
            .named("vkCreateDescriptorPool")?;
        for place in 0..count {
            let first = u64::from(place * window);
            let own = u64::from(window).min(u64::from(shape.instances) - first);
            let each = vectors * steps.vector_bytes();
            let output = Binding::range(buffer, offset + first * each, own * each);
            let sets = target.sets(output)?;
            target.windows.push(sets);
        }
        Ok(target)
    }

    /// The crowd that it belongs to.
    pub(crate) fn is_of(&self, crowd: &Arc<DeviceCrowd>) -> bool {
        Arc::ptr_eq(&self.crowd, crowd)
    }

    /// The sets of a window whose result goes into a range.
    fn sets(&self, output: Binding) -> Result<CrowdSets, VulkanError> {
        let crowd = &self.crowd;
        let whole = Binding::whole;
        let places = whole(&self.places);
        let values = self.whole.as_ref().map_or(output, whole);
        let own = &self.pipelines;
        let if_there = |pipeline: &Option<Arc<Pipeline>>, bindings: &[Binding]| match pipeline {
            Some(pipeline) => self.set(pipeline, bindings),
            None => Ok(vk::DescriptorSet::null()),
        };
        let (entries, cells) = (whole(&crowd.entries), whole(&crowd.cells));
        let [clips, bases, spans] = [&crowd.clips, &crowd.bases, &crowd.spans].map(whole);
        Ok(CrowdSets {
            times: self.set(&own.times, &[entries, clips, bases, spans, places])?,
            joints: self.set(
                &own.joints,
                &[entries, whole(&crowd.channels), cells, places, values],
            )?,
            walk: if_there(&own.walk, &[whole(&crowd.links), values])?,
            skin: if_there(&own.skin, &[whole(&crowd.bind), values])?,
            half: if_there(&own.half, &[values, output])?,
        })
    }

    fn set(
        &self,
        pipeline: &Pipeline,
        bindings: &[Binding],
    ) -> Result<vk::DescriptorSet, VulkanError> {
        debug_assert_eq!(bindings.len(), pipeline.bindings as usize);
        let raw = &self.crowd.engine.device.raw;
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.pool)
            .set_layouts(&layouts);
        // SAFETY: the pool was made with room for this set.
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

impl Drop for CrowdTarget {
    fn drop(&mut self) {
        let device = &self.crowd.engine.device;
        if device.may_destroy() {
            // SAFETY: created from this device; whoever records promises that no work that uses the
            // target is in flight when it is dropped. Null is allowed.
            unsafe { device.raw.destroy_descriptor_pool(self.pool, None) };
        }
    }
}
