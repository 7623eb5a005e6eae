//! Cameras and points in space, as a drawing that does not move: for paper, and for browsers without
//! scripts.

use super::{
    super::plot::{Panel, WIDTH, short},
    Figure, every, thinned,
};
use crate::{Report, text::escape};
use maud::{Markup, html};
use std::fmt::Write;
use wheatstone_core::geometry::Vector3;

/// To the right, up and forward, as the cameras together see the world; unit vectors.
pub(crate) fn basis(report: &Report) -> [Vector3; 3] {
    let corner = |camera: &crate::CameraFigures, index: usize| {
        camera.corners.get(index).copied().map(Vector3::from)
    };
    let sum = |of: &dyn Fn(&crate::CameraFigures) -> Option<Vector3>| -> Vector3 {
        report.cameras.iter().filter_map(of).sum()
    };
    let forward = sum(&|c| Some(corner(c, 0)? + corner(c, 1)? + corner(c, 2)? + corner(c, 3)?));
    let down = sum(&|c| Some(corner(c, 3)? - corner(c, 0)? + corner(c, 2)? - corner(c, 1)?));
    let (forward, up) = if forward.norm() > 1e-9 && down.norm() > 1e-9 {
        (forward.normalize(), -down.normalize())
    } else {
        (Vector3::z(), Vector3::y())
    };
    let right = forward.cross(&up).normalize();
    [right, right.cross(&forward), forward]
}

/// The directions across and up of a look at the scene, half from the right and from above.
fn look(report: &Report) -> [Vector3; 2] {
    let [right, up, forward] = basis(report);
    // 40 degrees to the side, 25 from above.
    let side = right * 0.766 + forward * 0.643;
    let ahead = forward * 0.766 - right * 0.643;
    [side, up * 0.906 + ahead * 0.423]
}

pub(super) fn figure(report: &Report) -> Option<Figure> {
    let points: Vec<(usize, Vector3)> = report
        .points
        .iter()
        .filter_map(|point| {
            let place = point.world.or_else(|| Some(point.located.as_ref()?.point))?;
            Some((point.view, Vector3::from(place)))
        })
        .collect();
    if points.is_empty() {
        return None;
    }
    let [across, up] = look(report);
    let flat = |place: Vector3| [place.dot(&across), -place.dot(&up)];
    let centres = report.cameras.iter().filter_map(|camera| Some(Vector3::from(camera.centre?)));
    let all: Vec<[f64; 2]> =
        points.iter().map(|(_, place)| *place).chain(centres).map(flat).collect();
    let end = |axis: usize, pick: fn(f64, f64) -> f64| {
        all.iter().map(|p| p[axis]).reduce(pick).unwrap_or(0.0)
    };
    let (low, high) = ([end(0, f64::min), end(1, f64::min)], [end(0, f64::max), end(1, f64::max)]);
    let margin = 26.0;
    let scale =
        (WIDTH - 2.0 * margin) / (high[0] - low[0]).max((high[1] - low[1]) / 0.9).max(1e-300);
    let place = |point: Vector3| {
        let [x, y] = flat(point);
        [margin + (x - low[0]) * scale, margin + (y - low[1]) * scale]
    };
    let size = (high[0] - low[0]).max(high[1] - low[1]) * 0.12;
    let dots = points.iter().step_by(every(points.len()));
    let dots = dots.map(|(view, point)| (view % 6, place(*point).map(short)));
    let body = html! {
        @for (colour, [x, y]) in dots { circle class={ "f" (colour) } cx=(x) cy=(y) r="2" {} }
        @for camera in &report.cameras { (frustum(camera, size, &place)) }
    };
    let height = 2.0 * margin + (high[1] - low[1]) * scale;
    let alternative =
        format!("{} cameras and {} points in space.", report.cameras.len(), points.len());
    Some(Figure {
        name: "scene",
        title: "Cameras and points",
        how: format!(
            "Pyramids are the cameras' fields of view, dots the points; points of one view share a colour.{}",
            thinned(points.len())
        ),
        good: "Every camera sees all points, from clearly different directions.",
        panels: vec![Panel {
            alternative,
            heading: String::new(),
            size: [WIDTH, height.max(120.0)],
            body,
        }],
    })
}

/// A camera as the pyramid that it observes.
fn frustum(
    camera: &crate::CameraFigures,
    size: f64,
    place: &dyn Fn(Vector3) -> [f64; 2],
) -> Markup {
    let Some(centre) = camera.centre.map(Vector3::from) else { return Markup::default() };
    let ends: Vec<[f64; 2]> =
        camera.corners.iter().map(|corner| place(centre + Vector3::from(*corner) * size)).collect();
    let [x, y] = place(centre);
    let mut path = String::new();
    for (index, end) in ends.iter().enumerate() {
        let next = ends[(index + 1) % ends.len()];
        let _ = write!(
            path,
            "M{} {}L{} {}L{} {}",
            short(x),
            short(y),
            short(end[0]),
            short(end[1]),
            short(next[0]),
            short(next[1])
        );
    }
    // The name stays inside the drawing; a letter is about 7 wide.
    let half = 3.5 * camera.name.chars().count() as f64;
    let left = short(x.min(WIDTH - half - 2.0).max(half + 2.0));
    html! {
        path class="line ink" d=(path) {}
        text class="tick mid" x=(left) y=(short(y + 18.0)) { (escape(&camera.name)) }
    }
}
