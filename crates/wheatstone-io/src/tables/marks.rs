//! Decimal marks of a table of text: a comma or a point, the same throughout.
//!
//! Between semicolons and tabs both are read. Where a table has both, one of them separates thousands, and
//! nothing in the cell itself tells which: `81.455` may be eighty-one thousand.

use super::{cells, rows::Table};
use csv::StringRecord;
use wheatstone_core::{Error, Result};

/// The mark that the cells of a table have, from its first row to its last.
#[derive(Default)]
pub(super) struct Marks {
    first: Option<Marked>,
}

/// A number with a mark, and where it stands.
struct Marked {
    mark: char,
    line: u64,
    cell: String,
}

impl Marks {
    /// Whether numbers are written with decimal commas, as far as was read.
    pub(super) fn is_comma(&self) -> bool {
        self.first.as_ref().is_some_and(|first| first.mark == ',')
    }

    /// Looks at the numbers of a row, in these columns; refuses one whose mark differs from those before.
    pub(super) fn look(
        &mut self,
        table: &Table,
        columns: &[usize],
        (record, line): (&StringRecord, u64),
    ) -> Result<()> {
        for cell in columns.iter().filter_map(|column| record.get(*column)) {
            let Some(mark) = cell.chars().find(|letter| matches!(letter, ',' | '.')) else {
                continue;
            };
            // What is no number is refused where it is needed.
            match &self.first {
                Some(first) if first.mark == mark => {}
                _ if cells::number(cell.trim(), true).is_err() => {}
                None => self.first = Some(Marked { mark, line, cell: cell.trim().into() }),
                Some(first) => return Err(first.differs(table, line, cell.trim())),
            }
        }
        Ok(())
    }
}

impl Marked {
    fn differs(&self, table: &Table, line: u64, cell: &str) -> Error {
        let called = |comma: bool| if comma { "comma" } else { "point" };
        let own = called(self.mark == ',');
        let other = called(self.mark != ',');
        let problem = format!(
            "`{cell}` has a decimal {other}, but `{}` in line {} a decimal {own}",
            self.cell, self.line
        );
        let hint = "write all numbers with one decimal mark, and without separators of thousands";
        cells::malformed(&table.path, Some(line), problem, hint)
    }
}
