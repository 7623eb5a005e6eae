//! A file written beside the one that it replaces, by the standard library alone: for systems for which
//! `atomic-write-file` is not made.

use std::{
    ffi::OsString,
    fs::{self, File},
    io::{Error, ErrorKind, Result, Write},
    path::{Path, PathBuf},
};

/// A file that gets its name when it is finished. Dropped before that, it leaves nothing.
pub(super) struct AtomicWriteFile {
    file: File,
    path: PathBuf,
    /// Where it is until then.
    beside: PathBuf,
}

impl AtomicWriteFile {
    pub(super) fn open(path: &Path) -> Result<Self> {
        let name = path.file_name().ok_or_else(|| Error::from(ErrorKind::InvalidInput))?;
        let mut hidden = OsString::from(".");
        hidden.push(name);
        hidden.push(".tmp");
        let beside = path.with_file_name(hidden);
        Ok(Self { file: File::create(&beside)?, path: path.into(), beside })
    }

    pub(super) fn commit(self) -> Result<()> {
        self.file.sync_all()?;
        fs::rename(&self.beside, &self.path)
    }
}

impl Write for AtomicWriteFile {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.file.flush()
    }
}

impl Drop for AtomicWriteFile {
    fn drop(&mut self) {
        // After a rename there is nothing to remove.
        let _ = fs::remove_file(&self.beside);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_there_when_it_is_finished_and_not_before() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let write = |text: &str| {
            let mut file = AtomicWriteFile::open(&path).unwrap();
            file.write_all(text.as_bytes()).unwrap();
            file
        };
        drop(write("lost"));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        write("first").commit().unwrap();
        drop(write("lost"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "first");
        write("second").commit().unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "second");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(AtomicWriteFile::open(Path::new("..")).is_err());
    }
}
