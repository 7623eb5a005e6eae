//! A camera whose picture creeps from view to view: a mount that gives way, or one that is warming up.

use super::{
    Fault,
    camera_moved::{of_all, used},
    evidence::Evidence,
    finding::{Freedom, Proposal, Severity},
    pairs::Pair,
    robust_camera::RobustCamera,
    sums::{Sums, Total},
    unsynchronised,
};
use nalgebra::{Matrix2, Vector2};

pub(super) struct CameraDrifted;

/// Of fewer views a single one decides.
const LEAST_VIEWS: usize = 5;

/// To how many times the error with it an error without the drift comes, at least.
const CLEARLY: f64 = 1.5;

/// The share of a drift's squares that the camera cannot take up, at least. Of a drift in step with the depth of the charts
/// it takes up nearly all, and such a drift takes up what water and glass do: 0.02 to 0.2 of those that tanks with
/// windows show, above 0.5 of planes in random order, or with the first one shown again at the end.
const LEAST_SHARE: f64 = 0.35;

/// Drifts of more than so many times what is left are fatal.
const GREAT: f64 = 10.0;

impl Fault for CameraDrifted {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        // The pose of a chart in the hand takes up a part of any shift of its pictures.
        if !evidence.are_pictures || evidence.data.has_estimated_poses() {
            return Vec::new();
        }
        (0..evidence.data.cameras).filter_map(|camera| drift(evidence, camera)).collect()
    }
}

fn drift(evidence: &Evidence, camera: usize) -> Option<Proposal> {
    let seen = evidence.seen[camera].as_ref()?;
    let views: Vec<usize> =
        (0..evidence.views.len()).filter(|view| evidence.at(*view, camera).is_some()).collect();
    if views.len() < LEAST_VIEWS {
        return None;
    }
    let pairs = used(evidence, camera, &views);
    let (fitted, before) = of_all(&seen.camera, &pairs);
    let before = before.min(evidence.mean_error(camera));
    if before < CLEARLY * evidence.noise[camera] {
        return None;
    }
    let found = Drift::fit(fitted, pairs)?;
    // Shifts of a single view, or of all from one on, leave more than noise behind a steady one.
    let is_clear = before > CLEARLY * found.left
        && found.share > LEAST_SHARE
        && evidence.is_convincing(camera, [before, found.left], 0.0);
    is_clear.then(|| proposal((camera, &views), found.by, [before, found.left]))
}

/// A shift of a camera's pictures that grows evenly from view to view.
struct Drift {
    /// From the first view to the last.
    by: Vector2<f64>,
    /// Mean over the views of the median error without it.
    left: f64,
    /// The share of its squares that the camera cannot take up.
    share: f64,
}

impl Drift {
    fn fit(mut camera: RobustCamera, mut views: Vec<Vec<Pair>>) -> Option<Self> {
        // To first order each time; a drift along the depth of the charts, which a fit takes up in part, needs a few.
        const ROUNDS: usize = 4;
        let last = (views.len() - 1) as f64;
        let times: Vec<f64> = (0..views.len()).map(|view| view as f64 / last - 0.5).collect();
        let mut drift = Self { by: Vector2::zeros(), left: f64::INFINITY, share: 0.0 };
        for _ in 0..ROUNDS {
            let (by, left_over) = step(&Sums::of(&camera, &views), &times)?;
            for (pairs, time) in views.iter_mut().zip(&times) {
                pairs.iter_mut().for_each(|(_, pixel)| *pixel -= by * *time);
            }
            (camera, drift.left) = of_all(&camera, &views);
            drift.by += by;
            drift.share = (left_over * drift.by).dot(&drift.by) / drift.by.norm_squared();
        }
        Some(drift)
    }
}

/// The shift, times a number of each view, that explains most to first order, and the squares that the camera cannot take
/// up, for one of a pixel.
fn step(sums: &Sums, times: &[f64]) -> Option<(Vector2<f64>, Matrix2<f64>)> {
    let mut total = Total::default();
    times.iter().enumerate().for_each(|view| total.add(sums, (view.0, *view.1)));
    let (matrix, right) = total.reduced(sums);
    Some((matrix.try_inverse()? * right, matrix / total.weight))
}

fn proposal(
    (camera, views): (usize, &[usize]),
    by: Vector2<f64>,
    [before, left]: [f64; 2],
) -> Proposal {
    let mut figures = unsynchronised::overall_figures(before, left);
    figures.extend([("drift of x, px".into(), by.x), ("drift of y, px".into(), by.y)]);
    Proposal {
        freedom: Freedom::Scale,
        // Two numbers for all views come before two for each.
        left: 0.0,
        cells: views.iter().map(|view| (*view, camera)).collect(),
        also: views.iter().map(|view| (*view, camera)).collect(),
        key: "drift".into(),
        figures,
        stays_in_fit: true,
        ..Proposal::itself(
            "camera-drifted",
            if by.norm() > GREAT * left { Severity::Fatal } else { Severity::Warning },
            format!(
                "the camera drifts: from the first view to the last its picture creeps by {:.2} px",
                by.norm()
            ),
            "let the cameras warm up, fix their mounts, and record again",
        )
    }
}
