//! Every test of the files.

mod dat_fixtures;
mod fixtures;
mod npz;
mod support;
