//! One camera from charts that stand anywhere: an ideal lens whose focal length is scanned, and each
//! chart's place from its plane-to-plane map.
//!
//! Source: Zhang 2000 (doi:10.1109/34.888718) for places from maps between planes. The focal length is
//! scanned instead of solved for: a wide lens bends the maps, and the scan does not mind.

use super::state::{Shot, State};
use crate::{
    camera::{pinhole::Pinhole, posed_lens::PosedLens},
    geometry::{Pixel, Point3, Pose, Vector3},
    method::Lens,
};
use nalgebra::{Matrix3, SMatrix, SVector};
use wheatstone_numeric::statistics::{mean, median};

/// A chart is placed by as many points or more.
pub(super) const LEAST: usize = 6;

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
    placed(&flat)
}

/// Where a chart stands whose points fall on the plane at distance one as these pairs say.
pub(crate) fn placed(flat: &[(Pixel, Pixel)]) -> Option<Pose> {
    if flat.len() < LEAST {
        return None;
    }
    let first = plane_map(flat)?;
    let error = |map: &Matrix3<f64>, (from, to): &(Pixel, Pixel)| {
        let at = map * from.to_homogeneous();
        let off = Pixel::new(at.x / at.z, at.y / at.z) - to;
        if off.x.is_finite() && off.y.is_finite() { off.norm() } else { f64::INFINITY }
    };
    // Gross errors bend the map; the worst go, and it is made anew.
    let errors: Vec<f64> = flat.iter().map(|pair| error(&first, pair)).collect();
    let most = 4.0 * median(&errors);
    let kept: Vec<(Pixel, Pixel)> =
        flat.iter().zip(&errors).filter(|(_, e)| **e <= most).map(|(pair, _)| *pair).collect();
    let spoilt = kept.len() < flat.len() && kept.len() >= LEAST;
    pose_of(&if spoilt { plane_map(&kept).unwrap_or(first) } else { first })
}

/// The map between planes that takes each first place nearest to its second, by the normal equations
/// of the direct linear transformation: less exact than [`crate::geometry::Homography::fit`], quick,
/// and good enough to begin with.
fn plane_map(pairs: &[(Pixel, Pixel)]) -> Option<Matrix3<f64>> {
    let [from, to] = [
        about_middle(pairs.iter().map(|pair| pair.0))?,
        about_middle(pairs.iter().map(|pair| pair.1))?,
    ];
    // Sums of the products of (x, y, 1) with each other: plain, and times the coordinates seen, and times
    // these squared.
    let mut sums = [Matrix3::zeros(); 4];
    for (a, b) in pairs {
        let (a, b) = (from.transform_point(a), to.transform_point(b));
        let product = a.to_homogeneous() * a.to_homogeneous().transpose();
        for (sum, factor) in sums.iter_mut().zip([1.0, b.x, b.y, b.x * b.x + b.y * b.y]) {
            *sum += product * factor;
        }
    }
    let [plain, by_x, by_y, by_square] = sums;
    let mut matrix = SMatrix::<f64, 8, 8>::zeros();
    let mut right = SVector::<f64, 8>::zeros();
    for (first, by) in [(0, &by_x), (3, &by_y)] {
        matrix.fixed_view_mut::<3, 3>(first, first).copy_from(&plain);
        matrix.fixed_view_mut::<2, 3>(6, first).copy_from(&-by.fixed_rows::<2>(0));
        right.fixed_rows_mut::<3>(first).copy_from(&by.column(2));
    }
    matrix.fixed_view_mut::<2, 2>(6, 6).copy_from(&by_square.fixed_view::<2, 2>(0, 0));
    right.fixed_rows_mut::<2>(6).copy_from(&-by_square.fixed_view::<2, 1>(0, 2));
    let h = matrix.cholesky()?.solve(&right);
    // The middle of the points is never on the horizon: its weight is 1.
    let map = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0);
    Some(to.try_inverse()? * map * from)
}

/// Brings points to mean 0 and a root mean square distance of 1.
fn about_middle(points: impl Iterator<Item = Pixel> + Clone) -> Option<Matrix3<f64>> {
    let count = points.clone().count() as f64;
    let middle = points.clone().map(|p| p.coords).sum::<nalgebra::Vector2<f64>>() / count;
    let square = points.map(|p| (p.coords - middle).norm_squared()).sum::<f64>() / count;
    let scale = 1.0 / square.sqrt();
    let shift = -middle * scale;
    scale.is_finite().then(|| Matrix3::new(scale, 0.0, shift.x, 0.0, scale, shift.y, 0.0, 0.0, 1.0))
}

/// The pose whose plane z = 0 a map takes to the plane at distance one.
fn pose_of(map: &Matrix3<f64>) -> Option<Pose> {
    let [a, b, c] = [0, 1, 2].map(|column| map.column(column).into_owned());
    let scale = 2.0 / (a.norm() + b.norm());
    let scale = if c.z < 0.0 { -scale } else { scale };
    let (a, b, translation): (Vector3, Vector3, Vector3) = (a * scale, b * scale, c * scale);
    // The nearest orthonormal pair: each takes half of what is missing to a right angle.
    let (a, b) = (a.normalize(), b.normalize());
    let (sum, difference) = ((a + b).normalize(), (a - b).normalize());
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let (first, second) = ((sum + difference) * half, (sum - difference) * half);
    let rotation = Matrix3::from_columns(&[first, second, first.cross(&second)]);
    let sound = rotation.iter().chain(&translation).all(|v| v.is_finite());
    sound.then_some(Pose { rotation, translation })
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
        for (chart, seen) in charts.iter_mut().zip(&views).filter(|(_, seen)| seen.len() >= LEAST) {
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
