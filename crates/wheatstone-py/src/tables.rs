//! Tables of any library that speaks Arrow's PyCapsule interface: matched pixels in, the same rows with points
//! appended out. It is the one function that engines run on their workers.

use crate::{
    errors::raised,
    model::{PyModel, Ready},
    pool::pool,
};
use arrow_array::{RecordBatch, RecordBatchReader};
use arrow_schema::{ArrowError, Schema, SchemaRef};
use pyo3::prelude::*;
use pyo3_arrow::{PyRecordBatchReader, PySchema, input::AnyRecordBatch};
use std::{path::Path, sync::Arc};
use wheatstone::{
    LocatedBatch,
    method::{PixelSigmas, mismatch::MismatchTest},
    tables::{ColumnNames, LocatedColumns, Rows, SigmaColumns, TableOptions, TableReader},
};

fn appended(covariance: bool, false_alarm: f64, cameras: usize) -> LocatedColumns {
    let test = MismatchTest::new(false_alarm, cameras);
    LocatedColumns { covariance, rounded: false, test }
}

/// What is appended, and how columns are named.
fn options(
    (covariance, false_alarm): (bool, f64),
    cameras: usize,
    columns: Option<&str>,
) -> PyResult<(LocatedColumns, TableOptions)> {
    let columns = columns.map(ColumnNames::parse).transpose().map_err(raised)?;
    Ok((
        appended(covariance, false_alarm, cameras),
        TableOptions { columns, ..TableOptions::default() },
    ))
}

/// Standard deviations of pixels, as they are asked for: one in pixels, or names of columns.
#[derive(FromPyObject)]
enum Noise {
    One(f64),
    Columns(Vec<String>),
}

/// The same of a table that is being read.
enum Sigmas {
    Unknown,
    One(f64),
    Columns(SigmaColumns),
}

impl Sigmas {
    fn of(noise: Option<Noise>, rows: &TableReader) -> PyResult<Self> {
        Ok(match noise {
            None => Self::Unknown,
            Some(Noise::One(sigma)) => Self::One(sigma),
            Some(Noise::Columns(names)) => {
                Self::Columns(rows.sigma_columns(&names).map_err(raised)?)
            }
        })
    }
}

/// Batches that are located when they are asked for.
struct Located {
    rows: TableReader,
    ready: Arc<Ready>,
    appended: LocatedColumns,
    sigmas: Sigmas,
    schema: SchemaRef,
    found: LocatedBatch,
}

impl Located {
    fn located(&mut self, rows: &Rows) -> wheatstone::Result<RecordBatch> {
        let of_rows = match &self.sigmas {
            Sigmas::Columns(columns) => Some(rows.pixel_sigmas(columns)?),
            _ => None,
        };
        let sigmas = match (&self.sigmas, &of_rows) {
            (Sigmas::One(sigma), _) => Some(PixelSigmas::One(*sigma)),
            (_, Some(own)) => Some(PixelSigmas::Each(own.iter().map(Vec::as_slice).collect())),
            _ => None,
        };
        self.ready.locator().locate_noisy_into(&rows.pixels(), sigmas.as_ref(), &mut self.found);
        self.appended.append(rows.batch(), &rows.pixels(), &mut self.found)
    }
}

impl Iterator for Located {
    type Item = Result<RecordBatch, ArrowError>;

    fn next(&mut self) -> Option<Self::Item> {
        let outside = |e: wheatstone::Error| ArrowError::ExternalError(Box::new(e));
        let rows = match self.rows.next_rows() {
            Ok(rows) => rows?,
            Err(e) => return Some(Err(outside(e))),
        };
        let pool = match pool() {
            Ok(pool) => pool,
            Err(e) => return Some(Err(ArrowError::ComputeError(e.to_string()))),
        };
        Some(pool.install(|| self.located(&rows)).map_err(outside))
    }
}

impl RecordBatchReader for Located {
    fn schema(&self) -> SchemaRef {
        self.schema.clone()
    }
}

#[pymethods]
impl PyModel {
    /// A reader of the same rows with points appended. `test` is the share of correct matches that may be called a
    /// mismatch, and the standard deviation of the pixels or the columns that have it, where it is known.
    fn locate_stream(
        &self,
        py: Python,
        table: AnyRecordBatch,
        covariance: bool,
        test: (f64, Option<Noise>),
        columns: Option<&str>,
    ) -> PyResult<PyRecordBatchReader> {
        let (false_alarm, noise) = test;
        let (appended, options) = options((covariance, false_alarm), self.cameras(), columns)?;
        let source: Box<dyn RecordBatchReader + Send> = table.into_reader()?;
        let schema = appended.schema(&source.schema());
        let rows = TableReader::of_batches(Path::new("table"), source, &options)
            .map_err(raised)?
            .lenient();
        self.needs(2 * rows.cameras())?;
        let sigmas = Sigmas::of(noise, &rows)?;
        let ready = py.detach(|| self.ready(true))?;
        let found = LocatedBatch::default();
        let located = Located { rows, ready, appended, sigmas, schema, found };
        Ok(PyRecordBatchReader::new(Box::new(located)))
    }

    /// The schema of what `locate_stream` gives for a table of this schema.
    fn located_schema(&self, schema: PySchema, covariance: bool) -> PySchema {
        let own: &Schema = schema.as_ref();
        PySchema::new(appended(covariance, 0.001, self.cameras()).schema(own))
    }
}
