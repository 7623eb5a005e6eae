//! Cameras and charts adjusted together.
//!
//! Source: bundle adjustment, Triggs, McLauchlan, Hartley & Fitzgibbon 2000
//! (doi:10.1007/3-540-44480-7_21): every view's six unknowns are eliminated first (Schur's
//! complement), so that what is solved has the cameras' unknowns only. Robust cost: Cauchy's, Holland &
//! Welsch 1977 (doi:10.1080/03610927708827533).

use super::{
    elimination::Step,
    state::{Shot, State},
    sums::{TotalSums, ViewSums},
};
use crate::{
    Error, Result,
    camera::{
        batch_projection::BatchProjection,
        normal_equations::{PosedObservations, Sums},
        posed_lens::POSE,
    },
    geometry::{Pixel, Point3, Pose, Vector3},
};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::marker::PhantomData;
use wheatstone_numeric::{
    levenberg_marquardt::{Damping, Found, Patience, Problem, search},
    loss::Loss,
    progress::Progress,
};

/// Damping where nothing is known of how far the start is off.
pub(super) fn first_damping() -> Damping {
    Damping::nielsen(1e-3, 1.0 / 3.0)
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
    pub(super) damping: Damping,
}

/// How an adjustment ended.
#[derive(Clone, Debug)]
pub(super) struct Adjusted<L> {
    pub(super) state: State<L>,
    /// What points say at that state, and how strongly the last step was damped.
    pub(super) sums: TotalSums,
    pub(super) damping: Damping,
}

impl<'a> Bundle<'a> {
    fn unknowns(&self) -> usize {
        self.free.iter().map(Vec::len).sum()
    }

    fn first(&self, camera: usize) -> usize {
        self.free[..camera].iter().map(Vec::len).sum()
    }

    /// What was seen, of each view in each camera, as sums are taken of it.
    fn seen(&self) -> Vec<Vec<PosedObservations>> {
        let of = |seen: &Vec<(Point3, Pixel)>| PosedObservations::new(seen.iter().copied());
        self.shots.iter().map(|shot| shot.iter().map(of).collect()).collect()
    }

    /// The normal equations at a state.
    pub(super) fn equations<L: BatchProjection>(&self, state: &State<L>) -> TotalSums {
        self.sums(state, &self.seen())
    }

    /// Half the weighted sum of squares at a state.
    pub(super) fn cost<L: BatchProjection>(&self, state: &State<L>) -> f64 {
        self.equations(state).cost
    }

    fn sums<L: BatchProjection>(
        &self,
        state: &State<L>,
        seen: &[Vec<PosedObservations>],
    ) -> TotalSums {
        // Points that are worth another core: some tens of microseconds.
        const TOGETHER: usize = 1000;
        let points: usize = seen.iter().flatten().map(PosedObservations::len).sum();
        let views: Vec<ViewSums> = (0..seen.len())
            .into_par_iter()
            .with_min_len(1 + TOGETHER * seen.len() / points.max(1))
            .map_init(Sums::default, |sums, view| {
                let chart = (&state.charts[view], self.loose[view]);
                let seen = (seen[view].as_slice(), state.cameras.as_slice());
                ViewSums::of(seen, chart, (&self.free, self.loss), sums)
            })
            .collect();
        let count = self.unknowns();
        let mut whole = TotalSums {
            cost: 0.0,
            cameras: DMatrix::zeros(count, count),
            gradient: DVector::zeros(count),
            views: Vec::new(),
        };
        for view in &views {
            whole.cost += view.cost;
            let counts = self.free.iter().map(Vec::len);
            view.add_to(counts, &mut whole.cameras, &mut whole.gradient);
        }
        whole.cameras.fill_upper_triangle_with_lower_triangle();
        whole.views = views;
        whole
    }

    /// Adjusts until a step gains less than a share of the cost.
    pub(super) fn adjust<L: BatchProjection>(
        &self,
        start: State<L>,
        patience: Patience,
        progress: &dyn Progress,
    ) -> Result<Adjusted<L>> {
        let adjustment = Adjustment { bundle: self, seen: self.seen(), lens: PhantomData };
        let found = search(&adjustment, start, (patience, self.damping), progress)?;
        let Found { state, equations, damping, .. } = found.ok_or_else(lost)?;
        Ok(Adjusted { state, sums: equations, damping })
    }
}

/// A bundle of cameras with this kind of lens, as a least-squares problem.
struct Adjustment<'a, L> {
    bundle: &'a Bundle<'a>,
    seen: Vec<Vec<PosedObservations>>,
    lens: PhantomData<L>,
}

impl<L: BatchProjection> Problem for Adjustment<'_, L> {
    type State = State<L>;
    type Equations = TotalSums;
    type Step = Step;

    fn linearise(&self, state: &State<L>) -> Option<TotalSums> {
        Some(self.bundle.sums(state, &self.seen)).filter(|sums| sums.cost.is_finite())
    }

    fn step(&self, sums: &TotalSums, damping: f64) -> Option<(Step, f64)> {
        let step = sums.step(self.bundle.loose, damping)?;
        let promised = step.expected(sums, damping);
        Some((step, promised))
    }

    fn cost(&self, sums: &TotalSums) -> f64 {
        sums.cost
    }

    fn moved(&self, state: &State<L>, step: &Step) -> State<L> {
        let mut moved = state.clone();
        for (index, camera) in moved.cameras.iter_mut().enumerate() {
            let first = self.bundle.first(index);
            let (mut turn, mut by) = (Vector3::zeros(), Vector3::zeros());
            let mut numbers = camera.lens.parameters_mut();
            for (offset, unknown) in self.bundle.free[index].iter().enumerate() {
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
}

pub(super) fn lost() -> Error {
    Error::Degenerate {
        problem: "the bundle adjustment of cameras and chart poses failed".into(),
        hint: "check that the points of every view have board coordinates, all in one unit".into(),
    }
}
