//! The scratch pool keeps the buffers for preparation from call to call, because allocating them takes as long as
//! preparing a hundred keys.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, TryLockError};

use crate::method::interpolation::Interpolation;
use crate::prepare::clip_data::PartRef;
use crate::prepare::error::SetError;
use crate::prepare::preparation::{Preparation, SetRequest};
use crate::prepare::prepared::Prepared;
use crate::threads;
use crate::tracks::set::TrackSet;

/// The scratch buffers of one thread, for one interpolation.
pub(crate) struct Scratch {
    interpolation: Interpolation,
    pub(crate) prepared: Prepared,
    pub(crate) preparation: Preparation,
}

impl Scratch {
    /// Prepares some intervals of tracks together; the previous contents are dropped.
    pub(crate) fn prepare(
        &mut self,
        set: &TrackSet,
        intervals: impl Iterator<Item = (usize, Range<usize>)>,
    ) -> Result<(), SetError> {
        self.prepared.clear();
        self.preparation.push(&mut self.prepared, set, intervals)
    }

    /// The parts that were prepared last.
    pub(crate) fn parts(&self) -> impl Iterator<Item = PartRef<'_>> {
        let prepared = &self.prepared;
        (prepared.parts.iter()).map(move |part| PartRef { prepared, part })
    }
}

/// The number of scratches that are kept for each thread. Programs alternate between interpolations; transforms alone
/// use three.
const KEPT_EACH: usize = 4;

/// The scratches that threads have returned, the latest last. No thread waits for the mutex, because a process may be
/// forked while a thread that does not exist in the fork has it locked.
#[derive(Default)]
pub(crate) struct ScratchPool(Mutex<Vec<Scratch>>);

/// How often a thread tries to lock the pool before it continues without it; others have it locked for nanoseconds.
const LOOKS: usize = 1000;

impl ScratchPool {
    /// Takes scratch buffers for an interpolation from the pool, or allocates them. They prepare only the intervals
    /// that the samples of this timeline need.
    pub(crate) fn take(&self, request: &SetRequest<'_>) -> Scratch {
        let interpolation = request.interpolation;
        let mut memory = self.find(interpolation).unwrap_or_else(|| Scratch {
            interpolation: *interpolation,
            prepared: Prepared::new(interpolation),
            preparation: Preparation::new(interpolation),
        });
        memory.preparation.only_for(request.timeline, request.set);
        memory
    }

    fn find(&self, interpolation: &Interpolation) -> Option<Scratch> {
        let mut kept = self.kept()?;
        let index = (kept.iter()).rposition(|memory| memory.interpolation == *interpolation)?;
        Some(kept.remove(index))
    }

    /// Puts scratch buffers back into the pool. Call it only after success: a failed preparation
    /// may leave them half filled.
    pub(crate) fn give_back(&self, memory: Scratch) {
        let Some(mut kept) = self.kept() else {
            return;
        };
        if kept.len() >= KEPT_EACH * threads::count() {
            kept.remove(0);
        }
        kept.push(memory);
    }

    fn kept(&self) -> Option<MutexGuard<'_, Vec<Scratch>>> {
        for _ in 0..LOOKS {
            match self.0.try_lock() {
                Ok(kept) => return Some(kept),
                Err(TryLockError::Poisoned(kept)) => return Some(kept.into_inner()),
                Err(TryLockError::WouldBlock) => std::hint::spin_loop(),
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::{self, Method};

    /// Catches a pool that allocates again when two methods alternate, and one that grows without
    /// bound.
    #[test]
    fn each_way_to_interpolate_finds_its_memory_again() {
        let pool = ScratchPool::default();
        let new = |method: Method| {
            let interpolation = method.into();
            Scratch {
                interpolation,
                prepared: Prepared::new(&interpolation),
                preparation: Preparation::new(&interpolation),
            }
        };
        let find = |method: Method| pool.find(&method.into());
        pool.give_back(new(method::SLERP));
        pool.give_back(new(method::BESSEL_OVERHAUSER));
        assert!(find(method::C2).is_none() && pool.kept().unwrap().len() == 2);
        assert!(find(method::SLERP).is_some() && pool.kept().unwrap().len() == 1);
        for _ in 0..9 * threads::count() {
            pool.give_back(new(method::SLERP));
        }
        assert_eq!(pool.kept().unwrap().len(), KEPT_EACH * threads::count());
    }

    /// The case of a process that was forked while another thread had locked the pool.
    #[test]
    fn a_pool_that_stays_locked_is_done_without() {
        let pool = ScratchPool::default();
        let locked = pool.kept().unwrap();
        let interpolation = method::SLERP.into();
        assert!(pool.find(&interpolation).is_none());
        pool.give_back(Scratch {
            interpolation,
            prepared: Prepared::new(&interpolation),
            preparation: Preparation::new(&interpolation),
        });
        assert!(locked.is_empty());
    }
}
