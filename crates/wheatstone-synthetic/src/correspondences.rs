//! Bare correspondences of a rig, without pictures.

use super::{Noise, Rig};
use wheatstone_charts::chart::AnyChart;
use wheatstone_core::{
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3, Pose},
};
use wheatstone_numeric::random::Random;

/// A placement of a chart: its name and `world_from_chart`.
pub type Placement = (String, Pose);

/// The pixels of a world point, if all cameras see it.
fn seen_by_all(rig: &Rig, world: Point3) -> Option<Vec<Pixel>> {
    rig.cameras.iter().map(|camera| camera.project_visible(world)).collect()
}

fn dataset(rig: &Rig, views: Vec<String>, correspondences: Vec<Correspondence>) -> Dataset {
    Dataset { unit: "cm".into(), cameras: rig.cameras.len(), views, correspondences }
}

fn noisy(pixels: Vec<Pixel>, noise: Noise, random: &mut Random) -> Vec<Option<Pixel>> {
    pixels.into_iter().map(|pixel| Some(noise.apply(pixel, random))).collect()
}

/// The points of a chart at each placement, as far as all cameras see them; at most `most` of them,
/// left out at random.
#[must_use]
pub fn chart_correspondences(
    rig: &Rig,
    chart: &AnyChart,
    views: &[(String, Pose)],
    (noise, seed): (Noise, u64),
    most: Option<usize>,
) -> Dataset {
    let mut random = Random::new(seed);
    let points = chart.points();
    let mut rows = Vec::new();
    for (view, (_, world_from_chart)) in views.iter().enumerate() {
        for (id, point) in points.iter().enumerate() {
            let world = world_from_chart.transform(*point);
            if let Some(pixels) = seen_by_all(rig, world) {
                rows.push(Correspondence {
                    view,
                    id: Some(id.to_string()),
                    pixels: noisy(pixels, noise, &mut random),
                    world: Some(world),
                    board: None,
                });
            }
        }
    }
    if let Some(most) = most.filter(|most| *most < rows.len()) {
        let mut order: Vec<usize> = (0..rows.len()).collect();
        random.shuffle(&mut order);
        order.truncate(most);
        order.sort_unstable();
        rows = order.into_iter().map(|index| rows[index].clone()).collect();
    }
    dataset(rig, views.iter().map(|(name, _)| name.clone()).collect(), rows)
}

/// [`chart_correspondences`] of charts that stand at `actual` placements and are said to stand at
/// `nominal` ones (the same number, in the same order): the pixels are those of the actual places, the
/// world points the nominal ones.
#[must_use]
pub fn misplaced_correspondences(
    rig: &Rig,
    chart: &AnyChart,
    (actual, nominal): (&[Placement], &[Placement]),
    noise: (Noise, u64),
    most: Option<usize>,
) -> Dataset {
    let mut data = chart_correspondences(rig, chart, actual, noise, most);
    for row in &mut data.correspondences {
        if let (Some((_, said)), Some((_, stood))) = (nominal.get(row.view), actual.get(row.view)) {
            let place = |world| said.transform(stood.inverse().transform(world));
            row.world = row.world.map(place);
        }
    }
    data
}

/// Points spread evenly over the box that a chart of this size sweeps from `near` to `far`, as far
/// as all cameras see them. Fewer than `count` where the cameras see next to nothing of it.
#[must_use]
pub fn random_correspondences(
    rig: &Rig,
    chart: &AnyChart,
    (near, far): (f64, f64),
    (noise, seed): (Noise, u64),
    count: usize,
) -> Dataset {
    let mut random = Random::new(seed);
    let points = chart.points();
    let reach = |axis: usize| points.iter().map(|p| p[axis].abs()).fold(0.0, f64::max);
    let (wide, high) = (reach(0), reach(1));
    let mut rows = Vec::with_capacity(count);
    // A thousand tries a point are enough wherever the cameras see anything at all.
    for _ in 0..count.saturating_mul(1000) {
        if rows.len() == count {
            break;
        }
        let world = Point3::new(
            random.uniform(-wide, wide),
            random.uniform(-high, high),
            random.uniform(near, far),
        );
        if let Some(pixels) = seen_by_all(rig, world) {
            let pixels = noisy(pixels, noise, &mut random);
            rows.push(Correspondence {
                view: 0,
                id: None,
                pixels,
                world: Some(world),
                board: None,
            });
        }
    }
    dataset(rig, Vec::new(), rows)
}
