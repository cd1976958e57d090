//! Smoothing of evaluated rotations and positions: the weights of kernels, and the sums of the steps from sample to
//! sample, each step times its weight.

pub(crate) mod kernel;
pub(crate) mod rows;
