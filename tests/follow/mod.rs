//! Bodies that follow paths: the numbers of worked examples, the reference, and the same bits on
//! every device.

mod engine;
mod examples;
mod smooth;
