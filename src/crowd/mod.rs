//! Crowds: many instances of one skeleton, each at its own time in clips of its own, evaluated in one go on the CPU
//! or on a Vulkan device, with the same bits.
//!
//! Thousands of characters change what they play a few times a second and are drawn at every frame. So an instance
//! is 16 bytes that change only when it plays something else, where it stands follows from one clock of whole ticks,
//! and the device finds each instance's segments itself.
//!
//! # Types
//!
//! * [`CrowdLibrary`]: the clips of a skeleton, its masks and reference poses.
//! * [`Crowd`]: instances with up to four [`CrowdLayer`]s each, and the clock; made by
//!   [`Engine::crowd`](crate::Engine::crowd).
//! * [`CrowdFade`]: a layer's weight as a function of the clock.
//! * [`CrowdOutput`]: what an evaluation stores of each joint ([`CrowdValues`]), in 32 or 16 bits.
//! * [`MotionTables`] and [`MotionStates`]: a library's clips without instances, for those who train on motion.
//!
//! # From a call to its bytes
//!
//! 1. [`Crowd::set`] packs a layer into its entry and notes that it changed.
//! 2. An evaluation finds, for each layer of each instance, its tick and from that its position in each time base.
//! 3. It evaluates the rotation, translation and scale of each joint in the lowest layer and lays the others over it.
//! 4. It walks the skeleton down, level by level, and multiplies with the inverse bind matrices where skinning
//!    matrices are asked for.
//!
//! A device does each step by a kernel over a window of instances; the CPU does all of them for 32 instances a task.

// Inside
//
// A library's clips are flat tables (`clip_tables`): per clip its time bases, per time base its spans, per joint a
// rotation, a translation and a scale, each with a form and cells of four numbers. Each layer of an instance is an
// entry of 16 bytes (`instances`); weights that fade are written into it as the clock moves (`fade`). Positions are found by `twin::crowd_times`; layers are laid over each other by
// `lay_over` and `twin::crowd_layers`; `gpu::crowd` runs the kernels, `on_cpu` their twins.
//
// Cells of channels with one form and one time base lie side by side, constant by constant, so that neighbouring
// joints are neighbouring lanes. On a device the tables stay; entries that changed are written with the next
// evaluation; positions live for a window alone.

pub(crate) mod clip_tables;
pub(crate) mod fade;
pub(crate) mod instances;
pub(crate) mod lay_over;
pub(crate) mod layer;
pub(crate) mod library;
pub(crate) mod on_cpu;
pub(crate) mod player;
pub(crate) mod states;

pub use crate::crowd::fade::CrowdFade;
pub use crate::crowd::layer::CrowdLayer;
pub use crate::crowd::library::CrowdLibrary;
pub use crate::crowd::player::Crowd;
pub use crate::crowd::states::{MotionStates, MotionTables, MotionWords};
pub use crate::crowd_error::CrowdError;
pub use crate::output::crowd::{CrowdOutput, CrowdValues};
