//! Work that somebody no longer wants: a flag that its tasks look at.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The work was stopped ([`Stop`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the work was cancelled (Stop)")]
pub struct StoppedError;

thread_local! {
    /// That of the work that this thread does.
    static CURRENT: RefCell<Option<Stop>> = const { RefCell::new(None) };
}

/// Ends work of the engine before its end, from another thread.
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
    /// One that has stopped nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// That of the work which this thread does, inside [`Stop::during`]; elsewhere one that has stopped
    /// nothing.
    #[must_use]
    pub fn of_this_work() -> Self {
        current().unwrap_or_default()
    }

    /// Asks the work inside [`Stop::during`] to end: within some hundredths of a second its evaluations
    /// return [`Error::Stopped`](crate::Error::Stopped), and so does each that it begins later. What an
    /// evaluation has written of its result by then is of no use.
    pub fn stop(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether [`Stop::stop`] was called.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Does work on this thread that may be stopped.
    pub fn during<R>(&self, work: impl FnOnce() -> R) -> R {
        during(Some(self.clone()), work)
    }
}

/// That of the work that this thread does, for the tasks that it is cut into.
pub(crate) fn current() -> Option<Stop> {
    CURRENT.with_borrow(Clone::clone)
}

/// Does a task with the stop of the work that it is a part of.
pub(crate) fn during<R>(stop: Option<Stop>, task: impl FnOnce() -> R) -> R {
    /// Puts back, also when the task panics, what was there before.
    struct Before(Option<Stop>);
    impl Drop for Before {
        fn drop(&mut self) {
            CURRENT.set(self.0.take());
        }
    }
    let _before = Before(CURRENT.replace(stop));
    task()
}

/// Whether the work of this thread is to end. Of a task on the engine's threads only inside of [`during`]:
/// the thread may have taken it up while it waits for other work.
pub(crate) fn is_stopped() -> bool {
    CURRENT.with_borrow(|stop| stop.as_ref().is_some_and(Stop::is_stopped))
}

/// Refuses to go on where the work of this thread is to end; as [`is_stopped`].
pub(crate) fn check() -> Result<(), StoppedError> {
    CURRENT.with_borrow(|stop| check_of(stop.as_ref()))
}

/// Refuses to go on with a task of work that has this stop.
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
