//! Where the adjustment of a camera may begin, for lenses from telephoto to fisheye.
//!
//! The linear camera is a good start for weak distortion. For strong distortion radial alignment
//! gives all but depth, focal length and distortion, whatever the lens; those follow from a scan.

use super::radial_alignment::{Aligned, Scaled};
use crate::{
    camera::{
        batch_projection::BatchProjection,
        composed::Composed,
        picture_domain::{Area, has_rays},
        pinhole::Pinhole,
        posed_lens::PosedLens,
        projection::Projection,
    },
    geometry::{Pixel, Point3, Pose, ProjectionMatrix, Vector3},
};
use nalgebra::{Matrix2, Matrix3, Vector2};

/// A camera model that a fit can start. The first four of its numbers are its pinhole's, the fifth is
/// the first coefficient of its radial distortion.
pub(crate) trait Lens: Composed + BatchProjection {
    /// The model that a fit starts from; `first` is the coefficient of the cube in
    /// radius = a + first a^3, where a is the distance from the axis at which the projection lays a point
    /// out.
    fn start(pinhole: Pinhole, first: f64) -> Self;

    /// Whether it holds all over the area and a tenth beyond.
    fn holds_over(&self, area: Area) -> bool {
        has_rays(self, area)
    }
}

impl<L: Lens> PosedLens<L> {
    /// The same camera with an ideal lens.
    pub(super) fn undistorted(&self) -> Self {
        Self { lens: L::start(*self.lens.pinhole(), 0.0), ..self.clone() }
    }

    pub(super) fn sees_all(&self, pairs: &[(Point3, Pixel)]) -> bool {
        pairs.iter().all(|(world, _)| {
            let point =
                self.camera_from_world.rotation * world.coords + self.camera_from_world.translation;
            self.lens.project(Point3::from(point)).is_some()
        })
    }
}

/// Points that decide between depths: more add time, not certainty.
const SCANNED: usize = 50;

/// Depths tried for the nearest point, as shares of the points' mean distance from their middle: a
/// few behind the camera's centre, where fisheyes see too, then evenly in the logarithm from a lens
/// among the points to one that hardly observes perspective.
fn depths() -> impl Iterator<Item = f64> {
    const STEPS: usize = 36;
    let (least, most): (f64, f64) = (0.03, 100.0);
    let ahead =
        move |step: usize| least * libm::pow(most / least, step as f64 / (STEPS - 1) as f64);
    [-0.8, -0.4, -0.2, 0.0].into_iter().chain((0..STEPS).map(ahead))
}

/// The points as a scan observes them.
struct Scan<'a> {
    /// Each point's distance from the axis in scaled units, its place along the axis, and the radius
    /// of its pixel.
    points: Vec<[f64; 3]>,
    aligned: &'a Aligned,
    rotation: Matrix3<f64>,
    nearest: f64,
}

impl<'a> Scan<'a> {
    fn new(scaled: &Scaled, aligned: &'a Aligned, mirrored: bool) -> Self {
        let rotation = aligned.rotation(mirrored);
        let axis: Vector3 = rotation.row(2).transpose();
        let step = scaled.pairs.len().div_ceil(SCANNED);
        let along = scaled.pairs.iter().map(|(world, _)| axis.dot(world));
        let nearest = along.clone().fold(f64::INFINITY, f64::min);
        let points =
            along.zip(&aligned.radii).map(|(along, [seen, radius])| [*radius, along, *seen]);
        Self { points: points.step_by(step).collect(), aligned, rotation, nearest }
    }

    /// Focal length and the coefficient of the cube, and the sum of squared errors of the radius, for
    /// the nearest point at this depth.
    fn profile<L: Lens>(&self, gap: f64) -> Option<(f64, f64, f64)> {
        let radii = self.points.iter().map(|[radius, along, seen]| {
            Some((L::Projection::distance(*radius, along - self.nearest + gap)?, *seen))
        });
        let radii: Vec<(f64, f64)> = radii.collect::<Option<_>>()?;
        let (mut matrix, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for (ideal, seen) in &radii {
            let row = Vector2::new(*ideal, ideal * ideal * ideal);
            matrix += row * row.transpose();
            right += row * *seen;
        }
        // The cube is tenths of the radius or less, and to be told from it by ten digits.
        let told = matrix.determinant() > 1e-20 * matrix[(0, 0)] * matrix[(1, 1)];
        let [focal, cubic] = (matrix.try_inverse().filter(|_| told)? * right).into();
        let error = |(ideal, seen): &(f64, f64)| {
            let gap = focal * ideal + cubic * ideal * ideal * ideal - seen;
            gap * gap
        };
        let squares = radii.iter().map(error).sum();
        (focal > 0.0).then_some((focal, cubic, squares))
    }
}

/// The best depth, focal length and first coefficient for a centre of distortion: both handednesses,
/// and for each depth the radial profile by least squares.
fn aligned_start<L: Lens>(scaled: &Scaled, centre: Pixel) -> Option<PosedLens<L>> {
    let aligned = scaled.align(centre)?;
    let mut best: Option<(f64, PosedLens<L>)> = None;
    for mirrored in [false, true] {
        let scan = Scan::new(scaled, &aligned, mirrored);
        for gap in depths() {
            let Some((focal, cubic, squares)) = scan.profile::<L>(gap) else { continue };
            if best.as_ref().is_none_or(|(least, _)| squares < *least) {
                let focal_lengths = [focal * scan.aligned.aspect, focal];
                let pinhole = Pinhole { focal: focal_lengths, principal: [centre.x, centre.y] };
                let rotation = scan.rotation;
                let depth = gap - scan.nearest;
                let translation = scaled.unscaled(rotation, aligned.translation(depth));
                let model = L::start(pinhole, cubic / focal);
                best = Some((
                    squares,
                    PosedLens { lens: model, camera_from_world: Pose { rotation, translation } },
                ));
            }
        }
    }
    best.map(|(_, camera)| camera)
}

/// The linear camera without distortion.
fn linear_start<L: Lens>(linear: &ProjectionMatrix) -> Option<PosedLens<L>> {
    let (k, rotation, translation) = linear.decompose()?;
    let pinhole = Pinhole { focal: [k[(0, 0)], k[(1, 1)]], principal: [k[(0, 2)], k[(1, 2)]] };
    Some(PosedLens {
        lens: L::start(pinhole, 0.0),
        camera_from_world: Pose { rotation, translation },
    })
}

/// Cameras from which an adjustment may reach the best fit.
pub(super) fn starts<L: Lens>(
    pairs: &[(Point3, Pixel)],
    linear: &ProjectionMatrix,
) -> Vec<PosedLens<L>> {
    let mut found: Vec<PosedLens<L>> = linear_start(linear).into_iter().collect();
    if let Some(scaled) = Scaled::new(pairs) {
        let centres = scaled.centres(linear);
        let aligned = centres.into_iter().filter_map(|centre| aligned_start(&scaled, centre));
        // Where the cube folds the picture over within the points, none is safer.
        found.extend(
            aligned.map(|c: PosedLens<L>| if c.sees_all(pairs) { c } else { c.undistorted() }),
        );
    }
    found
}
