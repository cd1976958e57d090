//! Passes over poses, recorded from buffers of an application into another of its buffers, with all resources
//! prepared once.

use std::sync::Arc;

use ash::vk;
use glam::Quat;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::QueueLane;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::{EvaluateError, VulkanError};
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::submission::{Access, Binding, Commands, DescriptorPool, Submission};
use crate::memory::reserved;
use crate::output::pose_error::{OFFSET_STEP, PoseError, check_fraction, check_weights};
use crate::output::rotations::Layout;
use crate::shader::{Kernel, Link, PoseDispatch};

/// Bytes of a rotation, and of every other value that passes read or write.
pub(crate) const VALUE: u64 = size_of::<[f32; 4]>() as u64;

/// The number of values in a window when poses are added frame by frame. All windows share the reference rotations of
/// one window, a mebibyte.
const ADDED_AT_ONCE: usize = 1 << 16;

/// A pass, and the ranges of the buffers that it reads. Each range is as long as the pass needs, and starts at a
/// multiple of [`OFFSET_STEP`]; those of a blend start at a multiple of a value's size.
pub(crate) enum PassJob<'a> {
    /// The weighted sum of layers.
    Blend(Vec<VulkanBuffer>),
    /// Slerp from the first to the second.
    Mix([VulkanBuffer; 2]),
    /// A base and a layer, with a reference rotation for each track.
    Add([VulkanBuffer; 2], &'a [Quat]),
    /// Poses frame by frame, and the skeleton.
    World(VulkanBuffer, &'a [Link]),
}

/// The shape of a pass: tracks, samples, and their layout.
pub(crate) type PassShape = (usize, usize, Layout);

/// A layer of a blend that is copied next to the others: its location, and the offset that it is copied to.
struct GatheredLayer {
    from: vk::Buffer,
    from_offset: u64,
    to_offset: u64,
}

/// Layers that are copied into one buffer before they are blended.
struct Gathered {
    buffer: Buffer,
    layers: Vec<GatheredLayer>,
    /// Bytes of a layer.
    size: u64,
}

/// A pass over poses, prepared for recording into an application's commands, and the buffers that it reads and writes
/// ([`PassRequest::target`](crate::pose::pass::PassRequest::target)). Recording does not allocate.
pub struct PassTarget {
    engine: Arc<VulkanEngine>,
    pipeline: Arc<Pipeline>,
    gathered: Option<Gathered>,
    /// The weights, and where kernels read them.
    weights: Vec<f32>,
    weights_at: Vec<(vk::Buffer, u64)>,
    /// Whether weights must be between 0 and 1.
    are_fractions: bool,
    dispatches: Vec<(vk::DescriptorSet, PoseDispatch)>,
    bytes: u64,
    // What the sets are made of and lead to. Whoever records promises that no work that uses it is in
    // flight when the target is dropped.
    _pool: DescriptorPool,
    _buffers: Vec<Buffer>,
}

/// The resources of a target while it is made.
struct Parts<'a> {
    engine: &'a VulkanEngine,
    buffers: Vec<Buffer>,
    weights_at: Vec<(vk::Buffer, u64)>,
    /// The buffers and the arguments of each dispatch.
    dispatches: Vec<(Vec<Binding>, PoseDispatch)>,
}

impl Parts<'_> {
    /// A range of `size` bytes that starts `start` bytes after the start of the range `of`.
    fn range(
        &self,
        subject: &'static str,
        of: VulkanBuffer,
        start: u64,
        size: u64,
    ) -> Result<Binding, VulkanError> {
        (self.engine.device.physical).check_range(subject, size)?;
        Ok(Binding::range(of.buffer, of.offset + start, size))
    }

    /// Memory of the device for `count` weights, which every recording writes.
    fn weights(&mut self, count: usize) -> Result<Binding, VulkanError> {
        let size = (count * size_of::<f32>()) as u64;
        (self.engine.device.physical).check_range("the weights of a blend", size)?;
        let device = &self.engine.device;
        let buffer = Buffer::new(device, "tumble pass weights", size, Residence::Device)?;
        let binding = Binding::whole(&buffer);
        self.weights_at.push((buffer.raw, 0));
        self.buffers.push(buffer);
        Ok(binding)
    }

    /// A buffer of `count` reference rotations, followed by room for the weight.
    fn references(
        &mut self,
        count: usize,
        values: impl Iterator<Item = Quat>,
    ) -> Result<Binding, EvaluateError> {
        let size = (count as u64 + 1) * VALUE;
        (self.engine.device.physical).check_range("the reference rotations", size)?;
        let mut references: Vec<[f32; 4]> = reserved(count + 1, "reference rotations")?;
        references.extend(values.take(count).map(|value| value.to_array()));
        references.push([0.0; 4]);
        let bytes = bytemuck::cast_slice(&references);
        let buffer = (self.engine).resident("tumble pass references", bytes, &mut Vec::new())?;
        let binding = Binding::whole(&buffer);
        self.weights_at.push((buffer.raw, count as u64 * VALUE));
        self.buffers.push(buffer);
        Ok(binding)
    }

    fn dispatch(&mut self, bindings: Vec<Binding>, count: usize, detail: usize) {
        let [count, detail] = [count as u32, detail as u32];
        let arguments = PoseDispatch { count, detail };
        self.dispatches.push((bindings, arguments));
    }
}

/// Whether ranges of `size` bytes are contiguous in one buffer and start at an offset that a kernel can bind.
fn are_bound_together(ranges: &[VulkanBuffer], size: u64) -> bool {
    let begins = ranges
        .first()
        .is_some_and(|first| first.offset.is_multiple_of(OFFSET_STEP));
    begins
        && ranges.windows(2).all(|pair| {
            pair[0].buffer == pair[1].buffer
                && pair[0].offset.checked_add(size) == Some(pair[1].offset)
        })
}

impl PassTarget {
    /// Makes a target for a pass and the range of its result, both of which were checked.
    pub(crate) fn new(
        engine: &Arc<VulkanEngine>,
        job: &PassJob<'_>,
        (tracks, samples, layout): PassShape,
        weights: Vec<f32>,
        result: VulkanBuffer,
    ) -> Result<Self, EvaluateError> {
        let count = tracks.saturating_mul(samples);
        let size = (count as u64).saturating_mul(VALUE);
        let kernel = match job {
            PassJob::Blend(_) => Kernel::PosesBlend,
            PassJob::Mix(_) => Kernel::PosesMix,
            PassJob::Add(..) => Kernel::PosesAdd,
            PassJob::World(..) => Kernel::PosesWorld,
        };
        let pipeline = engine.pipeline(kernel)?;
        let mut parts = Parts {
            engine,
            buffers: Vec::new(),
            weights_at: Vec::new(),
            dispatches: Vec::new(),
        };
        let (mut gathered, mut bytes) = (None, size);
        const POSES: &str = "poses";
        match job {
            // Kernels are not dispatched over nothing.
            _ if count == 0 => bytes = 0,
            PassJob::Blend(layers) => {
                let all = size.saturating_mul(layers.len() as u64);
                (engine.device.physical).check_range("the layers of a blend", all)?;
                let input = if are_bound_together(layers, size) {
                    Binding::range(layers[0].buffer, layers[0].offset, all)
                } else {
                    let together = gather(engine, layers, size)?;
                    let input = Binding::range(together.buffer.raw, 0, all);
                    gathered = Some(together);
                    input
                };
                let bindings = vec![
                    input,
                    parts.weights(layers.len())?,
                    parts.range(POSES, result, 0, size)?,
                ];
                parts.dispatch(bindings, count, layers.len());
            }
            &PassJob::Mix([from, to]) => {
                let bindings = vec![
                    parts.range(POSES, from, 0, size)?,
                    parts.range(POSES, to, 0, size)?,
                    parts.weights(1)?,
                    parts.range(POSES, result, 0, size)?,
                ];
                parts.dispatch(bindings, count, 0);
            }
            &PassJob::Add([base, layer], reference) => {
                // Frame by frame all windows share the references; track by track each value has its track's.
                let at_once = match layout {
                    Layout::FrameMajor => count.min(window_of_frames(tracks) * tracks),
                    Layout::TrackMajor => count,
                };
                let mut shared: Option<(usize, Binding)> = None;
                for start in (0..count).step_by(at_once) {
                    let values = at_once.min(count - start);
                    let references = match (shared, layout) {
                        (Some((length, binding)), _) if length == values => binding,
                        (_, Layout::FrameMajor) => {
                            parts.references(values, reference.iter().copied().cycle())?
                        }
                        (_, Layout::TrackMajor) => {
                            let each = |&value| std::iter::repeat_n(value, samples);
                            parts.references(values, reference.iter().flat_map(each))?
                        }
                    };
                    shared = Some((values, references));
                    let (start, size) = (start as u64 * VALUE, values as u64 * VALUE);
                    let bindings = vec![
                        parts.range(POSES, base, start, size)?,
                        parts.range(POSES, layer, start, size)?,
                        references,
                        parts.range(POSES, result, start, size)?,
                    ];
                    parts.dispatch(bindings, values, 0);
                }
            }
            &PassJob::World(local, links) => {
                bytes = size.saturating_mul(2);
                let table = bytemuck::cast_slice(links);
                engine.check_size("a skeleton", table)?;
                let links = engine.resident("tumble pass skeleton", table, &mut Vec::new())?;
                let bindings = vec![
                    parts.range(POSES, local, 0, size)?,
                    Binding::whole(&links),
                    parts.range("poses in the world", result, 0, bytes)?,
                ];
                parts.buffers.push(links);
                parts.dispatch(bindings, samples, tracks);
            }
        }
        let mut pool = DescriptorPool::new(&engine.device);
        pool.make_room(parts.dispatches.len() as u32)?;
        let dispatches = (parts.dispatches.iter())
            .map(|(bindings, arguments)| Ok((pool.set(&pipeline, bindings)?, *arguments)))
            .collect::<Result<_, VulkanError>>()?;
        Ok(Self {
            engine: Arc::clone(engine),
            pipeline,
            gathered,
            weights,
            weights_at: parts.weights_at,
            are_fractions: !matches!(job, PassJob::Blend(_)),
            dispatches,
            bytes,
            _pool: pool,
            _buffers: parts.buffers,
        })
    }

    /// The length of the result, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Sets the weights for later recordings: one for each layer of a blend, one for two layers that are mixed or
    /// added, none for a skeleton.
    ///
    /// # Errors
    /// When the number of weights is wrong, or a weight is out of range for the pass.
    pub fn set_weights(&mut self, weights: &[f32]) -> Result<(), PoseError> {
        if weights.len() != self.weights.len() {
            return Err(PoseError::WeightCount {
                weights: weights.len(),
                needed: self.weights.len(),
            });
        }
        match self.are_fractions {
            true => weights
                .iter()
                .try_for_each(|&weight| check_fraction(weight))?,
            false => check_weights(weights)?,
        }
        self.weights.copy_from_slice(weights);
        Ok(())
    }

    /// Records the pass into the application's command buffer.
    ///
    /// Recording neither waits nor allocates. It records the weights, whose values stay in the commands, and one
    /// dispatch; for poses that are added frame by frame one dispatch for each 65 536 values; and before a blend a
    /// copy of each layer, unless the layers are contiguous. Barriers are included, as for the samples of a clip
    /// ([`ClipTarget::record`](crate::gpu::clip_target::ClipTarget::record)): the pass waits for all commands
    /// recorded before it, and later commands see the result. The commands may be submitted any number of times.
    ///
    /// # Safety
    /// The command buffer must belong to the engine's device and to a queue family that can compute, and must be in
    /// the recording state, outside a render pass. The target must live until the work has ended. All recordings of
    /// one target must run on one queue.
    pub unsafe fn record(&self, commands: vk::CommandBuffer) {
        // SAFETY: promised by the caller.
        self.record_into(unsafe { Commands::new(&self.engine.device, commands) });
    }

    fn record_into(&self, commands: Commands<'_>) {
        if self.dispatches.is_empty() {
            return;
        }
        // The inputs may just have been written, the result and the weights may still be read.
        commands.barrier(Access::Any, Access::KernelAndCopy);
        if let Some(gathered) = &self.gathered {
            for layer in &gathered.layers {
                let from = (layer.from, layer.from_offset);
                let to = (gathered.buffer.raw, layer.to_offset);
                commands.copy_range(from, to, gathered.size);
            }
        }
        for &(buffer, offset) in &self.weights_at {
            commands.update(buffer, offset, bytemuck::cast_slice(&self.weights));
        }
        if self.gathered.is_some() || !self.weights_at.is_empty() {
            commands.barrier(Access::Copy, Access::Kernel);
        }
        for (set, arguments) in &self.dispatches {
            let groups = self.engine.workgroups(arguments.count);
            let arguments = bytemuck::bytes_of(arguments);
            commands.dispatch(&self.pipeline, *set, arguments, groups);
        }
        commands.barrier(Access::Kernel, Access::Any);
    }

    /// Runs the pass and waits for its end.
    pub(crate) fn run(&self) -> Result<(), VulkanError> {
        let mut submission = Submission::new(&self.engine.device, QueueLane::Kernels)?;
        submission.begin(0)?;
        self.record_into(submission.commands());
        submission.submit()?;
        submission.wait()?;
        Ok(())
    }
}

/// Memory for a contiguous copy of the layers of a blend.
fn gather(
    engine: &VulkanEngine,
    layers: &[VulkanBuffer],
    size: u64,
) -> Result<Gathered, VulkanError> {
    let all = size * layers.len() as u64;
    let device = &engine.device;
    let layers = (layers.iter().zip(0..)).map(|(layer, index)| GatheredLayer {
        from: layer.buffer,
        from_offset: layer.offset,
        to_offset: index * size,
    });
    Ok(Gathered {
        buffer: Buffer::new(device, "tumble pass layers", all, Residence::Device)?,
        layers: layers.collect(),
        size,
    })
}

/// The number of frames in a window of poses that are added: a multiple with which every window starts at an offset
/// that a kernel can bind.
fn window_of_frames(tracks: usize) -> usize {
    let values = (OFFSET_STEP / VALUE) as usize;
    let step = values >> tracks.trailing_zeros().min(values.trailing_zeros());
    (ADDED_AT_ONCE / tracks.max(1)).max(step) / step * step
}

impl std::fmt::Debug for PassTarget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PassTarget")
            .field("pass", &self.pipeline.name)
            .field("weights", &self.weights)
            .field("bytes", &self.bytes)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_of_added_poses_begin_where_kernels_may_bind_them() {
        for tracks in [1, 2, 3, 5, 8, 16, 60, 1000, 65_535, 65_536, 1_000_000] {
            let frames = window_of_frames(tracks);
            let bytes = (frames * tracks) as u64 * VALUE;
            assert!(bytes.is_multiple_of(OFFSET_STEP), "{tracks}: {frames}");
            assert!(
                frames * tracks <= ADDED_AT_ONCE.max(16 * tracks),
                "{tracks}: {frames}"
            );
        }
    }

    #[test]
    fn layers_lie_together_one_behind_the_other_in_one_buffer() {
        use ash::vk::Handle as _;
        let range = |buffer, offset| VulkanBuffer {
            buffer: vk::Buffer::from_raw(buffer),
            offset,
            size: 512,
        };
        assert!(are_bound_together(&[range(1, 256), range(1, 768)], 512));
        assert!(are_bound_together(&[range(1, 256)], 512));
        assert!(!are_bound_together(&[range(1, 256), range(2, 768)], 512));
        assert!(!are_bound_together(&[range(1, 768), range(1, 256)], 512));
        assert!(!are_bound_together(&[range(1, 0), range(1, 768)], 512));
        assert!(!are_bound_together(&[range(1, 16), range(1, 528)], 512));
    }
}
