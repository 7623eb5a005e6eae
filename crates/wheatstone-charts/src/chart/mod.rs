//! Charts: rigid objects with points at known places, how to find them in a picture, how to draw
//! them.
//!
//! To add one: write `chart/<name>.rs` with a type that implements [`Chart`] and `Default`, then add
//! its `mod` line and its row below. The contract tests pick it up from there.

pub mod april_grid;
pub mod charuco;
pub mod chessboard;
pub mod dot_grid;
mod growing;
pub mod kalibr_target;
pub mod lattice;
pub mod line_grid;
pub mod point_list;
pub mod rigid;
pub mod sheet;
mod trimming;
pub mod two_level;

use crate::imaging::GrayImage;
use std::path::Path;
use wheatstone_core::{
    Error, Result,
    geometry::{Pixel, Point3},
    registry,
};

/// A point of a chart: its index in [`Chart::points`].
pub type PointId = usize;

/// Chart points found in one picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Detection {
    /// Each point at most once, by rising id.
    pub points: Vec<(PointId, Pixel)>,
    /// Standard deviation of each point along each axis of the picture, in pixels: what the picture's
    /// noise does to it, and what is known of the method's own faults. In the order of `points`; none
    /// where it is not told.
    pub sigmas: Vec<f64>,
}

/// What a search for a chart in one picture came to.
#[derive(Clone, Debug, PartialEq)]
pub enum ChartSearch {
    /// The chart was found. More than one reading means that the picture alone cannot tell which
    /// point is which (a grid that leaves the picture, a board that looks the same upside down);
    /// all readings hold the same pixels, and the first has the chart's x axis nearest to the
    /// picture's.
    Found(Vec<Detection>),
    /// It was not, for this reason.
    NotFound(String),
}

/// Sigmas of places in a picture, by the places' bits.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sigmas(std::collections::BTreeMap<[u64; 2], f64>);

impl Sigmas {
    fn add(&mut self, at: Pixel, sigma: f64) {
        self.0.insert([at.x.to_bits(), at.y.to_bits()], sigma);
    }

    fn of(&self, at: Pixel) -> Option<f64> {
        self.0.get(&[at.x.to_bits(), at.y.to_bits()]).copied()
    }

    /// The same readings with the sigmas of their points, if all have one.
    fn told(&self, mut sighting: ChartSearch) -> ChartSearch {
        if let ChartSearch::Found(readings) = &mut sighting {
            for reading in readings {
                let all: Option<Vec<f64>> =
                    reading.points.iter().map(|(_, at)| self.of(*at)).collect();
                reading.sigmas = all.unwrap_or_default();
            }
        }
        sighting
    }
}

/// Which picture is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureOf<'a> {
    /// The camera's place in the capture, from 0.
    pub camera: usize,
    /// The view's name.
    pub view: &'a str,
}

/// A rigid object with points at known places in its own frame.
///
/// The frame has x right, y down and z into the chart, for someone who looks at its face; its
/// origin is the centre of the points unless the chart says otherwise.
pub trait Chart: Sync {
    /// Where the points are, in the order of their ids.
    fn points(&self) -> Vec<Point3>;

    /// The places of `points` as the world would need them printed: dark shapes on a white ground.
    fn shapes(&self) -> Vec<Shape>;

    /// The white board's left, top, right and bottom edges.
    fn board(&self) -> [f64; 4];

    /// How much light the chart returns at `(x, y)`, 0 (black ink) to 1 (white board), averaged
    /// over a box of `width` by `height` about it; `None` off the board.
    fn reflectance(&self, place: [f64; 2], size: [f64; 2]) -> Option<f64>;

    /// Looks for the chart.
    fn detect(&self, image: &GrayImage) -> ChartSearch;

    /// Looks for the chart in a picture of which more is known: charts that were told where some of their
    /// points are seen make use of it.
    fn detect_in(&self, image: &GrayImage, _of: PictureOf) -> ChartSearch {
        self.detect(image)
    }

    /// Points that someone has named in a picture, and where they are seen, to some pixels.
    fn named_in(&self, _of: PictureOf) -> Vec<(PointId, Pixel)> {
        Vec::new()
    }

    /// What is counted on it, and its sizes in millimetres, as the sheet says on which it is printed;
    /// `scale` is the number of millimetres in the unit of its lengths.
    fn label(&self, _scale: f64) -> String {
        format!("{} points", self.points().len())
    }

    /// The setting that says how large it is, with its value in the user's unit: all its other lengths
    /// are in proportion.
    fn size(&self) -> Option<(&'static str, f64)> {
        None
    }

    /// What the user calls a point.
    fn name(&self, id: PointId) -> String {
        id.to_string()
    }

    /// Reads the files that the chart names; relative paths begin at `folder`.
    ///
    /// # Errors
    ///
    /// [`wheatstone_core::Error::Io`], [`wheatstone_core::Error::Malformed`].
    fn load(&mut self, _folder: &Path) -> Result<()> {
        Ok(())
    }

    /// The chart that a user who describes this one may have before the cameras, in case this one is
    /// nowhere to be found: squares are often counted where inner corners are meant.
    fn miscounted(&self) -> Option<AnyChart> {
        None
    }

    /// The settings with which a chart that was not found is there, as the user would write them:
    /// "`columns = 6`, `rows = 5`". Asked of some pictures after the search has failed; it may take long.
    fn misdeclared(&self, _image: &GrayImage) -> Option<String> {
        None
    }

    /// Refuses sizes that no chart has.
    ///
    /// # Errors
    ///
    /// [`wheatstone_core::Error::Setting`].
    fn validate(&self) -> Result<()>;
}

/// A dark shape on a chart, in the chart's frame and unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Left, top, right and bottom edges.
    Rectangle([f64; 4]),
    /// Centre and radius.
    Disc([f64; 2], f64),
}

impl Shape {
    /// Left, top, right and bottom edges.
    #[must_use]
    pub fn edges(self) -> [f64; 4] {
        match self {
            Self::Rectangle(edges) => edges,
            Self::Disc([x, y], radius) => [x - radius, y - radius, x + radius, y + radius],
        }
    }
}

/// A length in millimetres as people write it.
fn length(millimetres: f64) -> String {
    ((millimetres * 1000.0).round() / 1000.0).to_string()
}

/// Refuses a setting of a chart.
fn refused(setting: &str, value: impl ToString, need: impl Into<String>) -> Error {
    let (setting, value) = (format!("[chart] {setting}"), value.to_string());
    Error::Setting { setting, value, need: need.into() }
}

registry! {
    /// Every chart the toolkit knows.
    pub enum AnyChart: Chart, all {
        "line-grid" => LineGrid(line_grid::LineGrid),
        "chessboard" => Chessboard(chessboard::Chessboard),
        "dot-grid" => DotGrid(dot_grid::DotGrid),
        "charuco" => Charuco(charuco::Charuco),
        "april-grid" => AprilGrid(april_grid::AprilGrid),
        "point-list" => PointList(point_list::PointList),
        "two-level" => TwoLevel(two_level::TwoLevel),
    }
}
