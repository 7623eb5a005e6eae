//! Where files come from and go to.

use super::{Format, Layout};
use std::{
    io::Write,
    path::{Path, PathBuf},
};
use wheatstone_core::{
    Error, Result,
    error::{Hint, Remedy},
    storage,
};

/// A file that was read whole.
#[derive(Clone, Debug, PartialEq)]
pub struct InputFile {
    /// Where it lay.
    pub path: PathBuf,
    /// What is in it.
    pub bytes: Vec<u8>,
}

/// A file to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputFile {
    /// Its name within the folder; empty for the file that the caller names.
    pub name: String,
    /// What goes into it.
    pub bytes: Vec<u8>,
}

/// A table of a million points takes a hundred megabytes.
const LARGEST_FILE: u64 = 1 << 28;

/// A rig has some cameras and some files each.
const MOST_FILES: usize = 1000;

impl InputFile {
    /// It as text.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] where it is none.
    pub fn text(&self) -> Result<&str> {
        std::str::from_utf8(&self.bytes).map_err(|e| {
            let before = &self.bytes[..e.valid_up_to()];
            let line = before.iter().filter(|b| **b == b'\n').count() as u64 + 1;
            self.error(line, "not text (UTF-8)".into(), "is this the file that you meant?")
        })
    }

    /// What is wrong with it, and on which line, 0 where no line is to blame.
    pub(super) fn error(&self, line: u64, problem: String, hint: impl Into<Hint>) -> Error {
        Error::Malformed {
            path: self.path.clone(),
            line: (line > 0).then_some(line),
            problem,
            hint: hint.into(),
        }
    }

    /// Its name without folder and extension.
    pub(super) fn stem(&self) -> String {
        self.path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
    }

    /// Its name without folder.
    pub(super) fn name(&self) -> String {
        self.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    }
}

impl OutputFile {
    /// The one file of a format that has one.
    pub(super) fn only(text: String) -> Self {
        Self { name: String::new(), bytes: text.into_bytes() }
    }

    /// One of several.
    pub(super) fn named(name: impl Into<String>, text: String) -> Self {
        Self { name: name.into(), bytes: text.into_bytes() }
    }
}

/// Reads the files that were named; of a folder those that belong to the format, in sorted order.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Malformed`] where a file is larger than any of its kind, or a folder holds
/// none of the format's files.
pub fn gather(format: &Format, paths: &[PathBuf]) -> Result<Vec<InputFile>> {
    let mut found = Vec::new();
    for path in paths {
        if !path.is_dir() {
            found.push(path.clone());
            continue;
        }
        let before = found.len();
        let mut names: Vec<PathBuf> = Vec::new();
        for entry in std::fs::read_dir(path).map_err(|e| Error::reading(path, e))? {
            names.push(entry.map_err(|e| Error::reading(path, e))?.path());
        }
        names.retain(|name| name.is_file() && belongs(format.layout, name));
        names.sort();
        found.extend(names);
        if found.len() == before {
            return Err(Error::Malformed {
                path: path.clone(),
                line: None,
                problem: format!("this folder has no file of the format `{}`", format.name),
                hint: Hint::new("name the files, or choose another format", Remedy::SourceFormat),
            });
        }
    }
    found.truncate(MOST_FILES);
    found.into_iter().map(read).collect()
}

fn belongs(layout: Layout, path: &Path) -> bool {
    let name =
        path.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
    match layout {
        Layout::File(extension) | Layout::Cameras(extension) => {
            name.ends_with(&format!(".{extension}"))
        }
        // `rt_is.10001` is one of frame 10001.
        Layout::Folder(ends) => {
            let bare = name.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches('.');
            ends.iter().any(|end| name.ends_with(end) || bare.ends_with(end))
        }
    }
}

fn read(path: PathBuf) -> Result<InputFile> {
    use std::io::Read;
    let mut bytes = Vec::new();
    let opened = storage::open(&path)?;
    opened.take(LARGEST_FILE + 1).read_to_end(&mut bytes).map_err(|e| Error::reading(&path, e))?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(Error::Malformed {
            path,
            line: None,
            problem: format!("larger than {LARGEST_FILE} bytes"),
            hint: "is this the file that you meant?".into(),
        });
    }
    Ok(InputFile { path, bytes })
}

/// Writes files: one to `path` itself, several into the folder `path`. All are
/// written out before the first takes its place.
///
/// # Errors
///
/// [`Error::Io`].
pub fn save(files: &[OutputFile], path: &Path) -> Result<Vec<PathBuf>> {
    let mut written = Vec::new();
    if files.iter().any(|file| !file.name.is_empty()) {
        storage::create_folder(path)?;
    }
    for file in files {
        let place = if file.name.is_empty() { path.to_path_buf() } else { path.join(&file.name) };
        let mut output = storage::Output::create(&place)?;
        let filled = output.write_all(&file.bytes).and_then(|()| output.flush());
        filled.map_err(|e| Error::writing(&place, e))?;
        written.push((output, place));
    }
    written
        .into_iter()
        .map(|(output, place)| {
            output.commit()?;
            Ok(place)
        })
        .collect()
}
