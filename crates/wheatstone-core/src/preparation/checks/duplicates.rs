//! The same thing twice: views, and cameras.

use super::{
    Fault,
    evidence::Evidence,
    finding::{Change, Proposal, Severity},
    pairs::Pair,
    views::LEAST,
    views::View,
};
use crate::{dataset::Correspondence, geometry::Point3};
use std::collections::BTreeMap;
use wheatstone_numeric::statistics::median;

pub(super) struct Duplicates;

impl Fault for Duplicates {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found = identical_cameras(evidence);
        let named: Vec<Named> = evidence.views.iter().map(|view| named(evidence, view)).collect();
        let middles: Vec<_> = (0..named.len()).map(|view| middles(evidence, view)).collect();
        for second in 0..evidence.views.len() {
            let mut earlier = named.iter().enumerate().take(second);
            let near =
                |first: usize| named.len() <= FEW || are_near(&middles[first], &middles[second]);
            found.extend(earlier.find_map(|(first, names)| {
                near(first).then(|| copied(evidence, (first, names), second)).flatten()
            }));
        }
        found.extend(lattices(evidence));
        found
    }
}

/// In pixels: detectors repeat themselves on one picture to a hundredth at best; two pictures never agree so.
const DETECTED: f64 = 0.02;

/// Pixels of two cameras that are the same.
fn identical_cameras(evidence: &Evidence) -> Vec<Proposal> {
    let mut found = Vec::new();
    let rows = &evidence.data.correspondences;
    for second in 0..evidence.data.cameras {
        for first in 0..second {
            let both = |c: &Correspondence| Some((c.pixels[first]?, c.pixels[second]?));
            let gaps: Vec<f64> =
                rows.iter().filter_map(both).map(|(a, b)| (a - b).norm()).collect();
            if gaps.len() < LEAST || median(&gaps) > DETECTED {
                continue;
            }
            let what = format!(
                "cameras {} and {} give the same pixels: one file or column was taken twice",
                first + 1,
                second + 1
            );
            let cells: Vec<(usize, usize)> =
                (0..evidence.views.len()).flat_map(|v| [(v, first), (v, second)]).collect();
            found.push(Proposal {
                also: cells.clone(),
                cells,
                figures: vec![("median distance of their pixels, px".into(), median(&gaps))],
                ..Proposal::itself(
                    "identical-cameras",
                    Severity::Fatal,
                    what,
                    "give each camera its own pictures: one picture cannot be triangulated",
                )
            });
        }
    }
    found
}

/// Views of which all pairs are compared, at most.
const FEW: usize = 200;

/// The median of a view's pixels along x, by camera; none where a camera has too few.
fn middles(evidence: &Evidence, view: usize) -> Vec<Option<f64>> {
    let of = |pairs: &[Pair]| -> Option<f64> {
        let along: Vec<f64> = pairs.iter().map(|(_, pixel)| pixel.x).collect();
        (along.len() >= LEAST).then(|| median(&along))
    };
    evidence.cells[view].iter().map(|cell| of(&cell.pairs)).collect()
}

/// Whether views may be copies by where their middles lie: most pairs are told apart by that, which is quick.
fn are_near(first: &[Option<f64>], second: &[Option<f64>]) -> bool {
    /// Pixels by which copies may differ, and more.
    const FAR: f64 = 10.0;
    let pairs = first.iter().zip(second).filter_map(|(a, b)| Some((a.as_ref()?, b.as_ref()?)));
    let gaps: Vec<f64> = pairs.map(|(a, b)| (a - b).abs()).collect();
    gaps.is_empty() || gaps.iter().all(|gap| *gap < FAR)
}

/// Rows of a view by their points' names; the first one where several have a name.
type Named<'a> = BTreeMap<&'a str, usize>;

fn named<'a>(evidence: &Evidence<'a>, view: &View) -> Named<'a> {
    let data = evidence.data;
    let name = |row: &usize| Some((data.correspondences[*row].id.as_deref()?, *row));
    view.rows.iter().rev().filter_map(name).collect()
}

/// A view whose pixels another view has too.
fn copied(evidence: &Evidence, (first, names): (usize, &Named), second: usize) -> Option<Proposal> {
    let data = evidence.data;
    let (a, b) = (&evidence.views[first].rows, &evidence.views[second].rows);
    let mut same_place = 0;
    let mut gaps = vec![Vec::new(); data.cameras];
    let mut places: Vec<(Point3, Point3)> = Vec::new();
    for (rank, row) in b.iter().enumerate() {
        let own = &data.correspondences[*row];
        let named = own.id.as_deref().and_then(|id| names.get(id));
        let other = named.or_else(|| a.get(rank).filter(|_| a.len() == b.len()));
        let Some(other) = other else { continue };
        let twin = &data.correspondences[*other];
        for ((p, q), gaps) in own.pixels.iter().zip(&twin.pixels).zip(&mut gaps) {
            if let (Some(p), Some(q)) = (p, q) {
                gaps.push((p - q).norm());
            }
        }
        if let (Some(p), Some(q)) = (own.world, twin.world) {
            places.push((p, q));
            same_place += usize::from((p - q).norm() < 1e-6 * evidence.frame.size);
        }
    }
    gaps.retain(|gaps| gaps.len() >= LEAST);
    if gaps.is_empty() {
        return None;
    }
    let placed_alike = 10 * same_place > 9 * b.len();
    let gap = gaps.iter().map(|gaps| median(gaps)).fold(0.0, f64::max);
    // A chart at rest, photographed again, is seen within its noise.
    let noise = evidence.seen.iter().flatten().map(|seen| seen.typical).fold(1.0, f64::min);
    // Rounded pixels of places that hardly differ are the same by right.
    let step = || {
        let steps = places.iter().filter_map(|(p, q)| visible_step(evidence, *p, *q));
        median(&steps.collect::<Vec<f64>>())
    };
    let exact = gap < 1e-6 && (placed_alike || step() > 3.0);
    let is_repeated = placed_alike && gap > DETECTED;
    if is_repeated && gap < 2.5 * noise + DETECTED {
        return Some(repeated(evidence, (first, second), gap));
    }
    if !exact && (!placed_alike || is_repeated) {
        return None;
    }
    Some(copy(evidence, (first, second), placed_alike, gap))
}

/// A chart that was shown twice at one place: nothing has moved in between.
fn repeated(evidence: &Evidence, (first, second): (usize, usize), gap: f64) -> Proposal {
    let name = &evidence.views[first].name;
    Proposal {
        cells: (0..evidence.data.cameras).map(|camera| (second, camera)).collect(),
        key: name.clone(),
        figures: vec![("median distance of their pixels, px".into(), gap)],
        ..Proposal::itself(
            "duplicate-views",
            Severity::Information,
            format!(
                "the chart stands where view `{name}` has it, and nothing moved in between: cross-validation, which leaves out one of them at a time, looks a little better than it is"
            ),
            "nothing to do",
        )
    }
}

fn copy(evidence: &Evidence, (first, second): (usize, usize), alike: bool, gap: f64) -> Proposal {
    let name = &evidence.views[first].name;
    let (severity, what) = if alike {
        (
            Severity::Warning,
            format!(
                "the view is a copy of view `{name}`: it counts twice, and cross-validation looks better than it is"
            ),
        )
    } else {
        (
            Severity::Fatal,
            format!(
                "the view has the pixels of view `{name}`, but other world coordinates: one of the two is wrong"
            ),
        )
    };
    let drop = |row: &usize| Change::Drop { row: *row };
    let rows = &evidence.views[second].rows;
    Proposal {
        cells: (0..evidence.data.cameras).map(|camera| (second, camera)).collect(),
        key: name.clone(),
        figures: vec![("median distance of their pixels, px".into(), gap)],
        changes: if alike { rows.iter().map(drop).collect() } else { Vec::new() },
        ..Proposal::itself(
            "duplicate-views",
            severity,
            what,
            "remove one of them, or let it be removed if the coordinates are the same",
        )
    }
}

/// How far apart two places are in the pictures, in pixels: the most of all cameras.
fn visible_step(evidence: &Evidence, p: Point3, q: Point3) -> Option<f64> {
    let [p, q] = [p, q].map(|place| evidence.frame.scaled(place));
    let seen = evidence.seen.iter().flatten();
    let steps = seen.filter_map(|s| Some((s.camera.project(p)? - s.camera.project(q)?).norm()));
    steps.reduce(f64::max)
}

/// Whole pixels in one camera, and half ones in another: one of them counts from another place.
fn lattices(evidence: &Evidence) -> Vec<Proposal> {
    let fraction = |camera: usize| -> Option<f64> {
        let seen: Vec<f64> = evidence
            .data
            .correspondences
            .iter()
            .filter_map(|c| *c.pixels.get(camera)?)
            .flat_map(|pixel| [pixel.x, pixel.y])
            .collect();
        let first = seen.first()?.rem_euclid(1.0);
        let alike = |value: &f64| (value.rem_euclid(1.0) - first).abs() < 1e-6;
        (seen.len() >= 2 * LEAST && seen.iter().all(alike)).then_some(first)
    };
    let known: Vec<(usize, f64)> =
        (0..evidence.data.cameras).filter_map(|camera| Some((camera, fraction(camera)?))).collect();
    let Some((_, first)) = known.iter().find(|(_, f)| *f == 0.0).or_else(|| known.first()) else {
        return Vec::new();
    };
    let odd = known.iter().filter(|(_, other)| (other - first).abs() > 1e-6);
    odd.map(|(camera, own)| Proposal {
        cells: (0..evidence.views.len()).map(|view| (view, *camera)).collect(),
        figures: vec![("fraction of its pixels".into(), *own)],
        ..Proposal::itself(
            "pixel-offset",
            Severity::Warning,
            format!("its rounded pixels end in {own:.3}, those of another camera in {first:.3}: their origins differ (half a pixel lies between a pixel's corner and its centre)"),
            "harmless as long as `locate` gets pixels with the same origin; otherwise put (0, 0) at the centre of the first pixel",
        )
    })
    .collect()
}
