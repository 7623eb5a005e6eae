//! How charts are placed.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// Which frame is the world's where no chart's place is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Gauge {
    /// The chart of the first view: its points have Z = 0.
    #[default]
    FirstView,
    /// The first camera: x right, y down, z forward.
    FirstCamera,
}

impl Gauge {
    /// The names, as files and the command line have them.
    pub const NAMES: [&'static str; 2] = ["first-view", "first-camera"];

    /// By its name.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`].
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "first-view" => Ok(Self::FirstView),
            "first-camera" => Ok(Self::FirstCamera),
            _ => Err(Error::UnknownName {
                kind: "gauge",
                name: name.into(),
                known: Self::NAMES.map(String::from).into(),
            }),
        }
    }
}

/// Which lenses are tried.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Lenses {
    /// Both, and the one that explains the pixels better is taken.
    #[default]
    Either,
    /// Brown's.
    Brown,
    /// Kannala's and Brandt's.
    KannalaBrandt,
}

/// How charts are placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BundleSettings {
    /// The frame of the world where no place is known.
    pub gauge: Gauge,
    /// The lenses.
    pub lenses: Lenses,
    /// Whether every lens has all its terms, where fewer would predict as well.
    pub all_terms: bool,
    /// Whether points count that stand out as gross errors.
    pub keep_gross: bool,
    /// Whether charts are adjusted together with the model-free camera even where a lens predicts as well as it
    /// does: for who fits that camera, whose error bars then hold what both do not know.
    pub always_model_free: bool,
}
