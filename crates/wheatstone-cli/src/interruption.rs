//! Ctrl-C, and requests to end from other programs: work stops at its next step; what has not stopped by then is ended,
//! and leaves nothing half-written.

use std::{
    sync::atomic::{AtomicU8, Ordering},
    thread,
    time::Duration,
};
use wheatstone::storage::discard_unfinished;

/// What work is given to stop by itself, as it does as a rule. It may wait for a pipe, or decode a picture.
const PATIENCE: Duration = Duration::from_millis(500);

/// Exit status of a program that was interrupted: 128 and the number of the signal. 0: nobody asked.
static STATUS: AtomicU8 = AtomicU8::new(0);

/// Ctrl-C's, where the signal is not known.
const CTRL_C: u8 = 130;

/// Listens from now on. Where the system does not allow it, a signal ends the program at once, as ever.
pub(crate) fn listen() {
    #[cfg(unix)]
    let listening = {
        use signal_hook::{
            consts::{SIGHUP, SIGINT, SIGTERM},
            iterator::Signals,
        };
        Signals::new([SIGHUP, SIGINT, SIGTERM]).map(|mut signals| {
            thread::spawn(move || signals.forever().for_each(|signal| stop(128 + signal as u8)));
        })
    };
    #[cfg(not(unix))]
    let listening = ctrlc::set_handler(|| stop(CTRL_C));
    if let Err(problem) = listening {
        crate::verbosity::detail!("cannot handle signals: {problem}");
    }
}

/// Asks work to stop, and ends the program where it does not. Whoever asks twice is in a hurry.
fn stop(status: u8) {
    if STATUS.swap(status, Ordering::SeqCst) != 0 {
        end();
    }
    thread::spawn(|| {
        thread::sleep(PATIENCE);
        crate::verbosity::labelled("error", &wheatstone::Error::Cancelled.to_string());
        end();
    });
}

fn end() -> ! {
    discard_unfinished();
    std::process::exit(status().into());
}

/// Whether somebody has asked to stop.
pub(crate) fn asked() -> bool {
    STATUS.load(Ordering::Relaxed) != 0
}

/// The exit status of work that was interrupted.
pub(crate) fn status() -> u8 {
    match STATUS.load(Ordering::Relaxed) {
        0 => CTRL_C,
        asked => asked,
    }
}
