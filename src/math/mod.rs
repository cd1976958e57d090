//! Arithmetic with the same bits on every machine: quaternions in f64, exponential and logarithm,
//! dual numbers, quadrature, and the rounding of the numbers that kernels read.

pub(crate) mod canonical;
pub(crate) mod dual;
pub(crate) mod operators;
pub(crate) mod quadrature;
pub(crate) mod quaternion;
pub(crate) mod ranges;
