//! Folders that appear as a whole.

use super::{
    calls::{Calls, System, again},
    unfinished::{Unfinished, folder_of},
};
use crate::Error;
use std::{
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

/// Lets `fill` write files into a folder, and gives that folder its name when it is full: where `fill` fails, or the
/// program ends, nothing has happened.
///
/// Of a folder that is there already, files of the same name are replaced, one after the other when all are written.
///
/// # Errors
///
/// Those of `fill`, and [`Error::Io`].
pub fn write_folder<T, E: From<Error>>(
    path: &Path,
    fill: impl FnOnce(&Path) -> Result<T, E>,
) -> Result<T, E> {
    write_with(path, fill, &System)
}

pub(super) fn write_with<T, E: From<Error>>(
    path: &Path,
    fill: impl FnOnce(&Path) -> Result<T, E>,
    calls: &dyn Calls,
) -> Result<T, E> {
    let failed = |problem| Error::writing(path, problem);
    let path = target(path).map_err(failed)?;
    let is_there = path.exists();
    // A folder that is there may be another disk than what it lies in.
    let parent = if is_there { &*path } else { folder_of(&path) };
    fs::create_dir_all(parent).map_err(failed)?;
    let unfinished = Unfinished::create(parent, calls).map_err(failed)?;
    let beside = unfinished.folder();
    again(|| calls.create_folder(&beside)).map_err(failed)?;
    let filled = fill(&beside)?;
    let moved = if is_there {
        fill_in(&beside, &path, calls)
    } else {
        again(|| calls.rename(&beside, &path))
    };
    moved.and_then(|()| sync_folder(parent, calls)).map_err(failed)?;
    Ok(filled)
}

/// The folder itself, where the path is a link to one.
fn target(path: &Path) -> io::Result<PathBuf> {
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => fs::canonicalize(path),
        Ok(_) => Err(io::ErrorKind::NotADirectory.into()),
        Err(_) => Ok(path.components().collect()),
    }
}

/// Moves all files of a folder into another one.
fn fill_in(from: &Path, to: &Path, calls: &dyn Calls) -> io::Result<()> {
    let mut entries = fs::read_dir(from)?.collect::<io::Result<Vec<_>>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let place = to.join(entry.file_name());
        if entry.file_type()?.is_dir() && place.is_dir() {
            fill_in(&entry.path(), &place, calls)?;
        } else {
            again(|| calls.rename(&entry.path(), &place))?;
        }
    }
    sync_folder(to, calls)
}

/// Puts the names in a folder on the disk, where the system opens folders.
pub(super) fn sync_folder(folder: &Path, calls: &dyn Calls) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    let opened = File::open(folder)?;
    again(|| calls.sync(&opened))
}
