//! What lies beside synthetic data: the cameras that made them.

use super::{Noise, Rig};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use wheatstone_core::{
    Error, Result,
    error::{Hint, Remedy},
    limits, storage,
};

/// How synthetic data came about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// The unit of world lengths.
    pub unit: String,
    /// The cameras.
    pub rig: Rig,
    /// The error put on pixels; none for pictures, whose error is the detector's.
    pub noise: Noise,
    /// The seed of every random choice.
    pub seed: u64,
}

impl Truth {
    /// Where the truth of a points file or a capture's folder lies.
    #[must_use]
    pub fn path_beside(data: &Path) -> PathBuf {
        if data.is_dir() { data.join("truth.json") } else { data.with_extension("truth.json") }
    }

    /// Writes the file.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn save(&self, path: &Path) -> Result<()> {
        let mut bytes =
            serde_json::to_vec_pretty(self).map_err(|e| Error::writing(path, e.into()))?;
        bytes.push(b'\n');
        storage::write(path, &bytes)
    }

    /// Reads a file that [`Truth::save`] wrote.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], [`Error::Malformed`].
    pub fn load(path: &Path) -> Result<Self> {
        let text = storage::read_text(path, limits::SETTINGS_BYTES)?;
        serde_json::from_str(&text).map_err(|e| Error::Malformed {
            path: path.into(),
            line: Some(e.line() as u64),
            problem: format!("not a truth file: {e}"),
            hint: Hint::new(
                "rename the file if it is yours: one of this name is written beside synthetic data",
                Remedy::Synthesise,
            ),
        })
    }
}
