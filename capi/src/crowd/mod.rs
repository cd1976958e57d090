//! Crowds: many instances of one skeleton, each of which plays clips at its time and speed.

pub mod events;
pub mod fade;
pub mod file;
pub mod layer;
pub mod library;
pub mod output;
pub mod player;
pub mod stages;
pub mod target;
pub mod visible;
