//! The files that Tumble reads and writes: keyframes in (`.dat`, NPZ, NPY), results out (NPZ, NPY, CSV),
//! one file a format; what is wrong with an input ([`Diagnostic`]); and sets of any size to
//! play with ([`generate`](mod@generate)).

pub mod csv;
pub mod dat;
pub mod diagnostic;
pub mod format;
pub mod generate;
mod grid;
pub mod keys;
pub mod map;
pub mod motion;
pub mod npy;
pub mod npz;
pub mod output;
pub mod poses;
mod quaternion;
mod source;
mod text;
pub mod times;
mod warnings;

pub use crate::diagnostic::{Code, Diagnostic, Place, Severity};
pub use crate::format::{FORMATS, Format, Loaded, ReadOptions};
pub use crate::text::lines::Limits;
