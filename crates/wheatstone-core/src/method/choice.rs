//! A method that was chosen among several.

use serde::{Deserialize, Serialize};

/// Which method was chosen among several, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Choice {
    /// The method's name.
    pub chosen: String,
    /// Why, in one sentence.
    pub reason: String,
    /// Root mean square error of each method tried, over all points of views left out, in world units.
    pub held_out_rms: Vec<(String, f64)>,
}
