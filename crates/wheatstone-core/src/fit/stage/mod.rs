//! Where charts really stood.
//!
//! A chart is put at its places with a ruler or on a stage, and that is often the largest error of
//! all: pixels are known to a twentieth of a pixel, places to half a millimetre. Every pixel of a view
//! then disagrees with those of the other views in the same way, and that can be seen: cameras and
//! charts are adjusted together (bundle adjustment: Triggs et al. 2000,
//! doi:10.1007/3-540-44480-7_21), each chart's offset and rotation under the prior that the user's word
//! for the stage is. The cameras are those of [`crate::method::neural_camera`], so that it holds for
//! any optics, and noise and correction are learnt from pixels whose charts are loose
//! (`docs/decisions/0010-stage-errors.md`).
//!
//! **What cannot be seen.** Motions that all charts have in common, and offsets that grow evenly with
//! the place (a stage's scale, a stage that runs askew), look exactly like other cameras: the cameras
//! take them up. Such parts stay near nothing, with the prior's uncertainty. Offsets are reported
//! whole, and as their *observable part*: what is left when the best affine function of the place is
//! taken away. Points located later share the unobservable part: their errors are those of the stage
//! as a whole, not of one placement.

mod affine;
mod charts;
mod joint;
mod observable;
mod prior;

pub use observable::{Significance, ViewOffset};
pub use prior::StagePrior;

use crate::{
    Result,
    dataset::{Dataset, split::sample},
    geometry::StageCovariance,
};
use affine::AffineMaps;
use charts::ChartPosition;
use joint::{CameraObservations, JointAdjustment};
use nalgebra::DMatrix;
use wheatstone_numeric::progress::Progress;

/// Charts put where they stood.
#[derive(Clone, Debug)]
pub struct SolvedStage {
    /// One entry a view that has points, in the order of the data.
    pub offsets: Vec<ViewOffset>,
    /// The data with world places corrected.
    pub data: Dataset,
    /// Whether that was worth it.
    pub significance: Significance,
    /// What points located by cameras fitted to `data` are uncertain by the charts' places.
    pub uncertainty: StageCovariance,
    /// Standard deviation of one pixel coordinate, a camera each, that neither the camera nor any
    /// place of its charts explains.
    pub pixel_noise: Vec<f64>,
    /// How much the cameras disagree on where the charts stood: chi-square a degree of freedom, about
    /// 1 where nothing but noise parts them. All sigmas above are widened by its root where it is more
    /// than 1.
    pub disagreement: f64,
    /// Rounds of adjustment until the charts stood still.
    pub rounds: usize,
}

/// Solves for where the charts of `data` stood, together with the cameras, under `prior`. Views are
/// taken by name; where the file has none, layers of points on a common level of one axis are.
///
/// Gross outliers bend the result as they bend any fit: set them aside before.
///
/// # Errors
///
/// [`crate::Error::Setting`] and [`crate::Error::UnknownName`] for a prior that means nothing,
/// [`crate::Error::Degenerate`] for fewer than three views or points in no layers (nothing can be seen of
/// where charts stood then), [`crate::Error::TooFew`] for cameras that saw next to nothing,
/// [`crate::Error::Cancelled`].
pub fn solve(data: &Dataset, prior: &StagePrior, progress: &dyn Progress) -> Result<SolvedStage> {
    prior.check(data)?;
    let placements = charts::placements(data)?;
    let charts = charts::loose(&placements, prior);
    let observations = CameraObservations::of_all(data, &placements);
    let mut joint = JointAdjustment::new(&observations, charts, progress)?;
    let rounds = joint.solve(prior.rotation_sigma.is_none(), progress)?;
    let maps = AffineMaps::of(&placements, &joint.charts);
    let covariance = joint.covariance().ok_or_else(joint::lost)?;
    let settled = settle(&mut joint, &maps, &covariance).ok_or_else(joint::lost)?;
    let offsets = observable::offsets(&placements, &joint.charts, &settled.motions);
    Ok(SolvedStage {
        offsets,
        data: charts::moved(data, &placements, &joint.charts),
        significance: joint.significance(prior.offset_sigma),
        uncertainty: settled.uncertainty,
        pixel_noise: joint.pixel_noise(),
        disagreement: joint.disagreement,
        rounds,
    })
}

/// What is known of adjusted charts whose frame is the nominal one.
struct Settled {
    /// Covariance of all their motions.
    motions: DMatrix<f64>,
    uncertainty: StageCovariance,
}

/// Brings adjusted charts back to the nominal frame; `covariance` is that of their motions by the pixels.
fn settle(
    joint: &mut JointAdjustment,
    maps: &AffineMaps,
    covariance: &DMatrix<f64>,
) -> Option<Settled> {
    joint.keep_nominal(maps)?;
    let within = maps.taken_out(&maps.taken_out(covariance)?.transpose())?;
    let uncertainty = maps.covariance(&joint.charts, &within)?;
    Some(Settled { motions: within + maps.shared()?, uncertainty })
}

/// The share of the views' extent that [`suspect`] supposes as standard deviation of their places:
/// two millimetres over a metre, more than any ruler's. What it estimates hardly depends on it.
const SUPPOSED: f64 = 2e-3;

/// Cameras, views and pixels of the views that suffice to tell: of more, a part is taken, since the adjustment's work
/// grows with the cube of the views.
const MOST_CAMERAS: usize = 8;
const MOST_VIEWS: usize = 40;
const MOST_PIXELS: usize = 16_000;

/// The cameras that see most.
fn seeing_most(data: &Dataset) -> Vec<usize> {
    let mut seen = vec![0_usize; data.cameras];
    for row in &data.correspondences {
        for (seen, pixel) in seen.iter_mut().zip(&row.pixels) {
            *seen += usize::from(pixel.is_some());
        }
    }
    let mut cameras: Vec<usize> = (0..data.cameras).collect();
    cameras.sort_by_key(|camera| std::cmp::Reverse(seen[*camera]));
    cameras.truncate(MOST_CAMERAS);
    cameras.sort_unstable();
    cameras
}

/// Whether data look as if charts had not stood where they were said to, and by how much, without
/// solving for it: one adjustment, no iteration.
///
/// # Errors
///
/// As [`solve`].
pub fn suspect(data: &Dataset, progress: &dyn Progress) -> Result<Significance> {
    let few = (data.cameras > MOST_CAMERAS).then(|| data.of_cameras(&seeing_most(data)));
    let thinned = data.views.len().div_ceil(MOST_VIEWS).max(1);
    let (_, data) = sample(few.as_ref().unwrap_or(data), MOST_PIXELS * thinned, 0);
    let mut placements = charts::placements(&data)?;
    let thinned = placements.len().div_ceil(MOST_VIEWS);
    placements = placements.into_iter().step_by(thinned).collect();
    let sigma = SUPPOSED * ChartPosition::extent(&placements);
    let charts = charts::loose(&placements, &StagePrior::of(sigma));
    let observations = CameraObservations::of_all(&data, &placements);
    let joint = JointAdjustment::new(&observations, charts, progress)?;
    Ok(joint.significance(sigma))
}
