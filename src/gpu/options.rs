//! Choices for an engine, and where its time went.

use std::ops::AddAssign;
use std::time::Duration;

use crate::simd::dispatch::VectorWidth;

/// How results of a Vulkan device reach the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Transfer {
    /// In place where the device shares the host's memory, else staged. Software devices
    /// work on the caller's own memory where they can, without a copy.
    #[default]
    Automatic,
    /// The kernel writes into memory that the host reads.
    InPlace,
    /// The kernel writes into the device's memory, from where results are copied.
    Staged,
}

/// On which queue of a Vulkan device results are copied to the host, where they are copied
/// ([`Transfer::Staged`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ReadBack {
    /// Cards that have a second queue: [`ReadBack::Overlapped`]; all others, and software devices:
    /// [`ReadBack::SameQueue`].
    #[default]
    Automatic,
    /// In the submission of the kernels, after them.
    SameQueue,
    /// In a submission of its own, which waits for the kernels' on a timeline semaphore: on a second
    /// queue, so that the next kernels run beside the copy; where there is none, on the same queue.
    /// Devices without timeline semaphores copy as by [`ReadBack::SameQueue`].
    Overlapped,
}

/// How keys, segments and work lists come to a Vulkan device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Uploads {
    /// Each upload by itself: as [`Uploads::Direct`] where the memory that is both the device's and
    /// the host's is as large as the device's (resizable BAR, integrated devices), or the upload is at
    /// most a 64th of it; else read in place or staged, as results are ([`Transfer`]).
    #[default]
    Automatic,
    /// Written by the host into the device's own memory, where any of it is visible to the host and
    /// there is room; else as by `Automatic`.
    Direct,
    /// Written into the host's memory, from where the device copies them.
    Staged,
}

/// How kernels of a Vulkan device read keys, segments and work lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reads {
    /// Texel buffers on software devices that can, else storage buffers.
    #[default]
    Automatic,
    /// Storage buffers.
    StorageBuffers,
    /// Texel buffers, and stores of 64 bits, on devices that have 64-bit integers and texel
    /// buffers as long as their largest allocation; else storage buffers.
    TexelBuffers,
}

/// How the samples of a result are shared among the invocations of a kernel on a Vulkan device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mapping {
    /// [`Mapping::Samples`] on graphics cards and integrated devices, [`Mapping::Runs`] on software
    /// devices.
    #[default]
    Automatic,
    /// An invocation takes up to 16 consecutive samples of one segment, whose constants it loads
    /// once. Devices that serve their lanes one by one are fastest so.
    Runs,
    /// Neighbouring invocations take neighbouring samples: the lanes that a card runs together write
    /// whole lines of memory, and read the constants that they share from one address.
    Samples,
}

/// Where the arcs of [`SLERP`](crate::method::SLERP) are prepared for a Vulkan device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PrepareArcs {
    /// Of many keys on the card, if it has memory of its own; else on the host.
    #[default]
    Automatic,
    /// On the host, which uploads keys and arcs.
    OnHost,
    /// On the device, to which keys are uploaded, and 4 bytes for each arc. Arcs between keys whose signs are
    /// [as authored](crate::KeySigns::AsAuthored) are prepared on the host all the same.
    OnDevice,
}

/// Choices for an [`Engine`](crate::engine::Engine); none of them changes a bit of any result.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct EngineOptions {
    /// Bytes of the device's memory to use besides results, on the CPU for the segments of a set; no limit by
    /// default. What needs more is prepared piece by piece.
    pub memory: Option<u64>,
    /// Worker threads of the CPU; by default those that all engines of the process share, as many as the
    /// environment's `RAYON_NUM_THREADS` says, else one for each core.
    pub thread_count: Option<usize>,
    /// The widest vector instructions to evaluate with on the CPU; by default
    /// [`VectorWidth::widest`].
    pub vector_width: Option<VectorWidth>,
    /// Whether the CPU writes past its caches: rotations of segments in f32, track by track, where the
    /// memory is aligned to 16 bytes. By default it does so with results of 32 MiB and more, on
    /// processors that gain by it.
    pub streaming_stores: Option<bool>,
    /// How results come back from a Vulkan device.
    pub transfer: Transfer,
    /// On which queue results are copied back.
    pub read_back: ReadBack,
    /// How a Vulkan device gets what its kernels read.
    pub uploads: Uploads,
    /// How a Vulkan device's kernels read.
    pub reads: Reads,
    /// How a Vulkan device's invocations share the samples.
    pub mapping: Mapping,
    /// Where arcs are prepared for a Vulkan device.
    pub prepare_arcs: PrepareArcs,
    /// Use a device although it fails the self-test: its bits may differ.
    pub allow_inexact: bool,
}

/// Where the time of a Vulkan device's evaluations went
/// ([`Engine::take_timings`](crate::engine::Engine::take_timings)).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Timings {
    /// Time in which the host made work lists and recorded commands; the device may have worked on
    /// another window meanwhile.
    pub work_lists: Duration,
    /// Time from submitting work to seeing that it has ended, copies included; time that several windows in
    /// flight share is counted once.
    pub submit_to_fence: Duration,
    /// Time in which the queue of the kernels worked, by the device's clock; zero where it has none.
    /// Copies on another queue run beside it and are not counted here.
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
