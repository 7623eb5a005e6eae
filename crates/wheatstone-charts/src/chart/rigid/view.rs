//! Rough cameras: where the points of a body should be seen. They need only be good enough to look for
//! a point nearer to its place than to its neighbours'; what they leave is taken up by the matched
//! points around.

use nalgebra::{Matrix3, Matrix3x4, Vector3};
use wheatstone_core::geometry::{Homography, Pixel, Point3, ProjectionMatrix};
use wheatstone_numeric::{
    least_squares::solve,
    levenberg_marquardt::{Patience, minimise},
    progress::Silent,
};

/// From the body to the picture.
#[derive(Clone, Debug)]
pub(super) enum View {
    Projection(ProjectionMatrix),
    /// Parallel light: four points that are not on one plane determine it.
    Affine([[f64; 4]; 2]),
}

/// Pairs from which on a projection is fitted freely: twice what determine it.
const FREELY: usize = 12;

/// Focal lengths that are tried, in picture widths: from a wide angle to a tele lens. Neighbours are 1.6
/// apart, and the points of a body are displaced by a fraction of its depth between them.
const FOCAL_LENGTHS: [f64; 8] = [0.5, 0.75, 1.1, 1.7, 2.6, 4.2, 8.0, 20.0];

impl View {
    pub(super) fn project(&self, point: &Point3) -> Option<Pixel> {
        match self {
            Self::Projection(matrix) => matrix.project(*point),
            Self::Affine(rows) => {
                let h = point.to_homogeneous();
                let [x, y] = rows.map(|row| (0..4).map(|at| row[at] * h[at]).sum());
                Some(Pixel::new(x, y))
            }
        }
    }

    /// The freest camera that the pairs determine.
    pub(super) fn fit(pairs: &[(Point3, Pixel)], centre: Pixel, width: f64) -> Option<Self> {
        if pairs.len() >= FREELY
            && let Some(matrix) = ProjectionMatrix::fit(pairs)
        {
            return Some(Self::Projection(matrix));
        }
        let missed = |view: &Self| -> f64 {
            let miss = |(point, pixel): &(Point3, Pixel)| {
                view.project(point).map_or(f64::INFINITY, |at| (at - pixel).norm_squared())
            };
            pairs.iter().map(miss).sum()
        };
        // A camera must explain the pairs to some percent of their extent.
        let explains = |view: &Self| missed(view) < 4e-4 * extent(pairs);
        let refined = (4..FREELY).contains(&pairs.len()).then(|| {
            let starts = Self::of_plane(pairs, centre, width).into_iter();
            starts.filter_map(|start| start.refined(pairs, centre, width))
        });
        let refined =
            refined.and_then(|views| views.min_by(|a, b| missed(a).total_cmp(&missed(b))));
        refined.filter(explains).or_else(|| Self::affine(pairs)).or_else(|| {
            let views = Self::of_plane(pairs, centre, width);
            views.into_iter().min_by(|a, b| missed(a).total_cmp(&missed(b)))
        })
    }

    /// The camera with square pixels and the picture's middle on its axis that explains the pairs best,
    /// from this one on: focal length, turn and place.
    fn refined(&self, pairs: &[(Point3, Pixel)], centre: Pixel, width: f64) -> Option<Self> {
        let Self::Projection(start) = self else { return None };
        let (inner, turn, place) = start.decompose()?;
        let build = |p: &[f64]| {
            let focal = libm::exp(p[0]) * inner[(0, 0)];
            let step = nalgebra::Rotation3::new(Vector3::new(p[1], p[2], p[3]));
            let moved = place + Vector3::new(p[4], p[5], p[6]) * place.norm();
            let inner = Matrix3::new(focal, 0.0, centre.x, 0.0, focal, centre.y, 0.0, 0.0, 1.0);
            let mut outer = Matrix3x4::zeros();
            outer.fixed_view_mut::<3, 3>(0, 0).copy_from(&(step.matrix() * turn));
            outer.set_column(3, &moved);
            ProjectionMatrix(inner * outer)
        };
        let residuals = |p: &[f64]| -> Option<Vec<f64>> {
            let camera = build(p);
            let mut all = Vec::with_capacity(2 * pairs.len() + 1);
            for (point, pixel) in pairs {
                let off = camera.project(*point)? - pixel;
                all.extend([off.x, off.y]);
            }
            // Four points on a plane leave the focal length all but free.
            all.push(0.002 * width * p[0]);
            Some(all)
        };
        const STEP: f64 = 1e-6;
        let patience = Patience { steps: 40, least_gain: 1e-9 };
        let found = minimise(&[0.0; 7], patience, &Silent, |p, normal| {
            let own = residuals(p)?;
            let mut slopes = Vec::with_capacity(7);
            for axis in 0..7 {
                let mut ahead = [0.0; 7];
                ahead.copy_from_slice(p);
                ahead[axis] += STEP;
                slopes.push(residuals(&ahead)?);
            }
            for (index, residual) in own.iter().enumerate() {
                let mut row = [0.0; 7];
                for (cell, slope) in row.iter_mut().zip(&slopes) {
                    *cell = (slope[index] - residual) / STEP;
                }
                normal.add(&row, *residual);
            }
            Some(own.iter().map(|r| r * r).sum::<f64>() / 2.0)
        });
        Some(Self::Projection(build(&found.ok()?.parameters)))
    }

    /// The camera that observes the pairs under parallel light, unless they are on one plane.
    fn affine(pairs: &[(Point3, Pixel)]) -> Option<Self> {
        let (_, _, thickness) = plane(pairs)?;
        if pairs.len() < 4 || thickness < 0.01 {
            return None;
        }
        let left: Vec<f64> =
            pairs.iter().flat_map(|(point, _)| [point.x, point.y, point.z, 1.0]).collect();
        let right: Vec<f64> = pairs.iter().flat_map(|(_, pixel)| [pixel.x, pixel.y]).collect();
        let found = solve(&left, 4, &right, 2)?;
        let row = |side: usize| [0, 1, 2, 3].map(|at| found[(at, side)]);
        Some(Self::Affine([row(0), row(1)]))
    }

    /// Cameras that see the pairs, which lie near a plane, as they are seen: one a focal length, each with
    /// square pixels and the picture's middle on its axis.
    pub(super) fn of_plane(pairs: &[(Point3, Pixel)], centre: Pixel, width: f64) -> Vec<Self> {
        let Some((middle, axes, _)) = plane(pairs) else { return Vec::new() };
        let flat: Vec<(Pixel, Pixel)> = pairs
            .iter()
            .map(|(point, pixel)| {
                let from = point - middle;
                let on_plane = Pixel::new(axes.column(0).dot(&from), axes.column(1).dot(&from));
                (on_plane, *pixel - centre.coords)
            })
            .collect();
        let Some(Homography(map)) = Homography::fit(&flat) else { return Vec::new() };
        let views = FOCAL_LENGTHS.into_iter().filter_map(|length| {
            let focal = length * width;
            let scaled = Matrix3::from_diagonal(&Vector3::new(1.0 / focal, 1.0 / focal, 1.0)) * map;
            // In front of the camera.
            let scaled = scaled * scaled[(2, 2)].signum();
            let (first, second) = (scaled.column(0), scaled.column(1));
            let scale = (first.norm() * second.norm()).sqrt();
            let (first, second) = (first / scale, second / scale);
            // As near to both as two directions at right angles are.
            let (sum, difference) = (first + second, first - second);
            let (sum, difference) = (sum.normalize(), difference.normalize());
            let along = (sum + difference).normalize();
            let down = (sum - difference).normalize();
            let turn = Matrix3::from_columns(&[along, down, along.cross(&down)]) * axes.transpose();
            let place = scaled.column(2) / scale - turn * middle.coords;
            if !turn.iter().chain(place.iter()).all(|it| it.is_finite()) {
                return None;
            }
            let inner = Matrix3::new(focal, 0.0, centre.x, 0.0, focal, centre.y, 0.0, 0.0, 1.0);
            let mut outer = Matrix3x4::zeros();
            outer.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
            outer.set_column(3, &place);
            Some(Self::Projection(ProjectionMatrix(inner * outer)))
        });
        views.collect()
    }

    /// Whether the world is right-handed as it is seen; a mirrored match is none.
    pub(super) fn is_right_handed(&self) -> bool {
        match self {
            Self::Projection(matrix) => {
                matrix.0.fixed_view::<3, 3>(0, 0).into_owned().determinant() > 0.0
            }
            Self::Affine(_) => true,
        }
    }
}

/// Sum of the squared distances of the pixels from their middle.
fn extent(pairs: &[(Point3, Pixel)]) -> f64 {
    let count = pairs.len() as f64;
    let middle = pairs.iter().map(|(_, at)| at.coords).sum::<nalgebra::Vector2<f64>>() / count;
    pairs.iter().map(|(_, at)| (at.coords - middle).norm_squared()).sum()
}

/// The middle of the points, the axes of their best plane with its normal last (a right-handed frame),
/// and their extent across it as a share of that along it.
fn plane(pairs: &[(Point3, Pixel)]) -> Option<(Point3, Matrix3<f64>, f64)> {
    let count = pairs.len() as f64;
    let middle = pairs.iter().map(|(point, _)| point.coords).sum::<Vector3<f64>>() / count;
    let mut spread = Matrix3::zeros();
    for (point, _) in pairs {
        let from = point.coords - middle;
        spread += from * from.transpose();
    }
    let eigen = spread.try_symmetric_eigen(1e-12, 100)?;
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let [first, second, third] = order;
    let along = eigen.eigenvectors.column(first).into_owned();
    let down = eigen.eigenvectors.column(second).into_owned();
    let axes = Matrix3::from_columns(&[along, down, along.cross(&down)]);
    let share = (eigen.eigenvalues[third].max(0.0) / eigen.eigenvalues[second]).sqrt();
    share.is_finite().then(|| (middle.into(), axes, share))
}
