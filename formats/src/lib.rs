//! The files that Tumble reads and writes, one file or folder a format, and the table of them
//! ([`FORMATS`]); what is wrong with an input ([`Diagnostic`]); clips of motion files
//! ([`Motion`](motion::Motion)), and how they are sampled ([`sample`]); and sets of any size to play
//! with ([`generate`](mod@generate)).
//!
//! From the bottom to the top, where code uses what lies below it:
//!
//! - inputs and their faults: [`diagnostic`], [`budget`], [`beneath`], and the private modules `source` and `text`;
//! - what files hold: [`motion`], [`feature`], [`carried_mesh`], [`poses`];
//! - [`format`](mod@format): what a format is, and the options of reading and writing;
//! - the formats: [`dat`], [`bvh`], [`gltf`] and the others; CSV, Parquet and Arrow share the private module `table`;
//! - [`format::registry`]: the list of all formats, and which of them a file is in.
//!
//! Beside them stands what is made of clips: [`sample`], [`reduce`](mod@reduce), [`trim`](mod@trim),
//! [`adjust`](mod@adjust), [`compare`].

// Tests may use what systems round differently (clippy.toml).
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod adjust;
#[cfg(feature = "parquet")]
pub mod arrow;
pub mod beneath;
pub mod budget;
pub mod bvh;
pub mod carried_mesh;
pub mod compare;
pub mod csv;
pub mod dat;
mod decimal;
pub mod diagnostic;
pub mod euroc;
#[cfg(feature = "fbx")]
pub mod fbx;
pub mod feature;
pub mod format;
pub mod generate;
pub mod gltf;
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

pub use crate::diagnostic::{Code, Diagnostic, Location, Severity};
pub use crate::feature::Feature;
pub use crate::format::registry::FORMATS;
pub use crate::format::{Format, Loaded, ReadOptions};
pub use crate::text::lines::Limits;
