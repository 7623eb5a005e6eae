//! Progress on standard error: a bar on a terminal, a line now and then elsewhere.

use indicatif::{ProgressBar, ProgressStyle};
use std::{
    io::IsTerminal,
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};
use wheatstone::numeric::progress::Progress;

/// Shows how far a command is. Nothing appears for work that takes less than a second.
pub(crate) struct Bar {
    state: Mutex<State>,
    terminal: bool,
}

struct State {
    task: String,
    began: Instant,
    last_line: Instant,
    bar: Option<ProgressBar>,
}

/// Before this a bar would only flicker.
const PATIENCE: Duration = Duration::from_secs(1);
/// Lines in a log need not come more often.
const LINE_EVERY: Duration = Duration::from_secs(5);

impl Bar {
    pub(crate) fn new() -> Self {
        let now = Instant::now();
        let state = State { task: String::new(), began: now, last_line: now, bar: None };
        Self { state: Mutex::new(state), terminal: std::io::stderr().is_terminal() }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        let state = self.state.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let Some(bar) = state.bar.take() {
            bar.finish_and_clear();
        }
    }
}

impl Progress for Bar {
    fn cancelled(&self) -> bool {
        crate::interruption::asked()
    }

    fn report(&self, task: &str, done: u64, total: u64) {
        if !crate::verbosity::speaks() {
            return;
        }
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.task != task {
            if let Some(bar) = state.bar.take() {
                bar.finish_and_clear();
            }
            state.task = task.to_owned();
            state.began = Instant::now();
            state.last_line = state.began;
        }
        if !self.terminal {
            if state.last_line.elapsed() >= LINE_EVERY {
                state.last_line = Instant::now();
                crate::verbosity::tell(format_args!("{task}: {done} of {total}"));
            }
            return;
        }
        if state.bar.is_none() && state.began.elapsed() >= PATIENCE {
            let began = state.began.elapsed();
            let style = ProgressStyle::with_template("{msg} [{bar:32}] {pos}/{len} {eta} left");
            let bar = ProgressBar::new(total).with_elapsed(began).with_message(task.to_owned());
            state.bar = Some(match style {
                Ok(style) => bar.with_style(style.progress_chars("=> ")),
                Err(_) => bar,
            });
        }
        if let Some(bar) = &state.bar {
            bar.set_length(total);
            // Threads may report out of order.
            bar.set_position(done.max(bar.position()).min(total));
        }
    }
}

/// Shows how many rows have gone by, where nobody knows how many will come; on terminals only, and
/// after a second.
pub(crate) struct Counter {
    began: Instant,
    shown: Option<ProgressBar>,
    watched: bool,
}

impl Counter {
    /// `quiet` where rows themselves go to the terminal.
    pub(crate) fn new(quiet: bool) -> Self {
        let watched = std::io::stderr().is_terminal() && !quiet;
        Self { began: Instant::now(), shown: None, watched }
    }

    /// Tells that `done` rows have gone by in all.
    pub(crate) fn reach(&mut self, done: u64) {
        if !self.watched || self.began.elapsed() < PATIENCE {
            return;
        }
        let elapsed = self.began.elapsed();
        let bar = self.shown.get_or_insert_with(|| {
            let bar = ProgressBar::new_spinner().with_elapsed(elapsed);
            match ProgressStyle::with_template("located {human_pos} rows, {msg}") {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        });
        bar.set_message(format!("{:.0} a second", done as f64 / elapsed.as_secs_f64()));
        bar.set_position(done);
    }
}

impl Drop for Counter {
    fn drop(&mut self) {
        if let Some(bar) = self.shown.take() {
            bar.finish_and_clear();
        }
    }
}
