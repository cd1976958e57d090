//! Compares the kernels as Rust ([`entries`](crate::twin::entries)) with the CPU's code, without a device. The compiler
//! of the shaders writes the kernels as Rust from the same representation as the SPIR-V.
//!
//! * `arithmetic.rs`: functions that are written for lanes, and those that are written by hand, on hostile arguments;
//! * `on_trials.rs`: whole kernels on the inputs of the kernels' check, and the CPU's way to the same;
//! * `numbers.rs`: numbers as devices may compute with them;
//! * `mistakes.rs`: a mistake anywhere is found, and the results of kernels and functions are those of `recorded.txt`;
//! * `lines.rs` and `crowd_lines.rs`: the memory that the waves of a card touch and the statements that they execute,
//!   over whole workloads, whose results must be the CPU's.
//!
//! They use private items of the engine, so they are tests of the library: `src/twin/mod.rs` includes them.

mod arithmetic;
mod crowd_lines;
mod lines;
mod mistakes;
mod numbers;
mod on_trials;
