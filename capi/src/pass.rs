//! Passes over rotations in buffers of an application's Vulkan device: blends, mixes, additions, and skeletons.

use std::ffi::c_void;
use std::sync::RwLock;

use glam::Quat;
use tumble::vulkan::{PassRequest, PassTarget, PosePass, VulkanBuffer};
use tumble::{Error, Skeleton};

use crate::arguments::{Out, SizedStructure, list, needed, option, product, vulkan};
use crate::engine::TumbleEngine;
use crate::handle::{self, Object};
use crate::result::{Failure, TumbleResult, code};
use crate::samples::layout;
use crate::skeleton::joints;
use crate::vulkan::buffer_range;

/// The operation of a pass. Each has the bits of the same operation on the CPU.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumblePassOperation {
    /// The weighted sum of layers, normalized. Inputs: one or more layers, with a weight for each, finite and within
    /// ±1e9.
    Blend = 0,
    /// Slerp between two inputs, with one weight, 0 to 1: at 0 the result is the first input.
    Mix = 1,
    /// The first input, and the weighted difference of the second from `reference`, with one weight, 0 to 1.
    Add = 2,
    /// Rotations and positions in the world, of the skeleton `parents` and `offsets`. The one input is the rotations in
    /// the parents' frames. No weight; the layout must be `TUMBLE_LAYOUT_FRAME_MAJOR`.
    World = 3,
}

/// A range of a Vulkan buffer.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleBufferRange {
    /// The `VkBuffer`, as a number: `(uint64_t)buffer`.
    pub buffer: u64,
    /// The start of the range in bytes.
    pub offset: u64,
    /// The length of the range in bytes.
    pub size: u64,
}

/// A pass over rotations in buffers of an application's Vulkan device. Each input has four f32 `x y z w` for each
/// sample of each track, as `tumble_clip_evaluate_to_buffer` and `tumble_clip_record` write them.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumblePass {
    /// `sizeof(TumblePass)`.
    pub size: usize,
    /// A `TumblePassOperation`.
    pub operation: u32,
    /// A `TumbleLayout`, of every input and of the result.
    pub layout: u32,
    /// The number of tracks of every input.
    pub track_count: usize,
    /// The number of samples of each track.
    pub sample_count: usize,
    /// The inputs, as the operation says. Each range has at least 16 × `track_count` × `sample_count` bytes. For
    /// `TUMBLE_PASS_OPERATION_BLEND`, each range must start at a multiple of 16; for other operations, at a multiple of
    /// 256. Layers of a blend that follow each other in one buffer, the first at a multiple of 256, are read directly;
    /// others are first copied into one buffer.
    pub inputs: *const TumbleBufferRange,
    /// The number of `inputs`.
    pub input_count: usize,
    /// The weights, as the operation says.
    pub weights: *const f32,
    /// The number of `weights`.
    pub weight_count: usize,
    /// For `TUMBLE_PASS_OPERATION_ADD`: a rotation `x y z w` for each track.
    pub reference: *const f32,
    /// For `TUMBLE_PASS_OPERATION_WORLD`: the index of each joint's parent, -1 for a root, with a joint for each track.
    pub parents: *const i32,
    /// For `TUMBLE_PASS_OPERATION_WORLD`: the position `x y z` of each joint in its parent's frame; null: all are 0.
    pub offsets: *const f32,
}

// SAFETY: `repr(C)`, the size is the first member, and zero bits are valid numbers and null pointers.
unsafe impl SizedStructure for TumblePass {
    const FIRST_SIZE: usize = size_of::<Self>();
}

/// The inputs and weights of a pass must be as many as its operation takes.
fn exactly<const N: usize, T: Copy>(found: &[T], name: &str) -> Result<[T; N], Failure> {
    found.try_into().map_err(|_| {
        let found = found.len();
        Failure::argument(format!(
            "`pass->{name}` is {found}; this operation takes {N}"
        ))
    })
}

impl TumblePass {
    /// Calls `work` with the pass of a structure; null is an error.
    ///
    /// # Safety
    /// The pointer must be null or point to such a structure, whose pointers are null or as its members say.
    unsafe fn read<T>(
        pointer: *const Self,
        engine: &TumbleEngine,
        work: impl FnOnce(PassRequest<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        // SAFETY: as the caller promises.
        let structure = unsafe { needed(pointer, "pass")? };
        let operations = [
            TumblePassOperation::Blend,
            TumblePassOperation::Mix,
            TumblePassOperation::Add,
            TumblePassOperation::World,
        ];
        let operation = option(structure.operation, &operations, "pass->operation")?;
        let layout = layout(structure.layout)?;
        // SAFETY: as the caller promises.
        let (inputs, weights) = unsafe {
            (
                list(structure.inputs, structure.input_count, "pass->inputs")?,
                list(structure.weights, structure.weight_count, "pass->weights")?,
            )
        };
        let range = |input: &TumbleBufferRange| {
            let TumbleBufferRange {
                buffer,
                offset,
                size,
            } = *input;
            buffer_range(engine.is_on_application_device, buffer, offset, size)
        };
        let inputs: Vec<VulkanBuffer> = inputs.iter().map(range).collect::<Result<_, _>>()?;
        let tracks = structure.track_count;
        let (layers, reference, skeleton): (Vec<_>, Vec<Quat>, Skeleton);
        let pass = match operation {
            TumblePassOperation::Blend => {
                if inputs.len() != weights.len() {
                    return Err(Failure::argument(format!(
                        "`pass->weight_count` is {}, and there are {} layers; give a weight for each",
                        weights.len(),
                        inputs.len()
                    )));
                }
                layers = inputs.into_iter().zip(weights.iter().copied()).collect();
                PosePass::Blend { layers: &layers }
            }
            TumblePassOperation::Mix => {
                let [from, to] = exactly(&inputs, "input_count")?;
                let [weight] = exactly(weights, "weight_count")?;
                PosePass::Mix { from, to, weight }
            }
            TumblePassOperation::Add => {
                let [base, layer] = exactly(&inputs, "input_count")?;
                let [weight] = exactly(weights, "weight_count")?;
                let numbers = product::<f32>(tracks, 4, "pass->reference")?;
                // SAFETY: as the caller promises.
                let numbers = unsafe { list(structure.reference, numbers, "pass->reference")? };
                let (rotations, _) = numbers.as_chunks::<4>();
                reference = rotations.iter().copied().map(Quat::from_array).collect();
                PosePass::Add {
                    base,
                    layer,
                    reference: &reference,
                    weight,
                }
            }
            TumblePassOperation::World => {
                let [local] = exactly(&inputs, "input_count")?;
                let [] = exactly(weights, "weight_count")?;
                // SAFETY: as the caller promises.
                let joints = unsafe { joints(structure.parents, structure.offsets, tracks)? };
                let (parents, offsets) = joints.into_iter().unzip();
                skeleton = Skeleton::new(parents, offsets)?;
                PosePass::World {
                    local,
                    skeleton: &skeleton,
                }
            }
        };
        work((engine.inner).pass(pass, tracks, structure.sample_count, layout))
    }
}

/// Returns the size of a pass's result in bytes: 16 for each sample of each track, or 32 for
/// `TUMBLE_PASS_OPERATION_WORLD`, whose result is a rotation `x y z w` and a position `x y z 0` each.
///
/// # Errors
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if a constant is unknown, the number of inputs or weights is not the operation's,
///   or the engine was not created by `tumble_engine_from_vulkan`.
/// - `TUMBLE_RESULT_INVALID_POINTER` if an array is null.
/// - `TUMBLE_RESULT_INVALID_INPUT` if the skeleton is refused.
///
/// # Safety
/// `pass` must point to a `TumblePass` whose pointers are null or as its members say, and `bytes` must point to memory
/// for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_pass_bytes(
    engine: *const TumbleEngine,
    pass: *const TumblePass,
    bytes: *mut u64,
) -> TumbleResult {
    code(|| {
        let out = Out::new(bytes, "bytes")?;
        let engine = handle::get(engine)?;
        // SAFETY: as the caller promises.
        unsafe {
            let bytes = TumblePass::read(pass, &engine, |request| Ok(request.bytes()))?;
            out.set(bytes);
        }
        Ok(())
    })
}

/// Runs a pass whose result goes to a range of a buffer, and waits for the result. Commands that are submitted to the
/// engine's queue afterwards see the result; the inputs may be written by commands that were submitted there before.
///
/// The range starts at a multiple of 256, has at least the bytes of `tumble_pass_bytes`, and does not overlap an
/// input. All buffers must belong to the engine's device, be bound to memory, and have the usage
/// `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT`; layers of a blend that are not contiguous need
/// `VK_BUFFER_USAGE_TRANSFER_SRC_BIT` too. This call submits to the engine's queue.
///
/// # Errors
/// - As `tumble_pass_bytes`.
/// - `TUMBLE_RESULT_WRONG_SIZE` if a range is not aligned or too short.
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if there is no layer, a weight is out of its range, the layout for a skeleton is
///   track by track, or the result overlaps an input.
/// - `TUMBLE_RESULT_DEVICE` if the device fails.
///
/// # Safety
/// `pass` must point to a `TumblePass` whose pointers are null or as its members say; the buffers must be as
/// described, and nothing else may use the ranges during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_pass_to_buffer(
    engine: *const TumbleEngine,
    pass: *const TumblePass,
    buffer: u64,
    offset: u64,
    size: u64,
) -> TumbleResult {
    code(|| {
        let engine = handle::get(engine)?;
        let result = buffer_range(engine.is_on_application_device, buffer, offset, size)?;
        // SAFETY: as the caller promises.
        unsafe { TumblePass::read(pass, &engine, |request| Ok(request.to_buffer(result)?)) }
    })
}

/// A pass target: a pass, prepared for recording into command buffers, and the range of the application's buffer that
/// receives its result.
pub struct TumblePassTarget {
    inner: RwLock<PassTarget>,
}

impl Object for TumblePassTarget {
    const NAME: &'static str = "pass target";
}

/// Prepares the recording of a pass, whose result goes to a range of the application's Vulkan buffer.
///
/// The kernel is compiled and memory is allocated here, not when a frame is recorded. If the kernel was not checked
/// before, this call checks it; only then it submits to the engine's queue. The buffers must be as `tumble_pass_to_buffer`
/// says. The target does not need the engine afterwards. The application frees the target with
/// `tumble_pass_target_free` before it destroys a buffer or the device.
///
/// # Errors
/// As `tumble_pass_to_buffer`.
///
/// # Safety
/// `pass` must point to a `TumblePass` whose pointers are null or as its members say; the buffers must be as
/// described; and `target` must point to memory for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_pass_target_new(
    engine: *const TumbleEngine,
    pass: *const TumblePass,
    buffer: u64,
    offset: u64,
    size: u64,
    target: *mut *mut TumblePassTarget,
) -> TumbleResult {
    code(|| {
        let out = Out::new(target, "target")?;
        let engine = handle::get(engine)?;
        let result = buffer_range(engine.is_on_application_device, buffer, offset, size)?;
        // SAFETY: as the caller promises.
        let made =
            unsafe { TumblePass::read(pass, &engine, |request| Ok(request.target(result)?))? };
        let inner = RwLock::new(made);
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(TumblePassTarget { inner })) };
        Ok(())
    })
}

/// Sets the weights of a pass target for later recordings: as many as the pass has. Commands that are already recorded
/// keep theirs.
///
/// # Errors
/// `TUMBLE_RESULT_INVALID_ARGUMENT` if the number of weights is another, or a weight is out of its range; then none is
/// set.
///
/// # Safety
/// `weights` must have `weight_count` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_pass_set_weights(
    target: *const TumblePassTarget,
    weights: *const f32,
    weight_count: usize,
) -> TumbleResult {
    code(|| {
        let target = handle::get(target)?;
        // SAFETY: as the caller promises.
        let weights = unsafe { list(weights, weight_count, "weights")? };
        let mut inner = handle::locked::<TumblePassTarget, _>(target.inner.write())?;
        inner.set_weights(weights).map_err(Error::from)?;
        Ok(())
    })
}

/// Records a pass into the application's command buffer `commands`, a `VkCommandBuffer`.
///
/// Nothing is submitted, waited for or allocated. The weights stay in the commands. Barriers are included: the pass
/// waits for all commands that were recorded before it, such as those of `tumble_clip_record`, and all commands after
/// it see the result. The commands may be submitted any number of times; all recordings of one target must run on one
/// queue.
///
/// The command buffer must belong to the engine's device and to a queue family that can compute, and must be in the
/// recording state, outside a render pass.
///
/// # Safety
/// The command buffer must be as described, and nothing else may use it during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_pass_record(
    target: *const TumblePassTarget,
    commands: *mut c_void,
) -> TumbleResult {
    code(|| {
        let target = handle::get(target)?;
        let commands = vulkan(commands, "commands")?;
        let inner = handle::locked::<TumblePassTarget, _>(target.inner.read())?;
        // SAFETY: as the caller promises.
        unsafe { inner.record(commands) };
        Ok(())
    })
}

/// Frees a pass target. Does nothing if `target` is null.
///
/// # Safety
/// All work that was recorded with the target must have ended, and none may be submitted later.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_pass_target_free(target: *mut TumblePassTarget) -> TumbleResult {
    code(|| handle::free(target))
}
