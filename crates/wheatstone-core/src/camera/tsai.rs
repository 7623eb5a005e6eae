//! Tsai's camera: a pinhole whose picture must be stretched radially to become ideal.
//!
//! Source: Tsai 1987 (doi:10.1109/JRA.1987.1087109), with the first coefficient only, as the paper
//! recommends. The distortion is told from the distorted place to the ideal one, the other way round
//! than in Brown's model.

use super::{
    AdjustableCamera, CameraModel,
    batch_projection::{BatchProjection, LANES, MOST_NUMBERS, ProjectedBatch},
    pinhole::Pinhole,
};
use crate::geometry::{Pixel, Point3, Ray, Vector3};
use nalgebra::Matrix2x3;
use serde::{Deserialize, Serialize};
use wheatstone_numeric::{
    number::{Doubles, Number, registers_mut},
    simd::Simd,
};

/// Ideal radius = r (1 + kappa r^2) for a distorted radius r, both on the plane z = 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tsai {
    /// Focal lengths and principal point; the ratio of the focal lengths is the paper's scale factor
    /// s_x.
    pub pinhole: Pinhole,
    /// The paper's kappa_1 times the squared focal length: no unit. Positive for barrel distortion.
    pub kappa: f64,
}

impl Default for Tsai {
    fn default() -> Self {
        Self { pinhole: Pinhole::default(), kappa: 0.2 }
    }
}

impl Tsai {
    /// The distorted radius of an ideal one: the root of the cubic on the branch that starts at the axis,
    /// by Newton's method. `None` beyond the fold.
    fn distort(&self, ideal: f64) -> Option<f64> {
        if self.kappa < 0.0 {
            // The cubic has its highest value, 2/3 of the radius there, at r^2 = -1 / (3 kappa).
            let fold = 1.0 / (-3.0 * self.kappa).sqrt();
            if ideal >= fold * (2.0 / 3.0) {
                return None;
            }
        }
        // From 0 upwards the cubic is concave (kappa < 0) and Newton's steps stay below the root;
        // it is convex otherwise and they stay above it once they are there.
        let mut radius = if self.kappa < 0.0 { 0.0 } else { ideal };
        for _ in 0..MOST_STEPS {
            let square = radius * radius;
            let step =
                (ideal - radius * (1.0 + self.kappa * square)) / (1.0 + 3.0 * self.kappa * square);
            if step.abs() <= LEAST_STEP * (radius + step) {
                break;
            }
            radius += step;
        }
        (1.0 + 3.0 * self.kappa * radius * radius > 0.0).then_some(radius)
    }

    /// [`Tsai::distort`] of a register full of ideal radii; where there is none, not a number.
    #[inline(always)]
    fn distorted<S: Simd>(&self, ideal: Doubles<S>) -> Doubles<S> {
        let simd = ideal.0;
        let (one, zero) = (ideal.all(1.0), ideal.all(0.0));
        let (kappa, slope) = (ideal.all(self.kappa), ideal.all(3.0 * self.kappa));
        let inward = self.kappa < 0.0;
        let mut radius = if inward { zero } else { ideal };
        for _ in 0..MOST_STEPS {
            let square = radius * radius;
            let step = (ideal - radius * (one + kappa * square)) / (one + slope * square);
            let moved = radius + step;
            let size = step.max_with(zero - step);
            // Where a step no longer moves the radius it stays, whatever the others do.
            let moves = simd.greater_than_f64s(size.1, (ideal.all(LEAST_STEP) * moved).1);
            radius = Doubles(simd, simd.select_f64s(moves, moved.1, radius.1));
            let mut any = [0.0; LANES];
            registers_mut::<S>(&mut any)[0] = simd.select_f64s(moves, one.1, zero.1);
            if any == [0.0; LANES] {
                break;
            }
        }
        let fold = if inward { (2.0 / 3.0) / (-3.0 * self.kappa).sqrt() } else { f64::INFINITY };
        radius + ideal.held(-1.0, fold)
    }

    /// Projects with all slopes a point whose distorted radius is known.
    #[inline(always)]
    fn slopes<N: Number>(
        &self,
        point: [N; 3],
        radius: N,
        slopes: &mut [[N; 2]],
    ) -> ProjectedBatch<N> {
        let z = point[2];
        let (x, y) = (point[0] / z, point[1] / z);
        let (one, kappa) = (z.all(1.0), z.all(self.kappa));
        let square = radius * radius;
        let rise = one + z.all(3.0 * self.kappa) * square;
        let (growth, factor) = (one / rise, one / (one + kappa * square));
        // (growth - factor) / ideal^2, without the quotient of two small numbers at the axis.
        let bend = z.all(-2.0 * self.kappa) * growth * factor * factor * factor;
        let mixed = x * y * bend;
        let stretch = [[factor + x * x * bend, mixed], [mixed, factor + y * y * bend]];
        let by_kappa = z.all(0.0) - square * growth * factor;
        let place = [x * factor, y * factor];
        self.pinhole.slopes(place, [[x * by_kappa, y * by_kappa]], slopes);
        ProjectedBatch {
            pixel: self.pinhole.pixels(place),
            by_point: self.pinhole.by_point(stretch, [x, y, z]),
            seen: z.held(0.0, f64::INFINITY) + rise.held(0.0, f64::INFINITY),
        }
    }
}

/// Of Newton's method, and the share of a radius that is no step any more.
const MOST_STEPS: usize = 100;
const LEAST_STEP: f64 = 1e-15;

impl CameraModel for Tsai {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        let Self { pinhole, kappa } = self;
        pinhole.parameters_mut().into_iter().chain([kappa]).collect()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        if point.z <= 0.0 {
            return None;
        }
        let (x, y) = (point.x / point.z, point.y / point.z);
        let radius = self.distort((x * x + y * y).sqrt())?;
        let factor = 1.0 / (1.0 + self.kappa * radius * radius);
        Some(self.pinhole.pixel(x * factor, y * factor))
    }

    fn project_with_jacobian(&self, point: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        self.project_with_slopes(point, &mut [[0.0; 2]; MOST_NUMBERS])
    }

    fn ray(&self, pixel: Pixel) -> Option<Ray> {
        let [x, y] = self.pinhole.place(pixel);
        let square = x * x + y * y;
        if 1.0 + 3.0 * self.kappa * square <= 0.0 {
            return None;
        }
        let factor = 1.0 + self.kappa * square;
        let direction = Vector3::new(x * factor, y * factor, 1.0).normalize();
        Some(Ray { origin: Point3::origin(), direction })
    }
}

impl AdjustableCamera for Tsai {
    fn project_with_slopes(
        &self,
        point: Point3,
        slopes: &mut [[f64; 2]],
    ) -> Option<(Pixel, Matrix2x3<f64>)> {
        let (x, y) = (point.x / point.z, point.y / point.z);
        let radius = self.distort((x * x + y * y).sqrt())?;
        self.slopes(point.into(), radius, slopes).of_one()
    }
}

impl BatchProjection for Tsai {
    #[inline(always)]
    fn trace<S: Simd>(
        &self,
        point: [Doubles<S>; 3],
        slopes: &mut [[Doubles<S>; 2]],
    ) -> ProjectedBatch<Doubles<S>> {
        let (x, y) = (point[0] / point[2], point[1] / point[2]);
        self.slopes(point, self.distorted((x * x + y * y).root()), slopes)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::tests::slopes_agree_with_differences, *};

    #[test]
    fn slopes_are_those_of_the_projection() {
        for kappa in [0.2, -0.1, 0.0] {
            slopes_agree_with_differences(&Tsai { kappa, ..Tsai::default() });
        }
    }

    #[test]
    fn rays_come_back_until_the_fold() {
        for kappa in [0.3, -0.2] {
            let camera = Tsai { kappa, ..Tsai::default() };
            for pixel in [Pixel::new(0.0, 0.0), Pixel::new(500.0, 100.0), Pixel::new(319.5, 239.5)]
            {
                let back = camera.project(camera.ray(pixel).unwrap().at(7.0)).unwrap();
                assert!((back - pixel).norm() < 1e-9, "{kappa}: {back}");
            }
        }
        let folded = Tsai { kappa: -0.2, ..Tsai::default() };
        assert!(folded.project(Point3::new(0.9, 0.0, 1.0)).is_none());
    }
}
