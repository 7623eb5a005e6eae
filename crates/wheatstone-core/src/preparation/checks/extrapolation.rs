//! How much worse a camera tells views that are nearer or farther than all to which it was fitted: a lens that the
//! formula does not describe, such as one behind glass or water, is extrapolated there.

use wheatstone_numeric::statistics::median;

/// Depths of a view's points along a camera's axis, in units of the scene's size, and the view's error by the camera of
/// the others, over the good level.
pub(super) struct Extent {
    pub(super) depths: Vec<f64>,
    pub(super) excess: f64,
}

/// For each view, the error over the good level that extrapolation alone may leave: 1 for views among good ones in depth.
pub(super) fn allowances(views: &[Option<Extent>]) -> Vec<f64> {
    (0..views.len()).map(|view| allowance(views, view).unwrap_or(1.0)).collect()
}

/// From a view beyond all good ones: what the next one on their side errs by tells of it.
fn allowance(views: &[Option<Extent>], view: usize) -> Option<f64> {
    /// Noise alone leaves half of the good level.
    const NOISE: f64 = 0.5;
    /// By how much errors grow from one view to the next: 2 to 4 times, by simulated optics with steps of 15 from 140 to 50 cm.
    const GROWTH: f64 = 4.0;
    /// A view that errs by more may have a fault itself, and tells nothing of the next.
    const TRUSTED: f64 = 3.5;
    let own = median(&views[view].as_ref()?.depths);
    let others = || (0..views.len()).filter(|v| *v != view).filter_map(|v| views[v].as_ref());
    let good = || others().filter(|other| other.excess <= 1.0).flat_map(|other| &other.depths);
    let is_nearest = good().all(|depth| *depth > own);
    if good().next().is_none() || !is_nearest && !good().all(|depth| *depth < own) {
        return None;
    }
    let inwards =
        |other: &Extent| (median(&other.depths) - own) * if is_nearest { 1.0 } else { -1.0 };
    let next = others()
        .filter(|other| inwards(other) > 0.0)
        .min_by(|a, b| inwards(a).total_cmp(&inwards(b)))?;
    (next.excess <= TRUSTED).then(|| 1.0 + GROWTH * (next.excess - NOISE).max(0.0))
}
