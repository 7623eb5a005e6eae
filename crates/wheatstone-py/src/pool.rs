//! The threads that work is done on: a pool of this package's own, whose size can be set, and which a forked
//! process makes anew.
//!
//! A worker of a cluster is one of many processes on its machine: `WHEATSTONE_THREADS=1` keeps threads and
//! processes from multiplying.

use pyo3::{exceptions::PyRuntimeError, prelude::*, types::PyDict};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::{
    cell::RefCell,
    sync::{
        Arc, Mutex, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard,
        atomic::{AtomicUsize, Ordering},
    },
};

/// A pool, and which process made it: after a fork its threads do not exist in the child.
struct Made {
    process: u32,
    threads: usize,
    pool: Arc<ThreadPool>,
}

static POOL: Mutex<Option<Made>> = Mutex::new(None);

/// A child has the locks of its parent, but not the threads that would release them. So whoever takes a lock that
/// others wait for reads this first, and who forks writes it.
static FORK: RwLock<()> = RwLock::new(());

thread_local! {
    /// Held by a thread that forks, in the parent and in the child.
    static FORKING: RefCell<Option<RwLockWriteGuard<'static, ()>>> = const { RefCell::new(None) };
}

/// No thread forks until this is dropped. Take it without holding the interpreter, and once at a time.
pub(crate) fn unforked() -> RwLockReadGuard<'static, ()> {
    FORK.read().unwrap_or_else(PoisonError::into_inner)
}

#[pyfunction]
fn before_fork() {
    let guard = FORK.write().unwrap_or_else(PoisonError::into_inner);
    FORKING.set(Some(guard));
}

#[pyfunction]
fn after_fork() {
    FORKING.take();
}

/// Has Python call these two around every fork, where there is such a thing.
pub(crate) fn heed_forks(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let os = module.py().import("os")?;
    if !os.hasattr("register_at_fork")? {
        return Ok(());
    }
    let after = wrap_pyfunction!(after_fork, module)?;
    let hooks = PyDict::new(module.py());
    hooks.set_item("before", wrap_pyfunction!(before_fork, module)?)?;
    hooks.set_item("after_in_parent", &after)?;
    hooks.set_item("after_in_child", &after)?;
    os.call_method("register_at_fork", (), Some(&hooks)).map(drop)
}

/// The number that was set; 0 where none was.
static THREADS: AtomicUsize = AtomicUsize::new(0);

/// More threads than any machine has.
const MOST: usize = 1024;

fn wanted() -> usize {
    let given = |name: &str| std::env::var(name).ok()?.trim().parse::<usize>().ok();
    let set = Some(THREADS.load(Ordering::Relaxed)).filter(|count| *count > 0);
    set.or_else(|| given("WHEATSTONE_THREADS").filter(|count| *count > 0))
        .or_else(|| given("RAYON_NUM_THREADS").filter(|count| *count > 0))
        .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, Into::into))
        .min(MOST)
}

/// The pool of this process. Call it without holding the interpreter.
pub(crate) fn pool() -> PyResult<Arc<ThreadPool>> {
    let (process, threads) = (std::process::id(), wanted());
    let _unforked = unforked();
    let mut made = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(own) = made.as_ref().filter(|own| own.process == process && own.threads == threads)
    {
        return Ok(own.pool.clone());
    }
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|index| format!("wheatstone-{index}"))
        .build()
        .map_err(|e| PyRuntimeError::new_err(format!("cannot start {threads} threads: {e}")))?;
    let pool = Arc::new(pool);
    let before = made.replace(Made { process, threads, pool: pool.clone() });
    if let Some(other) = before.filter(|other| other.process != process) {
        // Waiting for threads that stayed in the parent would never end.
        std::mem::forget(other);
    }
    Ok(pool)
}

/// Sets the number of threads that work is done on; 0 for the default.
#[pyfunction]
pub(crate) fn set_threads(count: usize) {
    THREADS.store(count.min(MOST), Ordering::Relaxed);
}

/// The number of threads that work is done on.
#[pyfunction]
pub(crate) fn get_threads() -> usize {
    wanted()
}
