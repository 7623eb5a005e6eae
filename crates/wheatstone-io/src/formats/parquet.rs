//! The project's own table of points, as Parquet.

use super::{Content, Format, Layout, OutputFile};
use crate::tables;

pub(super) const FORMAT: Format = Format {
    name: "parquet",
    about: "the same table as Parquet (columns x1 y1 x2 y2 … X Y Z view id), null where unknown",
    layout: Layout::File("parquet"),
    content: Content::Points {
        read: Some(|files, given| {
            tables::read_parquet(&files[0].path, files[0].bytes.clone(), given.unit())
        }),
        write: Some(|data, _| {
            Ok(vec![OutputFile { name: String::new(), bytes: tables::write_parquet(data)? }])
        }),
    },
};
