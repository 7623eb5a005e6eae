//! Whether a chart held by hand has the shape that was declared.
//!
//! Cameras and charts adjusted together follow a chart that is printed longer than wide, whose tags are farther apart
//! than was said, or that is not flat: focal lengths and distances take on a part of it, and the reprojection error
//! alone tells that something is wrong.
//!
//! A stretch along one side is found by adjusting everything to stretched charts. Other shapes are found on the chart:
//! where its points, each moved by what its own residuals ask for on average, would leave only a small part of them,
//! it is the chart that errs. The residuals of a wrong lens stay with the picture, those of a wrong place with the
//! view.

use super::{
    chart_poses::EstimatedPoses,
    checks::{self, Finding},
};
use crate::{
    Error, Result,
    dataset::{Dataset, chart_pose},
    fit::bundle::{self, BundleSettings, Lenses},
    geometry::Vector3,
    method::{AnyMethod, Reconstructor},
};
use nalgebra::{DMatrix, DVector, Matrix2x3, Matrix3, Vector2};
use std::collections::BTreeMap;
use wheatstone_numeric::{progress::Progress, statistics::median};

/// The share of the squared residuals that the chart's shape explains, from which on it is said: the reprojection
/// error of a chart of the right shape would be 0.6 of what it is. Five sets of real pictures stay below; two rendered
/// grids of tags with wrong gaps come to 0.99.
const EXPLAINED: f64 = 0.64;

/// Residuals of so many times the median are gross errors.
const GROSS: f64 = 5.0;

/// Views needed to tell the chart from where it stood: of fewer, moves of its points could explain anything.
const VIEWS: usize = 5;

/// A reprojection error below this, in pixels, is none that anybody would mend.
const LEAST: f64 = 0.01;

/// By this the chart is stretched along its rows to see what the reprojection error does.
const STRETCH: f64 = 0.01;

/// Stretches that differ by less are one.
const SETTLED: f64 = 5e-4;

/// Stretches that are tried beside the first three, at most.
const ROUNDS: usize = 6;

/// A stretch is said that leaves less than this share of the squared residuals. Of five sets of real pictures the
/// best stretch leaves 0.96 to 1.02.
const LEFT: f64 = 0.75;

/// The warning, where the chart of data that were placed has another shape; `recorded` is what they were placed from.
///
/// # Errors
///
/// [`Error::Cancelled`].
pub(super) fn examine(
    recorded: &Dataset,
    (placed, estimated): &(Dataset, EstimatedPoses),
    settings: BundleSettings,
    progress: &dyn Progress,
) -> Result<Option<Finding>> {
    if estimated.gauge.is_none() || estimated.views.len() < VIEWS || estimated.rms < LEAST {
        return Ok(None);
    }
    if let Some(stretch) = stretch(recorded, estimated, settings, progress)? {
        return Ok(Some(stretched(stretch)));
    }
    let name = match (estimated.freed, &*estimated.lens) {
        (true, _) => "neural-camera",
        (_, "kannala-brandt") => "kannala-brandt",
        _ => "brown",
    };
    let map = match AnyMethod::named(name)?.fit(placed, 0, progress) {
        Ok(fit) => fit.reconstructor,
        Err(Error::Cancelled) => return Err(Error::Cancelled),
        Err(_) => return Ok(None),
    };
    let found = Shape::of(&residuals(placed, &*map), placed);
    // Of the adjustment: a pose a chart; a pose, a focal length and two coefficients or so a camera.
    let numbers = 6 * estimated.views.len() + 9 * placed.cameras;
    Ok(found.and_then(|found| found.finding(numbers, &placed.unit)))
}

/// A pixel's distance from where its camera sees the point, and what that is by the chart's three directions.
struct Residual {
    /// The point of the chart, by its coordinates' bits: the same in all views.
    point: [u64; 2],
    off: Vector2<f64>,
    by_chart: Matrix2x3<f64>,
}

fn residuals(placed: &Dataset, map: &dyn Reconstructor) -> Vec<Residual> {
    let mut all = Vec::new();
    for view in 0..placed.views.len().max(1) {
        let rows = || placed.correspondences.iter().filter(move |row| row.view == view);
        let Some(pose) = chart_pose(rows()) else { continue };
        for row in rows() {
            let (Some([x, y]), Some(world)) = (row.board, row.world) else { continue };
            for (camera, pixel) in row.pixels.iter().enumerate() {
                let predicted = pixel.and_then(|pixel| Some((pixel, map.project(camera, world)?)));
                let Some((pixel, (at, by_world))) = predicted else { continue };
                all.push(Residual {
                    point: [x.to_bits(), y.to_bits()],
                    off: pixel - at,
                    by_chart: by_world * pose.rotation,
                });
            }
        }
    }
    let typical = median(&all.iter().map(|one| one.off.norm()).collect::<Vec<_>>());
    all.retain(|one| one.off.norm() < GROSS * typical);
    all
}

/// Normal equations of one point's move on the chart.
#[derive(Clone)]
struct Sums {
    matrix: Matrix3<f64>,
    vector: Vector3,
}

/// What the residuals ask for at each point of the chart.
struct Shape {
    points: BTreeMap<[u64; 2], Sums>,
    /// Sum of the squared residuals, and how many numbers they are.
    squares: f64,
    count: usize,
}

impl Shape {
    fn of(residuals: &[Residual], placed: &Dataset) -> Option<Self> {
        let zero = Sums { matrix: Matrix3::zeros(), vector: Vector3::zeros() };
        let mut points: BTreeMap<[u64; 2], Sums> = BTreeMap::new();
        for one in residuals {
            let sums = points.entry(one.point).or_insert_with(|| zero.clone());
            sums.matrix += one.by_chart.transpose() * one.by_chart;
            sums.vector += one.by_chart.transpose() * one.off;
        }
        let squares = residuals.iter().map(|one| one.off.norm_squared()).sum();
        let enough = residuals.len() >= 2 * VIEWS * placed.cameras.min(2) && squares > 0.0;
        enough.then_some(Self { points, squares, count: 2 * residuals.len() })
    }

    /// The move of each point in the chart's plane (2) or in space (3).
    fn moves(&self, dimensions: usize) -> impl Iterator<Item = ([f64; 2], DVector<f64>, f64)> {
        self.points.iter().filter_map(move |(point, sums)| {
            let matrix = DMatrix::from_fn(dimensions, dimensions, |i, j| sums.matrix[(i, j)]);
            let vector = DVector::from_fn(dimensions, |i, _| sums.vector[i]);
            let moved = matrix.cholesky()?.solve(&vector);
            let explained = moved.dot(&vector);
            Some((point.map(f64::from_bits), moved, explained))
        })
    }

    /// The share of the residuals' variance that moves of the points would take away, where the adjustment has so many
    /// numbers; 0 where moves would explain anything.
    fn explained(&self, dimensions: usize, numbers: usize) -> f64 {
        let explained: f64 = self.moves(dimensions).map(|(_, _, explained)| explained).sum();
        let before = self.count as f64 - numbers as f64;
        let after = before - (dimensions * self.points.len()) as f64;
        if after < 0.5 * before {
            return 0.0;
        }
        1.0 - (self.squares - explained) / after * before / self.squares
    }

    /// Root mean square of the moves.
    fn size(&self, dimensions: usize) -> f64 {
        let squares: Vec<f64> =
            self.moves(dimensions).map(|(_, moved, _)| moved.norm_squared()).collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    }

    /// The warning, if the shape explains enough.
    fn finding(&self, numbers: usize, unit: &str) -> Option<Finding> {
        let [flat, bent] = [2, 3].map(|dimensions| self.explained(dimensions, numbers));
        if flat.max(bent) < EXPLAINED {
            return None;
        }
        let share =
            ("share of the squared residuals that its shape explains (%)", 100.0 * flat.max(bent));
        Some(if flat >= EXPLAINED {
            let text = format!(
                "the chart has not the shape that was declared: its points lie elsewhere by at least {} {unit} rms, in every picture alike",
                short(self.size(2))
            );
            let hint = "measure it: the pitch along rows and along columns, the size of its tags and the gaps between them";
            checks::other_shape(text, share, hint)
        } else {
            let text = format!(
                "the chart is not flat: its points lie beside its plane by about {} {unit} rms, in every picture alike",
                short(self.size(3))
            );
            checks::other_shape(text, share, "mount it on glass or a thick plate")
        })
    }
}

/// By which factor the chart is longer along its rows than along its columns, against what was declared, where that
/// explains the residuals: the mean square of an adjustment has its least there, by successive parabolas.
fn stretch(
    recorded: &Dataset,
    estimated: &EstimatedPoses,
    settings: BundleSettings,
    progress: &dyn Progress,
) -> Result<Option<f64>> {
    let lenses =
        if estimated.lens == "kannala-brandt" { Lenses::KannalaBrandt } else { Lenses::Brown };
    let settings = BundleSettings { lenses, ..settings };
    let mean_square = |by: f64| {
        let mut data = recorded.clone();
        for row in &mut data.correspondences {
            row.board = row.board.map(|[x, y]| [x * by, y]);
        }
        match bundle::solve(&data, settings, progress) {
            Ok(solved) => Ok(solved.rms * solved.rms),
            Err(Error::Cancelled) => Err(Error::Cancelled),
            Err(_) => Ok(f64::NAN),
        }
    };
    let mut tried = Vec::new();
    for by in [1.0 - STRETCH, 1.0, 1.0 + STRETCH] {
        tried.push((by, mean_square(by)?));
    }
    let same = tried[1].1;
    for _ in 0..ROUNDS {
        let is_new = |by: &f64| tried.iter().all(|one| (one.0 - by).abs() > SETTLED);
        let Some(next) = least_of(&tried).filter(is_new) else { break };
        tried.push((next, mean_square(next)?));
        tried.sort_by(|a, b| a.1.total_cmp(&b.1));
        tried.truncate(3);
    }
    let best = tried.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    Ok(best.filter(|best| best.1 < LEFT * same).map(|best| best.0))
}

/// Where the parabola through three points has its least value, not far beyond them; where it has none, as beyond a
/// great stretch, as far downhill.
fn least_of(points: &[(f64, f64)]) -> Option<f64> {
    let [(a, at_a), (b, at_b), (c, at_c)] = *points else { return None };
    let slopes = [(at_b - at_a) / (b - a), (at_c - at_b) / (c - b)];
    let curvature = (slopes[1] - slopes[0]) / (c - a);
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let reach = high - low;
    let least = if curvature > 0.0 {
        0.5 * (a + b - slopes[0] / curvature)
    } else {
        let best = points.iter().min_by(|a, b| a.1.total_cmp(&b.1))?.0;
        if best > 0.5 * (low + high) { f64::INFINITY } else { f64::NEG_INFINITY }
    };
    (!least.is_nan()).then(|| least.clamp(low - reach, high + reach))
}

/// Two significant digits.
fn short(value: f64) -> String {
    let digits = (1.0 - libm::log10(value).floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}

fn stretched(by: f64) -> Finding {
    let percent = 100.0 * (by - 1.0);
    let text = format!(
        "the chart is {:.2} % {} along x, against along y, than was declared: focal lengths and distances are wrong by as much",
        percent.abs(),
        if percent > 0.0 { "longer" } else { "shorter" }
    );
    let hint = "measure the pitch along rows and along columns, over as many squares as there are; print without scaling";
    checks::other_shape(text, ("stretch along x (%)", percent), hint)
}
