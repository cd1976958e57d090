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

/// A pool of buffers, each for one interpolation: what threads have given back, the latest last.
pub(crate) struct Pool<T>(Mutex<Vec<(Interpolation, T)>>);

/// The scratch pool.
pub(crate) type ScratchPool = Pool<Memory>;

impl<T> Default for Pool<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T> Pool<T> {
    /// Takes buffers for an interpolation out of the pool, if there are any.
    fn find(&self, interpolation: &Interpolation) -> Option<T> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let place = kept.iter().rposition(|(own, _)| own == interpolation)?;
        Some(kept.remove(place).1)
    }

    /// Puts buffers back into the pool.
    fn keep(&self, interpolation: Interpolation, buffers: T) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() >= KEPT_EACH * rayon::current_num_threads() {
            kept.remove(0);
        }
        kept.push((interpolation, buffers));
    }
}

impl ScratchPool {
    /// Takes scratch buffers for an interpolation out of the pool, or allocates them. They prepare
    /// only what the samples of this timeline need.
    pub(crate) fn take(&self, request: &Request<'_>) -> Memory {
        let interpolation = request.interpolation;
        let mut memory = self.find(interpolation).unwrap_or_else(|| Memory {
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
        self.keep(memory.interpolation, memory);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method;

    /// Catches a pool that allocates again when two methods alternate, and one that grows without
    /// bound.
    #[test]
    fn each_way_to_interpolate_finds_its_memory_again() {
        let pool = Pool::default();
        let kept = || pool.0.lock().unwrap().len();
        for (i, own) in [method::SLERP, method::BESSEL_OVERHAUSER]
            .into_iter()
            .enumerate()
        {
            pool.keep(own.into(), i);
        }
        assert_eq!((kept(), pool.find(&method::C2.into())), (2, None));
        assert_eq!((pool.find(&method::SLERP.into()), kept()), (Some(0), 1));
        for i in 0..9 * rayon::current_num_threads() {
            pool.keep(method::SLERP.into(), i);
        }
        assert_eq!(kept(), KEPT_EACH * rayon::current_num_threads());
    }
}
