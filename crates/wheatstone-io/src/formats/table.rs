//! The project's own table of points, as CSV.

use super::{Content, Format, Given, InputFile, Layout, OutputFile};
use crate::tables::{self, Duplicates, PointsReader};
use wheatstone_core::{Result, dataset::Dataset};

pub(super) const FORMAT: Format = Format {
    name: "csv",
    about: "x1,y1,x2,y2,…,X,Y,Z, view, id: what `fit`, `locate` and the other verbs read",
    layout: Layout::File("csv"),
    content: Content::Points { read: Some(read), write: Some(write) },
};

fn read(files: &[InputFile], given: &Given) -> Result<Dataset> {
    let file = &files[0];
    let source = Box::new(std::io::Cursor::new(file.bytes.clone()));
    let reader = PointsReader::new(&file.path, source)?;
    tables::read_from(reader, given.unit(), Duplicates::Keep)
}

fn write(data: &Dataset, _given: &Given) -> Result<Vec<OutputFile>> {
    Ok(vec![OutputFile::only(tables::write(data))])
}
