//! Where exactly a corner of a chessboard is: the saddle of the grey values around it.

use crate::{geometry::Pixel, imaging::GrayImage};
use nalgebra::{Matrix6, Vector2, Vector6};

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
pub(super) fn refine(image: &GrayImage, start: Pixel, sigma: f64) -> Option<Pixel> {
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

/// Step from `at` to the saddle of the quadric around it, at most one `sigma`.
fn saddle_from(image: &GrayImage, at: Pixel, sigma: f64) -> Option<Vector2<f64>> {
    // A hundredth of the weight is left there.
    let reach = (3.0 * sigma).ceil();
    if !image.contains(at, reach + 0.5) {
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
