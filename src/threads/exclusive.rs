//! A value that one caller at a time uses, without a lock during the use.

use std::mem::take;
use std::ops::{Deref, DerefMut};
use std::sync::{Condvar, Mutex, PoisonError};
use std::thread;

use crate::threads::{self, lock};

/// A value that callers take and put back, one after another. A caller that waits for it sleeps, and does no other
/// work (`threads`); therefore the caller that has it can always continue.
#[derive(Default)]
pub(crate) struct Exclusive<T> {
    kept: Mutex<ExclusiveState<T>>,
    came_back: Condvar,
}

#[derive(Default)]
struct ExclusiveState<T> {
    /// The value; while a caller has taken it, the default value.
    value: T,
    is_lent: bool,
}

impl<T: Default> Exclusive<T> {
    /// Takes the value; waits until no other caller has it. The engine's threads do not wait, because the caller that
    /// has the value may wait for work that such a thread has begun. They get a default value if it is taken.
    pub(crate) fn take(&self) -> ExclusiveGuard<'_, T> {
        let mut kept = lock(&self.kept);
        if kept.is_lent && threads::is_worker() {
            let value = T::default();
            return ExclusiveGuard {
                origin: None,
                value,
            };
        }
        let waited = self.came_back.wait_while(kept, |kept| kept.is_lent);
        kept = waited.unwrap_or_else(PoisonError::into_inner);
        kept.is_lent = true;
        let (origin, value) = (Some(self), take(&mut kept.value));
        ExclusiveGuard { origin, value }
    }

    /// The value, unless a caller has it; a default value replaces it.
    pub(crate) fn idle(&self) -> Option<T> {
        let mut kept = lock(&self.kept);
        (!kept.is_lent).then(|| take(&mut kept.value))
    }
}

/// A value that was taken. When this is dropped, the value is put back; after a panic a default value instead,
/// because work may be incomplete.
pub(crate) struct ExclusiveGuard<'a, T: Default> {
    /// `None` for a default value that is not put back.
    origin: Option<&'a Exclusive<T>>,
    value: T,
}

impl<T: Default> Deref for ExclusiveGuard<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T: Default> DerefMut for ExclusiveGuard<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

impl<T: Default> Drop for ExclusiveGuard<'_, T> {
    fn drop(&mut self) {
        let Some(origin) = self.origin else { return };
        let mut value = take(&mut self.value);
        if thread::panicking() {
            value = T::default();
        }
        let mut kept = lock(&origin.kept);
        (kept.value, kept.is_lent) = (value, false);
        drop(kept);
        origin.came_back.notify_one();
    }
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use super::*;

    #[test]
    fn one_at_a_time_has_it_and_nobody_after_a_panic_what_was_half_done() {
        let exclusive = Exclusive::<Vec<usize>>::default();
        thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..1000 {
                        let mut value = exclusive.take();
                        let length = value.len();
                        value.push(length);
                    }
                });
            }
        });
        let mut value = exclusive.take();
        assert!(value.iter().copied().eq(0..8000));
        assert_eq!(exclusive.idle(), None);
        // The engine's threads do not wait.
        threads::on_threads(|| exclusive.take().push(1)).unwrap();
        value.truncate(2);
        drop(value);
        assert_eq!(exclusive.idle(), Some(vec![0, 1]));
        let panicked = catch_unwind(AssertUnwindSafe(|| {
            exclusive.take().push(7);
            let _half = exclusive.take();
            panic!("half way");
        }));
        assert!(panicked.is_err());
        assert_eq!(exclusive.idle(), Some(vec![]));
    }
}
