//! Tumble for C and C++: the interface that `include/tumble.h` declares.
//!
//! Handles are indices into a table of this library and are never dereferenced, so that one that was
//! freed, or is of another kind, is an error (`handle`). Every function that can fail gives a
//! [`TumbleResult`](result::TumbleResult), with words for it in [`result::tumble_last_error`]; a
//! panic, which is a mistake of ours, ends in the code `INTERNAL` and not in the caller.
// Tests may use what systems round differently (clippy.toml).
#![cfg_attr(test, allow(clippy::disallowed_methods))]
#![allow(unsafe_code)] // pointers of the caller's, and names that C links

mod arguments;
pub mod clip;
pub mod crowd;
pub mod engine;
pub mod file;
mod handle;
pub mod interpolation;
pub mod request;
pub mod result;
pub mod samples;
pub mod set;
pub mod set_vectors;
#[cfg(test)]
mod tests;
pub mod version;
pub mod vulkan;
