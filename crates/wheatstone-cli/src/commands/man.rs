//! `wheatstone man`.

use crate::{failure::Outcome, verbosity::say};
use clap::Args;
use std::path::{Path, PathBuf};
use wheatstone::storage;

/// Write manual pages: one for the program and one for each verb
#[derive(Args)]
#[command(after_help = "Example:\n  wheatstone man ~/.local/share/man/man1 && man wheatstone-fit")]
pub(crate) struct Man {
    /// The folder for the pages
    folder: PathBuf,
}

impl Man {
    pub(crate) fn run(self) -> Outcome {
        storage::write_folder(&self.folder, write_pages)?;
        say!("Wrote manual pages to {}", self.folder.display());
        Ok(())
    }
}

fn write_pages(folder: &Path) -> Outcome {
    let mut program = crate::definition();
    // Fills in the verbs' full names.
    program.build();
    let verbs = program.get_subcommands().filter(|verb| verb.get_name() != "help");
    let verbs: Vec<clap::Command> = verbs.cloned().collect();
    for command in std::iter::once(program).chain(verbs) {
        let name = command.get_display_name().unwrap_or(command.get_name()).to_owned();
        let mut page = Vec::new();
        clap_mangen::Man::new(command).render(&mut page)?;
        storage::write(&folder.join(format!("{name}.1")), &page)?;
    }
    Ok(())
}
