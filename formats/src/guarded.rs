//! Other crates' decoders, whose panics on broken bytes become refusals of the input.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread;

thread_local! {
    static DEPTH: Cell<usize> = const { Cell::new(0) };
}

/// Whether a panic of this thread, now, becomes a refusal of an input. A panic hook has nothing to say of
/// such.
#[must_use]
pub fn is_guarded() -> bool {
    DEPTH.get() > 0
}

/// What `work` gives, or its panic. Nothing that it has touched may be used after that.
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
