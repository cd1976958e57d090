//! Passes over rotations in buffers of an application's device: their descriptions, and checks of them.

mod application_device;

use glam::Quat;

use crate::engine::Engine;
use crate::error::Error;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::opened::Opened;
use crate::gpu::passes::{PassJob, PassShape, VALUE};
use crate::output::pose_error::{
    OFFSET_STEP, PassOperand, PoseError, check_fraction, check_references, check_skeleton,
    check_weights,
};
use crate::output::rotations::Layout;
use crate::pose::skeleton::Skeleton;

/// A pass over rotations in buffers of an application's device: a blend, a mix, an addition, or the evaluation of a
/// skeleton. [`Engine::pass`] takes it.
///
/// Each input is a range of a buffer with four f32 for each rotation, as
/// [`Request::to_buffer`](crate::engine::clip::request::Request::to_buffer) and
/// [`ClipTarget::record`](crate::gpu::clip::ClipTarget::record) write it. Layers of a blend must start at multiples of
/// 16 bytes, all other ranges at multiples of 256. Layers of a blend that follow each other in one buffer, the first at
/// a multiple of 256 bytes, are read directly; others are first copied into one buffer.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum PosePass<'a> {
    /// The weighted sum of layers, as [`Engine::blend`].
    Blend {
        /// Each layer's range and weight.
        layers: &'a [(VulkanBuffer, f32)],
    },
    /// Slerp between two poses, as [`Engine::mix`].
    Mix {
        /// The rotations at weight 0.
        from: VulkanBuffer,
        /// The rotations at weight 1.
        to: VulkanBuffer,
        /// The weight, 0 to 1.
        weight: f32,
    },
    /// A base and the weighted difference of a layer from a reference, as [`Engine::add`].
    Add {
        /// The rotations to which the difference is added.
        base: VulkanBuffer,
        /// The rotations whose difference from the reference is added.
        layer: VulkanBuffer,
        /// A rotation for each track. In the layout frame by frame, the references take up to a mebibyte of the
        /// device's memory, or as much as 16 frames if this is more; in the layout track by track, as much as a layer.
        reference: &'a [Quat],
        /// The weight, 0 to 1.
        weight: f32,
    },
    /// Rotations and positions in the world, as [`Engine::world`]; the layout must be frame by frame.
    World {
        /// The rotations in the parents' frames.
        local: VulkanBuffer,
        /// The skeleton, with a joint for each track.
        skeleton: &'a Skeleton,
    },
}

impl PosePass<'_> {
    /// The ranges that the pass reads.
    fn inputs(&self) -> Vec<VulkanBuffer> {
        match *self {
            Self::Blend { layers } => layers.iter().map(|&(layer, _)| layer).collect(),
            Self::Mix { from, to, .. } => vec![from, to],
            Self::Add { base, layer, .. } => vec![base, layer],
            Self::World { local, .. } => vec![local],
        }
    }

    fn weights(&self) -> Vec<f32> {
        match *self {
            Self::Blend { layers } => layers.iter().map(|&(_, weight)| weight).collect(),
            Self::Mix { weight, .. } | Self::Add { weight, .. } => vec![weight],
            Self::World { .. } => Vec::new(),
        }
    }
}

/// A pass over rotations in buffers ([`Engine::pass`]), and the shape of its inputs.
#[derive(Debug, Clone, Copy)]
#[must_use = "a pass does nothing until its result is sent somewhere"]
pub struct PassRequest<'a> {
    engine: &'a Engine,
    pass: PosePass<'a>,
    shape: PassShape,
}

impl Engine {
    /// Starts a pass over rotations in buffers of the device that the engine was made from ([`Engine::from_vulkan`]).
    ///
    /// It blends, mixes or adds layers or evaluates a skeleton, from buffer to buffer, with the bits of
    /// [`Engine::blend`], [`Engine::mix`], [`Engine::add`] and [`Engine::world`]. Nothing is copied to the host.
    /// `tracks`, `samples` and `layout` are the shape of every input.
    ///
    /// [`PassRequest::to_buffer`] runs it at once. [`PassRequest::target`] prepares it for recording into the
    /// application's commands, after the samples of clips
    /// ([`ClipTarget::record`](crate::gpu::clip::ClipTarget::record)) and before the draw calls.
    /// `examples/application_device.rs` evaluates two clips, mixes them and evaluates their skeleton in one
    /// submission.
    pub fn pass<'a>(
        &'a self,
        pass: PosePass<'a>,
        tracks: usize,
        samples: usize,
        layout: Layout,
    ) -> PassRequest<'a> {
        PassRequest {
            engine: self,
            pass,
            shape: (tracks, samples, layout),
        }
    }
}

impl<'a> PassRequest<'a> {
    /// The length of each input in bytes.
    #[must_use]
    pub fn input_bytes(&self) -> u64 {
        let (tracks, samples, _) = self.shape;
        (tracks as u64)
            .saturating_mul(samples as u64)
            .saturating_mul(VALUE)
    }

    /// The length of the result in bytes: that of an input, or twice as much for [`PosePass::World`], whose result is
    /// `[frame][track]`, a rotation `x y z w` and a position `x y z 0` each.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        match self.pass {
            PosePass::World { .. } => self.input_bytes().saturating_mul(2),
            _ => self.input_bytes(),
        }
    }

    /// The device, the pass and its weights, if everything fits.
    fn checked(&self, result: VulkanBuffer) -> Result<(&'a Opened, PassJob<'a>, Vec<f32>), Error> {
        let Some(opened) = self.engine.opened() else {
            return Err(Error::BufferOnCpu);
        };
        if opened.engine().device.owned {
            return Err(Error::BufferOfOther);
        }
        let (tracks, _, layout) = self.shape;
        let (inputs, weights) = (self.pass.inputs(), self.pass.weights());
        let (job, step) = match self.pass {
            PosePass::Blend { layers } => {
                if layers.is_empty() {
                    return Err(PoseError::NoLayer.into());
                }
                check_weights(&weights)?;
                (PassJob::Blend(inputs.clone()), VALUE)
            }
            PosePass::Mix { from, to, weight } => {
                check_fraction(weight)?;
                (PassJob::Mix([from, to]), OFFSET_STEP)
            }
            PosePass::Add {
                base,
                layer,
                reference,
                weight,
            } => {
                check_fraction(weight)?;
                check_references(reference.len(), tracks)?;
                (PassJob::Add([base, layer], reference), OFFSET_STEP)
            }
            PosePass::World { local, skeleton } => {
                check_skeleton(skeleton.len(), tracks)?;
                if layout == Layout::TrackMajor {
                    return Err(PoseError::TrackMajor.into());
                }
                (PassJob::World(local, skeleton.links()), OFFSET_STEP)
            }
        };
        let (read, written) = (self.input_bytes(), self.bytes());
        let engine = opened.engine();
        for buffer in inputs.iter().chain([&result]) {
            buffer.check(&engine.device.raw)?;
        }
        for (index, &input) in inputs.iter().enumerate() {
            check_range(PassOperand::Input(index), input, read, step)?;
        }
        check_range(PassOperand::Result, result, written, OFFSET_STEP)?;
        let overlaps = |input: &VulkanBuffer| {
            let is_before = |a: u64, bytes: u64, b: u64| a.saturating_add(bytes) <= b;
            let apart = is_before(input.offset, read, result.offset)
                || is_before(result.offset, written, input.offset);
            input.buffer == result.buffer && !apart
        };
        if let Some(input) = inputs.iter().position(overlaps) {
            return Err(PoseError::Overlap { input }.into());
        }
        Ok((opened, job, weights))
    }
}

/// Refuses a range that is too short or starts at an offset that a kernel cannot bind.
fn check_range(
    operand: PassOperand,
    range: VulkanBuffer,
    needed: u64,
    step: u64,
) -> Result<(), PoseError> {
    let VulkanBuffer { offset, size, .. } = range;
    match offset.is_multiple_of(step) && size >= needed {
        true => Ok(()),
        false => Err(PoseError::Buffer {
            operand,
            offset,
            size,
            needed,
            step,
        }),
    }
}
