//! How points are spread.

use super::{Point3, Vector3};
use nalgebra::{Matrix3, SymmetricEigen};

/// Mean of some points, axes from the longest to the shortest, and standard deviations along them.
pub(crate) fn principal_axes(places: &[Point3]) -> (Point3, [Vector3; 3], [f64; 3]) {
    let count = places.len().max(1) as f64;
    let middle = Point3::from(places.iter().map(|p| p.coords).sum::<Vector3>() / count);
    let scatter: Matrix3<f64> =
        places.iter().map(|p| (p - middle) * (p - middle).transpose()).sum::<Matrix3<f64>>()
            / count;
    let (axes, variances) = axes_of(scatter);
    (middle, axes, variances.map(|variance| variance.max(0.0).sqrt()))
}

/// The axes of a covariance from the longest to the shortest, and the variances along them.
pub(crate) fn axes_of(covariance: Matrix3<f64>) -> ([Vector3; 3], [f64; 3]) {
    let eigen = SymmetricEigen::new(covariance);
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let axes = order.map(|index| eigen.eigenvectors.column(index).into_owned());
    (axes, order.map(|index| eigen.eigenvalues[index]))
}
