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
use wheatstone::{
    AnyMethod, Calibration, Preparation, StagePrior,
    calibration::Source,
    evaluate::compare,
    fit::bundle::{BundleSettings, Gauge},
    method::{
        AnyReconstructor, KnownLens,
        brown::Brown,
        kannala_brandt::KannalaBrandt,
        network::{Network, Training},
    },
    preparation::{
        self,
        checks::{self, Examination, Finding},
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

    fn method(&self, lenses: &[&Calibration]) -> wheatstone::Result<AnyMethod> {
        if !lenses.is_empty() {
            return with_known_lenses(lenses);
        }
        let mut method = AnyMethod::named(&self.method)?;
        if let Some(preset) = &self.preset {
            method = method.preset(preset)?;
        }
        match (self.epochs, &mut method) {
            (None, _) => Ok(method),
            (
                Some(epochs),
                AnyMethod::Network(Network {
                    training: Training::Backpropagation(training), ..
                }),
            ) => {
                training.epochs = epochs;
                Ok(method)
            }
            (Some(_), other) => Err(wheatstone::Error::Setting {
                setting: "epochs".into(),
                value: format!("set for `{}`", other.name()),
                need: "it to the method `network` with preset `paper` only".into(),
            }),
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

/// The method that keeps the lenses of these models, all of one kind.
fn with_known_lenses(models: &[&Calibration]) -> wheatstone::Result<AnyMethod> {
    let refuse = |problem: String| wheatstone::Error::Unsupported {
        format: "intrinsics".into(),
        what: problem,
        hint: "give models of `brown` lenses only, or of `kannala-brandt` lenses only".into(),
    };
    let (mut brown, mut fisheye) = (Brown::default(), KannalaBrandt::default());
    for model in models {
        let (method, train) = (model.fitted()?.0, model.data.restored());
        let numbers = method.lens_numbers();
        // Another program's calibration does not say how uncertain its lenses are.
        let exact = model.imported.is_some();
        match &model.reconstructor {
            AnyReconstructor::Brown(fitted) if exact => {
                let lenses = fitted.cameras.iter().map(|camera| KnownLens::exact(camera.model));
                brown.lenses.extend(lenses);
            }
            AnyReconstructor::KannalaBrandt(fitted) if exact => {
                let lenses = fitted.cameras.iter().map(|camera| KnownLens::exact(camera.model));
                fisheye.lenses.extend(lenses);
            }
            AnyReconstructor::Brown(fitted) => {
                brown.lenses.extend(fitted.lenses_among(&numbers, &train));
            }
            AnyReconstructor::KannalaBrandt(fitted) => {
                fisheye.lenses.extend(fitted.lenses_among(&numbers, &train));
            }
            _ => {
                let name = method.name();
                return Err(refuse(format!("a `{name}` model, which has no lens of its own")));
            }
        }
    }
    match (brown.lenses.is_empty(), fisheye.lenses.is_empty()) {
        (false, true) => Ok(brown.into()),
        (true, false) => Ok(fisheye.into()),
        _ => Err(refuse("lenses of two kinds".into())),
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
        let method = settings.method(&lenses.iter().map(|model| &**model).collect::<Vec<_>>())?;
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
        let finding = |finding: &Finding| {
            let figures: serde_json::Map<_, _> =
                finding.figures.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
            json!({
                "code": finding.code,
                "severity": finding.severity,
                "views": finding.views,
                "cameras": finding.cameras,
                "explanation": finding.explanation,
                "hint": finding.hint,
                "fixable": finding.is_fixable(),
                "estimate": finding.is_estimate,
                "figures": figures,
            })
        };
        json!({
            "findings": self.examination.findings.iter().map(finding).collect::<Vec<_>>(),
            "cannot_be_seen": self.examination.cannot_be_seen,
            "layout": self.examination.layout,
        })
        .to_string()
    }

    /// The data with the faults corrected that can be.
    fn repaired(&self) -> PyDataset {
        PyDataset(checks::repair_all(&self.data, &self.examination.findings))
    }
}

/// Checks the name of a method, for errors before any work.
#[pyfunction]
pub(crate) fn require_method(name: &str) -> PyResult<()> {
    AnyMethod::named(name).map(|_| ()).map_err(raised)
}
