//! Tables as they are read, whatever their kind.

use super::{
    cells::malformed,
    collected::Duplicates,
    columnar::{ColumnTable, in_memory},
    layout::Header,
    names::{ColumnNames, shared_unit},
    numpy,
    rows::{self, Rows},
    text::TextTable,
    writer::{Kind, TableStyle},
};
use arrow_array::{RecordBatchIterator, RecordBatchReader};
use flate2::read::MultiGzDecoder;
use std::{
    fs::File,
    io::{Cursor, Read, Seek},
    path::Path,
    sync::Arc,
};
use wheatstone_core::{Error, Result, limits, storage, unit};

/// How a table is read.
#[derive(Clone, Debug, Default)]
pub struct TableOptions {
    /// What is told of its columns, beside what their names say.
    pub columns: Option<ColumnNames>,
    /// The unit of lengths that is wanted: a table in another is converted, one that says none is in it.
    pub unit: Option<String>,
    /// What to do with rows that stand in it twice.
    pub duplicates: Duplicates,
    /// Whether rows are passed on as they come, however few.
    pub prompt: bool,
}

/// Reads a table of points, some rows at a time, in constant memory: text, gzipped or not, Parquet or Arrow; a NumPy
/// array is read whole.
pub struct TableReader {
    kind: Table,
    prompt: bool,
}

enum Table {
    Text(Box<TextTable>),
    Columns(ColumnTable),
}

impl TableReader {
    /// Opens a file, or standard input as text for `-`.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], or [`Error::Malformed`] where the columns' names do not tell two cameras' pixels.
    pub fn open(path: &Path, options: &TableOptions) -> Result<Self> {
        if path.as_os_str() == "-" {
            let source = Box::new(std::io::stdin());
            return Self::of_text(Path::new("standard input"), source, options);
        }
        let mut file = storage::open(path)?;
        let mut first = Vec::new();
        file.by_ref()
            .take(FIRST as u64)
            .read_to_end(&mut first)
            .map_err(|e| Error::reading(path, e))?;
        // A pipe cannot be read from its beginning again.
        if file.rewind().is_err() {
            return Self::of_text(path, Box::new(Cursor::new(first).chain(file)), options);
        }
        Self::of_kind(path, Sort::of(&first, path), file, options)
    }

    /// Reads what is held in memory; `name` stands for it in messages.
    ///
    /// # Errors
    ///
    /// As [`TableReader::open`].
    pub fn of_bytes(name: &Path, bytes: Vec<u8>, options: &TableOptions) -> Result<Self> {
        Self::of_kind(name, Sort::of(&bytes, name), Cursor::new(bytes), options)
    }

    /// Reads record batches that are in memory, or that another program hands over by Arrow's C interface; `name` stands
    /// for them in messages. Their schema's metadata may say the unit of lengths, under the key `unit`.
    ///
    /// # Errors
    ///
    /// As [`TableReader::open`].
    pub fn of_batches(
        name: &Path,
        batches: Box<dyn RecordBatchReader + Send>,
        options: &TableOptions,
    ) -> Result<Self> {
        let table = ColumnTable::batches(name, batches, options.columns.as_ref())?;
        Ok(Self { kind: Table::Columns(table), prompt: options.prompt })
    }

    /// Takes pixels and lengths that are none (out of range, text that is no number, one coordinate alone) for what was
    /// not seen, instead of ending with an error. Only tables of columns: rows then pass through whatever they hold.
    #[must_use]
    pub fn lenient(mut self) -> Self {
        if let Table::Columns(columns) = &mut self.kind {
            Arc::make_mut(&mut columns.table).reading.lenient = true;
        }
        self
    }

    fn of_kind<F: Source>(
        path: &Path,
        sort: Sort,
        file: F,
        options: &TableOptions,
    ) -> Result<Self> {
        let told = options.columns.as_ref();
        let table = match sort {
            Sort::Parquet => file.parquet(path, told)?,
            Sort::Arrow { stream } => ColumnTable::arrow(path, file, stream, told)?,
            Sort::Gzip => {
                return Self::of_text(path, Box::new(MultiGzDecoder::new(file)), options);
            }
            Sort::Text => return Self::of_text(path, Box::new(file), options),
            Sort::Numpy => array(path, file, told)?,
            Sort::OldFeather => {
                let problem = "a Feather file of version 1".into();
                let hint =
                    "write version 2, which is an Arrow file: `pyarrow.feather.write_feather` does";
                return Err(malformed(path, None, problem, hint));
            }
        };
        Ok(Self { kind: Table::Columns(table), prompt: options.prompt })
    }

    fn of_text(path: &Path, source: Box<dyn Read + Send>, options: &TableOptions) -> Result<Self> {
        let table = TextTable::new(path, source, options.columns.as_ref())?;
        Ok(Self { kind: Table::Text(Box::new(table)), prompt: options.prompt })
    }

    fn table(&self) -> &rows::Table {
        match &self.kind {
            Table::Text(text) => &text.table,
            Table::Columns(columns) => &columns.table,
        }
    }

    /// The columns' names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.table().names.iter().map(String::as_str)
    }

    /// Cameras whose pixels it has.
    #[must_use]
    pub fn cameras(&self) -> usize {
        self.table().layout.pixels.len()
    }

    /// The unit of its lengths, where it says one.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] where the names of the columns and what is said elsewhere differ, or what is said is no unit
    /// of lengths.
    pub fn unit(&self) -> Result<Option<String>> {
        let said = match &self.kind {
            Table::Text(text) => &text.unit,
            Table::Columns(columns) => &columns.unit,
        };
        let other = said.as_deref().filter(|said| unit::is_of_other_kind(said));
        if let (Some(said), true) = (other, self.table().layout.has_lengths()) {
            let problem = format!("`{said}` is given for the unit of lengths");
            let hint = "give a unit of X, Y, Z, such as mm; pixels need none";
            return Err(malformed(self.path(), None, problem, hint));
        }
        match (self.table().layout.unit, said) {
            (Some(named), Some(said)) if named != said => Err(Error::Malformed {
                path: self.path().into(),
                line: None,
                problem: format!(
                    "the column names give lengths in `{named}`, but the table gives `{said}`"
                ),
                hint:
                    "give one unit: in the column names, in a comment, or in the metadata of the file"
                        .into(),
            }),
            (named, said) => Ok(named.map(str::to_owned).or_else(|| said.clone())),
        }
    }

    /// What the user should know of how the columns were understood: lengths without a unit in their names are
    /// taken to be in the unit that the names of others say.
    #[must_use]
    pub fn note(&self) -> Option<String> {
        let table = self.table();
        let layout = &table.layout;
        let lengths: Vec<&str> = (layout.world.iter().flatten())
            .chain(layout.board.iter().flatten())
            .map(|column| table.names[*column].as_str())
            .collect();
        shared_unit(&lengths)
    }

    /// Whether it has lengths, in the world or on a board, and nothing in it says their unit.
    #[must_use]
    pub fn lacks_unit(&self) -> bool {
        self.table().layout.has_lengths() && matches!(self.unit(), Ok(None))
    }

    /// A style in which rows go on as they came.
    #[must_use]
    pub fn style(&self) -> TableStyle {
        match &self.kind {
            Table::Text(text) => TableStyle {
                delimiter: text.delimiter,
                unit: text.unit.clone(),
                unit_comment: text.unit.is_some(),
            },
            Table::Columns(columns) => {
                TableStyle { unit: columns.unit.clone(), ..TableStyle::default() }
            }
        }
    }

    /// Says that points are missing, and which columns there are, where neither the world's nor a board's are.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`].
    pub fn needs_points(&self) -> Result<()> {
        let table = self.table();
        if table.layout.has_lengths() {
            return Ok(());
        }
        Err(Header { path: &table.path, line: None, names: &table.names }.no_points())
    }

    pub(super) fn path(&self) -> &Path {
        &self.table().path
    }

    /// The next rows, some thousands at most; none at the end.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], or [`Error::Malformed`] naming line, column and what was seen.
    pub fn next_rows(&mut self) -> Result<Option<Rows>> {
        // Enough to occupy all cores, little to hold.
        const CELLS: usize = 1 << 17;
        let most = (CELLS / self.table().names.len().max(1)).clamp(1, 1 << 14);
        match &mut self.kind {
            Table::Text(text) => text.next_rows(most, self.prompt),
            Table::Columns(columns) => columns.next_rows(most),
        }
    }
}

/// Bytes that tell the kind of a file.
const FIRST: usize = 6;

/// Kinds of files, by their first bytes.
enum Sort {
    Text,
    Gzip,
    Parquet,
    Arrow { stream: bool },
    Numpy,
    OldFeather,
}

impl Sort {
    fn of(first: &[u8], path: &Path) -> Self {
        match (&first[..first.len().min(FIRST)], Kind::of(path)) {
            ([b'P', b'A', b'R', b'1', ..], _) | (_, Kind::Parquet) => Self::Parquet,
            ([b'A', b'R', b'R', b'O', b'W', b'1', ..], _) => Self::Arrow { stream: false },
            ([0xFF, 0xFF, 0xFF, 0xFF, ..], _) => Self::Arrow { stream: true },
            ([0x1F, 0x8B, ..], _) => Self::Gzip,
            (b"\x93NUMPY", _) => Self::Numpy,
            ([b'F', b'E', b'A', b'1', ..], _) => Self::OldFeather,
            (_, Kind::Arrow) => Self::Arrow { stream: false },
            _ => Self::Text,
        }
    }
}

/// A matrix of NumPy's, whose columns have the names that their number tells.
fn array(path: &Path, file: impl Read, told: Option<&ColumnNames>) -> Result<ColumnTable> {
    let limit = limits::FILE_BYTES;
    let mut bytes = Vec::new();
    let mut whole = file.take(limit.most().saturating_add(1));
    whole.read_to_end(&mut bytes).map_err(|e| Error::reading(path, e))?;
    limit.allow(path, bytes.len() as u64)?;
    let batch = numpy::table(path, &bytes)?;
    let schema = batch.schema();
    ColumnTable::batches(path, Box::new(RecordBatchIterator::new([Ok(batch)], schema)), told)
}

/// Where a table comes from.
trait Source: Read + Seek + Send + 'static + Sized {
    fn parquet(self, path: &Path, told: Option<&ColumnNames>) -> Result<ColumnTable>;
}

impl Source for File {
    fn parquet(self, path: &Path, told: Option<&ColumnNames>) -> Result<ColumnTable> {
        ColumnTable::parquet(path, self, told)
    }
}

impl Source for Cursor<Vec<u8>> {
    fn parquet(self, path: &Path, told: Option<&ColumnNames>) -> Result<ColumnTable> {
        ColumnTable::parquet(path, in_memory(self.into_inner()), told)
    }
}
