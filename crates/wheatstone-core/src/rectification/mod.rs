//! A virtual rectified pair from any two cameras of any model: two ideal pinholes side by side, looking
//! the same way, with the baseline along their rows. What one of them shows in a row the other shows in
//! the same row, so that programs for dense stereo can search along rows.
//!
//! A model says, of a world point, where each camera observes it; of a network, which does not say it, that is
//! first learned from where it finds points. The lines along which the cameras see are followed from the
//! near to the far end of the space that was shown; the virtual centres lie nearest to these lines. Where
//! they all meet there (lenses in air) the pair is exact. Where they do not (water, glass), no pinhole
//! can be: the tables then are exact at one depth, the harmonic mean of the depths that were shown, about
//! which the errors at the others are even, and what is left at each depth is told.
//!
//! Fusiello, Trucco & Verri 2000 (doi:10.1007/s001380050120) rectify pinholes so; the virtual centre of
//! cameras that see from many places is after Swaminathan, Grossberg & Nayar 2003
//! (doi:10.1109/CVPR.2003.1211522).

mod frame;
mod vertical_error;
mod maps;
mod points;
mod ray_table;
mod epipolar;
mod error_summary;
mod table;

pub use error_summary::ErrorSummary;
pub use table::Table;
pub use vertical_error::{AtDepth, VerticalError, VerticalErrors};

use crate::{
    Calibration, Error, Result,
    geometry::{Pixel, Point3, Pose, Vector3},
};
use maps::Maps;
use nalgebra::{Matrix3x4, Matrix4};
use serde::Serialize;
use wheatstone_numeric::progress::Progress;

/// What is wanted of a rectified pair.
#[derive(Clone, Debug, PartialEq)]
pub struct PairSettings {
    /// The two cameras, counted from 0, in any order.
    pub cameras: [usize; 2],
    /// Width and height of the model's pictures in pixels, a camera of the model each, where they are
    /// known and the model does not say it. Elsewhere the tables end with the trained parts.
    pub sizes: Vec<Option<[u32; 2]>>,
    /// Width and height of the rectified pictures; as large as the model's pictures, or what they show,
    /// where nothing is said.
    pub size: Option<[u32; 2]>,
    /// Focal length of the virtual cameras in pixels; otherwise one that keeps the scale of the pictures.
    pub focal: Option<f64>,
}

impl Default for PairSettings {
    fn default() -> Self {
        Self { cameras: [0, 1], sizes: Vec::new(), size: None, focal: None }
    }
}

/// The virtual cameras.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct VirtualPair {
    /// The model's cameras that they stand for, counted from 0: the left, then the right.
    pub cameras: [usize; 2],
    /// The unit of lengths.
    pub unit: String,
    /// Width and height of their pictures in pixels.
    pub size: [u32; 2],
    /// Focal length in pixels, of both and along both axes.
    pub focal: f64,
    /// Principal points in pixels; of the same y, and mostly of the same x.
    pub principal: [[f64; 2]; 2],
    /// How far the right one stands from the left one, along x, in `unit`.
    pub baseline: f64,
    /// World to the left one's frame (x right, y down, z forward); that of the right one is the same, moved
    /// by the baseline. In a left-handed world its determinant is -1.
    pub rectified_from_world: Pose,
    /// The depth at which the tables are exact, in `unit`.
    pub depth: f64,
}

/// A virtual pair, with the model's own map to make tables of.
pub struct Rectification<'a> {
    /// The virtual cameras.
    pub pair: VirtualPair,
    /// What is left of vertical differences in the space that the model was fitted to.
    pub leftover: VerticalError,
    maps: Maps<'a>,
    /// Places in the space that was shown, which both cameras see.
    places: Vec<Point3>,
    sources: [Source; 2],
    grids: [table::Grid; 2],
}

/// The picture that a table takes its pixels from.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Source {
    /// Least and largest x and y of the pixels that it has.
    picture: [[f64; 2]; 2],
    /// Those of the pixels that the model was shown.
    shown: [[f64; 2]; 2],
}

impl<'a> Rectification<'a> {
    /// The pair of two cameras of a model.
    ///
    /// # Errors
    ///
    /// [`Error::Setting`] for cameras that there are not; [`Error::Degenerate`] where the cameras share no
    /// view, or stand behind each other; [`Error::TooFew`] where the model carries no points and no size of
    /// its pictures is known; [`Error::Cancelled`].
    pub fn of(
        model: &'a Calibration,
        wanted: &PairSettings,
        progress: &dyn Progress,
    ) -> Result<Self> {
        check(model, wanted)?;
        let maps = Maps::of(model, wanted.cameras, progress)?;
        progress.check()?;
        let shown = points::shown(model, &maps, wanted)?;
        let lines = ray_table::RayTable::of(&maps, &shown.places)?;
        let frame::Framed { pair, maps, exchanged } =
            frame::pair(maps, &shown, &lines, model, wanted)?;
        let mut sources = shown.sources;
        if exchanged {
            sources.swap(0, 1);
        }
        let grids = [0, 1].map(|side| table::Grid::of(&maps, &pair, side));
        let mut made = Self {
            pair,
            leftover: VerticalError::default(),
            maps,
            places: shown.places,
            sources,
            grids,
        };
        made.leftover = VerticalError::of(&made, &model.data);
        Ok(made)
    }

    /// Where a virtual camera (0 the left, 1 the right) shows what the model's camera has at `pixel`.
    /// `None` where it shows it nowhere.
    #[must_use]
    pub fn rectified(&self, side: usize, pixel: Pixel) -> Option<Pixel> {
        self.grids.get(side)?.invert(pixel, |at| self.source(side, at))
    }

    /// Where in the model's picture lies what a virtual camera shows at a pixel.
    #[must_use]
    pub fn source(&self, side: usize, rectified: Pixel) -> Option<Pixel> {
        self.maps.project(side, self.pair.place(side, rectified))
    }

    /// The table of a virtual camera (0 the left, 1 the right).
    #[must_use]
    pub fn table(&self, side: usize) -> Table {
        Table::of(self, side)
    }

    /// Where rectified pixels of one point place it, in the left virtual camera's frame.
    #[must_use]
    pub fn meet(&self, left: Pixel, right: Pixel) -> Option<Point3> {
        let h = self.pair.depth_matrix()
            * nalgebra::Vector4::new(left.x, left.y, left.x - right.x, 1.0);
        (h.w > 0.0).then(|| Point3::from(h.xyz() / h.w))
    }
}

impl VirtualPair {
    /// Whether its pictures have such a pixel.
    fn holds(&self, at: Pixel) -> bool {
        (0..2).all(|axis| at[axis] >= -0.5 && at[axis] < f64::from(self.size[axis]) - 0.5)
    }

    /// What a virtual camera shows at a pixel, at the depth at which the tables are exact, in the world.
    fn place(&self, side: usize, at: Pixel) -> Point3 {
        let [cx, cy] = self.principal[side];
        let across = self.depth / self.focal;
        let aside = if side == 1 { self.baseline } else { 0.0 };
        let place = Point3::new((at.x - cx) * across + aside, (at.y - cy) * across, self.depth);
        self.rectified_from_world.inverse().transform(place)
    }

    /// OpenCV's `P1` and `P2`: from the left virtual camera's frame to either's pixels.
    #[must_use]
    pub fn projections(&self) -> [Matrix3x4<f64>; 2] {
        [0, 1].map(|side| {
            let [cx, cy] = self.principal[side];
            let mut matrix = Matrix3x4::zeros();
            matrix[(0, 0)] = self.focal;
            matrix[(1, 1)] = self.focal;
            matrix[(2, 2)] = 1.0;
            (matrix[(0, 2)], matrix[(1, 2)]) = (cx, cy);
            matrix[(0, 3)] = if side == 1 { -self.focal * self.baseline } else { 0.0 };
            matrix
        })
    }

    /// OpenCV's `Q`: from x, y, disparity (left x less right x) and 1 to a point in the left virtual camera's
    /// frame, as homogeneous coordinates.
    #[must_use]
    pub fn depth_matrix(&self) -> Matrix4<f64> {
        let [[left, y], [right, _]] = self.principal;
        let mut matrix = Matrix4::zeros();
        (matrix[(0, 0)], matrix[(1, 1)]) = (1.0, 1.0);
        (matrix[(0, 3)], matrix[(1, 3)], matrix[(2, 3)]) = (-left, -y, self.focal);
        (matrix[(3, 2)], matrix[(3, 3)]) = (1.0 / self.baseline, (right - left) / self.baseline);
        matrix
    }

    /// The centres of the virtual cameras in the world.
    #[must_use]
    pub fn centres(&self) -> [Point3; 2] {
        let world_from_rectified = self.rectified_from_world.inverse();
        let centre =
            |x: f64| world_from_rectified.transform(Point3::from(Vector3::new(x, 0.0, 0.0)));
        [centre(0.0), centre(self.baseline)]
    }
}

/// What can be said before any work.
fn check(model: &Calibration, wanted: &PairSettings) -> Result<()> {
    let count = model.volume.cameras();
    let [a, b] = wanted.cameras;
    if a == b || a.max(b) >= count {
        return Err(Error::Setting {
            setting: "cameras".into(),
            value: format!("{},{}", a + 1, b + 1),
            need: format!("two different cameras of the model's {count}, counted from 1"),
        });
    }
    if let Some(focal) = wanted.focal.filter(|focal| !(*focal > 0.0 && focal.is_finite())) {
        return Err(Error::Setting {
            setting: "focal length".into(),
            value: focal.to_string(),
            need: "pixels above 0".into(),
        });
    }
    // Of the order of the largest pictures that are decoded.
    const LARGEST: u32 = 16_384;
    match wanted.size {
        Some([width, height])
            if !(2..=LARGEST).contains(&width) || !(2..=LARGEST).contains(&height) =>
        {
            Err(Error::Setting {
                setting: "size of the rectified pictures".into(),
                value: format!("{width}x{height}"),
                need: format!("2 to {LARGEST} pixels per side"),
            })
        }
        _ => Ok(()),
    }
}
