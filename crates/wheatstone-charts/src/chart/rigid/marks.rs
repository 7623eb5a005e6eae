//! What can be a mark of a body in a picture, sorted by place.

use super::body::Patch;
use crate::{
    chart::dot_grid::{
        blobs::{self, Blob, Outline},
        centre, growth,
    },
    imaging::{GrayImage, filter::halvings},
};
use wheatstone_core::geometry::Pixel;
use wheatstone_numeric::statistics::median;

/// Marks of one kind, dark or bright.
#[derive(Clone)]
pub(super) struct Marks {
    pub(super) blobs: Vec<Blob>,
    /// Of marks that are corners, which are measured when they are found.
    corners: Option<Corners>,
    /// Boxes a row and a column.
    size: (usize, usize),
    /// Where each box's marks begin in `sorted`, and where the last one's end.
    begins: Vec<u32>,
    sorted: Vec<u32>,
}

/// What is known of corners beside their places.
#[derive(Clone)]
struct Corners {
    /// Standard deviation of each along each axis, in pixels.
    sigmas: Vec<f64>,
    /// Boards of them, the largest first.
    boards: Vec<Patch>,
}

/// In pixels, a side of a box: what is looked for lies within a box or two.
const BOX: f64 = 16.0;

/// Patches that a picture is searched with, at least, the clearest.
const MOST_MARKS: usize = 2_000;
/// Sigma of an outline's middle as a share of its width, measured on the stepped plate's marks that show no
/// centroid (0.25 px of 5).
const OUTLINE: f64 = 0.05;
/// Of a mark that is looked for where it should be: its depth, as a share of the contrast of its
/// neighbours.
const LEAST_DEPTH: f64 = 0.3;
/// Of the same: its sigma as a share of its width. Noise alone moves a centroid anywhere in its window.
const LEAST_CERTAIN: f64 = 0.1;
/// In pixels, the shorter side of the smallest half that is looked at.
const LEAST_SIDE: usize = 96;

impl Marks {
    pub(super) fn new(mut blobs: Vec<Blob>, most: usize) -> Self {
        let clear = |blob: &Blob| blob.contrast * blob.area().sqrt();
        blobs.sort_by(|a, b| clear(b).total_cmp(&clear(a)));
        blobs.truncate(most);
        let reach = |pick: fn(&Blob) -> f64| blobs.iter().map(pick).fold(0.0, f64::max) / BOX;
        let size =
            (reach(|blob| blob.centre.x) as usize + 1, reach(|blob| blob.centre.y) as usize + 1);
        let own = |blob: &Blob| {
            let (x, y) = place(blob.centre);
            y as usize * size.0 + x as usize
        };
        let mut begins = vec![0_u32; size.0 * size.1 + 1];
        blobs.iter().for_each(|blob| begins[own(blob) + 1] += 1);
        (1..begins.len()).for_each(|index| begins[index] += begins[index - 1]);
        let mut sorted: Vec<u32> = (0..blobs.len() as u32).collect();
        sorted.sort_by_key(|index| own(&blobs[*index as usize]));
        Self { blobs, corners: None, size, begins, sorted }
    }

    /// Corners with their sigmas, and the boards that they make.
    pub(super) fn of_corners(corners: &[(Pixel, f64)], boards: Vec<Patch>) -> Self {
        // All are alike, which keeps their order.
        let one = |at: &(Pixel, f64)| Blob {
            centre: at.0,
            covariance: nalgebra::Matrix2::identity(),
            contrast: 1.0,
        };
        let mut own = Self::new(corners.iter().map(one).collect(), usize::MAX);
        let sigmas = corners.iter().map(|corner| corner.1).collect();
        own.corners = Some(Corners { sigmas, boards });
        own
    }

    pub(super) fn are_corners(&self) -> bool {
        self.corners.is_some()
    }

    /// The largest patches of marks that lie on a lattice, at most `most` of them with `least` marks or more.
    pub(super) fn patches(&self, least: usize, most: usize) -> Vec<Patch> {
        match &self.corners {
            Some(Corners { boards, .. }) => {
                boards.iter().filter(|board| board.len() >= least).take(most).cloned().collect()
            }
            None => growth::patches(&self.blobs, least, most),
        }
    }

    /// Marks in the boxes that a square about a place meets.
    fn about(&self, at: Pixel, radius: f64) -> impl Iterator<Item = usize> {
        let reach = nalgebra::Vector2::new(radius, radius);
        let ((left, top), (right, bottom)) = (place(at - reach), place(at + reach));
        let (width, height) = (self.size.0 as i64, self.size.1 as i64);
        let inside = left < width && right >= 0;
        let (left, right) = (left.clamp(0, width - 1), right.clamp(0, width - 1));
        let rows = if inside { top.max(0)..bottom.min(height - 1) + 1 } else { 0..0 };
        rows.flat_map(move |row| {
            let begin = self.begins[(row * width + left) as usize] as usize;
            let end = self.begins[(row * width + right) as usize + 1] as usize;
            self.sorted[begin..end].iter().map(|index| *index as usize)
        })
    }

    pub(super) fn at(&self, index: usize) -> Pixel {
        self.blobs[index].centre
    }

    /// The mark nearest to a place within `radius`, and its distance.
    pub(super) fn nearest(&self, at: Pixel, radius: f64) -> Option<(usize, f64)> {
        // A chart fills no more than the picture, so that steps are short.
        let radius = radius.min(10.0 * BOX);
        if !at.coords.iter().all(|it| it.abs() < 1e6) {
            return None;
        }
        let mut best: Option<(usize, f64)> = None;
        for index in self.about(at, radius) {
            let distance = (self.at(index) - at).norm();
            if distance <= radius && best.is_none_or(|(_, least)| distance < least) {
                best = Some((index, distance));
            }
        }
        best
    }

    /// Whether two marks are of one kind, as those of a body are side by side.
    pub(super) fn alike(&self, one: usize, other: usize) -> bool {
        let (one, other) = (&self.blobs[one], &self.blobs[other]);
        let near = |ratio: f64| (0.4..2.5).contains(&ratio);
        near(one.area() / other.area()) && near(one.contrast / other.contrast)
    }

    /// From a mark's edge to that of the nearest other, in pixels.
    pub(super) fn gap(&self, index: usize) -> f64 {
        let own = &self.blobs[index];
        let radius = |blob: &Blob| (blob.area() / std::f64::consts::PI).sqrt();
        self.about(own.centre, 4.0 * BOX)
            .filter(|other| {
                // Specks of noise about a mark are no marks.
                let other_blob = &self.blobs[*other];
                *other != index
                    && other_blob.area() > 0.3 * own.area()
                    && other_blob.contrast > 0.3 * own.contrast
            })
            .map(|other| (self.at(other) - own.centre).norm() - radius(&self.blobs[other]))
            .fold(4.0 * BOX, f64::min)
            - radius(own)
    }

    /// The centroid of a mark's light, and its standard deviation along each axis.
    pub(super) fn measure(&self, image: &GrayImage, index: usize) -> (Pixel, f64) {
        let blob = &self.blobs[index];
        if let Some(Corners { sigmas, .. }) = &self.corners {
            return (blob.centre, sigmas[index]);
        }
        centre::measure(image, blob, self.gap(index).max(2.0)).map_or_else(
            // Half hidden by a glint, or too pale: the outline's own middle.
            || (blob.centre, OUTLINE * blob.area().sqrt()),
            |dot| (dot.centroid, dot.sigma),
        )
    }

    /// A mark about `at` that is like these; `None` where the picture shows none with certainty.
    pub(super) fn measure_like(
        &self,
        image: &GrayImage,
        like: &[usize],
        at: Pixel,
        gap: f64,
    ) -> Option<(Pixel, f64)> {
        // Boards were followed to their ends.
        if self.corners.is_some() {
            return None;
        }
        let middle = |value: &dyn Fn(&Blob) -> f64| {
            median(&like.iter().map(|index| value(&self.blobs[*index])).collect::<Vec<_>>())
        };
        let (across, down) = (middle(&|b| b.covariance[(0, 0)]), middle(&|b| b.covariance[(1, 1)]));
        let slant = middle(&|b| b.covariance[(0, 1)]);
        let covariance = nalgebra::Matrix2::new(across, slant, slant, down);
        let model = Blob { centre: at, covariance, contrast: middle(&|b| b.contrast) };
        let dot = centre::measure(image, &model, gap)?;
        // In the same sense, and with a third of the light.
        let bright = self.side_is_bright(image, like[0]);
        let certain = dot.depth * if bright { -1.0 } else { 1.0 } > LEAST_DEPTH * model.contrast;
        (certain && dot.sigma < LEAST_CERTAIN * model.area().sqrt())
            .then_some((dot.centroid, dot.sigma))
    }

    /// Whether a mark is brighter than its ground.
    fn side_is_bright(&self, image: &GrayImage, index: usize) -> bool {
        centre::measure(image, &self.blobs[index], self.gap(index).max(2.0))
            .is_some_and(|dot| dot.depth < 0.0)
    }
}

/// The box of a place: column and row.
fn place(at: Pixel) -> (i64, i64) {
    ((at.x / BOX).floor() as i64, (at.y / BOX).floor() as i64)
}

/// All that can be marks, at each size of the picture: dark and bright.
pub(super) fn find(image: &GrayImage, count: usize) -> Vec<[Marks; 2]> {
    let most = MOST_MARKS.max(4 * count);
    let sizes = halvings(image, LEAST_SIDE);
    let marks = sizes.iter().enumerate().map(|(halvings, image)| {
        let found = blobs::find(image, Outline::Convex);
        [found.dark, found.bright].map(|side| {
            let whole = side.iter().map(|blob| blob.restored(halvings)).collect();
            Marks::new(whole, most)
        })
    });
    marks.collect()
}

/// Marks of two sizes of the picture together: what both see is there once.
pub(super) fn united(finer: &Marks, coarser: &Marks) -> Marks {
    let mut blobs = finer.blobs.clone();
    let news = coarser.blobs.iter().filter(|blob| {
        let radius = (blob.area() / std::f64::consts::PI).sqrt();
        finer.nearest(blob.centre, radius).is_none()
    });
    blobs.extend(news.copied());
    let most = blobs.len();
    Marks::new(blobs, most)
}
