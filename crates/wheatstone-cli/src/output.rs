//! Outputs that are no inputs, and files that are no folders.

use crate::failure::{Failure, Outcome};
use std::path::Path;
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
