//! Whether the pixels tell focal lengths at all. From charts that are parallel to each other they do
//! not: a longer lens and a board farther away look the same. The search ends somewhere all the same,
//! with confident figures; so what is asked is how much worse other focal lengths would do.

use super::{
    adjustment::{Bundle, first_damping},
    gather::Gathered,
    rig::{Terms, unknowns},
    state::{Choice, Shot, thinned},
};
use crate::{Error, Result, geometry::Vector3};
use nalgebra::Matrix3;
use wheatstone_numeric::{levenberg_marquardt::Patience, loss::Loss, progress::Progress};

/// Focal lengths that must be told apart from the one found, as shares of it.
const OTHERS: [f64; 2] = [0.8, 1.25];

/// Known points that lie flatter than this (thickness over extent) are one plane.
const FLAT: f64 = 1e-2;

/// Five standard deviations.
const CLEARLY: f64 = 25.0;

/// So far above it that the last steps of a search cannot bring a chi-square down there.
const FAR: f64 = 400.0 * CLEARLY;

/// Points of what each camera saw of a view that are asked first.
const ASKED: usize = 16;

/// Charts whose normals spread by less than this many degrees about their mean are held for parallel:
/// what little such tilts tell, a bent board or a lens's terms could feign.
const PARALLEL: f64 = 2.0;

/// Root mean square angle of the charts' normals from their mean, and its standard deviation, in
/// degrees.
fn tilt<L>(gathered: &Gathered, choice: &Choice<L>) -> (f64, f64) {
    let charts = choice.state.charts.iter().zip(&choice.loose).enumerate();
    let loose: Vec<_> = charts.filter(|(_, (_, loose))| **loose).collect();
    let normals: Vec<Vector3> = loose
        .iter()
        .map(|(_, (chart, _))| chart.rotation.column(2).into_owned())
        .chain(gathered.known_normals())
        .collect();
    let Some(first) = normals.first() else { return (0.0, 0.0) };
    // Which way a known plane's normal points is chance.
    let towards = |normal: &Vector3| normal * normal.dot(first).signum();
    let mean = normals.iter().map(towards).sum::<Vector3>().normalize();
    let square = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let spread: Vec<f64> =
        normals.iter().map(|normal| normal.cross(&mean).norm_squared()).collect();
    let sigma: Vec<f64> = loose
        .iter()
        .filter_map(|(view, _)| {
            let turns = choice.charts.as_ref()?[*view];
            let across = Matrix3::identity() - mean * mean.transpose();
            let own: Matrix3<f64> = turns.fixed_view::<3, 3>(0, 0).into_owned();
            Some((across * own * across).trace())
        })
        .collect();
    (square(&spread).sqrt().to_degrees(), square(&sigma).sqrt().to_degrees())
}

/// Refuses a state whose focal lengths could as well be others; `known_flatness` is how flat the points of
/// known place lie, as [`crate::dataset::Dataset::flatness`] tells it.
pub(super) fn check<L: Terms>(
    gathered: &Gathered,
    (choice, known_flatness): (&Choice<L>, f64),
    progress: &dyn Progress,
) -> Result<()> {
    // Known places tell the focal length by themselves, unless all lie on one plane.
    if gathered.has_known() && known_flatness > FLAT {
        return Ok(());
    }
    let (spread, sigma) = tilt(gathered, choice);
    if spread < PARALLEL.max(3.0 * sigma) {
        return Err(parallel(format!(
            "the chart normals differ by only {spread:.2} degrees, with a standard deviation of {sigma:.2}"
        )));
    }
    let variance = variance(choice);
    // Few points that tell focal lengths apart are enough; only where they do not are all asked.
    let few = thinned(&choice.clean, ASKED);
    for share in OTHERS {
        let worse = |shots: &[Shot]| worse(gathered, choice, (shots, share), progress);
        if worse(&few)? / variance >= CLEARLY {
            continue;
        }
        let all = worse(&choice.clean)? / variance;
        if all < CLEARLY {
            return Err(parallel(format!(
                "focal lengths {share} times as long fit almost as well (chi-square larger by {all:.1})"
            )));
        }
    }
    Ok(())
}

/// Of one pixel coordinate; nothing is measured better than to a millionth.
fn variance<L>(choice: &Choice<L>) -> f64 {
    (choice.sigma * choice.sigma).max(1e-12)
}

/// By how much the least sum of squares grows for a share of the focal lengths that were found.
fn worse<L: Terms>(
    gathered: &Gathered,
    choice: &Choice<L>,
    (shots, share): (&[Shot], f64),
    progress: &dyn Progress,
) -> Result<f64> {
    let held: Vec<usize> = choice.terms.iter().copied().filter(|term| *term >= 2).collect();
    let free = (0..gathered.cameras)
        .map(|camera| unknowns(&held, camera > 0 || gathered.has_known()))
        .collect();
    let bundle =
        Bundle { shots, loose: &choice.loose, free, loss: Loss::Squares, damping: first_damping() };
    let mut state = choice.state.clone();
    for camera in &mut state.cameras {
        for value in camera.lens.parameters_mut().into_iter().take(2) {
            *value *= share;
        }
    }
    // Distances go along with focal lengths.
    let first = choice.state.cameras[0].camera_from_world;
    for (chart, _) in state.charts.iter_mut().zip(&choice.loose).filter(|(_, loose)| **loose) {
        chart.translation += first.inverse().rotation
            * Vector3::z()
            * ((share - 1.0) * first.transform(chart.translation.into()).z);
    }
    let least = bundle.cost(&choice.state);
    let rough = bundle.adjust(state, Patience { steps: 60, least_gain: 1e-2 }, progress)?;
    let excess = 2.0 * (rough.sums.cost - least);
    if excess > FAR * variance(choice) {
        return Ok(excess);
    }
    let other = bundle.adjust(rough.state, Patience { steps: 60, least_gain: 1e-5 }, progress)?;
    Ok(2.0 * (other.sums.cost - least))
}

fn parallel(evidence: String) -> Error {
    Error::Degenerate {
        problem: format!(
            "the chart poses of all views are nearly parallel: {evidence}; such views cannot separate focal length from distance"
        ),
        hint: "tilt the board by at least twenty degrees, differently in each view; or give its poses (`translation` of [[views]], or X,Y,Z)".into(),
    }
}
