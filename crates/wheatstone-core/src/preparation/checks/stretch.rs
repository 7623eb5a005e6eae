//! A chart's size and pose, adjusted to its pixels in cameras that are known.

use super::{evidence::Evidence, other_pose::GivenChart, pairs::Pair, robust_camera::RobustCamera};
use crate::{
    dataset::chart_pose,
    geometry::{Pixel, Point3, Pose, Vector3},
};
use nalgebra::{SMatrix, SVector, Vector2};
use wheatstone_numeric::{
    levenberg_marquardt::{Damping, Patience, Problem, search},
    progress::Silent,
    statistics::median,
};

/// How a chart's places are to be changed: stretched in its plane about its middle, turned, moved.
#[derive(Clone, Debug)]
pub(super) struct Stretch {
    pub(super) given: GivenChart,
    pub(super) scale: [f64; 2],
    pub(super) turn: Vector3,
    pub(super) by: Vector3,
}

impl Stretch {
    /// Alike along both sides, and nothing else.
    pub(super) fn by_scale(given: GivenChart, scale: f64) -> Self {
        Self { given, scale: [scale; 2], turn: Vector3::zeros(), by: Vector3::zeros() }
    }

    pub(super) fn map(&self, place: Point3) -> Point3 {
        let GivenChart { middle, along, .. } = self.given;
        let own = place - middle;
        let [a, b] = along.map(|side| own.dot(&side));
        let height = own - along[0] * a - along[1] * b;
        let [by_a, by_b] = self.scale;
        // Points off the plane belong to the same body.
        let stretched =
            along[0] * (a * by_a) + along[1] * (b * by_b) + height * (by_a * by_b).abs().sqrt();
        let turn = Pose::from_rotation_vector(Vector3::zeros(), self.turn);
        middle + turn.rotation * stretched + self.by
    }

    /// Stages err by little; beyond a thirtieth of the scene's size, or two degrees, it is a slip.
    pub(super) fn is_slip(&self) -> bool {
        self.by.norm() >= 0.03 || self.turn.norm() >= 0.03
    }

    /// A tenth of a percent is as well as one view of a chart tells its size.
    pub(super) fn is_sized(&self) -> bool {
        self.scale.iter().any(|scale| (scale - 1.0).abs() > 3e-3)
    }

    fn stepped(&self, step: &SVector<f64, 8>) -> Self {
        let [right, down] = self.given.along;
        Self {
            scale: [self.scale[0] + step[0], self.scale[1] + step[1]],
            turn: self.turn + Vector3::new(step[2], step[3], step[4]),
            by: self.by + right * step[5] + down * step[6] + right.cross(&down) * step[7],
            ..self.clone()
        }
    }
}

/// The view's points with each camera.
pub(super) type Shots<'a> = Vec<(&'a RobustCamera, Pair)>;

/// Some points of a view in these cameras, with pixels as `read` (by camera and row) has them, and the chart as its
/// places are given. `None` where a camera saw too few.
pub(super) fn shots<'a>(
    evidence: &'a Evidence,
    (view, cameras): (usize, &[usize]),
    read: impl Fn(usize, usize) -> Option<Pixel>,
) -> Option<(Shots<'a>, GivenChart)> {
    /// More take time only.
    const USED: usize = 40;
    let mut shots: Shots = Vec::new();
    let mut all: Vec<Point3> = Vec::new();
    for camera in cameras {
        let (cell, _, other) = evidence.at(view, *camera)?;
        let step = cell.pairs.len().div_ceil(USED).max(1);
        for (row, (place, _)) in cell.rows.iter().zip(&cell.pairs).step_by(step) {
            shots.extend(read(*camera, *row).map(|pixel| (other, (*place, pixel))));
        }
        all.extend(cell.pairs.iter().map(|pair| pair.0));
    }
    let along = evidence.views[view].board.as_ref().map(|board| board.along);
    Some((shots, GivenChart::of(&all, along)))
}

/// The same with points and pixels as they are.
pub(super) fn shots_as_told<'a>(
    evidence: &'a Evidence,
    view_and_cameras: (usize, &[usize]),
) -> Option<(Shots<'a>, GivenChart)> {
    let pixel = |camera: usize, row: usize| evidence.data.correspondences[row].pixels[camera];
    shots(evidence, view_and_cameras, pixel)
}

/// The chart of a view where it stands in the other views: starts for a pose that was estimated from faulty pictures.
pub(super) fn in_other_views(
    evidence: &Evidence,
    view: usize,
    given: GivenChart,
) -> impl Iterator<Item = Stretch> {
    let frame = evidence.frame;
    let pose = |view: usize| {
        let rows = evidence.views[view].rows.iter();
        chart_pose(rows.map(|row| &evidence.data.correspondences[*row]))
    };
    let own = pose(view).map(|pose| pose.inverse());
    let others = (0..evidence.views.len()).filter(move |other| *other != view);
    others.filter_map(move |other| {
        let moved = pose(other)?.after(own.as_ref()?);
        let by = frame.scaled(moved.transform(frame.world(given.middle))) - given.middle;
        Some(Stretch { turn: moved.rotation_vector(), by, ..Stretch::by_scale(given, 1.0) })
    })
}

/// The share of an error that an explanation leaves at most where it may find the pose anew: the pose alone takes up a
/// part of what a fault of another view does to the cameras. Chosen by simulated faults.
pub(super) const MOST_LEFT: f64 = 0.2;

/// Numbers of a stretch: the scales, the turn, the move along the sides and across; and those that a hypothesis adjusts.
pub(super) const RIGID: &[usize] = &[2, 3, 4, 5, 6, 7];
pub(super) const SCALES: &[usize] = &[0, 1];
pub(super) const SHIFT: &[usize] = &[5, 6];
pub(super) const SCALES_AND_SHIFT: &[usize] = &[0, 1, 5, 6];
pub(super) const SIZED: &[usize] = &[0, 1, 5, 6, 7];
pub(super) const ANY: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 7];

/// Adjusts these numbers of a stretch to the pixels.
pub(super) fn adjusted(shots: &Shots, start: Stretch, free: &'static [usize]) -> Stretch {
    const PATIENCE: Patience = Patience { steps: 25, least_gain: 1e-5 };
    let how = (PATIENCE, Damping::marquardt(1e-3));
    let found = search(&Stretching { shots, free }, start.clone(), how, &Silent);
    found.ok().flatten().map_or(start, |found| found.state)
}

/// A stretch found from pixels, under Cauchy's weight.
struct Stretching<'a> {
    shots: &'a Shots<'a>,
    free: &'static [usize],
}

struct Equations {
    errors: Vec<Vector2<f64>>,
    scale: f64,
    matrix: SMatrix<f64, 8, 8>,
    gradient: SVector<f64, 8>,
}

impl Equations {
    /// What Cauchy's weight makes least, for errors of this scale.
    fn cost(&self, scale: f64) -> f64 {
        let of = |error: &Vector2<f64>| libm::log1p(error.norm_squared() / (scale * scale));
        0.5 * scale * scale * self.errors.iter().map(of).sum::<f64>()
    }
}

impl Stretching<'_> {
    fn errors(&self, stretch: &Stretch) -> Vec<Vector2<f64>> {
        let of = |(camera, (place, pixel)): &(&RobustCamera, Pair)| {
            camera.error(&(stretch.map(*place), *pixel))
        };
        self.shots.iter().map(of).collect()
    }
}

impl Problem for Stretching<'_> {
    type State = Stretch;
    type Equations = Equations;
    type Step = SVector<f64, 8>;

    /// Slopes are differences.
    fn linearise(&self, stretch: &Stretch) -> Option<Equations> {
        const STEP: f64 = 1e-5;
        let errors = self.errors(stretch);
        let lengths: Vec<f64> = errors.iter().map(|error| error.norm()).collect();
        let scale = (1.2 * median(&lengths)).max(1e-3);
        let ahead = |index: usize| {
            let mut step = SVector::<f64, 8>::zeros();
            step[index] = STEP;
            self.errors(&stretch.stepped(&step))
        };
        let moved: Vec<(usize, Vec<Vector2<f64>>)> =
            self.free.iter().map(|k| (*k, ahead(*k))).collect();
        let mut matrix = SMatrix::<f64, 8, 8>::zeros();
        let mut gradient = SVector::<f64, 8>::zeros();
        for (row, error) in errors.iter().enumerate() {
            let weight = 1.0 / (1.0 + error.norm_squared() / (scale * scale));
            for axis in 0..2 {
                let mut slopes = SVector::<f64, 8>::zeros();
                for (index, moved) in &moved {
                    slopes[*index] = (error[axis] - moved[row][axis]) / STEP;
                }
                matrix.ger(weight, &slopes, &slopes, 1.0);
                gradient += slopes * (weight * error[axis]);
            }
        }
        Some(Equations { errors, scale, matrix, gradient })
    }

    fn step(&self, equations: &Equations, damping: f64) -> Option<(SVector<f64, 8>, f64)> {
        let Equations { matrix, gradient, .. } = equations;
        let diagonal = matrix.diagonal();
        let held = diagonal.map(|value| if value > 0.0 { damping * value } else { 1.0 });
        let step = (matrix + SMatrix::from_diagonal(&held)).cholesky()?.solve(gradient);
        Some((step, 0.5 * (step.dot(gradient) + step.dot(&held.component_mul(&step)))))
    }

    fn moved(&self, stretch: &Stretch, step: &SVector<f64, 8>) -> Stretch {
        stretch.stepped(step)
    }

    fn cost(&self, equations: &Equations) -> f64 {
        equations.cost(equations.scale)
    }

    fn gain(&self, before: &Equations, after: &Equations) -> f64 {
        before.cost(before.scale) - after.cost(before.scale)
    }
}
