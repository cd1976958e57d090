//! Every test of the files.

// Tests may use what systems round differently (clippy.toml).
#![allow(clippy::disallowed_methods)]

mod body;
mod bvh;
mod bvh_write;
mod cases;
#[cfg(all(feature = "fbx", feature = "mcap", feature = "parquet"))]
mod codes;
mod dat_fixtures;
mod dialects;
mod end_frame;
#[cfg(feature = "fbx")]
mod fbx;
mod fixtures;
mod glb;
mod gltf;
mod gltf_bake;
mod gltf_gather;
mod gltf_new;
mod gltf_times;
mod gltf_values;
mod kept;
mod layers;
mod learning;
mod left_out;
mod maps;
#[cfg(feature = "mcap")]
mod mcap;
mod mirrored;
mod morphs;
mod npz;
mod origins;
mod pickles;
// The guide has all formats.
#[cfg(all(feature = "fbx", feature = "mcap", feature = "parquet"))]
mod readme;
mod reduce;
mod retarget;
mod robots;
mod root_motion;
mod round_trip;
mod scalars;
mod skins;
mod support;
mod table_options;
#[cfg(feature = "parquet")]
mod table_results;
#[cfg(feature = "parquet")]
mod tables;
mod tum;
mod validator;
