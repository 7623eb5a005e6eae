//! Both poses in which a chart may stand that its cameras see nearly alike: each is tried.

use super::{
    adjustment::{Bundle, first_damping},
    state::{Shot, State},
};
use crate::{
    Result,
    camera::batch_projection::BatchProjection,
    geometry::{Point3, Pose, other_tilt},
};
use wheatstone_numeric::{levenberg_marquardt::Patience, loss::Loss, progress::Progress};

/// Steps of a chart alone.
const PATIENCE: Patience = Patience { steps: 25, least_gain: 1e-4 };

/// Poses that differ by less than this, in radians, are one: half a degree.
const ALIKE: f64 = 0.01;

/// By how much the sum of squared errors, over their variance, must be larger for a pose to be ruled out: three
/// standard deviations.
const RULED_OUT: f64 = 9.0;

/// The charts adjusted by themselves: from where they stand, and from their other poses.
struct Both<L> {
    states: [State<L>; 2],
    /// The cost of each view in either.
    costs: [Vec<f64>; 2],
}

/// The points of a view's chart, in its own frame, about their middle, and the camera that sees most of them.
fn middle(shot: &Shot) -> Option<(Point3, usize)> {
    let (camera, seen) = shot.iter().enumerate().max_by_key(|(_, seen)| seen.len())?;
    let sum: nalgebra::Vector3<f64> = seen.iter().map(|(place, _)| place.coords).sum();
    (!seen.is_empty()).then(|| (Point3::from(sum / seen.len() as f64), camera))
}

fn other_pose<L>(state: &State<L>, view: usize, shot: &Shot) -> Option<Pose> {
    let (middle, camera) = middle(shot)?;
    let chart = &state.charts[view];
    let aim = chart.transform(middle);
    let centre = state.cameras[camera].camera_from_world.inverse().translation;
    let turn = other_tilt(aim.coords - centre, chart.rotation.column(2).into());
    let rotation = turn * chart.rotation;
    Some(Pose { rotation, translation: aim.coords - rotation * middle.coords })
}

impl<L: BatchProjection> Both<L> {
    fn tried(
        state: &State<L>,
        (shots, loose): (&[Shot], &[bool]),
        loss: Loss,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let mut other = state.clone();
        for (view, chart) in other.charts.iter_mut().enumerate().filter(|(view, _)| loose[*view]) {
            *chart = other_pose(state, view, &shots[view]).unwrap_or(*chart);
        }
        let free = vec![Vec::new(); state.cameras.len()];
        let bundle = Bundle { shots, loose, free, loss, damping: first_damping() };
        let adjusted = |start: State<L>| bundle.adjust(start, PATIENCE, progress);
        let both = [adjusted(state.clone())?, adjusted(other)?];
        let costs = both
            .each_ref()
            .map(|found| found.sums.views.iter().map(|view| view.cost).collect::<Vec<f64>>());
        Ok(Self { states: both.map(|found| found.state), costs })
    }
}

/// Each chart in that of its two poses that explains its pixels better.
pub(super) fn better<L: BatchProjection>(
    mut state: State<L>,
    seen: (&[Shot], &[bool]),
    loss: Loss,
    progress: &dyn Progress,
) -> Result<State<L>> {
    // Where a chart has no other pose that can be adjusted to, all stay.
    let Ok(Both { states: [_, other], costs: [own, others] }) =
        Both::tried(&state, seen, loss, progress)
    else {
        progress.check()?;
        return Ok(state);
    };
    for (view, chart) in state.charts.iter_mut().enumerate() {
        if others[view] < own[view] {
            *chart = other.charts[view];
        }
    }
    Ok(state)
}

/// Views whose pixels, with errors of this standard deviation, do not tell the two poses apart.
pub(super) fn undecided<L: BatchProjection>(
    state: &State<L>,
    seen: (&[Shot], &[bool]),
    sigma: f64,
    progress: &dyn Progress,
) -> Vec<usize> {
    let Ok(Both { states: [here, there], costs: [own, others] }) =
        Both::tried(state, seen, Loss::Squares, progress)
    else {
        return Vec::new();
    };
    let is_undecided = |view: &usize| {
        let (a, b) = (&here.charts[*view], &there.charts[*view]);
        let rotation = a.rotation.transpose() * b.rotation;
        let apart = Pose { rotation, ..Pose::default() }.rotation_vector().norm();
        seen.1[*view]
            && apart > ALIKE
            && 2.0 * (others[*view] - own[*view]) < RULED_OUT * sigma * sigma
    };
    (0..here.charts.len()).filter(is_undecided).collect()
}
