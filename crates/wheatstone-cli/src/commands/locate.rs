//! `wheatstone locate`.

use crate::failure::{Failure, Outcome};
use clap::Args;
use std::{
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};
use wheatstone::{
    Calibration, Error, dataset::points_file::PointsReader, geometry::Pixel, method::Located,
    method::locate_all, storage::Output,
};

/// Turn matched pixels into points in the world
#[derive(Args)]
#[command(after_help = "Examples:\n  wheatstone locate model.json pixels.csv -o points.csv\n  \
    producer | wheatstone locate model.json - | consumer\n\n\
    Appends X,Y,Z, sX,sY,sZ (one standard deviation, world units) and residual (pixels) to every row.\n\
    Rows that cannot be located keep their place, with empty cells. Columns of the input that have\n\
    one of these names go on as input_X and so on.")]
pub(crate) struct Locate {
    /// The model file
    model: PathBuf,
    /// A points file with columns x1,y1,x2,y2,…, or - for standard input
    points: PathBuf,
    /// Where the points go, or - for standard output
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: PathBuf,
}

/// Rows that are read, located and written at once: enough to occupy all cores, little to hold.
const ROWS_AT_ONCE: usize = 16_384;

/// What is appended to each row.
const COLUMNS: [&str; 7] = ["X", "Y", "Z", "sX", "sY", "sZ", "residual"];

impl Locate {
    pub(crate) fn run(self) -> Outcome {
        let model = Calibration::load(&self.model)?;
        let mut reader = PointsReader::open(&self.points)?;
        if reader.cameras() != model.reconstructor.cameras() {
            return Err(Error::Mismatch {
                what: "number of cameras",
                model: model.reconstructor.cameras().to_string(),
                data: reader.cameras().to_string(),
            }
            .into());
        }
        if self.output.as_os_str() == "-" {
            let mut out = BufWriter::with_capacity(1 << 18, std::io::stdout().lock());
            stream(&model, &mut reader, &mut out, Failure::Output)?;
            return out.flush().map_err(Failure::Output);
        }
        let mut out = Output::create(&self.output)?;
        let path = self.output.clone();
        stream(&model, &mut reader, &mut out, |source| writing(&path, source))?;
        Ok(out.commit()?)
    }
}

fn writing(path: &Path, source: std::io::Error) -> Failure {
    Error::Io { action: "write", path: path.into(), source }.into()
}

fn stream(
    model: &Calibration,
    reader: &mut PointsReader,
    out: &mut dyn Write,
    failed: impl Fn(std::io::Error) -> Failure,
) -> Outcome {
    let delimiter = reader.delimiter();
    let mut header: Vec<String> = reader
        .header()
        .iter()
        .map(|name| if COLUMNS.contains(&name) { format!("input_{name}") } else { name.into() })
        .collect();
    header.extend(COLUMNS.map(String::from));
    let mut writer =
        csv::WriterBuilder::new().delimiter(delimiter).buffer_capacity(1 << 18).from_writer(out);
    let as_io = |e: csv::Error| match e.into_kind() {
        csv::ErrorKind::Io(e) => e,
        other => std::io::Error::other(format!("{other:?}")),
    };
    writer.write_record(&header).map_err(|e| failed(as_io(e)))?;
    let mut records = vec![csv::StringRecord::new(); ROWS_AT_ONCE];
    loop {
        let mut pixels: Vec<Vec<Option<Pixel>>> = Vec::with_capacity(ROWS_AT_ONCE);
        for record in &mut records {
            if !reader.next(record)? {
                break;
            }
            pixels.push(reader.pixels(record)?);
        }
        let located = locate_all(&*model.reconstructor, &pixels);
        for (record, found) in records.iter().zip(&located) {
            for cell in record {
                writer.write_field(cell).map_err(|e| failed(as_io(e)))?;
            }
            writer.write_record(cells(found.as_ref())).map_err(|e| failed(as_io(e)))?;
        }
        if pixels.len() < ROWS_AT_ONCE {
            return writer.flush().map_err(failed);
        }
    }
}

/// The appended cells; empty where nothing was located or a figure does not exist.
fn cells(found: Option<&Located>) -> [String; 7] {
    let Some(found) = found else { return Default::default() };
    let sigma = found.covariance.diagonal().map(f64::sqrt);
    let values =
        [found.point.x, found.point.y, found.point.z, sigma.x, sigma.y, sigma.z, found.residual];
    values.map(|value| if value.is_finite() { value.to_string() } else { String::new() })
}
