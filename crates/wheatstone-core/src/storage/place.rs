//! Where an output goes: into a file, which is replaced as a whole, or through a device or a pipe.

use super::{
    calls::{Calls, again},
    folder::sync_folder,
    unfinished::{Unfinished, folder_of},
};
use std::{
    fs::{self, File, OpenOptions},
    io::{Error, ErrorKind, Result, Write},
    path::{Path, PathBuf},
};

/// As many links as an operating system follows.
const MOST_LINKS: usize = 40;

/// What an output is written to.
pub(super) enum Place {
    /// Beside the file that it will replace.
    Beside(Unfinished, PathBuf),
    /// Straight into what has no content of its own to replace: a device, a pipe, an open file's name.
    Through(File),
}

/// What a path leads to.
enum Destination {
    /// A regular file, there or not, by its own name.
    File(PathBuf),
    /// What is no regular file, or a name that stands for what a process has opened, as `/dev/stdout` does.
    Through,
}

/// Whether the name stands for what a process has opened: what is written then goes where that process writes.
fn is_opened(path: &Path) -> bool {
    let folder = path.parent().and_then(|folder| folder.canonicalize().ok());
    folder.is_some_and(|folder| folder.starts_with("/proc") || folder == Path::new("/dev/fd"))
}

/// Follows a path through symbolic links.
fn destination(path: &Path) -> Result<Destination> {
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => return Err(ErrorKind::IsADirectory.into()),
        Ok(found) if !found.is_file() => return Ok(Destination::Through),
        Err(problem) if problem.kind() != ErrorKind::NotFound => return Err(problem),
        _ => {}
    }
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        if is_opened(&path) {
            return Ok(Destination::Through);
        }
        match fs::symlink_metadata(&path) {
            Ok(found) if found.is_symlink() => {
                let target = fs::read_link(&path)?;
                path = path.parent().unwrap_or(Path::new("")).join(target);
            }
            _ => return Ok(Destination::File(path)),
        }
    }
    Err(Error::other("too many symbolic links"))
}

impl Place {
    pub(super) fn open(path: &Path, calls: &dyn Calls) -> Result<Self> {
        match destination(path)? {
            Destination::File(path) => {
                let unfinished = Unfinished::create(folder_of(&path), calls)?;
                Ok(Self::Beside(unfinished, path))
            }
            Destination::Through => {
                let opened = OpenOptions::new().write(true).truncate(true).open(path)?;
                Ok(Self::Through(opened))
            }
        }
    }

    /// Fails where [`Place::open`] would, without waiting for anybody to read from a pipe.
    pub(super) fn check(path: &Path, calls: &dyn Calls) -> Result<()> {
        match destination(path)? {
            Destination::File(path) => Unfinished::create(folder_of(&path), calls).map(drop),
            Destination::Through => Ok(()),
        }
    }

    pub(super) fn write(&mut self, bytes: &[u8], calls: &dyn Calls) -> Result<usize> {
        match self {
            Self::Beside(unfinished, _) => calls.write(&mut unfinished.file, bytes),
            Self::Through(file) => file.write(bytes),
        }
    }

    pub(super) fn commit(self, calls: &dyn Calls) -> Result<()> {
        match self {
            Self::Beside(unfinished, path) => {
                keep_owner(&unfinished.file, &path)?;
                again(|| calls.sync(&unfinished.file))?;
                unfinished.rename(&path, calls)?;
                sync_folder(folder_of(&path), calls)
            }
            Self::Through(mut file) => file.flush(),
        }
    }
}

/// Gives a file the mode of the one that it will replace, and its owner where that is allowed.
fn keep_owner(file: &File, replaced: &Path) -> Result<()> {
    let Ok(found) = fs::metadata(replaced) else { return Ok(()) };
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt, fchown};
        let _ = fchown(file, Some(found.uid()), Some(found.gid()));
    }
    file.set_permissions(found.permissions())
}
