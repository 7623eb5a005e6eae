//! What cameras are uncertain by where charts' places were found from the same pixels.
//!
//! Source: bundle adjustment, Triggs, McLauchlan, Hartley & Fitzgibbon 2000
//! (doi:10.1007/3-540-44480-7_21): the covariance of the cameras alone is the inverse of their normal
//! matrix with every chart's six unknowns eliminated (Schur's complement). Charts link the cameras, so
//! it is one matrix of all of them. Where no place at all is known the world's frame is nobody's: of one
//! camera it is the camera's own, of several the one in which the charts' points, located by these cameras,
//! as a whole neither move nor turn (inner constraints: Triggs et al., section 9.2). That says what is not
//! known of shapes and distances, and no more.

use super::{
    CameraUncertainty, FittedCamera, KnownLens,
    camera_uncertainty::{inverse, joined},
};
use crate::{
    camera::{AdjustableCamera, posed_lens::MOST_UNKNOWNS},
    dataset::Dataset,
    geometry::{Point3, Vector3},
};
use nalgebra::{DMatrix, Matrix3, Matrix6, MatrixXx6, Vector2, Vector6};
use wheatstone_numeric::{levenberg_marquardt::NormalEquations, matrix_product::product};

/// Unknowns of a chart: a turn about its middle, a move.
const MOTION: usize = 6;

/// A chart whose place was found.
struct Chart {
    middle: Point3,
}

/// How many unknowns charts have, whose places were found.
pub(super) fn unknowns(train: &Dataset) -> usize {
    MOTION * charts(train).iter().flatten().count()
}

/// Middles of the charts whose places were found, by view.
pub(super) fn middles(train: &Dataset) -> Vec<Option<Point3>> {
    charts(train).into_iter().map(|chart| Some(chart?.middle)).collect()
}

/// By view.
fn charts(train: &Dataset) -> Vec<Option<Chart>> {
    let mut points: Vec<Vec<Point3>> = vec![Vec::new(); train.views.len().max(1)];
    for row in train.correspondences.iter().filter(|row| row.has_estimated_pose()) {
        if let Some(points) = points.get_mut(row.view) {
            points.extend(row.world);
        }
    }
    let chart = |points: Vec<Point3>| {
        let middle = points.iter().map(|p| p.coords).sum::<Vector3>() / points.len() as f64;
        (!points.is_empty()).then(|| Chart { middle: middle.into() })
    };
    points.into_iter().map(chart).collect()
}

impl Chart {
    /// How one of its points moves with each of its unknowns.
    fn motion(&self, point: Point3) -> [Vector3; MOTION] {
        let arm = point - self.middle;
        std::array::from_fn(|index| {
            let mut along = Vector3::zeros();
            along[index % 3] = 1.0;
            if index < 3 { along.cross(&arm) } else { along }
        })
    }
}

/// Sums over what one camera saw of one view: by its numbers, then the chart's.
struct Cell {
    camera: usize,
    chart: Option<usize>,
    /// Of slopes.
    plain: NormalEquations,
    /// Of slopes times each pixel's variance.
    weighed: NormalEquations,
}

fn cells<L: AdjustableCamera>(
    cameras: &[FittedCamera<L>],
    open: &[CameraUncertainty],
    (train, charts): (&Dataset, &[Option<Chart>]),
) -> Option<Vec<Cell>> {
    let mut cells: Vec<Cell> = Vec::new();
    let views = charts.len() + 1;
    let mut places: Vec<Option<usize>> = vec![None; views * cameras.len()];
    for row in &train.correspondences {
        let Some(world) = row.world else { continue };
        let chart =
            charts.get(row.view).and_then(Option::as_ref).filter(|_| row.has_estimated_pose());
        let motion = chart.map(|chart| chart.motion(world));
        for (index, (camera, open)) in cameras.iter().zip(open).enumerate() {
            let Some(Some(pixel)) = row.pixels.get(index) else { continue };
            let own = open.numbers();
            let size = own + if motion.is_some() { MOTION } else { 0 };
            let view = if motion.is_some() { row.view } else { views - 1 };
            let place = *places[view * cameras.len() + index].get_or_insert_with(|| {
                let sums = NormalEquations::new(size);
                let chart = motion.is_some().then_some(row.view);
                cells.push(Cell { camera: index, chart, plain: sums.clone(), weighed: sums });
                cells.len() - 1
            });
            let mut rows = [[0.0; MOST_UNKNOWNS + MOTION]; 2];
            let slopes = open.slopes(camera, world)?;
            for (number, slope) in slopes[..own].iter().enumerate() {
                (rows[0][number], rows[1][number]) = (slope[0], slope[1]);
            }
            if let Some(motion) = &motion {
                let (_, by_world) = camera.project_with_jacobian(world)?;
                for (number, by) in motion.iter().enumerate() {
                    let slope = by_world * by;
                    (rows[0][own + number], rows[1][own + number]) = (slope.x, slope.y);
                }
            }
            let cell = &mut cells[place];
            cell.plain.add_pixel([&rows[0][..size], &rows[1][..size]], [0.0; 2]);
            let sigma = open.noise.variance(*pixel).sqrt();
            rows.iter_mut().flatten().for_each(|value| *value *= sigma);
            cell.weighed.add_pixel([&rows[0][..size], &rows[1][..size]], [0.0; 2]);
        }
    }
    Some(cells)
}

/// The covariance of all cameras' numbers, one camera's after the other. `None` where no chart's place
/// was found, or something is not determined.
pub(super) fn covariance<L: AdjustableCamera>(
    cameras: &[FittedCamera<L>],
    open: &[CameraUncertainty],
    lenses: Option<&[KnownLens<L>]>,
    train: &Dataset,
) -> Option<DMatrix<f64>> {
    let charts = charts(train);
    if charts.iter().all(Option::is_none) {
        return None;
    }
    let cells = cells(cameras, open, (train, &charts))?;
    let first: Vec<usize> = open
        .iter()
        .scan(0, |sum, open| {
            let first = *sum;
            *sum += open.numbers();
            Some(first)
        })
        .collect();
    let count: usize = open.iter().map(CameraUncertainty::numbers).sum();
    let carried = carried(&cells, (&first, count, charts.len()))?;
    let frame_is_known = train.known().any(|(_, row)| !row.has_estimated_pose());
    let held = if frame_is_known { 0 } else { MOTION };
    let mut normal = DMatrix::zeros(count + held, count + held);
    let mut errors = DMatrix::zeros(count, count);
    for cell in &cells {
        let own = open[cell.camera].numbers();
        // From the camera's numbers and the chart's to all cameras', the chart's taken up.
        let mut through = DMatrix::zeros(count, cell.plain.gradient().len());
        for number in 0..own {
            through[(first[cell.camera] + number, number)] = 1.0;
        }
        if let Some(view) = cell.chart {
            through.columns_mut(own, MOTION).copy_from(&(-&carried[view]));
        }
        let turned = through.transpose();
        let mut block = normal.view_mut((0, 0), (count, count));
        block += product(&product(&through, &cell.plain.matrix()), &turned);
        errors += product(&product(&through, &cell.weighed.matrix()), &turned);
    }
    if let (true, [alone], None) = (held > 0, open, lenses) {
        return of_lens_alone((&normal, &errors), alone);
    }
    if held > 0 {
        let conditions = frame(cameras, open, (train, &first, count))?;
        normal.view_mut((count, 0), (held, count)).copy_from(&conditions);
        normal.view_mut((0, count), (count, held)).copy_from(&conditions.transpose());
    }
    let covariance = match lenses {
        None => {
            let inverse = inverse(normal)?.view((0, 0), (count, count)).into_owned();
            product(&product(&inverse, &errors), &inverse.transpose())
        }
        Some(lenses) => with_lenses((&normal, &errors), open, lenses)?,
    };
    covariance.iter().all(|value| value.is_finite()).then_some(covariance)
}

/// The covariance of a camera that is alone: in its own frame its pose is known.
fn of_lens_alone(
    (normal, errors): (&DMatrix<f64>, &DMatrix<f64>),
    open: &CameraUncertainty,
) -> Option<DMatrix<f64>> {
    let lens: Vec<usize> = (0..open.numbers()).filter(|place| !open.is_of_pose(*place)).collect();
    let of_lens = |all: &DMatrix<f64>| all.select_rows(&lens).select_columns(&lens);
    let inverse = inverse(of_lens(normal))?;
    let found = product(&product(&inverse, &of_lens(errors)), &inverse.transpose());
    let mut covariance = DMatrix::zeros(open.numbers(), open.numbers());
    for (from_row, row) in lens.iter().enumerate() {
        for (from_column, column) in lens.iter().enumerate() {
            covariance[(*row, *column)] = found[(from_row, from_column)];
        }
    }
    covariance.iter().all(|value| value.is_finite()).then_some(covariance)
}

/// The covariance of all cameras' numbers where only poses were adjusted, from the normal equations (with the frame's
/// conditions behind the numbers) and the products of slopes and noise.
fn with_lenses<L>(
    (normal, errors): (&DMatrix<f64>, &DMatrix<f64>),
    open: &[CameraUncertainty],
    lenses: &[KnownLens<L>],
) -> Option<DMatrix<f64>> {
    let is_of_pose: Vec<bool> = open
        .iter()
        .flat_map(|open| (0..open.numbers()).map(|place| open.is_of_pose(place)))
        .collect();
    let places = |pose: bool| -> Vec<usize> {
        (0..is_of_pose.len()).filter(|place| is_of_pose[*place] == pose).collect()
    };
    let (adjusted, known) = (places(true), places(false));
    let conditions = is_of_pose.len()..normal.nrows();
    let unknown: Vec<usize> = adjusted.iter().copied().chain(conditions).collect();
    let of = |matrix: &DMatrix<f64>, rows: &[usize], columns: &[usize]| {
        matrix.select_rows(rows).select_columns(columns)
    };
    let inverse = inverse(of(normal, &unknown, &unknown))?.rows(0, adjusted.len()).into_owned();
    let taken_up = -product(&inverse, &of(normal, &unknown, &known));
    let inverse = inverse.columns(0, adjusted.len()).into_owned();
    let noise =
        product(&product(&inverse, &of(errors, &adjusted, &adjusted)), &inverse.transpose());
    let mut covariance = DMatrix::zeros(known.len(), known.len());
    let mut first = 0;
    for own in lenses.iter().map(KnownLens::matrix) {
        covariance.view_mut((first, first), own.shape()).copy_from(&own);
        first += own.nrows();
    }
    Some(joined((&adjusted, &noise), (&known, &covariance), &taken_up))
}

/// What of each chart's motion the cameras' numbers take up: mixed products times the inverse of the
/// chart's own, a view.
fn carried(
    cells: &[Cell],
    (first, count, views): (&[usize], usize, usize),
) -> Option<Vec<MatrixXx6<f64>>> {
    let mut mixed = vec![MatrixXx6::zeros(count); views];
    let mut own = vec![None; views];
    for cell in cells {
        let Some(view) = cell.chart else { continue };
        let sums = cell.plain.matrix();
        let numbers = sums.nrows() - MOTION;
        let mut part = mixed[view].view_mut((first[cell.camera], 0), (numbers, MOTION));
        part += sums.view((0, numbers), (numbers, MOTION));
        *own[view].get_or_insert_with(Matrix6::zeros) +=
            sums.fixed_view::<MOTION, MOTION>(numbers, numbers);
    }
    let pairs = mixed.into_iter().zip(own);
    pairs
        .map(|(mixed, own)| match own {
            Some(own) => Some(
                product(&mixed, &scaled_inverse(&own)?).fixed_columns::<MOTION>(0).into_owned(),
            ),
            None => Some(mixed),
        })
        .collect()
}

fn scaled_inverse(matrix: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let scale = Matrix6::from_diagonal(&Vector6::from_fn(|k, _| 1.0 / matrix[(k, k)].sqrt()));
    Some(scale * (scale * matrix * scale).cholesky()?.inverse() * scale)
}

/// How far the charts' points, located by the cameras, move and turn as a whole with each number.
fn frame<L: AdjustableCamera>(
    cameras: &[FittedCamera<L>],
    open: &[CameraUncertainty],
    (train, first, count): (&Dataset, &[usize], usize),
) -> Option<DMatrix<f64>> {
    let all = || train.known().map(|(world, _)| world.coords);
    let centre = all().sum::<Vector3>() / all().count().max(1) as f64;
    let mut conditions = DMatrix::zeros(MOTION, count);
    for (world, row) in train.known().filter(|(_, row)| row.seen_by() >= 2) {
        let mut normal = Matrix3::zeros();
        let mut sides = Vec::new();
        for (index, (camera, open)) in cameras.iter().zip(open).enumerate() {
            if !matches!(row.pixels.get(index), Some(Some(_))) {
                continue;
            }
            let (_, by_world) = camera.project_with_jacobian(world)?;
            normal += by_world.transpose() * by_world;
            let slopes = open.slopes(camera, world)?;
            sides.extend(slopes[..open.numbers()].iter().enumerate().map(|(number, slope)| {
                (first[index] + number, by_world.transpose() * Vector2::from(*slope))
            }));
        }
        let inverse = normal.try_inverse()?;
        for (column, side) in sides {
            let by = inverse * side;
            let turned = (world.coords - centre).cross(&by);
            for axis in 0..3 {
                conditions[(axis, column)] += by[axis];
                conditions[(3 + axis, column)] += turned[axis];
            }
        }
    }
    // Each of size one: what matters is what is nothing.
    for mut condition in conditions.row_iter_mut() {
        let size = condition.norm();
        condition /= size;
    }
    Some(conditions)
}
