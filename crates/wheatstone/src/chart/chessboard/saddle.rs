//! Where exactly a corner of a chessboard is: the saddle of the grey values around it.

use crate::{geometry::Pixel, imaging::GrayImage, numeric::statistics::median};
use nalgebra::{Matrix2, Matrix6, Vector2, Vector6};

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
const OWN_FAULT: f64 = 0.01;
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
fn noise(image: &GrayImage, at: Pixel) -> f64 {
    let (x, y) = (at.x.round() as isize, at.y.round() as isize);
    let value = |x: isize, y: isize| f64::from(image.at(x, y));
    let mut all = Vec::with_capacity(169);
    for row in y - 6..=y + 6 {
        for column in x - 6..=x + 6 {
            let second = |row: isize| {
                value(column - 1, row) - 2.0 * value(column, row) + value(column + 1, row)
            };
            all.push((second(row - 1) - 2.0 * second(row) + second(row + 1)).abs());
        }
    }
    // The mask's weights have the norm 6.
    (median(&all) / 0.6745 / 6.0).max(ROUNDING)
}

/// Standard deviation of the saddle in windows, for noise of one grey level.
fn spread(image: &GrayImage, at: Pixel, window: f64) -> Option<f64> {
    let reach = (3.0 * window).ceil() as isize;
    let (column, row) = (at.x.round() as isize, at.y.round() as isize);
    let (mut normal, mut squared, mut right) =
        (Matrix6::zeros(), Matrix6::zeros(), Vector6::zeros());
    for py in row - reach..=row + reach {
        for px in column - reach..=column + reach {
            let (x, y) = ((px as f64 - at.x) / window, (py as f64 - at.y) / window);
            let weight = libm::exp(-(x * x + y * y) / 2.0);
            let terms = Vector6::new(x * x, x * y, y * y, x, y, 1.0);
            normal.ger(weight, &terms, &terms, 1.0);
            squared.ger(weight * weight, &terms, &terms, 1.0);
            right += terms * (weight * f64::from(image.at(px, py)));
        }
    }
    let inverse = normal.cholesky()?.inverse();
    let quadric = inverse * right;
    let covariance = inverse * squared * inverse;
    let slope = covariance.fixed_view::<2, 2>(3, 3).into_owned();
    let bend = Matrix2::new(2.0 * quadric[0], quadric[1], quadric[1], 2.0 * quadric[2]);
    let back = bend.try_inverse()?;
    Some(((back * slope * back).trace() / 2.0).sqrt())
}

/// Step from `at` to the saddle of the quadric around it, at most one `sigma`.
fn saddle_from(image: &GrayImage, at: Pixel, sigma: f64) -> Option<Vector2<f64>> {
    // A hundredth of the weight is left there.
    let reach = (3.0 * sigma).ceil();
    if !image.contains(at, reach) {
        return None;
    }
    // In units of sigma from `at`, with the Gaussian's weight there.
    let steps = |centre: f64| {
        let middle = centre.round() as isize;
        let pixels = middle - reach as isize..=middle + reach as isize;
        pixels.map(move |pixel| {
            let distance = (pixel as f64 - centre) / sigma;
            (pixel, distance, libm::exp(-distance * distance / 2.0))
        })
    };
    let across: Vec<_> = steps(at.x).collect();
    let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
    for (row, y, weight_y) in steps(at.y) {
        for &(column, x, weight_x) in &across {
            let terms = Vector6::new(x * x, x * y, y * y, x, y, 1.0);
            let weighted = terms * (weight_x * weight_y);
            normal.ger(1.0, &weighted, &terms, 1.0);
            right += weighted * f64::from(image.at(column, row));
        }
    }
    let quadric = normal.cholesky()?.solve(&right);
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
