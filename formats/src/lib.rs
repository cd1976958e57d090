//! Reads and writes the file formats of Tumble. Each format is one module; the table [`FORMATS`] lists them. Errors
//! and warnings about inputs are of type [`Diagnostic`]. A clip of a motion file is a [`Motion`](motion::Motion);
//! [`sample`] evaluates it. [`generate`](mod@generate) makes sets of any size for tests.
//!
//! The modules from the bottom up; each may use those before it:
//!
//! - inputs and errors in them: [`diagnostic`], [`budget`], [`beneath`], and the private modules `source` and `text`;
//! - [`motion`]: clips, the contents of files, and operations on them: [`sample`], [`reduce`](mod@reduce),
//!   [`trim`](mod@trim), [`adjust`](mod@adjust), [`compare`], [`skeleton`] and others;
//! - [`format`](mod@format): the description of a format, and the options of reading and writing; [`feature`]: what
//!   formats can store;
//! - the formats: [`dat`], [`bvh`], [`gltf`] and others; CSV, Parquet and Arrow share the private module `table`;
//! - [`FORMATS`], the table of all formats, and [`format::registry`], which searches it.
//!
//! Formats of other files have tables of the same kind: [`SURFACES`] for meshes and nets of control points
//! ([`surface`]), and [`PATHS`] for paths ([`path`]).

// Tests may use functions whose last bit differs between systems (clippy.toml).
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod array;
#[cfg(feature = "parquet")]
pub mod arrow;
pub mod beneath;
pub mod budget;
pub mod bvh;
pub mod csv;
pub mod dat;
mod decimal;
pub mod diagnostic;
pub mod dialect;
pub mod euroc;
#[cfg(feature = "fbx")]
pub mod fbx;
pub mod feature;
pub mod folder;
mod foreign;
pub mod format;
pub mod generate;
pub mod gltf;
pub mod guarded;
pub mod kitti;
pub mod learning;
mod limits;
pub mod map;
#[cfg(feature = "mcap")]
pub mod mcap;
pub mod motion;
mod names;
pub mod npy;
pub mod npz;
pub mod output;
#[cfg(feature = "parquet")]
pub mod parquet;
pub mod path;
pub mod pickle;
pub mod printable;
pub mod quaternion;
mod rate;
pub mod referred;
pub mod retarget;
pub mod robot;
pub mod rotation_form;
mod rotation_matrix;
mod source;
pub mod surface;
mod table;
mod text;
mod time_order;
pub mod times;
pub mod tum;
mod warnings;

pub use crate::diagnostic::{Code, Diagnostic, Location, Severity};
pub use crate::feature::Feature;
pub use crate::format::{Format, Loaded, ReadOptions};
pub use crate::limits::Limits;
pub use crate::motion::{
    adjust, carried_mesh, collapse, compare, crowd_library, end_frame, join, keyed, keys, origin,
    outside, packed, poses, reduce, retime, root_motion, sample, scalars, signs, skeleton, smooth,
    trajectory, trim, world,
};
use crate::path::PathFormat;
pub use crate::source::file_kind;
use crate::surface::SurfaceFormat;

/// All formats. To add one, write a module with a `FORMAT`, and add a line here. Help, the choice of a format by a
/// file's name, searches of directories, completions, messages, documentation and tests use this table. Every format
/// can be read. [`Format::detect`] finds the format of an input; the first format is the default. The first of
/// [`Format::writable`] is the default for outputs.
pub static FORMATS: &[&Format] = &[
    &dat::FORMAT,
    &gltf::FORMAT,
    &bvh::FORMAT,
    #[cfg(feature = "fbx")]
    &fbx::FORMAT,
    // Before NPZ: files of PyTorch are ZIP archives too.
    &pickle::format::FORMAT,
    &pickle::format::TORCH,
    &npz::FORMAT,
    &npy::FORMAT,
    #[cfg(feature = "parquet")]
    &parquet::FORMAT,
    #[cfg(feature = "parquet")]
    &arrow::FORMAT,
    &csv::FORMAT,
    &dialect::json::FORMAT,
    &tum::FORMAT,
    &euroc::FORMAT,
    &kitti::FORMAT,
    #[cfg(feature = "mcap")]
    &mcap::FORMAT,
];

/// All formats of surfaces. A file's format is recognised by its extension.
pub static SURFACES: &[&SurfaceFormat] = &[
    &surface::obj::FORMAT,
    &surface::ply::FORMAT,
    &gltf::meshes::SURFACE,
    &surface::net::FORMAT,
];

/// All formats of paths. A file's format is recognised by its first bytes; the first format is the default.
pub static PATHS: &[&PathFormat] = &[
    &path::csv::FORMAT,
    &path::npy::FORMAT,
    #[cfg(feature = "mcap")]
    &mcap::PATH_FORMAT,
];
