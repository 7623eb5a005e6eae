//! Projection with all slopes, for one point or a register of them.

use super::AdjustableCamera;
use crate::geometry::Pixel;
use nalgebra::Matrix2x3;
use wheatstone_numeric::{number::Doubles, simd::Simd};

/// Numbers of the lens with most of them, Brown's.
pub(crate) const MOST_NUMBERS: usize = 18;

/// What a camera says of points before it.
#[derive(Clone, Copy)]
pub(crate) struct ProjectedBatch<N> {
    pub(crate) pixel: [N; 2],
    /// Derivatives of the pixel's x, then y, by the point.
    pub(crate) by_point: [[N; 3]; 2],
    /// 0; not a number where the camera cannot see the point.
    pub(crate) seen: N,
}

impl ProjectedBatch<f64> {
    /// In the form of [`AdjustableCamera::project_with_slopes`].
    pub(super) fn of_one(self) -> Option<(Pixel, Matrix2x3<f64>)> {
        let [x, y] = self.by_point;
        let by_point = Matrix2x3::from_rows(&[x.into(), y.into()]);
        (self.seen == 0.0).then(|| (Pixel::from(self.pixel), by_point))
    }
}

/// A camera that can be asked for a register full of points.
pub(crate) trait BatchProjection: AdjustableCamera + Send + Sync {
    /// [`AdjustableCamera::project_with_slopes`] of a register full of points; so many of the slopes are
    /// asked for, and others may be missing.
    fn trace<S: Simd>(
        &self,
        point: [Doubles<S>; 3],
        slopes: (&mut [[Doubles<S>; 2]; MOST_NUMBERS], usize),
    ) -> ProjectedBatch<Doubles<S>>;
}

/// Doubles of the widest register.
pub(crate) const LANES: usize = 8;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        camera::{brown_conrady::BrownConrady, kannala_brandt::KannalaBrandt, tsai::Tsai},
        geometry::Point3,
    };
    use wheatstone_numeric::{
        number::{registers, registers_mut},
        simd::{WithSimd, on_each},
    };

    struct All<'a, L>(&'a L, &'a [[f64; LANES]; 3]);

    impl<L: BatchProjection> WithSimd for All<'_, L> {
        type Output = Vec<f64>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
            let zero = Doubles(simd, simd.splat_f64s(0.0));
            let width = size_of::<S::f64s>() / size_of::<f64>();
            let mut found = vec![Vec::new(); LANES];
            for first in (0..LANES).step_by(width) {
                let mut slopes = [[zero; 2]; MOST_NUMBERS];
                let point = self
                    .1
                    .each_ref()
                    .map(|values| Doubles(simd, registers::<S>(values)[first / width]));
                let trace = self.0.trace(point, (&mut slopes, MOST_NUMBERS));
                let values = trace.pixel.iter().chain(trace.by_point.as_flattened());
                for value in values.chain([&trace.seen]).chain(slopes.as_flattened()) {
                    let mut lanes = [0.0; LANES];
                    registers_mut::<S>(&mut lanes)[0] = value.1;
                    (0..width).for_each(|lane| found[first + lane].push(lanes[lane]));
                }
            }
            found.concat()
        }
    }

    fn agrees(camera: &impl BatchProjection) {
        let point = [
            [0.0, 1e-9, 10.0, -30.0, 0.3, 25.0, 1e-9, 60.0],
            [0.0, 0.0, -20.0, 15.0, 0.2, -25.0, -2e-9, 5.0],
            [80.0, 80.0, 80.0, 80.0, 80.0, 60.0, -3.0, -10.0],
        ];
        let all = on_each(|| All(camera, &point));
        let same = |a: &f64, b: &f64| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan();
        assert!(all.iter().all(|other| other.iter().zip(&all[0]).all(|(a, b)| same(a, b))));
        let count = camera.clone().parameters_mut().len();
        for (lane, found) in all[0].chunks_exact(9 + 2 * MOST_NUMBERS).enumerate() {
            let mut slopes = [[0.0; 2]; MOST_NUMBERS];
            let place = Point3::new(point[0][lane], point[1][lane], point[2][lane]);
            let wanted = camera.project_with_slopes(place, &mut slopes[..count]);
            assert_eq!(wanted.is_none(), found[8].is_nan(), "{place}");
            let Some((pixel, by_point)) = wanted else { continue };
            let of_point = by_point.transpose();
            let wanted = pixel.iter().chain(of_point.iter()).chain([&0.0]);
            for (a, b) in found.iter().zip(wanted.chain(slopes[..count].as_flattened())) {
                assert!((a - b).abs() <= 1e-12 * (1.0 + b.abs()), "{place}: {a} and {b}");
            }
        }
    }

    #[test]
    fn a_register_of_points_goes_where_each_of_them_does() {
        agrees(&BrownConrady { prism: [1e-3, -2e-3, 5e-4, 3e-3], ..BrownConrady::default() });
        agrees(&BrownConrady { rational: [0.1, -0.03, 0.01], ..BrownConrady::default() });
        agrees(&BrownConrady { tilt: [0.1, -0.2], ..BrownConrady::default() });
        agrees(&KannalaBrandt::default());
        agrees(&Tsai::default());
        agrees(&Tsai { kappa: -0.1, ..Tsai::default() });
    }
}
