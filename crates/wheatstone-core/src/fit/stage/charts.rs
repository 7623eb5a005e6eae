//! Which points moved together: the charts at their places, as the data tell of them.

use super::prior::StagePrior;
use crate::{
    Error, Result,
    dataset::Dataset,
    geometry::{Point3, Vector3},
    method::neural_camera::chart_poses::UncertainPose,
};
use nalgebra::Matrix3;

/// One placement of the chart.
#[derive(Clone, Debug)]
pub(super) struct ChartPosition {
    /// The view's name, or the layer's.
    pub(super) name: String,
    /// Indices into the data's correspondences, of those whose place is known.
    pub(super) rows: Vec<usize>,
    /// The middle of its points.
    pub(super) centre: Point3,
    /// Mean of the products of its points' coordinates about the middle, in squared world units.
    pub(super) spread: Matrix3<f64>,
    /// Half its longest extent along a world axis.
    pub(super) half_extent: f64,
}

/// Fewer placements than this tell nothing: two can always be explained by other cameras.
const FEWEST: usize = 3;

impl ChartPosition {
    fn new(name: String, rows: Vec<usize>, data: &Dataset) -> Option<Self> {
        let points: Vec<Vector3> =
            rows.iter().filter_map(|row| Some(data.correspondences[*row].world?.coords)).collect();
        let first = points.first()?;
        let (low, high) =
            points.iter().fold((*first, *first), |(low, high), p| (low.inf(p), high.sup(p)));
        let centre = points.iter().sum::<Vector3>() / points.len() as f64;
        let products = points.iter().map(|p| (p - centre) * (p - centre).transpose());
        let spread = products.sum::<Matrix3<f64>>() / points.len() as f64;
        let half_extent = 0.5 * (high - low).amax();
        Some(Self { name, rows, centre: centre.into(), spread, half_extent })
    }

    /// The longest extent of the placements' middles along a world axis.
    pub(super) fn extent(placements: &[Self]) -> f64 {
        let along = |axis: usize| {
            let places = placements.iter().map(|placement| placement.centre[axis]);
            places.clone().fold(f64::NEG_INFINITY, f64::max) - places.fold(f64::INFINITY, f64::min)
        };
        (0..3).map(along).fold(0.0, f64::max)
    }
}

/// The placements of the data: views by name, or layers.
pub(super) fn placements(data: &Dataset) -> Result<Vec<ChartPosition>> {
    let groups = if data.views.is_empty() { layers(data)? } else { views(data) };
    let placements: Vec<ChartPosition> = groups
        .into_iter()
        .filter_map(|(name, rows)| ChartPosition::new(name, rows, data))
        .collect();
    if placements.len() < FEWEST {
        return Err(Error::Degenerate {
            problem: format!(
                "the offsets of {} chart pose(s) cannot be determined: a change of the cameras explains any offset equally well",
                placements.len()
            ),
            hint: "show the chart at three or more positions (each beyond the second can be checked), or omit the stage sigma"
                .into(),
        });
    }
    Ok(placements)
}

fn views(data: &Dataset) -> Vec<(String, Vec<usize>)> {
    let mut groups: Vec<(String, Vec<usize>)> =
        data.views.iter().map(|name| (name.clone(), Vec::new())).collect();
    for (index, row) in data.correspondences.iter().enumerate() {
        if row.world.is_some() {
            groups[row.view].1.push(index);
        }
    }
    groups
}

/// Readings of one level differ by rounding only: less than this share of the extent.
const SAME_LEVEL: f64 = 1e-6;

/// A layer that can be told from a row of points of something else.
const POINTS_A_LAYER: usize = 4;

/// The layers along the axis that has fewest, each a chart on a stage.
fn layers(data: &Dataset) -> Result<Vec<(String, Vec<usize>)>> {
    let along = |axis: usize| {
        let mut points: Vec<(f64, usize)> = data
            .correspondences
            .iter()
            .enumerate()
            .filter_map(|(index, row)| Some((row.world?[axis], index)))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let extent = points.last().map_or(0.0, |last| last.0) - points.first().map_or(0.0, |p| p.0);
        let mut layers: Vec<(f64, Vec<usize>)> = Vec::new();
        for (value, index) in points {
            match layers.last_mut() {
                Some((level, rows)) if value - *level <= SAME_LEVEL * extent => rows.push(index),
                _ => layers.push((value, vec![index])),
            }
        }
        // Digits that tell levels apart, and no more.
        let digits = -libm::log10((SAME_LEVEL * extent).max(f64::MIN_POSITIVE)).floor();
        let round = libm::exp10(digits.clamp(0.0, 12.0));
        let name = |(level, rows): (f64, Vec<usize>)| {
            (format!("{} = {}", ["X", "Y", "Z"][axis], (level * round).round() / round), rows)
        };
        layers.into_iter().map(name).collect::<Vec<_>>()
    };
    let sheets = |layers: &Vec<(String, Vec<usize>)>| {
        layers.len() > 1 && layers.iter().all(|(_, rows)| rows.len() >= POINTS_A_LAYER)
    };
    (0..3).rev().map(along).filter(sheets).min_by_key(Vec::len).ok_or_else(|| Error::Degenerate {
        problem: "the points have no view names and form no layers, so it is unknown which of them moved together"
            .into(),
        hint: "add a column `view` that names the chart pose".into(),
    })
}

/// The placements as they may move under a prior.
pub(super) fn loose(placements: &[ChartPosition], prior: &StagePrior) -> Vec<UncertainPose> {
    let chart = |placement: &ChartPosition| {
        let own = prior.views.iter().rev().find(|(name, _)| *name == placement.name);
        let offset = own.map_or(prior.offset_sigma, |(_, sigma)| *sigma);
        // Points in one place cannot show a rotation.
        let lever = placement.half_extent;
        let held = if lever > 0.0 { offset / lever } else { 0.0 };
        let rotation = prior.rotation_sigma.unwrap_or(held);
        let sigma = [offset, offset, offset, rotation, rotation, rotation];
        UncertainPose { centre: placement.centre, sigma, motion: [0.0; 6] }
    };
    placements.iter().map(chart).collect()
}

/// The data with every chart where it stood.
pub(super) fn moved(
    data: &Dataset,
    placements: &[ChartPosition],
    charts: &[UncertainPose],
) -> Dataset {
    let mut data = data.clone();
    for (placement, chart) in placements.iter().zip(charts) {
        for row in &placement.rows {
            let world = &mut data.correspondences[*row].world;
            *world = world.map(|world| chart.place(world));
        }
    }
    data
}
