//! The cost of evaluating and reading, counted, not timed: a program of its own, because the memory that
//! is counted is the whole process's.

#![allow(clippy::disallowed_methods)] // as in tests/all.rs

use std::sync::{Mutex, MutexGuard, PoisonError};

use peak_alloc::PeakAlloc;

mod bombs;
#[path = "../../../formats/tests/cases.rs"]
mod cases;
mod growth;
#[cfg(target_arch = "x86_64")]
mod instructions;
#[path = "../../../formats/tests/mcap/log.rs"]
#[expect(dead_code, reason = "no log is interrupted here")]
mod log;
mod memory;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// As long as the guard is kept, no other test allocates memory that would be counted.
fn one_at_a_time() -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    ONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The result of some work, and the most memory that it took in addition to the memory in use before, bytes.
fn peak_of<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    let done = work();
    (done, ALLOCATOR.peak_usage().saturating_sub(before))
}
