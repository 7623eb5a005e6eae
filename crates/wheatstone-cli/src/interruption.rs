//! Ctrl-C: the first time work stops at its next step and leaves nothing half-written; the second
//! time the program ends at once.

use std::sync::atomic::{AtomicBool, Ordering};

/// Exit status of a program that was interrupted: 128 and the number of the signal.
pub(crate) const STATUS: u8 = 130;

static ASKED: AtomicBool = AtomicBool::new(false);

/// Listens from now on. Where the system does not allow it, Ctrl-C ends the program at once, as ever.
pub(crate) fn listen() {
    let caught = ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::SeqCst) {
            std::process::exit(STATUS.into());
        }
        crate::verbosity::say!("\nstopping at the next step … (Ctrl-C again to stop now)");
    });
    if let Err(problem) = caught {
        crate::verbosity::detail!("cannot handle Ctrl-C: {problem}");
    }
}

/// Whether the reader has asked to stop.
pub(crate) fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}
