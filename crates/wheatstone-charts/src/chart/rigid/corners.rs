//! Marks that are corners of chessboards: boards as the chessboard's search finds them, over the edges at which
//! they meet, and their flat parts.

use super::{body::Patch, marks::Marks};
use crate::{
    chart::chessboard::{
        fold, growth,
        seed::{self, Labels, Scale},
    },
    imaging::GrayImage,
};
use wheatstone_core::geometry::Pixel;

/// Boards that are followed to their ends at one size of the picture: more than a body has faces to one side.
const MOST_BOARDS: usize = 6;
/// Corners that are looked at, at least, as for chessboards.
const MOST_CORNERS: usize = 4_000;
/// Points of the smallest board.
const LEAST_BOARD: usize = 9;
/// In pixels: nearer than this to another, a corner is the same.
const SAME: f64 = 2.0;

/// The corners at the size of the picture that shows the most of them, as dark marks; there are no bright ones.
pub(super) fn find(image: &GrayImage, count: usize) -> [Marks; 2] {
    let pixels = image.width() * image.height();
    let mut best = Found::default();
    for scale in Scale::ladder(pixels) {
        // As for chessboards: a large texture that shows nothing in its half would take seconds.
        let promising = 8 * best.corners.len() >= count;
        if pixels >= seed::LARGE && *scale == Scale::Full && !promising {
            continue;
        }
        let found = look(image, *scale, count);
        if found.corners.len() > best.corners.len() {
            best = found;
        }
        if best.corners.len() >= count {
            break;
        }
    }
    best.boards.sort_by_key(|board| std::cmp::Reverse(board.len()));
    best.boards.dedup();
    [Marks::of_corners(&best.corners, best.boards), Marks::new(Vec::new(), 0)]
}

/// Corners with their sigmas, and boards of them.
#[derive(Default)]
struct Found {
    corners: Vec<(Pixel, f64)>,
    boards: Vec<Patch>,
}

impl Found {
    /// Adds a board, corner by corner; those that another board has are not there twice.
    fn add(&mut self, labels: &Labels, sigma: impl Fn(Pixel) -> Option<f64>) {
        let mut board = Patch::new();
        for (label, at) in labels {
            let known = self.corners.iter().position(|(other, _)| (other - at).norm() < SAME);
            let index = known.or_else(|| {
                self.corners.push((*at, sigma(*at)?));
                Some(self.corners.len() - 1)
            });
            board.extend(index.map(|index| (*label, index)));
        }
        self.boards.push(board);
    }
}

fn look(image: &GrayImage, scale: Scale, count: usize) -> Found {
    let seeds = seed::find(image, scale, LEAST_BOARD, MOST_CORNERS.max(4 * count));
    let mut found = Found::default();
    let most_points = growth::most_points(count);
    for seed in seeds.iter().take(MOST_BOARDS) {
        let Some(mut grown) = growth::grow(image, seed, most_points, f64::INFINITY) else {
            continue;
        };
        growth::settle(image, most_points, (&mut grown.labels, &mut grown.sigmas));
        found.add(&grown.labels, |at| grown.sigmas.of(at));
        let parts = fold::parts(grown.labels);
        if parts.len() > 1 {
            parts.iter().for_each(|part| found.add(part, |_| None));
        }
    }
    found
}
