//! A first piece of the board, by a general detector on the picture at one of several sizes.

use super::response::{self, Peak};
use crate::{
    chart::Detection,
    imaging::{GrayImage, filter::halve},
};
use calib_targets::{
    ChessCorner,
    chessboard::{ChessboardDetector, ChessboardParams},
    core::AxisEstimate,
};
use chess_corners_core::{
    Corner, CornerDescriptor, CornerRefiner, ImageView, OrientationMethod, RefineContext,
    RefineStatus, SaddlePointConfig, SaddlePointRefiner, describe_corners, merge_corners_simple,
};
use std::collections::BTreeMap;
use wheatstone_core::geometry::Pixel;

/// Points by their labels; where labels begin and which way they go means nothing.
pub(in crate::chart) type Labels = BTreeMap<(i32, i32), Pixel>;

/// What a look at the picture gives.
pub(in crate::chart) struct Seed {
    /// A piece of one board.
    pub(in crate::chart) labels: Labels,
    /// Everything that looks like a corner, also beyond that piece.
    pub(in crate::chart) corners: Vec<Pixel>,
}

/// The size at which a picture is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::chart) enum Scale {
    /// A quarter: large pictures that are blurred.
    Quarter,
    /// Half: large or blurred pictures.
    Half,
    /// As it is.
    Full,
    /// Twice: squares of few pixels.
    Double,
}

impl Scale {
    /// The sizes that are worth a look, the most promising first. The detector compares a ring of
    /// radius 5 pixels: large pictures show their squares well at half the size, in a quarter of
    /// the time; doubling helps small ones only.
    pub(in crate::chart) fn ladder(pixels: usize) -> &'static [Self] {
        match pixels {
            0..1_000_000 => &[Self::Full, Self::Double, Self::Half],
            1_000_000..LARGE => &[Self::Full, Self::Half],
            _ => &[Self::Half, Self::Quarter, Self::Full],
        }
    }

    /// The most that a chart with markers is seen of at its sizes, until all `whole` points are; no
    /// points where it is not seen. Squares with readable markers are wide enough to be seen in the half of
    /// a large picture; looking for smaller ones costs seconds on a texture.
    pub(in crate::chart) fn most_of_markers(
        image: &GrayImage,
        whole: usize,
        look: impl Fn(Self) -> Detection,
    ) -> Detection {
        let large = image.width() * image.height() >= LARGE;
        let mut best = Detection::default();
        for scale in if large { [Self::Half, Self::Quarter] } else { [Self::Full, Self::Half] } {
            let found = look(scale);
            if found.points.len() > best.points.len() {
                best = found;
            }
            if best.points.len() == whole {
                break;
            }
        }
        best
    }

    fn apply(self, image: &GrayImage) -> image::GrayImage {
        match self {
            Self::Quarter => halve(&halve(image)).to_8_bit(),
            Self::Half => halve(image).to_8_bit(),
            Self::Full => image.to_8_bit(),
            Self::Double => {
                let twice = GrayImage::from_fn(2 * image.width(), 2 * image.height(), |x, y| {
                    image.sample(self.restore(Pixel::new(x as f64, y as f64)))
                });
                twice.to_8_bit()
            }
        }
    }

    /// From the picture of this size to the original.
    fn restore(self, at: Pixel) -> Pixel {
        let factor = match self {
            Self::Quarter => 4.0,
            Self::Half => 2.0,
            Self::Full => 1.0,
            Self::Double => 0.5,
        };
        // Pixel centres are whole numbers, so pictures share their edges at -0.5.
        Pixel::from((at.coords.add_scalar(0.5) * factor).add_scalar(-0.5))
    }
}

/// The `most` strongest corners of a picture.
pub(in crate::chart) fn corners(image: &GrayImage, scale: Scale, most: usize) -> Vec<Pixel> {
    let found = Look::new(image, scale).strongest(most).into_iter();
    found.map(|corner| scale.restore(corner.position.cast::<f64>())).collect()
}

/// A picture at one size, and where squares may meet in it.
pub(in crate::chart) struct Look {
    scale: Scale,
    picture: image::GrayImage,
    /// The strongest first.
    peaks: Vec<Peak>,
}

impl Look {
    /// Finds the places at which squares may meet.
    pub(in crate::chart) fn new(image: &GrayImage, scale: Scale) -> Self {
        let picture = scale.apply(image);
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let mut peaks = response::peaks(picture.as_raw(), width, height);
        // To look at all of these closely would take seconds.
        if is_texture(&peaks, width.min(height)) {
            peaks.clear();
        }
        peaks.sort_by(|a, b| b.strength.total_cmp(&a.strength));
        Self { scale, picture, peaks }
    }

    /// How many places there are.
    pub(in crate::chart) fn count(&self) -> usize {
        self.peaks.len()
    }

    /// How many of the strongest places those of a board of `count` points are likely to be among.
    pub(in crate::chart) fn few(&self, count: usize) -> usize {
        let last = count.min(self.peaks.len());
        let floor = self.peaks[..last].last().map_or(0.0, |peak| LEAST_SHARE * peak.strength);
        let strong = self.peaks.partition_point(|peak| peak.strength >= floor);
        strong.min(2 * count + FEW)
    }

    /// The corners at the `most` strongest places, in the pixels of the picture at this size. Noise has places
    /// everywhere. A board's are among the strongest, and the time to look at them closely and to sort them into a
    /// lattice must have a bound.
    fn strongest(&self, most: usize) -> Vec<ChessCorner> {
        let (width, height) = (self.picture.width() as usize, self.picture.height() as usize);
        let values = self.picture.as_raw();
        let Some(view) = ImageView::from_u8_slice(width, height, values) else {
            return Vec::new();
        };
        let mut refiner = SaddlePointRefiner::new(SaddlePointConfig::default());
        let context = RefineContext::new(Some(view), None);
        let places = self.peaks.iter().take(most).map(|peak| {
            let found = refiner.refine(peak.place.map(|at| at as f32), context);
            let accepted = found.status == RefineStatus::Accepted;
            let [x, y] = if accepted { [found.x, found.y] } else { peak.centre };
            Corner::new(x, y, peak.strength)
        });
        let corners = merge_corners_simple(&mut places.collect(), SAME);
        let method = Some(OrientationMethod::RingFit);
        let corners = describe_corners(values, width, height, RING, corners, method);
        corners.iter().filter_map(told).collect()
    }

    /// Looks for pieces of boards of `count` points among the `most` strongest corners, the largest first.
    pub(in crate::chart) fn find(&self, count: usize, most: usize) -> Vec<Seed> {
        let corners = self.strongest(most);
        self.pieces(&corners, &corners, count)
    }

    /// The same among those corners alone that are turned about alike, one range of turns after another.
    ///
    /// The detector follows the two directions that most edges in the picture have. Those need not be the
    /// board's: where the gaps of a small keyboard meet its keys, light and dark alternate as on squares on edge.
    pub(in crate::chart) fn find_by_turn(&self, count: usize, most: usize) -> Vec<Seed> {
        let corners = self.strongest(most);
        let of_range = |range| {
            let alike = corners.iter().filter(|corner| is_turned(corner, range));
            self.pieces(&alike.copied().collect::<Vec<_>>(), &corners, count)
        };
        (0..RANGES).flat_map(of_range).collect()
    }

    /// Pieces of boards of `count` points among `some` of the corners.
    fn pieces(&self, some: &[ChessCorner], corners: &[ChessCorner], count: usize) -> Vec<Seed> {
        let mut parameters = ChessboardParams::default();
        parameters.min_labeled_corners = parameters.min_labeled_corners.min(count);
        let Ok(detector) = ChessboardDetector::new(parameters) else { return Vec::new() };
        let place = |p: nalgebra::Point2<f32>| self.scale.restore(p.cast::<f64>());
        let seeds = detector.detect_all(some).into_iter().map(|board| Seed {
            labels: board
                .corners
                .iter()
                .map(|corner| ((corner.grid.u, corner.grid.v), place(corner.position)))
                .collect(),
            corners: corners.iter().map(|corner| place(corner.position)).collect(),
        });
        seeds.collect()
    }
}

/// Ranges of turns that corners are sorted by, each half over the one before: 45 degrees wide, for
/// perspective turns the corners of one board apart.
const RANGES: u8 = 4;

/// Whether a corner is turned by an angle of this range. The bisectors of its edges tell the turn, up to a
/// quarter, for neighbours on a board have dark and light exchanged.
fn is_turned(corner: &ChessCorner, range: u8) -> bool {
    let step = std::f32::consts::FRAC_PI_2 / f32::from(RANGES);
    let turn = (corner.axes[0].angle + corner.axes[1].angle) / 2.0 - f32::from(range) * step;
    turn.rem_euclid(std::f32::consts::FRAC_PI_2) < 2.0 * step
}

/// The strength of places that are looked at first, as a share of that of the last one that a board would need if it had
/// all the strongest: light that halves across the board, and blur.
const LEAST_SHARE: f32 = 0.25;
/// Strong corners beside a board's that may be among those. Where there are more, all are looked at.
const FEW: usize = 100;

/// A corner as the search for lattices takes it.
fn told(corner: &CornerDescriptor) -> Option<ChessCorner> {
    let axes = corner
        .axes?
        .map(|axis| AxisEstimate { angle: axis.angle, fit_std_error: axis.fit_std_error });
    Some(ChessCorner::new(nalgebra::Point2::new(corner.x, corner.y), axes, corner.response))
}

/// In pixels: corners nearer to each other are one.
const SAME: f32 = 3.0;
/// In pixels: the ring that tells the directions of a corner's edges.
const RING: u32 = 5;

/// Whether a picture of this shorter side is full of strong corners: no board has as many. Noise has a few
/// strong ones among many weak.
fn is_texture(peaks: &[Peak], side: usize) -> bool {
    let most = peaks.iter().map(|peak| peak.strength).fold(0.0, f32::max);
    let strong = peaks.iter().filter(|peak| peak.strength > 0.5 * most).count();
    side >= LEAST_TEXTURE && strong > MOST_STRONG
}

/// In pixels: smaller pictures have no room for a texture.
const LEAST_TEXTURE: usize = 384;
/// Strong corners of a picture that are a texture: ten times those that are looked at.
const MOST_STRONG: usize = 40_000;

/// Looks for pieces of boards of `count` points among the `most` strongest corners, the largest first.
pub(in crate::chart) fn find(
    image: &GrayImage,
    scale: Scale,
    count: usize,
    most: usize,
) -> Vec<Seed> {
    Look::new(image, scale).find(count, most)
}

/// In pixels: pictures that are looked at in half their size first.
pub(in crate::chart) const LARGE: usize = 4_000_000;
