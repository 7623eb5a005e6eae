//! Tables of points: matched pixels, with world coordinates where they are known.
//!
//! A header names the columns: `x1,y1,x2,y2[,x3,y3…]` pixels (empty or NaN: not seen by that camera),
//! `X,Y,Z` world, or `board_x,board_y` on a chart whose pose is unknown, optionally `view` and `id`.
//! Usual other names are understood (`u1`, `x_1`, `left_x`, `X_mm`), others are told by [`ColumnNames`];
//! columns that are none of these are passed over. Text with commas, semicolons or tabs, gzipped or not,
//! Parquet and Arrow files are read and written; record batches of Arrow are read as they are.

mod arrow_lengths;
mod cells;
mod collected;
mod columnar;
mod head;
mod layout;
mod lines;
mod located;
mod marks;
mod names;
mod numbers;
mod numpy;
mod parquet_checksums;
mod parquet_lengths;
mod points;
mod reader;
mod rounding;
mod rows;
mod shown;
mod sigmas;
mod text;
mod thrift;
mod writer;

pub use collected::Duplicates;
pub use located::LocatedColumns;
pub use names::ColumnNames;
pub(crate) use numpy::{MAGIC, cameras, matrix};
pub(crate) use points::encode_in;
pub use points::{encode, read, read_bytes, read_with, save, write};
pub use reader::{TableOptions, TableReader};
pub use rounding::{is_text, round_to_sigma};
pub use rows::Rows;
pub use sigmas::SigmaColumns;
pub use writer::{TableStyle, TableWriter};

pub use arrow_array::{
    Array, ArrayRef, Float64Array, RecordBatch, RecordBatchIterator, RecordBatchReader, StringArray,
};
pub use arrow_schema::{ArrowError, DataType, Field, Schema, SchemaRef};

/// Arrow's own crates, of the release whose types are in the signatures.
pub use {arrow_array, arrow_schema};
