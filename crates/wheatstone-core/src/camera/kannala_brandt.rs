//! The fisheye whose picture radius is an odd polynomial of the angle from the axis.
//!
//! Source: Kannala & Brandt 2006 (doi:10.1109/TPAMI.2006.153), in the four-coefficient form that
//! OpenCV's fisheye module uses.

use super::{
    AdjustableCamera, CameraModel,
    batch_projection::{BatchProjection, MOST_NUMBERS, ProjectedBatch},
    monotonic::stays_positive,
    pinhole::Pinhole,
};
use crate::geometry::{Pixel, Point3, Ray, Vector3};
use nalgebra::Matrix2x3;
use serde::{Deserialize, Serialize};
use wheatstone_numeric::{
    number::{Doubles, Number},
    simd::Simd,
};

/// Radius = focal * (t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9) for the angle t from the axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KannalaBrandt {
    /// Focal lengths and principal point.
    pub pinhole: Pinhole,
    /// k1 to k4.
    pub coefficients: [f64; 4],
}

impl Default for KannalaBrandt {
    fn default() -> Self {
        Self {
            pinhole: Pinhole { focal: [260.0, 260.0], principal: [319.5, 239.5] },
            coefficients: [-0.02, 0.004, -0.003, 0.0005],
        }
    }
}

impl KannalaBrandt {
    /// Whether the distorted angle grows all the way from the axis to `angle`; beyond, the
    /// polynomial folds the picture over.
    fn rises(&self, angle: f64) -> bool {
        let [k1, k2, k3, k4] = self.coefficients;
        stays_positive([1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4], angle * angle)
    }

    /// Projects with all slopes, beyond the fold too; `angle_of` tells the angle from the axis by distance
    /// from it and place along it.
    #[inline(always)]
    fn slopes<N: Number>(
        &self,
        [x, y, z]: [N; 3],
        angle_of: impl Fn(N, N) -> N,
        slopes: &mut [[N; 2]],
    ) -> ProjectedBatch<N> {
        let square = x * x + y * y;
        // On the axis the picture is that of a pinhole: so it is, to rounding, this far from it.
        const NEAR: f64 = 1e-150;
        let near = z.all(NEAR);
        let radius = square.root().max_with(near);
        let distance_square = square + z * z;
        let angle = angle_of(radius, z);
        let (distorted, slope) = self.distort(angle);
        let scale = distorted / radius;
        let along = slope * z / distance_square - scale;
        let (east, south) = (x / radius, y / radius);
        let by_depth = z.all(0.0) - slope / distance_square;
        let [fx, fy] = [z.all(self.pinhole.focal[0]), z.all(self.pinhole.focal[1])];
        let by_point = [
            [fx * (scale + east * east * along), fx * east * south * along, fx * x * by_depth],
            [fy * east * south * along, fy * (scale + south * south * along), fy * y * by_depth],
        ];
        let place = [x * scale, y * scale];
        let unit = angle / radius;
        let mut next = [x * unit, y * unit];
        let mut of_lens = [next; 4];
        for slope in &mut of_lens {
            next = [next[0] * angle * angle, next[1] * angle * angle];
            *slope = next;
        }
        self.pinhole.slopes(place, of_lens, slopes);
        let pixel = self.pinhole.pixels(place);
        // Behind the camera there is nothing on the axis.
        ProjectedBatch { pixel, by_point, seen: z.max_with(radius - near).held(0.0, f64::INFINITY) }
    }

    /// The distorted angle and its derivative.
    #[inline(always)]
    fn distort<N: Number>(&self, angle: N) -> (N, N) {
        let t2 = angle * angle;
        let one = angle.all(1.0);
        let mut sums = [angle.all(0.0); 2];
        for (k, power) in self.coefficients.into_iter().zip([3.0, 5.0, 7.0, 9.0]).rev() {
            sums[0] = t2 * (angle.all(k) + sums[0]);
            sums[1] = t2 * (angle.all(power * k) + sums[1]);
        }
        (angle * (one + sums[0]), one + sums[1])
    }
}

/// The angle from the axis of registers full of points, 0 to pi: `atan2(radius, z)` within some
/// roundings, for a `radius` above 0.
#[inline(always)]
fn angle_of<N: Number>(radius: N, z: N) -> N {
    let one = z.all(1.0);
    let (ahead, distance) = (z.max_with(z.all(0.0) - z), (radius * radius + z * z).root());
    // The tangent of half the angle, halved twice more: an eighth of the angle is at most pi / 16.
    let halved = |tangent: N| tangent / (one + (one + tangent * tangent).root());
    let tangent = halved(halved(radius / (distance + ahead)));
    let square = tangent * tangent;
    // The series of the arcus tangent: of tan(pi / 16) the term after these is 6e-19.
    const TERMS: i32 = 12;
    let mut sum = z.all(0.0);
    for term in (0..TERMS).rev() {
        sum = z.all(1.0 / f64::from(2 * term + 1)) - square * sum;
    }
    let angle = z.all(8.0) * tangent * sum;
    // 1 ahead, -1 behind: there it is what is missing to half a turn.
    let side = z / ahead.max_with(z.all(f64::MIN_POSITIVE));
    let missing = z.all(std::f64::consts::PI) - angle - angle;
    angle + (one - side) * z.all(0.5) * missing
}

impl CameraModel for KannalaBrandt {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        let Self { pinhole, coefficients } = self;
        pinhole.parameters_mut().into_iter().chain(coefficients).collect()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        let radius = (point.x * point.x + point.y * point.y).sqrt();
        if radius == 0.0 {
            return (point.z > 0.0).then(|| self.pinhole.pixel(0.0, 0.0));
        }
        let angle = libm::atan2(radius, point.z);
        let scale = self.distort(angle).0 / radius;
        self.rises(angle).then(|| self.pinhole.pixel(point.x * scale, point.y * scale))
    }

    fn project_with_jacobian(&self, point: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        let found = self.project_with_slopes(point, &mut [[0.0; 2]; MOST_NUMBERS])?;
        let radius = (point.x * point.x + point.y * point.y).sqrt();
        self.rises(libm::atan2(radius, point.z)).then_some(found)
    }

    fn ray(&self, pixel: Pixel) -> Option<Ray> {
        let [x, y] = self.pinhole.place(pixel);
        let radius = (x * x + y * y).sqrt();
        let mut angle = radius;
        for _ in 0..50 {
            let (distorted, slope) = self.distort(angle);
            let step = (radius - distorted) / slope;
            // Half a radian a step keeps Newton on the branch that starts at the axis.
            angle += step.clamp(-0.5, 0.5);
            if step.abs() < 1e-15 {
                break;
            }
        }
        let (distorted, slope) = self.distort(angle);
        if slope <= 0.0 || (distorted - radius).abs() > 1e-11 || angle > std::f64::consts::PI {
            return None;
        }
        let sine = if radius > 0.0 { libm::sin(angle) / radius } else { 0.0 };
        let direction = Vector3::new(x * sine, y * sine, libm::cos(angle));
        Some(Ray { origin: Point3::origin(), direction: direction.normalize() })
    }
}

impl AdjustableCamera for KannalaBrandt {
    fn project_with_slopes(
        &self,
        point: Point3,
        slopes: &mut [[f64; 2]],
    ) -> Option<(Pixel, Matrix2x3<f64>)> {
        self.slopes(point.into(), libm::atan2, slopes).of_one()
    }
}

impl BatchProjection for KannalaBrandt {
    #[inline(always)]
    fn trace<S: Simd>(
        &self,
        point: [Doubles<S>; 3],
        slopes: &mut [[Doubles<S>; 2]],
    ) -> ProjectedBatch<Doubles<S>> {
        self.slopes(point, angle_of, slopes)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::tests::slopes_agree_with_differences, *};

    #[test]
    fn slopes_are_those_of_the_projection() {
        slopes_agree_with_differences(&KannalaBrandt::default());
    }

    #[test]
    fn sees_behind_itself_but_not_beyond_the_fold() {
        let wide = KannalaBrandt { coefficients: [0.0; 4], ..KannalaBrandt::default() };
        assert!(wide.project(Point3::new(10.0, 0.0, -1.0)).is_some());
        assert!(wide.project(Point3::new(0.0, 0.0, -1.0)).is_none());
        let folded = KannalaBrandt { coefficients: [-0.2, 0.0, 0.0, 0.0], ..wide };
        // 1 + 3 k1 t^2 is 0 at t = 1.29 rad.
        assert!(folded.project(Point3::new(libm::tan(1.28), 0.0, 1.0)).is_some());
        assert!(folded.project(Point3::new(libm::tan(1.30), 0.0, 1.0)).is_none());
    }
}
