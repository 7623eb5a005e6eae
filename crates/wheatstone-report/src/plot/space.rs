//! Cameras and places in space, drawn from half the right and above: what figures of several kinds
//! share, and the directions and axes that 3-D views share with them.

use super::{WIDTH, scale::round_below, short};
use crate::text::escape;
use maud::{Markup, html};
use serde::Serialize;
use std::fmt::Write;
use wheatstone_core::geometry::{Pixel, Vector3};

/// A camera as its field of view.
#[derive(Clone, Copy, Serialize)]
pub(crate) struct Frustum<'a> {
    pub(crate) name: &'a str,
    /// Its centre in the world, where it is known.
    pub(crate) centre: Option<[f64; 3]>,
    /// Unit vectors to the corners of its picture: top left, top right, bottom right, bottom left.
    pub(crate) corners: &'a [[f64; 3]],
}

/// The cosine and the sine of the angle from the middle of a picture beyond which fields of view are not drawn, 65
/// degrees: at right angles a pyramid is flat, and beyond it looks back.
const WIDEST: [f64; 2] = [0.422_618, 0.906_308];

/// Unit vectors in which the corners of a picture look, clockwise from the top left one, each at most as far from the middle as fields of
/// view are drawn. `area` is its left, top, right and bottom; `None` where a pixel looks nowhere.
pub(crate) fn corners(
    [left, top, right, bottom]: [f64; 4],
    look: impl Fn(Pixel) -> Option<Vector3>,
) -> Option<[Vector3; 4]> {
    let unit = |x: f64, y: f64| look(Pixel::new(x, y))?.try_normalize(0.0);
    let middle = unit((left + right) / 2.0, (top + bottom) / 2.0)?;
    let corner = |x: f64, y: f64| {
        let direction = unit(x, y)?;
        let along = direction.dot(&middle);
        if along >= WIDEST[0] {
            return Some(direction);
        }
        let across = (direction - middle * along).try_normalize(0.0)?;
        Some(middle * WIDEST[0] + across * WIDEST[1])
    };
    Some([corner(left, top)?, corner(right, top)?, corner(right, bottom)?, corner(left, bottom)?])
}

/// To the right, up and forward, as the cameras together see the world; unit vectors.
pub(crate) fn basis(cameras: &[Frustum<'_>]) -> [Vector3; 3] {
    let corner =
        |camera: &Frustum<'_>, index: usize| camera.corners.get(index).copied().map(Vector3::from);
    let sum = |of: &dyn Fn(&Frustum<'_>) -> Option<Vector3>| -> Vector3 {
        cameras.iter().filter_map(of).sum()
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

/// Room about what is drawn.
const MARGIN: f64 = 26.0;

/// Room below the drawing for the scale and what signs mean.
pub(crate) const FOOT: f64 = 26.0;

/// A look at places and cameras, as large as fits.
pub(crate) struct Sketch<'a> {
    cameras: &'a [Frustum<'a>],
    axes: Option<Axes>,
    /// Unit vectors across, up and away from the eye.
    directions: [Vector3; 3],
    low: [f64; 2],
    /// Length of a unit in the drawing.
    scale: f64,
    /// Length at which pyramids are cut, in the world.
    reach: f64,
    /// Height of the drawing, without what stands below it.
    pub(crate) height: f64,
}

impl<'a> Sketch<'a> {
    /// `None` where there are no places.
    pub(crate) fn of(
        cameras: &'a [Frustum<'a>],
        places: impl Iterator<Item = Vector3> + Clone,
    ) -> Option<Self> {
        places.clone().next()?;
        let [right, up, forward] = basis(cameras);
        // 40 degrees to the side, 25 from above.
        let across = right * 0.766 + forward * 0.643;
        let ahead = forward * 0.766 - right * 0.643;
        let directions = [across, up * 0.906 + ahead * 0.423, ahead * 0.906 - up * 0.423];
        let axes = Axes::of(places.clone());
        let ends = axes.iter().flat_map(Axes::ends).map(|(_, end)| end);
        let centres = cameras.iter().filter_map(|camera| Some(Vector3::from(camera.centre?)));
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for place in places.chain(centres).chain(ends) {
            for (axis, value) in flat(&directions, place).into_iter().enumerate() {
                (low[axis], high[axis]) = (low[axis].min(value), high[axis].max(value));
            }
        }
        let [wide, high] = [high[0] - low[0], high[1] - low[1]];
        let scale = (WIDTH - 2.0 * MARGIN) / wide.max(high / 0.9).max(1e-300);
        let reach = wide.max(high) * 0.12;
        let height = 2.0 * MARGIN + high * scale;
        Some(Self { cameras, axes, directions, low, scale, reach, height })
    }

    /// Where a place of the world lies in the drawing.
    pub(crate) fn place(&self, point: Vector3) -> [f64; 2] {
        let [x, y] = flat(&self.directions, point);
        [MARGIN + (x - self.low[0]) * self.scale, MARGIN + (y - self.low[1]) * self.scale]
    }

    /// How far a place of the world lies from the eye, up to what all have in common.
    pub(crate) fn away(&self, point: Vector3) -> f64 {
        point.dot(&self.directions[2])
    }

    /// The cameras, the axes of the world, and a bar as long as each of them.
    pub(crate) fn surroundings(&self, unit: &str) -> Markup {
        html! {
            @for camera in self.cameras { (self.frustum(camera)) }
            @if let Some(axes) = &self.axes {
                @for (name, tip) in axes.ends() { (axis(name, self.place(axes.from), self.place(tip))) }
                (scale_bar(&format!("{} {unit}", axes.length), axes.length * self.scale, self.height))
            }
        }
    }

    /// A camera as the pyramid that it observes.
    fn frustum(&self, camera: &Frustum<'_>) -> Markup {
        let Some(centre) = camera.centre.map(Vector3::from) else { return Markup::default() };
        let end = |corner: &[f64; 3]| self.place(centre + Vector3::from(*corner) * self.reach);
        let ends: Vec<[f64; 2]> = camera.corners.iter().map(end).collect();
        let [x, y] = self.place(centre);
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
            text class="tick mid" x=(left) y=(short(y + 18.0)) { (escape(camera.name)) }
        }
    }
}

fn flat([across, up, _]: &[Vector3; 3], place: Vector3) -> [f64; 2] {
    [place.dot(across), -place.dot(up)]
}

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
