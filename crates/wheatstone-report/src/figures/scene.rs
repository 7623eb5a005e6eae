//! Cameras and points in space, as a drawing that does not move: for paper, and for browsers without
//! scripts.

use super::{
    super::plot::{
        Panel, WIDTH, short,
        space::{FOOT, Frustum, Sketch},
    },
    Figure, every, thinned,
};
use crate::{PointFigures, Report};
use maud::{Markup, html};
use wheatstone_core::geometry::Vector3;

/// The cameras as they are drawn.
pub(crate) fn frusta(report: &Report) -> Vec<Frustum<'_>> {
    let cameras = report.cameras.iter().map(|camera| Frustum {
        name: &camera.name,
        centre: camera.centre,
        corners: &camera.corners,
    });
    cameras.collect()
}

/// A point that is drawn.
struct Dot {
    view: usize,
    place: Vector3,
    /// Whether one camera alone observes it.
    single: bool,
}

fn dots(report: &Report) -> Vec<Dot> {
    let dot = |point: &PointFigures| {
        let place = point.world.or_else(|| Some(point.located.as_ref()?.point))?;
        let single = report.cameras.len() > 1 && point.seen_by() == 1;
        Some(Dot { view: point.view, place: Vector3::from(place), single })
    };
    report.points.iter().filter_map(dot).collect()
}

pub(super) fn figure(report: &Report) -> Option<Figure> {
    let points = dots(report);
    let frusta = frusta(report);
    let sketch = Sketch::of(&frusta, points.iter().map(|dot| dot.place))?;
    let singles = points.iter().filter(|dot| dot.single).count();
    let drawn = points.iter().step_by(every(points.len()));
    let drawn = drawn.map(|dot| (dot, sketch.place(dot.place).map(short)));
    let body = html! {
        @for (dot, [x, y]) in drawn {
            @if dot.single { circle class="ring" cx=(x) cy=(y) r="2.6" {} }
            @else { circle class={ "f" (dot.view % 6) } cx=(x) cy=(y) r="2" {} }
        }
        (sketch.surroundings(&report.unit))
        (legend(singles, sketch.height))
    };
    let alternative = format!(
        "{} cameras and {} points in space, with the axes X, Y and Z of the world.",
        report.cameras.len(),
        points.len()
    );
    Some(Figure {
        name: "scene",
        title: "Cameras and points",
        how: format!(
            "Pyramids are the cameras' fields of view, dots the points; points of one view share a colour, and rings are points that one camera alone observes. X, Y and Z are the axes of the world, each as long as the bar.{}",
            thinned(points.len())
        ),
        good: "Every camera sees all points, from clearly different directions.",
        panels: vec![Panel {
            alternative,
            heading: String::new(),
            size: [WIDTH, (sketch.height + FOOT).max(120.0)],
            body,
        }],
    })
}

/// What rings are, at the lower left; nothing where there are none.
fn legend(singles: usize, below: f64) -> Markup {
    html! {
        @if singles > 0 {
            circle class="ring" cx="12" cy=(short(below + 14.0)) r="3.4" {}
            text x="21" y=(short(below + 18.0)) { "seen by one camera alone: " (singles) }
        }
    }
}
