//! Fisheye cameras after Kannala and Brandt, fitted by bundle adjustment to known points; then
//! triangulation.
//!
//! Source: Kannala & Brandt 2006 (doi:10.1109/TPAMI.2006.153), in the form of
//! [`crate::camera::kannala_brandt`]; adjustment and choice of terms as in the module on fitting
//! cameras.

use super::{
    AnyMethod, Fit, FittedCameras, KnownLens, Method, known_lens_fit,
    resection::NestedModels,
    resection_start::{Lens, starts},
    unknown,
};
use crate::{
    Error, Result,
    camera::{kannala_brandt::KannalaBrandt as Model, pinhole::Pinhole, posed_lens::PosedLens},
    dataset::Dataset,
    geometry::{Pixel, Point3, ProjectionMatrix},
};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::progress::Progress;

/// Which terms of the radius a camera may have, beside focal lengths and principal point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct KannalaBrandt {
    /// How many of k1 to k4: 0 to 4.
    pub terms: usize,
    /// Whether each camera may do with fewer, where more would not predict better.
    pub choose: bool,
    /// Lenses that are known, one a camera: they are kept, and only poses are adjusted. None where they are to be found.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lenses: Vec<KnownLens<Model>>,
}

impl Default for KannalaBrandt {
    fn default() -> Self {
        Self { terms: 4, choose: true, lenses: Vec::new() }
    }
}

/// Fisheye cameras and their noise.
pub type KannalaBrandtReconstructor = FittedCameras<Model>;

impl KannalaBrandt {
    const PRESETS: &'static [&'static str] = &["default", "fixed"];

    /// The numbers that a camera may have, those that it may do without included.
    pub(super) fn numbers(&self) -> Vec<usize> {
        self.ladder().rungs.pop().unwrap_or_default()
    }

    fn ladder(&self) -> NestedModels {
        let least = if self.choose { 0 } else { self.terms };
        let rungs: Vec<Vec<usize>> =
            (least..=self.terms).map(|terms| (0..4 + terms).collect()).collect();
        NestedModels { method: "kannala-brandt", rungs }
    }
}

/// Cameras from which an adjustment to these pairs may start, for lenses from telephoto to fisheye.
pub(crate) fn starting_cameras(pairs: &[(Point3, Pixel)]) -> Vec<PosedLens<Model>> {
    ProjectionMatrix::fit(pairs).map_or_else(Vec::new, |linear| starts(pairs, &linear))
}

impl Lens for Model {
    fn start(pinhole: Pinhole, first: f64) -> Self {
        Self { pinhole, coefficients: [first, 0.0, 0.0, 0.0] }
    }
}

impl Method for KannalaBrandt {
    fn fit(&self, train: &Dataset, _seed: u64, progress: &dyn Progress) -> Result<Fit> {
        if self.terms > 4 {
            return Err(Error::Setting {
                setting: "terms".into(),
                value: self.terms.to_string(),
                need: "0 to 4".into(),
            });
        }
        if !self.lenses.is_empty() {
            return known_lens_fit::fit(&self.lenses, train, progress);
        }
        self.ladder().fit::<Model>(train, progress)
    }

    fn includes_pose_uncertainty(&self) -> bool {
        true
    }

    fn summary(&self) -> &'static str {
        "fisheye cameras, least reprojection error, then triangulation (2006)"
    }

    fn presets(&self) -> &'static [&'static str] {
        Self::PRESETS
    }

    fn preset(&self, name: &str) -> Result<AnyMethod> {
        match name {
            "default" => Ok(Self::default().into()),
            "fixed" => Ok(Self { choose: false, ..Self::default() }.into()),
            _ => Err(unknown("preset", name, Self::PRESETS)),
        }
    }
}
