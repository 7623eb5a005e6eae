//! Some rows of a points file, on their way.

use super::{
    columns::{Cells, Column, Columns},
    digits::{Digits, ROWS},
    layout::LARGEST,
    records::push_cell,
    sheet::{Pieces, Sheet},
    spelled::Spelled,
};
use rayon::prelude::*;
use std::ops::Range;
use wheatstone_core::{Result, geometry::PixelColumns};

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
    /// [`wheatstone_core::Error::Malformed`] for a place that is none, naming line and column.
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

    /// Writes the rows as text, with what is `added` to them. What was text stays as it was written, but for
    /// quotes and spaces that say nothing.
    pub fn write(&self, added: &[Column], delimiter: u8, pieces: &mut Pieces) {
        // Rows a task: large enough to pay for handing it over, small enough to balance.
        const TASK: usize = 1024;
        let count = self.count();
        let own = match &self.held {
            Held::Columns(columns) => &columns.columns[..],
            Held::Text(_) => &[],
        };
        let columns: Vec<&Column> = own.iter().map(|(_, column)| column).chain(added).collect();
        let tasks = pieces.begin(count.div_ceil(TASK)).par_iter_mut().enumerate();
        tasks.for_each(|(task, sheet)| {
            let rows = task * TASK..count.min((task + 1) * TASK);
            self.piece(rows, &columns, delimiter, sheet);
        });
    }

    /// Writes some rows, of which the first is a multiple of [`ROWS`].
    fn piece(&self, rows: Range<usize>, columns: &[&Column], delimiter: u8, out: &mut Sheet) {
        // What shortest digits of a number take at most, but for rare ones.
        const CELL: usize = 20;
        let text = match &self.held {
            Held::Columns(_) => None,
            Held::Text(text) => Some(text),
        };
        out.begin(rows.len() * CELL * (columns.len() + if text.is_some() { 4 } else { 0 }));
        let mut columns: Vec<Written> =
            columns.iter().map(|column| Written::new(column, delimiter)).collect();
        for row in rows.clone() {
            if row % ROWS == 0 {
                let block = row..rows.end.min(row + ROWS);
                columns.iter_mut().for_each(|column| column.make(block.clone()));
            }
            if let Some(text) = text {
                text.push_row(out, row);
            }
            for (index, column) in columns.iter().enumerate() {
                if index > 0 || text.is_some() {
                    out.push(delimiter);
                }
                column.push(out, row, delimiter);
            }
            out.push(b'\n');
        }
    }
}

/// A column that is written as text.
enum Written<'a> {
    /// With the digits of so many rows from a multiple of [`ROWS`] on.
    Numbers(&'a Cells<f64>, Box<Digits>),
    /// The words as cells, and nothing before them.
    Words(&'a [u8], Vec<Vec<u8>>),
    Other(&'a Column),
}

impl<'a> Written<'a> {
    fn new(column: &'a Column, delimiter: u8) -> Self {
        let cell = |word: &&str| {
            let mut cell = Vec::new();
            push_cell(&mut cell, word, delimiter);
            cell
        };
        match column {
            Column::Numbers(cells) => Self::Numbers(cells, Box::default()),
            Column::Words(words) => {
                let cells = std::iter::once(Vec::new()).chain(words.words.iter().map(cell));
                Self::Words(&words.places, cells.collect())
            }
            Column::Integers(_) | Column::Texts(_) => Self::Other(column),
        }
    }

    /// Makes rows ready.
    fn make(&mut self, rows: Range<usize>) {
        if let Self::Numbers(cells, digits) = self {
            digits.make(&cells.values()[rows]);
        }
    }

    /// Writes the cell of a row that was made ready.
    #[inline]
    fn push(&self, out: &mut Sheet, row: usize, delimiter: u8) {
        match self {
            Self::Numbers(cells, digits) => {
                if let Some(value) = cells.get(row)
                    && !value.is_nan()
                {
                    digits.push(out, row % ROWS, *value);
                }
            }
            Self::Words(places, cells) => out.extend(&cells[usize::from(places[row])]),
            Self::Other(Column::Texts(texts)) => {
                push_cell(out, texts.get(row).unwrap_or_default(), delimiter);
            }
            Self::Other(column) => out.extend(column.text(row).as_bytes()),
        }
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
