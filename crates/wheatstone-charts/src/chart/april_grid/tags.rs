//! Tags in a picture: four corners whose sides are dark within and light without, and a word between them.

use crate::imaging::GrayImage;
use calib_targets::aruco::{Dictionary, Matcher};
use std::collections::BTreeSet;
use wheatstone_core::geometry::{Homography, Pixel};

/// A tag that was read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tag {
    pub(super) id: usize,
    /// Clockwise in the picture, from the corner at which the dictionary's word begins.
    pub(super) corners: [Pixel; 4],
}

/// Other corners that a side may end at: those of the tag itself and half of its neighbours'.
const NEIGHBOURS: usize = 64;
/// In pixels: a side of a tag with cells of two pixels.
const LEAST_SIDE: f64 = 14.0;
/// In grey levels: a side's contrast, beyond noise.
const LEAST_CONTRAST: f64 = 10.0;
/// Wrong bits that are put up with, at most; words of 36h11 differ by eleven.
const MOST_WRONG: u8 = 3;
/// Four corners that are read, at most: noise may have any number of dark quadrangles.
const MOST_READ: usize = 4_000;

pub(super) fn find(image: &GrayImage, corners: &[Pixel], words: &Dictionary) -> Vec<Tag> {
    let sides: Vec<Vec<usize>> =
        (0..corners.len()).map(|from| ends(image, corners, from)).collect();
    let matcher = Matcher::new(*words, words.max_correction_bits().min(MOST_WRONG));
    let mut found = Vec::new();
    let mut read_before = BTreeSet::new();
    for first in 0..corners.len() {
        for second in &sides[first] {
            for third in &sides[*second] {
                for fourth in &sides[*third] {
                    let quad = [first, *second, *third, *fourth];
                    let is_first = first < *second && first < *third && first < *fourth;
                    if !is_first || !sides[*fourth].contains(&first) || !read_before.insert(quad) {
                        continue;
                    }
                    if read_before.len() > MOST_READ {
                        return found;
                    }
                    found.extend(read(image, quad.map(|index| corners[index]), &matcher));
                }
            }
        }
    }
    found
}

/// Corners at which a side can end that begins here, with the tag on its right.
fn ends(image: &GrayImage, corners: &[Pixel], from: usize) -> Vec<usize> {
    let start = corners[from];
    let mut near: Vec<(f64, usize)> = corners
        .iter()
        .enumerate()
        .map(|(index, at)| ((at - start).norm(), index))
        .filter(|(distance, _)| *distance > LEAST_SIDE)
        .collect();
    let count = NEIGHBOURS.min(near.len());
    if count < near.len() {
        near.select_nth_unstable_by(count, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate(count);
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    near.into_iter()
        .map(|(_, index)| index)
        .filter(|index| is_side(image, start, corners[*index]))
        .collect()
}

/// Whether all along a line it is darker on the right than on the left.
fn is_side(image: &GrayImage, from: Pixel, to: Pixel) -> bool {
    let along = to - from;
    // Half of the narrowest cell, a tenth of the side, to the right; y goes down.
    let across = nalgebra::Vector2::new(-along.y, along.x) * 0.05;
    let mut darkest_outside = f32::INFINITY;
    let mut brightest_inside = f32::NEG_INFINITY;
    // The middle first, which most false sides fail at.
    for share in [0.5, 0.25, 0.75, 0.12, 0.88, 0.375, 0.625] {
        let at = from + along * share;
        let (inside, outside) = (image.sample(at + across), image.sample(at - across));
        if f64::from(outside - inside) < LEAST_CONTRAST {
            return false;
        }
        darkest_outside = darkest_outside.min(outside);
        brightest_inside = brightest_inside.max(inside);
    }
    // Light may fall unevenly, but not by so much along one side.
    darkest_outside > brightest_inside
}

/// The tag between four corners.
fn read(image: &GrayImage, corners: [Pixel; 4], matcher: &Matcher) -> Option<Tag> {
    let unit = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Pixel::new(x, y));
    let pairs: Vec<(Pixel, Pixel)> = unit.into_iter().zip(corners).collect();
    let map = Homography::fit(&pairs)?;
    let look = |x: f64, y: f64| map.map(Pixel::new(x, y)).map(|at| f64::from(image.sample(at)));
    let bits = matcher.dictionary().marker_size();
    [2, 1].into_iter().find_map(|border| {
        let count = bits + 2 * border;
        let cell = 1.0 / count as f64;
        // The mean of four places about the cell's middle.
        let value = |x: usize, y: usize| -> Option<f64> {
            let at = |index: usize, part: usize| (index as f64 + [0.35, 0.65][part]) * cell;
            let all = (0..4).map(|part| look(at(x, part % 2), at(y, part / 2)));
            Some(all.sum::<Option<f64>>()? / 4.0)
        };
        let paper = [0.3, 0.5, 0.7].into_iter().flat_map(|along| {
            let (near, far) = (-0.5 * cell, 1.0 + 0.5 * cell);
            [(along, near), (along, far), (near, along), (far, along)]
        });
        let paper = mean(paper.map(|(x, y)| look(x, y)))?;
        let inside = |at: usize| at >= border && at < bits + border;
        let places = || (0..count * count).map(|index| (index % count, index / count));
        let frame = || places().filter(|(x, y)| !(inside(*x) && inside(*y)));
        let dark = mean(frame().map(|(x, y)| value(x, y)))?;
        let threshold = (paper + dark) / 2.0;
        let mut wrong = 0;
        for (x, y) in frame() {
            wrong += usize::from(value(x, y)? > threshold);
        }
        // A border of one cell read as two holds a third of word.
        if wrong * 10 > frame().count() {
            return None;
        }
        let mut word = 0_u64;
        for y in 0..bits {
            for x in 0..bits {
                word |= u64::from(value(x + border, y + border)? < threshold) << (y * bits + x);
            }
        }
        let found = matcher.match_code(word)?;
        let mut turned = corners;
        turned.rotate_left(usize::from(found.rotation) % 4);
        Some(Tag { id: found.id as usize, corners: turned })
    })
}

fn mean(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let all: Vec<f64> = values.collect::<Option<_>>()?;
    (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
}
