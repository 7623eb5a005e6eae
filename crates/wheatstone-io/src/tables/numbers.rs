//! A column as numbers, whatever its file keeps them as.

use super::{
    cells::{self, Fault},
    shown::keys_of,
};
use arrow_array::{
    Array, Float64Array, cast::AsArray, downcast_integer_array, types::Decimal128Type,
};
use arrow_schema::DataType;

/// Why a column is not one of numbers.
pub(super) enum Unfit {
    /// This row holds none.
    Row(usize, Fault),
    /// It holds things of another kind.
    Kind,
}

/// How cells are read.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reading {
    /// Whether a comma in text may stand for the decimal point.
    pub(super) comma: bool,
    /// Whether cells that are no pixels and no lengths count for empty ones, instead of ending the reading.
    pub(super) lenient: bool,
}

/// The numbers of a column, NaN in place of nulls.
pub(super) fn of(array: &dyn Array, reading: Reading) -> Result<Float64Array, Unfit> {
    match array.data_type() {
        DataType::Utf8 => of_text(array.as_string::<i32>(), reading),
        DataType::LargeUtf8 => of_text(array.as_string::<i64>(), reading),
        DataType::Utf8View => of_text(array.as_string_view(), reading),
        DataType::Dictionary(..) => of_dictionary(array, reading),
        // A column of nothing but nulls may have no kind.
        DataType::Null => Ok(vec![f64::NAN; array.len()].into()),
        DataType::Float64 => places(array.as_primitive().clone(), reading),
        DataType::Float32 => {
            of_values(array.as_primitive::<arrow_array::types::Float32Type>(), f64::from, reading)
        }
        DataType::Float16 => {
            of_values(array.as_primitive::<arrow_array::types::Float16Type>(), f64::from, reading)
        }
        DataType::Decimal128(_, scale) => {
            let unit = 10f64.powi(-i32::from(*scale));
            of_values(array.as_primitive::<Decimal128Type>(), |value| value as f64 * unit, reading)
        }
        _ => downcast_integer_array!(
            array => of_values(array, |value| value as f64, reading),
            _ => Err(Unfit::Kind)
        ),
    }
}

fn of_text<'a>(
    text: impl IntoIterator<Item = Option<&'a str>>,
    reading: Reading,
) -> Result<Float64Array, Unfit> {
    let number = |(row, cell): (usize, Option<&str>)| {
        let value = cells::number(cell.unwrap_or_default().trim(), reading.comma);
        let value = if reading.lenient { Ok(value.unwrap_or(None)) } else { value };
        value.map(|value| value.unwrap_or(f64::NAN)).map_err(|fault| Unfit::Row(row, fault))
    };
    let values: Vec<f64> = text.into_iter().enumerate().map(number).collect::<Result<_, _>>()?;
    Ok(values.into())
}

fn of_values<T: Copy>(
    cells: impl IntoIterator<Item = Option<T>>,
    number: impl Fn(T) -> f64,
    reading: Reading,
) -> Result<Float64Array, Unfit> {
    let numbers = cells.into_iter().map(|cell| cell.map_or(f64::NAN, &number));
    places(numbers.collect::<Vec<f64>>().into(), reading)
}

/// Rows that share their values: each value is looked at once.
fn of_dictionary(array: &dyn Array, reading: Reading) -> Result<Float64Array, Unfit> {
    let Some(dictionary) = array.as_any_dictionary_opt() else { return Err(Unfit::Kind) };
    let keys = keys_of(dictionary);
    let values = of(dictionary.values(), reading).map_err(|unfit| match unfit {
        Unfit::Row(value, fault) => {
            Unfit::Row(keys.iter().position(|key| *key == Some(value)).unwrap_or(0), fault)
        }
        kind => kind,
    })?;
    Ok(keys
        .iter()
        .map(|key| key.map_or(f64::NAN, |key| values.value(key)))
        .collect::<Vec<_>>()
        .into())
}

/// Numbers with NaN in place of nulls, where each can be a pixel or a length.
fn places(array: Float64Array, reading: Reading) -> Result<Float64Array, Unfit> {
    let whole = if array.null_count() == 0 {
        array
    } else {
        array.iter().map(|cell| cell.unwrap_or(f64::NAN)).collect::<Vec<f64>>().into()
    };
    if reading.lenient {
        let place = |value: &f64| cells::place(*value).unwrap_or(None).unwrap_or(f64::NAN);
        return Ok(whole.values().iter().map(place).collect::<Vec<f64>>().into());
    }
    for (row, value) in whole.values().iter().enumerate() {
        cells::place(*value).map_err(|fault| Unfit::Row(row, fault))?;
    }
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arrow_array::{
        Decimal128Array, DictionaryArray, Int64Array, ListArray, NullArray, StringViewArray,
        UInt8Array,
        types::{Int8Type, Int32Type},
    };

    fn values(array: &dyn Array) -> Vec<f64> {
        of(array, Reading::default()).ok().unwrap().values().to_vec()
    }

    #[test]
    fn every_kind_of_number_and_of_text() {
        assert_eq!(values(&Int64Array::from(vec![-3, 1 << 20])), [-3.0, 1_048_576.0]);
        assert_eq!(values(&UInt8Array::from(vec![255])), [255.0]);
        assert_eq!(values(&arrow_array::Float32Array::from(vec![0.5])), [0.5]);
        assert_eq!(values(&StringViewArray::from(vec![" 2.5"])), [2.5]);
        let decimals = Decimal128Array::from(vec![12_345]).with_precision_and_scale(9, 2).unwrap();
        assert!((values(&decimals)[0] - 123.45).abs() < 1e-12);
        let shared: DictionaryArray<Int32Type> = [Some("7"), None, Some("7")].into_iter().collect();
        let found = values(&shared);
        assert_eq!((found[0], found[2], found[1].is_nan()), (7.0, 7.0, true));
        let empty: DictionaryArray<Int32Type> = [None::<&str>].into_iter().collect();
        assert!(values(&empty)[0].is_nan() && values(&NullArray::new(2))[1].is_nan());
    }

    #[test]
    fn a_null_is_not_a_number_and_a_list_is_no_column_of_numbers() {
        assert!(values(&Int64Array::from(vec![None, Some(1)]))[0].is_nan());
        let lists = ListArray::from_iter_primitive::<Int32Type, _, _>([Some([Some(1)])]);
        assert!(matches!(of(&lists, Reading::default()), Err(Unfit::Kind)));
    }

    #[test]
    fn a_shared_value_that_is_no_number_is_found_in_its_row() {
        let shared: DictionaryArray<Int8Type> = ["1", "2", "left"].into_iter().collect();
        assert!(matches!(of(&shared, Reading::default()), Err(Unfit::Row(2, _))));
    }
}
