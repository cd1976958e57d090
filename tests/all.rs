//! Every test of the engine. A program for each file would link the library and compile its generic
//! functions once per file. `cargo test --test all motion::` runs those of one file.

// Tests may use what systems round differently (clippy.toml).
#![allow(clippy::disallowed_methods)]

mod accuracy;
mod bit_identity;
mod buffers;
mod c2;
#[cfg(feature = "vulkan")]
mod crowd;
mod encoding;
#[cfg(feature = "vulkan")]
mod exact_functions;
#[cfg(feature = "vulkan")]
mod examples;
#[cfg(all(feature = "vulkan", target_os = "linux"))]
mod exported;
mod external_vectors;
mod extremes;
mod follow;
mod golden;
#[cfg(feature = "vulkan")]
mod mesa;
mod method_lists;
mod motion;
mod names;
mod numbers;
mod original;
#[cfg(feature = "vulkan")]
mod other_kernels;
mod outside;
mod per_track;
mod poses;
mod reduce;
#[cfg(feature = "vulkan")]
mod sampler;
mod scalars;
mod sparse_samples;
#[cfg(feature = "vulkan")]
mod speed;
#[cfg(feature = "vulkan")]
mod spirv;
mod stream;
mod textbook;
#[cfg(feature = "vulkan")]
mod threads;
#[cfg(feature = "vulkan")]
mod tidy;
#[cfg(feature = "vulkan")]
mod timed;
mod times;
mod transforms;
#[cfg(feature = "vulkan")]
mod validation;
mod verify;
#[cfg(feature = "vulkan")]
mod vulkan;
mod widths;

#[cfg(feature = "vulkan")]
#[path = "support/application.rs"]
mod application;
#[cfg(feature = "vulkan")]
#[path = "support/layer.rs"]
mod layer;
mod support;
