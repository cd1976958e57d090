//! What evaluating and reading cost, counted, not timed: a program of its own, because the memory that
//! is counted is the whole process's.

#[cfg(target_arch = "x86_64")]
mod instructions;
mod memory;
