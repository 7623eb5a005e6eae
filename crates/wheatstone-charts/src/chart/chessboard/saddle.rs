//! Where exactly a corner of a chessboard is: the saddle of the grey values around it.

use crate::imaging::GrayImage;
use nalgebra::{Matrix2, Matrix6, Vector2, Vector6};
use wheatstone_core::geometry::Pixel;

/// Steps after which a search that has not settled is given up: good ones need five.
const MOST_STEPS: usize = 20;
/// In pixels. A hundred times finer than the noise of good pictures leaves a corner uncertain.
const SETTLED: f64 = 1e-4;

/// The saddle nearest to `start`, seen through a Gaussian window of `sigma` pixels that is centred
/// on the saddle itself; `None` where there is none within two `sigma` or the window leaves the
/// picture.
///
/// The grey values are fitted by a quadric as by Lucchese and Mitra (2002,
/// doi:10.1109/APCCAS.2002.1115151). Four squares are symmetric about their corner, so a window that
/// is symmetric about it too leaves no bias, however badly a quadric describes them.
pub(in crate::chart) fn refine(image: &GrayImage, start: Pixel, sigma: f64) -> Option<Pixel> {
    let mut at = start;
    for _ in 0..MOST_STEPS {
        let step = saddle_from(image, at, sigma)?;
        at += step;
        if (at - start).norm() > 2.0 * sigma {
            return None;
        }
        if step.norm() < SETTLED {
            return Some(at);
        }
    }
    None
}

/// In pixels: five pixels across hold nine values more than a quadric.
const LEAST_REACH: f64 = 2.0;

/// The sigma of the widest window up to `sigma` that a place leaves room for beside the picture's border;
/// `None` where that is too near.
pub(in crate::chart) fn fitting(image: &GrayImage, at: Pixel, sigma: f64) -> Option<f64> {
    let (right, bottom) = (image.width() as f64 - 1.0 - at.x, image.height() as f64 - 1.0 - at.y);
    let room = at.x.min(at.y).min(right).min(bottom).floor();
    // A little less, so that the window's reach is not rounded up.
    (room >= LEAST_REACH).then(|| sigma.min(room / 3.0 - 1e-9))
}

/// In pixels: what is left without noise, measured on rendered boards (see the decision on charts).
pub(super) const OWN_FAULT: f64 = 0.01;
/// In grey levels: what rounding to whole ones leaves uncertain, the root of a twelfth.
const ROUNDING: f64 = 0.29;

/// Standard deviation of a saddle along each axis, in pixels: what the noise of the grey values around it
/// does to the quadric, and the method's own fault.
pub(in crate::chart) fn sigma(image: &GrayImage, at: Pixel, window: f64) -> f64 {
    let noise = noise(image, at);
    spread(image, at, window).map_or(window, |spread| {
        let own = noise * spread * window;
        (own * own + OWN_FAULT * OWN_FAULT).sqrt().min(window)
    })
}

/// Standard deviation of the noise about a place, in grey levels, by Immerkær's mask (1996,
/// doi:10.1006/cviu.1996.0060), which neither slopes nor edges along the axes excite; the median over a
/// window does without those that do.
pub(super) fn noise(image: &GrayImage, at: Pixel) -> f64 {
    let (x, y) = (at.x.round() as isize, at.y.round() as isize);
    let value = |x: isize, y: isize| image.at(x, y);
    let seconds: Vec<[f32; NOISE_SIDE]> = (0..NOISE_SIDE as isize + 2)
        .map(|row| {
            let row = y - NOISE_REACH - 1 + row;
            std::array::from_fn(|column| {
                let column = x - NOISE_REACH + column as isize;
                value(column - 1, row) - 2.0 * value(column, row) + value(column + 1, row)
            })
        })
        .collect();
    let masked = seconds.windows(3).flat_map(|rows| {
        (0..NOISE_SIDE).map(|at| (rows[0][at] - 2.0 * rows[1][at] + rows[2][at]).abs())
    });
    let mut all: Vec<f32> = masked.collect();
    let middle = all.len() / 2;
    let median = f64::from(*all.select_nth_unstable_by(middle, f32::total_cmp).1);
    // The mask's weights have the norm 6.
    (median / 0.6745 / 6.0).max(ROUNDING)
}

/// In pixels: the window in which noise is measured, to each side and in all.
const NOISE_REACH: isize = 6;
/// See [`NOISE_REACH`].
const NOISE_SIDE: usize = 2 * NOISE_REACH as usize + 1;

/// Standard deviation of the saddle in windows, for noise of one grey level.
fn spread(image: &GrayImage, at: Pixel, window: f64) -> Option<f64> {
    let lines = Lines::new(at, window);
    let inverse = lines.normal(1).cholesky()?.inverse();
    let quadric = inverse * lines.right(image);
    let covariance = inverse * lines.normal(2) * inverse;
    let slope = covariance.fixed_view::<2, 2>(3, 3).into_owned();
    let hessian = Matrix2::new(2.0 * quadric[0], quadric[1], quadric[1], 2.0 * quadric[2]);
    let back = hessian.try_inverse()?;
    Some(((back * slope * back).trace() / 2.0).sqrt())
}

/// Step from `at` to the saddle of the quadric around it, at most one `sigma`.
fn saddle_from(image: &GrayImage, at: Pixel, sigma: f64) -> Option<Vector2<f64>> {
    if !image.contains(at, reach(sigma)) {
        return None;
    }
    let lines = Lines::new(at, sigma);
    let quadric = lines.normal(1).cholesky()?.solve(&lines.right(image));
    let (a, b, c, d, e) = (quadric[0], quadric[1], quadric[2], quadric[3], quadric[4]);
    let determinant = 4.0 * a * c - b * b;
    // Otherwise it is a hill, a pit, a ridge or a plain.
    if determinant >= 0.0 {
        return None;
    }
    let step = Vector2::new(b * e - 2.0 * c * d, b * d - 2.0 * a * e) / determinant;
    let length = step.norm();
    if !length.is_finite() {
        return None;
    }
    Some(step * (sigma / length.max(1.0)))
}

/// How far a window is followed, in pixels: a hundredth of the weight is left there.
fn reach(sigma: f64) -> f64 {
    (3.0 * sigma).ceil()
}

/// The columns and the rows of a Gaussian window. Its weights and the quadric's terms are products of what each of the
/// two says, and so are their sums over the window.
struct Lines {
    across: Line,
    down: Line,
}

/// Powers of x and of y in the terms of a quadric.
const TERMS: [(usize, usize); 6] = [(2, 0), (1, 1), (0, 2), (1, 0), (0, 1), (0, 0)];

impl Lines {
    fn new(at: Pixel, sigma: f64) -> Self {
        Self { across: Line::new(at.x, sigma), down: Line::new(at.y, sigma) }
    }

    /// The weighted squares of a fit's terms, with the weights to this power.
    fn normal(&self, power: i32) -> Matrix6<f64> {
        let (across, down) = (self.across.moments(power), self.down.moments(power));
        Matrix6::from_fn(|i, j| across[TERMS[i].0 + TERMS[j].0] * down[TERMS[i].1 + TERMS[j].1])
    }

    /// The weighted products of terms and grey values; beyond the picture, those of its border.
    fn right(&self, image: &GrayImage) -> Vector6<f64> {
        let mut sums = [[0.0; 3]; 3];
        let across = &self.across;
        let first = across.first.clamp(0, image.width() as isize) as usize;
        let inside = across.first >= 0 && first + across.steps.len() <= image.width();
        let mut bordered = Vec::new();
        for (row, [weight, y, square]) in (self.down.first..).zip(&self.down.steps) {
            let row = row.clamp(0, image.height() as isize - 1);
            let values = if inside {
                &image.row(row as usize)[first..first + across.steps.len()]
            } else {
                bordered.clear();
                let columns = across.first..across.first + across.steps.len() as isize;
                bordered.extend(columns.map(|column| image.at(column, row)));
                &bordered
            };
            let mut line = [0.0; 3];
            for (value, weights) in values.iter().zip(&across.steps) {
                for (sum, weight) in line.iter_mut().zip(weights) {
                    *sum += weight * f64::from(*value);
                }
            }
            for (sums, weight) in sums.iter_mut().zip([weight, y, square]) {
                for (sum, line) in sums.iter_mut().zip(line) {
                    *sum += weight * line;
                }
            }
        }
        Vector6::from_fn(|term, _| sums[TERMS[term].1][TERMS[term].0])
    }
}

/// The columns, or the rows, of a window.
struct Line {
    /// The first of them.
    first: isize,
    /// The weight of each, times the powers 0, 1 and 2 of its distance from the middle in sigmas.
    steps: Vec<[f64; 3]>,
}

impl Line {
    fn new(centre: f64, sigma: f64) -> Self {
        let (middle, reach) = (centre.round() as isize, reach(sigma) as isize);
        let steps = (middle - reach..=middle + reach).map(|pixel| {
            let distance = (pixel as f64 - centre) / sigma;
            let weight = libm::exp(-distance * distance / 2.0);
            [weight, weight * distance, weight * distance * distance]
        });
        Self { first: middle - reach, steps: steps.collect() }
    }

    /// Sums of the weights to this power, times the powers 0 to 4 of the distance.
    fn moments(&self, power: i32) -> [f64; 5] {
        let mut sums = [0.0; 5];
        for [weight, first, second] in &self.steps {
            let ratio = [1.0, first / weight, second / weight];
            let own = weight.powi(power);
            for (sum, term) in sums.iter_mut().zip([
                1.0,
                ratio[1],
                ratio[2],
                ratio[1] * ratio[2],
                ratio[2] * ratio[2],
            ]) {
                *sum += own * term;
            }
        }
        sums
    }
}
