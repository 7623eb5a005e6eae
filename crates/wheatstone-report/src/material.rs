//! What a report is made of.

use wheatstone_charts::{capture::Capture, detection::Found};
use wheatstone_core::{Calibration, camera::PosedCamera, error::Hint, evaluate::Comparison};

/// The pictures that a model was fitted to, with what was found in them.
#[derive(Clone, Copy)]
pub struct PictureSource<'a> {
    /// The capture.
    pub capture: &'a Capture,
    /// What was found.
    pub found: &'a Found,
}

/// How a caller words what is to be done: one sentence without a full stop.
#[derive(Clone, Copy, Debug)]
pub struct Wording(pub fn(Hint) -> String);

impl Default for Wording {
    fn default() -> Self {
        Self(|hint| hint.to_string())
    }
}

impl Wording {
    /// A whole sentence.
    pub(super) fn sentence(self, hint: Hint) -> String {
        format!("{}.", self.0(hint))
    }
}

/// What a report is made of.
pub struct Material<'a> {
    /// What is reported on, such as the name of the model file.
    pub title: String,
    /// The command that writes the report again.
    pub command: Option<String>,
    /// The model.
    pub model: &'a Calibration,
    /// Methods side by side, where they were compared.
    pub comparison: Option<&'a Comparison>,
    /// The true cameras, where they are known.
    pub truth: Option<&'a [PosedCamera]>,
    /// How advice is worded, for the caller to name its own means; [`Wording::default`] names none.
    pub wording: Wording,
    /// The pictures, where there are any.
    pub seen: Option<PictureSource<'a>>,
    /// Whether the method is fitted once more without each view, so that errors are those on points
    /// that it has not seen.
    pub held_out: bool,
}
