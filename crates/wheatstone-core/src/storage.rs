//! Files read whole, and files written so that a failure leaves the old one as it was.

#[cfg(any(target_arch = "wasm32", test))]
mod beside;
mod place;

use crate::{Error, Result};
#[cfg(not(target_arch = "wasm32"))]
use atomic_write_file::AtomicWriteFile;
#[cfg(target_arch = "wasm32")]
use beside::AtomicWriteFile;
use place::Place;
use std::{
    io::{BufWriter, Read, Write},
    path::{Path, PathBuf},
};

/// Reads a text file of at most `limit` bytes.
///
/// # Errors
///
/// [`Error::Io`] where it cannot be read (a folder, say), [`Error::Malformed`] where it is larger
/// than `limit` or not UTF-8.
pub fn read_text(path: &Path, limit: u64) -> Result<String> {
    let mut bytes = Vec::new();
    open(path)?.take(limit + 1).read_to_end(&mut bytes).map_err(|e| Error::reading(path, e))?;
    let malformed = |problem: String, hint: &str| Error::Malformed {
        path: path.into(),
        line: None,
        problem,
        hint: hint.into(),
    };
    if bytes.len() as u64 > limit {
        return Err(malformed(
            format!("larger than {limit} bytes"),
            "is this the file that you meant?",
        ));
    }
    String::from_utf8(bytes).map_err(|e| {
        let before = &e.as_bytes()[..e.utf8_error().valid_up_to()];
        let line = before.iter().filter(|b| **b == b'\n').count() as u64 + 1;
        Error::Malformed {
            path: path.into(),
            line: Some(line),
            problem: "not text (UTF-8)".into(),
            hint: "is this the file that you meant?".into(),
        }
    })
}

/// Opens a regular file (or a pipe) for reading; a folder is refused by name.
///
/// # Errors
///
/// [`Error::Io`].
pub fn open(path: &Path) -> Result<std::fs::File> {
    let file = std::fs::File::open(path).map_err(|e| Error::reading(path, e))?;
    if file.metadata().map_err(|e| Error::reading(path, e))?.is_dir() {
        return Err(Error::reading(path, std::io::ErrorKind::IsADirectory.into()));
    }
    Ok(file)
}

/// A file that appears under its name only when [`Output::commit`] is called: written beside,
/// synced, renamed. Dropped before that, it leaves nothing.
///
/// Of a symbolic link the file that it leads to is replaced. A file that is replaced keeps its mode. Devices, pipes and
/// names such as `/dev/stdout` are written through and stay what they are.
pub struct Output {
    path: PathBuf,
    file: BufWriter<Place>,
}

impl Output {
    /// Begins to write `path`. For a pipe it waits until somebody reads from it.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] where the folder cannot be written to, or `path` is itself a folder.
    pub fn create(path: &Path) -> Result<Self> {
        let file = Place::open(path).map_err(|e| Error::writing(path, e))?;
        // Large enough for a table's rows to reach the disk in few calls.
        Ok(Self { path: path.into(), file: BufWriter::with_capacity(1 << 20, file) })
    }

    /// Whether `path` can be written to, which is better known before long work than after it.
    ///
    /// # Errors
    ///
    /// As [`Output::create`].
    pub fn check(path: &Path) -> Result<()> {
        Place::check(path).map_err(|e| Error::writing(path, e))
    }

    /// Puts the finished file in its place.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; the old file, if there was one, is then untouched.
    pub fn commit(self) -> Result<()> {
        let Self { path, file } = self;
        let file = file.into_inner().map_err(std::io::IntoInnerError::into_error);
        file.and_then(Place::commit).map_err(|e| Error::writing(&path, e))
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

/// Writes a whole file at once, see [`Output`].
///
/// # Errors
///
/// [`Error::Io`]; the old file, if there was one, is then untouched.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut output = Output::create(path)?;
    output.write_all(bytes).map_err(|e| Error::writing(path, e))?;
    output.commit()
}

/// Makes a folder and those above it.
///
/// # Errors
///
/// [`Error::Io`].
pub fn create_folder(path: &Path) -> Result<()> {
    std::fs::create_dir_all(path).map_err(|source| Error::Io {
        action: "create",
        path: path.into(),
        source,
    })
}
