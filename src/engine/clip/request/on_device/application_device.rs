//! Results in buffers on an application's Vulkan device. These functions are unsafe, because the compiler cannot
//! check the application's promises about its buffers.
#![allow(unsafe_code)]

use std::sync::Arc;

use ash::vk;

use crate::engine::clip::request::on_device::on_vulkan;
use crate::engine::clip::request::{Request, RequestPart, RequestSource};
use crate::error::Error;
use crate::gpu::clip::ClipTarget;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::job::Job;
use crate::gpu::recorded::{CommandScopes, Commands};
use crate::gpu::timed_clip::TimedClip;
use crate::machine::MachineClip as _;
use crate::machine::error::VulkanError;
use crate::output::window::Window;

impl Request<'_> {
    /// Evaluates into a buffer of the application, on the device that the engine was made from
    /// ([`Engine::from_vulkan`](crate::engine::Engine::from_vulkan)), for a renderer or another kernel.
    ///
    /// Returns when the result is written; commands that are submitted to the queue afterwards see it. When the same
    /// request of a clip is repeated, its work lists are already on the device.
    ///
    /// # Errors
    /// * As [`Request::size`].
    /// * When the engine is the CPU, or was not made from the application's device.
    /// * When the buffer is null, or the range does not start at a multiple of a value's size, is too short, or ends
    ///   beyond the buffer.
    /// * When the device fails.
    ///
    /// # Safety
    /// The buffer must belong to the engine's device, be bound to memory, have the usages `STORAGE_BUFFER` and
    /// `TRANSFER_DST`, and contain the range. Nothing else may use the range until this returns.
    pub unsafe fn to_buffer(&self, buffer: VulkanBuffer) -> Result<(), Error> {
        let (_, part) = self.for_buffer(buffer)?;
        (self.source).with_uploaded(&part, |clip, timeline, window| {
            let to_buffer =
                |engine: &VulkanEngine, job: Job<'_>| engine.run_into(job, window, buffer);
            clip.on_device(timeline, self.encoding, to_buffer)
        })
    }

    /// Prepares this request for recording into the application's commands, with its result in a buffer on the device
    /// that the engine was made from ([`Engine::from_vulkan`](crate::engine::Engine::from_vulkan)). The kernels are
    /// compiled, and the work lists are made and uploaded here, once.
    ///
    /// # Errors
    /// As [`Request::to_buffer`]; also when the range is longer than the device can bind, or the clip's segments take
    /// more than [`EngineOptions::memory`](crate::machine::options::EngineOptions::memory).
    ///
    /// # Safety
    /// As [`Request::to_buffer`]; the buffer must live as long as the target, and the target must be dropped after
    /// all work that was recorded with it has ended, and before the device is destroyed.
    pub unsafe fn target(&self, buffer: VulkanBuffer) -> Result<ClipTarget, Error> {
        let (engine, part) = self.for_buffer(buffer)?;
        (self.source).with_uploaded(&part, |clip, timeline, window| {
            let target =
                |_: &VulkanEngine, job: Job<'_>| ClipTarget::new(&engine, job, window, buffer);
            clip.on_device(timeline, self.encoding, target)
        })
    }

    /// Prepares this request for recording at times that are known only when they are recorded
    /// ([`TimedTarget::record`]): for a clip at another time in each frame. The number of times in the request is the
    /// number of samples of each recording. The kernels are compiled here. A set is prepared and uploaded here as a
    /// whole.
    ///
    /// # Errors
    /// As [`Request::target`].
    ///
    /// # Safety
    /// As [`Request::target`].
    pub unsafe fn timed_target(&self, buffer: VulkanBuffer) -> Result<TimedTarget, Error> {
        let (engine, part) = self.for_buffer(buffer)?;
        let prepared;
        let clip = match &self.source {
            RequestSource::Clip(clip) => *clip,
            RequestSource::Set {
                engine,
                set,
                interpolation,
            } => {
                prepared = engine.upload(set, *interpolation)?;
                &prepared
            }
            RequestSource::Grouped(_) => return Err(Error::SeveralInterpolations),
        };
        let clip = on_vulkan(clip.uploaded()?.prepared()?)?;
        let samples = 0..part.window.samples.len();
        let window = Window::of(part.window.tracks.clone(), samples, self.layout);
        let target = |_: &VulkanEngine, job: Job<'_>| {
            TimedClip::new(
                &engine,
                job,
                Arc::clone(clip.data()),
                window.clone(),
                buffer,
            )
        };
        let clip = clip.on_device(&part.timeline, self.encoding, target)?;
        Ok(TimedTarget { clip })
    }

    /// The device and the part of the result, if the result fits the range of the buffer.
    fn for_buffer(&self, buffer: VulkanBuffer) -> Result<(Arc<VulkanEngine>, RequestPart), Error> {
        let Some(opened) = self.source.engine().opened() else {
            return Err(Error::BufferOnCpu);
        };
        let engine = opened.engine();
        if engine.device.owned {
            return Err(Error::BufferOfOther);
        }
        buffer.check(&engine.device.raw)?;
        let part = self.part()?;
        let rotation = self.encoding.bytes() as u64;
        let needed = (part.window.len() as u64).saturating_mul(rotation);
        if !buffer.offset.is_multiple_of(rotation) || buffer.size < needed {
            return Err(Error::Vulkan(VulkanError::BufferRange {
                offset: buffer.offset,
                size: buffer.size,
                rotation,
                needed,
            }));
        }
        Ok((engine, part))
    }
}

/// Samples of a clip, prepared for recording into an application's commands, each time at other times
/// ([`Request::timed_target`]).
///
/// ```
/// use tumble::ash::vk;
/// use tumble::vulkan::{TimedTarget, VulkanBuffer};
/// use tumble::{Clip, Error, SampleTimes};
///
/// /// # Safety
/// /// As for `Request::timed_target`.
/// unsafe fn target(clip: &Clip, pose: VulkanBuffer) -> Result<TimedTarget, Error> {
///     let one_sample = SampleTimes::at(vec![0.0]); // of each track
///     unsafe { clip.request(&one_sample).timed_target(pose) }
/// }
///
/// /// # Safety
/// /// As for `TimedTarget::record`.
/// unsafe fn frame(target: &TimedTarget, commands: vk::CommandBuffer, seconds: f64) -> Result<(), Error> {
///     unsafe { target.record(commands, 0, &[seconds]) }
/// }
/// ```
pub struct TimedTarget {
    clip: TimedClip,
}

impl TimedTarget {
    /// The length of a result, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.clip.range().bytes
    }

    /// Records an evaluation at these times, seconds, into the application's command buffer: as many as the request has
    /// samples, the same for all tracks. The result starts `offset` bytes after the start of the target's range. It has
    /// the bits of an evaluation at [`SampleTimes::at`](crate::SampleTimes::at) these times.
    ///
    /// Nothing is submitted or waited for. The host finds the segment of each sample, because a device would round the
    /// time first. The segments are written into the commands, about 28 bytes for each sample of a track. Barriers are
    /// included, as for [`ClipTarget::record`](crate::gpu::clip::ClipTarget::record). Several recordings of a target
    /// may be in flight on one queue. If the commands are submitted again, they evaluate the same times.
    ///
    /// # Errors
    /// When there is another number of times, a time is not finite, the result does not fit at this offset, `offset` is
    /// not a multiple of a value's size, or there is not enough memory; then nothing is recorded.
    ///
    /// # Safety
    /// As for [`ClipTarget::record`](crate::gpu::clip::ClipTarget::record).
    pub unsafe fn record(
        &self,
        commands: vk::CommandBuffer,
        offset: u64,
        times: &[f64],
    ) -> Result<(), Error> {
        // SAFETY: as the caller promises.
        unsafe { self.record_between(commands, offset, times, CommandScopes::default()) }
    }

    /// As [`TimedTarget::record`], with barriers only for the commands that use the result's memory (`scopes`).
    /// Earlier recordings of the target are waited for in any case.
    ///
    /// # Errors
    /// As for [`TimedTarget::record`].
    ///
    /// # Safety
    /// As for [`ClipTarget::record_between`](crate::gpu::clip::ClipTarget::record_between).
    pub unsafe fn record_between(
        &self,
        commands: vk::CommandBuffer,
        offset: u64,
        times: &[f64],
        scopes: CommandScopes,
    ) -> Result<(), Error> {
        // SAFETY: as the caller promises.
        let commands = unsafe { Commands::new(&self.clip.engine().device, commands) };
        let commands = commands.between(scopes.with_earlier_recordings());
        Ok(self.clip.record_at(commands, offset, times)?)
    }
}

impl std::fmt::Debug for TimedTarget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TimedTarget")
            .field("encoding", &self.clip.range().encoding)
            .field("bytes", &self.bytes())
            .finish_non_exhaustive()
    }
}
