//! The program, run as a user runs it.

use std::{
    path::Path,
    process::{Command, Output, Stdio},
};

/// In a folder, with nothing to read from.
pub(crate) fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wheatstone"));
    command.args(arguments).current_dir(folder).stdin(Stdio::null());
    command
}

/// Runs it, however it ends.
pub(crate) fn wheatstone(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// What it says to people.
pub(crate) fn said(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Runs what must work, and gives standard output and what is said to people.
pub(crate) fn done(folder: &Path, arguments: &[&str]) -> (String, String) {
    let output = wheatstone(folder, arguments);
    let said = said(&output);
    assert!(output.status.success(), "{arguments:?}: {said}");
    (String::from_utf8(output.stdout).unwrap(), said)
}

/// Runs what must fail with one message and a hint, and gives both.
pub(crate) fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = wheatstone(folder, arguments);
    let said = said(&output);
    let status = output.status;
    assert!(matches!(status.code(), Some(1 | 2)), "{arguments:?}: {status:?} {said}");
    assert!(output.stdout.is_empty(), "{arguments:?} prints although it fails");
    assert_eq!(said.matches("error: ").count(), 1, "{arguments:?}: {said}");
    // What cannot be read as a command ends with 2, and with tips of its own.
    assert!(said.contains("hint: ") || status.code() == Some(2), "{arguments:?}: {said}");
    said
}
