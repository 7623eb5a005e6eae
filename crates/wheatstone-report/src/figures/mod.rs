//! The figures, one file each: a function that draws it where the report has what it needs.

mod beyond;
mod budget;
mod coverage;
mod depth;
mod distribution;
mod error_bars;
mod error_map;
mod learning;
mod methods;
mod misses;
mod reconstruction;
pub(super) mod scene;
mod setup;
mod views;
mod volume;

use super::Report;
pub use super::plot::Panel;

/// One figure of the page.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Its name in addresses and of its file.
    pub name: &'static str,
    /// Its title.
    pub title: &'static str,
    /// How to read it, in one sentence.
    pub how: String,
    /// How it looks where all is well, in one sentence.
    pub good: &'static str,
    /// The drawings.
    pub panels: Vec<Panel>,
}

/// Draws a figure where the report has what it needs.
type Draw = fn(&Report) -> Option<Figure>;

/// All figures in the page's order, each beside the name of the part of the page that it is in.
const ROWS: &[(&str, Draw)] = &[
    ("scene", scene::figure),
    ("setup", setup::robot),
    ("setup", setup::network),
    ("setup", setup::sigmoid),
    ("setup", setup::chart),
    ("accuracy", depth::figure),
    ("accuracy", views::figure),
    ("accuracy", distribution::figure),
    ("accuracy", error_bars::figure),
    ("accuracy", budget::figure),
    ("pictures", error_map::figure),
    ("pictures", misses::figure),
    ("coverage", coverage::figure),
    ("coverage", volume::figure),
    ("reconstruction", reconstruction::figure),
    ("methods", methods::figure),
    ("methods", learning::figure),
    ("methods", beyond::figure),
];

/// Every figure that the report has what it needs for.
#[must_use]
pub fn all(report: &Report) -> Vec<Figure> {
    ROWS.iter().filter_map(|(_, figure)| figure(report)).collect()
}

/// The figures of one part of the page.
pub(super) fn of_part(report: &Report, part: &str) -> Vec<Figure> {
    let rows = ROWS.iter().filter(|(name, _)| *name == part);
    rows.filter_map(|(_, figure)| figure(report)).collect()
}

/// Marks in one drawing: more take seconds to draw and hide each other.
const MOST_MARKS: usize = 1500;

/// Every so many of `count` things are drawn, so that no drawing has too many marks.
fn every(count: usize) -> usize {
    count.div_ceil(MOST_MARKS).max(1)
}

/// What is added to "how to read" where not everything is drawn.
fn thinned(count: usize) -> String {
    match every(count) {
        1 => String::new(),
        every => format!(" Of {count} points, one in {every} is drawn."),
    }
}
