//! Rectified pairs: disparities of two pictures.

use crate::{errors::invalid, pictures::picture, pool::pool};
use numpy::{PyArray2, PyArrayMethods, ToPyArray};
use pyo3::prelude::*;
use wheatstone::stereo::{MatchError, Matcher, Picture, vertical_offset};

/// Disparity, confidence and standard deviation (height, width), and how many rows lower the right picture shows things.
type Matched<'py> =
    (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<f32>>, Option<f32>);

/// Matches a rectified pair.
#[pyfunction]
pub(crate) fn match_pair<'py>(
    py: Python<'py>,
    pair: (Bound<'py, PyAny>, Bound<'py, PyAny>),
    range: (i32, i32),
    refine: bool,
    fill: bool,
    bgr: bool,
) -> PyResult<Matched<'py>> {
    let images = [picture(&pair.0, bgr)?, picture(&pair.1, bgr)?];
    let work = || -> Result<_, MatchError> {
        let bytes = images.each_ref().map(|image| image.to_8_bit().into_raw());
        let [left, right] = [0, 1]
            .map(|side| Picture::new(images[side].width(), images[side].height(), &bytes[side]));
        let (left, right) = (left?, right?);
        let matcher = Matcher::new(range.0..range.1).refining(refine).filling(fill);
        let map = matcher.compute(&left, &right)?;
        Ok((map, vertical_offset(&left, &right, range.0..range.1)?))
    };
    let (map, vertical) = py.detach(|| pool().map(|pool| pool.install(work)))?.map_err(|e| {
        invalid(e.to_string(), "give a rectified pair, and a range such as (0, 64)")
    })?;
    let array = |values: &[f32]| values.to_pyarray(py).reshape([map.height, map.width]);
    let vertical = vertical.map(|found| found.median);
    Ok((array(&map.disparity)?, array(&map.confidence)?, array(&map.sigma)?, vertical))
}
