//! One camera from charts that stand anywhere: an ideal lens whose focal length is scanned, and each
//! chart's place from its plane-to-plane map.
//!
//! The focal length is scanned instead of solved for (Zhang 2000, doi:10.1109/34.888718): a wide lens bends the maps
//! between planes, and the scan does not mind.

use super::state::{Shot, State};
use crate::{
    camera::{pinhole::Pinhole, posed_lens::PosedLens},
    geometry::{LEAST_ON_PLANE, Pixel, Point3, Pose, planar_pose},
    method::Lens,
};
use wheatstone_numeric::statistics::{mean, median};

/// Focal lengths that are tried, as shares of the pixels' extent: from a fisheye to a long lens.
fn focal_lengths(extent: f64) -> impl Iterator<Item = f64> {
    const STEPS: i32 = 20;
    let (least, most): (f64, f64) = (0.2, 8.0);
    (0..STEPS).map(move |step| {
        extent * least * libm::pow(most / least, f64::from(step) / f64::from(STEPS - 1))
    })
}

/// Middle and larger side of the box round the pixels.
fn extent(views: &[&[(Point3, Pixel)]]) -> Option<(Pixel, f64)> {
    let pixels = || views.iter().flat_map(|view| view.iter().map(|(_, pixel)| *pixel));
    let bounds = |axis: usize| {
        pixels().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), pixel| {
            (low.min(pixel[axis]), high.max(pixel[axis]))
        })
    };
    let ((left, right), (top, bottom)) = (bounds(0), bounds(1));
    let size = (right - left).max(bottom - top);
    size.is_finite().then(|| (Pixel::new((left + right) / 2.0, (top + bottom) / 2.0), size))
}

/// Where a chart stands before a camera, by the map between the chart and the plane at distance one.
pub(super) fn place<L: Lens>(lens: &L, seen: &[(Point3, Pixel)]) -> Option<Pose> {
    let flat: Vec<(Pixel, Pixel)> = seen
        .iter()
        .filter_map(|(place, pixel)| {
            let ray = lens.ray(*pixel)?.direction;
            // Beyond eighty degrees the plane runs away.
            (ray.z > 0.17)
                .then(|| (Pixel::new(place.x, place.y), Pixel::new(ray.x / ray.z, ray.y / ray.z)))
        })
        .collect();
    planar_pose(&flat)
}

/// Median pixel error of one view.
pub(super) fn view_error<L: Lens>(
    lens: &L,
    camera_from_chart: &Pose,
    seen: &[(Point3, Pixel)],
) -> f64 {
    let errors: Vec<f64> = seen
        .iter()
        .map(|(place, pixel)| {
            let at = lens.project(camera_from_chart.transform(*place));
            at.map_or(f64::INFINITY, |at| (at - pixel).norm())
        })
        .collect();
    median(&errors)
}

/// States of one camera (at the world's origin) from which an adjustment may begin, the best first.
pub(super) fn starts<L: Lens>(shots: &[Shot], camera: usize) -> Vec<State<L>> {
    // More depend on where the scan's steps fall, not on the lens.
    const BEST: usize = 3;
    let views: Vec<&[(Point3, Pixel)]> = shots.iter().map(|shot| shot[camera].as_slice()).collect();
    let Some((centre, size)) = extent(&views) else { return Vec::new() };
    let mut found: Vec<(f64, State<L>)> = Vec::new();
    for focal in focal_lengths(size) {
        let pinhole = Pinhole { focal: [focal; 2], principal: [centre.x, centre.y] };
        let lens = L::start(pinhole, 0.0);
        let mut errors = Vec::new();
        let mut charts = vec![Pose::default(); views.len()];
        for (chart, seen) in
            charts.iter_mut().zip(&views).filter(|(_, seen)| seen.len() >= LEAST_ON_PLANE)
        {
            if let Some(pose) = place(&lens, seen) {
                *chart = pose;
                // A view behind the camera spoils a mean; no view is worse than lost.
                errors.push(view_error(&lens, &pose, seen).min(size));
            } else {
                errors.push(size);
            }
        }
        if !errors.is_empty() {
            let posed = PosedLens { lens, camera_from_world: Pose::default() };
            found.push((mean(&errors), State { cameras: vec![posed], charts }));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().take(BEST).map(|(_, state)| state).collect()
}
