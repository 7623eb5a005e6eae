//! Rectified pictures, for matchers and to look at.

use crate::imaging::{Annotated, GrayImage};
use rayon::prelude::*;
use wheatstone_core::{geometry::Pixel, rectification::Table};

/// The rectified picture that a table makes of `picture`; black where the table shows nothing.
///
/// Between pixels it is cubic (Keys 1981, doi:10.1109/TASSP.1981.1163711): what is linear is blurred between pixels and
/// sharp on them, which moves disparities.
#[must_use]
pub fn remapped(table: &Table, picture: &GrayImage) -> GrayImage {
    let mut values = vec![0.0; table.width * table.height];
    values.par_chunks_mut(table.width).enumerate().for_each(|(y, row)| {
        for (x, value) in row.iter_mut().enumerate() {
            let at = y * table.width + x;
            let (x, y) = (table.x[at], table.y[at]);
            if [x, y] != [Table::NOWHERE; 2] {
                *value = cubic(picture, x, y).clamp(0.0, 255.0);
            }
        }
    });
    GrayImage::from_fn(table.width, table.height, |x, y| values[y * table.width + x])
}

fn cubic(picture: &GrayImage, x: f32, y: f32) -> f32 {
    let (column, row) = (x.floor(), y.floor());
    let (across, down) = (weights(x - column), weights(y - row));
    let mut sum = 0.0;
    for (down, dy) in down.into_iter().zip(-1..) {
        for (across, dx) in across.into_iter().zip(-1..) {
            sum += down * across * picture.at(column as isize + dx, row as isize + dy);
        }
    }
    sum
}

/// Of the pixels one before, at, one and two after a place.
fn weights(part: f32) -> [f32; 4] {
    let (square, cube) = (part * part, part * part * part);
    [
        0.5 * (2.0 * square - cube - part),
        0.5 * (3.0 * cube - 5.0 * square + 2.0),
        0.5 * (4.0 * square - 3.0 * cube + part),
        0.5 * (cube - square),
    ]
}

/// Two pictures beside each other with level lines across both: what lies on a line in one lies on it in
/// the other.
#[must_use]
pub fn side_by_side(left: &GrayImage, right: &GrayImage) -> Annotated {
    // Enough to find something on each, few enough to tell them apart.
    const LINES: usize = 16;
    const COLOURS: [[u8; 3]; 2] = [[214, 73, 51], [23, 123, 189]];
    let (width, height) = (left.width() + right.width(), left.height().max(right.height()));
    let both = GrayImage::from_fn(width, height, |x, y| {
        let (picture, x) = if x < left.width() { (left, x) } else { (right, x - left.width()) };
        if y < picture.height() { picture.at(x as isize, y as isize) } else { 0.0 }
    });
    let mut drawn = Annotated::new(&both);
    for line in 0..LINES {
        let y = ((line as f64 + 0.5) * height as f64 / LINES as f64).round();
        let end = width as f64 - 1.0;
        drawn.line(Pixel::new(0.0, y), Pixel::new(end, y), COLOURS[line % 2]);
    }
    drawn
}

#[cfg(test)]
mod tests {
    use super::{GrayImage, cubic};

    #[test]
    fn quadratic_pictures_are_kept_between_pixels() {
        let shade = |x: f32, y: f32| 20.0 + 3.0 * x + 0.25 * x * x + 2.0 * y;
        let picture = GrayImage::from_fn(12, 9, |x, y| shade(x as f32, y as f32));
        for (x, y) in [(4.0, 3.0), (4.3, 3.6), (7.75, 5.5)] {
            assert!((cubic(&picture, x, y) - shade(x, y)).abs() < 1e-3);
        }
    }
}
