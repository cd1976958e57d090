//! The clips of a motion library on a Vulkan device: their tables, which stay there, and the states of instances, which
//! kernels evaluate from them into memory of the device.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{cast_slice, cast_slice_mut};

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::QueueLane;
use crate::gpu::engine::{FreeBuffer, VulkanEngine};
use crate::gpu::external::{Exported, ExportedResult};
use crate::gpu::in_flight::grow;
use crate::gpu::physical::DeviceKind;
use crate::gpu::physical::upload_memory::KernelReads;
use crate::gpu::recorded::{Binding, Recorded};
use crate::gpu::submission::Submission;
use crate::gpu::upload::Upload;
use crate::machine::error::{EvaluateError, VulkanError};
use crate::output::states::StoredArray;
use crate::shader::{
    CrowdBase, CrowdChannel, CrowdClip, CrowdLink, CrowdSpan, MotionSample, TreeFrame,
};
use crate::threads::exclusive::Exclusive;
use crate::threads::stop;
use crate::work::motion::{StatesResources, StatesShape, TreeResources, record_window};

/// Windows begin at multiples of this number of instances, so that their arrays begin at offsets at which kernels can
/// bind them.
const LEAST_WINDOW: u64 = 64;

/// The size of a window's states: on a software device they stay in the processor's cache.
const WINDOW: u64 = 64 << 20;
const SOFTWARE_WINDOW: u64 = 4 << 20;

/// The name of the tables in messages.
const SUBJECT: &str = "a motion library";

/// The tables of a motion library.
pub(crate) struct MotionSource<'a> {
    pub(crate) clips: &'a [CrowdClip],
    pub(crate) bases: &'a [CrowdBase],
    pub(crate) spans: &'a [CrowdSpan],
    pub(crate) channels: &'a [CrowdChannel],
    pub(crate) cells: &'a [[f32; 4]],
    pub(crate) links: &'a [CrowdLink],
    pub(crate) joints: u32,
    pub(crate) ticks_per_second: u32,
    pub(crate) tree: Option<TreeSource<'a>>,
}

/// The tables of a robot's tree.
pub(crate) struct TreeSource<'a> {
    pub(crate) frames: &'a [TreeFrame],
    /// The words of the states that arrays have.
    pub(crate) picks: &'a [u32],
}

/// The instances whose states are computed. Every clip exists.
pub(crate) struct StatesRequest<'a> {
    pub(crate) at: &'a [MotionSample],
    pub(crate) steps: Option<StateSteps>,
    pub(crate) arrays: &'a [StoredArray],
}

/// The samples between which velocities are differences, of each instance.
pub(crate) struct StateSteps {
    pub(crate) ends: [Vec<MotionSample>; 2],
    /// Steps of this length in a second.
    pub(crate) rates: Vec<f32>,
}

/// The tables on a device.
pub(crate) struct ResidentMotions {
    // Dropped first: it waits for its work before the tables are freed.
    work: Exclusive<Option<Box<StatesWork>>>,
    engine: Arc<VulkanEngine>,
    clips: Buffer,
    bases: Buffer,
    spans: Buffer,
    channels: Buffer,
    cells: Buffer,
    links: Buffer,
    tree: Option<ResidentTree>,
    bytes: u64,
    joints: u32,
    link_count: u32,
    ticks_per_second: f32,
}

/// The tables of a robot's tree on a device.
struct ResidentTree {
    frames: Buffer,
    picks: Buffer,
    frame_count: u32,
}

/// The memory of work, which is kept for the next call.
struct StatesWork {
    // Dropped first: it waits for its work before the buffers are freed.
    submission: Submission,
    samples: Upload,
    rates: Upload,
    states: Option<Buffer>,
    /// The states of frames of a robot's tree.
    frames: Option<Buffer>,
    /// The result, before it is copied to memory that the host reads.
    output: Option<Buffer>,
}

/// The memory of a result.
#[derive(Clone, Copy)]
enum StatesTarget<'a> {
    /// Memory that others import.
    Exported(&'a Exported),
    /// Memory that the host reads, and kernels write.
    InPlace(&'a Buffer),
    /// Memory that the host reads, into which the result is copied.
    Copied(&'a Buffer),
}

/// States of instances in memory that the host reads. On a device that shares the host's memory, kernels have written
/// them there; from other devices they were copied.
pub struct MappedStates {
    memory: FreeBuffer,
    bytes: usize,
}

impl MappedStates {
    /// The arrays, at the ranges that were returned with them.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.memory.bytes(0..self.bytes)
    }
}

impl std::fmt::Debug for MappedStates {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MappedStates")
            .field("bytes", &self.bytes)
            .finish_non_exhaustive()
    }
}

impl ResidentMotions {
    /// Copies tables to a device. It refuses tables that are larger than its memory.
    pub(crate) fn new(
        engine: Arc<VulkanEngine>,
        source: &MotionSource<'_>,
    ) -> Result<Self, VulkanError> {
        let tables: [&[u8]; 6] = [
            cast_slice(source.clips),
            cast_slice(source.bases),
            cast_slice(source.spans),
            cast_slice(source.channels),
            cast_slice(source.cells),
            cast_slice(source.links),
        ];
        let of_tree: [&[u8]; 2] = source.tree.as_ref().map_or([&[]; 2], |tree| {
            [cast_slice(tree.frames), cast_slice(tree.picks)]
        });
        let all = tables.iter().chain(&of_tree);
        let bytes = all.map(|table| table.len() as u64).sum();
        let (subject, limit) = (SUBJECT, engine.device.physical.info.device_local_memory);
        if bytes > limit {
            return Err(VulkanError::TooLarge {
                subject,
                bytes,
                limit,
            });
        }
        if let Some(budget) = engine
            .budget
            .filter(|_| engine.clip_bytes().is_some_and(|room| bytes > room as u64))
        {
            return Err(VulkanError::OverBudget {
                subject,
                bytes,
                budget,
            });
        }
        let table = |bytes: &[u8]| {
            engine.check_size(SUBJECT, bytes)?;
            engine.resident("tumble motion library", bytes, &mut Vec::new())
        };
        let tree = |tree: &TreeSource<'_>| {
            let [frames, picks] = of_tree.map(table);
            Ok::<_, VulkanError>(ResidentTree {
                frames: frames?,
                picks: picks?,
                frame_count: tree.frames.len() as u32,
            })
        };
        let tree = source.tree.as_ref().map(tree).transpose()?;
        let [clips, bases, spans, channels, cells, links] = tables.map(table);
        Ok(Self {
            work: Exclusive::default(),
            clips: clips?,
            bases: bases?,
            spans: spans?,
            channels: channels?,
            cells: cells?,
            links: links?,
            tree,
            bytes,
            joints: source.joints,
            link_count: source.links.len() as u32,
            ticks_per_second: source.ticks_per_second as f32,
            engine,
        })
    }

    /// Bytes of the tables.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Joints of the skeleton, or tracks of a robot.
    pub(crate) fn joints(&self) -> u32 {
        self.joints
    }

    /// The name of the device.
    pub(crate) fn device_name(&self) -> &str {
        &self.engine.device.physical.info.name
    }

    /// Computes states into memory that other interfaces on the same card import, and the ranges of the arrays. If they
    /// can wait for the device, this returns while it is still writing.
    pub(crate) fn export(
        &self,
        request: &StatesRequest<'_>,
    ) -> Result<(ExportedResult, Vec<Range<u64>>), EvaluateError> {
        self.engine.device.check_process()?;
        let ranges = StoredArray::ranges(request.arrays, request.at.len());
        let bytes = ranges.last().map_or(0, |range| range.end);
        let exported = self.engine.exported(bytes)?;
        self.run(request, &ranges, StatesTarget::Exported(&exported))?;
        Ok((ExportedResult::new(exported, bytes), ranges))
    }

    /// Computes states into memory that the host reads, and the ranges of the arrays.
    pub(crate) fn evaluate(
        &self,
        request: &StatesRequest<'_>,
    ) -> Result<(MappedStates, Vec<Range<u64>>), EvaluateError> {
        self.engine.device.check_process()?;
        let ranges = StoredArray::ranges(request.arrays, request.at.len());
        let bytes = ranges.last().map_or(0, |range| range.end);
        let is_in_place = self.engine.device.placing.in_place;
        let residence = match is_in_place {
            true => Residence::InPlace,
            false => Residence::Readback,
        };
        let memory = self.engine.free_buffer(bytes, residence)?;
        let target = match is_in_place {
            true => StatesTarget::InPlace(&memory),
            false => StatesTarget::Copied(&memory),
        };
        self.run(request, &ranges, target)?;
        let bytes = bytes as usize;
        Ok((MappedStates { memory, bytes }, ranges))
    }

    /// The number of instances of a window.
    fn window(&self, shape: &StatesShape<'_>) -> Result<usize, VulkanError> {
        let physical = &self.engine.device.physical;
        let largest =
            (physical.info.max_storage_buffer_range).min(physical.info.max_memory_allocation_size);
        let limit = match physical.info.kind {
            DeviceKind::Cpu => SOFTWARE_WINDOW,
            _ => WINDOW,
        };
        let [of_joints, of_frames] = shape.state_bytes();
        let each = of_joints.max(of_frames);
        physical.check_range("the states of a motion library", LEAST_WINDOW * each)?;
        let window = limit.min(largest) / each / LEAST_WINDOW * LEAST_WINDOW;
        Ok(window.max(LEAST_WINDOW) as usize)
    }

    fn run(
        &self,
        request: &StatesRequest<'_>,
        ranges: &[Range<u64>],
        target: StatesTarget<'_>,
    ) -> Result<(), EvaluateError> {
        let device = &self.engine.device;
        if request.at.is_empty() || request.arrays.is_empty() {
            return Ok(());
        }
        let mut kept = self.work.take();
        let mut work = match kept.take() {
            Some(work) => work,
            None => Box::new(StatesWork {
                submission: Submission::new(device, QueueLane::Kernels)?,
                samples: Upload::default(),
                rates: Upload::default(),
                states: None,
                frames: None,
                output: None,
            }),
        };
        // The last call may have returned while the device still worked on its exported result.
        work.submission.wait()?;
        self.run_windows(&mut work, request, ranges, target)?;
        // After an error the work is dropped, because its recording may be incomplete.
        *kept = Some(work);
        Ok(())
    }

    fn run_windows(
        &self,
        work: &mut StatesWork,
        request: &StatesRequest<'_>,
        ranges: &[Range<u64>],
        target: StatesTarget<'_>,
    ) -> Result<(), EvaluateError> {
        let shape = StatesShape {
            joints: self.joints,
            links: self.link_count,
            frames: self.tree.as_ref().map_or(0, |tree| tree.frame_count),
            ticks_per_second: self.ticks_per_second,
            arrays: request.arrays,
            are_differences: request.steps.is_some(),
            instances: request.at.len(),
        };
        let count = request.at.len();
        let window = self.window(&shape)?;
        let bytes = ranges.last().map_or(0, |range| range.end);
        self.upload(work, request, window)?;
        let device = &self.engine.device;
        let states = (shape.state_bytes()).map(|each| window.min(count) as u64 * each);
        grow(device, &mut work.states, states[0], Residence::Device)?;
        if self.tree.is_some() {
            grow(device, &mut work.frames, states[1], Residence::Device)?;
        }
        if matches!(target, StatesTarget::Copied(_)) {
            grow(device, &mut work.output, bytes, Residence::Results)?;
        }
        for first in (0..count).step_by(window) {
            stop::check()?;
            let last = count.min(first + window);
            self.submit(work, (&shape, ranges), first..last, target)?;
            let is_waited_for = match target {
                // The readers of an exported result wait for its semaphore, so the last window need not be waited for
                // here. The windows before it must be, because the next one reuses their buffers.
                StatesTarget::Exported(exported) => last < count || !exported.has_timeline(),
                StatesTarget::InPlace(_) | StatesTarget::Copied(_) => true,
            };
            if is_waited_for {
                work.submission.wait()?;
            }
        }
        match target {
            StatesTarget::Exported(_) => {}
            StatesTarget::InPlace(host) | StatesTarget::Copied(host) => {
                host.invalidate(&(0..bytes as usize))?;
            }
        }
        Ok(())
    }

    /// Writes the clips and ticks of all instances for the device, window by window.
    fn upload(
        &self,
        work: &mut StatesWork,
        request: &StatesRequest<'_>,
        window: usize,
    ) -> Result<(), VulkanError> {
        let device = &self.engine.device;
        let (reads, count) = (KernelReads::Often, request.at.len());
        let lists: Vec<&[MotionSample]> = match &request.steps {
            Some(steps) => vec![request.at, &steps.ends[0], &steps.ends[1]],
            None => vec![request.at],
        };
        let bytes = lists.len() * size_of_val(request.at);
        let name = "tumble motion samples";
        let mut room: &mut [MotionSample] =
            cast_slice_mut(work.samples.room(device, name, reads, bytes)?);
        for first in (0..count).step_by(window) {
            for list in &lists {
                let part = &list[first..count.min(first + window)];
                let (written, rest) = room.split_at_mut(part.len());
                written.copy_from_slice(part);
                room = rest;
            }
        }
        let rates = (request.steps.as_ref()).map_or(&[0.0][..], |steps| &steps.rates);
        let name = "tumble motion rates";
        let room = work.rates.room(device, name, reads, size_of_val(rates))?;
        room.copy_from_slice(cast_slice(rates));
        Ok(())
    }

    /// Submits a window of instances. After the last window, the commands make the result visible to its readers.
    fn submit(
        &self,
        work: &mut StatesWork,
        (shape, ranges): (&StatesShape<'_>, &[Range<u64>]),
        window: Range<usize>,
        target: StatesTarget<'_>,
    ) -> Result<(), VulkanError> {
        let StatesWork {
            submission,
            samples,
            rates,
            states,
            frames,
            output,
        } = work;
        submission.begin()?;
        let recorded = &mut submission.work;
        let uploaded = |upload: &Upload, recorded: &mut Recorded| match window.start {
            0 => upload.copied_in(recorded),
            _ => upload.resource_of(recorded),
        };
        let written = match target {
            StatesTarget::Exported(exported) => Some(&exported.buffer),
            StatesTarget::InPlace(host) => Some(host),
            StatesTarget::Copied(_) => output.as_ref(),
        };
        let (samples, rates) = (uploaded(samples, recorded), uploaded(rates, recorded));
        let (Some(samples), Some(rates), Some(states), Some(written)) =
            (samples, rates, states.as_ref(), written)
        else {
            return Ok(()); // cannot happen: `run_windows` made them
        };
        let bytes = ranges.last().map_or(0, |range| range.end);
        let result = recorded.resource(Binding::range(written.raw, 0, bytes));
        let resources = StatesResources {
            clips: recorded.whole(&self.clips),
            bases: recorded.whole(&self.bases),
            spans: recorded.whole(&self.spans),
            channels: recorded.whole(&self.channels),
            cells: recorded.whole(&self.cells),
            links: recorded.whole(&self.links),
            samples,
            rates,
            states: recorded.whole(states),
            tree: match (&self.tree, frames) {
                (Some(tree), Some(states)) => Some(TreeResources {
                    frames: recorded.whole(&tree.frames),
                    picks: recorded.whole(&tree.picks),
                    states: recorded.whole(states),
                }),
                _ => None,
            },
            result,
        };
        let instances = window.start as u32..window.end as u32;
        let recording = &mut recorded.recording;
        record_window(recording, shape, &resources, instances, ranges);
        let is_last = window.end == shape.instances;
        let mut point = None;
        match target {
            StatesTarget::InPlace(_) => recording.read_by_host(result),
            StatesTarget::Exported(exported) if is_last => {
                recording.publish();
                recording.release(result.into());
                point = exported.next_point();
            }
            StatesTarget::Copied(host) if is_last => {
                let host = recorded.resource(Binding::range(host.raw, 0, bytes));
                recorded.recording.copy(result, host);
                recorded.recording.read_by_host(host);
            }
            StatesTarget::Exported(_) | StatesTarget::Copied(_) => recording.publish(),
        }
        recorded.bind(|kernel| self.engine.pipeline(kernel))?;
        submission.submit_between(None, point)?;
        if let StatesTarget::Exported(exported) = target {
            exported.has_submitted(point);
        }
        Ok(())
    }
}
