//! Outputs that are no inputs.

use crate::failure::{Failure, Outcome};
use std::path::Path;

/// Refuses an output that is one of the inputs: what was read would be gone.
pub(crate) fn refuse_inputs<'a>(
    output: &Path,
    inputs: impl IntoIterator<Item = &'a Path>,
) -> Outcome {
    // What is not there yet, or is written to standard output, is no input.
    let Ok(place) = output.canonicalize() else { return Ok(()) };
    let is_same = |input: &&Path| {
        let of_capture = || input.join("capture.toml").canonicalize();
        let same =
            |found: std::io::Result<_>| found.is_ok_and(|found: std::path::PathBuf| found == place);
        same(input.canonicalize()) || same(of_capture())
    };
    match inputs.into_iter().filter(|_| place.is_file()).find(is_same) {
        Some(input) => Err(Failure::usage(
            format!(
                "{} would be written over, and it is read from {}",
                output.display(),
                input.display()
            ),
            "give the output another name",
        )),
        None => Ok(()),
    }
}
