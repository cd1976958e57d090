//! A crowd on a Vulkan device: its tables stay there, and each evaluation records what changed and the
//! dispatches, without waiting and without allocating.

use std::ops::Range;
use std::sync::Arc;

use ash::vk;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::crowd_target::CrowdTarget;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::VulkanError;
use crate::gpu::physical::DeviceKind;
use crate::gpu::pipeline::Pipeline;
use crate::shader::{CROWD_WORKGROUP, CrowdDispatch, CrowdEntry, CrowdPlace, Kernel};

/// The most bytes that one command may write into a buffer.
const UPDATE: usize = 1 << 16;

/// The fewest instances of a window: so many that windows start at multiples of 256 bytes.
const LEAST_WINDOW: u64 = 32;

/// Bytes of a window's matrices on a software device.
const SOFTWARE_WINDOW: u64 = 8 << 20;

/// What a crowd's kernels read, as bytes.
pub(crate) struct CrowdSource<'a> {
    pub(crate) clips: &'a [u8],
    pub(crate) bases: &'a [u8],
    pub(crate) spans: &'a [u8],
    pub(crate) channels: &'a [u8],
    pub(crate) cells: &'a [u8],
    pub(crate) links: &'a [u8],
    /// The rows of inverse bind matrices; empty where there are none.
    pub(crate) bind: &'a [u8],
    pub(crate) shape: CrowdShape,
}

/// The sizes of a crowd.
#[derive(Debug, Clone)]
pub(crate) struct CrowdShape {
    pub(crate) instances: u32,
    pub(crate) layers: u32,
    pub(crate) joints: u32,
    /// The most time bases of a clip.
    pub(crate) bases: u32,
    /// Where each level of the skeleton below the roots starts among the links, and their end.
    pub(crate) levels: Vec<u32>,
    /// The cells of the first mask and of the first reference pose.
    pub(crate) masks: u32,
    pub(crate) references: u32,
    /// Whether all rotations are arcs or constants.
    pub(crate) only_arcs: bool,
}

/// What an evaluation leaves: which of the kernels run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CrowdSteps {
    /// Whether matrices are made, not rotations alone.
    pub(crate) matrices: bool,
    /// Whether the skeleton is walked, and whether inverse bind matrices follow.
    pub(crate) walk: bool,
    pub(crate) skin: bool,
    /// Whether values are rounded to 16 bits at the end.
    pub(crate) half: bool,
}

impl CrowdSteps {
    /// Vectors of four numbers for each joint.
    pub(crate) fn vectors(self) -> u32 {
        if self.matrices { 3 } else { 1 }
    }

    /// Bytes of a vector as it is left.
    pub(crate) fn vector_bytes(self) -> u64 {
        if self.half { 8 } else { 16 }
    }
}

/// A crowd's buffers on a device.
pub(crate) struct DeviceCrowd {
    pub(crate) engine: Arc<VulkanEngine>,
    pub(crate) shape: CrowdShape,
    pub(crate) clips: Buffer,
    pub(crate) bases: Buffer,
    pub(crate) spans: Buffer,
    pub(crate) channels: Buffer,
    pub(crate) cells: Buffer,
    pub(crate) links: Buffer,
    pub(crate) bind: Buffer,
    /// `[instance][layer]`
    pub(crate) entries: Buffer,
}

impl DeviceCrowd {
    /// Copies the tables to the device.
    pub(crate) fn new(
        engine: &Arc<VulkanEngine>,
        source: CrowdSource<'_>,
    ) -> Result<Self, VulkanError> {
        let limit = engine.device.physical.info.max_storage_buffer_range;
        let check = |what, bytes: u64| match bytes > limit {
            true => Err(VulkanError::TooLarge { what, bytes, limit }),
            false => Ok(()),
        };
        let resident = |name, bytes: &[u8]| {
            check("a crowd's library", bytes.len() as u64)?;
            engine.resident(name, bytes, &mut Vec::new())
        };
        let shape = source.shape;
        let entries = u64::from(shape.instances) * u64::from(shape.layers);
        let entries = entries * size_of::<CrowdEntry>() as u64;
        check("a crowd's instances", entries)?;
        check(
            "a window of a crowd's poses",
            LEAST_WINDOW * 48 * u64::from(shape.joints),
        )?;
        Ok(Self {
            engine: Arc::clone(engine),
            clips: resident("tumble crowd clips", source.clips)?,
            bases: resident("tumble crowd time bases", source.bases)?,
            spans: resident("tumble crowd spans", source.spans)?,
            channels: resident("tumble crowd channels", source.channels)?,
            cells: resident("tumble crowd cells", source.cells)?,
            links: resident("tumble crowd links", source.links)?,
            bind: resident("tumble crowd inverse bind", source.bind)?,
            entries: Buffer::new(
                &engine.device,
                "tumble crowd entries",
                entries,
                Residence::Device,
            )?,
            shape,
        })
    }

    /// Instances that are evaluated at once: as many as their results fit the device's limits, and the
    /// memory budget.
    pub(crate) fn window(&self) -> u32 {
        let shape = &self.shape;
        let info = &self.engine.device.physical.info;
        let matrices = 48 * u64::from(shape.joints);
        let places = size_of::<CrowdPlace>() as u64 * u64::from(shape.layers * shape.bases);
        let bytes = matrices.max(places);
        let range = info
            .max_storage_buffer_range
            .min(info.max_memory_allocation_size);
        let budget = self.engine.clip_bytes.map_or(range, |bytes| bytes as u64);
        let mut range = range.min(budget);
        if info.kind == DeviceKind::Cpu {
            // Every kernel goes over a window while it is in the processor's cache.
            range = range.min(SOFTWARE_WINDOW);
        }
        // Vectors are counted in 32 bits.
        let most = (range / bytes).min(u64::from(u32::MAX / 4) / (bytes / 8));
        let all = u64::from(shape.instances).next_multiple_of(LEAST_WINDOW);
        (most / LEAST_WINDOW * LEAST_WINDOW).clamp(LEAST_WINDOW, all) as u32
    }

    /// Records an evaluation at a time of the clock: the entries that changed, then the dispatches.
    /// `changes` are ranges of entries, with the entries themselves.
    ///
    /// # Safety
    /// The command buffer must be of this device, in recording, outside of a render pass, and its
    /// queue must be able to compute. What it was recorded for must be submitted in the order of the
    /// calls.
    pub(crate) unsafe fn record<'e>(
        &self,
        target: &CrowdTarget,
        commands: vk::CommandBuffer,
        clock: u64,
        changes: impl Iterator<Item = (usize, &'e [CrowdEntry])>,
    ) {
        let recorder = Recorder {
            crowd: self,
            commands,
        };
        recorder.barrier(vk::PipelineStageFlags::ALL_COMMANDS, READY);
        let each = size_of::<CrowdEntry>();
        let mut changed = false;
        for (first, entries) in changes {
            changed = true;
            for (place, part) in (first..)
                .step_by(UPDATE / each)
                .zip(entries.chunks(UPDATE / each))
            {
                let bytes = bytemuck::cast_slice(part);
                // SAFETY: promised by the caller; the range lies within the buffer.
                unsafe {
                    self.engine.device.raw.cmd_update_buffer(
                        commands,
                        self.entries.raw,
                        (place * each) as u64,
                        bytes,
                    );
                }
            }
        }
        if changed {
            recorder.barrier(vk::PipelineStageFlags::TRANSFER, READY);
        }
        for (window, sets) in target.windows.iter().enumerate() {
            let first = window as u32 * target.window;
            let count = target.window.min(self.shape.instances - first);
            let arguments = CrowdDispatch {
                count: 0,
                first_instance: first,
                joints: self.shape.joints,
                layers: self.shape.layers,
                bases: self.shape.bases,
                first_link: 0,
                clock_low: clock as u32,
                clock_high: (clock >> 32) as u32,
                masks: self.shape.masks,
                references: self.shape.references,
            };
            recorder.window(target, sets, count, arguments);
        }
        recorder.barrier(
            vk::PipelineStageFlags::COMPUTE_SHADER,
            vk::PipelineStageFlags::ALL_COMMANDS,
        );
    }
}

/// What a crowd does next.
const READY: vk::PipelineStageFlags = vk::PipelineStageFlags::from_raw(
    vk::PipelineStageFlags::COMPUTE_SHADER.as_raw() | vk::PipelineStageFlags::TRANSFER.as_raw(),
);

/// The kernels of a target that are dispatched one after another.
pub(crate) struct CrowdPipelines {
    pub(crate) times: Arc<Pipeline>,
    /// Rotations, or matrices in the parents' frames.
    pub(crate) joints: Arc<Pipeline>,
    pub(crate) walk: Option<Arc<Pipeline>>,
    pub(crate) skin: Option<Arc<Pipeline>>,
    pub(crate) half: Option<Arc<Pipeline>>,
}

impl CrowdPipelines {
    pub(crate) fn new(crowd: &DeviceCrowd, steps: CrowdSteps) -> Result<Self, VulkanError> {
        let (engine, shape) = (&crowd.engine, &crowd.shape);
        let is_plain = shape.layers == 1 && shape.only_arcs;
        let if_wanted = |wanted: bool, kernel| wanted.then(|| engine.pipeline(kernel)).transpose();
        Ok(Self {
            times: engine.pipeline(Kernel::CrowdTimes)?,
            joints: engine.pipeline(match (steps.matrices, is_plain) {
                (true, true) => Kernel::CrowdPlainLocals,
                (true, false) => Kernel::CrowdLocals,
                (false, true) => Kernel::CrowdPlainRotations,
                (false, false) => Kernel::CrowdRotations,
            })?,
            walk: if_wanted(steps.walk, Kernel::CrowdWalk)?,
            skin: if_wanted(steps.skin, Kernel::CrowdSkin)?,
            half: if_wanted(steps.half, Kernel::CrowdHalf)?,
        })
    }
}

/// The descriptor sets of a window's kernels; null for kernels that do not run.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CrowdSets {
    pub(crate) times: vk::DescriptorSet,
    pub(crate) joints: vk::DescriptorSet,
    pub(crate) walk: vk::DescriptorSet,
    pub(crate) skin: vk::DescriptorSet,
    pub(crate) half: vk::DescriptorSet,
}

/// Records into a command buffer.
struct Recorder<'a> {
    crowd: &'a DeviceCrowd,
    commands: vk::CommandBuffer,
}

impl Recorder<'_> {
    /// Records one window's dispatches.
    fn window(
        &self,
        target: &CrowdTarget,
        sets: &CrowdSets,
        instances: u32,
        arguments: CrowdDispatch,
    ) {
        let (shape, pipelines) = (&self.crowd.shape, &target.pipelines);
        let joints = instances * shape.joints;
        let places = instances * shape.layers * shape.bases;
        self.dispatch(&pipelines.times, sets.times, places, arguments);
        self.dispatch(&pipelines.joints, sets.joints, joints, arguments);
        if let Some(walk) = &pipelines.walk {
            for level in shape.levels.windows(2) {
                let level: Range<u32> = level[0]..level[1];
                let own = CrowdDispatch {
                    joints: level.len() as u32,
                    layers: shape.joints,
                    first_link: level.start,
                    ..arguments
                };
                self.dispatch(walk, sets.walk, instances * own.joints, own);
            }
        }
        if let Some(skin) = &pipelines.skin {
            self.dispatch(skin, sets.skin, 3 * joints, arguments);
        }
        if let Some(half) = &pipelines.half {
            let vectors = target.steps.vectors() * joints;
            self.dispatch(half, sets.half, vectors, arguments);
        }
    }

    /// Records a dispatch, and that what comes next sees what it wrote.
    fn dispatch(
        &self,
        pipeline: &Pipeline,
        set: vk::DescriptorSet,
        count: u32,
        arguments: CrowdDispatch,
    ) {
        if count == 0 {
            return;
        }
        let (engine, commands) = (&self.crowd.engine, self.commands);
        let raw = &engine.device.raw;
        let arguments = CrowdDispatch { count, ..arguments };
        let constants = bytemuck::bytes_of(&arguments);
        let compute = vk::PipelineBindPoint::COMPUTE;
        let stage = vk::ShaderStageFlags::COMPUTE;
        const _: () = assert!(CROWD_WORKGROUP == crate::shader::WORKGROUP);
        let [x, y, z] = engine.workgroups(count);
        // SAFETY: the command buffer is in recording, as the caller of `record` promises; set and
        // pipeline belong to this device and live as long as the target.
        unsafe {
            raw.cmd_bind_pipeline(commands, compute, pipeline.raw);
            raw.cmd_bind_descriptor_sets(commands, compute, pipeline.layout, 0, &[set], &[]);
            raw.cmd_push_constants(commands, pipeline.layout, stage, 0, constants);
            raw.cmd_dispatch(commands, x, y, z);
        }
        self.barrier(vk::PipelineStageFlags::COMPUTE_SHADER, READY);
    }

    /// Records that whatever was written before is there for what comes next.
    fn barrier(&self, from: vk::PipelineStageFlags, to: vk::PipelineStageFlags) {
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
        let none = vk::DependencyFlags::empty();
        // SAFETY: as in `dispatch`.
        unsafe {
            self.crowd.engine.device.raw.cmd_pipeline_barrier(
                self.commands,
                from,
                to,
                none,
                &memory,
                &[],
                &[],
            );
        }
    }
}
