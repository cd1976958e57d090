//! Queues of devices, and a lock for each. Vulkan allows a queue only one user at a time.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, Weak};

use ash::vk::{self, Handle as _};

use crate::gpu::handles::QueueLock;
use crate::threads::lock;

/// The lock of every queue that an engine of this process uses, by the queue's handle: several engines may be made of
/// one application's device, and each of them makes a [`DeviceQueue`] for the same queue.
static LOCKS: Mutex<BTreeMap<u64, Weak<Mutex<()>>>> = Mutex::new(BTreeMap::new());

/// A queue as one engine uses it.
pub(crate) struct DeviceQueue {
    raw: vk::Queue,
    pub(crate) family: u32,
    /// The lock that all engines use for the queue.
    of_engines: Arc<Mutex<()>>,
    /// The lock that the application uses for the queue.
    of_application: Option<QueueLock>,
}

impl DeviceQueue {
    pub(crate) fn new(raw: vk::Queue, family: u32, of_application: Option<QueueLock>) -> Self {
        let mut all = lock(&LOCKS);
        let found = all.get(&raw.as_raw()).and_then(Weak::upgrade);
        let of_engines = found.unwrap_or_else(|| {
            let new = Arc::default();
            all.insert(raw.as_raw(), Arc::downgrade(&new));
            new
        });
        Self {
            raw,
            family,
            of_engines,
            of_application,
        }
    }

    /// Calls `work` while nothing else uses the queue; `None` if the application's lock did not call its argument.
    pub(crate) fn with<T>(&self, work: impl FnOnce(vk::Queue) -> T) -> Option<T> {
        // Always in this order. The application's lock may be one for several queues, so it is the last.
        let _engines = self.lock();
        match &self.of_application {
            Some(shared) => shared.run(|| work(self.raw)),
            None => Some(work(self.raw)),
        }
    }

    /// Keeps all other engines from the queue.
    pub(crate) fn lock(&self) -> MutexGuard<'_, ()> {
        lock(&self.of_engines)
    }
}

impl Drop for DeviceQueue {
    fn drop(&mut self) {
        let mut all = lock(&LOCKS);
        // While the table is locked, nobody else can begin to use the lock.
        if Arc::strong_count(&self.of_engines) == 1 {
            all.remove(&self.raw.as_raw());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Handles that no driver gives.
    fn queue(handle: u64) -> DeviceQueue {
        DeviceQueue::new(vk::Queue::from_raw(u64::MAX - handle), 0, None)
    }

    #[test]
    fn work_is_done_within_the_locks_of_engines_and_application() {
        let shared = Arc::new(Mutex::new(()));
        let raw = vk::Queue::from_raw(u64::MAX - 3);
        let one = DeviceQueue::new(raw, 0, Some(QueueLock::from(Arc::clone(&shared))));
        let again = queue(3);
        let are_free = || {
            [
                shared.try_lock().is_ok(),
                again.of_engines.try_lock().is_ok(),
            ]
        };
        assert_eq!(one.with(|_| are_free()), Some([false; 2]));
        assert_eq!(again.with(|_| are_free()), Some([true, false]));
        assert_eq!(are_free(), [true; 2]);
    }

    #[test]
    fn a_queue_has_one_lock_as_long_as_an_engine_uses_it() {
        let (one, again, other) = (queue(1), queue(1), queue(2));
        assert!(Arc::ptr_eq(&one.of_engines, &again.of_engines));
        assert!(!Arc::ptr_eq(&one.of_engines, &other.of_engines));
        let held = one.lock();
        assert!(again.of_engines.try_lock().is_err() && other.of_engines.try_lock().is_ok());
        drop(held);
        let is_listed = |handle: u64| lock(&LOCKS).contains_key(&(u64::MAX - handle));
        drop(one);
        assert!(is_listed(1), "another engine uses it");
        drop((again, other));
        assert!(!is_listed(1) && !is_listed(2));
    }
}
