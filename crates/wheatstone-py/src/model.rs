//! A fitted model: its file, its evidence, and the locators made of it.

use crate::{
    dataset::PyDataset,
    errors::{invalid, raised, worded},
    pool::{pool, unforked},
    work,
};
use pyo3::{prelude::*, types::PyBytes};
use serde_json::json;
use std::{
    path::PathBuf,
    sync::{Arc, OnceLock},
};
use wheatstone::{Calibration, Material, Report, SettledLocator, Wording, calibration::Judgement};

self_cell::self_cell! {
    /// A locator beside the model that it borrows.
    pub(crate) struct Ready {
        owner: Arc<Calibration>,
        #[covariant]
        dependent: SettledLocator,
    }
}

impl Ready {
    fn of(model: Arc<Calibration>, with_covariance: bool) -> Arc<Self> {
        Arc::new(Self::new(model, |model| model.settled_locator(with_covariance)))
    }

    pub(crate) fn locator(&self) -> &SettledLocator<'_> {
        self.borrow_dependent()
    }
}

/// A fitted model.
#[pyclass(frozen, name = "Model", module = "wheatstone._wheatstone", weakref)]
pub(crate) struct PyModel {
    pub(crate) model: Arc<Calibration>,
    points: OnceLock<Arc<Ready>>,
    full: OnceLock<Arc<Ready>>,
}

impl PyModel {
    pub(crate) fn new(model: Calibration) -> Self {
        Self { model: Arc::new(model), points: OnceLock::new(), full: OnceLock::new() }
    }

    /// The locator for points alone, or with covariances. To be called by a thread that is not the pool's, without the
    /// interpreter: a thread of the pool that makes it would take up work of others meanwhile, which waits for it.
    pub(crate) fn ready(&self, with_covariance: bool) -> PyResult<Arc<Ready>> {
        let cell = if with_covariance { &self.full } else { &self.points };
        if let Some(ready) = cell.get() {
            return Ok(ready.clone());
        }
        let pool = pool()?;
        let _unforked = unforked();
        let made = || pool.install(|| Ready::of(self.model.clone(), with_covariance));
        Ok(cell.get_or_init(made).clone())
    }

    pub(crate) fn cameras(&self) -> usize {
        self.model.reconstructor.cameras()
    }

    /// Refuses pixels of another number of cameras, and models that triangulate nothing.
    pub(crate) fn needs(&self, columns: usize) -> PyResult<()> {
        let cameras = self.cameras();
        if cameras < 2 {
            return Err(raised(wheatstone::Error::Degenerate {
                problem: "this model has one camera, and a single camera cannot triangulate".into(),
                hint: "calibrate it together with a second camera, from views that both see".into(),
            }));
        }
        if columns == 2 * cameras {
            return Ok(());
        }
        Err(invalid(
            format!("pixels have {columns} columns, and the model has {cameras} cameras"),
            &format!(
                "give an array of shape (n, {}): x and y of each camera, in the order of the fit",
                2 * cameras
            ),
        ))
    }
}

#[pymethods]
impl PyModel {
    #[staticmethod]
    fn load(py: Python, path: PathBuf) -> PyResult<Self> {
        py.detach(|| Calibration::load(&path)).map(Self::new).map_err(raised)
    }

    #[staticmethod]
    fn from_bytes(py: Python, data: &[u8]) -> PyResult<Self> {
        py.detach(|| Calibration::from_bytes(data)).map(Self::new).map_err(raised)
    }

    fn save(&self, py: Python, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.model.save(&path)).map_err(raised)
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| self.model.to_bytes()).map_err(raised)?;
        Ok(PyBytes::new(py, &bytes))
    }

    #[getter(cameras)]
    fn camera_count(&self) -> usize {
        self.cameras()
    }

    #[getter]
    fn unit(&self) -> &str {
        &self.model.unit
    }

    #[getter]
    fn method(&self) -> &str {
        self.model.choice.as_ref().map_or(self.model.method.name(), |choice| &choice.chosen)
    }

    /// Why the model is unusable, if it is.
    #[getter]
    fn broken(&self) -> Option<String> {
        self.model.broken()
    }

    /// Evidence as JSON: training, validation, choice, findings, intrinsics, where it comes from.
    fn evidence(&self) -> String {
        let model = &*self.model;
        json!({
            "seed": model.seed,
            "training": model.training,
            "validation": model.validation,
            "choice": model.choice,
            "findings": model.findings,
            "outliers": model.outliers,
            "ellipsoids": model.ellipsoids,
            "stage": model.stage,
            "placed": model.placed,
            "viewpoint": model.viewpoint,
            "sizes": (0..self.cameras()).map(|camera| model.picture_size(camera)).collect::<Vec<_>>(),
            "source": model.source,
            "imported": model.imported,
            "intrinsics": model.reconstructor.intrinsics(),
            "relative_poses": model.reconstructor.relative_poses(),
        })
        .to_string()
    }

    /// The points that it was fitted to.
    fn data(&self) -> PyDataset {
        PyDataset(self.model.data.restored())
    }

    /// The same model with error bars that leave out what all points share of the stage's errors.
    fn relative(&self) -> Self {
        let mut model = (*self.model).clone();
        model.stage_covariance = model.stage_covariance.map(|stage| stage.relative());
        Self::new(model)
    }

    /// The error on points with known places, as JSON with its `kind`.
    #[pyo3(signature = (data, align, progress = None))]
    fn evaluate(
        &self,
        py: Python,
        data: &PyDataset,
        align: bool,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<String> {
        work::run(py, progress, |progress| {
            let found = self.model.judge(data.0.clone(), align, progress)?;
            let mut value = json!(found);
            if let Judgement::Points(_) = found {
                let own = data.0.clone().in_unit(&self.model.unit)?;
                value["fitted_share"] = json!(self.model.data.share_of(&own));
            }
            Ok(value.to_string())
        })
    }

    /// Whether the cameras moved since the fit, as JSON.
    #[pyo3(signature = (data, progress = None))]
    fn camera_motion(
        &self,
        py: Python,
        data: &PyDataset,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<String> {
        work::run(py, progress, |progress| {
            let found =
                self.model.camera_motion(&data.0.clone().in_unit(&self.model.unit)?, progress)?;
            let mut value = json!(found);
            value["explained"] = found.is_explained().into();
            Ok(value.to_string())
        })
    }

    /// The report: its page, its figures as JSON, its verdict.
    #[pyo3(signature = (title, held_out, progress = None))]
    fn report(
        &self,
        py: Python,
        title: String,
        held_out: bool,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(String, String, String)> {
        work::run(py, progress, |progress| {
            let material = Material {
                title,
                command: None,
                model: &self.model,
                comparison: None,
                truth: None,
                wording: Wording(worded),
                seen: None,
                held_out,
            };
            let report = Report::of(&material, progress)?;
            let summary = json!(report).to_string();
            Ok((report.html(), summary, report.verdict.sentence.clone()))
        })
    }
}
