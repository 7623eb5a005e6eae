//! Tables of text: comma-separated values and their kin.

use super::{
    cells,
    layout::{Header, Layout},
    lines::Lines,
    names::ColumnNames,
    numbers::Reading,
    rows::{Rows, Table},
};
use arrow_array::{ArrayRef, RecordBatch, builder::StringBuilder};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use csv::{ByteRecord, StringRecord};
use std::{io::Read, path::Path, sync::Arc};
use wheatstone_core::{Error, Result, limits, storage, unit};

/// Reads a table of text, some rows at a time.
pub(super) struct TextTable {
    pub(super) table: Arc<Table>,
    rows: csv::Reader<Lines>,
    pub(super) delimiter: u8,
    /// What a comment line before the first row says of the unit.
    pub(super) unit: Option<String>,
    schema: SchemaRef,
    record: ByteRecord,
    /// The line of `record` where it was read and not passed on: the first row of a table without a header.
    held: Option<u64>,
}

impl TextTable {
    pub(super) fn new(
        path: &Path,
        source: Box<dyn Read + Send>,
        told: Option<&ColumnNames>,
    ) -> Result<Self> {
        let mut lines = Lines::new(source);
        let first = lines.first(|lines| split(lines).any(|line| !is_aside(line)));
        let first = first.map_err(|e| Error::reading(path, e))?.to_vec();
        storage::refuse_other_kinds(path, &first)?;
        let head = Head::of(&first);
        let rows = csv::ReaderBuilder::new()
            .delimiter(head.delimiter)
            .comment(Some(b'#'))
            .has_headers(false)
            .flexible(true)
            .buffer_capacity(1 << 16)
            .from_reader(lines);
        let mut table = Self {
            table: Arc::new(Table { path: path.into(), ..Table::default() }),
            rows,
            delimiter: head.delimiter,
            unit: head.unit,
            schema: Arc::new(Schema::empty()),
            record: ByteRecord::new(),
            held: None,
        };
        table.read_header(told, head.comment)?;
        let field = |name: &String| Field::new(name, DataType::Utf8, true);
        let fields: Vec<Field> = table.table.names.iter().map(field).collect();
        table.schema = Arc::new(Schema::new(fields));
        Ok(table)
    }

    /// Takes the first row for the header, or where it is numbers the names that were told, or a comment
    /// before it that names as many columns.
    fn read_header(
        &mut self,
        told: Option<&ColumnNames>,
        comment: Option<Vec<String>>,
    ) -> Result<()> {
        let first = self.next_record()?;
        let line = first.unwrap_or(1);
        let cells = self.text(line)?;
        let comma = self.delimiter != b',';
        let numbers =
            !cells.is_empty() && cells.iter().all(|cell| cells::number(cell, comma).is_ok());
        let headless = numbers && cells.iter().any(|cell| !cell.is_empty());
        let refuse = |problem: String, names: &[String]| {
            Header { path: &self.table.path, line: Some(line), names }.refuse(problem)
        };
        let names = match (told, comment) {
            (Some(ColumnNames::InOrder(names)), _) => {
                if names.len() != cells.len() {
                    let problem = format!("{} columns, {} were named", cells.len(), names.len());
                    return Err(refuse(problem, &cells));
                }
                let unnamed = |(index, name): (usize, &String)| match name.as_str() {
                    "" => format!("column_{}", index + 1),
                    name => name.to_owned(),
                };
                names.iter().enumerate().map(unnamed).collect()
            }
            (_, Some(names)) if headless && names.len() == cells.len() => names,
            _ if headless => return Err(refuse("the header is missing".into(), &cells)),
            _ => cells,
        };
        self.held = first.filter(|_| headless);
        let path = self.table.path.clone();
        let header = Header { path: &path, line: Some(line), names: &names };
        let layout = Layout::of(&header, told)?;
        self.table =
            Arc::new(Table { path, names, layout, reading: Reading { comma, lenient: false } });
        Ok(())
    }

    /// The next rows, at most so many; with `prompt` those that have come.
    pub(super) fn next_rows(&mut self, most: usize, prompt: bool) -> Result<Option<Rows>> {
        let table = Arc::clone(&self.table);
        let Table { path, names, layout, reading } = &*table;
        let (columns, comma) = (names.len(), reading.comma);
        let mut texts: Vec<StringBuilder> = (0..columns).map(|_| StringBuilder::new()).collect();
        let numbers: Vec<usize> = layout.pixels.iter().flatten().copied().collect();
        let mut pixels: Vec<Vec<f64>> = vec![Vec::with_capacity(most); numbers.len()];
        let (mut lines, mut decimal_comma) = (Vec::new(), false);
        let mut bytes = 0;
        while lines.len() < most && bytes < limits::BATCH_BYTES.most() {
            if prompt && !lines.is_empty() && self.waits() {
                break;
            }
            let Some(line) =
                self.held.take().map_or_else(|| self.next_record(), |at| Ok(Some(at)))?
            else {
                break;
            };
            if self.record.len() != columns {
                return Err(cells::unequal(path, line, (self.record.len(), columns), !comma));
            }
            bytes += self.record.as_slice().len() as u64;
            let record = StringRecord::from_byte_record(std::mem::take(&mut self.record))
                .map_err(|_| cells::no_text(path, line))?;
            for (builder, cell) in texts.iter_mut().zip(&record) {
                let cell = cell.trim();
                builder.append_option((!cell.is_empty()).then_some(cell));
            }
            for (values, column) in pixels.iter_mut().zip(&numbers) {
                let cell = record[*column].trim();
                decimal_comma |= comma && cell.contains(',');
                let value = cells::number(cell, comma)
                    .map_err(|fault| fault.at(path, Some(line), &names[*column]))?;
                values.push(value.unwrap_or(f64::NAN));
            }
            for (pair, columns) in pixels.chunks_exact(2).zip(&layout.pixels) {
                let empty =
                    [0, 1].map(|axis| pair[axis].last().is_some_and(|value| value.is_nan()));
                if empty[0] != empty[1] {
                    let name = &names[columns[usize::from(empty[1])]];
                    return Err(cells::half().at(path, Some(line), name));
                }
            }
            self.record = record.into_byte_record();
            lines.push(line);
        }
        if lines.is_empty() {
            return Ok(None);
        }
        let arrays = texts.iter_mut().map(|text| Arc::new(text.finish()) as ArrayRef).collect();
        let batch = RecordBatch::try_new(Arc::clone(&self.schema), arrays)
            .map_err(|e| cells::malformed(path, None, e.to_string(), ""))?;
        let rows =
            Rows::new(Arc::clone(&table), batch, pixels.into_iter().map(Into::into).collect());
        Ok(Some(rows.of_lines(lines, decimal_comma)))
    }

    /// Reads the next row into `record`; its line, none at the end.
    fn next_record(&mut self) -> Result<Option<u64>> {
        let read =
            self.rows.read_byte_record(&mut self.record).map_err(|e| match e.into_kind() {
                csv::ErrorKind::Io(e) => Error::reading(&self.table.path, e),
                other => cells::malformed(&self.table.path, None, format!("{other:?}"), ""),
            })?;
        if !read {
            return Ok(None);
        }
        self.rows.get_mut().end_row();
        // The reader counts from where it began to look, which empty lines and comments may follow: the
        // end of a row tells its line.
        let end = self.rows.position();
        let within = self.record.as_slice().iter().filter(|byte| **byte == b'\n').count() as u64;
        let closed = u64::from(self.rows.get_ref().ends_line(end.byte()));
        Ok(Some(end.line().saturating_sub(within + closed)))
    }

    fn waits(&self) -> bool {
        self.rows.get_ref().waits(self.rows.position().byte())
    }

    /// The cells of `record`.
    fn text(&self, line: u64) -> Result<Vec<String>> {
        let cell = |cell: &[u8]| match std::str::from_utf8(cell) {
            Ok(text) => Ok(text.trim().to_owned()),
            Err(_) => Err(cells::no_text(&self.table.path, line)),
        };
        self.record.iter().map(cell).collect()
    }
}

/// What the lines before the first row say.
struct Head {
    delimiter: u8,
    unit: Option<String>,
    /// The columns that the last comment before the first row may name, as NumPy writes a header.
    comment: Option<Vec<String>>,
}

impl Head {
    fn of(first: &[u8]) -> Self {
        let mut head = Self { delimiter: b',', unit: None, comment: None };
        let mut last = None;
        let mut lines = split(first);
        for line in lines.by_ref() {
            if !is_aside(line) {
                head.delimiter = delimiter(line);
                break;
            }
            head.note_unit(line);
            last = comment_text(line).or(last);
        }
        // Those behind the header count as well.
        lines.take_while(|line| is_aside(line)).for_each(|line| head.note_unit(line));
        head.comment = last.map(|text| {
            let cells = text.split(char::from(head.delimiter));
            cells.map(|cell| cell.trim().to_owned()).collect()
        });
        head
    }

    /// Reads `# unit: cm`.
    fn note_unit(&mut self, line: &[u8]) {
        let said = comment_text(line).and_then(|text| {
            let (key, value) = text.split_once([':', '='])?;
            let key = key.trim().to_lowercase();
            (key == "unit" || key == "units").then(|| unit::canonical(value).to_owned())
        });
        self.unit = said.or(self.unit.take());
    }
}

/// Lines, however they end.
fn split(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(|byte| matches!(byte, b'\n' | b'\r'))
}

/// Whether a line is empty or a comment.
fn is_aside(line: &[u8]) -> bool {
    line.is_empty() || line[0] == b'#'
}

fn comment_text(line: &[u8]) -> Option<String> {
    let text = line.strip_prefix(b"#")?;
    Some(String::from_utf8_lossy(text).trim_matches(['#', ' ', '\t']).to_owned())
}

/// The character that separates the cells of a line.
fn delimiter(line: &[u8]) -> u8 {
    let count = |wanted: u8| line.iter().filter(|byte| **byte == wanted).count();
    // Between semicolons or tabs commas may be decimal ones.
    let text = String::from_utf8_lossy(line);
    let numbers = |delimiter: u8| {
        let mut cells = text.split(char::from(delimiter));
        count(delimiter) > 0 && cells.all(|cell| cells::number(cell.trim(), true).is_ok())
    };
    let surely = [b';', b'\t'].into_iter().find(|delimiter| numbers(*delimiter));
    surely.unwrap_or_else(|| {
        let most = [b';', b'\t', b','].into_iter().max_by_key(|delimiter| count(*delimiter));
        most.unwrap_or(b',')
    })
}
