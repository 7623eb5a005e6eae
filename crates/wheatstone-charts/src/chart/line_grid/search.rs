//! The whole search: scales and polarities, coarse to fine, and the largest grid among them.

use super::{
    candidates,
    grid::Grid,
    growth::{grow, largest},
    level::{Level, Polarity},
    refine,
};
use crate::{
    chart::{Sigmas, lattice::Labelled},
    imaging::GrayImage,
};

/// Shortest side of a picture in which anything is looked for, in pixels: two pitches of the
/// smallest kind.
const LEAST_SIDE: usize = 24;
/// Width of lines, in pixels, below which halving the picture would blur them.
const FINE: f64 = 8.0;

/// Variance of the blur in the level where lines are measured, in square pixels: that of sampling,
/// and a lens's of 0.7 px.
const BLURRED: f64 = 0.8 * 0.8 + 0.7 * 0.7;

/// The crossings of the largest grid in a picture with their sigmas, none if there is none. A grid of `whole`
/// crossings ends the search.
pub(super) fn crossings(image: &GrayImage, whole: usize) -> (Vec<Labelled>, Sigmas) {
    if image.width().min(image.height()) < LEAST_SIDE {
        return Default::default();
    }
    let levels = Level::pyramid(image, LEAST_SIDE);
    let mut best: Option<(Polarity, Grid)> = None;
    // Coarse levels cost little, and may end the search.
    for level in levels.iter().rev() {
        for (polarity, candidates) in candidates::find(&level.image) {
            if candidates.seeds.is_empty() {
                continue;
            }
            let Some(grid) = largest(&candidates, level.view(polarity), whole) else { continue };
            // What grows on elsewhere at least doubles seldom, and never from a scrap.
            let least = best.as_ref().map_or(0, |(_, best)| best.nodes.len() / 3);
            if grid.nodes.len() <= least {
                continue;
            }
            let Some(grid) = finished(grid, level, &levels, (polarity, whole)) else { continue };
            let count = grid.nodes.len();
            if best.as_ref().is_none_or(|(_, best)| count > best.nodes.len()) {
                best = Some((polarity, grid));
            }
        }
        if best.as_ref().is_some_and(|(_, grid)| grid.nodes.len() >= whole) {
            break;
        }
    }
    let Some((_, grid)) = best else { return Default::default() };
    let mut sigmas = Sigmas::default();
    let mut labelled = Vec::new();
    for ((column, row), pixel, sigma) in refine::unbiased(&grid) {
        sigmas.add(pixel, sigma);
        labelled.push(Labelled { column, row, pixel });
    }
    (labelled, sigmas)
}

/// A grid that was found in one level, measured in the level that shows its lines best; in the
/// whole picture's pixels. `None` where it does not stand closer scrutiny.
fn finished(
    mut grid: Grid,
    found: &Level,
    levels: &[Level],
    (polarity, whole): (Polarity, usize),
) -> Option<Grid> {
    let pitch = typical_pitch(&grid)? * found.scale();
    let width = printed(grid.width * pitch / found.scale()) * found.scale();
    // The coarsest level whose lines are still wide.
    let fine = levels.iter().rev().find(|level| width / level.scale() >= FINE);
    let fine = fine.or(levels.first())?;
    let fine = if fine.halvings > found.halvings { found } else { fine };
    for node in grid.nodes.values_mut() {
        node.pixel = fine.in_level(found.to_picture(node.pixel));
    }
    let view = fine.view(polarity);
    let segments = refine::segments(&grid, view);
    refine::refine(&mut grid, view, &segments);
    grow(&mut grid, view, whole);
    for _ in 0..2 {
        let segments = refine::segments(&grid, view);
        refine::prune(&mut grid, &segments);
        refine::refine(&mut grid, view, &segments);
    }
    let seen = typical_pitch(&grid)? * grid.width;
    grid.width *= printed(seen) / seen;
    for node in grid.nodes.values_mut() {
        node.pixel = fine.to_picture(node.pixel);
        node.sigma *= fine.scale();
    }
    Some(grid)
}

/// The width of a line without blur, from that at half depth, both in the level's pixels: variances
/// add, and a width at half depth is 2.355 sigma.
fn printed(seen: f64) -> f64 {
    (seen * seen - 2.355 * 2.355 * BLURRED).max(0.0).sqrt()
}

/// Middle length of a step, in the level's pixels.
fn typical_pitch(grid: &Grid) -> Option<f64> {
    let steps = grid
        .nodes
        .keys()
        .flat_map(|label| [(1, 0), (0, 1)].into_iter().filter_map(|side| grid.step(*label, side)));
    let lengths: Vec<f64> = steps.map(|step| step.norm()).collect();
    (!lengths.is_empty()).then(|| wheatstone_numeric::statistics::median(&lengths))
}
