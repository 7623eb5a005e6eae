//! What locating adds to the rows of a table.

use super::rounding::round_to_sigma;
use arrow_array::{ArrayRef, Float64Array, RecordBatch, StringArray};
use arrow_schema::{DataType, Field, FieldRef, Schema, SchemaRef};
use std::{mem::take, sync::Arc};
use wheatstone_core::{
    Error, Result,
    dataset::volume::Trust,
    geometry::PixelColumns,
    method::{LocatedBatch, mismatch::MismatchTest},
};

/// What is added to each row.
const COLUMNS: [&str; 9] = ["X", "Y", "Z", "sX", "sY", "sZ", "residual", "trust", "mismatch"];

/// Those of them that hold text.
const TEXT: [&str; 2] = ["trust", "mismatch"];

/// What is added where the covariance is asked for.
const COVARIANCE: [&str; 6] = ["cXX", "cXY", "cXZ", "cYY", "cYZ", "cZZ"];

/// The columns that located points add to a table: `X`, `Y`, `Z` and their standard deviations `sX`, `sY`, `sZ`;
/// `residual`; `trust`, which is `inside`, `edge` or `outside`; `mismatch`, which is `yes` where the rays do not
/// intersect. Null stands where nothing was located, or where a figure does not exist.
#[derive(Clone, Debug)]
pub struct LocatedColumns {
    /// Whether the covariance is added as well: `cXX`, `cXY`, `cXZ`, `cYY`, `cYZ`, `cZZ`.
    pub covariance: bool,
    /// Whether places are rounded to what their standard deviations mean, as for text.
    pub rounded: bool,
    /// Which points are called mismatched.
    pub test: MismatchTest,
}

impl LocatedColumns {
    fn added(&self) -> impl Iterator<Item = &'static str> + Clone {
        let covariance = if self.covariance { &COVARIANCE[..] } else { &[] };
        COLUMNS.iter().chain(covariance).copied()
    }

    /// What a column of the input is called: `input_X` and so on where its name is that of an added one.
    fn renamed(&self, name: &str) -> String {
        let is_taken = self.added().any(|own| own == name);
        if is_taken { format!("input_{name}") } else { name.into() }
    }

    /// The names of the input's columns and of the added ones.
    #[must_use]
    pub fn names<'n>(&self, input: impl IntoIterator<Item = &'n str>) -> Vec<String> {
        let own = input.into_iter().map(|name| self.renamed(name));
        own.chain(self.added().map(str::to_owned)).collect()
    }

    /// The schema of the input's rows with what is added to them.
    #[must_use]
    pub fn schema(&self, input: &Schema) -> SchemaRef {
        let own = input.fields().iter().map(|field| match self.renamed(field.name()) {
            name if name == *field.name() => Arc::clone(field),
            name => Arc::new(field.as_ref().clone().with_name(name)),
        });
        let added = self.added().map(|name| {
            let kind = if TEXT.contains(&name) { DataType::Utf8 } else { DataType::Float64 };
            Arc::new(Field::new(name, kind, true))
        });
        let fields: Vec<FieldRef> = own.chain(added).collect();
        Arc::new(Schema::new_with_metadata(fields, input.metadata().clone()))
    }

    /// The added columns, taken out of `places`.
    #[must_use]
    pub fn of(&self, pixels: &PixelColumns, places: &mut LocatedBatch) -> Vec<ArrayRef> {
        let count = places.len();
        let mismatch = self.test.mismatches(pixels, places);
        let trust =
            places.point[0].iter().enumerate().map(|(row, x)| match places.trust.get(row) {
                _ if x.is_nan() => None,
                Some(Trust::Inside) => Some("inside"),
                Some(Trust::Edge) => Some("edge"),
                Some(Trust::Outside) => Some("outside"),
                None => None,
            });
        let trust = Arc::new(trust.collect::<StringArray>());
        let mismatch = (0..count).map(|row| mismatch.get(row)?.then_some("yes"));
        let mismatch = Arc::new(mismatch.collect::<StringArray>());
        let mut sigmas = places.sigma();
        if self.rounded {
            for (axis, sigmas) in places.point.iter_mut().zip(&mut sigmas) {
                round_to_sigma(axis, sigmas);
                let own = sigmas.clone();
                round_to_sigma(sigmas, &own);
            }
        }
        let number = |values: Vec<f64>| number(values, count);
        let mut columns: Vec<ArrayRef> = Vec::with_capacity(COLUMNS.len() + COVARIANCE.len());
        columns.extend(take(&mut places.point).into_iter().chain(sigmas).map(number));
        columns.push(number(take(&mut places.residual)));
        columns.extend([trust as ArrayRef, mismatch]);
        if self.covariance {
            columns.extend(take(&mut places.covariance).into_iter().map(number));
        }
        columns
    }

    /// Rows with what is added to them, which is taken out of `places`.
    ///
    /// # Errors
    ///
    /// [`Error::Mismatch`] where there are not as many places as rows.
    pub fn append(
        &self,
        rows: &RecordBatch,
        pixels: &PixelColumns,
        places: &mut LocatedBatch,
    ) -> Result<RecordBatch> {
        let located = places.len();
        let columns = rows.columns().iter().cloned().chain(self.of(pixels, places)).collect();
        RecordBatch::try_new(self.schema(&rows.schema()), columns).map_err(|_| Error::Mismatch {
            what: "number of rows",
            model: located.to_string(),
            data: rows.num_rows().to_string(),
        })
    }
}

/// A column of numbers, null where one is not finite, and everywhere where there are none.
fn number(values: Vec<f64>, count: usize) -> ArrayRef {
    if values.is_empty() {
        return Arc::new(Float64Array::new_null(count));
    }
    if values.iter().all(|value| value.is_finite()) {
        return Arc::new(Float64Array::from(values));
    }
    Arc::new(values.into_iter().map(|v| v.is_finite().then_some(v)).collect::<Float64Array>())
}
