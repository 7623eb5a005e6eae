//! Rectified pictures that are equally sharp.

use crate::matches::Source;
use wheatstone_charts::{
    imaging::{ColourImage, filter::gaussian_blur},
    rectified_pictures::remapped,
};
use wheatstone_core::rectification::Table;

/// How far a camera blurs what it sees, as a standard deviation in its pixels: 0.29 by a square pixel, and 0.5 by its lens.
const OWN_BLUR: f64 = 0.58;
/// Less blur than this, in pixels, makes no difference.
const LEAST_BLUR: f64 = 0.3;

/// Two pictures as the tables show them, in grey. That of the camera of higher resolution is blurred until it is as sharp as
/// the other: the matcher would take details that one camera alone shows for noise of pixels.
pub(crate) fn rectified(tables: &[Table; 2], pictures: [&ColourImage; 2]) -> [Vec<u8>; 2] {
    // Where a table shows nothing in the middle, pictures stay as they are.
    let scales = match tables.each_ref().map(scale) {
        [Some(one), Some(other)] => [one, other],
        _ => [1.0; 2],
    };
    [0, 1].map(|side| {
        let (own, other) = (scales[side], scales[1 - side]);
        let blur = OWN_BLUR * (other * other - own * own).max(0.0).sqrt() / own;
        let picture = pictures[side].gray.stretched();
        let picture = if blur > LEAST_BLUR { gaussian_blur(&picture, blur) } else { picture };
        remapped(&tables[side], &picture).to_8_bit().into_raw()
    })
}

/// How many rectified pixels are as long as one of the camera's, in the middle.
fn scale(table: &Table) -> Option<f64> {
    let [x, y] = [table.width, table.height].map(|side| side as f64 / 2.0);
    Some(Source::of(table, x, y)?.stretch().sqrt())
}
