//! The project's own table of points, as text, Parquet and Arrow.

use super::{Content, Format, Given, InputFile, Layout, OutputFile};
use crate::tables::{self, Duplicates, TableOptions};
use std::path::Path;
use wheatstone_core::{Result, dataset::Dataset};

pub(super) const TEXT: Format = Format {
    name: "csv",
    about: "x1,y1,x2,y2,…,X,Y,Z, view, id: what `fit`, `locate` and the other verbs read",
    layout: Layout::File("csv"),
    content: Content::Points {
        read: Some(read),
        write: Some(|data, _| written(data, "points.csv")),
    },
};

pub(super) const PARQUET: Format = Format {
    name: "parquet",
    about: "the same table as Parquet (columns x1 y1 x2 y2 … X Y Z view id), null where unknown",
    layout: Layout::File("parquet"),
    content: Content::Points {
        read: Some(read),
        write: Some(|data, _| written(data, "points.parquet")),
    },
};

pub(super) const ARROW: Format = Format {
    name: "arrow",
    about: "the same table as an Arrow file, also known as Feather",
    layout: Layout::File("arrow"),
    content: Content::Points {
        read: Some(read),
        write: Some(|data, _| written(data, "points.arrow")),
    },
};

fn read(files: &[InputFile], given: &Given) -> Result<Dataset> {
    let options = TableOptions {
        columns: given.columns.clone(),
        unit: given.unit.clone(),
        duplicates: Duplicates::Keep,
        ..TableOptions::default()
    };
    tables::read_bytes(&files[0].path, files[0].bytes.clone(), &options)
}

fn written(data: &Dataset, name: &str) -> Result<Vec<OutputFile>> {
    Ok(vec![OutputFile { name: String::new(), bytes: tables::encode(data, Path::new(name))? }])
}
