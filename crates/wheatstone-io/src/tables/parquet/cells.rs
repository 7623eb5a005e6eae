//! Cells out of a column's pages.

use super::super::columns::{Cells, Column, Texts};
use parquet::{
    column::reader::{ColumnReader, ColumnReaderImpl, get_typed_column_reader},
    data_type::{
        BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type, Int64Type,
    },
    errors::ParquetError,
};

/// The next cells of a column, with the reader to go on from.
pub(super) fn cells(
    reader: ColumnReader,
    count: usize,
    deepest: i16,
) -> Result<(Column, ColumnReader), ParquetError> {
    macro_rules! typed {
        ($kind:ty, $variant:ident, $column:expr) => {{
            let mut own = get_typed_column_reader::<$kind>(reader);
            let found = found(&mut own, count, deepest)?;
            ($column(found), ColumnReader::$variant(own))
        }};
    }
    Ok(match reader {
        ColumnReader::DoubleColumnReader(_) => {
            typed!(DoubleType, DoubleColumnReader, |found| Column::Numbers(spread(found, f64::NAN)))
        }
        ColumnReader::FloatColumnReader(_) => {
            typed!(FloatType, FloatColumnReader, |found: Found<f32>| {
                Column::Numbers(spread(found.map(f64::from), f64::NAN))
            })
        }
        ColumnReader::Int32ColumnReader(_) => {
            typed!(Int32Type, Int32ColumnReader, |found: Found<i32>| {
                Column::Integers(spread(found.map(i64::from), 0))
            })
        }
        ColumnReader::Int64ColumnReader(_) => {
            typed!(Int64Type, Int64ColumnReader, |found| Column::Integers(spread(found, 0)))
        }
        ColumnReader::BoolColumnReader(_) => {
            typed!(BoolType, BoolColumnReader, |found| texts(found, |value: &bool| {
                if *value { "true".into() } else { "false".into() }
            }))
        }
        ColumnReader::ByteArrayColumnReader(_) => {
            typed!(ByteArrayType, ByteArrayColumnReader, |found| {
                texts(found, |value: &ByteArray| String::from_utf8_lossy(value.data()))
            })
        }
        _ => return Err(ParquetError::General("a column of another kind than it said".into())),
    })
}

/// Values that were found one after the other, and which rows they belong to where not all have one.
struct Found<V> {
    values: Vec<V>,
    held: Option<Vec<bool>>,
}

impl<V> Found<V> {
    fn map<W>(self, convert: impl Fn(V) -> W) -> Found<W> {
        Found { values: self.values.into_iter().map(convert).collect(), held: self.held }
    }
}

fn found<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    count: usize,
    deepest: i16,
) -> Result<Found<T::T>, ParquetError> {
    let mut values: Vec<T::T> = Vec::with_capacity(count);
    if deepest == 0 {
        reader.read_records(count, None, None, &mut values)?;
        return Ok(Found { values, held: None });
    }
    let mut levels: Vec<i16> = Vec::with_capacity(count);
    reader.read_records(count, Some(&mut levels), None, &mut values)?;
    let held = (values.len() < levels.len())
        .then(|| levels.into_iter().map(|level| level == deepest).collect());
    Ok(Found { values, held })
}

/// Each value in its row, and `nothing` between.
fn spread<V: Copy>(found: Found<V>, nothing: V) -> Cells<V> {
    let Some(held) = found.held else { return Cells::whole(found.values) };
    let mut values = found.values.into_iter();
    let cell = |held: &bool| if *held { values.next().unwrap_or(nothing) } else { nothing };
    Cells::partial(held.iter().map(cell).collect(), held)
}

fn texts<'a, V: 'a>(
    found: Found<V>,
    text: impl for<'v> Fn(&'v V) -> std::borrow::Cow<'v, str>,
) -> Column {
    let rows = found.held.as_ref().map_or(found.values.len(), Vec::len);
    let mut texts = Texts::with_capacity(rows);
    let mut values = found.values.iter();
    for row in 0..rows {
        let held = found.held.as_ref().is_none_or(|held| held[row]);
        let value = if held { values.next() } else { None };
        texts.push(value.map(&text).as_deref());
    }
    Column::Texts(texts)
}
