//! Charts as drawings to print, to true scale.

use super::{Chart, Shape};
use std::fmt::Write;
use wheatstone_core::{Error, Result};

/// The units that a drawing can have.
pub const UNITS: [&str; 4] = ["mm", "cm", "m", "in"];

/// Length of the ruler below the chart, in millimetres.
const RULER: f64 = 100.0;

/// Millimetres in one of [`UNITS`]; `None` for any other.
#[must_use]
pub fn millimetres_per(unit: &str) -> Option<f64> {
    match unit {
        "mm" => Some(1.0),
        "cm" => Some(10.0),
        "m" => Some(1000.0),
        "in" => Some(25.4),
        _ => None,
    }
}

/// An SVG of the chart whose lengths are in `unit`, with a ruler to check the print by.
///
/// # Errors
///
/// [`Error::UnknownName`] for a unit that is not in [`UNITS`].
pub fn draw(chart: &dyn Chart, unit: &str, title: &str) -> Result<String> {
    let scale = millimetres_per(unit).ok_or_else(|| Error::UnknownName {
        kind: "unit",
        name: unit.into(),
        known: UNITS.map(String::from).to_vec(),
    })?;
    let [left, top, right, bottom] = chart.board().map(|edge| edge * scale);
    // Room for the ruler below the board.
    let (width, height) = ((right - left).max(RULER + 10.0), bottom - top + 12.0);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" viewBox=\"{left} {top} {width} {height}\">\n<title>{}</title>\n<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n<g fill=\"black\">\n",
        escaped(title)
    );
    for shape in chart.shapes() {
        // Writing to a string cannot fail.
        let _ = match shape {
            Shape::Rectangle(edges) => {
                let [x, y, right, bottom] = edges.map(|edge| edge * scale);
                let (width, height) = (right - x, bottom - y);
                writeln!(text, "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/>")
            }
            Shape::Disc(centre, radius) => {
                let [x, y] = centre.map(|at| at * scale);
                writeln!(text, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{}\"/>", radius * scale)
            }
        };
    }
    let (x, y) = (left + 5.0, bottom + 4.0);
    let _ = write!(
        text,
        "</g>\n<path d=\"M{x} {}v3h{RULER}v-3\" fill=\"none\" stroke=\"black\" stroke-width=\"0.2\"/>\n<text x=\"{}\" y=\"{}\" font-family=\"sans-serif\" font-size=\"3\" text-anchor=\"middle\">{RULER} mm: if this is not its length, the print is not to scale</text>\n</svg>\n",
        y - 3.0,
        x + RULER / 2.0,
        y + 4.0
    );
    Ok(text)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
