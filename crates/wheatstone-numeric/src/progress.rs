//! How long work tells how far it is, and is asked to stop.

use crate::{Error, Result};
use std::{
    ops::ControlFlow,
    sync::atomic::{AtomicBool, Ordering},
};

/// Hears how far a task is. Reports may come from several threads at once.
pub trait Progress: Sync {
    /// `done` of `total` steps of the task called `task` are finished.
    fn report(&self, task: &str, done: u64, total: u64);

    /// Whether the work should stop at the next step.
    fn cancelled(&self) -> bool {
        false
    }

    /// An error where the work should stop, for `?`.
    ///
    /// # Errors
    ///
    /// [`Error::Cancelled`].
    fn check(&self) -> Result<()> {
        if self.cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

/// Hears nothing and never stops.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _task: &str, _done: u64, _total: u64) {}
}

/// Hears reports by a closure of task, steps done and steps in all, which says whether to go on.
///
/// Work stops soon after the closure has first returned [`ControlFlow::Break`], with
/// [`Error::Cancelled`].
///
/// ```
/// use std::ops::ControlFlow;
/// use wheatstone_numeric::progress::{FnProgress, Progress};
///
/// let patient = FnProgress::new(|_task, done, _total| {
///     if done < 10 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
/// });
/// patient.report("fitting", 9, 100);
/// assert!(!patient.cancelled());
/// patient.report("fitting", 10, 100);
/// assert!(patient.cancelled());
/// ```
pub struct FnProgress<F> {
    call: F,
    stopped: AtomicBool,
}

impl<F: Fn(&str, u64, u64) -> ControlFlow<()> + Sync> FnProgress<F> {
    /// Of a closure, which may be called from several threads at once.
    pub fn new(call: F) -> Self {
        Self { call, stopped: AtomicBool::new(false) }
    }
}

impl<F: Fn(&str, u64, u64) -> ControlFlow<()> + Sync> Progress for FnProgress<F> {
    fn report(&self, task: &str, done: u64, total: u64) {
        if (self.call)(task, done, total).is_break() {
            self.stopped.store(true, Ordering::Relaxed);
        }
    }

    fn cancelled(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }
}

/// Passes on whether to stop, but no reports: for parts of a task that has reports of its own.
pub struct Muted<'a>(pub &'a dyn Progress);

impl Progress for Muted<'_> {
    fn report(&self, _task: &str, _done: u64, _total: u64) {}

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
