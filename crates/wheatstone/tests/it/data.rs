//! Where real data lie, if they are there.

use std::path::PathBuf;

/// The folder of a data set: in `WHEATSTONE_DATA`, or in `shared/data` beside the project. `None`, with
/// a word on standard error, where it is absent.
pub(crate) fn folder(set: &str) -> Option<PathBuf> {
    let root = std::env::var_os("WHEATSTONE_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    let folder = root.join(set);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: no `{set}` in {}; set WHEATSTONE_DATA to test on it", root.display());
    None
}
