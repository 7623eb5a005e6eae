//! Whether a lens holds all over a picture and a little beyond.
//!
//! Coefficients are known where points were observed. Undistortion works on the whole picture, and beyond it
//! where an image is scaled to keep all of it: there a polynomial may fold the picture over, and a quotient
//! may have a pole.

use super::{CameraModel, brown_conrady::BrownConrady};
use crate::geometry::{Pixel, Point3};

/// Left, top, right and bottom edge of a part of a picture, in pixels.
pub type Area = [f64; 4];

/// By this share of each side a lens must hold beyond the picture.
const BEYOND: f64 = 0.1;

/// Intervals between the pixels that are looked at along a side.
const STEPS: usize = 12;

/// The largest second difference of an undistortion map, in pixels over one pixel; what lenses really do
/// stays below a hundredth.
const LARGEST_JUMP: f64 = 0.1;

/// Pixels on a grid over the area and a tenth beyond.
fn pixels([left, top, right, bottom]: Area) -> impl Iterator<Item = Pixel> {
    let (wide, high) = (right - left, bottom - top);
    let along = |low: f64, side: f64, step: usize| {
        low - BEYOND * side + (1.0 + 2.0 * BEYOND) * side * step as f64 / STEPS as f64
    };
    let all = (0..=STEPS).flat_map(|row| (0..=STEPS).map(move |column| (column, row)));
    all.map(move |(column, row)| Pixel::new(along(left, wide, column), along(top, high, row)))
}

/// The part of an area of which the area is a tenth beyond: what holds over it holds over the area, and no more.
#[must_use]
pub fn without_margin([left, top, right, bottom]: Area) -> Area {
    const MARGIN: f64 = BEYOND / (1.0 + 2.0 * BEYOND);
    let [x, y] = [MARGIN * (right - left), MARGIN * (bottom - top)];
    [left + x, top + y, right - x, bottom - y]
}

/// Whether every pixel of the area, and of a tenth beyond it, has a ray.
#[must_use]
pub fn has_rays(lens: &impl CameraModel, area: Area) -> bool {
    pixels(area).all(|pixel| lens.ray(pixel).is_some())
}

/// Whether an image of the area, and of a tenth beyond it, can be undistorted: every pixel has a ray, and the
/// map from undistorted to distorted pixels has no pole, no fold and no jump.
#[must_use]
pub fn undistorts(lens: &BrownConrady, area: Area) -> bool {
    let distorted = |x: f64, y: f64| {
        let [x, y] = lens.pinhole.place(Pixel::new(x, y));
        lens.project(Point3::new(x, y, 1.0))
    };
    let is_smooth = |pixel: Pixel, [dx, dy]: [f64; 2]| {
        let (x, y) = (pixel.x, pixel.y);
        let all = (distorted(x - dx, y - dy), distorted(x, y), distorted(x + dx, y + dy));
        let (Some(before), Some(middle), Some(after)) = all else { return false };
        (before.coords - 2.0 * middle.coords + after.coords).norm() < LARGEST_JUMP
    };
    has_rays(lens, area)
        && pixels(area).all(|pixel| [[1.0, 0.0], [0.0, 1.0]].iter().all(|by| is_smooth(pixel, *by)))
}

/// The smallest area that holds all pixels; `None` where there are none.
#[must_use]
pub fn bounding(pixels: impl Iterator<Item = Pixel>) -> Option<Area> {
    pixels.fold(None, |area, pixel| {
        let [left, top, right, bottom] = area.unwrap_or([pixel.x, pixel.y, pixel.x, pixel.y]);
        Some([left.min(pixel.x), top.min(pixel.y), right.max(pixel.x), bottom.max(pixel.y)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::pinhole::Pinhole;

    const PICTURE: Area = [-0.5, -0.5, 639.5, 479.5];

    fn lens(radial: [f64; 3], rational: [f64; 3]) -> BrownConrady {
        let pinhole = Pinhole { focal: [530.0, 530.0], principal: [320.0, 240.0] };
        BrownConrady { radial, rational, ..BrownConrady::ideal(pinhole) }
    }

    #[test]
    fn folds_and_poles_in_the_picture_are_found() {
        assert!(undistorts(&lens([-0.3, 0.1, 0.0], [0.0; 3]), PICTURE));
        // The radius r - r^3 turns round at 0.577; the corner of the picture is at 0.75.
        assert!(!undistorts(&lens([-1.0, 0.0, 0.0], [0.0; 3]), PICTURE));
        // 1 - 2 r^2 is 0 at 0.707; above it stands the same but for a thousandth.
        assert!(!undistorts(&lens([-1.999, 0.0, 0.0], [-2.0, 0.0, 0.0]), PICTURE));
        assert!(undistorts(&lens([0.1, 0.0, 0.0], [0.3, 0.0, 0.0]), PICTURE));
        assert!(undistorts(&lens([-1.0, 0.0, 0.0], [0.0; 3]), [220.0, 140.0, 420.0, 340.0]));
    }

    #[test]
    fn without_its_margin_an_area_is_asked_for_itself_alone() {
        // The radius r - 0.2 r^3 turns round at 1.29, where it is 0.86: beyond the corner at 0.755, not by a tenth.
        let folds_beyond = lens([-0.2, 0.0, 0.0], [0.0; 3]);
        assert!(!undistorts(&folds_beyond, PICTURE));
        assert!(undistorts(&folds_beyond, without_margin(PICTURE)));
        assert!(!undistorts(&lens([-1.0, 0.0, 0.0], [0.0; 3]), without_margin(PICTURE)));
        let all: Vec<_> = pixels(without_margin(PICTURE)).collect();
        let within = |pixel: &&Pixel| {
            (-0.5 - 1e-9..=639.5 + 1e-9).contains(&pixel.x)
                && (-0.5 - 1e-9..=479.5 + 1e-9).contains(&pixel.y)
        };
        assert_eq!(all.iter().filter(within).count(), all.len());
        assert!(all.iter().any(|pixel| (pixel.x + 0.5).abs() < 1e-9));
    }
}
