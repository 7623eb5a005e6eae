//! A first piece of the board, by a general detector on the picture at one of several sizes.

use crate::{
    chart::Detection,
    geometry::Pixel,
    imaging::{GrayImage, filter::halve},
};
use calib_targets::{
    ChessCorner,
    chessboard::{ChessboardDetector, ChessboardParams},
    core::ImageRefiner,
    detect::{DetectorConfig, default_chess_config, detect_corners},
};
use std::collections::BTreeMap;

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

    fn apply(self, image: &GrayImage) -> GrayImage {
        match self {
            Self::Quarter => halve(&halve(image)),
            Self::Half => halve(image),
            Self::Full => image.clone(),
            Self::Double => GrayImage::from_fn(2 * image.width(), 2 * image.height(), |x, y| {
                image.sample(self.restore(Pixel::new(x as f64, y as f64)))
            }),
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
    let found = strongest(image, scale, most).into_iter();
    found.map(|corner| scale.restore(corner.position.cast::<f64>())).collect()
}

/// The `most` strongest corners, in the pixels of the picture at this size.
fn strongest(image: &GrayImage, scale: Scale, most: usize) -> Vec<ChessCorner> {
    let picture = scale.apply(image).to_8_bit();
    // The detector subtracts its ring's reach from the sides without looking (chess-corners 2.1).
    if picture.width().min(picture.height()) < LEAST_SIDE {
        return Vec::new();
    }
    let settings = default_chess_config().with_refiner(ImageRefiner::saddle_point());
    if is_texture(&picture, &settings) {
        return Vec::new();
    }
    let mut corners = detect_corners(&picture, &settings);
    // Noise has corners everywhere. A board's are among the strongest, and the time to sort them
    // into a lattice must have a bound.
    corners.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    corners.truncate(most);
    corners
}

/// Whether a large picture is full of strong corners, by samples of it: no board has as many, and to find
/// them all would take seconds. Noise has a few strong ones among many weak.
fn is_texture(picture: &image::GrayImage, settings: &DetectorConfig) -> bool {
    let (width, height) = (picture.width(), picture.height());
    if width.min(height) < SAMPLES * SAMPLE {
        return false;
    }
    let mut strengths = Vec::new();
    for row in 0..SAMPLES {
        for column in 0..SAMPLES {
            let middle = |at: u32, size: u32| (2 * at + 1) * size / (2 * SAMPLES) - SAMPLE / 2;
            let (x, y) = (middle(column, width), middle(row, height));
            let sample = image::imageops::crop_imm(picture, x, y, SAMPLE, SAMPLE).to_image();
            strengths.extend(detect_corners(&sample, settings).iter().map(|it| it.strength));
        }
    }
    let most = strengths.iter().copied().fold(0.0, f32::max);
    let strong = strengths.iter().filter(|it| **it > 0.5 * most).count();
    let sampled = (SAMPLES * SAMPLES * SAMPLE * SAMPLE) as usize;
    strong * (width * height) as usize > MOST_STRONG * sampled
}

/// Samples across and down, and their side in pixels: a twentieth of 3 megapixels.
const SAMPLES: u32 = 4;
/// See [`SAMPLES`].
const SAMPLE: u32 = 96;
/// Strong corners of a picture that are a texture: ten times those that are looked at.
const MOST_STRONG: usize = 40_000;

/// Looks for pieces of boards of `count` points among the `most` strongest corners, the largest first.
pub(in crate::chart) fn find(
    image: &GrayImage,
    scale: Scale,
    count: usize,
    most: usize,
) -> Vec<Seed> {
    let corners = strongest(image, scale, most);
    let mut parameters = ChessboardParams::default();
    parameters.min_labeled_corners = parameters.min_labeled_corners.min(count);
    let Ok(detector) = ChessboardDetector::new(parameters) else { return Vec::new() };
    let place = |p: nalgebra::Point2<f32>| scale.restore(p.cast::<f64>());
    let seeds = detector.detect_all(&corners).into_iter().map(|board| Seed {
        labels: board
            .corners
            .iter()
            .map(|corner| ((corner.grid.u, corner.grid.v), place(corner.position)))
            .collect(),
        corners: corners.iter().map(|corner| place(corner.position)).collect(),
    });
    seeds.collect()
}

/// In pixels: pictures that are looked at in half their size first.
pub(in crate::chart) const LARGE: usize = 4_000_000;

/// In pixels: a ring of radius 5, and one pixel to find a maximum among.
const LEAST_SIDE: u32 = 13;
