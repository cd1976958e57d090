//! Evaluation on a Vulkan device.

mod arcs;
#[cfg(feature = "lab")]
pub(crate) mod figures;
pub(crate) mod from_keys;
pub(crate) mod run;

use std::mem::{ManuallyDrop, take};
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use ash::vk;
use glam::Quat;
use tumble_exact::FloatControls;

use crate::cpu::engine::CpuEngine;
use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::{DeviceQueue, LogicalDevice, QueueLane};
use crate::gpu::engine::from_keys::KeyUploads;
use crate::gpu::external::Exported;
use crate::gpu::handles::VulkanHandles;
use crate::gpu::in_flight::{InFlight, Target};
use crate::gpu::instance::Instance;
use crate::gpu::job::{ClipBuffers, Job, WorkLists};
use crate::gpu::kernel_check::passes::KernelPass;
use crate::gpu::kernel_check::{self, KernelCheck};
use crate::gpu::physical::upload_memory::KernelReads;
use crate::gpu::physical::{PhysicalDevice, shapes};
use crate::gpu::pipeline::{Exactness, Pipeline};
use crate::gpu::pipeline_cache::PipelineCache;
use crate::gpu::submission::Submission;
use crate::gpu::upload::writable;
use crate::machine::error::calls::Named as _;
use crate::machine::error::{EvaluateError, VulkanError};
use crate::machine::options::{EngineOptions, RunLanes, Timings, Transfer};
use crate::memory::OutOfMemoryError;
use crate::output::buffer::OutputBuffer;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Storage};
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::shader::{Item, KERNELS, Kernel, KernelCode, List};
use crate::simd::dispatch::VectorWidth;
use crate::threads::exclusive::Exclusive;
use crate::threads::{copy, lock};
use crate::work::lists::ListRequest;

/// The number of rotations of one window, 32 MiB, unless the device's limits, the memory budget or the device's speed
/// require fewer.
const WINDOW: u64 = 1 << 21;

/// The minimum number of rotations of a window, 1 MiB; windows are halved down to it if memory is short or the device
/// slow.
const SMALLEST_WINDOW: usize = 1 << 16;

/// The number of windows in flight: the host fills one while the device evaluates another.
const IN_FLIGHT: usize = 2;

/// The number of windows in flight if a second queue copies: one is filled, one evaluated, and one copied back.
const IN_FLIGHT_WITH_COPIES: usize = 3;

/// A Vulkan device with its kernels.
pub(crate) struct VulkanEngine {
    pub(crate) device: Arc<LogicalDevice>,
    /// Pipelines, which are made when they are first needed.
    pipelines: Mutex<[Option<Arc<Pipeline>>; KERNELS.len()]>,
    /// Kernels that differ from the CPU; other kernels are used in their place.
    replaced: Mutex<Vec<KernelCheck>>,
    pub(crate) in_flight: Exclusive<Vec<InFlight<WorkLists>>>,
    pub(crate) keys_in_flight: Exclusive<Vec<InFlight<KeyUploads>>>,
    pub(crate) in_flight_count: usize,
    /// Whether neighbouring invocations evaluate neighbouring samples; otherwise each evaluates a run of samples.
    pub(crate) maps_samples: bool,
    /// The number of invocations that evaluate a run together.
    pub(crate) run_lanes: RunLanes,
    /// The number of keys from which on the arcs between them are prepared on the device.
    pub(crate) prepares_arcs_from: usize,
    /// Whether the caller's memory is imported if the device can.
    pub(crate) imports: bool,
    /// Rotations of one window.
    pub(crate) window: AtomicUsize,
    /// Bytes that the segments of one buffer may take.
    pub(crate) group_bytes: usize,
    /// The memory budget in bytes.
    pub(crate) budget: Option<u64>,
    /// Whether kernels that differ from the CPU are used nevertheless.
    allow_inexact: bool,
    free: FreeBuffers,
    /// The CPU, for the host's part of the work.
    pub(super) host: CpuEngine,
    pub(crate) timings: Mutex<Timings>,
}

impl VulkanEngine {
    /// Bytes that the segments of one clip may take on the device, half of the budget; `None` without a memory budget.
    pub(crate) fn clip_bytes(&self) -> Option<usize> {
        let half = self.budget.map(|budget| budget / 2);
        half.map(|bytes| usize::try_from(bytes).unwrap_or(usize::MAX))
    }

    /// Makes an engine on an open device, whose exactness was not tested yet.
    pub(crate) fn new(device: Arc<LogicalDevice>, options: &EngineOptions) -> Self {
        let info = &device.physical.info;
        let in_flight_count = match device.copies_apart {
            true => IN_FLIGHT_WITH_COPIES,
            false => IN_FLIGHT,
        };
        let largest = info
            .max_storage_buffer_range
            .min(info.max_memory_allocation_size);
        // A window may need as many items as it has rotations.
        let mut window = WINDOW.min(largest / size_of::<Item>() as u64 / 2);
        let half = options.memory.map(|budget| budget / 2);
        if let Some(half) = half {
            let each = (size_of::<Item>() + 2 * Encoding::F32.bytes()) as u64;
            window = window.min(half / in_flight_count as u64 / each);
        }
        // Window lengths are multiples of 64 if possible, so that windows start at aligned offsets.
        let window = (window / 64 * 64).max(64) as usize;
        let bytes = |bytes| usize::try_from(bytes).unwrap_or(usize::MAX);
        Self {
            pipelines: Mutex::new([const { None }; KERNELS.len()]),
            replaced: Mutex::default(),
            in_flight: Exclusive::default(),
            keys_in_flight: Exclusive::default(),
            in_flight_count,
            maps_samples: device.physical.maps_samples(options.mapping),
            run_lanes: options
                .run_lanes
                .unwrap_or_else(|| shapes::run_lanes(info.vendor_id)),
            prepares_arcs_from: arcs::prepared_from(options.prepare_arcs, info.kind),
            imports: options.transfer == Transfer::Automatic,
            window: AtomicUsize::new(window),
            group_bytes: bytes(half.map_or(largest, |half| half.min(largest))),
            budget: options.memory,
            allow_inexact: options.allow_inexact,
            free: Arc::default(),
            host: CpuEngine::on_shared_threads(VectorWidth::widest()),
            timings: Mutex::default(),
            device,
        }
    }

    /// Makes an engine on an application's device.
    ///
    /// # Safety
    /// As [`Engine::from_vulkan`](crate::engine::Engine::from_vulkan).
    pub(crate) unsafe fn from_handles(
        handles: VulkanHandles,
        options: &EngineOptions,
    ) -> Result<Self, VulkanError> {
        use vk::QueueFlags as Flags;
        let version = handles.check()?;
        let instance = Instance::borrowed(handles.entry, handles.instance);
        // SAFETY: the instance is valid, as the caller promises.
        let known = unsafe { instance.raw.enumerate_physical_devices() };
        let known = known.named("vkEnumeratePhysicalDevices")?;
        if !known.contains(&handles.physical_device) {
            let count = known.len();
            return Err(VulkanError::OtherPhysicalDevice { count });
        }
        let mut physical = PhysicalDevice::new(&instance, handles.physical_device)?
            .ok_or(VulkanError::NoDevice)?;
        physical.queue_family = handles.queue_family;
        physical.check_family(handles.queue_family, Flags::COMPUTE, "compute")?;
        if let Some(copies) = &handles.copy_queue {
            // A queue that computes or draws can copy.
            let can_copy = Flags::TRANSFER | Flags::COMPUTE | Flags::GRAPHICS;
            physical.check_family(copies.family, can_copy, "copy")?;
            if copies.queue == handles.queue {
                return Err(VulkanError::SameQueue);
            }
        }
        if version < vk::API_VERSION_1_2 && !handles.shader_float_controls {
            // The application may not have enabled the float controls of the device, so none are used.
            physical.float_controls = FloatControls::default();
        }
        physical.has_int64 &= handles.shader_int64;
        physical.converts_halves = false; // the application enabled what it needs
        let pipelines = match handles.pipeline_cache {
            Some(cache) => PipelineCache::of_application(cache, &physical),
            None => PipelineCache::new(&handles.device, &physical, &options.cache_files),
        };
        let device = LogicalDevice::with_queues(
            physical,
            handles.device,
            DeviceQueue::new(handles.queue, handles.queue_family, handles.queue_lock),
            handles.copy_queue,
            pipelines,
            options,
        );
        Ok(Self::new(Arc::new(device), options))
    }

    /// The kinds of lists that the engine's kernels over segments can use. Kinds that bind more storage buffers than
    /// the device allows are left out.
    pub(crate) fn lists(&self) -> Vec<List> {
        let mut all = vec![List::Samples, List::Frames];
        let has_room = self.device.reads_texels || self.device.physical.storage_buffers > 4;
        all.extend(has_room.then_some(List::Times));
        if self.maps_samples {
            all.extend([List::FramesSpread, List::TimesSpread]);
            all.extend([List::FramesCoalesced, List::TimesCoalesced]);
        }
        all
    }

    /// The pipeline of a kernel. It is made when it is first needed, and checked then, unless this kernel is known to
    /// be exact on this device.
    pub(crate) fn pipeline(&self, kernel: Kernel) -> Result<Arc<Pipeline>, VulkanError> {
        let kept = || lock(&self.pipelines)[kernel as usize].clone();
        if let Some(pipeline) = kept() {
            return Ok(pipeline);
        }
        // Created outside the lock, because drivers take up to seconds. If several callers create this pipeline, the
        // first one is kept.
        let made = Arc::new(Pipeline::new(&self.device, kernel, Exactness::Demanded)?);
        self.trust(kernel, &made)?;
        let mut all = lock(&self.pipelines);
        Ok(Arc::clone(all[kernel as usize].get_or_insert(made)))
    }

    /// Refuses a kernel that differs from the CPU, unless inexact devices are allowed.
    fn trust(&self, kernel: Kernel, pipeline: &Pipeline) -> Result<(), VulkanError> {
        match self.difference(kernel, pipeline)? {
            Some(check) if !self.allow_inexact => Err(VulkanError::InexactKernel {
                device: self.device.physical.info.name.clone(),
                kernel: check.name,
                differing: check.differing,
                total: check.total,
            }),
            _ => Ok(()),
        }
    }

    /// The check of a kernel that differs from the CPU; `None` if it does not. The check is not run if the kernel is
    /// known to pass.
    fn difference(
        &self,
        kernel: Kernel,
        pipeline: &Pipeline,
    ) -> Result<Option<KernelCheck>, VulkanError> {
        let passes = &self.device.passes;
        let pass = KernelPass::new(&self.device.physical, pipeline.code_hash);
        if passes.has(&pass) {
            return Ok(None);
        }
        let check = kernel_check::check(kernel, pipeline)?;
        if check.differing > 0 {
            return Ok(Some(check));
        }
        passes.remember([pass]);
        Ok(None)
    }

    /// Whether the engine uses a kernel that other kernels can replace: it does if the device runs it and gives the
    /// CPU's bits. A kernel that differs is refused here even if inexact devices are allowed, because the others need
    /// not differ; it is listed as [`replaced`](KernelCheck::replaced). Other errors are left to the first use of the
    /// kernel.
    pub(crate) fn uses(&self, kernel: Kernel) -> bool {
        if !Pipeline::can_run(&self.device, kernel) {
            return false;
        }
        let name = kernel.code(self.device.variants()).0;
        let is_replaced = |check: &KernelCheck| check.name == name;
        if !kernel.is_replaceable() || lock(&self.pipelines)[kernel as usize].is_some() {
            return true;
        }
        if lock(&self.replaced).iter().any(is_replaced) {
            return false;
        }
        let Ok(made) = Pipeline::new(&self.device, kernel, Exactness::Demanded) else {
            return true;
        };
        match self.difference(kernel, &made) {
            Ok(Some(check)) => {
                let mut replaced = lock(&self.replaced);
                if !replaced.iter().any(is_replaced) {
                    replaced.push(check);
                }
                false
            }
            Ok(None) => {
                lock(&self.pipelines)[kernel as usize].get_or_insert(Arc::new(made));
                true
            }
            Err(_) => true,
        }
    }

    /// Checks every kernel, while `each` returns true; with `only_unknown`, the kernels that are known to pass are
    /// not run.
    pub(crate) fn check_kernels(
        &self,
        only_unknown: bool,
        each: &mut dyn FnMut(KernelCheck) -> bool,
    ) -> Result<(), VulkanError> {
        let (passes, physical) = (&self.device.passes, &self.device.physical);
        let mut passed = Vec::new();
        let mut check = |code: &KernelCode| {
            let pass = KernelPass::new(physical, Pipeline::code_hash(&self.device, code.kernel));
            if only_unknown && passes.has(&pass) {
                return Ok(self.known_kernel(code));
            }
            let kept = lock(&self.pipelines)[code.kernel as usize].clone();
            let pipeline = match kept {
                Some(pipeline) => pipeline,
                None => {
                    let (device, kernel) = (&self.device, code.kernel);
                    Arc::new(Pipeline::new(device, kernel, Exactness::Demanded)?)
                }
            };
            let check = kernel_check::check(code.kernel, &pipeline)?;
            if check.differing == 0 {
                passed.push(pass);
                lock(&self.pipelines)[code.kernel as usize].get_or_insert(pipeline);
            }
            Ok(check)
        };
        let mut outcome = Ok(());
        for code in self.runnable() {
            let goes_on = match check(code) {
                Ok(check) => each(check),
                Err(error) => {
                    outcome = Err(error);
                    false
                }
            };
            if !goes_on {
                break;
            }
        }
        passes.remember(passed);
        outcome
    }

    /// The known results of the kernels' checks.
    pub(crate) fn known_kernels(&self) -> Vec<KernelCheck> {
        self.runnable()
            .map(|code| self.known_kernel(code))
            .collect()
    }

    /// The kernels that this device can run.
    pub(crate) fn runnable(&self) -> impl Iterator<Item = &'static KernelCode> {
        let kernels = KERNELS.iter();
        kernels.filter(|code| Pipeline::can_run(&self.device, code.kernel))
    }

    fn known_kernel(&self, code: &KernelCode) -> KernelCheck {
        let (name, ..) = code.kernel.code(self.device.variants());
        let mut replaced = lock(&self.replaced).clone().into_iter();
        if let Some(check) = replaced.find(|check| check.name == name) {
            return check;
        }
        let hash = Pipeline::code_hash(&self.device, code.kernel);
        KernelCheck {
            name,
            total: 0,
            differing: 0,
            replaced: false,
            remembered: self
                .device
                .passes
                .has(&KernelPass::new(&self.device.physical, hash)),
        }
    }

    /// Copies a clip's segments to the device, or prepares them there. The buffers of `spare`, which are no longer
    /// needed, are reused if they are large enough.
    pub(crate) fn upload(
        &self,
        clip: &ClipData,
        spare: Option<ClipBuffers>,
    ) -> Result<ClipBuffers, VulkanError> {
        // With a memory limit, the old buffers are freed before new ones are allocated.
        let spare = spare.filter(|old| self.budget.is_none() && self.owns(old));
        let spare = spare.into_iter().flat_map(|buffers| buffers.groups);
        let (mut segments_of, mut constants_of): (Vec<Buffer>, Vec<Buffer>) = spare.unzip();
        let groups = clip
            .groups
            .iter()
            .map(|group| {
                let constants = bytemuck::cast_slice(&group.constants);
                let segment_bytes = group.segments.bytes_on_device() as u64;
                (self.device.physical).check_range("segments", segment_bytes)?;
                self.check_size("keys", constants)?;
                let segments = match group.segments.are_arcs_listed {
                    true => self.room_for_arcs(segment_bytes, &mut segments_of)?,
                    false => {
                        let segments = group.segments.as_bytes();
                        self.resident("tumble segments", segments, &mut segments_of)?
                    }
                };
                let constants = self.resident("tumble constants", constants, &mut constants_of)?;
                Ok((segments, constants))
            })
            .collect::<Result<Vec<_>, VulkanError>>()?;
        self.prepare_arcs(clip, &groups)?;
        let device = Arc::clone(&self.device);
        Ok(ClipBuffers { device, groups })
    }

    /// The request for the work lists of a job.
    pub(crate) fn list_request<'a>(&'a self, job: Job<'a>) -> ListRequest<'a> {
        ListRequest {
            maps_samples: self.maps_samples,
            run_lanes: self.run_lanes,
            clip: job.clip,
            timeline: job.timeline,
        }
    }

    /// Refuses a buffer that is longer than a kernel can bind.
    pub(crate) fn check_size(
        &self,
        subject: &'static str,
        bytes: &[u8],
    ) -> Result<(), VulkanError> {
        (self.device.physical).check_range(subject, bytes.len() as u64)
    }

    /// Whether buffers belong to this device; those from before it was opened again do not.
    pub(crate) fn owns(&self, buffers: &ClipBuffers) -> bool {
        Arc::ptr_eq(&self.device, &buffers.device)
    }

    pub(crate) fn window(&self) -> usize {
        self.window.load(Ordering::Relaxed)
    }

    /// Halves the size of later windows; false if it is at its minimum already.
    pub(crate) fn halve_windows(&self) -> bool {
        let half = self.window() / 2;
        let smaller = half >= SMALLEST_WINDOW;
        if smaller {
            self.window.store(half, Ordering::Relaxed);
        }
        smaller
    }

    /// Frees the buffers that are kept for the next evaluation and that no other evaluation uses; false if there are
    /// none.
    pub(crate) fn give_back(&self) -> bool {
        let in_flight = self.in_flight.idle().map_or(0, |kept| kept.len());
        let keys_in_flight = self.keys_in_flight.idle().map_or(0, |kept| kept.len());
        let free = take(&mut *lock(&self.free)).len();
        in_flight + keys_in_flight + free > 0
    }

    /// Makes a buffer with these bytes, in the memory that kernels read fastest.
    pub(crate) fn resident(
        &self,
        name: &str,
        bytes: &[u8],
        spare: &mut Vec<Buffer>,
    ) -> Result<Buffer, VulkanError> {
        let size = bytes.len() as u64;
        // The host can write a spare buffer in place if it is mapped and large enough.
        let fits = |buffer: &Buffer| buffer.is_mapped() && buffer.size >= size;
        let (mut upload, is_staged) = match spare.iter().position(fits) {
            Some(index) => (spare.swap_remove(index), false),
            None => writable(&self.device, name, size, KernelReads::Often)?,
        };
        copy(upload.bytes_mut(0..bytes.len()), bytes);
        if !is_staged {
            return Ok(upload);
        }
        let resident = Buffer::new(&self.device, name, size, Residence::Device)?;
        let mut submission = Submission::new(&self.device, QueueLane::Kernels)?;
        submission.begin()?;
        let work = &mut submission.work;
        let [from, to] = [&upload, &resident].map(|buffer| work.whole(buffer));
        work.recording.copy(from, to);
        work.recording.publish();
        submission.run()?;
        Ok(resident)
    }

    /// Evaluates in f32 into memory of the engine's choice. This is mapped device memory, if the device writes in
    /// place and one allocation can contain the result. When the same request is repeated on a card, it is memory
    /// that the card's copies write directly.
    pub(crate) fn evaluate(
        &self,
        job: Job<'_>,
        layout: Layout,
    ) -> Result<Box<dyn Storage>, EvaluateError> {
        let encoding = Encoding::F32;
        let job = Job { encoding, ..job };
        let whole = job.whole(layout);
        let bytes = (whole.len() * encoding.bytes()) as u64;
        let fits = bytes <= self.device.physical.info.max_memory_allocation_size;
        let in_place = self.device.placing.in_place;
        // Allocating memory into which a card can copy takes long, so this is done only for requests that are repeated.
        let kept = self.kept(job, &whole)?;
        let pays = in_place || kept.is_some();
        let residence = match in_place {
            true => Residence::InPlace,
            false => Residence::Readback,
        };
        let buffer = match fits && pays {
            true => match self.free_buffer(bytes, residence) {
                // The result may still fit if it is computed window by window.
                Err(error) if error.is_out_of_memory() => None,
                // The host changes some rotations (`patches`). In memory that is not coherent it would have to flush
                // whole atoms, and could overwrite rotations of the next window, which the device may be writing.
                Ok(buffer) if !buffer.is_coherent() => None,
                buffer => Some(buffer?),
            },
            false => None,
        };
        let Some(mut buffer) = buffer else {
            let mut quats = OutputBuffer::new(whole.len())?;
            let output = bytemuck::cast_slice_mut(&mut quats);
            let target = Target::of(&self.device, self.imports, output, encoding.bytes());
            self.run(job, &whole, target, kept.as_deref())?;
            return Ok(Box::new(quats));
        };
        let target = match in_place {
            true => Target::Buffer(&mut buffer),
            false => Target::Staged(&mut buffer),
        };
        self.run(job, &whole, target, kept.as_deref())?;
        let count = whole.len();
        Ok(Box::new(MappedQuats { buffer, count }))
    }

    /// Evaluates a window into the caller's memory.
    pub(crate) fn evaluate_into(
        &self,
        job: Job<'_>,
        window: &Window,
        output: &mut [u8],
    ) -> Result<(), EvaluateError> {
        let each = job.encoding.bytes();
        let kept = self.kept(job, window)?;
        let target = Target::of(&self.device, self.imports, output, each);
        self.run(job, window, target, kept.as_deref())
    }

    /// A buffer for a result that the host reads: a free one of about this size, if there is one, else a new one.
    pub(crate) fn free_buffer(
        &self,
        bytes: u64,
        residence: Residence,
    ) -> Result<FreeBuffer, VulkanError> {
        let mut free = lock(&self.free);
        let fits = |buffer: &Buffer| (bytes..=bytes.max(1 << 16) * 2).contains(&buffer.size);
        let kept = free.iter().position(fits).map(|i| free.swap_remove(i));
        drop(free);
        let made = || Buffer::new(&self.device, "tumble rotations", bytes, residence);
        Ok(FreeBuffer {
            buffer: ManuallyDrop::new(kept.map_or_else(made, Ok)?),
            free: Arc::clone(&self.free),
        })
    }

    /// Memory for a result of this size that other interfaces import.
    pub(crate) fn exported(&self, bytes: u64) -> Result<Arc<Exported>, EvaluateError> {
        // The result is allocated as a whole, so smaller windows would not help.
        let exported = match Exported::new(&self.device, bytes) {
            Err(error) if error.is_out_of_memory() && self.give_back() => {
                Exported::new(&self.device, bytes)
            }
            made => made,
        };
        let exported = exported.map_err(|error| match error.is_out_of_memory() {
            true => {
                let needed = usize::try_from(bytes).unwrap_or(usize::MAX);
                OutOfMemoryError::new::<u8>("a result in the device's memory", needed).into()
            }
            false => EvaluateError::from(error),
        });
        Ok(Arc::new(exported?))
    }
}

/// Output buffers of dropped results, for reuse: the first access to fresh memory takes longer than evaluating.
type FreeBuffers = Arc<Mutex<Vec<Buffer>>>;

/// A mapped buffer for a result. When it is dropped, the buffer returns to the engine.
pub(crate) struct FreeBuffer {
    buffer: ManuallyDrop<Buffer>,
    free: FreeBuffers,
}

impl Deref for FreeBuffer {
    type Target = Buffer;

    fn deref(&self) -> &Buffer {
        &self.buffer
    }
}

impl DerefMut for FreeBuffer {
    fn deref_mut(&mut self) -> &mut Buffer {
        &mut self.buffer
    }
}

/// The maximum number of output buffers that are kept for later evaluations.
const KEPT: usize = 4;

impl Drop for FreeBuffer {
    fn drop(&mut self) {
        let mut free = lock(&self.free);
        if free.len() == KEPT {
            free.remove(0);
        }
        // SAFETY: it is taken once, here, and not used afterwards.
        free.push(unsafe { ManuallyDrop::take(&mut self.buffer) });
    }
}

/// A result in mapped memory.
struct MappedQuats {
    buffer: FreeBuffer,
    count: usize,
}

impl Storage for MappedQuats {
    fn quats(&self) -> &[Quat] {
        let all = 0..self.count * size_of::<Quat>();
        bytemuck::cast_slice(self.buffer.bytes(all))
    }
}
