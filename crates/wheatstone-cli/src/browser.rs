//! A page shown to whoever sits at the terminal, when they ask for it.

use crate::verbosity::remark;
use clap::Args;
use std::{
    io::IsTerminal,
    path::Path,
    process::{Command, Stdio},
};

/// Whether the report is shown when it is written.
#[derive(Args)]
pub(crate) struct Showing {
    /// Open the report in the browser (at a terminal only)
    #[arg(long)]
    open: bool,
}

impl Showing {
    /// Opens the page if that was asked for and somebody is there to see it.
    pub(crate) fn show(&self, page: &Path) {
        if !self.open {
            return;
        }
        if !std::io::stderr().is_terminal() {
            remark!("note", "`--open` does nothing without a terminal");
            return;
        }
        let mut command = opener();
        command.arg(page).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        if let Err(e) = command.spawn() {
            remark!("note", "no browser could be started ({e}); open the file yourself");
        }
    }
}

/// What the system opens files with.
fn opener() -> Command {
    if cfg!(windows) {
        Command::new("explorer")
    } else if cfg!(target_os = "macos") {
        Command::new("open")
    } else {
        Command::new("xdg-open")
    }
}
