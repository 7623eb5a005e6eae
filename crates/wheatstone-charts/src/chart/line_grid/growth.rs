//! From one cell of crossings to all that hang together with it, line by line: a crossing joins
//! where the line that leads to it can be followed all the way and another crosses it there.
//!
//! Nothing is assumed about the whole: lens distortion, tilt and warps bend lines, but from one
//! crossing to the next a line is nearly straight and steps change little.

use super::{
    candidates::{Candidate, Candidates, Seed},
    grid::{Grid, Label, Node, SIDES, crosswise, onward},
    level::View,
    profile::{Dip, Window, dip},
};
use nalgebra::Vector2;
use std::collections::{BTreeMap, BTreeSet};
use wheatstone_core::geometry::Pixel;
use wheatstone_numeric::statistics::median;

/// How far, in pitches, profiles reach at most: short of the next line by more than its half width.
const REACH: f64 = 0.42;
/// How far beyond a line's edge profiles reach, in pixels: 2 sigma of the blur, and the ends that
/// make the ground level.
const GROUND: f64 = 3.0;
/// Width at half depth of a line without width, in pixels: 2.355 sigma of a lens and of sampling.
const BLURRED: f64 = 2.5;
/// See [`Look::settled`].
const ROUGHLY: f64 = 2.0;
/// Stations along a line between two crossings.
const STATIONS: usize = 5;
/// How far from a straight line or from where it is expected a line may be, in pitches.
const SEARCH: f64 = 0.3;
/// How much a line's depth may differ from that at its neighbour, as a factor: uneven light
/// changes it by a tenth a pitch, lines that end at a crossing halve it there.
const DEPTHS: f64 = 0.5;
/// How far off a straight line between two crossings stations may be, in pitches.
const STRAIGHT: f64 = 0.06;
/// Seeds that are tried in one level: a grid has many, and clutter is as even only by accident.
const TRIES: usize = 150;
/// Grids are followed to this many times the chart's crossings, enough to tell a mistaken count by; a texture
/// of 12 megapixels would go on for seconds.
const MOST_WHOLE: usize = 4;
/// Crossings of the smallest chart that counts for that.
const LEAST_WHOLE: usize = 250;

/// Longest step of a level's grids, in pixels: lines of 5 px are the widest that candidates show,
/// and 1/25 of the pitch the narrowest that charts have.
const LONGEST: f64 = 125.0;

/// A point of a line, seen across it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Station {
    /// How far along, 0 at one crossing and 1 at the next.
    pub(super) along: f64,
    /// Where the line is.
    pub(super) pixel: Pixel,
    /// How it looks, in shares of the step across.
    pub(super) dip: Dip,
}

/// A line's width and how exactly its middle is wanted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    /// Share of the pitch.
    pub(super) width: f64,
    /// Samples by which a profile may be off the dip's middle. Off the middle, the dip's own tail
    /// tilts the ground: 2 are enough to find a line, and at 0.1 the bias is below 0.001 px.
    pub(super) settled: f64,
}

impl Look {
    fn window(self, across: Vector2<f64>) -> Window {
        let reach = (self.width / 2.0 + GROUND / across.norm()).min(REACH);
        Window { reach, search: SEARCH, settled: self.settled }
    }
}

/// The share of a step that the crossing at its end disturbs.
pub(super) fn disturbed(width: f64, along: Vector2<f64>) -> f64 {
    (width / 2.0 + 1.5 / along.norm()).clamp(0.15, 0.36)
}

/// Follows a line from `from` over `step`, at the given places along it, with steps across given at
/// its two ends. Places where no line is seen are `None`.
pub(super) fn follow(
    view: View,
    (from, step): (Pixel, Vector2<f64>),
    across: [Vector2<f64>; 2],
    places: &[f64],
    look: Look,
) -> Vec<Option<Station>> {
    let mut drift = 0.0;
    let stations = places.iter().map(|along| {
        let centre = from + step * *along;
        let across = across[0] * (1.0 - along) + across[1] * *along;
        let found = dip(view, centre, across, drift, look.window(across))?;
        drift = found.offset;
        Some(Station { along: *along, pixel: centre + across * found.offset, dip: found })
    });
    stations.collect()
}

/// Places evenly spread over the part of a step that its ends do not disturb.
pub(super) fn spread(count: usize, margin: f64) -> Vec<f64> {
    let span = 1.0 - 2.0 * margin;
    (0..count).map(|i| margin + span * i as f64 / (count - 1) as f64).collect()
}

/// Intercept and slope of the offsets over the way along, and the largest deviation.
fn straight(stations: &[Station]) -> (f64, f64, f64) {
    let count = stations.len() as f64;
    let mean = |value: fn(&Station) -> f64| stations.iter().map(value).sum::<f64>() / count;
    let (along, offset) = (mean(|s| s.along), mean(|s| s.dip.offset));
    let (mut product, mut square) = (0.0, 0.0);
    for station in stations {
        product += (station.along - along) * (station.dip.offset - offset);
        square += (station.along - along) * (station.along - along);
    }
    let slope = if square > 0.0 { product / square } else { 0.0 };
    let start = offset - slope * along;
    let deviation = stations
        .iter()
        .map(|s| (s.dip.offset - start - slope * s.along).abs())
        .fold(0.0_f64, f64::max);
    (start, slope, deviation)
}

fn alike(depth: f64, other: f64) -> bool {
    depth > DEPTHS * other && other > DEPTHS * depth
}

/// What is known about a place before a crossing is looked for there.
struct Expected {
    /// The known neighbour.
    from: Node,
    /// The step from there.
    step: Vector2<f64>,
    /// The step along the other line.
    across: Vector2<f64>,
    width: f64,
}

impl Expected {
    /// The crossing, if the line leads to it and another crosses there.
    fn look(&self, view: View) -> Option<Node> {
        let margin = disturbed(self.width, self.step);
        let leading: Vec<Station> = follow(
            view,
            (self.from.pixel, self.step),
            [self.across, self.across],
            &spread(STATIONS, margin),
            Look { width: self.width, settled: ROUGHLY },
        )
        .into_iter()
        .collect::<Option<_>>()?;
        let (start, slope, deviation) = straight(&leading);
        let good = |s: &Station| {
            alike(s.dip.depth, self.from.depth) && self.fits(s.dip.width, self.across)
        };
        if deviation > STRAIGHT || !leading.iter().all(good) {
            return None;
        }
        let intersection = self.from.pixel + self.step + self.across * (start + slope);
        let depths: Vec<f64> = leading.iter().map(|s| s.dip.depth).collect();
        let depth = median(&depths);
        let arms: Vec<Vec<Station>> = [1.0, -1.0]
            .iter()
            .filter_map(|sign| self.arm(view, intersection, *sign, depth))
            .collect();
        let middles: Vec<f64> = arms
            .iter()
            .map(|arm| arm.iter().map(|s| s.dip.offset).sum::<f64>() / arm.len() as f64)
            .collect();
        // Two arms of one line meet.
        let offset = match middles.as_slice() {
            [one] => *one,
            [one, other] if (one - other).abs() < 2.0 * SEARCH * 0.5 => (one + other) / 2.0,
            _ => return None,
        };
        let pixel = intersection + self.step * offset;
        view.contains(pixel, 1.0).then_some(Node { pixel, depth, sigma: 0.0 })
    }

    /// One half of the line that crosses at `intersection`, on the side to which `sign` says.
    fn arm(&self, view: View, intersection: Pixel, sign: f64, depth: f64) -> Option<Vec<Station>> {
        let nearest = disturbed(self.width, self.across);
        let places = [nearest, (nearest + 0.45) / 2.0, 0.45];
        let stations: Vec<Station> = follow(
            view,
            (intersection, sign * self.across),
            [self.step, self.step],
            &places,
            Look { width: self.width, settled: ROUGHLY },
        )
        .into_iter()
        .collect::<Option<_>>()?;
        let (_, slope, deviation) = straight(&stations);
        let good = |s: &Station| alike(s.dip.depth, depth) && self.fits(s.dip.width, self.step);
        // Steps across are known to a fifth at worst.
        (deviation < STRAIGHT && slope.abs() < 0.3 && stations.iter().all(good)).then_some(stations)
    }

    /// Whether a line is as wide as those of the grid. Blur has its own width, which is more of the
    /// pitch where the grid is far away.
    fn fits(&self, width: f64, across: Vector2<f64>) -> bool {
        width < 2.0 * self.width + BLURRED / across.norm() && self.width < 2.0 * width
    }
}

/// Adds every crossing that can be reached. Stops by itself: each new one lies on the picture, at
/// least half a step from those it was reached from.
pub(super) fn grow(grid: &mut Grid, view: View, whole: usize) {
    // How much was known when a place was looked at in vain.
    let mut failed: BTreeMap<Label, usize> = BTreeMap::new();
    // Six pixels each way is less than any pitch that lines can be told at.
    let most = (view.area() / 36 + 4).min(MOST_WHOLE * whole.max(LEAST_WHOLE));
    loop {
        let frontier: BTreeSet<Label> = grid
            .nodes
            .keys()
            .flat_map(|label| SIDES.map(|side| onward(*label, side, 1)))
            .filter(|label| !grid.nodes.contains_key(label))
            .collect();
        let mut found = Vec::new();
        for label in frontier {
            let known = neighbourhood(grid, label);
            if failed.get(&label) == Some(&known) {
                continue;
            }
            match reach(grid, view, label) {
                Some(node) => found.push((label, node)),
                None => drop(failed.insert(label, known)),
            }
        }
        if found.is_empty() || grid.nodes.len() > most {
            return;
        }
        grid.nodes.extend(found);
    }
}

/// How many crossings near `label` are known.
fn neighbourhood(grid: &Grid, label: Label) -> usize {
    let near = (-2..=2).flat_map(|dx| (-2..=2).map(move |dy| (dx, dy)));
    near.filter(|(dx, dy)| grid.nodes.contains_key(&(label.0 + dx, label.1 + dy))).count()
}

/// The crossing at `label`, from any neighbour that leads to it.
fn reach(grid: &Grid, view: View, label: Label) -> Option<Node> {
    SIDES.iter().find_map(|side| {
        let known = onward(label, *side, -1);
        let from = *grid.nodes.get(&known)?;
        let step = grid.prediction(known, *side)? - from.pixel;
        let cross = crosswise(*side);
        let cross = (cross.0.abs(), cross.1.abs());
        let across = grid.step(known, cross)?;
        let node = Expected { from, step, across, width: grid.width }.look(view)?;
        // Folding back on what is known is no growth.
        let far = |other: Label| {
            grid.pixel(other).is_none_or(|p| (p - node.pixel).norm() > 0.5 * step.norm())
        };
        let near = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy)));
        near.map(|(dx, dy)| (label.0 + dx, label.1 + dy)).all(far).then_some(node)
    })
}

/// The largest grid that grows from any of a level's seeds.
pub(super) fn largest(candidates: &Candidates, view: View, enough: usize) -> Option<Grid> {
    let mut best: Option<Grid> = None;
    let mut used: BTreeMap<(i32, i32), Vec<Pixel>> = BTreeMap::new();
    let (mut tries, mut known) = (0, 0);
    for seed in &candidates.seeds {
        let place = candidates.places[seed.candidate].pixel;
        if tries == TRIES {
            break;
        }
        if is_near(&used, place) {
            continue;
        }
        tries += 1;
        let Some(mut grid) = cell(seed, candidates, view) else { continue };
        grow(&mut grid, view, enough);
        for node in grid.nodes.values() {
            used.entry(in_boxes(node.pixel)).or_default().push(node.pixel);
        }
        known += grid.nodes.len();
        let count = grid.nodes.len();
        if best.as_ref().is_none_or(|best| count > best.nodes.len()) {
            best = Some(grid);
        }
        // What is left cannot beat it, or it is whole.
        let left = candidates.seeds.len().saturating_sub(known);
        if count >= enough || best.as_ref().is_some_and(|best| best.nodes.len() > left) {
            break;
        }
    }
    best
}

/// In pixels: more than a candidate is off its crossing.
const OFF: f64 = 2.5;

/// The box of side [`OFF`] that a place is in.
fn in_boxes(place: Pixel) -> (i32, i32) {
    ((place.x / OFF).floor() as i32, (place.y / OFF).floor() as i32)
}

/// Whether one of these places is within [`OFF`] of another.
fn is_near(used: &BTreeMap<(i32, i32), Vec<Pixel>>, place: Pixel) -> bool {
    let (column, row) = in_boxes(place);
    let boxes = (-1..=1).flat_map(|x| (-1..=1).map(move |y| (column + x, row + y)));
    let mut near = boxes.filter_map(|it| used.get(&it)).flatten();
    near.any(|other| (other - place).norm() < OFF)
}

/// Four crossings about a square that has the seed at a corner.
fn cell(seed: &Seed, candidates: &Candidates, view: View) -> Option<Grid> {
    let places = &candidates.places;
    let own = places[seed.candidate];
    // A corner's curvature is half a full crossing's, or less in its shade.
    let row = |offset: f64| places.partition_point(|other| other.pixel.y < own.pixel.y + offset);
    let near: Vec<&Candidate> = places[row(-LONGEST)..row(LONGEST)]
        .iter()
        .filter(|other| (other.pixel.x - own.pixel.x).abs() < 2.0 * LONGEST)
        .filter(|other| other.curvature > 0.25 * own.curvature)
        .collect();
    let steps: Vec<Option<Vector2<f64>>> =
        seed.arms.iter().map(|arm| neighbour(own.pixel, *arm, &near)).collect();
    (0..steps.len()).find_map(|i| {
        let (a, b) = (steps[i]?, steps[(i + 1) % steps.len()]?);
        let sine = a.perp(&b) / (a.norm() * b.norm());
        // Tilted by 60 degrees, a right angle is 53 degrees or more.
        if sine < 0.4 {
            return None;
        }
        let fourth = own.pixel + a + b;
        let nearest = near
            .iter()
            .map(|other| other.pixel)
            .min_by(|p, q| (p - fourth).norm().total_cmp(&(q - fourth).norm()))?;
        if (nearest - fourth).norm() > 0.3 * a.norm().min(b.norm()) {
            return None;
        }
        first_cell(view, own.pixel, [a, b, nearest - own.pixel])
    })
}

/// The step to the nearest candidate along an arm.
fn neighbour(from: Pixel, arm: Vector2<f64>, near: &[&Candidate]) -> Option<Vector2<f64>> {
    near.iter()
        .map(|other| other.pixel - from)
        // No nearer than lines can be told apart, in a corridor as wide as arms are uncertain.
        .filter(|step| step.dot(&arm) > 6.0 && step.perp(&arm).abs() < 0.2 * step.dot(&arm))
        .min_by(|a, b| a.norm().total_cmp(&b.norm()))
}

/// A grid of one cell, if lines join its corners; corners are given by their steps from the first.
fn first_cell(view: View, first: Pixel, [a, b, fourth]: [Vector2<f64>; 3]) -> Option<Grid> {
    let sides = [
        (first, a, [b, fourth - a]),
        (first, b, [a, fourth - b]),
        (first + a, fourth - a, [a, fourth - b]),
        (first + b, fourth - b, [b, fourth - a]),
    ];
    let mut stations: Vec<Station> = Vec::new();
    for (from, step, across) in sides {
        // The width is not yet known: as wide as any.
        let unknown = Look { width: 1.0, settled: ROUGHLY };
        let seen = follow(view, (from, step), across, &spread(STATIONS, 0.3), unknown);
        let seen: Vec<Station> = seen.into_iter().collect::<Option<_>>()?;
        if straight(&seen).2 > STRAIGHT {
            return None;
        }
        stations.extend(seen);
    }
    let middle =
        |value: fn(&Station) -> f64| median(&stations.iter().map(value).collect::<Vec<_>>());
    let (depth, width) = (middle(|s| s.dip.depth), middle(|s| s.dip.width));
    // Half the ground belongs to no grid of lines.
    if width > 0.6 || !stations.iter().all(|s| alike(s.dip.depth, depth)) {
        return None;
    }
    let corners = [((0, 0), Vector2::zeros()), ((1, 0), a), ((0, 1), b), ((1, 1), fourth)];
    let nodes = corners
        .map(|(label, step)| (label, Node { pixel: first + step, depth, sigma: 0.0 }))
        .into_iter()
        .collect();
    Some(Grid { nodes, width })
}
