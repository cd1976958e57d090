//! Handles: keys of a table of objects, which C receives as pointers that are never dereferenced.
//!
//! Each key is used once. A handle that was freed or has another type is not found. If a handle is freed during a call
//! of another thread, its object exists until that call returns.

use std::any::Any;
use std::collections::HashMap;
use std::sync::{
    Arc, LazyLock, LockResult, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard,
};

use crate::result::{Failure, TumbleResult};

/// A type of objects that have handles.
pub(crate) trait Object: Any + Send + Sync {
    /// The type's name in messages.
    const NAME: &'static str;
}

struct Table {
    objects: HashMap<usize, Arc<dyn Any + Send + Sync>>,
    next: usize,
}

static TABLE: LazyLock<RwLock<Table>> = LazyLock::new(|| {
    RwLock::new(Table {
        objects: HashMap::new(),
        next: 0,
    })
});

/// The difference of consecutive handles: they look like aligned pointers that are not null.
const STEP: usize = 16;

/// The table, also if its lock is poisoned: no panic can occur between changes that belong together.
fn read() -> RwLockReadGuard<'static, Table> {
    TABLE.read().unwrap_or_else(PoisonError::into_inner)
}

fn write() -> RwLockWriteGuard<'static, Table> {
    TABLE.write().unwrap_or_else(PoisonError::into_inner)
}

/// Adds an object to the table and returns its handle.
pub(crate) fn give<T: Object>(object: T) -> *mut T {
    let mut table = write();
    table.next += STEP;
    let handle = table.next;
    table.objects.insert(handle, Arc::new(object));
    std::ptr::without_provenance_mut(handle)
}

/// The object of a handle.
pub(crate) fn get<T: Object>(handle: *const T) -> Result<Arc<T>, Failure> {
    let name = T::NAME;
    if handle.is_null() {
        let message = format!("the {name} is null");
        return Err(Failure::new(TumbleResult::InvalidHandle, message));
    }
    let found = read().objects.get(&handle.addr()).cloned();
    let found = found.ok_or_else(|| {
        let message = format!("this {name} was freed, or never existed");
        Failure::new(TumbleResult::InvalidHandle, message)
    })?;
    found.downcast().map_err(|_| {
        let message = format!("this handle is not one of the kind `{name}`");
        Failure::new(TumbleResult::InvalidHandle, message)
    })
}

/// Removes a handle from the table; does nothing for null.
pub(crate) fn free<T: Object>(handle: *mut T) -> Result<(), Failure> {
    if handle.is_null() {
        return Ok(());
    }
    get::<T>(handle)?;
    // Dropped after the lock of the table is released, because dropping an object may wait for a device.
    let object = write().objects.remove(&handle.addr());
    drop(object);
    Ok(())
}

/// The guard of a lock; an error if the lock is poisoned, because a call that panicked may have changed only a part of
/// the object.
pub(crate) fn locked<T: Object, G>(lock: LockResult<G>) -> Result<G, Failure> {
    lock.map_err(|_| {
        let name = T::NAME;
        let message = format!("an earlier call with this {name} had an internal error; free it");
        Failure::new(TumbleResult::Internal, message)
    })
}
