//! Where real data is, if it is.

use std::path::{Path, PathBuf};

/// The folder of a set of real data: in `WHEATSTONE_DATA`, or in `shared/data` beside the project.
/// `None`, with a word to whoever reads the test's output, where it is absent.
pub(crate) fn folder(set: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let root = std::env::var_os("WHEATSTONE_DATA").map_or(beside, PathBuf::from);
    let folder = root.join(set);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: no folder {}", folder.display());
    None
}
