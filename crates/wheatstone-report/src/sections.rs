//! The parts of a report, as plain data.

use super::{cloud::SceneCloud, grid::Grid};
use serde::{Deserialize, Serialize};
use wheatstone_core::dataset::split::FoldKind;

/// What it comes to, in words.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// One word: `sound`, `fair`, `doubtful` or `unproven`; of the paper's claims, `confirmed` or
    /// `mixed`.
    pub grade: String,
    /// One sentence.
    pub sentence: String,
    /// Why, a sentence each.
    pub reasons: Vec<String>,
    /// What would make it better, a sentence each.
    pub advice: Vec<String>,
}

/// Errors over all points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Accuracy {
    /// Points with a known place that two cameras or more saw.
    pub n: usize,
    /// Those of them that were located.
    pub located: usize,
    /// Root mean square distance.
    pub rms: f64,
    /// Median distance.
    pub median: f64,
    /// The distance that 95 % of the points stay below.
    pub p95: f64,
    /// Mean of the distance as a percentage of the point's distance from the cameras.
    pub mean_percent: f64,
    /// Root mean square along X, Y and Z.
    pub rms_xyz: [f64; 3],
    /// Median distance of the points from the middle of the cameras.
    pub working_distance: f64,
    /// Root mean square that the error bars predict.
    pub predicted_rms: Option<f64>,
    /// Root mean square that the pixels' noise alone allows: by the true cameras where they are known, otherwise
    /// by the noise that the most flexible fit leaves.
    pub floor_rms: Option<f64>,
}

impl Accuracy {
    /// `rms` over the floor, where it is known, else over what the fit's own error bars predict.
    #[must_use]
    pub fn ratio(&self) -> Option<f64> {
        self.floor_rms.or(self.predicted_rms).filter(|least| *least > 0.0).map(|it| self.rms / it)
    }
}

/// One camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraFigures {
    /// Its name.
    pub name: String,
    /// Left, top, right and bottom of its picture in pixels; of the points in it, where the size of
    /// the picture is not known.
    pub area: [f64; 4],
    /// Whether `area` is the whole picture.
    pub area_is_picture: bool,
    /// Its centre in the world, where the points tell.
    pub centre: Option<[f64; 3]>,
    /// Unit vectors in which the corners of `area` look: top left, top right, bottom right, bottom
    /// left. Empty where the points do not tell.
    pub corners: Vec<[f64; 3]>,
    /// Points that it saw.
    pub seen: usize,
    /// Root mean square of the misses in its picture, per pixel coordinate.
    pub miss_rms: Option<f64>,
    /// Points, counted over `area`.
    pub coverage: Grid,
    /// Root mean square error in the world, over `area`.
    pub errors: Grid,
}

/// One view or slab that was held out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewFigures {
    /// The view's name, or the slab's bounds.
    pub name: String,
    /// Whether it lies among those that were fitted; none where it was fitted itself.
    pub kind: Option<FoldKind>,
    /// Its points with a known place.
    pub points: usize,
    /// Those of them that were located.
    pub located: usize,
    /// Root mean square error.
    pub rms: Option<f64>,
    /// Root mean square that the error bars predict.
    pub predicted_rms: Option<f64>,
    /// Why nothing was located, if so.
    pub problem: Option<String>,
}

/// Errors of the points between two depths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DepthBand {
    /// Mean depth of its points.
    pub depth: f64,
    /// Points in it.
    pub points: usize,
    /// Root mean square error.
    pub rms: f64,
    /// Root mean square that the error bars predict.
    pub predicted_rms: Option<f64>,
    /// Root mean square that the pixels' noise alone allows, where the true cameras are known.
    pub floor_rms: Option<f64>,
}

/// One size of error ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorBarPoint {
    /// The share of true places that the ellipsoid promises to hold, 0 to 1.
    pub nominal: f64,
    /// The share that it holds.
    pub actual: f64,
}

/// One method among several.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodFigures {
    /// Its name.
    pub method: String,
    /// Root mean square error on what was held out.
    pub rms: Option<f64>,
    /// Median error, where it was kept.
    pub median: Option<f64>,
    /// The error that 95 % of the points stay below, where it was kept.
    pub p95: Option<f64>,
    /// Times what the pixels' noise allows, where the true cameras are known.
    pub ratio_to_floor: Option<f64>,
    /// Points located, of how many, where it was kept.
    pub located: Option<[usize; 2]>,
    /// Whether it is the one to trust here.
    pub chosen: bool,
    /// Why it could not be fitted, if so.
    pub problem: Option<String>,
}

/// Curves over one axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurveFigure {
    /// What goes across, with its unit.
    pub across: String,
    /// What goes up, with its unit.
    pub up: String,
    /// The curves.
    pub curves: Vec<Curve>,
    /// Values that the curves are held against.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub levels: Vec<Level>,
}

/// A value that curves are held against.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// The value, upwards.
    pub at: f64,
    /// What it is.
    pub name: String,
}

/// The setup of the 2001 paper, as its figures 1 to 4 show it. Lengths are centimetres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SetupFigures {
    /// Of each camera X and Z: of its centre, and of where the left and the right border of its picture are at
    /// Z = 100 cm.
    pub cameras: Vec<[[f64; 2]; 3]>,
    /// Z of each place of the chart.
    pub stations: Vec<f64>,
    /// X of the chart's left and right end.
    pub chart: [f64; 2],
    /// Units of the network's layers, inputs and outputs included.
    pub layers: Vec<usize>,
    /// Width and height of a picture in pixels.
    pub picture: [f64; 2],
    /// The chart's lines as each camera sees them, each as pixels along it.
    pub lines: Vec<Vec<Vec<[f64; 2]>>>,
}

/// One curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// What it shows.
    pub name: String,
    /// Across and up.
    pub points: Vec<[f64; 2]>,
}

/// A source of error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BudgetShare {
    /// What it is: `pixel noise`, `lens model`, `the charts' places`, `extrapolation`.
    pub source: String,
    /// Its share in the mean square error, 0 to 1; all shares sum to 1.
    #[serde(default)]
    pub share: f64,
    /// Root mean square of the error that it makes alone.
    pub rms: f64,
    /// In one sentence, how it is known.
    pub explanation: String,
}

/// An observation that was set aside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutlierFigures {
    /// The view.
    pub view: String,
    /// The point's name.
    pub id: String,
    /// The camera, where it is one camera's.
    pub camera: Option<usize>,
    /// Why.
    pub reason: String,
}

/// How far a chart stood from where it was said to stand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageFigures {
    /// The view.
    pub view: String,
    /// Found place minus stated place.
    pub offset: [f64; 3],
    /// Found against stated attitude: axis times angle, in radians.
    pub rotation: [f64; 3],
    /// Standard deviation of the offset.
    pub sigma: Option<f64>,
}

/// A fault of the data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FindingFigures {
    /// Its name in lists.
    pub code: String,
    /// `error`, `warning` or `note`.
    pub severity: String,
    /// The views that show it.
    pub views: Vec<String>,
    /// The cameras that show it.
    pub cameras: Vec<String>,
    /// What it is.
    pub explanation: String,
    /// What to do about it.
    pub hint: String,
    /// Whether it is in the model, whose errors or error bars it makes larger than they are told.
    #[serde(default)]
    pub stays_in_fit: bool,
}

/// A claim that was tested.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClaimFigures {
    /// What is said.
    pub claim: String,
    /// What was measured.
    pub measured: String,
    /// `confirmed`, `not confirmed` or `not tested`.
    #[serde(default)]
    pub verdict: String,
    /// The criterion and what explains the figure, or why it was not tested.
    #[serde(default)]
    pub why: String,
}

/// One point as the cameras saw it, and where it was located.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointFigures {
    /// Index into the report's `point_views`.
    pub view: usize,
    /// Its name within the view.
    pub id: Option<String>,
    /// Where each camera saw it.
    pub pixels: Vec<Option<[f64; 2]>>,
    /// Where it is, where that is known.
    pub world: Option<[f64; 3]>,
    /// Where it was located.
    pub located: Option<LocatedFigures>,
}

impl PointFigures {
    /// How many cameras saw it.
    #[must_use]
    pub fn seen_by(&self) -> usize {
        self.pixels.iter().flatten().count()
    }

    /// Distance of the located place from the known one.
    #[must_use]
    pub fn error(&self) -> Option<f64> {
        let (world, found) = (self.world?, self.located.as_ref()?.point);
        Some((0..3).map(|axis| (found[axis] - world[axis]).powi(2)).sum::<f64>().sqrt())
    }

    /// The distance that the error bar predicts, root mean square.
    #[must_use]
    pub fn predicted(&self) -> Option<f64> {
        let [xx, _, _, yy, _, zz] = self.located.as_ref()?.covariance?;
        Some((xx + yy + zz).sqrt())
    }
}

/// Where a point was located.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LocatedFigures {
    /// In the world.
    pub point: [f64; 3],
    /// XX, XY, XZ, YY, YZ, ZZ of its covariance.
    pub covariance: Option<[f64; 6]>,
    /// How badly the rays miss each other, in pixels.
    pub residual: Option<f64>,
    /// In each camera, from where the point was seen to where it was expected, in pixels.
    pub misses: Vec<Option<[f64; 2]>>,
    /// Its distance from the cameras, along the direction in which they look.
    pub depth: f64,
}

/// A picture, made small.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PictureFigures {
    /// The view.
    pub view: String,
    /// The camera's index.
    pub camera: usize,
    /// The file's name.
    pub name: String,
    /// Width and height of the original in pixels.
    pub size: [usize; 2],
    /// The picture as a `data:` address.
    pub data: String,
    /// What was found, in pixels of the original.
    pub found: Vec<[f64; 2]>,
    /// Why nothing was found, if so.
    pub problem: Option<String>,
}

/// Small pieces of pictures, side by side in one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Crops {
    /// All pieces as one `data:` address.
    pub data: String,
    /// Side of a piece, in pixels of the original.
    pub side: usize,
    /// Pieces in a row.
    pub columns: usize,
    /// The point, or the observation that was set aside, and the camera of each piece.
    pub of: Vec<[usize; 2]>,
}

/// A scene that the cameras saw, reconstructed with the model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneFigures {
    /// Names of the pictures, one a camera.
    pub pictures: Vec<String>,
    /// Why there are no points, where the pictures do not fit the model or each other: a sentence without its full stop.
    pub problem: Option<String>,
    /// How many points there are.
    pub points: usize,
    /// The share of the reference picture's pixels that have one, 0 to 1.
    pub density: f64,
    /// The share of the points within the calibrated volume, 0 to 1.
    pub inside: f64,
    /// Medians of the standard deviations of X, Y and Z.
    pub sigmas: Option<[f64; 3]>,
    /// Some of the points.
    pub sample: SceneCloud,
}
