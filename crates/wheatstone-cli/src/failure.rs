//! How a command fails: one message, what to do about it, and the exit status.

use crate::verbosity::labelled;
use std::process::ExitCode;
use wheatstone::error::{Hint, Remedy};

/// Why a command did not finish.
pub(crate) enum Failure {
    /// The library says.
    Library(wheatstone::Error),
    /// The options do not go together.
    Usage {
        /// What does not.
        problem: String,
        /// What to write instead.
        hint: String,
    },
    /// Standard output could not be written.
    Output(std::io::Error),
}

pub(crate) type Outcome<T = ()> = Result<T, Failure>;

impl Failure {
    pub(crate) fn usage(problem: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Usage { problem: problem.into(), hint: hint.into() }
    }

    /// Prints the message and gives the exit status.
    pub(crate) fn report(self) -> ExitCode {
        let (problem, hint, status) = match &self {
            // Whoever reads has seen enough (`… | head`): that is no failure.
            Self::Output(e) if e.kind() == std::io::ErrorKind::BrokenPipe => {
                return ExitCode::SUCCESS;
            }
            Self::Output(e) => (format!("cannot write to standard output: {e}"), None, 1),
            Self::Library(e @ wheatstone::Error::Cancelled) => {
                (e.to_string(), None, crate::interruption::status())
            }
            Self::Library(e) => (e.to_string(), e.hint().map(worded), 1),
            Self::Usage { problem, hint } => (problem.clone(), Some(hint.clone()), 2),
        };
        labelled("error", &problem);
        if let Some(hint) = hint {
            labelled("hint", &hint);
        }
        ExitCode::from(status)
    }
}

/// A hint of the library, and what it is called here that serves.
pub(crate) fn worded(hint: Hint) -> String {
    let ours = match hint.remedy() {
        Some(Remedy::ImageSize) => ": `--size 1280x1024`",
        Some(Remedy::SourceFormat) => ": `--from NAME`; `wheatstone list formats` has the names",
        Some(Remedy::Formats) => "; `wheatstone list formats` shows what each format holds",
        Some(Remedy::Methods) => " (`wheatstone list methods`)",
        Some(Remedy::Charts) => "; `wheatstone list charts` prints the charts",
        Some(Remedy::Board) => ": `--board 10x77` for ten corners 77 mm apart",
        Some(Remedy::TwoCameras) => ": `--cameras 1,3`",
        Some(Remedy::Method) => ": `wheatstone fit … --method brown`",
        Some(Remedy::Fit) => ": `wheatstone fit … -o model.json`",
        Some(Remedy::Evaluate) => " (`wheatstone evaluate model.json exam.csv`)",
        Some(Remedy::Compare) => " (`wheatstone compare`)",
        Some(Remedy::ChartPlaces) => " (`--stage-sigma`)",
        Some(Remedy::Locate) => ": `wheatstone locate model.json pixels.csv -o points.csv`",
        Some(Remedy::ShowDetections) => "; `wheatstone detect --draw DIR` shows what was found",
        Some(Remedy::Synthesise) => ": `wheatstone synth`",
        Some(Remedy::RepairOrInsist) => "; `--fix` corrects it, `--force` continues anyway",
        Some(Remedy::Insist) => "; `--force` continues anyway",
        Some(Remedy::DropDuplicates) => " (`--drop-duplicates`)",
        Some(Remedy::Columns) => ": `--columns x1=u_left,y1=v_left,…`",
        Some(Remedy::BoardColumns) => ": `--columns board_x=X,board_y=Y`",
        Some(Remedy::Unit) => " (`--unit`)",
        Some(Remedy::Limits) => " `--limits 10` takes ten times as much",
        Some(Remedy::NewCapture) => "; `wheatstone new` makes one",
        Some(Remedy::Follow) => "; `--follow` reads them where they are",
        _ => "",
    };
    format!("{hint}{ours}")
}

impl From<wheatstone::Error> for Failure {
    fn from(error: wheatstone::Error) -> Self {
        Self::Library(error)
    }
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Self::Output(error)
    }
}
