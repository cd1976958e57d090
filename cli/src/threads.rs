//! Work that the engine's threads share.

/// `together`, in which rayon uses the engine's threads. If the system refuses them, `alone` does the
/// same on this one.
pub(crate) fn on_threads<R: Send>(
    together: impl FnOnce() -> R + Send,
    alone: impl FnOnce() -> R,
) -> R {
    tumble::on_threads(together).unwrap_or_else(|_| alone())
}
