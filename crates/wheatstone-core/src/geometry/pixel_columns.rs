//! Pixels of many points, column by column.

use super::Pixel;
use std::ops::Range;

/// Matched pixels of many points: a column of x and one of y for each camera, all of one length. NaN
/// stands where a camera did not see a point.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelColumns<'a> {
    cameras: Vec<[&'a [f64]; 2]>,
    points: usize,
}

impl<'a> PixelColumns<'a> {
    /// Of columns, x and y of each camera; what is longer than the shortest is left off.
    #[must_use]
    pub fn new(mut cameras: Vec<[&'a [f64]; 2]>) -> Self {
        let points = cameras.iter().flatten().map(|column| column.len()).min().unwrap_or(0);
        cameras.iter_mut().flatten().for_each(|column| *column = &column[..points]);
        Self { cameras, points }
    }

    /// How many points.
    #[must_use]
    pub fn points(&self) -> usize {
        self.points
    }

    /// x and y of each camera.
    #[must_use]
    pub fn cameras(&self) -> &[[&'a [f64]; 2]] {
        &self.cameras
    }

    /// What the cameras saw of one point.
    pub fn point(&self, index: usize) -> impl Iterator<Item = Option<Pixel>> + '_ {
        self.cameras.iter().map(move |[x, y]| {
            let pixel = Pixel::new(x[index], y[index]);
            (!pixel.x.is_nan() && !pixel.y.is_nan()).then_some(pixel)
        })
    }

    /// Some of the points, one after another.
    #[must_use]
    pub fn part(&self, points: Range<usize>) -> Self {
        let of = |[x, y]: &[&'a [f64]; 2]| [&x[points.clone()], &y[points.clone()]];
        Self { cameras: self.cameras.iter().map(of).collect(), points: points.len() }
    }
}

/// Columns of pixels that are given row by row, one entry a camera: x and y of each camera.
#[must_use]
pub fn columns_of(rows: &[Vec<Option<Pixel>>], cameras: usize) -> Vec<[Vec<f64>; 2]> {
    let column = |camera: usize, axis: usize| {
        let value = |row: &Vec<Option<Pixel>>| {
            row.get(camera).copied().flatten().map_or(f64::NAN, |pixel| pixel[axis])
        };
        rows.iter().map(value).collect()
    };
    (0..cameras).map(|camera| [column(camera, 0), column(camera, 1)]).collect()
}
