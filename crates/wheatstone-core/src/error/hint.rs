//! What to do about an error, and which of the caller's means serves.

use std::fmt;

/// What a program offers against an error, for the program to say what its own means is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Remedy {
    /// To give the size of the pictures.
    ImageSize,
    /// To say which format files are in.
    SourceFormat,
    /// To list the formats and what they hold.
    Formats,
    /// To list the methods.
    Methods,
    /// To list the charts.
    Charts,
    /// To say how many corners a board has, and how far apart.
    Board,
    /// To choose two of the cameras.
    TwoCameras,
    /// To choose the method of a fit.
    Method,
    /// To fit a model.
    Fit,
    /// To judge a model on data.
    Evaluate,
    /// To compare methods on data.
    Compare,
    /// To let a fit solve for where charts stood.
    ChartPlaces,
    /// To locate points with a model.
    Locate,
    /// To show what was found in pictures.
    ShowDetections,
    /// To make synthetic data, with the truth beside them.
    Synthesise,
    /// To put faults of the data right, or to go on in spite of them.
    RepairOrInsist,
    /// To go on in spite of faults of the data.
    Insist,
    /// To keep the first of rows that stand in a table twice.
    DropDuplicates,
    /// To say what the columns of a table hold.
    Columns,
    /// To say that columns hold places on a board.
    BoardColumns,
    /// To say the unit of lengths.
    Unit,
    /// To begin a capture: a folder with its file, to be filled in.
    NewCapture,
    /// To read pictures of a capture wherever they are.
    Follow,
    /// To take larger inputs.
    Limits,
}

/// What to do about an error: one sentence without a full stop, complete without the name of any
/// program's means, and the means that serves, where one does.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hint {
    words: String,
    remedy: Option<Remedy>,
}

impl Hint {
    /// A sentence, and what serves.
    #[must_use]
    pub fn new(words: impl Into<String>, remedy: Remedy) -> Self {
        Self { words: words.into(), remedy: Some(remedy) }
    }

    /// What serves, where a program is likely to offer it.
    #[must_use]
    pub fn remedy(&self) -> Option<Remedy> {
        self.remedy
    }
}

impl From<String> for Hint {
    fn from(words: String) -> Self {
        Self { words, remedy: None }
    }
}

impl From<&str> for Hint {
    fn from(words: &str) -> Self {
        words.to_owned().into()
    }
}

impl std::ops::Deref for Hint {
    type Target = str;

    fn deref(&self) -> &str {
        &self.words
    }
}

impl fmt::Display for Hint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words)
    }
}
