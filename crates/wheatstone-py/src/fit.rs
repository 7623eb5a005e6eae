//! Fits, comparisons of methods, and checks of data.

use crate::{
    dataset::PyDataset,
    errors::{invalid, raised},
    model::PyModel,
    work,
};
use pyo3::prelude::*;
use serde::Deserialize;
use serde_json::json;
use std::sync::Arc;
use wheatstone::{
    AnyMethod, Calibration, Preparation, StagePrior,
    calibration::{KnownLenses, Source},
    evaluate::compare,
    fit::bundle::{BundleSettings, Gauge},
    preparation::{
        self,
        checks::{self, Examination},
    },
};

/// What a fit is told, as the Python layer writes it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Settings {
    method: String,
    preset: Option<String>,
    epochs: Option<u64>,
    seed: u64,
    validate: bool,
    fix: bool,
    force: bool,
    keep_outliers: bool,
    stage_sigma: Option<f64>,
    expect_baseline: Option<[f64; 2]>,
    gauge: String,
    sizes: Vec<Option<[u32; 2]>>,
    source: Option<Source>,
}

impl Settings {
    fn of(text: &str) -> PyResult<Self> {
        serde_json::from_str(text)
            .map_err(|e| invalid(format!("cannot read the settings of the fit: {e}"), ""))
    }

    fn method(&self, lenses: &[Arc<Calibration>]) -> wheatstone::Result<AnyMethod> {
        if !lenses.is_empty() {
            let mut known = KnownLenses::default();
            lenses.iter().try_for_each(|model| known.add(model))?;
            return known.method();
        }
        let mut method = AnyMethod::named(&self.method)?;
        if let Some(preset) = &self.preset {
            method = method.preset(preset)?;
        }
        match self.epochs {
            Some(epochs) => method.with_epochs(epochs),
            None => Ok(method),
        }
    }

    fn preparation(&self, method: Option<&AnyMethod>) -> wheatstone::Result<Preparation> {
        let bundle_settings = BundleSettings {
            gauge: Gauge::named(&self.gauge)?,
            keep_gross: self.keep_outliers,
            ..BundleSettings::default()
        };
        Ok(Preparation {
            repair: self.fix,
            insist: self.force,
            baseline: self.expect_baseline.map(|[length, tolerance]| (length, tolerance)),
            keep_outliers: self.keep_outliers,
            stage: self.stage_sigma.map(StagePrior::of),
            bundle_settings,
            ..Preparation::default()
        }
        .for_method(method))
    }
}

/// Fits a model to data.
#[pyfunction]
#[pyo3(signature = (data, settings, intrinsics, progress = None))]
pub(crate) fn fit(
    py: Python,
    data: &PyDataset,
    settings: &str,
    intrinsics: Vec<PyRef<PyModel>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<PyModel> {
    let settings = Settings::of(settings)?;
    let lenses: Vec<_> = intrinsics.iter().map(|model| model.model.clone()).collect();
    work::run(py, progress, |progress| {
        let method = settings.method(&lenses)?;
        method.takes(data.0.cameras)?;
        let preparation = settings.preparation(Some(&method))?;
        let prepared = preparation.run(data.0.clone(), settings.seed, progress)?;
        let mut model =
            Calibration::fit(&method, &prepared, settings.seed, settings.validate, progress)?;
        model.sizes = settings.sizes.clone();
        model.source = settings.source.clone();
        Ok(model)
    })
    .map(PyModel::new)
}

/// Compares methods by leave-one-view-out cross-validation; JSON.
#[pyfunction]
#[pyo3(signature = (data, methods, settings, progress = None))]
pub(crate) fn compare_methods(
    py: Python,
    data: &PyDataset,
    methods: Vec<String>,
    settings: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let settings = Settings::of(settings)?;
    work::run(py, progress, |progress| {
        let methods = methods.iter().map(|name| AnyMethod::named(name));
        let methods = methods.collect::<wheatstone::Result<Vec<_>>>()?;
        let preparation = settings.preparation(None)?;
        let prepared = preparation.run(data.0.clone(), settings.seed, progress)?;
        let found = compare(&methods, &prepared.data, None, settings.seed, progress)?;
        Ok(json!(found).to_string())
    })
}

/// What an examination of data found.
#[pyclass(frozen, name = "Examination", module = "wheatstone._wheatstone")]
pub(crate) struct PyExamination {
    examination: Examination,
    data: wheatstone::Dataset,
}

/// Looks for faults of the data.
#[pyfunction]
#[pyo3(signature = (data, expect_baseline, progress = None))]
pub(crate) fn check(
    py: Python,
    data: &PyDataset,
    expect_baseline: Option<[f64; 2]>,
    progress: Option<Py<PyAny>>,
) -> PyResult<PyExamination> {
    work::run(py, progress, |progress| {
        let mut examination = preparation::examine(&data.0, BundleSettings::default(), progress)?;
        if let Some([length, tolerance]) = expect_baseline {
            let differs = checks::compare_baseline(&examination, length, tolerance);
            examination.findings.splice(0..0, differs);
        }
        Ok(PyExamination { examination, data: data.0.clone() })
    })
}

#[pymethods]
impl PyExamination {
    /// All that it says, as JSON; cameras counted from 0.
    fn told(&self) -> String {
        self.examination.to_json(0).to_string()
    }

    /// The data with the faults corrected that can be.
    fn repaired(&self, py: Python) -> PyResult<PyDataset> {
        let settings = BundleSettings::default();
        work::run(py, None, |progress| {
            // The findings may be those of a sample of the views.
            let all = preparation::examine_every_view(&self.data, settings, progress)?;
            preparation::repair(&self.data, &all, settings, progress).map(PyDataset)
        })
    }
}

/// Checks the name of a method, for errors before any work.
#[pyfunction]
pub(crate) fn require_method(name: &str) -> PyResult<()> {
    AnyMethod::named(name).map(|_| ()).map_err(raised)
}
