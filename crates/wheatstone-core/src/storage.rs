//! Files read whole, and files written so that a failure leaves the old one as it was.

mod calls;
#[cfg(test)]
mod faults;
mod folder;
mod names;
mod place;
mod text;
mod unfinished;

pub use folder::write_folder;
pub use names::file_name;
pub use text::{refuse_other_kinds, text};
pub use unfinished::discard_unfinished;

use crate::{Error, Result, limits::Limit};
use calls::{Calls, System};
use place::Place;
use std::{
    io::{BufWriter, Read, Write},
    path::{Path, PathBuf},
};

/// Reads a whole file.
///
/// # Errors
///
/// [`Error::Io`] where it cannot be read (a folder, say), [`Error::Malformed`] where it is larger than the limit.
pub fn read(path: &Path, limit: Limit) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut opened = open(path)?.take(limit.most().saturating_add(1));
    opened.read_to_end(&mut bytes).map_err(|e| Error::reading(path, e))?;
    limit.allow(path, bytes.len() as u64)?;
    Ok(bytes)
}

/// Reads a text file.
///
/// # Errors
///
/// As [`read`], and [`Error::Malformed`] where it is not UTF-8.
pub fn read_text(path: &Path, limit: Limit) -> Result<String> {
    let bytes = read(path, limit)?;
    String::from_utf8(bytes).map_err(|e| text::not_text(path, e.as_bytes(), e.utf8_error()))
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
    file: BufWriter<Called>,
}

/// A place, and the calls by which it is written to.
struct Called {
    place: Place,
    calls: &'static dyn Calls,
}

impl Write for Called {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.place.write(bytes, self.calls)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Output {
    /// Begins to write `path`. For a pipe it waits until somebody reads from it.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] where the folder cannot be written to, or `path` is itself a folder.
    pub fn create(path: &Path) -> Result<Self> {
        Self::create_with(path, &System)
    }

    fn create_with(path: &Path, calls: &'static dyn Calls) -> Result<Self> {
        let place = Place::open(path, calls).map_err(|e| Error::writing(path, e))?;
        let called = Called { place, calls };
        // Large enough for a table's rows to reach the disk in few calls.
        Ok(Self { path: path.into(), file: BufWriter::with_capacity(1 << 20, called) })
    }

    /// Whether `path` can be written to, which is better known before long work than after it.
    ///
    /// # Errors
    ///
    /// As [`Output::create`].
    pub fn check(path: &Path) -> Result<()> {
        Place::check(path, &System).map_err(|e| Error::writing(path, e))
    }

    /// Puts the finished file in its place.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; the old file, if there was one, is then untouched.
    pub fn commit(self) -> Result<()> {
        let Self { path, file } = self;
        let file = file.into_inner().map_err(std::io::IntoInnerError::into_error);
        let commit = |called: Called| called.place.commit(called.calls);
        file.and_then(commit).map_err(|e| Error::writing(&path, e))
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

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use super::*;
    use std::{
        fs::{self, File, OpenOptions},
        io::Seek,
        os::unix::fs::{FileTypeExt, PermissionsExt, symlink},
    };

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn a_link_stays_and_its_target_is_replaced_with_its_own_mode() {
        let folder = tempfile::tempdir().unwrap();
        let [target, link, chain] = ["target", "link", "chain"].map(|n| folder.path().join(n));
        fs::write(&target, "old").unwrap();
        fs::set_permissions(&target, fs::Permissions::from_mode(0o640)).unwrap();
        symlink("target", &link).unwrap();
        symlink(&link, &chain).unwrap();
        write(&chain, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert!(fs::symlink_metadata(&chain).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&target).unwrap(), "new");
        assert_eq!(mode(&target), 0o640);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    }

    #[test]
    fn a_link_to_nothing_makes_its_target_as_any_new_file() {
        let folder = tempfile::tempdir().unwrap();
        let [target, link, plain] = ["target", "link", "plain"].map(|n| folder.path().join(n));
        symlink("target", &link).unwrap();
        write(&link, b"new").unwrap();
        fs::write(&plain, "").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&target).unwrap(), "new");
        assert_eq!(mode(&target), mode(&plain));
    }

    #[test]
    fn links_in_a_circle_are_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let [one, other] = ["one", "other"].map(|name| folder.path().join(name));
        symlink("other", &one).unwrap();
        symlink("one", &other).unwrap();
        assert!(write(&one, b"new").is_err());
        assert!(Output::check(&one).is_err());
        assert!(fs::symlink_metadata(&one).unwrap().is_symlink());
    }

    #[test]
    fn a_pipe_is_written_through_and_stays_a_pipe() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        // Nobody reads yet: a check does not wait.
        Output::check(&pipe).unwrap();
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || {
                let mut text = String::new();
                File::open(pipe).unwrap().read_to_string(&mut text).unwrap();
                text
            }
        });
        write(&pipe, b"through").unwrap();
        assert_eq!(reader.join().unwrap(), "through");
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn an_opened_file_keeps_who_has_it_open() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let mut opened =
            OpenOptions::new().create_new(true).read(true).write(true).open(&path).unwrap();
        let number = std::os::fd::AsRawFd::as_raw_fd(&opened);
        let of_process = PathBuf::from(format!("/proc/self/fd/{number}"));
        if !of_process.exists() {
            return;
        }
        let link = folder.path().join("link");
        symlink(&of_process, &link).unwrap();
        for name in [&of_process, &link] {
            write(name, b"into it").unwrap();
            let mut text = String::new();
            opened.rewind().unwrap();
            opened.read_to_string(&mut text).unwrap();
            assert_eq!(text, "into it");
        }
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }
}
