//! A camera at a pose with a lens from telephoto to fisheye, whose elements may stand beside the axis.
//!
//! Source: Kannala & Brandt 2006 (doi:10.1109/TPAMI.2006.153), and the tangential terms of Brown 1966 ("Decentering
//! distortion of lenses") in OpenCV's order; a tilted sensor does nearly the same.

use crate::{
    camera::{
        AdjustableCamera, kannala_brandt::KannalaBrandt, pinhole::Pinhole, posed_lens::PosedLens,
    },
    geometry::{Pixel, Point3},
};
use nalgebra::{Matrix2x3, Vector2};

/// The lens's own numbers: focal lengths, principal point, four radial coefficients, two of the decentring.
pub(super) const LENS: usize = 10;

/// Unknowns of a camera: rotation, translation, the lens's numbers.
pub(super) const UNKNOWNS: usize = 6 + LENS;

/// Tangential terms.
const TANGENTIAL: usize = 2;

#[derive(Clone, Debug)]
pub(super) struct DecentredCamera {
    pub(super) posed: PosedLens<KannalaBrandt>,
    /// p1 and p2; `None` where the elements are taken to stand on the axis.
    pub(super) decentring: Option<[f64; TANGENTIAL]>,
}

/// Where a point falls, and how that changes with a turn, with the point in the camera's frame, and with the lens's numbers.
pub(super) struct Row {
    pub(super) pixel: Pixel,
    pub(super) by_turn: Matrix2x3<f64>,
    pub(super) by_point: Matrix2x3<f64>,
    pub(super) by_lens: [[f64; 2]; LENS],
}

impl DecentredCamera {
    /// Of its pose and of the terms that its lens has.
    pub(super) fn unknowns(&self) -> usize {
        if self.decentring.is_some() { UNKNOWNS } else { UNKNOWNS - TANGENTIAL }
    }

    /// Of a point in the world.
    pub(super) fn row(&self, world: Point3) -> Option<Row> {
        let PosedLens { lens, camera_from_world: pose } = &self.posed;
        let turned = pose.rotation * world.coords;
        let mut by_lens = [[0.0; 2]; LENS];
        let (radial, tangential) = by_lens.split_at_mut(LENS - TANGENTIAL);
        let (seen, by_point) =
            lens.project_with_slopes(Point3::from(turned + pose.translation), radial)?;
        let mut pixel = seen;
        // The other slopes change by a hundredth with it: too little to lead a search astray.
        if let Some(decentring) = self.decentring {
            tangential.copy_from_slice(&tangential_slopes(&lens.pinhole, seen));
            for (by, value) in tangential.iter().zip(decentring) {
                pixel += Vector2::from(*by) * value;
            }
        }
        Some(Row { pixel, by_turn: by_point * -turned.cross_matrix(), by_point, by_lens })
    }

    /// Where a point in the world falls.
    pub(super) fn project(&self, world: Point3) -> Option<Pixel> {
        let pixel = self.row(world)?.pixel;
        (pixel.x.is_finite() && pixel.y.is_finite()).then_some(pixel)
    }
}

/// How a pixel moves with p1 and with p2.
fn tangential_slopes(pinhole: &Pinhole, pixel: Pixel) -> [[f64; 2]; TANGENTIAL] {
    let [x, y] = pinhole.place(pixel);
    let [fx, fy] = pinhole.focal;
    let square = x * x + y * y;
    [
        [fx * 2.0 * x * y, fy * (square + 2.0 * y * y)],
        [fx * (square + 2.0 * x * x), fy * 2.0 * x * y],
    ]
}
