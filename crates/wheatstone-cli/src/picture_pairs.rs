//! Pictures of two cameras, as they are named on the command line.

use crate::failure::{Failure, Outcome};
use std::path::{Path, PathBuf};
use wheatstone::Error;

/// Pairs of two files, of two folders in sorted order, or of `2 n` files: those of the first camera, then as many of the
/// second, as a shell makes them of `left/*.png right/*.png`.
pub(crate) fn pairs(named: &[PathBuf]) -> Outcome<Vec<[PathBuf; 2]>> {
    let (first, second) = named.split_at(named.len() / 2);
    let files_of = |named: &[PathBuf]| -> Outcome<Vec<PathBuf>> {
        let each: Outcome<Vec<Vec<PathBuf>>> = named.iter().map(|path| files(path)).collect();
        Ok(each?.concat())
    };
    paired(files_of(first)?, files_of(second)?)
}

/// One picture of either camera after the other.
pub(crate) fn paired(first: Vec<PathBuf>, second: Vec<PathBuf>) -> Outcome<Vec<[PathBuf; 2]>> {
    if first.len() != second.len() {
        return Err(Failure::usage(
            format!("{} pictures of one camera, {} of the other", first.len(), second.len()),
            "pictures are paired in sorted order: give the same number of each",
        ));
    }
    Ok(first.into_iter().zip(second).map(|(a, b)| [a, b]).collect())
}

/// A file itself; of a folder its files, in sorted order.
pub(crate) fn files(path: &Path) -> Outcome<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let reading = |source| Error::Io { action: "read", path: path.into(), source };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(path).map_err(reading)? {
        let entry = entry.map_err(reading)?.path();
        found.extend(entry.is_file().then_some(entry));
    }
    found.sort();
    Ok(found)
}
