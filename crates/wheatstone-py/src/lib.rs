//! The extension module of the Python package `wheatstone`.
//!
//! It hands arrays to the library and back; what users see is written in Python, in `python/wheatstone/`, which
//! turns JSON of this module into objects with names and types.

#![allow(clippy::too_many_arguments, reason = "arguments of Python's functions have names")]

mod cameras;
mod dataset;
mod errors;
mod fit;
mod locate;
mod matching;
mod model;
mod pictures;
mod pool;
mod reconstruction;
mod sigmas;
mod synthetic;
mod tables;
mod work;

use pyo3::prelude::*;
use wheatstone::{AnyMethod, FORMATS, Format, synthetic::Rig};

/// Names of the formats of calibrations that can be written, or read.
fn formats(which: fn(&Format) -> bool) -> Vec<&'static str> {
    FORMATS
        .iter()
        .filter(|format| format.is_calibration() && which(format))
        .map(|format| format.name)
        .collect()
}

/// Takes inputs up to so many times larger than what is usual, in this process from now on.
#[pyfunction]
fn raise_limits(times: u64) {
    wheatstone::limits::raise(times);
}

#[pymodule(gil_used = false)]
fn _wheatstone(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<dataset::PyDataset>()?;
    module.add_class::<model::PyModel>()?;
    module.add_class::<fit::PyExamination>()?;
    module.add_class::<pyo3_arrow::PyRecordBatchReader>()?;
    module.add_class::<pyo3_arrow::PySchema>()?;
    module.add_function(wrap_pyfunction!(fit::fit, module)?)?;
    module.add_function(wrap_pyfunction!(fit::compare_methods, module)?)?;
    module.add_function(wrap_pyfunction!(fit::check, module)?)?;
    module.add_function(wrap_pyfunction!(fit::require_method, module)?)?;
    module.add_function(wrap_pyfunction!(cameras::from_matrices, module)?)?;
    module.add_function(wrap_pyfunction!(cameras::read_cameras, module)?)?;
    module.add_function(wrap_pyfunction!(matching::match_pair, module)?)?;
    module.add_class::<reconstruction::PyReconstructor>()?;
    module.add_function(wrap_pyfunction!(reconstruction::save_cloud, module)?)?;
    module.add_function(wrap_pyfunction!(pictures::detect, module)?)?;
    module.add_function(wrap_pyfunction!(pictures::detect_all, module)?)?;
    module.add_function(wrap_pyfunction!(pictures::chart_settings, module)?)?;
    module.add_function(wrap_pyfunction!(pictures::chart_points, module)?)?;
    module.add_function(wrap_pyfunction!(synthetic::synth, module)?)?;
    module.add_function(wrap_pyfunction!(synthetic::synth_capture, module)?)?;
    module.add_function(wrap_pyfunction!(pool::set_threads, module)?)?;
    module.add_function(wrap_pyfunction!(pool::get_threads, module)?)?;
    module.add_function(wrap_pyfunction!(raise_limits, module)?)?;
    pool::heed_forks(module)?;
    module.add("METHODS", AnyMethod::NAMES.to_vec())?;
    module.add("RIGS", Rig::NAMES.to_vec())?;
    module.add("FORMATS_READ", formats(Format::reads))?;
    module.add("FORMATS_WRITTEN", formats(Format::writes))?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
