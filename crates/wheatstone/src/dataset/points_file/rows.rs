//! Some rows of a points file, on their way.

use super::{
    columns::{Column, Columns},
    digits::push_number,
    layout::LARGEST,
    records::push_cell,
    spelled::Spelled,
};
use crate::{Result, geometry::PixelColumns};
use rayon::prelude::*;
use std::{io::Write, ops::Range};

/// Some rows: their pixels, and all else that they hold.
#[derive(Clone, Debug)]
pub struct Rows {
    held: Held,
    pixels: Vec<[Axis; 2]>,
}

#[derive(Clone, Debug)]
enum Held {
    Columns(Columns),
    Text(Spelled),
}

/// One number of one camera, for each row.
#[derive(Clone, Debug)]
pub(super) enum Axis {
    /// It stands in this column.
    Column(usize),
    /// It was made from one.
    Own(Vec<f64>),
}

impl Rows {
    pub(super) fn of_columns(columns: Columns, pixels: Vec<[Axis; 2]>) -> Self {
        Self { held: Held::Columns(columns), pixels }
    }

    pub(super) fn of_text(text: Spelled, pixels: Vec<[Axis; 2]>) -> Self {
        Self { held: Held::Text(text), pixels }
    }

    /// How many rows.
    #[must_use]
    pub fn count(&self) -> usize {
        match &self.held {
            Held::Columns(columns) => columns.rows(),
            Held::Text(text) => text.count(),
        }
    }

    /// The pixels, column by column.
    #[must_use]
    pub fn pixels(&self) -> PixelColumns<'_> {
        PixelColumns::new(self.pixels.iter().map(|[x, y]| [self.axis(x), self.axis(y)]).collect())
    }

    fn axis<'a>(&'a self, axis: &'a Axis) -> &'a [f64] {
        match (axis, &self.held) {
            (Axis::Own(values), _) => values,
            (Axis::Column(column), Held::Columns(columns)) => match &columns.columns[*column].1 {
                Column::Numbers(cells) => cells.values(),
                _ => &[],
            },
            (Axis::Column(_), Held::Text(_)) => &[],
        }
    }

    /// All columns: of text, pixels and places are numbers and all else is text.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Malformed`] for a place that is none, naming line and column.
    pub fn into_columns(self) -> Result<Columns> {
        match self.held {
            Held::Columns(columns) => Ok(columns),
            Held::Text(text) => text.columns(),
        }
    }

    /// The first row with a number that is no place, or with one half of a pixel; and the columns.
    pub(super) fn first_fault(&self) -> Option<(usize, &Columns)> {
        let fault = |x: f64, y: f64| {
            let place = (x.abs() <= LARGEST) & (y.abs() <= LARGEST);
            !(place | (x.is_nan() & y.is_nan()))
        };
        let of_camera = |[x, y]: &[&[f64]; 2]| {
            // Without a way out of the loop, which registers of several numbers can take at once.
            let any = x.iter().zip(*y).fold(false, |any, (x, y)| any | fault(*x, *y));
            if any { x.iter().zip(*y).position(|(x, y)| fault(*x, *y)) } else { None }
        };
        let first = self.pixels().cameras().iter().filter_map(of_camera).min()?;
        match &self.held {
            Held::Columns(columns) => Some((first, columns)),
            Held::Text(_) => None,
        }
    }

    /// The rows as text, with what is `added` to them: pieces of whole rows, one after the other. What was
    /// text stays as it was written, but for quotes and spaces that say nothing.
    #[must_use]
    pub fn text(&self, added: &[Column], delimiter: u8) -> Vec<Vec<u8>> {
        // Rows a task: large enough to pay for handing it over, small enough to balance.
        const TASK: usize = 1024;
        let count = self.count();
        let task = |task: usize| {
            let rows = task * TASK..count.min((task + 1) * TASK);
            self.piece(rows, added, delimiter)
        };
        (0..count.div_ceil(TASK)).into_par_iter().map(task).collect()
    }

    fn piece(&self, rows: Range<usize>, added: &[Column], delimiter: u8) -> Vec<u8> {
        // What shortest digits of a number take at most, but for rare ones.
        const CELL: usize = 20;
        let own = match &self.held {
            Held::Columns(columns) => &columns.columns[..],
            Held::Text(_) => &[],
        };
        let mut out = Vec::with_capacity(rows.len() * CELL * (own.len() + added.len() + 4));
        for row in rows {
            if let Held::Text(text) = &self.held {
                text.push_row(&mut out, row);
            }
            let columns = own.iter().map(|(_, column)| column).chain(added);
            for (index, column) in columns.enumerate() {
                if index > 0 || own.is_empty() {
                    out.push(delimiter);
                }
                push(&mut out, column, row, delimiter);
            }
            out.push(b'\n');
        }
        out
    }
}

/// Writes the cell of a column.
fn push(out: &mut Vec<u8>, column: &Column, row: usize, delimiter: u8) {
    match column {
        Column::Numbers(cells) => {
            if let Some(value) = cells.get(row)
                && !value.is_nan()
            {
                push_number(out, *value);
            }
        }
        Column::Integers(cells) => {
            if let Some(value) = cells.get(row) {
                // A vector takes all that is written to it.
                let _ = write!(out, "{value}");
            }
        }
        Column::Texts(texts) => push_cell(out, texts.get(row).unwrap_or_default(), delimiter),
        Column::Words(words) => push_cell(out, words.get(row).unwrap_or_default(), delimiter),
    }
}

/// The names of columns as the first line of a table of text.
#[must_use]
pub fn header_line<'a>(names: impl IntoIterator<Item = &'a str>, delimiter: u8) -> Vec<u8> {
    let mut line = Vec::new();
    for (index, name) in names.into_iter().enumerate() {
        if index > 0 {
            line.push(delimiter);
        }
        push_cell(&mut line, name, delimiter);
    }
    line.push(b'\n');
    line
}
