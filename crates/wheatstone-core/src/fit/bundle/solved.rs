//! Where charts stood, once that is known.

use super::settings::Gauge;
use crate::{
    camera::AnyCamera,
    dataset::{Dataset, chart_pose},
    geometry::Pose,
};
use serde::{Deserialize, Serialize};

/// Where a chart is believed to have stood.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct ViewPose {
    /// The view's name.
    pub view: String,
    /// Where the chart's origin lies in the world.
    pub translation: [f64; 3],
    /// World from chart: a rotation vector in radians.
    pub rotation: [f64; 3],
    /// Standard deviation of `translation`; with a frame of the first view's chart it has that chart's
    /// own, as what is known is known from the cameras.
    pub translation_sigma: [f64; 3],
    /// Standard deviation of the turn about each axis of the world, in radians.
    pub rotation_sigma: [f64; 3],
    /// Points of this view that take part.
    pub points: usize,
}

/// A camera whose pose relative to the others changed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CameraMotion {
    /// The camera, counted from 0; of two it may as well be the other.
    pub camera: usize,
    /// How it changed.
    pub change: PoseChange,
    /// The views' names in which it is another than in the first one; all of them for a drift.
    pub views: Vec<String>,
    /// By how far the chart's points moved in its pictures, in pixels: root mean square.
    pub shift: f64,
    /// Rotation, in degrees.
    pub rotation: f64,
    /// Translation in the data's unit; 0 where the rotation explains it.
    pub translation: f64,
    /// Root mean square error of a pixel coordinate with constant relative poses, and with this change.
    pub errors: [f64; 2],
}

/// How a camera's pose changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PoseChange {
    /// From a view on.
    Step,
    /// Evenly from the first view to the last.
    Drift,
    /// In a few views, in each by another amount.
    FewViews,
    /// In every view, in each by another amount.
    Every,
}

/// Charts placed.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct SolvedPoses {
    /// The data with known places, beside those on the chart; points of views that could not be placed
    /// are gone.
    pub data: Dataset,
    /// One entry a view that was placed.
    pub views: Vec<ViewPose>,
    /// Views that could not be placed, for too few points.
    pub unplaced: Vec<String>,
    /// Views whose chart may be tilted to either of two sides: their pixels do not tell.
    pub undecided: Vec<String>,
    /// The change of a camera's pose relative to the others, where the pixels tell one.
    pub motion: Option<CameraMotion>,
    /// The lens that was used: a name of the registry of cameras.
    pub lens: &'static str,
    /// The cameras, each in its own frame; one that sees charts in a mirror is that of its pictures with the sign of y changed.
    pub cameras: Vec<AnyCamera>,
    /// Root mean square distance of pixels from where cameras and charts say, gross errors left out.
    pub rms: f64,
    /// Points (a camera each) that stood out as gross errors.
    pub gross: usize,
    /// Distances of each camera from the first one, in the data's unit.
    pub baselines: Vec<f64>,
    /// Median distance of the charts from the first camera.
    pub distance: f64,
}

impl SolvedPoses {
    /// Takes over places to which charts were moved afterwards; the frame stays the first view's chart
    /// where it was that.
    pub fn adopt(&mut self, moved: Dataset, gauge: Gauge) {
        let from_board = |view: &str| -> Option<Pose> {
            let index = moved.views.iter().position(|name| name == view).unwrap_or(0);
            chart_pose(moved.correspondences.iter().filter(|row| row.view == index))
        };
        let known = moved.correspondences.iter().any(|row| row.board.is_none());
        let first = self.views.first().and_then(|first| from_board(&first.view));
        let to_world = match (gauge, first) {
            (Gauge::FirstView, Some(first)) if !known => first.inverse(),
            _ => Pose::default(),
        };
        for view in &mut self.views {
            if let Some(pose) = from_board(&view.view).map(|pose| to_world.after(&pose)) {
                view.translation = pose.translation.into();
                view.rotation = pose.rotation_vector().into();
            }
        }
        self.data = moved;
        for row in &mut self.data.correspondences {
            row.world = row.world.map(|world| to_world.transform(world));
        }
    }
}
