//! A sheet as an SVG drawing.

use super::{LETTERS, Sheet, written};
use crate::chart::Shape;
use std::fmt::Write;

pub(super) fn draw(sheet: &Sheet) -> String {
    let [width, height] = sheet.size.map(written);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n<g fill=\"black\" font-family=\"Helvetica,Arial,sans-serif\" font-size=\"{}\">\n",
        escaped(&sheet.title),
        LETTERS[0]
    );
    for shape in &sheet.shapes {
        // Writing to a string cannot fail.
        let _ = match shape {
            Shape::Rectangle([left, top, right, bottom]) => {
                let [width, height] = [right - left, bottom - top].map(written);
                let [left, top] = [*left, *top].map(written);
                writeln!(
                    text,
                    "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\"/>"
                )
            }
            Shape::Disc([x, y], radius) => {
                let [x, y, radius] = [*x, *y, *radius].map(written);
                writeln!(text, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\"/>")
            }
        };
    }
    for line in &sheet.texts {
        let [x, y] = line.at.map(written);
        let _ = writeln!(text, "<text x=\"{x}\" y=\"{y}\">{}</text>", escaped(&line.words));
    }
    text + "</g>\n</svg>\n"
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
