//! A sheet as a PDF of one page (ISO 32000-1): filled paths, and text in Helvetica, which every reader has.

use super::{LETTERS, Sheet, written};
use crate::chart::Shape;
use std::fmt::Write;

/// Points, of which an inch has 72, in a millimetre.
const POINTS: f64 = 72.0 / 25.4;

/// Arcs of a disc: eight Bezier curves are off by 4 millionths of the radius.
const ARCS: u32 = 8;

pub(super) fn draw(sheet: &Sheet) -> Vec<u8> {
    let [width, height] = sheet.size.map(|side| side * POINTS);
    let content = content(sheet);
    // Readers are asked not to fit the page to the printer's margins.
    let objects = [
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>".into(),
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>".into(),
        format!(
            "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width} {height}] /Contents 4 0 R /Resources << /Font << /F 5 0 R >> >> >>"
        ),
        format!("<< /Length {} >>\nstream\n{content}endstream", content.len()),
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>".into(),
        format!("<< /Title ({}) >>", escaped(&sheet.title)),
    ];
    let mut file = String::from("%PDF-1.6\n");
    let mut offsets = Vec::new();
    for (index, object) in objects.iter().enumerate() {
        offsets.push(file.len());
        file += &format!("{} 0 obj\n{object}\nendobj\n", index + 1);
    }
    let table = file.len();
    let count = objects.len() + 1;
    file += &format!("xref\n0 {count}\n0000000000 65535 f \n");
    for offset in offsets {
        file += &format!("{offset:010} 00000 n \n");
    }
    file += &format!(
        "trailer\n<< /Size {count} /Root 1 0 R /Info 6 0 R >>\nstartxref\n{table}\n%%EOF\n"
    );
    file.into_bytes()
}

/// What is drawn, in millimetres from the top-left corner, y down.
fn content(sheet: &Sheet) -> String {
    let mut text = format!("{POINTS} 0 0 -{POINTS} 0 {} cm\n", sheet.size[1] * POINTS);
    for shape in &sheet.shapes {
        // Writing to a string cannot fail.
        let _ = match shape {
            Shape::Rectangle([left, top, right, bottom]) => {
                let edges = [*left, *top, right - left, bottom - top].map(written);
                let [left, top, width, height] = edges;
                writeln!(text, "{left} {top} {width} {height} re")
            }
            Shape::Disc(centre, radius) => {
                text += &disc(*centre, *radius);
                Ok(())
            }
        };
    }
    text += "f\n";
    for line in &sheet.texts {
        let ([x, y], words) = (line.at.map(written), escaped(&line.words));
        let size = LETTERS[0];
        let _ = writeln!(text, "BT /F {size} Tf 1 0 0 -1 {x} {y} Tm ({words}) Tj ET");
    }
    text
}

fn disc([x, y]: [f64; 2], radius: f64) -> String {
    let step = std::f64::consts::TAU / f64::from(ARCS);
    let handle = radius * 4.0 / 3.0 * libm::tan(step / 4.0);
    let mut text = format!("{} {} m\n", written(x + radius), written(y));
    for arc in 0..ARCS {
        let [(sine, cosine), (next_sine, next_cosine)] =
            [arc, arc + 1].map(|arc| libm::sincos(f64::from(arc) * step));
        let end = [x + radius * next_cosine, y + radius * next_sine];
        let curve = [
            x + radius * cosine - handle * sine,
            y + radius * sine + handle * cosine,
            end[0] + handle * next_sine,
            end[1] - handle * next_cosine,
            end[0],
            end[1],
        ];
        for length in curve.map(written) {
            let _ = write!(text, "{length} ");
        }
        text += "c\n";
    }
    text + "h\n"
}

/// A string between parentheses; what is not ASCII has no code that all encodings share.
fn escaped(text: &str) -> String {
    let plain = text.chars().map(|c| if c.is_ascii() && !c.is_ascii_control() { c } else { '?' });
    plain.collect::<String>().replace('\\', "\\\\").replace('(', "\\(").replace(')', "\\)")
}
