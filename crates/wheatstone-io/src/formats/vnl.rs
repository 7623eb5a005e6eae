//! Corners of a chart as mrcal's tools list them: `# filename x y level`, a row a corner, the corners of a
//! picture row by row of the board, `-` where one was not found.
//!
//! Source: mrcal's documentation, "How to run a calibration", and mrgingham. Pictures belong to the same camera
//! where their names differ in the last number alone, which is the view. How wide the board is and how far its
//! corners are apart must be given.

use super::{Content, Format, Given, InputFile, Layout, text::finite};
use std::collections::BTreeMap;
use wheatstone_core::{
    Result,
    dataset::{Correspondence, Dataset},
    error::{Hint, Remedy},
    geometry::Pixel,
};

pub(super) const FORMAT: Format = Format {
    name: "vnl",
    about: "corners.vnl of mrcal and mrgingham; needs --board",
    layout: Layout::File("vnl"),
    content: Content::Points { read: Some(read), write: None, known_only: false },
};

/// A picture's name without its last number, and that number.
fn split(name: &str) -> (String, String) {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let Some(end) = stem.rfind(|c: char| c.is_ascii_digit()) else {
        return (stem.into(), String::new());
    };
    let start = stem[..end].rfind(|c: char| !c.is_ascii_digit());
    let start = start.map_or(0, |at| at + stem[at..].chars().next().map_or(1, char::len_utf8));
    let camera = format!("{}{}", &stem[..start], &stem[end + 1..]);
    (camera, stem[start..=end].into())
}

/// Columns named by the legend, by what they hold.
fn legend(text: &str) -> Option<[usize; 3]> {
    let line = text.lines().find(|line| line.starts_with('#') && !line.starts_with("##"))?;
    let names: Vec<&str> = line.trim_start_matches('#').split_whitespace().collect();
    let at = |name: &str| names.iter().position(|other| *other == name);
    Some([at("filename")?, at("x")?, at("y")?])
}

/// A picture's corners in their order.
type Pictures = BTreeMap<(String, String), Vec<Option<Pixel>>>;

fn pictures(file: &InputFile) -> Result<Pictures> {
    let text = file.text()?;
    let [name, x, y] = legend(text).ok_or_else(|| {
        file.error(
            1,
            "the legend `# filename x y level` is missing".into(),
            "is this a corners.vnl?",
        )
    })?;
    let mut found = Pictures::new();
    for (line, content) in (1_u64..).zip(text.lines()) {
        let content = content.split('#').next().unwrap_or("");
        let cells: Vec<&str> = content.split_whitespace().collect();
        if cells.is_empty() {
            continue;
        }
        let (Some(name), Some(x), Some(y)) = (cells.get(name), cells.get(x), cells.get(y)) else {
            return Err(file.error(
                line,
                "cells are missing".into(),
                "write - for corners that were not found",
            ));
        };
        let corners = found.entry(split(name)).or_default();
        corners.push(match (*x, *y) {
            ("-", _) | (_, "-") => None,
            (x, y) => Some(Pixel::new(finite(x, file, line)?, finite(y, file, line)?)),
        });
    }
    Ok(found)
}

fn read(files: &[InputFile], given: &Given) -> Result<Dataset> {
    let file = &files[0];
    let pictures = pictures(file)?;
    let Some((columns, pitch)) = given.board else {
        let hint = Hint::new("give its number of columns and its pitch", Remedy::Board);
        return Err(file.error(0, "it does not describe the board".into(), hint));
    };
    let mut cameras: Vec<&str> = pictures.keys().map(|(camera, _)| camera.as_str()).collect();
    cameras.dedup();
    if cameras.len() > 64 {
        let hint = "the picture names of one camera may differ in the last number only";
        return Err(file.error(
            0,
            format!("{} cameras according to the picture names", cameras.len()),
            hint,
        ));
    }
    let mut rows: BTreeMap<(&str, usize), Vec<Option<Pixel>>> = BTreeMap::new();
    for ((camera, view), corners) in &pictures {
        let index = cameras.binary_search(&camera.as_str()).unwrap_or(0);
        // A picture without the board is one line of dashes.
        for (point, corner) in corners.iter().enumerate().filter(|(_, corner)| corner.is_some()) {
            rows.entry((view, point)).or_insert_with(|| vec![None; cameras.len()])[index] = *corner;
        }
    }
    let mut views: Vec<String> = Vec::new();
    let mut correspondences = Vec::with_capacity(rows.len());
    for ((view, point), pixels) in rows {
        if views.last().is_none_or(|last| last != view) {
            views.push(view.into());
        }
        let place = [(point % columns) as f64 * pitch, (point / columns) as f64 * pitch];
        correspondences.push(Correspondence {
            view: views.len() - 1,
            id: Some(point.to_string()),
            pixels,
            world: None,
            board: Some(place),
        });
    }
    Ok(Dataset { unit: given.unit().into(), cameras: cameras.len(), views, correspondences })
}
