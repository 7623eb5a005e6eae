//! How noisy pixels are, as arrays have it.

use crate::errors::invalid;
use numpy::{
    PyReadonlyArray2,
    ndarray::{ArrayView2, s},
};
use pyo3::prelude::*;
use std::ops::Range;
use wheatstone::method::PixelSigmas;

/// Standard deviations of pixels, in pixels.
#[derive(FromPyObject)]
pub(crate) enum Sigmas<'py> {
    /// One for all of them.
    One(f64),
    /// One for each (n, cameras).
    Each(PyReadonlyArray2<'py, f64>),
}

/// The same without the interpreter.
#[derive(Clone, Copy)]
pub(crate) enum Given<'a> {
    One(f64),
    Each(ArrayView2<'a, f64>),
}

impl<'a> Given<'a> {
    pub(crate) fn of(sigmas: &'a Sigmas) -> Self {
        match sigmas {
            Sigmas::One(sigma) => Self::One(*sigma),
            Sigmas::Each(sigmas) => Self::Each(sigmas.as_array()),
        }
    }

    /// Those of some rows, whose columns are put into `columns`.
    pub(crate) fn of_rows(
        self,
        rows: Range<usize>,
        columns: &mut Vec<Vec<f64>>,
    ) -> PixelSigmas<'_> {
        match self {
            Self::One(sigma) => PixelSigmas::One(sigma),
            Self::Each(each) => {
                transpose(each.slice(s![rows, ..]), columns);
                PixelSigmas::Each(columns.iter().map(Vec::as_slice).collect())
            }
        }
    }
}

/// Copies some rows to columns as they are.
fn transpose(rows: ArrayView2<f64>, columns: &mut Vec<Vec<f64>>) {
    columns.resize_with(rows.ncols(), Vec::new);
    for (own, column) in columns.iter_mut().zip(rows.columns()) {
        own.clear();
        own.extend(column);
    }
}

/// Refuses what is no standard deviation of a pixel that was seen.
pub(crate) fn refuse_sigmas<T: Copy + Into<f64>>(
    rows: ArrayView2<T>,
    sigmas: ArrayView2<f64>,
) -> PyResult<()> {
    let hint = "give a value above 0, in pixels, for each pixel";
    if sigmas.dim() != (rows.nrows(), rows.ncols() / 2) {
        return Err(invalid(format!("pixel_sigma has shape {:?}", sigmas.shape()), hint));
    }
    let is_wrong = |(place, sigma): &((usize, usize), &f64)| {
        let &(row, camera) = place;
        let [x, y] = [0, 1].map(|axis| -> f64 { rows[[row, 2 * camera + axis]].into() });
        !(**sigma > 0.0 && sigma.is_finite()) && x.is_finite() && y.is_finite()
    };
    match sigmas.indexed_iter().find(is_wrong) {
        None => Ok(()),
        Some(((row, camera), sigma)) => {
            Err(invalid(format!("pixel_sigma of row {row}, camera {camera} is {sigma}"), hint))
        }
    }
}
