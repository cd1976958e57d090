//! Where a crowd's results go on a device: each evaluation records what changed and the dispatches,
//! without waiting and without allocating.

use std::sync::Arc;

use ash::vk;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::crowd::DeviceCrowd;
use crate::gpu::descriptors::DescriptorPool;
use crate::gpu::error::VulkanError;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::read_back::ReadBack;
use crate::gpu::submission::{Access, Binding, Commands};
use crate::output::crowd::CrowdOutput;
use crate::shader::{CROWD_WORKGROUP, CrowdDispatch, CrowdEntry, Kernel, WORKGROUP};

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
        let places = new("tumble crowd places", crowd.place_bytes())?;
        // Values of a window before they are rounded to 16 bits.
        let values = joints * output.vectors() as u64 * 16;
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
            let own = window.min(instances - first);
            let each = joints * output.bytes() as u64;
            let start = offset + u64::from(first) * each;
            let range = Binding::range(buffer, start, u64::from(own) * each);
            let values = whole.as_ref().map_or(range, Binding::whole);
            let bound = [Binding::whole(&places), values, range];
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
            _buffers: (places, whole),
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
            let places = (first..).step_by(UPDATE / each);
            for (place, part) in places.zip(entries.chunks(UPDATE / each)) {
                let bytes = bytemuck::cast_slice(part);
                commands.update(self.crowd.entries.raw, (place * each) as u64, bytes);
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
                Kernel::CrowdHalf => joints * self.output.vectors() as u32,
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
                        let own = CrowdDispatch {
                            joints: level[1] - level[0],
                            layers: arguments.joints,
                            first_link: level[0],
                            ..arguments
                        };
                        dispatch(instances * own.joints, own);
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
    pub(crate) results: ReadBack,
    pub(crate) target: CrowdTarget,
}

impl CrowdReader {
    pub(crate) fn new(crowd: &Arc<DeviceCrowd>, output: CrowdOutput) -> Result<Self, VulkanError> {
        let engine = &crowd.engine;
        let bytes = crowd.bytes(output);
        let mut results = ReadBack::new(&engine.device)?;
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
