//! What views tell of the cameras' relative poses: how much the errors shrink, to first order, where one camera may stand
//! elsewhere in some views.
//!
//! Source: the score test, Rao 1948 (doi:10.1017/S0305004100023987), on the adjustment's normal equations with the charts
//! eliminated: nothing is adjusted again.

use super::{
    adjustment::{Bundle, first_damping},
    rig::{Terms, unknowns},
    state::{Choice, Shot},
};
use crate::camera::posed_lens::POSE;
use nalgebra::{DMatrix, Matrix3, Matrix6, SymmetricEigen, Vector6};
use wheatstone_numeric::{cholesky::Cholesky, loss::Loss, matrix_product::product};

/// Of a matrix whose diagonal is 1 before charts are eliminated, what no direction is determined below.
const LEAST: f64 = 1e-9;

/// The normal equations, view by view, with the charts eliminated.
#[derive(Clone)]
pub(super) struct ViewEquations {
    /// The sum of squared errors.
    pub(super) squares: f64,
    /// By the unknowns of all cameras; the last row and column is the gradient.
    views: Vec<DMatrix<f64>>,
    /// The diagonal of all views together, no chart eliminated.
    diagonal: Vec<f64>,
    /// By view, then camera: the same of a camera's pose alone, no chart eliminated.
    alone: Vec<Vec<Matrix6<f64>>>,
    /// The first unknown of each camera.
    first: Vec<usize>,
    /// From a turn about a camera's centre and a move to a turn about the world's origin and a move.
    about_centre: Vec<Matrix6<f64>>,
}

/// Another pose of a camera, times a number of each view.
pub(super) struct Moved {
    /// By how much it reduces the sum of squared errors.
    pub(super) gain: f64,
    /// By how much a turn alone does.
    pub(super) gain_of_turn: f64,
    /// The turn about its centre, in its axes and radians, and the move.
    pub(super) pose: Vector6<f64>,
    /// The turn where it is nothing else.
    pub(super) turn: Vector6<f64>,
}

impl ViewEquations {
    /// At a state, of these pixels.
    pub(super) fn new<L: Terms>(choice: &Choice<L>, shots: &[Shot]) -> Option<Self> {
        let free = vec![unknowns(choice.terms, true); choice.state.cameras.len()];
        let counts: Vec<usize> = free.iter().map(Vec::len).collect();
        let first: Vec<usize> = (0..counts.len()).map(|camera| counts[0] * camera).collect();
        let (loose, loss) = (&choice.loose, Loss::Squares);
        let bundle = Bundle { shots, loose, free, loss, damping: first_damping() };
        let sums = bundle.equations(&choice.state);
        let whole = sums.by_view(&vec![false; loose.len()], &counts)?;
        let pose = |view: &DMatrix<f64>, first: usize| -> Matrix6<f64> {
            view.fixed_view::<POSE, POSE>(first, first).into_owned()
        };
        let alone = whole.iter().map(|view| first.iter().map(|at| pose(view, *at)).collect());
        let diagonal = |index: usize| whole.iter().map(|view| view[(index, index)]).sum();
        let about_centre = choice.state.cameras.iter().map(|camera| {
            let mut matrix = Matrix6::identity();
            let arm: Matrix3<f64> = -camera.camera_from_world.translation.cross_matrix();
            matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&arm);
            matrix
        });
        Some(Self {
            squares: 2.0 * sums.cost,
            views: sums.by_view(loose, &counts)?,
            diagonal: (0..sums.gradient.len()).map(diagonal).collect(),
            alone: alone.collect(),
            about_centre: about_centre.collect(),
            first,
        })
    }

    fn unknowns(&self) -> usize {
        self.views.first().map_or(0, |view| view.nrows() - 1)
    }

    /// The views in which a camera's pose is told by it and other cameras.
    pub(super) fn linked(&self, camera: usize) -> Vec<usize> {
        (0..self.views.len()).filter(|view| self.pose(*view, camera).gain().is_some()).collect()
    }

    /// What a view tells of a camera's pose, with the gradient.
    fn pose(&self, view: usize, camera: usize) -> Score {
        let (first, count) = (self.first[camera], self.unknowns());
        let matrix = &self.views[view];
        Score {
            matrix: matrix.fixed_view::<POSE, POSE>(first, first).into_owned(),
            gradient: matrix.fixed_view::<POSE, 1>(first, count).into_owned(),
            alone: self.alone[view][camera].diagonal(),
        }
    }

    /// Frees a camera's pose in a view, and tells what that gains by itself.
    pub(super) fn free(&mut self, camera: usize, view: usize) -> Option<f64> {
        let score = self.pose(view, camera);
        let (gain, inverse) = (score.gain()?, score.inverse()?);
        let whole = &mut self.views[view];
        let columns = whole.columns(self.first[camera], POSE).into_owned();
        let inverse = DMatrix::from_column_slice(POSE, POSE, inverse.as_slice());
        let taken = product(&product(&columns, &inverse), &columns.transpose());
        *whole -= taken;
        // Nothing but rounding is left of it.
        whole.rows_mut(self.first[camera], POSE).fill(0.0);
        whole.columns_mut(self.first[camera], POSE).fill(0.0);
        Some(gain)
    }

    /// All views together.
    pub(super) fn together(&self) -> Option<Together<'_>> {
        let count = self.unknowns();
        let mut sum = DMatrix::zeros(count + 1, count + 1);
        self.views.iter().for_each(|view| sum += view);
        let scale = |own: &f64| if *own > 0.0 { own.sqrt() } else { 1.0 };
        let scales: Vec<f64> = self.diagonal.iter().map(scale).collect();
        let matrix = DMatrix::from_fn(count, count, |row, column| {
            sum[(row, column)] / scales[row] / scales[column]
        });
        // The frame of the world, which the charts leave open, stays where it is.
        let factors = Cholesky::new(&matrix, |_| LEAST)?;
        let gradient: Vec<f64> = (0..count).map(|row| sum[(row, count)]).collect();
        let mut together =
            Together { equations: self, factors, scales, step: Vec::new(), gain: 0.0 };
        together.step = together.solve(&gradient);
        together.gain = gradient.iter().zip(&together.step).map(|(a, b)| a * b).sum();
        Some(together)
    }

    /// Root mean square by which a camera's points, so many, move in its pictures of these views where it moves so.
    pub(super) fn shift(
        &self,
        (camera, views): (usize, &[usize]),
        moved: &Vector6<f64>,
        points: usize,
    ) -> f64 {
        let moved = self.about_centre[camera] * moved;
        let squares = views.iter().map(|view| (self.alone[*view][camera] * moved).dot(&moved));
        (squares.sum::<f64>() / points.max(1) as f64).max(0.0).sqrt()
    }
}

/// The sum of the views' normal equations, factored.
pub(super) struct Together<'a> {
    equations: &'a ViewEquations,
    factors: Cholesky,
    scales: Vec<f64>,
    /// What solves them, and gains so much.
    step: Vec<f64>,
    pub(super) gain: f64,
}

impl Together<'_> {
    fn solve(&self, right: &[f64]) -> Vec<f64> {
        let scaled: Vec<f64> = right.iter().zip(&self.scales).map(|(a, scale)| a / scale).collect();
        let solved = self.factors.solve(&scaled);
        solved.iter().zip(&self.scales).map(|(a, scale)| a / scale).collect()
    }

    /// A camera moved by a pose times a number of each view.
    pub(super) fn moved(
        &self,
        camera: usize,
        times: impl Iterator<Item = (usize, f64)>,
    ) -> Option<Moved> {
        let (first, count) = (self.equations.first[camera], self.equations.unknowns());
        let mut columns = DMatrix::zeros(count + 1, POSE);
        let (mut own, mut alone) = (Matrix6::zeros(), Matrix6::zeros());
        for (view, time) in times.filter(|(_, time)| *time != 0.0) {
            alone += self.equations.alone[view][camera] * (time * time);
            let view = &self.equations.views[view];
            columns += view.columns(first, POSE) * time;
            own += view.fixed_view::<POSE, POSE>(first, first) * (time * time);
        }
        let gradient = columns.row(count).transpose().fixed_rows::<POSE>(0).into_owned();
        let mut score = Score { matrix: own, gradient, alone: alone.diagonal() };
        for index in 0..POSE {
            let column: Vec<f64> = columns.column(index).iter().take(count).copied().collect();
            let solved = self.solve(&column);
            for other in 0..POSE {
                let others = columns.column(other);
                let taken: f64 = solved.iter().zip(others.iter()).map(|(a, b)| a * b).sum();
                score.matrix[(other, index)] -= taken;
            }
            let taken: f64 = column.iter().zip(&self.step).map(|(a, b)| a * b).sum();
            score.gradient[index] -= taken;
        }
        let about = &self.equations.about_centre[camera];
        let score = Score {
            matrix: about.tr_mul(&(score.matrix * about)),
            gradient: about.tr_mul(&score.gradient),
            alone: about.tr_mul(&(alone * about)).diagonal(),
        };
        let turn = score.of_turn();
        Some(Moved {
            gain: score.gain()?,
            gain_of_turn: turn.gain()?,
            pose: -score.inverse()? * score.gradient,
            turn: -turn.inverse()? * turn.gradient,
        })
    }
}

/// Normal equations of a camera's pose.
struct Score {
    matrix: Matrix6<f64>,
    gradient: Vector6<f64>,
    /// The matrix's diagonal where all else is known.
    alone: Vector6<f64>,
}

impl Score {
    /// The inverse, nothing along directions that are not determined; `None` where none is.
    fn inverse(&self) -> Option<Matrix6<f64>> {
        let scale = |index: usize| {
            let own = self.alone[index];
            if own > 0.0 { 1.0 / own.sqrt() } else { 0.0 }
        };
        let scales = Vector6::from_fn(|index, _| scale(index));
        let scaled = Matrix6::from_fn(|row, column| {
            0.5 * (self.matrix[(row, column)] + self.matrix[(column, row)])
                * scales[row]
                * scales[column]
        });
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(scaled);
        let mut inverse = Matrix6::zeros();
        let mut determined = false;
        for (vector, value) in eigenvectors.column_iter().zip(eigenvalues.iter()) {
            if *value > LEAST {
                determined = true;
                inverse += vector * vector.transpose() / *value;
            }
        }
        let inverse =
            Matrix6::from_fn(|row, column| inverse[(row, column)] * scales[row] * scales[column]);
        determined.then_some(inverse)
    }

    /// By how much the pose that solves them reduces the sum of squares.
    fn gain(&self) -> Option<f64> {
        Some((self.inverse()? * self.gradient).dot(&self.gradient))
    }

    fn of_turn(&self) -> Self {
        let mut turn = Self { matrix: self.matrix, gradient: self.gradient, alone: self.alone };
        for index in 3..POSE {
            turn.matrix.row_mut(index).fill(0.0);
            turn.matrix.column_mut(index).fill(0.0);
            turn.gradient[index] = 0.0;
        }
        turn
    }
}
