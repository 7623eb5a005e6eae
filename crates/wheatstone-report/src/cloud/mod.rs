//! A reconstructed cloud of points on a page of its own, in the 3-D view of the report.

mod columns;
mod still;
mod value;

use crate::{
    figures::Figure,
    html::filled,
    page::shell::{Frame, Shell, stage},
    plot::space::Frustum,
    text::{escape, json},
};
use columns::Columns;
use maud::{Markup, Render, html};
use serde::Serialize;
use still::Summary;
pub use value::{CloudCamera, SceneCloud};

/// All that the script reads.
#[derive(Serialize)]
struct Data<'a> {
    unit: &'a str,
    cameras: &'a [Frustum<'a>],
    /// `None` where there are no points.
    cloud: Option<Cloud>,
}

#[derive(Serialize)]
struct Cloud {
    #[serde(flatten)]
    frame: Frame,
    #[serde(flatten)]
    columns: Columns,
}

impl SceneCloud {
    /// The page: one file of HTML below 15 MB, no network. Up to 400 000 points are shown, less where
    /// three or more cameras' pixels would make it larger; of more, an even sample. Points without a
    /// finite place are left out.
    ///
    /// On the page a coordinate has an error of at most 8e-6 times its distance from the middle of the
    /// points, and a standard deviation one of at most 1/2000 of the logarithm of the ratio between
    /// the largest and the smallest.
    #[must_use]
    pub fn page(&self) -> String {
        let names = self.names();
        let cameras = self.frusta(&names);
        let shown = columns::shown(self);
        let summary = Summary::of(self, &shown, &cameras);
        let figure = still::figure((self, self.points.len()), &shown, (&summary, &cameras));
        let place = |index: &usize| self.points[*index].map(f64::from);
        let cloud = (!shown.is_empty()).then(|| Cloud {
            frame: Frame::of(
                shown.iter().map(place).filter(|place| summary.is_inside(*place)),
                (summary.centre, summary.extent),
                &cameras,
            ),
            columns: Columns::of(self, &shown, summary.centre),
        });
        let data = Data { unit: &self.unit, cameras: &cameras, cloud };
        let navigation = html! {
            nav aria-label="Parts of the page" {
                ul { li { a href="#scene" { "3-D view" } } li { a href="#figures" { "In figures" } } }
            }
        };
        let shell = Shell {
            title: &self.title,
            kind: "Wheatstone points in space",
            program: concat!("wheatstone ", env!("CARGO_PKG_VERSION")),
            first: ["scene", "To the 3-D view"],
            navigation,
            main: self.main(&summary, figure.as_ref()),
            data: json(&data),
            script: include_str!("cloud.js"),
        };
        shell.page()
    }

    /// The points as a drawing, where there are any; they are a sample of `total`.
    pub(crate) fn drawing(&self, total: usize) -> Option<Figure> {
        let names = self.names();
        let cameras = self.frusta(&names);
        let shown = columns::shown(self);
        let summary = Summary::of(self, &shown, &cameras);
        still::figure((self, total), &shown, (&summary, &cameras))
    }

    fn main(&self, summary: &Summary, figure: Option<&Figure>) -> Markup {
        let still = html! {
            @if let Some(figure) = figure {
                @for panel in &figure.panels { (panel.inline()) }
                p { strong { "How to read:" } " " (escape(&figure.how)) }
            } @else { p { "There are no points to show." } }
        };
        let unit = escape(&self.unit);
        let sentence = summary.sentence(self);
        let sample = summary.sample(self);
        let table = summary.table(self);
        let stage = stage(
            "The points in space. Arrow keys turn, with shift they move, plus and minus zoom, \
             Enter selects the point in the middle, M turns measuring on and off, Escape clears, \
             Home shows the points, R the cameras too.",
        );
        let hidden = |without: bool| if without { "hidden" } else { "" };
        let warnings = html! {
            @for warning in &self.warnings { p { strong { "Warning:" } " " (escape(warning)) "." } }
        };
        let values: [(&str, &dyn Render); 11] = [
            ("title", &escape(&self.title)),
            ("sentence", &sentence),
            ("warnings", &warnings),
            ("sample", &sample),
            ("stage", &stage),
            ("still", &still),
            ("table", &table),
            ("unit", &unit),
            ("no-colours", &hidden(self.colours.is_empty())),
            ("no-sigmas", &hidden(self.sigmas.is_empty())),
            ("no-confidence", &hidden(self.confidence.is_empty())),
        ];
        filled(include_str!("cloud.html"), &values)
    }
}
