//! Charts taken out of the normal equations (Schur's complement), and a step of everything.

use super::sums::{TotalSums, ViewSums};
use crate::camera::posed_lens::POSE;
use nalgebra::{DMatrix, DVector, Matrix6, MatrixXx6, Vector6};
use wheatstone_numeric::{blocked_matrix::BlockedMatrix, cholesky::Cholesky};

/// Of each view the factor L of its chart's matrix, and L^-1 times what the chart shares with the cameras'
/// unknowns and times its gradient.
pub(super) struct Eliminated {
    lower: Vec<Matrix6<f64>>,
    /// A row each of the chart's unknowns, of one view after the other.
    shares: Vec<f64>,
    /// A row's length: the cameras' unknowns, and the gradient.
    stride: usize,
    /// What all charts take up.
    taken: DMatrix<f64>,
}

/// A step of everything.
pub(super) struct Step {
    pub(super) cameras: DVector<f64>,
    pub(super) charts: Vec<Vector6<f64>>,
}

impl Step {
    /// How much the damped model expects of it.
    pub(super) fn expected(&self, whole: &TotalSums, damping: f64) -> f64 {
        let mut gain = 0.0;
        let mut add = |value: f64, gradient: f64, diagonal: f64| {
            gain += 0.5 * value * (damping * diagonal * value - gradient);
        };
        for (index, value) in self.cameras.iter().enumerate() {
            add(*value, whole.gradient[index], whole.cameras[(index, index)]);
        }
        for (view, step) in whole.views.iter().zip(&self.charts) {
            for k in 0..POSE {
                add(step[k], view.chart_gradient(k), view.chart[(k, k)]);
            }
        }
        gain
    }
}

impl Eliminated {
    /// `None` where a chart is not determined.
    fn new(views: &[ViewSums], loose: &[bool], (unknowns, damping): (usize, f64)) -> Option<Self> {
        let stride = unknowns + 1;
        let mut lower = Vec::with_capacity(views.len());
        let mut shares = Vec::with_capacity(views.len() * POSE * stride);
        let mut columns = BlockedMatrix::zeros(stride, POSE * views.len());
        for (index, (view, loose)) in views.iter().zip(loose).enumerate() {
            let first = shares.len();
            shares.extend_from_slice(&view.mixed);
            if !loose {
                lower.push(Matrix6::zeros());
                continue;
            }
            let mut chart = view.chart;
            for k in 0..POSE {
                chart[(k, k)] *= 1.0 + damping;
            }
            let factor = chart.cholesky()?.l();
            for row in 0..POSE {
                let (done, rest) = shares[first..].split_at_mut(row * stride);
                let own = &mut rest[..stride];
                for (column, other) in done.chunks_exact(stride).enumerate() {
                    let factor = factor[(row, column)];
                    for (value, other) in own.iter_mut().zip(other) {
                        *value -= factor * other;
                    }
                }
                let inverse = 1.0 / factor[(row, row)];
                own.iter_mut().for_each(|value| *value *= inverse);
                columns.fill_column(POSE * index + row, own);
            }
            lower.push(factor);
        }
        Some(Self { lower, shares, stride, taken: columns.square() })
    }

    /// The chart's share of a step of all cameras.
    fn chart(&self, view: usize, cameras: &DVector<f64>) -> Vector6<f64> {
        let rows = self.shares[view * POSE * self.stride..].chunks_exact(self.stride);
        let mut step = Vector6::zeros();
        for (value, row) in step.iter_mut().zip(rows) {
            let moved: f64 = row.iter().zip(cameras.iter()).map(|(a, b)| a * b).sum();
            *value = -(row[self.stride - 1] + moved);
        }
        let lower = &self.lower[view];
        for row in (0..POSE).rev() {
            let known: f64 = (row + 1..POSE).map(|below| lower[(below, row)] * step[below]).sum();
            step[row] = (step[row] - known) / lower[(row, row)];
        }
        step
    }
}

impl TotalSums {
    /// The loose charts eliminated, and the cameras' matrix without what they take up.
    fn reduced(&self, loose: &[bool], damping: f64) -> Option<(Eliminated, DMatrix<f64>)> {
        let count = self.gradient.len();
        let eliminated = Eliminated::new(&self.views, loose, (count, damping))?;
        let matrix = &self.cameras - eliminated.taken.view((0, 0), (count, count));
        Some((eliminated, matrix))
    }

    /// What each view tells of the cameras, its chart eliminated: normal equations whose last row and column is the
    /// gradient. `None` where a chart is not determined.
    pub(super) fn by_view(&self, loose: &[bool], counts: &[usize]) -> Option<Vec<DMatrix<f64>>> {
        let count = self.gradient.len();
        let eliminated = Eliminated::new(&self.views, loose, (count, 0.0))?;
        let of_view = |(view, sums): (usize, &ViewSums)| {
            let (mut own, mut gradient) = (DMatrix::zeros(count, count), DVector::zeros(count));
            sums.add_to(counts.iter().copied(), &mut own, &mut gradient);
            own.fill_upper_triangle_with_lower_triangle();
            let mut matrix = own.resize(count + 1, count + 1, 0.0);
            for (row, value) in gradient.iter().enumerate() {
                matrix[(row, count)] = *value;
                matrix[(count, row)] = *value;
            }
            if loose[view] {
                let first = view * POSE * eliminated.stride;
                let shares = &eliminated.shares[first..first + POSE * eliminated.stride];
                let shares = DMatrix::from_row_slice(POSE, eliminated.stride, shares);
                matrix -= shares.tr_mul(&shares);
            }
            matrix
        };
        Some(self.views.iter().enumerate().map(of_view).collect())
    }

    /// A step for this damping; `None` where something is not determined.
    pub(super) fn step(&self, loose: &[bool], damping: f64) -> Option<Step> {
        let count = self.gradient.len();
        let (eliminated, matrix) = self.reduced(loose, damping)?;
        let more = |index: usize| {
            let diagonal = self.cameras[(index, index)];
            damping * if diagonal > 0.0 { diagonal } else { 1.0 }
        };
        let right: Vec<f64> =
            (0..count).map(|row| eliminated.taken[(row, count)] - self.gradient[row]).collect();
        let cameras = if count == 0 { right } else { Cholesky::new(&matrix, more)?.solve(&right) };
        let cameras = DVector::from_vec(cameras);
        let chart = |(view, loose): (usize, &bool)| {
            if *loose { eliminated.chart(view, &cameras) } else { Vector6::zeros() }
        };
        let charts = loose.iter().enumerate().map(chart).collect();
        cameras.iter().all(|value| value.is_finite()).then_some(Step { cameras, charts })
    }

    /// Covariance of every chart's turn (radians) and place for pixel errors of this standard
    /// deviation; `None` where something is not determined.
    pub(super) fn chart_covariances(
        &self,
        loose: &[bool],
        sigma: f64,
    ) -> Option<Vec<Matrix6<f64>>> {
        let count = self.gradient.len();
        let (eliminated, reduced) = self.reduced(loose, 0.0)?;
        let open = reduced.cholesky()?;
        let each = loose.iter().enumerate().map(|(view, loose)| {
            if !loose {
                return Some(Matrix6::zeros());
            }
            let shares = &eliminated.shares[view * POSE * eliminated.stride..];
            let shares =
                MatrixXx6::from_fn(count, |row, column| shares[column * eliminated.stride + row]);
            let half = open.l_dirty().solve_lower_triangular(&shares)?;
            let inner = Matrix6::identity() + half.tr_mul(&half);
            let inverse = eliminated.lower[view].solve_lower_triangular(&Matrix6::identity())?;
            Some(inverse.tr_mul(&inner) * inverse * (sigma * sigma))
        });
        each.collect()
    }
}
