//! Of cameras that are polynomials of the world.

use super::{Observation, UncertainCameras};
use crate::geometry::batch_triangulation::{Polynomials, TERMS, polynomials::polynomial};
use wheatstone_numeric::number::Number;

impl UncertainCameras for Polynomials {
    fn count(&self) -> usize {
        self.cameras.len()
    }

    #[inline(always)]
    fn observation<N: Number>(&self, camera: usize, point: [N; 3], noise: N) -> Observation<N> {
        let place = self.scaled(point);
        let (camera, zero) = (&self.cameras[camera], noise.all(0.0));
        let mut rows = [[zero; 3]; 2];
        for (row, factors) in rows.iter_mut().zip(&camera.factors) {
            *row = polynomial(factors, place).1;
            for (value, half) in row.iter_mut().zip(self.half) {
                *value = *value * zero.all(1.0 / half);
            }
        }
        let variance = noise + quadratic(&camera.covariance, &terms(place));
        Observation { rows, covariance: [variance, zero, variance] }
    }
}

/// What all terms come to at a place, as [`POWERS`](crate::geometry::batch_triangulation::POWERS) has them.
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
            below = below.add_product(term.all(*factor), *term);
        }
        let own = terms[index];
        whole = whole + own * (below + below + own.all(row[index]) * own);
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::batch_triangulation::POWERS;

    #[test]
    fn terms_are_the_powers_in_their_order() {
        let place = [0.3, -0.7, 1.1];
        for (term, powers) in terms(place).into_iter().zip(POWERS) {
            let wanted: f64 =
                (0..3).map(|axis| f64::powi(place[axis], powers[axis].into())).product();
            assert!((term - wanted).abs() < 1e-15, "{powers:?}: {term} {wanted}");
        }
    }
}
