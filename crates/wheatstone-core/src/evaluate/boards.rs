//! A model judged by boards in the hand: nobody knows where such a board stood, but how long it is, and that it is flat.
//!
//! Points are located one by one, then compared with the board's own coordinates: lengths between them, their distances
//! from a plane, and, after the best rigid motion of each view (Horn 1987, doi:10.1364/JOSAA.4.000629), all of them.

use super::coverage::Ellipsoids;
use crate::{
    Error, Result,
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3, Pose, Vector3, principal_axes},
    method::Reconstructor,
};
use nalgebra::{Matrix3, Vector2};
use serde::Serialize;
use wheatstone_numeric::statistics::{mean, root_mean_square};

/// What boards in the hand say of a model. Lengths are in the unit of the data.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct BoardEvaluation {
    /// The unit of lengths.
    pub unit: String,
    /// Points on boards that two cameras or more saw.
    pub n: usize,
    /// Those of them that were located, in views with four or more.
    pub located: usize,
    /// Distances between neighbours.
    pub neighbours: Lengths,
    /// Distances across the board.
    pub across: Lengths,
    /// Distances from the plane that fits each view best.
    pub flatness: Deviation,
    /// Distances from the board's own points after the best rigid motion of each view, root mean square.
    pub shape: f64,
    /// View by view.
    pub views: Vec<BoardView>,
    /// Reprojection error of each camera for the board placed so, in pixels, root mean square; none for maps that are
    /// no cameras.
    pub cameras: Vec<Option<f64>>,
}

/// Errors of distances between located points: located minus true.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Lengths {
    /// Pairs of points; none has a point in common with another.
    pub n: usize,
    /// Mean of the true distances.
    pub length: f64,
    /// Mean error: over the length, the error of scale.
    pub bias: f64,
    /// Standard deviation of the mean error, by its scatter from view to view; infinite for one view.
    pub bias_sigma: f64,
    /// How the errors scatter about nothing.
    pub error: Deviation,
}

/// A root mean square beside the one that error bars let expect.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Deviation {
    /// Root mean square.
    pub rms: f64,
    /// What the points' standard deviations let expect of it.
    pub expected: f64,
    /// Share of the values within 1.96 standard deviations: 0.95 where error bars hold.
    pub within95: f64,
}

/// One view.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct BoardView {
    /// Its name.
    pub view: String,
    /// Points located.
    pub located: usize,
    /// Mean error of the distances across the board.
    pub bias: f64,
    /// Distances from the best plane, root mean square.
    pub flatness: f64,
    /// Distances from the board's own points, root mean square.
    pub shape: f64,
}

/// A located point of a board.
struct OnBoard<'a> {
    board: Point3,
    found: Point3,
    /// All that is uncertain of it, and the part of it that is the noise of its own pixels.
    covariance: Matrix3<f64>,
    noise: Matrix3<f64>,
    pixels: &'a [Option<Pixel>],
}

/// An error and its standard deviation.
type Judged = (f64, f64);

/// Judges a map by the boards of `data` whose places are not known. Its `ellipsoids` say how much longer than its standard
/// deviations its errors are.
///
/// # Errors
///
/// [`Error::Degenerate`] where no view has four located points.
pub fn evaluate_boards(
    map: &dyn Reconstructor,
    data: &Dataset,
    ellipsoids: &Ellipsoids,
) -> Result<BoardEvaluation> {
    let widened = ellipsoids.radius2_95 / Ellipsoids::NORMAL.radius2_95;
    let is_judged = |row: &&Correspondence| row.board.is_some() && row.seen_by() >= 2;
    let n = data.correspondences.iter().filter(is_judged).count();
    let (mut views, mut all) = (Vec::new(), Errors::default());
    let (mut near, mut far) = (Vec::new(), Vec::new());
    for (view, name) in data.views.iter().enumerate() {
        let rows = data.correspondences.iter().filter(|row| row.view == view).filter(is_judged);
        let points: Vec<OnBoard> = rows.filter_map(|row| on_board(map, row, widened)).collect();
        if points.len() < LEAST {
            continue;
        }
        let Some(own) = Errors::of(map, &points) else { continue };
        let bias = |judged: &[(f64, Judged)]| {
            mean(&judged.iter().map(|(_, (error, _))| *error).collect::<Vec<_>>())
        };
        near.push(bias(&own.neighbours));
        far.push(bias(&own.across));
        views.push(BoardView {
            view: name.clone(),
            located: points.len(),
            bias: bias(&own.across),
            flatness: rms(own.flatness.iter().map(|(off, _)| *off)),
            shape: rms(own.shape.iter().copied()),
        });
        all.extend(own);
    }
    if views.is_empty() {
        return Err(Error::Degenerate {
            problem: "no view has four points of the board that this model locates".into(),
            hint: "record the board where two cameras or more see it".into(),
        });
    }
    let camera = |camera: usize| {
        let own: Vec<f64> =
            all.pixels.iter().filter(|(of, _)| *of == camera).map(|(_, off)| *off).collect();
        (!own.is_empty()).then(|| rms(own.into_iter()) / std::f64::consts::SQRT_2)
    };
    Ok(BoardEvaluation {
        unit: data.unit.clone(),
        n,
        located: views.iter().map(|view| view.located).sum(),
        neighbours: lengths(&all.neighbours, &near),
        across: lengths(&all.across, &far),
        flatness: deviation(&all.flatness),
        shape: rms(all.shape.into_iter()),
        views,
        cameras: (0..data.cameras).map(camera).collect(),
    })
}

/// Points that fit a plane and leave something to judge.
const LEAST: usize = 4;

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    root_mean_square(&values.collect::<Vec<_>>())
}

fn on_board<'a>(
    map: &dyn Reconstructor,
    row: &'a Correspondence,
    widened: f64,
) -> Option<OnBoard<'a>> {
    let [x, y] = row.board?;
    let found = map.locate(&row.pixels)?;
    let mut information = Matrix3::zeros();
    let mut is_camera = true;
    for (camera, pixel) in row.pixels.iter().enumerate() {
        let Some(pixel) = pixel else { continue };
        let slopes = map.project(camera, found.point).map(|(_, slopes)| slopes);
        let sigma = map.pixel_sigma(camera, *pixel, found.point);
        match slopes.zip(sigma) {
            Some((slopes, sigma)) => information += slopes.transpose() * slopes / (sigma * sigma),
            None => is_camera = false,
        }
    }
    let noise = information.try_inverse().filter(|_| is_camera).unwrap_or(found.covariance);
    Some(OnBoard {
        board: Point3::new(x, y, 0.0),
        found: found.point,
        covariance: found.covariance * widened,
        noise,
        pixels: &row.pixels,
    })
}

/// Errors of one view, or of many.
#[derive(Default)]
struct Errors {
    /// True length, and the error.
    neighbours: Vec<(f64, Judged)>,
    across: Vec<(f64, Judged)>,
    flatness: Vec<Judged>,
    shape: Vec<f64>,
    /// The camera and the length of the error in pixels.
    pixels: Vec<(usize, f64)>,
}

impl Errors {
    /// `None` for points on a line.
    fn of(map: &dyn Reconstructor, points: &[OnBoard]) -> Option<Self> {
        let both: Vec<(Point3, Point3)> = points.iter().map(|p| (p.board, p.found)).collect();
        let pose = Pose::aligning(&both)?;
        // What is not known of the cameras moves neighbours alike.
        let near = |point: &OnBoard| point.noise;
        let far = |point: &OnBoard| point.covariance;
        let mut errors = Self {
            neighbours: pairs(points, false).map(|two| length(two, &pose, near)).collect(),
            across: pairs(points, true).map(|two| length(two, &pose, far)).collect(),
            flatness: flatness(points),
            ..Self::default()
        };
        for point in points {
            let there = pose.transform(point.board);
            errors.shape.push((point.found - there).norm());
            for (camera, pixel) in point.pixels.iter().enumerate() {
                let seen = pixel.and_then(|pixel| {
                    let off: Vector2<f64> = map.project(camera, there)?.0 - pixel;
                    Some(off.norm())
                });
                errors.pixels.extend(seen.map(|off| (camera, off)));
            }
        }
        Some(errors)
    }

    fn extend(&mut self, other: Self) {
        self.neighbours.extend(other.neighbours);
        self.across.extend(other.across);
        self.flatness.extend(other.flatness);
        self.shape.extend(other.shape);
        self.pixels.extend(other.pixels);
    }
}

/// Pairs of points that have none in common: each point, in order, with the nearest or the farthest one that is left.
fn pairs<'a, 'b>(
    points: &'a [OnBoard<'b>],
    far: bool,
) -> impl Iterator<Item = [&'a OnBoard<'b>; 2]> {
    let mut left: Vec<&OnBoard> = points.iter().collect();
    std::iter::from_fn(move || {
        let first = (left.len() > 1).then(|| left.remove(0))?;
        let distance = |index: &usize| {
            let distance = (left[*index].board - first.board).norm();
            if far { -distance } else { distance }
        };
        let second = (0..left.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        Some([first, left.remove(second)])
    })
}

/// The true length of a pair of points, and the error of the located one along the board as it stood: noise across a
/// distance would lengthen it.
fn length(
    [a, b]: [&OnBoard; 2],
    pose: &Pose,
    covariance: impl Fn(&OnBoard) -> Matrix3<f64>,
) -> (f64, Judged) {
    let apart = a.board - b.board;
    let along = pose.rotation * apart.normalize();
    let error = along.dot(&(a.found - b.found)) - apart.norm();
    let variance = along.dot(&((covariance(a) + covariance(b)) * along));
    (apart.norm(), (error, variance.sqrt()))
}

/// Distances from the best plane, with their standard deviations.
fn flatness(points: &[OnBoard]) -> Vec<Judged> {
    let found: Vec<Point3> = points.iter().map(|point| point.found).collect();
    let (middle, [.., normal], _) = principal_axes(&found);
    let normal: Vector3 = normal;
    // The plane has three numbers, which take up their share of the scatter.
    let freedom = ((points.len() - 3) as f64 / points.len() as f64).sqrt();
    let of = |point: &OnBoard| {
        let sigma = normal.dot(&(point.noise * normal)).sqrt() * freedom;
        ((point.found - middle).dot(&normal), sigma)
    };
    points.iter().map(of).collect()
}

/// Of pairs of points, and the mean error of each view.
fn lengths(judged: &[(f64, Judged)], views: &[f64]) -> Lengths {
    let count = views.len() as f64;
    let middle = mean(views);
    let squares: f64 = views.iter().map(|bias| (bias - middle).powi(2)).sum();
    let bias_sigma =
        if views.len() > 1 { (squares / (count - 1.0) / count).sqrt() } else { f64::INFINITY };
    let errors: Vec<Judged> = judged.iter().map(|(_, error)| *error).collect();
    Lengths {
        n: judged.len(),
        length: mean(&judged.iter().map(|(length, _)| *length).collect::<Vec<_>>()),
        bias: mean(&errors.iter().map(|(error, _)| *error).collect::<Vec<_>>()),
        bias_sigma,
        error: deviation(&errors),
    }
}

fn deviation(judged: &[Judged]) -> Deviation {
    /// 95 % of a normal distribution.
    const QUANTILE: f64 = 1.96;
    let within = judged.iter().filter(|(error, sigma)| error.abs() <= QUANTILE * sigma).count();
    Deviation {
        rms: rms(judged.iter().map(|(error, _)| *error)),
        expected: rms(judged.iter().map(|(_, sigma)| *sigma)),
        within95: within as f64 / judged.len().max(1) as f64,
    }
}
