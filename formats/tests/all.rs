//! Every test of the files.

mod bvh;
mod dat_fixtures;
mod fixtures;
mod support;
mod table_options;
#[cfg(feature = "parquet")]
mod table_results;
#[cfg(feature = "parquet")]
mod tables;
mod tum;
