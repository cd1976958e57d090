//! Evaluation on a Vulkan device.

use std::mem::take;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use glam::Quat;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::{Lane, LogicalDevice};
use crate::gpu::error::{EvaluateError, VulkanError};
use crate::gpu::from_keys::KeyUploads;
use crate::gpu::in_flight::{InFlight, Target, copy};
use crate::gpu::kernel_check::passes::{Pass, Passes};
use crate::gpu::kernel_check::{self, KernelCheck};
use crate::gpu::memory_types::KernelReads;
use crate::gpu::options::{EngineOptions, Timings, Transfer};
use crate::gpu::pipeline::{Exactness, Pipeline};
use crate::gpu::submission::{Access, Submission};
use crate::gpu::turns::Turns;
use crate::gpu::upload::writable;
use crate::gpu::work_list::WorkLists;
use crate::output::buffer::OutputBuffer;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Storage};
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::shader::{Item, KERNELS, Kernel, KernelCode, List};
use crate::time::frames::Timeline;

/// Rotations of one window, 32 MiB, unless the device's limits, the memory budget or the device's
/// speed demand fewer.
const WINDOW: u64 = 1 << 21;

/// Rotations down to which windows are halved when memory is short or the device slow: 1 MiB.
const SMALLEST_WINDOW: usize = 1 << 16;

/// Windows in flight: the host fills one while the device works on another.
const IN_FLIGHT: usize = 2;

/// The same where a second queue copies: one is filled, one evaluated, and one on its way back.
const IN_FLIGHT_WITH_COPIES: usize = 3;

/// A Vulkan device with its kernels.
pub(crate) struct VulkanEngine {
    pub(crate) device: Arc<LogicalDevice>,
    /// Made when they are first needed.
    pipelines: Mutex<[Option<Arc<Pipeline>>; KERNELS.len()]>,
    pub(crate) in_flight: Turns<Vec<InFlight<WorkLists>>>,
    pub(crate) keys_in_flight: Turns<Vec<InFlight<KeyUploads>>>,
    pub(crate) in_flight_count: usize,
    /// Whether neighbouring invocations take neighbouring samples; else each takes a run of them.
    pub(crate) maps_samples: bool,
    /// Whether the caller's memory is imported where the device can.
    pub(crate) imports: bool,
    /// Rotations of one window.
    pub(crate) window: AtomicUsize,
    /// Bytes that the segments of one buffer may take.
    pub(crate) group_bytes: usize,
    /// Bytes that the segments of one clip may take on the device; `None` without a memory budget.
    pub(crate) clip_bytes: Option<usize>,
    /// Whether kernels that differ from the CPU are used all the same.
    allow_inexact: bool,
    free: FreeBuffers,
    pub(crate) timings: Mutex<Timings>,
}

/// Locks what a thread that panicked cannot have left half changed.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The segments and constants of a clip, on the device.
pub(crate) struct ClipBuffers {
    device: Arc<LogicalDevice>,
    /// The segments of each group, and its constants.
    pub(crate) groups: Vec<(Buffer, Buffer)>,
}

/// What is to be evaluated, and how stored.
#[derive(Clone, Copy)]
pub(crate) struct Job<'a> {
    pub(crate) clip: &'a ClipData,
    pub(crate) buffers: &'a Arc<ClipBuffers>,
    pub(crate) timeline: &'a Timeline,
    pub(crate) encoding: Encoding,
}

impl Job<'_> {
    /// All of the result.
    pub(crate) fn whole(&self, layout: Layout) -> Window {
        Window::whole(self.clip.track_count(), self.timeline.len(), layout)
    }
}

impl VulkanEngine {
    /// An engine on a device that is open, whose exactness is still to be tested.
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
        // Windows start at aligned offsets where their length allows.
        let window = (window / 64 * 64).max(64) as usize;
        let bytes = |bytes| usize::try_from(bytes).unwrap_or(usize::MAX);
        Self {
            pipelines: Mutex::new([const { None }; KERNELS.len()]),
            in_flight: Turns::default(),
            keys_in_flight: Turns::default(),
            in_flight_count,
            maps_samples: device.physical.maps_samples(options.mapping),
            imports: options.transfer == Transfer::Automatic,
            window: AtomicUsize::new(window),
            group_bytes: bytes(half.map_or(largest, |half| half.min(largest))),
            clip_bytes: half.map(bytes),
            allow_inexact: options.allow_inexact,
            free: Arc::default(),
            timings: Mutex::default(),
            device,
        }
    }

    /// The kinds of lists that its kernels over segments work on. What binds more storage buffers than the
    /// device can is left out.
    pub(crate) fn lists(&self) -> Vec<List> {
        let mut all = vec![List::Samples, List::Frames];
        let has_room = self.device.reads_texels || self.device.physical.storage_buffers > 4;
        all.extend(has_room.then_some(List::Times));
        if self.maps_samples {
            all.extend([List::FramesCoalesced, List::TimesCoalesced]);
        }
        all
    }

    /// The pipeline of a kernel, made when it is first needed, and checked then unless this kernel is known to be
    /// exact on this device.
    pub(crate) fn pipeline(&self, kernel: Kernel) -> Result<Arc<Pipeline>, VulkanError> {
        let kept = || lock(&self.pipelines)[kernel as usize].clone();
        if let Some(pipeline) = kept() {
            return Ok(pipeline);
        }
        // Drivers take up to seconds for it. Nobody who wants another waits meanwhile; of several callers
        // who make this one, the first one's is kept.
        let made = Arc::new(Pipeline::new(&self.device, kernel, Exactness::Demanded)?);
        self.trust(kernel, &made)?;
        let mut all = lock(&self.pipelines);
        Ok(Arc::clone(all[kernel as usize].get_or_insert(made)))
    }

    /// Refuses a kernel that differs from the CPU, unless inexact devices are allowed.
    fn trust(&self, kernel: Kernel, pipeline: &Pipeline) -> Result<(), VulkanError> {
        let passes = Passes::of_user();
        let pass = Pass::new(&self.device.physical, pipeline.code_hash);
        if passes.has(&pass) {
            return Ok(());
        }
        let check = kernel_check::check(kernel, pipeline)?;
        if check.differing == 0 {
            passes.remember([pass]);
        } else if !self.allow_inexact {
            return Err(VulkanError::InexactKernel {
                device: self.device.physical.info.name.clone(),
                kernel: check.name,
                differing: check.differing,
                total: check.total,
            });
        }
        Ok(())
    }

    /// Checks every kernel, while `each` returns true; with `only_unknown` those alone that are not known to
    /// pass.
    pub(crate) fn check_kernels(
        &self,
        only_unknown: bool,
        each: &mut dyn FnMut(KernelCheck) -> bool,
    ) -> Result<(), VulkanError> {
        let (passes, physical) = (Passes::of_user(), &self.device.physical);
        let mut passed = Vec::new();
        let mut check = |code: &KernelCode| {
            let pass = Pass::new(physical, Pipeline::code_hash(&self.device, code.kernel));
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
        for code in self.bindable() {
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

    /// What is known of each kernel.
    pub(crate) fn known_kernels(&self) -> Vec<KernelCheck> {
        self.bindable()
            .map(|code| self.known_kernel(code))
            .collect()
    }

    /// The kernels that the device may be given: those that bind no more storage buffers than it allows.
    pub(crate) fn bindable(&self) -> impl Iterator<Item = &'static KernelCode> {
        let limit = self.device.physical.storage_buffers;
        let needed = |code: &KernelCode| Pipeline::storage_buffers(&self.device, code.kernel);
        KERNELS.iter().filter(move |code| needed(code) <= limit)
    }

    fn known_kernel(&self, code: &KernelCode) -> KernelCheck {
        let (name, ..) = code.kernel.code(self.device.reads_texels);
        let hash = Pipeline::code_hash(&self.device, code.kernel);
        KernelCheck {
            name,
            total: 0,
            differing: 0,
            remembered: Passes::of_user().has(&Pass::new(&self.device.physical, hash)),
        }
    }

    /// Copies a clip's segments to the device. The buffers of `spare`, which are no longer needed,
    /// are used again where they are large enough.
    pub(crate) fn upload(
        &self,
        clip: &ClipData,
        spare: Option<ClipBuffers>,
    ) -> Result<ClipBuffers, VulkanError> {
        // Under a memory budget the old buffers are freed before new ones are allocated.
        let spare = spare.filter(|old| self.clip_bytes.is_none() && self.holds(old));
        let spare = spare.into_iter().flat_map(|buffers| buffers.groups);
        let (mut segments_of, mut constants_of): (Vec<Buffer>, Vec<Buffer>) = spare.unzip();
        let groups = clip
            .groups
            .iter()
            .map(|group| {
                let segments = group.segments.as_bytes();
                let constants = bytemuck::cast_slice(&group.constants);
                self.check_size("segments", segments)?;
                self.check_size("keys", constants)?;
                Ok((
                    self.resident("tumble segments", segments, &mut segments_of)?,
                    self.resident("tumble constants", constants, &mut constants_of)?,
                ))
            })
            .collect::<Result<_, _>>()?;
        let device = Arc::clone(&self.device);
        Ok(ClipBuffers { device, groups })
    }

    /// Refuses what is longer than a kernel can bind.
    pub(crate) fn check_size(&self, what: &'static str, bytes: &[u8]) -> Result<(), VulkanError> {
        (self.device.physical).check_range(what, bytes.len() as u64)
    }

    /// Whether buffers belong to this device; those from before it was opened again do not.
    pub(crate) fn holds(&self, buffers: &ClipBuffers) -> bool {
        Arc::ptr_eq(&self.device, &buffers.device)
    }

    pub(crate) fn window(&self) -> usize {
        self.window.load(Ordering::Relaxed)
    }

    /// Halves the size of later windows; false when it is at its minimum already.
    pub(crate) fn halve_windows(&self) -> bool {
        let half = self.window() / 2;
        let smaller = half >= SMALLEST_WINDOW;
        if smaller {
            self.window.store(half, Ordering::Relaxed);
        }
        smaller
    }

    /// Frees the buffers that are kept for the next evaluation and not in use by another; false when
    /// there are none.
    pub(crate) fn give_back(&self) -> bool {
        let in_flight = self.in_flight.idle().map_or(0, |kept| kept.len());
        let keys_in_flight = self.keys_in_flight.idle().map_or(0, |kept| kept.len());
        let free = take(&mut *lock(&self.free)).len();
        in_flight + keys_in_flight + free > 0
    }

    /// A buffer with these bytes, in the memory that kernels read fastest.
    pub(crate) fn resident(
        &self,
        name: &str,
        bytes: &[u8],
        spare: &mut Vec<Buffer>,
    ) -> Result<Buffer, VulkanError> {
        let size = bytes.len() as u64;
        // Of spare ones the host writes those that kernels have read in place.
        let fits = |buffer: &Buffer| buffer.is_mapped() && buffer.size >= size;
        let (mut upload, is_staged) = match spare.iter().position(fits) {
            Some(place) => (spare.swap_remove(place), false),
            None => writable(&self.device, name, size, KernelReads::Often)?,
        };
        copy(upload.bytes_mut(0..bytes.len()), bytes);
        if !is_staged {
            return Ok(upload);
        }
        let resident = Buffer::new(&self.device, name, size, Residence::Device)?;
        let mut submission = Submission::new(&self.device, Lane::Kernels)?;
        submission.begin(0)?;
        (submission.commands()).copy(&upload, &resident, upload.size);
        (submission.commands()).barrier(Access::Copy, Access::Kernel);
        submission.submit()?;
        submission.wait()?;
        Ok(resident)
    }

    /// Evaluates in f32 into memory of the engine's choice: the device's own, mapped, where
    /// it writes in place and one allocation can hold the result.
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
        let buffer = match self.device.placing.in_place && fits {
            true => match self.output_buffer(bytes) {
                // Window by window the result may still be made.
                Err(error) if error.is_out_of_memory() => None,
                // The host changes some rotations (`patches`). Where it must show that, it would show
                // with them what lies beside, into which the device may be writing the next window.
                Ok(buffer) if !buffer.is_coherent() => None,
                buffer => Some(buffer?),
            },
            false => None,
        };
        let Some(mut buffer) = buffer else {
            let mut quats = OutputBuffer::new(whole.len())?;
            self.evaluate_into(job, &whole, bytemuck::cast_slice_mut(&mut quats))?;
            return Ok(Box::new(quats));
        };
        self.run(job, &whole, Target::Buffer(&mut buffer))?;
        Ok(Box::new(MappedQuats {
            buffer: Some(buffer),
            count: whole.len(),
            free: Arc::clone(&self.free),
        }))
    }

    /// Evaluates a window into the caller's memory.
    pub(crate) fn evaluate_into(
        &self,
        job: Job<'_>,
        window: &Window,
        output: &mut [u8],
    ) -> Result<(), EvaluateError> {
        let each = job.encoding.bytes();
        let target = Target::of(&self.device, self.imports, output, each);
        self.run(job, window, target)
    }

    /// A buffer that was given back, when one fits closely, else a new one.
    fn output_buffer(&self, bytes: u64) -> Result<Buffer, VulkanError> {
        let mut free = lock(&self.free);
        let fits = |buffer: &Buffer| (bytes..=bytes.max(1 << 16) * 2).contains(&buffer.size);
        if let Some(i) = free.iter().position(fits) {
            return Ok(free.swap_remove(i));
        }
        drop(free);
        Buffer::new(&self.device, "tumble rotations", bytes, Residence::InPlace)
    }
}

/// Output buffers of dropped results, to use again: the first touch of fresh memory costs more
/// than evaluating.
type FreeBuffers = Arc<Mutex<Vec<Buffer>>>;

/// A result in mapped memory. When it is dropped, the buffer goes back to its engine.
struct MappedQuats {
    /// There until it is dropped.
    buffer: Option<Buffer>,
    count: usize,
    free: FreeBuffers,
}

impl Storage for MappedQuats {
    fn quats(&self) -> &[Quat] {
        let all = 0..self.count * size_of::<Quat>();
        let bytes = self.buffer.as_ref().map(|buffer| buffer.bytes(all));
        bytemuck::cast_slice(bytes.unwrap_or_default())
    }
}

/// The most output buffers that are kept for later evaluations.
const KEPT: usize = 4;

impl Drop for MappedQuats {
    fn drop(&mut self) {
        let mut free = lock(&self.free);
        if free.len() == KEPT {
            free.remove(0);
        }
        free.extend(self.buffer.take());
    }
}
