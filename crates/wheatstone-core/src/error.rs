//! The one error type of the library: facts that name the file, the line and the way out.

mod hint;

pub use hint::{Hint, Remedy};

use crate::{
    limits::{Exceeded, Limit},
    unit,
};
use std::path::{Path, PathBuf};

/// Shorthand for results of this library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What went wrong, grouped by what the reader can do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("cannot {action} `{}`: {source}", path.display())]
    Io {
        /// What was tried: `read`, `write`, `create`.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// Why the operating system refused.
        source: std::io::Error,
    },
    /// A file is not what its reader needs: wrong form, wrong value, wrong kind.
    #[error("{}{}: {problem}", path.display(), line.map(|l| format!(":{l}")).unwrap_or_default())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1, where one is to blame.
        line: Option<u64>,
        /// What is wrong, with the text that was seen.
        problem: String,
        /// What to do about it.
        hint: Hint,
    },
    /// A picture could not be used.
    #[error("{}: {problem}", path.display())]
    Image {
        /// The picture.
        path: PathBuf,
        /// What is wrong.
        problem: String,
        /// What to do about it.
        hint: Hint,
    },
    /// Too few points to determine the unknowns of a method.
    #[error("{method} needs at least {need} {what}, got {got}")]
    TooFew {
        /// The method that refused.
        method: String,
        /// What is counted, such as `points seen by camera 1`.
        what: String,
        /// The least it can do with.
        need: usize,
        /// What it was given.
        got: usize,
    },
    /// The data cannot determine what is asked, however many points there are.
    #[error("{problem}")]
    Degenerate {
        /// What is degenerate.
        problem: String,
        /// What to add or change.
        hint: Hint,
    },
    /// The data have a fault that makes a fit worthless.
    #[error("{problem} ({code})")]
    Faulty {
        /// The fault's name, in kebab case.
        code: String,
        /// What is wrong, and where.
        problem: String,
        /// What to do about it.
        hint: Hint,
    },
    /// A model and the data given to it do not belong together.
    #[error("{what}: the model has {model}, the data has {data}")]
    Mismatch {
        /// What differs, such as `number of cameras`.
        what: &'static str,
        /// The model's value.
        model: String,
        /// The data's value.
        data: String,
    },
    /// A name that no implementation has.
    #[error("unknown {kind} `{name}`")]
    UnknownName {
        /// The kind of thing, such as `method`.
        kind: &'static str,
        /// What was asked for.
        name: String,
        /// The names that exist.
        known: Vec<String>,
    },
    /// A setting outside the values it can take.
    #[error("{setting} cannot be {value}")]
    Setting {
        /// The setting.
        setting: String,
        /// The value given.
        value: String,
        /// What it must be.
        need: String,
    },
    /// A file format cannot hold what is to be written, or is to be read from it.
    #[error("`{format}` cannot hold {what}")]
    Unsupported {
        /// The format's name.
        format: String,
        /// What does not go in.
        what: String,
        /// What to do about it.
        hint: Hint,
    },
    /// The caller asked to stop.
    #[error("cancelled; nothing was written")]
    Cancelled,
}

impl From<wheatstone_numeric::Error> for Error {
    fn from(error: wheatstone_numeric::Error) -> Self {
        match error {
            wheatstone_numeric::Error::Degenerate { problem, hint } => {
                Self::Degenerate { problem, hint: hint.into() }
            }
            wheatstone_numeric::Error::Cancelled => Self::Cancelled,
            other => Self::Degenerate { problem: other.to_string(), hint: Hint::default() },
        }
    }
}

impl Limit {
    /// Refuses more.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`], which names the file and says what is too many.
    pub fn allow(self, path: &Path, found: u64) -> Result<()> {
        if found <= self.most() { Ok(()) } else { Err(self.refuse(path)) }
    }

    /// That there are more.
    #[must_use]
    pub fn refuse(self, path: &Path) -> Error {
        Error::Malformed {
            path: path.into(),
            line: None,
            problem: Exceeded(self).to_string(),
            hint: Hint::new("is this the file that you meant?", Remedy::Limits),
        }
    }
}

impl Error {
    /// A file that could not be read.
    pub fn reading(path: impl Into<PathBuf>, source: std::io::Error) -> Self {
        let within = source.get_ref().and_then(|own| own.downcast_ref::<Exceeded>());
        if let Some(Exceeded(limit)) = within {
            return limit.refuse(&path.into());
        }
        Self::Io { action: "read", path: path.into(), source }
    }

    /// A file that could not be written.
    pub fn writing(path: impl Into<PathBuf>, source: std::io::Error) -> Self {
        Self::Io { action: "write", path: path.into(), source }
    }

    /// The same refusal in the name of the format that was to be written.
    #[must_use]
    pub fn of_format(mut self, name: &str) -> Self {
        if let Self::Unsupported { format, .. } = &mut self {
            *format = name.into();
        }
        self
    }

    /// A name that stays, in kebab case: of a fault of the data its own, of other errors their kind.
    #[must_use]
    pub fn code(&self) -> &str {
        match self {
            Self::Io { .. } => "io",
            Self::Malformed { .. } => "malformed",
            Self::Image { .. } => "image",
            Self::TooFew { .. } => "too-few",
            Self::Degenerate { .. } => "degenerate",
            Self::Faulty { code, .. } => code,
            Self::Mismatch { .. } => "mismatch",
            Self::UnknownName { .. } => "unknown-name",
            Self::Setting { .. } => "setting",
            Self::Unsupported { .. } => "unsupported",
            Self::Cancelled => "cancelled",
        }
    }

    /// What the reader can do about it, in one sentence without a full stop.
    #[must_use]
    pub fn hint(&self) -> Option<Hint> {
        match self {
            Self::Malformed { hint, .. }
            | Self::Image { hint, .. }
            | Self::Degenerate { hint, .. }
            | Self::Unsupported { hint, .. }
            | Self::Faulty { hint, .. } => Some(hint.clone()),
            Self::Io { source, path, .. } => Some(io_hint(source.kind(), path)),
            Self::TooFew { what, .. } => Some(Hint::new(
                format!("give more {what}, or choose a simpler method"),
                Remedy::Methods,
            )),
            Self::Mismatch { what: "unit", .. } => Some(Hint::new(
                format!("units that convert are {}", unit::names().collect::<Vec<_>>().join(", ")),
                Remedy::Unit,
            )),
            Self::Mismatch { .. } => {
                Some("use the model that was fitted to these cameras, in the same order".into())
            }
            Self::UnknownName { name, known, .. } => Some(match nearest(name, known) {
                Some(near) => {
                    format!("did you mean `{near}`? There are: {}", known.join(", ")).into()
                }
                None => format!("there are: {}", known.join(", ")).into(),
            }),
            Self::Setting { need, .. } => Some(format!("give {need}").into()),
            Self::Cancelled => None,
        }
        .filter(|hint| !hint.is_empty())
    }
}

fn io_hint(kind: std::io::ErrorKind, path: &Path) -> Hint {
    use std::io::ErrorKind as Kind;
    match kind {
        Kind::NotFound => {
            match path.parent().filter(|p| !p.as_os_str().is_empty() && !p.exists()) {
                Some(parent) => format!("the folder `{}` does not exist", parent.display()).into(),
                None if path.ends_with("capture.toml") => Hint::new(
                    "give the folder of a capture, which has that file",
                    Remedy::NewCapture,
                ),
                None => "check the spelling of the path".into(),
            }
        }
        Kind::PermissionDenied => "check the permissions of the file and its folder".into(),
        Kind::IsADirectory => "name a file, not a folder".into(),
        Kind::StorageFull => "free some disk space; the old file is untouched".into(),
        _ => Hint::default(),
    }
}

/// The known name that is closest to a mistyped one, if any is close.
#[must_use]
pub fn nearest<'a>(name: &str, known: &'a [String]) -> Option<&'a str> {
    known
        .iter()
        .map(|candidate| (strsim::levenshtein(name, candidate), candidate.as_str()))
        .min()
        .filter(|(distance, candidate)| *distance <= candidate.len().max(name.len()) / 3 + 1)
        .map(|(_, candidate)| candidate)
}
