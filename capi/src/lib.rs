//! Tumble for C and C++: the interface that `include/tumble.h` declares.
//!
//! Handles are keys of a table in this library and are never dereferenced, so a handle that was freed or has another
//! type is an error (module `handle`). Every function that can fail returns a [`TumbleResult`](result::TumbleResult),
//! and [`result::tumble_last_error`] returns its message. A panic, which is an error of this library, does not reach
//! the caller: the call returns the code `INTERNAL`.
// Tests may use functions whose last bit differs between systems (clippy.toml).
#![cfg_attr(test, allow(clippy::disallowed_methods))]
#![allow(unsafe_code)] // because of pointers of the caller, and of functions that C finds by name

mod arguments;
pub mod clip;
pub mod crowd;
pub mod engine;
pub mod file;
mod handle;
pub mod interpolation;
pub mod pass;
pub mod request;
pub mod result;
pub mod sampler;
pub mod samples;
pub mod scalars;
pub mod set;
pub mod set_vectors;
mod skeleton;
#[cfg(test)]
mod tests;
pub mod timed;
pub mod version;
pub mod vulkan;
