//! Where a model comes from.

use serde::{Deserialize, Serialize};

/// What a model was fitted to, in words.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// The name of the table, or of the capture's folder.
    pub name: String,
    /// The world frame: what its axes and its origin are.
    pub frame: String,
}

/// The origin of a calibration that another program made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Imported {
    /// The format that it was read from.
    pub format: String,
    /// The names of its files, without their folders.
    pub files: Vec<String>,
    /// The cameras' names.
    pub cameras: Vec<String>,
    /// Width and height of the cameras' pictures in pixels, where known.
    pub sizes: Vec<Option<[u32; 2]>>,
    /// The standard deviation that one pixel coordinate is believed to have. The files do not say it.
    pub pixel_sigma: f64,
}
