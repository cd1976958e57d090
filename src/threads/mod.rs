//! The engine's own threads. Nothing of the engine uses rayon's global pool: that one cannot be had in
//! a forked process, and the program ends where the system refuses its threads.
//!
//! A thread that has work done waits for it asleep, whoever it is. A worker of a caller's own rayon pool
//! would else, as rayon's workers do, take up other tasks of that pool while it waits, and one of these
//! may need what the waiting call, or the caller around it, has locked.

pub(crate) mod exclusive;
pub(crate) mod stop;

use std::cell::Cell;
use std::io;
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
    /// How many were asked for.
    pub count: usize,
    /// What the system said.
    pub reason: String,
}

impl OutOfThreadsError {
    /// For one thread that could not be started.
    pub(crate) fn of_one(error: &io::Error) -> Self {
        let (count, reason) = (1, error.to_string());
        Self { count, reason }
    }
}

/// Locks what a thread that panicked cannot have left half changed.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

thread_local! {
    /// Whether this is one of the engine's threads.
    static IS_WORKER: Cell<bool> = const { Cell::new(false) };
}

/// Bytes of a worker's stack. A worker that waits for parts of its work takes up that of other calls
/// meanwhile, one on top of the other, as many as there are at a time.
const STACK: usize = 4 << 20;

/// What a thread is sure to begin with, in bytes, beside its stack.
const BEGINNING: usize = 1 << 20;

/// Whether this system has threads. WebAssembly has none as Rust compiles for it: there the calling
/// thread does all work, and rayon's parallel loops run on it.
pub(crate) const HAS_THREADS: bool = !cfg!(target_family = "wasm");

/// Threads that share work: the process's, or an engine's own. They are started when there is work for
/// them for the first time; a forked process, in which they are not, starts its own.
pub(crate) struct Threads {
    /// How many; `None`: as the environment says.
    count: Option<usize>,
    /// Those of the process that was first, which are found without a lock: a process may be forked
    /// while other threads of it work.
    first: OnceLock<Pool>,
    /// Those of a process that was forked from it.
    forked: Mutex<Option<Pool>>,
}

#[derive(Clone)]
struct Pool {
    process: u32,
    threads: Arc<rayon::ThreadPool>,
}

static SHARED: Threads = Threads::new(None);

/// Runs `work` with the engine's threads: rayon inside it uses them. The calling thread waits, asleep.
///
/// There is one such pool in a process. It has as many threads as the environment's
/// `RAYON_NUM_THREADS` says, else one for each core. A forked process gets its own.
///
/// As everywhere in rayon, one of these threads that waits takes up other tasks meanwhile: tasks that
/// share a lock must not hold it across a call of the engine in here. In threads and pools of their own
/// they may.
///
/// ```
/// let threads = tumble::on_threads(rayon::current_num_threads)?;
/// assert!(threads >= 1);
/// # Ok::<(), tumble::OutOfThreadsError>(())
/// ```
///
/// # Errors
/// When the system refuses the threads.
pub fn on_threads<R: Send>(work: impl FnOnce() -> R + Send) -> Result<R, OutOfThreadsError> {
    SHARED.run(work)
}

/// Bytes that one thread copies at once.
const COPY_TASK: usize = 1 << 20;

/// Copies bytes, on all threads where they are many and threads can be had.
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

/// Whether this is one of the engine's own threads. They must wait for nobody that may need them.
pub(crate) fn is_worker() -> bool {
    IS_WORKER.get()
}

/// How many threads share the work that is given to [`on_threads`] here; none is started for it.
pub(crate) fn count() -> usize {
    SHARED.count()
}

impl Threads {
    pub(crate) const fn new(count: Option<usize>) -> Self {
        Self {
            count,
            first: OnceLock::new(),
            forked: Mutex::new(None),
        }
    }

    /// Starts them, if they are not there yet.
    pub(crate) fn start(&self) -> Result<(), OutOfThreadsError> {
        match HAS_THREADS {
            true => self.pool().map(|_| ()),
            false => Ok(()),
        }
    }

    /// How many share work that is given to [`Threads::run`] here.
    pub(crate) fn count(&self) -> usize {
        match IS_WORKER.get() {
            _ if !HAS_THREADS => 1,
            true => rayon::current_num_threads(),
            false => self.count.unwrap_or_else(default_count),
        }
    }

    /// Runs `work` with these threads, or with those that run this already.
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
        // A worker of another pool would take up other work while it waits; a thread does not.
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
        // Nobody works while this is locked: threads are started, and not waited for.
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

/// Ends the threads of this process. Those of the process that it was forked from are not there, and
/// what belongs to them may be in the middle of a change.
fn abandon(pool: Option<Pool>) {
    match pool {
        Some(pool) if pool.process != process_id() => std::mem::forget(pool),
        _ => {}
    }
}

/// Of this process; systems without processes panic when asked.
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

/// Starts one thread and waits until it has begun. Rust ends the process where a thread that has its stack
/// lacks the little memory that it begins with: there is room for both, or it is not asked for.
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
        let _ = sender.send(()); // whoever waits is there
        drop(sender);
        worker.run();
    })?;
    let _ = has_begun.recv(); // a thread that ended has begun too
    Ok(())
}

/// As many as `RAYON_NUM_THREADS` says, else one for each core that this process may use.
fn default_count() -> usize {
    static COUNT: OnceLock<usize> = OnceLock::new();
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

    /// A worker of somebody else's pool that took up another task while it waits would meet the lock of
    /// the one below it on its own stack.
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
