//! The engine's threads. The engine does not use rayon's global pool, because that pool does not work in a forked
//! process, and ends the program if the system refuses threads.
//!
//! Every thread that waits for work of the engine sleeps. Otherwise a worker of a caller's rayon pool would run other
//! tasks of that pool while it waits, as rayon's workers do. Such a task could need a lock that the waiting call or its
//! caller has.

// Without the feature `vulkan`, nothing uses `exclusive`.
#[cfg_attr(not(feature = "vulkan"), allow(dead_code))]
pub(crate) mod exclusive;
pub(crate) mod stop;

use std::cell::Cell;
use std::io;
use std::num::NonZeroUsize;
use std::panic::resume_unwind;
use std::process;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, mpsc};
use std::thread;

use rayon::prelude::*;

/// The system refused worker threads.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the system refused to start {count} worker threads: {reason}; ask for fewer (RAYON_NUM_THREADS, or `thread_count` in EngineOptions), or let this process have more"
)]
#[non_exhaustive]
pub struct OutOfThreadsError {
    /// The requested number of threads.
    pub count: usize,
    /// The system's message.
    pub reason: String,
}

impl OutOfThreadsError {
    /// The error for one thread that could not be started.
    pub(crate) fn of_one(error: &io::Error) -> Self {
        let (count, reason) = (1, error.to_string());
        Self { count, reason }
    }
}

/// Locks a mutex whose value is consistent even after a thread panicked.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

thread_local! {
    /// Whether this is one of the engine's threads.
    static IS_WORKER: Cell<bool> = const { Cell::new(false) };
}

/// The size of a worker's stack in bytes. A worker that waits for parts of its work runs tasks of other calls on the
/// same stack, as many as there are at a time.
const STACK: usize = 4 << 20;

/// The memory in bytes that a new thread surely needs in addition to its stack.
const BEGINNING: usize = 1 << 20;

/// Whether the target has threads. WebAssembly has none as Rust compiles for it: the calling thread does all work,
/// and rayon's parallel loops run on it.
pub(crate) const HAS_THREADS: bool = !cfg!(target_family = "wasm");

/// Threads that share work: those of the process, or those of one engine. They are started when they first have work;
/// a forked process, in which they do not exist, starts its threads again.
pub(crate) struct Threads {
    /// The number of threads; `None`: the environment decides.
    count: Option<usize>,
    /// The threads of the first process. They are found without a lock, because a process may be forked while its
    /// other threads work.
    first: OnceLock<Pool>,
    /// The threads of a process that was forked from the first one.
    forked: Mutex<Option<Pool>>,
}

#[derive(Clone)]
struct Pool {
    process: u32,
    threads: Arc<rayon::ThreadPool>,
}

static SHARED: Threads = Threads::new(None);

/// Runs `work` on the engine's threads, so that rayon inside it uses them. The calling thread sleeps until the end.
///
/// There is one such pool in a process. It has as many threads as the environment variable `RAYON_NUM_THREADS` says,
/// or one for each core. A forked process has a separate pool.
///
/// While one of these threads waits, it runs other tasks, as in all of rayon. Therefore tasks on these threads must
/// not keep a shared lock while they call the engine. Threads and pools of the application may.
///
/// ```
/// let threads = tumble::on_threads(rayon::current_num_threads)?;
/// assert!(threads >= 1);
/// # Ok::<(), tumble::OutOfThreadsError>(())
/// ```
///
/// # Errors
/// When the system refuses to start the threads.
pub fn on_threads<R: Send>(work: impl FnOnce() -> R + Send) -> Result<R, OutOfThreadsError> {
    SHARED.run(work)
}

/// The number of bytes that one thread copies at once.
const COPY_TASK: usize = 1 << 20;

/// Copies bytes, on all threads if there are many bytes and threads can be started.
pub(crate) fn copy(to: &mut [u8], from: &[u8]) {
    let copied = (to.len() > COPY_TASK).then(|| {
        on_threads(|| {
            let pieces = to.par_chunks_mut(COPY_TASK).zip(from.par_chunks(COPY_TASK));
            pieces.for_each(|(to, from)| to.copy_from_slice(from));
        })
    });
    if !matches!(copied, Some(Ok(()))) {
        to.copy_from_slice(from);
    }
}

/// Whether this is one of the engine's threads. These must not wait for a thread that may need them.
pub(crate) fn is_worker() -> bool {
    IS_WORKER.get()
}

/// The number of threads that share work of [`on_threads`] on this thread; starts none.
pub(crate) fn count() -> usize {
    SHARED.count()
}

impl Threads {
    /// The process's threads, which run [`on_threads`].
    pub(crate) fn of_process() -> &'static Self {
        &SHARED
    }

    pub(crate) const fn new(count: Option<usize>) -> Self {
        Self {
            count,
            first: OnceLock::new(),
            forked: Mutex::new(None),
        }
    }

    /// Starts the threads, if they do not exist yet.
    pub(crate) fn start(&self) -> Result<(), OutOfThreadsError> {
        match HAS_THREADS {
            true => self.pool().map(|_| ()),
            false => Ok(()),
        }
    }

    /// The number of threads that share work of [`Threads::run`] on this thread.
    pub(crate) fn count(&self) -> usize {
        match IS_WORKER.get() {
            _ if !HAS_THREADS => 1,
            true => rayon::current_num_threads(),
            false => self.count.unwrap_or_else(default_count),
        }
    }

    /// Runs `work` on these threads, or on the engine's threads that run this call already.
    pub(crate) fn run<R: Send>(
        &self,
        work: impl FnOnce() -> R + Send,
    ) -> Result<R, OutOfThreadsError> {
        if IS_WORKER.get() || !HAS_THREADS {
            return Ok(work());
        }
        let threads = self.pool()?;
        if rayon::current_thread_index().is_none() {
            return Ok(threads.install(work));
        }
        // A worker of another pool would start another task while it waits, so a separate thread waits instead.
        thread::scope(|scope| {
            let waiting = thread::Builder::new()
                .spawn_scoped(scope, || threads.install(work))
                .map_err(|error| OutOfThreadsError::of_one(&error))?;
            waiting.join().map_or_else(|panic| resume_unwind(panic), Ok)
        })
    }

    fn pool(&self) -> Result<Arc<rayon::ThreadPool>, OutOfThreadsError> {
        let process = process_id();
        let of_first = || {
            let first = self.first.get();
            first.filter(|first| first.process == process)
        };
        if let Some(first) = of_first() {
            return Ok(Arc::clone(&first.threads));
        }
        // The lock is held only while threads are started, never while they work.
        let mut forked = lock(&self.forked);
        let there = of_first().or(forked.as_ref().filter(|pool| pool.process == process));
        if let Some(pool) = there {
            return Ok(Arc::clone(&pool.threads));
        }
        let made = Pool {
            process,
            threads: Arc::new(start(self.count.unwrap_or_else(default_count))?),
        };
        let threads = Arc::clone(&made.threads);
        if let Err(made) = self.first.set(made) {
            abandon(forked.replace(made));
        }
        Ok(threads)
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        let forked = self
            .forked
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner);
        abandon(self.first.take());
        abandon(forked.take());
    }
}

/// Ends the threads of this process. The threads of the process that it was forked from do not exist in it, and their
/// data may be inconsistent.
fn abandon(pool: Option<Pool>) {
    match pool {
        Some(pool) if pool.process != process_id() => std::mem::forget(pool),
        _ => {}
    }
}

/// The id of this process. (On systems without processes, the standard library's function panics.)
fn process_id() -> u32 {
    if HAS_THREADS { process::id() } else { 0 }
}

fn start(count: usize) -> Result<rayon::ThreadPool, OutOfThreadsError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(count)
        .stack_size(STACK)
        .thread_name(|index| format!("tumble {index}"))
        .start_handler(|_| IS_WORKER.set(true))
        .spawn_handler(start_one)
        .build()
        .map_err(|error| OutOfThreadsError {
            count,
            reason: error.to_string(),
        })
}

/// Starts one thread and waits until it has begun. Rust ends the process if a thread that has a stack lacks the
/// little memory that it needs next. Therefore the thread is started only if there is memory for both.
fn start_one(worker: rayon::ThreadBuilder) -> io::Result<()> {
    let mut room = Vec::<u8>::new();
    if room.try_reserve_exact(STACK + BEGINNING).is_err() {
        return Err(io::ErrorKind::OutOfMemory.into());
    }
    drop(std::hint::black_box(room));
    let mut thread = thread::Builder::new().stack_size(worker.stack_size().unwrap_or(STACK));
    if let Some(name) = worker.name() {
        thread = thread.name(name.to_owned());
    }
    let (sender, has_begun) = mpsc::channel();
    thread.spawn(move || {
        let _ = sender.send(()); // the receiver waits below
        drop(sender);
        worker.run();
    })?;
    let _ = has_begun.recv(); // a thread that ended has begun too
    Ok(())
}

/// The number of the threads of the process, once something asked for it.
static COUNT: OnceLock<usize> = OnceLock::new();

/// Sets the number of threads that all engines of the process share, instead of that of the environment variable
/// `RAYON_NUM_THREADS`. False if it is too late, because the number was used or set before.
///
/// ```
/// use std::num::NonZeroUsize;
/// if tumble::set_thread_count(NonZeroUsize::MIN) {
///     assert_eq!(tumble::on_threads(rayon::current_num_threads)?, 1);
/// }
/// # Ok::<(), tumble::OutOfThreadsError>(())
/// ```
pub fn set_thread_count(count: NonZeroUsize) -> bool {
    COUNT.set(count.get()).is_ok()
}

/// The number that was set, or that `RAYON_NUM_THREADS` says, or one for each core that this process may use.
fn default_count() -> usize {
    *COUNT.get_or_init(|| {
        let named = std::env::var("RAYON_NUM_THREADS").ok();
        let named = named.and_then(|count| count.parse().ok());
        named
            .filter(|&count| count > 0)
            .unwrap_or_else(|| thread::available_parallelism().map_or(1, usize::from))
    })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use rayon::prelude::*;

    use super::*;

    #[test]
    fn work_inside_work_uses_the_same_threads() {
        let threads = Threads::new(Some(3));
        let inner = threads.run(|| {
            let inner = (on_threads(rayon::current_num_threads), count());
            assert_eq!(threads.count(), 3);
            inner
        });
        assert_eq!(inner, Ok((Ok(3), 3)));
        assert_eq!(on_threads(rayon::current_num_threads), Ok(count()));
    }

    /// Catches a worker of another library's pool that starts another task while it waits: the task would wait for the
    /// lock of the task that is interrupted on the same stack.
    #[test]
    fn a_callers_worker_that_waits_takes_up_no_other_task() {
        let callers = rayon::ThreadPoolBuilder::new()
            .num_threads(2)
            .build()
            .unwrap();
        let (inside, max_inside) = (AtomicUsize::new(0), AtomicUsize::new(0));
        callers.install(|| {
            (0..64).into_par_iter().for_each(|_| {
                let now = 1 + inside.fetch_add(1, Ordering::SeqCst);
                max_inside.fetch_max(now, Ordering::SeqCst);
                let sum = on_threads(|| (0..1000u64).into_par_iter().sum::<u64>());
                assert_eq!(sum, Ok(499_500));
                inside.fetch_sub(1, Ordering::SeqCst);
            });
        });
        assert!(max_inside.into_inner() <= 2);
    }

    #[test]
    fn a_panic_in_the_work_is_the_callers() {
        let caught = std::panic::catch_unwind(|| on_threads(|| panic!("of the work")));
        assert!(caught.is_err());
        assert_eq!(on_threads(|| 1), Ok(1));
    }

    /// More stack than there is address space for: the system refuses.
    #[test]
    fn threads_that_are_refused_are_an_error() {
        let refused = OutOfThreadsError::of_one(&io::Error::from(io::ErrorKind::WouldBlock));
        let text = refused.to_string();
        assert!(
            text.contains("1 worker threads") && text.contains("RAYON_NUM_THREADS"),
            "{text}"
        );
    }
}
