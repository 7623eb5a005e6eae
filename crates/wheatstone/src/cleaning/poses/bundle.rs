//! Cameras and charts adjusted together.
//!
//! Source: bundle adjustment, Triggs, McLauchlan, Hartley & Fitzgibbon 2000
//! (doi:10.1007/3-540-44480-7_21): every view's six unknowns are eliminated first (Schur's
//! complement), so that what is solved has the cameras' unknowns only. Damping as Nielsen's (Madsen,
//! Nielsen & Tingleff 2004, section 3.2); robust cost Cauchy's, Holland & Welsch 1977
//! (doi:10.1080/03610927708827533).

use super::{
    loss::Loss,
    sums::{CellSums, ViewSums},
};
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

/// At most so many points of what each camera saw of a view, spread evenly over the list.
pub(super) fn thinned(shots: &[Shot], most: usize) -> Vec<Shot> {
    let few = |seen: &Vec<(Point3, Pixel)>| -> Vec<(Point3, Pixel)> {
        if seen.len() <= most {
            return seen.clone();
        }
        (0..most).map(|index| seen[index * seen.len() / most]).collect()
    };
    shots.iter().map(|shot| shot.iter().map(few).collect()).collect()
}

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
    /// Of the first step.
    pub(super) damping: f64,
}

/// How an adjustment ended.
#[derive(Clone, Debug)]
pub(super) struct Adjusted<L> {
    pub(super) state: State<L>,
    /// What points say at that state, and how strongly the last step was damped.
    pub(super) sums: Whole,
    pub(super) damping: f64,
}

/// Sums of all views at one state.
#[derive(Clone, Debug)]
pub(super) struct Whole {
    /// Half the weighted sum of squares.
    pub(super) cost: f64,
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

    /// Half the weighted sum of squares at a state.
    pub(super) fn cost<L: AdjustableCamera + Sync>(&self, state: &State<L>) -> f64 {
        self.sums(state).cost
    }

    fn sums<L: AdjustableCamera + Sync>(&self, state: &State<L>) -> Whole {
        // A view takes some microseconds: fewer are not worth another core.
        const TOGETHER: usize = 4;
        let first: Vec<usize> = (0..self.free.len()).map(|camera| self.first(camera)).collect();
        let views: Vec<ViewSums> = (0..self.shots.len())
            .into_par_iter()
            .with_min_len(TOGETHER)
            .map_init(CellSums::default, |cell, view| {
                let chart = (&state.charts[view], self.loose[view]);
                let seen = (&self.shots[view], state.cameras.as_slice());
                ViewSums::of(seen, chart, (&self.free, self.loss), cell)
            })
            .collect();
        let count = self.unknowns();
        let mut whole = Whole {
            cost: 0.0,
            cameras: DMatrix::zeros(count, count),
            gradient: DVector::zeros(count),
            views: Vec::new(),
        };
        for view in &views {
            whole.cost += view.cost;
            for (own, first) in view.own.iter().zip(&first) {
                own.add_to(&mut whole.cameras, &mut whole.gradient, *first);
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
        let (mut damping, mut raise) = (self.damping, 2.0);
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
            // Most steps are good ones: what the next one needs is worked out with the cost.
            let next = self.sums(&tried);
            if next.cost.is_finite() && next.cost < whole.cost {
                let gain = whole.cost - next.cost;
                let expected = step.expected(&whole, damping);
                let quality = if expected > 0.0 { (gain / expected).min(1.0) } else { 0.5 };
                damping *= (1.0 - (2.0 * quality - 1.0).powi(3)).max(1.0 / 3.0);
                raise = 2.0;
                let done = gain < least_gain * whole.cost;
                state = tried;
                whole = next;
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
        Ok(Adjusted { state, sums: whole, damping })
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
    pub(super) fn chart_covariances(&self, whole: &Whole, sigma: f64) -> Option<Vec<Matrix6<f64>>> {
        let (inverse, reduced, _) = whole.reduced(self, 0.0)?;
        let open = reduced.cholesky()?.inverse();
        let each =
            whole.views.iter().zip(&inverse).zip(self.loose).map(|((view, inverse), loose)| {
                if !loose {
                    return Matrix6::zeros();
                }
                let carried = inverse * view.mixed_matrix().transpose();
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
            view.eliminate(&inverse, &mut matrix, &mut right);
            inverses.push(inverse);
        }
        matrix.fill_upper_triangle_with_lower_triangle();
        Some((inverses, matrix, right))
    }

    fn step(&self, bundle: &Bundle, damping: f64) -> Option<Step> {
        let (inverses, matrix, right) = self.reduced(bundle, damping)?;
        let cameras = if right.is_empty() { right } else { matrix.cholesky()?.solve(&right) };
        let charts = self
            .views
            .iter()
            .zip(&inverses)
            .map(|(view, inverse)| -(inverse * (view.chart_gradient + view.carried(&cameras))));
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
