//! What all pages with a 3-D view share: head and foot, style and scripts, and how the scripts read
//! the axes of the world.

use crate::{
    html::{STYLE, filled, policy},
    plot::{
        self,
        space::{Axes, Frustum},
    },
    text,
};
use maud::{Markup, PreEscaped};
use serde::Serialize;
use wheatstone_core::geometry::Vector3;

const TEMPLATE: &str = include_str!("page.html");

/// The scripts that all of them have; a page's own one comes after them.
const SCRIPTS: [&str; 3] =
    [include_str!("three/three.min.js"), include_str!("page.js"), include_str!("view.js")];

/// A page's own parts.
pub(crate) struct Shell<'a> {
    pub(crate) title: &'a str,
    /// What stands after the title, such as "Wheatstone report".
    pub(crate) kind: &'static str,
    /// The program that wrote it.
    pub(crate) program: &'a str,
    /// The name of the first part, and the words that lead there past the head.
    pub(crate) first: [&'static str; 2],
    pub(crate) navigation: Markup,
    pub(crate) main: Markup,
    /// What the scripts read.
    pub(crate) data: Markup,
    pub(crate) script: &'static str,
}

impl Shell<'_> {
    /// The whole page. Its policy names its one style and its one script by their digests.
    pub(crate) fn page(&self) -> String {
        let style = [plot::STYLE, STYLE].concat();
        let script = [&SCRIPTS.concat(), self.script].concat();
        let [first, skip] = self.first;
        filled(
            TEMPLATE,
            &[
                ("policy", &policy(&style, &script)),
                ("program", &text::escape(self.program)),
                ("title", &text::escape(self.title)),
                ("kind", &self.kind),
                ("first", &first),
                ("skip", &skip),
                ("navigation", &self.navigation),
                ("main", &self.main),
                ("data", &self.data),
                ("style", &PreEscaped(&style)),
                ("script", &PreEscaped(&script)),
            ],
        )
        .into_string()
    }
}

/// The stage of a 3-D view, with words for those who cannot see it, and its colour bar.
pub(crate) fn stage(label: &str) -> Markup {
    filled(include_str!("stage.html"), &[("label", &label)])
}

/// The axes of the world, drawn at a corner of the points.
#[derive(Serialize)]
pub(crate) struct WorldAxes {
    /// Where they begin, from the scene's centre.
    from: [f64; 3],
    length: f64,
}

impl WorldAxes {
    /// For these places; `None` where they have no extent.
    pub(crate) fn of(places: impl Iterator<Item = [f64; 3]>, centre: [f64; 3]) -> Option<Self> {
        let axes = Axes::of(places.map(Vector3::from))?;
        Some(Self { from: (axes.from - Vector3::from(centre)).into(), length: axes.length })
    }
}

/// The frame of a 3-D view: what places are given from, and its directions.
#[derive(Serialize)]
pub(crate) struct Frame {
    /// Taken off all places, so that 32 bits hold them.
    pub(crate) centre: [f64; 3],
    /// Half the diagonal of the points.
    pub(crate) extent: f64,
    /// Right, up and forward; unit vectors.
    pub(crate) basis: [[f64; 3]; 3],
    pub(crate) axes: Option<WorldAxes>,
}

impl Frame {
    /// For these places, seen as the cameras together see them.
    pub(crate) fn of(
        places: impl Iterator<Item = [f64; 3]>,
        (centre, extent): ([f64; 3], f64),
        cameras: &[Frustum<'_>],
    ) -> Self {
        let axes = WorldAxes::of(places, centre);
        Self { centre, extent, basis: plot::space::basis(cameras).map(Into::into), axes }
    }
}
