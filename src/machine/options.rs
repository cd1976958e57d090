//! Options of an engine, and the times of its evaluations.

use std::ops::AddAssign;
use std::path::PathBuf;
use std::time::Duration;

use crate::names::fields::with_fields;
use crate::simd::dispatch::VectorWidth;

/// How results of a Vulkan device reach the host's memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Transfer {
    /// `InPlace` if the device shares the host's memory, otherwise `Staged`. Software devices write directly into the
    /// caller's memory if possible.
    #[default]
    Automatic,
    /// The kernel writes into memory that the host can read.
    InPlace,
    /// The kernel writes into the device's memory, and results are copied to the host.
    Staged,
}

/// On which queue of a Vulkan device results are copied to the host, if they are copied ([`Transfer::Staged`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum ReadBack {
    /// [`ReadBack::Overlapped`] on cards that have a second queue, otherwise and on software devices
    /// [`ReadBack::SameQueue`].
    #[default]
    Automatic,
    /// In the submission of the kernels, after them.
    SameQueue,
    /// In a separate submission, which waits for the kernels on a timeline semaphore. It uses a second queue, so that
    /// the next kernels run beside the copy, or the same queue if there is no other. Devices without timeline
    /// semaphores use [`ReadBack::SameQueue`].
    Overlapped,
}

/// How keys, segments and work lists are transferred to a Vulkan device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Uploads {
    /// [`Uploads::Direct`] if the memory that is device-local and host-visible is as large as the device's memory
    /// (resizable BAR, integrated devices), or if the upload is at most a 64th of that memory. Otherwise as results
    /// ([`Transfer`]): read in place or staged.
    #[default]
    Automatic,
    /// The host writes into device-local memory, if some of it is host-visible and has room; otherwise as
    /// `Automatic`.
    Direct,
    /// The host writes into host memory, from which the device copies.
    Staged,
}

/// How kernels of a Vulkan device read keys, segments and work lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Reads {
    /// Texel buffers on software devices that support them, otherwise storage buffers.
    #[default]
    Automatic,
    /// Storage buffers.
    StorageBuffers,
    /// Texel buffers, and stores of 64 bits, on devices with 64-bit integers and with texel buffers as long as their
    /// largest allocation; otherwise storage buffers.
    TexelBuffers,
}

/// How the samples of a result are distributed to the invocations of a kernel on a Vulkan device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Mapping {
    /// [`Mapping::Samples`] on graphics cards and integrated devices, [`Mapping::Runs`] on software
    /// devices.
    #[default]
    Automatic,
    /// Each invocation evaluates up to 16 consecutive samples of one segment, whose constants it loads once. This is
    /// fastest on devices that execute their lanes one after another.
    Runs,
    /// Neighbouring invocations evaluate neighbouring samples. The lanes that a card executes together write whole
    /// cache lines and read shared constants from one address.
    Samples,
}

/// Where the arcs of [`SLERP`](crate::method::SLERP) are prepared for a Vulkan device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum PrepareArcs {
    /// On a discrete card for many keys, otherwise on the host.
    #[default]
    Automatic,
    /// On the host, which uploads keys and arcs.
    OnHost,
    /// On the device, to which keys and 4 bytes for each arc are uploaded. Arcs between keys whose signs are
    /// [as authored](crate::KeySigns::AsAuthored) are always prepared on the host.
    OnDevice,
}

/// The folder in which an engine keeps files for later processes, because their data takes time to make. They contain
/// the driver's compiled kernels (`pipelines-…`), the kernels that passed their check (`kernel-checks`), and the speed
/// of each model of card (`probe-…`, for [`Engine::auto`](crate::engine::Engine::auto)). An engine reads and writes no
/// other files.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum CacheFiles {
    /// In the directory that the environment variable `TUMBLE_CACHE_DIR` names; if it is empty, nowhere. Without the
    /// variable, in `tumble` in the user's cache directory: `XDG_CACHE_HOME` or `~/.cache`, `~/Library/Caches` on
    /// macOS, `LOCALAPPDATA` on Windows.
    #[default]
    OfUser,
    /// In this directory, which is created when something is written.
    Within(PathBuf),
    /// Nowhere: no file is read or written. Each process compiles and checks the kernels that it uses.
    Off,
}

/// Options of an [`Engine`](crate::engine::Engine). None of them changes any bit of a result.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct EngineOptions {
    /// The limit of memory in bytes: on a Vulkan device for everything except results, on the CPU for the segments of a
    /// set. By default there is none. Larger sets are prepared piece by piece.
    pub memory: Option<u64>,
    /// The limit, in bytes, for the segments of a clip on the CPU. A clip with larger segments keeps its keys instead, if
    /// its samples can be computed from them; keys take an eighth of the memory or less. By default only `memory` is the
    /// limit, because segments are faster for many samples. A program with many clips in memory sets a limit such as 1 MiB.
    pub kept_segments: Option<u64>,
    /// The number of worker threads of the CPU. By default all engines of the process share a pool of as many threads
    /// as the environment variable `RAYON_NUM_THREADS` says, or one for each core.
    pub thread_count: Option<usize>,
    /// The widest vector instructions that the CPU uses; by default [`VectorWidth::widest`].
    pub vector_width: Option<VectorWidth>,
    /// Whether the CPU uses non-temporal stores, which bypass the caches. They apply to rotations in f32, track by
    /// track, in memory that is aligned to 16 bytes. By default they are used for results of 32 MiB and more, on
    /// processors where they are faster.
    pub streaming_stores: Option<bool>,
    /// How results are transferred from a Vulkan device.
    pub transfer: Transfer,
    /// On which queue results are copied to the host.
    pub read_back: ReadBack,
    /// How keys, segments and work lists are transferred to a Vulkan device.
    pub uploads: Uploads,
    /// How kernels of a Vulkan device read their input.
    pub reads: Reads,
    /// How samples are distributed to invocations of a Vulkan device.
    pub mapping: Mapping,
    /// Where arcs are prepared for a Vulkan device.
    pub prepare_arcs: PrepareArcs,
    /// How many invocations of a Vulkan device evaluate a run together; by default what is best on cards of its vendor.
    pub run_lanes: Option<RunLanes>,
    /// Whether a device is used although it fails the self-test; its bits may differ from the CPU's.
    pub allow_inexact: bool,
    /// Which files an engine on a Vulkan device reads and writes.
    pub cache_files: CacheFiles,
}

with_fields! {
    EngineOptions:
    with_memory(memory: Option<u64>),
    with_kept_segments(kept_segments: Option<u64>),
    with_thread_count(thread_count: Option<usize>),
    with_vector_width(vector_width: Option<VectorWidth>),
    with_transfer(transfer: Transfer),
    with_read_back(read_back: ReadBack),
    with_uploads(uploads: Uploads),
    with_reads(reads: Reads),
    with_mapping(mapping: Mapping),
    with_prepare_arcs(prepare_arcs: PrepareArcs),
    with_run_lanes(run_lanes: Option<RunLanes>),
    with_cache_files(cache_files: CacheFiles),
}

/// How many neighbouring invocations of a graphics card evaluate a run of samples together, track by track, for runs of
/// each class of lengths ([`RunLanes::CLASSES`]). Only powers of two from 4 to 32 are used. Other numbers are rounded
/// down to a power of two; numbers outside 4 to 32 count as 4 or 32.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct RunLanes(pub [u32; 5]);

impl RunLanes {
    /// The mean number of samples of a run below which it belongs to the class; runs of the last class are longer.
    pub const CLASSES: [u64; 4] = [8, 16, 32, 128];

    /// The class of runs by their number and that of their samples.
    #[must_use]
    pub fn class(runs: u64, samples: u64) -> usize {
        Self::CLASSES.partition_point(|end| samples >= end.saturating_mul(runs))
    }

    /// The number of invocations for runs of a class.
    #[cfg_attr(not(feature = "vulkan"), allow(dead_code))]
    pub(crate) fn of_class(self, class: usize) -> u32 {
        let lanes = self.0[class].clamp(4, 32);
        1 << lanes.ilog2()
    }
}

/// The times of a Vulkan device's evaluations ([`Engine::take_timings`](crate::engine::Engine::take_timings)).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Timings {
    /// Time in which the host made work lists and recorded commands. The device may have worked on another window at
    /// the same time.
    pub work_lists: Duration,
    /// Time from the submission of work until the host saw its end, including copies. Time that several windows in
    /// flight share is counted once.
    pub submit_to_fence: Duration,
    /// Time in which the kernels' queue was busy, by the device's time stamps; zero if it has none. Copies on another
    /// queue are not included.
    pub on_device: Duration,
    /// Time in which the host copied results into the caller's memory.
    pub read_back: Duration,
}

impl AddAssign for Timings {
    fn add_assign(&mut self, more: Self) {
        self.work_lists += more.work_lists;
        self.submit_to_fence += more.submit_to_fence;
        self.on_device += more.on_device;
        self.read_back += more.read_back;
    }
}
