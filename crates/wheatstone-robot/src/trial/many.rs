//! Many trials, side by side.

use super::{Clock, Observers, Outcome, Trial};
use std::{
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};
use wheatstone_core::Result;
use wheatstone_numeric::progress::{Muted, Progress};

/// Runs trials, as many at a time as there are threads; what became of them stands in their order,
/// whatever the number of threads.
///
/// # Errors
///
/// The first of [`Trial::run`]'s, in the order of the trials.
pub fn run_all(
    trials: &[Trial],
    observers: Observers,
    clock: Clock,
    progress: &dyn Progress,
) -> Result<Vec<Outcome>> {
    if let [trial] = trials {
        return Ok(vec![trial.run(observers, clock, progress)?]);
    }
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let outcomes = Mutex::new(trials.iter().map(|_| None).collect::<Vec<_>>());
    // Threads of their own: a pool's would take up one world amid a step of another, and the step's time
    // would tell nothing.
    let work = || {
        while let Some((index, trial)) = take(&next, trials) {
            let outcome = trial.run(observers, clock, &Muted(progress));
            let failed = outcome.is_err();
            outcomes.lock().unwrap_or_else(PoisonError::into_inner)[index] = Some(outcome);
            let finished = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress.report("worlds", finished as u64, trials.len() as u64);
            if failed {
                return;
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..rayon::current_num_threads().min(trials.len()) {
            scope.spawn(work);
        }
    });
    // Where one failed, the others stopped: none that follows it counts.
    outcomes.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().flatten().collect()
}

fn take<'a>(next: &AtomicUsize, trials: &'a [Trial]) -> Option<(usize, &'a Trial)> {
    let index = next.fetch_add(1, Ordering::Relaxed);
    trials.get(index).map(|trial| (index, trial))
}
