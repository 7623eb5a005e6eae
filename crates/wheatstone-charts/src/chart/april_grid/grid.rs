//! From tags that were read to all corners of the grid.

use super::{AprilGrid, Found, tags::Tag};
use crate::{
    chart::{Detection, chessboard::saddle},
    imaging::GrayImage,
};
use std::collections::BTreeMap;
use wheatstone_core::geometry::{Homography, Pixel};

/// How far a corner may be from where those around say, as a share of the gap between tags: beyond a half
/// it would be the square's other corner.
const MOST_DEVIATION: f64 = 0.3;
/// The saddle's window as a share of the gap, and its bounds in pixels: as on chessboards, but within the
/// small square.
const WINDOW: (f64, f64, f64) = (0.2, 0.8, 2.5);
/// Corners by which another is looked for.
const AROUND: usize = 12;
/// Contrast of a corner that was not read, as a share of the median.
const LEAST_CONTRAST: f64 = 0.25;

/// Neighbours that are not where the declared counts have them, as a share of those that are, from which on
/// other counts are looked for. Sound pictures have hardly any, whatever the lens.
const MISPLACED: f64 = 0.1;
/// How many times as many neighbours must be in their places with other counts. With the right ones all are.
const CLEARLY_MORE: f64 = 1.2;

/// The corners of the tags that were read, if two neighbours agree on how tags are turned on the chart.
///
/// Programs print the same word in any of four turns; which one this chart has follows from where each
/// tag's neighbours are.
pub(super) fn laid(chart: &AprilGrid, tags: &[Tag]) -> Option<Found> {
    let by_place = placed(chart, tags);
    let votes = [0, 1, 2, 3].map(|turn| agreeing(chart, &by_place, turn).0);
    let turn = (0..4).max_by_key(|turn| (votes[*turn].len(), 4 - turn))?;
    let best = &votes[turn];
    if best.len() < 2 {
        return None;
    }
    let corners = best.keys().flat_map(|(column, row)| {
        // From the top left clockwise, rows counted from below.
        let corners = on_chart(&by_place[&(*column, *row)], turn);
        [(0, 1), (1, 1), (1, 0), (0, 0)]
            .into_iter()
            .zip(corners)
            .map(move |((x, y), at)| ((2 * column + x, 2 * row + y), at))
    });
    Some(corners.collect())
}

/// The tags that are on the chart, by columns and rows.
fn placed(chart: &AprilGrid, tags: &[Tag]) -> BTreeMap<(usize, usize), Tag> {
    let mut by_place: BTreeMap<(usize, usize), Tag> = BTreeMap::new();
    let mut twice = Vec::new();
    for tag in tags {
        let Some(number) = tag.id.checked_sub(chart.first) else { continue };
        let place = (number % chart.columns, number / chart.columns);
        if place.1 < chart.rows && by_place.insert(place, *tag).is_some() {
            twice.push(place);
        }
    }
    // Two of one name: neither can be believed.
    by_place.retain(|place, _| !twice.contains(place));
    by_place
}

/// The grid with other counts, or another first tag, on which clearly more of the tags that were read are
/// neighbours, where the declared one is contradicted. With the right counts every two tags that are side by
/// side are neighbours, so that no others have more, be the lens as it may.
pub(super) fn better_counts(chart: &AprilGrid, tags: &[Tag]) -> Option<AprilGrid> {
    let score = |chart: &AprilGrid| {
        let by_place = placed(chart, tags);
        let sides = |turn| {
            let (agreeing, misplaced) = agreeing(chart, &by_place, turn);
            (agreeing.values().sum::<usize>(), misplaced)
        };
        (0..4).map(sides).max_by_key(|(agreeing, _)| *agreeing).unwrap_or_default()
    };
    let (least, last) =
        (tags.iter().map(|tag| tag.id).min()?, tags.iter().map(|tag| tag.id).max()?);
    let (own, misplaced) = score(chart);
    if own > 0 && (misplaced as f64) < MISPLACED * own as f64 {
        return None;
    }
    let firsts = if least < chart.first { vec![least] } else { vec![chart.first, least] };
    let others = firsts.into_iter().flat_map(|first| {
        (1..=last - first + 1).map(move |columns| {
            // As many rows as declared, if the tags do not show more.
            let rows = (last - first) / columns + 1;
            let exchanged = columns == chart.rows && rows <= chart.columns;
            let rows = if exchanged { chart.columns } else { rows };
            AprilGrid { columns, rows, first, ..chart.clone() }
        })
    });
    let (most, best) = others
        .map(|other| (score(&other).0, other))
        .reduce(|best, other| if other.0 > best.0 { other } else { best })?;
    (most >= LEAST_SIDES && most as f64 > CLEARLY_MORE * own as f64).then_some(best)
}

/// Sides at which neighbours agree, each counted from both, before other counts are believed: two by two tags.
const LEAST_SIDES: usize = 8;

/// The tag's corners from the chart's top left clockwise, if the chart has its words turned so.
fn on_chart(tag: &Tag, turn: usize) -> [Pixel; 4] {
    let mut corners = tag.corners;
    corners.rotate_left(turn);
    corners
}

/// The tags that have neighbours where they expect them, with the number of these; and how many neighbours
/// are elsewhere.
fn agreeing(
    chart: &AprilGrid,
    tags: &BTreeMap<(usize, usize), Tag>,
    turn: usize,
) -> (BTreeMap<(usize, usize), usize>, usize) {
    let unit = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Pixel::new(x, y));
    let pitch = 1.0 + chart.spacing;
    let mut misplaced = 0;
    let mut found = BTreeMap::new();
    for ((column, row), tag) in tags {
        let own = on_chart(tag, turn);
        let pairs: Vec<(Pixel, Pixel)> = unit.into_iter().zip(own).collect();
        let Some(map) = Homography::fit(&pairs) else { continue };
        let size = (own[2] - own[0]).norm();
        let expects = |(x, y): (isize, isize)| -> Option<bool> {
            let next = (column.checked_add_signed(x)?, row.checked_add_signed(y)?);
            let its = on_chart(tags.get(&next)?, turn);
            let close = unit.into_iter().zip(its).all(|(at, seen)| {
                let place = Pixel::new(at.x + x as f64 * pitch, at.y - y as f64 * pitch);
                map.map(place).is_some_and(|expected| (expected - seen).norm() < 0.2 * size)
            });
            Some(close)
        };
        let sides = [(1, 0), (-1, 0), (0, 1), (0, -1)].into_iter().filter_map(expects);
        let (close, elsewhere): (Vec<bool>, Vec<bool>) = sides.partition(|close| *close);
        misplaced += elsewhere.len();
        if !close.is_empty() {
            found.insert((*column, *row), close.len());
        }
    }
    (found, misplaced)
}

/// All corners that the picture shows, each at its saddle.
pub(super) fn completed(chart: &AprilGrid, image: &GrayImage, read: Found) -> Detection {
    let mut sharp: BTreeMap<(usize, usize), (Pixel, f64)> = BTreeMap::new();
    let mut contrasts = Vec::new();
    for (place, at) in &read {
        let Some((own, map)) = local(chart, &read, *place) else { continue };
        let Some((found, sigma, gap)) = refined(chart, image, (*at, own), &map) else { continue };
        if (found - at).norm() < MOST_DEVIATION * gap {
            contrasts.extend(contrast(chart, image, *place, &map));
            sharp.insert(*place, (found, sigma));
        }
    }
    let least = LEAST_CONTRAST * wheatstone_numeric::statistics::median(&contrasts);
    // Point by point outwards from what is there.
    loop {
        let known: Found = sharp.iter().map(|(place, (at, _))| (*place, *at)).collect();
        let mut news = Vec::new();
        for place in beside(chart, &known) {
            let Some((own, map)) = local(chart, &known, place) else { continue };
            let Some(expected) = map.map(own) else { continue };
            let Some((found, sigma, gap)) = refined(chart, image, (expected, own), &map) else {
                continue;
            };
            let close = (found - expected).norm() < MOST_DEVIATION * gap;
            if close && contrast(chart, image, place, &map).is_some_and(|it| it > least) {
                news.push((place, (found, sigma)));
            }
        }
        if news.is_empty() {
            break;
        }
        sharp.extend(news);
    }
    let id = |(column, row): &(usize, usize)| row * 2 * chart.columns + column;
    let mut all: Vec<_> = sharp.iter().map(|(place, found)| (id(place), *found)).collect();
    all.sort_unstable_by_key(|(id, _)| *id);
    Detection {
        points: all.iter().map(|(id, (at, _))| (*id, *at)).collect(),
        sigmas: all.iter().map(|(_, (_, sigma))| *sigma).collect(),
    }
}

/// Places without a corner beside those with one.
fn beside(chart: &AprilGrid, known: &Found) -> Vec<(usize, usize)> {
    let places = (0..2 * chart.rows).flat_map(|row| (0..2 * chart.columns).map(move |c| (c, row)));
    let near = |(column, row): &(usize, usize)| {
        let around = (column.saturating_sub(2)..=column + 2)
            .flat_map(|c| (row.saturating_sub(2)..=row + 2).map(move |r| (c, r)));
        around.filter(|place| known.contains_key(place)).count() >= 4
    };
    places.filter(|place| !known.contains_key(place)).filter(near).collect()
}

/// From the chart to the picture about a place, and where the place is on the chart.
fn local(
    chart: &AprilGrid,
    known: &Found,
    (column, row): (usize, usize),
) -> Option<(Pixel, Homography)> {
    let own = Pixel::from(chart.place(column, row));
    let reach = 5;
    let mut near: Vec<(f64, Pixel, Pixel)> = (column.saturating_sub(reach)..=column + reach)
        .flat_map(|c| (row.saturating_sub(reach)..=row + reach).map(move |r| (c, r)))
        .filter_map(|place| {
            let at = known.get(&place)?;
            let on = Pixel::from(chart.place(place.0, place.1));
            Some(((on - own).norm(), on, *at))
        })
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let pairs: Vec<(Pixel, Pixel)> =
        near.into_iter().take(AROUND).map(|(_, on, at)| (on, at)).collect();
    Some((own, Homography::fit(&pairs)?))
}

/// The saddle from `start` on, its sigma, and the gap between tags in pixels there.
fn refined(
    chart: &AprilGrid,
    image: &GrayImage,
    (start, own): (Pixel, Pixel),
    map: &Homography,
) -> Option<(Pixel, f64, f64)> {
    let here = map.map(own)?;
    let step = |x: f64, y: f64| Some((map.map(own + nalgebra::Vector2::new(x, y))? - here).norm());
    let gap = step(chart.gap(), 0.0)?.min(step(0.0, chart.gap())?);
    let window = (WINDOW.0 * gap).clamp(WINDOW.1, WINDOW.2);
    let window = saddle::fitting(image, start, window)?;
    let found = saddle::refine(image, start, window)?;
    Some((found, saddle::sigma(image, found, window), gap))
}

/// By how much the light quarters at a corner outshine the dark ones, the tag and the square.
fn contrast(
    chart: &AprilGrid,
    image: &GrayImage,
    (column, row): (usize, usize),
    map: &Homography,
) -> Option<f64> {
    let own = Pixel::from(chart.place(column, row));
    // Into the tag: to the right of left corners, up from lower ones. Half the square, or a border's cell.
    let reach = (0.4 * chart.gap()).min(0.06 * chart.tag);
    let sides = [
        if column.is_multiple_of(2) { reach } else { -reach },
        if row.is_multiple_of(2) { -reach } else { reach },
    ];
    let look = |x: f64, y: f64| {
        let at = map.map(own + nalgebra::Vector2::new(x * sides[0], y * sides[1]))?;
        image.contains(at, 0.0).then(|| f64::from(image.sample(at)))
    };
    // Nearer to the corner where the picture ends beside it.
    [1.0, 0.5, 0.3].into_iter().find_map(|share| {
        let dark = look(share, share)?.max(look(-share, -share)?);
        let light = look(share, -share)?.min(look(-share, share)?);
        Some(light - dark)
    })
}
