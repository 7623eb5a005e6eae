//! What one view says of cameras and its chart: normal equations of their common adjustment.
//!
//! A pixel depends on the chart's place in the camera and on the lens only. So sums are taken by those
//! six unknowns and the lens's, and brought to the unknowns of camera and chart once a view.

use crate::{
    camera::{
        batch_projection::BatchProjection,
        normal_equations::{PosedObservations, Sums, WIDTH},
        posed_lens::{POSE, PosedLens},
    },
    geometry::Pose,
};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6};
use wheatstone_numeric::loss::Loss;

/// What a point that no camera can see costs, in pixels: as much as a gross error.
const UNSEEN: f64 = 1e3;

/// Sums of one view.
#[derive(Clone, Debug)]
pub(super) struct ViewSums {
    pub(super) cost: f64,
    /// A camera's unknowns by each other, the lower triangle row by row, and its gradient; then the
    /// next camera's.
    own: Vec<f64>,
    /// A row each of the chart's unknowns: by the unknowns of all cameras one after the other, and last
    /// the gradient.
    pub(super) mixed: Vec<f64>,
    pub(super) chart: Matrix6<f64>,
}

impl ViewSums {
    /// Of a view and the cameras that saw it; the chart's own unknowns count where it is loose.
    pub(super) fn of<L: BatchProjection>(
        (seen, cameras): (&[PosedObservations], &[PosedLens<L>]),
        (world_from_chart, loose): (&Pose, bool),
        (free, loss): (&[Vec<usize>], Loss),
        sums: &mut Sums,
    ) -> Self {
        let count: usize = free.iter().map(Vec::len).sum();
        let size: usize = free.iter().map(|free| free.len() * (free.len() + 3) / 2).sum();
        let mut view = Self {
            cost: 0.0,
            own: Vec::with_capacity(size),
            mixed: vec![0.0; POSE * (count + 1)],
            chart: Matrix6::zeros(),
        };
        let mut first = 0;
        for ((camera, seen), free) in cameras.iter().zip(seen).zip(free) {
            if seen.len() == 0 {
                view.own.extend(std::iter::repeat_n(0.0, free.len() * (free.len() + 3) / 2));
            } else {
                let camera_from_world = camera.camera_from_world.after(world_from_chart);
                let posed = PosedLens { lens: &camera.lens, camera_from_world };
                let mut terms = [0; WIDTH];
                let own = free.iter().filter(|unknown| **unknown >= POSE);
                let held = terms.iter_mut().zip(own).map(|(to, from)| *to = from - POSE).count();
                sums.take(&posed, (seen, &terms[..held]), loss);
                view.cost += sums.cost + sums.unseen as f64 * loss.of(UNSEEN * UNSEEN).0;
                let turn = camera.camera_from_world.rotation;
                let arm = (turn * world_from_chart.translation).cross_matrix();
                let posed = free.first().is_some_and(|unknown| *unknown < POSE);
                if loose {
                    view.add_chart(sums, &turn, (&arm, posed), first);
                }
                view.add_own(sums, &arm, posed);
            }
            first += free.len();
        }
        view
    }

    /// By the chart's turn and place in the world; the camera's unknowns begin at `first`.
    fn add_chart(
        &mut self,
        sums: &Sums,
        turn: &Matrix3<f64>,
        (arm, posed): (&Matrix3<f64>, bool),
        first: usize,
    ) {
        let mut turned = [[0.0; POSE]; WIDTH];
        for (turned, row) in turned.iter_mut().zip(&sums.products[..=sums.unknowns]) {
            for half in [0, 3] {
                for axis in 0..3 {
                    turned[half + axis] =
                        (0..3).map(|k| row[half + k] * turn[(k, axis)]).sum::<f64>();
                }
            }
        }
        for half in [0, 3] {
            for axis in 0..3 {
                for k in 0..3 {
                    let factor = turn[(k, axis)];
                    for (column, value) in turned[half + k].iter().enumerate() {
                        self.chart[(half + axis, column)] += factor * value;
                    }
                }
            }
        }
        let stride = self.mixed.len() / POSE;
        for (k, row) in self.mixed.chunks_exact_mut(stride).enumerate() {
            row[stride - 1] += turned[sums.unknowns][k];
            let begin = if posed { 0 } else { POSE };
            for (value, turned) in row[first..].iter_mut().zip(&turned[begin..sums.unknowns]) {
                *value = turned[k];
            }
            // From a turn about the chart's origin to one about the world's.
            for (j, value) in row[first..].iter_mut().enumerate().take(if posed { 3 } else { 0 }) {
                *value -= (0..3).map(|i| arm[(i, j)] * turned[3 + i][k]).sum::<f64>();
            }
        }
    }

    /// The camera's own unknowns, its turn one about the world's origin, which is `arm` from the chart's in
    /// the camera's axes.
    fn add_own(&mut self, sums: &Sums, arm: &Matrix3<f64>, posed: bool) {
        let products = &sums.products;
        let [mut first, mut second, mut third, ..] = *products;
        for (j, row) in [&mut first, &mut second, &mut third].into_iter().enumerate() {
            for k in 0..3 {
                let factor = arm[(k, j)];
                for (value, other) in row.iter_mut().zip(&products[3 + k]) {
                    *value -= factor * other;
                }
            }
            for column in 0..3 {
                row[column] -= (0..3).map(|k| arm[(k, column)] * row[3 + k]).sum::<f64>();
            }
        }
        let turned = [first, second, third];
        let begin = if posed { 0 } else { POSE };
        for row in begin..sums.unknowns {
            for column in begin..=row {
                let turns = column < 3;
                self.own.push(if turns { turned[column][row] } else { products[row][column] });
            }
        }
        let error = sums.unknowns;
        let gradient = |row: usize| if row < 3 { turned[row][error] } else { products[row][error] };
        self.own.extend((begin..error).map(gradient));
    }

    /// Adds what is said of the cameras, each with so many unknowns, to their matrix (its lower triangle)
    /// and gradient.
    pub(super) fn add_to(
        &self,
        counts: impl Iterator<Item = usize>,
        matrix: &mut DMatrix<f64>,
        gradient: &mut DVector<f64>,
    ) {
        let (mut values, mut first) = (self.own.iter(), 0);
        for count in counts {
            for row in 0..count {
                for (column, value) in values.by_ref().take(row + 1).enumerate() {
                    matrix[(first + row, first + column)] += value;
                }
            }
            for (row, value) in values.by_ref().take(count).enumerate() {
                gradient[first + row] += value;
            }
            first += count;
        }
    }

    /// Gradient by one of the chart's unknowns.
    pub(super) fn chart_gradient(&self, unknown: usize) -> f64 {
        let stride = self.mixed.len() / POSE;
        self.mixed[(unknown + 1) * stride - 1]
    }
}

/// Sums of all views at one state.
#[derive(Clone, Debug)]
pub(super) struct TotalSums {
    /// Half the weighted sum of squares.
    pub(super) cost: f64,
    /// By the unknowns of all cameras.
    pub(super) cameras: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
    pub(super) views: Vec<ViewSums>,
}
