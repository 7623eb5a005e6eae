//! What outputs ask of the file system. Tests put calls that fail in their place.

use std::{
    fs::{self, File, OpenOptions},
    io::{ErrorKind, Result, Write},
    path::Path,
};

/// Calls to the file system, each of which may fail.
pub(super) trait Calls: Send + Sync {
    /// Makes a file that was not there.
    fn create(&self, path: &Path) -> Result<File> {
        OpenOptions::new().write(true).create_new(true).open(path)
    }

    fn create_folder(&self, path: &Path) -> Result<()> {
        fs::create_dir(path)
    }

    fn write(&self, file: &mut File, bytes: &[u8]) -> Result<usize> {
        file.write(bytes)
    }

    /// Waits until a file, or a folder's list of names, is on the disk.
    fn sync(&self, file: &File) -> Result<()> {
        file.sync_all()
    }

    fn rename(&self, from: &Path, to: &Path) -> Result<()> {
        fs::rename(from, to)
    }
}

/// The calls of the system.
pub(super) struct System;

impl Calls for System {}

/// Repeats a call that a signal interrupted.
pub(super) fn again<T>(mut call: impl FnMut() -> Result<T>) -> Result<T> {
    loop {
        match call() {
            Err(problem) if problem.kind() == ErrorKind::Interrupted => {}
            done => return done,
        }
    }
}

#[cfg(test)]
pub(super) mod failing {
    use super::Calls;
    use std::{
        fs::File,
        io::{Error, ErrorKind, Result},
        path::Path,
        sync::atomic::{AtomicUsize, Ordering},
    };

    /// The system's calls, of which one fails.
    pub(crate) struct Failing {
        left: AtomicUsize,
        kind: ErrorKind,
    }

    impl Failing {
        /// The call of this number fails, counted from 0.
        pub(crate) fn at(call: usize, kind: ErrorKind) -> Self {
            Self { left: AtomicUsize::new(call + 1), kind }
        }

        /// Whether the call that was to fail has come.
        pub(crate) fn has_failed(&self) -> bool {
            self.left.load(Ordering::Relaxed) == 0
        }

        fn count(&self) -> Result<()> {
            let count = |left: usize| left.checked_sub(1);
            match self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, count) {
                Ok(1) => Err(Error::from(self.kind)),
                _ => Ok(()),
            }
        }
    }

    impl Calls for Failing {
        fn create(&self, path: &Path) -> Result<File> {
            self.count().and_then(|()| super::System.create(path))
        }

        fn create_folder(&self, path: &Path) -> Result<()> {
            self.count().and_then(|()| super::System.create_folder(path))
        }

        /// Half of the bytes at a time, as a disk that fills up takes them.
        fn write(&self, file: &mut File, bytes: &[u8]) -> Result<usize> {
            let half = &bytes[..bytes.len().div_ceil(2)];
            self.count().and_then(|()| super::System.write(file, half))
        }

        fn sync(&self, file: &File) -> Result<()> {
            self.count().and_then(|()| super::System.sync(file))
        }

        fn rename(&self, from: &Path, to: &Path) -> Result<()> {
            self.count().and_then(|()| super::System.rename(from, to))
        }
    }
}
