//! Some rows of a table, on their way.

use super::{
    cells::{self, Fault},
    layout::Layout,
    numbers::{self, Reading, Unfit},
    shown::Shown,
};
use arrow_array::{ArrayRef, Float64Array, RecordBatch};
use arrow_schema::{DataType, Field, Schema};
use std::{path::PathBuf, sync::Arc};
use wheatstone_core::{
    Error, Result,
    dataset::Correspondence,
    geometry::{Pixel, PixelColumns, Point3},
};

/// What all rows of a table have in common.
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    pub(super) path: PathBuf,
    pub(super) names: Vec<String>,
    pub(super) layout: Layout,
    /// How cells are read: whether commas may be decimal ones, and whether what is no number counts for empty.
    pub(super) reading: Reading,
}

/// Some rows of a table: their columns, and the pixels as numbers.
#[derive(Clone, Debug)]
pub struct Rows {
    table: Arc<Table>,
    batch: RecordBatch,
    /// Without nulls: NaN stands where a camera did not see a point. x and y of each camera.
    pixels: Vec<Float64Array>,
    at: Place,
    decimal_comma: bool,
}

/// Where rows stand in their file.
#[derive(Clone, Debug)]
enum Place {
    /// In these lines.
    Lines(Vec<u64>),
    /// One behind the other from this row on, counted from 1.
    Rows(u64),
}

/// A coordinate without its partner is no pixel.
fn drop_halves(pair: &mut [Float64Array]) {
    let [x, y] = pair else { return };
    let is_half = |(x, y): (&f64, &f64)| x.is_nan() != y.is_nan();
    if !x.values().iter().zip(y.values()).any(is_half) {
        return;
    }
    let beside = |own: &Float64Array, other: &Float64Array| -> Float64Array {
        let both = own.values().iter().zip(other.values());
        both.map(|(own, other)| if other.is_nan() { f64::NAN } else { *own })
            .collect::<Vec<_>>()
            .into()
    };
    (*x, *y) = (beside(x, y), beside(y, x));
}

impl Rows {
    pub(super) fn new(table: Arc<Table>, batch: RecordBatch, pixels: Vec<Float64Array>) -> Self {
        Self { table, batch, pixels, at: Place::Rows(1), decimal_comma: false }
    }

    pub(super) fn of_lines(self, lines: Vec<u64>, decimal_comma: bool) -> Self {
        Self { at: Place::Lines(lines), decimal_comma, ..self }
    }

    /// Of columns as a file has them, from this row on, counted from 1.
    pub(super) fn of_columns(table: Arc<Table>, batch: RecordBatch, first: u64) -> Result<Self> {
        let mut rows = Self::new(table, batch, Vec::new());
        rows.at = Place::Rows(first);
        let Table { layout, .. } = &*rows.table;
        let axes: Vec<usize> = layout.pixels.iter().flatten().copied().collect();
        rows.pixels = axes.into_iter().map(|column| rows.numbers(column)).collect::<Result<_>>()?;
        if rows.table.reading.lenient {
            rows.pixels.chunks_exact_mut(2).for_each(drop_halves);
            return Ok(rows);
        }
        for (pair, columns) in rows.pixels.chunks_exact(2).zip(&layout.pixels) {
            let (x, y) = (pair[0].values(), pair[1].values());
            let half = x.iter().zip(y.iter()).position(|(x, y)| x.is_nan() != y.is_nan());
            if let Some(row) = half {
                let empty = columns[usize::from(y[row].is_nan())];
                return Err(rows.fault(cells::half(), row, empty));
            }
        }
        Ok(rows)
    }

    /// How many rows.
    #[must_use]
    pub fn count(&self) -> usize {
        self.batch.num_rows()
    }

    /// The pixels, column by column.
    #[must_use]
    pub fn pixels(&self) -> PixelColumns<'_> {
        let values = |axis: usize| &self.pixels[axis].values()[..];
        let camera = |pair: usize| [values(2 * pair), values(2 * pair + 1)];
        PixelColumns::new((0..self.pixels.len() / 2).map(camera).collect())
    }

    /// All columns as the table has them; those of a table of text are text.
    #[must_use]
    pub fn batch(&self) -> &RecordBatch {
        &self.batch
    }

    /// Whether numbers are written with decimal commas.
    pub(super) fn decimal_comma(&self) -> bool {
        self.decimal_comma
    }

    /// All columns, with pixels and lengths as numbers where the table is of text.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] for a length that is no number, naming line and column.
    pub fn typed(&self) -> Result<RecordBatch> {
        let mut columns = self.batch.columns().to_vec();
        let mut fields: Vec<Field> =
            self.batch.schema().fields().iter().map(|field| field.as_ref().clone()).collect();
        for column in self.table.layout.numbers() {
            if let DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View =
                fields[column].data_type()
            {
                let numbers = self.numbers(column)?;
                let cells = numbers.values().iter().map(|v| (!v.is_nan()).then_some(*v));
                columns[column] = Arc::new(cells.collect::<Float64Array>()) as ArrayRef;
                fields[column] = Field::new(fields[column].name(), DataType::Float64, true);
            }
        }
        RecordBatch::try_new(Arc::new(Schema::new(fields)), columns)
            .map_err(|e| cells::malformed(&self.table.path, None, e.to_string(), ""))
    }

    /// A column as numbers; NaN where there is none.
    pub(super) fn numbers(&self, column: usize) -> Result<Float64Array> {
        let array = self.batch.column(column);
        numbers::of(array, self.table.reading).map_err(|unfit| match unfit {
            Unfit::Row(row, fault) => self.fault(fault, row, column),
            Unfit::Kind => {
                let name = &self.table.names[column];
                let problem = format!("column `{name}` holds {}, not numbers", array.data_type());
                let hint = "write it as numbers, or remove it";
                cells::malformed(&self.table.path, None, problem, hint)
            }
        })
    }

    /// The line of a row, or its number where the file has no lines.
    pub(super) fn line(&self, row: usize) -> u64 {
        match &self.at {
            Place::Lines(lines) => lines[row],
            Place::Rows(first) => first + row as u64,
        }
    }

    /// Whether cells that hold no numbers count for empty ones.
    pub(super) fn is_lenient(&self) -> bool {
        self.table.reading.lenient
    }

    /// Says that a cell holds no standard deviation.
    pub(super) fn no_sigma(&self, value: f64, row: usize, column: usize) -> Error {
        self.fault(cells::no_sigma(value), row, column)
    }

    fn fault(&self, fault: Fault, row: usize, column: usize) -> Error {
        let Table { path, names, .. } = &*self.table;
        match &self.at {
            Place::Lines(_) => fault.at(path, Some(self.line(row)), &names[column]),
            Place::Rows(_) => fault.in_row(path, self.line(row), &names[column]),
        }
    }

    /// The rows as correspondences, with the names of their views.
    pub(super) fn correspondences(&self) -> Result<Vec<(Correspondence, Option<String>)>> {
        let layout = &self.table.layout;
        let world = self.lengths(layout.world)?;
        let board = self.lengths(layout.board)?;
        let text =
            |column: Option<usize>| column.map(|column| Shown::of(self.batch.column(column)));
        let (view, id) = (text(layout.view), text(layout.id));
        let pixels = self.pixels();
        let row = |row: usize| {
            let seen =
                |[x, y]: &[&[f64]; 2]| (!x[row].is_nan()).then(|| Pixel::new(x[row], y[row]));
            let at = |lengths: &Option<Vec<Float64Array>>, axis: usize| {
                lengths.as_ref().map(|lengths| lengths[axis].value(row)).filter(|v| !v.is_nan())
            };
            let world = (|| Some(Point3::new(at(&world, 0)?, at(&world, 1)?, at(&world, 2)?)))();
            let board = (|| Some([at(&board, 0)?, at(&board, 1)?]))();
            let id = id.as_ref().map(|id| id.text(row)).filter(|id| !id.is_empty());
            let pixels = pixels.cameras().iter().map(seen).collect();
            let correspondence = Correspondence { view: 0, id, pixels, world, board };
            (correspondence, view.as_ref().map(|view| view.text(row)))
        };
        Ok((0..self.count()).map(row).collect())
    }

    /// Columns of lengths that are given together or not at all.
    fn lengths<const N: usize>(
        &self,
        columns: Option<[usize; N]>,
    ) -> Result<Option<Vec<Float64Array>>> {
        let Some(columns) = columns else { return Ok(None) };
        let arrays: Vec<Float64Array> =
            columns.iter().map(|column| self.numbers(*column)).collect::<Result<_>>()?;
        for row in 0..self.count() {
            let empty: Vec<usize> =
                (0..N).filter(|axis| arrays[*axis].value(row).is_nan()).collect();
            if (1..N).contains(&empty.len()) {
                return Err(self.fault(cells::half(), row, columns[empty[0]]));
            }
        }
        Ok(Some(arrays))
    }
}
