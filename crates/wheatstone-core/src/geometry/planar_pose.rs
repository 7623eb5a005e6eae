//! Where a flat chart stands, by the map between its plane and the plane at distance one before a camera.
//!
//! Source: Zhang 2000 (doi:10.1109/34.888718).

use super::{Pixel, Pose, Vector3};
use nalgebra::{Matrix3, SMatrix, SVector, Vector2};
use wheatstone_numeric::statistics::median;

/// A chart is placed by as many points or more.
pub(crate) const LEAST_ON_PLANE: usize = 6;

/// Where a chart stands whose points fall on the plane at distance one as these pairs say.
pub(crate) fn planar_pose(flat: &[(Pixel, Pixel)]) -> Option<Pose> {
    if flat.len() < LEAST_ON_PLANE {
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
    let spoilt = kept.len() < flat.len() && kept.len() >= LEAST_ON_PLANE;
    pose_of(&if spoilt { plane_map(&kept).unwrap_or(first) } else { first })
}

/// The map between planes that takes each first place nearest to its second, by the normal equations
/// of the direct linear transformation: less exact than [`super::Homography::fit`], quick,
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
    let middle = points.clone().map(|p| p.coords).sum::<Vector2<f64>>() / count;
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
