//! Tables of text: comma-separated values and their kin.

use super::{
    cells,
    head::Head,
    layout::{Header, Layout},
    lines::Lines,
    marks::Marks,
    names::ColumnNames,
    numbers::Reading,
    rows::{Rows, Table},
};
use arrow_array::{ArrayRef, RecordBatch, builder::StringBuilder};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use csv::{ByteRecord, StringRecord};
use std::{io::Read, path::Path, sync::Arc};
use wheatstone_core::{Error, Result, limits, storage};

/// Reads a table of text, some rows at a time.
pub(super) struct TextTable {
    pub(super) table: Arc<Table>,
    rows: csv::Reader<Lines>,
    pub(super) delimiter: u8,
    /// What a comment line before the first row says of the unit.
    pub(super) unit: Option<String>,
    schema: SchemaRef,
    record: ByteRecord,
    marks: Marks,
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
        let first = lines.first(Head::is_whole);
        let first = first.map_err(|e| Error::reading(path, e))?.to_vec();
        storage::refuse_other_kinds(path, &first)?;
        let head = Head::of(&first);
        lines.watch_below(head.bytes);
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
            marks: Marks::default(),
            held: None,
        };
        if head.has_separator {
            table.next_record()?;
        }
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
        let marked: Vec<usize> = layout.numbers().filter(|_| comma).collect();
        let (mut lines, mut bytes) = (Vec::new(), 0);
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
                let value = cells::number(record[*column].trim(), comma)
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
            self.marks.look(&table, &marked, (&record, line))?;
            self.record = record.into_byte_record();
            lines.push(line);
        }
        self.refuse_late_unit()?;
        if lines.is_empty() {
            return Ok(None);
        }
        let arrays = texts.iter_mut().map(|text| Arc::new(text.finish()) as ArrayRef).collect();
        let batch = RecordBatch::try_new(Arc::clone(&self.schema), arrays)
            .map_err(|e| cells::malformed(path, None, e.to_string(), ""))?;
        let rows =
            Rows::new(Arc::clone(&table), batch, pixels.into_iter().map(Into::into).collect());
        Ok(Some(rows.of_lines(lines, self.marks.is_comma())))
    }

    /// Refuses a comment among the rows that were read so far which says a unit that the head does not.
    fn refuse_late_unit(&mut self) -> Result<()> {
        let late = self.rows.get_mut().late_units();
        let Table { path, layout, .. } = &*self.table;
        if !layout.has_lengths() {
            return Ok(());
        }
        let own = layout.unit.or(self.unit.as_deref());
        match late.into_iter().find(|(_, unit)| own != Some(unit)) {
            Some((line, unit)) => {
                let problem = format!("`# unit: {unit}` stands below the first row");
                let hint = "say the unit above the header: lengths were read before";
                Err(cells::malformed(path, Some(line), problem, hint))
            }
            None => Ok(()),
        }
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

#[cfg(test)]
mod tests {
    use crate::tables::{TableOptions, TableReader, read_bytes};
    use std::{fmt::Write, path::Path};
    use wheatstone_core::{Result, dataset::Dataset};

    fn read_in(text: &str, unit: Option<&str>) -> Result<Dataset> {
        let options = TableOptions { unit: unit.map(Into::into), ..TableOptions::default() };
        read_bytes(Path::new("t.csv"), text.into(), &options)
    }

    fn read(text: &str) -> Result<Dataset> {
        read_in(text, None)
    }

    fn refused(text: &str) -> String {
        read(text).unwrap_err().to_string()
    }

    #[test]
    fn a_table_has_one_decimal_mark() {
        let head = "x1;y1;x2;y2;X;Y;Z;note\n";
        let comma = "`81.455` has a decimal point, but `743,5` in line 2 a decimal comma";
        let rows = "743,5;1;2;3;81.455;4;5;\n";
        assert_eq!(refused(&format!("{head}{rows}")), format!("t.csv:2: {comma}"));
        let rows = "743.5;1;2;3;81,455;4;5;\n";
        assert!(refused(&format!("{head}{rows}")).contains("`81,455` has a decimal comma, but"));
        // What is no column of numbers may have whatever marks it likes.
        let rows = "743,5;1;2;3;81;4;5;1.5\n1,5;1;2;3;;;;n.a.\n";
        assert_eq!(
            read(&format!("{head}{rows}")).unwrap().correspondences[0].pixels[0].unwrap().x,
            743.5
        );
        assert!(
            refused(&format!("{head}1.234,5;1;2;3;4;5;6;\n")).contains("which is not a number")
        );
        // Rows come in batches; the first of these has commas alone.
        let mut text = head.to_owned();
        (0..40_000).for_each(|row| writeln!(text, "{row},5;1;2;3;4;5;6;").unwrap());
        text.push_str("7;1;2;3;4;5.5;6;\n");
        let said = refused(&text);
        assert!(
            said.starts_with("t.csv:40002: `5.5` has a decimal point, but `0,5` in line 2"),
            "{said}"
        );
    }

    #[test]
    fn a_first_line_for_excel_says_the_separator() {
        for text in [
            "sep=;\r\nx1;y1;x2;y2;X;Y;Z\r\n1,5;2;3;4;5;6;7\r\n",
            "\u{feff}sep=;\nx1;y1;x2;y2;X;Y;Z\n1,5;2;3;4;5;6;7\n",
            "SEP=,\nx1,y1,x2,y2,X,Y,Z\n1.5,2,3,4,5,6,7\n",
            "sep=|\n# unit: mm\nx1|y1|x2|y2|X|Y|Z\n1,5|2|3|4|5|6|7\n",
        ] {
            let data = read(text).unwrap();
            assert_eq!(data.correspondences[0].pixels[0].unwrap().x, 1.5, "{text}");
        }
        let said = refused("sep=;\nx1;y1;x2;y2;X;Y;Z\n1;2;3;4;5;6;right\n");
        assert!(said.starts_with("t.csv:3: column `Z` is `right`"), "{said}");
    }

    #[test]
    fn a_unit_below_the_rows_is_not_passed_over() {
        let table = |head: &str, tail: &str| {
            format!("{head}x1,y1,x2,y2,X,Y,Z,id\n1,2,3,4,5,6,7,#1\n{tail}8,2,3,4,5,6,7,#2\n")
        };
        let said = refused(&table("", "# unit: m\n"));
        assert_eq!(said, "t.csv:3: `# unit: m` stands below the first row");
        assert_eq!(refused(&table("# unit: cm\n", "\n# unit: m\n")), said.replace(":3", ":5"));
        assert_eq!(read(&table("# unit: m\n", "# unit: metres\n")).unwrap().unit, "m");
        assert_eq!(read(&table("", "# from the left\n")).unwrap().correspondences.len(), 2);
        assert!(read("x1,y1,x2,y2\n1,2,3,4\n# unit: m\n").is_ok());
        assert!(refused("x1,y1,x2,y2,X,Y,Z\n1,2,3,4,5,6,7\n# unit: m").contains(":3: "));
        // Lines are counted in what was given on, too.
        let mut text = String::from("x1,y1,x2,y2,X,Y,Z\n");
        (0..40_000).for_each(|row| writeln!(text, "{row},1,2,3,4,5,6").unwrap());
        assert!(refused(&(text + "# unit: m\n")).starts_with("t.csv:40002: "));
    }

    #[test]
    fn units_stand_in_names_with_and_without_a_preposition() {
        for (header, unit) in [
            ("X in cm,Y in cm,Z in cm", "cm"),
            ("X_in_cm,Y_in_cm,Z_in_cm", "cm"),
            ("X in,Y in,Z in", "in"),
            ("X in in,Y in in,Z in in", "in"),
            ("X [km],Y [km],Z [km]", "km"),
        ] {
            let data =
                read(&format!("x1 in px,y1 in px,x2 in px,y2 in px,{header}\n1,2,3,4,5,6,7\n"));
            assert_eq!(data.unwrap().unit, unit, "{header}");
        }
        let note = |header: &str| {
            let text = format!("x1,y1,x2,y2,{header}\n1,2,3,4,5,6,7\n");
            TableReader::of_bytes(Path::new("t.csv"), text.into(), &TableOptions::default())
                .unwrap()
                .note()
        };
        let told = "`X`, `Y` are taken to be in cm, as `Z [cm]` says";
        assert_eq!(note("X,Y,Z [cm]").as_deref(), Some(told));
        assert_eq!((note("X,Y,Z"), note("X_cm,Y_cm,Z_cm")), (None, None));
    }

    #[test]
    fn pixels_are_no_unit_of_lengths() {
        let row = "x1,y1,x2,y2,X,Y,Z\n1,2,3,4,5,6,7\n";
        for unit in ["px", "Pixels", "deg"] {
            assert!(refused(&format!("# unit: {unit}\n{row}")).contains("for the unit of lengths"));
            let error = read_in(row, Some(unit)).unwrap_err().to_string();
            assert_eq!(error, format!("the unit of lengths cannot be `{unit}`"));
        }
        assert!(read("# unit: px\nx1,y1,x2,y2\n1,2,3,4\n").is_ok());
        assert_eq!(read(&format!("# unit: cubit\n{row}")).unwrap().unit, "cubit");
    }
}
