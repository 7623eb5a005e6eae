//! Tsai's two-step calibration: rotation and sideways place in closed form from radial alignment,
//! then focal length, depth and one coefficient of distortion; then triangulation.
//!
//! Source: Tsai 1987 (doi:10.1109/JRA.1987.1087109), for points that are not coplanar. Two things
//! differ from the paper. The principal point, which the paper takes to be the middle of the frame
//! memory, is not told by a file of points: the linear camera's is tried first, then the centre of
//! distortion, and it is adjusted in the end together with everything else. And the last step
//! adjusts all of the model's own numbers, where the paper stops after depth, focal length and
//! distortion: with pixel noise on both coordinates that is the most likely camera.

use super::{
    AnyMethod, Fit, FittedCameras, Method,
    checks::linear_camera,
    only_default,
    radial_alignment::{Aligned, Scaled},
    resection::{Adjusted, FINAL, SCOUTING, assemble, pairs_of, possible, unexplained},
};
use crate::{
    Result,
    camera::{
        pinhole::Pinhole,
        posed_lens::{POSE, PosedLens},
        tsai::Tsai as Model,
    },
    dataset::Dataset,
    geometry::{Pixel, Point3, Pose, Vector3},
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use wheatstone_numeric::{least_squares::solve, progress::Progress};

/// There is nothing to set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tsai {}

/// Tsai's cameras and their noise.
pub type TsaiReconstructor = FittedCameras<Model>;

/// Radial alignment has seven unknowns and one equation a point.
const POINTS_NEEDED: usize = 7;

/// T_z, the focal lengths and kappa_1, as [`PosedLens::adjust`] numbers them: what the paper's second
/// stage adjusts.
const SECOND_STAGE: [usize; 4] = [5, POSE, POSE + 1, POSE + 4];

/// Everything: six of the pose, two focal lengths, the principal point, kappa_1.
const ALL: [usize; 11] = [0, 1, 2, 3, 4, 5, POSE, POSE + 1, POSE + 2, POSE + 3, POSE + 4];

/// Focal length and depth from the alignment, without distortion: the linear equations of the paper's
/// second stage, for both coordinates at once: f radius - T_z seen = along seen. A negative solution
/// is that of the mirrored frame.
fn second_step(scaled: &Scaled, aligned: &Aligned, centre: Pixel) -> Option<PosedLens<Model>> {
    let rotation = aligned.rotation(false);
    let axis: Vector3 = rotation.row(2).transpose();
    let (mut left, mut right) = (Vec::new(), Vec::new());
    for ((world, _), [seen, radius]) in scaled.pairs.iter().zip(&aligned.radii) {
        left.extend([*radius, -seen]);
        right.push(axis.dot(world) * seen);
    }
    let found = solve(&left, 2, &right, 1)?;
    let (focal, depth) = (found[0], found[1]);
    let mirrored = focal < 0.0;
    let (focal, depth) = (focal.abs(), if mirrored { -depth } else { depth });
    let rotation = aligned.rotation(mirrored);
    let pinhole =
        Pinhole { focal: [focal * aligned.aspect, focal], principal: [centre.x, centre.y] };
    let translation = scaled.unscaled(rotation, aligned.translation(depth));
    Some(PosedLens {
        lens: Model { pinhole, kappa: 0.0 },
        camera_from_world: Pose { rotation, translation },
    })
}

/// One camera by both steps, from the best of several principal points.
fn fit_camera(camera: usize, train: &Dataset, progress: &dyn Progress) -> Result<Adjusted<Model>> {
    let pairs: Vec<(Point3, Pixel)> = pairs_of("tsai", camera, POINTS_NEEDED, train)?;
    let linear = linear_camera(camera, &pairs)?;
    let scaled = Scaled::new(&pairs).ok_or_else(|| unexplained("tsai", camera))?;
    let mut best: Option<Adjusted<Model>> = None;
    for centre in scaled.centres(&linear) {
        let aligned = scaled.align(centre);
        let start = aligned.and_then(|aligned| second_step(&scaled, &aligned, centre));
        let Some(start) = start else { continue };
        let second = start.adjust(&SECOND_STAGE, &pairs, SCOUTING, progress);
        let Some(second) = possible(second)? else { continue };
        let whole = second.camera.adjust(&ALL, &pairs, FINAL, progress);
        let Some(whole) = possible(whole)? else { continue };
        if best.as_ref().is_none_or(|best| whole.squares < best.squares) {
            best = Some(whole);
        }
    }
    best.ok_or_else(|| unexplained("tsai", camera))
}

impl Method for Tsai {
    fn fit(&self, train: &Dataset, _seed: u64, progress: &dyn Progress) -> Result<Fit> {
        let found: Result<Vec<_>> = (0..train.cameras)
            .into_par_iter()
            .map(|camera| fit_camera(camera, train, progress))
            .collect();
        assemble(found?, None, train)
    }

    fn includes_pose_uncertainty(&self) -> bool {
        true
    }

    fn summary(&self) -> &'static str {
        "cameras by radial alignment with one term of distortion, then triangulation (1987)"
    }

    fn preset(&self, name: &str) -> Result<AnyMethod> {
        only_default(self, name)
    }
}
