//! Every test of the files.

mod bvh;
mod bvh_write;
mod dat_fixtures;
mod fixtures;
mod support;
mod tum;
