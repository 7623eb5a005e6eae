//! What a fit is worth, told to people: one [`Report`] value, with every figure and picture as data,
//! and one HTML file made of it that needs no network and no other file.
//!
//! `summary.json` is the value itself; its fields are documented here and nowhere else. The page's
//! figures are drawn by [`figures`], one file each: to add one, write `figures/<name>.rs`, then add its
//! `mod` line and its row in `figures/mod.rs`.

mod budget;
mod build;
mod cameras;
mod cloud;
pub mod figures;
pub mod html;
mod grid;
mod material;
mod page;
mod pictures;
mod plot;
mod points;
mod preparation;
pub mod reproduction;
mod sections;
mod text;
mod verdict;

pub use cloud::{CloudCamera, SceneCloud};
pub use grid::Grid;
pub use material::{Material, PictureSource, Wording};
pub use points::Validation;
pub use sections::{
    Accuracy, BudgetShare, CameraFigures, ClaimFigures, Crops, Curve, CurveFigure, DepthBand,
    ErrorBarPoint, FindingFigures, Level, LocatedFigures, MethodFigures, OutlierFigures,
    PictureFigures, PointFigures, SceneFigures, SetupFigures, StageFigures, Verdict, ViewFigures,
};

use serde::{Deserialize, Serialize};
use std::path::Path;
use wheatstone_core::{Error, Result, preparation::EstimatedPoses, storage};

/// What the first field of every summary says.
pub const FORMAT: &str = "wheatstone-report";

/// The version of the form that is written. A field that is added does not change it.
pub const VERSION: u32 = 1;

/// All that is known of a fit, as data. Lengths are in `unit`, pixel (0, 0) is the centre of the
/// top-left pixel, lists that nothing is known for are empty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// [`FORMAT`].
    pub format: String,
    /// [`VERSION`].
    pub version: u32,
    /// The program that wrote it.
    pub program: String,
    /// What is reported on, such as the name of the model file.
    pub title: String,
    /// The command that writes it again, where it was made by one.
    pub command: Option<String>,
    /// The unit of world lengths.
    pub unit: String,
    /// The method that was fitted.
    pub method: Option<String>,
    /// Its settings, as model files spell them.
    pub settings: serde_json::Value,
    /// The seed of every random choice.
    pub seed: Option<u64>,
    /// What it comes to, in words.
    pub verdict: Verdict,
    /// Which points the errors below are of.
    pub judgement: Validation,
    /// The errors in figures.
    pub accuracy: Option<Accuracy>,
    /// The cameras.
    pub cameras: Vec<CameraFigures>,
    /// The views, or slabs of space, that were held out one after the other.
    pub views: Vec<ViewFigures>,
    /// Errors by depth.
    pub depth: Vec<DepthBand>,
    /// How often the error ellipsoids hold what they promise.
    pub error_bars: Vec<ErrorBarPoint>,
    /// Methods side by side.
    pub methods: Vec<MethodFigures>,
    /// The setup of the 2001 paper, where that was done again.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub setup: Option<SetupFigures>,
    /// How the error fell during the fit.
    pub learning: Option<CurveFigure>,
    /// How the error grows beyond the range that was fitted.
    pub beyond: Option<CurveFigure>,
    /// Where the error comes from.
    pub budget: Vec<BudgetShare>,
    /// Observations that were set aside.
    pub outliers: Vec<OutlierFigures>,
    /// How far charts stood from where they were said to stand.
    pub stage: Vec<StageFigures>,
    /// Where charts of unknown place were found to have stood, where there were any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub placed: Option<EstimatedPoses>,
    /// Faults of the data.
    pub findings: Vec<FindingFigures>,
    /// Claims that were tested.
    pub claims: Vec<ClaimFigures>,
    /// Every point.
    pub points: Vec<PointFigures>,
    /// Names of the views that points refer to.
    pub point_views: Vec<String>,
    /// A scene that was reconstructed with the model, where there was one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<SceneFigures>,
    /// Pictures, made small, where there are any.
    pub pictures: Vec<PictureFigures>,
    /// Small pieces of pictures about points, where there are any.
    pub crops: Option<Crops>,
    /// The same about the observations that were set aside; `of` counts `outliers`.
    pub outlier_crops: Option<Crops>,
}

impl Report {
    /// The page: one file, no network.
    #[must_use]
    pub fn html(&self) -> String {
        page::page(self)
    }

    /// Writes the page.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn write_html(&self, path: &Path) -> Result<()> {
        storage::write(path, self.html().as_bytes())
    }

    /// Writes the value itself, as JSON.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn write_summary(&self, path: &Path) -> Result<()> {
        let mut bytes = serde_json::to_vec(self).map_err(|e| Error::writing(path, e.into()))?;
        bytes.push(b'\n');
        storage::write(path, &bytes)
    }

    /// Writes every figure as an SVG file of its own into a folder.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn write_figures(&self, folder: &Path) -> Result<()> {
        storage::write_folder(folder, |folder| {
            for figure in figures::all(self) {
                let many = figure.panels.len() > 1;
                for (index, panel) in figure.panels.iter().enumerate() {
                    let number = if many { format!("-{}", index + 1) } else { String::new() };
                    let path = folder.join(format!("{}{number}.svg", figure.name));
                    storage::write(&path, panel.standalone().as_bytes())?;
                }
            }
            Ok(())
        })
    }

    /// A report on nothing yet.
    fn empty(title: &str, unit: &str) -> Self {
        Self {
            format: FORMAT.into(),
            version: VERSION,
            program: concat!("wheatstone ", env!("CARGO_PKG_VERSION")).into(),
            title: title.into(),
            command: None,
            unit: unit.into(),
            method: None,
            settings: serde_json::Value::Null,
            seed: None,
            verdict: Verdict::default(),
            judgement: Validation::Nothing,
            accuracy: None,
            cameras: Vec::new(),
            views: Vec::new(),
            depth: Vec::new(),
            error_bars: Vec::new(),
            methods: Vec::new(),
            setup: None,
            learning: None,
            beyond: None,
            budget: Vec::new(),
            outliers: Vec::new(),
            stage: Vec::new(),
            placed: None,
            findings: Vec::new(),
            claims: Vec::new(),
            points: Vec::new(),
            point_views: Vec::new(),
            scene: None,
            pictures: Vec::new(),
            crops: None,
            outlier_crops: None,
        }
    }
}
