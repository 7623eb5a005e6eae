//! Small files that ask for much, and large ones that are honest: within little memory.

use crate::program::{command, done, said};
use parquet::{
    arrow::ArrowWriter,
    basic::Compression,
    file::{
        properties::WriterProperties,
        reader::{FileReader, SerializedFileReader},
    },
};
use std::{
    fs::{self, File},
    io::Write,
    path::Path,
    process::{Command, Output, Stdio},
    sync::Arc,
};
use wheatstone::{
    numeric::random::Random,
    tables::{
        ArrayRef, Float64Array, RecordBatch, StringArray,
        arrow_schema::{DataType, Field, Schema},
    },
};

/// What a process may take of addresses, in kilobytes; threads and their arenas take 300 MB that they never fill.
const ADDRESSES: u32 = 900_000;
/// The C library makes another arena of 64 MB of addresses whenever threads meet in one: how many would be chance.
const ARENAS: u32 = 4;

/// Runs the program with little memory.
pub(crate) fn bounded(at: &Path, arguments: &str) -> Output {
    let program = env!("CARGO_BIN_EXE_wheatstone");
    let line = format!("ulimit -v {ADDRESSES} && exec {program} {arguments}");
    let mut shell = Command::new("sh");
    shell.env("MALLOC_ARENA_MAX", ARENAS.to_string());
    let output = shell.args(["-c", &line]).current_dir(at).stdin(Stdio::null()).output().unwrap();
    let told = said(&output);
    assert!(
        !told.contains("panicked") && !told.contains("memory allocation"),
        "{arguments}: {told}"
    );
    assert!(output.status.code().is_some(), "{arguments}: {:?}", output.status);
    output
}

fn refused(at: &Path, arguments: &str, words: &str) {
    let output = bounded(at, arguments);
    assert_eq!(output.status.code(), Some(1), "{arguments}: {}", said(&output));
    assert!(said(&output).contains(words), "{arguments}: {}", said(&output));
}

/// A table whose last column repeats one long text: some kilobytes that unpack to gigabytes.
fn long_texts(
    path: &Path,
    packing: Compression,
    is_dictionary: bool,
    (text, rows): (usize, usize),
) {
    let number = |value: f64| Arc::new(Float64Array::from(vec![value; rows])) as ArrayRef;
    let long = "a".repeat(text);
    let mut columns: Vec<ArrayRef> = (0..4).map(|column| number(f64::from(column))).collect();
    columns.push(Arc::new(StringArray::from_iter_values(std::iter::repeat_n(long, rows))));
    let names = ["x1", "y1", "x2", "y2", "note"];
    let fields: Vec<Field> = names
        .iter()
        .zip(&columns)
        .map(|(name, column)| Field::new(*name, column.data_type().clone(), true))
        .collect();
    assert_eq!(fields[4].data_type(), &DataType::Utf8);
    let batch = RecordBatch::try_new(Arc::new(Schema::new(fields)), columns).unwrap();
    let properties = WriterProperties::builder()
        .set_compression(packing)
        .set_dictionary_enabled(is_dictionary)
        .build();
    let file = File::create(path).unwrap();
    let mut writer = ArrowWriter::try_new(file, batch.schema(), Some(properties)).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
}

fn model(at: &Path) {
    done(at, &["synth", "--points", "--count", "100", "-o", "points.csv"]);
    done(at, &["fit", "points.csv", "--method", "dlt", "-o", "model.json"]);
}

#[test]
fn long_texts_are_unpacked_bit_by_bit() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    model(at);
    // Some kilobytes that are 1.3 gigabytes.
    for is_dictionary in [true, false] {
        let packing = Compression::ZSTD(Default::default());
        long_texts(&at.join("bomb.parquet"), packing, is_dictionary, (1 << 16, 20_000));
        assert!(fs::metadata(at.join("bomb.parquet")).unwrap().len() < 1_000_000);
        let output = bounded(at, "locate model.json bomb.parquet -o out.parquet");
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    }
    let output = bounded(at, "check bomb.parquet");
    assert_ne!(output.status.code(), Some(0), "there are no places in it");
}

#[test]
fn a_page_that_lies_about_its_size_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    model(at);
    for packing in [Compression::GZIP(Default::default()), Compression::ZSTD(Default::default())] {
        let path = at.join("lies.parquet");
        long_texts(&path, packing, false, (1000, 1000));
        let read = |name: &str| bounded(at, &format!("locate model.json {name} -o out.csv"));
        assert_eq!(read("lies.parquet").status.code(), Some(0), "{packing}");
        let mut bytes = fs::read(&path).unwrap();
        let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
        let place = reader.metadata().row_group(0).column(4).data_page_offset() as usize;
        // After the page's kind: the size that it unpacks to, seven bits a byte.
        assert_eq!(bytes[place..place + 3], [0x15, 0, 0x15]);
        let length = 1 + bytes[place + 3..].iter().position(|byte| *byte < 0x80).unwrap();
        bytes[place + 3..place + 2 + length].fill(0x80);
        bytes[place + 3] |= 0x40;
        bytes[place + 2 + length] = 0;
        fs::write(at.join("lies.parquet"), bytes).unwrap();
        let output = read("lies.parquet");
        assert_eq!(output.status.code(), Some(1), "{packing}: {}", said(&output));
        let is_named = said(&output).contains("larger than its header says");
        assert!(is_named || packing != Compression::GZIP(Default::default()), "{}", said(&output));
    }
}

#[test]
fn what_never_ends_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    model(at);
    // No line end; a quotation mark that is never closed.
    for (beginning, rest) in [("", "\0"), ("x1,y1,x2,y2\n\"", "a\n"), ("x1,y1,x2,y2\n", "1")] {
        let mut child = command(at, &["locate", "model.json", "-", "-o", "out.csv"])
            .stdin(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut input = child.stdin.take().unwrap();
        let block = rest.repeat((1 << 20) / rest.len());
        let mut written = input.write_all(beginning.as_bytes());
        let mut megabytes = 0;
        while written.is_ok() && megabytes < 200 {
            written = input.write_all(block.as_bytes());
            megabytes += 1;
        }
        drop(input);
        assert!(megabytes < 100, "{beginning:?} {rest:?}: it reads on and on");
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        assert!(said(&output).contains("bytes of a row"), "{}", said(&output));
        assert!(said(&output).contains("--limits 10"), "{}", said(&output));
    }
}

#[test]
fn too_many_columns_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let header = |cameras: usize| -> String {
        let names: Vec<String> = (1..=cameras).map(|c| format!("x{c},y{c}")).collect();
        format!("{}\n", names.join(","))
    };
    fs::write(at.join("columns.csv"), header(100_000)).unwrap();
    refused(at, "check columns.csv", "more than 10000 columns");
    fs::write(at.join("cameras.csv"), header(3000)).unwrap();
    refused(at, "check cameras.csv", "more than 1000 cameras");
    let output = bounded(at, "check cameras.csv --limits 5");
    assert!(!said(&output).contains("limit"), "{}", said(&output));
}

#[test]
fn pictures_are_measured_before_they_are_decoded() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let chart =
        "unit = \"mm\"\n[chart]\ntype = \"chessboard\"\ncolumns = 9\nrows = 6\npitch = 30.0\n";
    let capture = format!("{chart}[cameras]\nleft = \"left.bmp\"\nright = \"right.bmp\"\n");
    fs::write(at.join("capture.toml"), capture).unwrap();
    // The header of a picture of 20 000 x 20 000 pixels, and nothing behind it.
    let mut header = b"BM".to_vec();
    header.extend([0; 8]);
    header.extend(54_u32.to_le_bytes());
    header.extend(40_u32.to_le_bytes());
    header.extend(20_000_i32.to_le_bytes());
    header.extend(20_000_i32.to_le_bytes());
    header.extend(1_u16.to_le_bytes());
    header.extend(24_u16.to_le_bytes());
    header.extend([0; 24]);
    for name in ["left.bmp", "right.bmp"] {
        fs::write(at.join(name), &header).unwrap();
    }
    refused(at, "detect .", "20000 x 20000 pixels; the limit is 16384");
}

#[test]
fn many_views_are_examined_within_little_memory() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    // A board of forty points, at a thousand places.
    let mut text = String::from("x1,y1,x2,y2,X,Y,Z,view\n");
    let mut random = Random::new(1);
    for view in 0..1000 {
        let z = 500.0 + f64::from(view % 400);
        let shift = [random.uniform(-40.0, 40.0), random.uniform(-40.0, 40.0)];
        for point in 0..40 {
            let x = f64::from(point % 8 - 4) * 20.0 + shift[0];
            let y = f64::from(point / 8 - 2) * 20.0 + shift[1];
            let mut pixel = |value: f64| 1000.0 * value / z + 500.0 + 0.1 * random.normal();
            let pixels = [x + 50.0, y, x - 50.0, y].map(&mut pixel).map(|p| format!("{p:.3}"));
            text += &format!("{},{x},{y},{z},{view}\n", pixels.join(","));
        }
    }
    fs::write(at.join("many.csv"), text).unwrap();
    let output = bounded(at, "check many.csv");
    assert!(said(&output).contains("No fault found"), "{}", said(&output));
}
