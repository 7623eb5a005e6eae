//! Where exactly a corner is, once its board is known: two crossing edges, fitted to the grey values about it.
//!
//! The lattice tells which way the edges run and how the lens bends them, so that the window may be wide; uneven
//! light is fitted beside them, which would draw a saddle aside by its slope times the window's square.

use super::{
    saddle::{OWN_FAULT, noise},
    seed::Labels,
};
use crate::imaging::GrayImage;
use nalgebra::{SMatrix, SVector, Vector2};
use std::cmp::Ordering;
use wheatstone_core::geometry::Pixel;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// The window's radius as a share of the distance of the lattice's lines, and the least radius in pixels: a little
/// less than half keeps the next lines out of it, under blur too.
const WINDOW: (f64, f64) = (0.4, 4.5);
/// The widest window as a share of the picture's diagonal, and bounds in pixels. Measured on rendered boards (see the
/// decision on speed): wider ones cost more time than they gain, and small pictures have little of it.
const WIDEST: (f64, f64, f64) = (0.01, 8.0, 12.0);
/// Steps of the fit: good ones need three.
const MOST_STEPS: usize = 8;
/// In pixels: after so short a step the next is a tenth of it, and a tenth of what noise does.
const SETTLED: f64 = 3e-3;
/// In pixels: the width of an edge to begin with, to each side. A pixel's own width and a lens make 1 to 2.
const EDGE: f64 = 1.7;
/// The narrowest edge, in pixels: half a pixel is its own blur.
const LEAST_EDGE: f64 = 0.6;
/// In pixels: farther from its saddle, and the fit has found something else.
const MOST_MOVED: f64 = 0.5;
/// What edges leave of the grey values at most: as a multiple of the noise, and as a share of the contrast. Judged, not
/// measured: noise itself leaves 1, and a mark over a tenth of the window as much as a third.
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
    curvature: f64,
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
        Some(Self {
            along,
            across,
            curvature: across.dot(&change) / (length * length),
            step: length,
        })
    }

    /// How far a place is from the line through `corner`, and what that becomes as the corner moves.
    #[inline(always)]
    fn distance(&self, from_corner: Vector2<f64>) -> (f64, Vector2<f64>) {
        let along = self.along.dot(&from_corner);
        let distance = self.across.dot(&from_corner) - 0.5 * self.curvature * along * along;
        (distance, self.curvature * along * self.along - self.across)
    }
}

/// An edge's height at a distance from its middle, as a share of `width`, from -1 to 1; and its slope.
#[inline(always)]
fn edge(distance: f64, width: f64) -> (f64, f64) {
    let x = distance / width;
    if x.abs() >= 1.0 {
        return (x.signum(), 0.0);
    }
    (0.5 * x * (3.0 - x * x), 1.5 * (1.0 - x * x) / width)
}

/// What is fitted: the mean light, its two slopes, the contrast, the corner's two coordinates, the edges' width.
type Unknowns = SVector<f64, 7>;
/// Places of the unknowns among the sums.
const PLACES: [usize; 7] = [0, 1, 2, 3, 5, 6, 7];
/// The place of what is left; in the middle of a square nothing after it tells anything.
const LEFT: usize = 4;

/// Two edges that cross.
struct Cross<'a> {
    image: &'a GrayImage,
    lines: [Line; 2],
    start: Pixel,
    radius: f64,
}

impl Cross<'_> {
    /// The pixels of every so many rows of the window, with their places from its middle.
    #[inline(always)]
    fn each(&self, rows: usize, mut visit: impl FnMut(Vector2<f64>, f64)) {
        let reach = self.radius as isize;
        let (column, row) = (self.start.x.round() as isize, self.start.y.round() as isize);
        for y in (row - reach..=row + reach).step_by(rows) {
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
        let (mut count, mut sum, mut heights, mut squares, mut products) =
            (0.0, 0.0, 0.0, 0.0, 0.0);
        self.each(3, |place, value| {
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
        Unknowns::from([mean, 0.0, 0.0, contrast, 0.0, 0.0, EDGE])
    }

    /// The corner and its standard deviation along each axis.
    fn fit(&self) -> Option<(Pixel, f64)> {
        let mut now = self.first();
        for _ in 0..MOST_STEPS {
            let sums = on_widest(Sums { cross: self, now: &now });
            let of = |row: usize, column: usize| sums.products[row][column];
            let normal = SMatrix::<f64, 7, 7>::from_fn(|i, j| of(PLACES[i], PLACES[j]));
            let right = Unknowns::from_fn(|i, _| of(PLACES[i], LEFT));
            let factors = normal.cholesky()?;
            let mut change = factors.solve(&right);
            let length = Vector2::new(change[4], change[5]).norm();
            change *= (MOST_MOVED / length).min(1.0);
            now += change;
            now[6] = now[6].clamp(LEAST_EDGE, self.radius);
            let moved = Vector2::new(now[4], now[5]);
            // Numbers that are none do not get on either.
            if moved.norm().partial_cmp(&MOST_MOVED) != Some(Ordering::Less) {
                return None;
            }
            if length < SETTLED {
                let variance = of(LEFT, LEFT) / (sums.count as f64 - 7.0);
                let inverse = factors.inverse();
                let own = variance * (inverse[(4, 4)] + inverse[(5, 5)]) / 2.0;
                let sigma = (own + OWN_FAULT * OWN_FAULT).sqrt();
                return self.is_plain(&now, variance.sqrt()).then(|| (self.start + moved, sigma));
            }
        }
        None
    }

    /// Whether edges are all that there is, by the standard deviation of what they leave.
    fn is_plain(&self, now: &Unknowns, left: f64) -> bool {
        let more = left - MOST_LEFT.1 * now[3].abs();
        let plain = more <= 0.0 || more <= MOST_LEFT.0 * noise(self.image, self.start);
        plain && now[6] < MOST_EDGE * self.radius
    }
}

/// The sums that a step of the fit is taken from.
struct Sums<'a> {
    cross: &'a Cross<'a>,
    now: &'a Unknowns,
}

/// Products of the model's slopes and of what it leaves, summed over the window.
struct Summed {
    products: [[f64; 8]; 8],
    count: usize,
}

impl WithSimd for Sums<'_> {
    type Output = Summed;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Summed {
        let [mean, slope_x, slope_y, contrast, x, y, width] = *self.now.as_ref();
        // Light multiplies what the board returns: its slopes are steeper on bright squares.
        let ratio = (contrast / mean.max(1.0)).clamp(-1.0, 1.0);
        let lines = &self.cross.lines;
        let mut summed = Summed { products: [[0.0; 8]; 8], count: 0 };
        self.cross.each(1, |place, value| {
            let from_corner = place - Vector2::new(x, y);
            let ((d, move_d), (e, move_e)) =
                (lines[0].distance(from_corner), lines[1].distance(from_corner));
            let ((u, slope_u), (v, slope_v)) = (edge(d, width), edge(e, width));
            let height = u * v;
            let lit = 1.0 + ratio * height;
            let light = slope_x * place.x + slope_y * place.y;
            let left = value - mean - contrast * height - light * lit;
            summed.count += 1;
            let mut terms = [1.0, place.x * lit, place.y * lit, height, left, 0.0, 0.0, 0.0];
            let mut used = LEFT + 1;
            if slope_u != 0.0 || slope_v != 0.0 {
                let moved = contrast * (slope_u * v * move_d + u * slope_v * move_e);
                let wider = -contrast * (slope_u * v * d + u * slope_v * e) / width;
                terms[LEFT + 1..].copy_from_slice(&[moved.x, moved.y, wider]);
                used = terms.len();
            }
            for (sums, one) in summed.products[..used].iter_mut().zip(terms) {
                for (sum, other) in sums.iter_mut().zip(terms) {
                    *sum += one * other;
                }
            }
        });
        // Where rows were left out, their columns were not.
        for row in LEFT + 1..8 {
            for column in 0..=LEFT {
                summed.products[row][column] = summed.products[column][row];
            }
        }
        summed
    }
}

/// The corner with this label, and its standard deviation along each axis in pixels; `None` where squares are too small,
/// too blurred or not plain, or the picture ends.
pub(super) fn crossing(
    image: &GrayImage,
    labels: &Labels,
    label: (i32, i32),
) -> Option<(Pixel, f64)> {
    let start = *labels.get(&label)?;
    let lines = [Line::through(labels, label, (1, 0))?, Line::through(labels, label, (0, 1))?];
    let sine = lines[0].along.perp(&lines[1].along).abs();
    let apart = lines[0].step.min(lines[1].step) * sine;
    let diagonal = Vector2::new(image.width() as f64, image.height() as f64).norm();
    let radius = (WINDOW.0 * apart).min((WIDEST.0 * diagonal).clamp(WIDEST.1, WIDEST.2));
    if radius < WINDOW.1 || sine < LEAST_ANGLE || !image.contains(start, radius + 1.0) {
        return None;
    }
    Cross { image, lines, start, radius }.fit()
}
