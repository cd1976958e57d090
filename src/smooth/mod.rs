//! Smoothing of evaluated rotations and positions: the weights of kernels, and their sums of the
//! steps from sample to sample.

pub(crate) mod kernel;
pub(crate) mod rows;
