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
//! - [`FORMATS`], the table of all formats, and [`format::registry`]: which of them a file is in.
//!
//! Files that hold no clips have tables of the same kind: [`SURFACES`] (meshes and nets of control points:
//! [`surface`]) and [`PATHS`] ([`path`]).
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
pub mod surface;
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
pub use crate::format::{Format, Loaded, ReadOptions};
use crate::path::PathFormat;
use crate::surface::SurfaceFormat;
pub use crate::text::lines::Limits;

/// Every format; a format is a file that names it in a `FORMAT`, and one line here. All of them are read. Help,
/// the choice by a file's name, walks over directories, completions, messages, documents and tests walk
/// this table. Inputs are known by their first bytes, then by the ending of their name; the first format is that
/// of inputs which tell neither way, the first of [`Format::writable`] that of such outputs.
pub static FORMATS: &[&Format] = &[
    &dat::FORMAT,
    &gltf::FORMAT,
    &bvh::FORMAT,
    #[cfg(feature = "fbx")]
    &fbx::FORMAT,
    &npz::FORMAT,
    &npy::FORMAT,
    #[cfg(feature = "parquet")]
    &parquet::FORMAT,
    #[cfg(feature = "parquet")]
    &arrow::FORMAT,
    &csv::FORMAT,
    &tum::FORMAT,
    &euroc::FORMAT,
    &kitti::FORMAT,
    #[cfg(feature = "mcap")]
    &mcap::FORMAT,
];

/// Every format of surfaces, of which files are known by the ending of their name.
pub static SURFACES: &[&SurfaceFormat] = &[
    &surface::obj::FORMAT,
    &surface::ply::FORMAT,
    &gltf::meshes::SURFACE,
    &surface::net::FORMAT,
];

/// Every format of paths, of which files are known by their first bytes; the first is that of inputs which do not
/// tell.
pub static PATHS: &[&PathFormat] = &[&path::csv::FORMAT, &path::npy::FORMAT];
