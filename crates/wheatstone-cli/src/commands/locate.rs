//! `wheatstone locate`.

use crate::{
    failure::{Failure, Outcome},
    progress::Counter,
    voice::remark,
};
use clap::Args;
use std::{
    io::{BufWriter, IsTerminal, Write},
    path::{Path, PathBuf},
};
use wheatstone::{
    Calibration, Error,
    dataset::{points_file::PointsReader, volume::Trust},
    geometry::Pixel,
    method::{
        Located, locate_all,
        mismatch::{exchanged_cameras, is_mismatch, mismatched_share},
    },
    storage::Output,
};

/// Turn matched pixels into points in the world
#[derive(Args)]
#[command(after_help = "Examples:\n  wheatstone locate model.json pixels.csv -o points.csv\n  \
    producer | wheatstone locate model.json - | consumer\n\n\
    Appends to every row: X,Y,Z and sX,sY,sZ (one standard deviation), in world units; residual, in\n\
    pixels; trust, which is `inside` the space that the model was fitted to, its `edge`, or `outside`;\n\
    and mismatch, which is `yes` where the pixels do not show one point.\n\
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
    /// Append the covariance of X, Y, Z as well: cXX,cXY,cXZ,cYY,cYZ,cZZ
    #[arg(long)]
    covariance: bool,
    /// How often a true match may be called a mismatch
    #[arg(long, value_name = "RATE", default_value = "0.001", value_parser = rate)]
    false_alarm: f64,
}

/// A probability that leaves both answers possible.
fn rate(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if value > 0.0 && value < 1.0 { Ok(value) } else { Err("it lies between 0 and 1".into()) }
}

/// Rows that are read, located and written at once: enough to occupy all cores, little to hold.
const ROWS_AT_ONCE: usize = 16_384;

/// What is appended to each row.
const COLUMNS: [&str; 9] = ["X", "Y", "Z", "sX", "sY", "sZ", "residual", "trust", "mismatch"];

/// What is appended where the covariance is asked for.
const COVARIANCE: [&str; 6] = ["cXX", "cXY", "cXZ", "cYY", "cYZ", "cZZ"];

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
            self.stream(&model, &mut reader, &mut out, Failure::Output)?;
            return out.flush().map_err(Failure::Output);
        }
        let mut out = Output::create(&self.output)?;
        let path = self.output.clone();
        self.stream(&model, &mut reader, &mut out, |source| writing(&path, source))?;
        Ok(out.commit()?)
    }

    fn stream(
        &self,
        model: &Calibration,
        reader: &mut PointsReader,
        out: &mut dyn Write,
        failed: impl Fn(std::io::Error) -> Failure,
    ) -> Outcome {
        let delimiter = reader.delimiter();
        let header = self.header(reader.header().iter());
        let mut writer = csv::WriterBuilder::new()
            .delimiter(delimiter)
            .buffer_capacity(1 << 18)
            .from_writer(out);
        let as_io = |e: csv::Error| match e.into_kind() {
            csv::ErrorKind::Io(e) => e,
            other => std::io::Error::other(format!("{other:?}")),
        };
        writer.write_record(&header).map_err(|e| failed(as_io(e)))?;
        let mut first = true;
        let shows_rows = self.output.as_os_str() == "-" && std::io::stdout().is_terminal();
        let (mut counter, mut done) = (Counter::new(shows_rows), 0);
        let mut records = vec![csv::StringRecord::new(); ROWS_AT_ONCE];
        loop {
            let mut pixels: Vec<Vec<Option<Pixel>>> = Vec::with_capacity(ROWS_AT_ONCE);
            for record in &mut records {
                if !reader.next(record)? {
                    break;
                }
                pixels.push(reader.pixels(record)?);
            }
            if first {
                refuse_exchanged(model, &pixels, self.false_alarm)?;
                first = false;
            }
            let located = locate_all(&*model.reconstructor, &pixels);
            let trusted = model.volume.trust_all(&pixels);
            for (row, (record, found)) in records.iter().zip(&located).enumerate() {
                for cell in record {
                    writer.write_field(cell).map_err(|e| failed(as_io(e)))?;
                }
                let judged = found.as_ref().map(|found| {
                    let seen = pixels[row].iter().flatten().count();
                    (found, trusted[row], is_mismatch(found, seen, self.false_alarm))
                });
                writer.write_record(self.cells(judged)).map_err(|e| failed(as_io(e)))?;
            }
            done += pixels.len() as u64;
            counter.reach(done);
            if pixels.len() < ROWS_AT_ONCE {
                return writer.flush().map_err(failed);
            }
        }
    }

    /// The input's columns and the appended ones, each name once.
    fn header<'a>(&self, columns: impl Iterator<Item = &'a str>) -> Vec<String> {
        let covariance = if self.covariance { &COVARIANCE[..] } else { &[] };
        let appended = || COLUMNS.iter().chain(covariance);
        let free = |name: &str| {
            if appended().any(|own| *own == name) { format!("input_{name}") } else { name.into() }
        };
        columns.map(free).chain(appended().map(|name| (*name).into())).collect()
    }

    /// The appended cells; empty where nothing was located or a figure does not exist.
    fn cells(&self, judged: Option<(&Located, Trust, bool)>) -> Vec<String> {
        let count = COLUMNS.len() + if self.covariance { COVARIANCE.len() } else { 0 };
        let Some((found, trust, mismatch)) = judged else { return vec![String::new(); count] };
        let number = |value: f64| if value.is_finite() { value.to_string() } else { String::new() };
        let sigma = found.covariance.diagonal().map(f64::sqrt);
        let mut cells = Vec::with_capacity(count);
        cells.extend(found.point.iter().chain(sigma.iter()).map(|value| number(*value)));
        cells.push(number(found.residual));
        cells.push(trust.to_string());
        cells.push(if mismatch { "yes".into() } else { String::new() });
        if self.covariance {
            let places = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
            cells.extend(places.map(|place| number(found.covariance[place])));
        }
        cells
    }
}

/// Refuses pixels whose columns stand for other cameras than those of the model; warns where most do
/// not belong together anyway. The first rows speak for all.
pub(crate) fn refuse_exchanged(
    model: &Calibration,
    pixels: &[Vec<Option<Pixel>>],
    rate: f64,
) -> Outcome {
    const ROWS: usize = 512;
    let rows = &pixels[..pixels.len().min(ROWS)];
    if let Some((a, b)) = exchanged_cameras(&*model.reconstructor, rows, rate) {
        return Err(Error::Faulty {
            code: "cameras-swapped".into(),
            problem: format!(
                "the pixels do not belong together, but would with cameras {} and {} exchanged",
                a + 1,
                b + 1
            ),
            hint: "give the columns in the order of the cameras that the model was fitted to"
                .into(),
        }
        .into());
    }
    match mismatched_share(&*model.reconstructor, rows, rate) {
        Some(share) if share > 0.5 => remark!(
            "warning",
            "{:.0} % of the first {} points have pixels that do not show one point: is this the model of these cameras?",
            100.0 * share,
            rows.len()
        ),
        _ => {}
    }
    Ok(())
}

fn writing(path: &Path, source: std::io::Error) -> Failure {
    Error::Io { action: "write", path: path.into(), source }.into()
}
