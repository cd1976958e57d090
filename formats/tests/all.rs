//! Every test of the files.

mod bvh;
mod dat_fixtures;
mod fixtures;
mod support;
mod tum;
