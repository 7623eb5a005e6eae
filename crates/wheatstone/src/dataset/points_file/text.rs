//! Correspondences as the text of a points file.

use crate::dataset::Dataset;

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
