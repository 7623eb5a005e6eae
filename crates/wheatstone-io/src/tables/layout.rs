//! Which column holds what.

use std::{collections::BTreeMap, path::Path};
use wheatstone_core::{Error, Result};

/// Beyond this no pixel and no chart lies, but overflow does.
pub(super) const LARGEST: f64 = 1e9;

/// Where each quantity stands in a row.
#[derive(Clone, Debug, Default)]
pub(super) struct Layout {
    pub(super) pixels: Vec<[usize; 2]>,
    pub(super) world: Option<[usize; 3]>,
    pub(super) board: Option<[usize; 2]>,
    pub(super) view: Option<usize>,
    pub(super) id: Option<usize>,
}

impl Layout {
    /// From the columns' names, which stand in `line` where the file has lines.
    pub(super) fn read(path: &Path, line: Option<u64>, header: &csv::StringRecord) -> Result<Self> {
        let refuse = |problem: String, hint: &str| Error::Malformed {
            path: path.into(),
            line,
            problem,
            hint: hint.into(),
        };
        const HINT: &str = "the first line names the columns, such as `x1,y1,x2,y2,X,Y,Z`";
        if header.iter().all(str::is_empty) {
            return Err(refuse("the file is empty".into(), HINT));
        }
        if header.iter().all(|name| name.parse::<f64>().is_ok()) {
            return Err(refuse("there is no header, only numbers".into(), HINT));
        }
        let mut columns = BTreeMap::new();
        for (index, name) in header.iter().enumerate() {
            if columns.insert(name, index).is_some() && !name.is_empty() {
                return Err(refuse(format!("two columns are named `{name}`"), HINT));
            }
        }
        let find = |name: &str| columns.get(name).copied();
        let mut pixels = Vec::new();
        while let (Some(x), Some(y)) =
            (find(&format!("x{}", pixels.len() + 1)), find(&format!("y{}", pixels.len() + 1)))
        {
            pixels.push([x, y]);
        }
        // One camera's list of corners calibrates it; points in the world need two.
        let corners = find("board_x").is_some() && find("X").is_none();
        let least = if corners && find("x2").or(find("y2")).is_none() { 1 } else { 2 };
        if pixels.len() < least {
            let missing = ["x1", "y1", "x2", "y2"].into_iter().find(|name| find(name).is_none());
            let missing = missing.unwrap_or("x2");
            return Err(refuse(format!("there is no column `{missing}`"), HINT));
        }
        let next = pixels.len() + 1;
        let stray = columns.keys().find(|name| {
            let digits = name.strip_prefix(['x', 'y']).unwrap_or_default();
            digits.parse::<usize>().is_ok_and(|camera| camera >= next)
        });
        if let Some(stray) = stray {
            return Err(refuse(
                format!("column `{stray}` stands alone: cameras go on as `x{next}`, `y{next}`"),
                HINT,
            ));
        }
        let world = [find("X"), find("Y"), find("Z")];
        if world.iter().any(Option::is_some) && !world.iter().all(Option::is_some) {
            return Err(refuse("of `X`, `Y`, `Z` some are missing".into(), HINT));
        }
        let both = |a, b| Some([find(a)?, find(b)?]);
        Ok(Self {
            pixels,
            world: (|| Some([world[0]?, world[1]?, world[2]?]))(),
            board: both("board_x", "board_y"),
            view: find("view"),
            id: find("id"),
        })
    }
}
