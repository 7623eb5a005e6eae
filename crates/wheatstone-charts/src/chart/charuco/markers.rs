//! Reads the markers in the light squares of a chessboard, and finds the one way to lay the board down
//! that most of them agree with.

use super::{Charuco, Labels, Place};
use crate::{
    chart::chessboard::growth::{Grown, frontier, predict},
    imaging::GrayImage,
};
use calib_targets::aruco::{Dictionary, Match, Matcher};
use std::collections::BTreeMap;
use wheatstone_core::geometry::{Homography, Pixel};

/// Wrong bits that are put up with, at most, where the dictionary's words differ by enough.
const MOST_WRONG: u8 = 3;
/// Share of a marker's border that must be dark: glare and specks may hide the rest.
const LEAST_BORDER: f64 = 0.85;

/// Where the board's labels are on the board; `None` where no markers say so, or as many say otherwise.
pub(super) fn place(
    board: &Charuco,
    image: &GrayImage,
    grown: &Grown,
    words: &Dictionary,
) -> Option<Place> {
    let seen = codes(image, grown, (board.marker / board.pitch, words.marker_size()));
    Some(agreed(board, &matched(&seen, words))?.0)
}

/// A square by its lowest labels, and the codes that its marker may have.
pub(super) type Codes = ((i32, i32), [u64; 2]);

/// The codes in the light squares, of markers with this share of a square's side and so many bits a row.
pub(super) fn codes(image: &GrayImage, grown: &Grown, marker: (f64, usize)) -> Vec<Codes> {
    let labels = with_rim(&grown.labels);
    let dark = (grown.dark_square.0 + grown.dark_square.1).rem_euclid(2);
    let light = labels.keys().filter(|(column, row)| (column + row).rem_euclid(2) != dark);
    light.filter_map(|square| Some((*square, code(image, &labels, *square, marker)?))).collect()
}

/// The markers of a dictionary among the codes.
pub(super) fn matched(codes: &[Codes], words: &Dictionary) -> Vec<((i32, i32), Match)> {
    let matcher = Matcher::new(*words, words.max_correction_bits().min(MOST_WRONG));
    let best = |codes: &[u64; 2]| {
        let found = codes.map(|code| matcher.match_code(code));
        found.into_iter().flatten().min_by_key(|read| read.hamming)
    };
    codes.iter().filter_map(|(square, codes)| Some((*square, best(codes)?))).collect()
}

/// The one way to lay the board down that most markers agree with, and how many do.
pub(super) fn agreed(board: &Charuco, markers: &[((i32, i32), Match)]) -> Option<(Place, usize)> {
    let layouts = [board.marked(false), board.marked(true)];
    // With an odd count of rows the layouts are the same.
    let layouts = if layouts[0] == layouts[1] { &layouts[..1] } else { &layouts };
    let mut votes: BTreeMap<(usize, Place), usize> = BTreeMap::new();
    for (label, read) in markers {
        for (layout, marked) in layouts.iter().enumerate() {
            let Some(square) = marked.get(read.id as usize) else { continue };
            let square = (square.0 as i32, square.1 as i32);
            let place = Place::by_square(read.rotation, *label, square);
            *votes.entry((layout, place)).or_default() += 1;
        }
    }
    let (best, most) = votes.iter().max_by_key(|(_, count)| **count)?;
    let rivals = votes.iter().filter(|(place, count)| *place != best && *count == most).count();
    // One marker may be anything that looks like one; on a board of other counts or another layout some few
    // agree by chance.
    let all: usize =
        votes.iter().filter(|((layout, _), _)| *layout == best.0).map(|(_, count)| count).sum();
    (rivals == 0 && *most >= 2 && 2 * most > all).then_some((best.1, *most))
}

/// The board under labels of which y turns from x as in the picture, since it is seen from its face and
/// markers are not their mirror images.
pub(super) fn face_up(grown: Grown) -> Grown {
    let at = |column: i32, row: i32| grown.labels.get(&(column, row));
    let turn = |(label, here): (&(i32, i32), &Pixel)| {
        let (along, down) = (at(label.0 + 1, label.1)?, at(label.0, label.1 + 1)?);
        Some((along - here).perp(&(down - here)))
    };
    if grown.labels.iter().filter_map(turn).sum::<f64>() >= 0.0 {
        return grown;
    }
    let dark_square = (grown.dark_square.1, grown.dark_square.0);
    let labels = grown.labels.into_iter().map(|((x, y), pixel)| ((y, x), pixel)).collect();
    Grown { labels, dark_square, sigmas: grown.sigmas }
}

/// The labels and one ring about them, so that squares on the board's rim have four corners too.
fn with_rim(labels: &Labels) -> Labels {
    let mut wider = labels.clone();
    // The second round adds the ring's own corners.
    for _ in 0..2 {
        let added: Vec<_> = frontier(&wider)
            .into_iter()
            .filter_map(|place| Some((place, predict(&wider, place)?.0)))
            .collect();
        wider.extend(added);
    }
    wider
}

/// The codes that the marker in the square with these lowest labels may have.
fn code(
    image: &GrayImage,
    labels: &Labels,
    (column, row): (i32, i32),
    (share, bits): (f64, usize),
) -> Option<[u64; 2]> {
    let mut pairs = [(Pixel::origin(), Pixel::origin()); 4];
    for (pair, (x, y)) in pairs.iter_mut().zip([(0, 0), (1, 0), (1, 1), (0, 1)]) {
        let pixel = labels.get(&(column + x, row + y))?;
        *pair = (Pixel::new(f64::from(x), f64::from(y)), *pixel);
    }
    if !pairs.iter().all(|(_, pixel)| image.contains(*pixel, 0.0)) {
        return None;
    }
    let square = Homography::fit(&pairs)?;
    let look = |x: f64, y: f64| square.map(Pixel::new(x, y)).map(|at| f64::from(image.sample(at)));
    let begin = (1.0 - share) / 2.0;
    let cell = share / (bits + 2) as f64;
    // The mean of nine places in the cell's middle half.
    let value = |x: usize, y: usize| -> Option<f64> {
        let mut sum = 0.0;
        for place in 0..9 {
            let within = |third: usize, count: usize| {
                begin + (count as f64 + 0.25 + 0.25 * third as f64) * cell
            };
            sum += look(within(place % 3, x), within(place / 3, y))?;
        }
        Some(sum / 9.0)
    };
    let paper = [0.2, 0.4, 0.6, 0.8].into_iter().flat_map(|along| {
        let (near, far) = (begin / 2.0, 1.0 - begin / 2.0);
        [(along, near), (along, far), (near, along), (far, along)]
    });
    let paper = median(paper.map(|(x, y)| look(x, y)).collect::<Option<_>>()?)?;
    let is_border = |x: usize, y: usize| x == 0 || y == 0 || x == bits + 1 || y == bits + 1;
    let (mut border, mut inner) = (Vec::new(), Vec::new());
    for y in 0..bits + 2 {
        for x in 0..bits + 2 {
            if is_border(x, y) { &mut border } else { &mut inner }.push(value(x, y)?);
        }
    }
    let threshold = (median(border.clone())? + paper) / 2.0;
    let dark = border.iter().filter(|value| **value < threshold).count();
    if (dark as f64) < LEAST_BORDER * border.len() as f64 {
        return None;
    }
    let word = |threshold: f64| {
        let bits = inner.iter().enumerate();
        bits.fold(0_u64, |word, (bit, value)| word | (u64::from(*value < threshold) << bit))
    };
    // Blur makes the border lighter, and light cells alone in the dark darker than paper: then the middle
    // of the word's own values tells them apart.
    let (low, high) = inner
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| (low.min(*it), high.max(*it)));
    Some([threshold, (low + high) / 2.0].map(word))
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
