//! The grid of dots: points at the dots' centres. Symmetric grids, the asymmetric ones of OpenCV, and
//! calibration plates.

pub(super) mod blobs;
pub(super) mod centre;
mod ground;
pub(super) mod growth;
mod layout;
mod misdeclared;

use super::{
    Chart, ChartSearch, Shape, Sigmas,
    lattice::{Labelled, Lattice, Origin},
    length, refused,
    trimming::trim,
};
use crate::imaging::{GrayImage, filter::halvings};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use wheatstone_core::{
    Result,
    geometry::{Pixel, Point3},
};

/// Dots in rows. Dark ones on a light ground are drawn; light ones on a dark ground are found as well.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DotGrid {
    /// Dots a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Distance of neighbouring rows, in the user's unit. In symmetric grids the dots of a row are as far
    /// apart, in asymmetric ones twice as far.
    pub pitch: f64,
    /// Of a dot, in the user's unit; half the pitch where it is left out. Used for drawing; any size is
    /// found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diameter: Option<f64>,
    /// Whether every second row is moved to the right by the pitch, as in OpenCV's asymmetric grids.
    #[serde(default)]
    pub asymmetric: bool,
    /// Whether the dot with id 0 is larger than the others, which tells how the chart is turned.
    #[serde(default)]
    pub first_larger: bool,
    /// Where the chart's frame begins.
    #[serde(default)]
    pub origin: Origin,
}

impl Default for DotGrid {
    fn default() -> Self {
        Self {
            columns: 10,
            rows: 7,
            pitch: 20.0,
            diameter: None,
            asymmetric: false,
            first_larger: false,
            origin: Origin::Centre,
        }
    }
}

/// Dots below which a part of a grid is not told from clutter.
const LEAST_FOUND: usize = 8;
/// Share of the places between the outermost dots that must have one: grids have nearly all, chance
/// alignments in noise and text of 12 megapixels had a quarter.
const LEAST_FILLED: f64 = 0.5;
/// The same of asymmetric grids, which must be there from end to end: a part of a symmetric grid, sheared, is
/// one that lacks two of its corners.
const LEAST_FILLED_ASYMMETRIC: f64 = 0.8;
/// Of a first dot that is larger, to the others: drawn so.
const LARGER: f64 = 1.6;
/// The square of the least such ratio that is taken for one: dots are equal to a tenth.
const LARGER_AREA: f64 = 1.6;
/// In pixels, the shorter side of the smallest half that is looked at: four dots across.
const LEAST_SIDE: usize = 24;
/// In pixels: the chessboard's search begins with the half of such pictures too.
const LARGE: usize = 4_000_000;
/// Patches that a picture is searched for a grid with, at least: noise has them everywhere, dots have
/// the strongest.
const MOST_PATCHES: usize = 4_000;
/// Grids of one size of a picture that are looked at: a few things beside the chart may look like one.
const MOST_GRIDS: usize = 4;
/// Dots of a thing that the chart may be looked for beside: a grid of more is a texture, of which any
/// piece can have the chart's counts.
const MOST_BESIDE: usize = 500;

impl DotGrid {
    /// Places a pitch apart, a dot at each or, in asymmetric grids, at every second.
    fn lattice(&self) -> Lattice {
        let columns = if self.asymmetric { 2 * self.columns } else { self.columns };
        Lattice { columns, rows: self.rows, pitch: self.pitch, origin: self.origin }
    }

    fn diameter(&self) -> f64 {
        self.diameter.unwrap_or(self.pitch / 2.0)
    }

    fn radius(&self, id: usize) -> f64 {
        let larger = if self.first_larger && id == 0 { LARGER } else { 1.0 };
        larger * self.diameter() / 2.0
    }

    /// What the dots of one size of the picture come to; see [`Self::look`].
    ///
    /// The largest grid need not be the chart: a keyboard may have more keys than the chart has dots.
    /// Lesser ones are looked at until one can be the chart, if they have half of its dots: what else
    /// is in the picture has pieces of grids with fewer.
    fn look_among(
        &self,
        image: &GrayImage,
        blobs: &mut Vec<blobs::Blob>,
        halvings: usize,
    ) -> Option<(bool, usize, ChartSearch)> {
        // How clearly a patch stands out from noise.
        let clear = |blob: &blobs::Blob| blob.contrast * blob.area().sqrt();
        blobs.sort_by(|a, b| clear(b).total_cmp(&clear(a)));
        let whole = self.columns * self.rows;
        blobs.truncate(MOST_PATCHES.max(4 * whole));
        let mut labels = self.take_labels(blobs, halvings)?;
        let mut best = self.look(image, &labels);
        for _ in 1..MOST_GRIDS {
            if matches!(best.2, ChartSearch::Found(_)) || labels.len() > MOST_BESIDE {
                break;
            }
            let lesser = self.take_labels(blobs, halvings);
            let Some(lesser) = lesser.filter(|lesser| 2 * lesser.len() >= whole) else { break };
            labels = lesser;
            let look = self.look(image, &labels);
            if look.1 > best.1 {
                best = look;
            }
        }
        Some(best)
    }

    /// Takes the largest grid out of the dots of one size of the picture. Its dots are in the whole picture's
    /// pixels, by labels along the chart's rows and columns.
    fn take_labels(
        &self,
        blobs: &mut Vec<blobs::Blob>,
        halvings: usize,
    ) -> Option<BTreeMap<(i32, i32), blobs::Blob>> {
        let found = growth::take_largest(blobs, LEAST_FOUND.min(self.columns * self.rows))?;
        let mut labels = layout::straightened(&found, self.asymmetric);
        let lattice = self.lattice();
        let filled = if self.asymmetric { 0.5 } else { 1.0 };
        trim(&mut labels, (lattice.columns, lattice.rows), filled);
        Some(labels.into_iter().map(|(label, blob)| (label, blob.restored(halvings))).collect())
    }

    /// Every way in which dots at these labels can be the chart.
    fn place(&self, image: &GrayImage, centres: &BTreeMap<(i32, i32), Pixel>) -> ChartSearch {
        if self.asymmetric {
            return layout::place(self, centres);
        }
        let found = centres.iter().map(|((column, row), pixel)| Labelled {
            column: *column,
            row: *row,
            pixel: *pixel,
        });
        self.lattice().place(&found.collect::<Vec<_>>(), image, None)
    }

    /// What a grid comes to. With it: whether nothing is missing, and how much there is of it, anything
    /// that can be placed on the chart before anything that cannot.
    fn look(
        &self,
        image: &GrayImage,
        labels: &BTreeMap<(i32, i32), blobs::Blob>,
    ) -> (bool, usize, ChartSearch) {
        let lattice = self.lattice();
        let (width, height) = layout::size(labels);
        let (width, height) = (width.max(height) as usize, width.min(height) as usize);
        if width > lattice.columns.max(lattice.rows) || height > lattice.columns.min(lattice.rows) {
            // No chart of this size, so that places need not be exact.
            let centres = labels.iter().map(|(label, blob)| (*label, blob.centre)).collect();
            return (false, labels.len(), self.place(image, &centres));
        }
        let dots: BTreeMap<_, _> = labels
            .iter()
            .filter_map(|(label, blob)| {
                Some((*label, centre::measure(image, blob, gap(labels, *label))?))
            })
            .collect();
        let whole = self.columns * self.rows;
        if dots.len() < LEAST_FOUND.min(whole) {
            return (false, 0, ChartSearch::NotFound("no grid of dots found".into()));
        }
        let places = (width * height) as f64;
        let least = if self.asymmetric { LEAST_FILLED_ASYMMETRIC / 2.0 } else { LEAST_FILLED };
        if dots.len() < (least * places) as usize {
            return (false, 0, ChartSearch::NotFound("no grid of dots found".into()));
        }
        let placed = centre::placed(&dots);
        let centres: BTreeMap<_, _> =
            placed.iter().map(|(label, dot)| (*label, dot.centre)).collect();
        let mut sighting = self.place(image, &centres);
        if self.first_larger {
            sighting = turned_by(larger(&placed), sighting);
        }
        let mut sigmas = Sigmas::default();
        for (label, dot) in &placed {
            sigmas.add(dot.centre, dots[label].sigma);
        }
        sighting = sigmas.told(sighting);
        let seen = matches!(sighting, ChartSearch::Found(_));
        (seen && dots.len() == whole, dots.len() + if seen { whole } else { 0 }, sighting)
    }
}

/// In which order a picture's halves are searched: the finest first, but dots of few pixels in a large
/// picture are rare, and looked for last.
fn order(sizes: &[GrayImage]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    if sizes[0].values().len() > LARGE {
        order.rotate_left(1);
    }
    order
}

/// In pixels, from a dot's edge to that of its nearest neighbour.
fn gap(labels: &BTreeMap<(i32, i32), blobs::Blob>, (column, row): (i32, i32)) -> f64 {
    let own = &labels[&(column, row)];
    let around =
        (-2..=2).flat_map(|c| (-2..=2).map(move |r| (c, r))).filter(|step| *step != (0, 0));
    around
        .filter_map(|(c, r)| labels.get(&(column + c, row + r)))
        .map(|other| {
            let step = other.centre - own.centre;
            let way = step / step.norm();
            // An ellipse reaches this far along a direction, at most.
            let reach =
                |blob: &blobs::Blob| 2.0 * (way.transpose() * blob.covariance * way)[0].sqrt();
            step.norm() - reach(own) - reach(other)
        })
        .fold(f64::INFINITY, f64::min)
        .max(0.0)
}

/// The dot that is clearly larger than the others, if there is one.
fn larger(dots: &BTreeMap<(i32, i32), centre::Placed>) -> Option<Pixel> {
    let mut sizes: Vec<f64> = dots.values().map(|dot| dot.radius_squared).collect();
    sizes.sort_by(f64::total_cmp);
    let median = sizes.get(sizes.len() / 2)?;
    let largest = dots.values().max_by(|a, b| a.radius_squared.total_cmp(&b.radius_squared))?;
    (largest.radius_squared > LARGER_AREA * median).then_some(largest.centre)
}

/// The readings whose point 0 is at this dot; all where no dot is larger than the others.
fn turned_by(first: Option<Pixel>, sighting: ChartSearch) -> ChartSearch {
    let (Some(first), ChartSearch::Found(mut readings)) = (first, sighting.clone()) else {
        return sighting;
    };
    readings.retain(|reading| reading.points.contains(&(0, first)));
    if readings.is_empty() {
        return ChartSearch::NotFound("the larger dot is not where the chart has its first".into());
    }
    ChartSearch::Found(readings)
}

impl Chart for DotGrid {
    fn points(&self) -> Vec<Point3> {
        let all = self.lattice().points();
        if !self.asymmetric {
            return all;
        }
        let across = 2 * self.columns;
        let places = all.into_iter().enumerate();
        places
            .filter(|(index, _)| (index / across + index % across).is_multiple_of(2))
            .map(|(_, point)| point)
            .collect()
    }

    fn shapes(&self) -> Vec<Shape> {
        let points = self.points().into_iter().enumerate();
        points.map(|(id, point)| Shape::Disc([point.x, point.y], self.radius(id))).collect()
    }

    fn label(&self, scale: f64) -> String {
        let pitch = length(scale * self.pitch);
        let (columns, rows) = (self.columns, self.rows);
        let kind = if self.asymmetric { "dots, asymmetric" } else { "dots" };
        format!("{columns} columns x {rows} rows of {kind}, pitch {pitch} mm")
    }

    fn size(&self) -> Option<(&'static str, f64)> {
        Some(("pitch", self.pitch))
    }

    fn board(&self) -> [f64; 4] {
        let lattice = self.lattice();
        let [left, top] = lattice.first_point();
        [
            left - self.pitch,
            top - self.pitch,
            left + lattice.columns as f64 * self.pitch,
            top + lattice.rows as f64 * self.pitch,
        ]
    }

    fn reflectance(&self, [x, y]: [f64; 2], size: [f64; 2]) -> Option<f64> {
        let [left, top, right, bottom] = self.board();
        if x < left || x > right || y < top || y > bottom {
            return None;
        }
        let lattice = self.lattice();
        let [first_x, first_y] = lattice.first_point();
        let nearest = |at: f64, first: f64, count: usize| {
            ((at - first) / self.pitch).round().clamp(0.0, (count - 1) as f64) as usize
        };
        let column = nearest(x, first_x, lattice.columns);
        let row = nearest(y, first_y, lattice.rows);
        // Dots of asymmetric grids may reach beyond their own place's cell.
        let places = (row.saturating_sub(1)..=(row + 1).min(lattice.rows - 1)).flat_map(|row| {
            (column.saturating_sub(1)..=(column + 1).min(lattice.columns - 1))
                .map(move |column| (column, row))
        });
        let ink: f64 = places
            .filter(|(column, row)| !self.asymmetric || (column + row).is_multiple_of(2))
            .map(|(column, row)| {
                let centre = [column, row].map(|count| count as f64 * self.pitch);
                let from = [x - first_x - centre[0], y - first_y - centre[1]];
                covered(from, size, self.radius(row * lattice.columns + column))
            })
            .sum();
        Some(1.0 - ink)
    }

    fn detect(&self, image: &GrayImage) -> ChartSearch {
        let sizes = halvings(image, LEAST_SIDE);
        let mut best: Option<(usize, ChartSearch)> = None;
        for halvings in order(&sizes) {
            let mut blobs = blobs::find(&sizes[halvings], blobs::Outline::Ellipse);
            for side in [&mut blobs.dark, &mut blobs.bright] {
                let Some((full, rank, sighting)) = self.look_among(image, side, halvings) else {
                    continue;
                };
                if full {
                    return sighting;
                }
                if best.as_ref().is_none_or(|(most, _)| rank > *most) {
                    best = Some((rank, sighting));
                }
            }
        }
        best.map_or_else(|| ChartSearch::NotFound("no grid of dots found".into()), |(_, it)| it)
    }

    fn misdeclared(&self, image: &GrayImage) -> Option<String> {
        misdeclared::told(self, image)
    }

    fn validate(&self) -> Result<()> {
        Lattice { columns: self.columns, ..self.lattice() }.validate()?;
        // Asymmetric dots are as near as the diagonal, and the first may be larger.
        let nearest = if self.asymmetric { std::f64::consts::SQRT_2 } else { 1.0 } * self.pitch;
        let diameter = self.diameter();
        let most = nearest * if self.first_larger { 2.0 / (1.0 + LARGER) } else { 1.0 };
        if diameter > 0.0 && diameter < 0.95 * most {
            return Ok(());
        }
        Err(refused("diameter", diameter, "a length above 0, small enough to keep the dots apart"))
    }
}

/// Share of a box of `size` that a disc of `radius` covers, the box's middle at `from` the disc's.
pub(super) fn covered([x, y]: [f64; 2], [width, height]: [f64; 2], radius: f64) -> f64 {
    if width <= 0.0 || height <= 0.0 {
        return if x * x + y * y < radius * radius { 1.0 } else { 0.0 };
    }
    let (far_x, far_y) = (x.abs() + width / 2.0, y.abs() + height / 2.0);
    if far_x * far_x + far_y * far_y < radius * radius {
        return 1.0;
    }
    let (near_x, near_y) = ((x.abs() - width / 2.0).max(0.0), (y.abs() - height / 2.0).max(0.0));
    if near_x * near_x + near_y * near_y >= radius * radius {
        return 0.0;
    }
    // Strips of the box, each cut by the disc at two heights: at sixteen the error is under 1e-3 of the box.
    const STRIPS: usize = 16;
    let strip = |index: usize| {
        let at = x + width * ((index as f64 + 0.5) / STRIPS as f64 - 0.5);
        let half = (radius * radius - at * at).max(0.0).sqrt();
        ((y + height / 2.0).min(half) - (y - height / 2.0).max(-half)).max(0.0) / height
    };
    (0..STRIPS).map(strip).sum::<f64>() / STRIPS as f64
}
