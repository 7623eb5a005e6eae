//! Outputs that are no inputs.

use crate::failure::{Failure, Outcome};
use std::path::Path;
use wheatstone::capture::FILE_NAME;

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
