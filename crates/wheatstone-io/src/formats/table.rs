//! The project's own table of points, as text, Parquet and Arrow.

use super::{Content, Format, Given, InputFile, Layout, OutputFile};
use crate::tables::{self, Duplicates, TableOptions, TableReader};
use std::path::Path;
use wheatstone_core::{Result, dataset::Dataset};

/// The names of these formats.
pub(super) const NAMES: [&str; 3] = [TEXT.name, PARQUET.name, ARROW.name];

pub(super) const TEXT: Format = Format {
    name: "csv",
    about: "x1,y1,x2,y2,…,X,Y,Z, view, id: what `fit`, `locate` and the other verbs read",
    layout: Layout::File("csv"),
    content: Content::Points {
        read: Some(read),
        write: Some(|data, given| written(data, given, "points.csv")),
        known_only: false,
    },
};

pub(super) const PARQUET: Format = Format {
    name: "parquet",
    about: "the same table as Parquet (columns x1 y1 x2 y2 … X Y Z view id), null where unknown",
    layout: Layout::File("parquet"),
    content: Content::Points {
        read: Some(read),
        write: Some(|data, given| written(data, given, "points.parquet")),
        known_only: false,
    },
};

pub(super) const ARROW: Format = Format {
    name: "arrow",
    about: "the same table as an Arrow file, also known as Feather",
    layout: Layout::File("arrow"),
    content: Content::Points {
        read: Some(read),
        write: Some(|data, given| written(data, given, "points.arrow")),
        known_only: false,
    },
};

fn options(given: &Given) -> TableOptions {
    TableOptions {
        columns: given.columns.clone(),
        unit: given.unit.clone(),
        duplicates: Duplicates::Keep,
        ..TableOptions::default()
    }
}

fn read(files: &[InputFile], given: &Given) -> Result<Dataset> {
    tables::read_bytes(&files[0].path, files[0].bytes.clone(), &options(given))
}

/// The unit that a table says itself.
pub(super) fn unit(file: &InputFile, given: &Given) -> Result<Option<String>> {
    TableReader::of_bytes(&file.path, file.bytes.clone(), &options(given))?.unit()
}

/// A unit that nobody said is not written: who reads the table may know it.
fn written(data: &Dataset, given: &Given, name: &str) -> Result<Vec<OutputFile>> {
    let bytes = tables::encode_in(data, Path::new(name), given.unit.clone())?;
    Ok(vec![OutputFile { name: String::new(), bytes }])
}
