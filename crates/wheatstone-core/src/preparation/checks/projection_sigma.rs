//! How uncertain it is where a fitted camera sees points: few points leave a lens open, above all beyond them.

use super::{
    decentred_camera::{DecentredCamera, Row, UNKNOWNS},
    pairs::Pair,
    resection::{Normal, cauchy},
};
use nalgebra::{Cholesky, Const, SMatrix};

/// The covariance of a camera's numbers, as the factor of its inverse.
pub(super) struct ProjectionSigma {
    camera: DecentredCamera,
    factor: Option<Cholesky<f64, Const<UNKNOWNS>>>,
}

impl ProjectionSigma {
    /// Of a camera that was fitted to these pairs.
    pub(super) fn new(camera: &DecentredCamera, fitted: &[Pair]) -> Self {
        let mut matrix = Normal::weighed(camera, fitted, cauchy).matrix;
        let unknowns = camera.unknowns();
        (unknowns..UNKNOWNS).for_each(|index| matrix[(index, index)] = 1.0);
        // What the fit takes up of the errors is missing in their scale.
        let freedom = (2 * fitted.len()).saturating_sub(unknowns) as f64;
        matrix *= freedom / (2 * fitted.len()).max(1) as f64;
        Self { camera: camera.clone(), factor: matrix.cholesky() }
    }

    /// Root mean square over these pairs of the standard deviation of where the camera sees them, both axes together, in
    /// pixels. Infinite where the fit left a number open.
    pub(super) fn over(&self, pairs: &[Pair]) -> f64 {
        let Some(factor) = &self.factor else { return f64::INFINITY };
        let variance = |(world, _): &Pair| {
            let slopes = slopes(&self.camera.row(*world)?);
            Some(slopes.dot(&factor.solve(&slopes)))
        };
        let variances: Vec<f64> = pairs.iter().filter_map(variance).collect();
        (variances.iter().sum::<f64>() / variances.len().max(1) as f64).sqrt()
    }
}

/// How the pixel changes with the camera's numbers, a column an axis.
fn slopes(row: &Row) -> SMatrix<f64, UNKNOWNS, 2> {
    SMatrix::from_fn(|index, axis| match index {
        0..3 => row.by_turn[(axis, index)],
        3..6 => row.by_point[(axis, index - 3)],
        _ => row.by_lens[index - 6][axis],
    })
}
