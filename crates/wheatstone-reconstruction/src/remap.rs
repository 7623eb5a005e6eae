//! Rectified pictures for a matcher.

use rayon::prelude::*;
use wheatstone_charts::imaging::GrayImage;
use wheatstone_core::rectification::Table;

/// The rectified picture that a table makes, in 8 bits, black where the table shows nothing.
///
/// Between pixels it is cubic (Keys 1981, doi:10.1109/TASSP.1981.1163711): what is linear is blurred between pixels and
/// sharp on them, which moves disparities.
pub(crate) fn rectified(table: &Table, picture: &GrayImage) -> Vec<u8> {
    let mut pixels = vec![0; table.width * table.height];
    pixels.par_chunks_mut(table.width).enumerate().for_each(|(y, row)| {
        for (x, value) in row.iter_mut().enumerate() {
            let at = y * table.width + x;
            let (x, y) = (table.x[at], table.y[at]);
            if [x, y] != [Table::NOWHERE; 2] {
                *value = (sample(picture, x, y) + 0.5).clamp(0.0, 255.0) as u8;
            }
        }
    });
    pixels
}

fn sample(picture: &GrayImage, x: f32, y: f32) -> f32 {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadratic_pictures_are_kept_between_pixels() {
        let shade = |x: f32, y: f32| 20.0 + 3.0 * x + 0.25 * x * x + 2.0 * y;
        let picture = GrayImage::from_fn(12, 9, |x, y| shade(x as f32, y as f32));
        for (x, y) in [(4.0, 3.0), (4.3, 3.6), (7.75, 5.5)] {
            assert!((sample(&picture, x, y) - shade(x, y)).abs() < 1e-3);
        }
    }
}
