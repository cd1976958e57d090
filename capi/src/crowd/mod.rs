//! Crowds: many instances of one skeleton, each at its own time in clips of its own.

pub mod fade;
pub mod file;
pub mod layer;
pub mod library;
pub mod output;
pub mod player;
pub mod target;
pub mod visible;
