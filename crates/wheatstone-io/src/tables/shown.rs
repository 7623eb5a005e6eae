//! Cells of any kind as text.

use arrow_array::{
    Array, Float32Array, Float64Array, StringArray, array::AnyDictionaryArray, cast::AsArray,
    downcast_integer_array, downcast_temporal_array, types::Decimal128Type,
};
use arrow_schema::DataType;
use std::fmt::{self, Write};

/// A column whose cells are written as text. Numbers have the shortest digits that read back the same.
pub(super) enum Shown<'a> {
    Double(&'a Float64Array),
    Single(&'a Float32Array),
    Text(&'a StringArray),
    /// Rows that share their values: which value each has.
    Shared(Vec<Option<usize>>, Box<Shown<'a>>),
    Other(&'a dyn Array),
}

impl<'a> Shown<'a> {
    pub(super) fn of(array: &'a dyn Array) -> Self {
        match array.data_type() {
            DataType::Float64 => Self::Double(array.as_primitive()),
            DataType::Float32 => Self::Single(array.as_primitive()),
            DataType::Utf8 => Self::Text(array.as_string()),
            DataType::Dictionary(..) => {
                let dictionary = array.as_any_dictionary();
                Self::Shared(keys_of(dictionary), Box::new(Self::of(dictionary.values())))
            }
            _ => Self::Other(array),
        }
    }

    /// Writes a cell; nothing for one that holds none.
    pub(super) fn push(&self, row: usize, out: &mut String) {
        let written = match self {
            Self::Double(numbers) if numbers.is_valid(row) && !numbers.value(row).is_nan() => {
                write!(out, "{}", numbers.value(row))
            }
            Self::Single(numbers) if numbers.is_valid(row) && !numbers.value(row).is_nan() => {
                write!(out, "{}", numbers.value(row))
            }
            Self::Text(text) if text.is_valid(row) => out.write_str(text.value(row)),
            Self::Shared(keys, values) => {
                if let Some(value) = keys[row] {
                    values.push(value, out);
                }
                Ok(())
            }
            Self::Other(array) if array.is_valid(row) => write(*array, row, out),
            _ => Ok(()),
        };
        // Text in memory takes all that is written.
        debug_assert!(written.is_ok());
    }

    pub(super) fn is_number(&self) -> bool {
        matches!(self, Self::Double(_) | Self::Single(_))
    }

    /// A cell.
    pub(super) fn text(&self, row: usize) -> String {
        let mut text = String::new();
        self.push(row, &mut text);
        text
    }
}

/// Which value each row has, of rows that share their values.
pub(super) fn keys_of(dictionary: &dyn AnyDictionaryArray) -> Vec<Option<usize>> {
    // Without values there are no keys either.
    if dictionary.values().is_empty() {
        return vec![None; dictionary.len()];
    }
    let keys = dictionary.normalized_keys().into_iter().enumerate();
    keys.map(|(row, key)| dictionary.is_valid(row).then_some(key)).collect()
}

/// A cell that is not null, of the kinds that tables keep seldom; nothing for lists, structures and what else text has
/// no form for. Dates and times are written after ISO 8601.
fn write(array: &dyn Array, row: usize, out: &mut String) -> fmt::Result {
    match array.data_type() {
        DataType::Boolean => write!(out, "{}", array.as_boolean().value(row)),
        DataType::LargeUtf8 => out.write_str(array.as_string::<i64>().value(row)),
        DataType::Utf8View => out.write_str(array.as_string_view().value(row)),
        DataType::Decimal128(..) => {
            out.write_str(&array.as_primitive::<Decimal128Type>().value_as_string(row))
        }
        DataType::Date32 | DataType::Date64 => downcast_temporal_array!(
            array => array.value_as_date(row).map_or(Ok(()), |date| write!(out, "{date:?}")),
            _ => Ok(())
        ),
        DataType::Time32(_) | DataType::Time64(_) => downcast_temporal_array!(
            array => array.value_as_time(row).map_or(Ok(()), |time| write!(out, "{time:?}")),
            _ => Ok(())
        ),
        DataType::Timestamp(_, zone) => {
            let utc = if zone.is_some() { "Z" } else { "" };
            downcast_temporal_array!(
                array => array.value_as_datetime(row).map_or(Ok(()), |at| write!(out, "{at:?}{utc}")),
                _ => Ok(())
            )
        }
        _ => downcast_integer_array!(
            array => write!(out, "{}", array.value(row)),
            _ => Ok(())
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arrow_array::{
        BooleanArray, Date32Array, Decimal128Array, DictionaryArray, Int64Array,
        TimestampMillisecondArray, types::Int32Type,
    };

    #[test]
    fn cells_of_every_kind() {
        let text = |array: &dyn Array, row| Shown::of(array).text(row);
        assert_eq!(text(&Int64Array::from(vec![Some(-7), None]), 0), "-7");
        assert_eq!(text(&Int64Array::from(vec![Some(-7), None]), 1), "");
        assert_eq!(text(&BooleanArray::from(vec![true]), 0), "true");
        assert_eq!(text(&Date32Array::from(vec![19_000]), 0), "2022-01-08");
        let instants = TimestampMillisecondArray::from(vec![1_500]);
        assert_eq!(text(&instants, 0), "1970-01-01T00:00:01.500");
        assert_eq!(text(&instants.with_timezone("UTC"), 0), "1970-01-01T00:00:01.500Z");
        let decimals = Decimal128Array::from(vec![-5]).with_precision_and_scale(4, 2).unwrap();
        assert_eq!(text(&decimals, 0), "-0.05");
        let shared: DictionaryArray<Int32Type> = [Some("a,b"), None].into_iter().collect();
        assert_eq!([text(&shared, 0), text(&shared, 1)], ["a,b", ""]);
    }
}
