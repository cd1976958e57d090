//! A crowd on a Vulkan device: its tables, which stay on the device, and the buffers for its results. Each evaluation
//! records the changes and the dispatches, without waiting and without allocating. Each barrier names the buffers
//! that it orders.

use std::sync::Arc;

use ash::vk;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::VulkanError;
use crate::gpu::in_flight::KernelResults;
use crate::gpu::physical::DeviceKind;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::submission::{Access, Binding, Commands, DescriptorPool};
use crate::gpu::whole_instances::WholeInstances;
use crate::output::crowd::{
    CrowdFrame, CrowdOutput, CrowdValues, EntryChanges, VisibleInstances, listed_changes,
};
use crate::shader::{
    CROWD_WORKGROUP, CrowdChange, CrowdDispatch, CrowdEntry, CrowdPosition, Kernel, MAX_WALKED,
    WORKGROUP,
};

/// The minimum number of instances of a window: with it, windows start at multiples of 256 bytes.
const LEAST_WINDOW: u64 = 32;

/// The size of a window's matrices on a software device, bytes.
const SOFTWARE_WINDOW: u64 = 8 << 20;

/// Bytes of a matrix.
const MATRIX: u64 = 48;

/// The sizes of a crowd, and the tables of its library for the kernels ([`VulkanEngine::crowd_table`]).
pub(crate) struct CrowdTables {
    pub(crate) instances: u32,
    /// The first link of each level of the skeleton below the roots, then the number of links.
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
    /// The rows of inverse bind matrices; empty if there are none.
    pub(crate) bind: Buffer,
}

/// A crowd's buffers on a device.
pub(crate) struct DeviceCrowd {
    pub(crate) engine: Arc<VulkanEngine>,
    pub(crate) tables: CrowdTables,
    /// `[instance][layer]`
    pub(crate) entries: Buffer,
    /// Changed entries, before they are copied to the others.
    changes: Buffer,
    /// The visible instances, if not all are visible.
    visible: Buffer,
}

impl DeviceCrowd {
    pub(crate) fn new(engine: Arc<VulkanEngine>, tables: CrowdTables) -> Result<Self, VulkanError> {
        let device = &engine.device;
        let arguments = &tables.arguments;
        let instances = u64::from(tables.instances);
        let entries = instances * u64::from(arguments.layers);
        let listed = listed_changes(entries as usize) * size_of::<CrowdChange>();
        let entries = entries * size_of::<CrowdEntry>() as u64;
        let poses = LEAST_WINDOW * MATRIX * u64::from(arguments.joints);
        let physical = &device.physical;
        physical.check_range("a crowd's instances", entries)?;
        physical.check_range("a window of a crowd's poses", poses)?;
        let new = |name, size| Buffer::new(device, name, size, Residence::Device);
        Ok(Self {
            entries: new("tumble crowd entries", entries)?,
            changes: new("tumble crowd changes", listed as u64)?,
            visible: new("tumble crowd visible instances", 4 * instances)?,
            engine,
            tables,
        })
    }

    /// Bytes of the result of one instance.
    pub(crate) fn bytes(&self, output: CrowdOutput) -> u64 {
        u64::from(self.tables.arguments.joints) * output.bytes() as u64
    }

    /// Bytes of the positions of the layers of one instance.
    pub(crate) fn position_bytes(&self) -> u64 {
        let arguments = &self.tables.arguments;
        size_of::<CrowdPosition>() as u64 * u64::from(arguments.layers) * u64::from(arguments.bases)
    }

    /// The number of instances of a window: their results fit the device's limits and the memory budget.
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

    /// Whether instances have one layer, and all rotations are arcs or constants.
    fn is_plain(&self) -> bool {
        self.tables.arguments.layers == 1 && self.tables.only_arcs
    }

    /// How instances are evaluated as wholes, where they are: on cards that can bind all that a kernel then reads. Software
    /// devices run a workgroup's invocations one after another, and stop at each barrier.
    fn whole(&self, output: CrowdOutput) -> Option<WholeInstances> {
        let device = &self.engine.device;
        let binds = |whole: &WholeInstances| {
            Pipeline::storage_buffers(device, whole.kernel) <= device.physical.storage_buffers
        };
        let whole = WholeInstances::new(&self.tables.arguments, output, self.is_plain());
        whole.filter(|whole| self.engine.maps_samples && binds(whole))
    }

    /// The kernels for a result, in their order.
    pub(crate) fn kernels(&self, output: CrowdOutput) -> Vec<Kernel> {
        use CrowdValues::{Model, Rotations, Skinning};
        if let Some(whole) = self.whole(output) {
            return vec![whole.kernel];
        }
        let is_plain = self.is_plain();
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

    /// The buffers that a kernel binds.
    fn bindings(&self, kernel: Kernel, window: &WindowBuffers) -> Vec<Binding> {
        let (tables, whole) = (&self.tables, Binding::whole);
        let WindowBuffers {
            entries,
            positions,
            values,
            output,
        } = *window;
        match kernel {
            Kernel::CrowdTimes => {
                let [clips, bases, spans] =
                    [&tables.clips, &tables.bases, &tables.spans].map(whole);
                vec![entries, clips, bases, spans, positions]
            }
            Kernel::CrowdWalk | Kernel::CrowdWalkAll => vec![whole(&tables.links), values],
            Kernel::CrowdSkin => vec![whole(&tables.bind), values],
            Kernel::CrowdHalf => vec![values, output],
            Kernel::CrowdRotations
            | Kernel::CrowdPlainRotations
            | Kernel::CrowdLocals
            | Kernel::CrowdPlainLocals => {
                let (channels, cells) = (whole(&tables.channels), whole(&tables.cells));
                vec![entries, channels, cells, positions, values]
            }
            // Over whole instances.
            _ => {
                let CrowdTables {
                    clips,
                    bases,
                    spans,
                    channels,
                    cells,
                    ..
                } = tables;
                let read = [clips, bases, spans, channels, cells].map(whole);
                let has_matrices = !matches!(
                    kernel,
                    Kernel::CrowdWholeRotations | Kernel::CrowdPlainWholeRotations
                );
                let skeleton = [&tables.links, &tables.bind].map(whole);
                let skeleton = if has_matrices { &skeleton[..] } else { &[] };
                // The result is bound in both precisions.
                [&[entries], &read[..], skeleton, &[output; 2]].concat()
            }
        }
    }
}

/// The buffers of a window's kernels.
#[derive(Clone, Copy)]
struct WindowBuffers {
    /// All entries, or those of the window's instances.
    entries: Binding,
    /// The position of each layer of the window's instances in its clip.
    positions: Binding,
    /// The values in 32 bits.
    values: Binding,
    /// The result.
    output: Binding,
}

/// A kernel with its buffers.
struct BoundKernel {
    kernel: Kernel,
    pipeline: Arc<Pipeline>,
    set: vk::DescriptorSet,
}

/// A window of instances: its kernels in their order.
struct Window {
    kernels: Vec<BoundKernel>,
    /// The descriptor sets of the first kernels, those that read entries, for gathered entries.
    on_gathered: Vec<vk::DescriptorSet>,
    buffers: WindowBuffers,
}

/// A range of an application's buffer for a crowd's results ([`Crowd::target`](crate::crowd::player::Crowd::target)),
/// with all resources for recording.
pub struct CrowdTarget {
    /// The crowd that the target was made for; its buffers are in the descriptor sets.
    pub(crate) crowd: Arc<DeviceCrowd>,
    output: CrowdOutput,
    /// How instances are evaluated as wholes, if they are.
    whole: Option<WholeInstances>,
    /// The range of the result.
    pub(crate) range: Binding,
    /// The maximum number of instances.
    pub(crate) room: u32,
    scatter: BoundKernel,
    gather: BoundKernel,
    /// The number of instances of a window.
    window: u32,
    windows: Vec<Window>,
    // What the sets are made of and lead to. Whoever records promises that no work that uses it is in
    // flight when the target is dropped.
    _pool: DescriptorPool,
    /// Nothing where instances are evaluated as wholes.
    positions: Buffer,
    gathered: Buffer,
    /// The values of a window before a separate kernel rounds them to 16 bits.
    values: Option<Buffer>,
}

impl CrowdTarget {
    /// Makes a target for a range that starts at `offset`, with room for `room` instances.
    pub(crate) fn new(
        crowd: &Arc<DeviceCrowd>,
        output: CrowdOutput,
        (buffer, offset): (vk::Buffer, u64),
        room: u32,
    ) -> Result<Self, VulkanError> {
        let engine = &crowd.engine;
        let arguments = &crowd.tables.arguments;
        let window = crowd.window();
        let each = crowd.bytes(output);
        let new = |name, each: u64| {
            let size = u64::from(window) * each;
            Buffer::new(&engine.device, name, size, Residence::Device)
        };
        let whole = crowd.whole(output);
        let position_bytes = if whole.is_some() {
            0
        } else {
            crowd.position_bytes()
        };
        let positions = new("tumble crowd places", position_bytes)?;
        let entry_bytes = size_of::<CrowdEntry>() as u64 * u64::from(arguments.layers);
        let gathered = new("tumble crowd gathered entries", entry_bytes)?;
        let value_bytes = u64::from(arguments.joints) * output.vector_count() as u64 * 16;
        let has_values = output.is_half && whole.is_none();
        let values = has_values.then(|| new("tumble crowd values", value_bytes));
        let values = values.transpose()?;
        let pipelines = crowd
            .kernels(output)
            .into_iter()
            .map(|kernel| Ok((kernel, engine.pipeline(kernel)?)))
            .collect::<Result<Vec<_>, VulkanError>>()?;
        let count = room.div_ceil(window);
        let mut pool = DescriptorPool::new(&engine.device);
        pool.make_room(2 + count * (pipelines.len() as u32 + 2))?;
        let entries = Binding::whole(&crowd.entries);
        let mut bound = |kernel, bindings: &[Binding]| -> Result<_, VulkanError> {
            let pipeline = engine.pipeline(kernel)?;
            let set = pool.set(&pipeline, bindings)?;
            Ok(BoundKernel {
                kernel,
                pipeline,
                set,
            })
        };
        let changes = Binding::whole(&crowd.changes);
        let scatter = bound(Kernel::CrowdScatter, &[changes, entries])?;
        let visible = Binding::whole(&crowd.visible);
        let all = [entries, visible, Binding::whole(&gathered)];
        let gather = bound(Kernel::CrowdGather, &all)?;
        let mut windows = Vec::new();
        for first in (0..room).step_by(window as usize) {
            let count = window.min(room - first);
            let start = offset + u64::from(first) * each;
            let range = Binding::range(buffer, start, u64::from(count) * each);
            let buffers = WindowBuffers {
                entries,
                positions: Binding::whole(&positions),
                values: values.as_ref().map_or(range, Binding::whole),
                output: range,
            };
            let on_gathered = WindowBuffers {
                entries: Binding::whole(&gathered),
                ..buffers
            };
            let read_entries = pipelines.iter().take(2);
            let on_gathered = read_entries
                .map(|(kernel, pipeline)| {
                    pool.set(pipeline, &crowd.bindings(*kernel, &on_gathered))
                })
                .collect::<Result<_, VulkanError>>()?;
            let kernels = pipelines
                .iter()
                .map(|(kernel, pipeline)| {
                    let set = pool.set(pipeline, &crowd.bindings(*kernel, &buffers))?;
                    Ok(BoundKernel {
                        kernel: *kernel,
                        pipeline: Arc::clone(pipeline),
                        set,
                    })
                })
                .collect::<Result<_, VulkanError>>()?;
            windows.push(Window {
                kernels,
                on_gathered,
                buffers,
            });
        }
        Ok(Self {
            crowd: Arc::clone(crowd),
            output,
            whole,
            range: Binding::range(buffer, offset, u64::from(room) * each),
            room,
            scatter,
            gather,
            window,
            windows,
            _pool: pool,
            positions,
            gathered,
            values,
        })
    }

    /// The output that is written to the buffer.
    #[must_use]
    pub fn output(&self) -> CrowdOutput {
        self.output
    }

    /// Bytes of the result of a frame.
    fn bytes(&self, frame: &CrowdFrame<'_>) -> u64 {
        u64::from(frame.instances) * self.crowd.bytes(self.output)
    }

    /// Records the evaluation of a frame that has at least one instance and at most `room`: the changes, then the
    /// dispatches. Recorded frames must be submitted in the order of the calls.
    pub(crate) fn record(&self, commands: Commands<'_>, frame: &CrowdFrame<'_>) {
        let (crowd, whole) = (&self.crowd, Binding::whole);
        let result = Binding {
            size: self.bytes(frame),
            ..self.range
        };
        // Evaluations before this one may use the crowd's buffers, and anything the result's.
        let used = [
            whole(&crowd.entries),
            whole(&crowd.changes),
            whole(&crowd.visible),
            whole(&self.positions),
            whole(&self.gathered),
            self.values.as_ref().map_or(result, whole),
        ];
        let used = &used[..5 + usize::from(self.values.is_some())];
        let scratch = &used[3..5];
        commands.barrier_over(Access::KernelAndCopy, Access::KernelAndCopy, used);
        commands.barrier_over(Access::Any, Access::Kernel, &[result]);
        self.record_changes(commands, frame);
        let arguments = CrowdDispatch {
            clock_low: frame.clock as u32,
            clock_high: (frame.clock >> 32) as u32,
            ..crowd.tables.arguments
        };
        let is_gathered = frame.visible != VisibleInstances::All;
        let firsts = (0..frame.instances).step_by(self.window as usize);
        for (first_instance, window) in firsts.zip(&self.windows) {
            let instances = self.window.min(frame.instances - first_instance);
            let arguments = CrowdDispatch {
                first_instance,
                ..arguments
            };
            if first_instance > 0 {
                commands.barrier_over(Access::Kernel, Access::Kernel, scratch);
            }
            if is_gathered {
                let count = instances * arguments.layers;
                self.dispatch(commands, &self.gather, CrowdDispatch { count, ..arguments });
                commands.barrier_over(Access::Kernel, Access::Kernel, &[whole(&self.gathered)]);
            }
            self.record_window(commands, window, is_gathered, instances, arguments);
        }
        commands.barrier_over(Access::Kernel, Access::Any, &[result]);
    }

    /// Records the changes that the device does not know yet: entries, and the list of visible instances.
    fn record_changes(&self, commands: Commands<'_>, frame: &CrowdFrame<'_>) {
        let crowd = &self.crowd;
        let [entries, changes, visible] =
            [&crowd.entries, &crowd.changes, &crowd.visible].map(Binding::whole);
        if let VisibleInstances::List(list) = frame.visible {
            commands.update(visible.buffer, 0, bytemuck::cast_slice(list));
            commands.barrier_over(Access::Copy, Access::Kernel, &[visible]);
        }
        match frame.changes {
            EntryChanges::None => {}
            EntryChanges::Range(first, changed) => {
                let offset = first * size_of::<CrowdEntry>();
                commands.update(entries.buffer, offset as u64, bytemuck::cast_slice(changed));
                commands.barrier_over(Access::Copy, Access::Kernel, &[entries]);
            }
            EntryChanges::List(list) => {
                commands.update(changes.buffer, 0, bytemuck::cast_slice(list));
                commands.barrier_over(Access::Copy, Access::Kernel, &[changes]);
                let count = list.len() as u32;
                let arguments = CrowdDispatch {
                    count,
                    ..crowd.tables.arguments
                };
                self.dispatch(commands, &self.scatter, arguments);
                commands.barrier_over(Access::Kernel, Access::Kernel, &[entries]);
            }
        }
    }

    /// Records a dispatch with as many invocations as its arguments say.
    fn dispatch(&self, commands: Commands<'_>, bound: &BoundKernel, arguments: CrowdDispatch) {
        let groups = self.crowd.engine.workgroups(arguments.count);
        let bytes = bytemuck::bytes_of(&arguments);
        commands.dispatch(&bound.pipeline, bound.set, bytes, groups);
    }

    /// Records the dispatches of a window; each sees the result of the previous one.
    fn record_window(
        &self,
        commands: Commands<'_>,
        window: &Window,
        is_gathered: bool,
        instances: u32,
        arguments: CrowdDispatch,
    ) {
        const _: () = assert!(CROWD_WORKGROUP == WORKGROUP);
        let joints = instances * arguments.joints;
        let order = |range| commands.barrier_over(Access::Kernel, Access::Kernel, &[range]);
        let WindowBuffers {
            positions, values, ..
        } = window.buffers;
        for (index, bound) in window.kernels.iter().enumerate() {
            let gathered = window.on_gathered.get(index).filter(|_| is_gathered);
            let mut arguments = arguments;
            let mut set = bound.set;
            if let Some(&on_gathered) = gathered {
                (set, arguments.first_instance) = (on_gathered, 0);
            }
            if let Some(whole) = &self.whole {
                let count = instances;
                let levels = &self.crowd.tables.levels;
                let (pushed, groups) = whole.dispatch(CrowdDispatch { count, ..arguments }, levels);
                let groups = self.crowd.engine.workgroups(groups * WORKGROUP);
                let bytes = bytemuck::bytes_of(&pushed);
                commands.dispatch(&bound.pipeline, set, bytes, groups);
                continue;
            }
            let dispatch = |arguments: CrowdDispatch, invocations| {
                let groups = self.crowd.engine.workgroups(invocations);
                let bytes = bytemuck::bytes_of(&arguments);
                commands.dispatch(&bound.pipeline, set, bytes, groups);
            };
            // What the kernel before left for this one.
            match index {
                0 => {}
                1 => order(positions),
                _ if bound.kernel == Kernel::CrowdWalk => {}
                _ => order(values),
            }
            let count = match bound.kernel {
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
                    dispatch(walk, instances * WORKGROUP);
                    continue;
                }
                Kernel::CrowdWalk => {
                    let mut is_bound = false;
                    for level in self.crowd.tables.levels.windows(2) {
                        let joints = level[1] - level[0];
                        let level_arguments = CrowdDispatch {
                            count: instances * joints,
                            joints,
                            layers: arguments.joints,
                            first_link: level[0],
                            ..arguments
                        };
                        if joints == 0 {
                            continue;
                        }
                        order(values);
                        if is_bound {
                            let groups = self.crowd.engine.workgroups(level_arguments.count);
                            let bytes = bytemuck::bytes_of(&level_arguments);
                            commands.dispatch_again(&bound.pipeline, bytes, groups);
                        } else {
                            dispatch(level_arguments, level_arguments.count);
                            is_bound = true;
                        }
                    }
                    continue;
                }
                _ => joints,
            };
            dispatch(CrowdDispatch { count, ..arguments }, count);
        }
    }
}

/// A target whose result the host reads: it is in host-visible memory, and a submission does not wait.
pub(crate) struct CrowdReader {
    // It goes first: it waits for what uses the rest.
    pub(crate) results: KernelResults,
    pub(crate) target: CrowdTarget,
}

impl CrowdReader {
    /// Makes a reader with room for `room` instances.
    pub(crate) fn new(
        crowd: &Arc<DeviceCrowd>,
        output: CrowdOutput,
        room: u32,
    ) -> Result<Self, VulkanError> {
        let engine = &crowd.engine;
        let bytes = u64::from(room) * crowd.bytes(output);
        let mut results = KernelResults::new(&engine.device)?;
        let staged = !engine.device.placing.in_place;
        let buffer = results.room(&engine.device, bytes, staged)?.raw;
        Ok(Self {
            results,
            target: CrowdTarget::new(crowd, output, (buffer, 0), room)?,
        })
    }

    /// Whether the reader is for this output and has room for so many instances.
    pub(crate) fn fits(&self, output: CrowdOutput, instances: u32) -> bool {
        self.target.output == output && self.target.room >= instances
    }

    /// Submits the evaluation of a frame; the previous one must have been waited for.
    pub(crate) fn submit(&mut self, frame: &CrowdFrame<'_>) -> Result<(), VulkanError> {
        self.results.kernels.begin(0)?;
        let commands = self.results.kernels.commands();
        self.target.record(commands, frame);
        self.results.submit(Some(self.target.bytes(frame)))
    }

    /// Waits, and copies the result to `output`, which has the same length.
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
