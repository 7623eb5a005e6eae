//! Where an output goes: into a file, which is replaced as a whole, or through a device or a pipe.

use super::AtomicWriteFile;
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

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use super::{super::write, *};
    use std::{
        io::Read,
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
        assert!(Place::check(&one).is_err());
        assert!(fs::symlink_metadata(&one).unwrap().is_symlink());
    }

    #[test]
    fn a_pipe_is_written_through_and_stays_a_pipe() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        // Nobody reads yet: a check does not wait.
        Place::check(&pipe).unwrap();
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
        write(&of_process, b"into it").unwrap();
        let mut text = String::new();
        opened.read_to_string(&mut text).unwrap();
        assert_eq!(text, "into it");
    }
}
