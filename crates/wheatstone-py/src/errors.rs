//! The library's errors as Python's exceptions, with hints in the words of the Python interface.

use pyo3::{prelude::*, types::PyDict};
use std::io::ErrorKind;
use wheatstone::{
    Error,
    error::{Hint, Remedy},
};

/// The exception for an error of the library: `wheatstone.errors` has one class a kind.
pub(crate) fn raised(error: Error) -> PyErr {
    Python::attach(|py| exception(py, &error).unwrap_or_else(|problem| problem))
}

/// An exception for an argument that makes no sense.
pub(crate) fn invalid(problem: impl Into<String>, hint: &str) -> PyErr {
    let problem = problem.into();
    Python::attach(|py| {
        build(py, "ArgumentError", &problem, Some(hint), None).unwrap_or_else(|problem| problem)
    })
}

/// The exception where a picture shows no chart.
pub(crate) fn not_found(why: &str) -> PyErr {
    Python::attach(|py| {
        build(py, "ChartNotFoundError", why, None, None).unwrap_or_else(|problem| problem)
    })
}

fn exception(py: Python, error: &Error) -> PyResult<PyErr> {
    let class = match error {
        Error::Io { source, .. } if source.kind() == ErrorKind::NotFound => "MissingFileError",
        Error::Io { .. } => "FileError",
        Error::Malformed { .. } => "MalformedError",
        Error::Image { .. } => "ImageError",
        Error::TooFew { .. } => "TooFewError",
        Error::Degenerate { .. } => "DegenerateError",
        Error::Faulty { .. } => "FaultyError",
        Error::Mismatch { .. } => "MismatchError",
        Error::UnknownName { .. } => "UnknownNameError",
        Error::Setting { .. } => "SettingError",
        Error::Unsupported { .. } => "UnsupportedError",
        Error::Cancelled => "CancelledError",
        _ => "WheatstoneError",
    };
    let hint = error.hint().map(worded);
    build(py, class, &error.to_string(), hint.as_deref(), Some(error.code()))
}

fn build(
    py: Python,
    class: &str,
    problem: &str,
    hint: Option<&str>,
    code: Option<&str>,
) -> PyResult<PyErr> {
    let class = py.import("wheatstone.errors")?.getattr(class)?;
    let details = PyDict::new(py);
    details.set_item("hint", hint)?;
    details.set_item("code", code)?;
    Ok(PyErr::from_value(class.call((problem,), Some(&details))?))
}

/// A hint of the library, with the name of what serves in Python.
pub(crate) fn worded(hint: Hint) -> String {
    let ours = match hint.remedy() {
        Some(Remedy::ImageSize) => ": `image_size=(1280, 1024)`",
        Some(Remedy::SourceFormat) => ": `format=\"opencv\"`; `wheatstone.FORMATS` has the names",
        Some(Remedy::Formats) => "; `wheatstone.FORMATS` has their names",
        Some(Remedy::Methods) => " (`wheatstone.METHODS`)",
        Some(Remedy::Charts) => "; `wheatstone.Chart` makes charts",
        Some(Remedy::TwoCameras) => ": `cameras=(0, 2)`",
        Some(Remedy::Method) => ": `fit(…, method=\"brown\")`",
        Some(Remedy::Fit) => ": `fit(…).save(\"model.json\")`",
        Some(Remedy::Evaluate) => " (`Calibration.evaluate`)",
        Some(Remedy::Compare) => " (`wheatstone.compare`)",
        Some(Remedy::ChartPlaces) => " (`stage_sigma=…`)",
        Some(Remedy::Locate) => ": `Calibration.locate`",
        Some(Remedy::Synthesise) => ": `wheatstone.synth`",
        Some(Remedy::RepairOrInsist) => "; `fix=True` corrects it, `force=True` continues anyway",
        Some(Remedy::Insist) => "; `force=True` continues anyway",
        Some(Remedy::DropDuplicates) => " (`drop_duplicates=True`)",
        Some(Remedy::Columns) => ": `columns={\"x1\": \"u_left\", …}`",
        Some(Remedy::BoardColumns) => ": `columns={\"board_x\": \"X\", \"board_y\": \"Y\"}`",
        Some(Remedy::Unit) => " (`unit=`)",
        Some(Remedy::Limits) => " `wheatstone.raise_limits(10)` takes ten times as much",
        Some(Remedy::Follow) => "; `wheatstone.read(…, follow=True)` reads them where they are",
        _ => "",
    };
    format!("{hint}{ours}")
}
