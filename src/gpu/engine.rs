//! Evaluation on a Vulkan device.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use glam::Quat;

use super::buffer::{Buffer, Residence};
use super::device::LogicalDevice;
use super::error::VulkanError;
use super::mapped::{FreeBuffers, MappedQuats};
use super::physical::{DeviceKind, PhysicalDevice};
use super::pipeline::{Clock, Exactness, KERNEL_BINDINGS, Pipeline, kernel};
use super::slot::{Finish, Slot, Stopwatch, Target};
use super::submission::{Access, Binding, Submission};
use super::work_list::work;
use crate::clock::{FramesError, Ticks, Timeline};
use crate::device::{EngineOptions, Timings, Transfer};
use crate::method::Form;
use crate::prepare::ClipData;
use crate::rotations::{Layout, Storage};
use crate::segment::shader::WORKGROUP;
use crate::segment::{Item, Launch};
use crate::window::Window;

const ROTATION: u64 = size_of::<[f32; 4]>() as u64;

/// Rotations of one window, unless limits or the budget say less: 32 MiB, which no
/// device takes near 100 ms to fill.
const WINDOW: u64 = 1 << 21;

/// Windows in flight: the host fills one while the device works on another.
const SLOTS: usize = 2;

/// A Vulkan device with its kernels.
pub(crate) struct VulkanEngine {
    device: Arc<LogicalDevice>,
    pipelines: [Pipeline; 4],
    slots: Mutex<Vec<Slot>>,
    /// Results are written in place, or copied out of the device's own memory.
    in_place: bool,
    /// Rotations of one window.
    window: usize,
    /// Bytes that the segments of one buffer may take.
    group_bytes: u64,
    /// Bytes that the segments of one clip may take; no limit unless one was asked.
    clip_bytes: Option<u64>,
    free: FreeBuffers,
    timings: Mutex<Timings>,
}

/// The segments and constants of a clip, on the device.
pub(crate) struct ClipBuffers {
    groups: Vec<GroupBuffers>,
}

struct GroupBuffers {
    segments: Buffer,
    constants: Buffer,
}

/// What may fail in an evaluation.
#[derive(Debug, thiserror::Error)]
pub(crate) enum EvaluateError {
    #[error(transparent)]
    Vulkan(#[from] VulkanError),
    #[error(transparent)]
    Frames(#[from] FramesError),
}

impl VulkanEngine {
    /// Opens a device and checks that it is exact.
    pub(crate) fn new(
        physical: PhysicalDevice,
        options: &EngineOptions,
    ) -> Result<Self, VulkanError> {
        let device = LogicalDevice::new(physical)?;
        Self::with_device(device, options)
    }

    pub(super) fn with_device(
        device: Arc<LogicalDevice>,
        options: &EngineOptions,
    ) -> Result<Self, VulkanError> {
        let info = &device.physical.info;
        let in_place = match options.transfer {
            Transfer::Automatic => {
                matches!(info.kind, DeviceKind::Integrated | DeviceKind::Cpu)
            }
            Transfer::InPlace => true,
            Transfer::Staged => false,
        };
        let largest = info
            .max_storage_buffer_range
            .min(info.max_memory_allocation_size);
        // A window may need as many items as it has rotations.
        let mut window = WINDOW.min(largest / size_of::<Item>() as u64 / 2);
        let mut group_bytes = largest;
        if let Some(budget) = options.memory {
            let each = size_of::<Item>() as u64 + 2 * ROTATION;
            window = window.min(budget / 2 / SLOTS as u64 / each);
            group_bytes = group_bytes.min(budget / 2);
        }
        // Windows start at aligned offsets where their length allows.
        let window = (window / 64 * 64).max(64) as usize;
        let pipeline = |form, clock| {
            Pipeline::new(
                &device,
                kernel(form, clock),
                KERNEL_BINDINGS,
                Exactness::Demanded,
            )
        };
        let pipelines = [
            pipeline(Form::Arc, Clock::Frames)?,
            pipeline(Form::Arc, Clock::Times)?,
            pipeline(Form::Polynomial, Clock::Frames)?,
            pipeline(Form::Polynomial, Clock::Times)?,
        ];
        Ok(Self {
            pipelines,
            slots: Mutex::default(),
            in_place,
            window,
            group_bytes,
            clip_bytes: options.memory.map(|budget| budget / 2),
            free: Arc::default(),
            timings: Mutex::default(),
            device,
        })
    }

    pub(super) fn device(&self) -> &Arc<LogicalDevice> {
        &self.device
    }

    /// Name, kind and limits of the device.
    pub(crate) fn info(&self) -> &super::DeviceInfo {
        &self.device.physical.info
    }

    /// Runs every canary.
    pub(crate) fn canaries(&self) -> Result<Vec<super::CanaryReport>, VulkanError> {
        super::canary::run(self)
    }

    /// Where the time went since this was last asked.
    pub(crate) fn take_timings(&self) -> Timings {
        std::mem::take(&mut *self.timings.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// What the validation layer has said so far.
    pub(crate) fn validation_messages(&self) -> Vec<String> {
        self.device.physical.instance.validation_messages()
    }

    /// Bytes of segments that go into one buffer.
    pub(crate) fn group_bytes(&self) -> usize {
        usize::try_from(self.group_bytes).unwrap_or(usize::MAX)
    }

    /// Bytes of segments that one clip may hold on the device.
    pub(crate) fn clip_bytes(&self) -> Option<usize> {
        self.clip_bytes
            .map(|bytes| usize::try_from(bytes).unwrap_or(usize::MAX))
    }

    /// Brings a clip's segments to the device.
    pub(crate) fn upload(&self, clip: &ClipData) -> Result<ClipBuffers, VulkanError> {
        let limit = self.device.physical.info.max_storage_buffer_range;
        let groups = clip
            .groups
            .iter()
            .map(|group| {
                let segments = group.segments.as_bytes();
                let constants = bytemuck::cast_slice(&group.constants);
                for (what, bytes) in [("segments", segments), ("keys", constants)] {
                    let bytes = bytes.len() as u64;
                    if bytes > limit {
                        return Err(VulkanError::TooLarge { what, bytes, limit });
                    }
                }
                Ok(GroupBuffers {
                    segments: self.resident("tumble segments", segments)?,
                    constants: self.resident("tumble constants", constants)?,
                })
            })
            .collect::<Result<_, _>>()?;
        Ok(ClipBuffers { groups })
    }

    /// A buffer with these bytes, in the memory that kernels read fastest.
    fn resident(&self, name: &str, bytes: &[u8]) -> Result<Buffer, VulkanError> {
        let size = bytes.len() as u64;
        let mut upload = Buffer::new(&self.device, name, size, Residence::Upload)?;
        upload.bytes_mut(0..bytes.len()).copy_from_slice(bytes);
        if self.in_place {
            return Ok(upload);
        }
        let resident = Buffer::new(&self.device, name, size, Residence::Device)?;
        let mut submission = Submission::new(&self.device)?;
        submission.begin(0)?;
        submission.copy(&upload, &resident, 0, upload.size());
        submission.barrier(Access::Copy, Access::Kernel);
        submission.submit()?;
        submission.wait()?;
        Ok(resident)
    }

    /// Evaluates into memory of the engine's choice: the device's own, mapped, where
    /// it writes in place and one allocation can hold the result.
    pub(crate) fn evaluate(
        &self,
        clip: &ClipData,
        buffers: &ClipBuffers,
        timeline: &Timeline,
        layout: Layout,
    ) -> Result<Box<dyn Storage>, EvaluateError> {
        let count = clip.track_count() * timeline.len();
        let bytes = count as u64 * ROTATION;
        if !self.in_place || bytes > self.device.physical.info.max_memory_allocation_size {
            let mut quats: Vec<Quat> = bytemuck::zeroed_vec(count);
            let whole = Window::whole(clip.track_count(), timeline.len(), layout);
            self.evaluate_into(clip, buffers, timeline, &whole, &mut quats)?;
            return Ok(Box::new(quats));
        }
        let mut buffer = self.output_buffer(bytes)?;
        let whole = Window::whole(clip.track_count(), timeline.len(), layout);
        self.run(clip, buffers, timeline, &whole, Target::Buffer(&mut buffer))?;
        Ok(Box::new(MappedQuats::new(buffer, count, &self.free)))
    }

    /// Evaluates a window into the caller's memory.
    pub(crate) fn evaluate_into(
        &self,
        clip: &ClipData,
        buffers: &ClipBuffers,
        timeline: &Timeline,
        window: &Window,
        output: &mut [Quat],
    ) -> Result<(), EvaluateError> {
        let output = Target::Slice(bytemuck::cast_slice_mut(output));
        self.run(clip, buffers, timeline, window, output)
    }

    /// A buffer that was given back, when one fits closely, else a new one.
    fn output_buffer(&self, bytes: u64) -> Result<Buffer, VulkanError> {
        let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let fits = |buffer: &Buffer| (bytes..=bytes.max(1 << 16) * 2).contains(&buffer.size());
        if let Some(i) = free.iter().position(fits) {
            return Ok(free.swap_remove(i));
        }
        drop(free);
        Buffer::new(&self.device, "tumble rotations", bytes, Residence::Readback)
    }

    fn run(
        &self,
        clip: &ClipData,
        buffers: &ClipBuffers,
        timeline: &Timeline,
        window: &Window,
        mut target: Target<'_>,
    ) -> Result<(), EvaluateError> {
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        let windows = window.cut(self.window);
        while slots.len() < SLOTS.min(windows.len()) {
            slots.push(Slot::new(&self.device)?);
        }
        let mut next = 0;
        let mut result = Ok(());
        let mut stopwatch = Stopwatch::default();
        for window in windows {
            next = (next + 1) % slots.len();
            let slot = &mut slots[next];
            result = slot
                .finish(&mut target, &mut stopwatch)
                .map_err(EvaluateError::from)
                .and_then(|()| {
                    let listing = Instant::now();
                    let started = self.start(slot, clip, buffers, timeline, window, &target);
                    stopwatch.timings.work_lists += listing.elapsed();
                    started
                });
            if result.is_err() {
                break;
            }
        }
        // Also after an error: what was submitted uses the caller's buffers.
        let oldest_first = slots.len();
        for i in 1..=oldest_first {
            let finished = slots[(next + i) % oldest_first].finish(&mut target, &mut stopwatch);
            result = result.and(finished.map_err(EvaluateError::from));
        }
        *self.timings.lock().unwrap_or_else(PoisonError::into_inner) += stopwatch.timings;
        result
    }

    /// Submits one window.
    fn start(
        &self,
        slot: &mut Slot,
        clip: &ClipData,
        buffers: &ClipBuffers,
        timeline: &Timeline,
        window: Window,
        target: &Target<'_>,
    ) -> Result<(), EvaluateError> {
        let alignment = self
            .device
            .physical
            .info
            .min_storage_buffer_offset_alignment
            .max(1);
        let start = match target {
            Target::Buffer(_) => window.start as u64 * ROTATION,
            Target::Slice(_) => 0,
        };
        let aligned = start / alignment * alignment;
        let shift = (start - aligned) / ROTATION;
        let size = (window.len() as u64 + shift) * ROTATION;
        let mut lists = work(clip, timeline, &window, shift as u32)?;
        slot.write(&self.device, &lists)?;

        let staged_items = !self.in_place;
        if staged_items {
            Slot::grow(
                &self.device,
                &mut slot.device_items,
                slot.items.size(),
                Residence::Device,
            )?;
            let size = slot.distances.size();
            Slot::grow(
                &self.device,
                &mut slot.device_distances,
                size,
                Residence::Device,
            )?;
        }
        if matches!(target, Target::Slice(_)) {
            let residence = if self.in_place {
                Residence::Readback
            } else {
                Residence::Device
            };
            Slot::grow(&self.device, &mut slot.rotations, size, residence)?;
            if !self.in_place {
                Slot::grow(&self.device, &mut slot.readback, size, Residence::Readback)?;
            }
        }
        slot.submission.begin(lists.len() as u32)?;
        let (mut items, mut distances) = (&slot.items, &slot.distances);
        if let (Some(own_items), Some(own_distances)) = (&slot.device_items, &slot.device_distances)
        {
            slot.submission.copy(items, own_items, 0, items.size());
            slot.submission
                .copy(distances, own_distances, 0, distances.size());
            slot.submission.barrier(Access::Copy, Access::Kernel);
            (items, distances) = (own_items, own_distances);
        }
        let rotations = match (target, &slot.rotations) {
            (Target::Buffer(buffer), _) => Binding {
                buffer,
                offset: aligned,
                size,
            },
            (Target::Slice(_), Some(buffer)) => Binding {
                buffer,
                offset: 0,
                size,
            },
            (Target::Slice(_), None) => unreachable!("grown above"),
        };
        let pipeline = self.pipeline(clip.interpolation.method.form, timeline);
        let mut first_item = 0;
        for list in &lists {
            let item_count = list.item_count() as u32;
            if item_count == 0 {
                continue;
            }
            let group = &buffers.groups[list.group];
            let bindings = [
                Binding::whole(&group.segments),
                Binding::whole(&group.constants),
                Binding::whole(items),
                Binding::whole(distances),
                rotations,
            ];
            let launch = Launch {
                first_item,
                item_count,
                stride: window.stride() as u32,
            };
            let groups = self.workgroups(item_count);
            slot.submission
                .dispatch(pipeline, &bindings, bytemuck::bytes_of(&launch), groups)?;
            first_item += item_count;
        }
        if let (Some(rotations), Some(readback)) = (&slot.rotations, &slot.readback)
            && matches!(target, Target::Slice(_))
        {
            slot.submission.barrier(Access::Kernel, Access::Copy);
            slot.submission.copy(rotations, readback, 0, size);
            slot.submission.barrier(Access::Copy, Access::Host);
        } else {
            slot.submission.barrier(Access::Kernel, Access::Host);
        }
        slot.submission.submit()?;
        let chunks = lists.iter_mut().flat_map(|list| &mut list.chunks);
        let patches = chunks
            .flat_map(|chunk| std::mem::take(&mut chunk.patches))
            .collect();
        slot.done = Some(Finish { window, patches });
        Ok(())
    }

    fn pipeline(&self, form: Form, timeline: &Timeline) -> &Pipeline {
        let times = matches!(timeline.ticks, Ticks::Times { .. });
        let form = match form {
            Form::Arc => 0,
            Form::Polynomial => 2,
        };
        &self.pipelines[form + usize::from(times)]
    }

    /// Enough workgroups for `items`, within the limit along x.
    fn workgroups(&self, items: u32) -> [u32; 2] {
        let groups = items.div_ceil(WORKGROUP);
        let x = groups.min(self.device.physical.info.max_compute_work_group_count[0]);
        [x, groups.div_ceil(x)]
    }
}
