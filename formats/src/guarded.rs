//! Runs decoders of other crates, whose panics on damaged input become errors.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread;

thread_local! {
    static DEPTH: Cell<usize> = const { Cell::new(0) };
}

/// Whether a panic of this thread would now become an error about an input. A panic hook prints nothing in this case.
#[must_use]
pub fn is_guarded() -> bool {
    DEPTH.get() > 0
}

/// The result of `work`, or its panic. After a panic, data that `work` has modified must not be used.
#[cfg_attr(
    not(any(feature = "parquet", test)),
    expect(dead_code, reason = "the tables' decoders alone assert")
)]
pub(crate) fn guarded<T>(work: impl FnOnce() -> T) -> thread::Result<T> {
    DEPTH.set(DEPTH.get() + 1);
    let done = catch_unwind(AssertUnwindSafe(work));
    DEPTH.set(DEPTH.get() - 1);
    done
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_known_for_what_it_is() {
        assert!(!is_guarded());
        assert_eq!(guarded(is_guarded).ok(), Some(true));
        assert!(guarded(|| guarded(|| panic!("broken")).is_err()).unwrap());
        assert!(!is_guarded());
    }
}
