//! A crowd on a Vulkan device: its tables, which stay there, and where its results go. Each evaluation records
//! what changed and the dispatches, without waiting and without allocating.

use std::sync::Arc;

use ash::vk;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::VulkanError;
use crate::gpu::in_flight::KernelResults;
use crate::gpu::physical::DeviceKind;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::submission::{Access, Binding, Commands, DescriptorPool};
use crate::output::crowd::{CrowdOutput, CrowdValues};
use crate::shader::{
    CROWD_WORKGROUP, CrowdDispatch, CrowdEntry, CrowdPosition, Kernel, MAX_WALKED, WORKGROUP,
};

/// The fewest instances of a window: so many that windows start at multiples of 256 bytes.
const LEAST_WINDOW: u64 = 32;

/// Bytes of a window's matrices on a software device.
const SOFTWARE_WINDOW: u64 = 8 << 20;

/// Bytes of a matrix.
const MATRIX: u64 = 48;

/// The sizes of a crowd, and what its kernels read of its library ([`VulkanEngine::crowd_table`]).
pub(crate) struct CrowdTables {
    pub(crate) instances: u32,
    /// Where each level of the skeleton below the roots starts among the links, and their end.
    pub(crate) levels: Vec<u32>,
    /// Whether all rotations are arcs or constants.
    pub(crate) only_arcs: bool,
    /// The push constants that all dispatches share.
    pub(crate) arguments: CrowdDispatch,
    pub(crate) clips: Buffer,
    pub(crate) bases: Buffer,
    pub(crate) spans: Buffer,
    pub(crate) channels: Buffer,
    pub(crate) cells: Buffer,
    pub(crate) links: Buffer,
    /// The rows of inverse bind matrices; empty where there are none.
    pub(crate) bind: Buffer,
}

/// A crowd's buffers on a device.
pub(crate) struct DeviceCrowd {
    pub(crate) engine: Arc<VulkanEngine>,
    pub(crate) tables: CrowdTables,
    /// `[instance][layer]`
    pub(crate) entries: Buffer,
}

impl DeviceCrowd {
    pub(crate) fn new(engine: Arc<VulkanEngine>, tables: CrowdTables) -> Result<Self, VulkanError> {
        let device = &engine.device;
        let arguments = &tables.arguments;
        let entries = u64::from(tables.instances) * u64::from(arguments.layers);
        let entries = entries * size_of::<CrowdEntry>() as u64;
        let poses = LEAST_WINDOW * MATRIX * u64::from(arguments.joints);
        let physical = &device.physical;
        physical.check_range("a crowd's instances", entries)?;
        physical.check_range("a window of a crowd's poses", poses)?;
        Ok(Self {
            entries: Buffer::new(device, "tumble crowd entries", entries, Residence::Device)?,
            engine,
            tables,
        })
    }

    pub(crate) fn bytes(&self, output: CrowdOutput) -> u64 {
        let joints = u64::from(self.tables.instances) * u64::from(self.tables.arguments.joints);
        joints * output.bytes() as u64
    }

    /// Bytes of the positions of the layers of an instance.
    pub(crate) fn position_bytes(&self) -> u64 {
        let arguments = &self.tables.arguments;
        size_of::<CrowdPosition>() as u64 * u64::from(arguments.layers) * u64::from(arguments.bases)
    }

    /// Instances that are evaluated at once: as many as their results fit the device's limits, and the
    /// memory budget.
    pub(crate) fn window(&self) -> u32 {
        let arguments = &self.tables.arguments;
        let info = &self.engine.device.physical.info;
        let bytes = self
            .position_bytes()
            .max(MATRIX * u64::from(arguments.joints));
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
        let limit = (range / bytes).min(u64::from(u32::MAX / 4) / (bytes / 8));
        let all = u64::from(self.tables.instances).next_multiple_of(LEAST_WINDOW);
        (limit / LEAST_WINDOW * LEAST_WINDOW).clamp(LEAST_WINDOW, all) as u32
    }

    /// The kernels that run for a result, one after another.
    pub(crate) fn kernels(&self, output: CrowdOutput) -> Vec<Kernel> {
        use CrowdValues::{Model, Rotations, Skinning};
        let is_plain = self.tables.arguments.layers == 1 && self.tables.only_arcs;
        let joints = match (output.values, is_plain) {
            (Rotations, true) => Kernel::CrowdPlainRotations,
            (Rotations, false) => Kernel::CrowdRotations,
            (_, true) => Kernel::CrowdPlainLocals,
            (_, false) => Kernel::CrowdLocals,
        };
        let mut kernels = vec![Kernel::CrowdTimes, joints];
        // Software devices run a workgroup's invocations one after another, and stop at each barrier.
        let fits = self.tables.arguments.joints <= MAX_WALKED;
        let walk = match self.engine.maps_samples && fits {
            true => Kernel::CrowdWalkAll,
            false => Kernel::CrowdWalk,
        };
        let walks = matches!(output.values, Model | Skinning);
        kernels.extend(walks.then_some(walk));
        kernels.extend((output.values == Skinning).then_some(Kernel::CrowdSkin));
        kernels.extend(output.is_half.then_some(Kernel::CrowdHalf));
        kernels
    }

    /// The buffers that a kernel binds: `positions` are where each layer of a window's instances is in its clip,
    /// `values` are in 32 bits, and `output` is what is left of them.
    pub(crate) fn bindings(
        &self,
        kernel: Kernel,
        [positions, values, output]: [Binding; 3],
    ) -> Vec<Binding> {
        let (tables, whole) = (&self.tables, Binding::whole);
        let entries = whole(&self.entries);
        match kernel {
            Kernel::CrowdTimes => {
                let [clips, bases, spans] =
                    [&tables.clips, &tables.bases, &tables.spans].map(whole);
                vec![entries, clips, bases, spans, positions]
            }
            Kernel::CrowdWalk | Kernel::CrowdWalkAll => vec![whole(&tables.links), values],
            Kernel::CrowdSkin => vec![whole(&tables.bind), values],
            Kernel::CrowdHalf => vec![values, output],
            _ => {
                let (channels, cells) = (whole(&tables.channels), whole(&tables.cells));
                vec![entries, channels, cells, positions, values]
            }
        }
    }
}

/// The most bytes that one command may write into a buffer.
const UPDATE: usize = 1 << 16;

/// A range of an application's buffer that a crowd is evaluated into
/// ([`Crowd::target`](crate::crowd::player::Crowd::target)), with all that recording needs.
pub struct CrowdTarget {
    /// What it was made for; its buffers are in the sets.
    pub(crate) crowd: Arc<DeviceCrowd>,
    output: CrowdOutput,
    pipelines: Vec<(Kernel, Arc<Pipeline>)>,
    /// Instances of a window.
    window: u32,
    /// The descriptor sets of each window, one for each kernel.
    windows: Vec<Vec<vk::DescriptorSet>>,
    // What the sets are made of and lead to. Whoever records promises that no work that uses it is in
    // flight when the target is dropped.
    _pool: DescriptorPool,
    _buffers: (Buffer, Option<Buffer>),
}

impl CrowdTarget {
    /// For a range of a buffer from `offset` on, which is as long as the result.
    pub(crate) fn new(
        crowd: &Arc<DeviceCrowd>,
        output: CrowdOutput,
        buffer: vk::Buffer,
        offset: u64,
    ) -> Result<Self, VulkanError> {
        let engine = &crowd.engine;
        let (window, instances) = (crowd.window(), crowd.tables.instances);
        let joints = u64::from(crowd.tables.arguments.joints);
        let new = |name, each: u64| {
            let size = u64::from(window) * each;
            Buffer::new(&engine.device, name, size, Residence::Device)
        };
        let positions = new("tumble crowd places", crowd.position_bytes())?;
        // Values of a window before they are rounded to 16 bits.
        let values = joints * output.vector_count() as u64 * 16;
        let whole = (output.is_half).then(|| new("tumble crowd values", values));
        let whole = whole.transpose()?;
        let pipelines = crowd
            .kernels(output)
            .into_iter()
            .map(|kernel| Ok((kernel, engine.pipeline(kernel)?)))
            .collect::<Result<Vec<_>, VulkanError>>()?;
        let count = instances.div_ceil(window);
        let mut pool = DescriptorPool::new(&engine.device);
        pool.make_room(count * pipelines.len() as u32)?;
        let mut windows = Vec::new();
        for first in (0..instances).step_by(window as usize) {
            let count = window.min(instances - first);
            let each = joints * output.bytes() as u64;
            let start = offset + u64::from(first) * each;
            let range = Binding::range(buffer, start, u64::from(count) * each);
            let values = whole.as_ref().map_or(range, Binding::whole);
            let bound = [Binding::whole(&positions), values, range];
            let sets = pipelines
                .iter()
                .map(|(kernel, pipeline)| pool.set(pipeline, &crowd.bindings(*kernel, bound)))
                .collect::<Result<_, _>>()?;
            windows.push(sets);
        }
        Ok(Self {
            crowd: Arc::clone(crowd),
            output,
            pipelines,
            window,
            windows,
            _pool: pool,
            _buffers: (positions, whole),
        })
    }

    /// What is left there.
    #[must_use]
    pub fn output(&self) -> CrowdOutput {
        self.output
    }

    /// Records an evaluation at a time of the clock: the entries that changed, then the dispatches.
    /// `changes` are ranges of entries, with the entries themselves. What is recorded must be submitted
    /// in the order of the calls.
    pub(crate) fn record<'e>(
        &self,
        commands: Commands<'_>,
        clock: u64,
        changes: impl Iterator<Item = (usize, &'e [CrowdEntry])>,
    ) {
        let tables = &self.crowd.tables;
        commands.barrier(Access::Any, Access::Any);
        let each = size_of::<CrowdEntry>();
        for (first, entries) in changes {
            let first_entries = (first..).step_by(UPDATE / each);
            for (first_entry, part) in first_entries.zip(entries.chunks(UPDATE / each)) {
                let bytes = bytemuck::cast_slice(part);
                commands.update(self.crowd.entries.raw, (first_entry * each) as u64, bytes);
            }
        }
        commands.barrier(Access::Copy, Access::Kernel);
        let firsts = (0..tables.instances).step_by(self.window as usize);
        for (first_instance, sets) in firsts.zip(&self.windows) {
            let instances = self.window.min(tables.instances - first_instance);
            let arguments = CrowdDispatch {
                first_instance,
                clock_low: clock as u32,
                clock_high: (clock >> 32) as u32,
                ..tables.arguments
            };
            self.record_window(commands, sets, instances, arguments);
        }
        commands.barrier(Access::Kernel, Access::Any);
    }

    /// Records the dispatches of a window, each of which sees what the one before it wrote.
    fn record_window(
        &self,
        commands: Commands<'_>,
        sets: &[vk::DescriptorSet],
        instances: u32,
        arguments: CrowdDispatch,
    ) {
        const _: () = assert!(CROWD_WORKGROUP == WORKGROUP);
        let joints = instances * arguments.joints;
        for ((kernel, pipeline), &set) in self.pipelines.iter().zip(sets) {
            let dispatch = |count, arguments| {
                if count > 0 {
                    let arguments = CrowdDispatch { count, ..arguments };
                    let groups = self.crowd.engine.workgroups(count);
                    commands.dispatch(pipeline, set, bytemuck::bytes_of(&arguments), groups);
                    commands.barrier(Access::Kernel, Access::Kernel);
                }
            };
            let count = match kernel {
                Kernel::CrowdTimes => instances * arguments.layers * arguments.bases,
                Kernel::CrowdSkin => 3 * joints,
                Kernel::CrowdHalf => joints * self.output.vector_count() as u32,
                Kernel::CrowdWalkAll => {
                    let levels = self.crowd.tables.levels.len() - 1;
                    let walk = CrowdDispatch {
                        count: instances,
                        layers: levels as u32,
                        first_link: self.crowd.tables.levels[levels],
                        ..arguments
                    };
                    let groups = self.crowd.engine.workgroups(instances * WORKGROUP);
                    commands.dispatch(pipeline, set, bytemuck::bytes_of(&walk), groups);
                    commands.barrier(Access::Kernel, Access::Kernel);
                    continue;
                }
                Kernel::CrowdWalk => {
                    for level in self.crowd.tables.levels.windows(2) {
                        let level_arguments = CrowdDispatch {
                            joints: level[1] - level[0],
                            layers: arguments.joints,
                            first_link: level[0],
                            ..arguments
                        };
                        dispatch(instances * level_arguments.joints, level_arguments);
                    }
                    continue;
                }
                _ => joints,
            };
            dispatch(count, arguments);
        }
    }
}

/// A target whose result the host reads: evaluated into memory that the host sees, submitted without a wait.
pub(crate) struct CrowdReader {
    // It goes first: it waits for what uses the rest.
    pub(crate) results: KernelResults,
    pub(crate) target: CrowdTarget,
}

impl CrowdReader {
    pub(crate) fn new(crowd: &Arc<DeviceCrowd>, output: CrowdOutput) -> Result<Self, VulkanError> {
        let engine = &crowd.engine;
        let bytes = crowd.bytes(output);
        let mut results = KernelResults::new(&engine.device)?;
        let staged = !engine.device.placing.in_place;
        let buffer = results.room(&engine.device, bytes, staged)?.raw;
        Ok(Self {
            results,
            target: CrowdTarget::new(crowd, output, buffer, 0)?,
        })
    }

    /// Submits an evaluation; the one before must have been waited for.
    pub(crate) fn submit<'e>(
        &mut self,
        clock: u64,
        changes: impl Iterator<Item = (usize, &'e [CrowdEntry])>,
    ) -> Result<(), VulkanError> {
        self.results.kernels.begin(0)?;
        let commands = self.results.kernels.commands();
        self.target.record(commands, clock, changes);
        let bytes = self.target.crowd.bytes(self.target.output);
        self.results.submit(Some(bytes))
    }

    /// Waits, and copies the result, of which `output` has as many bytes.
    pub(crate) fn wait_into(&mut self, output: &mut [u8]) -> Result<(), VulkanError> {
        self.results.wait()?;
        output.copy_from_slice(self.results.bytes(0..output.len())?);
        Ok(())
    }
}

impl std::fmt::Debug for CrowdTarget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CrowdTarget")
            .field("output", &self.output)
            .finish_non_exhaustive()
    }
}
