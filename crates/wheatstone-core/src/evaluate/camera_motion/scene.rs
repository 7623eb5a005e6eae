//! What was seen, as groups of pixels that share a place, without gross errors.

use super::{
    rows::{Group, LEAST_ON_BOARD, Place, Rig, Seen},
    solution::Solution,
};
use crate::{
    dataset::{Correspondence, Dataset},
    geometry::{Point3, Pose},
    method::Reconstructor,
};
use std::collections::HashSet;
use wheatstone_numeric::statistics::{chi_square_upper_quantile, median};

/// Groups with where they are to begin with.
pub(super) struct Scene {
    pub(super) groups: Vec<Group>,
    pub(super) places: Vec<Place>,
}

/// More points tell no more: what is uncertain of the fit then is.
const MOST: usize = 20_000;

impl Scene {
    /// Points at given places, boards whose poses are not known, and points that two cameras or more matched.
    pub(super) fn of(map: &dyn Reconstructor, data: &Dataset) -> Self {
        let mut scene = Self { groups: Vec::new(), places: Vec::new() };
        let mut boards: Vec<Vec<&Correspondence>> = vec![Vec::new(); data.views.len().max(1)];
        // Evenly chosen where there are more.
        let stride = data.correspondences.len().div_ceil(MOST).max(1);
        for row in data.correspondences.iter().step_by(stride) {
            if let Some(world) = row.world {
                scene.push(Place::Given, seen(map, row, world, world));
            } else if row.board.is_some() {
                boards[row.view].push(row);
            } else if row.seen_by() >= 2
                && let Some(found) = map.locate_point(&row.pixels)
            {
                scene.push(Place::Point(found), seen(map, row, found, found));
            }
        }
        boards.iter().for_each(|rows| scene.push_board(map, rows));
        scene
    }

    fn push(&mut self, place: Place, seen: Vec<Seen>) {
        if seen.len() >= place.least() {
            self.groups.push(Group { seen });
            self.places.push(place);
        }
    }

    /// A board that one camera alone saw tells nothing of cameras against each other.
    fn push_board(&mut self, map: &dyn Reconstructor, rows: &[&Correspondence]) {
        let located = |row: &&Correspondence| {
            let [x, y] = row.board?;
            Some((Point3::new(x, y, 0.0), map.locate_point(&row.pixels)?))
        };
        let pairs: Vec<(Point3, Point3)> = rows.iter().filter_map(located).collect();
        let Some(pose) = Pose::aligning(&pairs).filter(|_| pairs.len() >= LEAST_ON_BOARD) else {
            return;
        };
        let each = rows.iter().flat_map(|row| {
            let [x, y] = row.board.unwrap_or_default();
            let at = Point3::new(x, y, 0.0);
            seen(map, row, pose.transform(at), at)
        });
        self.push(Place::Board(pose), each.collect());
    }
}

/// A pixel of a group, or all of them.
type Outlier = (usize, Option<usize>);

/// Pixels that no noise makes, and matches of different points.
pub(super) fn outliers(rig: &Rig<'_>, solution: &Solution) -> Vec<Outlier> {
    /// So seldom is a good pixel left out.
    const RATE: f64 = 1e-6;
    // The pixels of a match share what is left of it; others are judged one by one.
    let mut judged: Vec<(Outlier, f64, usize)> = Vec::new();
    for (index, rows) in solution.equations.groups.iter().enumerate() {
        if matches!(solution.state.places[index], Place::Point(_)) {
            let freedom = rows.left.len() - rows.places();
            judged.push(((index, None), rows.left.norm_squared(), freedom));
        } else {
            for place in 0..rig.groups[index].seen.len() {
                let square = rows.left.rows(2 * place, 2).norm_squared();
                judged.push(((index, Some(place)), square, 2));
            }
        }
    }
    // The median of a chi-square variable (Wilson & Hilferty 1931, doi:10.1073/pnas.17.12.684).
    let middle = |freedom: f64| freedom * (1.0 - 2.0 / (9.0 * freedom)).powi(3);
    let shares: Vec<f64> = judged.iter().map(|(_, square, n)| square / middle(*n as f64)).collect();
    let variance = median(&shares);
    let most = 2 * rig.frames.len();
    let limits: Vec<f64> =
        (1..=most).map(|n| variance * chi_square_upper_quantile(RATE, n)).collect();
    let is_gross = |(_, square, n): &(Outlier, f64, usize)| *square > limits[n - 1];
    judged.into_iter().filter(is_gross).map(|(outlier, ..)| outlier).collect()
}

/// Leaves out pixels, and groups that tell nothing without them.
pub(super) fn leave_out(rig: &mut Rig<'_>, places: &mut Vec<Place>, outliers: &[Outlier]) {
    let all: HashSet<Outlier> = outliers.iter().copied().collect();
    let groups = std::mem::take(&mut rig.groups).into_iter().zip(std::mem::take(places));
    for (index, (group, place)) in groups.enumerate() {
        let kept = group.seen.into_iter().enumerate();
        let kept: Vec<Seen> = kept
            .filter(|(own, _)| !all.contains(&(index, Some(*own))) && !all.contains(&(index, None)))
            .map(|(_, seen)| seen)
            .collect();
        if kept.len() >= place.least() {
            rig.groups.push(Group { seen: kept });
            places.push(place);
        }
    }
}

fn seen(map: &dyn Reconstructor, row: &Correspondence, world: Point3, at: Point3) -> Vec<Seen> {
    let of = |(camera, pixel): (usize, &Option<_>)| {
        let pixel = (*pixel)?;
        map.project(camera, world)?;
        let sigma = map.pixel_sigma(camera, pixel, world).filter(|sigma| *sigma > 0.0)?;
        Some(Seen { camera, pixel, sigma, at })
    };
    row.pixels.iter().enumerate().filter_map(of).collect()
}
