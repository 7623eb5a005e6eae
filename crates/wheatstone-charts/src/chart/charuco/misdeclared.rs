//! What of a ChArUco board is declared otherwise than a picture shows it.

use super::{Chart, Charuco, markers};
use crate::{
    chart::chessboard::{
        growth::{self, Grown},
        seed,
    },
    imaging::GrayImage,
};
use calib_targets::aruco::{Dictionary, builtins};

/// Markers as shares of a square, in percent: the least that can be read, the most that is taken, and a step of
/// a third of a cell.
const MARKERS: (std::ops::RangeInclusive<u32>, usize) = (40..=85, 5);
/// Pieces of chessboards that are looked at, the largest first: a board may lie on a tiled floor.
const PIECES: usize = 3;
/// Markers that must agree: fewer do on boards of other counts.
const LEAST_MARKERS: usize = 4;

/// Another board that markers agree with.
struct Reading {
    /// How many of counts, dictionary and marker are not as declared.
    differences: usize,
    /// Markers that agree.
    agreeing: usize,
    board: Charuco,
}

/// The settings of the board in the picture that are not as declared, the fewest that most markers agree with.
pub(super) fn told(declared: &Charuco, image: &GrayImage) -> Option<String> {
    let mut readings = Vec::new();
    let large = image.width() * image.height() >= seed::LARGE;
    let scales = if large {
        [seed::Scale::Half, seed::Scale::Quarter]
    } else {
        [seed::Scale::Full, seed::Scale::Half]
    };
    for scale in scales {
        for seed in seed::find(image, scale, 9, 10_000).iter().take(PIECES) {
            readings.extend(of_piece(declared, image, seed));
        }
    }
    let rank = |reading: &Reading| (reading.differences, std::cmp::Reverse(reading.agreeing));
    let first = readings.iter().map(rank).min()?;
    // As declared: nothing of it is wrong.
    if first.0 == 0 {
        return None;
    }
    readings.retain(|reading| rank(reading) == first);
    // Markers can be read with sides that are somewhat wrong: the middle of these.
    let best = &readings.first()?.board;
    let alike =
        |reading: &&Reading| Charuco { marker: best.marker, ..reading.board.clone() } == *best;
    let sides: Vec<f64> = readings.iter().filter(alike).map(|it| it.board.marker).collect();
    let marker = wheatstone_numeric::statistics::median(&sides);
    Some(described(declared, &Charuco { marker, ..best.clone() }))
}

/// The settings that differ, as the user would write them.
fn described(declared: &Charuco, meant: &Charuco) -> String {
    let mut all = Vec::new();
    if (meant.columns, meant.rows) != (declared.columns, declared.rows) {
        all.push(format!("`columns = {}`, `rows = {}` (squares)", meant.columns, meant.rows));
    }
    if meant.dictionary != declared.dictionary {
        all.push(format!("`dictionary = \"{}\"`", meant.dictionary));
    }
    if meant.marker != declared.marker {
        let percent = (100.0 * meant.marker / meant.pitch).round();
        all.push(format!("a `marker` of about {percent} % of the square with its dark border"));
    }
    all.join(", ")
}

/// Boards that a piece of a chessboard may be, by its markers.
fn of_piece(declared: &Charuco, image: &GrayImage, seed: &seed::Seed) -> Vec<Reading> {
    let sides =
        MARKERS.0.step_by(MARKERS.1).map(|percent| declared.pitch * f64::from(percent) / 100.0);
    let mut readings = Vec::new();
    for marker in std::iter::once(declared.marker).chain(sides) {
        let board = Charuco { marker, ..declared.clone() };
        let most = growth::most_points(declared.columns * declared.rows);
        let Some(grown) = growth::grow(image, seed, most, board.reach()) else { continue };
        let grown = markers::face_up(grown);
        for bits in 3..=8 {
            let seen = markers::codes(image, &grown, (marker / board.pitch, bits));
            if seen.len() < LEAST_MARKERS {
                continue;
            }
            for (name, words) in dictionaries().into_iter().filter(|it| it.1.marker_size() == bits)
            {
                let board = Charuco { dictionary: name.into(), ..board.clone() };
                readings.extend(with_counts(
                    (declared, &board),
                    &grown,
                    &markers::matched(&seen, &words),
                ));
            }
        }
    }
    readings
}

/// All dictionaries, small ones first: larger ones of a kind begin with the same markers.
fn dictionaries() -> Vec<(&'static str, Dictionary)> {
    let named = |name: &&'static str| Some((*name, builtins::builtin_dictionary(name)?));
    let mut all: Vec<_> = builtins::BUILTIN_DICTIONARY_NAMES.iter().filter_map(named).collect();
    all.sort_by_key(|(_, words)| words.codes().len());
    all
}

/// Boards with the counts that are likely: as declared, exchanged, and as far as corners were found.
fn with_counts(
    (declared, board): (&Charuco, &Charuco),
    grown: &Grown,
    found: &[((i32, i32), calib_targets::aruco::Match)],
) -> Vec<Reading> {
    let extent = |pick: fn(&(i32, i32)) -> i32| {
        let all = grown.labels.keys().map(pick);
        (all.clone().max().unwrap_or(0) - all.min().unwrap_or(0) + 2) as usize
    };
    let seen = (extent(|label| label.0), extent(|label| label.1));
    let own = (declared.columns, declared.rows);
    let of_counts = |(columns, rows): (usize, usize)| {
        let board = Charuco { columns, rows, ..board.clone() };
        let is_possible = board.validate().is_ok();
        let agreeing = markers::agreed(&board, is_possible.then_some(found)?)?.1;
        let differences = usize::from((columns, rows) != own)
            + usize::from(board.dictionary != declared.dictionary)
            + usize::from(board.marker != declared.marker);
        // Of the squares with four corners half have markers, and half of those are asked for.
        let enough = agreeing >= LEAST_MARKERS.max(squares(grown) / 4);
        enough.then_some(Reading { differences, agreeing, board })
    };
    [own, (own.1, own.0), seen, (seen.1, seen.0)].into_iter().filter_map(of_counts).collect()
}

/// Squares of which all corners were found.
fn squares(grown: &Grown) -> usize {
    let has = |column: i32, row: i32| grown.labels.contains_key(&(column, row));
    let whole = |(column, row): &&(i32, i32)| {
        has(column + 1, *row) && has(*column, row + 1) && has(column + 1, row + 1)
    };
    grown.labels.keys().filter(whole).count()
}
