//! The points in figures, and as a drawing that does not move: for paper, and for browsers without
//! scripts or WebGL.

use super::value::{MOST_DOTS, SceneCloud, scattered};
use crate::{
    figures::{Figure, Panel},
    page::table::table,
    plot::{
        WIDTH,
        colour::cividis,
        short,
        space::{FOOT, Frustum, Sketch, basis},
    },
    text::{escape, figure as digits},
};
use maud::{Markup, html};
use wheatstone_core::geometry::Vector3;
use wheatstone_numeric::statistics::{median, percentile};

/// What the points that are shown come to.
pub(super) struct Summary {
    /// Points that are shown.
    count: usize,
    /// The middle of the points, but for the last 1 % on either side of each axis.
    pub(super) centre: [f64; 3],
    /// Half the diagonal of their box.
    pub(super) extent: f64,
    /// Least and largest X, Y and Z.
    bounds: [[f64; 2]; 3],
    /// Medians of the standard deviations of X, Y and Z.
    sigmas: Option<[f64; 3]>,
    /// Median of the standard deviations of the places: the root of the sum of their squares.
    spread: Option<f64>,
    confidence: Option<f64>,
    /// The least and the largest depth, without 1 % at either end.
    depths: [f64; 2],
    forward: Vector3,
}

/// What is finite among these numbers.
fn finite(values: impl Iterator<Item = f32>) -> Vec<f64> {
    values.filter(|value| value.is_finite()).map(f64::from).collect()
}

fn middle(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| median(values))
}

/// All but 1 % at either end.
fn most(values: &[f64]) -> [f64; 2] {
    if values.is_empty() { [0.0; 2] } else { [0.01, 0.99].map(|share| percentile(values, share)) }
}

impl Summary {
    pub(super) fn of(cloud: &SceneCloud, shown: &[usize], cameras: &[Frustum<'_>]) -> Self {
        let axis = |axis: usize| -> Vec<f64> {
            shown.iter().map(|index| f64::from(cloud.points[*index][axis])).collect()
        };
        let axes = [0, 1, 2].map(axis);
        let boxed = [0, 1, 2].map(|axis| most(&axes[axis]));
        let ends = |values: &Vec<f64>| {
            let ends = values.iter().map(|value| [*value, *value]);
            ends.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or([0.0; 2])
        };
        let extent =
            boxed.iter().map(|[low, high]| ((high - low) / 2.0).powi(2)).sum::<f64>().sqrt();
        let sigma = |axis: usize| {
            let known = shown.iter().filter_map(|index| cloud.sigmas.get(*index));
            middle(&finite(known.map(|sigma| sigma[axis])))
        };
        let forward = basis(cameras)[2];
        let from = eye(cameras);
        let depth = |index: &usize| {
            let place = Vector3::from(cloud.points[*index].map(f64::from));
            (place - from).dot(&forward)
        };
        let depths: Vec<f64> = shown.iter().map(depth).collect();
        let known = shown.iter().filter_map(|index| cloud.sigmas.get(*index));
        let spread = known.map(|sigma| Vector3::from(sigma.map(f64::from)).norm() as f32);
        let confidence = shown.iter().filter_map(|index| cloud.confidence.get(*index).copied());
        Self {
            count: shown.len(),
            centre: boxed.map(|[low, high]| (low + high) / 2.0),
            // Of one point alone the surroundings are shown.
            extent: if extent > 0.0 { extent } else { 1.0 },
            bounds: [0, 1, 2].map(|axis| ends(&axes[axis])),
            sigmas: sigma(0).zip(sigma(1)).zip(sigma(2)).map(|((x, y), z)| [x, y, z]),
            spread: middle(&finite(spread)),
            confidence: middle(&finite(confidence)),
            depths: most(&depths),
            forward,
        }
    }

    /// Whether a place is among those that views begin with: a few points that lie far away would make
    /// all others small.
    pub(super) fn is_inside(&self, place: [f64; 3]) -> bool {
        (Vector3::from(place) - Vector3::from(self.centre)).norm() <= 1.001 * self.extent
    }

    /// What it comes to, in a sentence.
    pub(super) fn sentence(&self, cloud: &SceneCloud) -> Markup {
        let unit = escape(&cloud.unit);
        let [near, far] = self.depths.map(digits);
        html! {
            (cloud.points.len()) " points"
            @if self.count > 0 { " at depths of " (near) " to " (far) " " (unit) }
            @if let Some(spread) = self.spread {
                "; median standard deviation " (digits(spread)) " " (unit)
            }
        }
    }

    /// What is not shown, if anything.
    pub(super) fn sample(&self, cloud: &SceneCloud) -> Markup {
        html! {
            @if self.count < cloud.points.len() {
                p.note { (self.count) " of " (cloud.points.len()) " points shown" }
            }
        }
    }

    /// Bounds and medians.
    pub(super) fn table(&self, cloud: &SceneCloud) -> Markup {
        let row = |name: &str, values: [f64; 3]| {
            let values = values.map(digits);
            [name].into_iter().chain(values.iter().map(String::as_str)).map(escape).collect()
        };
        let mut rows: Vec<Vec<Markup>> = Vec::new();
        if self.count > 0 {
            rows.push(row("smallest", self.bounds.map(|bound| bound[0])));
            rows.push(row("largest", self.bounds.map(|bound| bound[1])));
        }
        rows.extend(self.sigmas.map(|it| row("median standard deviation", it)));
        let heads = ["X", "Y", "Z"].map(|axis| format!("{axis}, {}", cloud.unit));
        let heads = ["of the points shown", &heads[0], &heads[1], &heads[2]];
        html! {
            @if let Some(confidence) = self.confidence {
                p { "The median confidence of the matches is " (digits(confidence)) "." }
            }
            (table("Coordinates", &heads, &rows))
        }
    }
}

/// Where depths are counted from: the middle of the cameras' centres, or the origin of the world.
fn eye(cameras: &[Frustum<'_>]) -> Vector3 {
    let centres = cameras.iter().filter_map(|camera| camera.centre.map(Vector3::from));
    let centres: Vec<Vector3> = centres.collect();
    centres.iter().sum::<Vector3>() / centres.len().max(1) as f64
}

/// The drawing; `None` where there are no points. The cloud may be a sample of `total` points.
pub(super) fn figure(
    (cloud, total): (&SceneCloud, usize),
    shown: &[usize],
    (summary, cameras): (&Summary, &[Frustum<'_>]),
) -> Option<Figure> {
    let place = |index: usize| cloud.points[index].map(f64::from);
    let near = shown.iter().copied().filter(|index| summary.is_inside(place(*index)));
    let near: Vec<usize> = near.collect();
    let mut drawn = scattered(&near, MOST_DOTS);
    let at = |index: usize| Vector3::from(place(index));
    let sketch = Sketch::of(cameras, drawn.iter().map(|index| at(*index)))?;
    // What is near hides what is behind it.
    drawn.sort_by(|a, b| sketch.away(at(*b)).total_cmp(&sketch.away(at(*a))).then(a.cmp(b)));
    let from = eye(cameras);
    let [least, largest] = summary.depths;
    let fill = |index: usize| match cloud.colours.get(index) {
        Some([red, green, blue]) => format!("#{red:02x}{green:02x}{blue:02x}"),
        None => {
            let depth = (at(index) - from).dot(&summary.forward);
            cividis((depth - least) / (largest - least).max(1e-300))
        }
    };
    let body = html! {
        @for index in &drawn {
            @let [x, y] = sketch.place(at(*index)).map(short);
            circle cx=(x) cy=(y) r="1.6" fill=(fill(*index)) {}
        }
        (sketch.surroundings(&cloud.unit))
    };
    let colour = if cloud.colours.is_empty() {
        "their depth: the farther, the lighter"
    } else {
        "the picture"
    };
    let pyramids = if cameras.iter().any(|camera| !camera.corners.is_empty()) {
        " Pyramids are the cameras' fields of view."
    } else {
        ""
    };
    Some(Figure {
        name: "cloud",
        title: "Points in space",
        how: format!(
            "Dots are {} of the {} points, in the colour of {colour}.{pyramids} X, Y and Z are the axes of the world, each as long as the bar.",
            drawn.len(),
            total
        ),
        good: "The points lie on the surfaces that the pictures show.",
        panels: vec![Panel {
            alternative: format!(
                "{} points in space, with the axes X, Y and Z of the world.",
                drawn.len()
            ),
            heading: String::new(),
            size: [WIDTH, (sketch.height + FOOT).max(120.0)],
            body,
        }],
    })
}
