//! Which column of a table holds what.

use super::names::{ColumnNames, Pixels, families, lengths, with_unit_of, without_length_unit};
use std::path::Path;
use wheatstone_core::{
    Error, Result,
    error::{Hint, Remedy},
    limits,
};

/// Where each quantity stands in a row.
#[derive(Clone, Debug, Default)]
pub(super) struct Layout {
    pub(super) pixels: Vec<[usize; 2]>,
    pub(super) world: Option<[usize; 3]>,
    pub(super) board: Option<[usize; 2]>,
    pub(super) view: Option<usize>,
    pub(super) id: Option<usize>,
    /// The unit of lengths, where the columns' names say it.
    pub(super) unit: Option<&'static str>,
}

/// The names that a header gives, for messages that say where.
pub(super) struct Header<'a> {
    pub(super) path: &'a Path,
    /// The line in which they stand, where the file has lines.
    pub(super) line: Option<u64>,
    pub(super) names: &'a [String],
}

impl Header<'_> {
    pub(super) fn refuse(&self, problem: String) -> Error {
        let hint = "name the columns in the first line, such as `x1,y1,x2,y2,X,Y,Z`; other names can be mapped";
        self.malformed(problem, Hint::new(hint, Remedy::Columns))
    }

    fn malformed(&self, problem: String, hint: Hint) -> Error {
        Error::Malformed { path: self.path.into(), line: self.line, problem, hint }
    }

    /// Says which columns are missing, and which there are.
    pub(super) fn missing(&self, columns: &[&str]) -> Error {
        self.refuse(self.no_column(columns))
    }

    /// Refuses a table of caliscope: a row of it is a point and a camera.
    fn refuse_caliscope(&self) -> Result<()> {
        let has = |own: &str| self.names.iter().any(|name| name == own);
        if !["sync_index", "img_loc_x", "img_loc_y"].into_iter().all(has) {
            return Ok(());
        }
        Err(self.malformed(
            "a table of caliscope, which has a row for each camera that sees a point, not one for each point".into(),
            "read it with `read_caliscope` of the Python package; `save` of what it gives writes a table that is read here".into(),
        ))
    }

    fn no_column(&self, columns: &[&str]) -> String {
        let quoted: Vec<String> = columns.iter().map(|name| format!("`{name}`")).collect();
        format!("no column {}; found: {}", quoted.join(", "), self.names.join(", "))
    }

    /// Says that points of the world are missing; or Z alone, where there are X and Y.
    pub(super) fn no_points(&self) -> Error {
        match lengths(self.names, ["X", "Y"]).0 {
            [Some(x), Some(y)] => self.malformed(self.no_column(&["Z"]), Hint::new(
                format!(
                    "add Z; or, if `{}` and `{}` are places on a flat chart that stood in another pose in each view, name them `board_x` and `board_y`",
                    self.names[x], self.names[y]
                ),
                Remedy::BoardColumns,
            )),
            _ => self.missing(&["X", "Y", "Z"]),
        }
    }
}

impl Layout {
    /// From the columns' names, and what a user tells of them.
    pub(super) fn of(header: &Header, told: Option<&ColumnNames>) -> Result<Self> {
        limits::COLUMNS.allow(header.path, header.names.len() as u64)?;
        if header.names.iter().all(String::is_empty) {
            return Err(header.refuse("the file is empty".into()));
        }
        if told.is_none() {
            header.refuse_caliscope()?;
        }
        for (index, name) in header.names.iter().enumerate() {
            if !name.is_empty() && header.names[..index].contains(name) {
                return Err(header.refuse(format!("two columns have the name `{name}`")));
            }
        }
        let names = match told {
            Some(ColumnNames::Renamed(pairs)) => renamed(header, pairs)?,
            _ => header.names.to_vec(),
        };
        let exact = |name: &str| names.iter().position(|own| own == name);
        let (board, mut units) = lengths(&names, ["board_x", "board_y"]);
        let (world, said) = lengths(&names, ["X", "Y", "Z"]);
        units.extend(said);
        units.dedup();
        if let [one, other, ..] = &units[..] {
            return Err(header.refuse(format!("some lengths are in `{one}` and some in `{other}`")));
        }
        let board = all(board);
        // Who says that X and Y are places on a board has no use for its Z, which is 0 throughout.
        let mapped = matches!(told, Some(ColumnNames::Renamed(_)));
        if world.iter().any(Option::is_some) {
            let missing: Vec<&str> = (["X", "Y", "Z"].into_iter().zip(&world))
                .filter_map(|(name, column)| column.is_none().then_some(name))
                .collect();
            let no_use = mapped && board.is_some() && missing == ["X", "Y"];
            if missing == ["Z"] {
                return Err(header.no_points());
            }
            if !missing.is_empty() && !no_use {
                return Err(header.missing(&missing));
            }
        }
        // One camera's list of corners calibrates it; points in the world need two.
        let least = if board.is_some() && world[0].is_none() { 1 } else { 2 };
        let pixels = pixels(header, &names, least)?;
        limits::CAMERAS.allow(header.path, pixels.len() as u64)?;
        Ok(Self {
            pixels,
            world: all(world),
            board,
            view: exact("view"),
            id: exact("id"),
            unit: units.first().copied(),
        })
    }

    /// Whether it has places, in the world or on a board.
    pub(super) fn has_lengths(&self) -> bool {
        self.world.is_some() || self.board.is_some()
    }

    /// The columns that hold numbers.
    pub(super) fn numbers(&self) -> impl Iterator<Item = usize> + '_ {
        let world = self.world.iter().flatten();
        self.pixels.iter().flatten().chain(world).chain(self.board.iter().flatten()).copied()
    }
}

fn all<const N: usize>(columns: [Option<usize>; N]) -> Option<[usize; N]> {
    let found: Vec<usize> = columns.into_iter().flatten().collect();
    found.try_into().ok()
}

/// The names with those that a user tells; what had one of these by itself loses it.
fn renamed(header: &Header, pairs: &[(String, String)]) -> Result<Vec<String>> {
    let mut names = header.names.to_vec();
    for name in &mut names {
        if pairs.iter().any(|(ours, _)| ours == name) {
            name.clear();
        }
    }
    for (ours, theirs) in pairs {
        let exact = header.names.iter().position(|name| name == theirs);
        // `X` is `X_mm`, too.
        let index = exact
            .or_else(|| header.names.iter().position(|name| without_length_unit(name) == theirs));
        let Some(index) = index else { return Err(header.missing(&[theirs])) };
        names[index] = with_unit_of(&header.names[index], ours);
    }
    Ok(names)
}

/// The pixels' columns, camera by camera.
fn pixels(header: &Header, names: &[String], least: usize) -> Result<Vec<[usize; 2]>> {
    let found = families(names);
    let complete = |pixels: &Pixels| pixels.values().filter(|pair| all(**pair).is_some()).count();
    let mut ways = found.iter().filter(|(_, pixels)| complete(pixels) >= least);
    let Some((family, pixels)) = ways.next() else {
        let best = found.values().max_by_key(|pixels| complete(pixels));
        return Err(incomplete(header, best));
    };
    if !family.is_ours()
        && let Some((_, other)) = ways.next()
    {
        let name = |pixels: &Pixels| {
            let first = pixels.values().flatten().flatten().next();
            first.map_or("", |column| &header.names[*column]).to_owned()
        };
        let (one, other) = (name(pixels), name(other));
        return Err(header.refuse(format!(
            "the pixels may be in `{one}` and similar columns, or in `{other}` and similar columns"
        )));
    }
    // Cameras count from 1, or from 0 where the table has a 0.
    let first = usize::from(!pixels.contains_key(&0));
    let mut columns = Vec::new();
    for (place, (camera, pair)) in pixels.iter().enumerate() {
        match all(*pair) {
            Some(pair) if *camera == place + first => columns.push(pair),
            _ => {
                let stray =
                    pair.iter().flatten().next().map_or("", |column| &header.names[*column]);
                let next = place + first;
                return Err(header.refuse(format!(
                    "column `{stray}` has no partner: the next camera needs `x{next}`, `y{next}`"
                )));
            }
        }
    }
    Ok(columns)
}

/// Says which of two cameras' pixels are missing.
fn incomplete(header: &Header, found: Option<&Pixels>) -> Error {
    let mut missing = vec!["x1", "y1", "x2", "y2"];
    for (place, pair) in found.into_iter().flat_map(Pixels::values).enumerate().take(2) {
        for (axis, column) in pair.iter().enumerate() {
            if column.is_some() {
                missing.retain(|name| *name != ["x1", "y1", "x2", "y2"][2 * place + axis]);
            }
        }
    }
    header.missing(&missing)
}
