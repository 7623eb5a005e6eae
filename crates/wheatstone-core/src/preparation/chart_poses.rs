//! Where charts of unknown place stood.
//!
//! Cameras and charts are adjusted together twice: with parametric lenses, then, from there, with the
//! model-free camera. The second is right behind any optics; the first is surer where its lens is that of the
//! cameras, because it has fewer numbers to find: a model-free camera tells focal length from distance by
//! little. So the first stays where its lens, by `auto`'s own rule, predicts views left out as well as the
//! model-free camera does, all charts being where that one puts them.

use super::outliers;
use crate::{
    Error, Result,
    camera::AnyCamera,
    dataset::Dataset,
    fit::{
        bundle::{self, BundleSettings, CameraMotion, Gauge, Lenses, SolvedPoses, ViewPose},
        stage::{self, StagePrior},
    },
    method::auto,
};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::progress::Progress;

/// Charts of unknown place, placed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct EstimatedPoses {
    /// One entry a view.
    pub views: Vec<ViewPose>,
    /// Views that could not be placed, for too few points.
    pub unplaced: Vec<String>,
    /// Views whose chart may be tilted to either of two sides: their pixels do not tell.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub undecided: Vec<String>,
    /// The lens with which they were placed: a name of the registry of cameras.
    pub lens: String,
    /// Root mean square distance, in pixels, of detections from where cameras and charts say, with
    /// that lens.
    pub rms: f64,
    /// Distances of each camera from the first one, in the data's unit.
    pub baselines: Vec<f64>,
    /// Whether charts and the model-free camera were adjusted together after that.
    pub freed: bool,
    /// The frame of the world; none where some places were known, whose frame it is then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gauge: Option<Gauge>,
    /// The change of a camera's pose relative to the others, where the pixels tell one; a model's file has it among its
    /// findings.
    #[serde(skip)]
    pub motion: Option<CameraMotion>,
}

/// How far charts may go from where a known lens put them, as a share of their distance, and in
/// radians: behind water or glass they are off by a three-hundredth.
const FREEDOM: f64 = 0.01;

/// The data with all charts placed, and where they stood; `lenses` are those that are known, one a camera, or none.
pub(super) fn place(
    data: &Dataset,
    lenses: &[AnyCamera],
    bundle_settings: BundleSettings,
    progress: &dyn Progress,
) -> Result<(Dataset, EstimatedPoses)> {
    let mut solved = if lenses.is_empty() {
        bundle::solve(data, bundle_settings, progress)?
    } else {
        bundle::solve_known(data, lenses, bundle_settings, progress)?
    };
    let mut freed = None;
    if lenses.is_empty() && bundle_settings.lenses == Lenses::Either {
        freed = model_free(&solved, bundle_settings, progress)?;
    }
    let is_free = freed.is_some();
    let known = data.known().next().is_some();
    if let Some(freed) = freed {
        solved.adopt(freed, bundle_settings.gauge);
    }
    // A point with a place on the chart and one in the world tells that the place was found.
    let estimated = EstimatedPoses {
        views: solved.views,
        unplaced: solved.unplaced,
        undecided: solved.undecided,
        motion: solved.motion,
        lens: solved.lens.into(),
        rms: solved.rms,
        baselines: solved.baselines,
        freed: is_free,
        gauge: (!known).then_some(bundle_settings.gauge),
    };
    Ok((solved.data, estimated))
}

/// Charts and model-free cameras adjusted together; `None` where that does not apply, and where the lens does
/// as well.
fn model_free(
    solved: &SolvedPoses,
    bundle_settings: BundleSettings,
    progress: &dyn Progress,
) -> Result<Option<Dataset>> {
    let held = |view: usize| {
        let mut rows = solved.data.correspondences.iter().filter(|row| row.view == view);
        rows.all(|row| row.board.is_none())
    };
    let names = solved.data.views.iter().enumerate();
    let prior = StagePrior {
        offset_sigma: FREEDOM * solved.distance,
        rotation_sigma: Some(FREEDOM),
        // Known places are kept.
        views: names.filter(|(view, _)| held(*view)).map(|(_, name)| (name.clone(), 0.0)).collect(),
    };
    let clean = if bundle_settings.keep_gross {
        solved.data.clone()
    } else {
        without_outliers(&solved.data, progress)?
    };
    match stage::solve(&clean, &prior, progress) {
        Ok(freed) if bundle_settings.always_model_free => {
            Ok(Some(with_pixels_of(freed.data, &solved.data)))
        }
        Ok(freed) => {
            let lens = if solved.lens == "kannala-brandt" { "kannala-brandt" } else { "brown" };
            let does_as_well = auto::does_as_well(lens, "neural-camera", &freed.data, progress)?;
            Ok((!does_as_well).then(|| with_pixels_of(freed.data, &solved.data)))
        }
        Err(Error::Degenerate { .. } | Error::TooFew { .. }) => Ok(None),
        Err(other) => Err(other),
    }
}

/// The data without the pixels of outliers, which would bend charts and cameras alike: no error is cut off there.
fn without_outliers(data: &Dataset, progress: &dyn Progress) -> Result<Dataset> {
    // Of many points of a camera some are chosen at random.
    const SEED: u64 = 0;
    let mut clean = data.clone();
    for outlier in outliers::screen(data, SEED, progress)?.outliers {
        for camera in outlier.cameras {
            clean.correspondences[outlier.row].pixels[camera] = None;
        }
    }
    Ok(clean)
}

/// Charts that were moved, with all the pixels again: what is an outlier is judged anew.
fn with_pixels_of(mut moved: Dataset, data: &Dataset) -> Dataset {
    for (row, own) in moved.correspondences.iter_mut().zip(&data.correspondences) {
        row.pixels.clone_from(&own.pixels);
    }
    moved
}
