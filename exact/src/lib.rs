//! SPIR-V that gives the same bits on every Vulkan driver.
//!
//! Vulkan requires correct rounding of `+ - *` on f32, but lets a driver fuse a multiplication with an addition and reorder
//! sums. It defines division, roots and functions such as sine only within bounds. This crate
//!
//! * decorates the operations of a compute shader so that a driver must do them as written ([`exact`]), whichever
//!   compiler made the shader (naga, glslang, DXC, rust-gpu);
//! * finds the operations that Vulkan does not define to the last bit, with their lines ([`inexact`]);
//! * adds the float controls that a device offers ([`float_controls`]), and takes the decorations away again for a
//!   control experiment ([`without_decorations`]);
//! * has sine, cosine, roots, reciprocal and arc tangent in WGSL and in Rust with the same bits ([`functions`]).
//!
//! ```
//! use naga::valid::{Capabilities, ValidationFlags, Validator};
//! use tumble_exact::functions::WGSL;
//!
//! let shader = "
//!     @group(0) @binding(0) var<storage, read_write> values: array<f32>;
//!     @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
//!         values[id.x] = sine_cosine(values[id.x]).x * reciprocal(3.0);
//!     }";
//! // naga compiles it here; any compiler will do.
//! let module = naga::front::wgsl::parse_str(&[shader, WGSL].concat())?;
//! let info = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module)?;
//! let spirv = naga::back::spv::write_vec(&module, &info, &Default::default(), None)?;
//!
//! let same_everywhere = tumble_exact::exact(&spirv)?;
//! assert!(tumble_exact::inexact(&same_everywhere)?.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The pass cannot see whether a driver obeys. Compare the results of a shader with those of the same operations on
//! `f32` in Rust, which are exact. Compare also without the decorations, because a comparison that never fails shows
//! nothing. The engine `tumble` does both for its own kernels when it opens a device (`tumble devices`).
//!
//! Drivers may flush subnormal numbers to zero, or keep them, and few say which. Therefore keep every number either 0
//! or much larger in magnitude than 2^-126, for example by [`functions::flushed`].

mod controls;
pub mod functions;
#[allow(dead_code)] // A constant that only shaders use.
mod generated;
mod operations;
mod pass;
pub mod spirv;

pub use crate::controls::{FloatControls, float_controls, without_decorations};
pub use crate::operations::{InexactOperation, inexact};
pub use crate::pass::{
    PassError, exact, no_contraction, no_contraction_with_f16, nontemporal_stores, splat_products,
    texel_buffers, workgroup_layouts,
};
pub use crate::spirv::SpirvError;
