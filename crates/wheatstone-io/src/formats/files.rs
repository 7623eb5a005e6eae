//! Where files come from and go to.

use super::{Format, Layout};
use std::path::{Path, PathBuf};
use wheatstone_core::{
    Error, Result,
    error::{Hint, Remedy},
    limits, storage,
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

impl InputFile {
    /// It as text.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] where it is none.
    pub fn text(&self) -> Result<&str> {
        storage::text(&self.path, &self.bytes)
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

/// What endings of names promise of a file.
const KINDS: &[(&str, &[&str])] = &[
    ("YAML", &["yml", "yaml"]),
    ("JSON", &["json"]),
    ("XML", &["xml"]),
    ("TOML", &["toml"]),
    ("CSV", &["csv"]),
    ("NumPy", &["npy", "npz"]),
    ("Parquet", &["parquet", "pq"]),
    ("Arrow", &["arrow", "feather", "ipc"]),
    ("PLY", &["ply"]),
    ("PCD", &["pcd"]),
    ("MATLAB", &["mat"]),
    ("gzip", &["gz"]),
];

impl Format {
    /// Refuses a name for the one file of this format that promises another kind of file, which whoever opens it would
    /// take it for.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] with the ending that says what is written.
    pub fn check_name(&self, path: &Path) -> Result<()> {
        let Layout::File(own) = self.layout else { return Ok(()) };
        let end =
            path.extension().map(|end| end.to_string_lossy().to_lowercase()).unwrap_or_default();
        let kind =
            |end: &str| KINDS.iter().find(|(_, ends)| ends.contains(&end)).map(|(kind, _)| *kind);
        match (kind(own), kind(&end)) {
            (Some(written), Some(promised)) if written != promised => Err(Error::Malformed {
                path: path.into(),
                line: None,
                problem: format!(
                    "`{}` is written as {written}, and this name promises {promised}",
                    self.name
                ),
                hint: format!("end the name in .{own}").into(),
            }),
            _ => Ok(()),
        }
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
    if let Some(last) = found.last() {
        limits::FILES.allow(last, found.len() as u64)?;
    }
    let read =
        |path: PathBuf| Ok(InputFile { bytes: storage::read(&path, limits::FILE_BYTES)?, path });
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

/// Writes files: one to `path` itself, several into the folder `path`, which gets its name when it has them all.
///
/// # Errors
///
/// [`Error::Io`].
pub fn save(files: &[OutputFile], path: &Path) -> Result<Vec<PathBuf>> {
    if let [file] = files
        && file.name.is_empty()
    {
        storage::write(path, &file.bytes)?;
        return Ok(vec![path.to_path_buf()]);
    }
    storage::write_folder(path, |folder| {
        files.iter().try_for_each(|file| storage::write(&folder.join(&file.name), &file.bytes))
    })?;
    Ok(files.iter().map(|file| path.join(&file.name)).collect())
}
