//! Synthetic cameras, and what they see.

use crate::{
    dataset::PyDataset,
    errors::{invalid, raised},
    work,
};
use pyo3::prelude::*;
use serde::Deserialize;
use std::path::PathBuf;
use wheatstone::{
    AnyChart, LineGrid,
    synthetic::{
        HandHeld, Noise, Rig, Sensor, Stage, chart_correspondences, hand_held_correspondences,
        random_correspondences, write_capture,
    },
};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    rig: String,
    cameras: usize,
    noise: String,
    count: Option<usize>,
    random: Option<usize>,
    hand_held: Option<usize>,
    near: f64,
    far: f64,
    step: f64,
    seed: u64,
    /// As in `capture.toml`; a line grid that fills the pictures where none is given.
    chart: Option<AnyChart>,
}

impl Settings {
    fn of(text: &str) -> PyResult<Self> {
        serde_json::from_str(text)
            .map_err(|e| invalid(format!("cannot read the settings: {e}"), ""))
    }

    /// The cameras, and a chart that fills their pictures.
    fn scene(&self) -> wheatstone::Result<(Rig, AnyChart)> {
        let rig = Rig::named(&self.rig, self.cameras)?;
        if let Some(chart) = &self.chart {
            chart.validate()?;
            return Ok((rig, chart.clone()));
        }
        let share = if self.hand_held.is_some() { HandHeld::SIZE } else { 1.0 };
        let pitch = share * rig.chart_pitch();
        Ok((rig, LineGrid { pitch, ..LineGrid::default() }.into()))
    }

    fn placements(&self, chart: &AnyChart) -> wheatstone::Result<Vec<(String, wheatstone::Pose)>> {
        let Some(views) = self.hand_held else {
            return Stage { near: self.near, far: self.far, step: self.step }.views();
        };
        HandHeld::between([self.near, self.far], views).placements(chart, self.seed)
    }
}

/// Correspondences of synthetic cameras, in centimetres.
#[pyfunction]
pub(crate) fn synth(py: Python, settings: &str) -> PyResult<PyDataset> {
    let settings = Settings::of(settings)?;
    py.detach(|| {
        let (rig, chart) = settings.scene()?;
        let noise: Noise = settings.noise.parse()?;
        let noise = (noise, settings.seed);
        if let Some(count) = settings.random {
            let range = (settings.near, settings.far);
            return Ok(random_correspondences(&rig, &chart, range, noise, count));
        }
        let placements = settings.placements(&chart)?;
        Ok(match settings.hand_held {
            Some(_) => hand_held_correspondences(&rig, &chart, &placements, noise).0,
            None => chart_correspondences(&rig, &chart, &placements, noise, settings.count),
        })
    })
    .map(PyDataset)
    .map_err(raised)
}

/// Writes a rendered capture: pictures, `capture.toml`, and the truth.
#[pyfunction]
#[pyo3(signature = (path, settings, progress = None))]
pub(crate) fn synth_capture(
    py: Python,
    path: PathBuf,
    settings: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<()> {
    let settings = Settings::of(settings)?;
    work::run(py, progress, |progress| {
        let (rig, chart) = settings.scene()?;
        let placements = settings.placements(&chart)?;
        let views = (placements.as_slice(), settings.hand_held.is_none());
        let sensor = (Sensor::default(), settings.seed);
        write_capture(&path, (&rig, &chart), views, sensor, progress)
    })
}
