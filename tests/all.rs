//! Every test of the engine: a program for each file would link the library, and compile what
//! it makes of generic functions, as often as there are files.
//! `cargo test --test all motion::` runs those of one file.

// Tests may use what systems round differently (clippy.toml).
#![allow(clippy::disallowed_methods)]

mod accuracy;
mod bit_identity;
mod c2;
mod crowd;
mod encoding;
mod examples;
#[cfg(target_os = "linux")]
mod exported;
mod external_vectors;
mod extremes;
mod follow;
mod golden;
mod mesa;
mod method_lists;
mod motion;
mod names;
mod numbers;
mod original;
mod outside;
mod poses;
mod reduce;
mod sparse_samples;
mod speed;
mod spirv;
mod stream;
mod textbook;
mod threads;
mod tidy;
mod times;
mod transforms;
mod validation;
mod verify;
mod vulkan;
mod widths;

#[path = "support/application.rs"]
mod application;
#[path = "support/layer.rs"]
mod layer;
mod support;
