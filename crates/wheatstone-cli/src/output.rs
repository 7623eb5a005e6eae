//! Outputs that are no inputs, files that are no folders, and what earlier runs have left.

use crate::{
    failure::{Failure, Outcome},
    verbosity::remark,
};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};
use wheatstone::{Error, capture::FILE_NAME};

/// Refuses an output that is one of the inputs: what was read would be gone.
pub(crate) fn refuse_inputs<'a>(
    output: &Path,
    inputs: impl IntoIterator<Item = &'a Path>,
) -> Outcome {
    // What is not there yet, or is written to standard output, is no input.
    let Ok(place) = output.canonicalize() else { return Ok(()) };
    if !place.is_file() {
        return Ok(());
    }
    let is_place = |path: &Path| path.canonicalize().is_ok_and(|found| found == place);
    let is_same = |input: &&Path| is_place(input) || is_place(&input.join(FILE_NAME));
    match inputs.into_iter().find(is_same) {
        Some(input) => Err(Failure::usage(
            format!("{} is read, and would be written over", input.display()),
            "give the output another name",
        )),
        None => Ok(()),
    }
}

/// Refuses a name for a page that is one of something else.
pub(crate) fn refuse_other_than_page(output: &Path) -> Outcome {
    let ending = output.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    match ending.as_deref() {
        None | Some("html" | "htm") => Ok(()),
        Some(ending) => Err(Failure::usage(
            format!("{}: reports are not written as .{ending}", output.display()),
            "let its name end in `.html`; browsers print it to PDF, and `--json` gives the figures as numbers",
        )),
    }
}

/// Refuses to move files into a folder where one of them would take the place of a folder: the system's own message does
/// not say which.
pub(crate) fn refuse_folders(filled: &Path, place: &Path) -> Outcome {
    let failed = |source| Error::reading(filled, source);
    let entries =
        filled.read_dir().map_err(failed)?.collect::<Result<Vec<_>, _>>().map_err(failed)?;
    let files = entries.iter().filter(|entry| entry.path().is_file());
    let folders = files.map(|entry| place.join(entry.file_name())).filter(|path| path.is_dir());
    match folders.min() {
        Some(path) => Err(Failure::usage(
            format!("{} is a folder, and a file of that name is to be written", path.display()),
            "move it away, or give the output another name",
        )),
        None => Ok(()),
    }
}

/// Files of an earlier run in the folders that a run writes to: beside new ones they are easily taken for its own.
#[derive(Default)]
pub(crate) struct Earlier(BTreeSet<PathBuf>);

impl Earlier {
    /// Looks, before the run, for files with these names in a folder. One of them, `mark`, is in every folder that is ours.
    pub(crate) fn look(&mut self, folder: &Path, mark: &str, names: &BTreeSet<String>) {
        if folder.join(mark).is_file() {
            let files = names.iter().map(|name| folder.join(name));
            self.0.extend(files.filter(|path| path.is_file()));
        }
    }

    /// Says which of them this run has not written.
    pub(crate) fn tell(&self, written: &BTreeSet<PathBuf>) {
        const MOST: usize = 4;
        let left: Vec<String> =
            self.0.difference(written).map(|path| path.display().to_string()).collect();
        match &left[..] {
            [] => {}
            [one] => remark!("note", "{one} is of an earlier run"),
            [some @ .., last] if left.len() <= MOST => {
                remark!("note", "{} and {last} are of an earlier run", some.join(", "));
            }
            all => {
                let (some, more) = all.split_at(MOST);
                remark!(
                    "note",
                    "{} and {} more files are of an earlier run",
                    some.join(", "),
                    more.len()
                );
            }
        }
    }
}
