//! Passes over rotations that lie in buffers of an application's device: what is asked, and whether it fits.

mod application_device;

use glam::Quat;

use crate::engine::Engine;
use crate::error::Error;
use crate::evaluate::Backend;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::pass_target::{PassJob, PassShape, VALUE};
use crate::gpu::recovery::Opened;
use crate::output::pose_error::{
    OFFSET_STEP, PassOperand, PoseError, check_fraction, check_references, check_skeleton,
    check_weights,
};
use crate::output::rotations::Layout;
use crate::pose::skeleton::Skeleton;

/// A pass over rotations that lie in buffers of an application's device, each a range of four f32 a rotation, as
/// [`Request::to_buffer`](crate::engine::clip::request::Request::to_buffer) and
/// [`ClipTarget::record`](crate::gpu::clip_target::ClipTarget::record) leave them there. [`Engine::pass`] takes it.
///
/// Ranges start at multiples of 256 bytes, layers of a blend at multiples of 16. Layers that lie one behind the other in
/// one buffer, from a multiple of 256 bytes on, are read where they lie; others are copied together first.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum PosePass<'a> {
    /// Layers with their weights, as [`Engine::blend`].
    Blend {
        /// Each layer's range and weight.
        layers: &'a [(VulkanBuffer, f32)],
    },
    /// Slerp from one to another, as [`Engine::mix`].
    Mix {
        /// At weight 0.
        from: VulkanBuffer,
        /// At weight 1.
        to: VulkanBuffer,
        /// From 0 to 1.
        weight: f32,
    },
    /// A layer added to a base, as [`Engine::add`].
    Add {
        /// What is added to.
        base: VulkanBuffer,
        /// What is added.
        layer: VulkanBuffer,
        /// A rotation for each track. Frame by frame they take up to a megabyte of the device's memory, or 16
        /// frames; track by track as much as a layer.
        reference: &'a [Quat],
        /// From 0 to 1.
        weight: f32,
    },
    /// Rotations and positions in the world, as [`Engine::world`]: of rotations that lie frame by frame.
    World {
        /// Rotations in their parents' frames.
        local: VulkanBuffer,
        /// A link for each track.
        skeleton: &'a Skeleton,
    },
}

impl PosePass<'_> {
    /// What it reads.
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

/// A pass over rotations in buffers ([`Engine::pass`]), and their shape.
#[derive(Debug, Clone, Copy)]
#[must_use = "a pass does nothing until its result is sent somewhere"]
pub struct PassRequest<'a> {
    engine: &'a Engine,
    pass: PosePass<'a>,
    shape: PassShape,
}

impl Engine {
    /// A pass over rotations that lie in buffers of the device that the engine was made from
    /// ([`Engine::from_vulkan`]): layers are blended, mixed or added, or a skeleton is walked, from buffer to buffer,
    /// with the bits of [`Engine::blend`], [`Engine::mix`], [`Engine::add`] and [`Engine::world`]. Nothing comes to
    /// the host. `tracks`, `samples` and `layout` are those of every input.
    ///
    /// [`PassRequest::to_buffer`] runs it at once; [`PassRequest::target`] makes it ready to be recorded into the
    /// application's commands, behind the samples of clips
    /// ([`ClipTarget::record`](crate::gpu::clip_target::ClipTarget::record)) and before whatever draws.
    /// `examples/application_device.rs` evaluates two clips, mixes them and walks their skeleton in one submission.
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
    /// Bytes of each input.
    #[must_use]
    pub fn input_bytes(&self) -> u64 {
        let (tracks, samples, _) = self.shape;
        (tracks as u64)
            .saturating_mul(samples as u64)
            .saturating_mul(VALUE)
    }

    /// Bytes of the result: those of an input, or twice as many in the world, where `[frame][track]` a rotation
    /// `x y z w` and a position `x y z 0` lie.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        match self.pass {
            PosePass::World { .. } => self.input_bytes().saturating_mul(2),
            _ => self.input_bytes(),
        }
    }

    /// The device, the pass and its weights, where all fits.
    fn checked(&self, result: VulkanBuffer) -> Result<(&'a Opened, PassJob<'a>, Vec<f32>), Error> {
        let Backend::Vulkan(opened) = &*self.engine.backend else {
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

/// Refuses a range that starts where no kernel can bind it, or that is too short.
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
