//! The scratch pool: the buffers that preparing needs are kept from call to call, because
//! allocating them takes as long as preparing a hundred keys.

use std::sync::{Mutex, PoisonError};

use crate::method::interpolation::Interpolation;
use crate::prepare::preparation::Preparation;
use crate::prepare::prepared::Prepared;
use crate::prepare::request::Request;

/// The scratch buffers of one thread, for one interpolation.
pub(crate) struct Memory {
    interpolation: Interpolation,
    pub(crate) prepared: Prepared,
    pub(crate) preparation: Preparation,
}

/// How many are kept for each thread. Programs alternate between interpolations; transforms alone
/// use three.
const KEPT_EACH: usize = 4;

/// The scratch pool: what threads have given back, the latest last.
#[derive(Default)]
pub(crate) struct ScratchPool(Mutex<Vec<Memory>>);

impl ScratchPool {
    /// Takes scratch buffers for an interpolation out of the pool, or allocates them. They prepare
    /// only what the samples of this timeline need.
    pub(crate) fn take(&self, request: &Request<'_>) -> Memory {
        let interpolation = request.interpolation;
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let suits = |memory: &Memory| memory.interpolation == *interpolation;
        let own = (kept.iter().rposition(suits)).map(|place| kept.remove(place));
        drop(kept);
        let mut memory = own.unwrap_or_else(|| Memory {
            interpolation: *interpolation,
            prepared: Prepared::new(interpolation),
            preparation: Preparation::new(interpolation),
        });
        memory.preparation.only_for(request.timeline, request.set);
        memory
    }

    /// Puts scratch buffers back into the pool. Call it only after success: a failed preparation
    /// may leave them half filled.
    pub(crate) fn give_back(&self, memory: Memory) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() >= KEPT_EACH * rayon::current_num_threads() {
            kept.remove(0);
        }
        kept.push(memory);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method;
    use crate::time::frames::Frames;
    use crate::tracks::set::swinging;

    /// Catches a pool that allocates again when two methods alternate, and one that grows without
    /// bound.
    #[test]
    fn each_way_to_interpolate_finds_its_memory_again() {
        let set = swinging(4, 26, false);
        let timeline = Frames::fps(60)
            .resolve(set.track_count(), set.time_span())
            .unwrap();
        let scratch_pool = ScratchPool::default();
        let from = |pool: &ScratchPool, own| {
            let interpolation = Interpolation::from(own);
            pool.take(&Request::whole(&set, &interpolation, &timeline))
        };
        let take = |own| from(&scratch_pool, own);
        let kept = || scratch_pool.0.lock().unwrap().len();
        for own in [method::SLERP, method::BESSEL_OVERHAUSER] {
            scratch_pool.give_back(take(own));
        }
        assert_eq!(kept(), 2);
        let first = take(method::SLERP);
        assert_eq!(kept(), 1);
        scratch_pool.give_back(first);
        for _ in 0..9 * rayon::current_num_threads() {
            scratch_pool.give_back(from(&ScratchPool::default(), method::SLERP));
        }
        assert_eq!(kept(), KEPT_EACH * rayon::current_num_threads());
    }
}
