//! Vulkan, through `ash`: evaluation on a device, with the bits of the CPU. Unsafe code is allowed here.
//!
//! A driver may compile slowly, run out of memory, lose its device, round differently from Vulkan's rules, or belong
//! to an application that draws at the same time. Therefore work is submitted in short windows with limited memory,
//! kernels are compared with the CPU before they are used, and failed work is repeated by one piece of code.
//!
//! # Types
//!
//! One type owns one Vulkan object, destroys it, and keeps alive the objects from which it was made:
//!
//! * [`Instance`](instance::Instance), [`PhysicalDevice`](physical::PhysicalDevice) with its queue families and memory
//!   types, [`LogicalDevice`](device::LogicalDevice) with a queue for kernels and, on cards, one for copies;
//! * [`Buffer`](buffer::Buffer), [`Pipeline`](pipeline::Pipeline), [`Submission`](submission::Submission): commands,
//!   a fence and a recording that are reused;
//! * [`VulkanEngine`](engine::VulkanEngine): a device with its pipelines, and buffers kept for the next call;
//! * [`Opened`](opened::Opened): the device for the rest of the crate, a [`Machine`](crate::machine::Machine). It has
//!   the current `VulkanEngine`, opens a lost device again, and repeats work that ran out of memory in smaller windows.
//!
//! # Steps
//!
//! 1. A [`VulkanClip`](clip::VulkanClip) makes a [`Job`](job::Job): prepared segments on the device
//!    ([`ClipBuffers`](job::ClipBuffers)), sample times and an encoding. `Opened::attempt_smaller` runs it.
//! 2. [`engine::run`] divides the result into windows of at most 2²¹ rotations and runs them in a pipeline: while the
//!    device evaluates one window, the host lists the next ([`in_flight`]).
//! 3. [`lists`](crate::work::lists) lists which samples of a window belong to which segment, as runs, single samples,
//!    or a grid; [`job`] keeps the lists of repeated requests. [`upload`] writes them to memory that kernels read.
//! 4. The copies of the lists and a dispatch for each group of segments become a
//!    [`Recording`](crate::work::recording::Recording), which [`recorded`] writes into commands with the barriers that
//!    it needs; [`submission`] submits them.
//! 5. `InFlight::finish` waits for the fence, copies the bytes to the caller if necessary, and overwrites the
//!    rotations that the host computed in f64 because no polynomial fits their curve.
//!
//! Sets with fewer samples than keys are evaluated by [`engine::from_keys`] without segments. Crowds have separate
//! tables and targets ([`crowd`]), and so have states of motion libraries ([`motion`]). A [`ClipTarget`](clip::ClipTarget) records a clip into an application's commands,
//! and a [`TimedClip`](timed_clip::TimedClip) at times that are known only then;
//! [`passes`] runs passes over poses, or records them from buffer to buffer.
//!
//! # Memory
//!
//! | what | memory |
//! |---|---|
//! | segments, constants, tables of crowds and of motion libraries | device memory |
//! | lists and keys | device memory if the host can write it ([`UploadMemory`](physical::upload_memory::UploadMemory)), else copied to it, or read in host memory |
//! | results | where the host reads them on devices that share its memory, and in the caller's memory on software devices ([`external`]); else device memory, copied by the second queue beside later kernels |
//! | results for CUDA | device memory, exported as a file descriptor ([`external`]) |
//!
//! Small buffers share allocations of 4 MiB ([`SharedMemory`](shared_memory::SharedMemory)).
//!
//! # Trust
//!
//! [`self_test`] runs when a device is opened, [`kernel_check`] when a pipeline is first made; passed checks are
//! stored ([`cache`](crate::machine::cache)).
#![allow(unsafe_code)]

pub(crate) mod buffer;
pub(crate) mod clip;
pub(crate) mod crowd;
pub(crate) mod device;
pub(crate) mod engine;
pub(crate) mod external;
pub(crate) mod handles;
pub(crate) mod in_flight;
pub(crate) mod instance;
pub(crate) mod job;
pub(crate) mod kernel_check;
mod machine;
pub(crate) mod motion;
pub(crate) mod opened;
pub(crate) mod passes;
pub(crate) mod physical;
pub(crate) mod pipeline;
pub(crate) mod pipeline_cache;
pub(crate) mod recorded;
pub(crate) mod run_once;
pub(crate) mod self_test;
pub(crate) mod shared_memory;
pub(crate) mod submission;
pub(crate) mod timed_clip;
pub(crate) mod upload;
