//! The pinhole behind a lens with radial, tangential and thin-prism distortion.
//!
//! Sources: D. C. Brown 1971, "Close-range camera calibration", Photogrammetric Engineering 37(8),
//! for the radial and tangential parts; Weng, Cohen & Herniou 1992 (doi:10.1109/34.159901) for the
//! thin prism. The rational denominator and the numbering of all coefficients are OpenCV's
//! (k1 to k6, p1, p2, s1 to s4).

use super::{
    AdjustableCamera, CameraModel,
    batch_projection::{BatchProjection, ProjectedBatch},
    monotonic::stays_positive,
    pinhole::Pinhole,
    ray_by_slopes,
};
use crate::geometry::{Pixel, Point3, Ray};
use nalgebra::{Matrix2x3, Vector2};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::{
    number::{Doubles, Number},
    simd::Simd,
};

/// A pinhole behind a distorting lens. A place `(x, y)` on the plane z = 1, at squared radius s, goes
/// to `(x, y) (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3)` and from there by the
/// tangential and prism terms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BrownConrady {
    /// The ideal part.
    pub pinhole: Pinhole,
    /// k1, k2, k3: radial, of second, fourth and sixth order.
    pub radial: [f64; 3],
    /// p1, p2: tangential.
    pub tangential: [f64; 2],
    /// k4, k5, k6: the denominator of the radial part.
    #[serde(default)]
    pub rational: [f64; 3],
    /// s1 to s4: thin prism, of second and fourth order along x, then along y.
    #[serde(default)]
    pub prism: [f64; 4],
}

impl Default for BrownConrady {
    fn default() -> Self {
        Self {
            pinhole: Pinhole::default(),
            radial: [-0.2, 0.05, 0.0],
            tangential: [1e-3, -5e-4],
            rational: [0.0; 3],
            prism: [0.0; 4],
        }
    }
}

/// The radial part at one squared radius.
struct Radial<N> {
    /// Numerator over denominator.
    factor: N,
    /// Its derivative by the squared radius.
    slope: N,
    denominator: N,
}

impl BrownConrady {
    /// Whether the distorted radius grows all the way from the axis to squared radius `s`; beyond,
    /// the polynomial folds the picture over.
    fn rises(&self, s: f64) -> bool {
        let [k1, k2, k3] = self.radial;
        if self.rational == [0.0; 3] {
            return stays_positive([1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3], s);
        }
        let [k4, k5, k6] = self.rational;
        // The derivative of the radius by the radius, times the squared denominator.
        let mut growth = [0.0; 7];
        for (i, above) in [1.0, k1, k2, k3].into_iter().enumerate() {
            for (j, below) in [1.0, k4, k5, k6].into_iter().enumerate() {
                growth[i + j] += above * below * (1.0 + 2.0 * i as f64 - 2.0 * j as f64);
            }
        }
        stays_positive([1.0, k4, k5, k6], s) && stays_positive(growth, s)
    }

    /// The radial part, beyond the fold too.
    #[inline(always)]
    fn radial<N: Number>(&self, s: N) -> Radial<N> {
        let ([k1, k2, k3], [k4, k5, k6]) =
            (self.radial.map(|k| s.all(k)), self.rational.map(|k| s.all(k)));
        let [one, two, three] = [1.0, 2.0, 3.0].map(|value| s.all(value));
        let denominator = one + s * (k4 + s * (k5 + s * k6));
        let factor = (one + s * (k1 + s * (k2 + s * k3))) / denominator;
        let denominator_slope = k4 + s * (two * k5 + s * three * k6);
        let numerator_slope = k1 + s * (two * k2 + s * three * k3);
        let slope = (numerator_slope - factor * denominator_slope) / denominator;
        Radial { factor, slope, denominator }
    }

    /// The place on the plane z = 1 of a point in front, with its squared radius.
    fn ideal(point: Point3) -> Option<[f64; 3]> {
        let (x, y) = (point.x / point.z, point.y / point.z);
        (point.z > 0.0).then_some([x, y, x * x + y * y])
    }

    /// Where a place on the plane z = 1 goes on it, before the focal lengths.
    #[inline(always)]
    fn distort<N: Number>(&self, [x, y, s]: [N; 3], factor: N) -> [N; 2] {
        let [p1, p2] = self.tangential.map(|p| s.all(p));
        let [s1, s2, s3, s4] = self.prism.map(|term| s.all(term));
        let two = s.all(2.0);
        [
            x * factor + two * p1 * x * y + p2 * (s + two * x * x) + s * (s1 + s * s2),
            y * factor + p1 * (s + two * y * y) + two * p2 * x * y + s * (s3 + s * s4),
        ]
    }

    /// Derivatives of [`BrownConrady::distort`] by the place.
    #[inline(always)]
    fn stretch<N: Number>(&self, [x, y, s]: [N; 3], radial: &Radial<N>) -> [[N; 2]; 2] {
        let [p1, p2] = self.tangential.map(|p| s.all(p));
        let [s1, s2, s3, s4] = self.prism.map(|term| s.all(term));
        let [two, six] = [2.0, 6.0].map(|value| s.all(value));
        let (along_x, along_y) = (two * (s1 + two * s2 * s), two * (s3 + two * s4 * s));
        let Radial { factor, slope, .. } = *radial;
        let mixed = two * x * y * slope + two * p1 * x + two * p2 * y;
        [
            [
                factor + two * x * x * slope + two * p1 * y + six * p2 * x + x * along_x,
                mixed + y * along_x,
            ],
            [
                mixed + x * along_y,
                factor + two * y * y * slope + six * p1 * y + two * p2 * x + y * along_y,
            ],
        ]
    }

    /// Projects with all slopes, beyond the fold too.
    #[inline(always)]
    fn slopes<N: Number>(&self, point: [N; 3], slopes: &mut [[N; 2]]) -> ProjectedBatch<N> {
        let z = point[2];
        let (x, y) = (point[0] / z, point[1] / z);
        let s = x * x + y * y;
        let radial = self.radial(s);
        let place = self.distort([x, y, s], radial.factor);
        let stretch = self.stretch([x, y, s], &radial);
        let (one, two, zero) = (s.all(1.0), s.all(2.0), s.all(0.0));
        let inverse = one / radial.denominator;
        let (x_over, y_over) = (x * inverse, y * inverse);
        let by_k = |power: N| [x_over * power, y_over * power];
        let below = |power: N| by_k((zero - power) * radial.factor);
        let (s2, s3) = (s * s, s * s * s);
        let of_lens = [
            by_k(s),
            by_k(s2),
            by_k(s3),
            [two * x * y, s + two * y * y],
            [s + two * x * x, two * x * y],
            below(s),
            below(s2),
            below(s3),
            [s, zero],
            [s2, zero],
            [zero, s],
            [zero, s2],
        ];
        self.pinhole.slopes(place, of_lens, slopes);
        ProjectedBatch {
            pixel: self.pinhole.pixels(place),
            by_point: self.pinhole.by_point(stretch, [x, y, z]),
            seen: z.held(0.0, f64::INFINITY) + radial.denominator.held(0.0, f64::INFINITY),
        }
    }
}

impl CameraModel for BrownConrady {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        let Self { pinhole, radial, tangential, rational, prism } = self;
        let lens = radial.iter_mut().chain(tangential).chain(rational).chain(prism);
        pinhole.parameters_mut().into_iter().chain(lens).collect()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        let [x, y, s] = Self::ideal(point)?;
        let [to_x, to_y] = self.distort([x, y, s], self.radial(s).factor);
        self.rises(s).then(|| self.pinhole.pixel(to_x, to_y))
    }

    fn ray(&self, pixel: Pixel) -> Option<Ray> {
        let lens = self.radial.iter().chain(&self.tangential).chain(&self.rational);
        if lens.chain(&self.prism).all(|value| *value == 0.0) {
            return self.pinhole.ray(pixel);
        }
        let slopes = |place: Vector2<f64>| {
            let (_, by_point) = self.project_with_jacobian(Point3::new(place.x, place.y, 1.0))?;
            Some(by_point.fixed_columns::<2>(0).into_owned())
        };
        let from = |start: Vector2<f64>| {
            ray_by_slopes(|point| self.project(point), slopes, (start, pixel))
        };
        // The ideal lens's ray is near, but may be beyond a fold: the axis never is.
        from(self.pinhole.place(pixel).into()).or_else(|| from(Vector2::zeros()))
    }

    fn project_with_jacobian(&self, point: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        let [x, y, s] = Self::ideal(point)?;
        if !self.rises(s) {
            return None;
        }
        let radial = self.radial(s);
        let [to_x, to_y] = self.distort([x, y, s], radial.factor);
        let stretch = self.stretch([x, y, s], &radial);
        let [along_x, along_y] = self.pinhole.by_point(stretch, [x, y, point.z]);
        let by_point = Matrix2x3::from_rows(&[along_x.into(), along_y.into()]);
        Some((self.pinhole.pixel(to_x, to_y), by_point))
    }
}

impl AdjustableCamera for BrownConrady {
    fn project_with_slopes(
        &self,
        point: Point3,
        slopes: &mut [[f64; 2]],
    ) -> Option<(Pixel, Matrix2x3<f64>)> {
        self.slopes(point.into(), slopes).of_one()
    }
}

impl BatchProjection for BrownConrady {
    #[inline(always)]
    fn trace<S: Simd>(
        &self,
        point: [Doubles<S>; 3],
        slopes: &mut [[Doubles<S>; 2]],
    ) -> ProjectedBatch<Doubles<S>> {
        self.slopes(point, slopes)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::tests::slopes_agree_with_differences, *};

    #[test]
    fn slopes_are_those_of_the_projection() {
        let plain = BrownConrady { radial: [-0.23, 0.12, -0.02], ..BrownConrady::default() };
        let full = BrownConrady {
            rational: [0.1, -0.03, 0.01],
            prism: [1e-3, -2e-3, 5e-4, 3e-3],
            ..plain
        };
        slopes_agree_with_differences(&plain);
        slopes_agree_with_differences(&full);
    }

    #[test]
    fn nothing_is_seen_beyond_the_fold_even_where_the_polynomial_rises_again() {
        let lens = BrownConrady { radial: [-0.5, 0.1, 0.0], ..BrownConrady::default() };
        // 1 + 3 k1 s + 5 k2 s^2 is negative for s between 1 and 2, and positive beyond.
        let at = |s: f64| lens.project(Point3::new(s.sqrt(), 0.0, 1.0));
        assert!(at(0.9).is_some() && at(1.5).is_none() && at(2.5).is_none());
    }

    #[test]
    fn cameras_of_old_files_have_no_prism() {
        let old = r#"{"pinhole":{"focal":[700.0,700.0],"principal":[319.5,239.5]},
            "radial":[-0.2,0.05,0.0],"tangential":[0.001,-0.0005]}"#;
        assert_eq!(serde_json::from_str::<BrownConrady>(old).unwrap(), BrownConrady::default());
    }
}
