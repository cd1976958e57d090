//! Work that the threads share. A caller's own rayon pool is used where it calls from one; else there is
//! one for the call. Where the system refuses threads, the calling one does it all.

use rayon::prelude::*;

/// The results of `of` for each, in order.
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
