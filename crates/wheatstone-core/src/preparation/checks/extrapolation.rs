//! How much worse a camera tells views that are nearer or farther than all to which it was fitted: a lens that the
//! formula does not describe, such as one behind glass or water, is extrapolated there.

use super::pairs::Pair;
use crate::geometry::Vector3;
use nalgebra::{Matrix3, SymmetricEigen};
use wheatstone_numeric::statistics::median;

/// Places of a view's points along a direction, in units of the scene's size, and the view's error by the camera of the
/// others, over the good level.
pub(super) struct Extent {
    pub(super) places: Vec<f64>,
    pub(super) excess: f64,
}

/// The direction across which views are thinnest: of parallel charts, the one that tells them apart however a camera looks.
pub(super) fn across<'a>(views: impl Iterator<Item = &'a [Pair]>) -> Vector3 {
    let mut scatter = Matrix3::zeros();
    for pairs in views {
        let middle = pairs.iter().map(|(world, _)| world.coords).sum::<Vector3>()
            / pairs.len().max(1) as f64;
        for (world, _) in pairs {
            let from_middle = world.coords - middle;
            scatter += from_middle * from_middle.transpose();
        }
    }
    /// Ten are enough, unless places overflow.
    const ITERATIONS: usize = 100;
    SymmetricEigen::try_new(scatter, f64::EPSILON, ITERATIONS)
        .map_or_else(Vector3::z, |eigen| eigen.eigenvectors.column(eigen.eigenvalues.imin()).into())
}

/// For each view, the error over the good level that extrapolation alone may leave: 1 for views among good ones.
pub(super) fn allowances(views: &[Option<Extent>]) -> Vec<f64> {
    (0..views.len()).map(|view| allowance(views, view).unwrap_or(1.0)).collect()
}

/// From a view beyond all good ones: what the next one on their side errs by tells of it.
fn allowance(views: &[Option<Extent>], view: usize) -> Option<f64> {
    /// Noise alone leaves half of the good level.
    const NOISE: f64 = 0.5;
    /// By how much errors grow from one view to the next: 2 to 5.6 times, by simulated tanks and slabs of glass with 5 to
    /// 10 parallel charts.
    const GROWTH: f64 = 6.0;
    /// A view that errs by more may have a fault itself, and tells nothing of the next, unless extrapolation allows it.
    const TRUSTED: f64 = 3.5;
    let own = median(&views[view].as_ref()?.places);
    let others = || {
        let all = views.iter().enumerate().filter(|(other, _)| *other != view);
        all.filter_map(|(other, extent)| Some((other, extent.as_ref()?)))
    };
    let good =
        || others().filter(|(_, other)| other.excess <= 1.0).flat_map(|(_, other)| &other.places);
    let is_least = good().all(|place| *place > own);
    if good().next().is_none() || !is_least && !good().all(|place| *place < own) {
        return None;
    }
    let inwards = |(_, other): &(usize, &Extent)| {
        (median(&other.places) - own) * if is_least { 1.0 } else { -1.0 }
    };
    let (place, next) = others()
        .filter(|other| inwards(other) > 0.0)
        .min_by(|a, b| inwards(a).total_cmp(&inwards(b)))?;
    let is_trusted =
        next.excess <= TRUSTED || allowance(views, place).is_some_and(|most| next.excess <= most);
    is_trusted.then(|| 1.0 + GROWTH * (next.excess - NOISE).max(0.0))
}
