//! The files that Tumble reads and writes, one file or folder a format, and the table of them
//! ([`FORMATS`]); what is wrong with an input ([`Diagnostic`]); clips of motion files
//! ([`Motion`](motion::Motion)), and how they are sampled ([`sample`]); and sets of any size to play
//! with ([`generate`](mod@generate)).

// Tests may use what systems round differently (clippy.toml).
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod adjust;
#[cfg(feature = "parquet")]
pub mod arrow;
pub mod beneath;
pub mod budget;
pub mod bvh;
pub mod compare;
pub mod csv;
pub mod dat;
mod decimal;
pub mod dense;
pub mod diagnostic;
pub mod euroc;
#[cfg(feature = "fbx")]
pub mod fbx;
pub mod feature;
pub mod format;
pub mod generate;
pub mod gltf;
mod grid;
pub mod guarded;
pub mod keyed;
pub mod keys;
pub mod kitti;
pub mod map;
#[cfg(feature = "mcap")]
pub mod mcap;
pub mod motion;
mod names;
pub mod npy;
pub mod npz;
pub mod origin;
pub mod output;
pub mod packed;
#[cfg(feature = "parquet")]
pub mod parquet;
pub mod path;
pub mod poses;
pub mod printable;
pub mod quaternion;
mod rate;
pub mod reduce;
pub mod rotation_form;
mod rotation_matrix;
pub mod sample;
mod select;
pub mod signs;
pub mod smooth;
mod source;
mod table;
mod text;
pub mod times;
pub mod trajectory;
pub mod trim;
pub mod tum;
mod warnings;
pub mod world;

pub use crate::diagnostic::{Code, Diagnostic, Place, Severity};
pub use crate::feature::Feature;
pub use crate::format::{FORMATS, Format, Loaded, ReadOptions};
pub use crate::text::lines::Limits;
