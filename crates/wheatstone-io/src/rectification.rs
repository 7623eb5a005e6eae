//! Rectified pictures to look at.

use wheatstone_charts::imaging::{Annotated, GrayImage};
use wheatstone_core::{geometry::Pixel, rectification::Table};

/// The rectified picture that a table makes of `picture`: bilinear between pixels; black where the table
/// shows nothing.
#[must_use]
pub fn remapped(table: &Table, picture: &GrayImage) -> GrayImage {
    let value = |index: usize| {
        let (x, y) = (table.x[index], table.y[index]);
        let nothing = x == Table::NOWHERE && y == Table::NOWHERE;
        if nothing { 0.0 } else { picture.sample(Pixel::new(f64::from(x), f64::from(y))) }
    };
    GrayImage::from_fn(table.width, table.height, |x, y| value(y * table.width + x))
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
