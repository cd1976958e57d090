//! Vectors of f32 and f64 numbers: four lanes on any target, eight of AVX2 and sixteen of AVX-512, selected at run
//! time. Unsafe code is allowed here, for the processor's vector instructions.
#![allow(unsafe_code)]

pub(crate) mod cache_line;
pub(crate) mod components;
pub(crate) mod dispatch;
pub(crate) mod doubles;
#[cfg(wide_vectors)]
pub(crate) mod eight;
pub(crate) mod lanes;
#[cfg(wide_vectors)]
pub(crate) mod sixteen;
pub(crate) mod together;
