//! Handles: the numbers of objects in a table, given to C as pointers that nothing dereferences.
//!
//! A number is given once. A handle that was freed, or is of another kind, is not found; one that is
//! freed while another thread works with it keeps its object until that call is over.

use std::any::Any;
use std::collections::HashMap;
use std::sync::{
    Arc, LazyLock, LockResult, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard,
};

use crate::result::{Failure, TumbleResult};

/// An object that has handles.
pub(crate) trait Object: Any + Send + Sync {
    /// What messages call it.
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

/// Handles look like pointers to something that is aligned, and are far from null.
const STEP: usize = 16;

/// The table. Nothing panics between two changes that belong together.
fn read() -> RwLockReadGuard<'static, Table> {
    TABLE.read().unwrap_or_else(PoisonError::into_inner)
}

fn write() -> RwLockWriteGuard<'static, Table> {
    TABLE.write().unwrap_or_else(PoisonError::into_inner)
}

/// A handle of an object, which keeps it.
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

/// Forgets a handle; null is none.
pub(crate) fn free<T: Object>(handle: *mut T) -> Result<(), Failure> {
    if handle.is_null() {
        return Ok(());
    }
    get::<T>(handle)?;
    // Dropped after the table is let go: objects may wait for a device.
    let object = write().objects.remove(&handle.addr());
    drop(object);
    Ok(())
}

/// What a lock guards, unless a call that held it ended in a panic: what it left may be half changed.
pub(crate) fn locked<T: Object, G>(lock: LockResult<G>) -> Result<G, Failure> {
    lock.map_err(|_| {
        let name = T::NAME;
        let message = format!("an earlier call with this {name} had an internal error; free it");
        Failure::new(TumbleResult::Internal, message)
    })
}
