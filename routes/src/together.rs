//! Runs work on several threads: in the caller's rayon pool if it calls from one, otherwise in a new pool for the
//! call. If the system refuses threads, the calling thread does all of it.

use rayon::prelude::*;

/// The results of `of` for all entries, in order.
pub(crate) fn map<T: Sync, R: Send>(all: &[T], of: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let together = || all.par_iter().map(&of).collect();
    if all.len() < 2 {
        return all.iter().map(&of).collect();
    }
    if rayon::current_thread_index().is_some() {
        return together();
    }
    match rayon::ThreadPoolBuilder::new().build() {
        Ok(threads) => threads.install(together),
        Err(_) => all.iter().map(&of).collect(),
    }
}
