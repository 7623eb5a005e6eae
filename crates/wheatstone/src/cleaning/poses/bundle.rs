//! Cameras and charts adjusted together.
//!
//! Source: bundle adjustment, Triggs, McLauchlan, Hartley & Fitzgibbon 2000
//! (doi:10.1007/3-540-44480-7_21): every view's six unknowns are eliminated first (Schur's
//! complement), so that what is solved has the cameras' unknowns only. Damping as Nielsen's (Madsen,
//! Nielsen & Tingleff 2004, section 3.2); robust cost Cauchy's, Holland & Welsch 1977
//! (doi:10.1080/03610927708827533).

use super::loss::Loss;
use crate::{
    Error, Result,
    camera::AdjustableCamera,
    geometry::{Pixel, Point3, Pose, Vector3},
    progress::Progress,
};
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use rayon::prelude::*;

/// Unknowns of a place and attitude.
pub(super) const POSE: usize = 6;

/// What every camera saw of one view: the chart's points in its own frame, with pixels, a camera.
pub(super) type Shot = Vec<Vec<(Point3, Pixel)>>;

/// A camera at its place.
#[derive(Clone, Debug)]
pub(super) struct Posed<L> {
    pub(super) lens: L,
    pub(super) camera_from_world: Pose,
}

/// All that is adjusted.
#[derive(Clone, Debug)]
pub(super) struct State<L> {
    pub(super) cameras: Vec<Posed<L>>,
    /// World from chart, a view.
    pub(super) charts: Vec<Pose>,
}

/// An adjustment: what was seen, and what of it may change.
pub(super) struct Bundle<'a> {
    pub(super) shots: &'a [Shot],
    /// Whether each view's chart may move.
    pub(super) loose: &'a [bool],
    /// Which of each camera's unknowns may change: 0 to 5 its pose, then its lens's own numbers.
    pub(super) free: Vec<Vec<usize>>,
    pub(super) loss: Loss,
}

/// Sums of one view.
struct ViewSums {
    cost: f64,
    /// By cameras' unknowns: one block a camera.
    own: Vec<(DMatrix<f64>, DVector<f64>)>,
    /// Cameras' unknowns by the chart's.
    mixed: DMatrix<f64>,
    chart: Matrix6<f64>,
    chart_gradient: Vector6<f64>,
}

impl ViewSums {
    /// Adds an error of a camera (and the first of its unknowns), whose derivatives by the camera's
    /// unknowns are `row`, and by the chart's, where that may move, `chart`.
    fn add(
        &mut self,
        (camera, first): (usize, usize),
        row: &[f64],
        chart: Option<Vector6<f64>>,
        (weight, error): (f64, f64),
    ) {
        let (own, gradient) = &mut self.own[camera];
        for (a, value) in row.iter().enumerate() {
            let weighted = weight * value;
            gradient[a] += weighted * error;
            for (b, other) in row.iter().enumerate().skip(a) {
                own[(b, a)] += weighted * other;
            }
        }
        let Some(chart) = chart else { return };
        for (a, value) in row.iter().enumerate() {
            for k in 0..POSE {
                self.mixed[(first + a, k)] += weight * value * chart[k];
            }
        }
        self.chart.ger(weight, &chart, &chart, 1.0);
        self.chart_gradient += chart * (weight * error);
    }
}

/// What a point that no camera can see costs, in pixels: as much as a gross error.
const UNSEEN: f64 = 1e3;

/// How an adjustment ended.
#[derive(Clone, Debug)]
pub(super) struct Adjusted<L> {
    pub(super) state: State<L>,
    pub(super) cost: f64,
}

/// Sums of all views at one state.
struct Whole {
    cost: f64,
    cameras: DMatrix<f64>,
    gradient: DVector<f64>,
    views: Vec<ViewSums>,
}

impl<'a> Bundle<'a> {
    fn unknowns(&self) -> usize {
        self.free.iter().map(Vec::len).sum()
    }

    fn first(&self, camera: usize) -> usize {
        self.free[..camera].iter().map(Vec::len).sum()
    }

    fn cost<L: AdjustableCamera + Sync>(&self, state: &State<L>) -> f64 {
        let views: Vec<f64> = (0..self.shots.len())
            .into_par_iter()
            .map(|view| {
                let mut cost = 0.0;
                for (camera, seen) in state.cameras.iter().zip(&self.shots[view]) {
                    let pose = camera.camera_from_world.after(&state.charts[view]);
                    let mut slopes = vec![[0.0; 2]; camera.lens.clone().parameters_mut().len()];
                    for (place, pixel) in seen {
                        let point = pose.transform(*place);
                        let square = match camera.lens.project_with_slopes(point, &mut slopes) {
                            Some((at, _)) => (at - pixel).norm_squared(),
                            None => UNSEEN * UNSEEN,
                        };
                        cost += self.loss.of(square).0;
                    }
                }
                cost
            })
            .collect();
        views.iter().sum()
    }

    fn view_sums<L: AdjustableCamera>(&self, state: &State<L>, view: usize) -> ViewSums {
        let mut sums = ViewSums {
            cost: 0.0,
            own: self
                .free
                .iter()
                .map(|f| (DMatrix::zeros(f.len(), f.len()), DVector::zeros(f.len())))
                .collect(),
            mixed: DMatrix::zeros(self.unknowns(), POSE),
            chart: Matrix6::zeros(),
            chart_gradient: Vector6::zeros(),
        };
        let world_from_chart = &state.charts[view];
        for (index, (camera, seen)) in state.cameras.iter().zip(&self.shots[view]).enumerate() {
            let free = &self.free[index];
            let first = self.first(index);
            let mut slopes = vec![[0.0; 2]; camera.lens.clone().parameters_mut().len()];
            let mut row = vec![0.0; free.len()];
            let turn = camera.camera_from_world.rotation;
            for (place, pixel) in seen {
                let turned = world_from_chart.rotation * place.coords;
                let world = turned + world_from_chart.translation;
                let in_camera = turn * world;
                let point = Point3::from(in_camera + camera.camera_from_world.translation);
                let Some((at, by_point)) = camera.lens.project_with_slopes(point, &mut slopes)
                else {
                    sums.cost += self.loss.of(UNSEEN * UNSEEN).0;
                    continue;
                };
                let error = at - pixel;
                let (cost, weight) = self.loss.of(error.norm_squared());
                sums.cost += cost;
                let by_own_turn = -(by_point * in_camera.cross_matrix());
                let by_place = by_point * turn;
                let by_chart_turn = -(by_place * turned.cross_matrix());
                for axis in 0..2 {
                    for (value, unknown) in row.iter_mut().zip(free) {
                        *value = match unknown {
                            0..3 => by_own_turn[(axis, *unknown)],
                            3..POSE => by_point[(axis, unknown - 3)],
                            _ => slopes[unknown - POSE][axis],
                        };
                    }
                    let [turn, place] = [by_chart_turn.row(axis), by_place.row(axis)];
                    let chart = Vector6::from_iterator(turn.iter().chain(place.iter()).copied());
                    let chart = self.loose[view].then_some(chart);
                    sums.add((index, first), &row, chart, (weight, error[axis]));
                }
            }
        }
        sums
    }

    fn sums<L: AdjustableCamera + Sync>(&self, state: &State<L>) -> Whole {
        let views: Vec<ViewSums> =
            (0..self.shots.len()).into_par_iter().map(|view| self.view_sums(state, view)).collect();
        let count = self.unknowns();
        let mut whole = Whole {
            cost: 0.0,
            cameras: DMatrix::zeros(count, count),
            gradient: DVector::zeros(count),
            views: Vec::new(),
        };
        for view in &views {
            whole.cost += view.cost;
            for (camera, (own, gradient)) in view.own.iter().enumerate() {
                let (first, size) = (self.first(camera), gradient.len());
                let mut block = whole.cameras.view_mut((first, first), (size, size));
                block += own;
                let mut rows = whole.gradient.rows_mut(first, size);
                rows += gradient;
            }
        }
        whole.cameras.fill_upper_triangle_with_lower_triangle();
        whole.views = views;
        whole
    }

    /// Adjusts until a step gains less than a share of the cost.
    pub(super) fn adjust<L: AdjustableCamera + Send + Sync>(
        &self,
        start: State<L>,
        (steps, least_gain): (usize, f64),
        progress: &dyn Progress,
    ) -> Result<Adjusted<L>> {
        let mut state = start;
        let mut whole = self.sums(&state);
        let (mut damping, mut raise) = (1e-3, 2.0);
        for _ in 0..steps {
            progress.check()?;
            let Some(step) = whole.step(self, damping) else {
                damping *= raise;
                raise *= 2.0;
                if damping > 1e12 {
                    break;
                }
                continue;
            };
            let tried = self.moved(&state, &step);
            let cost = self.cost(&tried);
            if cost.is_finite() && cost < whole.cost {
                let gain = whole.cost - cost;
                let expected = step.expected(&whole, damping);
                let quality = if expected > 0.0 { (gain / expected).min(1.0) } else { 0.5 };
                damping *= (1.0 - (2.0 * quality - 1.0).powi(3)).max(1.0 / 3.0);
                raise = 2.0;
                let done = gain < least_gain * whole.cost;
                state = tried;
                whole = self.sums(&state);
                if done {
                    break;
                }
            } else {
                damping *= raise;
                raise *= 2.0;
                if damping > 1e12 {
                    break;
                }
            }
        }
        if !whole.cost.is_finite() {
            return Err(lost());
        }
        Ok(Adjusted { state, cost: whole.cost })
    }

    fn moved<L: AdjustableCamera>(&self, state: &State<L>, step: &Step) -> State<L> {
        let mut moved = state.clone();
        for (index, camera) in moved.cameras.iter_mut().enumerate() {
            let first = self.first(index);
            let (mut turn, mut by) = (Vector3::zeros(), Vector3::zeros());
            let mut numbers = camera.lens.parameters_mut();
            for (offset, unknown) in self.free[index].iter().enumerate() {
                let value = step.cameras[first + offset];
                match unknown {
                    0..3 => turn[*unknown] = value,
                    3..POSE => by[unknown - 3] = value,
                    _ => *numbers[unknown - POSE] += value,
                }
            }
            let pose = &mut camera.camera_from_world;
            // The turn is about the world's origin in the camera's axes: the translation stays.
            pose.rotation =
                Pose::from_rotation_vector(Vector3::zeros(), turn).rotation * pose.rotation;
            pose.translation += by;
        }
        for (chart, step) in moved.charts.iter_mut().zip(&step.charts) {
            let turn = Vector3::new(step[0], step[1], step[2]);
            chart.rotation =
                Pose::from_rotation_vector(Vector3::zeros(), turn).rotation * chart.rotation;
            chart.translation += Vector3::new(step[3], step[4], step[5]);
        }
        moved
    }

    /// Covariance of every chart's turn (radians) and place for pixel errors of this standard
    /// deviation; `None` where something is not determined.
    pub(super) fn chart_covariances<L: AdjustableCamera + Sync>(
        &self,
        state: &State<L>,
        sigma: f64,
    ) -> Option<Vec<Matrix6<f64>>> {
        let whole = self.sums(state);
        let (inverse, reduced, _) = whole.reduced(self, 0.0)?;
        let open = reduced.cholesky()?.inverse();
        let each =
            whole.views.iter().zip(&inverse).zip(self.loose).map(|((view, inverse), loose)| {
                if !loose {
                    return Matrix6::zeros();
                }
                let carried = inverse * view.mixed.transpose();
                let through: Matrix6<f64> =
                    (&carried * &open * carried.transpose()).fixed_view::<6, 6>(0, 0).into_owned();
                (inverse + through) * (sigma * sigma)
            });
        Some(each.collect())
    }
}

/// A step of everything.
struct Step {
    cameras: DVector<f64>,
    charts: Vec<Vector6<f64>>,
}

impl Step {
    /// How much the damped model expects of it.
    fn expected(&self, whole: &Whole, damping: f64) -> f64 {
        let mut gain = 0.0;
        let mut add = |value: f64, gradient: f64, diagonal: f64| {
            gain += 0.5 * value * (damping * diagonal * value - gradient);
        };
        for (index, value) in self.cameras.iter().enumerate() {
            add(*value, whole.gradient[index], whole.cameras[(index, index)]);
        }
        for (view, step) in whole.views.iter().zip(&self.charts) {
            for k in 0..POSE {
                add(step[k], view.chart_gradient[k], view.chart[(k, k)]);
            }
        }
        gain
    }
}

impl Whole {
    /// The charts' inverses, the cameras' matrix and right side with the charts eliminated.
    #[allow(clippy::type_complexity, reason = "three parts of one elimination, used once each")]
    fn reduced(
        &self,
        bundle: &Bundle,
        damping: f64,
    ) -> Option<(Vec<Matrix6<f64>>, DMatrix<f64>, DVector<f64>)> {
        let mut matrix = self.cameras.clone();
        for index in 0..matrix.nrows() {
            let diagonal = matrix[(index, index)];
            matrix[(index, index)] += damping * if diagonal > 0.0 { diagonal } else { 1.0 };
        }
        let mut right = -&self.gradient;
        let mut inverses = Vec::with_capacity(self.views.len());
        for (view, loose) in self.views.iter().zip(bundle.loose) {
            if !loose {
                inverses.push(Matrix6::zeros());
                continue;
            }
            let mut chart = view.chart;
            for k in 0..POSE {
                chart[(k, k)] *= 1.0 + damping;
            }
            let inverse = chart.cholesky()?.inverse();
            let carried = &view.mixed * inverse;
            matrix -= &carried * view.mixed.transpose();
            right += &carried * view.chart_gradient;
            inverses.push(inverse);
        }
        Some((inverses, matrix, right))
    }

    fn step(&self, bundle: &Bundle, damping: f64) -> Option<Step> {
        let (inverses, matrix, right) = self.reduced(bundle, damping)?;
        let cameras = if right.is_empty() { right } else { matrix.cholesky()?.solve(&right) };
        let charts = self.views.iter().zip(&inverses).map(|(view, inverse)| {
            -(inverse * (view.chart_gradient + view.mixed.transpose() * &cameras))
        });
        let charts: Vec<Vector6<f64>> = charts.collect();
        cameras.iter().all(|value| value.is_finite()).then_some(Step { cameras, charts })
    }
}

pub(super) fn lost() -> Error {
    Error::Degenerate {
        problem: "cameras and chart placements could not be adjusted together".into(),
        hint: "check that every view's points carry the board's own coordinates, in one unit"
            .into(),
    }
}
