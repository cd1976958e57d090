//! Stopping of work: a flag that tasks check.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The work was stopped ([`Stop`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the work was cancelled (Stop)")]
pub struct StoppedError;

thread_local! {
    /// The stop of the work that this thread does.
    static CURRENT: RefCell<Option<Stop>> = const { RefCell::new(None) };
}

/// A flag with which another thread stops work of the engine.
///
/// ```
/// # use glam::Quat;
/// use tumble::{Device, Engine, Error, SampleTimes, Stop, TrackSet, method};
/// # let mut set = TrackSet::new();
/// # set.push("", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_x(1.0)])?;
/// let engine = Engine::new(Device::Cpu)?;
/// let stop = Stop::new();
/// stop.stop(); // another thread's, while the engine works
/// let found = stop.during(|| engine.evaluate(&set, method::C2, &SampleTimes::fps(60)));
/// assert!(matches!(found, Err(Error::Stopped(_))));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// A new flag, which is not set.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The flag of the work inside [`Stop::during`] that this thread does. Elsewhere a new flag.
    #[must_use]
    pub fn of_this_work() -> Self {
        current().unwrap_or_default()
    }

    /// Stops the work inside [`Stop::during`]: within some hundredths of a second, the evaluations of this work return
    /// [`Error::Stopped`](crate::Error::Stopped), and so does each evaluation that the work starts later. A partly
    /// written result must not be used.
    pub fn stop(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether [`Stop::stop`] was called.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Does `work` on the calling thread; [`Stop::stop`] of this flag stops it.
    pub fn during<R>(&self, work: impl FnOnce() -> R) -> R {
        during(Some(self.clone()), work)
    }
}

/// The flag of the work that this thread does, for its tasks on other threads.
pub(crate) fn current() -> Option<Stop> {
    CURRENT.with_borrow(Clone::clone)
}

/// Does a task with the flag of the work that it is a part of.
pub(crate) fn during<R>(stop: Option<Stop>, task: impl FnOnce() -> R) -> R {
    /// Restores the previous flag, also after a panic.
    struct Before(Option<Stop>);
    impl Drop for Before {
        fn drop(&mut self) {
            CURRENT.set(self.0.take());
        }
    }
    let _before = Before(CURRENT.replace(stop));
    task()
}

/// Whether the work of this thread was stopped. For tasks on the engine's threads this is valid only inside
/// [`during`], because a thread that waits for other work may have started the task.
pub(crate) fn is_stopped() -> bool {
    CURRENT.with_borrow(|stop| stop.as_ref().is_some_and(Stop::is_stopped))
}

/// Returns an error if the work of this thread was stopped; see [`is_stopped`].
pub(crate) fn check() -> Result<(), StoppedError> {
    CURRENT.with_borrow(|stop| check_of(stop.as_ref()))
}

/// Returns an error if the work with this flag was stopped.
pub(crate) fn check_of(stop: Option<&Stop>) -> Result<(), StoppedError> {
    match stop {
        Some(stop) if stop.is_stopped() => Err(StoppedError),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_holds_for_its_own_work_and_no_longer() {
        let (outer, inner) = (Stop::new(), Stop::new());
        inner.stop();
        outer.during(|| {
            assert_eq!(check(), Ok(()));
            inner.during(|| assert_eq!(check(), Err(StoppedError)));
            during(None, || assert_eq!(check(), Ok(())));
            assert_eq!(check(), Ok(()));
        });
        let caught = std::panic::catch_unwind(|| inner.during(|| panic!("of the work")));
        assert!(caught.is_err());
        assert_eq!(check(), Ok(()));
    }
}
