//! Cameras and points in space, as a drawing that does not move: for paper, and for browsers without
//! scripts.

use super::{
    super::plot::{Panel, WIDTH, short},
    Figure, every, round_below, thinned,
};
use crate::{PointFigures, Report, text::escape};
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

/// The world's axes at a corner of the points: where they begin, and how long they are drawn, a round
/// number of units.
pub(crate) struct Axes {
    pub(crate) from: Vector3,
    pub(crate) length: f64,
}

impl Axes {
    /// A quarter as long as the box of these places, a little beyond its corner of least X, Y and Z.
    pub(crate) fn of(places: impl Iterator<Item = Vector3>) -> Option<Self> {
        let ends = places.map(|place| (place, place));
        let (low, high) =
            ends.reduce(|(low, high), (place, _)| (low.inf(&place), high.sup(&place)))?;
        let longest = (high - low).max();
        let from = low - Vector3::repeat(0.08 * longest);
        (longest > 0.0).then(|| Self { from, length: round_below(0.25 * longest) })
    }

    fn ends(&self) -> [(&'static str, Vector3); 3] {
        let end = |axis: Vector3| self.from + axis * self.length;
        [("X", end(Vector3::x())), ("Y", end(Vector3::y())), ("Z", end(Vector3::z()))]
    }
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
    let axes = Axes::of(points.iter().map(|dot| dot.place));
    let ends: Vec<(&str, Vector3)> = axes.iter().flat_map(Axes::ends).collect();
    let [across, up] = look(report);
    let flat = |place: Vector3| [place.dot(&across), -place.dot(&up)];
    let centres = report.cameras.iter().filter_map(|camera| Some(Vector3::from(camera.centre?)));
    let all = points.iter().map(|dot| dot.place).chain(centres).chain(ends.iter().map(|end| end.1));
    let all: Vec<[f64; 2]> = all.map(flat).collect();
    let end = |axis: usize, pick: fn(f64, f64) -> f64| all.iter().map(|p| p[axis]).reduce(pick);
    let low = [end(0, f64::min)?, end(1, f64::min)?];
    let high = [end(0, f64::max)?, end(1, f64::max)?];
    if points.is_empty() {
        return None;
    }
    let margin = 26.0;
    let scale =
        (WIDTH - 2.0 * margin) / (high[0] - low[0]).max((high[1] - low[1]) / 0.9).max(1e-300);
    let place = |point: Vector3| {
        let [x, y] = flat(point);
        [margin + (x - low[0]) * scale, margin + (y - low[1]) * scale]
    };
    let size = (high[0] - low[0]).max(high[1] - low[1]) * 0.12;
    let height = 2.0 * margin + (high[1] - low[1]) * scale;
    let singles = points.iter().filter(|dot| dot.single).count();
    let drawn = points.iter().step_by(every(points.len()));
    let drawn = drawn.map(|dot| (dot, place(dot.place).map(short)));
    let body = html! {
        @for (dot, [x, y]) in drawn {
            @if dot.single { circle class="ring" cx=(x) cy=(y) r="2.6" {} }
            @else { circle class={ "f" (dot.view % 6) } cx=(x) cy=(y) r="2" {} }
        }
        @for camera in &report.cameras { (frustum(camera, size, &place)) }
        @if let Some(axes) = &axes {
            @for (name, tip) in &ends { (axis(name, place(axes.from), place(*tip))) }
            (scale_bar(&format!("{} {}", axes.length, report.unit), axes.length * scale, height))
        }
        (legend(singles, height))
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
            size: [WIDTH, (height + FOOT).max(120.0)],
            body,
        }],
    })
}

/// Room below the drawing for the scale and the legend.
const FOOT: f64 = 26.0;

/// One axis of the world, named at its end.
fn axis(name: &str, from: [f64; 2], tip: [f64; 2]) -> Markup {
    let path =
        format!("M{} {}L{} {}", short(from[0]), short(from[1]), short(tip[0]), short(tip[1]));
    let length = libm::hypot(tip[0] - from[0], tip[1] - from[1]).max(1e-9);
    let beyond = |axis: usize| tip[axis] + 9.0 * (tip[axis] - from[axis]) / length;
    html! {
        path class="line ink" d=(path) {}
        text class="name mid" x=(short(beyond(0))) y=(short(beyond(1) + 4.0)) { (name) }
    }
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

/// A bar with its length in the world, at the lower right.
fn scale_bar(words: &str, length: f64, below: f64) -> Markup {
    let (right, y) = (WIDTH - 10.0, below + 14.0);
    let left = right - length;
    let path = format!(
        "M{} {}v8M{} {}h{}M{} {}v8",
        short(left),
        short(y - 4.0),
        short(left),
        short(y),
        short(length),
        short(right),
        short(y - 4.0)
    );
    html! {
        path class="line ink" d=(path) {}
        text class="end" x=(short(left - 6.0)) y=(short(y + 4.0)) { (escape(words)) }
    }
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
