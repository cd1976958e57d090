//! The files that Tumble reads and writes: keyframes in (`.dat`), clips in and out (BVH, Parquet,
//! Arrow, CSV, TUM), results out (NPY, Parquet, Arrow, CSV), one file a format; what is wrong with an
//! input ([`Diagnostic`]); and sets of any size to play with ([`generate`](mod@generate)).

pub mod adjust;
#[cfg(feature = "parquet")]
pub mod arrow;
pub mod bvh;
pub mod csv;
pub mod dat;
mod decimal;
pub mod diagnostic;
pub mod format;
pub mod generate;
mod grid;
pub mod keyed;
pub mod keys;
pub mod map;
pub mod motion;
mod names;
pub mod npy;
pub mod output;
#[cfg(feature = "parquet")]
pub mod parquet;
pub mod poses;
mod quaternion;
pub mod sample;
mod source;
mod table;
mod text;
pub mod times;
pub mod tum;
mod warnings;
pub mod world;

pub use crate::diagnostic::{Code, Diagnostic, Place, Severity};
pub use crate::format::{FORMATS, Format, Loaded, ReadOptions};
pub use crate::text::lines::Limits;
