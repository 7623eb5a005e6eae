//! Long work: the interpreter released, Ctrl-C heard, progress reported.

use crate::{errors::raised, pool::pool};
use pyo3::prelude::*;
use std::{
    panic::resume_unwind,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{RecvTimeoutError, sync_channel},
    },
    time::Duration,
};
use wheatstone::Progress;

/// What the work reports, and whether it is to stop.
#[derive(Default)]
struct Listener {
    cancelled: AtomicBool,
    last: Mutex<Option<(String, u64, u64)>>,
}

impl Progress for Listener {
    fn report(&self, task: &str, done: u64, total: u64) {
        *self.last.lock().unwrap_or_else(PoisonError::into_inner) =
            Some((task.into(), done, total));
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// How often signals are looked at and progress is passed on.
const TURN: Duration = Duration::from_millis(50);

/// Runs `work` on the pool, while the calling thread hears signals and calls `callback(task, done, total)`.
/// An exception of the callback, or Ctrl-C, cancels the work.
pub(crate) fn run<T: Send>(
    py: Python,
    callback: Option<Py<PyAny>>,
    work: impl FnOnce(&dyn Progress) -> wheatstone::Result<T> + Send,
) -> PyResult<T> {
    let listener = Listener::default();
    let mut problem: Option<PyErr> = None;
    let outcome = py.detach(|| {
        let pool = pool()?;
        std::thread::scope(|scope| {
            let (done, finished) = sync_channel::<()>(1);
            let listener = &listener;
            let worker = scope.spawn(move || {
                let found = pool.install(|| work(listener));
                drop(done);
                found
            });
            while let Err(RecvTimeoutError::Timeout) = finished.recv_timeout(TURN) {
                if problem.is_some() {
                    continue;
                }
                problem = Python::attach(|py| heard(py, listener, callback.as_ref())).err();
                listener.cancelled.store(problem.is_some(), Ordering::Relaxed);
            }
            Ok(worker.join().unwrap_or_else(|panic| resume_unwind(panic)))
        })
    });
    match (outcome, problem) {
        (_, Some(problem)) => Err(problem),
        (outcome, None) => outcome.and_then(|found| found.map_err(raised)),
    }
}

fn heard(py: Python, listener: &Listener, callback: Option<&Py<PyAny>>) -> PyResult<()> {
    py.check_signals()?;
    let last = listener.last.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let (Some(callback), Some(last)) = (callback, last) {
        callback.call1(py, last)?;
    }
    Ok(())
}
