//! Correspondences as the text of a points file, and as columns of one.

use super::{Column, Columns};
use wheatstone_core::dataset::{Correspondence, Dataset};

/// Correspondences by column, with the names that a points file gives them.
#[must_use]
pub fn columns(data: &Dataset) -> Columns {
    let rows = &data.correspondences;
    let mut columns = Vec::new();
    let mut numbers = |name: String, of: &dyn Fn(&Correspondence) -> Option<f64>| {
        columns.push((name, Column::Numbers(rows.iter().map(of).collect())));
    };
    for camera in 0..data.cameras {
        for (axis, letter) in ["x", "y"].into_iter().enumerate() {
            numbers(format!("{letter}{}", camera + 1), &|row| {
                (*row.pixels.get(camera)?).map(|pixel| pixel[axis])
            });
        }
    }
    if rows.iter().any(|row| row.world.is_some()) {
        for (axis, name) in ["X", "Y", "Z"].into_iter().enumerate() {
            numbers(name.into(), &|row| row.world.map(|world| world[axis]));
        }
    }
    if rows.iter().any(|row| row.board.is_some()) {
        for (axis, name) in ["board_x", "board_y"].into_iter().enumerate() {
            numbers(name.into(), &|row| row.board.map(|board| board[axis]));
        }
    }
    if !data.views.is_empty() {
        let view = |row: &Correspondence| data.views.get(row.view).cloned();
        columns.push(("view".into(), Column::Texts(rows.iter().map(view).collect())));
    }
    if rows.iter().any(|row| row.id.is_some()) {
        let ids = rows.iter().map(|row| row.id.clone()).collect();
        columns.push(("id".into(), Column::Texts(ids)));
    }
    Columns { columns }
}

/// The text of a points file with these correspondences.
#[must_use]
pub fn write(data: &Dataset) -> String {
    let mut columns: Vec<String> =
        (1..=data.cameras).flat_map(|c| [format!("x{c}"), format!("y{c}")]).collect();
    let on_board = data.correspondences.iter().any(|c| c.board.is_some());
    let in_world = data.correspondences.iter().any(|c| c.world.is_some());
    if in_world {
        columns.extend(["X", "Y", "Z"].map(String::from));
    }
    if on_board {
        columns.extend(["board_x", "board_y"].map(String::from));
    }
    if !data.views.is_empty() {
        columns.push("view".into());
    }
    let named = data.correspondences.iter().any(|c| c.id.is_some());
    if named {
        columns.push("id".into());
    }
    let mut text = columns.join(",") + "\n";
    let cells = |values: Option<Vec<f64>>, count: usize| match values {
        Some(values) => values.iter().map(f64::to_string).collect(),
        None => vec![String::new(); count],
    };
    for row in &data.correspondences {
        let mut all: Vec<String> = Vec::with_capacity(columns.len());
        for pixel in &row.pixels {
            all.extend(cells(pixel.map(|p| vec![p.x, p.y]), 2));
        }
        if in_world {
            all.extend(cells(row.world.map(|w| vec![w.x, w.y, w.z]), 3));
        }
        if on_board {
            all.extend(cells(row.board.map(|b| b.to_vec()), 2));
        }
        if !data.views.is_empty() {
            all.push(data.views.get(row.view).map_or_else(String::new, |name| quoted(name)));
        }
        if named {
            all.push(quoted(row.id.as_deref().unwrap_or_default()));
        }
        text += &all.join(",");
        text.push('\n');
    }
    text
}

/// A name as a CSV cell.
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.into()
    }
}
