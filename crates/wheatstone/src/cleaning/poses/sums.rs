//! What one view says of cameras and its chart: normal equations of their common adjustment.
//!
//! A pixel depends on the chart's place in the camera and on the lens only. So sums are taken by those
//! six unknowns and the lens's, and brought to the unknowns of camera and chart once a view.

use super::{
    bundle::{POSE, Posed, Shot},
    loss::Loss,
};
use crate::{
    camera::AdjustableCamera,
    geometry::{Pixel, Point3, Pose, Vector3},
    numeric::panels::Panels,
};
use nalgebra::{DMatrix, DVector, Matrix2x3, Matrix3, Matrix6, SMatrix, Vector6};

/// Room for a pose, the terms of the lens with most of them, nine of Brown's that are adjusted here, and
/// the error: two panels.
const WIDTH: usize = 16;

/// Where the errors stand, beside the slopes by the unknowns.
const ERROR: usize = WIDTH - 1;

/// Numbers of the lens with most of them, Brown's.
const MOST_NUMBERS: usize = 16;

/// What a point that no camera can see costs, in pixels: as much as a gross error.
const UNSEEN: f64 = 1e3;

/// Sums of one view.
#[derive(Clone, Debug)]
pub(super) struct ViewSums {
    pub(super) cost: f64,
    /// One block a camera.
    pub(super) own: Vec<Block>,
    /// Cameras' unknowns, of all cameras one after the other, by the chart's.
    mixed: Vec<[f64; POSE]>,
    pub(super) chart: Matrix6<f64>,
    pub(super) chart_gradient: Vector6<f64>,
}

/// Sums of one camera's unknowns: the lower triangle row by row, and the gradient.
#[derive(Clone, Debug)]
pub(super) struct Block {
    triangle: Vec<f64>,
    gradient: Vec<f64>,
}

impl Block {
    pub(super) fn add_to(
        &self,
        matrix: &mut DMatrix<f64>,
        gradient: &mut DVector<f64>,
        first: usize,
    ) {
        let mut values = self.triangle.iter();
        for (row, value) in self.gradient.iter().enumerate() {
            gradient[first + row] += value;
            for (column, value) in values.by_ref().take(row + 1).enumerate() {
                matrix[(first + row, first + column)] += value;
            }
        }
    }
}

impl ViewSums {
    /// Of a view and the cameras that saw it; the chart's own unknowns count where it is loose.
    pub(super) fn of<L: AdjustableCamera>(
        (shot, cameras): (&Shot, &[Posed<L>]),
        (world_from_chart, loose): (&Pose, bool),
        (free, loss): (&[Vec<usize>], Loss),
        cell: &mut CellSums,
    ) -> Self {
        let count = free.iter().map(Vec::len).sum();
        let mut sums = Self {
            cost: 0.0,
            own: Vec::with_capacity(cameras.len()),
            mixed: Vec::with_capacity(count),
            chart: Matrix6::zeros(),
            chart_gradient: Vector6::zeros(),
        };
        for ((camera, seen), free) in cameras.iter().zip(shot).zip(free) {
            if seen.is_empty() {
                sums.own.push(Block { triangle: Vec::new(), gradient: Vec::new() });
                sums.mixed.extend(free.iter().map(|_| [0.0; POSE]));
                continue;
            }
            let pose = camera.camera_from_world.after(world_from_chart);
            cell.fill(&camera.lens, &pose, seen, (free, loss));
            sums.cost += cell.cost;
            let turn = camera.camera_from_world.rotation;
            if loose {
                sums.chart += cell.by_chart(&turn);
                sums.chart_gradient += cell.chart_gradient(&turn);
            }
            let arm = (turn * world_from_chart.translation).cross_matrix();
            cell.turn_rows(&arm);
            let places: Vec<usize> = places(free).collect();
            let row = |place: &usize| cell.mixed(*place, &turn);
            sums.mixed.extend(places.iter().map(|p| if loose { row(p) } else { [0.0; POSE] }));
            cell.turn_columns(&arm);
            sums.own.push(cell.block(&places));
        }
        sums
    }

    /// Takes what the chart takes up out of the cameras' matrix (its lower triangle) and right side.
    pub(super) fn eliminate(
        &self,
        inverse: &Matrix6<f64>,
        matrix: &mut DMatrix<f64>,
        right: &mut DVector<f64>,
    ) {
        for (row, mixed) in self.mixed.iter().enumerate() {
            if mixed == &[0.0; POSE] {
                continue;
            }
            let carried = inverse * Vector6::from(*mixed);
            right[row] += carried.dot(&self.chart_gradient);
            for (column, other) in self.mixed[..=row].iter().enumerate() {
                let product: f64 = carried.iter().zip(other).map(|(a, b)| a * b).sum();
                matrix[(row, column)] -= product;
            }
        }
    }

    /// The chart's share of a step of all cameras.
    pub(super) fn carried(&self, cameras: &DVector<f64>) -> Vector6<f64> {
        let parts = self.mixed.iter().zip(cameras.iter());
        parts.map(|(mixed, step)| Vector6::from(*mixed) * *step).sum()
    }

    /// Cameras' unknowns by the chart's.
    pub(super) fn mixed_matrix(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.mixed.len(), POSE, |row, column| self.mixed[row][column])
    }
}

/// Where a camera's free unknowns stand in the sums of a cell.
fn places(free: &[usize]) -> impl Iterator<Item = usize> {
    let mut lens = POSE..WIDTH;
    free.iter().filter_map(
        move |unknown| {
            if *unknown < POSE { Some(*unknown) } else { lens.next() }
        },
    )
}

/// Sums of the points of one view in one camera, by the chart's place in the camera (a turn about its
/// own origin in the camera's axes, a move), then the lens's free numbers.
#[derive(Default)]
pub(super) struct CellSums {
    cost: f64,
    matrix: SMatrix<f64, WIDTH, WIDTH>,
    gradient: [f64; WIDTH],
    /// Unknowns that there are.
    used: usize,
    /// A column a pixel's coordinate: its slopes, then its error.
    rows: Panels,
}

impl CellSums {
    fn fill<L: AdjustableCamera>(
        &mut self,
        lens: &L,
        camera_from_chart: &Pose,
        seen: &[(Point3, Pixel)],
        (free, loss): (&[usize], Loss),
    ) {
        let mut terms = [0; WIDTH];
        self.used = POSE;
        for unknown in free.iter().filter(|unknown| **unknown >= POSE).take(ERROR - POSE) {
            terms[self.used] = unknown - POSE;
            self.used += 1;
        }
        let terms = &terms[POSE..self.used];
        let mut slopes = [[0.0; 2]; MOST_NUMBERS];
        let count = lens.clone().parameters_mut().len().min(MOST_NUMBERS);
        let slopes = &mut slopes[..count];
        let Pose { rotation, translation } = camera_from_chart;
        self.rows.clear(WIDTH, 2 * seen.len());
        self.cost = 0.0;
        for (index, (place, pixel)) in seen.iter().enumerate() {
            let turned = rotation * place.coords;
            let point = Point3::from(turned + translation);
            let Some((at, by_point)) = lens.project_with_slopes(point, slopes) else {
                self.cost += loss.of(UNSEEN * UNSEEN).0;
                continue;
            };
            let error = at - pixel;
            let (cost, weight) = loss.of(error.norm_squared());
            self.cost += cost;
            let root = weight.sqrt();
            for axis in 0..2 {
                let mut row = [0.0; WIDTH];
                let [turn, along] = by_pose(&turned, &by_point, axis);
                row[..3].copy_from_slice(turn.as_slice());
                row[3..POSE].copy_from_slice(along.as_slice());
                for (value, term) in row[POSE..].iter_mut().zip(terms) {
                    *value = slopes[*term][axis];
                }
                row[ERROR] = error[axis];
                row.iter_mut().for_each(|value| *value *= root);
                self.rows.fill_column(2 * index + axis, &row);
            }
        }
        self.matrix.copy_from(&self.rows.square());
        self.gradient = std::array::from_fn(|place| self.matrix[(ERROR, place)]);
    }

    fn part(&self, row: usize, column: usize) -> Matrix3<f64> {
        self.matrix.fixed_view::<3, 3>(row, column).into_owned()
    }

    /// By the chart's turn and place in the world.
    fn by_chart(&self, turn: &Matrix3<f64>) -> Matrix6<f64> {
        let mut matrix = Matrix6::zeros();
        for row in [0, 3] {
            for column in [0, 3] {
                let part = turn.transpose() * self.part(row, column) * turn;
                matrix.fixed_view_mut::<3, 3>(row, column).copy_from(&part);
            }
        }
        matrix
    }

    fn chart_gradient(&self, turn: &Matrix3<f64>) -> Vector6<f64> {
        let part = |first: usize| {
            turn.tr_mul(&Vector3::new(
                self.gradient[first],
                self.gradient[first + 1],
                self.gradient[first + 2],
            ))
        };
        let (turned, moved) = (part(0), part(3));
        Vector6::new(turned.x, turned.y, turned.z, moved.x, moved.y, moved.z)
    }

    /// Rows and gradient from a turn about the chart's origin to one about the world's, which is `arm`
    /// from it in the camera's axes.
    fn turn_rows(&mut self, arm: &Matrix3<f64>) {
        for k in 0..3 {
            for j in 0..3 {
                let factor = arm[(k, j)];
                self.gradient[j] -= factor * self.gradient[3 + k];
                for column in 0..self.used {
                    let value = self.matrix[(3 + k, column)];
                    self.matrix[(j, column)] -= factor * value;
                }
            }
        }
    }

    /// Columns likewise.
    fn turn_columns(&mut self, arm: &Matrix3<f64>) {
        for k in 0..3 {
            for j in 0..3 {
                let factor = arm[(k, j)];
                for row in 0..self.used {
                    let value = self.matrix[(row, 3 + k)];
                    self.matrix[(row, j)] -= factor * value;
                }
            }
        }
    }

    /// One of the camera's unknowns by the chart's.
    fn mixed(&self, place: usize, turn: &Matrix3<f64>) -> [f64; POSE] {
        let value = |column: usize| {
            let axis = column % 3;
            let first = column - axis;
            (0..3).map(|k| self.matrix[(place, first + k)] * turn[(k, axis)]).sum()
        };
        std::array::from_fn(value)
    }

    fn block(&self, places: &[usize]) -> Block {
        let row = |(index, row): (usize, &usize)| {
            let row = *row;
            places[..=index].iter().map(move |column| self.matrix[(row, *column)])
        };
        Block {
            triangle: places.iter().enumerate().flat_map(row).collect(),
            gradient: places.iter().map(|place| self.gradient[*place]).collect(),
        }
    }
}

/// Derivatives of a pixel's coordinate by a turn of the chart about its origin, and by a move.
fn by_pose(turned: &Vector3, by_point: &Matrix2x3<f64>, axis: usize) -> [Vector3; 2] {
    let along = by_point.row(axis).transpose();
    [turned.cross(&along), along]
}
