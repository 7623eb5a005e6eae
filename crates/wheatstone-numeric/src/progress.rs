//! How long work tells how far it is, and is asked to stop.

use crate::{Error, Result};

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

/// Passes on whether to stop, but no reports: for parts of a task that has reports of its own.
pub struct Muted<'a>(pub &'a dyn Progress);

impl Progress for Muted<'_> {
    fn report(&self, _task: &str, _done: u64, _total: u64) {}

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
