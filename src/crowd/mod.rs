//! Crowds: many instances of one skeleton, each of which plays clips at its own time. One call evaluates all of them,
//! on the CPU or on a Vulkan device, with the same bits.
//!
//! Characters of a game change their clips a few times a second and are drawn at every frame. Therefore a layer of an
//! instance is 16 bytes that change only when another clip is played; its time follows from one clock that counts
//! whole ticks; and the device finds each instance's segments.
//!
//! # Types
//!
//! * [`CrowdLibrary`]: the clips of a skeleton, its masks and reference poses. [`CrowdStorage`] says how it stores clips.
//! * [`Crowd`]: instances with up to four [`CrowdLayer`]s each, and the clock.
//!   [`Engine::crowd`](crate::Engine::crowd) makes one.
//! * [`CrowdFade`]: a layer's weight as a function of the clock.
//! * [`ClipEvent`]: a named moment of a clip; [`Crowd::passed_events`] lists those that instances pass.
//! * [`CrowdOutput`]: which values an evaluation stores for each joint ([`CrowdValues`]), in 32 or 16 bits.
//!   With the feature `vulkan`, a `CrowdStage` continues matrices in a buffer that the application has changed.
//! * [`MotionTables`] and [`MotionStates`]: clips without instances, for the training of models of motion.
//!   [`MotionBuilder`] collects them. With the feature `vulkan`, a `DeviceMotions` has them on a device.
//! * [`BodyTables`] and [`BodyStates`]: the same for a robot's joints and bodies; on a device, `DeviceBodies`.
//!
//! # Steps
//!
//! 1. [`Crowd::set`] packs a layer into its entry and marks the entry as changed.
//! 2. For each layer of each instance, an evaluation computes the tick of the clip, and from it the position among the
//!    key times of each *time base*: a list of key times that channels share.
//! 3. It evaluates the rotation, translation and scale of each joint in the lowest layer and blends the other layers
//!    over it.
//! 4. For matrices in the model it multiplies along the skeleton, level by level, and for skinning matrices also by
//!    the inverse bind matrices.
//!
//! A Vulkan device runs a kernel for each step over a window of instances; on the CPU, a task does all steps for 32
//! instances.

// Inside
//
// The clips of a library are flat tables (`clip_tables`). A clip has time bases, and a time base has spans. Each joint
// of a clip has a rotation, a translation and a scale; each of these has a form and cells of four numbers. Each layer
// of an instance is an entry of 16 bytes (`instances`); weights that fade are written into it as the clock moves
// (`fade`). Positions are found by `twin::crowd_times`; layers are laid over each other by `lay_over` and
// `twin::crowd_layers`; `gpu::crowd` runs the kernels, `on_cpu` their twins.
//
// If channels have the same form and time base, their cells are stored side by side, constant by constant, so that
// neighbouring joints are neighbouring lanes. Motion tables store keys instead of segments for arcs and lines
// (`clip_keys`); crowds do so for cubics too if this is requested (`compact`). A device keeps the tables. Entries that
// changed are written to it with the next evaluation. Positions are kept only while a window is evaluated.

pub(crate) mod body_states;
pub(crate) mod channel_curve;
pub(crate) mod clip_keys;
pub(crate) mod clip_tables;
pub(crate) mod compact;
#[cfg(feature = "vulkan")]
pub(crate) mod device_bodies;
#[cfg(feature = "vulkan")]
pub(crate) mod device_motions;
pub(crate) mod events;
pub(crate) mod fade;
pub(crate) mod instances;
pub(crate) mod lay_over;
pub(crate) mod layer;
pub(crate) mod library;
pub(crate) mod on_cpu;
pub(crate) mod player;
pub(crate) mod stages;
pub(crate) mod states;
mod tree_walk;

pub use crate::crowd::body_states::{BodyStates, BodyTables};
pub use crate::crowd::clip_keys::KeyPrecision;
pub use crate::crowd::compact::CrowdStorage;
#[cfg(feature = "vulkan")]
pub use crate::crowd::device_bodies::DeviceBodies;
#[cfg(feature = "vulkan")]
pub use crate::crowd::device_motions::DeviceMotions;
pub use crate::crowd::events::{ClipEvent, PassedEvent};
pub use crate::crowd::fade::CrowdFade;
pub use crate::crowd::layer::{CrowdLayer, LayerBlend};
pub use crate::crowd::library::{CrowdLibrary, MotionBuilder, MotionClip};
pub use crate::crowd::player::Crowd;
pub use crate::crowd::states::{FrameStep, MotionStates, MotionTables, MotionWords};
pub use crate::crowd_error::CrowdError;
#[cfg(feature = "vulkan")]
pub use crate::gpu::motion::MappedStates;
#[cfg(feature = "vulkan")]
pub use crate::output::crowd::CrowdStage;
pub use crate::output::crowd::{CrowdOutput, CrowdValues};
#[cfg(feature = "vulkan")]
pub use crate::output::states::{BodyArray, StateArray};
