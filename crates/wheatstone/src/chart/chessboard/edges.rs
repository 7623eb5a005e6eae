//! Where exactly a corner is, once its board is known: two crossing edges, fitted to the grey values about it.
//!
//! The lattice tells which way the edges run and how the lens bends them, so that the window may be wide; uneven
//! light is fitted beside them, which would draw a saddle aside by its slope times the window's square.

use super::{
    saddle::{OWN_FAULT, noise},
    seed::Labels,
};
use crate::{geometry::Pixel, imaging::GrayImage};
use nalgebra::{SMatrix, SVector, Vector2};

/// The window's radius as a share of the distance of the lattice's lines, and its bounds in pixels.
///
/// Measured on rendered boards (see the decision on speed): a little less than half keeps the next lines out of it,
/// under blur too; wider ones cost more time than they gain.
const WINDOW: (f64, f64, f64) = (0.4, 4.5, 10.0);
/// Steps of the fit: good ones need three.
const MOST_STEPS: usize = 8;
/// In pixels: the fit has settled.
const SETTLED: f64 = 1e-3;
/// In pixels: the width of an edge to begin with, to each side. A pixel's own width and a lens make 1 to 2.
const EDGE: f64 = 1.7;
/// The narrowest edge, in pixels: half a pixel is its own blur.
const LEAST_EDGE: f64 = 0.6;
/// In pixels: farther from its saddle, and the fit has found something else.
const MOST_MOVED: f64 = 0.5;
/// What edges leave of the grey values at most: as a multiple of the noise, and as a share of the contrast. Rendered
/// and photographed edges leave 1.5 and 0.05; marks inside the squares leave 0.3.
const MOST_LEFT: (f64, f64) = (2.0, 0.1);
/// The widest edge as a share of the window: beyond, blur hides what is fitted.
const MOST_EDGE: f64 = 0.7;
/// Sine of the least angle between the edges.
const LEAST_ANGLE: f64 = 0.25;

/// A line of the lattice at one of its corners.
struct Line {
    /// Unit vector along it.
    along: Vector2<f64>,
    /// Unit vector across it.
    across: Vector2<f64>,
    /// Its curvature, towards `across`, by pixel.
    bend: f64,
    /// Distance to the next corner.
    step: f64,
}

impl Line {
    /// The line through a corner in this direction.
    fn through(labels: &Labels, (column, row): (i32, i32), way: (i32, i32)) -> Option<Self> {
        let at = |n: i32| labels.get(&(column + n * way.0, row + n * way.1)).map(|at| at.coords);
        let here = at(0)?;
        let (step, change) = match (at(-1), at(1)) {
            (Some(behind), Some(ahead)) => ((ahead - behind) / 2.0, ahead - 2.0 * here + behind),
            (None, Some(ahead)) => {
                let change = at(2).map_or_else(Vector2::zeros, |next| next - 2.0 * ahead + here);
                (ahead - here - change / 2.0, change)
            }
            (Some(behind), None) => {
                let change = at(-2).map_or_else(Vector2::zeros, |last| here - 2.0 * behind + last);
                (here - behind + change / 2.0, change)
            }
            (None, None) => return None,
        };
        let length = step.norm();
        let along = step / length;
        let across = Vector2::new(-along.y, along.x);
        Some(Self { along, across, bend: across.dot(&change) / (length * length), step: length })
    }

    /// How far a place is from the line through `corner`, and what that becomes as the corner moves.
    fn distance(&self, from_corner: Vector2<f64>) -> (f64, Vector2<f64>) {
        let along = self.along.dot(&from_corner);
        let distance = self.across.dot(&from_corner) - 0.5 * self.bend * along * along;
        (distance, self.bend * along * self.along - self.across)
    }
}

/// An edge's height at a distance from its middle, as a share of `width`, from -1 to 1; and its slope.
fn edge(distance: f64, width: f64) -> (f64, f64) {
    let x = distance / width;
    if x.abs() >= 1.0 {
        return (x.signum(), 0.0);
    }
    (0.5 * x * (3.0 - x * x), 1.5 * (1.0 - x * x) / width)
}

/// What is fitted: the corner's two coordinates, the mean light and its slopes, the contrast, the edges' width.
type Unknowns = SVector<f64, 7>;

/// The normal equations of a step: products of slopes, their products with what is left, and its squares.
struct Step {
    normal: SMatrix<f64, 7, 7>,
    right: Unknowns,
    left: f64,
    count: usize,
}

/// Two edges that cross.
struct Cross<'a> {
    image: &'a GrayImage,
    lines: [Line; 2],
    start: Pixel,
    radius: f64,
}

impl Cross<'_> {
    /// The pixels of the window, with their places from its middle.
    fn each(&self, mut visit: impl FnMut(Vector2<f64>, f64)) {
        let reach = self.radius as isize;
        let (column, row) = (self.start.x.round() as isize, self.start.y.round() as isize);
        for y in row - reach..=row + reach {
            let down = y as f64 - self.start.y;
            let half = (self.radius * self.radius - down * down).max(0.0).sqrt() as isize;
            let first = column - half;
            let values = &self.image.row(y as usize)[first as usize..=(column + half) as usize];
            for (x, value) in (first..).zip(values) {
                visit(Vector2::new(x as f64 - self.start.x, down), f64::from(*value));
            }
        }
    }

    /// Mean and contrast, to begin with.
    fn first(&self) -> Unknowns {
        let (mut count, mut sum, mut heights, mut squares, mut products) = (0.0, 0.0, 0.0, 0.0, 0.0);
        self.each(|place, value| {
            let [u, v] = [0, 1].map(|line| edge(self.lines[line].distance(place).0, EDGE).0);
            let height = u * v;
            count += 1.0;
            sum += value;
            heights += height;
            squares += height * height;
            products += height * value;
        });
        let contrast = (products - heights * sum / count) / (squares - heights * heights / count);
        let mean = (sum - contrast * heights) / count;
        Unknowns::from([0.0, 0.0, mean, 0.0, 0.0, contrast, EDGE])
    }

    fn step(&self, now: &Unknowns) -> Step {
        let [x, y, mean, slope_x, slope_y, contrast, width] = *now.as_ref();
        // Light multiplies what the board returns: its slopes are steeper on bright squares.
        let ratio = (contrast / mean.max(1.0)).clamp(-1.0, 1.0);
        let mut step =
            Step { normal: SMatrix::zeros(), right: SVector::zeros(), left: 0.0, count: 0 };
        self.each(|place, value| {
            let from_corner = place - Vector2::new(x, y);
            let [(d, move_d), (e, move_e)] = [0, 1].map(|line| self.lines[line].distance(from_corner));
            let ((u, slope_u), (v, slope_v)) = (edge(d, width), edge(e, width));
            let height = u * v;
            let lit = 1.0 + ratio * height;
            let light = slope_x * place.x + slope_y * place.y;
            let left = value - mean - contrast * height - light * lit;
            step.left += left * left;
            step.count += 1;
            let moved = contrast * (slope_u * v * move_d + u * slope_v * move_e);
            let wider = -contrast * (slope_u * v * d + u * slope_v * e) / width;
            let slopes = [moved.x, moved.y, 1.0, place.x * lit, place.y * lit, height, wider];
            // In the middle of a square nothing tells where the corner is.
            let used = if slope_u == 0.0 && slope_v == 0.0 { 2..6 } else { 0..7 };
            for i in used.clone() {
                step.right[i] += slopes[i] * left;
                for j in used.start..=i {
                    step.normal[(i, j)] += slopes[i] * slopes[j];
                }
            }
        });
        step
    }

    /// The corner and its standard deviation along each axis.
    fn fit(&self) -> Option<(Pixel, f64)> {
        let mut now = self.first();
        for _ in 0..MOST_STEPS {
            let step = self.step(&now);
            let factors = step.normal.cholesky()?;
            let mut change = factors.solve(&step.right);
            let length = change.fixed_rows::<2>(0).norm();
            change *= (MOST_MOVED / length).min(1.0);
            now += change;
            now[6] = now[6].clamp(LEAST_EDGE, self.radius);
            if !(now[0].hypot(now[1]) <= MOST_MOVED) {
                return None;
            }
            if length < SETTLED {
                let variance = step.left / (step.count as f64 - 7.0);
                let plain = MOST_LEFT.1 * now[5].abs();
                let left = variance.sqrt() - plain;
                let clear = left <= 0.0 || left <= MOST_LEFT.0 * noise(self.image, self.start);
                let inverse = factors.inverse();
                let own = variance * (inverse[(0, 0)] + inverse[(1, 1)]) / 2.0;
                let clear = clear && now[6] < MOST_EDGE * self.radius;
                let at = self.start + Vector2::new(now[0], now[1]);
                return clear.then(|| (at, (own + OWN_FAULT * OWN_FAULT).sqrt()));
            }
        }
        None
    }
}

/// The corner with this label, and its standard deviation along each axis in pixels; `None` where squares are too small,
/// too blurred or not plain, or the picture ends.
pub(super) fn crossing(image: &GrayImage, labels: &Labels, label: (i32, i32)) -> Option<(Pixel, f64)> {
    let start = *labels.get(&label)?;
    let lines = [Line::through(labels, label, (1, 0))?, Line::through(labels, label, (0, 1))?];
    let sine = lines[0].along.perp(&lines[1].along).abs();
    let apart = lines[0].step.min(lines[1].step) * sine;
    let radius = (WINDOW.0 * apart).min(WINDOW.2);
    if radius < WINDOW.1 || sine < LEAST_ANGLE || !image.contains(start, radius + 1.0) {
        return None;
    }
    Cross { image, lines, start, radius }.fit()
}
