//! Pictures that lie beside those of a capture, but are of kinds that are not read.

use crate::imaging::is_other_picture;
use std::{
    collections::BTreeSet,
    ffi::OsStr,
    path::{Path, PathBuf},
};

/// Files beside pictures, without those that a picture was made of: cameras save `IMG_1.CR2` beside `IMG_1.JPG`.
pub(super) fn beside(files: &[Vec<PathBuf>]) -> Vec<PathBuf> {
    let pictures: BTreeSet<(Option<&Path>, Option<&OsStr>)> =
        files.iter().flatten().map(|picture| (picture.parent(), picture.file_stem())).collect();
    let folders: BTreeSet<&Path> = pictures.iter().filter_map(|(folder, _)| *folder).collect();
    let entries = folders.into_iter().filter_map(|folder| {
        let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let entries = std::fs::read_dir(here).ok()?.flatten();
        Some(entries.map(|entry| folder.join(entry.file_name())))
    });
    let others = entries.flatten().filter(|file| is_other_picture(file));
    let mut lonely: Vec<PathBuf> =
        others.filter(|file| !pictures.contains(&(file.parent(), file.file_stem()))).collect();
    lonely.sort();
    lonely
}

/// Which files they are, and what to do with them; none where there are none.
pub(super) fn told(files: &[PathBuf]) -> Option<String> {
    // Beyond some, the rest is counted.
    const LISTED: usize = 3;
    let listed: Vec<String> =
        files.iter().take(LISTED).map(|file| format!("`{}`", file.display())).collect();
    let more = files.len().saturating_sub(LISTED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    (!files.is_empty()).then(|| {
        format!(
            "{}{more} {} passed over, as pictures of this kind are not read: save as PNG or TIFF what belongs to the capture",
            listed.join(", "),
            if files.len() == 1 { "was" } else { "were" }
        )
    })
}
