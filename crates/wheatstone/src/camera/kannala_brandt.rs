//! The fisheye whose picture radius is an odd polynomial of the angle from the axis.
//!
//! Source: Kannala & Brandt 2006 (doi:10.1109/TPAMI.2006.153), in the four-coefficient form that
//! OpenCV's fisheye module uses.

use super::{AdjustableCamera, CameraModel, pinhole::Pinhole, rising::stays_positive};
use crate::geometry::{Pixel, Point3, Ray, Vector3};
use nalgebra::Matrix2x3;
use serde::{Deserialize, Serialize};

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

    /// Projects, with the derivatives by the point; also the angle from the axis and the distorted
    /// place on the unit picture. Goes on beyond the fold.
    fn trace(&self, point: Point3) -> Option<(Pixel, Matrix2x3<f64>, f64, [f64; 2])> {
        let square = point.x * point.x + point.y * point.y;
        let radius = square.sqrt();
        let distance_square = square + point.z * point.z;
        // On the axis the picture is that of a pinhole; the limits are exact to rounding.
        let near = radius <= 1e-150 * distance_square;
        if near && point.z <= 0.0 {
            return None;
        }
        let angle = libm::atan2(radius, point.z);
        let (distorted, slope) = self.distort(angle);
        let scale = if near { 1.0 / point.z } else { distorted / radius };
        let along = slope * point.z / distance_square - scale;
        let (east, south) = if near { (0.0, 0.0) } else { (point.x / radius, point.y / radius) };
        let by_depth = -slope / distance_square;
        let [fx, fy] = self.pinhole.focal;
        let by_point = Matrix2x3::new(
            fx * (scale + east * east * along),
            fx * east * south * along,
            fx * point.x * by_depth,
            fy * east * south * along,
            fy * (scale + south * south * along),
            fy * point.y * by_depth,
        );
        let place = [point.x * scale, point.y * scale];
        Some((self.pinhole.pixel(place[0], place[1]), by_point, angle, place))
    }

    /// The distorted angle and its derivative.
    fn distort(&self, angle: f64) -> (f64, f64) {
        let t2 = angle * angle;
        let [k1, k2, k3, k4] = self.coefficients;
        (
            angle * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4)))),
            1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4))),
        )
    }
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
        let (pixel, by_point, angle, _) = self.trace(point)?;
        self.rises(angle).then_some((pixel, by_point))
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
        let (pixel, by_point, angle, place) = self.trace(point)?;
        let radius = (point.x * point.x + point.y * point.y).sqrt();
        let unit = if radius > 0.0 { angle / radius } else { 0.0 };
        let (mut x, mut y) = (point.x * unit, point.y * unit);
        let of_lens = [(); 4].map(|()| {
            (x, y) = (x * angle * angle, y * angle * angle);
            [x, y]
        });
        self.pinhole.slopes(place, &of_lens, slopes);
        Some((pixel, by_point))
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
