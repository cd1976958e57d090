//! A crowd on a Vulkan device: its tables, which stay on the device, and the buffers for its results. Each evaluation
//! records a frame ([`Frames`]) into the same memory, without waiting and without allocating.

use std::any::Any;
use std::sync::{Arc, Mutex};

use ash::vk;
use bytemuck::cast_slice;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::engine::VulkanEngine;
use crate::gpu::in_flight::KernelResults;
use crate::gpu::physical::DeviceKind;
use crate::gpu::recorded::{Binding, Commands, Recorded};
use crate::machine::crowd::{CrowdFrame, EntryChanges, VisibleInstances};
use crate::machine::crowd::{CrowdSource, MachineCrowd};
use crate::machine::error::VulkanError;
use crate::output::crowd::{CrowdOutput, CrowdStage, listed_changes};
use crate::shader::{CrowdChange, CrowdEntry, CrowdLink};
use crate::threads::lock;
use crate::work::crowd::{
    self, CrowdDevice, CrowdResources, CrowdShape, FrameKernels, Frames, StageResources, Stages,
};

/// The minimum number of instances of a window: with it, windows start at multiples of 256 bytes.
const LEAST_WINDOW: u64 = 32;

/// The size in bytes of a window's matrices on a software device.
const SOFTWARE_WINDOW: u64 = 8 << 20;

/// Bytes of a matrix.
const MATRIX: u64 = 48;

/// The shape of a crowd, and the tables of its library for the kernels.
pub(crate) struct CrowdTables {
    pub(crate) instances: u32,
    pub(crate) shape: CrowdShape,
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

impl CrowdTables {
    /// Copies the tables to the device.
    fn new(engine: &VulkanEngine, source: &CrowdSource<'_>) -> Result<Self, VulkanError> {
        // The list of links, followed by the first and the last index of each level.
        let mut links = source.links.to_vec();
        links.extend(source.levels.windows(2).map(|level| CrowdLink {
            joint: level[0],
            parent: level[1],
        }));
        let table = |name, bytes: &[u8]| {
            engine.check_size("a crowd's library", bytes)?;
            engine.resident(name, bytes, &mut Vec::new())
        };
        Ok(Self {
            instances: source.instances,
            shape: CrowdShape {
                levels: source.levels.to_vec(),
                forms: source.forms,
                arguments: source.arguments,
            },
            clips: table("tumble crowd clips", cast_slice(source.clips))?,
            bases: table("tumble crowd time bases", cast_slice(source.bases))?,
            spans: table("tumble crowd spans", cast_slice(source.spans))?,
            channels: table("tumble crowd channels", cast_slice(source.channels))?,
            cells: table("tumble crowd cells", cast_slice(source.cells))?,
            links: table("tumble crowd links", cast_slice(&links))?,
            bind: table("tumble crowd inverse bind", cast_slice(source.bind))?,
        })
    }
}

impl DeviceCrowd {
    fn new(engine: Arc<VulkanEngine>, tables: CrowdTables) -> Result<Self, VulkanError> {
        let device = &engine.device;
        let arguments = &tables.shape.arguments;
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
        self.tables.shape.bytes(output)
    }

    /// The number of instances of a window: their results fit the device's limits and the memory budget.
    pub(crate) fn window(&self) -> u32 {
        let shape = &self.tables.shape;
        let info = &self.engine.device.physical.info;
        let bytes = (shape.position_bytes()).max(MATRIX * u64::from(shape.arguments.joints));
        let range = info
            .max_storage_buffer_range
            .min(info.max_memory_allocation_size);
        let budget = self.engine.clip_bytes().map_or(range, |bytes| bytes as u64);
        let mut range = range.min(budget);
        if info.kind == DeviceKind::Cpu {
            // On software devices, windows are small, so that every kernel finds the window in the processor's cache.
            range = range.min(SOFTWARE_WINDOW);
        }
        // The kernels count vectors in 32 bits.
        let limit = (range / bytes).min(u64::from(u32::MAX / 4) / (bytes / 8));
        let all = u64::from(self.tables.instances).next_multiple_of(LEAST_WINDOW);
        (limit / LEAST_WINDOW * LEAST_WINDOW).clamp(LEAST_WINDOW, all) as u32
    }

    /// The kernels for a result.
    pub(crate) fn kernels(&self, output: CrowdOutput) -> FrameKernels {
        self.with_properties(|device| FrameKernels::new(&self.tables.shape, output, device))
    }

    /// The kernels of a stage.
    fn stage_kernels(&self, stage: CrowdStage) -> FrameKernels {
        self.with_properties(|device| FrameKernels::of_stage(&self.tables.shape, stage, device))
    }

    fn with_properties<T>(&self, choose: impl FnOnce(&CrowdDevice<'_>) -> T) -> T {
        choose(&CrowdDevice {
            maps_samples: self.engine.maps_samples,
            subgroup_lanes: self.engine.device.physical.subgroup_lanes,
            runs: &|kernel| self.engine.uses(kernel),
        })
    }
}

/// A range of an application's buffer for a crowd's results ([`Crowd::target`](crate::crowd::player::Crowd::target)),
/// or for a stage that continues them ([`Crowd::stage_target`](crate::crowd::player::Crowd::stage_target)), with all
/// resources for recording.
pub struct CrowdTarget {
    /// The crowd that the target was made for; its buffers are in the descriptor sets.
    pub(crate) crowd: Arc<DeviceCrowd>,
    output: CrowdOutput,
    /// The range of the result.
    pub(crate) range: Binding,
    /// The maximum number of instances.
    pub(crate) room: u32,
    evaluation: Evaluation,
    /// The recording of a frame, which the next frame fills again.
    work: Mutex<Recorded>,
    // The descriptor sets refer to these buffers. The caller guarantees that no work that uses them is in flight when
    // the target is dropped.
    _buffers: Vec<Buffer>,
}

/// The work that is recorded for a target.
enum Evaluation {
    /// Instances at the clock's time.
    Frames(Frames),
    /// Matrices that are in the range already.
    Stages(Stages),
}

impl CrowdTarget {
    /// Makes a target for a range that starts at `offset`, with room for `room` instances.
    pub(crate) fn new(
        crowd: &Arc<DeviceCrowd>,
        output: CrowdOutput,
        (buffer, offset): (vk::Buffer, u64),
        room: u32,
    ) -> Result<Self, VulkanError> {
        let (engine, tables) = (&crowd.engine, &crowd.tables);
        let shape = &tables.shape;
        let window = crowd.window();
        let kernels = crowd.kernels(output);
        let range = Binding::range(buffer, offset, u64::from(room) * crowd.bytes(output));
        let mut work = Recorded::new(&engine.device);
        let mut buffers = Vec::new();
        let mut new = |work: &mut Recorded, name, each: u64| {
            let size = u64::from(window) * each;
            let buffer = Buffer::new(&engine.device, name, size, Residence::Device)?;
            let resource = work.whole(&buffer);
            buffers.push(buffer);
            Ok::<_, VulkanError>(resource)
        };
        // If whole instances are evaluated, no memory for positions is needed.
        let position_bytes = match kernels.whole {
            Some(_) => 0,
            None => shape.position_bytes(),
        };
        let vectors = u64::from(shape.arguments.joints) * output.vector_count() as u64;
        let positions = new(&mut work, "tumble crowd places", position_bytes)?;
        let name = "tumble crowd gathered entries";
        let gathered = new(&mut work, name, shape.entry_bytes())?;
        let values = match output.is_half && kernels.whole.is_none() {
            true => Some(new(&mut work, "tumble crowd values", vectors * 16)?),
            false => None,
        };
        let resources = CrowdResources {
            clips: work.whole(&tables.clips),
            bases: work.whole(&tables.bases),
            spans: work.whole(&tables.spans),
            channels: work.whole(&tables.channels),
            cells: work.whole(&tables.cells),
            links: work.whole(&tables.links),
            bind: work.whole(&tables.bind),
            entries: work.whole(&crowd.entries),
            changes: work.whole(&crowd.changes),
            visible: work.whole(&crowd.visible),
            gathered,
            positions,
            values,
            result: work.resource(range),
        };
        let windows = [window, room];
        let recording = &mut work.recording;
        let frames = Frames::new(recording, shape.clone(), kernels, resources, windows);
        // Record once now, so that later frames need not allocate memory for their steps.
        frames.record(
            recording,
            &CrowdFrame {
                clock: 0,
                changes: EntryChanges::List(&[]),
                instances: room,
                visible: VisibleInstances::List(&[]),
            },
        );
        work.bind(|kernel| engine.pipeline(kernel))?;
        Ok(Self {
            crowd: Arc::clone(crowd),
            output,
            range,
            room,
            evaluation: Evaluation::Frames(frames),
            work: Mutex::new(work),
            _buffers: buffers,
        })
    }

    /// Makes a target for a stage of the matrices in a range that starts at `offset`, with room for `room` instances.
    pub(crate) fn of_stage(
        crowd: &Arc<DeviceCrowd>,
        stage: CrowdStage,
        (buffer, offset): (vk::Buffer, u64),
        room: u32,
    ) -> Result<Self, VulkanError> {
        let (engine, tables) = (&crowd.engine, &crowd.tables);
        let output = stage.output();
        let range = Binding::range(buffer, offset, u64::from(room) * crowd.bytes(output));
        let mut work = Recorded::new(&engine.device);
        let resources = StageResources {
            links: work.whole(&tables.links),
            bind: work.whole(&tables.bind),
            matrices: work.resource(range),
        };
        let (shape, kernels) = (tables.shape.clone(), crowd.stage_kernels(stage));
        let windows = [crowd.window(), room];
        let recording = &mut work.recording;
        let stages = Stages::new(recording, shape, kernels, &resources, windows);
        // Recorded once now, for the same reason as frames.
        stages.record(recording, room);
        work.bind(|kernel| engine.pipeline(kernel))?;
        Ok(Self {
            crowd: Arc::clone(crowd),
            output,
            range,
            room,
            evaluation: Evaluation::Stages(stages),
            work: Mutex::new(work),
            _buffers: Vec::new(),
        })
    }

    /// Whether it continues matrices that are in its range.
    pub(crate) fn is_of_stage(&self) -> bool {
        matches!(self.evaluation, Evaluation::Stages(_))
    }

    /// The length in bytes of the results that the target's range has room for: of the instances that are visible, or of
    /// more ([`Crowd::target`](crate::crowd::player::Crowd::target)).
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.range.size
    }

    /// The output that is written to the buffer.
    #[must_use]
    pub fn output(&self) -> CrowdOutput {
        self.output
    }

    /// Bytes of the result of a frame.
    fn frame_bytes(&self, frame: &CrowdFrame<'_>) -> u64 {
        u64::from(frame.instances) * self.crowd.bytes(self.output)
    }

    /// Records the evaluation of a frame that has at least one instance and at most `room`. Recorded frames must be
    /// submitted in the order of the calls.
    pub(crate) fn record(&self, commands: Commands<'_>, frame: &CrowdFrame<'_>) {
        let mut work = lock(&self.work);
        work.recording.clear_steps();
        match &self.evaluation {
            Evaluation::Frames(frames) => frames.record(&mut work.recording, frame),
            Evaluation::Stages(stages) => stages.record(&mut work.recording, frame.instances),
        }
        work.record(commands, &crowd::inputs(frame));
    }
}

/// A crowd on a device, and the evaluation that is in flight.
pub(crate) struct VulkanCrowd {
    pub(crate) device: Arc<DeviceCrowd>,
    /// The objects for evaluations whose result is read back, for the last requested output.
    reader: Option<CrowdReader>,
}

impl VulkanCrowd {
    pub(super) fn new(
        engine: Arc<VulkanEngine>,
        source: &CrowdSource<'_>,
    ) -> Result<Self, VulkanError> {
        let tables = CrowdTables::new(&engine, source)?;
        Ok(Self {
            device: Arc::new(DeviceCrowd::new(engine, tables)?),
            reader: None,
        })
    }

    /// The crowd, if it is on a Vulkan device.
    pub(crate) fn of(crowd: &dyn MachineCrowd) -> Option<&Self> {
        let crowd: &dyn Any = crowd;
        crowd.downcast_ref()
    }
}

impl MachineCrowd for VulkanCrowd {
    fn submit(&mut self, output: CrowdOutput, frame: &CrowdFrame<'_>) -> Result<(), VulkanError> {
        let kept = self.reader.take();
        let kept = kept.filter(|reader| reader.fits(output, frame.instances));
        let all = self.device.tables.instances;
        let room = frame.instances.next_power_of_two().min(all);
        let mut reader = kept.map_or_else(|| CrowdReader::new(&self.device, output, room), Ok)?;
        reader.submit(frame)?;
        self.reader = Some(reader);
        Ok(())
    }

    fn is_done(&self) -> Result<bool, VulkanError> {
        (self.reader.as_ref()).map_or(Ok(true), |reader| reader.results.is_done())
    }

    fn wait_into(&mut self, output: &mut [u8]) -> Result<bool, VulkanError> {
        let Some(mut reader) = self.reader.take() else {
            return Ok(false);
        };
        reader.wait_into(output)?;
        self.reader = Some(reader);
        Ok(true)
    }
}

/// A target whose result the host reads: it is in host-visible memory, and a submission does not wait.
struct CrowdReader {
    // Dropped first, because dropping it waits for the work that uses the other fields.
    results: KernelResults,
    target: CrowdTarget,
}

impl CrowdReader {
    /// Makes a reader with room for `room` instances.
    fn new(crowd: &Arc<DeviceCrowd>, output: CrowdOutput, room: u32) -> Result<Self, VulkanError> {
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

    /// Whether the reader is for this output and has room for `instances` instances.
    fn fits(&self, output: CrowdOutput, instances: u32) -> bool {
        self.target.output == output && self.target.room >= instances
    }

    /// Submits the evaluation of a frame; the previous one must have been waited for.
    fn submit(&mut self, frame: &CrowdFrame<'_>) -> Result<(), VulkanError> {
        let kernels = &mut self.results.kernels;
        kernels.begin()?;
        self.target.record(kernels.commands(), frame);
        let result = kernels.work.resource(self.target.range);
        kernels.work.recording.was_written(result);
        let size = self.target.frame_bytes(frame);
        self.results.submit(result, Some(size), None)
    }

    /// Waits, and copies the result to `output`, which has the same length.
    fn wait_into(&mut self, output: &mut [u8]) -> Result<(), VulkanError> {
        self.results.wait()?;
        output.copy_from_slice(self.results.bytes(0..output.len())?);
        Ok(())
    }
}

impl std::fmt::Debug for CrowdTarget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CrowdTarget")
            .field("output", &self.output)
            .field("bytes", &self.bytes())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use glam::{Affine3A, Quat};

    use super::*;
    use crate::crowd::library::CrowdLibrary;
    use crate::crowd::player::Crowd;
    use crate::device::Device;
    use crate::engine::Engine;
    use crate::machine::options::{EngineOptions, Mapping};
    use crate::method::slerp::SLERP;
    use crate::method::vector_method::VectorMethod;
    use crate::output::crowd::CrowdValues;
    use crate::pose::skeleton::Skeleton;
    use crate::shader::Kernel;
    use crate::tracks::set::TrackSet;

    /// A crowd whose skeleton has `joints` joints; with `has_many_bases`, each joint has its time base.
    fn crowd(mapping: Mapping, joints: usize, layers: usize, has_many_bases: bool) -> Vec<Crowd> {
        let skeleton = Skeleton::chain(joints, 1.0).unwrap();
        let mut library = CrowdLibrary::new(&skeleton).unwrap();
        let mut set = TrackSet::new();
        for joint in 0..joints {
            let first = if has_many_bases { joint as f64 } else { 0.0 };
            let keys = [0.0, 1.0].map(Quat::from_rotation_x);
            set.push("", &[first, first + 1.5], &keys).unwrap();
        }
        library.push(&set, SLERP, VectorMethod::Linear).unwrap();
        library
            .set_inverse_bind(&vec![Affine3A::IDENTITY; joints])
            .unwrap();
        let devices = Device::list().unwrap_or_default();
        let crowds = devices.into_iter().map(|device| {
            let options = EngineOptions {
                mapping,
                ..EngineOptions::default()
            };
            let engine = Engine::with_options(device, &options).unwrap();
            engine.crowd(&library, 1, layers).unwrap()
        });
        crowds.collect()
    }

    /// The kernels of an output, by their names.
    fn kernels(crowd: &Crowd, output: CrowdOutput) -> Vec<&'static str> {
        let on_device = VulkanCrowd::of(&**crowd.device.as_ref().unwrap()).unwrap();
        let kernels = on_device.device.kernels(output).kernels.into_iter();
        kernels
            .map(|kernel: Kernel| kernel.code(crate::shader::Variants::default()).0)
            .collect()
    }

    #[test]
    fn a_frame_of_small_instances_is_one_kernel_on_cards() {
        use CrowdValues::{Local, Model, Rotations, Skinning};
        for crowd in crowd(Mapping::Samples, 128, 1, false) {
            let on_device = VulkanCrowd::of(&**crowd.device.as_ref().unwrap()).unwrap();
            let lanes = on_device.device.engine.device.physical.subgroup_lanes;
            let by_subgroups = ["crowd_subgroup_rotations", "crowd_subgroup_rotations_f16"];
            for (output, by_subgroups) in [CrowdOutput::from, CrowdOutput::half]
                .map(|output| output(Rotations))
                .into_iter()
                .zip(by_subgroups)
            {
                let expected = match lanes.is_some() {
                    true => by_subgroups,
                    false => "crowd_plain_whole_rotations",
                };
                assert_eq!(kernels(&crowd, output), [expected]);
            }
            for output in [CrowdOutput::from, CrowdOutput::half] {
                for values in [Local, Model, Skinning] {
                    let matrices = ["crowd_plain_whole_matrices"];
                    assert_eq!(kernels(&crowd, output(values)), matrices);
                }
            }
        }
        for crowd in crowd(Mapping::Samples, 20, 2, false) {
            let found = kernels(&crowd, CrowdOutput::half(Skinning));
            assert_eq!(found, ["crowd_whole_matrices"]);
            let found = kernels(&crowd, Rotations.into());
            assert_eq!(found, ["crowd_whole_rotations"]);
        }
    }

    /// If a driver compiles the kernel wrongly, the kernel that uses workgroup memory is used instead, and the report
    /// says so.
    #[test]
    fn a_kernel_by_subgroups_that_differs_is_replaced() {
        use crate::gpu::pipeline::faults::MISCOMPILED;
        let rotations = CrowdValues::Rotations;
        for (kernel, name, output) in [
            (
                Kernel::CrowdSubgroupRotations,
                "crowd_subgroup_rotations",
                CrowdOutput::from(rotations),
            ),
            (
                Kernel::CrowdSubgroupRotationsF16,
                "crowd_subgroup_rotations_f16",
                CrowdOutput::half(rotations),
            ),
        ] {
            MISCOMPILED.set(Some(kernel));
            for mut crowd in crowd(Mapping::Samples, 128, 1, false) {
                let on_device = VulkanCrowd::of(&**crowd.device.as_ref().unwrap()).unwrap();
                let engine = Arc::clone(&on_device.device.engine);
                if engine.device.physical.subgroup_lanes.is_none() {
                    continue;
                }
                let of_workgroups = ["crowd_plain_whole_rotations"];
                assert_eq!(kernels(&crowd, output), of_workgroups);
                let known = engine.known_kernels();
                let replaced = Vec::from_iter(known.iter().filter(|check| check.replaced));
                let [check] = &replaced[..] else {
                    panic!("{replaced:?}");
                };
                assert_eq!(check.name.trim_end_matches("_converting"), name);
                assert!(check.differing > 0 && check.differing <= check.total);
                let cpu = Engine::new(Device::Cpu).unwrap();
                let mut on_cpu = cpu.crowd(crowd.library(), 1, 1).unwrap();
                if output.is_half {
                    let mut halves = vec![[0u16; 4]; crowd.output_len(output)];
                    let mut expected = halves.clone();
                    crowd.evaluate_half_into(rotations, &mut halves).unwrap();
                    (on_cpu.evaluate_half_into(rotations, &mut expected)).unwrap();
                    assert_eq!(halves, expected);
                } else {
                    let mut values = vec![[0.0; 4]; crowd.output_len(output)];
                    let mut expected = values.clone();
                    crowd.evaluate_into(rotations, &mut values).unwrap();
                    on_cpu.evaluate_into(rotations, &mut expected).unwrap();
                    assert_eq!(values, expected);
                }
            }
            MISCOMPILED.set(None);
        }
    }

    #[test]
    fn large_instances_and_software_devices_have_a_kernel_for_each_step() {
        use CrowdValues::{Rotations, Skinning};
        let skinning = CrowdOutput::half(Skinning);
        let steps = |walk| {
            let [times, locals] = ["crowd_times", "crowd_plain_locals"];
            [times, locals, walk, "crowd_skin", "crowd_half"]
        };
        for crowd in crowd(Mapping::Samples, 257, 1, false) {
            assert_eq!(kernels(&crowd, skinning), steps("crowd_walk"));
        }
        // Skeletons with as many time bases as joints.
        for crowd in crowd(Mapping::Samples, 33, 4, true) {
            let [times, _, walk, skin, half] = steps("crowd_walk_all");
            let found = kernels(&crowd, skinning);
            assert_eq!(found, [times, "crowd_locals", walk, skin, half]);
        }
        for crowd in crowd(Mapping::Runs, 20, 1, false) {
            assert_eq!(kernels(&crowd, skinning), steps("crowd_walk"));
            let rotations = ["crowd_times", "crowd_plain_rotations"];
            assert_eq!(kernels(&crowd, Rotations.into()), rotations);
        }
    }
}
