//! How sure the points are at which polynomial cameras' rays meet: from the noise of the pixels and the covariance
//! of the polynomials' factors.

use super::{Polynomials, TERMS, polynomial};
use crate::{
    geometry::meeting::Normal,
    numeric::{
        number::{Doubles, Number, registers, registers_mut},
        simd::{Simd, WithSimd, on_widest},
    },
};

/// Points worked on at once: their numbers stay in the nearest cache.
const BLOCK: usize = 64;

/// Columns that are told: the covariance, and what residual to expect.
const TOLD: usize = 7;

/// What is said of a point.
struct Spread<N> {
    /// XX, XY, XZ, YY, YZ, ZZ.
    covariance: [N; 6],
    residual_sigma: N,
}

impl Polynomials {
    /// The covariance XX, XY, XZ, YY, YZ, ZZ of points, and the root mean square that their residual is to be
    /// expected to have; `noise` holds a column of pixel variances a camera.
    pub(crate) fn spread(
        &self,
        (points, noise): ([&[f64]; 3], &[Vec<f64>]),
        covariance: &mut [&mut [f64]; 6],
        residual_sigma: &mut [f64],
    ) {
        on_widest(Pass { polynomials: self, points, noise, covariance, residual_sigma });
    }

    /// Of one point.
    #[inline(always)]
    fn spread_at<N: Number>(&self, point: [N; 3], noise: &impl Noise<N>) -> Spread<N> {
        let place = self.scaled(point);
        let zero = place[0].all(0.0);
        let terms = terms(place);
        let (mut normal, mut errors, mut expected) = (Normal::new(zero), Normal::new(zero), zero);
        for (index, camera) in self.cameras.iter().enumerate() {
            let variance = noise.of(index) + quadratic(&camera.covariance, &terms);
            let mut rows = [[zero; 3]; 2];
            for (row, factors) in rows.iter_mut().zip(&camera.factors) {
                *row = polynomial(factors, place).1;
            }
            normal.add(rows, [zero; 2], zero.all(1.0));
            errors.add(rows, [zero; 2], variance);
            expected = expected + variance + variance;
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
                    *value = *value + inverse[SYMMETRIC[i][k]] * errors.left[SYMMETRIC[k][j]];
                }
            }
        }
        let mut covariance = [zero; 6];
        for (i, row) in carried.iter().enumerate() {
            expected = expected - row[i];
            for j in i..3 {
                let mut sum = zero;
                for k in 0..3 {
                    sum = sum + row[k] * inverse[SYMMETRIC[k][j]];
                }
                covariance[SYMMETRIC[i][j]] = sum * zero.all(self.half[i] * self.half[j]);
            }
        }
        let freedom = (2 * self.cameras.len() - 3) as f64;
        let residual_sigma = (expected.or_larger(zero) * zero.all(1.0 / freedom)).root();
        Spread { covariance, residual_sigma }
    }
}

/// Where the six numbers of a symmetric matrix stand.
const SYMMETRIC: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// The variance of a pixel's noise, a camera each.
trait Noise<N> {
    fn of(&self, camera: usize) -> N;
}

/// What all terms come to at a place, as [`super::POWERS`] has them.
#[inline(always)]
fn terms<N: Number>([x, y, z]: [N; 3]) -> [N; TERMS] {
    let (xx, xy, yy) = (x * x, x * y, y * y);
    let (xz, yz, zz) = (x * z, y * z, z * z);
    [
        x.all(1.0),
        x,
        y,
        xx,
        xy,
        yy,
        xx * x,
        xx * y,
        x * yy,
        yy * y,
        z,
        xz,
        yz,
        xx * z,
        xy * z,
        yy * z,
        zz,
        xz * z,
        yz * z,
    ]
}

/// The variance of a sum of terms, of which the factors have this covariance.
#[inline(always)]
fn quadratic<N: Number>(covariance: &[[f64; TERMS]; TERMS], terms: &[N; TERMS]) -> N {
    let mut whole = terms[0].all(0.0);
    for (index, row) in covariance.iter().enumerate() {
        let mut below = terms[0].all(0.0);
        for (factor, term) in row[..index].iter().zip(terms) {
            below = below + term.all(*factor) * *term;
        }
        let own = terms[index];
        whole = whole + own * (below + below + own.all(row[index]) * own);
    }
    whole
}

/// One run through columns.
struct Pass<'a, 'b, 'c> {
    polynomials: &'a Polynomials,
    points: [&'a [f64]; 3],
    noise: &'a [Vec<f64>],
    covariance: &'b mut [&'c mut [f64]; 6],
    residual_sigma: &'b mut [f64],
}

impl WithSimd for Pass<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { polynomials, points, noise, covariance, residual_sigma } = self;
        let mut places = [[0.0; BLOCK]; 3];
        let mut variances = vec![[0.0; BLOCK]; noise.len()];
        let mut told = [[0.0; BLOCK]; TOLD];
        for start in (0..residual_sigma.len()).step_by(BLOCK) {
            let end = residual_sigma.len().min(start + BLOCK);
            for (own, column) in places.iter_mut().zip(points) {
                own[..end - start].copy_from_slice(&column[start..end]);
            }
            for (own, column) in variances.iter_mut().zip(noise) {
                own[..end - start].copy_from_slice(&column[start..end]);
            }
            tell::<S>(simd, polynomials, (&places, &variances), &mut told);
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
    polynomials: &Polynomials,
    (places, variances): (&[[f64; BLOCK]; 3], &[[f64; BLOCK]]),
    told: &mut [[f64; BLOCK]; TOLD],
) {
    for place in 0..registers::<S>(&places[0]).len() {
        let mut point = [Doubles(simd, simd.splat_f64s(0.0)); 3];
        for (value, column) in point.iter_mut().zip(places) {
            value.1 = registers::<S>(column)[place];
        }
        let found = polynomials.spread_at(point, &Variances { simd, variances, place });
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
    use crate::{
        geometry::meeting::{POWERS, SoloffPolynomial},
        numeric::{random::Random, simd::on_each},
    };

    #[test]
    fn terms_are_the_powers_in_their_order() {
        let place = [0.3, -0.7, 1.1];
        for (term, powers) in terms(place).into_iter().zip(POWERS) {
            let wanted: f64 =
                (0..3).map(|axis| f64::powi(place[axis], powers[axis].into())).product();
            assert!((term - wanted).abs() < 1e-15, "{powers:?}: {term} {wanted}");
        }
    }

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
        let mut told: Vec<Vec<Vec<f64>>> = vec![vec![vec![f64::NAN; POINTS]; TOLD]; 5];
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
            Pass { polynomials: &polynomials, points, noise: &noise, covariance, residual_sigma }
        });
        drop(columns);
        told.truncate(widths.len());
        assert!(told[0].iter().flatten().all(|value| value.is_finite()));
        assert!(told.iter().all(|other| *other == told[0]));
    }
}
