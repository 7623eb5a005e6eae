//! `wheatstone completions`.

use crate::failure::Outcome;
use clap::Args;
use clap_complete::Shell;
use std::io::Write;

/// Print a completion script for a shell
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    wheatstone completions bash > ~/.local/share/bash-completion/completions/wheatstone\n  \
    wheatstone completions zsh  > ~/.zfunc/_wheatstone\n  \
    wheatstone completions fish > ~/.config/fish/completions/wheatstone.fish")]
pub(crate) struct Completions {
    /// The shell
    shell: Shell,
}

impl Completions {
    pub(crate) fn run(self) -> Outcome {
        let mut text = Vec::new();
        clap_complete::generate(self.shell, &mut crate::definition(), "wheatstone", &mut text);
        std::io::stdout().write_all(&text)?;
        Ok(())
    }
}
