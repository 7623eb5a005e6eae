//! What neural cameras, and maps fitted beside them, are uncertain by where charts' places were found
//! from the same pixels.
//!
//! A fit holds such places for known. The covariance of its numbers is then that of bundle adjustment
//! (Triggs et al. 2000, doi:10.1007/3-540-44480-7_21) less what follows the charts: with the charts'
//! unknowns eliminated, A - B D^-1 B' has the inverse A^-1 + R P R', where R = -A^-1 B is how the numbers
//! follow the charts and P the charts' own covariance (Woodbury's formula). P is of all cameras together,
//! in the frame in which the charts' points as a whole neither move nor turn. It is kept as its few
//! independent motions that pixels notice, and what each camera does with each of them.

use super::{
    chart_poses::{MOTION, UncertainPose, UncertainPoses},
    evidence::Posterior,
    fit::State,
    lens::PARAMETERS,
    model::Mode,
    settings::NOISE,
    uncertain_poses::Information,
};
use crate::{
    dataset::Dataset,
    geometry::{Point3, Vector3},
    method::chart_pose_uncertainty,
};
use nalgebra::{DMatrix, Matrix6xX, SymmetricEigen};
use wheatstone_numeric::matrix_product::product;

/// How far charts may go from where they were found, as a share of their distance and in radians: what
/// they were allowed when they were placed together with such cameras (`preparation`).
const FREEDOM: f64 = 0.01;

/// The motions that are left out hold less than this share of what pixels notice of all: less than half
/// a percent of an error bar.
const UNNOTICED: f64 = 0.01;

/// Charts whose places were found, one a view; those of known places do not move.
pub(super) struct FoundCharts {
    charts: Vec<UncertainPose>,
    /// Whether other points say where the world is.
    frame_is_known: bool,
}

impl FoundCharts {
    /// `None` where all places were known. Cameras stand about `viewpoint`.
    pub(super) fn of(train: &Dataset, viewpoint: Point3) -> Option<Self> {
        let middles = chart_pose_uncertainty::middles(train);
        middles.iter().any(Option::is_some).then(|| {
            let chart = |middle: &Option<Point3>| {
                let offset = middle.map_or(0.0, |middle| FREEDOM * (middle - viewpoint).norm());
                let turn = if middle.is_some() { FREEDOM } else { 0.0 };
                UncertainPose {
                    centre: middle.unwrap_or(Point3::origin()),
                    sigma: [offset, offset, offset, turn, turn, turn],
                    motion: [0.0; MOTION],
                }
            };
            let charts = middles.iter().map(chart).collect();
            Self { charts, frame_is_known: train.known().any(|(_, row)| !row.has_estimated_pose()) }
        })
    }

    /// The charts of the points that a camera saw, free to move.
    pub(super) fn loosened(&self, camera: usize, train: &Dataset) -> UncertainPoses {
        let seen = train.known().filter(|(_, row)| matches!(row.pixels.get(camera), Some(Some(_))));
        let of_point = seen.map(|(_, row)| row.view).collect();
        UncertainPoses { charts: self.charts.clone(), of_point, held: false }
    }

    fn numbers(&self) -> usize {
        MOTION * self.charts.len()
    }

    /// By how much a point of a view's chart moves with each number of all motions.
    fn motion(&self, view: usize, point: Point3) -> [Vector3; MOTION] {
        let UncertainPose { centre, sigma, .. } = &self.charts[view];
        let arm = point - centre;
        std::array::from_fn(|number| {
            let mut along = Vector3::zeros();
            along[number % 3] = sigma[number];
            if number < 3 { along } else { along.cross(&arm) }
        })
    }

    /// Takes out of motions (a column each) what moves or turns the charts' points as a whole.
    fn held_in_frame(&self, train: &Dataset, root: DMatrix<f64>) -> Option<DMatrix<f64>> {
        if self.frame_is_known {
            return Some(root);
        }
        let found = || train.known().filter(|(_, row)| row.has_estimated_pose());
        let centre =
            found().map(|(world, _)| world.coords).sum::<Vector3>() / found().count().max(1) as f64;
        // What moves as a whole, by the motions' numbers.
        let mut conditions = Matrix6xX::zeros(self.numbers());
        for (world, row) in found() {
            let arm = world.coords - centre;
            for (number, by) in self.motion(row.view, world).iter().enumerate() {
                let mut column = conditions.fixed_view_mut::<6, 1>(0, MOTION * row.view + number);
                let turned = arm.cross(by);
                for axis in 0..3 {
                    column[axis] += by[axis];
                    column[3 + axis] += turned[axis];
                }
            }
        }
        // The motions that are a move or a turn of all.
        let mut whole = DMatrix::zeros(self.numbers(), 6);
        for (view, chart) in self.charts.iter().enumerate().filter(|(_, c)| c.sigma[0] > 0.0) {
            let arm = chart.centre.coords - centre;
            for axis in 0..3 {
                let mut along = Vector3::zeros();
                along[axis] = 1.0;
                let carried = along.cross(&arm);
                whole[(MOTION * view + axis, axis)] = 1.0 / chart.sigma[axis];
                whole[(MOTION * view + 3 + axis, 3 + axis)] = 1.0 / chart.sigma[3 + axis];
                for along in 0..3 {
                    whole[(MOTION * view + along, 3 + axis)] = carried[along] / chart.sigma[along];
                }
            }
        }
        let through = product(&conditions, &whole).fixed_view::<6, 6>(0, 0).into_owned();
        let inverse = through.try_inverse()?;
        let taken = product(&whole, &product(&inverse, &product(&conditions, &root)));
        Some(root - taken)
    }
}

/// What one camera says of charts, and how it follows them.
pub(super) struct Following {
    information: Information,
    /// What it would say if its own numbers were known.
    known: DMatrix<f64>,
    lens: DMatrix<f64>,
    /// Along x and y, a row an active function.
    weights: [DMatrix<f64>; 2],
}

impl Following {
    /// Of a camera at the mode of `fitted`.
    pub(super) fn of(
        mut state: State<'_>,
        fitted: &Posterior,
        charts: UncertainPoses,
    ) -> Option<Self> {
        state.charts = Some(charts);
        let sums = state.sums()?;
        let posterior = sums.posterior(&state.field, fitted.settings)?;
        let numbers = sums.numbers.len() - PARAMETERS;
        let covariance = &posterior.lens_covariance;
        let own = covariance.view((PARAMETERS, PARAMETERS), (numbers, numbers)).into_owned();
        let shared = covariance.view((0, PARAMETERS), (PARAMETERS, numbers)).into_owned();
        let lens = product(&shared, &own.cholesky()?.inverse());
        let weights = posterior.follow.each_ref().map(|follow| {
            -(product(&follow.columns(0, PARAMETERS).into_owned(), &lens)
                + follow.columns(PARAMETERS, numbers))
        });
        let precision = fitted.settings.value(NOISE).powi(-2);
        let known = sums.lens.view((PARAMETERS, PARAMETERS), (numbers, numbers)) * precision;
        let motions = vec![0.0; numbers];
        Some(Self { information: Information::of(&posterior, &motions)?, known, lens, weights })
    }

    /// What the camera does with each of these motions.
    pub(super) fn modes(&self, motions: &DMatrix<f64>) -> Vec<Mode> {
        let [lens, x, y] =
            [&self.lens, &self.weights[0], &self.weights[1]].map(|by| product(by, motions));
        let column = |matrix: &DMatrix<f64>, index: usize| {
            matrix.column(index).iter().copied().collect::<Vec<f64>>()
        };
        let mode = |index: usize| Mode {
            lens: column(&lens, index),
            weights: [column(&x, index), column(&y, index)],
        };
        (0..motions.ncols()).map(mode).collect()
    }
}

/// Independent motions of charts whose places were found, each by its standard deviation.
pub(in crate::method) struct Motions {
    charts: FoundCharts,
    modes: DMatrix<f64>,
}

impl Motions {
    /// By what all cameras together say; `None` where something is not determined.
    pub(super) fn of(
        charts: FoundCharts,
        following: &[Following],
        train: &Dataset,
    ) -> Option<Self> {
        let count = charts.numbers();
        let mut precision = DMatrix::identity(count, count);
        let mut noticed = DMatrix::zeros(count, count);
        for camera in following {
            precision += &camera.information.matrix;
            noticed += &camera.known - &camera.information.matrix;
        }
        let root = precision.cholesky()?.l().transpose().try_inverse()?;
        let root = charts.held_in_frame(train, root)?;
        let square = product(&root.transpose(), &product(&noticed, &root));
        let SymmetricEigen { eigenvectors, eigenvalues } =
            ((&square + square.transpose()) * 0.5).symmetric_eigen();
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| eigenvalues[*b].total_cmp(&eigenvalues[*a]));
        let mut left: f64 = eigenvalues.iter().map(|value| value.max(0.0)).sum();
        let enough = UNNOTICED * left;
        order.retain(|index| {
            let kept = left > enough && eigenvalues[*index] > 0.0;
            left -= eigenvalues[*index].max(0.0);
            kept
        });
        let modes = product(&root, &eigenvectors.select_columns(&order));
        modes.iter().all(|value| value.is_finite()).then_some(Self { charts, modes })
    }

    /// Of all motions' numbers, a column each.
    pub(super) fn modes(&self) -> &DMatrix<f64> {
        &self.modes
    }

    /// How many there are.
    pub(in crate::method) fn len(&self) -> usize {
        self.modes.ncols()
    }

    /// By how much a point of a view's chart moves in each of them.
    pub(in crate::method) fn of_point(&self, view: usize, point: Point3) -> Vec<Vector3> {
        let by = self.charts.motion(view, point);
        let numbers = self.modes.rows(MOTION * view, MOTION);
        let sum = |mode: usize| {
            by.iter().zip(numbers.column(mode).iter()).map(|(by, number)| by * *number).sum()
        };
        (0..self.len()).map(sum).collect()
    }
}
