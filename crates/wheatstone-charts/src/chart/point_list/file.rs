//! Tables of a body's points, and of where some of them are seen.

use crate::chart::PointId;
use std::path::Path;
use wheatstone_core::{Error, Result, geometry::Pixel, limits, storage};

/// A body's points.
pub(super) struct Listed {
    pub(super) points: Vec<[f64; 3]>,
    /// As many as points, or none.
    pub(super) names: Vec<String>,
}

/// A point that someone has seen in a camera's picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Named {
    pub(super) camera: usize,
    pub(super) view: Option<String>,
    pub(super) id: PointId,
    pub(super) pixel: Pixel,
}

/// A table's header and rows, trimmed; each with its line.
struct Table {
    header: Vec<String>,
    rows: Vec<(u64, Vec<String>)>,
}

fn malformed(path: &Path, line: Option<u64>, problem: String, hint: &str) -> Error {
    Error::Malformed { path: path.into(), line, problem, hint: hint.into() }
}

fn table(path: &Path) -> Result<Table> {
    let text = storage::read_text(path, limits::SETTINGS_BYTES)?;
    let text = text.trim_start_matches('\u{feff}');
    let first = text.lines().next().unwrap_or_default();
    let delimiter = [b';', b'\t', b',']
        .into_iter()
        .max_by_key(|d| first.bytes().filter(|byte| byte == d).count())
        .unwrap_or(b',');
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let problem = |e: csv::Error| malformed(path, None, e.to_string(), "give one row per point");
    let header = reader.headers().map_err(problem)?.iter().map(String::from).collect();
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(problem)?;
        let line = record.position().map_or(0, csv::Position::line);
        rows.push((line, record.iter().map(String::from).collect()));
    }
    Ok(Table { header, rows })
}

impl Table {
    fn column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|cell| cell.eq_ignore_ascii_case(name))
    }
}

fn number(path: &Path, line: u64, cell: &str) -> Result<f64> {
    cell.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| {
        malformed(
            path,
            Some(line),
            format!("`{cell}` is not a number"),
            "write numbers with a decimal point",
        )
    })
}

/// Reads `X,Y,Z` and, where there is one, `id`.
pub(super) fn read_points(path: &Path) -> Result<Listed> {
    let table = table(path)?;
    let mut columns = [0; 3];
    for (column, name) in columns.iter_mut().zip(["X", "Y", "Z"]) {
        *column = table.column(name).ok_or_else(|| {
            let problem = format!("no column `{name}` in the list of points");
            malformed(
                path,
                Some(1),
                problem,
                "begin with a header such as `id,X,Y,Z`, then give one row per point",
            )
        })?;
    }
    let mut listed = Listed { points: Vec::new(), names: Vec::new() };
    let name = table.column("id");
    for (line, cells) in &table.rows {
        let mut point = [0.0; 3];
        for (value, column) in point.iter_mut().zip(columns) {
            *value = number(path, *line, &cells[column])?;
        }
        listed.points.push(point);
        if let Some(column) = name {
            if listed.names.contains(&cells[column]) {
                let problem = format!("two points have the name `{}`", cells[column]);
                return Err(malformed(path, Some(*line), problem, "give each point its own name"));
            }
            listed.names.push(cells[column].clone());
        }
    }
    Ok(listed)
}

/// Reads `id,x1,y1,x2,y2,…` and, where there is one, `view`.
pub(super) fn read_start(path: &Path, id: impl Fn(&str) -> Option<PointId>) -> Result<Vec<Named>> {
    const HINT: &str = "begin with a header such as `id,x1,y1,x2,y2`, then give one row per point";
    let table = table(path)?;
    let Some(name) = table.column("id") else {
        return Err(malformed(path, Some(1), "no column `id` in the start file".into(), HINT));
    };
    let view = table.column("view");
    let cameras: Vec<(usize, usize, usize)> = (1..=table.header.len())
        .filter_map(|n| {
            Some((n - 1, table.column(&format!("x{n}"))?, table.column(&format!("y{n}"))?))
        })
        .collect();
    if cameras.is_empty() {
        return Err(malformed(path, Some(1), "no columns `x1,y1` in the start file".into(), HINT));
    }
    let mut named = Vec::new();
    for (line, cells) in &table.rows {
        let id = id(&cells[name]).ok_or_else(|| {
            let problem = format!("the chart has no point named `{}`", cells[name]);
            malformed(
                path,
                Some(*line),
                problem,
                "use the names in the list's column `id`, or numbers from 0",
            )
        })?;
        for (camera, x, y) in &cameras {
            if cells[*x].is_empty() && cells[*y].is_empty() {
                continue;
            }
            let pixel =
                Pixel::new(number(path, *line, &cells[*x])?, number(path, *line, &cells[*y])?);
            let view = view.map(|column| cells[column].clone()).filter(|view| !view.is_empty());
            named.push(Named { camera: *camera, view, id, pixel });
        }
    }
    Ok(named)
}
