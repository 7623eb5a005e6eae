//! Where an output goes: into a file, which is replaced as a whole, or through a device or a pipe.

#[cfg(target_arch = "wasm32")]
use super::beside::AtomicWriteFile;
#[cfg(not(target_arch = "wasm32"))]
use atomic_write_file::AtomicWriteFile;
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
    Beside(AtomicWriteFile),
    /// Straight into what has no content of its own to replace: a device, a pipe, an open file's name.
    Through(File),
}

/// Whether something is written straight into: it is there and is no regular file, or its name stands for what a
/// process has opened, as `/dev/stdout` does.
fn is_written_through(path: &Path) -> Result<bool> {
    let is_opened = |path: &Path| path.starts_with("/dev") || path.starts_with("/proc");
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => Err(ErrorKind::IsADirectory.into()),
        Ok(found) => Ok(!found.is_file() || is_opened(path)),
        Err(problem) if problem.kind() == ErrorKind::NotFound => Ok(false),
        Err(problem) => Err(problem),
    }
}

/// The file that a path leads to through symbolic links, there or not.
pub(super) fn followed(path: &Path) -> Result<PathBuf> {
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        match fs::symlink_metadata(&path) {
            Ok(found) if found.is_symlink() => {
                let target = fs::read_link(&path)?;
                path = path.parent().unwrap_or(Path::new("")).join(target);
            }
            _ => return Ok(path),
        }
    }
    Err(Error::other("too many symbolic links"))
}

impl Place {
    pub(super) fn open(path: &Path) -> Result<Self> {
        if is_written_through(path)? {
            return Ok(Self::Through(OpenOptions::new().write(true).truncate(true).open(path)?));
        }
        Ok(Self::Beside(AtomicWriteFile::open(&followed(path)?)?))
    }

    /// Fails where [`Place::open`] would, without waiting for anybody to read from a pipe.
    pub(super) fn check(path: &Path) -> Result<()> {
        if is_written_through(path)? {
            return Ok(());
        }
        AtomicWriteFile::open(&followed(path)?).map(drop)
    }

    pub(super) fn commit(self) -> Result<()> {
        match self {
            Self::Beside(file) => file.commit(),
            Self::Through(mut file) => file.flush(),
        }
    }
}

impl Write for Place {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        match self {
            Self::Beside(file) => file.write(bytes),
            Self::Through(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> Result<()> {
        match self {
            Self::Beside(file) => file.flush(),
            Self::Through(file) => file.flush(),
        }
    }
}
