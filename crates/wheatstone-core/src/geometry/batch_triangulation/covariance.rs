//! How sure the points are at which rays meet, of cameras that say how sure they are themselves: from the noise of the
//! pixels and the covariance of what was fitted, to first order.
//!
//! There are loops here where closures would be shorter: those would not become part of a kernel.

mod matrices;
mod polynomials;

use super::Normal;
pub(crate) use matrices::{PRODUCTS, UncertainMatrix};
use wheatstone_numeric::{
    number::{Doubles, Number, registers, registers_mut},
    simd::{Simd, WithSimd, on_widest},
};

/// Points worked on at once: their numbers stay in the nearest cache.
const BLOCK: usize = 64;

/// Columns that are told: the covariance, and what residual to expect.
const FIGURES: usize = 7;

/// What a camera says of a point.
pub(crate) struct Observation<N> {
    /// Derivatives of its pixel's x and y by the point's coordinates.
    rows: [[N; 3]; 2],
    /// The covariance of a seen pixel about the predicted one, detector's and fit's, in squared pixels: xx, xy, yy.
    covariance: [N; 3],
}

/// Cameras that say how sure they are. A squared pixel of error counts the same in each.
pub(crate) trait UncertainCameras {
    /// How many.
    fn count(&self) -> usize;

    /// What one of them says of a point, where pixels scatter by this variance.
    fn observation<N: Number>(&self, camera: usize, point: [N; 3], noise: N) -> Observation<N>;
}

/// The covariance XX, XY, XZ, YY, YZ, ZZ of points, and the root mean square that their residual is to be
/// expected to have; `noise` holds a column of pixel variances a camera.
pub(crate) fn propagate(
    cameras: &impl UncertainCameras,
    (points, noise): ([&[f64]; 3], &[Vec<f64>]),
    covariance: &mut [&mut [f64]; 6],
    residual_sigma: &mut [f64],
) {
    on_widest(Pass { cameras, points, noise, covariance, residual_sigma });
}

/// What is said of a point.
struct PointCovariance<N> {
    /// XX, XY, XZ, YY, YZ, ZZ.
    covariance: [N; 6],
    residual_sigma: N,
}

/// Where the six numbers of a symmetric matrix stand.
const SYMMETRIC: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// Adds what one row times another comes to, where such products together are symmetric.
#[inline(always)]
fn add_square<N: Number>(sums: &mut [N; 6], a: [N; 3], b: [N; 3]) {
    for i in 0..3 {
        for j in i..3 {
            let sum = &mut sums[SYMMETRIC[i][j]];
            *sum = sum.add_product(a[i], b[j]);
        }
    }
}

/// Of one point.
#[inline(always)]
fn covariance_at<N: Number>(
    cameras: &impl UncertainCameras,
    point: [N; 3],
    noise: &impl Noise<N>,
) -> PointCovariance<N> {
    let zero = point[0].all(0.0);
    let (mut normal, mut errors, mut expected) = (Normal::new(zero), [zero; 6], zero);
    for camera in 0..cameras.count() {
        let Observation { rows, covariance: [xx, xy, yy] } =
            cameras.observation(camera, point, noise.of(camera));
        let mut heavy = rows;
        for axis in 0..3 {
            let [a, b] = [rows[0][axis], rows[1][axis]];
            heavy[0][axis] = (xx * a).add_product(xy, b);
            heavy[1][axis] = (xy * a).add_product(yy, b);
        }
        for (row, heavy) in rows.iter().zip(heavy) {
            add_square(&mut normal.left, *row, *row);
            add_square(&mut errors, *row, heavy);
        }
        expected = expected + xx + yy;
    }
    // Points follow pixels by K = (J'J)^-1 J', so that their covariance is K S K', and of the errors I - J K is
    // left: the mean of its square is the traces' S less K S J'.
    let (mut inverse, by) = normal.cofactors();
    for value in &mut inverse {
        *value = *value * by;
    }
    let mut carried = [[zero; 3]; 3];
    for (i, row) in carried.iter_mut().enumerate() {
        for (j, value) in row.iter_mut().enumerate() {
            for k in 0..3 {
                *value = value.add_product(inverse[SYMMETRIC[i][k]], errors[SYMMETRIC[k][j]]);
            }
        }
    }
    let mut covariance = [zero; 6];
    for (i, row) in carried.iter().enumerate() {
        expected = expected - row[i];
        for j in i..3 {
            let sum = &mut covariance[SYMMETRIC[i][j]];
            for k in 0..3 {
                *sum = sum.add_product(row[k], inverse[SYMMETRIC[k][j]]);
            }
        }
    }
    let freedom = (2 * cameras.count() - 3) as f64;
    let residual_sigma = (expected.max_with(zero) * zero.all(1.0 / freedom)).root();
    PointCovariance { covariance, residual_sigma }
}

/// The variance of a pixel's noise, a camera each.
trait Noise<N> {
    fn of(&self, camera: usize) -> N;
}

/// One run through columns.
struct Pass<'a, 'b, 'c, C> {
    cameras: &'a C,
    points: [&'a [f64]; 3],
    noise: &'a [Vec<f64>],
    covariance: &'b mut [&'c mut [f64]; 6],
    residual_sigma: &'b mut [f64],
}

impl<C: UncertainCameras> WithSimd for Pass<'_, '_, '_, C> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { cameras, points, noise, covariance, residual_sigma } = self;
        let mut places = [[0.0; BLOCK]; 3];
        let mut variances = vec![[0.0; BLOCK]; noise.len()];
        let mut told = [[0.0; BLOCK]; FIGURES];
        for start in (0..residual_sigma.len()).step_by(BLOCK) {
            let end = residual_sigma.len().min(start + BLOCK);
            for (own, column) in places.iter_mut().zip(points) {
                own[..end - start].copy_from_slice(&column[start..end]);
            }
            for (own, column) in variances.iter_mut().zip(noise) {
                own[..end - start].copy_from_slice(&column[start..end]);
            }
            tell::<S>(simd, cameras, (&places, &variances), &mut told);
            let columns = covariance.iter_mut().map(|column| &mut **column);
            for (column, own) in columns.chain([&mut *residual_sigma]).zip(&told) {
                column[start..end].copy_from_slice(&own[..end - start]);
            }
        }
    }
}

/// A block of points.
#[inline(always)]
fn tell<S: Simd>(
    simd: S,
    cameras: &impl UncertainCameras,
    (places, variances): (&[[f64; BLOCK]; 3], &[[f64; BLOCK]]),
    told: &mut [[f64; BLOCK]; FIGURES],
) {
    for place in 0..registers::<S>(&places[0]).len() {
        let mut point = [Doubles(simd, simd.splat_f64s(0.0)); 3];
        for (value, column) in point.iter_mut().zip(places) {
            value.1 = registers::<S>(column)[place];
        }
        let found = covariance_at(cameras, point, &Variances { simd, variances, place });
        let [xx, xy, xz, yy, yz, zz] = found.covariance;
        let all = [xx, xy, xz, yy, yz, zz, found.residual_sigma];
        for (column, value) in told.iter_mut().zip(all) {
            registers_mut::<S>(column)[place] = value.1;
        }
    }
}

/// Of one register of points.
struct Variances<'a, S> {
    simd: S,
    variances: &'a [[f64; BLOCK]],
    place: usize,
}

impl<S: Simd> Noise<Doubles<S>> for Variances<'_, S> {
    #[inline(always)]
    fn of(&self, camera: usize) -> Doubles<S> {
        Doubles(self.simd, registers::<S>(&self.variances[camera])[self.place])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::batch_triangulation::{Polynomials, SoloffPolynomial};
    use wheatstone_numeric::{random::Random, simd::on_each};

    #[test]
    fn every_width_and_every_place_says_the_same() {
        // The last register and the last block are not full.
        const POINTS: usize = 77;
        let mut random = Random::new(12);
        let mut any = || random.uniform(-1.0, 1.0);
        let camera = |_| SoloffPolynomial {
            factors: [(); 2].map(|()| std::array::from_fn(|_| 100.0 * any())),
            covariance: std::array::from_fn(|row| std::array::from_fn(|_| 1e-3 * row as f64)),
        };
        let cameras: Vec<SoloffPolynomial> = (0..3).map(camera).collect();
        let polynomials = Polynomials { cameras, centre: [3.0, -2.0, 90.0], half: [9.0, 7.0, 2.0] };
        let mut column = |middle: f64, half: f64| -> Vec<f64> {
            (0..POINTS).map(|_| middle + half * random.uniform(-1.0, 1.0)).collect()
        };
        let points = [column(3.0, 9.0), column(-2.0, 7.0), column(90.0, 2.0)];
        let points = points.each_ref().map(Vec::as_slice);
        let noise: Vec<Vec<f64>> = (0..3).map(|_| column(0.02, 0.01)).collect();
        let mut told: Vec<Vec<Vec<f64>>> = vec![vec![vec![f64::NAN; POINTS]; FIGURES]; 5];
        let mut next = told.iter_mut();
        let mut columns: Vec<([&mut [f64]; 6], &mut [f64])> = next
            .by_ref()
            .map(|told| {
                let (sigma, covariance) = told.split_last_mut().unwrap();
                let mut covariance = covariance.iter_mut();
                ([(); 6].map(|()| covariance.next().unwrap().as_mut_slice()), sigma.as_mut_slice())
            })
            .collect();
        let mut columns = columns.iter_mut();
        let widths = on_each(|| {
            let (covariance, residual_sigma) = columns.next().unwrap();
            Pass { cameras: &polynomials, points, noise: &noise, covariance, residual_sigma }
        });
        drop(columns);
        told.truncate(widths.len());
        assert!(told[0].iter().flatten().all(|value| value.is_finite()));
        assert!(told.iter().all(|other| *other == told[0]));
    }
}
