//! Passes over poses on a device: over data of the host, and recorded into an application's commands, from its buffers
//! to another of its buffers.

use std::sync::Arc;

use ash::vk;
use bytemuck::cast_slice;
use glam::Quat;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::QueueLane;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::recorded::{Binding, CommandScopes, Commands, Recorded};
use crate::gpu::run_once::run_once;
use crate::gpu::submission::Submission;
use crate::machine::error::{EvaluateError, VulkanError};
use crate::machine::poses::{Pass, PassRunner, SampleRows};
use crate::memory::reserved;
use crate::output::pose_error::{OFFSET_STEP, PoseError, check_fraction, check_weights};
use crate::output::rotations::Layout;
use crate::shader::{Kernel, Link, PoseDispatch, Variants};
use crate::smooth::rows::{SampleRow, SmoothingPass};
use crate::work::recording::{Resource, Slice, workgroups};

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

/// A pass over poses, prepared for recording into an application's commands, and the buffers that it reads and writes
/// ([`PassRequest::target`](crate::pose::pass::PassRequest::target)). Recording does not allocate.
pub struct PassTarget {
    engine: Arc<VulkanEngine>,
    kernel: Kernel,
    /// All steps of the pass; its input are the weights.
    work: Recorded,
    weights: Vec<f32>,
    /// Whether weights must be between 0 and 1.
    are_fractions: bool,
    bytes: u64,
    // The descriptor sets refer to these buffers. The caller guarantees that no work that uses them is in flight when
    // the target is dropped.
    _buffers: Vec<Buffer>,
}

/// The only input of a pass's recording.
const WEIGHTS: usize = 0;

/// The resources of a target while it is made.
struct Parts<'a> {
    engine: &'a VulkanEngine,
    work: Recorded,
    buffers: Vec<Buffer>,
}

impl Parts<'_> {
    /// A range of an application's buffer, of `size` bytes.
    fn range(&mut self, of: VulkanBuffer, size: u64) -> Resource {
        self.work
            .resource(Binding::range(of.buffer, of.offset, size))
    }

    /// Refuses a binding of more bytes than kernels can bind.
    fn check(&self, subject: &'static str, size: u64) -> Result<(), VulkanError> {
        (self.engine.device.physical).check_range(subject, size)
    }

    /// A buffer of the target.
    fn owned(&mut self, buffer: Buffer) -> Resource {
        let resource = self.work.whole(&buffer);
        self.buffers.push(buffer);
        resource
    }

    /// Memory of the device for `count` weights, which every recording writes.
    fn weights(&mut self, count: usize) -> Result<Resource, VulkanError> {
        let size = (count * size_of::<f32>()) as u64;
        self.check("the weights of a blend", size)?;
        let device = &self.engine.device;
        let buffer = Buffer::new(device, "tumble pass weights", size, Residence::Device)?;
        let weights = self.owned(buffer);
        self.work.recording.write_input(weights, WEIGHTS);
        Ok(weights)
    }

    /// A range in which the layers of a blend follow each other: the layers' memory if it has this form, or else a
    /// buffer into which they are copied.
    fn layers(&mut self, layers: &[VulkanBuffer], size: u64) -> Result<Slice, VulkanError> {
        let all = size.saturating_mul(layers.len() as u64);
        self.check("the layers of a blend", all)?;
        if are_bound_together(layers, size) {
            return Ok(self.range(layers[0], all).into());
        }
        let device = &self.engine.device;
        let buffer = Buffer::new(device, "tumble pass layers", all, Residence::Device)?;
        let together = self.owned(buffer);
        for (&layer, index) in layers.iter().zip(0..) {
            let from = self.range(layer, size);
            let to = together.slice(index * size, size);
            self.work.recording.copy(from, to);
        }
        Ok(together.slice(0, all))
    }

    /// A buffer of `count` reference rotations, followed by room for the weight.
    fn references(
        &mut self,
        count: usize,
        values: impl Iterator<Item = Quat>,
    ) -> Result<Resource, EvaluateError> {
        let size = (count as u64 + 1) * VALUE;
        self.check("the reference rotations", size)?;
        let mut references: Vec<[f32; 4]> = reserved(count + 1, "reference rotations")?;
        references.extend(values.take(count).map(|value| value.to_array()));
        references.push([0.0; 4]);
        let bytes = bytemuck::cast_slice(&references);
        let buffer = (self.engine).resident("tumble pass references", bytes, &mut Vec::new())?;
        let references = self.owned(buffer);
        let weight = references.slice(count as u64 * VALUE, VALUE);
        self.work.recording.write_input(weight, WEIGHTS);
        Ok(references)
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
        let mut parts = Parts {
            engine,
            work: Recorded::new(&engine.device),
            buffers: Vec::new(),
        };
        let mut bytes = size;
        if count > 0 {
            // Earlier work may still write the inputs, or read the result and the weights.
            parts.work.recording.wait_for_all();
        }
        const POSES: &str = "poses";
        let mut dispatches: Vec<([Option<Slice>; 4], [usize; 2])> = Vec::new();
        match job {
            // If there are no values, nothing is dispatched.
            _ if count == 0 => bytes = 0,
            PassJob::Blend(layers) => {
                let input = parts.layers(layers, size)?;
                let weights = parts.weights(layers.len())?;
                parts.check(POSES, size)?;
                let result = parts.range(result, size);
                let bindings = [input, weights.into(), result.into()];
                let [input, weights, result] = bindings.map(Some);
                dispatches.push(([input, weights, result, None], [count, layers.len()]));
            }
            &PassJob::Mix([from, to]) => {
                parts.check(POSES, size)?;
                let [from, to, result] = [from, to, result].map(|range| parts.range(range, size));
                let weights = parts.weights(1)?;
                let bindings = [from, to, weights, result];
                dispatches.push((bindings.map(|range| Some(range.into())), [count, 0]));
            }
            &PassJob::Add([base, layer], reference) => {
                // Frame by frame all windows share the references; track by track each value has its track's.
                let at_once = match layout {
                    Layout::FrameMajor => count.min(window_of_frames(tracks) * tracks),
                    Layout::TrackMajor => count,
                };
                let ranges = [base, layer, result].map(|range| parts.range(range, size));
                let mut shared: Option<(usize, Resource)> = None;
                for start in (0..count).step_by(at_once) {
                    let values = at_once.min(count - start);
                    let references = match (shared, layout) {
                        (Some((length, references)), _) if length == values => references,
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
                    parts.check(POSES, size)?;
                    let [base, layer, result] = ranges.map(|range| range.slice(start, size));
                    let bindings = [base, layer, references.into(), result];
                    dispatches.push((bindings.map(Some), [values, 0]));
                }
            }
            &PassJob::World(local, links) => {
                bytes = size.saturating_mul(2);
                let table = bytemuck::cast_slice(links);
                engine.check_size("a skeleton", table)?;
                parts.check(POSES, size)?;
                parts.check("poses in the world", bytes)?;
                let links = engine.resident("tumble pass skeleton", table, &mut Vec::new())?;
                let links = parts.owned(links);
                let [local, result] = [(local, size), (result, bytes)]
                    .map(|(range, size)| Some(parts.range(range, size).into()));
                dispatches.push(([local, Some(links.into()), result, None], [samples, tracks]));
            }
        }
        let Parts {
            mut work, buffers, ..
        } = parts;
        let recording = &mut work.recording;
        for (bindings, [count, detail]) in dispatches {
            let set = recording.set(kernel, bindings.into_iter().flatten());
            let [count, detail] = [count as u32, detail as u32];
            let push = PoseDispatch { count, detail };
            recording.dispatch(set, &push, workgroups(count));
        }
        recording.publish();
        work.bind(|kernel| engine.pipeline(kernel))?;
        Ok(Self {
            engine: Arc::clone(engine),
            kernel,
            work,
            weights,
            are_fractions: !matches!(job, PassJob::Blend(_)),
            bytes,
            _buffers: buffers,
        })
    }

    /// The length of the result in bytes.
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
    /// dispatch. For poses that are added frame by frame it records one dispatch for each 65 536 values. Before a blend
    /// it records a copy of each layer, unless the layers are contiguous. Barriers are included, as for the samples of
    /// a clip ([`ClipTarget::record`](crate::gpu::clip::ClipTarget::record)): the pass waits for all commands recorded
    /// before it, and later commands see the result. The commands may be submitted any number of times.
    ///
    /// # Safety
    /// The command buffer must belong to the engine's device and to a queue family that can compute, and must be in
    /// the recording state, outside a render pass. The target must live until the work has ended. All recordings of
    /// one target must run on one queue.
    pub unsafe fn record(&self, commands: vk::CommandBuffer) {
        // SAFETY: as the caller promises.
        unsafe { self.record_between(commands, CommandScopes::default()) };
    }

    /// As [`PassTarget::record`], with barriers only for the named users of the poses and of the result's memory. Earlier
    /// recordings of the target are waited for in any case.
    ///
    /// # Safety
    /// As for [`PassTarget::record`]; and the application has its own barriers for other commands that use this memory.
    pub unsafe fn record_between(&self, commands: vk::CommandBuffer, scopes: CommandScopes) {
        // SAFETY: as the caller promises.
        let commands = unsafe { Commands::new(&self.engine.device, commands) };
        self.record_into(commands.between(scopes.with_earlier_recordings()));
    }

    fn record_into(&self, commands: Commands<'_>) {
        (self.work).record(commands, &[bytemuck::cast_slice(&self.weights)]);
    }

    /// Runs the pass and waits for its end.
    pub(crate) fn run(&self) -> Result<(), VulkanError> {
        let mut submission = Submission::new(&self.engine.device, QueueLane::Kernels)?;
        submission.begin()?;
        self.record_into(submission.commands());
        submission.run()?;
        Ok(())
    }
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
            .field("pass", &self.kernel.code(Variants::default()).0)
            .field("weights", &self.weights)
            .field("bytes", &self.bytes)
            .finish_non_exhaustive()
    }
}

impl PassRunner for VulkanEngine {
    fn window(&self) -> usize {
        self.window()
    }

    fn run(&self, pass: &Pass<'_>, output: &mut [[f32; 4]]) -> Result<(), EvaluateError> {
        let count = output.len();
        Ok(match *pass {
            Pass::Blend { layers, weights } => {
                let inputs = [cast_slice(layers), cast_slice(weights)];
                run_pass(
                    self,
                    Kernel::PosesBlend,
                    &inputs,
                    [count, weights.len()],
                    output,
                )
            }
            Pass::Mix { from, to, weight } => {
                let weight = [weight];
                let inputs = [cast_slice(from), cast_slice(to), cast_slice(&weight)];
                run_pass(self, Kernel::PosesMix, &inputs, [count, 0], output)
            }
            Pass::Add {
                base,
                layer,
                references,
            } => {
                let inputs = [base, layer, references].map(cast_slice);
                run_pass(self, Kernel::PosesAdd, &inputs, [count, 0], output)
            }
            Pass::World { local, links } => {
                let inputs = [cast_slice(local), cast_slice(links)];
                let counts = [local.len() / links.len(), links.len()];
                run_pass(self, Kernel::PosesWorld, &inputs, counts, output)
            }
        }?)
    }

    /// Smooths as many tracks at once as one pass can process. The host writes the steps outside the ends of rows.
    fn smooth(
        &self,
        all: &SampleRows<'_>,
        pass: &SmoothingPass<'_>,
        output: &mut [[f32; 4]],
    ) -> Result<(), EvaluateError> {
        if pass.weights.is_empty() {
            return self.host.smooth(all, pass, output);
        }
        let (limit, radius) = (self.window().max(2), pass.weights.len());
        let detail = usize::from(pass.are_rotations);
        let stride = all.samples - 1 + 2 * radius;
        // Rows that are smoothed together are separated by the values beyond their ends. If the kernel is wider than
        // the rows are long, these are more values than the rows have.
        let each = match 2 * radius > all.samples {
            true => 1,
            false => (limit / stride).max(1),
        };
        for first in (0..all.tracks).step_by(each) {
            let rows: Vec<SampleRow<'_>> = (first..all.tracks.min(first + each))
                .map(|track| all.row(track))
                .collect();
            let samples = rows
                .iter()
                .flat_map(|row| (0..row.count).map(|i| row.get(i)));
            let values: Vec<[f32; 4]> = samples.collect();
            // The step from one row to the next is computed too, and ignored.
            let mut steps = vec![[0.0; 4]; values.len() - 1];
            for (first, output) in (0..).step_by(limit - 1).zip(steps.chunks_mut(limit - 1)) {
                let values = &values[first..=first + output.len()];
                let counts = [output.len(), detail];
                run_pass(
                    self,
                    Kernel::PosesSteps,
                    &[cast_slice(values)],
                    counts,
                    output,
                )?;
            }
            let mut padded = Vec::with_capacity(rows.len() * stride);
            let mut spaced = Vec::with_capacity(rows.len() * stride);
            for (values, first) in values.chunks(all.samples).zip((0..).step_by(all.samples)) {
                let before = (0..stride).map(|step| step as isize - radius as isize);
                padded.extend(before.map(|step| steps[first + pass.step_at(step, all.samples)]));
                spaced.extend_from_slice(values);
                spaced.resize(padded.len(), [0.0; 4]);
            }
            let mut found = vec![[0.0; 4]; spaced.len() - stride + all.samples];
            let block = limit.saturating_sub(2 * radius).max(1);
            for (first, output) in (0..).step_by(block).zip(found.chunks_mut(block)) {
                let steps = &padded[first..first + output.len() + 2 * radius - 1];
                let values = &spaced[first..first + output.len()];
                let inputs = [
                    cast_slice(values),
                    cast_slice(steps),
                    cast_slice(pass.weights),
                ];
                let counts = [output.len(), 2 * radius + detail];
                run_pass(self, Kernel::PosesSmooth, &inputs, counts, output)?;
            }
            for (row, start) in rows.iter().zip((0..).step_by(stride)) {
                for sample in 0..all.samples {
                    let mut value = found[start + sample];
                    if pass.are_rotations && value == [0.0; 4] {
                        let center = (start + sample + radius) as isize;
                        value = pass.smoothed_in_f64(row.get(sample), |step| {
                            let [x, y, z, _] = padded[(center + step) as usize];
                            [x, y, z]
                        });
                    }
                    output[row.first + sample * row.stride] = value;
                }
            }
        }
        Ok(())
    }
}

/// Runs the kernel of a pass with these inputs, each of at most as many values of 16 bytes as a window has
/// rotations. The kernel has `count` invocations and the parameter `detail`.
fn run_pass(
    engine: &VulkanEngine,
    kernel: Kernel,
    inputs: &[&[u8]],
    [count, detail]: [usize; 2],
    output: &mut [[f32; 4]],
) -> Result<(), VulkanError> {
    let output = bytemuck::cast_slice_mut(output);
    for bytes in inputs.iter().copied().chain([&*output]) {
        engine.check_size("poses", bytes)?;
    }
    let [count, detail] = [count as u32, detail as u32];
    let (pipeline, groups) = (engine.pipeline(kernel)?, workgroups(count));
    let pass = PoseDispatch { count, detail };
    run_once(&pipeline, inputs, bytemuck::bytes_of(&pass), groups, output)
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
