//! What is being written, beside what it will replace: files named `.0.wheatstone-tmp`, and folders
//! `.0.wheatstone-tmp-folder`.
//!
//! Who writes holds a lock on the file. What nobody holds was left behind by a program that was killed, and is removed by
//! the next one that writes there.

use super::calls::{Calls, again};
use std::{
    collections::BTreeSet,
    ffi::OsString,
    fs::{self, File},
    io::{Error, ErrorKind, Result},
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

/// How the names of files end that are not finished.
const END: &str = ".wheatstone-tmp";

/// What follows on it in the names of folders.
const FOLDER: &str = "-folder";

/// Files of one folder that are written at a time, at most.
const MOST: usize = 10_000;

/// What this program writes at present, and the folders in which it looked for what was left behind.
static OWN: Mutex<Own> = Mutex::new(Own { unfinished: BTreeSet::new(), swept: BTreeSet::new() });

struct Own {
    unfinished: BTreeSet<PathBuf>,
    swept: BTreeSet<PathBuf>,
}

fn own() -> std::sync::MutexGuard<'static, Own> {
    OWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A file that nobody knows by its final name yet. Dropped, it is removed, and so is its folder.
pub(super) struct Unfinished {
    pub(super) file: File,
    path: PathBuf,
    has_name: bool,
}

/// The folder in which a path has its name.
pub(super) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

impl Unfinished {
    /// A new file in a folder.
    pub(super) fn create(folder: &Path, calls: &dyn Calls) -> Result<Self> {
        if own().swept.insert(folder.to_path_buf()) {
            sweep(folder);
        }
        for number in 0..MOST {
            let path = folder.join(format!(".{number}{END}"));
            let file = match again(|| calls.create(&path)) {
                Err(problem) if problem.kind() == ErrorKind::AlreadyExists => continue,
                created => created?,
            };
            // Where there are no locks, nobody sweeps.
            let _ = file.lock();
            // Somebody may have taken it for left behind before it was locked.
            if is_there(&file, &path) {
                own().unfinished.insert(path.clone());
                return Ok(Self { file, path, has_name: false });
            }
        }
        Err(Error::other(format!("{} has too many unfinished files", folder.display())))
    }

    /// Gives the file its name.
    pub(super) fn rename(mut self, to: &Path, calls: &dyn Calls) -> Result<()> {
        // Under the lock, for the old name may at once be another program's.
        let mut own = own();
        let renamed = again(|| calls.rename(&self.path, to));
        if renamed.is_ok() {
            own.unfinished.remove(&self.path);
            self.has_name = true;
        }
        // Dropped before `self`, which may need it.
        drop(own);
        renamed
    }

    /// The folder that belongs to it; it is not made here.
    pub(super) fn folder(&self) -> PathBuf {
        let mut name = OsString::from(&self.path);
        name.push(FOLDER);
        name.into()
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if !self.has_name {
            let mut own = own();
            discard(&self.path);
            own.unfinished.remove(&self.path);
        }
    }
}

/// Whether an opened file still has its name: only who holds the lock takes it away.
fn is_there(file: &File, path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let _ = path;
        file.metadata().is_ok_and(|found| found.nlink() > 0)
    }
    #[cfg(not(unix))]
    {
        let _ = file;
        path.exists()
    }
}

/// Removes a file and its folder.
fn discard(path: &Path) {
    let mut folder = OsString::from(path);
    folder.push(FOLDER);
    let _ = fs::remove_dir_all(folder);
    let _ = fs::remove_file(path);
}

/// Removes what was left behind in a folder.
pub(super) fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let number = name.to_str().and_then(|name| name.strip_prefix('.')?.strip_suffix(END));
        if number.is_none_or(|number| number.parse::<usize>().is_err()) {
            continue;
        }
        let path = entry.path();
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        let Some(file) = is_file.then(|| File::open(&path).ok()).flatten() else { continue };
        if file.try_lock().is_ok() && is_there(&file, &path) {
            discard(&path);
        }
    }
}

/// Removes all that this program has not finished writing, before it ends without more ado.
pub fn discard_unfinished() {
    for path in &own().unfinished {
        discard(path);
    }
}
